//! A guess as good as it serves conjugate gradients: the residual after a few of their iterations, and its gradient.
//!
//! Neither the distance to the exact solution nor the first residual says how many iterations a start will need: these
//! methods are quick with some errors and slow with others. The loss runs them instead, and measures what is left in
//! the norm of their stopping rule,
//!
//! ```text
//! loss = ln (r^T M^-1 r / b^T M^-1 b),   r = b - A x after `steps` iterations from x_0.
//! ```

use jointed::linear::operator::Operator;
use jointed::linear::precondition::Preconditioner;
use jointed::system::System;
use jointed::topology::Topology;
use kernels::Spatial;
use kernels::dispatch::vectorized;

/// What is left, squared and relative to b, of a system that counts as solved.
const SOLVED: f64 = 1e-24;

/// The loss of starts for systems of one connectivity: its memory. Calls allocate nothing.
pub struct CgLoss {
    operator: Operator,
    preconditioner: Preconditioner,
    /// The iterations, and what they end with.
    steps: Vec<Step>,
    /// Residual r; going back, the gradient with respect to it.
    residual: Vec<Spatial<f64>>,
    /// Going back: the gradient with respect to p.
    by_direction: Vec<Spatial<f64>>,
    /// A product with a matrix.
    product: Vec<Spatial<f64>>,
}

/// What going back needs of an iteration; vectors have one entry a joint.
#[derive(Clone, Debug)]
struct Step {
    /// z = M^-1 r.
    preconditioned: Vec<Spatial<f64>>,
    /// p.
    direction: Vec<Spatial<f64>>,
    /// A p.
    image: Vec<Spatial<f64>>,
    /// r^T z.
    squared: f64,
    /// p^T A p.
    curvature: f64,
}

#[inline(always)]
fn dot(a: &[Spatial<f64>], b: &[Spatial<f64>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}

/// `x += k y`
#[inline(always)]
fn add(x: &mut [Spatial<f64>], y: &[Spatial<f64>], k: f64) {
    for (x, y) in x.iter_mut().zip(y) {
        *x = x.plus(*y, k);
    }
}

impl CgLoss {
    /// Memory for systems of this connectivity and `steps` iterations with the preconditioner M.
    pub fn new(topology: &Topology, preconditioner: Preconditioner, steps: usize) -> Self {
        let zero = vec![Spatial::zero(); topology.joints.len()];
        let step = Step {
            preconditioned: zero.clone(),
            direction: zero.clone(),
            image: zero.clone(),
            squared: 0.0,
            curvature: 0.0,
        };
        Self {
            operator: Operator::new(topology),
            preconditioner,
            steps: vec![step; steps + 1],
            residual: zero.clone(),
            by_direction: zero.clone(),
            product: zero,
        }
    }

    /// The loss of `start`, one entry a joint, and its gradient with respect to it.
    ///
    /// Where there is nothing to solve or the iterations solve it, the loss is ln 1e-24; where the start is so far off
    /// that its residual is not finite, infinity: both have the gradient 0. Iterations end early where the curvature is
    /// not positive.
    pub fn value_and_gradient(
        &mut self,
        system: &System<f64>,
        start: &[Spatial<f64>],
        gradient: &mut [Spatial<f64>],
    ) -> f64 {
        vectorized(
            #[inline(always)]
            || {
                let (value, count) = self.iterate(system, start);
                match count {
                    Some(count) => self.go_back(system, count, gradient),
                    None => gradient.fill(Spatial::zero()),
                }
                value
            },
        )
    }

    /// The loss, and the number of iterations to go back through where it has a gradient.
    #[inline(always)]
    fn iterate(&mut self, system: &System<f64>, start: &[Spatial<f64>]) -> (f64, Option<usize>) {
        let Self { operator, preconditioner, steps, residual, product, .. } = self;
        let topology = &*system.topology;
        operator.prepare(system);
        preconditioner.prepare(operator, system);
        for (r, terms) in residual.iter_mut().zip(&system.joints) {
            *r = terms.rhs;
        }
        let of_rhs = preconditioner.apply(system, residual, product);
        operator.apply(topology, start, product);
        add(residual, product, -1.0);
        let last = steps.len() - 1;
        let mut k = 0;
        loop {
            let (before, after) = steps.split_at_mut(k);
            let Step { preconditioned, direction, image, squared, curvature } = &mut after[0];
            *squared = preconditioner.apply(system, residual, preconditioned);
            if *squared <= SOLVED * of_rhs || of_rhs == 0.0 {
                return (SOLVED.ln(), None);
            }
            let relative = *squared / of_rhs;
            if !relative.is_finite() {
                return (f64::INFINITY, None);
            }
            if k == last {
                return (relative.ln(), Some(k));
            }
            direction.copy_from_slice(preconditioned);
            if let Some(before) = before.last() {
                add(direction, &before.direction, *squared / before.squared);
            }
            *curvature = operator.apply(topology, direction, image);
            let step = *squared / *curvature;
            if !(*curvature > 0.0 && step.is_finite()) {
                return (relative.ln(), Some(k));
            }
            add(residual, image, -step);
            k += 1;
        }
    }

    /// The gradient of ln(r^T z) after `count` iterations, by the chain rule from the last to the first:
    ///
    /// ```text
    /// z = M^-1 r,  rho = r^T z,  ratio = rho / rho_before,  p = z + ratio p_before,
    /// q = A p,  c = p^T q,  step = rho / c,  r_after = r - step q
    /// ```
    #[inline(always)]
    fn go_back(&mut self, system: &System<f64>, count: usize, gradient: &mut [Spatial<f64>]) {
        let Self { operator, preconditioner, steps, residual: by_r, by_direction: by_p, product } = self;
        let topology = &*system.topology;
        let end = &steps[count];
        for (by_r, z) in by_r.iter_mut().zip(&end.preconditioned) {
            *by_r = Spatial::zero().plus(*z, 2.0 / end.squared);
        }
        by_p.fill(Spatial::zero());
        let mut by_squared = 0.0;
        for k in (0..count).rev() {
            let (before, after) = steps.split_at(k);
            let Step { preconditioned, image, squared, curvature, .. } = &after[0];
            // r_after and p_after to step, c and p; A is symmetric.
            let step = squared / curvature;
            let by_step = -dot(by_r, image);
            by_squared += by_step / curvature;
            operator.apply(topology, by_r, product);
            add(by_p, product, -step);
            add(by_p, image, -2.0 * by_step * step / curvature);
            // p to z, ratio and p_before.
            let (mut ratio, mut by_squared_before) = (0.0, 0.0);
            if let Some(before) = before.last() {
                ratio = squared / before.squared;
                let by_ratio = dot(by_p, &before.direction);
                by_squared += by_ratio / before.squared;
                by_squared_before = -by_ratio * ratio / before.squared;
            }
            // z and rho to r; M is symmetric.
            preconditioner.apply(system, by_p, product);
            add(by_r, product, 1.0);
            add(by_r, preconditioned, 2.0 * by_squared);
            by_p.iter_mut().for_each(|x| *x = Spatial::zero().plus(*x, ratio));
            by_squared = by_squared_before;
        }
        operator.apply(topology, by_r, gradient);
        gradient.iter_mut().for_each(|x| *x = Spatial::zero().plus(*x, -1.0));
    }
}

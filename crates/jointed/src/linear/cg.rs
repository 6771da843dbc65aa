//! Conjugate gradients on the multipliers: `A dlambda = b` with a preconditioner M.
//!
//! The paper's "CG" (its section 4) without saying which system; this is the dual one, in the original rows and SI
//! units, where plain CG (`raw`) mixes metres with 1/metres. The stopping rule is stated in the norm of the
//! preconditioner and relative to b,
//!
//! ```text
//! sqrt(r^T M^-1 r) <= tolerance sqrt(b^T M^-1 b),
//! ```
//!
//! and never to the residual of the start: a better guess must not buy a stricter target. In raw units ||r|| / ||b||
//! says little about stretch, so that the residuals of the stretch-shear and of the bend-twist rows are told apart.

use crate::linear::operator::Operator;
use crate::linear::precondition::{Frozen, Preconditioner, PreconditionerKind};
use crate::linear::{LinearInfo, LinearSolver, LinearStatus};
use crate::system::System;
use crate::topology::Topology;
use kernels::Spatial;
use kernels::dispatch::vectorized;

/// Rounding errors of a product with A, relative to [`magnitudes`]. They stay in the solution that a start leads to:
/// where they would be above the target the start is dropped, for no number of iterations would make up for them.
const ROUNDING: f64 = 1e-15;

/// How to iterate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CgParams {
    /// What stands in for A^-1.
    pub preconditioner: PreconditionerKind,
    /// Residual to reach, relative to the right-hand side, in the preconditioner's norm.
    pub tolerance: f64,
    /// Cap on the iterations of a solve; `None` for ten times the unknowns and a thousand more.
    pub max_iterations: Option<u64>,
}

impl Default for CgParams {
    fn default() -> Self {
        Self { preconditioner: PreconditionerKind::default(), tolerance: 1e-6, max_iterations: None }
    }
}

/// Preconditioned conjugate gradients. A solve does not allocate.
pub(crate) struct Cg {
    params: CgParams,
    preconditioner: Preconditioner,
    work: Work,
}

/// The vectors of the iteration, one entry a joint.
#[derive(Clone, Debug)]
struct Work {
    operator: Operator,
    residual: Vec<Spatial<f64>>,
    /// z = M^-1 r.
    preconditioned: Vec<Spatial<f64>>,
    direction: Vec<Spatial<f64>>,
    /// A times the direction.
    image: Vec<Spatial<f64>>,
    /// That of A.
    diagonal: Vec<Spatial<f64>>,
}

impl Cg {
    /// Memory for systems of this connectivity. `frozen` holds the rest shape where the preconditioner needs it; without
    /// it, the 6x6 blocks take its place.
    pub(crate) fn new(params: CgParams, topology: &Topology, frozen: Option<Frozen>) -> Self {
        let joints = topology.joints.len();
        let preconditioner = Preconditioner::new(params.preconditioner, topology, frozen);
        let zero = || vec![Spatial::zero(); joints];
        let work = Work {
            operator: Operator::new(topology),
            residual: zero(),
            preconditioned: zero(),
            direction: zero(),
            image: zero(),
            diagonal: zero(),
        };
        Self { params, preconditioner, work }
    }
}

impl Work {
    #[inline(always)]
    fn solve(
        &mut self,
        preconditioner: &mut Preconditioner,
        params: &CgParams,
        system: &System<f64>,
        has_start: bool,
        x: &mut [Spatial<f64>],
    ) -> LinearInfo {
        let topology = &*system.topology;
        let Self { operator, residual, preconditioned, direction, image, diagonal } = self;
        operator.prepare(system);
        preconditioner.prepare(operator, system);
        for (r, terms) in residual.iter_mut().zip(&system.joints) {
            *r = terms.rhs;
        }
        let rhs_squared = preconditioner.apply(system, residual, preconditioned);
        if rhs_squared == 0.0 {
            x.fill(Spatial::zero());
            return LinearInfo::default();
        }
        if !(rhs_squared > 0.0 && rhs_squared.is_finite()) {
            x.fill(Spatial::zero());
            return LinearInfo { status: LinearStatus::NotPositiveDefinite, residual: 1.0, ..LinearInfo::default() };
        }
        let mut squared = rhs_squared;
        let target = params.tolerance * params.tolerance * rhs_squared;
        let mut info = LinearInfo::default();
        for (joint, d) in diagonal.iter_mut().enumerate() {
            *d = operator.diagonal(system, joint);
        }
        let is_sound = has_start && {
            magnitudes(diagonal, x, image);
            ROUNDING * ROUNDING * preconditioner.apply(system, image, direction) <= target
        };
        info.start_dropped = has_start && !is_sound;
        if is_sound {
            operator.apply(topology, x, image);
            for (r, ax) in residual.iter_mut().zip(image.iter()) {
                *r = r.plus(*ax, -1.0);
            }
            squared = preconditioner.apply(system, residual, preconditioned);
        } else {
            x.fill(Spatial::zero());
        }
        direction.copy_from_slice(preconditioned);
        let unknowns = 6 * x.len() as u64;
        let cap = params.max_iterations.unwrap_or(10 * unknowns + 1000);
        while squared > target {
            if info.iterations == cap {
                info.status = LinearStatus::OutOfIterations;
                break;
            }
            let curvature = operator.apply(topology, direction, image);
            let step = squared / curvature;
            if !(curvature > 0.0 && step.is_finite()) {
                info.status = LinearStatus::NotPositiveDefinite;
                break;
            }
            info.iterations += 1;
            for (((x, p), r), ap) in x.iter_mut().zip(direction.iter()).zip(residual.iter_mut()).zip(image.iter()) {
                *x = x.plus(*p, step);
                *r = r.plus(*ap, -step);
            }
            let next = preconditioner.apply(system, residual, preconditioned);
            let ratio = next / squared;
            squared = next;
            for (p, z) in direction.iter_mut().zip(preconditioned.iter()) {
                *p = z.plus(*p, ratio);
            }
        }
        if !squared.is_finite() {
            info.status = LinearStatus::NotPositiveDefinite;
        }
        info.residual = (squared / rhs_squared).sqrt();
        [info.stretch_residual, info.bend_residual] = split_residuals(diagonal, system, residual);
        info
    }
}

/// How large the terms are that `A x` sums up, however much of them cancels: by `|A_ij| <= sqrt(A_ii A_jj)`, row i of a
/// joint has `sqrt(A_ii) sqrt(sum A_jj x_j^2)` over the joint's rows. Joints that share a body see no more of each other.
#[inline(always)]
fn magnitudes(diagonal: &[Spatial<f64>], x: &[Spatial<f64>], out: &mut [Spatial<f64>]) {
    for ((d, x), out) in diagonal.iter().zip(x).zip(out) {
        let d = d.to_array();
        let squared: f64 = x.to_array().iter().zip(&d).map(|(x, d)| d * x * x).sum();
        *out = Spatial::from_array(d.map(|d| (d * squared).sqrt()));
    }
}

/// `sqrt(sum r_i^2 / A_ii)` over the stretch-shear and over the bend-twist rows, each relative to that of b in the same
/// rows, or to that of all of b where these rows' is zero.
#[inline(always)]
fn split_residuals(diagonal: &[Spatial<f64>], system: &System<f64>, residual: &[Spatial<f64>]) -> [f64; 2] {
    let [mut r_squared, mut b_squared] = [[0.0; 2]; 2];
    for ((r, terms), d) in residual.iter().zip(&system.joints).zip(diagonal) {
        let (r, b, d) = (r.to_array(), terms.rhs.to_array(), d.to_array());
        for k in 0..6 {
            r_squared[k / 3] += r[k] * r[k] / d[k];
            b_squared[k / 3] += b[k] * b[k] / d[k];
        }
    }
    let all = b_squared[0] + b_squared[1];
    let ratio = |part: usize| {
        let reference = if b_squared[part] > 0.0 { b_squared[part] } else { all };
        (r_squared[part] / reference).sqrt()
    };
    [ratio(0), ratio(1)]
}

impl LinearSolver for Cg {
    fn solve(&mut self, system: &System<f64>, has_start: bool, dlambda: &mut [Spatial<f64>]) -> LinearInfo {
        let Self { params, preconditioner, work } = self;
        vectorized(
            #[inline(always)]
            || work.solve(preconditioner, params, system, has_start, dlambda),
        )
    }

    fn uses_start(&self) -> bool {
        true
    }
}

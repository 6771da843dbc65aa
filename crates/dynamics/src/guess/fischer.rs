//! Fischer's projection: the best start in the span of the last k solutions (Fischer 1998).
//!
//! Best means the smallest error in the norm of the current matrix A: with the solutions as columns of X,
//! `(X^T A X) c = X^T b`, `dlambda0 = X c`. The columns are made A-orthonormal one by one, newest first (k products with
//! A); one that depends on those before it is dropped. Each column's coefficient is taken from what the ones before have
//! left over of b, so that none of them can make the error larger, rounding or not. The span does not mind the dt^2 by
//! which a change of the time step scales a solution, so that nothing has to be done about it.

use component::Component;
use component::snapshot::StateVisitor;
use jointed::linear::operator::Operator;
use jointed::system::System;
use jointed::topology::Topology;
use kernels::Spatial;
use kernels::dispatch::vectorized;

use super::history::SolveHistory;
use super::{InitialGuess, from_body_frame};

/// A column is dropped where less than this share of its squared A-norm is new.
const DEPENDENT: f64 = 1e-20;

/// Starts linear solves from the projection on the last solutions.
#[derive(Clone, Debug)]
pub struct Fischer {
    history: SolveHistory,
    operator: Operator,
    /// Orthonormal columns and their images under A, one after the other.
    columns: Vec<Spatial<f64>>,
    images: Vec<Spatial<f64>>,
    /// What is left of b.
    residual: Vec<Spatial<f64>>,
    depth: usize,
}

impl Fischer {
    /// Default number of solutions to project on.
    pub const DEPTH: usize = 8;

    /// The projection on the last `depth` solutions of the same outer iteration.
    pub fn new(depth: usize, topology: &Topology) -> Self {
        let (depth, joints) = (depth.max(1), topology.joints.len());
        Self {
            history: SolveHistory::new(joints, depth),
            operator: Operator::new(topology),
            columns: vec![Spatial::zero(); depth * joints],
            images: vec![Spatial::zero(); depth * joints],
            residual: vec![Spatial::zero(); joints],
            depth,
        }
    }

    /// Adds the projection to `dlambda`; returns how many columns it has.
    #[inline(always)]
    fn project(&mut self, system: &System<f64>, iteration: usize, dlambda: &mut [Spatial<f64>]) -> usize {
        let Self { history, operator, columns, images, residual, depth } = self;
        let n = dlambda.len();
        let Some(ring) = history.ring(iteration).filter(|ring| n > 0 && ring.get(0).is_some()) else { return 0 };
        operator.prepare(system);
        for (r, terms) in residual.iter_mut().zip(&system.joints) {
            *r = terms.rhs;
        }
        let mut kept = 0;
        for entry in (0..*depth).filter_map(|age| ring.get(age)) {
            let (done, column) = columns.split_at_mut(kept * n);
            let column = &mut column[..n];
            for (joint, x) in column.iter_mut().enumerate() {
                *x = from_body_frame(system, joint, entry.values[joint]);
            }
            let mut taken = 0.0;
            for (earlier, image) in done.chunks_exact(n).zip(images.chunks_exact(n)) {
                let share = dot(column, image);
                taken += share * share;
                add(column, earlier, -share);
            }
            let image = &mut images[kept * n..(kept + 1) * n];
            let left = operator.apply(&system.topology, column, image);
            if !(left > DEPENDENT * (left + taken) && left.is_finite()) {
                continue;
            }
            let scale = 1.0 / left.sqrt();
            for (x, ax) in column.iter_mut().zip(image.iter_mut()) {
                *x = Spatial { linear: x.linear * scale, angular: x.angular * scale };
                *ax = Spatial { linear: ax.linear * scale, angular: ax.angular * scale };
            }
            let coefficient = dot(column, residual);
            add(dlambda, column, coefficient);
            add(residual, image, -coefficient);
            kept += 1;
        }
        kept
    }
}

#[inline(always)]
fn dot(x: &[Spatial<f64>], y: &[Spatial<f64>]) -> f64 {
    let mut sum = 0.0;
    for (x, y) in x.iter().zip(y) {
        sum += x.dot(*y);
    }
    sum
}

#[inline(always)]
fn add(x: &mut [Spatial<f64>], y: &[Spatial<f64>], k: f64) {
    for (x, y) in x.iter_mut().zip(y) {
        *x = x.plus(*y, k);
    }
}

impl InitialGuess for Fischer {
    fn helps_solves(&self) -> bool {
        true
    }

    fn start_solve(&mut self, component: &Component<f64>, iteration: usize, dlambda: &mut [Spatial<f64>]) -> bool {
        self.history.begin(component.effective_dt(), iteration);
        let columns = vectorized(
            #[inline(always)]
            || self.project(&component.system, iteration, dlambda),
        );
        columns > 0
    }

    fn observe_solve(&mut self, component: &Component<f64>, iteration: usize) {
        self.history.observe(component, iteration);
    }

    fn observe_step(&mut self, _: &Component<f64>) {
        self.history.accept();
    }

    fn visit_state(&mut self, visitor: &mut StateVisitor<'_>) {
        self.history.visit_state(visitor);
    }
}

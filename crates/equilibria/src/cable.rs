//! A cable between two grips, or in one, as [`crate::batch`] solves it.

use cosserat::internals::kernels::lane::Real;
use cosserat::internals::kernels::math::Vec3;
use nalgebra::{UnitQuaternion, Vector3};

use crate::answer::{Equilibrium, Finish};
use crate::batch::{self, Params, ParamsError};
use crate::descent::push;
use crate::problem::{Answers, Problem, Solved, System, Wide};
use crate::query::{Query, QueryError};
use crate::scaled::{Cut, Scaled, get, set};
use crate::start::{Curves, Starts};
use crate::sweep::{Chain, Found, Row};

impl Problem for Scaled {
    type Query = Query;
    /// The force on the first grip, over B / L^2, with the sign of the pull along the cable.
    type Begin = Vector3<f64>;
    type Equilibrium = Equilibrium;
    type Error = QueryError;

    fn solve_from(queries: &[Query], params: &Params, starts: &dyn Starts) -> Result<Answers<Self>, ParamsError> {
        batch::answers(queries, params, starts)
    }

    fn known(query: &Query, found: &Equilibrium) -> (Vec<UnitQuaternion<f64>>, Vector3<f64>) {
        let unit = query.cable.bending[0].max(query.cable.bending[1]) / query.cable.length.powi(2);
        (found.orientations.clone(), found.grips[0].force / -unit)
    }

    fn energy(found: &Equilibrium) -> f64 {
        found.energy
    }

    fn residual(found: &Equilibrium) -> f64 {
        found.residual
    }

    fn unit(query: &Query) -> f64 {
        query.cable.bending[0].max(query.cable.bending[1]) / query.cable.length
    }
}

impl Solved for Scaled {
    const CABLES: usize = 1;
    type System = Cables;

    fn new(query: &Query) -> Result<Self, QueryError> {
        query.validate().map(|()| Self::new(query))
    }

    fn cable(&self, _: usize, _: &Vector3<f64>) -> Scaled {
        *self
    }

    fn is_same(a: &Vector3<f64>, b: &Vector3<f64>, error: f64) -> bool {
        (a - b).norm() <= error * a.norm().max(1.0)
    }

    fn all_starts() -> impl Starts {
        Curves::all()
    }

    fn equilibrium(
        &self,
        finish: &mut Finish,
        query: &Query,
        force: &Vector3<f64>,
        turns: &[UnitQuaternion<f64>],
    ) -> Equilibrium {
        finish.equilibrium(query, self, force, turns)
    }

    fn not_found(solves: u32) -> QueryError {
        QueryError::NotFound { solves }
    }
}

/// Cables side by side.
#[derive(Clone, Debug)]
pub(crate) struct Cables {
    chain: Chain<Wide>,
    rows: Vec<Row<Wide>>,
    /// Change of the force in the last solve.
    change: Vec3<Wide>,
}

impl System<Scaled> for Cables {
    fn new(cut: &Cut) -> Self {
        Self { chain: Chain::new(cut), rows: vec![Row::zero(); cut.segments], change: Vec3::zero() }
    }

    fn load(&mut self, lane: usize, cut: &Cut, query: &Scaled, force: &Vector3<f64>, turns: &[UnitQuaternion<f64>]) {
        self.chain.load(lane, cut, query);
        for (own, q) in self.chain.turns.iter_mut().zip(turns) {
            set(own, lane, q);
        }
        // A free end bears nothing, and so the first grip bears all.
        let force = if query.held { *force } else { Vector3::z() * -(query.weight + query.carried[0]) };
        for k in 0..3 {
            self.chain.force.0[k].set_lane(lane, force[k]);
        }
    }

    #[inline(always)]
    fn solve(&mut self, shifts: Wide) -> Found<Wide> {
        let found = self.chain.solve(&mut self.rows, shifts);
        self.change = found.force;
        found
    }

    #[inline(always)]
    fn step(&mut self, shares: Wide, forces: Wide) {
        self.chain.step(&self.rows, shares, self.change, forces);
    }

    fn push(&mut self, lane: usize) {
        push(&mut self.chain, lane);
    }

    fn store(&self, lane: usize, turns: &mut [UnitQuaternion<f64>]) -> Vector3<f64> {
        for (own, q) in self.chain.turns.iter().zip(turns) {
            *q = get(own, lane);
        }
        Vector3::from_fn(|k, _| self.chain.force.0[k].lane(lane))
    }
}

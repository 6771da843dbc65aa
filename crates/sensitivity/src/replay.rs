//! Goes through a connected set's steps once more, or through those of several alike ones in lanes: what their equations are where
//! they are solved.

use std::sync::Arc;

use component::{Component, Members};
use dynamics::substep::Substep;
use jointed::tangent::Equations;
use jointed::tangent::jacobian::{Factor, Field, Jacobian, Whole};
use jointed::topology::Topology;
use kernels::lane::Real;
use nalgebra::DVector;
use rod::Integrator;
use rod::{Model, State};

use super::DerivativeError;
use super::touching::Border;

/// Connected sets beside themselves, one a lane, and the Jacobian of their last step.
pub(super) struct Replay<T> {
    pub(super) component: Component<T>,
    whole: Whole<T>,
    equations: Equations<T>,
    pub(super) topology: Arc<Topology>,
    jacobian: Jacobian<T>,
    factor: Factor<T>,
    border: Border,
    /// What the contacts' equations are to change by, and their impulses: see [`Border`].
    pub(super) contacts: DVector<f64>,
    work: Field<T>,
}

/// Components of the same sets, at their start.
pub(super) fn component<T: Real>(
    model: &Model,
    state: &State,
    integrator: Integrator,
    (sets, topology): (&[&Members], &Arc<Topology>),
) -> Component<T> {
    let mut component = Component::new(model, state, topology.clone(), sets);
    component.integrate_by(integrator);
    component
}

impl<T: Real> Replay<T> {
    /// At the start of a run.
    ///
    /// # Errors
    /// If there are too many loops.
    pub(super) fn new(
        model: &Model,
        state: &State,
        integrator: Integrator,
        sets: (&[&Members], &Arc<Topology>),
    ) -> Result<Self, DerivativeError> {
        let (equations, whole) = (Equations::default(), Whole::default());
        Ok(Self {
            component: component(model, state, integrator, sets),
            jacobian: Jacobian::new(sets.1, &equations, &whole),
            whole,
            equations,
            factor: Factor::new(sets.1).ok_or(DerivativeError::Unknown("rods that form so many loops"))?,
            topology: sets.1.clone(),
            border: Border::default(),
            contacts: DVector::zeros(0),
            work: Field::zero(sets.1),
        })
    }

    /// Begins a step where each lane began it; lanes without a set repeat the first.
    pub(super) fn begin_at(&mut self, substeps: &[&Substep]) {
        for lane in 0..T::LANES {
            self.component.begin_lane_at(lane, &substeps[lane.min(substeps.len() - 1)].begin);
        }
    }

    /// Puts the solution of a step that has begun in its place, one a lane, and factors the Jacobian there; `None` where it is
    /// singular. What contacts are to change by is zero then. Where there are contacts there is one lane.
    pub(super) fn linearise(&mut self, substeps: &[&Substep]) -> Option<()> {
        let Self { component, whole, equations, jacobian, factor, border, contacts, work, .. } = self;
        let first = substeps.first()?;
        component.set_forces(first.interval.time + first.interval.dt);
        component.predict_step(first.interval);
        for lane in 0..T::LANES {
            let own = substeps[lane.min(substeps.len() - 1)];
            component.place_lane(lane, &own.poses, &own.lambda);
        }
        component.evaluate_step();
        component.gather(equations, 1.0);
        component.whole_blocks(equations, 1.0, whole);
        jacobian.set(equations, whole);
        let is_free = |body: usize| !component.is_still(body);
        let lanes = substeps.len();
        *border = Border::new(&first.touching, (jacobian, factor, lanes), &is_free, work)?;
        *contacts = DVector::zeros(border.size());
        Some(())
    }

    /// Solves the equations of the step that was last linearised, or the transposed ones, in the place of what they are to change
    /// by: of the contacts' own equations [`Replay::contacts`] says that.
    pub(super) fn solve(&mut self, field: &mut Field<T>, transposed: bool) {
        self.border.solve(&self.jacobian, &mut self.factor, (field, &mut self.contacts), transposed);
    }

    /// `A^T x` of that step: see [`Jacobian::apply`].
    pub(super) fn apply_transposed(&self, x: &Field<T>, out: &mut Field<T>) {
        self.jacobian.apply(x, true, out);
    }

    /// Place of a contact's three equations in [`Replay::contacts`].
    pub(super) fn equations_of(&self, contact: usize) -> usize {
        self.border.first(contact)
    }
}

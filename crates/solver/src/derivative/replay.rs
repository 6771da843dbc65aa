//! Goes through a connected set's steps once more: what their equations are where they are solved.

use std::sync::Arc;

use nalgebra::{DVector, Matrix3};
use rod::{Model, State};

use super::touching::Border;
use super::{DerivativeError, Substep};
use crate::component::{Component, Members};
use crate::integrator::Integrator;
use crate::tangent::Equations;
use crate::tangent::jacobian::{Factor, Field, Jacobian};
use crate::topology::Topology;

/// A connected set beside itself, and the Jacobian of its last step.
pub(super) struct Replay {
    pub(super) component: Component<f64>,
    whole: (Vec<Matrix3<f64>>, Vec<Matrix3<f64>>),
    equations: Equations,
    pub(super) topology: Arc<Topology>,
    factor: Factor,
    border: Border,
    /// What the contacts' equations are to change by, and their impulses: see [`Border`].
    pub(super) contacts: DVector<f64>,
    work: Field,
}

/// Components of the same set, at its start.
pub(super) fn component<T: crate::kernel::lane::Real>(
    model: &Model,
    state: &State,
    integrator: Integrator,
    (members, topology): (&Members, &Arc<Topology>),
) -> Component<T> {
    let mut component = Component::new(model, state, topology.clone(), &[members]);
    component.integrate_by(integrator);
    component
}

impl Replay {
    /// At the start of a run.
    ///
    /// # Errors
    /// If there are too many loops.
    pub(super) fn new(
        model: &Model,
        state: &State,
        integrator: Integrator,
        set: (&Members, &Arc<Topology>),
    ) -> Result<Self, DerivativeError> {
        Ok(Self {
            component: component(model, state, integrator, set),
            whole: (Vec::new(), Vec::new()),
            equations: Equations::default(),
            factor: Factor::new(set.1).ok_or(DerivativeError::Unknown("rods that form so many loops"))?,
            topology: set.1.clone(),
            border: Border::default(),
            contacts: DVector::zeros(0),
            work: Field::zero(set.1),
        })
    }

    /// Begins a step and puts its solution in its place: returns the Jacobian there, which the factor is of; `None` where it is
    /// singular. What contacts are to change by is zero then.
    pub(super) fn linearise(&mut self, substep: &Substep) -> Option<Jacobian> {
        let Self { component, whole: (bodies, joints), equations, topology, factor, border, contacts, work } = self;
        component.set_forces(substep.interval.time + substep.interval.dt);
        component.predict_step(substep.interval);
        component.go_back_to(&substep.poses, &substep.lambda, 0.0);
        component.evaluate_step();
        component.gather(equations, 1.0);
        component.whole_blocks(equations, 1.0, bodies, joints);
        let mut jacobian = Jacobian::new(topology, equations, (bodies, joints));
        let is_free = |body: usize| !component.is_still(body);
        *border = Border::new(&substep.touching, &mut jacobian, factor, &is_free, work)?;
        *contacts = DVector::zeros(border.size());
        Some(jacobian)
    }

    /// Solves the equations of the step that was last linearised, or the transposed ones, in the place of what they are to change
    /// by: of the contacts' own equations [`Replay::contacts`] says that.
    pub(super) fn solve(&mut self, jacobian: &Jacobian, field: &mut Field, transposed: bool) {
        self.border.solve(jacobian, &mut self.factor, (field, &mut self.contacts), transposed);
    }

    /// Place of a contact's three equations in [`Replay::contacts`].
    pub(super) fn equations_of(&self, contact: usize) -> usize {
        self.border.first(contact)
    }
}

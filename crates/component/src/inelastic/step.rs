//! What joints with laws do in a step of a component, and at rest.

use jointed::rotation::RotationRows;
use kernels::lane::Real;
use kernels::math::Quat;
use nalgebra::Vector3;
use rod::{InternalVariables, State};

use super::{Inelastic, Pace};
use crate::Component;
use crate::parts::pick;
use crate::snapshot::StateVisitor;

impl<T: Real> Component<T> {
    /// By how much joints transmit other moments than their laws' at the last evaluation, at most: see [`JointLaw::missed`].
    pub fn missed_by_laws(&self) -> f64 {
        self.laws.missed
    }

    /// Lets joints with laws answer as at the end of a change that takes for ever: what relaxes has done so. It is for equilibria, which
    /// [`Component::end_laws`] makes the start of what comes next.
    pub fn change_laws_slowly(&mut self) {
        self.laws.pace = Pace::Slow;
    }

    /// Lets joints with laws answer as where they change at once, so that none flows, slips or relaxes: for vibrations about a state.
    pub fn change_laws_suddenly(&mut self) {
        self.laws.pace = Pace::Sudden;
    }

    /// Strain of a joint whose bodies are oriented so, in its rows [1/m].
    pub(crate) fn strain_of(&self, joint: usize, [a, b]: [Quat<T>; 2]) -> Vector3<f64> {
        let [of_a, of_b] = self.extras.rests.get(joint).map_or([a, b], |rests| [a * rests[0], b * rests[1]]);
        let (terms, constants) = (&self.system.joints[joint], &self.joints[joint]);
        let (_, measured) = RotationRows::new(self.strain_measure, (of_a.conj() * of_b).upper());
        let strain = measured * (T::splat(1.0) / terms.length) - constants.rest;
        pick(strain, 0).0.into()
    }

    /// Sets what damped joints with laws take from the start of the step.
    pub(crate) fn begin_laws(&mut self) {
        for k in 0..self.laws.all.len() {
            let own = &self.laws.all[k];
            if own.damping != Vector3::zeros() {
                let ends = self.system.topology.joints[own.joint].map(|body| self.start[body as usize].q);
                self.laws.all[k].start = self.strain_of(own.joint, ends);
            }
        }
    }

    /// Ends a step that is accepted: internal variables are those of its end. What an open grip let go is as at rest when it is held again.
    pub fn end_laws(&mut self) {
        let dt = self.laws.pace.over(self.dt);
        for k in 0..self.laws.all.len() {
            let joint = self.laws.all[k].joint;
            let ends = self.system.topology.joints[joint].map(|body| self.poses[body as usize].q);
            let strain = self.strain_of(joint, ends);
            let is_open = self.released.iter().any(|one| one.opens(joint));
            let Inelastic { law, stiffness, at, .. } = &mut self.laws.all[k];
            if is_open {
                at.forget();
                continue;
            }
            law.advance(stiffness, &strain, at, dt);
        }
    }

    /// Shows a visitor what joints with laws remember.
    pub(crate) fn visit_laws(&mut self, visitor: &mut StateVisitor<'_>) {
        let vector = |visitor: &mut StateVisitor<'_>, v: &mut Vector3<f64>| {
            v.iter_mut().for_each(|x| visitor.number(x));
        };
        visitor.list(&mut self.laws.all, |visitor, own| {
            let InternalVariables { strain, parts, hardening, dissipated } = &mut own.at;
            vector(visitor, strain);
            visitor.list(parts, vector);
            visitor.number(hardening);
            visitor.number(dissipated);
        });
    }

    /// Copies what joints with laws remember to `state`.
    pub(crate) fn store_laws(&self, state: &mut State) {
        for own in &self.laws.all {
            if state.internals.len() <= own.index {
                state.internals.resize_with(own.index + 1, InternalVariables::default);
            }
            let InternalVariables { strain, parts, hardening, dissipated } = &own.at;
            let to = &mut state.internals[own.index];
            (to.strain, to.hardening, to.dissipated) = (*strain, *hardening, *dissipated);
            to.parts.clone_from(parts);
        }
    }
}

//! What of a component a snapshot keeps.

use kernels::lane::Real;

use super::Component;
use super::constants::{BodyLoad, Follower};
use crate::snapshot::StateVisitor;

impl<T: Real> Component<T> {
    /// Shows a visitor all that the next step begins with, and what is read off between steps.
    pub fn visit_state(&mut self, visitor: &mut StateVisitor<'_>) {
        // Every field stands here, so that whoever adds one says whether it is kept.
        let Self {
            poses,
            velocities,
            lambda,
            held,
            given,
            has_given,
            loads,
            gravity,
            last_dt,
            last_effective,
            multistep,
            time,
            dt,
            solves,
            evaluations,
            used,
            segments,
            system,
            moved: _,
            rigid,
            joints,
            released: _,
            is_released_in_order: _,
            eyelets: _,
            laws: _,
            breakable: _,
            broken: _,
            // A step makes these anew before it looks at them.
            effective: _,
            start: _,
            predicted: _,
            dlambda: _,
            scratch: _,
            momentum: _,
            is_apart: _,
            pulls: _,
            pulls_hold: _,
            pushes: _,
            pushed: _,
            contact_stiffness: _,
            longest_unit: _,
            correction: _,
            unsolved: _,
            drag: _,
            torques_wait: _,
            // These stay the same, or follow from what is held; of air, a segment's inertia is each step's.
            bodies: _,
            resting: _,
            extras: _,
            strain_measure: _,
            changing: _,
            damping: _,
        } = self;
        visitor.size(T::LANES);
        visitor.size(*used);
        visitor.size(*segments);
        // A segment that is let go couples its joints from then on.
        system.topology.fixed.iter().for_each(|&fixed| visitor.size(usize::from(fixed)));
        visitor.list(poses, StateVisitor::pose);
        visitor.list(velocities, StateVisitor::spatial);
        visitor.list(lambda, StateVisitor::spatial);
        visitor.list(held, StateVisitor::vector);
        visitor.list(given, StateVisitor::real);
        visitor.flag(has_given);
        visitor.list(loads, |visitor, BodyLoad { force, torque, own, turns, .. }| {
            visitor.vector(force);
            visitor.vector(torque);
            if let Some(Follower { force, torque, predicted: _ }) = own {
                visitor.vector(force);
                visitor.vector(torque);
            }
            visitor.flag(turns);
        });
        visitor.list(rigid, |visitor, body| body.visit_state(visitor));
        // Joints that turn freely go on as open grips with what they have turned by; the others' may be set.
        joints.iter_mut().for_each(|joint| {
            visitor.vector(&mut joint.rest);
            visitor.vector(&mut joint.darboux);
        });
        visitor.vector(gravity);
        visitor.real(last_dt);
        visitor.real(last_effective);
        visitor.size(usize::from(multistep.is_some()));
        if let Some(steps) = multistep {
            steps.visit_state(visitor);
        }
        visitor.number(time);
        visitor.number(dt);
        visitor.word(solves);
        visitor.word(evaluations);
        self.visit_motions(visitor);
        self.visit_eyelets(visitor);
        self.visit_laws(visitor);
        self.visit_breaks(visitor);
    }
}

//! What of a component a snapshot keeps.

use super::Component;
use super::constants::BodyLoad;
use super::loose::Loose;
use crate::kernel::lane::Real;
use crate::snapshot::Tape;

impl<T: Real> Component<T> {
    /// Shows a tape all that the next step begins with, and what is read off between steps.
    pub(crate) fn tape(&mut self, tape: &mut Tape<'_>) {
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
            loose,
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
            beyond: _,
            changing: _,
            damping: _,
        } = self;
        tape.size(T::LANES);
        tape.size(*used);
        tape.size(*segments);
        // A segment that is let go couples its joints from then on.
        system.topology.fixed.iter().for_each(|&fixed| tape.size(usize::from(fixed)));
        tape.list(poses, Tape::pose);
        tape.list(velocities, Tape::spatial);
        tape.list(lambda, Tape::spatial);
        tape.list(held, Tape::vector);
        tape.list(given, Tape::real);
        tape.flag(has_given);
        tape.list(loads, |tape, BodyLoad { force, torque, turns, .. }| {
            tape.vector(force);
            tape.vector(torque);
            tape.flag(turns);
        });
        tape.list(rigid, |tape, body| body.tape(tape));
        // What joints that turn freely have turned by, with which open grips go on.
        loose.iter().filter_map(Loose::turning).for_each(|joint| tape.vector(&mut joints[joint].rest_darboux));
        tape.vector(gravity);
        tape.real(last_dt);
        tape.real(last_effective);
        tape.size(usize::from(multistep.is_some()));
        if let Some(steps) = multistep {
            steps.tape(tape);
        }
        tape.number(time);
        tape.number(dt);
        tape.word(solves);
        tape.word(evaluations);
        self.tape_motions(tape);
    }
}

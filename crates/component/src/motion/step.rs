//! What moves of a component.

use std::sync::Arc;

use kernels::Spatial;
use kernels::lane::Real;
use rod::Driven;

use super::{LARGEST_TURN, Motion, Moved, Steady};
use crate::Component;
use crate::parts::{copy_pose, copy_spatial, pick_pose};
use crate::snapshot::StateVisitor;

impl<T: Real> Component<T> {
    /// Lets a motion drive a body of a lane, which must be fixed, from the next step on.
    pub(crate) fn drive(&mut self, lane: usize, body: usize, driven: &Driven) {
        self.moved.retain(|moved| !moved.is_of(lane, body));
        self.moved.push(Moved { lane, body, motion: Motion::Driven(Arc::new(driven.clone())) });
        self.forget_steps(lane);
    }

    /// Puts what moves by itself to its place at time 0, with its velocities there.
    pub(crate) fn begin_motions(&mut self) {
        for Moved { lane, body, motion } in &self.moved {
            let (pose, velocity) = motion.at(0.0);
            copy_pose(&mut self.poses[*body], *lane, &pose, 0);
            copy_spatial(&mut self.velocities[*body], *lane, &velocity, 0);
        }
    }

    /// Lets a fixed segment of a lane go on with the velocities (v, w) from its pose at `time` [s]; it keeps the motion that
    /// it has if that is driven, or if the velocities are the same.
    pub(crate) fn prescribe(&mut self, lane: usize, body: usize, velocity: Spatial<f64>, time: f64) {
        let here = |moved: &Moved| (moved.lane, moved.body) == (lane, body);
        let old = self.moved.iter().position(here);
        match old.map(|k| &self.moved[k].motion) {
            Some(Motion::Driven(_)) => return,
            Some(Motion::Steady(steady)) if steady.velocity == velocity => return,
            _ => {}
        }
        if let Some(k) = old {
            self.moved.swap_remove(k);
        }
        if velocity != Spatial::zero() {
            let steady = Steady { since: time, origin: pick_pose(&self.poses[body], lane), velocity };
            self.moved.push(Moved { lane, body, motion: Motion::Steady(steady) });
        }
    }

    /// Lets everything stay where it is that would move by itself.
    pub fn hold_still(&mut self) {
        for Moved { lane, body, .. } in self.moved.drain(..) {
            copy_spatial(&mut self.velocities[body], lane, &Spatial::<f64>::zero(), 0);
        }
    }

    /// Shows all that moves by itself to a visitor.
    pub(crate) fn visit_motions(&mut self, visitor: &mut StateVisitor<'_>) {
        let mut count = self.moved.len();
        visitor.count(&mut count);
        let own = if visitor.is_reading() { std::mem::take(&mut self.moved) } else { Vec::new() };
        // A snapshot may have more or fewer, in another order.
        self.moved.resize_with(count, || Moved { lane: 0, body: 0, motion: Motion::Steady(Steady::none()) });
        for (k, Moved { lane, body, motion }) in self.moved.iter_mut().enumerate() {
            visitor.count(lane);
            visitor.count(body);
            let is_it = |own: &&Moved| own.is_of(*lane, *body);
            if let Some(own) = own.get(k).filter(is_it).or_else(|| own.iter().find(is_it)) {
                motion.clone_from(&own.motion);
            }
            motion.visit_state(visitor);
        }
    }

    /// Whether a motion of the model's drives a body of a lane.
    pub(crate) fn is_driven(&self, lane: usize, body: usize) -> bool {
        let is_it = |moved: &Moved| (moved.lane, moved.body) == (lane, body);
        self.moved.iter().any(|moved| is_it(moved) && matches!(moved.motion, Motion::Driven(_)))
    }

    /// Puts what moves by itself to its place at the end of the step under way, as a prediction. A step in which it turns
    /// too far is not solved, and so done again in halves.
    pub(crate) fn follow_motions(&mut self) {
        let (begin, end) = (self.time, self.time + self.dt);
        for Moved { lane, body, motion } in &self.moved {
            copy_pose(&mut self.predicted[*body], *lane, &motion.at(end).0, 0);
            if motion.turned(begin, end) > LARGEST_TURN {
                self.unsolved.set_lane(*lane, 1.0);
            }
        }
    }

    /// Whether anything moves by itself.
    pub(crate) fn has_motions(&self) -> bool {
        !self.moved.is_empty()
    }

    /// Puts what moves by itself to its place at `time` [s].
    pub(crate) fn place_moved(&mut self, time: f64) {
        for Moved { lane, body, motion } in &self.moved {
            copy_pose(&mut self.poses[*body], *lane, &motion.at(time).0, 0);
        }
    }

    /// Gives what moves by itself the velocities with which it goes on from the step under way, in the lanes where
    /// `active` >= 0.
    pub(crate) fn follow_velocities(&mut self, active: T) {
        for Moved { lane, body, motion } in &self.moved {
            if active.lane(*lane) >= 0.0 {
                copy_spatial(&mut self.velocities[*body], *lane, &motion.at(self.time + self.dt).1, 0);
            }
        }
    }
}

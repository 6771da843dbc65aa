//! Holding bodies of a component, and letting them go.

use kernels::Spatial;
use kernels::lane::Real;
use rod::{Model, Pose};

use super::{Change, Resting};
use crate::parts::{copy_spatial, get, get_quat, pick};
use crate::{Component, Members};

impl<T: Real> Component<T> {
    /// Whether a body that is held in one lane is held in all.
    pub fn is_held_alike(&self) -> bool {
        let is_alike = |free: T| (1..T::LANES).all(|lane| (free.lane(lane) == 0.0) == (free.lane(0) == 0.0));
        self.bodies.iter().all(|body| is_alike(body.free))
    }

    /// Makes the segments of a lane that the model fixes fixed.
    pub(crate) fn fix(&mut self, model: &Model, members: &Members, lane: usize) {
        for (body, _) in members.segments.iter().enumerate().filter(|(_, index)| model.segments[**index].fixed) {
            self.hold_segment(lane, body);
        }
    }

    /// Whether a body of a lane is held.
    pub(crate) fn is_held(&self, body: usize, lane: usize) -> bool {
        if body < self.segments { self.is_fixed(body, lane) } else { !self.is_open(body, lane) }
    }

    /// Pose of a body of a lane; of an open grip where it would close now.
    pub fn pose(&mut self, lane: usize, body: usize) -> Pose {
        self.follow_faces();
        let own = &self.poses[body];
        Pose { position: get(own.x, lane), orientation: get_quat(own.q, lane) }
    }

    /// Holds a body of a lane, drives it or lets it go. What is held already stays so, and what is free.
    pub fn change(&mut self, lane: usize, body: usize, change: Change<'_>) {
        let (is_segment, is_held) = (body < self.segments, self.is_held(body, lane));
        self.forget_steps(lane);
        match change {
            Change::LetGo => {
                self.moved.retain(|moved| !moved.is_of(lane, body));
                match is_segment {
                    true if is_held => {
                        self.free_segment(lane, body);
                        self.close_stored(lane, body);
                    }
                    true => {}
                    false => self.set_open(lane, body, true),
                }
            }
            Change::Store => {
                if !is_held {
                    self.hold_segment(lane, body);
                }
                self.open_stored(lane, body);
            }
            Change::Hold | Change::Drive(_) => {
                if !is_held && is_segment {
                    self.hold_segment(lane, body);
                    copy_spatial(&mut self.velocities[body], lane, &Spatial::<f64>::zero(), 0);
                    self.given[body].set_lane(lane, -1.0);
                } else if !is_held {
                    self.follow_faces();
                    self.set_open(lane, body, false);
                }
                if let Change::Drive(driven) = change {
                    self.drive(lane, body, driven);
                }
            }
        }
    }

    fn hold_segment(&mut self, lane: usize, body: usize) {
        let own = &mut self.bodies[body];
        let [mut inverse_mass, mut transverse, axial] =
            [own.inverse_mass, own.transverse, own.axial].map(|x| x.lane(lane));
        if let Some(drag) = &self.drag {
            // Without what the air has added to it in the last step.
            let [mass, across] = drag.inertia(body, lane);
            (inverse_mass, transverse) = (1.0 / mass, across);
        }
        self.resting.push(Resting { lane, body, inverse_mass, transverse, axial });
        own.inverse_mass.set_lane(lane, 0.0);
        own.transverse.set_lane(lane, 1.0);
        own.axial.set_lane(lane, 1.0);
        own.free.set_lane(lane, 0.0);
        self.begin_with(lane, body);
    }

    /// Tells what goes on from the steps before that a body is held or free from now on.
    fn begin_with(&mut self, lane: usize, body: usize) {
        let moments = self.moments(body, lane);
        if let Some(steps) = &mut self.multistep {
            steps.set_inertia(body, lane, &self.bodies[body], moments);
        }
    }

    fn free_segment(&mut self, lane: usize, body: usize) {
        let is_it = |resting: &Resting| (resting.lane, resting.body) == (lane, body);
        let Some(place) = self.resting.iter().position(is_it) else { return };
        let Resting { inverse_mass, transverse, axial, .. } = self.resting.swap_remove(place);
        let own = &mut self.bodies[body];
        own.inverse_mass.set_lane(lane, inverse_mass);
        own.transverse.set_lane(lane, transverse);
        own.axial.set_lane(lane, axial);
        own.free.set_lane(lane, 1.0);
        self.begin_with(lane, body);
        // Velocities of a fixed segment are the true rates at the end of the last step.
        self.given[body].set_lane(lane, 1.0);
        let velocity = pick(self.velocities[body].linear, lane);
        if let Some(steps) = &mut self.multistep {
            steps.set_velocity(body, lane, velocity);
        }
        self.has_given = true;
    }
}

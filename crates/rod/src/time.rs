//! A model at a time: anchors, what is held, loads, gravity and rest shapes as they are then.

use crate::{Body, Change, Changing, Freedom, Model};

impl Model {
    /// Makes anchors, loads, gravity and rest shapes those of `time` [s], and what is held what was in the step that ended then, so that
    /// energies and joints are measured as they are then; what has broken before it is broken. What a motion takes hold of on the way is where it says only when
    /// the simulation has told where that was (`Simulation::store_model`).
    pub fn set_time(&mut self, time: f64) {
        for driven in self.motions.iter().filter(|driven| driven.is_timed()) {
            match driven.body {
                Body::Segment(i) => self.segments[i].fixed = false,
                Body::Anchor(i) if !self.open.contains(&i) => self.open.push(i),
                Body::Anchor(_) => {}
            }
        }
        for driven in self.motions.iter().filter(|driven| driven.held_until(time)) {
            match driven.body {
                Body::Segment(i) => self.segments[i].fixed = true,
                Body::Anchor(i) => {
                    self.anchors[i] = driven.at(time).pose;
                    self.open.retain(|open| *open != i);
                }
            }
        }
        for own in self.breakable.iter().filter(|own| own.broke.is_some_and(|broke| time > broke)) {
            self.joints[own.joint].freedom = Freedom::Broken;
        }
        self.set_changing(time);
    }

    /// Makes loads, gravity and rest shapes that change over time those of `time` [s].
    pub fn set_changing(&mut self, time: f64) {
        for Change { of, track } in &self.changes {
            let value = track.at(time);
            match *of {
                Changing::Gravity => self.gravity = value,
                Changing::Force(load) => self.loads[load].force = value,
                Changing::Torque(load) => self.loads[load].torque = value,
                Changing::Rest(joint) => self.joints[joint].rest_darboux = value,
            }
        }
        for lift in &self.lifts {
            self.loads[lift.load].force = self.gravity * -lift.mass;
        }
    }

    /// Whether any of its motions takes hold or lets go on the way.
    pub fn has_timed_grips(&self) -> bool {
        self.motions.iter().any(crate::Driven::is_timed)
    }

    /// Whether anything of it changes over time: anchors, what is held, loads, gravity or rest shapes, and joints that can break.
    pub fn varies(&self) -> bool {
        let varies = |driven: &crate::Driven| driven.is_timed() || matches!(driven.body, Body::Anchor(_));
        !self.changes.is_empty() || !self.breakable.is_empty() || self.motions.iter().any(varies)
    }
}

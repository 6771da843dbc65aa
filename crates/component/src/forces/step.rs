//! Loads, gravity and rest shapes of a component.

use std::collections::HashMap;

use kernels::lane::Real;
use kernels::math::Vec3;
use nalgebra::Vector3;
use rod::{Change, Changing, Model};

use super::{Target, Varying};
use crate::constants::{BodyLoad, Follower};
use crate::parts::{pick, put, vec3};
use crate::{Component, Members};

impl<T: Real> Component<T> {
    /// Adds a model's loads, and what of them, of gravity and of rest shapes changes over time, in each of these sets, one a
    /// lane.
    pub(crate) fn add_loads(&mut self, model: &Model, lanes: &[&Members]) {
        let lifts: HashMap<usize, f64> = model.lifts.iter().map(|lift| (lift.load, lift.mass)).collect();
        let courses: HashMap<Changing, &Change> = model.changes.iter().map(|course| (course.of, course)).collect();
        for (lane, members) in lanes.iter().enumerate() {
            let changes = |of: Changing| courses.get(&of).copied().into_iter();
            let change = |of: Target| move |course: &Change| Varying { lane, of, track: course.track.clone() };
            self.changing.extend(changes(Changing::Gravity).map(change(Target::Gravity)));
            self.changing.extend(model.changes.iter().filter_map(|course| {
                let Changing::Rest(joint) = course.of else { return None };
                let place = members.joints.binary_search(&joint).ok()?;
                Some(change(Target::Rest(place, joint))(course))
            }));
            for (index, load) in model.loads.iter().enumerate() {
                let Ok(body) = members.segments.binary_search(&load.segment) else { continue };
                let place = self.loads.len();
                self.changing.extend(changes(Changing::Force(index)).map(change(Target::Load(place))));
                self.changing.extend(changes(Changing::Torque(index)).map(change(Target::Torque(place))));
                let turns = turns(load.offset, &load.torque) || changes(Changing::Torque(index)).next().is_some();
                let zero = Vec3::zero();
                let follows = load.follows.then_some(Follower { force: zero, torque: zero, predicted: zero });
                let turns = turns || load.follows;
                let lift = lifts.get(&index).copied().unwrap_or(0.0);
                let mut own = BodyLoad {
                    index,
                    lane,
                    body,
                    offset: T::zero(),
                    force: zero,
                    torque: zero,
                    own: follows,
                    lift,
                    turns,
                };
                own.offset.set_lane(lane, load.offset);
                let [force, torque] = own.given();
                put(force, lane, vec3(&load.force));
                put(torque, lane, vec3(&load.torque));
                self.loads.push(own);
            }
        }
    }

    /// Changes a load of the model, if it is on one of these segments: force [N] and torque [N m].
    pub fn set_load(&mut self, index: usize, force: &Vector3<f64>, torque: &Vector3<f64>) {
        for load in self.loads.iter_mut().filter(|load| load.index == index) {
            let lane = load.lane;
            let [own_force, own_torque] = load.given();
            put(own_force, lane, vec3(force));
            put(own_torque, lane, vec3(torque));
            load.turns = load.own.is_some() || turns(load.offset.lane(lane), torque);
        }
    }

    /// Changes gravity [m/s^2].
    pub fn set_gravity(&mut self, gravity: &Vector3<f64>) {
        self.gravity = Vec3(vec3(gravity).map(T::splat));
        self.lift();
    }

    /// Changes the rest Darboux vector [1/m] of a joint of one lane.
    pub fn set_rest(&mut self, lane: usize, joint: usize, rest: &Vector3<f64>) {
        let length = self.system.joints[joint].length.lane(lane);
        self.joints[joint].put_rest(lane, self.strain_measure, rest, length);
    }

    /// Makes loads, gravity and rest shapes those of `time` [s].
    pub fn set_forces(&mut self, time: f64) {
        let mut is_other_gravity = false;
        for Varying { lane, of, track } in &self.changing {
            let now = track.at(time);
            let value = vec3(&now);
            match *of {
                Target::Gravity => {
                    put(&mut self.gravity, *lane, value);
                    is_other_gravity = true;
                }
                Target::Load(place) => put(self.loads[place].given()[0], *lane, value),
                Target::Torque(place) => put(self.loads[place].given()[1], *lane, value),
                Target::Rest(joint, _) => {
                    let length = self.system.joints[joint].length.lane(*lane);
                    self.joints[joint].put_rest(*lane, self.strain_measure, &now, length);
                }
            }
        }
        if is_other_gravity {
            self.lift();
        }
    }

    /// Makes buoyancy that of gravity as it is now.
    fn lift(&mut self) {
        for load in self.loads.iter_mut().filter(|load| load.lift != 0.0) {
            let gravity = pick(self.gravity, load.lane);
            put(&mut load.force, load.lane, (gravity * -load.lift).0);
        }
    }
}

/// Whether a load turns its segment.
fn turns(offset: f64, torque: &Vector3<f64>) -> bool {
    *torque != Vector3::zeros() || offset != 0.0
}

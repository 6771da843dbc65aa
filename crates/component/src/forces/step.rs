//! Loads and gravity of a component.

use kernels::lane::Real;
use kernels::math::Vec3;
use nalgebra::Vector3;
use rod::{Change, Changing, Model};

use super::{ChangingForce, Force};
use crate::constants::BodyLoad;
use crate::parts::{put, vec3};
use crate::{Component, Members};

impl<T: Real> Component<T> {
    /// Adds a model's loads, and what of them and of gravity changes over time, in each of these sets, one a lane.
    pub(crate) fn add_loads(&mut self, model: &Model, lanes: &[&Members]) {
        for (lane, members) in lanes.iter().enumerate() {
            let changes = |of: Changing| model.changes.iter().filter(move |course| course.of == of);
            let change = |of: Force| move |course: &Change| ChangingForce { lane, of, track: course.track.clone() };
            self.changing.extend(changes(Changing::Gravity).map(change(Force::Gravity)));
            for (index, load) in model.loads.iter().enumerate() {
                let Ok(body) = members.segments.binary_search(&load.segment) else { continue };
                let place = self.loads.len();
                self.changing.extend(changes(Changing::Force(index)).map(change(Force::Load(place))));
                self.changing.extend(changes(Changing::Torque(index)).map(change(Force::Torque(place))));
                let turns = turns(load.offset, &load.torque) || changes(Changing::Torque(index)).next().is_some();
                let zero = Vec3::zero();
                let mut own = BodyLoad { index, lane, body, offset: T::zero(), force: zero, torque: zero, turns };
                own.offset.set_lane(lane, load.offset);
                put(&mut own.force, lane, vec3(&load.force));
                put(&mut own.torque, lane, vec3(&load.torque));
                self.loads.push(own);
            }
        }
    }

    /// Changes a load of the model, if it is on one of these segments: force [N] and torque [N m].
    pub fn set_load(&mut self, index: usize, force: &Vector3<f64>, torque: &Vector3<f64>) {
        for load in self.loads.iter_mut().filter(|load| load.index == index) {
            put(&mut load.force, load.lane, vec3(force));
            put(&mut load.torque, load.lane, vec3(torque));
            load.turns = turns(load.offset.lane(load.lane), torque);
        }
    }

    /// Changes gravity [m/s^2].
    pub fn set_gravity(&mut self, gravity: &Vector3<f64>) {
        self.gravity = Vec3(vec3(gravity).map(T::splat));
    }

    /// Makes loads and gravity those of `time` [s].
    pub fn set_forces(&mut self, time: f64) {
        for ChangingForce { lane, of, track } in &self.changing {
            let value = vec3(&track.at(time));
            match *of {
                Force::Gravity => put(&mut self.gravity, *lane, value),
                Force::Load(place) => put(&mut self.loads[place].force, *lane, value),
                Force::Torque(place) => put(&mut self.loads[place].torque, *lane, value),
            }
        }
    }
}

/// Whether a load turns its segment.
fn turns(offset: f64, torque: &Vector3<f64>) -> bool {
    *torque != Vector3::zeros() || offset != 0.0
}

//! What a gradient gains while steps are gone back over, of all that does not change from step to step.

use std::collections::BTreeMap;

use component::{BodyGradient, Members, add_numbers};
use kernels::lane::Real;
use kernels::math::Vec3;
use nalgebra::Vector3;
use rod::Model;

use super::wanted::Pair;
use super::{AirVariation, Variation};

/// Sums over steps, of connected sets one a lane.
#[derive(Clone, Debug)]
pub(super) struct ParameterGradient<T> {
    /// Numbers of joints.
    pub(super) joints: Vec<[T; 12]>,
    /// Of bodies: masses, and moments of inertia about their own axes.
    masses: Vec<T>,
    moments: Vec<Vec3<T>>,
    gravity: Vec3<T>,
    damping: [T; 2],
    /// One entry a lane.
    pub(super) air: Vec<AirVariation>,
    /// Of loads by their indices in the model.
    loads: BTreeMap<usize, Pair>,
    /// Of contacts, which are of one lane.
    pub(super) friction: f64,
}

impl<T: Real> ParameterGradient<T> {
    /// None, of so many sets, each of so many joints and bodies.
    pub(super) fn zero(sets: usize, [joints, bodies]: [usize; 2]) -> Self {
        let zero = T::zero();
        Self {
            joints: vec![[zero; 12]; joints],
            masses: vec![zero; bodies],
            moments: vec![Vec3::zero(); bodies],
            gravity: Vec3::zero(),
            damping: [zero; 2],
            air: vec![AirVariation::default(); sets],
            loads: BTreeMap::new(),
            friction: 0.0,
        }
    }

    /// Those of a step with respect to a body's inertia.
    #[inline(always)]
    pub(super) fn add_inertia(&mut self, body: usize, of: &BodyGradient<T>) {
        self.masses[body] += of.mass;
        self.moments[body] += of.moments + of.own_moments;
    }

    /// Those with respect to what surrounds a body.
    #[inline(always)]
    pub(super) fn add_surroundings(&mut self, of: &BodyGradient<T>) {
        self.gravity += of.gravity;
        self.damping[0] += of.damping[0];
        self.damping[1] += of.damping[1];
    }

    /// With respect to gravity and the rates of damping, in one lane.
    pub(super) fn add_surroundings_in(&mut self, lane: usize, gravity: Vector3<f64>, damping: [f64; 2]) {
        let numbers = self.gravity.0.iter_mut().chain(&mut self.damping);
        numbers.zip(gravity.iter().chain(&damping)).for_each(|(own, by)| add_in(own, lane, *by));
    }

    pub(super) fn add_moments_in(&mut self, lane: usize, body: usize, by: &Vector3<f64>) {
        self.moments[body].0.iter_mut().zip(by.iter()).for_each(|(own, by)| add_in(own, lane, *by));
    }

    /// With respect to force and torque of a load.
    pub(super) fn add_load(&mut self, index: usize, by: Pair) {
        let own = self.loads.entry(index).or_insert([Vector3::zeros(); 2]);
        (0..2).for_each(|k| own[k] += by[k]);
    }

    /// Adds all of it to a gradient of a model.
    pub(super) fn add_to(&self, model: &Model, sets: &[Members], out: &mut Variation) {
        for (lane, members) in sets.iter().enumerate() {
            for (&joint, numbers) in members.joints.iter().zip(&self.joints) {
                add_numbers(&mut out.joints[joint], &numbers.map(|x| x.lane(lane)));
            }
            for (body, &segment) in members.segments.iter().enumerate() {
                let own = &mut out.segments[segment];
                own.mass += self.masses[body].lane(lane);
                let [x, y, z] = self.moments[body].0.map(|x| x.lane(lane));
                own.inertia += match model.segments[segment].body {
                    Some(_) => Vector3::new(x, y, z),
                    // The first two moments of a segment of a rod are the same.
                    None => Vector3::new(0.5 * (x + y), 0.5 * (x + y), z),
                };
            }
            out.gravity += Vector3::from(self.gravity.0.map(|x| x.lane(lane)));
            (0..2).for_each(|k| out.damping[k] += self.damping[k].lane(lane));
            out.air.add(&self.air[lane]);
        }
        for (&index, by) in &self.loads {
            (0..2).for_each(|k| out.loads[index][k] += by[k]);
        }
        out.friction += self.friction;
    }
}

fn add_in<T: Real>(own: &mut T, lane: usize, by: f64) {
    own.set_lane(lane, own.lane(lane) + by);
}

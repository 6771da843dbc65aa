//! Drag of the air on segments: what it adds to the prediction and, linearly implicit, to the inertia.
//!
//! With the drag F at the step's old velocities (in the wind at its end) and a bound k of the eigenvalues of -dF/dv, the
//! velocity's change is `dt (F + m g) / (m + dt k)`, and `m + dt k` stands in for the mass wherever the step asks for
//! it: linearly implicit Euler, isotropic so that a body's inverse mass remains one number. Where forces balance nothing
//! is left of k; on the way there drag at most halves a relative velocity in a step, however light the segment is. What an
//! added inertia costs is lag, of first order in dt. Rotations across the axis go alike, with `I + dt k l^2 / 12`.

mod step;

use kernels::Spatial;
use kernels::dual::Dual;
use kernels::lane::Real;
use kernels::math::Vec3;
use rod::{Air, Model};

use super::Members;
use super::parts::pick;
use crate::variation::AirVariation;

/// What stays the same of a segment in air.
#[derive(Clone, Copy, Debug)]
struct Exposed<T> {
    /// Mass and moment of inertia across the axis, as they are; those of the step are in the component's constants.
    mass: T,
    transverse: T,
    /// Drag over the square of the speed, across and along the axis [kg/m].
    normal: T,
    tangential: T,
}

/// The air about a component, and what it does in the step under way.
#[derive(Clone, Debug)]
pub(super) struct Drag<T> {
    air: Air,
    bodies: Vec<Exposed<T>>,
    /// What is added to the wind everywhere: zero, with its derivatives where they are asked for [m/s].
    pub(super) breeze: Vec3<T>,
    /// Per segment: change of the velocity beyond that of free fall [m/s], and angular impulse in the body's frame
    /// [kg m^2/s].
    pub(super) impulses: Vec<Spatial<T>>,
}

impl<T: Real> Drag<T> {
    /// Sets of segments in `air`, one a lane; the first also fills the lanes left over.
    pub(super) fn new(air: &Air, model: &Model, sets: &[&Members]) -> Self {
        let count = sets.first().map_or(0, |members| members.segments.len());
        let zero = T::zero();
        let mut bodies = vec![Exposed { mass: zero, transverse: zero, normal: zero, tangential: zero }; count];
        for lane in 0..T::LANES {
            let Some(members) = sets.get(lane).or(sets.first()) else { continue };
            for (body, &index) in bodies.iter_mut().zip(&members.segments) {
                let segment = &model.segments[index];
                // Rigid bodies have a drag of their own.
                let exposed = if segment.body.is_some() { 0.0 } else { segment.length };
                let profile = air.density * segment.radius * exposed;
                body.mass.set_lane(lane, segment.mass());
                body.transverse.set_lane(lane, segment.transverse_inertia());
                body.normal.set_lane(lane, profile * air.normal_drag);
                body.tangential.set_lane(lane, profile * air.tangential_drag);
            }
        }
        Self { air: air.clone(), bodies, breeze: Vec3::zero(), impulses: vec![Spatial::zero(); count] }
    }

    /// Mass [kg] and moment of inertia across the axis [kg m^2] of a segment, without what air adds to them.
    pub(super) fn inertia(&self, body: usize, lane: usize) -> [f64; 2] {
        let Exposed { mass, transverse, .. } = self.bodies[body];
        [mass, transverse].map(|x| x.lane(lane))
    }

    pub(super) fn pick(&self, lane: usize) -> Drag<f64> {
        let exposed = |body: &Exposed<T>| Exposed {
            mass: body.mass.lane(lane),
            transverse: body.transverse.lane(lane),
            normal: body.normal.lane(lane),
            tangential: body.tangential.lane(lane),
        };
        let bodies: Vec<_> = self.bodies.iter().map(exposed).collect();
        Drag {
            air: self.air.clone(),
            impulses: vec![Spatial::zero(); bodies.len()],
            breeze: pick(self.breeze, lane),
            bodies,
        }
    }
}

impl<const D: usize> Drag<Dual<D>> {
    /// Lets the drag of a segment of a rod change along a direction with the air; `profile` is its radius times its length [m^2].
    pub(super) fn seed(&mut self, i: usize, k: usize, profile: f64, air: &Air, by: &AirVariation) {
        let body = &mut self.bodies[i];
        body.normal.slope[k] = profile * (by.density * air.normal_drag + air.density * by.normal_drag);
        body.tangential.slope[k] = profile * (by.density * air.tangential_drag + air.density * by.tangential_drag);
    }

    /// Lets the inertia of a segment change along a direction.
    pub(super) fn seed_inertia(&mut self, i: usize, k: usize, mass: f64, transverse: f64) {
        let body = &mut self.bodies[i];
        (body.mass.slope[k], body.transverse.slope[k]) = (mass, transverse);
    }
}

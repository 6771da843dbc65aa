//! What drag does in the step under way.

use kernels::Spatial;
use kernels::lane::Real;
use kernels::math::Vec3;

use super::Drag;
use crate::Component;
use crate::parts::{get, pick, put, vec3};
use crate::rigid::Rigid;

impl<T: Real> Component<T> {
    /// Inverse mass [1/kg] and moment of inertia across the axis [kg m^2] of a segment in the step under way: in air, with
    /// what drag adds to them. 0 and 1 where it is fixed.
    pub fn inertia(&self, segment: usize) -> [T; 2] {
        let constants = &self.bodies[segment];
        [constants.inverse_mass, constants.transverse]
    }

    /// Sets what [`Component::inertia`] returns: a recorded step's, in a component without air of its own.
    pub fn set_inertia(&mut self, segment: usize, [inverse_mass, transverse]: [T; 2]) {
        let constants = &mut self.bodies[segment];
        (constants.inverse_mass, constants.transverse) = (inverse_mass, transverse);
    }

    /// Whether there is air.
    pub fn has_air(&self) -> bool {
        self.drag.is_some()
    }

    /// Evaluates the drag for a step of `dt` [s] that begins at `time` [s]: before [`Component::predict`], which adds it.
    #[inline(never)]
    pub fn evaluate_drag(&mut self, time: f64, dt: f64) {
        T::dispatch(
            #[inline(always)]
            || self.evaluate_drag_kernel(time, dt),
        )
    }

    #[inline(always)]
    fn evaluate_drag_kernel(&mut self, time: f64, dt: f64) {
        if self.drag.is_none() {
            return;
        }
        self.begin_step(time, dt);
        let Self { drag, bodies, poses, velocities, loads, scratch, gravity, multistep, effective, .. } = self;
        let Some(drag) = drag else { return };
        let Drag { air, bodies: exposed, breeze, impulses } = drag.as_mut();
        let wind = air.wind.at(time + dt);
        let (zero, half, two, h) = (T::zero(), T::splat(0.5), T::splat(2.0), *effective);
        scratch.fill(Spatial::zero());
        for load in loads.iter_mut() {
            load.begin(&poses[load.body].q);
            scratch[load.body].linear += load.force;
        }
        for (i, body) in exposed.iter().enumerate() {
            let (constants, pose, velocity) = (&mut bodies[i], &poses[i], &velocities[i]);
            let axis = pose.q.axis();
            let moving = multistep.as_ref().map_or(velocity.linear, |steps| steps.brought(i).linear);
            // The two Gauss points lie at +-l / (2 sqrt 3).
            let arm = axis * (constants.length * T::splat(GAUSS));
            let turning = velocity.angular.cross(arm);
            let (mut force, mut torque, mut slope, mut swept) = (Vec3::zero(), Vec3::zero(), zero, zero);
            for side in [T::splat(1.0), T::splat(-1.0)] {
                let relative = wind_at(&wind, pose.x + arm * side) + *breeze - moving - turning * side;
                let along = relative.dot(axis);
                let across = relative - axis * along;
                let (normal, tangential) = (body.normal * across.norm_squared().sqrt(), body.tangential * along.abs());
                let share = (across * normal + axis * (along * tangential)) * half;
                force += share;
                torque += arm.cross(share) * side;
                // The larger of the two for both: a mean would not bound the coupling of shift and turn.
                slope = slope.max(normal).max(tangential);
                swept = swept.max(normal * along.abs());
            }
            // What weight and loads will have made of it by the end of the step, at most the terminal speed: else a
            // segment that starts at rest would fall beyond it.
            let pull = *gravity * body.mass + scratch[i].linear;
            let pull_along = pull.dot(axis);
            let pull_across = (pull - axis * pull_along).norm_squared().sqrt();
            slope = slope.max(fallen(body.normal, pull_across, body.mass, h));
            slope = slope.max(fallen(body.tangential, pull_along.abs(), body.mass, h));
            // Twice, for the slope of a square.
            let added = slope * two * h;
            // As a segment shifts, its neighbours turn it in the stream along them. That force is explicit in the pose, and
            // where the air passes many segments within a step it would throw the segment to and fro. Bounding the
            // change's factor by 4 (the stability of symplectic Euler) asks for this much inertia and no more.
            let added = added.max(swept * (h * h / constants.length) - body.mass);
            let free = constants.free;
            let third = constants.length * constants.length * T::splat(1.0 / 12.0);
            constants.inverse_mass = free / (body.mass + added);
            constants.transverse = (body.transverse + added * third) * free + (T::splat(1.0) - free);
            // The prediction adds free fall, with the mass as it is; what the added mass takes from it is taken here.
            let late = *gravity * (added * constants.inverse_mass);
            impulses[i] = Spatial {
                linear: (force * constants.inverse_mass - late) * h,
                angular: pose.q.rotate_back(torque) * (h * free),
            };
        }
        if !self.rigid.is_empty() {
            self.drag_on_rigid(time, dt);
        }
    }

    /// The drag on rigid bodies, at their centres and the same from all sides.
    fn drag_on_rigid(&mut self, time: f64, dt: f64) {
        let Self { drag: Some(drag), bodies, poses, velocities, rigid, scratch, gravity, multistep, effective, .. } =
            self
        else {
            return;
        };
        let Drag { air, impulses, .. } = drag.as_mut();
        let wind = air.wind.at(time + dt);
        for &Rigid { lane, body, mass, drag_area, .. } in rigid.iter() {
            if bodies[body].free.lane(lane) == 0.0 {
                continue;
            }
            let coefficient = 0.5 * air.density * drag_area;
            let moving = multistep.as_ref().map_or(velocities[body].linear, |steps| steps.brought(body).linear);
            let (velocity, gravity, dt) = (pick(moving, lane), pick(*gravity, lane), effective.lane(lane));
            let relative = Vec3(vec3(&wind.velocity(&get(poses[body].x, lane)))) - velocity;
            let slope = coefficient * relative.norm_squared().sqrt();
            let pull = gravity * mass + pick(scratch[body].linear, lane);
            let added = 2.0 * dt * slope.max(fallen(coefficient, pull.norm_squared().sqrt(), mass, dt));
            let inverse_mass = 1.0 / (mass + added);
            bodies[body].inverse_mass.set_lane(lane, inverse_mass);
            let change = (relative * (slope * inverse_mass) - gravity * (added * inverse_mass)) * dt;
            put(&mut impulses[body].linear, lane, change.0);
        }
    }
}

/// Place of a Gauss point along the axis, from the centre, over the length: 1 / (2 sqrt 3).
const GAUSS: f64 = 0.288_675_134_594_812_9;

/// `c v` of the speed v that a constant `force` gives a segment at rest within `dt`, at most the terminal speed.
#[inline(always)]
fn fallen<T: Real>(c: T, force: T, mass: T, dt: T) -> T {
    let (unhindered, terminal) = (c * force * dt / mass, (c * force).sqrt());
    (terminal - unhindered).select(unhindered, terminal)
}

/// Velocity of the air at a place in each lane.
#[inline(always)]
fn wind_at<T: Real>(wind: &rod::WindNow, x: Vec3<T>) -> Vec3<T> {
    let mut velocity = Vec3::zero();
    for lane in 0..T::LANES {
        put(&mut velocity, lane, vec3(&wind.velocity(&get(x, lane))));
    }
    velocity
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nalgebra::Vector3;
    use rod::{Air, Assembly, Material, RodSpec, Wind, shape};

    use super::*;
    use crate::split;

    /// A segment along x that stands still in a wind, and feels no weight: its drag, with the mass that drag adds.
    fn blown(wind: Vector3<f64>, dt: f64) -> (Component<f64>, f64, f64) {
        let material = Material { youngs_modulus: 1e6, torsion_modulus: 1e6, density: 1000.0 };
        let mut assembly = Assembly::new(Vector3::zeros());
        assembly.rod(&RodSpec::new(shape::straight(Vector3::zeros(), Vector3::x(), 0.5, 1), 0.01, material));
        let wind = Wind::new(wind, None, None);
        assembly.air(Air { density: 1.2, normal_drag: 1.1, tangential_drag: 0.05, wind });
        let (model, state) = assembly.finish();
        let (members, topology) = split(&model).swap_remove(0);
        let mut component = Component::new(&model, &state, Arc::new(topology), &[&members]);
        component.evaluate_drag(0.0, dt);
        let segment = &model.segments[0];
        (component, segment.mass(), 1.2 * segment.radius * segment.length)
    }

    #[test]
    fn a_short_step_feels_the_drag_of_the_square_law() {
        let dt = 1e-9;
        for (wind, coefficient) in [(Vector3::z() * 8.0, 1.1), (Vector3::x() * 8.0, 0.05)] {
            let (component, mass, profile) = blown(wind, dt);
            let drag = component.drag.as_ref().unwrap();
            let expected = wind * (profile * coefficient * wind.norm() * dt / mass);
            let found = drag.impulses[0].linear;
            assert!((Vector3::from(found.0) - expected).norm() < 1e-6 * expected.norm(), "{found:?}, not {expected}");
            assert!(drag.impulses[0].angular.norm_squared().sqrt() < 1e-20, "both halves feel the same wind");
        }
    }

    #[test]
    fn however_long_the_step_a_segment_is_never_blown_beyond_the_wind() {
        for dt in [1e-3, 1.0, 1e3, 1e9] {
            let (component, mass, _) = blown(Vector3::z() * 8.0, dt);
            let speed = component.drag.as_ref().unwrap().impulses[0].linear.0[2];
            // The slope of the square is twice its secant: at most half of the relative speed in a step.
            assert!((0.0..=4.0 + 1e-9).contains(&speed), "{dt} s: {speed} m/s");
            assert!(component.inertia(0)[0] <= 1.0 / mass);
        }
    }
}

//! Energy: kinetic energy of what moves freely, and that of its joints, grow by no more than the work that is done on them.
//!
//! Work is that of gravity and loads, of what is held on its way, of obstacles that move, and at most that of the wind. Implicit
//! Euler takes energy from whatever is convex; what it may give beside is of second order in the step's turns, `(F r + M)
//! turn^2` of each joint, and of the tolerances. M is what the strain asks for, `K kappa`, and not the torque that comes of it, the cosine of half the angle
//! times as much: a joint that is bent by more than a quarter of a turn softens, `d^2 E / d angle^2 >= -M / 2`, until its torque is zero at half a turn. What is stored in joints that yield little is that of their forces: their
//! gaps are below the tolerance. Joints with laws count with what can be had back of them.

use cosserat::simulation::{Status, StepParams, Touched};
use cosserat::state::{Body, Freedom, InelasticJoint, Joint, JointForce, Model, Pose, Segment, State, measure};
use nalgebra::{UnitQuaternion, Vector3};

use crate::law::{EPSILON, Law, ROUNDING, Violation};
use crate::step::{MOST_TURN, Step};

/// Energy over the steps so far.
#[derive(Default)]
pub(crate) struct EnergyBalance {
    /// Won beyond the work that was done, less what is allowed in each step [J].
    won: f64,
    /// What is allowed of fluctuations, at most [J].
    fluctuation: f64,
    /// By how much forces that are given have changed, of which a rule of second order carries a third from step to step [N].
    jump: f64,
    /// Whether the last step was not solved: what its joints store, which may gape, is not that of the forces that they tell. Or whether one turned past half a turn.
    is_unsolved: bool,
}

/// Energies of a state [J].
struct Stored {
    kinetic: f64,
    turning: f64,
    joints: f64,
}

fn stored(model: &Model, state: &State, forces: &[JointForce]) -> Stored {
    // Before the first step they are those of rest.
    let internals = (0..model.laws.len()).map(|k| state.internals.get(k).cloned().unwrap_or_default());
    let free = model.segments.iter().enumerate().filter(|(_, segment)| !segment.fixed);
    let moving: f64 = free.map(|(i, segment)| 0.5 * segment.mass() * state.velocities[i].norm_squared()).sum();
    // Joints between what is held at both ends do nothing to what moves freely.
    let is_held = |body: Body| match body {
        Body::Segment(i) => model.segments[i].fixed,
        Body::Anchor(_) => true,
    };
    let nothing = Model { joints: Vec::new(), loads: Vec::new(), laws: Vec::new(), ..model.clone() };
    let (mut own, mut joints) = (nothing, 0.0);
    let mut state = State { internals: Vec::new(), ..state.clone() };
    let mut laws = model.laws.iter().zip(internals).peekable();
    for (index, (joint, force)) in model.joints.iter().zip(forces).enumerate() {
        let law = laws.next_if(|(law, _)| law.joint == index);
        if model.is_open(joint) || is_held(joint.a) && is_held(joint.b) {
            continue;
        }
        if is_rigid(joint) {
            // In the place of what gaps within the tolerance would store.
            joints += elastic(model, &state, joint, &force.force) - gap(model, &state, joint);
        }
        if let Some((law, at)) = law {
            own.laws.push(InelasticJoint { joint: own.joints.len(), law: law.law.clone() });
            state.internals.push(at);
        }
        own.joints.push(*joint);
    }
    let energy = measure::energy(&own, &state);
    joints += energy.bend + energy.stretch;
    let kinetic = energy.kinetic;
    Stored { kinetic, turning: (kinetic - moving).max(0.0), joints }
}

/// By how much the linear part of `m (|v|^2 + |2 v - u|^2) / 4`, which steps of second order keep, is above that of the kinetic energy
/// [J]: u are the velocities a step before v.
fn multistep(step: &Step<'_>, states: [&State; 2]) -> f64 {
    let free = (0..step.model.segments.len()).filter(|&i| step.is_free(i));
    let of = |i: usize| {
        let [u, v] = states.map(|state| state.velocities[i]);
        0.25 * step.model.segments[i].mass() * ((v * 2.0 - u).norm_squared() - v.norm_squared())
    };
    free.map(of).sum()
}

fn is_rigid(joint: &Joint) -> bool {
    joint.stretch_compliance.max(joint.shear_compliance) <= Joint::RIGID
}

/// What a joint stores whose gap answers with this force [J].
fn elastic(model: &Model, state: &State, joint: &Joint, force: &Vector3<f64>) -> f64 {
    let own = model.pose(joint.a, state).orientation.inverse() * force;
    let [x, y, z] = [own.x, own.y, own.z].map(|x| 0.5 * x * x);
    x * joint.shear_compliance + y * (joint.shear_compliance + joint.shear_extra) + z * joint.stretch_compliance
}

/// What a joint's gap stores [J].
fn gap(model: &Model, state: &State, joint: &Joint) -> f64 {
    let own = model.pose(joint.a, state).orientation.inverse() * measure::stretch_gap(model, state, joint);
    let of = |x: f64, compliance: f64| if compliance > 0.0 { 0.5 * x * x / compliance } else { 0.0 };
    of(own.x, joint.shear_compliance)
        + of(own.y, joint.shear_compliance + joint.shear_extra)
        + of(own.z, joint.stretch_compliance)
}

/// Rotation vector from one orientation to another.
fn turn(from: &UnitQuaternion<f64>, to: &UnitQuaternion<f64>) -> Vector3<f64> {
    (to * from.inverse()).scaled_axis()
}

/// Way of the place of a body that is at `place` after the step.
fn displacement(before: &Pose, after: &Pose, place: &Vector3<f64>) -> Vector3<f64> {
    let own = after.orientation.inverse() * (place - after.position);
    place - (before.position + before.orientation * own)
}

/// Work done from outside in the step [J], and what is allowed beyond it but for fluctuations.
struct Work {
    done: f64,
    allowed: f64,
    /// Whether it is known though the step was done in parts.
    is_steady: bool,
}

fn work(step: &Step<'_>) -> Work {
    let (model, [before, after]) = (step.model, step.states);
    let mut sum = Work { done: 0.0, allowed: 0.0, is_steady: model.changes.is_empty() && model.air.is_none() };
    for (i, segment) in model.segments.iter().enumerate().filter(|(i, _)| step.is_free(*i)) {
        sum.done += segment.mass() * model.gravity.dot(&(after.positions[i] - before.positions[i]));
    }
    for load in model.loads.iter().filter(|load| step.is_free(load.segment)) {
        let i = load.segment;
        sum.is_steady &= !load.follows;
        let place = |state: &State| state.positions[i] + state.axis(i) * load.offset;
        let angle = turn(&before.orientations[i], &after.orientations[i]);
        let [force, torque] = step.load(load);
        sum.done += force.dot(&(place(after) - place(before))) + torque.dot(&angle);
        sum.allowed += (load.force.norm() * load.offset.abs() + load.torque.norm()) * step.turn(i).powi(2);
    }
    let tolerance = step.tolerance();
    // Forces turn with the bodies on their ways; in `xpbd` they are those of the iterates, too, and the
    // geometric stiffness begins with the pulls of the step before.
    let (order, stiff) = if step.is_newton() { (1.0, 0.0) } else { (2.0, 1.0) };
    for (k, joint, force) in step.joints() {
        let ends = [joint.a, joint.b].map(|body| step.free_end(body));
        let (size, bent) = (force.force.norm(), force.moment.norm().max(of_strain(step, k, joint)));
        for (end, body) in [joint.a, joint.b].into_iter().enumerate() {
            let [on_it, moment, arm] = step.pull(joint, force, end);
            let other = ends[1 - end];
            match ends[end] {
                Some(i) => {
                    let old = step.forces[0].get(k).map_or(0.0, |old| old.force.norm() * arm.norm());
                    let now = size * arm.norm() + bent;
                    sum.allowed += (order * now + stiff * old) * step.turn(i).powi(2);
                }
                None if other.is_some() => {
                    // What is held gives the opposite of what it feels.
                    let [from, to] = step.poses(body);
                    let far = displacement(&from, &to, &(to.position + arm));
                    let angle = turn(&from.orientation, &to.orientation);
                    let old = step.forces[0].get(k).map_or(size, |old| old.force.norm());
                    sum.done -= on_it.dot(&far) + moment.dot(&angle);
                    sum.allowed += order * (size * arm.norm() + bent) * angle.norm_squared();
                    if !step.is_euler() {
                        sum.allowed += 0.5 * (size + old) * far.norm() + moment.norm() * angle.norm();
                    }
                    sum.is_steady &= far.norm() == 0.0 && angle.norm() == 0.0;
                }
                None => {}
            }
        }
        if ends.iter().any(Option::is_some) {
            // Joints that yield otherwise along their axis than across leave out the moment of their gap (docs/accuracy.md).
            if joint.shear_compliance != joint.stretch_compliance || joint.shear_extra != 0.0 {
                let moment = measure::stretch_gap(model, after, joint).cross(&force.force).norm();
                let turned = [joint.a, joint.b].map(|body| step.poses(body).map(|pose| pose.orientation));
                sum.allowed += moment * turned.map(|[from, to]| from.angle_to(&to)).iter().sum::<f64>();
            }
            sum.allowed += 2.0 * tolerance * (size * joint.length + force.moment.norm());
            let stiffest =
                joint.bend_twist_compliance().iter().copied().filter(|&x| x > 0.0).fold(f64::INFINITY, f64::min);
            sum.allowed += 0.5 * (tolerance / joint.length).powi(2) / stiffest;
            if !is_rigid(joint) {
                let stiffest = joint.stretch_compliance.min(joint.shear_compliance).max(Joint::RIGID);
                sum.allowed += 0.5 * (tolerance * joint.length).powi(2) / stiffest;
            }
        }
    }
    eyelets(step, &mut sum);
    contacts(step, &mut sum);
    sum.allowed += wind(step);
    sum
}

/// The moment that the strain of an elastic joint asks for [N m]: see above.
fn of_strain(step: &Step<'_>, k: usize, joint: &Joint) -> f64 {
    if joint.freedom != Freedom::None || step.model.laws.iter().any(|law| law.joint == k) {
        return 0.0;
    }
    let strain = measure::bend_strain(step.model, step.states[1], joint);
    let stiff = joint.bend_twist_compliance().map(|x| if x > 0.0 { 1.0 / x } else { 0.0 });
    strain.component_mul(&stiff).norm() / joint.length
}

/// Work of what holds eyelets through which rods run that move freely.
fn eyelets(step: &Step<'_>, sum: &mut Work) {
    for (joint, sliding) in step.model.sliding_joints.iter().zip(step.sliding) {
        if step.free_end(joint.holder).is_some() || !step.is_free(joint.segments.start) {
            continue;
        }
        let [from, to] = step.poses(joint.holder);
        let place = to.position + to.orientation * joint.place;
        let (far, angle) = (displacement(&from, &to, &place), from.orientation.angle_to(&to.orientation));
        let size = sliding.force.norm();
        sum.done += sliding.force.dot(&far);
        sum.allowed += size * joint.place.norm() * angle.powi(2);
        if !step.is_euler() {
            sum.allowed += size * far.norm();
        }
        sum.is_steady &= far.norm() == 0.0;
    }
}

/// Whether a rod that runs through an eyelet is held and moves there: by what forces of its segments is not told.
fn leads_eyelets(step: &Step<'_>) -> bool {
    let moves = |i: usize| !step.is_free(i) && step.poses(Body::Segment(i))[0] != step.poses(Body::Segment(i))[1];
    step.model.sliding_joints.iter().any(|joint| joint.segments.clone().any(moves))
}

/// Work of contacts: of obstacles and held segments that move, and what they may give within their tolerance.
fn contacts(step: &Step<'_>, sum: &mut Work) {
    let model = step.model;
    sum.is_steady &= model.contacts.obstacles.iter().all(|obstacle| obstacle.motion.is_none());
    for contact in step.contacts {
        let normal = contact.force.norm();
        let bodies = match contact.other {
            Touched::Segment(i) => vec![contact.segment, i],
            Touched::Obstacle(k) => {
                let obstacle = &model.contacts.obstacles[k];
                let [from, to] = [step.time - step.dt, step.time].map(|time| obstacle.at(time).pose);
                let far = displacement(&from, &to, &contact.place);
                sum.done += contact.force.dot(&far);
                sum.allowed += 0.5
                    * normal
                    * (contact.place - to.position).norm()
                    * from.orientation.angle_to(&to.orientation).powi(2);
                vec![contact.segment]
            }
        };
        for (k, i) in bodies.iter().copied().enumerate() {
            let radius = model.segments[i].radius;
            let slip = contact.slip.norm();
            sum.allowed += normal * (2.0 * StepParams::DEFAULT.contact_tolerance * radius);
            sum.allowed += 0.5 * normal * (slip * slip / radius.max(slip) + step.reach(i) * step.turn(i).powi(2));
            if !step.is_free(i) {
                let [from, to] = step.poses(Body::Segment(i));
                let sign = if k == 0 { -1.0 } else { 1.0 };
                let far = displacement(&from, &to, &contact.place);
                sum.done += sign * contact.force.dot(&far);
                sum.is_steady &= far.norm() == 0.0;
            }
        }
    }
}

/// The most that the wind can do in the step [J]: its force in its own direction.
fn wind(step: &Step<'_>) -> f64 {
    let Some(air) = &step.model.air else { return 0.0 };
    let now = air.wind.at(step.time);
    let mut most = 0.0;
    for (i, segment) in step.model.segments.iter().enumerate().filter(|(i, _)| step.is_free(*i)) {
        let area = match &segment.body {
            Some(body) => 0.5 * body.drag_area,
            None => segment.length * segment.radius * air.normal_drag.max(air.tangential_drag),
        };
        let speed = step
            .states
            .map(|state| state.velocities[i].norm() + 0.5 * segment.length * state.angular_velocities[i].norm());
        let wind = now.velocity(&step.states[0].positions[i]).norm();
        let [before, after] = speed;
        let force = air.density * area * (wind + before.max(after)).powi(2);
        // The force is that of the velocity before; its change within the step takes more than it gives.
        most += force * (wind + (after - before).abs());
    }
    most * step.dt
}

/// Energy of what positions and angles are rounded by [J].
fn rounding(step: &Step<'_>) -> f64 {
    let (model, state) = (step.model, step.states[1]);
    let moved = |i: usize| {
        let (segment, far) = (&model.segments[i], EPSILON * state.positions[i].norm());
        let inertia = segment.transverse_inertia().max(segment.axial_inertia());
        0.5 * (segment.mass() * far.powi(2) + inertia * EPSILON.powi(2)) / step.dt.powi(2)
    };
    let bent = |joint: &Joint| {
        let stiffness = joint.bend_twist_compliance().map(|x| if x > 0.0 { 1.0 / x } else { 0.0 });
        0.5 * (EPSILON / joint.length).powi(2) * stiffness.sum()
    };
    let free = (0..model.segments.len()).filter(|&i| step.is_free(i));
    free.map(moved).sum::<f64>() + step.joints().map(|(_, joint, _)| bent(joint)).sum::<f64>()
}

/// By how much gravity and loads change in the step [N].
fn jump(step: &Step<'_>) -> f64 {
    let [before, after] = [step.model_before, step.model];
    let mass: f64 = after.segments.iter().filter(|segment| !segment.fixed).map(Segment::mass).sum();
    let loads = before.loads.iter().zip(&after.loads);
    (after.gravity - before.gravity).norm() * mass + loads.map(|(a, b)| (a.force - b.force).norm()).sum::<f64>()
}

impl EnergyBalance {
    /// Holds a step against the law, and all steps so far.
    pub(crate) fn step(&mut self, step: &Step<'_>, violations: &mut Vec<Violation>) {
        let model = step.model;
        let work = work(step);
        self.jump = self.jump / 3.0 + jump(step);
        let is_known = step.is_whole()
            || (step.status == Status::ConvergedInSubsteps && work.is_steady && !model.contacts.is_empty());
        // What feeds and pulleys do is not told.
        let is_fed = model.sliding_joints.iter().any(|joint| joint.feed.is_some())
            || !model.pulleys.is_empty()
            || leads_eyelets(step);
        let jumps = step.status == Status::PastHalfTurn;
        let was_unsolved = std::mem::replace(&mut self.is_unsolved, jumps || !step.is_solved());
        let grips = (0..model.anchors.len()).map(|i| {
            let [from, to] = step.poses(Body::Anchor(i));
            from.orientation.angle_to(&to.orientation)
        });
        let turned = (0..model.segments.len()).map(|i| step.turn(i)).chain(grips).fold(0.0, f64::max);
        if !is_known || was_unsolved || is_fed || model.contacts.allow_overlap || turned > MOST_TURN {
            *self = Self { jump: self.jump, is_unsolved: self.is_unsolved, ..Self::default() };
            return;
        }
        let [before, after] = step.states;
        let (old, new) = (stored(step.model_before, before, step.forces[0]), stored(model, after, step.forces[1]));
        let change = new.kinetic + new.joints - old.kinetic - old.joints;
        let mut won = change - work.done;
        if let (false, Some(earlier)) = (step.is_euler(), step.earlier) {
            // What the backward differences of second order keep is another energy (Dahlquist's G-stability).
            let energies = [multistep(step, [earlier, before]), multistep(step, [before, after])];
            won = won.min(won + energies[1] - energies[0]);
        }
        // Rates stand for the discrete momenta of turns to second order.
        let mut fluctuation = 0.25 * turned.min(1.0).powi(2) * (old.turning + new.turning);
        let mut changing = 0.0;
        // What contacts press may gain by so much of its kinetic energy.
        if !model.contacts.is_empty() {
            fluctuation += 0.02 * old.kinetic;
        }
        if !step.is_euler() {
            let change = |i: usize| (after.velocities[i] - before.velocities[i]).norm_squared();
            let spin = |i: usize| (after.angular_velocities[i] - before.angular_velocities[i]).norm_squared();
            for (i, segment) in model.segments.iter().enumerate().filter(|(i, _)| step.is_free(*i)) {
                let inertia = segment.transverse_inertia().max(segment.axial_inertia());
                fluctuation += 0.5 * segment.mass() * change(i) + 0.5 * inertia * spin(i);
            }
            let far = |i: usize| (after.positions[i] - before.positions[i]).norm() + step.reach(i) * step.turn(i);
            let farthest = (0..model.segments.len()).filter(|&i| step.is_free(i)).map(far).fold(0.0, f64::max);
            // Forces that change count as at the end of the step on a way of second order.
            changing = self.jump * farthest;
        }
        let rounding = ROUNDING * (old.kinetic + old.joints.abs() + new.kinetic + new.joints.abs() + work.done.abs())
            + rounding(step);
        let allowed = work.allowed + changing + rounding;
        step.hold(violations, Law::Energy, won, allowed + fluctuation, || {
            format!(
                "{:.4e} J grow by {won:.3e} J more than the work done ({:.3e} J), allowed {:.1e} J",
                old.kinetic + old.joints,
                work.done,
                allowed + fluctuation
            )
        });
        self.won += won - allowed;
        self.fluctuation = self.fluctuation.max(fluctuation);
        if self.won > self.fluctuation {
            step.hold(violations, Law::Energy, self.won, self.fluctuation, || {
                format!("over all steps energy has grown by {:.3e} J more than work and tolerances say", self.won)
            });
        }
        // It may have lost as much as it likes.
        self.won = self.won.max(0.0);
    }
}

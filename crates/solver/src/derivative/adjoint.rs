//! The adjoint of a connected set's steps: the derivative of one number with respect to all that they depend on, backwards in
//! time.
//!
//! With the Jacobian A of a step's equations in its poses and multipliers, and the derivatives b of the number with respect to
//! the poses at its end, `A^T x = b` is solved. What the step begins with, and parameters, enter its equations body by body and
//! joint by joint (`component/adjoint.rs`), and x says what that does with the number.

use std::sync::Arc;

use nalgebra::{SVector, Vector3, Vector6};
use rod::{JointForce, Model, State};

use super::duals::Duals;
use super::forward::six;
use super::recording::{Pair, Wanted};
use super::replay::Replay;
use super::{StateVariation, Substep, Variation};
use crate::component::{BodyBar, BodyGradient, Component, Ended, Members, add_numbers};
use crate::integrator::Integrator;
use crate::kernel::Spatial;
use crate::kernel::math::Vec3;
use crate::tangent::jacobian::{Field, split as parts};

/// Where a run begins, and how it is integrated.
#[derive(Clone)]
pub(super) struct Origin {
    pub(super) state: Arc<State>,
    pub(super) integrator: Integrator,
}

/// A connected set on its way back.
pub(super) struct Adjoint {
    pub(super) members: Members,
    replay: Replay,
    origin: Origin,
    /// Made where they are needed: dual numbers take much memory.
    duals: Option<Duals>,
    /// Derivatives with respect to the state between two steps, one entry a body.
    bars: Vec<BodyBar>,
    /// Those with respect to velocities as they are told, and whether any is not zero.
    told: Vec<Spatial<f64>>,
    is_told: bool,
    /// Those with respect to what joints transmit; empty where nobody asks.
    transmitted: Vec<JointForce>,
    memory: Memory,
}

/// Memory of a step back.
struct Memory {
    field: Field,
    moved: Field,
    /// The field's rows of bodies; of those that are held, derivatives with respect to their poses at the end.
    bodies: Vec<Spatial<f64>>,
    /// Of bodies that are held, derivatives with respect to their poses at the start, which contacts know.
    before: Vec<Spatial<f64>>,
    /// Of obstacles, the same at the start and at the end, one entry a contact.
    obstacles: Vec<(usize, [Pair; 2])>,
    ended: Vec<Ended>,
    gradients: Vec<BodyGradient>,
    /// Bars at the start of the step.
    start: Vec<BodyBar>,
}

fn vector(x: Vec3<f64>) -> Vector3<f64> {
    Vector3::from(x.0)
}

fn pair(x: Spatial<f64>) -> Pair {
    [vector(x.linear), vector(x.angular)]
}

fn spatial([linear, angular]: Pair) -> Spatial<f64> {
    Spatial { linear: Vec3(linear.into()), angular: Vec3(angular.into()) }
}

fn add(own: &mut Spatial<f64>, by: Spatial<f64>) {
    *own = own.plus(by, 1.0);
}

impl Adjoint {
    /// That of a set at the start of a run.
    pub(super) fn new(members: Members, replay: Replay, origin: Origin) -> Self {
        let bodies = replay.topology.bodies();
        let field = Field::zero(&replay.topology);
        let memory = Memory {
            moved: field.clone(),
            field,
            bodies: vec![Spatial::zero(); bodies],
            before: vec![Spatial::zero(); bodies],
            obstacles: Vec::new(),
            ended: Vec::with_capacity(bodies),
            gradients: Vec::with_capacity(bodies),
            start: vec![BodyBar::default(); bodies],
        };
        let (bars, told) = (vec![BodyBar::default(); bodies], vec![Spatial::zero(); bodies]);
        let transmitted = Vec::new();
        Self { members, replay, origin, duals: None, bars, told, is_told: false, transmitted, memory }
    }

    fn component(&self) -> &Component<f64> {
        &self.replay.component
    }

    /// Bodies that are held.
    pub(super) fn held(&self) -> Vec<usize> {
        (0..self.bars.len()).filter(|&body| self.component().is_still(body)).collect()
    }

    /// Forgets all derivatives.
    pub(super) fn begin(&mut self) {
        self.bars.fill(BodyBar::default());
        self.told.fill(Spatial::zero());
        self.is_told = false;
        self.transmitted.clear();
    }

    /// A fixed segment that nothing moves stays where it began.
    pub(super) fn add_base(&self, body: usize, pose: Pair, out: &mut Variation) {
        if let Some(&i) = self.members.segments.get(body)
            && !self.component().is_moved(body)
        {
            out.start.positions[i] += pose[0];
            out.start.turns[i] += pose[1];
        }
    }

    /// Adds the derivatives with respect to the state after a step.
    pub(super) fn add_objective(&mut self, objective: &[(usize, StateVariation)], step: usize) {
        for (_, of) in objective.iter().filter(|(own, _)| *own == step) {
            for (body, &i) in self.members.segments.iter().enumerate() {
                add(&mut self.bars[body].pose, spatial([of.positions[i], of.turns[i]]));
                if !self.replay.component.is_still(body) {
                    let told = spatial([of.velocities[i], of.angular_velocities[i]]);
                    self.is_told |= told != Spatial::zero();
                    add(&mut self.told[body], told);
                }
            }
            if !of.forces.is_empty() {
                self.transmitted.resize(self.members.joints.len(), JointForce::default());
            }
            for (own, of) in
                self.transmitted.iter_mut().zip(self.members.joints.iter().map_while(|&j| of.forces.get(j)))
            {
                own.force += of.force;
                own.moment += of.moment;
            }
        }
    }

    /// What is left at the start of the run.
    pub(super) fn end(&self, out: &mut Variation) {
        for (body, &i) in self.members.segments.iter().enumerate() {
            let BodyBar { pose, velocity, now, .. } = &self.bars[body];
            if self.component().is_still(body) {
                self.add_base(body, pair(*pose), out);
                continue;
            }
            // Velocities that are given are those over the last step and those at its end; momenta follow from them.
            let given = velocity.plus(self.told[body], 1.0);
            out.start.positions[i] += vector(pose.linear);
            out.start.turns[i] += vector(pose.angular);
            out.start.velocities[i] += vector(given.linear + now.linear);
            out.start.angular_velocities[i] += vector(given.angular);
        }
    }

    /// The derivatives with respect to the poses of a held body at the start and at the end of the step that has been gone back
    /// over.
    pub(super) fn of_held(&self, body: usize) -> [Pair; 2] {
        [&self.memory.before, &self.memory.bodies].map(|poses| pair(poses[body]))
    }

    /// The same with respect to the poses of obstacles, one entry a contact that presses.
    pub(super) fn of_obstacles(&self) -> &[(usize, [Pair; 2])] {
        &self.memory.obstacles
    }

    /// Goes back over a step: derivatives with respect to the state at its end become those at its start; `None` where its
    /// equations are singular.
    pub(super) fn step_back(
        &mut self,
        model: &Model,
        substep: &Substep,
        wanted: Wanted,
        out: &mut Variation,
    ) -> Option<()> {
        let Self { members, replay, origin, duals, bars, told, is_told, transmitted, memory } = self;
        let Memory { field, moved, bodies, before, obstacles, ended, gradients, start } = memory;
        replay.component.begin_at(&substep.begin);
        let jacobian = replay.linearise(substep)?;
        let topology = replay.topology.clone();
        let make = || Duals::new(model, origin, (members, &topology));
        if std::mem::take(is_told) {
            let moments = duals.get_or_insert_with(make).tell(substep, told, bars);
            if wanted.segments {
                moments.iter().enumerate().for_each(|(body, x)| add_inertia(out, members.segments[body], x));
            }
            told.fill(Spatial::zero());
        }

        let component = &replay.component;
        field.joints.fill(Vector6::zeros());
        for (j, of) in transmitted.drain(..).enumerate() {
            let (of_y, turn) = component.transmitted_back(j, &of);
            field.joints[j] = six(pair(of_y));
            let [a, b] = topology.joints[j].map(|body| body as usize);
            bars[a].pose.angular -= turn;
            bars[b].pose.angular += turn;
        }
        if substep.begins_anew {
            let Variation { gravity, loads, segments, .. } = &mut *out;
            component.begin_anew_back(
                bars,
                |of_gravity| {
                    if wanted.surroundings {
                        *gravity += vector(of_gravity);
                    }
                },
                |index, body, of_force, of_mass| {
                    if wanted.loads {
                        loads[index][0] += vector(of_force);
                    }
                    if wanted.segments {
                        segments[members.segments[body]].mass += of_mass;
                    }
                },
            );
        }
        ended.clear();
        for (i, bar) in bars.iter().enumerate() {
            let own = if component.is_still(i) { Ended::default() } else { component.end_back(i, bar) };
            field.bodies[i] = six(pair(bar.pose.plus(own.pose, 1.0)));
            ended.push(own);
        }
        replay.solve(&jacobian, field, true);
        let component = &replay.component;
        jacobian.apply(field, true, moved);

        gradients.clear();
        for i in 0..bars.len() {
            let own = spatial(parts(&field.bodies[i]));
            start[i] = BodyBar::default();
            if component.is_still(i) {
                bodies[i] = bars[i].pose.plus(spatial(parts(&moved.bodies[i])), -1.0);
                gradients.push(BodyGradient::default());
                continue;
            }
            bodies[i] = own;
            let (bar, gradient) = component.start_back(i, own, &ended[i]);
            start[i] = bar;
            gradients.push(gradient);
        }
        before.fill(Spatial::zero());
        obstacles.clear();
        for (contact, of) in substep.touching.iter().enumerate() {
            let own = replay.contacts.fixed_rows::<3>(replay.equations_of(contact));
            out.friction -= of.by_friction.dot(&own);
            let mut at_end = -of.by_pose.tr_mul(&own);
            for (side, body) in of.sides() {
                at_end += of.push_by_pose.fixed_rows::<6>(6 * side).tr_mul(&field.bodies[body]);
            }
            let at_start = -of.by_start.tr_mul(&own);
            let part = |of: &SVector<f64, 12>, side: usize| spatial(parts(&of.fixed_rows::<6>(6 * side).into()));
            for (side, body) in of.sides() {
                if component.is_still(body) {
                    add(&mut bodies[body], part(&at_end, side));
                    add(&mut before[body], part(&at_start, side));
                } else {
                    add(&mut start[body].pose, part(&at_start, side));
                }
            }
            if let Some(obstacle) = of.obstacle.filter(|_| wanted.obstacles) {
                obstacles.push((obstacle, [&at_start, &at_end].map(|of| pair(part(of, 1)))));
            }
        }
        for (j, own) in field.joints.iter().enumerate() {
            let own = spatial(parts(own));
            component.memory_back(j, own, start);
            if wanted.joints {
                add_numbers(&mut out.joints[members.joints[j]], &component.joint_back(j, own));
            }
        }
        component.loads_back(bodies, |index, body, [force, torque], of_mass| {
            gradients[body].mass += of_mass;
            if wanted.loads {
                out.loads[index][0] += vector(force);
                out.loads[index][1] += vector(torque);
            }
        });
        if component.has_air() {
            duals.get_or_insert_with(make).drag_back(
                substep,
                (model, members),
                (component, gradients, wanted),
                start,
                out,
            );
        }
        for (body, &i) in members.segments.iter().enumerate().filter(|(body, _)| !component.is_still(*body)) {
            let own = &gradients[body];
            if wanted.segments {
                out.segments[i].mass += own.mass;
                add_inertia(out, i, &(vector(own.moments) + vector(own.own_moments)));
            }
            if wanted.surroundings {
                out.gravity += vector(own.gravity);
                (0..2).for_each(|k| out.damping[k] += own.damping[k]);
            }
        }
        std::mem::swap(bars, start);
        Some(())
    }
}

/// Adds derivatives with respect to three moments of inertia of a segment of a rod, whose first two are the same.
fn add_inertia(out: &mut Variation, segment: usize, moments: &Vector3<f64>) {
    let across = 0.5 * (moments.x + moments.y);
    out.segments[segment].inertia += Vector3::new(across, across, moments.z);
}

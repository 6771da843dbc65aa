//! The adjoint of steps: the derivative of one number with respect to all that they depend on, backwards in time, of a connected set
//! or of alike ones in lanes.
//!
//! With the Jacobian A of a step's equations in its poses and multipliers, and the derivatives b of the number with respect to
//! the poses at its end, `A^T x = b` is solved. What the step begins with, and parameters, enter its equations body by body and
//! joint by joint (`component/adjoint.rs`), and x says what that does with the number.

use std::sync::Arc;

use component::{BodyBar, BodyGradient, Component, Ended, Members, copy_spatial, pick_spatial};
use dynamics::substep::Substep;
use jointed::tangent::jacobian::{Field, joined, six, split};
use jointed::topology::Topology;
use kernels::Spatial;
use kernels::lane::Real;
use nalgebra::{SVector, Vector3};
use rod::Model;

use super::duals::Duals;
use super::origin::Origin;
use super::parameter_gradient::ParameterGradient;
use super::replay::Replay;
use super::wanted::{Pair, Wanted};
use super::{DerivativeError, StateVariation, Variation};

/// Connected sets on their way back, one a lane.
pub(super) struct Adjoint<T> {
    pub(super) sets: Vec<Members>,
    replay: Replay<T>,
    origin: Origin,
    /// Made where they are needed, one a lane: dual numbers take much memory.
    duals: Vec<Option<Duals>>,
    /// Derivatives with respect to the state between two steps, one entry a body.
    bars: Vec<BodyBar<T>>,
    /// Those with respect to velocities as they are told, and whether any is not zero.
    told: Vec<Spatial<T>>,
    is_told: bool,
    /// Those with respect to what joints transmit, force and moment; empty where nobody asks.
    transmitted: Vec<Spatial<T>>,
    gains: ParameterGradient<T>,
    memory: Memory<T>,
}

/// Memory of a step back.
struct Memory<T> {
    field: Field<T>,
    moved: Field<T>,
    /// The field's rows of bodies; of those that are held, derivatives with respect to their poses at the end.
    bodies: Vec<Spatial<T>>,
    /// Of bodies that are held, derivatives with respect to their poses at the start, which contacts know.
    before: Vec<Spatial<T>>,
    /// Of obstacles, the same at the start and at the end, one entry a contact.
    obstacles: Vec<(usize, [Pair; 2])>,
    ended: Vec<Ended<T>>,
    gradients: Vec<BodyGradient<T>>,
    /// Bars at the start of the step.
    start: Vec<BodyBar<T>>,
}

#[inline(always)]
fn add<T: Real>(own: &mut Spatial<T>, by: Spatial<T>) {
    *own = own.plus(by, T::splat(1.0));
}

fn add_in<T: Real>(own: &mut Spatial<T>, lane: usize, by: Spatial<f64>) {
    let sum = pick_spatial(own, lane).plus(by, 1.0);
    copy_spatial(own, lane, &sum, 0);
}

impl<T: Real> Adjoint<T> {
    /// That of sets with the same connectivity, at the start of a run.
    ///
    /// # Errors
    /// If there are too many loops.
    pub(super) fn new(
        model: &Model,
        origin: &Origin,
        (sets, topology): (Vec<Members>, &Arc<Topology>),
    ) -> Result<Self, DerivativeError> {
        let lanes: Vec<&Members> = sets.iter().collect();
        let replay = Replay::new(model, &origin.state, origin.integrator, (&lanes, topology))?;
        let bodies = topology.bodies();
        let field = Field::zero(topology);
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
        Ok(Self {
            replay,
            origin: origin.clone(),
            duals: sets.iter().map(|_| None).collect(),
            bars: vec![BodyBar::default(); bodies],
            told: vec![Spatial::zero(); bodies],
            is_told: false,
            transmitted: Vec::new(),
            gains: ParameterGradient::zero(sets.len(), [topology.joints.len(), bodies]),
            memory,
            sets,
        })
    }

    fn component(&self) -> &Component<T> {
        &self.replay.component
    }

    pub(super) fn topology(&self) -> &Arc<Topology> {
        &self.replay.topology
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
        self.gains = ParameterGradient::zero(self.sets.len(), [self.replay.topology.joints.len(), self.bars.len()]);
    }

    /// A fixed segment that nothing moves stays where it began.
    pub(super) fn add_base(&self, lane: usize, body: usize, pose: Spatial<f64>, out: &mut Variation) {
        if let Some(&i) = self.sets[lane].segments.get(body)
            && !self.component().is_moved(body, lane)
        {
            let [shift, turn] = split(pose);
            out.start.positions[i] += shift;
            out.start.turns[i] += turn;
        }
    }

    /// Adds the derivatives with respect to the state after a step.
    pub(super) fn add_objective(&mut self, objective: &[(usize, StateVariation)], step: usize) {
        for (_, of) in objective.iter().filter(|(own, _)| *own == step) {
            for (lane, members) in self.sets.iter().enumerate() {
                for (body, &i) in members.segments.iter().enumerate() {
                    add_in(&mut self.bars[body].pose, lane, joined([of.positions[i], of.turns[i]]));
                    if !self.replay.component.is_still(body) {
                        let told = joined([of.velocities[i], of.angular_velocities[i]]);
                        self.is_told |= told != Spatial::zero();
                        add_in(&mut self.told[body], lane, told);
                    }
                }
                if !of.forces.is_empty() {
                    self.transmitted.resize(members.joints.len(), Spatial::zero());
                }
                let forces = members.joints.iter().map_while(|&j| of.forces.get(j));
                for (own, of) in self.transmitted.iter_mut().zip(forces) {
                    add_in(own, lane, joined([of.force, of.moment]));
                }
            }
        }
    }

    /// What is left at the start of the run, and all that was gained on the way.
    pub(super) fn end(&self, model: &Model, out: &mut Variation) {
        for (lane, members) in self.sets.iter().enumerate() {
            for (body, &i) in members.segments.iter().enumerate() {
                let BodyBar { pose, velocity, now, .. } = self.bars[body].pick(lane);
                if self.component().is_still(body) {
                    self.add_base(lane, body, pose, out);
                    continue;
                }
                // Velocities that are given are those over the last step and those at its end; momenta follow from them.
                let given = velocity.plus(pick_spatial(&self.told[body], lane), 1.0);
                let [[shift, turn], [velocity, rate], [now, _]] = [pose, given, now].map(split);
                out.start.positions[i] += shift;
                out.start.turns[i] += turn;
                out.start.velocities[i] += velocity + now;
                out.start.angular_velocities[i] += rate;
            }
        }
        self.gains.add_to(model, &self.sets, out);
    }

    /// The derivatives with respect to the poses of a held body at the start and at the end of the step that has been gone back
    /// over.
    pub(super) fn of_held(&self, body: usize) -> [Spatial<T>; 2] {
        [self.memory.before[body], self.memory.bodies[body]]
    }

    /// The same with respect to the poses of obstacles, one entry a contact that presses.
    pub(super) fn of_obstacles(&self) -> &[(usize, [Pair; 2])] {
        &self.memory.obstacles
    }

    /// Goes back over a step, one entry a lane: derivatives with respect to the state at its end become those at its start; `None`
    /// where its equations are singular. Lanes went through it alike, and where there are contacts there is one.
    pub(super) fn step_back(&mut self, model: &Model, substeps: &[&Substep], wanted: Wanted) -> Option<()> {
        self.replay.begin_at(substeps);
        self.replay.linearise(substeps)?;
        if std::mem::take(&mut self.is_told) {
            self.tell(model, substeps, wanted);
        }
        self.ask(substeps);
        let Memory { field, moved, .. } = &mut self.memory;
        self.replay.solve(field, true);
        self.replay.apply_transposed(field, moved);
        self.answer();
        if let [substep] = substeps {
            self.touch(substep, wanted);
        }
        self.gain(model, substeps, wanted);
        std::mem::swap(&mut self.bars, &mut self.memory.start);
        Some(())
    }

    /// What dual numbers in one lane stand for.
    fn duals<'a>(
        duals: &'a mut [Option<Duals>],
        (model, origin): (&Model, &Origin),
        (sets, topology): (&[Members], &Arc<Topology>),
        lane: usize,
    ) -> &'a mut Duals {
        duals[lane].get_or_insert_with(|| Duals::new(model, origin, (&sets[lane], topology)))
    }

    /// Adds what velocities at the end, as they are told, change by with the state there and with inertias.
    fn tell(&mut self, model: &Model, substeps: &[&Substep], wanted: Wanted) {
        let Self { sets, replay, origin, duals, bars, told, gains, .. } = self;
        for (lane, substep) in substeps.iter().enumerate() {
            let duals = Self::duals(duals, (model, origin), (sets, &replay.topology), lane);
            let told: Vec<Spatial<f64>> = told.iter().map(|told| pick_spatial(told, lane)).collect();
            let mut own: Vec<BodyBar> = bars.iter().map(|bar| bar.pick(lane)).collect();
            let moments = duals.tell(substep, &told, &mut own);
            bars.iter_mut().zip(&own).for_each(|(bar, own)| bar.put(lane, own));
            if wanted.segments {
                moments.iter().enumerate().for_each(|(body, x)| gains.add_moments_in(lane, body, x));
            }
        }
        told.fill(Spatial::zero());
    }

    /// Right-hand sides of the transposed equations.
    fn ask(&mut self, substeps: &[&Substep]) {
        let Self { replay, bars, transmitted, memory, .. } = self;
        let Memory { field, ended, .. } = memory;
        let component = &replay.component;
        field.joints.fill(Spatial::zero());
        for (j, of) in transmitted.drain(..).enumerate() {
            let (of_y, turn) = component.transmitted_back(j, of);
            field.joints[j] = of_y;
            let [a, b] = replay.topology.joints[j].map(|body| body as usize);
            bars[a].pose.angular -= turn;
            bars[b].pose.angular += turn;
        }
        if substeps.iter().any(|substep| substep.begins_anew) {
            component.begin_anew_back(bars);
        }
        ended.clear();
        T::dispatch(
            #[inline(always)]
            || {
                for (i, bar) in bars.iter().enumerate() {
                    let own = if component.is_still(i) { Ended::default() } else { component.end_back(i, bar) };
                    field.bodies[i] = bar.pose.plus(own.pose, T::splat(1.0));
                    ended.push(own);
                }
            },
        );
    }

    /// What their solution says of the state at the start and of bodies' own numbers.
    fn answer(&mut self) {
        let Self { replay, bars, memory, .. } = self;
        let Memory { field, moved, bodies, before, obstacles, ended, gradients, start } = memory;
        let component = &replay.component;
        gradients.clear();
        T::dispatch(
            #[inline(always)]
            || {
                for i in 0..bars.len() {
                    let mut gradient = BodyGradient::default();
                    if component.is_still(i) {
                        start[i] = BodyBar::default();
                        bodies[i] = bars[i].pose.plus(moved.bodies[i], T::splat(-1.0));
                    } else {
                        bodies[i] = field.bodies[i];
                        (start[i], gradient) = component.start_back(i, bodies[i], &ended[i]);
                    }
                    gradients.push(gradient);
                }
                for (j, own) in field.joints.iter().enumerate() {
                    component.memory_back(j, *own, start);
                }
            },
        );
        before.fill(Spatial::zero());
        obstacles.clear();
    }

    /// Adds what contacts say.
    fn touch(&mut self, substep: &Substep, wanted: Wanted) {
        let Self { replay, gains, memory, .. } = self;
        let Memory { field, bodies, before, obstacles, start, .. } = memory;
        for (contact, of) in substep.touching.iter().enumerate() {
            let own = replay.contacts.fixed_rows::<3>(replay.equations_of(contact));
            gains.friction -= of.by_friction.dot(&own);
            let mut at_end = -of.by_pose.tr_mul(&own);
            for (side, body) in of.sides() {
                at_end += of.push_by_pose.fixed_rows::<6>(6 * side).tr_mul(&six(field.bodies[body]));
            }
            let at_start = -of.by_start.tr_mul(&own);
            let part = |of: &SVector<f64, 12>, side: usize| {
                let own = of.fixed_rows::<6>(6 * side);
                [own.fixed_rows::<3>(0).into(), own.fixed_rows::<3>(3).into()]
            };
            let lanes = |of: Pair| Spatial::splat(joined(of));
            for (side, body) in of.sides() {
                if replay.component.is_still(body) {
                    add(&mut bodies[body], lanes(part(&at_end, side)));
                    add(&mut before[body], lanes(part(&at_start, side)));
                } else {
                    add(&mut start[body].pose, lanes(part(&at_start, side)));
                }
            }
            if let Some(obstacle) = of.obstacle.filter(|_| wanted.obstacles) {
                obstacles.push((obstacle, [&at_start, &at_end].map(|of| part(of, 1))));
            }
        }
    }

    /// Adds what the solution says of all that does not change from step to step.
    fn gain(&mut self, model: &Model, substeps: &[&Substep], wanted: Wanted) {
        let Self { sets, replay, origin, duals, gains, memory, .. } = self;
        let Memory { field, bodies, gradients, start, .. } = memory;
        let component = &replay.component;
        component.loads_back(bodies, |index, lane, body, [force, torque], of_mass| {
            let own = &mut gradients[body].mass;
            own.set_lane(lane, own.lane(lane) + of_mass);
            if wanted.loads {
                gains.add_load(index, [Vector3::from(force.0), Vector3::from(torque.0)]);
            }
        });
        if component.has_air() {
            for (lane, substep) in substeps.iter().enumerate() {
                let duals = Self::duals(duals, (model, origin), (sets, &replay.topology), lane);
                let mut own: Vec<BodyGradient<f64>> = gradients.iter().map(|of| of.pick(lane)).collect();
                let mut bars: Vec<BodyBar> = start.iter().map(|bar| bar.pick(lane)).collect();
                let inverse_mass = |body: usize| component.inertia(body)[0].lane(lane);
                let set = (model, &sets[lane], lane);
                duals.drag_back(substep, set, (&inverse_mass, &mut own, wanted), &mut bars, gains);
                gradients.iter_mut().zip(&own).for_each(|(all, own)| all.put(lane, own));
                start.iter_mut().zip(&bars).for_each(|(all, own)| all.put(lane, own));
            }
        }
        T::dispatch(
            #[inline(always)]
            || {
                if wanted.joints {
                    for (j, (numbers, own)) in gains.joints.iter_mut().zip(&field.joints).enumerate() {
                        let by = component.joint_back(j, *own);
                        for k in 0..12 {
                            numbers[k] += by[k];
                        }
                    }
                }
                for (body, own) in gradients.iter().enumerate().filter(|(body, _)| !component.is_still(*body)) {
                    if wanted.segments {
                        gains.add_inertia(body, own);
                    }
                    if wanted.surroundings {
                        gains.add_surroundings(own);
                    }
                }
            },
        );
    }
}

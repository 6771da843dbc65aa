//! The adjoint of a run: the derivative of one number with respect to all that the run depends on, backwards in time.
//!
//! A body is seeded without regard to its neighbours: what its start adds to a step's equations is its own, so that one run of
//! the kernels differentiates with respect to the same number of all bodies. Inner damping, which knows both bodies of a joint
//! at the start, takes a run for each colour of a colouring in which neighbours differ.

use nalgebra::{Vector3, Vector6};
use rod::{Body, InnerDamping, Model, State};

use super::forward::six;
use super::replay::{Replay, component};
use super::run::{Passed, Run};
use super::{DerivativeError, HeldVariation, JointVariation, StateVariation, Substep, Variation};
use crate::component::{Component, Group, Members, slope_of};
use crate::kernel::Spatial;
use crate::kernel::dual::Dual;
use crate::simulation::{Settings, Simulation, StepReport};
use crate::tangent::jacobian::{Field, Jacobian, split as parts};
use crate::topology::Topology;

/// Directions of a run of the kernels: a shift and a turn.
const WIDTH: usize = 6;

type Pair = [Vector3<f64>; 2];

const NONE: Pair = [Vector3::new(0.0, 0.0, 0.0); 2];

/// What a gradient is asked for beyond the first state and held bodies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wanted {
    /// Joints: compliances, rest shapes, inner damping.
    pub joints: bool,
    /// Segments: masses and inertias.
    pub segments: bool,
    /// Loads.
    pub loads: bool,
    /// Gravity, damping and the air.
    pub surroundings: bool,
}

impl Wanted {
    /// All of it.
    pub const ALL: Self = Self { joints: true, segments: true, loads: true, surroundings: true };
}

/// A simulation in formulation `newton` that keeps all its steps, to go back through them.
///
/// Steps are solved as those of [`super::Forward`]. A step of a segment takes about 500 bytes.
pub struct Recording {
    model: Model,
    run: Run,
    sets: Vec<Set>,
}

struct Set {
    members: Members,
    replay: Replay,
    dual: Component<Dual<WIDTH>>,
    /// Colours of bodies where joints have inner damping, else the same of all.
    colours: Vec<usize>,
    kept: Vec<Passed>,
}

/// Derivatives of the number with respect to a set's state between two steps, one entry a body.
struct Bars {
    poses: Vec<Pair>,
    /// Lists of [`Group::STATE`].
    groups: Vec<Vec<Pair>>,
    /// Velocities as they are told.
    told: Vec<Pair>,
}

/// Colours such that no joint has two bodies of the same.
fn colours(topology: &Topology) -> Vec<usize> {
    let mut colours = vec![usize::MAX; topology.bodies()];
    let mut neighbours = vec![Vec::new(); topology.bodies()];
    for &[a, b] in &topology.joints {
        neighbours[a as usize].push(b as usize);
        neighbours[b as usize].push(a as usize);
    }
    for body in 0..colours.len() {
        let is_free = |colour: &usize| neighbours[body].iter().all(|&other| colours[other] != *colour);
        colours[body] = (0..).find(is_free).unwrap_or(0);
    }
    colours
}

impl Recording {
    /// A simulation of `model` from `state`.
    ///
    /// # Errors
    /// If the formulation is not `newton`, the simulation cannot start, or the model has what is not differentiated.
    pub fn new(model: &Model, state: &State, settings: &Settings) -> Result<Self, DerivativeError> {
        let (run, sets) = Run::new(model, state, settings)?;
        let with_dual = |(members, replay): (Members, Replay)| {
            let topology = &replay.topology;
            let dual = component(model, state, settings.step.integrator, (&members, topology));
            let is_damped = members.joints.iter().any(|&j| model.joints[j].inner_damping != InnerDamping::NONE);
            let colours = if is_damped { colours(topology) } else { vec![0; topology.bodies()] };
            Set { members, replay, dual, colours, kept: Vec::new() }
        };
        let sets = sets.into_iter().map(with_dual).collect();
        Ok(Self { model: model.clone(), run, sets })
    }

    /// Advances by `dt` [s].
    ///
    /// # Errors
    /// If `dt` is not finite and positive, or the step does not converge, or one before has not: there is no gradient then.
    pub fn step(&mut self, dt: f64) -> Result<StepReport, DerivativeError> {
        let Self { run, sets, .. } = self;
        run.step(dt, &mut |members, passed| {
            if let Some(set) = sets.iter_mut().find(|set| set.members == *members) {
                set.kept.extend(passed);
            }
            Some(())
        })
    }

    /// Number of steps so far.
    pub fn steps(&self) -> usize {
        self.run.steps
    }

    /// The simulation itself, for what one reads off it.
    pub fn simulation(&self) -> &Simulation {
        &self.run.simulation
    }

    /// Copies poses and velocities to `state`, which must be of the model's size.
    pub fn store(&self, state: &mut State) {
        self.run.simulation.store(state);
    }

    /// The gradient of a number whose derivatives with respect to states are given: after so many steps (0: the first state),
    /// in any order. Of what is not wanted the gradient is zero. It lists all bodies that are held.
    ///
    /// # Errors
    /// If a list has another size than the model, or names a step that has not been taken; if a step did not converge, or its
    /// equations are singular.
    pub fn backward(
        &mut self,
        objective: &[(usize, StateVariation)],
        wanted: Wanted,
    ) -> Result<Variation, DerivativeError> {
        self.run.check()?;
        for (step, of) in objective {
            of.check(self.model.segments.len())?;
            if *step > self.run.steps {
                return Err(DerivativeError::Size { what: "steps", found: *step, expected: self.run.steps });
            }
        }
        let mut out = Variation::zero(&self.model);
        for set in &mut self.sets {
            set.backward(&self.model, objective, wanted, self.run.steps, &mut out)?;
        }
        Ok(out)
    }
}

impl Set {
    fn backward(
        &mut self,
        model: &Model,
        objective: &[(usize, StateVariation)],
        wanted: Wanted,
        steps: usize,
        out: &mut Variation,
    ) -> Result<(), DerivativeError> {
        let bodies = self.replay.topology.bodies();
        let held: Vec<usize> = (0..bodies).filter(|&body| self.dual.is_still(body)).collect();
        let mut held_poses = vec![vec![NONE; steps]; held.len()];
        let groups = Group::STATE.iter().take(if self.dual.has_steps() { 4 } else { 1 });
        let mut bars = Bars {
            poses: vec![NONE; bodies],
            groups: groups.map(|_| vec![NONE; bodies]).collect(),
            told: vec![NONE; bodies],
        };
        let mut step = steps;
        self.add_objective(objective, step, &mut bars);
        let kept = std::mem::take(&mut self.kept);
        let walked: Result<(), DerivativeError> = kept.iter().rev().try_for_each(|kept| {
            while step > kept.step + 1 {
                step -= 1;
                self.add_objective(objective, step, &mut bars);
            }
            let singular = DerivativeError::Singular { step: kept.step + 1 };
            let at_held = self.step_back(model, kept, wanted, &mut bars, out).ok_or(singular)?;
            for ((&body, pose), poses) in held.iter().zip(at_held).zip(&mut held_poses) {
                let mut add = |step: usize, share: f64| (0..2).for_each(|k| poses[step][k] += pose[k] * share);
                add(kept.step, kept.share);
                if kept.step > 0 {
                    add(kept.step - 1, 1.0 - kept.share);
                }
                self.add_base(body, pose, out);
            }
            Ok(())
        });
        self.kept = kept;
        walked?;
        while step > 0 {
            step -= 1;
            self.add_objective(objective, step, &mut bars);
        }
        self.end(&bars, out);
        for (body, poses) in held.into_iter().zip(held_poses) {
            let count = self.members.segments.len();
            let body = match body.checked_sub(count) {
                None => Body::Segment(self.members.segments[body]),
                Some(anchor) => Body::Anchor(self.members.anchors[anchor]),
            };
            out.held.push(HeldVariation { body, poses });
        }
        Ok(())
    }

    /// A fixed segment that nothing moves stays where it began.
    fn add_base(&self, body: usize, pose: Pair, out: &mut Variation) {
        if let Some(&i) = self.members.segments.get(body)
            && !self.dual.is_moved(body)
        {
            out.start.positions[i] += pose[0];
            out.start.turns[i] += pose[1];
        }
    }

    fn add_objective(&self, objective: &[(usize, StateVariation)], step: usize, bars: &mut Bars) {
        for (_, of) in objective.iter().filter(|(own, _)| *own == step) {
            for (body, &i) in self.members.segments.iter().enumerate() {
                bars.poses[body][0] += of.positions[i];
                bars.poses[body][1] += of.turns[i];
                if !self.dual.is_still(body) {
                    bars.told[body][0] += of.velocities[i];
                    bars.told[body][1] += of.angular_velocities[i];
                }
            }
        }
    }

    /// What is left at the start of the run.
    fn end(&self, bars: &Bars, out: &mut Variation) {
        for (body, &i) in self.members.segments.iter().enumerate() {
            if self.dual.is_still(body) {
                self.add_base(body, bars.poses[body], out);
                continue;
            }
            out.start.positions[i] += bars.poses[body][0];
            out.start.turns[i] += bars.poses[body][1];
            // Velocities that are given are those over the last step and those at its end; momenta follow from them.
            let now = bars.groups.get(1).map_or(Vector3::zeros(), |now| now[body][0]);
            out.start.velocities[i] += bars.groups[0][body][0] + now + bars.told[body][0];
            out.start.angular_velocities[i] += bars.groups[0][body][1] + bars.told[body][1];
        }
    }

    /// Goes back over a step: from the bars at its end to those at its start; returns those of held bodies' poses at its end.
    fn step_back(
        &mut self,
        model: &Model,
        kept: &Passed,
        wanted: Wanted,
        bars: &mut Bars,
        out: &mut Variation,
    ) -> Option<Vec<Pair>> {
        let substep = &kept.substep;
        self.replay.component.begin_at(&substep.begin);
        let jacobian = self.replay.linearise(substep)?;
        let bodies = self.replay.topology.bodies();
        let free: Vec<usize> = (0..bodies).filter(|&body| !self.dual.is_still(body)).collect();

        // Poses at the end, of which velocities are made.
        self.begin(substep);
        self.dual.predict_step(substep.interval);
        self.dual.place_constant(&substep.poses, &substep.lambda);
        self.dual.seed_group(Group::Pose, |body| !self.replay.component.is_still(body));
        self.dual.end_solved_step();
        let mut field = Field::zero(&self.replay.topology);
        for &body in &free {
            let own = self.ended(body, bars);
            field.bodies[body] = six(bars.poses[body]) + own;
        }
        self.replay.factor.solve(&jacobian, &mut field, true);
        let held = self.of_held(&jacobian, &field, bars);

        let mut poses = vec![NONE; bodies];
        let most = self.colours.iter().max().map_or(0, |most| most + 1);
        let is_damped = most > 1;
        for colour in 0..most {
            let colours = std::mem::take(&mut self.colours);
            self.begin(substep);
            self.dual.seed_group(Group::Pose, |body| colours[body] == colour);
            let (defects, missed) = self.evaluate(substep);
            for &body in free.iter().filter(|&&body| colours[body] == colour) {
                let own = self.ended(body, bars) + work_of_body(&field, body, &defects);
                poses[body] = parts(&own);
            }
            if is_damped {
                for (j, ends) in self.replay.topology.joints.iter().enumerate() {
                    let Some(body) = ends.iter().map(|&body| body as usize).find(|&body| colours[body] == colour)
                    else {
                        continue;
                    };
                    let [shift, turn] = parts(&work_of_joint(&field, j, &missed));
                    poses[body][0] += shift;
                    poses[body][1] += turn;
                }
            }
            self.colours = colours;
        }
        let mut groups = Vec::with_capacity(bars.groups.len());
        for &group in &Group::STATE[..bars.groups.len()] {
            self.begin(substep);
            self.dual.seed_group(group, |_| true);
            let (defects, _) = self.evaluate(substep);
            let mut own = vec![NONE; bodies];
            for &body in &free {
                own[body] = parts(&(self.ended(body, bars) + work_of_body(&field, body, &defects)));
            }
            groups.push(own);
        }
        self.parameters(model, substep, wanted, &field, bars, &free, out);
        *bars = Bars { poses, groups, told: vec![NONE; bodies] };
        Some(held)
    }

    /// Puts the dual component where a step begins, without slopes.
    fn begin(&mut self, substep: &Substep) {
        self.dual.begin_at(&substep.begin);
        self.dual.set_forces(substep.interval.time + substep.interval.dt);
        self.dual.still_forces();
    }

    /// Goes through a step: what the seeds add to its equations.
    fn evaluate(&mut self, substep: &Substep) -> (Vec<Spatial<Dual<WIDTH>>>, Vec<Spatial<Dual<WIDTH>>>) {
        let (mut defects, mut missed) = (Vec::new(), Vec::new());
        self.dual.predict_step(substep.interval);
        self.dual.place_constant(&substep.poses, &substep.lambda);
        self.dual.evaluate_step();
        self.dual.right_hand_sides(&mut defects, &mut missed);
        self.dual.end_solved_step();
        (defects, missed)
    }

    /// What the bars at the end say of a body's seeds, but for its pose.
    fn ended(&self, body: usize, bars: &Bars) -> Vector6<f64> {
        Vector6::from_fn(|k, _| {
            let at_end = self.dual.ended_along(body, k);
            let states = bars.groups.iter().zip(&at_end).map(|(bar, slope)| product(&bar[body], slope));
            states.sum::<f64>() + product(&bars.told[body], &self.dual.velocity_along(body, k))
        })
    }

    /// Bars of held bodies' poses at the end of a step.
    fn of_held(&self, jacobian: &Jacobian, field: &Field, bars: &Bars) -> Vec<Pair> {
        let mut moved = Field::zero(&self.replay.topology);
        jacobian.apply(field, true, &mut moved);
        let held = (0..self.replay.topology.bodies()).filter(|&body| self.dual.is_still(body));
        held.map(|body| parts(&(six(bars.poses[body]) - moved.bodies[body]))).collect()
    }

    /// Adds what a step's parameters do.
    #[allow(clippy::too_many_arguments)]
    fn parameters(
        &mut self,
        model: &Model,
        substep: &Substep,
        wanted: Wanted,
        field: &Field,
        bars: &Bars,
        free: &[usize],
        out: &mut Variation,
    ) {
        if wanted.joints {
            for half in 0..2 {
                self.begin(substep);
                self.seed_joints(Some(half));
                let (_, missed) = self.evaluate(substep);
                self.seed_joints(None);
                for (j, &index) in self.members.joints.iter().enumerate() {
                    let own = &mut out.joints[index];
                    let mut numbers = own.numbers();
                    let change = work_of_joint(field, j, &missed);
                    (0..WIDTH).for_each(|k| numbers[half * WIDTH + k] += change[k]);
                    *own = JointVariation::of_numbers(&numbers);
                }
            }
        }
        let along = |set: &mut Self, body: usize, defects: &[Spatial<Dual<WIDTH>>]| {
            set.ended(body, bars) + work_of_body(field, body, defects)
        };
        if wanted.segments {
            self.begin(substep);
            self.dual.seed_inertias(1.0);
            let (defects, _) = self.evaluate(substep);
            for &body in free {
                let own = along(self, body, &defects);
                let segment = &mut out.segments[self.members.segments[body]];
                segment.mass += own[0];
                segment.inertia += Vector3::new(0.5 * own[1], 0.5 * own[1], own[2]);
            }
            self.dual.seed_inertias(0.0);
        }
        if wanted.surroundings {
            self.begin(substep);
            self.dual.seed_gravity_and_damping(1.0);
            let (defects, _) = self.evaluate(substep);
            for &body in free {
                let own = along(self, body, &defects);
                out.gravity += own.fixed_rows::<3>(0);
                (0..2).for_each(|k| out.damping[k] += own[3 + k]);
            }
            self.dual.seed_gravity_and_damping(0.0);
            if let Some(air) = &model.air {
                self.begin(substep);
                self.dual.seed_air(&self.members, model, air, 1.0);
                let (defects, _) = self.evaluate(substep);
                for &body in free {
                    let own = along(self, body, &defects);
                    out.air.density += own[0];
                    out.air.normal_drag += own[1];
                    out.air.tangential_drag += own[2];
                    out.air.wind += own.fixed_rows::<3>(3);
                }
                self.dual.seed_air(&self.members, model, air, 0.0);
            }
        }
        if wanted.loads {
            // Of loads on the same segment one after the other.
            for rank in 0.. {
                self.begin(substep);
                let seeded = self.dual.seed_loads(rank);
                if seeded.is_empty() {
                    break;
                }
                let (defects, _) = self.evaluate(substep);
                for (index, body) in seeded {
                    let [force, torque] = parts(&along(self, body, &defects));
                    out.loads[index][0] += force;
                    out.loads[index][1] += torque;
                }
            }
        }
    }

    /// Seeds one half of the numbers of every joint, or none.
    fn seed_joints(&mut self, half: Option<usize>) {
        for j in 0..self.members.joints.len() {
            for k in 0..WIDTH {
                let mut numbers = [0.0; 2 * WIDTH];
                if let Some(half) = half {
                    numbers[half * WIDTH + k] = 1.0;
                }
                self.dual.seed_joint(j, k, &JointVariation::of_numbers(&numbers));
            }
        }
    }
}

/// What the answer of a step does with changes of a body's equations.
fn work_of_body(field: &Field, body: usize, defects: &[Spatial<Dual<WIDTH>>]) -> Vector6<f64> {
    Vector6::from_fn(|k, _| product(&parts(&field.bodies[body]), &slope_of(&defects[body], k)))
}

/// The same of a joint's equations.
fn work_of_joint(field: &Field, joint: usize, missed: &[Spatial<Dual<WIDTH>>]) -> Vector6<f64> {
    Vector6::from_fn(|k, _| product(&parts(&field.joints[joint]), &slope_of(&missed[joint], k)))
}

fn product(a: &Pair, b: &Pair) -> f64 {
    a[0].dot(&b[0]) + a[1].dot(&b[1])
}

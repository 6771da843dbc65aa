//! Forward sensitivities: derivatives along a few directions, carried with the motion.

use std::sync::Arc;

use component::{Component, Members, move_along, movement_along, slope_of};
use dynamics::simulation::{Settings, Simulation, StepReport};
use dynamics::substep::Touching;
use jointed::tangent::jacobian::{Field, joined, of_six, six, split};
use jointed::topology::Topology;
use kernels::Spatial;
use kernels::dual::Dual;
use kernels::lane::Real;
use kernels::parallel;
use nalgebra::{SVector, Vector3};
use rod::{Model, State};

use super::check;
use super::replay::{Replay, component};
use super::run::{Passed, Run};
use super::seed::{HeldSeed, ObstacleSeed, is_held, seed};
use super::{DerivativeError, StateVariation, Variation};

/// Directions that are carried at once.
const WIDTH: usize = 6;

/// A simulation in formulation `newton` with the derivatives of its states along some directions.
///
/// Steps are solved to 1e-10 of the prediction's residual at least, with the exact tangent where there is one. What the
/// derivatives cost beyond the steps grows with the number of directions.
pub struct Forward {
    run: Run,
    sets: Vec<Set>,
    directions: usize,
}

struct Set {
    members: Members,
    replay: Replay<f64>,
    chunks: Vec<Chunk>,
}

/// Up to [`WIDTH`] directions.
struct Chunk {
    component: Component<Dual<WIDTH>>,
    directions: std::ops::Range<usize>,
    variations: Vec<Variation>,
    held: Vec<HeldSeed>,
    obstacles: Vec<ObstacleSeed>,
    field: Field,
    bodies: Vec<Spatial<Dual<WIDTH>>>,
    joints: Vec<Spatial<Dual<WIDTH>>>,
}

impl Forward {
    /// A simulation of `model` from `state`, with derivatives along `directions`.
    ///
    /// # Errors
    /// If the formulation is not `newton`, the simulation cannot start, a variation does not fit the model, or the model has
    /// what is not differentiated.
    pub fn new(
        model: &Model,
        state: &State,
        settings: &Settings,
        directions: &[Variation],
    ) -> Result<Self, DerivativeError> {
        directions.iter().try_for_each(|variation| check::check_all(variation, model))?;
        if directions.iter().flat_map(|variation| &variation.held).any(|held| !is_held(model, held.body)) {
            return Err(DerivativeError::Unknown("motions of what is not held"));
        }
        let (run, sets) = Run::new(model, state, settings)?;
        let integrator = settings.step.integrator;
        let with_chunks = |(members, topology): (Members, Arc<Topology>)| {
            let chunk = |(index, variations): (usize, &[Variation])| {
                let mut component: Component<Dual<WIDTH>> =
                    component(model, state, integrator, (&[&members], &topology));
                let held = seed(&mut component, &members, model, variations);
                let first = index * WIDTH;
                Chunk {
                    component,
                    directions: first..first + variations.len(),
                    variations: variations.to_vec(),
                    held,
                    obstacles: ObstacleSeed::all(variations),
                    field: Field::zero(&topology),
                    bodies: Vec::new(),
                    joints: Vec::new(),
                }
            };
            let chunks = directions.chunks(WIDTH).enumerate().map(chunk).collect();
            let replay = Replay::new(model, state, integrator, (&[&members], &topology))?;
            Ok(Set { members, replay, chunks })
        };
        let sets =
            sets.into_iter().flat_map(|alike| alike.sets.into_iter().map(move |set| (set, alike.topology.clone())));
        let sets = sets.map(with_chunks).collect::<Result<_, DerivativeError>>()?;
        Ok(Self { run, sets, directions: directions.len() })
    }

    /// Advances by `dt` [s].
    ///
    /// # Errors
    /// If `dt` is not finite and positive, the step does not converge, or one before has not, or its equations are singular;
    /// derivatives are not to be used any more then.
    pub fn step(&mut self, dt: f64) -> Result<StepReport, DerivativeError> {
        let (report, passed) = self.run.step(dt)?;
        let advance = |index: usize, set: &mut Set| passed[index].iter().try_for_each(|passed| set.advance(passed));
        let done = parallel::reduce(&mut self.sets, Some(1), advance, Option::and).unwrap_or(Some(()));
        done.ok_or(DerivativeError::Singular { step: self.run.steps })?;
        Ok(report)
    }

    /// Time since the start [s].
    pub fn time(&self) -> f64 {
        self.run.simulation.time()
    }

    /// The simulation itself, for what one reads off it.
    pub fn simulation(&self) -> &Simulation {
        &self.run.simulation
    }

    /// Copies poses and velocities to `state`, which must be of the model's size.
    pub fn store(&self, state: &mut State) {
        self.run.simulation.store(state);
    }

    /// Number of directions.
    pub fn directions(&self) -> usize {
        self.directions
    }

    /// Copies the derivative of the state along a direction to `change`, which must be of the model's size; nothing is copied along
    /// one that there is not. That of what joints transmit is copied where `change` has an entry for each joint
    /// ([`StateVariation::with_forces`]).
    pub fn store_change(&self, direction: usize, change: &mut StateVariation) {
        for set in &self.sets {
            let Some(chunk) = set.chunks.iter().find(|chunk| chunk.directions.contains(&direction)) else { continue };
            let k = direction - chunk.directions.start;
            for (body, &i) in set.members.segments.iter().enumerate() {
                let component = &chunk.component;
                [change.positions[i], change.turns[i]] = movement_along(&component.poses[body], k);
                [change.velocities[i], change.angular_velocities[i]] = match component.is_still(body) {
                    true => [Vector3::zeros(); 2],
                    false => component.velocity_along(body, k),
                };
            }
            if change.forces.is_empty() {
                continue;
            }
            let joints = set.members.joints.iter().zip(&set.replay.topology.joints);
            for (j, (&index, ends)) in joints.enumerate() {
                let component = &chunk.component;
                let turns = ends.map(|body| movement_along(&component.poses[body as usize], k)[1]);
                let rows = slope_of(&component.lambda[j], k);
                change.forces[index] = set.replay.component.transmitted_along(j, turns, rows);
            }
        }
    }
}

impl Set {
    fn advance(&mut self, passed: &Passed) -> Option<()> {
        self.replay.component.go_on_like(&passed.substep.begin);
        self.replay.linearise(&[&passed.substep])?;
        for chunk in &mut self.chunks {
            chunk.advance(passed, &self.members, &mut self.replay);
        }
        self.replay.component.end_solved_step();
        if passed.substep.begins_anew {
            self.replay.component.begin_anew(1.0);
        }
        Some(())
    }
}

impl Chunk {
    fn advance(&mut self, Passed { substep, step, shares }: &Passed, members: &Members, replay: &mut Replay<f64>) {
        let Self { component, variations, held, obstacles, field, bodies, joints, .. } = self;
        component.go_on_like(&substep.begin);
        component.set_forces(substep.interval.time + substep.interval.dt);
        for (k, variation) in variations.iter().enumerate() {
            component.seed_forces(k, variation);
        }
        component.predict_step(substep.interval);
        component.place_constant(&substep.poses, &substep.lambda);
        for seed in held.iter() {
            component.seed_pose(seed.body, seed.direction, seed.at(*step, shares[1]));
        }
        component.evaluate_step();
        component.right_hand_sides(bodies, joints);
        for (k, variation) in variations.iter().enumerate() {
            field.bodies.fill(Spatial::zero());
            for i in 0..members.segments.len() {
                field.bodies[i] = joined(component.defect_along(bodies, i, k));
            }
            for (own, missed) in field.joints.iter_mut().zip(joints.iter()) {
                *own = joined(slope_of(missed, k));
            }
            replay.contacts.fill(0.0);
            for (contact, of) in substep.touching.iter().enumerate() {
                let [mut now, mut start] = moved_with(component, of, k);
                let own = |seed: &&ObstacleSeed| seed.direction == k && Some(seed.obstacle) == of.obstacle;
                for seed in obstacles.iter().filter(own) {
                    for (of, share) in [(&mut start, shares[0]), (&mut now, shares[1])] {
                        let mut partner = of.fixed_rows_mut::<6>(6);
                        partner += six(joined(seed.at(*step, share)));
                    }
                }
                for (side, body) in of.sides() {
                    let pushed = of_six(&(of.push_by_pose.fixed_rows::<6>(6 * side) * now));
                    field.bodies[body] = field.bodies[body].plus(pushed, 1.0);
                }
                let missed = of.by_pose * now + of.by_start * start + of.by_friction * variation.friction;
                let first = replay.equations_of(contact);
                replay.contacts.fixed_rows_mut::<3>(first).copy_from(&-missed);
            }
            replay.solve(field, false);
            for i in 0..members.segments.len() {
                if !component.is_still(i) {
                    move_along(&mut component.poses[i], k, &split(field.bodies[i]));
                }
            }
            for (j, y) in field.joints.iter().enumerate() {
                component.transmit_along(j, k, &split(-*y));
            }
        }
        component.end_solved_step();
        if substep.begins_anew {
            component.begin_anew(Dual::splat(1.0));
        }
    }
}

/// How the bodies of a contact move along a direction: at the end of the step those that are held, and at its start.
fn moved_with(component: &Component<Dual<WIDTH>>, of: &Touching, k: usize) -> [SVector<f64, 12>; 2] {
    let mut out = [SVector::<f64, 12>::zeros(); 2];
    for (side, body) in of.sides() {
        let [now, start] =
            [&component.poses, &component.start].map(|poses| six(joined(movement_along(&poses[body], k))));
        if component.is_still(body) {
            out[0].fixed_rows_mut::<6>(6 * side).copy_from(&now);
        }
        out[1].fixed_rows_mut::<6>(6 * side).copy_from(&start);
    }
    out
}

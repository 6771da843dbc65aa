//! Forward sensitivities: derivatives along a few directions, carried with the motion.

use nalgebra::{Vector3, Vector6};
use rod::{Model, State};

use super::replay::{Replay, component};
use super::seed::{HeldSeed, is_held, seed};
use super::{DerivativeError, StateVariation, Substep, Variation};
use crate::component::{Component, Members, move_along, movement_along, slope_of, split};
use crate::formulation::Tangent;
use crate::kernel::Spatial;
use crate::kernel::dual::Dual;
use crate::linear::solvers::SolverKind;
use crate::simulation::{Settings, Simulation, StepReport};
use crate::step::{Status, StepParams};
use crate::tangent::elimination::Elimination;
use crate::tangent::jacobian::{Field, Jacobian, split as parts};

/// Directions that are carried at once.
const WIDTH: usize = 6;

/// A simulation in formulation `newton` with the derivatives of its states along some directions.
///
/// Steps are solved to 1e-10 of the prediction's residual at least, with the exact tangent where there is one. What the
/// derivatives cost beyond the steps grows with the number of directions.
pub struct Forward {
    simulation: Simulation,
    sets: Vec<Set>,
    directions: usize,
    steps: usize,
}

struct Set {
    members: Members,
    replay: Replay,
    chunks: Vec<Chunk>,
}

/// Up to [`WIDTH`] directions.
struct Chunk {
    component: Component<Dual<WIDTH>>,
    directions: std::ops::Range<usize>,
    variations: Vec<Variation>,
    held: Vec<HeldSeed>,
    field: Field,
    bodies: Vec<Spatial<Dual<WIDTH>>>,
    joints: Vec<Spatial<Dual<WIDTH>>>,
}

/// Settings with which steps are solved to the end.
pub(super) fn solved(model: &Model, settings: &Settings) -> Result<Settings, DerivativeError> {
    if !settings.step.formulation.momentum() {
        return Err(DerivativeError::Formulation);
    }
    let exact = split(model).iter().all(|(_, topology)| Elimination::new(topology).is_some());
    let step = StepParams {
        relative_tolerance: settings.step.relative_tolerance.min(1e-10),
        absolute_tolerance: settings.step.absolute_tolerance.min(1e-12),
        tangent: if exact { Tangent::Exact } else { Tangent::Positive },
        ..settings.step
    };
    // Sets with more loops than one know no exact tangent; none may be stepped in lanes.
    let solver = if exact { settings.solver } else { SolverKind::Sparse };
    Ok(Settings { step, solver })
}

/// Refuses what is not differentiated.
pub(super) fn check(model: &Model) -> Result<(), DerivativeError> {
    let refuse = |is_there: bool, what| if is_there { Err(DerivativeError::Unknown(what)) } else { Ok(()) };
    refuse(!model.contacts.is_empty(), "contacts")?;
    refuse(model.motions.iter().any(|driven| driven.is_timed()), "grips that take hold or let go on the way")?;
    refuse(model.segments.iter().any(|segment| segment.body.is_some()), "rigid bodies")?;
    refuse(model.air.as_ref().is_some_and(|air| air.wind.has_gusts()), "gusts")
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
        let settings = solved(model, settings)?;
        check(model)?;
        directions.iter().try_for_each(|variation| variation.check(model))?;
        if directions.iter().flat_map(|variation| &variation.held).any(|held| !is_held(model, held.body)) {
            return Err(DerivativeError::Unknown("motions of what is not held"));
        }
        let mut simulation = Simulation::new(model, state, &settings, None)?;
        simulation.record_substeps();
        let sets = split(model).into_iter().map(|(members, topology)| {
            let topology = std::sync::Arc::new(topology);
            let (integrator, set) = (settings.step.integrator, (&members, &topology));
            let replay = Replay::new(model, state, integrator, set)?;
            let chunk = |(index, variations): (usize, &[Variation])| {
                let mut component: Component<Dual<WIDTH>> = component(model, state, integrator, set);
                let held = seed(&mut component, &members, model, variations);
                let first = index * WIDTH;
                Chunk {
                    component,
                    directions: first..first + variations.len(),
                    variations: variations.to_vec(),
                    held,
                    field: Field::zero(&topology),
                    bodies: Vec::new(),
                    joints: Vec::new(),
                }
            };
            let chunks = directions.chunks(WIDTH).enumerate().map(chunk).collect();
            Ok(Set { members, replay, chunks })
        });
        let sets = sets.collect::<Result<_, DerivativeError>>()?;
        Ok(Self { simulation, sets, directions: directions.len(), steps: 0 })
    }

    /// Advances by `dt` [s].
    ///
    /// # Errors
    /// If `dt` is not finite and positive, the step does not converge, or its equations are singular; derivatives are not to be
    /// used any more then.
    pub fn step(&mut self, dt: f64) -> Result<StepReport, DerivativeError> {
        let begin = self.simulation.time();
        let report = self.simulation.step(dt)?;
        self.steps += 1;
        let step = self.steps;
        if report.status > Status::ConvergedInSubsteps {
            return Err(DerivativeError::Step { step, status: report.status });
        }
        for substeps in self.simulation.take_substeps() {
            let (members, substeps) = substeps;
            let Some(set) = self.sets.iter_mut().find(|set| set.members == *members) else { continue };
            for substep in &substeps {
                let share = (substep.interval.time + substep.interval.dt - begin) / dt;
                set.advance(substep, step - 1, share).ok_or(DerivativeError::Singular { step })?;
            }
        }
        Ok(report)
    }

    /// Time since the start [s].
    pub fn time(&self) -> f64 {
        self.simulation.time()
    }

    /// The simulation itself, for what one reads off it.
    pub fn simulation(&self) -> &Simulation {
        &self.simulation
    }

    /// Copies poses and velocities to `state`, which must be of the model's size.
    pub fn store(&self, state: &mut State) {
        self.simulation.store(state);
    }

    /// Number of directions.
    pub fn directions(&self) -> usize {
        self.directions
    }

    /// Copies the derivative of the state along a direction to `change`, which must be of the model's size; zero along one that
    /// there is not.
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
        }
    }
}

impl Set {
    fn advance(&mut self, substep: &Substep, step: usize, share: f64) -> Option<()> {
        let jacobian = self.replay.linearise(substep)?;
        for chunk in &mut self.chunks {
            chunk.advance(substep, &self.members, &jacobian, &mut self.replay, (step, share));
        }
        self.replay.component.end_solved_step();
        Some(())
    }
}

impl Chunk {
    fn advance(
        &mut self,
        substep: &Substep,
        members: &Members,
        jacobian: &Jacobian,
        replay: &mut Replay,
        (step, share): (usize, f64),
    ) {
        let Self { component, variations, held, field, bodies, joints, .. } = self;
        component.set_forces(substep.interval.time + substep.interval.dt);
        for (k, variation) in variations.iter().enumerate() {
            component.seed_forces(k, variation);
        }
        component.predict_step(substep.interval);
        component.place_constant(&substep.poses, &substep.lambda);
        for seed in held.iter() {
            component.seed_pose(seed.body, seed.direction, seed.at(step, share));
        }
        component.evaluate_step();
        component.right_hand_sides(bodies, joints);
        for k in 0..variations.len() {
            field.bodies.fill(Vector6::zeros());
            for i in 0..members.segments.len() {
                field.bodies[i] = six(component.defect_along(bodies, i, k));
            }
            for (own, missed) in field.joints.iter_mut().zip(joints.iter()) {
                *own = six(slope_of(missed, k));
            }
            replay.factor.solve(jacobian, field, false);
            for i in (0..members.segments.len()).filter(|&i| !component.is_still(i)).collect::<Vec<_>>() {
                move_along(&mut component.poses[i], k, &parts(&field.bodies[i]));
            }
            for (j, y) in field.joints.iter().enumerate() {
                component.transmit_along(j, k, &parts(&-y));
            }
        }
        component.end_solved_step();
    }
}

/// A force and a torque, or a shift and a turn, in six rows.
pub(super) fn six([linear, angular]: [Vector3<f64>; 2]) -> Vector6<f64> {
    Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
}

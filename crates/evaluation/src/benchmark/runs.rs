//! Runs of scenes, with what they take.

use std::time::Instant;

use cosserat::guess;
use cosserat::scene::Scene;
use cosserat::simulation::{ContactForce, Counters, Settings, Simulation, Status};
use cosserat::state::{JointForce, State};

use super::quantity::{BenchmarkError, Outcome, Quantity};

/// The end of a step.
pub(super) struct Moment<'a> {
    /// Time [s].
    pub time: f64,
    /// Poses and velocities.
    pub state: &'a State,
    /// What joints transmit, one a joint.
    pub forces: &'a [JointForce],
    /// The contacts that press.
    pub contacts: &'a [ContactForce],
}

/// The runs of one experiment.
pub(super) struct Runs<'a> {
    settings: &'a Settings,
    go_on: &'a mut dyn FnMut() -> bool,
    status: Status,
    steps: usize,
    iterations: u64,
    seconds: f64,
}

impl<'a> Runs<'a> {
    pub(super) fn new(settings: &'a Settings, go_on: &'a mut dyn FnMut() -> bool) -> Self {
        Self { settings, go_on, status: Status::Converged, steps: 0, iterations: 0, seconds: 0.0 }
    }

    /// The settings of all runs.
    pub(super) fn settings(&self) -> &Settings {
        self.settings
    }

    /// Runs a scene as it says; `look` sees the end of each step.
    pub(super) fn play(
        &mut self,
        scene: &Scene,
        mut look: impl FnMut(&Moment<'_>),
    ) -> Result<Counters, BenchmarkError> {
        let model = &scene.model;
        let choice = guess::choose(model, &self.settings.step, Some(self.settings.solver));
        let guess = |model: &_, members: &_, topology: &_| choice.build_guess(model, members, topology);
        let mut simulation = Simulation::new(model, &scene.state, self.settings, Some(&guess))?;
        let mut state = scene.state.clone();
        let (mut forces, mut contacts) = (vec![JointForce::default(); model.joints.len()], Vec::new());
        for _ in 0..scene.run.steps {
            let begin = Instant::now();
            let status = simulation.step(scene.run.dt)?.status;
            self.seconds += begin.elapsed().as_secs_f64();
            self.status = self.status.max(status);
            self.steps += 1;
            simulation.store(&mut state);
            simulation.store_joint_forces(&mut forces);
            simulation.store_contact_forces(&mut contacts);
            look(&Moment { time: simulation.time(), state: &state, forces: &forces, contacts: &contacts });
            if !(self.go_on)() {
                return Err(BenchmarkError::Interrupted);
            }
        }
        let counters = simulation.counters();
        self.iterations += counters.iterations / simulation.components().max(1) as u64;
        Ok(counters)
    }

    /// What all of it came to.
    pub(super) fn outcome(self, quantities: Vec<Quantity>) -> Outcome {
        Outcome {
            quantities,
            status: self.status,
            iterations_per_step: self.iterations as f64 / self.steps.max(1) as f64,
            seconds: self.seconds,
        }
    }
}

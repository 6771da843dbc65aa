//! A run that keeps its steps, to go back through them.

use std::sync::Arc;

use component::snapshot::Snapshot;
use dynamics::simulation::{Settings, Simulation, StepReport};
use kernels::parallel;
use rod::{Model, State};

use super::back::Back;
use super::check;
use super::origin::Origin;
use super::run::Run;
use super::wanted::Wanted;
use super::{DerivativeError, StateVariation, Variation};

/// A simulation in formulation `newton` that keeps its steps, to go back through them: all of them, about 220 bytes a segment
/// and step (340 with the integrator bdf2), or with [`Recording::with_checkpoints`] one stretch of them at a time.
///
/// Steps are solved as those of [`super::Forward`].
pub struct Recording {
    model: Model,
    run: Run,
    origin: Origin,
    backs: Vec<Back>,
    /// Steps between two checkpoints.
    stretch: usize,
    /// The simulation at the start of each stretch.
    checkpoints: Vec<Snapshot>,
    /// Lengths of all steps [s].
    lengths: Vec<f64>,
    /// Whether the last stretch is kept.
    is_kept: bool,
}

impl Recording {
    /// A simulation of `model` from `state` that keeps all its steps.
    ///
    /// # Errors
    /// If the formulation is not `newton`, the simulation cannot start, or the model has what is not differentiated.
    pub fn new(model: &Model, state: &State, settings: &Settings) -> Result<Self, DerivativeError> {
        Self::with_checkpoints(model, state, settings, usize::MAX)
    }

    /// A simulation of `model` from `state` that keeps its state every `stretch` steps, and beside it the steps of one stretch.
    /// The way back takes the steps of all other stretches once more (a schedule of two levels; Griewank and Walther 2000), with
    /// the same bits. The square root of the number of steps is a good stretch.
    ///
    /// # Errors
    /// Those of [`Recording::new`], and where a stretch has no step.
    pub fn with_checkpoints(
        model: &Model,
        state: &State,
        settings: &Settings,
        stretch: usize,
    ) -> Result<Self, DerivativeError> {
        if stretch == 0 {
            return Err(DerivativeError::Stretch);
        }
        let (run, sets) = Run::new(model, state, settings)?;
        let origin = Origin { state: Arc::new(state.clone()), integrator: settings.step.integrator };
        let backs = Back::all(model, &origin, sets)?;
        let (checkpoints, lengths) = (Vec::new(), Vec::new());
        Ok(Self { model: model.clone(), run, origin, backs, stretch, checkpoints, lengths, is_kept: true })
    }

    /// Advances by `dt` [s].
    ///
    /// # Errors
    /// If `dt` is not finite and positive, or the step does not converge, or one before has not: there is no gradient then.
    pub fn step(&mut self, dt: f64) -> Result<StepReport, DerivativeError> {
        self.run.check()?;
        if self.run.steps == self.checkpoints.len().saturating_mul(self.stretch) {
            self.checkpoints.push(self.run.simulation.snapshot());
            self.backs.iter_mut().for_each(Back::forget);
            self.is_kept = true;
        }
        let report = self.step_kept(dt)?;
        self.lengths.push(dt);
        Ok(report)
    }

    fn step_kept(&mut self, dt: f64) -> Result<StepReport, DerivativeError> {
        let (report, mut passed) = self.run.step(dt)?;
        for back in &mut self.backs {
            back.keep(&mut passed);
        }
        if self.backs.iter().any(Back::comes_apart) {
            let backs = std::mem::take(&mut self.backs);
            self.backs = backs
                .into_iter()
                .map(|back| back.apart(&self.model, &self.origin))
                .collect::<Result<Vec<_>, _>>()?
                .into_iter()
                .flatten()
                .collect();
        }
        Ok(report)
    }

    /// Takes the steps of a stretch once more.
    fn repeat(&mut self, stretch: usize) -> Result<(), DerivativeError> {
        self.run.simulation.restore(&self.checkpoints[stretch])?;
        self.backs.iter_mut().for_each(Back::forget);
        let first = stretch.saturating_mul(self.stretch);
        self.run.steps = first;
        for step in first..first.saturating_add(self.stretch).min(self.lengths.len()) {
            self.step_kept(self.lengths[step])?;
        }
        Ok(())
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
    /// in any order. Of what is not wanted the gradient is zero. It lists all bodies that are held, and all obstacles where they
    /// are wanted.
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
            check::check_state(of, &self.model)?;
            if *step > self.run.steps {
                return Err(DerivativeError::Size { what: "steps", found: *step, expected: self.run.steps });
            }
        }
        let steps = self.lengths.len();
        let obstacles = if wanted.obstacles { self.model.contacts.obstacles.len() } else { 0 };
        self.backs.iter_mut().for_each(|back| back.begin(steps, obstacles, objective));
        let last = self.checkpoints.len().saturating_sub(1);
        let end = if last > 0 || !self.is_kept { Some(self.run.simulation.snapshot()) } else { None };
        for stretch in (0..self.checkpoints.len()).rev() {
            if stretch < last || !self.is_kept {
                self.is_kept = false;
                self.repeat(stretch)?;
            }
            let back = |_, back: &mut Back| back.back(&self.model, objective, wanted);
            parallel::reduce(&mut self.backs, Some(1), back, Result::and).unwrap_or(Ok(()))?;
        }
        if let Some(end) = end {
            self.run.simulation.restore(&end)?;
            self.run.steps = steps;
        }
        let mut out = Variation::zero(&self.model);
        self.backs.iter_mut().for_each(|back| back.end(&self.model, objective, &mut out));
        Ok(out)
    }
}

#[cfg(test)]
mod tests {
    use dynamics::formulation::Formulation;
    use dynamics::step::{Status, StepParams};
    use nalgebra::Vector3;
    use rod::{Assembly, Material, RodSpec, shape};

    use super::*;

    /// Of five rods one turns so fast that its steps are halved: four go back side by side, that one on its own.
    #[test]
    fn sets_go_back_in_lanes_as_long_as_their_steps_are_alike() {
        let material = Material { youngs_modulus: 1e7, torsion_modulus: 4e6, density: 1000.0 };
        let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
        for k in 0..5 {
            let line = shape::straight(Vector3::y() * k as f64, Vector3::x(), 1.0, 7);
            let rod = assembly.rod(&RodSpec::new(line, 0.01, material));
            assembly.fix(rod.start);
        }
        let (model, mut state) = assembly.finish();
        for i in (0..model.segments.len()).filter(|&i| !model.segments[i].fixed) {
            state.angular_velocities[i] = Vector3::y() * if i / 7 == 2 { 60.0 } else { 3.0 };
        }
        let step = StepParams { formulation: Formulation::Newton, max_iterations: 6, ..StepParams::DEFAULT };
        let settings = Settings { step, ..Settings::default() };
        let mut recording = Recording::new(&model, &state, &settings).unwrap();
        let sizes = |recording: &Recording| recording.backs.iter().map(Back::sets).collect::<Vec<_>>();
        assert_eq!(sizes(&recording), [5]);
        let halved = (0..4).filter(|_| recording.step(0.05).unwrap().status == Status::ConvergedInSubsteps).count();
        assert!(halved > 0);
        assert_eq!(sizes(&recording), [4, 1]);
    }
}

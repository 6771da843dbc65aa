//! A run that keeps its steps, to go back through them.

use std::sync::Arc;

use nalgebra::Vector3;
use rayon::prelude::*;
use rod::{Body, Model, State};

use super::adjoint::{Adjoint, Origin};
use super::replay::Replay;
use super::run::{Passed, Run, has_bodies};
use super::{AirVariation, DerivativeError, HeldVariation, ObstacleVariation, StateVariation, Variation};
use crate::component::Members;
use crate::simulation::{Settings, Simulation, StepReport};
use crate::snapshot::Snapshot;

/// A shift and a turn.
pub(super) type Pair = [Vector3<f64>; 2];

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
    /// Obstacles: where they are at the start and at the end of each step.
    pub obstacles: bool,
}

impl Wanted {
    /// All of it.
    pub const ALL: Self = Self { joints: true, segments: true, loads: true, surroundings: true, obstacles: true };
}

/// A simulation in formulation `newton` that keeps its steps, to go back through them: all of them, about 220 bytes a segment
/// and step (340 with the integrator bdf2), or with [`Recording::with_checkpoints`] one stretch of them at a time.
///
/// Steps are solved as those of [`super::Forward`].
pub struct Recording {
    model: Model,
    run: Run,
    sets: Vec<Set>,
    /// Steps between two checkpoints.
    stretch: usize,
    /// The simulation at the start of each stretch.
    checkpoints: Vec<Snapshot>,
    /// Lengths of all steps [s].
    lengths: Vec<f64>,
    /// Whether the last stretch is kept.
    is_kept: bool,
}

struct Set {
    adjoint: Adjoint,
    kept: Vec<Passed>,
    /// The step that the way back has come to.
    at: usize,
    /// What all sets feel, which is summed set by set: the same bits whatever the stretches.
    gravity: Vector3<f64>,
    damping: [f64; 2],
    air: AirVariation,
    /// Derivatives with respect to the poses of held bodies, a list a body.
    held: Vec<(usize, Vec<Pair>)>,
    /// The same of obstacles; none where they are not wanted.
    obstacles: Vec<Vec<Pair>>,
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
        let set = |(members, replay): (Members, Replay)| {
            let adjoint = Adjoint::new(members, replay, origin.clone());
            Set {
                adjoint,
                kept: Vec::new(),
                at: 0,
                gravity: Vector3::zeros(),
                damping: [0.0; 2],
                air: AirVariation::default(),
                held: Vec::new(),
                obstacles: Vec::new(),
            }
        };
        let sets = sets.into_iter().map(set).collect();
        let (checkpoints, lengths) = (Vec::new(), Vec::new());
        Ok(Self { model: model.clone(), run, sets, stretch, checkpoints, lengths, is_kept: true })
    }

    /// Advances by `dt` [s].
    ///
    /// # Errors
    /// If `dt` is not finite and positive, or the step does not converge, or one before has not: there is no gradient then.
    pub fn step(&mut self, dt: f64) -> Result<StepReport, DerivativeError> {
        self.run.check()?;
        if self.run.steps == self.checkpoints.len().saturating_mul(self.stretch) {
            self.checkpoints.push(self.run.simulation.snapshot());
            self.sets.iter_mut().for_each(|set| set.kept.clear());
            self.is_kept = true;
        }
        let report = self.step_kept(dt)?;
        self.lengths.push(dt);
        Ok(report)
    }

    fn step_kept(&mut self, dt: f64) -> Result<StepReport, DerivativeError> {
        let (report, passed) = self.run.step(dt)?;
        for (set, passed) in self.sets.iter_mut().zip(passed) {
            for mut passed in passed {
                if let Some(before) = set.kept.last() {
                    passed.substep.share_poses(&before.substep);
                }
                set.kept.push(passed);
            }
        }
        Ok(report)
    }

    /// Takes the steps of a stretch once more.
    fn repeat(&mut self, stretch: usize) -> Result<(), DerivativeError> {
        self.run.simulation.restore(&self.checkpoints[stretch])?;
        self.sets.iter_mut().for_each(|set| set.kept.clear());
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
        if wanted.segments && has_bodies(&self.model) {
            return Err(DerivativeError::Unknown("masses of rigid bodies"));
        }
        for (step, of) in objective {
            of.check(&self.model)?;
            if *step > self.run.steps {
                return Err(DerivativeError::Size { what: "steps", found: *step, expected: self.run.steps });
            }
        }
        let steps = self.lengths.len();
        for set in &mut self.sets {
            let obstacles = if wanted.obstacles { self.model.contacts.obstacles.len() } else { 0 };
            set.begin(steps, obstacles, objective);
        }
        // Each thread has its part of the sets. These write to places of their own, so that parts add up to the same bits.
        let share = self.sets.len().div_ceil(rayon::current_num_threads()).max(1);
        let mut parts: Vec<Variation> = self.sets.chunks(share).map(|_| Variation::zero(&self.model)).collect();
        let last = self.checkpoints.len().saturating_sub(1);
        let end = if last > 0 || !self.is_kept { Some(self.run.simulation.snapshot()) } else { None };
        for stretch in (0..self.checkpoints.len()).rev() {
            if stretch < last || !self.is_kept {
                self.is_kept = false;
                self.repeat(stretch)?;
            }
            let parts = self.sets.par_chunks_mut(share).zip(&mut parts);
            let back = |(sets, out): (&mut [Set], &mut Variation)| {
                sets.iter_mut().try_for_each(|set| set.back(&self.model, objective, wanted, out))
            };
            parts.map(back).collect::<Vec<_>>().into_iter().collect::<Result<(), DerivativeError>>()?;
        }
        if let Some(end) = end {
            self.run.simulation.restore(&end)?;
            self.run.steps = steps;
        }
        let mut parts = parts.into_iter();
        let mut out = parts.next().unwrap_or_else(|| Variation::zero(&self.model));
        parts.for_each(|part| out.add(&part));
        for set in &mut self.sets {
            set.end(objective, &mut out);
        }
        Ok(out)
    }
}

impl Set {
    /// Begins the way back at the end of a run of so many steps among so many obstacles.
    fn begin(&mut self, steps: usize, obstacles: usize, objective: &[(usize, StateVariation)]) {
        self.held = self.adjoint.held().into_iter().map(|body| (body, vec![[Vector3::zeros(); 2]; steps])).collect();
        self.obstacles = vec![vec![[Vector3::zeros(); 2]; steps + 1]; obstacles];
        (self.gravity, self.damping, self.air) = (Vector3::zeros(), [0.0; 2], AirVariation::default());
        self.at = steps;
        self.adjoint.begin();
        self.adjoint.add_objective(objective, steps);
    }

    /// Comes to an earlier step.
    fn go_to(&mut self, step: usize, objective: &[(usize, StateVariation)]) {
        while self.at > step {
            self.at -= 1;
            self.adjoint.add_objective(objective, self.at);
        }
    }

    /// Goes back through the steps that are kept.
    fn back(
        &mut self,
        model: &Model,
        objective: &[(usize, StateVariation)],
        wanted: Wanted,
        out: &mut Variation,
    ) -> Result<(), DerivativeError> {
        self.exchange_sums(out);
        let done = self.back_through(model, objective, wanted, out);
        self.exchange_sums(out);
        done
    }

    fn exchange_sums(&mut self, out: &mut Variation) {
        std::mem::swap(&mut self.gravity, &mut out.gravity);
        std::mem::swap(&mut self.damping, &mut out.damping);
        std::mem::swap(&mut self.air, &mut out.air);
    }

    fn back_through(
        &mut self,
        model: &Model,
        objective: &[(usize, StateVariation)],
        wanted: Wanted,
        out: &mut Variation,
    ) -> Result<(), DerivativeError> {
        for k in (0..self.kept.len()).rev() {
            self.go_to(self.kept[k].step + 1, objective);
            let Self { adjoint, kept, held, obstacles, .. } = self;
            let Passed { substep, step, shares } = &kept[k];
            adjoint.step_back(model, substep, wanted, out).ok_or(DerivativeError::Singular { step: step + 1 })?;
            for (body, poses) in held {
                for (pose, share) in adjoint.of_held(*body).into_iter().zip(shares) {
                    let mut add = |step: usize, share: f64| (0..2).for_each(|k| poses[step][k] += pose[k] * share);
                    add(*step, *share);
                    if *step > 0 {
                        add(step - 1, 1.0 - share);
                    }
                    adjoint.add_base(*body, pose, out);
                }
            }
            for (obstacle, poses) in adjoint.of_obstacles() {
                for (pose, share) in poses.iter().zip(shares) {
                    for (frame, share) in [(*step, 1.0 - share), (step + 1, *share)] {
                        (0..2).for_each(|k| obstacles[*obstacle][frame][k] += pose[k] * share);
                    }
                }
            }
        }
        Ok(())
    }

    /// Ends the way back.
    fn end(&mut self, objective: &[(usize, StateVariation)], out: &mut Variation) {
        self.go_to(0, objective);
        self.adjoint.end(out);
        out.gravity += self.gravity;
        (0..2).for_each(|k| out.damping[k] += self.damping[k]);
        out.air.add(&self.air);
        let members = &self.adjoint.members;
        for (body, poses) in self.held.drain(..) {
            let body = match body.checked_sub(members.segments.len()) {
                None => Body::Segment(members.segments[body]),
                Some(anchor) => Body::Anchor(members.anchors[anchor]),
            };
            out.held.push(HeldVariation { body, poses });
        }
        let obstacles = self.obstacles.drain(..).enumerate();
        out.obstacles.extend(obstacles.map(|(obstacle, poses)| ObstacleVariation { obstacle, poses }));
    }
}

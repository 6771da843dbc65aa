//! A run that derivatives are taken of: its simulation, and the steps that its connected sets are taken through.

use std::collections::HashMap;
use std::sync::Arc;

use component::{Alike, split, split_alike, whole};
use dynamics::formulation::Tangent;
use dynamics::simulation::{Settings, Simulation, StepReport};
use dynamics::step::{Interval, Status, StepParams};
use dynamics::substep::Substep;
use jointed::linear::solvers::SolverKind;
use jointed::tangent::elimination::Elimination;
use rod::{Model, State};

use super::DerivativeError;
use super::error::refuse;

/// What contacts are solved to, relative to radii.
const CONTACT_TOLERANCE: f64 = 1e-8;

/// A simulation in formulation `newton` whose steps are solved to the end.
pub(super) struct Run {
    pub(super) simulation: Simulation,
    /// Steps so far.
    pub(super) steps: usize,
    /// Number of the set that a segment is the first of.
    sets: HashMap<usize, usize>,
    /// The step that was not solved, after which there are no derivatives.
    failed: Option<(usize, Status)>,
}

/// An accepted step of a connected set, or a part of one.
pub(super) struct Passed {
    pub(super) substep: Substep,
    /// Of which step, from 0, and how much of it is over at its start and its end.
    pub(super) step: usize,
    pub(super) shares: [f64; 2],
}

impl Passed {
    /// Whether another set has gone through the same part of a step, but for what it was there.
    pub(super) fn is_like(&self, other: &Self) -> bool {
        (self.step, self.shares) == (other.step, other.shares)
            && self.substep.interval == other.substep.interval
            && self.substep.begins_anew == other.substep.begins_anew
    }
}

/// Settings with which steps are solved to the end.
fn solved(model: &Model, settings: &Settings) -> Result<Settings, DerivativeError> {
    if !settings.step.formulation.momentum() {
        return Err(DerivativeError::Formulation);
    }
    let touches = !model.contacts.is_empty();
    let exact = !touches && split(model).iter().all(|(_, topology)| Elimination::<f64>::new(topology).is_some());
    let step = StepParams {
        relative_tolerance: settings.step.relative_tolerance.min(1e-10),
        motion_tolerance: settings.step.motion_tolerance.min(1e-10),
        absolute_tolerance: settings.step.absolute_tolerance.min(1e-12),
        contact_tolerance: settings.step.contact_tolerance.min(CONTACT_TOLERANCE),
        tangent: if exact { Tangent::Exact } else { Tangent::Positive },
        ..settings.step
    };
    // Sets with more loops than one know no exact tangent; none may be stepped in lanes. What can touch never is.
    let solver = if exact || touches { settings.solver } else { SolverKind::Sparse };
    Ok(Settings { step, solver })
}

/// Refuses what is not differentiated of a run.
fn check(model: &Model) -> Result<(), DerivativeError> {
    let contacts = &model.contacts;
    let surfaces = contacts.between_segments.iter().chain(contacts.obstacles.iter().map(|obstacle| &obstacle.surface));
    refuse(surfaces.into_iter().any(|surface| surface.restitution > 0.0), "contacts that bounce")?;
    refuse(contacts.allow_overlap, "overlaps at the start")?;
    refuse(!model.breakable.is_empty(), "joints that can break")?;
    check_all(model)
}

/// Refuses what is not differentiated of a model, but for contacts.
pub(super) fn check_all(model: &Model) -> Result<(), DerivativeError> {
    let has_bodies = model.segments.iter().any(|segment| segment.body.is_some());
    refuse(has_bodies && model.air.is_some(), "rigid bodies in air")?;
    refuse(!model.sliding_joints.is_empty(), "eyelets")?;
    refuse(!model.pulleys.is_empty(), "pulleys")?;
    refuse(model.has_followers(), "loads that turn with their segments")?;
    refuse(!model.lifts.is_empty(), "buoyancy")?;
    refuse(!model.contacts.sheaths.is_empty(), "sheaths")?;
    refuse(!model.laws.is_empty(), "joints that are not elastic")?;
    refuse(model.motions.iter().any(|driven| driven.is_timed()), "grips that take hold or let go on the way")?;
    refuse(model.air.as_ref().is_some_and(|air| air.wind.has_gusts()), "gusts")
}

impl Run {
    /// A run from `state`, and its connected sets, alike ones together: those of which several go side by side. Sets are numbered in
    /// that order.
    ///
    /// # Errors
    /// If the formulation is not `newton`, the simulation cannot start, or the model has what is not differentiated.
    pub(super) fn new(
        model: &Model,
        state: &State,
        settings: &Settings,
    ) -> Result<(Self, Vec<Alike>), DerivativeError> {
        let settings = solved(model, settings)?;
        check(model)?;
        let mut simulation = Simulation::new(model, state, &settings, None)?;
        let (all, topology) = whole(model);
        simulation.record_substeps(&all);
        // What can touch is stepped together.
        let sets = match model.contacts.is_empty() {
            true => split_alike(model),
            false => vec![Alike { topology: Arc::new(topology), sets: vec![all], slides: false, is_inelastic: false }],
        };
        let firsts = sets.iter().flat_map(|alike| &alike.sets).enumerate();
        let numbers = firsts.filter_map(|(k, members)| Some((*members.segments.first()?, k))).collect();
        Ok((Self { simulation, steps: 0, sets: numbers, failed: None }, sets))
    }

    /// Whether all steps were solved.
    ///
    /// # Errors
    /// With the step that was not.
    pub(super) fn check(&self) -> Result<(), DerivativeError> {
        self.failed.map_or(Ok(()), |(step, status)| Err(DerivativeError::Step { step, status }))
    }

    /// Advances by `dt` [s]. Returns, beside how the step ended, what every set has passed through.
    ///
    /// # Errors
    /// If `dt` is not finite and positive, or a step does not converge, now or before. ([`Status::PastHalfTurn`] is solved.)
    pub(super) fn step(&mut self, dt: f64) -> Result<(StepReport, Vec<Vec<Passed>>), DerivativeError> {
        self.check()?;
        let begin = self.simulation.time();
        let report = self.simulation.step(dt)?;
        self.steps += 1;
        if !report.status.is_solved() {
            self.failed = Some((self.steps, report.status));
            self.check()?;
        }
        let step = self.steps - 1;
        let mut all: Vec<Vec<Passed>> = self.sets.iter().map(|_| Vec::new()).collect();
        for (members, substeps) in self.simulation.take_substeps() {
            let Some(&set) = members.segments.first().and_then(|first| self.sets.get(first)) else { continue };
            all[set].extend(substeps.into_iter().map(|substep| {
                let Interval { time, dt: own } = substep.interval;
                let shares = [time, time + own].map(|time| (time - begin) / dt);
                Passed { substep, step, shares }
            }));
        }
        Ok((report, all))
    }
}

//! Many connected sets of segments, stepped side by side: the entry point of this crate.

mod feeds;
mod holds;

use std::collections::HashSet;
use std::sync::Arc;

use component::snapshot::{Snapshot, StateVisitor};
use component::{Alike, Component, Members, has_loose, split, split_alike};
use contact::exclusion::PairFilter;
use jointed::linear::solvers::SolverKind;
use jointed::topology::Topology;
use kernels::parallel;
use nalgebra::Vector3;
use rod::Integrator;
use rod::{Body, Break, Carried, Changing, JointForce, Model, ModelError, OnPulley, Sliding, State};
use thiserror::Error;

use crate::attempt::{Exact, TangentChoice};
use crate::connected_set::{ConnectedSet, Projector};
use crate::contact_world::ContactWorld;
use crate::counters::Counters;
use crate::formulation::{ContactProjection, Tangent};
use crate::guess::InitialGuess;
use crate::lane_batch::LaneBatch;
use crate::limits::PARALLEL_SEGMENTS;
use crate::piece::Piece;
use crate::projection::{Predictor, ProjectionFactory};
use crate::step::{Interval, Status, StepParams, StepParamsError};
use crate::substep::Substep;

pub use contact::overlap::{Overlap, Overlapped};
pub use holds::{Taken, TimedGrip};
pub use rod::{ContactForce, Touched, contact_wrenches};

pub use friction::ParamsError as ContactParamsError;

pub use crate::contact_params::ContactParams;

/// How to simulate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Settings {
    /// Formulation, tolerances, caps.
    pub step: StepParams,
    /// Linear solver.
    pub solver: SolverKind,
}

/// Makes the guess of one connected set of segments; `None` for a zero start.
pub type GuessFactory<'a> = &'a dyn Fn(&Model, &Members, &Topology) -> Option<Box<dyn InitialGuess>>;

/// Why a simulation cannot start.
#[derive(Debug, Error)]
pub enum SimulationError {
    /// The model or the state is not valid.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A guess for whole steps with a formulation that never corrects it.
    #[error("a guess for the start of a whole step needs formulation newton; {0} would keep its error in the motion")]
    StepGuess(crate::formulation::Formulation),
    /// Predictions in the place of solves with an integrator that they do not know.
    #[error("predictions in the place of solves need integrator euler, not {0}")]
    Projection(Integrator),
    /// The exact tangent where there is none.
    #[error("tangent exact needs {0}")]
    Tangent(&'static str),
    /// A speed for a feed that is not there.
    #[error("sliding joint {0} has no feed")]
    NoFeed(usize),
    /// Eyelets where rods cannot run through any.
    #[error("sliding joints need {0}")]
    Sliding(&'static str),
    /// Pulleys where rods cannot run over any.
    #[error("pulleys need {0}")]
    Pulleys(&'static str),
    /// Sheaths where rods cannot run through any.
    #[error("sheaths need {0}")]
    Sheaths(&'static str),
    /// Joints with laws where nothing knows of them.
    #[error("joints that are not elastic need {0}")]
    Inelastic(&'static str),
    /// Joints that can break where nothing knows of them.
    #[error("joints that can break need {0}")]
    Breakable(&'static str),
    /// The solver cannot be set up for this graph.
    #[error(transparent)]
    Solver(#[from] jointed::linear::solvers::SolverError),
    /// A parameter of the steps is not allowed.
    #[error("step parameter {0}")]
    Step(#[from] StepParamsError),
    /// Bodies overlap at the start.
    #[error(transparent)]
    Overlap(#[from] Overlap),
    /// A contact parameter is not allowed.
    #[error(transparent)]
    ContactParams(#[from] ContactParamsError),
    /// A time step that is not positive and finite.
    #[error("time step dt = {0} s, but it must be finite and > 0")]
    TimeStep(f64),
    /// A motion for what moves freely, or is not there.
    #[error("a motion for {0}, but only fixed segments and anchors of the model can be driven")]
    NotHeld(Body),
    /// A motion for an obstacle that is not there.
    #[error("a motion for obstacle {0}, but the model has no such obstacle")]
    NoObstacle(usize),
    /// A load that is not there.
    #[error("load {index} does not exist (the model has {count})")]
    NoLoad {
        /// The index asked for.
        index: usize,
        /// Loads that there are.
        count: usize,
    },
    /// A joint that is not there.
    #[error("joint {index} does not exist (the model has {count})")]
    NoJoint {
        /// The index asked for.
        index: usize,
        /// Joints that there are.
        count: usize,
    },
    /// A load, gravity or a rest shape is set that the model changes over time.
    #[error("{0} changes over time as the model says, and cannot be set")]
    Changes(String),
    /// A force, a torque, gravity or a rest shape that is not finite.
    #[error("{0} must be finite")]
    NotFinite(String),
    /// A copy of a batch that cannot be simulated.
    #[error("copy {index}: {source}")]
    Copy {
        /// Index of the copy.
        index: usize,
        /// Why not.
        source: Box<SimulationError>,
    },
    /// A snapshot of something else.
    #[error("the snapshot is of a simulation with another model, solver or guess")]
    Snapshot,
    /// What is not held, or is not there, is to be let go.
    #[error("{0} is not held, and so cannot be released")]
    NothingToRelease(Body),
    /// What is held already, or is not there, is to be taken hold of.
    #[error("{0} is no free segment and no open anchor of the model, and so cannot be attached")]
    NothingToAttach(Body),
    /// Free joints where nothing knows of them.
    #[error("{0} knows no ball joints, hinges, grips that open and joints that break, but the model has some")]
    Loose(String),
}

/// Refuses a model with joints that leave something free for `what`, which knows none.
fn without_loose(model: &Model, what: &str) -> Result<(), SimulationError> {
    if has_loose(model) { Err(SimulationError::Loose(what.to_owned())) } else { Ok(()) }
}

/// What the exact tangent needs and these settings and this model lack.
fn lacks_for_exact(model: &Model, settings: &Settings) -> Option<&'static str> {
    if !settings.step.formulation.momentum() {
        return Some("formulation newton");
    }
    let is_coupled = settings.step.contact_projection == ContactProjection::Coupled || model.contacts.is_empty();
    (!is_coupled).then_some("contacts that are coupled")
}

/// A model in motion.
pub struct Simulation {
    pieces: Vec<Piece>,
    /// Groups of lanes that have come apart, in order: their place among the pieces at first, and how many sets each was of.
    parted: Vec<[usize; 2]>,
    params: StepParams,
    solver: SolverKind,
    /// Whether a segment is fixed, one a segment.
    held: Vec<bool>,
    /// Whether an anchor is open, one an anchor.
    open: Vec<bool>,
    /// The model's grips with times.
    schedule: Vec<holds::Scheduled>,
    /// Stores of rods that are fed.
    stores: Vec<feeds::Store>,
    /// Anchors that were driven, closed or opened on the way.
    moved_anchors: Vec<usize>,
    /// Whether the model changes a load over time, one a load.
    loads_change: Vec<bool>,
    /// Whether it changes gravity.
    gravity_changes: bool,
    /// Whether it changes the rest of each joint.
    rests_change: Vec<bool>,
    time: f64,
    /// What rounding has left out of the time [s]: a sum of many steps is as exact as one number can be.
    time_lost: f64,
}

/// What a step came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StepReport {
    /// The worst status of all connected sets.
    pub status: Status,
}

impl Simulation {
    /// A simulation of `model` from `state`. Rods with the same connectivity are stepped in groups, one a lane, where
    /// the solver is direct and no guess is made for any of them.
    ///
    /// # Errors
    /// If model, state or settings do not fit together, or bodies that can touch overlap by more than
    /// `contact_tolerance` and [`rod::Contacts::allow_overlap`] does not allow it.
    pub fn new(
        model: &Model,
        state: &State,
        settings: &Settings,
        guess: Option<GuessFactory<'_>>,
    ) -> Result<Self, SimulationError> {
        model.validate(state)?;
        settings.step.validate()?;
        let model = &*settings.step.formulation.measured(model);
        if let SolverKind::Cg(_) = settings.solver {
            without_loose(model, &format!("solver {}", settings.solver))?;
        }
        if !model.laws.is_empty() && !settings.step.formulation.momentum() {
            return Err(SimulationError::Inelastic("formulation newton"));
        }
        if !model.breakable.is_empty() && !settings.step.formulation.momentum() {
            return Err(SimulationError::Breakable("formulation newton"));
        }
        let touches = !model.contacts.is_empty();
        let is_coupled = settings.step.contact_projection == ContactProjection::Coupled;
        let exact = settings.step.tangent == Tangent::Exact;
        match lacks_for_exact(model, settings) {
            Some(lacking) if !model.sliding_joints.is_empty() => return Err(SimulationError::Sliding(lacking)),
            Some(lacking) if !model.pulleys.is_empty() => return Err(SimulationError::Pulleys(lacking)),
            Some(lacking) if !model.contacts.sheaths.is_empty() => return Err(SimulationError::Sheaths(lacking)),
            Some(lacking) if exact => return Err(SimulationError::Tangent(lacking)),
            _ => {}
        }
        let may_be_exact = settings.step.may_be_exact()
            && (!touches || is_coupled)
            && (exact || settings.solver == SolverKind::Direct);
        let grouping = settings.solver == SolverKind::Direct && !touches;
        let mut pieces = Vec::new();
        let mut singles = Vec::new();
        for alike in split_alike(model) {
            let guess_of = |members: &Members| guess.and_then(|factory| factory(model, members, &alike.topology));
            let guesses: Vec<_> = alike.sets.iter().map(guess_of).collect();
            let helps_steps = guesses.iter().flatten().any(|guess| guess.helps_steps());
            if helps_steps && !settings.step.formulation.momentum() {
                return Err(SimulationError::StepGuess(settings.step.formulation));
            }
            let Alike { topology, sets, .. } = &alike;
            if grouping && alike.fill_lanes() && guesses.iter().all(Option::is_none) {
                pieces.extend(LaneBatch::new(model, state, topology, sets.clone(), &settings.step).into_pieces());
                continue;
            }
            for (members, guess) in alike.sets.into_iter().zip(guesses) {
                let mut component = Component::new(model, state, alike.topology.clone(), &[&members]);
                component.integrate_by(settings.step.integrator);
                if alike.slides {
                    component.add_eyelets_of(model, &members);
                }
                let solver = settings.solver.build(model, &members, &alike.topology)?;
                let mut set = ConnectedSet::new(component, members, Projector::Solve { solver, guess });
                if may_be_exact || alike.slides {
                    set.exact = Exact::new(&alike.topology);
                    set.tangents =
                        (!exact && !alike.slides && set.exact.is_some()).then(|| TangentChoice::new(&alike.topology));
                }
                if alike.slides && alike.topology.elimination.is_none() {
                    let what = "rods without loops";
                    return Err(match model.sliding_joints.is_empty() {
                        true => SimulationError::Pulleys(what),
                        false => SimulationError::Sliding(what),
                    });
                }
                if exact && set.exact.is_none() {
                    return Err(SimulationError::Tangent("rods with at most one loop a set"));
                }
                if exact && touches && alike.topology.elimination.is_none() {
                    return Err(SimulationError::Tangent("rods without loops where something can touch them"));
                }
                singles.push(set);
            }
        }
        Self::of(model, state, pieces, singles, settings)
    }

    /// A simulation whose constraint projections are predicted instead of solved: the paper's end-to-end comparison.
    /// Each step has at most `params.max_iterations` predictions, and no substeps. Contacts follow each prediction, with the
    /// bodies' own masses, as in Algorithm 1 ([`ContactProjection::Alternating`]): nothing says how the rods would answer
    /// them.
    ///
    /// # Errors
    /// If model and state do not fit together, bodies overlap as in [`Simulation::new`], or the integrator is not Euler's.
    pub fn end_to_end(
        model: &Model,
        state: &State,
        params: &StepParams,
        projection: ProjectionFactory<'_>,
    ) -> Result<Self, SimulationError> {
        model.validate(state)?;
        params.validate()?;
        let model = &*params.formulation.measured(model);
        without_loose(model, "a prediction in place of solves")?;
        if !model.sliding_joints.is_empty() {
            return Err(SimulationError::Sliding("solves, not predictions in their place"));
        }
        if !model.pulleys.is_empty() {
            return Err(SimulationError::Pulleys("solves, not predictions in their place"));
        }
        if !model.contacts.sheaths.is_empty() {
            return Err(SimulationError::Sheaths("solves, not predictions in their place"));
        }
        if !model.laws.is_empty() {
            return Err(SimulationError::Inelastic("solves, not predictions in their place"));
        }
        if params.integrator != Integrator::Euler {
            return Err(SimulationError::Projection(params.integrator));
        }
        let single = |(members, topology): (Members, Topology)| {
            let projection = projection(model, &members, &topology);
            let component = Component::new(model, state, Arc::new(topology), &[&members]);
            let predictor = Predictor::new(projection, component.poses.len());
            ConnectedSet::new(component, members, Projector::Predict(predictor))
        };
        let singles = split(model).into_iter().map(single).collect();
        let contact_projection = ContactProjection::Alternating;
        let step = StepParams { contact_projection, max_halvings: 0, ..*params };
        Self::of(model, state, Vec::new(), singles, &Settings { step, solver: SolverKind::Direct })
    }

    /// A simulation of these pieces and sets, which go in step where they can touch.
    fn of(
        model: &Model,
        state: &State,
        mut pieces: Vec<Piece>,
        singles: Vec<ConnectedSet>,
        &Settings { step: params, solver }: &Settings,
    ) -> Result<Self, SimulationError> {
        params.contact.validate()?;
        if model.contacts.is_empty() {
            pieces.extend(singles.into_iter().map(|set| Piece::Single(Box::new(set))));
        } else {
            let mut filter = PairFilter::new(model);
            feeds::refuse_overlaps_outside(model, state, &singles, &mut filter, params.contact_tolerance)?;
            let sets = ContactWorld::new(model, singles, filter, &params)?;
            pieces.push(Piece::ContactWorld(Box::new(sets)));
        }
        let held = model.segments.iter().map(|segment| segment.fixed).collect();
        let changing: HashSet<Changing> = model.changes.iter().map(|change| change.of).collect();
        let changes = |of: &[Changing]| of.iter().any(|of| changing.contains(of));
        let mut simulation = Self {
            pieces,
            parted: Vec::new(),
            params,
            solver,
            stores: feeds::stores(model),
            held,
            open: (0..model.anchors.len()).map(|anchor| model.open.contains(&anchor)).collect(),
            schedule: holds::schedule(model),
            moved_anchors: Vec::new(),
            loads_change: (0..model.loads.len()).map(|i| changes(&[Changing::Force(i), Changing::Torque(i)])).collect(),
            gravity_changes: changes(&[Changing::Gravity]),
            rests_change: model.changing_rests(),
            time: 0.0,
            time_lost: 0.0,
        };
        simulation.keep_stores(0.0)?;
        Ok(simulation)
    }

    /// Advances by `dt` [s]: on rayon's current thread pool where there is enough to share, with the same bits on any
    /// number of threads. Before it, the model's grips take hold and let go whose time has come: see [`rod::Driven`].
    ///
    /// # Errors
    /// If `dt` is not finite and positive, or the factor of a set with a segment that is let go would be too large.
    pub fn step(&mut self, dt: f64) -> Result<StepReport, SimulationError> {
        if !(dt.is_finite() && dt > 0.0) {
            return Err(SimulationError::TimeStep(dt));
        }
        if !self.schedule.is_empty() {
            self.keep_schedule()?;
        }
        self.keep_stores(dt)?;
        let params = self.params;
        let interval = Interval { time: self.time, dt };
        let grain = self.shares_pieces().then_some(1);
        let status =
            parallel::reduce(&mut self.pieces, grain, |_, piece| piece.advance(interval, &params), Status::max);
        let (before, step) = (self.time, dt - self.time_lost);
        self.time += step;
        self.time_lost = (self.time - before) - step;
        Ok(StepReport { status: status.unwrap_or(Status::Converged) })
    }

    /// Whether pieces are stepped side by side on several threads.
    fn shares_pieces(&self) -> bool {
        self.pieces.len() > 1 && self.held.len() >= PARALLEL_SEGMENTS && parallel::threads() > 1
    }

    /// Threads that share a step: those of rayon's current pool where there is more than one piece to step and enough of
    /// it, else 1.
    pub fn threads(&self) -> usize {
        let shares_sets = |piece: &Piece| matches!(piece, Piece::ContactWorld(sets) if sets.is_parallel());
        if self.shares_pieces() || self.pieces.iter().any(shares_sets) { parallel::threads() } else { 1 }
    }

    /// Number of connected sets that move in the lanes of vector registers.
    pub fn in_lanes(&self) -> usize {
        self.components() - self.singles().count()
    }

    /// Time since the start [s].
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Copies poses and velocities to `state`, which must be of the model's size.
    pub fn store(&self, state: &mut State) {
        for piece in &self.pieces {
            piece.store(state);
        }
    }

    /// Copies what each joint transmits at the end of the last step to `forces`, which must have an entry for each joint of
    /// the model.
    pub fn store_joint_forces(&self, forces: &mut [JointForce]) {
        for piece in &self.pieces {
            piece.store_joint_forces(forces);
        }
    }

    /// The joints that have broken so far, in the order of time and then of joints. Their sets go on as one: in the same island and with one
    /// status.
    pub fn breaks(&self) -> Vec<Break> {
        let mut breaks: Vec<Break> = self.singles().flat_map(Component::breaks).copied().collect();
        breaks.sort_by(|a, b| a.time.total_cmp(&b.time).then(a.joint.cmp(&b.joint)));
        breaks
    }

    /// Copies where each sliding joint of the model is and what it does to `sliding`, which must have an entry for each.
    pub fn store_sliding(&self, sliding: &mut [Sliding]) {
        self.singles().for_each(|component| component.each_sliding(|index, own| sliding[index] = own));
    }

    /// Copies where rods are on each pulley of the model and what it does to `pulleys`, which must have an entry for each.
    pub fn store_pulleys(&self, pulleys: &mut [OnPulley]) {
        self.singles().for_each(|component| component.each_pulley(|index, own| pulleys[index] = own));
    }

    /// Copies how the last step ended for the connected set of each segment to `statuses`, which must have an entry for each
    /// segment; all are [`Status::Converged`] before the first step.
    pub fn store_statuses(&self, statuses: &mut [Status]) {
        for piece in &self.pieces {
            piece.store_statuses(statuses);
        }
    }

    /// Copies what every contact that presses gives its segment at the end of the last step to `forces`, in place of what
    /// was there; in the order of segments.
    pub fn store_contact_forces(&self, forces: &mut Vec<ContactForce>) {
        forces.clear();
        for piece in &self.pieces {
            piece.store_contact_forces(forces);
        }
    }

    /// Changes a load of the model, by its index in [`Model::loads`], from the next step on: a force of one's own, which may
    /// be another one before each step; where it jumps, [`Simulation::restart`] helps. Force [N] and torque [N m] are in world axes, of a load that follows its segment in
    /// the segment's ([`rod::Load::follows`]); the force acts where the model says.
    ///
    /// # Errors
    /// If there is no such load, the model changes it over time, or a number is not finite.
    pub fn set_load(&mut self, index: usize, force: Vector3<f64>, torque: Vector3<f64>) -> Result<(), SimulationError> {
        let what = || format!("load {index}");
        match self.loads_change.get(index) {
            None => return Err(SimulationError::NoLoad { index, count: self.loads_change.len() }),
            Some(true) => return Err(SimulationError::Changes(what())),
            Some(false) => {}
        }
        if !force.iter().chain(&torque).all(|x| x.is_finite()) {
            return Err(SimulationError::NotFinite(what()));
        }
        self.pieces.iter_mut().for_each(|piece| piece.set_load(index, &force, &torque));
        Ok(())
    }

    /// Restarts the integrator: the next step is one of Euler's rule. For forces that jump, which steps of second order would take for a
    /// change that goes on: let go of a weight, and without it the fall begins by `g dt / 3` too slowly.
    pub fn restart(&mut self) {
        self.pieces.iter_mut().for_each(Piece::restart);
    }

    /// Changes gravity [m/s^2] from the next step on.
    ///
    /// # Errors
    /// If the model changes it over time, or a number is not finite.
    pub fn set_gravity(&mut self, gravity: Vector3<f64>) -> Result<(), SimulationError> {
        let what = || "gravity".to_owned();
        if self.gravity_changes {
            return Err(SimulationError::Changes(what()));
        }
        if !gravity.iter().all(|x| x.is_finite()) {
            return Err(SimulationError::NotFinite(what()));
        }
        self.pieces.iter_mut().for_each(|piece| piece.set_gravity(&gravity));
        Ok(())
    }

    /// Changes the rest Darboux vector [1/m] of a joint, [`rod::Joint::rest_darboux`], from the next step on: a muscle, a motor, a wire with
    /// memory. What is measured off a model, energies and strains, takes the model's own: change it there, too.
    ///
    /// # Errors
    /// If there is no such joint, the model changes its rest over time, or a number is not finite.
    pub fn set_rest(&mut self, joint: usize, darboux: Vector3<f64>) -> Result<(), SimulationError> {
        let what = || format!("the rest of joint {joint}");
        match self.rests_change.get(joint) {
            None => return Err(SimulationError::NoJoint { index: joint, count: self.rests_change.len() }),
            Some(true) => return Err(SimulationError::Changes(what())),
            Some(false) => {}
        }
        if !darboux.iter().all(|x| x.is_finite()) {
            return Err(SimulationError::NotFinite(what()));
        }
        self.pieces.iter_mut().for_each(|piece| piece.set_rest(joint, &darboux));
        Ok(())
    }

    /// All that the steps to come depend on, to go on from again and again with the same bits: see
    /// [`Simulation::restore`]. Nothing changes; it is mutable because one walk writes snapshots and reads them.
    pub fn snapshot(&mut self) -> Snapshot {
        let mut snapshot = Snapshot::default();
        self.snapshot_into(&mut snapshot);
        snapshot
    }

    /// [`Simulation::snapshot`] in the place of an older one. It costs a small part of a step, and allocates nothing where
    /// the older one was of this simulation and had as many contacts.
    pub fn snapshot_into(&mut self, snapshot: &mut Snapshot) {
        snapshot.write(|visitor| self.visit_state(visitor));
    }

    /// Goes back to a snapshot. What follows has the same bits as what followed then: poses, velocities, time, motions, loads,
    /// gravity, contacts that press and what guesses have learned are those of the snapshot. Counters go on: they say what was
    /// done in all. What [`Simulation::singles`] shows is still of the last solve.
    ///
    /// The snapshot may be of another simulation of the same model with the same solver and guesses. What was held then is held
    /// again, what was free is let go. A snapshot from before a segment was held or let go without a grip of the model may be of
    /// something else: one that was fixed all along couples its joints otherwise than then, and alike rods have gone apart. A new
    /// simulation can be restored from it.
    ///
    /// # Errors
    /// [`SimulationError::Snapshot`] if the snapshot is of something else; then nothing has changed.
    pub fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SimulationError> {
        let is_read = self.part_as_in(snapshot) && snapshot.read(|visitor| self.visit_state(visitor));
        if is_read { Ok(()) } else { Err(SimulationError::Snapshot) }
    }

    fn visit_state(&mut self, visitor: &mut StateVisitor<'_>) {
        // Another number where a snapshot comes to hold something else.
        visitor.size(3);
        visitor.number(&mut self.time);
        self.visit_parted(visitor);
        visitor.number(&mut self.time_lost);
        self.visit_holds(visitor);
        visitor.size(self.pieces.len());
        self.pieces.iter_mut().for_each(|piece| piece.visit_state(visitor));
    }

    /// Takes the velocities of `state`, which must be of the model's size: an impulse between two steps. Poses stay, and
    /// guesses are not told. Fixed segments go on with theirs from where they are; those whose velocities are the same
    /// keep their motion to the last bit.
    pub fn set_velocities(&mut self, state: &State) {
        for piece in &mut self.pieces {
            piece.set_velocities(state, self.time);
        }
    }

    /// Lets a motion drive an obstacle of the model from the next step on, whatever moved it before; its times are
    /// [`Simulation::time`]'s. Where it is elsewhere than the obstacle is now, the obstacle jumps there within the next step;
    /// [`Carried::gripped`] begins where the obstacle is ([`rod::Obstacle::at`]). A step in which it turns by more than 1 rad
    /// is done in halves. The model is not told: what draws it follows [`rod::Obstacle::motion`].
    ///
    /// # Errors
    /// If there is no such obstacle.
    pub fn drive_obstacle(&mut self, obstacle: usize, motion: &Carried) -> Result<(), SimulationError> {
        match self.pieces.iter_mut().any(|piece| piece.drive_obstacle(obstacle, motion)) {
            true => Ok(()),
            false => Err(SimulationError::NoObstacle(obstacle)),
        }
    }

    /// Keeps what derivatives need of each step from now on. `whole` are all segments.
    pub fn record_substeps(&mut self, whole: &Members) {
        self.pieces.iter_mut().for_each(|piece| piece.record_substeps(whole));
    }

    /// Takes what was kept since, set by set; of what can touch as one set.
    pub fn take_substeps(&mut self) -> impl Iterator<Item = (&Members, Vec<Substep>)> {
        self.pieces.iter_mut().flat_map(Piece::take_substeps)
    }

    /// Counters summed over all connected sets.
    pub fn counters(&self) -> Counters {
        let mut sum = Counters::default();
        for piece in &self.pieces {
            sum += piece.counters();
        }
        sum
    }

    /// Number of connected sets of segments.
    pub fn components(&self) -> usize {
        self.pieces.iter().map(Piece::sets).sum()
    }

    /// The components that are stepped one by one, in order: what a guess or a linear solver worked on last.
    pub fn singles(&self) -> impl Iterator<Item = &Component<f64>> {
        self.pieces.iter().flat_map(Piece::singles).map(|set| &set.component)
    }
}

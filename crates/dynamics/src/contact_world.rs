//! Connected sets of segments that can touch: Algorithm 1 island by island.
//!
//! In each step the sets that may touch are islands (`islands/grouping.rs`); each goes through its iterations and halvings by
//! itself (`island.rs`), on its own thread where there is enough to share. Where nothing is found between two islands at the
//! start of a step, but sets leave the rooms of that search, it is made sure at the end that none of them could have met.

mod island;

use component::snapshot::StateVisitor;
use component::{Change, Members};
use contact::duplicates::shapes;
use contact::exclusion::PairFilter;
use island::{Island, IslandWorkspace, begin_set, each};
use jointed::linear::solvers::{SolverError, SolverKind};
use kernels::Spatial;
use kernels::math::Sym3;
use kernels::parallel;
use nalgebra::Vector3;
use rod::ContactForce;
use rod::{Body, Carried, Model};

use crate::connected_set::{ConnectedSet, Touch};
use crate::counters::{Counters, Stopwatch};
use crate::islands::{IslandContacts, Islands, Sets, Shared};
use crate::limits::PARALLEL_SEGMENTS;
use crate::step::{Interval, Status, StepParams};
use crate::substep::Substep;

/// All connected sets of a model with contacts.
pub(crate) struct ContactWorld {
    /// Boxed: in each step those of an island are put side by side.
    #[allow(clippy::vec_box)]
    pub(crate) sets: Vec<Box<ConnectedSet>>,
    shared: Shared,
    islands: Islands,
    /// Contacts of each island, and what else it keeps.
    stages: Vec<IslandContacts>,
    workspaces: Vec<IslandWorkspace>,
    counters: Counters,
    segments: usize,
    /// All of them as one set, and the steps that were accepted since they were last taken, where derivatives ask for them.
    pub(crate) substeps: Option<(Members, Vec<Substep>)>,
}

impl ContactWorld {
    /// Sets of `model`, whose contacts must not be empty, from `state`.
    ///
    /// # Errors
    /// If a set's factor would be too large.
    pub(crate) fn new(
        model: &Model,
        sets: Vec<ConnectedSet>,
        filter: PairFilter,
        params: &StepParams,
    ) -> Result<Self, SolverError> {
        let mut sets: Vec<Box<ConnectedSet>> = sets.into_iter().map(Box::new).collect();
        for set in &mut sets {
            let bodies = set.component.poses.len();
            set.component.pushes = vec![Spatial::zero(); bodies];
            set.component.pushed = vec![Spatial::zero(); bodies];
            set.component.contact_stiffness = vec![Sym3::zero(); bodies];
        }
        let shapes = shapes(model, sets.iter().map(|set| &set.members));
        let shared = Shared::new(model, shapes, filter, params);
        for (number, set) in sets.iter_mut().enumerate() {
            let (number, response) = (number as u32, shared.response(set)?);
            set.touch = Some(Box::new(Touch::new(number, response)));
        }
        Ok(Self {
            sets,
            shared,
            islands: Islands::default(),
            stages: Vec::new(),
            workspaces: Vec::new(),
            counters: Counters::default(),
            segments: model.segments.len(),
            substeps: None,
        })
    }

    /// The counters of all sets and of their contacts.
    pub(crate) fn counters(&self) -> Counters {
        let mut sum = self.counters;
        for set in &self.sets {
            sum += set.counters;
        }
        sum
    }

    /// Lets a motion drive an obstacle from the next step on; returns whether there is such an obstacle.
    pub(crate) fn drive_obstacle(&mut self, index: usize, motion: &Carried) -> bool {
        self.shared.drive_obstacle(index, motion)
    }

    /// Shows all sets and the contacts that press to a visitor.
    pub(crate) fn visit_state(&mut self, visitor: &mut StateVisitor<'_>) {
        self.sets.iter_mut().for_each(|set| set.visit_state(visitor));
        self.shared.visit_state(visitor);
    }

    /// Changes gravity [m/s^2], which says how fast bodies must meet to bounce.
    pub(crate) fn set_gravity(&mut self, gravity: &Vector3<f64>) {
        self.sets.iter_mut().for_each(|set| set.component.set_gravity(gravity));
    }

    /// Lets the next step be one of Euler's rule.
    pub(crate) fn restart(&mut self) {
        self.sets.iter_mut().for_each(|set| set.component.restart());
    }

    /// What presses on what at the end of the last step.
    pub(crate) fn contact_forces(&self) -> impl Iterator<Item = ContactForce> {
        self.shared.forces(&self.sets)
    }

    /// Holds a body of the model, drives it or lets it go, if it is one of these: returns whether it is. Contacts stay as
    /// they are, with their impulses.
    ///
    /// # Errors
    /// If the factor of its set would be too large.
    pub(crate) fn change(&mut self, body: Body, change: Change<'_>, solver: SolverKind) -> Result<bool, SolverError> {
        for set in &mut self.sets {
            if set.change(body, change, solver)? {
                if let Body::Segment(i) = body {
                    self.shared.change(i, change);
                    let topology = &set.component.system.topology;
                    if set.touch.as_ref().is_some_and(|touch| !touch.response.is_of(topology)) {
                        let response = self.shared.response(set)?;
                        if let Some(touch) = &mut set.touch {
                            touch.response = response;
                        }
                    }
                }
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Advances over `interval`.
    pub(crate) fn advance(&mut self, interval: Interval, params: &StepParams) -> Status {
        self.begin(interval, params);
        self.number();
        let mut watch = Stopwatch::start();
        let Self { sets, islands, stages, workspaces, shared, .. } = self;
        for (island, workspace) in workspaces[..islands.sizes.len()].iter_mut().enumerate() {
            let first = islands.firsts[island] as usize;
            let own = &mut sets[first..first + islands.sizes[island] as usize];
            // Where some must take steps of another kind than all of them have been predicted with, all are predicted anew.
            let goes_on = own.iter().filter(|set| set.component.can_go_on()).count();
            workspace.is_begun = goes_on == 0 || goes_on == own.len();
            if !workspace.is_begun {
                own.iter_mut().for_each(|set| set.component.roll_back());
            }
            stages[island].take_search(shared);
        }
        islands.deal(shared, stages);
        watch.mark(&mut self.counters.times.contact);
        loop {
            let todo = |workspace: &IslandWorkspace| workspace.status.is_none();
            self.work(todo, &|island| island.advance(interval, params));
            let count = self.islands.sizes.len();
            let mut watch = Stopwatch::start();
            let Self { sets, islands, stages, workspaces, shared, .. } = self;
            let is_whole = |island: u32| workspaces[island as usize].is_open;
            let met = islands.link_meetings(shared, &stages[..count], sets, is_whole);
            watch.mark(&mut self.counters.times.contact);
            if !met {
                break;
            }
            self.join(interval.time);
        }
        self.work(|_| true, &|island| island.close(params));
        self.end()
    }

    /// Predicts all sets and finds the contacts between them.
    fn begin(&mut self, interval: Interval, params: &StepParams) {
        each(&mut self.sets, self.segments, |set| {
            let held_back = !set.component.can_go_on();
            begin_set(set, held_back, interval, params, true);
        });
        let mut watch = Stopwatch::start();
        self.islands.reset(self.sets.len());
        self.islands.number();
        let all = Sets::new(&mut self.sets, self.islands.numbers());
        self.shared.find(interval, &all, &mut self.counters);
        self.islands.link_found(&self.shared);
        if self.substeps.is_some() {
            // Derivatives ask for steps of all sets together.
            (1..self.sets.len() as u32).for_each(|set| _ = self.islands.link(0, set));
        }
        watch.mark(&mut self.counters.times.contact);
    }

    /// Puts the sets of each island side by side, and makes its workspace.
    fn number(&mut self) {
        self.islands.number();
        let Self { sets, islands, stages, workspaces, shared, .. } = self;
        let number = |set: &ConnectedSet| set.touch.as_ref().map_or(0, |touch| touch.number);
        sets.sort_unstable_by_key(|set| (islands.of(number(set)), number(set)));
        let count = islands.sizes.len();
        if stages.len() < count {
            stages.resize_with(count, IslandContacts::default);
        }
        if workspaces.len() < count {
            workspaces.resize_with(count, IslandWorkspace::default);
        }
        for (island, workspace) in workspaces[..count].iter_mut().enumerate() {
            let first = islands.firsts[island] as usize;
            let own = &sets[first..first + islands.sizes[island] as usize];
            workspace.segments = own.iter().map(|set| set.members.segments.len()).sum();
            (workspace.status, workspace.is_open, workspace.is_begun) = (None, false, false);
            stages[island].start(shared, own.iter().flat_map(|set| set.members.segments.iter().map(|&i| i as u32)));
        }
    }

    /// Makes one island each of those that may have met; they are done again from the start of the step, at a time [s].
    fn join(&mut self, time: f64) {
        for (workspace, joins) in self.workspaces.iter_mut().zip(self.islands.joined()) {
            workspace.joins = joins;
        }
        self.work(|workspace| workspace.joins, &|island| island.undo(time));
        let (stages, workspaces) = (std::mem::take(&mut self.stages), std::mem::take(&mut self.workspaces));
        let leaders = self.islands.leaders.clone();
        for workspace in workspaces[..leaders.len()].iter().filter(|workspace| workspace.joins) {
            self.counters += workspace.counters;
        }
        self.number();
        for ((leader, stage), workspace) in leaders.into_iter().zip(stages).zip(workspaces) {
            if !workspace.joins {
                let island = self.islands.of(leader) as usize;
                (self.stages[island], self.workspaces[island]) = (stage, workspace);
            }
        }
        let Self { islands, stages, workspaces, shared, .. } = self;
        for contact in &shared.pressing {
            let component = shared.detector.shapes()[contact.key.0 as usize].component;
            let island = islands.of(component) as usize;
            if workspaces[island].status.is_none() {
                stages[island].take(*contact);
            }
        }
    }

    /// Ends the step of all islands.
    fn end(&mut self) -> Status {
        let Self { sets, islands, stages, workspaces, shared, counters, substeps, .. } = self;
        let mut status = Status::Converged;
        for workspace in &mut workspaces[..islands.sizes.len()] {
            status = status.max(workspace.status.unwrap_or(Status::Converged));
            *counters += std::mem::take(&mut workspace.counters);
            if let Some((_, kept)) = substeps {
                kept.append(&mut workspace.substeps);
            }
        }
        let mut watch = Stopwatch::start();
        shared.keep(stages[..islands.sizes.len()].iter().flat_map(IslandContacts::contacts));
        sets.sort_unstable_by_key(|set| set.touch.as_ref().map_or(0, |touch| touch.number));
        watch.mark(&mut counters.times.contact);
        status
    }

    /// Works on all islands whose workspaces are such, side by side where there is enough to share.
    fn work(&mut self, which: impl Fn(&IslandWorkspace) -> bool + Sync, what: &(dyn Fn(&mut Island<'_>) + Sync)) {
        let is_parallel = self.is_parallel();
        let Self { sets, islands, stages, workspaces, shared, substeps, .. } = self;
        let count = islands.sizes.len();
        let common = Common {
            shared,
            islands,
            whole: substeps.as_ref().map(|(whole, _)| whole),
            is_parallel,
            which: &which,
            what,
        };
        common.work(0, sets, &mut stages[..count], &mut workspaces[..count]);
    }

    /// Whether sets are worked on side by side on several threads.
    pub(crate) fn is_parallel(&self) -> bool {
        self.sets.len() > 1 && self.segments >= PARALLEL_SEGMENTS && parallel::threads() > 1
    }
}

/// What work on islands shares.
struct Common<'a> {
    shared: &'a Shared,
    islands: &'a Islands,
    whole: Option<&'a Members>,
    is_parallel: bool,
    which: &'a (dyn Fn(&IslandWorkspace) -> bool + Sync),
    what: &'a (dyn Fn(&mut Island<'_>) + Sync),
}

impl Common<'_> {
    /// Works on the islands from `first` on that have these workspaces, and these sets side by side.
    fn work(
        &self,
        first: usize,
        sets: &mut [Box<ConnectedSet>],
        stages: &mut [IslandContacts],
        workspaces: &mut [IslandWorkspace],
    ) {
        if let ([stage], [workspace]) = (&mut *stages, &mut *workspaces) {
            if (self.which)(workspace) {
                let sets = Sets::new(sets, &self.islands.seats);
                (self.what)(&mut Island { shared: self.shared, sets, stage, workspace, whole: self.whole });
            }
            return;
        }
        if workspaces.is_empty() {
            return;
        }
        let half = workspaces.len() / 2;
        let firsts = &self.islands.firsts;
        let (sets, other_sets) = sets.split_at_mut((firsts[first + half] - firsts[first]) as usize);
        let (stages, other_stages) = stages.split_at_mut(half);
        let (workspaces, other_rooms) = workspaces.split_at_mut(half);
        let mut one = || self.work(first, sets, stages, workspaces);
        let mut other = || self.work(first + half, other_sets, other_stages, other_rooms);
        if self.is_parallel {
            parallel::join(one, other);
        } else {
            one();
            other();
        }
    }
}

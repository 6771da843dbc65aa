//! Alike connected sets side by side, one a lane: each step's prediction and first linear solve, which ask for no contacts.
//!
//! A set has the same bits as one by one. What it begins a step with is put into the lanes of a component that all of its kind
//! share, thread by thread; the first linear system and its solution are handed back. From there on sets go by islands.

use std::sync::{Arc, Mutex, PoisonError};

use rayon::prelude::*;
use rod::{Model, State};

use crate::attempt::{Attempt, begin};
use crate::component::{Alike, Component, Members, Residuals, pick_spatial};
use crate::connected_set::{ConnectedSet, Projector};
use crate::counters::{Counters, Stopwatch};
use crate::formulation::ContactProjection;
use crate::kernel::Spatial;
use crate::kernel::lane::{Lanes, Real};
use crate::limits::{GROUP, shares_piece};
use crate::linear::LinearSolver;
use crate::linear::direct::Direct;
use crate::start::NoGuess;
use crate::step::{Interval, StepParams};

/// Memory to begin the steps of alike sets in.
#[derive(Clone)]
struct SideBySide {
    component: Component<Lanes<GROUP>>,
    solver: Direct<Lanes<GROUP>>,
    corrections: Vec<Spatial<Lanes<GROUP>>>,
}

impl SideBySide {
    /// Begins a step of these sets over `interval`.
    fn begin(&mut self, sets: &mut [Box<ConnectedSet>], interval: Interval, params: &StepParams) {
        let Self { component, solver, corrections } = self;
        let mut counters = Counters::default();
        let mut watch = Stopwatch::start();
        component.used = sets.len();
        for (lane, set) in sets.iter().enumerate() {
            component.take_begin(lane, &set.component);
        }
        watch.mark(&mut counters.times.predict);
        let Attempt { residuals, error, target, correction, unsolved, start } =
            begin(component, interval, params, &mut NoGuess, &mut counters);
        let mut watch = Stopwatch::start();
        solver.solve(&component.system, false, &mut component.dlambda);
        Lanes::<GROUP>::dispatch(
            #[inline(always)]
            || component.corrections(params.formulation, corrections),
        );
        watch.mark(&mut counters.times.solve);
        let Residuals { stretch, bend, momentum, check } = residuals;
        for (lane, set) in sets.iter_mut().enumerate() {
            component.give_begun(lane, &mut set.component);
            set.component.pushed.fill(Spatial::zero());
            let [stretch, bend, momentum, check] = [stretch, bend, momentum, check].map(|x| x.0[lane]);
            let residuals = Residuals { stretch, bend, momentum, check };
            let [error, target, correction, unsolved] = [error, target, correction, unsolved].map(|x| x.0[lane]);
            set.attempt = Attempt { residuals, error, target, correction, unsolved, start };
            (set.takes_part, set.is_ahead) = (true, true);
            if let Some(touch) = &mut set.touch {
                touch.corrections.clear();
                touch.corrections.extend(corrections.iter().map(|own| pick_spatial(own, lane)));
            }
        }
        watch.mark(&mut counters.times.predict);
        if let Some(first) = sets.first_mut() {
            first.counters += counters;
        }
    }
}

/// Sets that are alike.
struct Kind {
    pattern: SideBySide,
    /// Memory that no thread uses now.
    free: Mutex<Vec<SideBySide>>,
}

/// The kinds of sets that are begun side by side.
#[derive(Default)]
pub(super) struct Kinds {
    kinds: Vec<Kind>,
}

impl Kinds {
    /// Finds alike sets, of those that are solved directly and without guesses, and notes their kind in each.
    pub(super) fn of(model: &Model, state: &State, sets: &mut [Box<ConnectedSet>]) -> Self {
        let mut kinds = Vec::new();
        for sets in sets.chunk_by_mut(|a, b| Arc::ptr_eq(&a.component.system.topology, &b.component.system.topology)) {
            let topology = sets[0].component.system.topology.clone();
            let are_solved = sets.iter().all(|set| matches!(set.projector, Projector::Solve { guess: None, .. }));
            if !Alike::fills_lanes(sets.len(), &topology) || !are_solved {
                continue;
            }
            let members: Vec<&Members> = sets.iter().take(GROUP).map(|set| &set.members).collect();
            let component = Component::new(model, state, topology.clone(), &members);
            let pattern = SideBySide { component, solver: Direct::for_tree(&topology), corrections: Vec::new() };
            for set in sets.iter_mut() {
                set.kind = Some(kinds.len() as u32);
            }
            kinds.push(Kind { pattern, free: Mutex::new(Vec::new()) });
        }
        Self { kinds }
    }

    /// Begins a step of all sets over `interval`, those that are alike and plain side by side, others as `alone` does; on threads
    /// where there is enough to share: so many segments.
    pub(super) fn begin(
        &self,
        sets: &mut [Box<ConnectedSet>],
        segments: usize,
        (interval, params): (Interval, &StepParams),
        alone: impl Fn(&mut ConnectedSet) + Send + Sync,
    ) {
        let is_coupled = params.contact_projection == ContactProjection::Coupled;
        let may_begin = is_coupled && !params.formulation.momentum();
        let begin = |sets: &mut [Box<ConnectedSet>]| {
            let kind = sets[0].kind.filter(|_| may_begin && sets.iter().all(|set| set.component.is_plain()));
            match kind.and_then(|kind| self.kinds.get(kind as usize)) {
                Some(kind) if Alike::fills_lanes(sets.len(), &sets[0].component.system.topology) => {
                    let memory = kind.free.lock().unwrap_or_else(PoisonError::into_inner).pop();
                    let mut memory = memory.unwrap_or_else(|| kind.pattern.clone());
                    memory.begin(sets, interval, params);
                    kind.free.lock().unwrap_or_else(PoisonError::into_inner).push(memory);
                }
                _ => sets.iter_mut().for_each(|set| alone(set)),
            }
        };
        if shares_piece(sets.len(), segments) {
            let kinds = sets.par_chunk_by_mut(|a, b| a.kind == b.kind);
            kinds.flat_map(|kind| kind.par_chunks_mut(GROUP)).for_each(begin);
        } else {
            let kinds = sets.chunk_by_mut(|a, b| a.kind == b.kind);
            kinds.flat_map(|kind| kind.chunks_mut(GROUP)).for_each(begin);
        }
    }
}

#[cfg(test)]
mod tests;

//! Which linear solver and which start to take, by rules.
//!
//! The formulation is not chosen: it says which problem is to be solved. All the rest changes how each step gets to its
//! tolerance.
//!
//! - **The solver is direct**: it eliminates chains and trees without iterating. The same name is sparse Cholesky for
//!   sets with loops ([`jointed::linear::looped`]), set by set.
//! - **Alike sets move in lanes, eight at a time, without a start.** A start needs a set of its own.
//! - **`newton` starts steps at the parabola through the last three, or at the prediction.**
//!   [`GuessKind::StepAdaptive`] counts the iterations from both and finds out which takes fewer. It never leaves the
//!   parabola while contacts press: their impulses are part of the start.
//! - **Where segments can touch each other and the tolerance is loose, steps start at the prediction.** Such contacts
//!   come and go, and what a start continues is of those of the last steps.
//! - **`newton` iterates with the exact tangent or with the positive matrix**, whichever takes a set less work
//!   ([`Tangent::Auto`]).
//! - **`xpbd` starts at the prediction.** A start of a whole step would stay in the motion, and one of
//!   a linear solve is no use to a direct solver.
//!
//! `evaluate precision` measures what these rules rest on: solvers and starts side by side, at equal error.

use std::collections::HashSet;

use component::{Members, split_alike};
use jointed::linear::solvers::SolverKind;
use jointed::topology::Topology;
use rod::Model;

use crate::guess::{GuessKind, InitialGuess};
use crate::step::StepParams;

/// What was chosen, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// Linear solver of all connected sets.
    pub solver: SolverKind,
    /// Start of the sets that are stepped one by one; [`GuessKind::Zero`] where all move in lanes.
    pub guess: GuessKind,
    /// Number of connected sets that move in lanes.
    pub in_lanes: usize,
    /// Why this solver; `None` where it was asked for.
    pub why_solver: Option<String>,
    /// Why this start.
    pub why_guess: String,
    /// First segments of the sets that move in lanes.
    lanes: HashSet<usize>,
}

impl Choice {
    /// The solver and why, in words; `None` where it was asked for.
    pub fn reason_of_solver(&self) -> Option<String> {
        self.why_solver.as_ref().map(|why| format!("solver {}: {why}", self.solver))
    }

    /// What was chosen and why, in one line.
    pub fn reason(&self) -> String {
        let guess = format!("guess {}: {}", self.guess, self.why_guess);
        self.reason_of_solver().into_iter().chain([guess]).collect::<Vec<_>>().join("; ")
    }

    /// Whether a connected set of segments moves in a lane, which has no place for a start.
    pub fn is_in_lane(&self, members: &Members) -> bool {
        members.segments.first().is_some_and(|first| self.lanes.contains(first))
    }

    /// The start of one connected set of segments: a [`crate::simulation::GuessFactory`].
    pub fn build_guess(&self, model: &Model, members: &Members, topology: &Topology) -> Option<Box<dyn InitialGuess>> {
        if self.is_in_lane(members) { None } else { self.guess.build(model, members, topology) }
    }
}

/// Chooses the linear solver and the start for steps of `model`; `asked` is the solver where that is not to be chosen.
pub fn choose(model: &Model, step: &StepParams, asked: Option<SolverKind>) -> Choice {
    let solver = asked.unwrap_or(SolverKind::Direct);
    let touches = !model.contacts.is_empty();
    let mut census = Census::default();
    let mut lanes = HashSet::new();
    let mut alone = 0;
    for alike in split_alike(model) {
        census.add(&alike.topology, alike.sets.len());
        if solver == SolverKind::Direct && !touches && alike.fill_lanes() {
            lanes.extend(alike.sets.iter().filter_map(|members| members.segments.first()));
        } else {
            alone += alike.sets.len();
        }
    }
    let (guess, why_guess) = match (step.formulation.momentum(), alone) {
        (false, _) => (GuessKind::Zero, format!("formulation {} never corrects the start of a step", step.formulation)),
        (true, 0) => (GuessKind::Zero, "alike sets move in lanes, where none has a start of its own".to_owned()),
        (true, _) => (
            GuessKind::StepAdaptive,
            "it goes on from the last steps or takes the prediction, by the iterations that these took".to_owned(),
        ),
    };
    let in_lanes = lanes.len();
    let why_solver = if asked.is_none() { Some(census.reason(in_lanes)) } else { None };
    Choice { solver, guess, in_lanes, why_solver, why_guess, lanes }
}

/// How many connected sets there are of each shape.
#[derive(Default)]
struct Census {
    chains: usize,
    trees: usize,
    looped: usize,
}

impl Census {
    fn add(&mut self, topology: &Topology, sets: usize) {
        match (topology.elimination.is_some(), topology.branches) {
            (false, _) => self.looped += sets,
            (true, 0) => self.chains += sets,
            (true, _) => self.trees += sets,
        }
    }

    fn reason(&self, in_lanes: usize) -> String {
        let count = |n: usize, one: &str, many: &str| match n {
            0 => None,
            1 => Some(format!("1 {one}")),
            n => Some(format!("{n} {many}")),
        };
        let open = [count(self.chains, "chain", "chains"), count(self.trees, "tree", "trees")];
        let open: Vec<String> = open.into_iter().flatten().collect();
        let mut parts = Vec::new();
        if !open.is_empty() {
            let lanes = if in_lanes > 0 { format!(" ({in_lanes} in lanes)") } else { String::new() };
            parts.push(format!("{}{lanes}, eliminated without iterating", open.join(" and ")));
        }
        if let Some(looped) = count(self.looped, "set with loops", "sets with loops") {
            parts.push(format!("{looped}, solved by sparse Cholesky"));
        }
        if parts.is_empty() {
            "there is nothing to solve".to_owned()
        } else {
            format!("the rods form {}", parts.join(", and "))
        }
    }
}

//! The figures and tables of the paper (Shao et al., ICLR 2021, section 4 and supplement), measured.
//!
//! A file a figure. Its `measure` runs one *cell*, a scene and all that is compared on it, and gives plain data that can
//! be stored; a second function merges cells into what the figure shows. Results are the same in every run but for times.
//!
//! | paper | here |
//! |---|---|
//! | figure on performance over N | [`performance`] |
//! | figure on temporal evolution | [`temporal`] |
//! | sections on collisions and complex scenarios (trees), knot; when training has paid for itself | [`speedup`] |
//! | figure on long-term stability; supplement: dynamic results (a) to (g), knot, comparisons, NRMSE | [`motions`] |
//!
//! A *speed-up* is the share of time saved, `(t0 - t1) / t0`, where t0 is the time of conjugate gradients from zero:
//! 0.5 is twice as fast, and a loss is negative. The paper does not define its per cent; its "up to 50 %" and its ratio of
//! iterations read like this. Times of a guess are all of its times: features, inference, guards, and what it learns.
//!
//! A step does the same work each time it is repeated, so that of its repeats the quickest counts: what other
//! programs take of a processor in a millisecond is more than most steps.

pub mod motions;
pub mod performance;
pub mod speedup;
pub mod temporal;

use cosserat::guess::{GuessFactory, GuessKind, InitialGuess, Members, Topology};
use cosserat::internals::dynamics::guess::Fischer;
use cosserat::simulation::{CgParams, Settings, SimulationError, SolverKind, StepParams};
use cosserat::state::Model;

use crate::compare::Entry;

/// Name of the start at zero.
pub const ZERO: &str = "zero";
/// Name of Fischer's projection on the last solutions, the strongest rival without learning among the starts.
pub const FISCHER: &str = "fischer";
/// Name of the direct solver, the strongest rival of all.
pub const DIRECT: &str = "direct";

/// The paper's solver: position-based dynamics whose projections are solved by conjugate gradients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CgSolver {
    /// Formulation and outer iterations.
    pub step: StepParams,
    /// Preconditioner and tolerance, which the paper leaves open.
    pub cg: CgParams,
}

impl CgSolver {
    /// It as a simulation takes it.
    pub fn settings(&self) -> Settings {
        Settings { step: self.step, solver: SolverKind::Cg(self.cg) }
    }

    /// The same steps, solved directly.
    pub fn direct(&self) -> Settings {
        Settings { step: self.step, solver: SolverKind::Direct }
    }
}

/// A guess by name.
pub type NamedGuess<'a> = (String, GuessFactory<'a>);

/// Zero, then these, then Fischer's projection.
fn starts<'a>(guesses: &[NamedGuess<'a>]) -> Vec<(String, Option<GuessFactory<'a>>)> {
    let own = guesses.iter().map(|(name, factory)| (name.clone(), Some(*factory)));
    let zero = std::iter::once((ZERO.to_owned(), None));
    zero.chain(own).chain([(FISCHER.to_owned(), Some(&fischer as GuessFactory<'a>))]).collect()
}

/// The same with conjugate gradients, then the direct solver.
pub fn entries<'a>(solver: &CgSolver, guesses: &[NamedGuess<'a>]) -> Vec<Entry<'a>> {
    let entry = |(name, guess)| Entry { name, settings: solver.settings(), guess };
    let direct = Entry { name: DIRECT.to_owned(), settings: solver.direct(), guess: None };
    starts(guesses).into_iter().map(entry).chain([direct]).collect()
}

fn fischer(model: &Model, members: &Members, topology: &Topology) -> Option<Box<dyn InitialGuess>> {
    GuessKind::Fischer(Fischer::DEPTH).build(model, members, topology)
}

/// The share of time saved, `(t0 - t1) / t0`; not a number without times.
fn saved(t0: f64, t1: f64) -> f64 {
    (t0 - t1) / t0
}

/// The quickest of so many repeats: `run` makes one, and `take_quicker` takes from another what was quicker there. After
/// each step `progress()` says whether to go on; `None` where it said stop.
fn quickest<T>(
    repeats: usize,
    mut progress: impl FnMut() -> bool,
    run: impl Fn(&mut dyn FnMut() -> bool) -> Result<T, SimulationError>,
    take_quicker: impl Fn(&mut T, &T),
) -> Result<Option<T>, SimulationError> {
    let mut quickest = None;
    for _ in 0..repeats.max(1) {
        let mut go_on = true;
        let again = run(&mut || {
            go_on = progress();
            go_on
        })?;
        match &mut quickest {
            _ if !go_on => return Ok(None),
            Some(quickest) => take_quicker(quickest, &again),
            None => quickest = Some(again),
        }
    }
    Ok(quickest)
}

/// Scenes and guesses for tests: what stands for networks here is without learning.
#[cfg(test)]
mod example {
    use cosserat::scene;
    use cosserat::scene::sampling::{Parameters, Rod};
    use cosserat::simulation::{Integrator, PreconditionerKind};

    use super::*;

    pub(super) fn bending(segments: usize) -> scene::Scene {
        Parameters::Rod(Rod { segments, length: 2.0, ..Rod::default() }).scene().unwrap()
    }

    /// The motion's parabola.
    pub(super) fn quadratic(model: &Model, members: &Members, topology: &Topology) -> Option<Box<dyn InitialGuess>> {
        GuessKind::Quadratic.build(model, members, topology)
    }

    pub(super) const CG: CgSolver = CgSolver {
        step: StepParams { integrator: Integrator::Euler, ..StepParams::DEFAULT },
        cg: CgParams { preconditioner: PreconditionerKind::BlockJacobi, tolerance: 1e-6, max_iterations: None },
    };

    /// Stored and read back.
    pub(super) fn stored<T: serde::Serialize + serde::de::DeserializeOwned>(value: &T) -> T {
        serde_json::from_str(&serde_json::to_string(value).unwrap()).unwrap()
    }
}

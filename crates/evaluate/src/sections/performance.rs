//! The paper's figure on performance: over the number of segments, and where else a guess may begin to pay, over
//! stiffness and tolerance.

mod pays;
mod show;

use std::collections::BTreeMap;

use anyhow::Result;
use dataset::Scenario;
use evaluation::paper::performance::{self, Point};
use scene::sampling::{Helix, Parameters, Rod};
use serde::{Deserialize, Serialize};
use solver::linear::precondition::PreconditionerKind;

use crate::cells::Section;
use crate::context::Context;
use crate::library::Learned;
use crate::sections::paper::{FREE, SEED, motion, solver_of, with_guesses};

/// What is varied; all else is drawn as in Table 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
enum Varied {
    Segments(usize),
    Modulus(f64),
    Tolerance(f64),
}

impl Varied {
    fn value(self) -> f64 {
        match self {
            Self::Segments(segments) => segments as f64,
            Self::Modulus(value) | Self::Tolerance(value) => value,
        }
    }
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Key {
    scenario: Scenario,
    varied: Varied,
    preconditioner: String,
    tolerance: f64,
    simulations: usize,
    steps: usize,
    /// Of all, for times: see [`performance::measure`].
    repeats: usize,
    seed: u64,
}

pub(crate) struct Performance;

/// Preconditioners: the paper's reading, and the strongest of ours.
const PRECONDITIONERS: [PreconditionerKind; 2] = [PreconditionerKind::Raw, PreconditionerKind::BlockJacobi];
/// Tolerance where it is not varied: the cell in which the paper's figures can be had.
const TOLERANCE: f64 = 1e-4;

impl Section for Performance {
    type Key = Key;
    type Value = Point;
    const ID: &'static str = "performance";

    fn keys(&self, context: &Context) -> Result<Vec<Key>> {
        let size = context.size;
        let mut keys = Vec::new();
        for scenario in FREE {
            let all = performance::segments(scenario.family());
            let segments = size.pick(&all[2..=4], all);
            let moduli: &[f64] = size.pick(&[], &[1e3, 1e4, 1e5, 1e6, 1e7, 1e8]);
            let tolerances: &[f64] = size.pick(&[], &[1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8]);
            let varied = segments.iter().map(|&n| Varied::Segments(n));
            let varied = varied.chain(moduli.iter().map(|&y| Varied::Modulus(y)));
            for varied in varied.chain(tolerances.iter().map(|&tolerance| Varied::Tolerance(tolerance))) {
                keys.extend(PRECONDITIONERS.map(|preconditioner| Key {
                    scenario,
                    varied,
                    preconditioner: preconditioner.to_string(),
                    tolerance: if let Varied::Tolerance(tolerance) = varied { tolerance } else { TOLERANCE },
                    simulations: size.pick(2, simulations(varied, preconditioner)),
                    steps: size.pick(20, performance::STEPS),
                    repeats: size.pick(1, if preconditioner == PreconditionerKind::Raw { 1 } else { 2 }),
                    seed: SEED,
                }));
            }
        }
        Ok(keys)
    }

    fn seconds(&self, key: &Key) -> f64 {
        let segments = if let Varied::Segments(n) = key.varied { n as f64 } else { 40.0 };
        1e-6 * segments * segments * (key.simulations * key.steps * key.repeats) as f64
    }

    fn measure(&mut self, context: &Context, key: &Key, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Point>> {
        let guesses = context.library.guesses(key.scenario, Learned::Networks)?;
        let solver = solver_of(&key.preconditioner, key.tolerance)?;
        let mut simulated = Vec::new();
        for index in 0..key.simulations as u64 {
            let family = key.scenario.family();
            let parameters = match key.varied {
                Varied::Segments(segments) => performance::sample(family, segments, key.seed, index),
                Varied::Modulus(modulus) => stiffened(Parameters::sample(family, key.seed, index), modulus),
                Varied::Tolerance(_) => Parameters::sample(family, key.seed, index),
            };
            let scene = parameters.scene()?;
            let measured = with_guesses(&scene, &guesses, |named| {
                performance::measure(&motion(&scene, key.steps), &solver, named, key.repeats, &mut *go_on)
            })?;
            let Some(one) = measured else { return Ok(None) };
            simulated.push(one);
        }
        Ok(Some(performance::point(&simulated)))
    }

    fn show(&self, context: &Context, cells: &[(&Key, &Point)]) -> Result<report::Section> {
        Ok(show::section(context, cells))
    }

    fn claims(&self, _: &Context, cells: &[(&Key, &Point)]) -> Result<BTreeMap<String, String>> {
        Ok(show::claims(cells))
    }
}

/// Simulations of a point: the paper's, but fewer where one takes many seconds.
fn simulations(varied: Varied, preconditioner: PreconditionerKind) -> usize {
    match (varied, preconditioner) {
        (Varied::Segments(..=105), _) | (Varied::Segments(_), PreconditionerKind::BlockJacobi) => {
            performance::SIMULATIONS
        }
        _ => 10,
    }
}

/// With another modulus [Pa].
fn stiffened(parameters: Parameters, modulus: f64) -> Parameters {
    match parameters {
        Parameters::Rod(rod) => Parameters::Rod(Rod { youngs_modulus: modulus, ..rod }),
        Parameters::Helix(helix) => Parameters::Helix(Helix { torsion_modulus: modulus, ..helix }),
        other => other,
    }
}

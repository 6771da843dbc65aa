//! The paper's figure on performance: over the number of segments, and where else a guess may begin to pay, over
//! stiffness and tolerance.

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

/// What is varied, and its axis; all else is drawn as in Table 1.
const STUDIES: [(&str, &str); 3] =
    [("segments", "segments N"), ("stiffness", "modulus [Pa]"), ("tolerance", "tolerance of conjugate gradients")];

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Key {
    scenario: Scenario,
    /// Of [`STUDIES`].
    varied: String,
    value: f64,
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
            let values = [
                segments.iter().map(|&n| n as f64).collect(),
                size.pick(vec![], vec![1e3, 1e4, 1e5, 1e6, 1e7, 1e8]),
                size.pick(vec![], vec![1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8]),
            ];
            let studies = STUDIES.into_iter().zip(values);
            for (varied, value) in
                studies.flat_map(|((varied, _), values)| values.into_iter().map(move |x| (varied, x)))
            {
                keys.extend(PRECONDITIONERS.map(|preconditioner| Key {
                    scenario,
                    varied: varied.to_owned(),
                    value,
                    preconditioner: preconditioner.to_string(),
                    tolerance: if varied == "tolerance" { value } else { TOLERANCE },
                    simulations: size.pick(2, simulations(varied, value, preconditioner)),
                    steps: size.pick(20, performance::STEPS),
                    repeats: size.pick(1, if preconditioner == PreconditionerKind::Raw { 1 } else { 2 }),
                    seed: SEED,
                }));
            }
        }
        Ok(keys)
    }

    fn seconds(&self, key: &Key) -> f64 {
        let segments = if key.varied == "segments" { key.value } else { 40.0 };
        1e-6 * segments * segments * (key.simulations * key.steps * key.repeats) as f64
    }

    fn measure(&mut self, context: &Context, key: &Key, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Point>> {
        let guesses = context.library.guesses(key.scenario, Learned::Networks)?;
        let solver = solver_of(&key.preconditioner, key.tolerance)?;
        let mut simulated = Vec::new();
        for index in 0..key.simulations as u64 {
            let family = key.scenario.family();
            let drawn = Parameters::sample(family, key.seed, index);
            let parameters = match key.varied.as_str() {
                "segments" => performance::with_segments(drawn, key.value as usize),
                "stiffness" => stiffened(drawn, key.value),
                _ => drawn,
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
fn simulations(varied: &str, value: f64, preconditioner: PreconditionerKind) -> usize {
    let is_few = varied != "segments" || (value > 105.0 && preconditioner == PreconditionerKind::Raw);
    if is_few { 10 } else { performance::SIMULATIONS }
}

/// With another modulus [Pa].
fn stiffened(parameters: Parameters, modulus: f64) -> Parameters {
    match parameters {
        Parameters::Rod(rod) => Parameters::Rod(Rod { youngs_modulus: modulus, ..rod }),
        Parameters::Helix(helix) => Parameters::Helix(Helix { torsion_modulus: modulus, ..helix }),
        other => other,
    }
}

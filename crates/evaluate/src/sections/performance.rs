//! The paper's figure on performance: over the number of segments, and where else a guess may begin to pay, over
//! stiffness and tolerance.

mod key;
mod show;

use std::collections::BTreeMap;

use anyhow::Result;
use cosserat::scene::sampling::{Helix, Parameters, Rod};
use evaluation::paper::performance::{self, Point};

use crate::cells::Section;
use crate::context::Context;
use crate::library::Learned;
use crate::sections::paper::{BLOCK_JACOBI, FREE, RAW, SEED, solver, with_guesses};
use key::{PerformanceKey, TOLERANCE};

pub(crate) struct Performance;

/// Values of N, of rods and helices: below, within and beyond those of the training (10 to 55, 45 to 105).
const SEGMENTS: [[f64; 8]; 2] =
    [[5.0, 10.0, 20.0, 30.0, 40.0, 55.0, 80.0, 110.0], [20.0, 30.0, 45.0, 60.0, 80.0, 105.0, 150.0, 200.0]];
/// Moduli [Pa].
const MODULI: [f64; 6] = [1e3, 1e4, 1e5, 1e6, 1e7, 1e8];
const TOLERANCES: [f64; 6] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8];

impl Section for Performance {
    type Key = PerformanceKey;
    type Value = Point;
    const ID: &'static str = key::ID;

    fn keys(&self, context: &Context) -> Result<Vec<PerformanceKey>> {
        let size = context.size;
        let mut keys = Vec::new();
        for (scenario, segments) in FREE.into_iter().zip(&SEGMENTS) {
            let studies: [(&str, &[f64]); 3] = [
                ("segments", size.pick(&segments[2..=4], segments)),
                ("stiffness", size.pick(&[], &MODULI)),
                ("tolerance", size.pick(&[], &TOLERANCES)),
            ];
            for (varied, value) in studies.iter().flat_map(|(varied, values)| values.iter().map(|x| (*varied, *x))) {
                keys.extend([RAW, BLOCK_JACOBI].map(|preconditioner| PerformanceKey {
                    scenario,
                    varied: varied.to_owned(),
                    value,
                    preconditioner: preconditioner.to_owned(),
                    tolerance: if varied == "tolerance" { value } else { TOLERANCE },
                    simulations: size.pick(2, simulations(varied, value, preconditioner)),
                    steps: size.pick(20, performance::STEPS),
                    repeats: size.pick(1, if preconditioner == RAW { 1 } else { 2 }),
                    seed: SEED,
                }));
            }
        }
        Ok(keys)
    }

    fn seconds(&self, key: &PerformanceKey) -> f64 {
        let segments = if key.varied == "segments" { key.value } else { 40.0 };
        let a_step = if key.preconditioner == RAW { 1e-5 } else { 1e-6 } * segments * segments;
        a_step * (key.simulations * key.steps * key.repeats) as f64
    }

    fn measure(
        &mut self,
        context: &Context,
        key: &PerformanceKey,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Option<Point>> {
        let guesses = context.library.guesses(key.scenario, Learned::Networks)?;
        let solver = solver(&key.preconditioner, key.tolerance)?;
        let mut simulated = Vec::new();
        for index in 0..key.simulations as u64 {
            let scene = varied(key.scenario.sample(key.seed, index), &key.varied, key.value).scene()?;
            let measured = with_guesses(&scene, &guesses, |named| {
                performance::measure(&scene, key.steps, &solver, named, key.repeats, &mut *go_on)
            })?;
            let Some(one) = measured else { return Ok(None) };
            simulated.push(one);
        }
        Ok(Some(performance::point(&simulated)))
    }

    fn show(&self, context: &Context, cells: &[(&PerformanceKey, &Point)]) -> Result<report::Section> {
        Ok(show::section(context, cells))
    }

    fn claims(&self, _: &Context, cells: &[(&PerformanceKey, &Point)]) -> Result<BTreeMap<String, String>> {
        Ok(show::claims(cells))
    }
}

/// Simulations of a point: the paper's, but fewer where one takes seconds, and fewest where one takes a minute.
fn simulations(varied: &str, value: f64, preconditioner: &str) -> usize {
    match (varied, preconditioner) {
        ("segments", RAW) if value > 105.0 => 3,
        ("segments", RAW) if value > 45.0 => 10,
        ("segments", BLOCK_JACOBI) if value > 80.0 => 10,
        ("segments", _) => performance::SIMULATIONS,
        _ => 10,
    }
}

/// With another N or modulus [Pa].
fn varied(parameters: Parameters, what: &str, value: f64) -> Parameters {
    let segments = value as usize;
    match (what, parameters) {
        ("segments", Parameters::Rod(rod)) => Parameters::Rod(Rod { segments, ..rod }),
        ("segments", Parameters::Helix(helix)) => Parameters::Helix(Helix { segments, ..helix }),
        ("stiffness", Parameters::Rod(rod)) => Parameters::Rod(Rod { youngs_modulus: value, ..rod }),
        ("stiffness", Parameters::Helix(helix)) => Parameters::Helix(Helix { torsion_modulus: value, ..helix }),
        (_, drawn) => drawn,
    }
}

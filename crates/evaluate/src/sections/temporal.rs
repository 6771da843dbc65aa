//! The paper's figure on temporal evolution: iterations over the frames.

use std::collections::BTreeMap;
use std::ops::Range;

use anyhow::Result;
use dataset::Scenario;
use evaluation::guesses::{Spread, Tally};
use evaluation::paper::temporal::{self, StartSeries, WINDOW};
use report::{Axis, Block, Point, Reference, Section as PageSection, Series};
use serde::{Deserialize, Serialize};

use crate::blocks::{chart, figure, groups, section, values};
use crate::cells::Section;
use crate::context::Context;
use crate::library::Learned;
use crate::sections::paper::{
    BLOCK_JACOBI, FREE, PAPER_FRAMES, PAPER_GUESSES, RAW, SEED, solver, solver_words, with_guesses,
};
use crate::show::{join, per_cent};

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct TemporalKey {
    scenario: Scenario,
    simulation: u64,
    steps: usize,
    /// Of all, for times: see [`temporal::measure`].
    repeats: usize,
    preconditioner: String,
    tolerance: f64,
    seed: u64,
}

pub(crate) struct Temporal;

/// The solvers whose iterations are counted, the paper's first.
const SOLVERS: [(&str, f64); 2] = [(RAW, 1e-4), (BLOCK_JACOBI, 1e-2)];

/// Steps of a full simulation: four times the paper's training data's.
const STEPS: usize = 200;

const INTRODUCTION: &str = "The paper's figure on temporal evolution: iterations of conjugate gradients over the frames, \
    relative to those from zero on the same systems. The paper sees about half of the iterations for helices beyond the 50 \
    frames of its training data, and a gain for rods that falls. Its 20 simulations have one set of parameters, which would \
    be twenty times the same; all of ours but the first have its N and its modulus, and draw the rest from Table 1.";

impl Section for Temporal {
    type Key = TemporalKey;
    type Value = Vec<StartSeries>;
    const ID: &'static str = "temporal";

    fn keys(&self, context: &Context) -> Result<Vec<TemporalKey>> {
        let (steps, repeats) = (context.size.pick(40, STEPS), 1);
        let mut keys = Vec::new();
        for scenario in FREE {
            for (preconditioner, tolerance) in SOLVERS {
                for simulation in 0..context.size.pick(2, temporal::SIMULATIONS as u64) {
                    let preconditioner = preconditioner.to_owned();
                    keys.push(TemporalKey {
                        scenario,
                        simulation,
                        steps,
                        repeats,
                        preconditioner,
                        tolerance,
                        seed: SEED,
                    });
                }
            }
        }
        Ok(keys)
    }

    fn seconds(&self, key: &TemporalKey) -> f64 {
        (if key.scenario == Scenario::Rod { 0.004 } else { 0.01 }) * (key.steps * key.repeats) as f64
    }

    fn measure(
        &mut self,
        context: &Context,
        key: &TemporalKey,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Option<Self::Value>> {
        let guesses = context.library.guesses(key.scenario, Learned::All)?;
        let scene = temporal::sample(key.scenario.family(), key.seed, key.simulation).scene()?;
        let solver = solver(&key.preconditioner, key.tolerance)?;
        with_guesses(&scene, &guesses, |named| temporal::measure(&scene, key.steps, &solver, named, key.repeats, go_on))
    }

    fn show(&self, context: &Context, cells: &[(&TemporalKey, &Vec<StartSeries>)]) -> Result<PageSection> {
        let figures = groups(cells, |key| (key.scenario, &key.preconditioner)).into_iter();
        let figures = figures.map(|(_, own)| over_frames(context, own[0].0, &values(&own)));
        Ok(section([Self::ID, "Temporal evolution", INTRODUCTION], figures.collect::<Result<_>>()?))
    }

    fn claims(&self, _: &Context, cells: &[(&TemporalKey, &Vec<StartSeries>)]) -> Result<BTreeMap<String, String>> {
        let mut claims = BTreeMap::new();
        let mut add = |id: &str, words: String| join(claims.entry(id.to_owned()).or_default(), &words);
        let of_paper: Vec<_> = cells.iter().filter(|(key, _)| key.preconditioner == SOLVERS[0].0).copied().collect();
        for (scenario, own) in groups(&of_paper, |key| key.scenario) {
            let curves = curves(&values(&own));
            for curve in curves.iter().filter(|curve| PAPER_GUESSES.contains(&curve.name)) {
                let steps = curve.relative[0].len();
                // Quick runs end before the paper's training data do.
                let frames = PAPER_FRAMES.min(steps);
                let [early, late] = [0..frames, frames..steps].map(|range| curve.saved(range));
                let [first, beyond] = [early, late].map(|saved| saved.map_or("not measured".to_owned(), words));
                let who = format!("{scenario}, {}", curve.name);
                let both = format!("frames 1 to {frames}: {first}; beyond: {beyond}");
                if scenario == Scenario::Helix {
                    add("temporal-helix-gain", format!("{who}, saved beyond frame {frames}: {beyond}"));
                } else {
                    add("temporal-rod-gain", format!("{who}, saved in {both}"));
                }
                let is_early = early.zip(late).map(|(early, late)| early[0] >= late[0]);
                let higher = is_early.map_or("", |early| if early { ": more in the first" } else { ": more beyond" });
                add("temporal-highest", format!("{who}, {both}{higher}"));
                add("temporal-order", format!("{who}, beyond frame {frames}: {beyond}"));
            }
        }
        Ok(claims)
    }
}

/// A start over the frames.
struct Curve<'a> {
    name: &'a str,
    /// Iterations and time, relative to the zero start's.
    relative: [Vec<Option<Spread>>; 2],
}

/// The curves of all starts but zero.
fn curves<'a>(cells: &[&'a Vec<StartSeries>]) -> Vec<Curve<'a>> {
    let values: [fn(&Tally) -> f64; 2] = [|step| step.iterations as f64, |step| step.solve_s + step.guess_s];
    let starts = cells.first().map_or(&[][..], |starts| starts).iter().enumerate().skip(1);
    let curve = |(start, series): (usize, &'a StartSeries)| Curve {
        name: &series.name,
        relative: values.map(|value| temporal::curve(cells, start, WINDOW, value)),
    };
    starts.map(curve).collect()
}

impl Curve<'_> {
    /// Shares of iterations and time that the start saves over some frames; `None` where there are none.
    fn saved(&self, frames: Range<usize>) -> Option<[f64; 2]> {
        let means = |k: usize| self.relative[k][frames.clone()].iter().flatten().map(|spread| spread.mean);
        Some([1.0 - Spread::of(means(0))?.mean, 1.0 - Spread::of(means(1))?.mean])
    }
}

fn words([iterations, time]: [f64; 2]) -> String {
    format!("{} of iterations, {} of time", per_cent(iterations), per_cent(time))
}

/// The figure of a scenario and solver.
fn over_frames(context: &Context, key: &TemporalKey, cells: &[&Vec<StartSeries>]) -> Result<Block> {
    let TemporalKey { scenario, steps, preconditioner, tolerance, .. } = key;
    let curves = curves(cells);
    let zero = Reference::Horizontal { y: 1.0, label: "from zero".to_owned() };
    let references = vec![zero, context.library.training_end(*scenario)?];
    let charts = [(0, "iterations"), (1, "time, guess and solve")].map(|(k, title)| {
        let series = curves.iter().map(|curve| of_means(curve.name, &curve.relative[k])).collect();
        chart(title, [Axis::linear("frame"), Axis::linear("relative to zero")], series, references.clone())
    });
    let saved = curves.iter().filter_map(|curve| {
        let [iterations, _] = curve.saved(0..curve.relative[0].len())?;
        Some(format!("{} saves {} of the iterations", curve.name, per_cent(iterations)))
    });
    let caption = format!(
        "Means over the simulations, relative to conjugate gradients from zero: {}. Bands are quartiles.",
        saved.collect::<Vec<_>>().join(", ")
    );
    let solver = format!("{preconditioner} conjugate gradients to {tolerance:e}");
    let simulations = format!("{} of {steps} steps, window {WINDOW} frames; means and quartiles", cells.len());
    let conditions = context
        .conditions("linear solves and guesses, features, inference and guards included")
        .with("solver", solver_words(preconditioner, format!("{tolerance:e}")))
        .with("simulations", simulations);
    let id = format!("temporal-{scenario}-{preconditioner}");
    let title = format!("{scenario}: iterations and time over the frames, {solver}");
    Ok(figure([&id, &title, &caption], charts.into(), conditions))
}

/// A curve of means over the frames.
fn of_means(name: &str, spreads: &[Option<Spread>]) -> Series {
    let point = |(frame, spread): (usize, &Option<Spread>)| {
        let Spread { mean, lower, upper, .. } = (*spread)?;
        Some(Point { x: frame as f64 + 1.0, y: mean, band: Some([lower, upper]), ..Point::default() })
    };
    Series { markers: false, ..Series::new(name, spreads.iter().enumerate().filter_map(point)) }
}

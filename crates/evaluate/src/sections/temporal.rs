//! The paper's figure on temporal evolution: iterations over the frames.

use std::collections::BTreeMap;

use anyhow::Result;
use dataset::Scenario;
use evaluation::guesses::Spread;
use evaluation::paper::temporal::{self, Curve, StartSeries};
use report::{Axis, Block, Charts, Figure, LineChart, Point, Reference, Section as PageSection, Series};
use serde::{Deserialize, Serialize};
use solver::linear::precondition::PreconditionerKind;

use crate::cells::Section;
use crate::context::Context;
use crate::library::Learned;
use crate::sections::paper::{FREE, PAPER_FRAMES, PAPER_GUESSES, SEED, motion, solver_of, solver_words, with_guesses};
use crate::show::{join, per_cent};

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Key {
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
const SOLVERS: [(PreconditionerKind, f64); 2] =
    [(PreconditionerKind::Raw, 1e-4), (PreconditionerKind::BlockJacobi, 1e-2)];

/// Steps of a full simulation: four times the paper's training data's.
const STEPS: usize = 200;

const INTRODUCTION: &str = "The paper's figure on temporal evolution: iterations of conjugate gradients over the frames, \
    relative to those from zero on the same systems. The paper sees about half of the iterations for helices beyond the 50 \
    frames of its training data, and a gain for rods that falls. Its 20 simulations have one set of parameters, which would \
    be twenty times the same; all of ours but the first have its N and its modulus, and draw the rest from Table 1.";

impl Section for Temporal {
    type Key = Key;
    type Value = Vec<StartSeries>;
    const ID: &'static str = "temporal";

    fn keys(&self, context: &Context) -> Result<Vec<Key>> {
        let (steps, repeats) = (context.size.pick(40, STEPS), context.size.pick(1, 3));
        let mut keys = Vec::new();
        for scenario in FREE {
            for (preconditioner, tolerance) in SOLVERS {
                for simulation in 0..context.size.pick(2, temporal::SIMULATIONS as u64) {
                    let preconditioner = preconditioner.to_string();
                    keys.push(Key { scenario, simulation, steps, repeats, preconditioner, tolerance, seed: SEED });
                }
            }
        }
        Ok(keys)
    }

    fn seconds(&self, key: &Key) -> f64 {
        (if key.scenario == Scenario::Rod { 0.004 } else { 0.01 }) * (key.steps * key.repeats) as f64
    }

    fn measure(
        &mut self,
        context: &Context,
        key: &Key,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Option<Vec<StartSeries>>> {
        let guesses = context.library.guesses(key.scenario, Learned::All)?;
        let scene = temporal::sample(key.scenario.family(), key.seed, key.simulation).scene()?;
        let solver = solver_of(&key.preconditioner, key.tolerance)?;
        with_guesses(&scene, &guesses, |named| {
            temporal::measure(&motion(&scene, key.steps), &solver, named, key.repeats, go_on)
        })
    }

    fn show(&self, context: &Context, cells: &[(&Key, &Vec<StartSeries>)]) -> Result<PageSection> {
        let mut blocks = vec![Block::Paragraph(INTRODUCTION.to_owned())];
        for scenario in FREE {
            for solver in SOLVERS {
                let own = of(cells, scenario, solver);
                blocks.extend(figure(context, &own)?.map(Block::Figure));
            }
        }
        Ok(PageSection { id: Self::ID.to_owned(), title: "Temporal evolution".to_owned(), blocks })
    }

    fn claims(&self, _: &Context, cells: &[(&Key, &Vec<StartSeries>)]) -> Result<BTreeMap<String, String>> {
        let mut claims = BTreeMap::new();
        let mut add = |id: &str, words: String| join(claims.entry(id.to_owned()).or_default(), &words);
        for scenario in FREE {
            let curves = curves(&of(cells, scenario, SOLVERS[0]));
            for curve in PAPER_GUESSES.iter().filter_map(|guess| curves.iter().find(|curve| curve.name == *guess)) {
                // Quick runs end before the paper's training data do.
                let frames = PAPER_FRAMES.min(curve.iterations.len());
                let [early, late] = [0..frames, frames..curve.iterations.len()].map(|range| Gain::of(curve, range));
                let who = format!("{scenario}, {}", curve.name);
                let text = |gain: &Option<Gain>| gain.as_ref().map_or("not measured".to_owned(), Gain::text);
                let both = format!("frames 1 to {frames}: {}; beyond: {}", text(&early), text(&late));
                if scenario == Scenario::Helix {
                    add("temporal-helix-gain", format!("{who}, saved beyond frame {frames}: {}", text(&late)));
                } else {
                    add("temporal-rod-gain", format!("{who}, saved in {both}"));
                }
                let higher = early.zip(late.as_ref()).map(|(early, late)| early.iterations >= late.iterations);
                let higher = higher.map_or("", |early| if early { ": more in the first" } else { ": more beyond" });
                add("temporal-highest", format!("{who}, {both}{higher}"));
                add("temporal-order", format!("{who}, beyond frame {frames}: {}", text(&late)));
            }
        }
        Ok(claims)
    }
}

/// The cells of a scenario and solver.
fn of<'a>(
    cells: &[(&'a Key, &'a Vec<StartSeries>)],
    scenario: Scenario,
    (preconditioner, tolerance): (PreconditionerKind, f64),
) -> Vec<(&'a Key, &'a Vec<StartSeries>)> {
    let is_own = |key: &Key| {
        key.scenario == scenario && key.preconditioner == preconditioner.name() && key.tolerance == tolerance
    };
    cells.iter().filter(|(key, _)| is_own(key)).copied().collect()
}

fn curves(cells: &[(&Key, &Vec<StartSeries>)]) -> Vec<Curve> {
    let series: Vec<_> = cells.iter().map(|(_, series)| series.to_vec()).collect();
    temporal::curves(&series, temporal::WINDOW)
}

/// Shares saved by a guess, relative to zero.
struct Gain {
    iterations: f64,
    time: f64,
}

impl Gain {
    /// Over some frames; `None` where there are none.
    fn of(curve: &Curve, frames: std::ops::Range<usize>) -> Option<Self> {
        let saved = |spreads: &[Option<Spread>]| {
            let means = spreads[frames.clone()].iter().flatten().map(|spread| spread.mean);
            Some(1.0 - Spread::of(means)?.mean)
        };
        Some(Self { iterations: saved(&curve.iterations)?, time: saved(&curve.time)? })
    }

    fn text(&self) -> String {
        format!("{} of iterations, {} of time", per_cent(self.iterations), per_cent(self.time))
    }
}

fn figure(context: &Context, cells: &[(&Key, &Vec<StartSeries>)]) -> Result<Option<Figure>> {
    let Some((key, _)) = cells.first() else { return Ok(None) };
    let Key { scenario, steps, preconditioner, tolerance, .. } = key;
    let curves = curves(cells);
    let trained = context.library.training_end(*scenario)?;
    type OfCurve = fn(&Curve) -> &[Option<Spread>];
    let chart = |title: &str, values: OfCurve| LineChart {
        title: title.to_owned(),
        x: Axis::linear("frame"),
        y: Axis::linear("relative to zero"),
        series: curves.iter().skip(1).map(|curve| over_frames(&curve.name, values(curve))).collect(),
        references: vec![Reference::Horizontal { y: 1.0, label: "from zero".to_owned() }, trained.clone()],
        ..LineChart::default()
    };
    let conditions = context
        .conditions("linear solves and guesses, features, inference and guards included")
        .with("solver", solver_words(preconditioner, format!("{tolerance:e}")))
        .with(
            "simulations",
            format!("{} of {steps} steps, window {} frames; means and quartiles", cells.len(), temporal::WINDOW),
        );
    Ok(Some(Figure {
        id: format!("temporal-{scenario}-{preconditioner}"),
        title: format!(
            "{scenario}: iterations and time over the frames, {preconditioner} conjugate gradients to {tolerance:e}"
        ),
        caption: format!(
            "Means over the simulations, relative to conjugate gradients from zero: {}. Bands are quartiles.",
            curves.iter().skip(1).filter_map(mean).collect::<Vec<_>>().join(", ")
        ),
        charts: Charts::Lines(vec![
            chart("iterations", |curve| &curve.iterations),
            chart("time, guess and solve", |curve| &curve.time),
        ]),
        conditions,
    }))
}

/// What a start saves over all frames, in words.
fn mean(curve: &Curve) -> Option<String> {
    let gain = Gain::of(curve, 0..curve.iterations.len())?;
    Some(format!("{} saves {} of the iterations", curve.name, per_cent(gain.iterations)))
}

/// A curve of means over the frames.
fn over_frames(name: &str, spreads: &[Option<Spread>]) -> Series {
    let point = |(frame, spread): (usize, &Option<Spread>)| {
        let spread = spread.as_ref()?;
        let band = Some([spread.lower, spread.upper]);
        Some(Point { x: frame as f64 + 1.0, y: spread.mean, band, ..Point::default() })
    };
    Series { markers: false, ..Series::new(name, spreads.iter().enumerate().filter_map(point)) }
}

//! The paper's figure on temporal evolution: iterations over the frames.

use std::collections::BTreeMap;

use anyhow::Result;
use dataset::Scenario;
use evaluation::guesses::Spread;
use evaluation::paper::temporal::{self, Curve, Series as Measured};
use report::{Axis, Block, Charts, Figure, LineChart, Point, Reference, Section as PageSection, Series};
use serde::{Deserialize, Serialize};
use solver::linear::precondition::PreconditionerKind;

use crate::cells::Section;
use crate::context::Context;
use crate::library::Learned;
use crate::sections::paper::{SEED, motion, solver, with_guesses};
use crate::show::per_cent;

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

/// One simulation.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Value {
    series: Vec<Measured>,
}

pub(crate) struct Temporal;

/// The solvers whose iterations are counted.
const SOLVERS: [(PreconditionerKind, f64); 2] =
    [(PreconditionerKind::Raw, 1e-4), (PreconditionerKind::BlockJacobi, 1e-2)];

/// Frames of the training data.
const TRAINED: f64 = 50.0;

impl Section for Temporal {
    type Key = Key;
    type Value = Value;
    const ID: &'static str = "temporal";

    fn keys(&self, context: &Context) -> Result<Vec<Key>> {
        let mut keys = Vec::new();
        for scenario in [Scenario::Rod, Scenario::Helix] {
            for (preconditioner, tolerance) in SOLVERS {
                for simulation in 0..context.size.pick(2, temporal::SIMULATIONS as u64) {
                    let preconditioner = preconditioner.to_string();
                    let (steps, repeats) = (context.size.pick(40, STEPS), context.size.pick(1, 3));
                    keys.push(Key { scenario, simulation, steps, repeats, preconditioner, tolerance, seed: SEED });
                }
            }
        }
        Ok(keys)
    }

    fn seconds(&self, key: &Key) -> f64 {
        (if key.scenario == Scenario::Rod { 0.004 } else { 0.01 }) * (key.steps * key.repeats) as f64
    }

    fn measure(&mut self, context: &Context, key: &Key, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Value>> {
        let guesses = context.library.guesses(key.scenario, Learned::All)?;
        let scene = temporal::sample(key.scenario.family(), key.seed, key.simulation).scene()?;
        let solver = solver(key.preconditioner.parse().map_err(anyhow::Error::msg)?, key.tolerance);
        let cell = with_guesses(&scene, &guesses, |named| {
            temporal::measure(&motion(&scene, key.steps), &solver, named, key.repeats, go_on)
        })?;
        Ok(cell.map(|series| Value { series }))
    }

    fn show(&self, context: &Context, cells: &[(&Key, &Value)]) -> Result<PageSection> {
        let mut blocks = vec![Block::Paragraph(INTRODUCTION.to_owned())];
        for scenario in [Scenario::Rod, Scenario::Helix] {
            for (preconditioner, tolerance) in SOLVERS {
                let own = cells.iter().filter(|(key, _)| {
                    key.scenario == scenario
                        && key.preconditioner == preconditioner.name()
                        && key.tolerance == tolerance
                });
                let own: Vec<(&Key, &Value)> = own.copied().collect();
                blocks.extend(figure(context, &own).map(Block::Figure));
            }
        }
        Ok(PageSection { id: Self::ID.to_owned(), title: "Temporal evolution".to_owned(), blocks })
    }

    fn claims(&self, _: &Context, cells: &[(&Key, &Value)]) -> Result<BTreeMap<String, String>> {
        let [rod, helix] = [Scenario::Rod, Scenario::Helix].map(|scenario| over_time(cells, scenario));
        let text = |gain: &Gain| {
            let Gain { iterations, time } = gain;
            format!("{} of iterations, {} of time", per_cent(*iterations), per_cent(*time))
        };
        let mut claims = BTreeMap::new();
        if let [Some(rod), Some(helix)] = [rod, helix] {
            let both = |[early, late]: &[Gain; 2]| format!("frames 1 to 50: {}; beyond: {}", text(early), text(late));
            claims.insert(
                "temporal-helix-gain".to_owned(),
                format!("raw 1e-4, saved beyond frame 50: {}", text(&helix[1])),
            );
            claims.insert("temporal-rod-gain".to_owned(), format!("raw 1e-4, saved in {}", both(&rod)));
            claims.insert("temporal-highest".to_owned(), format!("rod, {}; helix, {}", both(&rod), both(&helix)));
            let words = format!("beyond frame 50, rod: {}; helix: {}", text(&rod[1]), text(&helix[1]));
            claims.insert("temporal-order".to_owned(), words);
        }
        Ok(claims)
    }
}

/// Shares saved by the paper's network, relative to zero.
struct Gain {
    iterations: f64,
    time: f64,
}

/// With the paper's solver: in the training's frames, and beyond them.
fn over_time(cells: &[(&Key, &Value)], scenario: Scenario) -> Option<[Gain; 2]> {
    let (preconditioner, _) = SOLVERS[0];
    let own = cells.iter().filter(|(key, _)| key.scenario == scenario && key.preconditioner == preconditioner.name());
    let series: Vec<_> = own.map(|(_, value)| value.series.clone()).collect();
    let curves = temporal::curves(&series, temporal::WINDOW);
    let curve = curves.iter().rfind(|curve| curve.name == "gn" || curve.name == "gn, planar")?;
    let saved = |spreads: &[Option<Spread>]| {
        let means = spreads.iter().flatten().map(|spread| spread.mean);
        Some(1.0 - Spread::of(means)?.mean)
    };
    let trained = (TRAINED as usize).min(curve.iterations.len());
    let gain = |from: usize, to: usize| {
        Some(Gain { iterations: saved(&curve.iterations[from..to])?, time: saved(&curve.time[from..to])? })
    };
    Some([gain(0, trained)?, gain(trained, curve.iterations.len())?])
}

/// Steps of a full simulation: four times the training data's.
const STEPS: usize = 200;

const INTRODUCTION: &str = "The paper's figure on temporal evolution: iterations of conjugate gradients over the frames, \
    relative to those from zero on the same systems. The paper sees about half of the iterations for helices beyond the 50 \
    frames of its training data, and a gain for rods that falls; restricted to the plane the rod's network does better. The \
    paper's 20 simulations have one set of parameters, which would be twenty times the same; all of ours but the first have \
    its N and its modulus, and draw the rest from Table 1.";

fn figure(context: &Context, cells: &[(&Key, &Value)]) -> Option<Figure> {
    let (key, _) = cells.first()?;
    let series: Vec<_> = cells.iter().map(|(_, value)| value.series.clone()).collect();
    let curves = temporal::curves(&series, temporal::WINDOW);
    type OfCurve = fn(&Curve) -> &[Option<Spread>];
    let chart = |title: &str, values: OfCurve| LineChart {
        title: title.to_owned(),
        x: Axis::linear("frame"),
        y: Axis::linear("relative to zero"),
        series: curves.iter().skip(1).map(|curve| over_frames(&curve.name, values(curve))).collect(),
        references: vec![
            Reference::Horizontal { y: 1.0, label: "from zero".to_owned() },
            Reference::Vertical { x: TRAINED, label: "training data end".to_owned() },
        ],
        ..LineChart::default()
    };
    let Key { scenario, steps, preconditioner, tolerance, .. } = key;
    let conditions = context
        .conditions("linear solves and guesses, features, inference and guards included")
        .with("solver", format!("conjugate gradients, {preconditioner}, tolerance {tolerance:e}, formulation xpbd"))
        .with(
            "simulations",
            format!("{} of {steps} steps, window {} frames; means and quartiles", cells.len(), temporal::WINDOW),
        );
    Some(Figure {
        id: format!("temporal-{scenario}-{preconditioner}"),
        title: format!(
            "{scenario}: iterations and time over the frames, {preconditioner} conjugate gradients to {tolerance:e}"
        ),
        caption: "Means over the simulations, relative to conjugate gradients from zero. Bands are quartiles."
            .to_owned(),
        charts: Charts::Lines(vec![
            chart("iterations", |curve| &curve.iterations),
            chart("time, guess and solve", |curve| &curve.time),
        ]),
        conditions,
    })
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

//! `--plot`: energy, length, iterations and time by stage over the simulated time.

use std::io::Write;
use std::path::Path;

use anyhow::Result;
use chart::{Axis, Charts, Conditions, Figure, LineChart, Series};
use export::write_atomically;

use crate::sample::Sample;

/// Files that [`write`] writes of a run.
pub(crate) const FILES: [&str; 4] = ["energy.svg", "length.svg", "iterations.svg", "stages.svg"];
/// The same of equilibria, which have no steps.
pub(crate) const AT_REST: [&str; 2] = [FILES[0], FILES[1]];

/// Writes those of [`FILES`] that are `wanted`, of a run, to `directory`.
pub(crate) fn write(directory: &Path, samples: &[Sample], conditions: &Conditions, wanted: &[&str]) -> Result<()> {
    // The start has no step behind it.
    let steps = samples.get(1..).unwrap_or_default();
    let charts = [
        ("Energy", "energy [J]", energies(samples)),
        (
            "Length of all rods over that of the start",
            "length ratio",
            vec![line("length", samples, |s| s.length_ratio)],
        ),
        ("Outer iterations", "iterations a step", vec![line("iterations", steps, |s| s.iterations)]),
        ("Time by stage", "time a step [us]", stages(steps)),
    ];
    for (file, (title, label, series)) in FILES.iter().zip(charts).filter(|(file, _)| wanted.contains(file)) {
        let chart = LineChart { x: Axis::linear("time [s]"), y: Axis::linear(label), series, ..LineChart::default() };
        let figure = Figure {
            id: file.trim_end_matches(".svg").to_owned(),
            title: title.to_owned(),
            caption: String::new(),
            charts: Charts::Lines(vec![chart]),
            conditions: conditions.clone(),
        };
        let svg = figure.svg();
        write_atomically(&directory.join(file), |out| out.write_all(svg.as_bytes()))?;
    }
    Ok(())
}

fn line(name: &str, samples: &[Sample], value: impl Fn(&Sample) -> f64) -> Series {
    let points = samples.iter().map(|sample| (sample.time, value(sample)));
    Series { markers: samples.len() == 1, ..Series::new(name, points) }
}

fn energies(samples: &[Sample]) -> Vec<Series> {
    vec![
        line("total", samples, |s| s.energy.total()),
        line("kinetic", samples, |s| s.energy.kinetic),
        line("gravity and loads", samples, |s| s.energy.external),
        line("stretch and shear", samples, |s| s.energy.stretch),
        line("bending and twist", samples, |s| s.energy.bend),
    ]
}

/// The stages that the run has.
fn stages(steps: &[Sample]) -> Vec<Series> {
    let Some(first) = steps.first() else { return Vec::new() };
    let has = |k: &usize| steps.iter().any(|sample| sample.stages_us[*k].1 > 0.0);
    let kept = (0..first.stages_us.len()).filter(has);
    kept.map(|k| line(first.stages_us[k].0, steps, |sample| sample.stages_us[k].1)).collect()
}

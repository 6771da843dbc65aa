//! `simulate static`: the equilibrium that a scene relaxes to.

use std::time::Instant;

use anyhow::{Context, Error, Result};
use rod::measure;
use scene::Scene;
use serde::Serialize;
use solver::statics::{StaticParams, equilibrium};

use crate::Outcome;
use crate::cli::{RestArgs, StaticArgs};
use crate::files::{Files, Wanted, Written};
use crate::numbers::{energy_scale, number, share, unless_noise};
use crate::{along, branches, scenes};
use terminal::say;

#[derive(Serialize)]
struct Report {
    scene: String,
    segments: usize,
    converged: bool,
    /// Linear solves, over all connected sets.
    linear_solves: usize,
    /// Whether the energy is at a minimum; missing where that is not known.
    #[serde(skip_serializing_if = "Option::is_none")]
    stable: Option<bool>,
    /// Largest movement in the last step: segment lengths or radians.
    last_movement: f64,
    tolerance: f64,
    /// none, steady, or frozen: a wind that changes in time, as it is at time 0.
    wind: &'static str,
    wall_s: f64,
    energy_start_j: f64,
    energy_end_j: f64,
    #[serde(skip)]
    energy_scale_j: f64,
    /// End face of the last segment of each rod [m].
    tips_m: Vec<[f64; 3]>,
}

/// The scene whose equilibrium is looked for, with the state in which the search begins.
pub(crate) fn begun(args: &RestArgs) -> Result<Scene> {
    let mut scene = scenes::named(&args.scene, args.seed, args.index)?;
    scenes::begin_with_frame(&mut scene, &args.begin)?;
    Ok(scene)
}

/// Prints a report, and what was written beside it.
pub(crate) fn tell<T: Serialize>(
    report: &T,
    json: bool,
    closed: Result<Option<Written>>,
    print: impl FnOnce(&T) -> Result<()>,
) -> Result<()> {
    if json {
        say!("{}", serde_json::to_string_pretty(report)?)?;
        return closed.map(drop);
    }
    print(report)?;
    if let Some(written) = closed? {
        say!("written to {}: {}", written.directory.display(), written.names.join(", "))?;
    }
    Ok(())
}

/// What the arguments ask of an equilibrium.
pub(crate) fn params(args: &StaticArgs) -> StaticParams {
    StaticParams {
        method: args.method,
        leave_unstable: !args.rest.keep_unstable,
        tolerance: args.tolerance,
        ..StaticParams::default()
    }
}

/// Finds the equilibrium, or several, as the arguments ask.
pub(crate) fn find(args: &StaticArgs) -> Result<Outcome> {
    match (args.along, args.branches) {
        (true, _) => along::follow(args),
        (_, true) => branches::find(args),
        _ => relax(args),
    }
}

/// Relaxes the scene, writes what was asked for (the start and the equilibrium as two frames), and prints a report.
fn relax(args: &StaticArgs) -> Result<Outcome> {
    let scene = begun(&args.rest)?;
    let wanted = args.out.as_deref().map(Wanted::plain);
    let files = wanted.map(|wanted| Files::open(wanted, &scene, 1.0, 0, 0.0)).transpose().context("--out")?;
    let params = params(args);
    let mut state = scene.state.clone();
    let begin = Instant::now();
    let found = equilibrium(&scene.model, &mut state, &params).with_context(|| scene.name.clone())?;
    let tip = |segments: &std::ops::Range<usize>| {
        let last = segments.end - 1;
        (state.positions[last] + state.axis(last) * (0.5 * scene.model.segments[last].length)).into()
    };
    let report = Report {
        scene: scene.name.clone(),
        segments: state.len(),
        converged: found.converged,
        linear_solves: found.steps,
        stable: found.stable,
        last_movement: found.movement,
        tolerance: args.tolerance,
        wind: match &scene.model.air {
            None => "none",
            Some(air) if air.wind.is_steady() => "steady",
            Some(_) => "frozen",
        },
        wall_s: begin.elapsed().as_secs_f64(),
        energy_start_j: measure::energy(&scene.model, &scene.state).total(),
        energy_end_j: measure::energy(&scene.model, &state).total(),
        energy_scale_j: energy_scale(&scene.model, &state),
        tips_m: scene.rods.iter().filter(|rod| !rod.segments.is_empty()).map(|rod| tip(&rod.segments)).collect(),
    };
    let mut closed = Ok(None);
    if let Some(mut files) = files {
        let refused = files.writer.push(&state, &[], 1.0).err().map(Error::from);
        closed = files.close(&scene, &report, refused, |_| Ok(())).context("--out").map(Some);
    }
    tell(&report, args.rest.json, closed, print)?;
    Ok(if found.converged { Outcome::Done } else { Outcome::NotConverged })
}

fn print(report: &Report) -> Result<()> {
    let status = if report.converged { "equilibrium found" } else { "NO equilibrium found" };
    let last = share(report.last_movement);
    say!(
        "{}: {status} after {} linear solves in {} s\n\
         in the last one no segment moved by more than {last} of its length, or turned by more than {last} rad",
        report.scene,
        report.linear_solves,
        number(report.wall_s)
    )?;
    if let Some(stable) = report.stable {
        say!("stable: {}", if stable { "yes" } else { "no" })?;
    }
    if report.wind == "frozen" {
        say!("in the wind as it is at time 0; it changes later, and so nothing stays at rest in it")?;
    }
    let scale = report.energy_start_j.abs().max(report.energy_end_j.abs()).max(report.energy_scale_j);
    let [start, end] = [report.energy_start_j, report.energy_end_j].map(|energy| number(unless_noise(energy, scale)));
    say!("energy: {start} J at the start, {end} J at rest")?;
    let size = report.tips_m.iter().flatten().fold(0.0, |size: f64, x| size.max(x.abs()));
    for (k, tip) in report.tips_m.iter().enumerate().take(10) {
        let [x, y, z] = tip.map(|x| number(unless_noise(x, size)));
        say!("tip of rod {k}: ({x}, {y}, {z}) m")?;
    }
    Ok(())
}

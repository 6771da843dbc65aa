//! `simulate static SCENE --along`: the equilibria along what a scene drives and loads.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Error, Result};
use cosserat::motion::{Change, Changing, Driven};
use cosserat::scene::Scene;
use cosserat::state::{JointForce, Model, State, measure};
use cosserat::statics::{PathEnd, PathEvent, PathParams, PathPoint, path};
use export::TableWriter;
use serde::Serialize;
use serde_json::{Map, Value};
use terminal::{Progress, say};

use crate::at_rest::AtRest;
use crate::cli::StaticArgs;
use crate::files::PATH;
use crate::inelastic::Inelastic;
use crate::numbers::number;
use crate::outcome::Outcome;
use crate::sharp::{SharpJoint, Sharpest};
use crate::sought::{Sought, begun, params, tell};

#[derive(Serialize)]
struct Report {
    #[serde(flatten)]
    sought: Sought,
    end: &'static str,
    end_time_s: f64,
    points: usize,
    events: Vec<Line>,
    /// What joints have lost and kept on the way; missing where all are elastic.
    #[serde(skip_serializing_if = "Option::is_none")]
    inelastic: Option<Inelastic>,
    /// The joint that turned furthest on the way, if it is too soft there.
    #[serde(skip_serializing_if = "Option::is_none")]
    sharp_joint: Option<SharpJoint>,
}

#[derive(Serialize)]
struct Line {
    kind: String,
    time_s: f64,
    point: usize,
    unstable_before: usize,
    unstable_after: usize,
    values: Map<String, Value>,
}

/// What changes over time of a scene, as columns and their values at a time [s].
fn values(model: &Model, time: f64) -> Vec<(String, f64)> {
    let mut out = Vec::new();
    let mut vector = |name: String, unit: &str, value: [f64; 3]| {
        out.extend(["x", "y", "z"].iter().zip(value).map(|(axis, x)| (format!("{name}_{axis}_{unit}"), x)));
    };
    for (i, change) in model.changes.iter().enumerate() {
        let is_like_the_last = |last: &Change| {
            matches!([last.of, change.of], [Changing::Rest(_), Changing::Rest(_)])
                && Arc::ptr_eq(&last.track, &change.track)
        };
        // The joints of a rod that change alike need one column.
        if i.checked_sub(1).is_some_and(|last| is_like_the_last(&model.changes[last])) {
            continue;
        }
        let (name, unit) = match change.of {
            Changing::Gravity => ("gravity".to_owned(), "m_s2"),
            Changing::Force(i) => (format!("load_{i}_force"), "n"),
            Changing::Torque(i) => (format!("load_{i}_torque"), "n_m"),
            Changing::Rest(i) => (format!("joint_{i}_rest"), "per_m"),
        };
        vector(name, unit, change.track.at(time).into());
    }
    for (i, driven) in model.motions.iter().enumerate() {
        let shift = driven.at(time).pose.position - driven.at(0.0).pose.position;
        vector(format!("motion_{i}_shift"), "m", shift.into());
    }
    let turned =
        |(i, driven): (usize, &Driven)| (format!("motion_{i}_turn_rad"), driven.carried.motion.turned(0.0, time));
    out.extend(model.motions.iter().enumerate().map(turned));
    out
}

/// Follows the scene's equilibria, writes what was asked for, and prints a report.
pub(crate) fn follow(args: &StaticArgs) -> Result<Outcome> {
    let (scene, held) = begun(&args.rest)?;
    let mut files = AtRest::open(args, &scene, scene.run.dt, Some(PATH)).context("--out")?;
    let until = scene.run.dt * scene.run.steps as f64;
    let params = PathParams { rest: params(args), ..PathParams::until(until) };
    let mut rows: Vec<String> = Vec::new();
    let mut refused: Option<Error> = None;
    let mut end_time_s = 0.0;
    let mut model = scene.model.clone();
    let mut sharpest = Sharpest::default();
    let (progress, mut shown) = (Progress::with_lines(scene.run.steps, "steps", args.rest.json)?, 0);
    let mut each = |point: &PathPoint, state: &State, forces: &[JointForce]| {
        end_time_s = point.time;
        let done = (point.time / scene.run.dt) as usize;
        progress.advance_by(done.saturating_sub(shown));
        shown = shown.max(done);
        sharpest.observe(&scene.model, state);
        let Some(files) = files.as_mut() else { return !progress.stopped() };
        model.set_time(point.time);
        let energy = measure::energy(&model, state).total();
        let PathPoint { time, length, unstable } = point;
        let of_course = values(&scene.model, *time).into_iter().map(|(_, x)| format!(",{x:?}"));
        let frame = rows.len() + 1;
        rows.push(format!("{frame},{time:?},{length:?},{unstable},{energy:?}{}", of_course.collect::<String>()));
        refused = files.push(&model, state, (forces, &[]), *time).err();
        refused.is_none() && !progress.stopped()
    };
    let begin = Instant::now();
    let mut state = scene.state.clone();
    let found = path(&scene.model, &mut state, &params, &mut each).with_context(|| scene.name.clone())?;
    let line = |event: &PathEvent| Line {
        kind: event.kind.to_string(),
        time_s: event.time,
        point: event.point,
        unstable_before: event.unstable[0],
        unstable_after: event.unstable[1],
        values: values(&scene.model, event.time).into_iter().map(|(name, x)| (name, x.into())).collect(),
    };
    let report = Report {
        sought: Sought::new((&scene, held), matches!(found.end, PathEnd::Until | PathEnd::Start), found.solves, begin),
        end: match found.end {
            PathEnd::Until => "until",
            PathEnd::Start => "start",
            PathEnd::Points => "points",
            PathEnd::Stopped => "stopped",
            PathEnd::Lost => "lost",
            PathEnd::NoStart => "no-start",
        },
        end_time_s,
        points: found.points,
        events: found.events.iter().map(line).collect(),
        inelastic: Inelastic::of(&scene, &state),
        sharp_joint: SharpJoint::of(&scene, &sharpest),
    };
    let table = |directory: &Path| write_table(directory, &scene, &rows);
    let closed =
        files.map(|files| files.close(&scene, &report, refused, &progress, table).context("--out")).transpose();
    progress.finish();
    tell(&report, args.rest.json, closed, print)?;
    Ok(match found.end {
        PathEnd::Stopped => Outcome::Interrupted,
        _ if report.sought.converged => Outcome::Done,
        _ => Outcome::NotConverged,
    })
}

fn write_table(directory: &Path, scene: &Scene, rows: &[String]) -> Result<()> {
    let of_course = values(&scene.model, 0.0).into_iter().map(|(name, _)| format!(",{name}"));
    let header = format!("frame,time_s,length,unstable,energy_j{}", of_course.collect::<String>());
    let mut table = TableWriter::create(&directory.join(PATH), &header)?;
    table.add(|writer| rows.iter().try_for_each(|row| writeln!(writer, "{row}")))?;
    Ok(table.finish()?)
}

fn print(report: &Report) -> Result<()> {
    say!(
        "{}: {} equilibria along the way, {} linear solves in {} s",
        report.sought.scene,
        report.points,
        report.sought.linear_solves,
        number(report.sought.wall_s)
    )?;
    for Line { kind, time_s, unstable_before, unstable_after, values, .. } in &report.events {
        say!("{kind} at {} s: unstable directions {unstable_before} before, {unstable_after} after", number(*time_s))?;
        let told = values.iter().filter_map(|(name, x)| x.as_f64().filter(|x| *x != 0.0).map(|x| (name, x)));
        let told: Vec<String> = told.take(8).map(|(name, x)| format!("{name} = {}", number(x))).collect();
        if !told.is_empty() {
            say!("  {}", told.join(", "))?;
        }
    }
    if report.events.is_empty() {
        say!("no fold and no bifurcation")?;
    }
    if let Some(inelastic) = &report.inelastic {
        say!("{inelastic}")?;
    }
    if let Some(joint) = &report.sharp_joint {
        say!("{joint}")?;
    }
    let end = number(report.end_time_s);
    match report.end {
        "until" => say!("followed to the end, {end} s"),
        "start" => say!("the way led back to the start, {end} s"),
        "points" => say!("NOT followed to the end: given up at {end} s after so many equilibria"),
        "stopped" => say!("stopped at {end} s"),
        "lost" => say!(
            "NOT followed to the end: no equilibrium close by at {end} s; something jumps there, or is led too far"
        ),
        _ => say!("NO equilibrium found to begin with"),
    }?;
    Ok(())
}

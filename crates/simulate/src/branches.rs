//! `simulate static SCENE --branches`: several equilibria of what a scene holds.

use std::time::Instant;

use anyhow::{Context, Error, Result};
use serde::Serialize;
use solver::statics::branches::{Branch, BranchParams, branches};

use crate::Outcome;
use crate::cli::StaticArgs;
use crate::files::{Files, Wanted};
use crate::numbers::{energy_scale, number, unless_noise};
use crate::statics::{Sought, begun, params, tell};
use terminal::say;

#[derive(Serialize)]
struct Report {
    #[serde(flatten)]
    sought: Sought,
    branches: Vec<Line>,
    #[serde(skip)]
    energy_scale_j: f64,
}

#[derive(Serialize)]
struct Line {
    energy_j: f64,
    stable: bool,
    /// Directions in which it is unstable.
    unstable: usize,
    neutral: bool,
}

/// Looks for equilibria, writes what was asked for (the start, then each of them), and prints a report.
pub(crate) fn find(args: &StaticArgs) -> Result<Outcome> {
    let scene = begun(&args.rest)?;
    let wanted = args.out.as_deref().map(Wanted::plain);
    let mut files = wanted.map(|wanted| Files::open(wanted, &scene, 1.0, 0, 0.0)).transpose().context("--out")?;
    let asked = BranchParams { rest: params(args), ..BranchParams::default() };
    let begin = Instant::now();
    let found = branches(&scene.model, &scene.state, &asked).with_context(|| scene.name.clone())?;
    let line = |&Branch { energy, unstable, neutral, .. }: &Branch| Line {
        energy_j: energy,
        stable: unstable == 0,
        unstable,
        neutral,
    };
    let report = Report {
        sought: Sought::new(&scene, !found.branches.is_empty(), found.solves, begin),
        branches: found.branches.iter().map(line).collect(),
        energy_scale_j: energy_scale(&scene.model, &scene.state),
    };
    let mut closed = Ok(None);
    if let Some(mut files) = files.take() {
        let mut push = |(k, branch): (usize, &Branch)| files.writer.push(&branch.state, &[], (k + 1) as f64);
        let refused = found.branches.iter().enumerate().try_for_each(&mut push).err().map(Error::from);
        closed = files.close(&scene, &report, refused, |_| Ok(())).context("--out").map(Some);
    }
    tell(&report, args.rest.json, closed, print)?;
    Ok(if report.sought.converged { Outcome::Done } else { Outcome::NotConverged })
}

fn print(report: &Report) -> Result<()> {
    let count = report.branches.len();
    say!(
        "{}: {count} equilibria found in {} linear solves and {} s; there may be more",
        report.sought.scene,
        report.sought.linear_solves,
        number(report.sought.wall_s)
    )?;
    for (k, Line { energy_j, unstable, neutral, .. }) in report.branches.iter().enumerate() {
        let kind = match unstable {
            0 => "stable".to_owned(),
            1 => "unstable in 1 direction".to_owned(),
            _ => format!("unstable in {unstable} directions"),
        };
        let family = if *neutral { ", one of a family of the same energy" } else { "" };
        say!("{}: {} J, {kind}{family}", k + 1, number(unless_noise(*energy_j, report.energy_scale_j)))?;
    }
    Ok(())
}

//! `simulate static SCENE --branches`: several equilibria of what a scene holds.

use std::time::Instant;

use anyhow::{Context, Result};
use cosserat::statics::{Branch, BranchParams, StaticParams, branches, equilibrium};
use serde::Serialize;
use terminal::{Progress, say};

use crate::at_rest::AtRest;
use crate::cli::StaticArgs;
use crate::numbers::{energy_scale, number, unless_noise};
use crate::outcome::Outcome;
use crate::sought::{Sought, begun, params, still, tell};

#[derive(Serialize)]
struct Report {
    #[serde(flatten)]
    sought: Sought,
    branches: Vec<Line>,
    /// Of what is driven, loads and gravity, in all frames.
    stands_at_s: f64,
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
    let (scene, held) = begun(&args.rest)?;
    let scene = still(scene);
    let progress = Progress::new(1, "equilibria", true)?;
    let mut files = AtRest::open(args, &scene, 1.0, None).context("--out")?;
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
        sought: Sought::new((&scene, held), !found.branches.is_empty(), found.solves, begin),
        branches: found.branches.iter().map(line).collect(),
        stands_at_s: 0.0,
        energy_scale_j: energy_scale(&scene.model, &scene.state),
    };
    let mut closed = Ok(None);
    if let Some(mut files) = files.take() {
        let mut push = |(k, branch): (usize, &Branch)| {
            // Its forces are found by staying there.
            let params = StaticParams { leave_unstable: false, ..asked.rest };
            let there = equilibrium(&scene.model, &mut branch.state.clone(), &params)?;
            files.push(&scene.model, &branch.state, (&there.forces, &there.contacts), (k + 1) as f64)
        };
        let refused = found.branches.iter().enumerate().try_for_each(&mut push).err();
        closed = files.close(&scene, &report, refused, &progress, |_| Ok(())).context("--out").map(Some);
    }
    tell(&report, args.rest.json, closed, print)?;
    Ok(match report.sought.converged {
        _ if progress.stopped() => Outcome::Interrupted,
        true => Outcome::Done,
        false => Outcome::NotConverged,
    })
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

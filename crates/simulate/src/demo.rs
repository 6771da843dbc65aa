//! `simulate` without arguments, with networks built in: the bending rod from COPINGNet's guess, and what that is worth.

use anyhow::Result;
use catalogue::{Guess, GuessName, Recipe, Training};
use clap::Parser;
use comfy_table::{CellAlignment, Table};
use cosserat::guess::{GuessFactory, GuessKind};
use cosserat::simulation::{Settings, SolverKind};
use evaluation::compare::{self, Cost, Entry, EntryRun};
use evaluation::guesses::Spread;
use graph::{Normal, planar_normal};
use terminal::{Progress, say};

use crate::choice::way;
use crate::cli::Cli;
use crate::outcome::Outcome;
use crate::run;
use crate::scenes::{scene, settings};

/// What is run, as flags: the formulation is the paper's, which networks are trained with.
const FLAGS: [&str; 6] = ["--formulation", "xpbd", "--solver", "cg", "--guess", "gn-best"];

/// Names of the rows.
const DIRECT: &str = "direct";
const ZERO: &str = "cg from zero";
const FISCHER: &str = "cg from Fischer's projection";
const PAPER: &str = "cg from COPINGNet (gn)";
const PAPER_PLANAR: &str = "cg from COPINGNet (gn), planar";
const BEST: &str = "cg from COPINGNet (gn-best)";

/// Runs the scene, then measures other starts and the direct solve beside it.
pub(crate) fn demo() -> Result<Outcome> {
    let cli = Cli::parse_from(["simulate"].iter().chain(&FLAGS));
    say!("simulate {}", FLAGS.join(" "))?;
    let outcome = run::run(&cli.scene, &cli.run)?;
    if !matches!(outcome, Outcome::Done) {
        return Ok(outcome);
    }
    let mut scene = scene(&cli.scene)?.scene;
    let settings = settings(&cli.scene, cli.run.guess, &scene.run);
    scene.model = settings.step.formulation.measured(&scene.model).into_owned();
    let training = Training::for_scene(&cli.run.learned, cli.run.guess.as_slice(), None, &scene, true)?;
    let cg = way((&cli.scene, &cli.run), &scene, &settings.step)?.solver;
    // The rod stays in a plane; of the guesses, gn alone does not know that by itself.
    let plane = planar_normal(&scene.model, &scene.state);
    let ways = [
        (DIRECT, SolverKind::Direct, GuessName::Plain(GuessKind::Zero), None),
        (ZERO, cg, GuessName::Plain(GuessKind::Zero), None),
        (FISCHER, cg, GuessName::Plain(GuessKind::Fischer(8)), None),
        (PAPER, cg, GuessName::Network(Recipe::Paper), None),
        (PAPER_PLANAR, cg, GuessName::Network(Recipe::Paper), plane),
        (BEST, cg, GuessName::Network(Recipe::Best), plane),
    ];
    let guesses = ways.iter().map(|&(_, _, name, _)| Guess::load(name, &training)).collect::<Result<Vec<_>>>()?;
    let factories: Vec<_> = ways.iter().zip(&guesses).map(|(&(.., plane), guess)| guess.factory(plane)).collect();
    let entry = |(&(name, solver, guess, _), factory): (&(&str, SolverKind, GuessName, Option<Normal>), _)| Entry {
        name: name.to_owned(),
        settings: Settings { step: settings.step, solver },
        guess: guess.helps_solves().then_some(factory as GuessFactory<'_>),
    };
    let entries: Vec<_> = ways.iter().zip(&factories).map(entry).collect();
    let progress = Progress::new(scene.run.steps, "steps", false)?;
    let compared =
        compare::run(&scene.model, &scene.state, scene.run.dt, scene.run.steps, &entries, |_| progress.advance())?;
    let interrupted = progress.finish();
    say!(
        "\nThe same motion in other ways, side by side; medians over the steps: outer iterations, cg iterations and us a step;\n\
         error: the largest of any step"
    )?;
    if compared.steps < scene.run.steps {
        say!("Stopped after {} of {} steps: what follows is of these alone.", compared.steps, scene.run.steps)?;
    }
    say!("{}", table(&compared.rows))?;
    say!("{}", verdict(&compared.rows))?;
    Ok(if interrupted { Outcome::Interrupted } else { Outcome::Done })
}

/// Median of the steps; zero without any.
fn median(run: &EntryRun, value: fn(&Cost) -> f64) -> f64 {
    Spread::of(run.by_step.iter().map(value)).map_or(0.0, |spread| spread.median)
}

/// Iterations of conjugate gradients in a step.
fn linear(run: &EntryRun) -> f64 {
    median(run, |step| step.linear_iterations as f64)
}

fn table(runs: &[EntryRun]) -> Table {
    let mut table = Table::new();
    table.load_style(comfy_table::presets::NOTHING);
    table.set_header(["way", "outer", "cg", "guess", "assemble", "solve", "total", "error", "status"]);
    for run in runs {
        let us = &run.median_us;
        let times = [us.guess, us.assemble, us.solve, us.total].map(|us| format!("{us:.1}"));
        let counts = [median(run, |step| step.iterations as f64), linear(run)].map(|count| format!("{count:.0}"));
        let cells = std::iter::once(run.name.clone()).chain(counts).chain(times);
        table.add_row(cells.chain([format!("{:.1e}", run.error), run.status.name().to_owned()]));
    }
    for column in table.column_iter_mut().skip(1).take(7) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

/// Who is fastest, and what the network's start is worth, in words.
fn verdict(rows: &[EntryRun]) -> String {
    let named = |name: &str| rows.iter().find(|row| row.name == name);
    let fastest = rows.iter().min_by(|a, b| a.median_us.total.total_cmp(&b.median_us.total));
    let (Some(fastest), Some(direct), Some(zero), Some(best)) = (fastest, named(DIRECT), named(ZERO), named(BEST))
    else {
        return String::new();
    };
    format!(
        "Fastest here: {}, {:.0} us a step. From COPINGNet (gn-best) conjugate gradients take {:.0} % of the iterations\n\
         and {:.0} % of the time that they take from zero, and {:.1} times the time of the direct solve.",
        fastest.name,
        fastest.median_us.total,
        100.0 * linear(best) / linear(zero),
        100.0 * best.median_us.total / zero.median_us.total,
        best.median_us.total / direct.median_us.total
    )
}

#[cfg(test)]
mod tests {
    use cosserat::simulation::{Counters, Status};
    use evaluation::stages::Stages;

    use super::*;

    #[test]
    fn the_verdict_is_what_the_numbers_say() {
        let row = |name: &str, linear_iterations, total| EntryRun {
            name: name.to_owned(),
            status: Status::Converged,
            given_up: None,
            sets: 1,
            counters: Counters::default(),
            median_us: Stages { total, ..Stages::default() },
            error: 0.0,
            by_step: vec![Cost { linear_iterations, ..Cost::default() }],
        };
        let rows = [row(DIRECT, 0, 20.0), row(ZERO, 40, 50.0), row(FISCHER, 8, 19.0), row(BEST, 20, 60.0)];
        assert_eq!(
            verdict(&rows),
            "Fastest here: cg from Fischer's projection, 19 us a step. From COPINGNet (gn-best) conjugate gradients take 50 % \
             of the iterations\nand 120 % of the time that they take from zero, and 3.0 times the time of the direct solve."
        );
    }
}

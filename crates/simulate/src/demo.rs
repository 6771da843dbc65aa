//! `simulate` without arguments, with networks built in: the bending rod from COPINGNet's guess, and what that is worth.

use anyhow::Result;
use catalogue::{Guess, GuessName, LearnedName, Recipe, Training};
use clap::Parser;
use evaluation::compare::{self, Entry, Row};
use graph::planar_normal;
use solver::guess::GuessKind;
use solver::linear::solvers::SolverKind;
use solver::simulation::{GuessFactory, Settings};

use crate::Outcome;
use crate::choice::way;
use crate::cli::Cli;
use crate::compare::{runs_table, say_stopped};
use crate::run;
use crate::scenes::{scene, settings};
use terminal::{Progress, say};

/// What is run, as flags: the formulation is the paper's, which networks are trained with.
const FLAGS: [&str; 6] = ["--formulation", "xpbd", "--solver", "cg", "--guess", "gn-best"];

/// Names of the rows.
const DIRECT: &str = "direct";
const ZERO: &str = "cg from zero";
const FISCHER: &str = "cg from Fischer's projection";
const PAPER: &str = "cg from COPINGNet (gn), planar";
const BEST: &str = "cg from COPINGNet (gn-best)";

/// Runs the scene, then measures other starts and the direct solve beside it.
pub(crate) fn demo() -> Result<Outcome> {
    let cli = Cli::parse_from(["simulate"].iter().chain(&FLAGS));
    say!("simulate {}", FLAGS.join(" "))?;
    let outcome = run::run(&cli.scene, &cli.run)?;
    if !matches!(outcome, Outcome::Done) {
        return Ok(outcome);
    }
    let scene = scene(&cli.scene)?;
    let settings = settings(&cli.scene);
    let training = Training::for_scene(&cli.run.learned, cli.run.guess.as_slice(), None, &scene, true)?;
    let cg = way(&cli.run, &scene, &settings.step)?.solver;
    let ways = [
        (DIRECT, SolverKind::Direct, GuessName::Plain(GuessKind::Zero)),
        (ZERO, cg, GuessName::Plain(GuessKind::Zero)),
        (FISCHER, cg, GuessName::Plain(GuessKind::Fischer(8))),
        (PAPER, cg, GuessName::Learned(LearnedName::Network(Recipe::Paper))),
        (BEST, cg, GuessName::Learned(LearnedName::Network(Recipe::Best))),
    ];
    let guesses = ways.iter().map(|&(_, _, name)| Guess::load(name, &training)).collect::<Result<Vec<_>>>()?;
    let plane = planar_normal(&scene.model, &scene.state);
    let factories: Vec<_> = guesses.iter().map(|guess| guess.factory(plane)).collect();
    let entry = |(&(name, solver, guess), factory): (&(&str, SolverKind, GuessName), _)| Entry {
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
    say_stopped(compared.steps, scene.run.steps)?;
    let medians = |row: &Row| [row.outer_median, row.linear_median].map(|median| format!("{median:.0}"));
    say!("{}", runs_table(&compared.rows, medians))?;
    say!("{}", verdict(&compared.rows))?;
    Ok(if interrupted { Outcome::Interrupted } else { Outcome::Done })
}

/// Who is fastest, and what the network's start is worth, in words.
fn verdict(rows: &[Row]) -> String {
    let named = |name: &str| rows.iter().find(|row| row.name == name);
    let fastest = rows.iter().min_by(|a, b| a.total_us.total_cmp(&b.total_us));
    let (Some(fastest), Some(direct), Some(zero), Some(best)) = (fastest, named(DIRECT), named(ZERO), named(BEST))
    else {
        return String::new();
    };
    format!(
        "Fastest here: {}, {:.0} us a step. From COPINGNet (gn-best) conjugate gradients take {:.0} % of the iterations\n\
         and {:.0} % of the time that they take from zero, and {:.1} times the time of the direct solve.",
        fastest.name,
        fastest.total_us,
        100.0 * best.linear_median / zero.linear_median,
        100.0 * best.total_us / zero.total_us,
        best.total_us / direct.total_us
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_verdict_is_what_the_numbers_say() {
        let row = |name: &str, linear_median, total_us| Row {
            name: name.to_owned(),
            status: "converged",
            given_up: None,
            iterations_per_step: 2.0,
            linear_iterations_per_solve: 0.0,
            outer_median: 2.0,
            linear_median,
            drag_us: 0.0,
            predict_us: 0.0,
            guess_us: 0.0,
            assemble_us: 0.0,
            solve_us: 0.0,
            update_us: 0.0,
            contact_us: 0.0,
            total_us,
            error: 0.0,
            by_step: vec![],
        };
        let rows = [row(DIRECT, 0.0, 20.0), row(ZERO, 40.0, 50.0), row(FISCHER, 8.0, 19.0), row(BEST, 20.0, 60.0)];
        assert_eq!(
            verdict(&rows),
            "Fastest here: cg from Fischer's projection, 19 us a step. From COPINGNet (gn-best) conjugate gradients take 50 % \
             of the iterations\nand 120 % of the time that they take from zero, and 3.0 times the time of the direct solve."
        );
    }
}

//! `evaluate benchmark`: fourteen experiments with known results, each with its error.

use anyhow::{Result, bail};
use clap::Args;
use cosserat::simulation::{Formulation, Integrator, Settings, StepParams};
use evaluation::benchmark::{BenchmarkError, Experiment, Outcome as Measured, Quantity, experiments};
use report::Cell;
use terminal::Progress;

use super::{OutputArgs, conditions};
use crate::blocks::table;
use crate::outcome::Outcome;
use crate::show::number;

#[derive(Args, Debug)]
pub(crate) struct BenchmarkArgs {
    /// Equations of all runs: xpbd, newton.
    #[arg(long, default_value_t = Formulation::Newton)]
    formulation: Formulation,
    /// Integrator of all runs: euler or bdf2.
    #[arg(long, default_value_t = Integrator::Bdf2)]
    integrator: Integrator,
    /// Run these experiments alone: their names, or those of their scenes.
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    only: Vec<String>,
    #[command(flatten)]
    output: OutputArgs,
}

/// The experiments that are asked for; all where none is named.
fn asked(names: &[String]) -> Result<Vec<Experiment>> {
    let is = |experiment: &Experiment, name: &String| [experiment.name, experiment.scene].contains(&name.as_str());
    let mut all = experiments();
    if let Some(name) = names.iter().find(|name| !all.iter().any(|experiment| is(experiment, name))) {
        let known = all.iter().map(|experiment| experiment.name).collect::<Vec<_>>().join(", ");
        bail!("--only {name}: there is no such experiment; there are: {known}");
    }
    all.retain(|experiment| names.is_empty() || names.iter().any(|name| is(experiment, name)));
    Ok(all)
}

/// Runs the experiments and shows each as soon as it is done. What is off ends the program with 1.
pub(crate) fn benchmark(args: &BenchmarkArgs) -> Result<Outcome> {
    let experiments = asked(&args.only)?;
    args.output.prepare()?;
    let &BenchmarkArgs { formulation, integrator, .. } = args;
    let step = StepParams { formulation, integrator, ..StepParams::DEFAULT };
    let settings = Settings { step, ..Settings::default() };
    let steps = experiments.iter().map(|experiment| experiment.steps).sum();
    let progress = Progress::new(steps, "steps", args.output.quiet)?;
    let say = |text: &str| progress.aside(|| args.output.say(text));
    say(&line(["experiment", "quantity", "right", "measured", "error", "allowed", "", "time"]))?;
    let (mut rows, mut counts, mut off) = (Vec::new(), [0; 2], Vec::new());
    for experiment in &experiments {
        match experiment.run(&settings, &mut || progress.advance()) {
            Ok(measured) => {
                say(&lines(experiment, &measured))?;
                rows.extend(of(experiment, &measured));
                let is_right = measured.quantities.iter().filter(|quantity| quantity.is_right());
                counts = [counts[0] + is_right.count(), counts[1] + measured.quantities.len()];
                if !measured.is_right() {
                    off.push(experiment.name);
                }
            }
            Err(BenchmarkError::Interrupted) => break,
            Err(error) => return Err(error.into()),
        }
    }
    say(&format!("{} of {} quantities within what is allowed", counts[0], counts[1]))?;
    let words = "Error: over the right value, or as it is where that is zero. Time and outer iterations a step are of all runs of \
                 the experiment. Published: errors of others, from cosseratbench (github.com/jakeryderv/cosseratbench, \
                 docs/findings.md), whose scenes are like ours but not the same.";
    let conditions = conditions().with("formulation", formulation.name()).with("integrator", integrator.name());
    let block =
        table(["benchmark-results", "Experiments with a known result", words], HEADINGS, rows, conditions.clone());
    let outcome = args.output.write(["benchmark", "Benchmark"], vec![block], conditions, progress.finish())?;
    if off.is_empty() {
        return Ok(outcome);
    }
    terminal::complain(format_args!("not right: {}", off.join(", ")));
    Ok(Outcome::Faulty)
}

/// A line of the terminal: experiment, quantity, right value, measured value, error, what is allowed, verdict, time.
fn line(cells: [&str; 8]) -> String {
    let [experiment, quantity, right, measured, error, allowed, verdict, time] = cells;
    format!("{experiment:<16}{quantity:<46}{right:>11}{measured:>11}{error:>10}{allowed:>8}  {verdict:<6}{time:>8}")
}

/// The lines of an experiment: one a quantity, what is published below it, and the status where steps were not solved.
fn lines(experiment: &Experiment, measured: &Measured) -> String {
    let mut lines = Vec::new();
    for (k, quantity) in measured.quantities.iter().enumerate() {
        let [name, time] = if k == 0 { [experiment.name, &format!("{:.1} s", measured.seconds)] } else { ["", ""] };
        let [right, value] = [quantity.right, quantity.measured].map(|value| report::significant(value, 5));
        let [error, allowed] = [quantity.error, quantity.allowed].map(number);
        lines.push(line([name, quantity.name, &right, &value, &error, &allowed, verdict(quantity), time]));
        if !quantity.published.is_empty() {
            lines.push(format!("{:18}published: {}", "", quantity.published));
        }
    }
    if !measured.status.is_converged() {
        lines.push(format!("{:16}worst status of a step: {}", "", measured.status.name()));
    }
    lines.join("\n")
}

/// Whether a quantity is right, in a word.
fn verdict(quantity: &Quantity) -> &'static str {
    if quantity.is_right() { "right" } else { "off" }
}

const HEADINGS: &str = "experiment | quantity | #right | source | #measured | #error | #allowed | verdict | status | #time [s] | #iterations | published";

/// A row for each quantity of an experiment, with what the whole took in the first.
fn of(experiment: &Experiment, measured: &Measured) -> Vec<Vec<Cell>> {
    let is_solved = measured.status.is_converged();
    let row = |(k, quantity): (usize, &Quantity)| {
        let of_all = |text: String| Cell::from(if k == 0 { text } else { String::new() });
        let loud = |is_good: bool, text: &str| if is_good { Cell::from(text) } else { Cell::strong(text) };
        vec![
            of_all(experiment.name.to_owned()),
            quantity.name.into(),
            report::significant(quantity.right, 5).into(),
            quantity.source.into(),
            report::significant(quantity.measured, 5).into(),
            number(quantity.error).into(),
            number(quantity.allowed).into(),
            loud(quantity.is_right(), verdict(quantity)),
            loud(is_solved, measured.status.name()),
            of_all(number(measured.seconds)),
            of_all(number(measured.iterations_per_step)),
            quantity.published.into(),
        ]
    };
    measured.quantities.iter().enumerate().map(row).collect()
}

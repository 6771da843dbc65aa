//! `evaluate stress`: the stability table, or some of its cases.

use anyhow::{Result, bail};
use clap::Args;
use cosserat::simulation::{Formulation, Integrator};
use evaluation::stress;
use terminal::Progress;

use super::{OutputArgs, conditions};
use crate::outcome::Outcome;
use crate::sections::stability::show as stability;

#[derive(Args, Debug)]
pub(crate) struct StressArgs {
    /// Formulations to run [default: all].
    #[arg(long, value_delimiter = ',')]
    formulation: Vec<Formulation>,
    /// Integrator of all runs: euler or bdf2.
    #[arg(long, default_value_t = Integrator::default())]
    integrator: Integrator,
    /// Run only the cases whose name holds this text.
    #[arg(long, default_value = "")]
    only: String,
    #[command(flatten)]
    output: OutputArgs,
}

/// Runs the cases and shows a row each.
pub(crate) fn stress(args: &StressArgs) -> Result<Outcome> {
    let is_asked = |formulation: &Formulation| args.formulation.is_empty() || args.formulation.contains(formulation);
    let mut cases = stress::cases();
    cases.retain(|case| case.name.contains(&args.only));
    if cases.is_empty() {
        let names = stress::cases().into_iter().map(|case| case.name).collect::<Vec<_>>().join("; ");
        bail!("--only {}: no case's name holds this text; there are: {names}", args.only);
    }
    args.output.prepare()?;
    let of = |case| Formulation::ALL.into_iter().filter(is_asked).map(move |formulation| (case, formulation));
    let runs = cases.iter().flat_map(of).filter(|(case, formulation)| case.formulations.contains(formulation));
    let progress = Progress::new(runs.clone().count(), "runs", args.output.quiet)?;
    args.output.say(&format!("cases: {}, runs: {}", cases.len(), runs.clone().count()))?;
    let mut rows = Vec::new();
    for (case, formulation) in runs {
        let mut settings = stress::settings(formulation);
        settings.step.integrator = args.integrator;
        rows.push(stress::run(case, &settings, None)?);
        if !progress.advance() {
            break;
        }
    }
    let conditions_of_rows = stability::tolerances(conditions()).with("integrator", args.integrator.name());
    let table = stability::cases_table(&rows.iter().collect::<Vec<_>>(), conditions_of_rows);
    let outcome = args.output.finish(["stress", "Stability"], vec![table], conditions(), progress)?;
    let failed = rows.iter().find(|row| !row.finite);
    Ok(failed.map_or(outcome, |row| Outcome::not_finite(&row.case, &row.formulation)))
}

//! `evaluate compare SCENE`: solvers and guesses side by side on a scene.

use anyhow::Result;
use catalogue::{GuessName, Row, Sources, Training, load, rows};
use clap::Args;
use cosserat::guess::{GuessFactory, GuessKind};
use cosserat::scene;
use cosserat::simulation::{
    CgParams, Formulation, Integrator, PreconditionerKind, Settings, SolverKind, Status, StepParams,
};
use dataset::Scenario;
use evaluation::compare::{self, Comparison, Entry, EntryRun};
use evaluation::guesses::{self, beside_zero};
use evaluation::precision::{Level, Outer, reference};
use evaluation::stages::Stages;
use graph::planar_normal;
use report::{Block, Cell, Conditions};
use terminal::{Progress, positive};

use super::random::{dropped, plan, solves_table};
use super::{OutputArgs, at_least_one, conditions, with_networks};
use crate::blocks::table;
use crate::outcome::Outcome;
use crate::show::number;
use crate::ways::{PRECONDITIONERS, cap};

#[derive(Args, Debug)]
pub(crate) struct CompareArgs {
    /// A scene file, or the name of a builtin scene (see `simulate list`).
    #[arg(default_value = "bending-rod", value_name = "SCENE.toml | NAME")]
    scene: String,
    /// Number of steps [default: the scene's].
    #[arg(long, value_parser = at_least_one, allow_hyphen_values = true)]
    steps: Option<usize>,
    /// Time step [s] [default: the scene's].
    #[arg(long, value_parser = positive, allow_hyphen_values = true)]
    dt: Option<f64>,
    /// Equations of conjugate gradients and of the reference: xpbd, newton.
    #[arg(long, default_value_t = Formulation::Xpbd)]
    formulation: Formulation,
    /// Residual at which a step is done, relative to that of its prediction.
    #[arg(long, default_value = "1e-6", value_parser = positive, allow_hyphen_values = true)]
    tolerance: f64,
    /// More guesses to compare: knn, gn, gn-best, gn-step, or fischer-16 for instance. Where the scene is planar, knn and
    /// gn are shown a second time, restricted to the plane; the others always are.
    #[arg(long, value_delimiter = ',', value_name = "GUESSES")]
    with: Vec<GuessName>,
    /// What learned guesses learned from: rod, helix, knot, tree [default: what is most like the scene].
    #[arg(long)]
    scenario: Option<Scenario>,
    /// Steps to leave out of the table of starts, where a history is not full yet.
    #[arg(long, default_value = "10")]
    skip: usize,
    #[command(flatten)]
    learned: Sources,
    #[command(flatten)]
    output: OutputArgs,
}

/// Runs both tables and shows them.
pub(crate) fn compare(args: &CompareArgs) -> Result<Outcome> {
    let is_file = args.scene.ends_with(".toml") || args.scene.contains(['/', '\\']);
    let scene = if is_file { scene::load(&args.scene)? } else { scene::builtin(&args.scene)? };
    args.output.prepare()?;
    let (dt, steps) = (args.dt.unwrap_or(scene.run.dt), args.steps.unwrap_or(scene.run.steps));
    let training = Training::for_scene(&args.learned, &args.with, args.scenario, &scene, args.output.quiet)?;
    let own = GuessKind::ALL.into_iter().chain([GuessKind::Fischer(4)]).map(GuessName::Plain);
    let loaded = load(own.chain(args.with.iter().copied()), &training)?;
    training.say_foreign(&args.with, &scene)?;
    for (name, guess) in &loaded {
        training.say_time_steps(*name, guess, dt)?;
    }
    let progress = Progress::new(2 * steps, "steps", args.output.quiet)?;
    let of_scene = format!("{}, {} segments, {steps} steps of {dt:?} s", scene.name, scene.model.segments.len());
    args.output.say(&of_scene)?;
    let plane = planar_normal(&scene.model, &scene.state);
    let rows = rows(&loaded, plane.is_some());
    let factories: Vec<_> = rows.iter().map(|row| row.factory(plane)).collect();
    let starts = rows.iter().zip(factories.iter().map(|own| own as GuessFactory<'_>));
    let (of_steps, of_solves): (Vec<_>, Vec<_>) = starts.partition(|(row, _)| row.guess_name.helps_steps());

    let level = Level::new(Outer::Tolerance(args.tolerance));
    let mut entries = Vec::new();
    let mut entry = |name: String, formulation, solver, guess| {
        // Where CG does not converge, halved steps would take their time to show the same.
        let max_halvings = if matches!(solver, SolverKind::Cg(_)) { 0 } else { StepParams::DEFAULT.max_halvings };
        // Guesses have learned from steps of Euler's rule.
        let integrator = Integrator::Euler;
        let step = StepParams { formulation, integrator, max_halvings, ..StepParams::DEFAULT };
        entries.push(Entry { name, settings: level.settings(&Settings { step, solver }), guess });
    };
    // The entry whose formulation the reference takes comes first.
    let own = args.formulation;
    let others = Formulation::ALL.into_iter().filter(|&formulation| formulation != own);
    for formulation in std::iter::once(own).chain(others) {
        entry(format!("{formulation}, direct"), formulation, SolverKind::Direct, None);
    }
    for (Row { name, .. }, guess) in of_steps {
        entry(format!("newton, direct, {name}"), Formulation::Newton, SolverKind::Direct, Some(guess));
    }
    entry(format!("{own}, sparse"), own, SolverKind::Sparse, None);
    entry(format!("{own}, cg frozen, zero"), own, SolverKind::cg(PreconditionerKind::Frozen), None);
    let max_iterations = cap(&scene);
    for preconditioner in PRECONDITIONERS {
        for (Row { name, .. }, guess) in &of_solves {
            let solver = SolverKind::Cg(CgParams { preconditioner, max_iterations, ..CgParams::default() });
            entry(format!("{own}, cg {preconditioner}, {name}"), own, solver, Some(*guess));
        }
    }
    let compared = compare::run(&scene.model, &scene.state, dt, steps, &entries, |steps| progress.advance_by(steps))?;
    let skip = args.skip.min(steps - 1);
    let buckets = (0..steps).map(|step| (step >= skip).then_some(0)).collect();
    let of_solves = of_solves.into_iter().map(|(row, guess)| (row.name.clone(), Some(guess))).collect();
    let plan = plan(of_solves, max_iterations, buckets, false);
    let base = entries[0].settings;
    let measured = guesses::measure(&scene.model, &scene.state, dt, &base, &plan, || progress.advance())?;
    let cells = beside_zero(&[measured], 0);

    let conditions = conditions().with("scene", of_scene).with("tolerance", format!("{:e}", args.tolerance));
    let conditions = with_networks(conditions, training.scenario.name(), &rows);
    let title = format!(
        "Starts: iterations of conjugate gradients in the first outer iteration of each step, on the same systems for all \
         (the exact motion's), after the first {skip} steps; % of the zero start"
    );
    let mut blocks = in_words(&compared, steps, own);
    blocks.push(runs(&compared.rows, conditions.clone()));
    blocks.push(solves_table(["compare-starts", &title], &cells, false, conditions.clone()));
    blocks.extend(dropped(&cells));
    let title = format!("{}: ways compared", scene.name);
    let outcome = args.output.finish(["compare", &title], blocks, conditions, progress)?;
    let failed = compared.rows.iter().find(|row| row.status == Status::NonFinite);
    Ok(failed.map_or(outcome, |row| Outcome::not_finite(&scene.name, &row.name)))
}

/// What errors are measured against, and how far.
fn in_words(compared: &Comparison, steps: usize, formulation: Formulation) -> Vec<Block> {
    let Comparison { steps: done, reference_status, first_contact, .. } = compared;
    let errors = format!(
        "Errors are those of positions (root mean square relative to the rods' length, the largest of any step) against \
         {formulation}, direct, solved to {:e} ({}). Conjugate gradients go to 1e-6 of the right-hand side, in the \
         preconditioner's norm.",
        reference::TOLERANCE,
        reference_status.name()
    );
    let stopped = format!("Stopped after {done} of {steps} steps: what follows is of these alone.");
    let contacts = first_contact.map(|step| {
        format!(
            "Contacts from step {step} on. Errors are those before: after them the smallest difference grows, and would \
             tell chaos from accuracy no more."
        )
    });
    let words = [Some(errors), (*done < steps).then_some(stopped), contacts];
    words.into_iter().flatten().map(Block::Paragraph).collect()
}

/// The table of ways: outer iterations a step and linear ones in each, and of each stage that there is the time.
fn runs(runs: &[EntryRun], conditions: Conditions) -> Block {
    let names = Stages::default().by_name().map(|(name, _)| name);
    let us = |run: &EntryRun, stage: usize| run.median_us.by_name()[stage].1;
    let stages: Vec<usize> = (0..names.len()).filter(|&k| runs.iter().any(|run| us(run, k) > 0.0)).collect();
    let times: String = stages.iter().map(|&stage| format!("#{} [us] | ", names[stage])).collect();
    let row = |run: &EntryRun| {
        let sets_and_steps = (run.by_step.len() * run.sets).max(1) as f64;
        let [outer, linear] = [run.counters.iterations, run.counters.linear_iterations].map(|count| count as f64);
        let counts = [format!("{:.2}", outer / sets_and_steps), format!("{:.1}", linear / outer.max(1.0))];
        let times = stages.iter().map(|&stage| format!("{:.1}", us(run, stage)));
        let given_up = run.given_up.map_or_else(String::new, |step| format!(", given up in step {step}"));
        let end = [number(run.error), run.status.name().to_owned() + &given_up];
        std::iter::once(run.name.clone()).chain(counts).chain(times).chain(end).map(Cell::from).collect()
    };
    let head = ["compare-runs", "Ways: outer iterations a step, linear ones in each; medians of a step's times", ""];
    let headings = format!("way | #outer | #linear | {times}#error | status");
    table(head, &headings, runs.iter().map(row).collect(), conditions)
}

//! `simulate compare`: solvers and guesses side by side.

use anyhow::{Result, bail};
use catalogue::{GuessName, NetworkOf, Training, load, networks, rows};
use comfy_table::{CellAlignment, Table};
use evaluation::compare::{self, Comparison, Entry};
use evaluation::precision::reference;
use evaluation::starts::{self, Cell, Plan};
use graph::planar_normal;
use serde::Serialize;
use solver::formulation::Formulation;
use solver::guess::GuessKind;
use solver::linear::cg::CgParams;
use solver::linear::precondition::PreconditionerKind;
use solver::linear::solvers::SolverKind;
use solver::simulation::{GuessFactory, Settings};
use solver::step::Status;

use crate::Outcome;
use crate::cli::CompareArgs;
use crate::scenes::{scene, settings, use_threads};
use crate::spreads::say_dropped;
use terminal::{Progress, say};

/// Tolerances of the tables of starts.
pub(crate) const TOLERANCES: [f64; 3] = [1e-2, 1e-4, 1e-6];
/// Preconditioners of the tables of starts.
pub(crate) const PRECONDITIONERS: [PreconditionerKind; 3] =
    [PreconditionerKind::Raw, PreconditionerKind::Jacobi, PreconditionerKind::BlockJacobi];
/// Guesses that are always shown.
const OWN: [GuessKind; 11] = [
    GuessKind::Zero,
    GuessKind::Previous,
    GuessKind::Linear,
    GuessKind::Quadratic,
    GuessKind::Fischer(4),
    GuessKind::Fischer(8),
    GuessKind::Frozen,
    GuessKind::StepPrevious,
    GuessKind::StepLinear,
    GuessKind::StepQuadratic,
    GuessKind::StepAdaptive,
];

#[derive(Serialize)]
struct Report {
    scene: String,
    segments: usize,
    steps: usize,
    /// Steps of the runs before Ctrl-C.
    steps_done: usize,
    dt_s: f64,
    outer_tolerance: f64,
    /// Worst status of the reference that errors are measured against.
    reference_status: &'static str,
    /// Steps of the reference before its first contact; errors are those of these steps.
    steps_before_contact: usize,
    contact_tolerance: f64,
    /// The networks among the guesses.
    networks: Vec<NetworkOf>,
    runs: Vec<compare::Row>,
    starts: Vec<Cell>,
}

/// Runs both tables and prints them.
pub(crate) fn compare(args: &CompareArgs) -> Result<Outcome> {
    let scene = scene(&args.scene)?;
    use_threads(&args.scene)?;
    let base = settings(&args.scene);
    let (dt, steps) = (scene.run.dt, scene.run.steps);
    if steps == 0 {
        bail!("--steps 0, but a comparison needs at least 1");
    }
    let quiet = args.scene.quiet || args.scene.json;
    let training = Training::for_scene(&args.learned, &args.with, args.scenario, &scene, quiet)?;
    let guesses = load(OWN.map(GuessName::Plain).into_iter().chain(args.with.iter().copied()), &training)?;
    training.say_foreign(&args.with, &scene)?;
    let progress = Progress::new(2 * steps, "steps", quiet)?;
    if !quiet {
        say!("{}: {} segments, {steps} steps of {dt:?} s", scene.name, scene.model.segments.len())?;
    }
    let plane = planar_normal(&scene.model, &scene.state);
    let rows = rows(&guesses, plane.is_some());
    let with_factories: Vec<_> = rows.iter().map(|row| (row, row.factory(plane))).collect();
    let of_solves = || with_factories.iter().filter(|(row, _)| !row.guess_name.helps_steps());

    let mut entries = Vec::new();
    let mut entry = |name: String, formulation, solver, guess| {
        // Where CG does not converge, halved steps would take their time to show the same.
        let max_halvings = if matches!(solver, SolverKind::Cg(_)) { 0 } else { base.step.max_halvings };
        let step = solver::step::StepParams { formulation, max_halvings, ..base.step };
        entries.push(Entry { name, settings: Settings { step, solver }, guess });
    };
    for formulation in Formulation::ALL {
        entry(format!("{formulation}, direct"), formulation, SolverKind::Direct, None);
    }
    for (row, factory) in with_factories.iter().filter(|(row, _)| row.guess_name.helps_steps()) {
        entry(format!("newton, direct, {}", row.name), Formulation::Newton, SolverKind::Direct, Some(factory as _));
    }
    let own = args.scene.formulation;
    entry(format!("{own}, sparse"), own, SolverKind::Sparse, None);
    entry(format!("{own}, cg frozen, zero"), own, SolverKind::cg(PreconditionerKind::Frozen), None);
    for preconditioner in PRECONDITIONERS {
        for (row, factory) in of_solves() {
            let params = CgParams { preconditioner, ..CgParams::default() };
            let solver = SolverKind::Cg(CgParams { max_iterations: cap(scene.model.segments.len()), ..params });
            let guess = row.guess_name.helps_solves().then_some(factory as _);
            entry(format!("{own}, cg {preconditioner}, {}", row.name), own, solver, guess);
        }
    }
    // The entry whose formulation the reference takes comes first.
    entries.sort_by_key(|entry| entry.settings.step.formulation != own);

    let Comparison { rows: runs, steps: steps_done, reference_status, first_contact } =
        compare::run(&scene.model, &scene.state, dt, steps, &entries, |_| progress.advance())?;
    let starts = of_solves().map(|(row, factory)| {
        let guess = row.guess_name.helps_solves().then_some(factory as GuessFactory<'_>);
        (row.name.clone(), guess)
    });
    let skip = args.skip.min(steps - 1);
    let plan = Plan {
        guesses: starts.collect(),
        preconditioners: PRECONDITIONERS.to_vec(),
        tolerances: TOLERANCES.to_vec(),
        max_iterations: cap(scene.model.segments.len()),
        buckets: (0..steps).map(|step| (step >= skip).then_some(0)).collect(),
    };
    let measured = starts::run(&scene.model, &scene.state, (dt, steps), &base, &plan, |_, _| progress.advance())?;
    let cells = starts::cells(&plan, &measured);
    let interrupted = progress.finish();

    let outer_tolerance = base.step.relative_tolerance;
    let (name, segments) = (scene.name, scene.model.segments.len());
    let report = Report {
        scene: name,
        segments,
        steps,
        steps_done,
        dt_s: dt,
        outer_tolerance,
        reference_status,
        steps_before_contact: first_contact.map_or(steps_done, |step| step - 1),
        contact_tolerance: base.step.contact_tolerance,
        networks: networks(&rows),
        runs,
        starts: cells,
    };
    if args.scene.json {
        say!("{}", serde_json::to_string_pretty(&report)?)?;
    } else if !quiet {
        print_runs(&report)?;
        print_starts(&report, skip)?;
    }
    let failed = report.runs.iter().find(|row| row.status == Status::NonFinite.name());
    Ok(match (failed, interrupted) {
        (Some(row), _) => Outcome::NotFinite(format!("{}, {}", report.scene, row.name)),
        (None, true) => Outcome::Interrupted,
        (None, false) => Outcome::Done,
    })
}

/// Cap on the iterations of a solve on large scenes, some tenths of a second each; CG's own on others.
fn cap(segments: usize) -> Option<u64> {
    (segments > 200).then_some(2_000_000 / segments as u64)
}

fn print_runs(report: &Report) -> Result<()> {
    say!(
        "\nRuns: outer tolerance {:e}, cg to 1e-6 of the right-hand side in its own norm; means: outer iterations a step, linear\n\
         ones in each; medians: us a step; error: root mean square of positions relative to the rods' length, the largest of\n\
         any step, against {} solved to {:e} ({})",
        report.outer_tolerance,
        report.runs.first().map_or("", |row| row.name.split(',').next().unwrap_or("")),
        reference::TOLERANCE,
        report.reference_status
    )?;
    if report.steps_before_contact < report.steps_done {
        say!(
            "Contacts from step {} on, to {:e} of a radius. Errors are those before: after them the smallest difference grows,\n\
             and would tell chaos from accuracy no more.",
            report.steps_before_contact + 1,
            report.contact_tolerance
        )?;
    }
    say_stopped(report.steps_done, report.steps)?;
    let means = |row: &compare::Row| {
        [format!("{:.2}", row.iterations_per_step), format!("{:.1}", row.linear_iterations_per_solve)]
    };
    say!("{}", runs_table(&report.runs, means))
}

/// Says that a table is of some of the steps alone, if it is.
pub(crate) fn say_stopped(done: usize, steps: usize) -> Result<()> {
    if done < steps {
        say!("Stopped after {done} of {steps} steps: what follows is of these alone.")?;
    }
    Ok(())
}

/// The table of ways to simulate a scene, with their outer and linear iterations as `counts` has them.
pub(crate) fn runs_table(runs: &[compare::Row], counts: impl Fn(&compare::Row) -> [String; 2]) -> Table {
    type Stage = (&'static str, fn(&compare::Row) -> f64);
    const STAGES: [Stage; 8] = [
        ("drag", |row| row.drag_us),
        ("predict", |row| row.predict_us),
        ("guess", |row| row.guess_us),
        ("assemble", |row| row.assemble_us),
        ("solve", |row| row.solve_us),
        ("update", |row| row.update_us),
        ("contact", |row| row.contact_us),
        ("total", |row| row.total_us),
    ];
    // What the scene does not have takes no room.
    let is_there = |(_, us): &&Stage| runs.iter().any(|row| us(row) > 0.0);
    let stages: Vec<&Stage> = STAGES.iter().filter(is_there).collect();
    let mut table = Table::new();
    table.load_style(comfy_table::presets::NOTHING);
    let names = stages.iter().map(|(name, _)| *name);
    table.set_header(["way", "outer", "linear"].into_iter().chain(names).chain(["error", "status"]));
    for row in runs {
        let [outer, linear] = counts(row);
        let times = stages.iter().map(|(_, us)| format!("{:.1}", us(row)));
        let status =
            row.given_up.map_or(row.status.to_owned(), |step| format!("{}, given up in step {step}", row.status));
        let first = [row.name.clone(), outer, linear].into_iter();
        table.add_row(first.chain(times).chain([format!("{:.1e}", row.error), status]));
    }
    for column in table.column_iter_mut().skip(1).take(stages.len() + 3) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

fn print_starts(report: &Report, skip: usize) -> Result<()> {
    say!(
        "\nStarts: cg iterations of the first outer iteration of each step relative to a zero start, on the same systems\n\
         for all (the exact motion's), after the first {skip} steps; tolerances relative to the right-hand side"
    )?;
    let mut table = Table::new();
    table.load_style(comfy_table::presets::NOTHING);
    let mut header = vec!["guess".to_owned()];
    for preconditioner in PRECONDITIONERS {
        header.extend(TOLERANCES.map(|tolerance| format!("{preconditioner} {tolerance:e}")));
    }
    table.set_header(header);
    let columns = PRECONDITIONERS.len() * TOLERANCES.len();
    for (k, row) in report.starts.chunks(columns).enumerate() {
        let Some(first) = row.first() else { continue };
        if k == 0 {
            let counts = row.iter().map(|cell| counted(cell.iterations, 0));
            table.add_row(std::iter::once(format!("{}, iterations", first.guess)).chain(counts));
        }
        let ratios = row.iter().map(|cell| counted(cell.ratio, 2));
        table.add_row(std::iter::once(first.guess.clone()).chain(ratios));
    }
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    say!("{table}")?;
    say_dropped(report.starts.iter().map(|cell| (cell.guess.as_str(), cell.dropped, cell.solves)))
}

/// A number, or a dash where nothing was counted.
fn counted(value: f64, digits: usize) -> String {
    if value.is_finite() { format!("{value:.digits$}") } else { "-".to_owned() }
}

//! The stability report: stiff and extreme cases in all formulations, and learned guesses far outside of their training.

use anyhow::{Context as _, Result};
use catalogue::rows;
use dataset::Scenario;
use evaluation::stress::{self, Case, CaseRun};
use graph::planar_normal;
use report::{Block, Cell, Conditions, Section as PageSection, Table};
use serde::{Deserialize, Serialize};
use solver::formulation::Formulation;
use solver::guess::GuessKind;
use solver::linear::cg::CgParams;
use solver::linear::precondition::PreconditionerKind;
use solver::linear::solvers::SolverKind;
use solver::simulation::{GuessFactory, Settings};

use crate::cells::Section;
use crate::context::Context;
use crate::library::Learned;
use crate::show::{columns, number};

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Key {
    case: String,
    formulation: String,
    /// Name of the start; of a learned one, "rod" or "helix" first.
    start: String,
    solver: String,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Value {
    row: CaseRun,
}

/// The section, with its cases.
pub(crate) struct Stability {
    cases: Vec<Case>,
}

impl Default for Stability {
    fn default() -> Self {
        Self { cases: stress::cases() }
    }
}

const DIRECT: &str = "direct";
const CG: &str = "cg block-jacobi to 1e-6";
const ZERO: &str = "zero";
/// Largest scene on which conjugate gradients from learned guesses are tried.
const LARGEST: usize = 1000;

impl Section for Stability {
    type Key = Key;
    type Value = Value;
    const ID: &'static str = "stability";

    fn keys(&self, context: &Context) -> Result<Vec<Key>> {
        let mut keys = Vec::new();
        let every = context.size.pick(8, 1);
        for case in self.cases.iter().step_by(every) {
            let mut add = |formulation: Formulation, solver: &str, start: &str| {
                let (case, formulation) = (case.name.clone(), formulation.name().to_owned());
                keys.push(Key { case, formulation, solver: solver.to_owned(), start: start.to_owned() });
            };
            for &formulation in case.formulations {
                add(formulation, DIRECT, ZERO);
            }
            let is_small = case.model.segments.len() <= LARGEST && case.model.contacts.is_empty();
            if !is_small {
                continue;
            }
            add(Formulation::Xpbd, CG, ZERO);
            for name in ["gn", "gn-best"] {
                add(Formulation::Xpbd, CG, name);
            }
            if case.formulations.contains(&Formulation::Newton) {
                add(Formulation::Newton, DIRECT, GuessKind::StepQuadratic.name());
                add(Formulation::Newton, DIRECT, "gn-step");
            }
        }
        Ok(keys)
    }

    fn seconds(&self, key: &Key) -> f64 {
        if key.solver == CG { 0.5 } else { 0.2 }
    }

    fn measure(&mut self, context: &Context, key: &Key, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Value>> {
        let case = self.cases.iter().find(|case| case.name == key.case).context("a case that there is not")?;
        let mut settings = stress::settings(key.formulation.parse().map_err(anyhow::Error::msg)?);
        if key.solver == CG {
            let cg = CgParams { preconditioner: PreconditionerKind::BlockJacobi, ..CgParams::default() };
            settings.solver = SolverKind::Cg(cg);
        }
        let row = run(context, case, &settings, &key.start)?;
        Ok(go_on().then_some(Value { row }))
    }

    fn show(&self, context: &Context, cells: &[(&Key, &Value)]) -> Result<PageSection> {
        let conditions = tolerances(context.conditions("wall time of all steps"));
        let is_plain = |key: &Key| key.solver == DIRECT && key.start == ZERO;
        let plain: Vec<_> = cells.iter().filter(|(key, _)| is_plain(key)).map(|(_, value)| &value.row).collect();
        let plain = cases_table(&plain, conditions.clone());
        let guessed = cells.iter().filter(|(key, _)| !is_plain(key));
        let learned = Table {
            id: "stability-guesses".to_owned(),
            title: "Learned guesses far outside of their training".to_owned(),
            caption: "The same cases from learned guesses, beside the same solver without them. A bad guess must cost time at \
                      worst: status, energy and length must be those of the row without it."
                .to_owned(),
            columns: columns(&[&["case", "formulation", "solver", "start", "status"], &NUMBERS[..]].concat()),
            rows: guessed.map(|(key, value)| row(&[&key.case, &key.formulation, &key.solver, &key.start], &value.row)).collect(),
            conditions,
        };
        let blocks = vec![Block::Paragraph(verdict(cells)), Block::Table(plain), Block::Table(learned)];
        Ok(PageSection { id: Self::ID.to_owned(), title: "Stability".to_owned(), blocks })
    }
}

/// Conditions with the table's tolerances.
pub(crate) fn tolerances(conditions: Conditions) -> Conditions {
    let tolerances = format!("{:e} relative, {:e} absolute", stress::RELATIVE_TOLERANCE, stress::ABSOLUTE_TOLERANCE);
    conditions.with("tolerance", tolerances)
}

/// The table of cases that are solved directly.
pub(crate) fn cases_table(runs: &[&CaseRun], conditions: Conditions) -> Table {
    Table {
        id: "stability-cases".to_owned(),
        title: "Stiff and extreme cases".to_owned(),
        caption: "Energy: largest rise of the total energy above its start, relative to the energy at stake; none in wind, \
                  which does work. Length: largest relative change. Stretch in segment lengths, bend in radians. Depth: \
                  deepest penetration over the radius."
            .to_owned(),
        columns: columns(&[&["case", "formulation", "status"], &NUMBERS[..]].concat()),
        rows: runs.iter().map(|run| row(&[&run.case, &run.formulation], run)).collect(),
        conditions,
    }
}

/// Runs a case from a start by name; rods' networks, or helices' where the case is bent or twisted at rest.
fn run(context: &Context, case: &Case, settings: &Settings, start: &str) -> Result<CaseRun> {
    if start == ZERO {
        return Ok(stress::run(case, settings, None)?);
    }
    if let Ok(kind) = start.parse::<GuessKind>() {
        let build = |model: &_, members: &_, topology: &_| kind.build(model, members, topology);
        return Ok(stress::run(case, settings, Some(&build))?);
    }
    let is_straight = case.model.joints.iter().all(|joint| joint.rest_darboux.norm() * joint.length < 1e-9);
    let guesses =
        context.library.guesses(if is_straight { Scenario::Rod } else { Scenario::Helix }, Learned::Networks)?;
    let plane = planar_normal(&case.model, &case.state);
    let rows = rows(&guesses, false);
    let guess = rows.iter().find(|row| row.name == start).context("a guess that there is not")?;
    Ok(stress::run(case, settings, Some(&guess.factory(plane) as GuessFactory<'_>))?)
}

const NUMBERS: [&str; 8] =
    ["#iterations a step", "#halved", "#energy rise", "#length", "#stretch", "#bend [rad]", "#depth", "#time [s]"];

fn row(names: &[&str], row: &CaseRun) -> Vec<Cell> {
    let optional = |value: Option<f64>| value.map_or(Cell::muted("-"), |value| number(value).into());
    let status = if is_good(row) { Cell::from(row.status.as_str()) } else { Cell::strong(row.status.as_str()) };
    let numbers = [
        number(row.iterations_per_step).into(),
        row.retries.to_string().into(),
        optional(row.energy_rise),
        number(row.length_drift).into(),
        number(row.worst_stretch).into(),
        number(row.worst_bend).into(),
        optional(row.deepest_penetration),
        number(row.seconds).into(),
    ];
    names.iter().map(|&name| Cell::from(name)).chain([status]).chain(numbers).collect()
}

/// Whether all steps converged.
fn is_good(row: &CaseRun) -> bool {
    row.finite && row.status.starts_with("converged")
}

/// The tables in words.
fn verdict(cells: &[(&Key, &Value)]) -> String {
    // Good runs and all, of each formulation, solver and start in their order.
    let mut counts: Vec<([&str; 3], [usize; 2])> = Vec::new();
    // The same solver from zero stands where the network's guess does not.
    let (mut learned, mut fallen) = (0, 0);
    for (key, value) in cells {
        let (way, good) = ([&key.formulation, &key.solver, &key.start].map(String::as_str), is_good(&value.row));
        let place = counts.iter().position(|(known, _)| *known == way).unwrap_or_else(|| {
            counts.push((way, [0; 2]));
            counts.len() - 1
        });
        counts[place].1[0] += usize::from(good);
        counts[place].1[1] += 1;
        if key.start.starts_with("gn") {
            let base = Key { start: ZERO.to_owned(), ..(*key).clone() };
            let stands = cells.iter().any(|(other, value)| **other == base && is_good(&value.row));
            learned += 1;
            fallen += usize::from(stands && !good);
        }
    }
    counts.sort_by_key(|([formulation, solver, start], _)| {
        (Formulation::ALL.iter().position(|known| known.name() == *formulation), *solver != DIRECT, *start != ZERO)
    });
    let words = counts.into_iter().map(|([formulation, solver, start], [good, all])| {
        format!("{formulation}, {solver}, from {start}: {good} of {all}")
    });
    format!(
        "Cases that converge in every step: {}. The paper's formulation is xpbd, the default xpbd-geometric. Of {learned} runs \
         from a learned guess {fallen} do not where the same solver does from zero.",
        words.collect::<Vec<_>>().join("; ")
    )
}

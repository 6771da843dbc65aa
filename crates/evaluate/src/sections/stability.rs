//! The stability report: stiff and extreme cases in all formulations, and learned guesses far outside of their training.

mod key;
pub(crate) mod show;

use anyhow::{Context as _, Result};
use catalogue::rows;
use cosserat::guess::GuessKind;
use cosserat::simulation::{CgParams, Formulation, PreconditionerKind, Settings, SolverKind};
use dataset::Scenario;
use evaluation::stress::{self, Case, CaseRun};
use graph::planar_normal;
use key::{DIRECT, StabilityKey, Value, ZERO};

use crate::cells::Section;
use crate::context::Context;
use crate::library::Learned;

/// The section, with its cases.
pub(crate) struct Stability {
    cases: Vec<Case>,
}

impl Default for Stability {
    fn default() -> Self {
        Self { cases: stress::cases() }
    }
}

const CG: &str = "cg block-jacobi to 1e-6";
/// Largest scene on which conjugate gradients from learned guesses are tried.
const LARGEST: usize = 1000;

impl Section for Stability {
    type Key = StabilityKey;
    type Value = Value;
    const ID: &'static str = "stability";

    fn keys(&self, context: &Context) -> Result<Vec<StabilityKey>> {
        let mut keys = Vec::new();
        for case in self.cases.iter().step_by(context.size.pick(8, 1)) {
            let mut add = |formulation: Formulation, solver: &str, start: &str| {
                let of = [&case.name, formulation.name(), solver, start];
                let [case, formulation, solver, start] = of.map(str::to_owned);
                keys.push(StabilityKey { case, formulation, start, solver });
            };
            for &formulation in case.formulations {
                add(formulation, DIRECT, ZERO);
            }
            if case.model.segments.len() > LARGEST || !case.model.contacts.is_empty() {
                continue;
            }
            for start in [ZERO, "gn", "gn-best"] {
                add(Formulation::Xpbd, CG, start);
            }
            if case.formulations.contains(&Formulation::Newton) {
                add(Formulation::Newton, DIRECT, GuessKind::StepQuadratic.name());
                add(Formulation::Newton, DIRECT, "gn-step");
            }
        }
        Ok(keys)
    }

    fn seconds(&self, key: &StabilityKey) -> f64 {
        if key.solver == CG { 0.5 } else { 0.2 }
    }

    fn measure(
        &mut self,
        context: &Context,
        key: &StabilityKey,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Option<Value>> {
        let case = self.cases.iter().find(|case| case.name == key.case).context("a case that there is not")?;
        let mut settings = stress::settings(key.formulation.parse().map_err(anyhow::Error::msg)?);
        if key.solver == CG {
            let cg = CgParams { preconditioner: PreconditionerKind::BlockJacobi, ..CgParams::default() };
            settings.solver = SolverKind::Cg(cg);
        }
        let row = run(context, case, &settings, &key.start)?;
        Ok(go_on().then_some(Value { row }))
    }

    fn show(&self, context: &Context, cells: &[(&StabilityKey, &Value)]) -> Result<report::Section> {
        Ok(show::section(context, cells))
    }
}

/// Runs a case from a start by name; rods' networks, or helices' where the case is bent or twisted at rest.
fn run(context: &Context, case: &Case, settings: &Settings, start: &str) -> Result<CaseRun> {
    if let Ok(kind) = start.parse::<GuessKind>() {
        let build = |model: &_, members: &_, topology: &_| kind.build(model, members, topology);
        return Ok(stress::run(case, settings, Some(&build))?);
    }
    let is_straight = case.model.joints.iter().all(|joint| joint.rest_darboux.norm() * joint.length < 1e-9);
    let scenario = if is_straight { Scenario::Rod } else { Scenario::Helix };
    let guesses = context.library.guesses(scenario, Learned::Networks)?;
    let rows = rows(&guesses, false);
    let guess = rows.iter().find(|row| row.name == start).context("a guess that there is not")?;
    Ok(stress::run(case, settings, Some(&guess.factory(planar_normal(&case.model, &case.state))))?)
}

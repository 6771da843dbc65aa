//! Error against run time over the time step: what a user gets from each formulation and integrator.

mod key;
mod show;

use anyhow::{Context as _, Result};
use cosserat::simulation::{Formulation, Integrator};
use evaluation::time_step::cases::{Case, cases};
use evaluation::time_step::{Problem, run, settings};
use key::{TimeStepKey, Value};

use crate::cells::Section;
use crate::context::{Context, Size};

/// Builtin scenes without contacts, with the steps of a run; then those with. Rods that fall onto each other are run to just
/// beyond their first contact, which takes errors apart.
const SCENES: [(&str, usize); 15] = [
    ("bending-rod", 96),
    ("helix", 32),
    ("slack-rod", 64),
    ("stiff-rod", 96),
    ("tip-mass", 96),
    ("free-spin", 96),
    ("tree-10", 64),
    ("tree-70", 32),
    ("crane", 96),
    ("two-arms", 96),
    ("drum", 96),
    ("suture", 96),
    ("helix-on-plane", 32),
    ("net-on-sphere", 32),
    ("hair", 32),
];
/// Steps for one of the scene's.
const SUBSTEPS: [f64; 6] = [0.25, 0.5, 1.0, 2.0, 4.0, 8.0];

/// The section, with the scene that is being measured.
#[derive(Default)]
pub(crate) struct TimeStep {
    current: Option<(String, Problem)>,
}

/// The case of this name.
fn case(name: &str) -> Option<Case> {
    cases().into_iter().find(|case| case.name == name)
}

impl Section for TimeStep {
    type Key = TimeStepKey;
    type Value = Value;
    const ID: &'static str = "time-step";

    fn keys(&self, context: &Context) -> Result<Vec<TimeStepKey>> {
        let is_full = context.size == Size::Full;
        let cases = cases().into_iter().filter(|case| is_full || !case.is_long).map(|case| {
            let substeps = if case.is_long { 4 } else { SUBSTEPS.len() };
            (case.name, None, substeps, if case.is_long { 1 } else { 3 })
        });
        let scenes = SCENES.into_iter().take(if is_full { SCENES.len() } else { 2 });
        let scenes = scenes.map(|(name, steps)| (name, Some(steps), SUBSTEPS.len(), 3));
        let mut keys = Vec::new();
        for (scene, steps, count, repetitions) in cases.chain(scenes) {
            let substeps = SUBSTEPS[..context.size.pick(count.min(3), count)].to_vec();
            for formulation in Formulation::ALL {
                for integrator in Integrator::ALL {
                    keys.push(TimeStepKey {
                        scene: scene.to_owned(),
                        steps,
                        formulation: formulation.name().to_owned(),
                        integrator: integrator.name().to_owned(),
                        substeps: substeps.clone(),
                        repetitions: context.size.pick(1, repetitions),
                    });
                }
            }
        }
        Ok(keys)
    }

    fn go_together(key: &TimeStepKey, next: &TimeStepKey) -> bool {
        key.scene == next.scene
    }

    fn seconds(&self, key: &TimeStepKey) -> f64 {
        let steps = key.steps.unwrap_or(3000) as f64 * key.substeps.iter().sum::<f64>();
        let a_step = if ["hair", "net-on-sphere", "tree-70"].contains(&key.scene.as_str()) { 1e-2 } else { 2e-4 };
        a_step * steps * key.repetitions as f64
    }

    fn measure(&mut self, _: &Context, key: &TimeStepKey, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Value>> {
        let case = case(&key.scene);
        if self.current.as_ref().is_none_or(|(scene, _)| *scene != key.scene) {
            let problem = match (&case, key.steps) {
                (Some(case), _) => Some(Problem::theory(case)?),
                (None, Some(steps)) => Problem::refined(&key.scene, steps, go_on)?,
                (None, None) => None,
            };
            let Some(problem) = problem else { return Ok(None) };
            self.current = Some((key.scene.clone(), problem));
        }
        let (_, problem) = self.current.as_ref().context("no scene")?;
        let [formulation, integrator] = [&key.formulation, &key.integrator];
        let settings =
            settings(formulation.parse().map_err(anyhow::Error::msg)?, integrator.parse().map_err(anyhow::Error::msg)?);
        let mut points = Vec::new();
        for &substeps in &key.substeps {
            let Some(point) = run(problem, &settings, substeps, key.repetitions, go_on)? else { return Ok(None) };
            points.push(point);
        }
        let right = case.map_or("a run with 32 times as many steps, to a tolerance of 1e-9", |case| case.right);
        Ok(Some(Value {
            errors: problem.errors.iter().map(|&name| name.to_owned()).collect(),
            right: right.to_owned(),
            floor: problem.floor.clone(),
            points,
        }))
    }

    fn show(&self, context: &Context, cells: &[(&TimeStepKey, &Value)]) -> Result<report::Section> {
        Ok(show::section(context, cells))
    }
}

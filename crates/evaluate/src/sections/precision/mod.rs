//! Error against run time: every scene in every way.

mod key;
mod sheet;
mod show;
mod tables;

use std::num::NonZeroUsize;
use std::rc::Rc;

use anyhow::{Context as _, Result};
use cosserat::scene::{self, Scene};
use cosserat::simulation::{Formulation, SolverKind};
use evaluation::precision::{Budget, Level, Outer, Problem, Way, run_way};
use key::{PrecisionKey, Value};

use crate::cells::Section;
use crate::context::{Context, Size};
use crate::library::{Guesses, Learned};
use crate::ways::{kinds, ways};

/// Each scene, from the paper's two rods to its trees, with the steps of a quick report and of a full one, and how finely
/// the converged reference cuts segments, coarsest first. Helices leave the range in which finer segments agree after 40
/// steps; what touches is run just beyond its first contact, which takes errors apart.
const COURSES: [(&str, [usize; 2], &[usize]); 11] = [
    ("bending-rod", [50, 100], &[1, 2, 4, 8]),
    ("helix", [40, 40], &[1, 2, 4, 8]),
    ("helix-on-plane", [12, 15], &[1, 2]),
    ("two-rods", [40, 40], &[1, 2, 4]),
    ("knot", [40, 100], &[1, 2]),
    ("tree-10", [10, 40], &[1, 2, 4]),
    ("tree-20", [5, 40], &[1, 2, 4]),
    ("tree-40", [3, 20], &[1, 2]),
    ("tree-70", [3, 20], &[1, 2]),
    ("net-on-sphere", [12, 20], &[1, 2]),
    ("hair", [4, 30], &[1, 2]),
];
/// Scenes that a quick report leaves out.
const FULL_ALONE: [&str; 2] = ["tree-20", "tree-70"];

/// The section, with the scene that is being measured.
#[derive(Default)]
pub(crate) struct Precision {
    current: Option<Current>,
}

struct Current {
    guesses: Rc<Guesses>,
    problem: Problem,
}

impl Section for Precision {
    type Key = PrecisionKey;
    type Value = Value;
    const ID: &'static str = "precision";

    fn keys(&self, context: &Context) -> Result<Vec<PrecisionKey>> {
        let (size, mut keys) = (context.size, Vec::new());
        let [quick, full] = [(0.1, 2), (2.0, 5)].map(|(seconds, repetitions)| Budget { seconds, repetitions });
        for (name, steps, factors) in COURSES {
            if size == Size::Quick && FULL_ALONE.contains(&name) {
                continue;
            }
            let scene = scene::builtin(name)?;
            let guesses = context.library.for_scene(&scene, learned(size, &scene))?;
            keys.extend(ways(&scene, &guesses, size).into_iter().map(|way| PrecisionKey {
                scene: name.to_owned(),
                steps: size.pick(steps[0], steps[1]),
                factors: size.pick(&[][..], factors).to_vec(),
                levels: levels(&way, size),
                budget: size.pick(quick, full),
                way: way.name,
            }));
        }
        Ok(keys)
    }

    fn go_together(key: &PrecisionKey, next: &PrecisionKey) -> bool {
        key.scene == next.scene
    }

    fn seconds(&self, key: &PrecisionKey) -> f64 {
        let share = if key.scene.contains("rod") || key.scene == "helix" { 0.1 } else { 0.5 };
        share * key.budget.seconds * key.levels.len() as f64
    }

    fn measure(
        &mut self,
        context: &Context,
        key: &PrecisionKey,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Option<Value>> {
        if self.current.as_ref().is_none_or(|current| current.problem.scene.name != key.scene) {
            self.current = current(context, key, go_on)?;
        }
        let Some(Current { guesses, problem }) = &self.current else { return Ok(None) };
        let mut ways = ways(&problem.scene, guesses, context.size).into_iter();
        let way = ways.find(|way| way.name == key.way).context("a way that the scene does not have")?;
        let Some(curve) = run_way(problem, &way, &key.levels, &key.budget, go_on)? else { return Ok(None) };
        let floor = problem.converged.as_ref().and_then(|converged| converged.error().iter().copied().reduce(f64::max));
        let exact = problem.exact(way.settings.step.formulation);
        let reference = exact.map_or("none", |exact| exact.status.name()).to_owned();
        Ok(Some(Value { curve, floor, reference }))
    }

    fn show(&self, context: &Context, cells: &[(&PrecisionKey, &Value)]) -> Result<report::Section> {
        Ok(show::section(context, cells))
    }
}

/// The learned guesses of a scene: nearest neighbours in small ones alone, because in others a prediction takes a second.
fn learned(size: Size, scene: &Scene) -> Learned {
    let has_neighbours = size == Size::Full && scene.model.segments.len() <= 120;
    if has_neighbours { Learned::All } else { Learned::Networks }
}

/// Levels of accuracy of a way.
fn levels(way: &Way<'_>, size: Size) -> Vec<Level> {
    if way.kind == kinds::END_TO_END {
        let predictions = [1, 2, 4, 8].map(|count| Level::new(Outer::Iterations(count)));
        return predictions[..size.pick(2, 4)].to_vec();
    }
    let tolerances = [1e-2, 1e-4, 1e-6, 1e-8];
    let mut levels = Level::of_tolerances(way.settings.solver, &tolerances[..size.pick(3, 4)]);
    // In a second sweep steps are divided, against the converged reference.
    if size == Size::Full && way.settings.solver == SolverKind::Direct {
        levels.extend([2, 4, 8].map(|substeps| Level { substeps, ..Level::new(Outer::Tolerance(1e-4)) }));
    }
    levels
}

/// Simulates the references of a scene.
fn current(context: &Context, key: &PrecisionKey, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Current>> {
    let scene = scene::builtin(&key.scene)?;
    let guesses = context.library.for_scene(&scene, learned(context.size, &scene))?;
    let refined = |&factor: &usize| {
        let parts = NonZeroUsize::new(factor).context("a segment in no parts")?;
        Ok(scene::builtin_refined(&key.scene, parts)?)
    };
    let refined = key.factors.iter().map(refined).collect::<Result<Vec<_>>>()?;
    let problem = Problem::new(scene, key.steps, &Formulation::ALL, &refined, go_on)?;
    Ok(problem.map(|problem| Current { guesses, problem }))
}

//! Error against run time: every scene in every way.

mod show;
mod tables;

use std::num::NonZeroUsize;
use std::rc::Rc;

use anyhow::{Context as _, Result};
use evaluation::precision::{Budget, Converged, Curve, Level, Outer, Problem, Refined, run_way};
use scene::Scene;
use serde::{Deserialize, Serialize};
use solver::formulation::Formulation;
use solver::linear::solvers::SolverKind;

use crate::cells::Section;
use crate::context::{Context, Size};
use crate::library::{Guesses, Learned};
use crate::ways::{Spec, Ways, kinds};

/// A scene, and how long it is run.
struct Course {
    scene: &'static str,
    /// Steps of a quick report and of a full one.
    steps: [usize; 2],
    /// How finely the converged reference cuts segments, coarsest first; none where contacts begin at once.
    factors: &'static [usize],
}

/// Each scene, from the paper's two rods to its trees. Helices leave the range in which finer segments agree after 40
/// steps; what touches is run just beyond its first contact, which takes errors apart.
const COURSES: [Course; 11] = [
    Course { scene: "bending-rod", steps: [50, 100], factors: &[1, 2, 4, 8] },
    Course { scene: "helix", steps: [40, 40], factors: &[1, 2, 4, 8] },
    Course { scene: "helix-on-plane", steps: [12, 15], factors: &[1, 2] },
    Course { scene: "two-rods", steps: [40, 40], factors: &[1, 2, 4] },
    Course { scene: "knot", steps: [40, 100], factors: &[1, 2] },
    Course { scene: "tree-10", steps: [10, 40], factors: &[1, 2, 4] },
    Course { scene: "tree-20", steps: [5, 40], factors: &[1, 2, 4] },
    Course { scene: "tree-40", steps: [3, 20], factors: &[1, 2] },
    Course { scene: "tree-70", steps: [3, 20], factors: &[1, 2] },
    Course { scene: "net-on-sphere", steps: [12, 20], factors: &[1, 2] },
    Course { scene: "hair", steps: [4, 30], factors: &[1, 2] },
];

/// Outer tolerances.
const TOLERANCES: [f64; 4] = [1e-2, 1e-4, 1e-6, 1e-8];

/// Into how many steps each is divided in a second sweep of the ways that solve directly, against the converged reference.
const SUBSTEPS: [usize; 3] = [2, 4, 8];

/// Outer tolerance of divided steps.
const SUBSTEPS_TOLERANCE: f64 = 1e-4;

/// Predictions a step of the end-to-end ways.
const PREDICTIONS: [usize; 4] = [1, 2, 4, 8];

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Key {
    scene: String,
    way: String,
    steps: usize,
    factors: Vec<usize>,
    levels: Vec<Level>,
    budget: Budget,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Value {
    curve: Curve,
    /// The converged reference's own error, the largest of all samples; `None` where there is none.
    floor: Option<f64>,
    /// Worst status of the exact reference of the way's formulation.
    reference: String,
}

/// The section, with the scene that is being measured.
#[derive(Default)]
pub(crate) struct Precision {
    current: Option<Current>,
}

struct Current {
    scene: Scene,
    guesses: Rc<Guesses>,
    problem: Problem,
}

impl Section for Precision {
    type Key = Key;
    type Value = Value;
    const ID: &'static str = "precision";

    fn keys(&self, context: &Context) -> Result<Vec<Key>> {
        let mut keys = Vec::new();
        let is_quick = |course: &&Course| context.size == Size::Full || !["tree-20", "tree-70"].contains(&course.scene);
        for course in COURSES.iter().filter(is_quick) {
            let scene = scene::builtin(course.scene)?;
            let guesses = context.library.for_scene(&scene, learned(context.size, &scene))?;
            let [quick, full] = course.steps;
            for spec in &Ways::new(&scene, &guesses, context.size).specs {
                keys.push(Key {
                    scene: course.scene.to_owned(),
                    way: spec.name.clone(),
                    steps: context.size.pick(quick, full),
                    factors: context.size.pick(&[][..], course.factors).to_vec(),
                    levels: levels(spec, context.size),
                    budget: context
                        .size
                        .pick(Budget { seconds: 0.1, repetitions: 2 }, Budget { seconds: 2.0, repetitions: 5 }),
                });
            }
        }
        Ok(keys)
    }

    fn seconds(&self, key: &Key) -> f64 {
        let share = if key.scene.contains("rod") || key.scene == "helix" { 0.1 } else { 0.5 };
        share * key.budget.seconds * key.levels.len() as f64
    }

    fn measure(&mut self, context: &Context, key: &Key, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Value>> {
        if self.current.as_ref().is_none_or(|current| current.problem.scene != key.scene) {
            self.current = current(context, key, go_on)?;
        }
        let Some(Current { scene, guesses, problem }) = &self.current else { return Ok(None) };
        let ways = Ways::new(scene, guesses, context.size);
        let spec = ways.specs.iter().find(|spec| spec.name == key.way).context("a way that the scene does not have")?;
        let curve = ways.with(spec, |way| run_way(problem, way, &key.levels, &key.budget, go_on));
        let Some(curve) = curve.context("a guess that makes no predictions")?? else { return Ok(None) };
        let floor = problem.converged.as_ref().and_then(|converged| converged.error().iter().copied().reduce(f64::max));
        let exact = problem.exact(spec.settings.step.formulation);
        let reference = exact.map_or("none", |exact| exact.status.name()).to_owned();
        Ok(Some(Value { curve, floor, reference }))
    }

    fn show(&self, context: &Context, cells: &[(&Key, &Value)]) -> Result<report::Section> {
        Ok(show::section(context, cells))
    }
}

/// Segments of the largest scene for nearest neighbours: there a prediction takes a second already.
const LARGEST_FOR_NEIGHBOURS: usize = 120;

/// The learned guesses of a scene.
fn learned(size: Size, scene: &Scene) -> Learned {
    let has_neighbours = size == Size::Full && scene.model.segments.len() <= LARGEST_FOR_NEIGHBOURS;
    if has_neighbours { Learned::All } else { Learned::Networks }
}

/// Levels of accuracy of a way.
fn levels(spec: &Spec, size: Size) -> Vec<Level> {
    if spec.kind == kinds::END_TO_END {
        let level = |&count: &usize| Level::new(Outer::Iterations(count));
        return PREDICTIONS[..size.pick(2, 4)].iter().map(level).collect();
    }
    let mut levels = Level::of_tolerances(spec.settings.solver, &TOLERANCES[..size.pick(3, 4)]);
    if size == Size::Full && spec.settings.solver == SolverKind::Direct {
        let outer = Outer::Tolerance(SUBSTEPS_TOLERANCE);
        levels.extend(SUBSTEPS.map(|substeps| Level { substeps, ..Level::new(outer) }));
    }
    levels
}

/// Simulates the references of a scene.
fn current(context: &Context, key: &Key, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Current>> {
    let scene = scene::builtin(&key.scene)?;
    let guesses = context.library.for_scene(&scene, learned(context.size, &scene))?;
    let parts = (scene.model.clone(), scene.state.clone());
    let span = (scene.run.dt, key.steps);
    let Some(mut problem) = Problem::new(&key.scene, parts, span, &Formulation::ALL, &mut *go_on)? else {
        return Ok(None);
    };
    if !key.factors.is_empty() {
        let mut refined = Vec::new();
        for &factor in &key.factors {
            let scene::Scene { model, state, .. } =
                scene::builtin_refined(&key.scene, NonZeroUsize::new(factor).unwrap_or(NonZeroUsize::MIN))?;
            refined.push(Refined { factor, model, state });
        }
        let Some(converged) = Converged::new(&problem, &refined, go_on)? else { return Ok(None) };
        problem.converged = Some(converged);
    }
    Ok(Some(Current { scene, guesses, problem }))
}

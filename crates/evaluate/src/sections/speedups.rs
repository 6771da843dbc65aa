//! The paper's total speed-ups: collisions, the knot, trees in wind.

use std::collections::BTreeMap;

use anyhow::Result;
use dataset::Scenario;
use evaluation::compare::Entry;
use evaluation::paper::speedup::{self, Run, Speedup, speedups};
use evaluation::paper::{DIRECT, FISCHER, ZERO, break_even};
use report::{Block, Cell, Column, Section as PageSection, Table};
use scene::Scene;
use scene::sampling::{Parameters, Tree};
use serde::{Deserialize, Serialize};
use solver::guess::GuessKind;
use solver::linear::precondition::PreconditionerKind;
use solver::simulation::GuessFactory;

use crate::cells::Section;
use crate::context::Context;
use crate::library::Learned;
use crate::sections::paper::{SEED, motion, solver, with_guesses};
use crate::show::{ALL_STAGES, number, per_cent, spread};
use crate::ways::cap;

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Key {
    /// Of trees, "trees-" and the number of rods.
    scene: String,
    /// Repetition; of trees, the topology.
    index: u64,
    steps: usize,
    /// Of all, for times: see [`speedup::measure`].
    repeats: usize,
    preconditioner: String,
    tolerance: f64,
    seed: u64,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Value {
    run: Run,
}

pub(crate) struct Speedups;

/// The paper's scenes, what it says of each, and for how many steps they are run.
const SCENES: [(&str, &str, [usize; 2]); 3] =
    [("helix-on-plane", "about 10 %", [14, 30]), ("two-rods", "about 6 %", [20, 100]), ("knot", "10.4 %", [20, 100])];

/// Rods of the trees, and what the paper says.
const TREES: [(usize, &str); 4] = [(10, "17.0 %"), (20, "15.8 %"), (40, "13.0 %"), (70, "11.1 %")];

/// Conjugate gradients as the paper may have run them, and as one would run them.
const SOLVERS: [(PreconditionerKind, f64); 2] =
    [(PreconditionerKind::Raw, 1e-4), (PreconditionerKind::BlockJacobi, 1e-4)];

impl Section for Speedups {
    type Key = Key;
    type Value = Value;
    const ID: &'static str = "speedups";

    fn keys(&self, context: &Context) -> Result<Vec<Key>> {
        let size = context.size;
        let mut keys = Vec::new();
        for (preconditioner, tolerance) in SOLVERS {
            let key = |scene: String, index: u64, steps: usize, repeats: usize| {
                let preconditioner = preconditioner.to_string();
                Key { scene, index, steps, repeats, preconditioner, tolerance, seed: SEED }
            };
            let repeats = size.pick(1, 2);
            for (scene, _, [quick, full]) in SCENES {
                let steps = size.pick(quick, full);
                keys.extend((0..size.pick(1, 5)).map(|index| key(scene.to_owned(), index, steps, repeats)));
            }
            // In raw units they run out of iterations in the first step.
            let (steps, repeats) = if preconditioner == PreconditionerKind::Raw { (5, repeats) } else { (20, 1) };
            for (rods, _) in TREES {
                let topologies = size.pick(1, speedup::TOPOLOGIES as u64);
                let steps = size.pick(1, steps);
                keys.extend((0..topologies).map(|index| key(format!("trees-{rods}"), index, steps, repeats)));
            }
        }
        Ok(keys)
    }

    fn seconds(&self, key: &Key) -> f64 {
        let a_step = match key.scene.as_str() {
            "trees-10" => 0.1,
            "trees-20" => 0.2,
            "trees-40" => 0.4,
            "trees-70" => 0.8,
            _ => 0.05,
        };
        a_step * (key.steps * key.repeats) as f64
    }

    fn measure(&mut self, context: &Context, key: &Key, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Value>> {
        let scene = scene_of(key)?;
        let guesses = context.library.for_scene(&scene, Learned::Networks)?;
        let mut solver = solver(key.preconditioner.parse().map_err(anyhow::Error::msg)?, key.tolerance);
        solver.cg.max_iterations = cap(&scene);
        // Where conjugate gradients run out, halved steps would take their time to show the same.
        solver.step.max_halvings = 0;
        let fischer = GuessKind::Fischer(8);
        let build = |model: &_, members: &_, topology: &_| fischer.build(model, members, topology);
        let run = with_guesses(&scene, &guesses, |named| {
            let mut starts: Vec<(&str, Option<GuessFactory<'_>>)> = vec![(ZERO, None)];
            starts.extend(named.iter().map(|(name, factory)| (name.as_str(), Some(*factory))));
            starts.push((FISCHER, Some(&build)));
            let settings = solver.settings();
            let entry = |(name, guess): (&str, _)| Entry { name: name.to_owned(), settings, guess };
            let mut entries: Vec<Entry<'_>> = starts.into_iter().map(entry).collect();
            entries.push(Entry { name: DIRECT.to_owned(), settings: solver.direct(), guess: None });
            speedup::measure(&motion(&scene, key.steps), &entries, key.repeats, go_on)
        })?;
        Ok(run.map(|run| Value { run }))
    }

    fn show(&self, context: &Context, cells: &[(&Key, &Value)]) -> Result<PageSection> {
        let mut blocks = vec![Block::Paragraph(INTRODUCTION.to_owned())];
        for (preconditioner, tolerance) in SOLVERS {
            let mut rows = Vec::new();
            for (scene, paper) in scenes() {
                let runs = runs_of(cells, &scene, preconditioner);
                rows.extend(speedups(&runs).iter().map(|way| row(&scene, &paper, &runs, way)));
            }
            let runs = "scenes: 5 runs of the same, 100 steps (helix-on-plane 30); trees: 30 topologies of each size, 20 \
                        steps (5 in raw units); medians and quartiles";
            blocks.push(Block::Table(Table {
                id: format!("speedups-{preconditioner}"),
                title: format!("Total speed-ups over {preconditioner} conjugate gradients from zero"),
                caption:
                    "Share of the whole simulation's time that each way saves, to the same tolerances; below zero it \
                          loses. The error is the positions' against a tight reference at the same time step; after \
                          contacts it tells chaos."
                        .to_owned(),
                columns: vec![
                    Column::text("scene"),
                    Column::text("paper, from its network"),
                    Column::text("way"),
                    Column::number("total saved"),
                    Column::number("projection saved"),
                    Column::number("iterations, relative"),
                    Column::number("contacts, of the total"),
                    Column::number("time a step [us]"),
                    Column::number("error"),
                    Column::number("not converged"),
                ],
                rows,
                conditions: context
                    .conditions(ALL_STAGES)
                    .with(
                        "solver",
                        format!("conjugate gradients, {preconditioner}, tolerance {tolerance:e}, formulation xpbd"),
                    )
                    .with("runs", if context.size == crate::context::Size::Full { runs } else { "one of each" })
                    .with("seed of the trees", SEED.to_string()),
            }));
        }
        blocks.push(Block::Table(break_evens(context, cells)?));
        Ok(PageSection { id: Self::ID.to_owned(), title: "Collisions, knot and trees".to_owned(), blocks })
    }

    fn claims(&self, _: &Context, cells: &[(&Key, &Value)]) -> Result<BTreeMap<String, String>> {
        let ids = [("helix-on-plane", "plane-total"), ("two-rods", "two-rods-total"), ("knot", "knot-total")];
        let ids = ids.map(|(scene, id)| (scene.to_owned(), id.to_owned())).into_iter();
        let trees = TREES.map(|(rods, _)| (format!("trees-{rods}"), format!("trees-{rods}-total"))).into_iter();
        Ok(ids.chain(trees).map(|(scene, id)| (id, claim(cells, &scene))).collect())
    }
}

const INTRODUCTION: &str = "The paper's total speed-ups, inference included: a helix that falls on the plane, two rods that \
    collide, a knot that is pulled tight, and trees in wind, from a network against conjugate gradients from zero. Trees are \
    drawn anew: none of their topologies was seen in training. The rivals stand beside.";

/// Names of all scenes, with the paper's words.
fn scenes() -> Vec<(String, String)> {
    let trees = TREES.map(|(rods, paper)| (format!("trees-{rods}"), paper.to_owned()));
    SCENES.map(|(scene, paper, _)| (scene.to_owned(), paper.to_owned())).into_iter().chain(trees).collect()
}

fn scene_of(key: &Key) -> Result<Scene> {
    let Some(rods) = key.scene.strip_prefix("trees-") else { return Ok(scene::builtin(&key.scene)?) };
    let Parameters::Tree(tree) = Scenario::Tree.sample(key.seed, key.index) else {
        anyhow::bail!("the scenario of trees has no trees");
    };
    Ok(Parameters::Tree(Tree { rods: rods.parse()?, ..tree }).scene()?)
}

fn runs_of(cells: &[(&Key, &Value)], scene: &str, preconditioner: PreconditionerKind) -> Vec<Run> {
    let own = cells.iter().filter(|(key, _)| key.scene == scene && key.preconditioner == preconditioner.name());
    own.map(|(_, value)| value.run.clone()).collect()
}

fn row(scene: &str, paper: &str, runs: &[Run], way: &Speedup) -> Vec<Cell> {
    let segments = runs.iter().map(|run| run.segments).sum::<usize>() as f64 / runs.len().max(1) as f64;
    let is_base = way.name == ZERO;
    let total = if is_base { Cell::muted("0") } else { spread(way.total.as_ref(), 100.0).into() };
    let projection = if is_base { Cell::muted("0") } else { spread(way.projection.as_ref(), 100.0).into() };
    let median =
        |value: Option<evaluation::guesses::Spread>| value.map_or("-".to_owned(), |spread| number(spread.median));
    vec![
        format!("{scene} ({segments:.0} segments)").into(),
        if way.name.starts_with("gn") { paper.into() } else { Cell::muted("-") },
        way.name.as_str().into(),
        total,
        projection,
        median(way.iteration_ratio).into(),
        median(way.contact_share).into(),
        median(way.step_us).into(),
        median(way.error).into(),
        way.not_converged.to_string().into(),
    ]
}

/// When training has paid for itself.
fn break_evens(context: &Context, cells: &[(&Key, &Value)]) -> Result<Table> {
    let mut rows = Vec::new();
    for (scene, _) in scenes() {
        let Some((key, _)) = cells.iter().find(|(key, _)| key.scene == scene) else { continue };
        let guesses = context.library.for_scene(&scene_of(key)?, Learned::Networks)?;
        for (preconditioner, tolerance) in SOLVERS {
            let runs = runs_of(cells, &scene, preconditioner);
            for (name, guess) in guesses.iter().filter(|(name, _)| name.helps_solves()) {
                let Some(network) = guess.network() else { continue };
                let seconds = network.card().training.seconds;
                let against = break_even::against(seconds, &runs, &name.to_string());
                for held in against.iter().filter(|held| RIVALS.contains(&held.against.as_str())) {
                    rows.push(vec![
                        format!("{scene}, {preconditioner} {tolerance:e}").into(),
                        name.to_string().into(),
                        number(seconds / 60.0).into(),
                        held.against.as_str().into(),
                        held.saved_s.map_or("-".to_owned(), |saved| number(1e6 * saved)).into(),
                        held.steps.map_or(Cell::muted("never"), |steps| Cell::strong(steps.to_string())),
                    ]);
                }
            }
        }
    }
    Ok(Table {
        id: "speedups-break-even".to_owned(),
        title: "When training has paid for itself".to_owned(),
        caption: "Steps after which the time that a guess saves is as long as its training took.".to_owned(),
        columns: vec![
            Column::text("scene, solver"),
            Column::text("guess"),
            Column::number("training [min]"),
            Column::text("against"),
            Column::number("saved a step [us]"),
            Column::number("steps to break even"),
        ],
        rows,
        conditions: context.conditions(ALL_STAGES).with("training", "wall time as the checkpoints' cards have it"),
    })
}

/// What a network must beat.
const RIVALS: [&str; 3] = [ZERO, FISCHER, DIRECT];

/// What the networks save in a scene, in words.
fn claim(cells: &[(&Key, &Value)], scene: &str) -> String {
    let mut words = Vec::new();
    for (preconditioner, tolerance) in SOLVERS {
        for way in speedups(&runs_of(cells, scene, preconditioner)) {
            if let Some(total) = way.total.filter(|_| way.name.starts_with("gn")) {
                words.push(format!("{} {} ({preconditioner} {tolerance:e})", way.name, per_cent(total.median)));
            }
        }
    }
    words.join("; ")
}

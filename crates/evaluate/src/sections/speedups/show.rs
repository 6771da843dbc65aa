//! Tables of the total speed-ups, and when training has paid for itself.

use std::collections::BTreeMap;

use anyhow::Result;
use catalogue::GuessName;
use evaluation::guesses::Spread;
use evaluation::paper::speedup::{SceneRun, Speedup, break_even, saved_s, speedups, step_s};
use evaluation::paper::{DIRECT, FISCHER, ZERO};
use report::{Block, Cell, Section as PageSection};

use super::key::{ID, SpeedupsKey, scene_of};
use crate::blocks::{groups, section as page_section, table, values};
use crate::context::Context;
use crate::library::Learned;
use crate::sections::claims::paper_says;
use crate::sections::paper::{SEED, solver_words};
use crate::show::{ALL_STAGES, join, number, per_cent, spread};

const INTRODUCTION: &str = "The paper's total speed-ups, inference included: a helix that falls on the plane, two rods that \
    collide, a knot that is pulled tight, and trees in wind, from a network against conjugate gradients from zero. Trees are \
    drawn anew: none of their topologies was seen in training. The rivals stand beside.";

/// What a network must beat.
const RIVALS: [&str; 3] = [ZERO, FISCHER, DIRECT];

pub(super) fn section(context: &Context, cells: &[(&SpeedupsKey, &SceneRun)]) -> Result<PageSection> {
    let mut blocks = Vec::new();
    for ((preconditioner, tolerance), own) in groups(cells, solver) {
        let mut rows = Vec::new();
        for (scene, own) in groups(&own, |key| &key.scene) {
            let (runs, paper) = (values(&own), paper_says(&claim(scene))?);
            rows.extend(speedups(&runs).iter().map(|way| row(scene, &paper, &runs, way)));
        }
        let runs = groups(&own, |key| (&key.scene, key.steps)).into_iter();
        let runs = runs.map(|((scene, steps), own)| format!("{} of {scene}, {steps} steps", own.len()));
        let runs = format!("{}; medians and quartiles", runs.collect::<Vec<_>>().join("; "));
        let conditions = context
            .conditions(ALL_STAGES)
            .with("solver", solver_words(preconditioner, format!("{tolerance:e}")))
            .with("runs", runs)
            .with("seed of the trees", SEED.to_string());
        let head = [
            &format!("speedups-{preconditioner}"),
            &format!("Total speed-ups over {preconditioner} conjugate gradients from zero"),
            "Share of the whole simulation's time that each way saves, to the same tolerances; below zero it loses. The \
             error is the positions' against a tight reference at the same time step, contacts or not.",
        ];
        blocks.push(table(head, HEADINGS, rows, conditions));
    }
    blocks.push(break_evens(context, cells)?);
    Ok(page_section([ID, "Collisions, knot and trees", INTRODUCTION], blocks))
}

const HEADINGS: &str = "scene | paper, from its network | way | #total saved | #projection saved | #iterations, relative | \
    #contacts, of the total | #time a step [us] | #error | #not converged";

/// The claim of the paper on a scene.
fn claim(scene: &str) -> String {
    format!("{}-total", if scene == "helix-on-plane" { "plane" } else { scene })
}

fn solver(key: &SpeedupsKey) -> (&str, f64) {
    (&key.preconditioner, key.tolerance)
}

fn median(value: Option<Spread>) -> String {
    value.map_or("-".to_owned(), |spread| number(spread.median))
}

fn row(scene: &str, paper: &str, runs: &[&SceneRun], way: &Speedup) -> Vec<Cell> {
    let segments = runs.iter().map(|run| run.segments).sum::<usize>() as f64 / runs.len().max(1) as f64;
    let saved = |saved: Option<&Spread>| if way.name == ZERO { Cell::muted("0") } else { spread(saved, 100.0).into() };
    vec![
        format!("{scene} ({segments:.0} segments)").into(),
        if way.name.starts_with("gn") { paper.into() } else { Cell::muted("-") },
        way.name.as_str().into(),
        saved(way.total.as_ref()),
        saved(way.projection.as_ref()),
        median(way.iteration_ratio).into(),
        median(way.contact_share).into(),
        median(way.step_us).into(),
        median(way.error).into(),
        way.not_converged.to_string().into(),
    ]
}

/// When training has paid for itself.
fn break_evens(context: &Context, cells: &[(&SpeedupsKey, &SceneRun)]) -> Result<Block> {
    let mut rows = Vec::new();
    for (scene, own) in groups(cells, |key| &key.scene) {
        let guesses = context.library.for_scene(&scene_of(own[0].0)?, Learned::Networks)?;
        let networks = guesses.iter().filter(|(name, _)| name.helps_solves());
        // A network in a scene's plane is a guess of its own.
        let names = |name: &GuessName| [name.to_string(), format!("{name}, planar")];
        let trained = networks.filter_map(|(name, guess)| Some((names(name), guess.network()?.card().seconds())));
        let trained: Vec<_> = trained.flat_map(|(names, seconds)| names.map(|name| (name, seconds))).collect();
        for ((preconditioner, tolerance), own) in groups(&own, solver) {
            let runs = values(&own);
            let is_there = |guess: &str| runs.iter().any(|run| step_s(run, guess).is_some());
            for (guess, seconds) in trained.iter().filter(|(guess, _)| is_there(guess)) {
                rows.extend(RIVALS.map(|rival| {
                    let saved_s = saved_s(&runs, guess, rival);
                    let steps = saved_s.and_then(|saved_s| break_even(*seconds, saved_s));
                    vec![
                        format!("{scene}, {preconditioner} {tolerance:e}").into(),
                        guess.as_str().into(),
                        number(seconds / 60.0).into(),
                        rival.into(),
                        saved_s.map_or("-".to_owned(), |saved| number(1e6 * saved)).into(),
                        steps.map_or(Cell::muted("never"), |steps| Cell::strong(steps.to_string())),
                    ]
                }));
            }
        }
    }
    let head = [
        "speedups-break-even",
        "When training has paid for itself",
        "Steps after which the time that a guess saves is as long as its training took.",
    ];
    let headings = "scene, solver | guess | #training [min] | against | #saved a step [us] | #steps to break even";
    let training = "wall time of all trainings that made the weights, one after the other, by their cards";
    Ok(table(head, headings, rows, context.conditions(ALL_STAGES).with("training", training)))
}

/// What the networks save in each scene, in words.
pub(super) fn claims(cells: &[(&SpeedupsKey, &SceneRun)]) -> BTreeMap<String, String> {
    let mut claims = BTreeMap::new();
    for (scene, own) in groups(cells, |key| &key.scene) {
        for ((preconditioner, tolerance), own) in groups(&own, solver) {
            for way in speedups(&values(&own)).iter().filter(|way| way.name.starts_with("gn")) {
                let Some(total) = way.total else { continue };
                let touches = way.contact_share.map(|share| share.median).filter(|share| *share > 0.0);
                let touches = touches.map_or(String::new(), |share| format!(", {} in contacts", per_cent(share)));
                let iterations = format!("{} of the iterations{touches}", median(way.iteration_ratio));
                let solver = format!("{preconditioner} {tolerance:e}");
                let words = format!("{} {} ({solver}, {iterations})", way.name, per_cent(total.median));
                join(claims.entry(claim(scene)).or_default(), &words);
            }
        }
    }
    claims
}

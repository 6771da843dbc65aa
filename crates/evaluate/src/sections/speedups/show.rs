//! Tables of the total speed-ups, and when training has paid for itself.

use std::collections::BTreeMap;

use anyhow::Result;
use evaluation::guesses::Spread;
use evaluation::paper::speedup::{SceneRun, Speedup, speedups};
use evaluation::paper::{DIRECT, FISCHER, ZERO, break_even};
use report::{Block, Cell, Section as PageSection, Table};
use solver::linear::precondition::PreconditionerKind;

use super::{Key, SCENES, SOLVERS, Speedups, TREES, scene_of, trees};
use crate::cells::Section as _;
use crate::context::Context;
use crate::library::Learned;
use crate::sections::claims::paper_says;
use crate::sections::paper::{SEED, solver_words};
use crate::show::{ALL_STAGES, columns, join, number, per_cent, spread};

const INTRODUCTION: &str = "The paper's total speed-ups, inference included: a helix that falls on the plane, two rods that \
    collide, a knot that is pulled tight, and trees in wind, from a network against conjugate gradients from zero. Trees are \
    drawn anew: none of their topologies was seen in training. The rivals stand beside.";

/// What a network must beat.
const RIVALS: [&str; 3] = [ZERO, FISCHER, DIRECT];

pub(super) fn section(context: &Context, cells: &[(&Key, &SceneRun)]) -> Result<PageSection> {
    let mut blocks = vec![Block::Paragraph(INTRODUCTION.to_owned())];
    for (preconditioner, tolerance) in SOLVERS {
        let mut rows = Vec::new();
        for (scene, claim) in scenes() {
            let runs = runs_of(cells, &scene, preconditioner);
            let paper = paper_says(&claim)?;
            rows.extend(speedups(&runs).iter().map(|way| row(&scene, &paper, &runs, way)));
        }
        let all = "scenes: 5 runs of the same, 100 steps (helix-on-plane 30); trees: 30 topologies of each size, 20 steps (5 \
                   in raw units); medians and quartiles";
        blocks.push(Block::Table(Table {
            id: format!("speedups-{preconditioner}"),
            title: format!("Total speed-ups over {preconditioner} conjugate gradients from zero"),
            caption: "Share of the whole simulation's time that each way saves, to the same tolerances; below zero it \
                      loses. The error is the positions' against a tight reference at the same time step, contacts or not."
                .to_owned(),
            columns: columns(&COLUMNS),
            rows,
            conditions: context
                .conditions(ALL_STAGES)
                .with("solver", solver_words(preconditioner.name(), format!("{tolerance:e}")))
                .with("runs", context.size.pick("one of each", all))
                .with("seed of the trees", SEED.to_string()),
        }));
    }
    blocks.push(Block::Table(break_evens(context, cells)?));
    Ok(PageSection { id: Speedups::ID.to_owned(), title: "Collisions, knot and trees".to_owned(), blocks })
}

const COLUMNS: [&str; 10] = [
    "scene",
    "paper, from its network",
    "way",
    "#total saved",
    "#projection saved",
    "#iterations, relative",
    "#contacts, of the total",
    "#time a step [us]",
    "#error",
    "#not converged",
];

/// Names of all scenes, each with its claim of the paper.
fn scenes() -> Vec<(String, String)> {
    let claims = ["plane-total", "two-rods-total", "knot-total"];
    let scenes = SCENES.iter().zip(claims).map(|((scene, _), claim)| ((*scene).to_owned(), claim.to_owned()));
    scenes.chain(TREES.map(|rods| (trees(rods), format!("{}-total", trees(rods))))).collect()
}

fn runs_of(cells: &[(&Key, &SceneRun)], scene: &str, preconditioner: PreconditionerKind) -> Vec<SceneRun> {
    let own = cells.iter().filter(|(key, _)| key.scene == scene && key.preconditioner == preconditioner.name());
    own.map(|(_, run)| (*run).clone()).collect()
}

fn row(scene: &str, paper: &str, runs: &[SceneRun], way: &Speedup) -> Vec<Cell> {
    let segments = runs.iter().map(|run| run.segments).sum::<usize>() as f64 / runs.len().max(1) as f64;
    let saved = |saved: Option<&Spread>| if way.name == ZERO { Cell::muted("0") } else { spread(saved, 100.0).into() };
    let median = |value: Option<Spread>| value.map_or("-".to_owned(), |spread| number(spread.median)).into();
    vec![
        format!("{scene} ({segments:.0} segments)").into(),
        if way.name.starts_with("gn") { paper.into() } else { Cell::muted("-") },
        way.name.as_str().into(),
        saved(way.total.as_ref()),
        saved(way.projection.as_ref()),
        median(way.iteration_ratio),
        median(way.contact_share),
        median(way.step_us),
        median(way.error),
        way.not_converged.to_string().into(),
    ]
}

/// When training has paid for itself.
fn break_evens(context: &Context, cells: &[(&Key, &SceneRun)]) -> Result<Table> {
    let mut rows = Vec::new();
    for (scene, _) in scenes() {
        let Some((key, _)) = cells.iter().find(|(key, _)| key.scene == scene) else { continue };
        let guesses = context.library.for_scene(&scene_of(key)?, Learned::Networks)?;
        let networks = guesses.iter().filter(|(name, _)| name.helps_solves());
        let networks: Vec<_> =
            networks.filter_map(|(name, guess)| Some((name.to_string(), guess.network()?))).collect();
        for (preconditioner, tolerance) in SOLVERS {
            let runs = runs_of(cells, &scene, preconditioner);
            for (name, network) in &networks {
                let seconds = network.card().seconds();
                // A network in a scene's plane is a guess of its own.
                for guess in [name.clone(), format!("{name}, planar")] {
                    if runs.iter().all(|run| break_even::step_s(run, &guess).is_none()) {
                        continue;
                    }
                    rows.extend(RIVALS.map(|rival| {
                        let saved_s = break_even::saved_s(&runs, &guess, rival);
                        let steps = saved_s.and_then(|saved_s| break_even::steps(seconds, saved_s));
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
    }
    let columns = columns(&[
        "scene, solver",
        "guess",
        "#training [min]",
        "against",
        "#saved a step [us]",
        "#steps to break even",
    ]);
    Ok(Table {
        id: "speedups-break-even".to_owned(),
        title: "When training has paid for itself".to_owned(),
        caption: "Steps after which the time that a guess saves is as long as its training took.".to_owned(),
        columns,
        rows,
        conditions: context
            .conditions(ALL_STAGES)
            .with("training", "wall time of all trainings that made the weights, one after the other, by their cards"),
    })
}

/// What the networks save in each scene, in words.
pub(super) fn claims(cells: &[(&Key, &SceneRun)]) -> BTreeMap<String, String> {
    let mut claims = BTreeMap::new();
    for (scene, claim) in scenes() {
        let words: &mut String = claims.entry(claim).or_default();
        for (preconditioner, tolerance) in SOLVERS {
            for way in speedups(&runs_of(cells, &scene, preconditioner)) {
                if let Some(total) = way.total.filter(|_| way.name.starts_with("gn")) {
                    let iterations = way.iteration_ratio.map_or("-".to_owned(), |ratio| number(ratio.median));
                    let contacts = way.contact_share.map_or(0.0, |share| share.median);
                    let touches =
                        if contacts > 0.0 { format!(", {} in contacts", per_cent(contacts)) } else { String::new() };
                    let how = format!("{preconditioner} {tolerance:e}, {iterations} of the iterations{touches}");
                    join(words, &format!("{} {} ({how})", way.name, per_cent(total.median)));
                }
            }
        }
    }
    claims.retain(|_, words: &mut String| !words.is_empty());
    claims
}

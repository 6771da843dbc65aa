//! Equilibria: Newton's method beside the flow that it replaced.

use anyhow::Result;
use cosserat::scene;
use evaluation::equilibria::{self, Rest};
use report::{Cell, Section as PageSection};
use serde::{Deserialize, Serialize};

use crate::blocks::{section, table};
use crate::cells::Section;
use crate::context::Context;
use crate::show::number;

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct RestKey {
    scene: String,
    turns: usize,
}

pub(crate) struct Equilibria;

/// Scenes without contacts that come to rest.
const SCENES: [&str; 12] = [
    "elastica",
    "helix",
    "hung-cable",
    "michell-ring",
    "clamped-ends",
    "roll-up",
    "euler-buckling",
    "branch",
    "strip",
    "net",
    "tree-10",
    "tree-40",
];

const INTRODUCTION: &str = "What `simulate static` does with each scene: Newton's method with the exact tangent, down in energy, \
    and the flow alone, which is what stood there before and still takes sets with several loops, large trees in wind, and what \
    Newton's method does not bring to rest.";

impl Section for Equilibria {
    type Key = RestKey;
    type Value = Vec<Rest>;
    const ID: &'static str = "equilibria";

    fn keys(&self, context: &Context) -> Result<Vec<RestKey>> {
        let scenes = context.size.pick(&SCENES[..2], &SCENES[..]);
        let turns = context.size.pick(1, 5);
        Ok(scenes.iter().map(|&scene| RestKey { scene: scene.to_owned(), turns }).collect())
    }

    fn seconds(&self, key: &RestKey) -> f64 {
        2.0 * key.turns as f64
    }

    fn measure(&mut self, _: &Context, key: &RestKey, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Vec<Rest>>> {
        Ok(equilibria::measure(&scene::builtin(&key.scene)?, key.turns, go_on)?)
    }

    fn show(&self, context: &Context, cells: &[(&RestKey, &Vec<Rest>)]) -> Result<PageSection> {
        let turns = cells.first().map_or(0, |(key, _)| key.turns);
        let conditions = context
            .without_networks("the whole search")
            .with("repetitions", format!("{turns}, in turns; the least time of each"))
            .with("tolerance", "the program's: nothing moves by more than 1e-9 segment lengths or radians");
        let table = table(
            [
                "equilibria-cost",
                "Linear solves and time to an equilibrium",
                "Where the last column is not small, the two came to different equilibria.",
            ],
            "scene | method | at rest | stable | #solves | #time [ms] | #apart [rod lengths]",
            cells.iter().flat_map(|(key, rests)| rests.iter().map(|rest| row(key, rest))).collect(),
            conditions,
        );
        Ok(section([Self::ID, "Equilibria by Newton's method", INTRODUCTION], vec![table]))
    }
}

fn row(key: &RestKey, Rest { method, converged, stable, solves, least_ms, apart }: &Rest) -> Vec<Cell> {
    let word = |is: bool| if is { "yes" } else { "no" };
    let stable = stable.map_or(Cell::muted("not known"), |is| word(is).into());
    let texts = [key.scene.as_str(), method.as_str(), word(*converged)].map(Cell::from);
    let numbers = [number(*least_ms), number(*apart)].map(Cell::from);
    texts.into_iter().chain([stable, solves.to_string().into()]).chain(numbers).collect()
}

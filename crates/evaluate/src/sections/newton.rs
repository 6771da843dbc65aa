//! Newton's method in a step: iterations and time with the positive matrix and with the exact tangent.

use anyhow::Result;
use cosserat::scene;
use cosserat::simulation::Tangent;
use evaluation::newton::{self, Ending};
use report::{Axis, Cell, LineChart, Section as PageSection, Series};
use serde::{Deserialize, Serialize};

use crate::blocks::{chart, figure, section, table};
use crate::cells::Section;
use crate::context::Context;
use crate::show::{ALL_STAGES, number};

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct NewtonKey {
    scene: String,
    steps: usize,
}

pub(crate) struct Newton;

/// Scenes with one connected set that an exact tangent is there for, and for which eight alike rods are not in the way.
const SCENES: [&str; 9] = [
    "bending-rod",
    "helix",
    "slack-rod",
    "tip-mass",
    "tree-10",
    "tree-70",
    "plucked-string",
    "hung-cable",
    "michell-ring",
];

const INTRODUCTION: &str = "Formulation `newton` solves a step's nonlinear equations, here to a relative residual of 1e-6. The \
    positive matrix leaves out how the torques of joints change as segments turn, the exact tangent has it, and `auto` finds out \
    which takes less work. All run the same scene in turns, each from the start that is chosen for it.";

impl Section for Newton {
    type Key = NewtonKey;
    type Value = Vec<Ending>;
    const ID: &'static str = "newton";

    fn keys(&self, context: &Context) -> Result<Vec<NewtonKey>> {
        let scenes = context.size.pick(&SCENES[1..3], &SCENES[..]);
        let steps = context.size.pick(20, 200);
        Ok(scenes.iter().map(|&scene| NewtonKey { scene: scene.to_owned(), steps }).collect())
    }

    fn seconds(&self, key: &NewtonKey) -> f64 {
        let a_step = if key.scene == "tree-70" { 0.1 } else { 0.005 };
        a_step * key.steps as f64
    }

    fn measure(
        &mut self,
        _: &Context,
        key: &NewtonKey,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Option<Vec<Ending>>> {
        Ok(newton::measure(&scene::builtin(&key.scene)?, key.steps, |_| go_on())?)
    }

    fn show(&self, context: &Context, cells: &[(&NewtonKey, &Vec<Ending>)]) -> Result<PageSection> {
        let steps = cells.first().map_or(0, |(key, _)| key.steps);
        let conditions = context
            .without_networks(ALL_STAGES)
            .with("steps", format!("{steps} of each scene's own length"))
            .with("tolerance", "1e-6 of the prediction's residual");
        let cost = table(
            ["newton-cost", "Iterations and time of a step", "Times are means over all steps."],
            "scene | matrix | start | #iterations a step | #time of a step [us] | #time, to the positive matrix | worst status",
            cells.iter().flat_map(|(key, endings)| endings.iter().map(|ending| row(key, endings, ending))).collect(),
            conditions.clone(),
        );
        let left = figure(
            [
                "newton-left",
                "What each iteration leaves",
                "The largest residual, in segment lengths and radians, of the step in the middle of the run, from the \
                 prediction. The straight lines of linear convergence bend down where it is quadratic.",
            ],
            cells.iter().map(|(key, endings)| convergence(key, endings)).collect(),
            conditions,
        );
        Ok(section([Self::ID, "Steps with the exact tangent", INTRODUCTION], vec![cost, left]))
    }
}

fn row(key: &NewtonKey, all: &[Ending], own: &Ending) -> Vec<Cell> {
    let texts = [&key.scene, &own.tangent, &own.guess].map(|text| Cell::from(text.as_str()));
    let ratio = own.step_us / all[0].step_us;
    let numbers = [own.iterations, own.step_us, ratio].map(|value| number(value).into());
    texts.into_iter().chain(numbers).chain([own.status.as_str().into()]).collect()
}

fn convergence(key: &NewtonKey, endings: &[Ending]) -> LineChart {
    // What is chosen on the way is one of the other two.
    let series = endings.iter().filter(|ending| ending.tangent != Tangent::Auto.name()).map(|ending| {
        let left = (1..).zip(&ending.left).filter(|(_, left)| **left > 0.0);
        Series::new(&ending.tangent, left.map(|(iteration, &left)| (f64::from(iteration), left)))
    });
    chart(&key.scene, [Axis::linear("iteration"), Axis::log("residual")], series.collect(), Vec::new())
}

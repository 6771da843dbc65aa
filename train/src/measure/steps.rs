//! Of whole steps: outer iterations relative to those from the parabola through the last steps.

use anyhow::Result;
use copingnet::{Encoding, GnStepGuess, Trained, Weights};
use cosserat::guess::{GuessKind, InitialGuess};
use dataset::Scenario;
use graph::{Graph, planar_normal};
use rayon::prelude::*;

use super::{Columns, Measured, Pair};
use crate::steps::{DTS, TOLERANCES, Trajectory};

/// Steps of each simulation.
const STEPS: usize = 100;

/// Time steps, each with both tolerances.
pub(crate) fn columns() -> Columns {
    let pair =
        |dt: f64| Pair { head: format!("dt {dt}"), name: format!("dt_{dt}"), solver: "direct", tolerances: TOLERANCES };
    Columns {
        about: "outer iterations to those from step-quadratic, at tolerance 1e-3 / 1e-6, planar scenes in their plane",
        parts: ["1e-3", "1e-6"],
        pairs: DTS.into_iter().map(pair).collect(),
    }
}

/// Measures on `scenes` validation scenes, every second one slack, on rayon's current thread pool. The score is the
/// ratios' geometric mean.
pub(crate) fn measure(scenario: Scenario, scenes: usize, weights: &Weights, encoding: &Encoding) -> Result<Measured> {
    let trained = Trained::new(weights, encoding.clone());
    let runs: Vec<[usize; 3]> = (0..scenes)
        .flat_map(|index| (0..DTS.len()).flat_map(move |dt| (0..TOLERANCES.len()).map(move |k| [index, dt, k])))
        .collect();
    let count = |&[index, dt, k]: &[usize; 3]| -> Result<[u64; 2]> {
        let trajectory = Trajectory::validation(scenario, index as u64, DTS[dt], TOLERANCES[k])?;
        iterations(&trajectory, &trained)
    };
    let counts = runs.par_iter().map(count).collect::<Result<Vec<_>>>()?;
    let mut sums = vec![[[0.0; 2]; 2]; DTS.len()];
    for ([_, dt, k], [baseline, own]) in runs.iter().zip(counts) {
        sums[*dt][*k][0] += baseline as f64;
        sums[*dt][*k][1] += own as f64;
    }
    let pairs: Vec<[f64; 2]> = sums.iter().map(|sums| sums.map(|[baseline, own]| own / baseline.max(1.0))).collect();
    let logarithms: f64 = pairs.iter().flatten().map(|ratio| ratio.ln()).sum();
    let score = (logarithms / (2 * pairs.len()) as f64).exp();
    Ok(Measured { pairs, score })
}

/// Outer iterations from the parabola, and from the network.
fn iterations(trajectory: &Trajectory, trained: &Trained) -> Result<[u64; 2]> {
    let plane = planar_normal(&trajectory.scene.model, &trajectory.scene.state);
    let mut simulations = [
        trajectory.simulation(&|model, members, topology| GuessKind::StepQuadratic.build(model, members, topology))?,
        trajectory.simulation(&|model, members, topology| {
            let guess: Box<dyn InitialGuess> =
                Box::new(GnStepGuess::new(trained, Graph::new(model, members, topology), plane));
            Some(guess)
        })?,
    ];
    for _ in 0..STEPS {
        for simulation in &mut simulations {
            simulation.step(trajectory.dt)?;
        }
    }
    Ok(simulations.map(|simulation| simulation.counters().iterations))
}

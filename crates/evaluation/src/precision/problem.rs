//! A scene to be simulated, with its references.

use rod::{Model, State};
use solver::formulation::Formulation;
use solver::simulation::SimulationError;

use super::reference::{Converged, Exact};

/// How many steps of a run errors are measured at, about.
pub const SAMPLES: usize = 10;

/// A scene, for how long it is run, and what its errors are measured against.
#[derive(Clone, Debug)]
pub struct Problem {
    /// Name of the scene.
    pub scene: String,
    /// Model.
    pub model: Model,
    /// First state.
    pub state: State,
    /// Time step [s].
    pub dt: f64,
    /// Number of steps.
    pub steps: usize,
    /// Steps, from 1, after which errors are measured: see [`sample_steps`].
    pub samples: Vec<usize>,
    /// References at the same time step, one a formulation.
    pub exact: Vec<Exact>,
    /// The converged reference, where there is one.
    pub converged: Option<Converged>,
}

impl Problem {
    /// A problem with exact references of `formulations`, and without a converged one. The first formulation's contacts
    /// say where the samples lie. After each step of each reference `go_on()` says whether to go on; `None` if not.
    ///
    /// # Errors
    /// If model and state do not fit together, or `dt` [s] is not finite and positive.
    pub fn new(
        scene: impl Into<String>,
        (model, state): (Model, State),
        (dt, steps): (f64, usize),
        formulations: &[Formulation],
        mut go_on: impl FnMut() -> bool,
    ) -> Result<Option<Self>, SimulationError> {
        let mut exact = Vec::with_capacity(formulations.len());
        for &formulation in formulations {
            match Exact::of_all_steps(&model, &state, (dt, steps), formulation, &mut go_on)? {
                Some(reference) => exact.push(reference),
                None => return Ok(None),
            }
        }
        let samples = sample_steps(steps, exact.first().and_then(|exact| exact.first_contact));
        for exact in &mut exact {
            let mut step = 0;
            exact.frames.retain(|_| {
                step += 1;
                samples.contains(&step)
            });
        }
        Ok(Some(Self { scene: scene.into(), model, state, dt, steps, samples, exact, converged: None }))
    }

    /// The reference of the same formulation, if there is one.
    pub fn exact(&self, formulation: Formulation) -> Option<&Exact> {
        self.exact.iter().find(|exact| exact.formulation == formulation)
    }

    /// How many of the samples come before the first contact in any of the references.
    pub fn samples_before_contact(&self) -> usize {
        let exact = self.exact.iter().map(|exact| exact.first_contact);
        let first = exact.chain(self.converged.iter().map(|converged| converged.first_contact)).flatten().min();
        self.samples.iter().take_while(|&&step| first.is_none_or(|first| step < first)).count()
    }
}

/// The steps, from 1 to `steps`, after which errors are measured: evenly spread, up to the last; where there is a first
/// contact within the run half of them before it, up to the last step without, and half from it on.
pub fn sample_steps(steps: usize, first_contact: Option<usize>) -> Vec<usize> {
    let spread = |after: usize, until: usize, count: usize| {
        let count = count.min(until - after);
        (1..=count).map(move |k| after + ((until - after) * k).div_ceil(count))
    };
    match first_contact {
        Some(first) if first > 1 && first <= steps => {
            spread(0, first - 1, SAMPLES / 2).chain(spread(first - 1, steps, SAMPLES / 2)).collect()
        }
        _ => spread(0, steps, SAMPLES).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_reach_to_the_end_and_to_the_first_contact() {
        assert_eq!(sample_steps(100, None), [10, 20, 30, 40, 50, 60, 70, 80, 90, 100]);
        assert_eq!(sample_steps(3, None), [1, 2, 3]);
        assert!(sample_steps(0, None).is_empty());
        assert_eq!(sample_steps(100, Some(51)), [10, 20, 30, 40, 50, 60, 70, 80, 90, 100]);
        assert_eq!(sample_steps(12, Some(3)), [1, 2, 4, 6, 8, 10, 12]);
        assert_eq!(sample_steps(20, Some(1)), [2, 4, 6, 8, 10, 12, 14, 16, 18, 20]);
        assert_eq!(sample_steps(20, Some(20)).last(), Some(&20));
        assert_eq!(sample_steps(20, Some(21)), sample_steps(20, None));
    }
}

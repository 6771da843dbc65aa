//! A start of a step where it saves outer iterations, and none where it does not.
//!
//! What the parabola through the last steps saves depends on the motion and on the tolerance: half of the iterations of a
//! rod that swings, none of one that creeps to rest under damping, where it costs an evaluation a step. So the iterations
//! of steps from both starts are averaged, the cheaper start is taken, and the other one has its turn now and then. Only
//! iterations are counted, no time is measured: the same motion takes the same starts on every machine.
//!
//! Where contacts press, their impulses are part of the start, and steps from the prediction that looks through them are
//! much dearer; those begin at the parabola always.

use super::{InitialGuess, StepExtrapolation};
use crate::component::{Component, Pose};
use crate::system::Six;

/// What a start costs, in outer iterations: the extrapolation and one more evaluation.
const COST: f64 = 0.5;
/// Weight of a step in the averages.
const WEIGHT: f64 = 0.25;
/// One step of so many begins where steps were dearer on average.
const TURN: u64 = 16;
/// Steps from the prediction, then from the parabola, before averages decide.
const FIRST: [u64; 2] = [3, 2];

/// Starts steps at the parabola through what the last three added to the prediction, as long as that saves iterations.
#[derive(Clone, Debug)]
pub struct StepAdaptive {
    parabola: StepExtrapolation,
    /// Mean outer iterations of steps from the prediction and from the parabola, the start's cost included.
    means: [f64; 2],
    /// Steps of each.
    counts: [u64; 2],
    /// Whether the step under way begins at the parabola; `None` before its first attempt.
    guesses: Option<bool>,
    /// Whether contacts pressed at the end of the last step.
    is_pressed: bool,
    /// Linear solves before the step under way.
    solves: u64,
}

impl StepAdaptive {
    /// No history yet.
    pub fn new(bodies: usize, joints: usize) -> Self {
        let parabola = StepExtrapolation::new(2, bodies, joints);
        Self { parabola, means: [0.0; 2], counts: [0; 2], guesses: None, is_pressed: false, solves: 0 }
    }

    fn choose(&self) -> bool {
        if self.is_pressed {
            return true;
        }
        let [from_prediction, from_parabola] = self.counts;
        let steps = from_prediction + from_parabola;
        if steps < FIRST[0] + FIRST[1] {
            return steps >= FIRST[0];
        }
        (self.means[1] < self.means[0]) != (steps % TURN == 0)
    }
}

impl InitialGuess for StepAdaptive {
    fn helps_steps(&self) -> bool {
        true
    }

    fn start_step(&mut self, component: &Component<f64>, poses: &mut [Pose<f64>], lambda: &mut [Six<f64>]) -> bool {
        let guesses = match self.guesses {
            Some(guesses) => guesses,
            None => self.choose(),
        };
        self.guesses = Some(guesses);
        if !guesses {
            self.parabola.stand_back();
            return false;
        }
        self.parabola.start_step(component, poses, lambda)
    }

    fn observe_step(&mut self, component: &Component<f64>) {
        self.parabola.observe_step(component);
        self.is_pressed = component.is_pressed();
        let iterations = (component.solves - self.solves) as f64;
        self.solves = component.solves;
        let kind = usize::from(self.guesses.take() == Some(true));
        let cost = iterations + COST * kind as f64;
        let weight = if self.counts[kind] == 0 { 1.0 } else { WEIGHT };
        self.means[kind] += weight * (cost - self.means[kind]);
        self.counts[kind] += 1;
    }
}

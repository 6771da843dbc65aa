//! A start of a step where it saves outer iterations, and none where it does not.
//!
//! What the parabola through the last steps saves depends on the motion and on the tolerance: many iterations of a rod that
//! swings, none of one that creeps to rest under damping, where it costs an evaluation a step. So the iterations of steps
//! from both starts are averaged, the cheaper start is taken, and the other one is tried now and then. Only solves and
//! evaluations are counted, no time is measured: the same motion takes the same starts on every machine.
//!
//! Where contacts press, their impulses are part of the start, and steps from the prediction that looks through them are
//! much dearer; those begin at the parabola always.

use component::snapshot::StateVisitor;
use component::{BodyPose, Component};
use kernels::Spatial;

use super::{InitialGuess, StepExtrapolation};

/// What an evaluation of constraints and residuals costs, in outer iterations, of which it is a part. A start takes one
/// more than the prediction, and one that is dropped takes two.
const EVALUATION: f64 = 0.35;
/// What the extrapolation and its history cost, in outer iterations.
const EXTRAPOLATION: f64 = 0.1;
/// Weight of a step in the average of the start that is taken.
const WEIGHT: f64 = 0.25;
/// Weight of a step in the average of the other one, which is tried so rarely.
const WEIGHT_OF_TURN: f64 = 0.75;
/// One step of so many begins where steps were dearer on average.
const TURN: u64 = 12;
/// Steps before the one that begins at the parabola, which it goes through.
const HISTORY: u64 = 3;
/// Steps from the prediction, then from the parabola, before averages decide.
const FIRST: [u64; 2] = [3, 2];

/// Starts steps at the parabola through what the last three added to the prediction, as long as that saves iterations.
#[derive(Clone, Debug)]
pub struct StepAdaptive {
    parabola: StepExtrapolation,
    /// Mean costs of steps from the prediction and from the parabola, in outer iterations.
    means: [f64; 2],
    /// Steps of each.
    counts: [u64; 2],
    /// Whether the step under way begins at the parabola; `None` before its first attempt.
    guesses: Option<bool>,
    /// Whether contacts pressed at the end of the last step.
    is_pressed: bool,
    /// Linear solves and evaluations before the step under way.
    done: [u64; 2],
}

impl StepAdaptive {
    /// No history yet.
    pub(crate) fn new(bodies: usize, joints: usize) -> Self {
        let parabola = StepExtrapolation::new(2, bodies, joints);
        Self { parabola, means: [0.0; 2], counts: [0; 2], guesses: None, is_pressed: false, done: [0; 2] }
    }

    /// Steps done.
    fn steps(&self) -> u64 {
        self.counts[0] + self.counts[1]
    }

    /// Whether the step after so many begins at the parabola, by what is known now.
    fn guesses_after(&self, steps: u64) -> bool {
        if self.is_pressed {
            return true;
        }
        if steps < FIRST[0] + FIRST[1] {
            return steps >= FIRST[0];
        }
        (self.means[1] < self.means[0]) != steps.is_multiple_of(TURN)
    }
}

impl InitialGuess for StepAdaptive {
    fn helps_steps(&self) -> bool {
        true
    }

    fn reads_prediction(&self) -> bool {
        false
    }

    fn start_step(
        &mut self,
        component: &Component<f64>,
        poses: &mut [BodyPose<f64>],
        lambda: &mut [Spatial<f64>],
    ) -> bool {
        let guesses = match self.guesses {
            Some(guesses) => guesses,
            None => self.guesses_after(self.steps()),
        };
        self.guesses = Some(guesses);
        if !guesses {
            self.parabola.stand_back();
            return false;
        }
        self.parabola.start_step(component, poses, lambda)
    }

    fn observe_step(&mut self, component: &Component<f64>) {
        self.is_pressed = component.is_pressed();
        let done = [component.solves, component.evaluations];
        let [solves, evaluations] = [0, 1].map(|k| (done[k] - self.done[k]) as f64);
        self.done = done;
        let kind = usize::from(self.guesses.take() == Some(true));
        let cost = (1.0 - EVALUATION) * solves + EVALUATION * evaluations + EXTRAPOLATION * kind as f64;
        let weight = match self.counts[kind] {
            0 => 1.0,
            _ if (self.means[1] < self.means[0]) == (kind == 1) => WEIGHT,
            _ => WEIGHT_OF_TURN,
        };
        self.means[kind] += weight * (cost - self.means[kind]);
        self.counts[kind] += 1;
        let steps = self.steps();
        if (steps..steps + HISTORY).any(|steps| self.guesses_after(steps)) {
            self.parabola.observe_step(component);
        } else {
            self.parabola.pass_step();
        }
    }

    fn visit_state(&mut self, visitor: &mut StateVisitor<'_>) {
        let Self { parabola, means, counts, is_pressed, done, guesses: _ } = self;
        parabola.visit_state(visitor);
        means.iter_mut().for_each(|mean| visitor.number(mean));
        counts.iter_mut().chain(done).for_each(|count| visitor.word(count));
        visitor.flag(is_pressed);
    }
}

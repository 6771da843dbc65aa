//! Joints that come apart on the way: when, where and how far.

use std::fmt::{self, Display, Formatter};

use cosserat::scene::Scene;
use cosserat::simulation::Status;
use cosserat::state::measure::{stretch_gap, widest_gap};
use cosserat::state::{Body, Model, State};
use serde::Serialize;

use crate::held::place;
use crate::numbers::number;

/// Gap in lengths of a joint from which on a step that has not converged counts, too.
const WIDE: f64 = 0.1;

/// Steps that ended with joints apart.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Apart {
    /// How many steps.
    steps: usize,
    first_step: usize,
    /// End of the first one, since the start [s].
    first_time_s: f64,
    /// The step with the widest gap.
    widest_step: usize,
    widest_gap_m: f64,
    widest_gap_per_length: f64,
    /// What the widest gap is between, in words.
    between: [String; 2],
}

impl Apart {
    /// Takes note of a step, which ended with `status` at `time` [s] in this state: where its joints are apart, in `noted`.
    pub(crate) fn note(
        noted: &mut Option<Self>,
        (step, time, status): (usize, f64, Status),
        scene: &Scene,
        model: &Model,
        state: &State,
    ) {
        // Rods that are to stretch may be torn, too, where contacts leave no solution.
        let of_any = || {
            let closed = model.joints.iter().enumerate().filter(|(_, joint)| !model.is_open(joint));
            let gaps = closed.map(|(k, joint)| (k, stretch_gap(model, state, joint).norm() / joint.length));
            gaps.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|_| status == Status::Apart)
        };
        let rigid = widest_gap(model, state).filter(|&(_, gap)| gap > WIDE);
        let Some((joint, gap)) = rigid.or_else(of_any) else { return };
        let joint = &model.joints[joint];
        let widest = || (stretch_gap(model, state, joint).norm(), [joint.a, joint.b].map(|body| words(scene, body)));
        match noted {
            None => {
                let (widest_gap_m, between) = widest();
                *noted = Some(Self {
                    steps: 1,
                    first_step: step,
                    first_time_s: time,
                    widest_step: step,
                    widest_gap_m,
                    widest_gap_per_length: gap,
                    between,
                });
            }
            Some(noted) => {
                noted.steps += 1;
                if gap > noted.widest_gap_per_length {
                    (noted.widest_step, noted.widest_gap_per_length) = (step, gap);
                    (noted.widest_gap_m, noted.between) = widest();
                }
            }
        }
    }
}

/// A body of a joint that is apart, in words.
fn words(scene: &Scene, body: Body) -> String {
    if matches!(body, Body::Anchor(_)) { "what holds it".to_owned() } else { place(scene, body) }
}

impl Display for Apart {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self { steps, first_step, widest_step, between: [a, b], .. } = self;
        let time = number(self.first_time_s);
        match steps {
            1 => write!(f, "joints came apart in step {first_step} ({time} s)")?,
            _ => write!(
                f,
                "joints came apart, first in step {first_step} ({time} s), in {steps} steps in all; widest in step {widest_step}"
            )?,
        }
        match self.widest_gap_per_length > WIDE {
            true => write!(
                f,
                ": {} m, {} times the joint's length, between {a} and {b}",
                number(self.widest_gap_m),
                number(self.widest_gap_per_length)
            )?,
            // Such a step is taken back.
            false => write!(f, ", however short; rods stayed where they were before it")?,
        }
        write!(
            f,
            "; look whether what is held is led into something, or further than the rod reaches; if not, a smaller --dt may help"
        )
    }
}

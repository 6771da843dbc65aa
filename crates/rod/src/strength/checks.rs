//! Joints that can break in a model: checks, and what is asked of them.

use std::ops::Range;

use super::Strength;
use crate::measure::bend_strain;
use crate::{Body, Joint, JointForce, Model, ModelError, State};

impl Strength {
    /// What is asked of a joint that transmits a force.
    pub fn asked(model: &Model, state: &State, joint: &Joint, force: &JointForce) -> Self {
        Self {
            tension: force.tension(model, state, joint),
            moment: force.moment.xy().norm(),
            curvature: bend_strain(model, state, joint).xy().norm(),
        }
    }
}

impl Model {
    /// Whether a joint of a rod with these segments can break, those to what holds it included.
    pub fn can_break(&self, segments: &Range<usize>) -> bool {
        self.breakable.iter().any(|own| self.is_of(own.joint, segments))
    }

    /// Whether a joint has one of these segments.
    fn is_of(&self, joint: usize, segments: &Range<usize>) -> bool {
        let is_own = |body| matches!(body, Body::Segment(i) if segments.contains(&i));
        self.joints.get(joint).is_some_and(|joint| is_own(joint.a) || is_own(joint.b))
    }

    /// Checks the joints that can break.
    pub(crate) fn validate_strengths(&self) -> Result<(), ModelError> {
        let what = "joint that can break";
        for (index, own) in self.breakable.iter().enumerate() {
            if own.joint >= self.joints.len() {
                let count = self.joints.len();
                return Err(ModelError::Index { what, index, target: "joint", to: own.joint, count });
            }
            let value = |quantity, value, allowed| Err(ModelError::Value { what, index, quantity, value, allowed });
            if index > 0 && self.breakable[index - 1].joint >= own.joint {
                return value("joint", own.joint as f64, "more than that of the joint before");
            }
            let eyelets = self.sliding_joints.iter().map(|joint| &joint.segments);
            let mut threaded = eyelets.chain(self.pulleys.iter().map(|pulley| &pulley.segments));
            if threaded.any(|segments| self.is_of(own.joint, segments)) {
                return value("joint", own.joint as f64, "none of a rod that runs through an eyelet or over a pulley");
            }
            if let Some(&most) = own.strength.numbers().iter().find(|most| most.is_nan() || **most <= 0.0) {
                return value("strength", most, "> 0");
            }
        }
        Ok(())
    }
}

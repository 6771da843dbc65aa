//! What joints bear before they break, and how they broke.

use std::ops::Range;

use crate::measure::bend_strain;
use crate::{Body, Joint, JointForce, Model, ModelError, State};

/// What a joint bears. It breaks where a step would end with more than any of these, and transmits nothing from the start of that step on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strength {
    /// Tension, the pull along the rod [N].
    pub tension: f64,
    /// Bending moment, about both axes together [N m].
    pub moment: f64,
    /// Curvature beyond that of the rest shape [1/m].
    pub curvature: f64,
}

/// A joint of a model that can break.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BreakableJoint {
    /// Index of the joint.
    pub joint: usize,
    /// What it bears.
    pub strength: Strength,
}

/// How a joint broke.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Break {
    /// Index of the joint.
    pub joint: usize,
    /// Time up to which it held, the start of a step [s].
    pub time: f64,
    /// What the end of that step would have asked of it: tension [N], bending moment [N m] and curvature beyond rest [1/m].
    pub load: Strength,
}

impl Strength {
    /// A joint that never breaks.
    pub const UNLIMITED: Self = Self { tension: f64::INFINITY, moment: f64::INFINITY, curvature: f64::INFINITY };

    fn numbers(&self) -> [f64; 3] {
        [self.tension, self.moment, self.curvature]
    }

    /// The weaker of two in each.
    pub(crate) fn weaker(self, other: Self) -> Self {
        Self {
            tension: self.tension.min(other.tension),
            moment: self.moment.min(other.moment),
            curvature: self.curvature.min(other.curvature),
        }
    }

    /// What is asked of a joint that transmits a force.
    pub fn asked(model: &Model, state: &State, joint: &Joint, force: &JointForce) -> Self {
        Self {
            tension: force.tension(model, state, joint),
            moment: force.moment.xy().norm(),
            curvature: bend_strain(model, state, joint).xy().norm(),
        }
    }

    /// The largest share of what it bears that a load makes up, and of which it is: 0 the tension, 1 the moment, 2 the curvature. Above 1 it
    /// breaks.
    pub fn share(&self, load: &Self) -> (f64, usize) {
        let shares = load.numbers().into_iter().zip(self.numbers()).map(|(load, most)| load / most);
        let (of, share) = shares
            .enumerate()
            .fold((0, 0.0), |(of, worst), (k, share)| if share > worst { (k, share) } else { (of, worst) });
        (share, of)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_share_says_by_what_a_joint_breaks() {
        let strength = Strength { tension: 10.0, curvature: 2.0, ..Strength::UNLIMITED };
        let load = |tension, moment, curvature| Strength { tension, moment, curvature };
        assert_eq!(strength.share(&load(5.0, 1e9, 0.5)), (0.5, 0));
        assert_eq!(strength.share(&load(5.0, 1e9, 3.0)), (1.5, 2));
        // Pressed, it does not break by tension.
        assert_eq!(strength.share(&load(-50.0, 0.0, 0.0)).0, 0.0);
        assert_eq!(strength.weaker(load(20.0, 3.0, 1.0)), load(10.0, 3.0, 1.0));
    }
}

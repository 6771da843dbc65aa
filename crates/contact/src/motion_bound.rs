//! How far the axis of a segment moves at most.

use component::BodyPose;
use kernels::math::Vec3;

/// How the axis of a segment moves.
#[derive(Clone, Copy, Debug)]
pub struct MotionBound {
    /// Of its centre [m].
    pub linear: Vec3<f64>,
    /// By how much its ends move at most about the centre [m].
    pub turned: f64,
}

impl MotionBound {
    pub(super) const NONE: Self = Self { linear: Vec3([0.0; 3]), turned: 0.0 };

    /// From one pose to another, of an axis of half length `half` [m].
    pub fn between(from: &BodyPose<f64>, to: &BodyPose<f64>, half: f64) -> Self {
        Self { linear: to.x - from.x, turned: half * norm(to.q.axis() - from.q.axis()) }
    }

    /// This and then another one.
    fn and(self, other: Self) -> Self {
        Self { linear: self.linear + other.linear, turned: self.turned + other.turned }
    }

    /// By how much points of the axis move at most [m].
    pub(super) fn length(self) -> f64 {
        norm(self.linear) + self.turned
    }

    /// By how much points of this axis and of another that moves `other` come nearer at most [m].
    pub fn towards(self, other: Self) -> f64 {
        norm(self.linear - other.linear) + self.turned + other.turned
    }
}

/// How a segment's axis has moved.
#[derive(Clone, Copy, Debug)]
pub struct MotionBounds {
    /// Since the start of the step.
    pub moved: MotionBound,
    /// By the rods' own correction.
    pub correction: MotionBound,
}

impl MotionBounds {
    /// No motion.
    pub const NONE: Self = Self { moved: MotionBound::NONE, correction: MotionBound::NONE };

    /// Since the start of the step, and by the rods' own correction.
    pub fn corrected(&self) -> MotionBound {
        self.moved.and(self.correction)
    }
}

/// Length of a vector.
pub fn norm(v: Vec3<f64>) -> f64 {
    v.norm_squared().sqrt()
}

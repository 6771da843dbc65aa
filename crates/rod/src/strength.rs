//! What joints bear before they break, and how they broke.

mod checks;

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
    /// The time up to which it held [s], where it has broken: see [`crate::Model::set_time`].
    pub broke: Option<f64>,
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

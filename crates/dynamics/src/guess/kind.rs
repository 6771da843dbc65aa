//! The guesses without learning by name.

use std::fmt;
use std::str::FromStr;

use component::Members;
use jointed::linear::precondition::Frozen;
use jointed::topology::Topology;
use rod::Model;

use super::{Extrapolation, Fischer, FrozenGuess, InitialGuess, StepAdaptive, StepExtrapolation};

/// Where linear solves, or whole steps, begin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum GuessKind {
    /// At zero.
    #[default]
    Zero,
    /// Solves at the previous step's solution.
    Previous,
    /// Solves at the line through the last two.
    Linear,
    /// Solves at the parabola through the last three.
    Quadratic,
    /// Solves at the best combination of this many last solutions.
    Fischer(usize),
    /// Solves at the solution of the rest shape's system; a zero start where its factor would be too large.
    Frozen,
    /// Steps at what the previous step added to the prediction.
    StepPrevious,
    /// Steps at the line through what the last two added.
    StepLinear,
    /// Steps at the parabola through what the last three added.
    StepQuadratic,
    /// Steps at that parabola where it saves outer iterations, else at the prediction.
    StepAdaptive,
}

impl GuessKind {
    /// All of them, with the default depths.
    pub const ALL: [GuessKind; 10] = [
        Self::Zero,
        Self::Previous,
        Self::Linear,
        Self::Quadratic,
        Self::Fischer(Fischer::DEPTH),
        Self::Frozen,
        Self::StepPrevious,
        Self::StepLinear,
        Self::StepQuadratic,
        Self::StepAdaptive,
    ];

    /// Its name in files and flags, without the depth of a projection.
    pub fn name(self) -> &'static str {
        match self {
            Self::Zero => "zero",
            Self::Previous => "previous",
            Self::Linear => "linear",
            Self::Quadratic => "quadratic",
            Self::Fischer(_) => "fischer",
            Self::Frozen => "frozen",
            Self::StepPrevious => "step-previous",
            Self::StepLinear => "step-linear",
            Self::StepQuadratic => "step-quadratic",
            Self::StepAdaptive => "step-adaptive",
        }
    }

    /// Whether it starts whole steps, which formulation `newton` alone can use.
    pub fn helps_steps(self) -> bool {
        matches!(self, Self::StepPrevious | Self::StepLinear | Self::StepQuadratic | Self::StepAdaptive)
    }

    /// Sets the guess up for one connected set of segments; `None` for a zero start.
    pub fn build(self, model: &Model, members: &Members, topology: &Topology) -> Option<Box<dyn InitialGuess>> {
        let (bodies, joints) = (topology.bodies(), topology.joints.len());
        Some(match self {
            Self::Zero => return None,
            Self::Previous => Box::new(Extrapolation::new(0, joints)),
            Self::Linear => Box::new(Extrapolation::new(1, joints)),
            Self::Quadratic => Box::new(Extrapolation::new(2, joints)),
            Self::Fischer(depth) => Box::new(Fischer::new(depth, topology)),
            Self::Frozen => Box::new(FrozenGuess::new(Frozen::new(model, members, topology).ok()?)),
            Self::StepPrevious => Box::new(StepExtrapolation::new(0, bodies, joints)),
            Self::StepLinear => Box::new(StepExtrapolation::new(1, bodies, joints)),
            Self::StepQuadratic => Box::new(StepExtrapolation::new(2, bodies, joints)),
            Self::StepAdaptive => Box::new(StepAdaptive::new(bodies, joints)),
        })
    }
}

impl fmt::Display for GuessKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fischer(depth) if *depth != Fischer::DEPTH => write!(f, "fischer-{depth}"),
            kind => f.write_str(kind.name()),
        }
    }
}

impl FromStr for GuessKind {
    type Err = String;

    /// A name of the list, or "fischer-" and the number of solutions to project on (1 to 64).
    fn from_str(name: &str) -> Result<Self, String> {
        let depth = name.strip_prefix("fischer-").and_then(|depth| depth.parse().ok());
        if let Some(depth @ 1..=64) = depth {
            return Ok(Self::Fischer(depth));
        }
        let names = || Self::ALL.map(Self::name).join(", ");
        let found = Self::ALL.into_iter().find(|kind| kind.name() == name);
        found.ok_or_else(|| format!("expected one of {} (fischer-4: on the last 4 solutions)", names()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back() {
        for kind in GuessKind::ALL.into_iter().chain([GuessKind::Fischer(4)]) {
            assert_eq!(kind.to_string().parse(), Ok(kind));
        }
        for wrong in ["fischer-0", "fischer-65", "fischer-", "Zero", ""] {
            assert!(wrong.parse::<GuessKind>().unwrap_err().contains("step-linear"));
        }
    }
}

//! What is identified of a cable with branches.

use std::fmt;
use std::ops::{Index, IndexMut};

use crate::parameter::{Parameter, Parameters};
use crate::quantity::{Quantity, Range, Scale};
use crate::specimen;

/// A number of a cable with branches, global for all its recordings. At rest such a cable lies in a plane, its branches too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Number {
    /// A number of the parent.
    Parent(Parameter),
    /// Bending stiffness over mass per length of the branches, to that of the parent.
    BranchBending,
    /// Mass per length of the branches, to that of the parent.
    BranchMass,
    /// The side of the parent on which its branches leave it at rest: angle about its axis from d1 [rad].
    Side,
    /// Curvature of the parent at rest towards that side [1/m], from the start or a branch's beginning on to the next.
    Curvature(usize),
    /// Angle by which the parent bends at rest towards that side where a branch begins [rad].
    Kink(usize),
}

impl Number {
    /// The numbers of a cable with so many branches.
    pub fn all(branches: usize) -> Vec<Self> {
        use Parameter::{Bending, Grip, InnerDamping, OuterDamping, Roll, TiltX, TiltY, Twist};
        let parent = [Bending, Twist, InnerDamping, OuterDamping, TiltX, TiltY, Grip, Roll].map(Self::Parent);
        let curvatures = (0..=branches).map(Self::Curvature);
        let kinks = (0..branches).map(Self::Kink);
        let own = [Self::BranchBending, Self::BranchMass, Self::Side];
        parent.into_iter().chain(own).chain(curvatures).chain(kinks).collect()
    }
}

impl fmt::Display for Number {
    /// Its name; branches and the spans between them count from 1.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Parent(parameter) => parameter.fmt(f),
            Self::BranchBending => f.pad("branch-bending"),
            Self::BranchMass => f.pad("branch-mass"),
            Self::Side => f.pad("side"),
            Self::Curvature(span) => write!(f, "curvature-{}", span + 1),
            Self::Kink(branch) => write!(f, "kink-{}", branch + 1),
        }
    }
}

impl Quantity for Number {
    fn range(self) -> Range {
        let factor = |most: f64| Range { start: 1.0, least: 1.0 / most, most, scale: Scale::Logarithm };
        let unit = |most: f64| Range { start: 0.0, least: -most, most, scale: Scale::Unit(1.0) };
        match self {
            Self::Parent(parameter) => parameter.range(),
            Self::BranchBending => factor(100.0),
            Self::BranchMass => factor(20.0),
            Self::Side => unit(6.3),
            Self::Curvature(_) => unit(20.0),
            Self::Kink(_) => unit(1.5),
        }
    }

    fn unit(self) -> &'static str {
        match self {
            Self::Parent(parameter) => parameter.unit(),
            Self::BranchBending | Self::BranchMass => "1",
            Self::Curvature(_) => "1/m",
            Self::Side | Self::Kink(_) => "rad",
        }
    }

    fn may_be_left_out(self) -> bool {
        matches!(self, Self::Parent(parameter) if parameter.may_be_left_out())
    }
}

/// A value for each number.
#[derive(Clone, Debug, PartialEq)]
pub struct Numbers {
    /// Those of the parent; its curvatures are 0, and `curvatures` has them.
    pub parent: Parameters,
    /// [`Number::BranchBending`].
    pub branch_bending: f64,
    /// [`Number::BranchMass`].
    pub branch_mass: f64,
    /// [`Number::Side`].
    pub side: f64,
    /// [`Number::Curvature`] of each span, one more than there are branches.
    pub curvatures: Vec<f64>,
    /// [`Number::Kink`] of each branch.
    pub kinks: Vec<f64>,
}

impl Numbers {
    /// Where a search begins, with so many branches, all of which leave on this side [rad].
    pub fn start(branches: usize, side: f64) -> Self {
        let (curvatures, kinks) = (vec![0.0; branches + 1], vec![0.0; branches]);
        Self { parent: Parameters::default(), branch_bending: 1.0, branch_mass: 1.0, side, curvatures, kinks }
    }
}

impl Index<Number> for Numbers {
    type Output = f64;

    fn index(&self, number: Number) -> &f64 {
        match number {
            Number::Parent(parameter) => &self.parent[parameter],
            Number::BranchBending => &self.branch_bending,
            Number::BranchMass => &self.branch_mass,
            Number::Side => &self.side,
            Number::Curvature(span) => &self.curvatures[span],
            Number::Kink(branch) => &self.kinks[branch],
        }
    }
}

impl IndexMut<Number> for Numbers {
    fn index_mut(&mut self, number: Number) -> &mut f64 {
        match number {
            Number::Parent(parameter) => &mut self.parent[parameter],
            Number::BranchBending => &mut self.branch_bending,
            Number::BranchMass => &mut self.branch_mass,
            Number::Side => &mut self.side,
            Number::Curvature(span) => &mut self.curvatures[span],
            Number::Kink(branch) => &mut self.kinks[branch],
        }
    }
}

impl specimen::Numbers for Numbers {
    type Quantity = Number;

    /// Those that are searched for, and the drags.
    fn quantities(&self) -> Vec<Number> {
        let drags = [Parameter::DragAcross, Parameter::DragAlong].map(Number::Parent);
        Number::all(self.kinks.len()).into_iter().chain(drags).collect()
    }

    fn beginnings(&self) -> Vec<Self> {
        let with = |parent: Parameters| Self { parent, ..self.clone() };
        specimen::Numbers::beginnings(&self.parent).into_iter().map(with).collect()
    }
}

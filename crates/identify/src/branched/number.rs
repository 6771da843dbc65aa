//! What is identified of a cable with branches.

use crate::parameter::{Parameter, Parameters};

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

    /// Its name; branches and the spans between them count from 1.
    pub fn name(self) -> String {
        match self {
            Self::Parent(parameter) => parameter.name().to_owned(),
            Self::BranchBending => "branch-bending".to_owned(),
            Self::BranchMass => "branch-mass".to_owned(),
            Self::Side => "side".to_owned(),
            Self::Curvature(span) => format!("curvature-{}", span + 1),
            Self::Kink(branch) => format!("kink-{}", branch + 1),
        }
    }

    /// Its unit.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Parent(parameter) => parameter.unit(),
            Self::BranchBending | Self::BranchMass => "1",
            Self::Curvature(_) => "1/m",
            Self::Side | Self::Kink(_) => "rad",
        }
    }

    /// The least and the largest value that it may have.
    pub fn bounds(self) -> [f64; 2] {
        match self {
            Self::Parent(parameter) => parameter.bounds(),
            Self::BranchBending => [0.01, 100.0],
            Self::BranchMass => [0.05, 20.0],
            Self::Side => [-6.3, 6.3],
            Self::Curvature(_) => [-20.0, 20.0],
            Self::Kink(_) => [-1.5, 1.5],
        }
    }

    /// Whether its logarithm is searched for, so that its spread is a factor.
    pub fn is_logarithmic(self) -> bool {
        match self {
            Self::Parent(parameter) => parameter.is_logarithmic(),
            Self::BranchBending | Self::BranchMass => true,
            Self::Side | Self::Curvature(_) | Self::Kink(_) => false,
        }
    }

    /// The number that is searched for: the logarithm of `value`, or the value in its unit of search.
    pub fn coordinate(self, value: f64) -> f64 {
        match self {
            Self::Parent(parameter) => parameter.coordinate(value),
            _ if self.is_logarithmic() => value.ln(),
            _ => value,
        }
    }

    /// The value of a coordinate, within the bounds.
    pub fn value(self, coordinate: f64) -> f64 {
        let [least, most] = self.bounds();
        match self {
            Self::Parent(parameter) => parameter.value(coordinate),
            _ if self.is_logarithmic() => coordinate.exp().clamp(least, most),
            _ => coordinate.clamp(least, most),
        }
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

    /// The value of a number.
    pub fn get(&self, number: Number) -> f64 {
        match number {
            Number::Parent(parameter) => self.parent[parameter],
            Number::BranchBending => self.branch_bending,
            Number::BranchMass => self.branch_mass,
            Number::Side => self.side,
            Number::Curvature(span) => self.curvatures[span],
            Number::Kink(branch) => self.kinks[branch],
        }
    }

    /// Sets a number.
    pub fn set(&mut self, number: Number, value: f64) {
        let place = match number {
            Number::Parent(parameter) => &mut self.parent[parameter],
            Number::BranchBending => &mut self.branch_bending,
            Number::BranchMass => &mut self.branch_mass,
            Number::Side => &mut self.side,
            Number::Curvature(span) => &mut self.curvatures[span],
            Number::Kink(branch) => &mut self.kinks[branch],
        };
        *place = value;
    }
}

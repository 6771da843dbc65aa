//! What is identified of a cable with branches.

use crate::parameter::{Parameter, Parameters};

/// A number of a cable with branches, global for all its recordings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Number {
    /// A number of the parent.
    Parent(Parameter),
    /// Bending stiffness over mass per length of the branches, to that of the parent.
    BranchBending,
    /// Mass per length of the branches, to that of the parent.
    BranchMass,
    /// The side of the parent on which a branch leaves it: angle about the parent's axis from its d1 [rad].
    Side(usize),
    /// Angle [rad] by which the parent bends at rest about its d1 where a branch begins.
    Kink1(usize),
    /// The same about its d2.
    Kink2(usize),
}

impl Number {
    /// The numbers of a cable with so many branches.
    pub fn all(branches: usize) -> Vec<Self> {
        let own = (0..branches).flat_map(|k| [Self::Side(k), Self::Kink1(k), Self::Kink2(k)]);
        let parent = Parameter::DEFAULT.map(Self::Parent);
        parent.into_iter().chain([Self::BranchBending, Self::BranchMass]).chain(own).collect()
    }

    /// Its name; branches count from 1.
    pub fn name(self) -> String {
        match self {
            Self::Parent(parameter) => parameter.name().to_owned(),
            Self::BranchBending => "branch-bending".to_owned(),
            Self::BranchMass => "branch-mass".to_owned(),
            Self::Side(branch) => format!("side-{}", branch + 1),
            Self::Kink1(branch) => format!("kink-{}-1", branch + 1),
            Self::Kink2(branch) => format!("kink-{}-2", branch + 1),
        }
    }

    /// Its unit.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Parent(parameter) => parameter.unit(),
            Self::BranchBending | Self::BranchMass => "1",
            Self::Side(_) | Self::Kink1(_) | Self::Kink2(_) => "rad",
        }
    }

    /// The least and the largest value that it may have.
    pub fn bounds(self) -> [f64; 2] {
        match self {
            Self::Parent(parameter) => parameter.bounds(),
            Self::BranchBending => [0.01, 100.0],
            Self::BranchMass => [0.05, 20.0],
            Self::Side(_) => [-6.3, 6.3],
            Self::Kink1(_) | Self::Kink2(_) => [-1.5, 1.5],
        }
    }

    /// The number that is searched for: the logarithm of `value`, or the value in its unit of search.
    pub fn coordinate(self, value: f64) -> f64 {
        match self {
            Self::Parent(parameter) => parameter.coordinate(value),
            Self::BranchBending | Self::BranchMass => value.ln(),
            Self::Side(_) | Self::Kink1(_) | Self::Kink2(_) => value,
        }
    }

    /// The value of a coordinate, within the bounds.
    pub fn value(self, coordinate: f64) -> f64 {
        let [least, most] = self.bounds();
        match self {
            Self::Parent(parameter) => parameter.value(coordinate),
            Self::BranchBending | Self::BranchMass => coordinate.exp().clamp(least, most),
            Self::Side(_) | Self::Kink1(_) | Self::Kink2(_) => coordinate.clamp(least, most),
        }
    }
}

/// A value for each number.
#[derive(Clone, Debug, PartialEq)]
pub struct Numbers {
    /// Those of the parent.
    pub parent: Parameters,
    /// [`Number::BranchBending`].
    pub branch_bending: f64,
    /// [`Number::BranchMass`].
    pub branch_mass: f64,
    /// [`Number::Side`], [`Number::Kink1`] and [`Number::Kink2`] of each branch.
    pub branches: Vec<[f64; 3]>,
}

impl Numbers {
    /// Where a search begins, with branches that leave on these sides [rad].
    pub fn start(sides: &[f64]) -> Self {
        let branches = sides.iter().map(|&side| [side, 0.0, 0.0]).collect();
        Self { parent: Parameters::default(), branch_bending: 1.0, branch_mass: 1.0, branches }
    }

    /// The value of a number.
    pub fn get(&self, number: Number) -> f64 {
        match number {
            Number::Parent(parameter) => self.parent[parameter],
            Number::BranchBending => self.branch_bending,
            Number::BranchMass => self.branch_mass,
            Number::Side(branch) => self.branches[branch][0],
            Number::Kink1(branch) => self.branches[branch][1],
            Number::Kink2(branch) => self.branches[branch][2],
        }
    }

    /// Sets a number.
    pub fn set(&mut self, number: Number, value: f64) {
        match number {
            Number::Parent(parameter) => self.parent[parameter] = value,
            Number::BranchBending => self.branch_bending = value,
            Number::BranchMass => self.branch_mass = value,
            Number::Side(branch) => self.branches[branch][0] = value,
            Number::Kink1(branch) => self.branches[branch][1] = value,
            Number::Kink2(branch) => self.branches[branch][2] = value,
        }
    }
}

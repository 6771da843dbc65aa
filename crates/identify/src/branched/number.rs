//! What is identified of a cable with branches.

use std::fmt;
use std::ops::{Index, IndexMut, Range};

use nalgebra::Vector3;

use super::Tree;
use crate::parameter::{Parameter, Parameters};
use crate::quantity::{self, Quantity, Scale};
use crate::specimen;

/// A number of a cable with branches, global for all its recordings. Junctions are the parent's markers between the grips where branches
/// begin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Number {
    /// A number of the parent.
    Parent(Parameter),
    /// Bending stiffness over mass per length of a branch, to that of the parent.
    BranchBending(usize),
    /// Mass per length of a branch, to that of the parent.
    BranchMass(usize),
    /// The side of the parent on which the first branch of a junction leaves it at rest, from that on which it is seen in the mean
    /// ([`Number::Seen`]): angle about the parent's axis [rad].
    Side(usize),
    /// Curvature of the parent at rest towards the side of the first junction [1/m], from a grip or a junction on to the next.
    Curvature(usize),
    /// Where a marker of the parent between the grips lies beside the rod [m]: in the frame of its segment, along d1 (axis 0), d2 (1) and
    /// d3 (2). A branch that hangs there lies beside its rod with it. It is not searched for, but the mean over the frames of a recording,
    /// and the middle one of all recordings.
    Beside {
        /// 0 to 2.
        axis: usize,
        /// The marker.
        marker: usize,
    },
    /// The side on which recordings show the first branch of a junction in the mean, were the parent not twisted, and after the last
    /// junction the mean twist between the grips [rad]: the twist in the first frame is counted from it, as markers do not tell whole
    /// turns. It is not searched for.
    Seen(usize),
}

impl Number {
    /// Those of such a cable that are searched for.
    pub fn all(tree: &Tree) -> Vec<Self> {
        use Parameter::{Bending, Grip, InnerDamping, OuterDamping, Roll, TiltX, TiltY, Twist};
        let (junctions, branches) = (tree.junctions().len(), tree.branches.len());
        let parent = [Bending, Twist, InnerDamping, OuterDamping, TiltX, TiltY, Grip, Roll].map(Self::Parent);
        let own = (0..branches).flat_map(|branch| [Self::BranchBending(branch), Self::BranchMass(branch)]);
        let (sides, curvatures) = ((0..junctions).map(Self::Side), (0..=junctions).map(Self::Curvature));
        parent.into_iter().chain(own).chain(sides).chain(curvatures).collect()
    }
}

impl fmt::Display for Number {
    /// Its name; branches and junctions count from 1, markers from 0.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (name, index) = match self {
            Self::Parent(parameter) => return parameter.fmt(f),
            Self::BranchBending(branch) => ("branch-bending", branch),
            Self::BranchMass(branch) => ("branch-mass", branch),
            Self::Side(junction) => ("side", junction),
            Self::Curvature(span) => ("curvature", span),
            Self::Beside { axis, marker } => return f.pad(&format!("beside-{}-at-{marker}", axis + 1)),
            Self::Seen(place) => ("seen", place),
        };
        f.pad(&format!("{name}-{}", index + 1))
    }
}

impl Quantity for Number {
    fn range(self) -> quantity::Range {
        let factor = |most: f64| quantity::Range { start: 1.0, least: 1.0 / most, most, scale: Scale::Logarithm };
        let unit = |most: f64| quantity::Range { start: 0.0, least: -most, most, scale: Scale::Unit(1.0) };
        match self {
            Self::Parent(parameter) => parameter.range(),
            Self::BranchBending(_) => factor(1000.0),
            Self::BranchMass(_) => factor(20.0),
            Self::Side(_) | Self::Seen(_) => unit(6.3),
            Self::Curvature(_) => unit(20.0),
            Self::Beside { .. } => unit(0.1),
        }
    }

    fn unit(self) -> &'static str {
        match self {
            Self::Parent(parameter) => parameter.unit(),
            Self::BranchBending(_) | Self::BranchMass(_) => "1",
            Self::Curvature(_) => "1/m",
            Self::Beside { .. } => "m",
            Self::Side(_) | Self::Seen(_) => "rad",
        }
    }

    fn may_be_left_out(self) -> bool {
        matches!(self, Self::Parent(parameter) if parameter.may_be_left_out())
    }

    fn is_averaged(self) -> bool {
        matches!(self, Self::Beside { .. })
    }

    fn prior(self) -> Option<f64> {
        match self {
            Self::Parent(Parameter::Roll) => Some(0.5),
            Self::Parent(_) => None,
            Self::BranchBending(_) => Some(1.0),
            Self::BranchMass(_) => Some(0.5),
            Self::Side(_) => Some(0.5),
            Self::Beside { .. } => Some(0.02),
            Self::Curvature(_) => Some(2.0),
            Self::Seen(_) => None,
        }
    }
}

/// A value for each number.
#[derive(Clone, Debug, PartialEq)]
pub struct Numbers {
    /// Those of the parent; its curvatures are 0.
    pub parent: Parameters,
    /// [`Number::BranchBending`] and [`Number::BranchMass`] of each branch.
    pub branches: Vec<[f64; 2]>,
    /// [`Number::Side`] of each junction.
    pub sides: Vec<f64>,
    /// [`Number::Curvature`] of each span, one more than there are junctions.
    pub curvatures: Vec<f64>,
    /// [`Number::Beside`] of each marker, 0 of those that are not between the grips.
    pub beside: Vec<Vector3<f64>>,
    /// [`Number::Seen`] of each junction, and that of the end's grip.
    pub seen: Vec<f64>,
    /// The markers of the parent between the grips.
    between: Range<usize>,
    /// Those that are searched for.
    all: Vec<Number>,
}

impl Numbers {
    /// Where a search for such a cable begins, with [`Numbers::seen`], one more than there are junctions: each branch leaves on the side
    /// on which it is seen.
    ///
    /// # Panics
    /// If there are more or fewer.
    pub fn start(tree: &Tree, seen: &[f64]) -> Self {
        let junctions = tree.junctions().len();
        assert_eq!(seen.len(), junctions + 1, "one for each junction, and one for the end's grip");
        Self {
            parent: Parameters::default(),
            branches: vec![[1.0; 2]; tree.branches.len()],
            sides: vec![0.0; junctions],
            curvatures: vec![0.0; junctions + 1],
            beside: vec![Vector3::zeros(); tree.count()],
            seen: seen.to_vec(),
            between: tree.between(),
            all: Number::all(tree),
        }
    }

    /// The side towards which the parent bends at rest: angle about its axis from d1 [rad].
    pub fn plane(&self) -> f64 {
        self.sides.first().map_or(0.0, |side| self.seen[0] + side)
    }
}

impl Index<Number> for Numbers {
    type Output = f64;

    fn index(&self, number: Number) -> &f64 {
        match number {
            Number::Parent(parameter) => &self.parent[parameter],
            Number::BranchBending(branch) => &self.branches[branch][0],
            Number::BranchMass(branch) => &self.branches[branch][1],
            Number::Side(junction) => &self.sides[junction],
            Number::Curvature(span) => &self.curvatures[span],
            Number::Beside { axis, marker } => &self.beside[marker][axis],
            Number::Seen(place) => &self.seen[place],
        }
    }
}

impl IndexMut<Number> for Numbers {
    fn index_mut(&mut self, number: Number) -> &mut f64 {
        match number {
            Number::Parent(parameter) => &mut self.parent[parameter],
            Number::BranchBending(branch) => &mut self.branches[branch][0],
            Number::BranchMass(branch) => &mut self.branches[branch][1],
            Number::Side(junction) => &mut self.sides[junction],
            Number::Curvature(span) => &mut self.curvatures[span],
            Number::Beside { axis, marker } => &mut self.beside[marker][axis],
            Number::Seen(place) => &mut self.seen[place],
        }
    }
}

impl specimen::Numbers for Numbers {
    type Quantity = Number;

    /// Those that are searched for, the drags, what was seen, and where markers lie.
    fn quantities(&self) -> Vec<Number> {
        let drags = [Parameter::DragAcross, Parameter::DragAlong].map(Number::Parent);
        let seen = (0..self.seen.len()).map(Number::Seen);
        let beside = self.between.clone().flat_map(|marker| (0..3).map(move |axis| Number::Beside { axis, marker }));
        self.all.iter().copied().chain(drags).chain(seen).chain(beside).collect()
    }

    fn beginnings(&self) -> Vec<Self> {
        let with = |parent: Parameters| Self { parent, ..self.clone() };
        specimen::Numbers::beginnings(&self.parent).into_iter().map(with).collect()
    }
}

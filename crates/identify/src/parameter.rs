//! What is identified of a cable: numbers, global for all its recordings.

use std::fmt;
use std::ops::{Index, IndexMut};

use crate::quantity::{Quantity, Range, Scale};
use crate::specimen::Numbers;

/// A number of a cable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Parameter {
    /// Bending stiffness over mass per length, EI / (rho A) [m^4/s^2]. Markers tell ratios to the mass alone.
    Bending,
    /// Stiffness of twist over that of bending, GJ / EI.
    Twist,
    /// Relaxation time of bending and twist (Kelvin-Voigt) [s].
    InnerDamping,
    /// Rate at which velocities decay [1/s].
    OuterDamping,
    /// Drag across the axis: deceleration over the square of the velocity [1/m].
    DragAcross,
    /// Drag along the axis: deceleration over the square of the velocity [1/m].
    DragAlong,
    /// Curvature at rest about d1 [1/m], in the mean over the cable.
    Curvature1,
    /// Curvature at rest about d2 [1/m], in the mean over the cable.
    Curvature2,
    /// By how much the curvature about d1 is greater at the end, and less at the start, than half-way [1/m].
    Slope1,
    /// The same about d2 [1/m].
    Slope2,
    /// By how much the curvature about d1 is less half-way than in the mean [1/m]; at both ends it is greater by twice as much.
    Bow1,
    /// The same about d2 [1/m].
    Bow2,
    /// Tilt of the recordings' vertical towards x [rad].
    TiltX,
    /// Tilt of the recordings' vertical towards y [rad].
    TiltY,
    /// Compliance of the grips: length of cable [m] that would bend and twist as much.
    Grip,
    /// Turn of the end's grip about the rod's axis [rad]. Where it is 0, a rod that hangs in a plane of x and z is not twisted.
    Roll,
    /// A section that bends unlike about its axes: EI is that of `Bending` times exp(h) about one axis across the rod and times exp(-h)
    /// about the other. With the angle a from d1 to the first this is h cos 2a; where it and `Sides2` are 0 it bends alike.
    Sides1,
    /// See [`Parameter::Sides1`]: h sin 2a.
    Sides2,
    /// Twist at rest [rad/m].
    RestTwist,
    /// Bending stiffness that strands add while they stick to each other, over EI, which is that of slipping strands
    /// ([`StrandFriction`](cosserat::assembly::StrandFriction)).
    StrandStiffness,
    /// Curvature over which strands begin to slip [1/m]: the moment of friction over the stiffness that sticking strands add.
    StrandSlip,
    /// Stiffness of bending and twist that relaxes, over that which stays ([`MaxwellBranch`](cosserat::assembly::MaxwellBranch)).
    Relaxing,
    /// Relaxation time of that stiffness [s].
    RelaxationTime,
    /// By how much the curvature at rest about d1 (axis 0) or d2 (axis 1) is greater [1/m] at so many tenths of the cable, 0 to 10, linear in
    /// between. [`Parameter::local`] has all that there are; to ask for the value of another panics.
    Local {
        /// 0 or 1.
        axis: u8,
        /// 0 to 10.
        tenth: u8,
    },
}

/// Those that are one number for the whole cable, with their names.
const WHOLE: [(Parameter, &str); 23] = [
    (Parameter::Bending, "bending"),
    (Parameter::Twist, "twist"),
    (Parameter::InnerDamping, "inner-damping"),
    (Parameter::OuterDamping, "outer-damping"),
    (Parameter::DragAcross, "drag-across"),
    (Parameter::DragAlong, "drag-along"),
    (Parameter::Curvature1, "curvature-1"),
    (Parameter::Curvature2, "curvature-2"),
    (Parameter::Slope1, "slope-1"),
    (Parameter::Slope2, "slope-2"),
    (Parameter::Bow1, "bow-1"),
    (Parameter::Bow2, "bow-2"),
    (Parameter::TiltX, "tilt-x"),
    (Parameter::TiltY, "tilt-y"),
    (Parameter::Grip, "grip"),
    (Parameter::Roll, "roll"),
    (Parameter::Sides1, "sides-1"),
    (Parameter::Sides2, "sides-2"),
    (Parameter::RestTwist, "rest-twist"),
    (Parameter::StrandStiffness, "strand-stiffness"),
    (Parameter::StrandSlip, "strand-slip"),
    (Parameter::Relaxing, "relaxing"),
    (Parameter::RelaxationTime, "relaxation-time"),
];
/// Places of [`Parameter::Local`] along the cable.
pub(crate) const PLACES: usize = 11;

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Local { axis, tenth } => f.pad(&format!("curvature-{}-at-{tenth}", axis + 1)),
            whole => f.pad(WHOLE[whole.index()].1),
        }
    }
}

impl Parameter {
    /// What is searched for unless more is asked for: all but the drags, which fast motion in the air alone can tell, and what round
    /// cables that were made straight do not have.
    pub const DEFAULT: [Self; 12] = [
        Self::Bending,
        Self::Twist,
        Self::InnerDamping,
        Self::OuterDamping,
        Self::Curvature1,
        Self::Curvature2,
        Self::Bow1,
        Self::Bow2,
        Self::TiltX,
        Self::TiltY,
        Self::Grip,
        Self::Roll,
    ];
    /// Number of parameters.
    pub const COUNT: usize = WHOLE.len() + 2 * PLACES;

    /// All of them, in the order in which they are told.
    pub fn all() -> impl Iterator<Item = Self> {
        WHOLE.into_iter().map(|(whole, _)| whole).chain(Self::local())
    }

    /// A curvature of its own for each tenth of the cable, about both axes.
    pub fn local() -> impl Iterator<Item = Self> {
        (0..2 * PLACES).map(|k| Self::Local { axis: (k / PLACES) as u8, tenth: (k % PLACES) as u8 })
    }

    /// Where it stands among all.
    pub fn index(self) -> usize {
        match self {
            Self::Local { axis, tenth } => WHOLE.len() + usize::from(axis) * PLACES + usize::from(tenth),
            whole => WHOLE.iter().position(|(own, _)| *own == whole).unwrap_or_default(),
        }
    }
}

impl Quantity for Parameter {
    fn range(self) -> Range {
        use Scale::{Logarithm, Unit};
        match self {
            Self::Bending => Range { start: 0.02, least: 1e-5, most: 100.0, scale: Logarithm },
            Self::Twist => Range { start: 0.7, least: 0.01, most: 100.0, scale: Logarithm },
            Self::InnerDamping => Range { start: 0.02, least: 1e-4, most: 10.0, scale: Logarithm },
            Self::OuterDamping => Range { start: 0.3, least: 1e-3, most: 100.0, scale: Logarithm },
            Self::DragAcross => Range { start: 0.1, least: 1e-3, most: 100.0, scale: Logarithm },
            Self::DragAlong => Range { start: 0.01, least: 1e-3, most: 100.0, scale: Logarithm },
            Self::Curvature1 | Self::Curvature2 | Self::Slope1 | Self::Slope2 | Self::Bow1 | Self::Bow2 => {
                Range { start: 0.0, least: -20.0, most: 20.0, scale: Unit(1.0) }
            }
            Self::Local { .. } => Range { start: 0.0, least: -20.0, most: 20.0, scale: Unit(1.0) },
            Self::TiltX | Self::TiltY => Range { start: 0.0, least: -0.3, most: 0.3, scale: Unit(0.1) },
            Self::Grip => Range { start: 0.01, least: 1e-4, most: 0.5, scale: Logarithm },
            Self::Roll => Range { start: 0.0, least: -6.3, most: 6.3, scale: Unit(1.0) },
            Self::Sides1 | Self::Sides2 => Range { start: 0.0, least: -1.5, most: 1.5, scale: Unit(1.0) },
            Self::RestTwist => Range { start: 0.0, least: -20.0, most: 20.0, scale: Unit(1.0) },
            Self::StrandStiffness => Range { start: 0.3, least: 1e-3, most: 100.0, scale: Logarithm },
            Self::StrandSlip => Range { start: 1.0, least: 1e-3, most: 100.0, scale: Logarithm },
            Self::Relaxing => Range { start: 0.3, least: 1e-3, most: 100.0, scale: Logarithm },
            Self::RelaxationTime => Range { start: 0.5, least: 1e-3, most: 100.0, scale: Logarithm },
        }
    }

    fn unit(self) -> &'static str {
        match self {
            Self::Bending => "m^4/s^2",
            Self::Twist | Self::Sides1 | Self::Sides2 | Self::StrandStiffness | Self::Relaxing => "1",
            Self::InnerDamping | Self::RelaxationTime => "s",
            Self::OuterDamping => "1/s",
            Self::DragAcross | Self::DragAlong | Self::Curvature1 | Self::Curvature2 => "1/m",
            Self::Slope1 | Self::Slope2 | Self::Bow1 | Self::Bow2 => "1/m",
            Self::TiltX | Self::TiltY | Self::Roll => "rad",
            Self::Local { .. } | Self::StrandSlip => "1/m",
            Self::RestTwist => "rad/m",
            Self::Grip => "m",
        }
    }

    fn may_be_left_out(self) -> bool {
        !Self::DEFAULT.contains(&self)
    }

    fn prior(self) -> Option<f64> {
        match self {
            // Solid rods have 0.65 to 0.77.
            Self::Twist => Some(1.0),
            Self::OuterDamping | Self::Grip => Some(2.0),
            Self::StrandStiffness | Self::StrandSlip | Self::Relaxing | Self::RelaxationTime => Some(2.0),
            Self::Curvature1 | Self::Curvature2 | Self::Bow1 | Self::Bow2 => Some(3.0),
            Self::TiltX | Self::TiltY | Self::Local { .. } => Some(1.0),
            _ => None,
        }
    }
}

/// A value for each parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters([f64; Parameter::COUNT]);

impl Default for Parameters {
    /// Where searches begin, without what may be left out.
    fn default() -> Self {
        let mut parameters = Self([0.0; Parameter::COUNT]);
        Parameter::DEFAULT.into_iter().for_each(|parameter| parameters[parameter] = parameter.start());
        parameters
    }
}

impl Index<Parameter> for Parameters {
    type Output = f64;

    fn index(&self, parameter: Parameter) -> &f64 {
        &self.0[parameter.index()]
    }
}

impl IndexMut<Parameter> for Parameters {
    fn index_mut(&mut self, parameter: Parameter) -> &mut f64 {
        &mut self.0[parameter.index()]
    }
}

/// Bending stiffnesses [m^4/s^2] from which a search may begin.
pub(crate) const BEGINNINGS: [f64; 4] = [0.005, 0.02, 0.08, 0.3];
/// Compliances of the grips [m] from which it may begin: in rigid grips no derivative leads to soft ones.
const GRIPS: [f64; 2] = [0.01, 0.1];

impl Numbers for Parameters {
    type Quantity = Parameter;

    fn quantities(&self) -> Vec<Parameter> {
        Parameter::all().collect()
    }

    fn check(&self) -> Result<(), String> {
        let has = |parameter: Parameter| self[parameter] != 0.0;
        let both = [Parameter::StrandStiffness, Parameter::StrandSlip, Parameter::Relaxing, Parameter::RelaxationTime]
            .map(has);
        match both {
            [a, b, ..] if a != b => Err("strand-stiffness and strand-slip go together: --law hysteresis".to_owned()),
            [.., a, b] if a != b => Err("relaxing and relaxation-time go together: --law viscoelastic".to_owned()),
            [true, _, true, _] => Err("hysteresis and viscoelastic do not go together; choose one".to_owned()),
            _ => Ok(()),
        }
    }

    fn groups(&self) -> Vec<(&'static str, Vec<Parameter>)> {
        vec![
            ("curvatures", Parameter::local().collect()),
            ("hysteresis", vec![Parameter::StrandStiffness, Parameter::StrandSlip]),
            ("viscoelastic", vec![Parameter::Relaxing, Parameter::RelaxationTime]),
        ]
    }

    fn beginnings(&self) -> Vec<Self> {
        let with = |bending: f64, grip: f64| {
            let mut parameters = *self;
            parameters[Parameter::Bending] = bending;
            parameters[Parameter::Grip] = grip;
            parameters
        };
        let all = BEGINNINGS.iter().flat_map(|&bending| GRIPS.map(|grip| with(bending, grip)));
        std::iter::once(*self).chain(all).collect()
    }
}

//! Which equations an outer iteration linearises, and how contacts enter it.

use std::fmt;
use std::str::FromStr;

/// The formulation of the projection.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Formulation {
    /// The paper's extended position-based dynamics: `dp = M^-1 J^T dlambda`, the momentum residual is dropped.
    Xpbd,
    /// `Xpbd` with geometric stiffness in the rotational mass: stable for slack rods under tension.
    #[default]
    XpbdGeometric,
    /// Momentum residual and geometric stiffness: implicit Euler, solved to the end.
    Newton,
}

impl Formulation {
    /// All of them.
    pub const ALL: [Formulation; 3] = [Formulation::Xpbd, Formulation::XpbdGeometric, Formulation::Newton];

    /// Whether the mass matrix holds the geometric stiffness.
    #[inline(always)]
    pub fn geometric(self) -> bool {
        self != Formulation::Xpbd
    }

    /// Whether the momentum residual is part of the equations, so that any start of a step is corrected.
    #[inline(always)]
    pub fn momentum(self) -> bool {
        self == Formulation::Newton
    }

    /// Its name in files and flags.
    pub fn name(self) -> &'static str {
        match self {
            Formulation::Xpbd => "xpbd",
            Formulation::XpbdGeometric => "xpbd-geometric",
            Formulation::Newton => "newton",
        }
    }
}

impl fmt::Display for Formulation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Formulation {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let names = || Self::ALL.map(Formulation::name).join(", ");
        Self::ALL.into_iter().find(|f| f.name() == name).ok_or_else(|| format!("expected one of {}", names()))
    }
}

/// How contacts enter an outer iteration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ContactProjection {
    /// Together with the rods: contacts see how the joints answer their impulses.
    #[default]
    Coupled,
    /// After the rods, with the masses of the bodies alone: line 11 of Algorithm 1 (paper, section 3).
    Alternating,
}

impl ContactProjection {
    /// All of them.
    pub const ALL: [ContactProjection; 2] = [ContactProjection::Coupled, ContactProjection::Alternating];

    /// Its name in files and flags.
    pub fn name(self) -> &'static str {
        match self {
            ContactProjection::Coupled => "coupled",
            ContactProjection::Alternating => "alternating",
        }
    }
}

impl fmt::Display for ContactProjection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for ContactProjection {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let names = || Self::ALL.map(ContactProjection::name).join(", ");
        Self::ALL.into_iter().find(|p| p.name() == name).ok_or_else(|| format!("expected one of {}", names()))
    }
}

//! Which equations an outer iteration linearises, with which matrix, and how contacts enter it.

pub use component::Formulation;
use names::names;

/// Which matrix formulation `newton` iterates with. The solution is the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tangent {
    /// That of the other two which takes less work, found out step by step: each connected set counts the iterations of both.
    /// Sets without an exact tangent and those with another solver than the direct one take the positive one.
    #[default]
    Auto,
    /// Positive definite: how the torques of joints change as segments turn is left out, but for the stiffness of pulls.
    Positive,
    /// The exact one ([`jointed::tangent`]), on chains and trees, and on rings that nothing can touch: fewer iterations, each of which
    /// costs about a third more.
    Exact,
}

names!(Tangent { Auto = "auto", Positive = "positive", Exact = "exact" });

/// How contacts enter an outer iteration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ContactProjection {
    /// Together with the rods: contacts see how the joints answer their impulses.
    #[default]
    Coupled,
    /// After the rods, with the masses of the bodies alone: line 11 of Algorithm 1 (paper, section 3).
    Alternating,
}

names!(ContactProjection { Coupled = "coupled", Alternating = "alternating" });

//! What a joint leaves free or yields to.

/// Which turns of its two bodies against each other a joint leaves free: it transmits no moment about them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Freedom {
    /// None: it bends and twists as its compliances say.
    #[default]
    None,
    /// All: a ball joint, a pinned support.
    Ball,
    /// Those about the axis d3 of body a: a hinge, measured from rest ([`crate::Joint::rest_frames`]). Bend compliance is that about the
    /// other two axes.
    Hinge,
    /// All, and all ways: it has broken, and transmits nothing.
    Broken,
}

/// Stiffness of a grip or a support: springs between what is held and what holds it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Springs {
    /// Along the axes d1, d2 and d3 of the joint's body a [N/m]; infinite where it does not yield.
    pub force: [f64; 3],
    /// Of bending about the axes d1 and d2 of the joint's rows and of twist about their d3 [N m/rad]; infinite where it does
    /// not yield.
    pub moment: [f64; 3],
}

impl Springs {
    /// Springs that do not yield.
    pub const RIGID: Self = Self { force: [f64::INFINITY; 3], moment: [f64::INFINITY; 3] };
}

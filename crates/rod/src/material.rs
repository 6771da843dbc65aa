//! Materials, and how joints made of them resist stretch and lose energy.

/// A linearly elastic, isotropic rod material (paper, section 3.1: the edge features Y and T, the node feature rho).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Young's modulus Y [Pa]: bending, and stretch where [`Stretch::Physical`] is chosen.
    pub youngs_modulus: f64,
    /// Torsion (shear) modulus T [Pa]: twist, and shear where [`Stretch::Physical`] is chosen.
    pub torsion_modulus: f64,
    /// Density rho [kg/m^3].
    pub density: f64,
}

/// How a joint resists stretch and shear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stretch {
    /// The same compliance in all directions [m/N]; the paper's rods use 1e-10, in effect "zero stretch".
    Compliance(f64),
    /// The material's own: l / (Y A) along the rod, l / (k T A) across it, with the shear factor k = 9/10 of a circle.
    Physical,
}

impl Stretch {
    /// Compliance of a rod that is stiff against stretch whatever its material [m/N].
    pub const ZERO_STRETCH: Stretch = Stretch::Compliance(1e-10);
    /// Timoshenko's shear correction factor of a full circular section.
    pub const SHEAR_FACTOR: f64 = 0.9;
}

/// Springs to the ground along a rod (a Winkler foundation): soil, tissue, glue. Each point is pulled to where it is drawn by a force per length
/// that is proportional to its way.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Foundation {
    /// Stiffness per length across the rod as drawn [N/m^2]; 0 without.
    pub across: f64,
    /// The same along the rod.
    pub along: f64,
    /// Relaxation time of the damping beside the springs, their force over the rate over their stiffness [s].
    pub damping: f64,
}

/// Inner damping (Kelvin-Voigt): a strain that changes is resisted by its stiffness times a relaxation time tau times its
/// rate, so that a free vibration of circular frequency omega has the damping ratio `omega tau / 2`. Rigid motion loses nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct InnerDamping {
    /// Relaxation time of bending [s].
    pub bending: f64,
    /// Relaxation time of twist [s].
    pub twist: f64,
    /// Relaxation time of stretch and shear [s].
    pub stretch: f64,
}

impl InnerDamping {
    /// None at all.
    pub const NONE: InnerDamping = InnerDamping { bending: 0.0, twist: 0.0, stretch: 0.0 };
}

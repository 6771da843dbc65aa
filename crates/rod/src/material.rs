//! Materials, circular sections and the compliances that follow from them.

use std::f64::consts::PI;

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

/// A full circular section.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Section {
    /// Radius r [m].
    pub radius: f64,
}

impl Section {
    /// Area A = pi r^2 [m^2].
    pub fn area(self) -> f64 {
        PI * self.radius.powi(2)
    }

    /// Second moment of area I = pi r^4 / 4 [m^4].
    pub fn second_moment(self) -> f64 {
        PI * self.radius.powi(4) / 4.0
    }

    /// Polar moment of area J = 2 I [m^4].
    pub fn polar_moment(self) -> f64 {
        2.0 * self.second_moment()
    }

    /// Bending stiffness B = Y I [N m^2].
    pub fn bending_stiffness(self, material: &Material) -> f64 {
        material.youngs_modulus * self.second_moment()
    }

    /// Torsional stiffness C = T J [N m^2].
    pub fn torsional_stiffness(self, material: &Material) -> f64 {
        material.torsion_modulus * self.polar_moment()
    }
}

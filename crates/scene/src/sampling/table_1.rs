//! The paper's two scenarios of Table 1.

use super::number::number;
use crate::defaults;
use crate::random::Random;

/// Steps of a sampled rod or helix (Table 1: t in [0, 50 dt]).
pub const STEPS: usize = 50;

/// Parameters of an initially straight bending rod.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rod {
    /// Number of segments N.
    pub segments: usize,
    /// Young's modulus Y, and torsion modulus [Pa].
    pub youngs_modulus: f64,
    /// Initial angle phi_0 above the horizontal [degrees].
    pub angle_deg: f64,
    /// Length l [m].
    pub length: f64,
    /// Radius of the section [m].
    pub radius: f64,
    /// Density [kg/m^3].
    pub density: f64,
}

/// Parameters of an elastic helix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Helix {
    /// Number of segments N.
    pub segments: usize,
    /// Torsion modulus T, and Young's modulus [Pa]: the paper gives T alone, we take Y = T as in its knot.
    pub torsion_modulus: f64,
    /// Radius HR of the helix [m].
    pub helix_radius: f64,
    /// Height HH of the helix [m].
    pub helix_height: f64,
    /// Winding number HW [turns].
    pub winding: f64,
    /// Radius of the section [m].
    pub radius: f64,
    /// Density [kg/m^3].
    pub density: f64,
}

impl Default for Rod {
    /// N = 30, l = 4 m, Y = 1e5 Pa, phi_0 = 0 (paper, supplement).
    fn default() -> Self {
        Self {
            segments: 30,
            youngs_modulus: 1e5,
            angle_deg: 0.0,
            length: 4.0,
            radius: defaults::RADIUS,
            density: defaults::DENSITY,
        }
    }
}

impl Default for Helix {
    /// N = 60, HR = HH = 0.5 m, HW = 2.5, T = 1e5 Pa (paper, supplement).
    fn default() -> Self {
        Self {
            segments: 60,
            torsion_modulus: 1e5,
            helix_radius: 0.5,
            helix_height: 0.5,
            winding: 2.5,
            radius: defaults::RADIUS,
            density: defaults::DENSITY,
        }
    }
}

impl Rod {
    /// Sample `index` of `seed` from Table 1: N in 10..=55, Y log-uniform in 1e4..1e6 Pa, phi_0 in 0..45 degrees,
    /// l in 1..5 m.
    pub fn sample(seed: u64, index: u64) -> Self {
        let mut random = Random::new(seed, index);
        Self {
            segments: random.whole(10, 55),
            youngs_modulus: 10f64.powf(random.uniform(4.0, 6.0)),
            angle_deg: random.uniform(0.0, 45.0),
            length: random.uniform(1.0, 5.0),
            ..Self::default()
        }
    }
}

impl Helix {
    /// Sample `index` of `seed` from Table 1: N in 45..=105, T log-uniform in 1e4..1e6 Pa, HR and HH in 0.4..0.6 m,
    /// HW in 2..3.
    pub fn sample(seed: u64, index: u64) -> Self {
        let mut random = Random::new(seed, index);
        Self {
            segments: random.whole(45, 105),
            torsion_modulus: 10f64.powf(random.uniform(4.0, 6.0)),
            helix_radius: random.uniform(0.4, 0.6),
            helix_height: random.uniform(0.4, 0.6),
            winding: random.uniform(2.0, 3.0),
            ..Self::default()
        }
    }
}

impl Rod {
    /// The text of a scene file.
    pub(super) fn to_toml(self) -> String {
        let (angle, length) = (number(self.angle_deg), number(self.length));
        let shape = format!("straight]\nangle_deg = {angle}\nlength_m = {length}\nsegments = {}", self.segments);
        text(self.youngs_modulus, self.radius, self.density, &shape)
    }
}

impl Helix {
    /// The text of a scene file.
    pub(super) fn to_toml(self) -> String {
        let (radius, height, winding) = (number(self.helix_radius), number(self.helix_height), number(self.winding));
        let shape = format!(
            "helix]\nradius_m = {radius}\nheight_m = {height}\nwinding = {winding}\nsegments = {}",
            self.segments
        );
        text(self.torsion_modulus, self.radius, self.density, &shape)
    }
}

/// The text of a scene file with one rod, its first segment fixed; `shape` is the rest of its shape's table.
fn text(modulus: f64, radius: f64, density: f64, shape: &str) -> String {
    format!(
        "bending = \"paper\"\nrun = {{ dt_s = {}, steps = {}, integrator = \"euler\" }}\n\n[[rods]]\nradius_m = {}\nyoungs_modulus_pa = {}\n\
         density_kg_m3 = {}\nclamp = [\"start-segment\"]\n\n[rods.shape.{shape}\n",
        number(defaults::DT),
        STEPS,
        number(radius),
        number(modulus),
        number(density)
    )
}

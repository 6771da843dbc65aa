//! Values of what a scene file leaves out; the paper fixes some and leaves the others open.

/// Time step [s] (paper, section 4).
pub const DT: f64 = 0.02;
/// Number of steps (paper: averages over runs of 100 steps).
pub const STEPS: usize = 100;
/// Gravitational acceleration [m/s^2] along world -z; not in the paper.
pub const GRAVITY: f64 = 9.81;
/// Radius of a rod [m]; not in the paper, chosen so that Y matters for rods of 1 to 5 m.
pub const RADIUS: f64 = 0.05;
/// Density [kg/m^3]; not in the paper, chosen as the radius is.
pub const DENSITY: f64 = 100.0;
/// Young's modulus [Pa] (paper, supplement: Y of the rod). The torsion modulus is Young's modulus unless given: the
/// paper's knot has Y = T, its rods name only Y and its helices only T.
pub const YOUNGS_MODULUS: f64 = 1e5;

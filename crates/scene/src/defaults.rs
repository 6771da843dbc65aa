//! Values of what a scene file leaves out; the paper fixes some and leaves the others open.

/// Time step [s] (paper, section 4).
pub const DT: f64 = 0.02;
/// Number of steps (paper: averages over runs of 100 steps).
pub const STEPS: usize = 100;
/// Gravitational acceleration [m/s^2] along world -z; not in the paper.
pub const GRAVITY: f64 = 9.81;
/// Density of the air [kg/m^3], dry, at sea level and 20 degrees (International Standard Atmosphere: 1.225 at 15).
pub const AIR_DENSITY: f64 = 1.2;
/// Drag coefficient across a cylinder's axis: 1.0 to 1.2 at Reynolds numbers of 1e3 to 2e5, those of twigs and branches in
/// wind (Hoerner, Fluid-Dynamic Drag, 1965, chapter 3).
pub const NORMAL_DRAG: f64 = 1.1;
/// Drag coefficient along a cylinder's axis, on the frontal area 2 r l: pi times a turbulent skin friction of about 0.003
/// on the wetted area 2 pi r l (Hoerner, chapter 2).
pub const TANGENTIAL_DRAG: f64 = 0.01;
/// Distance from gust to gust [m]; ours: a few times the size of a small tree.
pub const GUST_LENGTH: f64 = 10.0;
/// Time in which gusts change [s]; ours.
pub const GUST_TIME: f64 = 5.0;
/// Radius of a rod [m]; not in the paper, chosen so that Y matters for rods of 1 to 5 m.
pub const RADIUS: f64 = 0.05;
/// Density [kg/m^3]; not in the paper, chosen as the radius is.
pub const DENSITY: f64 = 100.0;
/// Young's modulus [Pa] (paper, supplement: Y of the rod). The torsion modulus is Young's modulus unless given: the
/// paper's knot has Y = T, its rods name only Y and its helices only T.
pub const YOUNGS_MODULUS: f64 = 1e5;

//! Rods that touch the ground and each other.

use cosserat::assembly::{Assembly, Contacts, Friction, Material, Obstacle, ObstacleShape, RodSpec, Surface, shape};
use cosserat::simulation::Formulation;
use nalgebra::{Unit, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::case::{Case, case};
use super::cases::GRAVITY;

/// Number of rods in the pile.
pub const PILE_RODS: usize = 1000;

/// Soft rubber.
const RUBBER: Material = Material { youngs_modulus: 1e7, torsion_modulus: 4e6, density: 1000.0 };

/// The case in which segments touch each other, the ground z = 0 and these walls alike, which are given by points [m] on them
/// and normals out of them; contacts take energy alone.
fn touching(
    name: String,
    mut assembly: Assembly,
    dt: f64,
    friction: f64,
    walls: &[(Vector3<f64>, Vector3<f64>)],
) -> Case {
    let surface = Surface { friction: Friction::new(friction), restitution: 0.0 };
    let half_space = |&(point, normal): &(Vector3<f64>, Vector3<f64>)| {
        let normal = Unit::new_normalize(normal);
        Obstacle::new(ObstacleShape::HalfSpace { point, normal }, surface)
    };
    let obstacles = [(Vector3::zeros(), Vector3::z())].iter().chain(walls).map(half_space).collect();
    assembly.model_mut().contacts = Contacts { between_segments: Some(surface), obstacles, ..Contacts::default() };
    case(name, assembly, dt, 50)
}

/// Eight layers of three parallel rods, crosswise, with gaps of a twentieth of a radius below each.
pub(super) fn stack() -> Case {
    let (radius, length) = (0.02, 0.5);
    let mut assembly = Assembly::new(GRAVITY);
    for layer in 0..8 {
        let (along, across) = if layer % 2 == 0 { (Vector3::x(), Vector3::y()) } else { (Vector3::y(), Vector3::x()) };
        let height = radius * (1.0 + 2.05 * f64::from(layer) + 0.05);
        for rod in -1..=1 {
            let start = across * (0.18 * f64::from(rod)) - along * (0.5 * length) + Vector3::z() * height;
            assembly.rod(&RodSpec::new(shape::straight(start, along, length, 5), radius, RUBBER));
        }
    }
    touching("stacked rods: 8 layers of 3".to_owned(), assembly, 0.01, 0.5, &[])
}

/// A rod that is a little tilted and falls onto the ground at 50 m/s.
pub(super) fn impact() -> Case {
    let mut assembly = Assembly::new(GRAVITY);
    let start = Vector3::new(0.0, 0.0, 0.5);
    assembly.rod(&RodSpec::new(shape::straight(start, Vector3::new(1.0, 0.0, 0.1), 1.0, 20), 0.01, RUBBER));
    assembly.state_mut().velocities.fill(Vector3::new(0.0, 0.0, -50.0));
    touching("a rod falls at 50 m/s".to_owned(), assembly, 0.02, 0.3, &[])
}

/// [`PILE_RODS`] short rods fall from a grid of columns between four walls: they lie anyhow in their layers, tilted by
/// 15 degrees at most, so that the layers can be close together without an overlap.
pub(super) fn pile() -> Case {
    const COLUMNS: usize = 10;
    let (radius, length, spacing) = (0.02, 0.2, 0.26);
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut uniform = |low: f64, high: f64| low + (high - low) * (random.next_u32() as f64 / 2_f64.powi(32));
    let mut assembly = Assembly::new(GRAVITY);
    for k in 0..PILE_RODS {
        let cell = Vector3::new(k % COLUMNS, k / COLUMNS % COLUMNS, k / (COLUMNS * COLUMNS)).map(|x| x as f64 + 0.5);
        let jitter = Vector3::new(uniform(-0.005, 0.005), uniform(-0.005, 0.005), uniform(-0.005, 0.005));
        let centre = cell.component_mul(&Vector3::new(spacing, spacing, 0.11)) + jitter;
        let (turn, tilt) = (uniform(0.0, std::f64::consts::TAU), uniform(-0.26, 0.26));
        let direction = Vector3::new(tilt.cos() * turn.cos(), tilt.cos() * turn.sin(), tilt.sin());
        let nodes = shape::straight(centre - direction * (0.5 * length), direction, length, 3 + k % 2);
        assembly.rod(&RodSpec::new(nodes, radius, RUBBER));
    }
    let far = COLUMNS as f64 * spacing;
    let walls = [Vector3::x(), Vector3::y()].map(|axis| [(Vector3::zeros(), axis), (axis * far, -axis)]);
    let pile = touching(format!("{PILE_RODS} rods in a pile"), assembly, 0.01, 0.4, walls.as_flattened());
    Case { formulations: &[Formulation::Newton], ..pile }
}

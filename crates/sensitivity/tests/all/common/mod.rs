//! Rods, trees and rings of the tests.
#![allow(missing_docs, unreachable_pub)]

use nalgebra::Vector3;
use rod::{Assembly, Material, Model, RodSpec, State, shape};

pub const GRAVITY: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

pub fn material(youngs_modulus: f64, density: f64) -> Material {
    Material { youngs_modulus, torsion_modulus: youngs_modulus, density }
}

/// A straight rod along x, its first segment fixed.
pub fn rod(length: f64, segments: usize, radius: f64, material: Material) -> (Model, State) {
    let mut assembly = Assembly::new(GRAVITY);
    let nodes = shape::straight(Vector3::zeros(), Vector3::x(), length, segments);
    let rod = assembly.rod(&RodSpec::new(nodes, radius, material));
    assembly.fix(rod.start);
    assembly.finish()
}

/// A helix whose two ends are clamped to the ground.
pub fn helix(segments: usize) -> (Model, State) {
    let mut assembly = Assembly::new(GRAVITY);
    let nodes = shape::helix(Vector3::zeros(), 0.3, 0.8, 2.5, segments);
    let rod = assembly.rod(&RodSpec::new(nodes, 0.03, material(1e5, 500.0)));
    assembly.clamp_start(&rod).clamp_end(&rod);
    assembly.finish()
}

/// A trunk with a fork and a branch of a branch, clamped at its foot.
pub fn tree() -> (Model, State) {
    let mut assembly = Assembly::new(GRAVITY);
    let line = |from: Vector3<f64>, direction, n| {
        RodSpec::new(shape::straight(from, direction, 0.15 * n as f64, n), 0.02, material(1e6, 700.0))
    };
    let trunk = assembly.rod(&line(Vector3::zeros(), Vector3::z(), 6));
    assembly.clamp_start(&trunk);
    for (parent, fraction, direction) in [(2, 1.0, Vector3::new(1.0, 0.2, 0.5)), (2, 0.5, Vector3::new(-1.0, 0.0, 1.0))]
    {
        let from = Vector3::new(0.0, 0.0, 0.15 * (parent as f64 + fraction));
        let branch = assembly.rod(&line(from, direction, 4));
        assembly.branch(parent, fraction, &branch);
        let twig = assembly.rod(&line(from + direction.normalize() * 0.3, Vector3::y(), 3));
        assembly.branch(branch.start + 1, 1.0, &twig);
    }
    assembly.finish()
}

/// A free ring with physical stretch that flies and turns.
pub fn ring() -> (Model, State) {
    let mut assembly = Assembly::new(GRAVITY);
    let nodes = shape::ring(Vector3::zeros(), 0.5, 14);
    let spec =
        RodSpec { closed: true, stretch: rod::Stretch::Physical, ..RodSpec::new(nodes, 0.03, material(1e5, 400.0)) };
    assembly.rod(&spec);
    let (model, mut state) = assembly.finish();
    for (i, v) in state.velocities.iter_mut().enumerate() {
        *v = Vector3::new(0.0, 0.3 * (i as f64).sin(), 1.0);
    }
    (model, state)
}

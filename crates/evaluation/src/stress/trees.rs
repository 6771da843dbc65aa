//! Rods that branch, and wind.

use nalgebra::Vector3;
use rod::{Air, Assembly, Material, RodSpec, Wind, shape};

use super::cases::GRAVITY;
use super::{Case, case};

/// A trunk of 100 segments with 1,000 branches of 5 segments, 10 at each of its segments, in all directions.
pub(super) fn branches() -> Case {
    let mut assembly = Assembly::new(GRAVITY);
    let wood = Material { youngs_modulus: 1e8, torsion_modulus: 4e7, density: 600.0 };
    let trunk = assembly.rod(&RodSpec::new(shape::straight(Vector3::zeros(), Vector3::z(), 10.0, 100), 0.1, wood));
    assembly.fix(trunk.start);
    for k in 0..1000 {
        let (parent, angle) = (trunk.start + k % 100, k as f64 * 2.399_963);
        let start = assembly.state_mut().positions[parent];
        let direction = Vector3::new(angle.cos(), angle.sin(), 0.5);
        let branch = assembly.rod(&RodSpec::new(shape::straight(start, direction, 1.0, 5), 0.01, wood));
        assembly.branch(parent, 0.5, &branch);
    }
    case("tree of 1,000 branches", assembly, 0.02, 50)
}

/// A tree of 70 rods: a trunk, 9 branches on it and 60 twigs on those, in wind of 60 m/s.
pub(super) fn storm() -> Case {
    let mut assembly = Assembly::new(GRAVITY);
    let wood = Material { youngs_modulus: 4e9, torsion_modulus: 5e8, density: 700.0 };
    let rod = |start, direction, length: f64, radius| {
        RodSpec::new(shape::straight(start, direction, length, (length / 0.065) as usize), radius, wood)
    };
    let trunk = assembly.rod(&rod(Vector3::zeros(), Vector3::z(), 4.0, 0.03));
    assembly.clamp_start(&trunk);
    let mut parents = vec![trunk];
    for k in 1..70 {
        let parent = &parents[if k < 10 { 0 } else { k % 9 + 1 }];
        // Anywhere in the upper half of the parent.
        let on = parent.start + parent.len() / 2 + k % (parent.len() / 2);
        let angle = k as f64 * 2.399_963;
        let (length, radius) = if k < 10 { (2.0, 0.012) } else { (0.7, 0.003) };
        let state = assembly.state_mut();
        let direction = state.axis(on) + Vector3::new(angle.cos(), angle.sin(), 1.0);
        let start = state.positions[on];
        let branch = assembly.rod(&rod(start, direction, length, radius));
        assembly.branch(on, 0.5, &branch);
        parents.push(branch);
    }
    let wind = Wind::steady(Vector3::new(60.0, 0.0, 0.0));
    assembly.air(Air { density: 1.2, normal_drag: 1.1, tangential_drag: 0.01, wind });
    case("70-rod tree, wind of 60 m/s", assembly, 0.02, 100)
}

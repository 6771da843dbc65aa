//! Who can touch whom, in closed form.

use nalgebra::Vector3;
use rod::{Assembly, Material, RodSpec, Surface, shape};

use super::*;

/// A straight rod of segments 0.02 m long.
fn straight(start: [f64; 3], segments: usize, radius: f64) -> RodSpec {
    let material = Material { youngs_modulus: 1e5, torsion_modulus: 1e5, density: 100.0 };
    RodSpec::new(shape::straight(start.into(), Vector3::x(), 0.02 * segments as f64, segments), radius, material)
}

fn touching(mut assembly: Assembly) -> Model {
    assembly.model_mut().contacts.between_segments = Some(Surface::default());
    assembly.finish().0
}

#[test]
fn neighbours_within_half_a_circumference_never_touch() {
    let mut assembly = Assembly::new(Vector3::zeros());
    assembly.rod(&straight([0.0; 3], 30, 0.05));
    let filter = PairFilter::new(&touching(assembly));
    // Between segments i and i + k lie k - 1 segments; pi * 0.05 m is 0.157 m.
    for (a, k) in (0..20).flat_map(|a| (1..10).map(move |k| (a, k))) {
        let between = 0.02 * f64::from(k - 1);
        assert_eq!(filter.contains(a, a + k), between > std::f64::consts::PI * 0.05, "{a} {k}");
    }
}

#[test]
fn distances_go_through_joints_and_take_the_mean_radius() {
    let mut assembly = Assembly::new(Vector3::zeros());
    let trunk = assembly.rod(&straight([0.0; 3], 10, 0.05));
    let twig = assembly.rod(&straight([0.1, 0.0, 0.0], 10, 0.01));
    assembly.branch(trunk.start + 4, 1.0, &twig);
    let filter = PairFilter::new(&touching(assembly));
    // Of trunk segment 9 four segments lie before the branch: 0.08 m, and pi * 0.03 m is 0.094 m.
    assert!(!filter.contains(9, 10) && filter.contains(9, 11));
    // Segment 4 holds the branch itself.
    assert!(!filter.contains(4, 14) && filter.contains(4, 15));
}

#[test]
fn one_of_two_must_move_and_obstacles_come_last() {
    let mut assembly = Assembly::new(Vector3::zeros());
    assembly.rod(&straight([0.0; 3], 2, 0.001));
    assembly.rod(&straight([0.0, 1.0, 0.0], 2, 0.001));
    assembly.fix(0).fix(2);
    let mut model = touching(assembly);
    let filter = PairFilter::new(&model);
    assert!(!filter.contains(0, 1), "joined");
    assert!(!filter.contains(0, 2), "both fixed");
    assert!(filter.contains(0, 3) && filter.contains(1, 2) && filter.contains(1, 3));
    assert!(!filter.contains(0, 4) && filter.contains(1, 4) && !filter.contains(4, 5), "4 and 5 are obstacles");
    assert!(filter.has_pairs(0));
    model.contacts.between_segments = None;
    let filter = PairFilter::new(&model);
    assert!(!filter.contains(1, 3) && filter.contains(1, 4));
    assert!(!filter.has_pairs(0) && filter.has_pairs(1));
}

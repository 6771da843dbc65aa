//! Whether segments pass through each other is found by brute force, where they do and nowhere else.

use cosserat::assembly::{Assembly, Material, RodSpec, shape};
use cosserat::state::{Model, State};
use evaluation::passing::passing;
use nalgebra::Vector3;

/// Two rods of two segments of 1 m along x and y: the first begins at -`from` [m] along its axis and so does the second, `height`
/// [m] above.
fn crosswise(from: f64, height: f64, joined: bool) -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::zeros());
    let material = Material { youngs_modulus: 1e6, torsion_modulus: 1e6, density: 1000.0 };
    let rods = [(Vector3::x(), 0.0), (Vector3::y(), height)].map(|(along, height)| {
        let start = Vector3::z() * height - along * from;
        assembly.rod(&RodSpec::new(shape::straight(start, along, 2.0, 2), 0.01, material))
    });
    if joined {
        assembly.join(rods[0].start, 1.0, rods[1].start, 1.0);
    }
    assembly.finish()
}

#[test]
fn what_jumps_through_is_found_and_what_goes_by_is_not() {
    let (model, before) = crosswise(0.7, 0.2, false);
    let at = |height: f64| crosswise(0.7, height, false).1;
    assert!(passing(&model, &before, &before).is_empty());
    assert!(passing(&model, &before, &at(0.1)).is_empty());
    assert_eq!(passing(&model, &before, &at(-0.2)), [[0, 2]]);
    // Down beside it, away along it, and through its second segment.
    let aside = |shift: Vector3<f64>| {
        let mut state = before.clone();
        state.positions[2..].iter_mut().for_each(|x| *x += shift);
        state
    };
    assert!(passing(&model, &aside(Vector3::x() * 2.0), &aside(Vector3::new(2.0, 0.0, -1.0))).is_empty());
    assert!(passing(&model, &before, &aside(Vector3::x() * 3.0)).is_empty());
    assert_eq!(passing(&model, &aside(Vector3::x()), &aside(Vector3::new(1.0, 0.0, -1.0))), [[1, 2]]);
}

#[test]
fn what_is_joined_at_one_place_is_left_out() {
    let (apart, before) = crosswise(0.999, 1e-3, false);
    let (joined, after) = crosswise(0.999, -1e-3, true);
    assert!(!passing(&apart, &before, &after).is_empty());
    assert!(passing(&joined, &before, &after).is_empty());
}

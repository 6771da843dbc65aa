//! What validation finds in a model and a state made by hand.

use nalgebra::{Quaternion, Unit, UnitQuaternion, Vector3};
use rod::{Assembly, Material, Model, Obstacle, ObstacleShape, RodSpec, State, Surface, measure, shape};

/// A straight rod of four segments, clamped at one face.
fn clamped() -> (Model, State) {
    let material = Material { youngs_modulus: 1e5, torsion_modulus: 1e5, density: 100.0 };
    let mut assembly = Assembly::new(Vector3::zeros());
    let nodes = shape::straight(Vector3::zeros(), Vector3::x(), 1.0, 4);
    let rod = assembly.rod(&RodSpec::new(nodes, 0.05, material));
    assembly.clamp_start(&rod);
    assembly.finish()
}

/// What validation says after `change`.
fn error(change: impl FnOnce(&mut Model, &mut State)) -> String {
    let (mut model, mut state) = clamped();
    model.validate(&state).unwrap();
    change(&mut model, &mut state);
    model.validate(&state).expect_err("a mistake").to_string()
}

/// The orientation, its quaternion stretched.
fn stretched(q: &UnitQuaternion<f64>, by: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::new_unchecked(q.into_inner() * by)
}

#[test]
fn a_segment_s_rod_is_below_the_number_of_segments() {
    for rod in [4, 1_000_000_000_000, usize::MAX] {
        let found = error(|model, _| model.segments[2].rod = rod);
        assert_eq!(found, format!("segment 2: rod {rod} does not exist (there are 4)"));
    }
    let (mut model, state) = clamped();
    model.segments[2].rod = 3;
    model.validate(&state).unwrap();
    assert_eq!(measure::rod_lengths(&model, &state).len(), 4);
}

#[test]
fn orientations_are_of_unit_length() {
    for by in [0.0, 0.5, 1.0 - 1e-5, 1.0 + 1e-5, 3.0] {
        let found = error(|_, state| state.orientations[3] = stretched(&state.orientations[3], by));
        let text = "segment 3: norm of the orientation = ";
        assert!(found.starts_with(text) && found.ends_with(", but it must be 1 to within 1e-6"), "{found}");
        let found = error(|model, _| model.anchors[0].orientation = stretched(&model.anchors[0].orientation, by));
        assert!(found.starts_with("anchor 0: norm of the orientation = "), "{found}");
    }
    let nan = UnitQuaternion::new_unchecked(Quaternion::new(f64::NAN, 0.0, 0.0, 0.0));
    let found = error(|_, state| state.orientations[1] = nan);
    assert_eq!(found, "segment 1: orientation = NaN, but it must be finite");
    // Rounding, in double precision and in single.
    let (model, mut state) = clamped();
    for by in [1.0 - 1e-15, 1.0 + 1e-7] {
        state.orientations[1] = stretched(&state.orientations[1], by);
        model.validate(&state).unwrap();
    }
}

#[test]
fn a_plane_s_normal_is_of_unit_length() {
    let found = error(|model, _| {
        let normal = Unit::new_unchecked(Vector3::new(0.0, 0.0, 2.0));
        let shape = ObstacleShape::HalfSpace { point: Vector3::zeros(), normal };
        model.contacts.obstacles.push(Obstacle::new(shape, Surface::default()));
    });
    assert_eq!(found, "obstacle 0: length of the normal = 2, but it must be 1 to within 1e-6");
}

//! Several equilibria of the same grips.

use std::f64::consts::PI;

use acceptance::Beam;
use cosserat::assembly::{Assembly, RestShape, RodSpec, Section};
use cosserat::state::State;
use cosserat::statics::{Branch, BranchParams, StaticError, branches};
use nalgebra::{UnitQuaternion, Vector3};

fn stable(found: &[Branch]) -> Vec<&Branch> {
    for Branch { energy, unstable, neutral, state } in found {
        let middle = state.positions[state.len() / 2];
        println!("{energy:.10e} unstable {unstable} neutral {neutral} middle {:?}", middle.as_slice());
    }
    assert!(found.windows(2).all(|pair| pair[0].energy <= pair[1].energy));
    found.iter().filter(|branch| branch.unstable == 0).collect()
}

fn assert_mirrored(a: &Branch, b: &Branch, length: f64, mirrored: impl Fn(Vector3<f64>) -> Vector3<f64>) {
    assert!((a.energy - b.energy).abs() <= 1e-10 * a.energy.abs(), "{:e} {:e}", a.energy, b.energy);
    let positions = |state: &State| state.positions.clone();
    for (x, y) in positions(&a.state).into_iter().zip(positions(&b.state)) {
        assert!((mirrored(x) - y).norm() < 1e-6 * length, "{x} {y}");
    }
}

/// A slack cable whose ends are turned against each other by half a turn: one way or the other, with the same energy.
#[test]
fn half_a_turn_has_two_branches_of_the_twist() {
    let beam = Beam::rubber(30);
    for sign in [1.0, -1.0] {
        // An arc of length 1 that sags by a good deal.
        let half = 1.2_f64;
        let node = |k: usize| {
            let angle = half * (2.0 * k as f64 / 30.0 - 1.0);
            Vector3::new(angle.sin(), 0.0, -angle.cos()) * (0.5 / half)
        };
        let nodes: Vec<_> = (0..=30).map(node).collect();
        let cable = |twist: f64| {
            let mut assembly = Assembly::new(Vector3::z() * -beam.gravity_for(20.0));
            let spec = RodSpec::new(nodes.clone(), beam.radius, beam.material);
            let rod = assembly.rod(&RodSpec { rest: RestShape::Straight, twist, ..spec });
            assembly.clamp_start(&rod).clamp_end(&rod);
            assembly.finish()
        };
        let (mut model, state) = cable(sign * PI * 29.0 / 30.0);
        // The faces stand as those of the plane cable, but for half a turn.
        model.anchors = cable(0.0).0.anchors;
        model.anchors[1].orientation *= UnitQuaternion::from_axis_angle(&Vector3::z_axis(), PI);
        let found = branches(&model, &state, &BranchParams::default()).unwrap();
        println!("{} solves", found.solves);
        let stable = stable(&found.branches);
        assert!(stable.len() >= 2);
        let mirror = |x: Vector3<f64>| Vector3::new(x.x, -x.y, x.z);
        assert_mirrored(stable[0], stable[1], 1.0, mirror);
        // From one at rest, from which nothing leads away, both are found, too.
        let again = branches(&model, &stable[0].state, &BranchParams::default()).unwrap();
        let lowest = again.branches.iter().filter(|branch| branch.unstable == 0).take(2);
        for (branch, known) in lowest.zip([stable[0], stable[1]]) {
            assert!((branch.energy - known.energy).abs() <= 1e-10 * known.energy.abs(), "{:e}", branch.energy);
        }
        assert!(again.branches.iter().filter(|branch| branch.unstable == 0).count() >= 2);
        // They are not one: the cable stands out to one side or to the other.
        let apart = |branch: &Branch| branch.state.orientations[15];
        assert!(apart(stable[0]).angle_to(&apart(stable[1])) > 1.0);
    }
}

/// A strip that is pushed together bends to the one side or to the other.
#[test]
fn a_buckled_strut_has_its_mirror_image() {
    let beam = Beam::rubber(40);
    let mut assembly = Assembly::new(Vector3::zeros());
    let sections = vec![Section::Rectangle { width: 0.05, height: 0.002 }];
    let spec = beam.spec(Vector3::zeros(), Vector3::x());
    let rod = assembly.rod(&RodSpec { sections, d1: Some(Vector3::z()), ..spec });
    assembly.clamp_start(&rod).clamp_end(&rod);
    let (mut model, state) = assembly.finish();
    model.anchors[1].position.x -= 0.02;
    let found = branches(&model, &state, &BranchParams::default()).unwrap();
    println!("{} solves", found.solves);
    let stable = stable(&found.branches);
    assert!(stable.len() >= 2);
    assert!(stable[0].state.positions[20].y.abs() > 0.05);
    let mirror = |x: Vector3<f64>| Vector3::new(x.x, -x.y, x.z);
    assert_mirrored(stable[0], stable[1], 1.0, mirror);
    assert!(!stable[0].neutral);
}

/// A round strut may bend to any side: that is one family.
#[test]
fn shapes_that_a_free_motion_joins_are_told_once() {
    let beam = Beam::rubber(20);
    let (mut assembly, rod) = beam.cantilever(Vector3::zeros());
    let euler = PI.powi(2) * beam.bending() / (4.0 * beam.length.powi(2));
    assembly.load(beam.end_load(&rod, Vector3::x() * (-1.5 * euler), Vector3::zeros()));
    let (model, state) = assembly.finish();
    let found = branches(&model, &state, &BranchParams::default()).unwrap();
    let stable = stable(&found.branches);
    assert_eq!(stable.len(), 1);
    assert!(stable[0].neutral);
    // The straight one is there, too, unstable to both sides.
    assert!(found.branches.iter().any(|branch| branch.unstable == 2));
}

#[test]
fn what_has_no_energy_and_what_is_not_joined_is_refused() {
    let beam = Beam::rubber(4);
    let (mut assembly, rod) = beam.cantilever(Vector3::zeros());
    assembly.load(beam.end_load(&rod, Vector3::zeros(), Vector3::y()));
    let (model, state) = assembly.finish();
    let error = branches(&model, &state, &BranchParams::default()).unwrap_err();
    assert!(matches!(error, StaticError::Branches(what) if what.contains("torques")), "{error}");

    let mut two = Assembly::new(Vector3::zeros());
    for y in [0.0, 1.0] {
        let rod = two.rod(&beam.spec(Vector3::y() * y, Vector3::x()));
        two.clamp_start(&rod);
    }
    let (model, state) = two.finish();
    let error = branches(&model, &state, &BranchParams::default()).unwrap_err();
    assert!(matches!(error, StaticError::Branches(what) if what.contains("joined")), "{error}");
}

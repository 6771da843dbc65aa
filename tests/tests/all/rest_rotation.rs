//! Bending measured from a rest rotation: a joint is as stiff as its material says, whatever its angle at rest.

use acceptance::tight;
use cosserat::assembly::{Assembly, Load, Material, RodSpec, Section, shape};
use cosserat::state::{Model, State, StrainMeasure, measure};
use cosserat::statics::{StaticParams, equilibrium};
use nalgebra::{UnitQuaternion, Vector3};

const MATERIAL: Material = Material { youngs_modulus: 1e7, torsion_modulus: 3e6, density: 1000.0 };
const LENGTH: f64 = 0.1;

/// A fixed segment along x, and a branch of one segment at `angle` [rad] to it in the plane of x and z.
fn branch(angle: f64, section: Section, d1: Option<Vector3<f64>>, from_rest: bool) -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::zeros());
    let line = |from: Vector3<f64>, to: Vector3<f64>| RodSpec {
        sections: vec![section],
        ..RodSpec::new(shape::straight(from, to, LENGTH, 1), 0.01, MATERIAL)
    };
    let trunk = assembly.rod(&line(Vector3::zeros(), Vector3::x()));
    let direction = Vector3::new(angle.cos(), 0.0, angle.sin());
    let twig = assembly.rod(&RodSpec { d1, ..line(Vector3::x() * LENGTH, direction) });
    assembly.branch(trunk.start, 1.0, &twig).fix(trunk.start);
    let (mut model, state) = assembly.finish();
    if from_rest {
        model.measure_from_rest();
    }
    (model, state)
}

/// Stiffness [N m] of the branch's joint against a small torque about `axis`.
fn stiffness((mut model, mut state): (Model, State), axis: Vector3<f64>) -> f64 {
    let first = state.orientations[1];
    let torque = 1e-6 * LENGTH / model.joints[0].bend_compliance / LENGTH.powi(2);
    model.loads.push(Load { segment: 1, offset: 0.0, force: Vector3::zeros(), torque: axis * torque, follows: false });
    assert!(equilibrium(&model, &mut state, &StaticParams::default()).unwrap().converged);
    torque / (state.orientations[1] * first.inverse()).scaled_axis().dot(&axis)
}

const ROUND: Section = Section::Circle { radius: 0.01 };

#[test]
fn a_branch_is_as_stiff_as_its_material_at_any_angle() {
    let own = ROUND.stiffness(&MATERIAL);
    for degrees in [0.0_f64, 30.0, 60.0, 90.0, 120.0] {
        let angle = degrees.to_radians();
        let along = Vector3::new(angle.cos(), 0.0, angle.sin());
        let across = along.cross(&Vector3::y());
        for (axis, expected) in [(Vector3::y(), own.bending[0]), (across, own.bending[0]), (along, own.torsion)] {
            let found = stiffness(branch(angle, ROUND, None, true), axis) * LENGTH;
            assert!((found / expected - 1.0).abs() < 1e-4, "{degrees} degrees, {axis}: {found} instead of {expected}");
        }
        // Of the rotation vector, less that at rest, what the joint turns further about the same axis.
        let half = 0.5 * angle;
        let (model, state) = branch(angle, ROUND, None, false);
        let found = stiffness((model.clone(), state.clone()), Vector3::y()) * LENGTH;
        assert!((found / own.bending[0] - 1.0).abs() < 1e-4, "{degrees} degrees: {found}");
        // The paper's sine: cos(angle / 2)^2 about the axis of the angle.
        let paper = Model { strain_measure: StrainMeasure::Sine, ..model };
        let found = stiffness((paper, state), Vector3::y()) * LENGTH;
        let expected = own.bending[0] * half.cos().powi(2);
        assert!((found / expected - 1.0).abs() < 1e-4, "{degrees} degrees: {found} instead of {expected}");
    }
}

#[test]
fn a_branch_with_sides_is_stiff_about_its_own_axes() {
    let section = Section::Rectangle { width: 0.03, height: 0.01 };
    let own = section.stiffness(&MATERIAL);
    for degrees in [0.0_f64, 45.0, 90.0, 120.0] {
        let angle = degrees.to_radians();
        let along = Vector3::new(angle.cos(), 0.0, angle.sin());
        let axes = [Vector3::y(), along.cross(&Vector3::y()), along];
        // Joints to other rods of such sections are measured from rest in any case.
        for from_rest in [false, true] {
            for (axis, expected) in axes.into_iter().zip([own.bending[0], own.bending[1], own.torsion]) {
                let rod = branch(angle, section, Some(Vector3::y()), from_rest);
                let found = stiffness(rod, axis) * LENGTH;
                assert!((found / expected - 1.0).abs() < 1e-4, "{degrees} degrees, {axis}: {found}, not {expected}");
            }
        }
    }
}

#[test]
fn energy_does_not_depend_on_the_roll_of_a_round_branch() {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -0.5, 0.4));
    let energy = |roll: f64| {
        let d1 = Vector3::new(roll.sin() * 0.2 + 0.1, roll.cos(), 0.3);
        let (model, mut state) = branch(1.9, ROUND, Some(d1), true);
        assert!(measure::energy(&model, &state).bend < 1e-24);
        state.orientations[1] = turn * state.orientations[1];
        measure::energy(&model, &state).bend
    };
    let first = energy(0.0);
    for roll in [0.5, 1.5, 3.0, 4.5] {
        assert!((energy(roll) / first - 1.0).abs() < 1e-12, "{roll}");
    }
}

/// Smooth rods are the same by both measures, to second order in the angle at a joint.
#[test]
fn smooth_rods_move_alike_by_both_measures() {
    let difference = |segments: usize| {
        let ends = [false, true].map(|from_rest| {
            let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
            let nodes = shape::helix(Vector3::zeros(), 0.2, 0.2, 1.0, segments);
            let rod = assembly.rod(&RodSpec::new(nodes, 0.02, MATERIAL));
            assembly.clamp_start(&rod);
            let (mut model, state) = assembly.finish();
            if from_rest {
                model.measure_from_rest();
            }
            let (_, end) = acceptance::run(&model, &state, &tight(), 0.005, 20);
            end.positions[segments - 1] - state.positions[segments - 1]
        });
        (ends[0] - ends[1]).norm() / ends[0].norm()
    };
    let differences = [20, 40].map(difference);
    println!("both measures: {differences:.6?}");
    assert!(differences[0] < 1e-3 && differences[1] < 0.5 * differences[0], "{differences:?}");
}

/// A straight rod has no angle at rest: both measures are the same, to the last bit.
#[test]
fn straight_rods_keep_their_bits() {
    let ends = [false, true].map(|from_rest| {
        let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
        let nodes = shape::straight(Vector3::zeros(), Vector3::z(), 1.0, 12);
        let rod = assembly.rod(&RodSpec::new(nodes, 0.02, MATERIAL));
        assembly.clamp_start(&rod);
        assembly.state_mut().velocities[5] = Vector3::x();
        let (mut model, state) = assembly.finish();
        if from_rest {
            model.measure_from_rest();
        }
        assert_eq!(model.beyond_the_paper(), None);
        acceptance::run(&model, &state, &tight(), 0.005, 20).1
    });
    assert_eq!(ends[0], ends[1]);
}

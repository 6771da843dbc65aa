//! What joints transmit, as the multipliers of the last step say.

use std::sync::Arc;

use dynamics::formulation::Formulation;
use dynamics::simulation::{Settings, Simulation};
use dynamics::step::{Status, StepParams};
use nalgebra::Vector3;
use rod::{
    Assembly, Body, Driven, Integrator, Interpolation, JointForce, Keyframe, Load, Material, Model, Motion, RodSpec,
    State, shape,
};
use statics::{StaticParams, equilibrium};

use crate::common::{DT, GRAVITY, material};

/// Rods that hang side by side from clamps, each heavier than the last.
fn hanging(rods: usize) -> (Model, State) {
    let mut assembly = Assembly::new(GRAVITY);
    for k in 0..rods {
        let nodes = shape::straight(Vector3::x() * k as f64, -Vector3::z(), 1.0, 5);
        let rod = assembly.rod(&RodSpec::new(nodes, 0.01, material(1e7, 1000.0 * (1 + k) as f64)));
        assembly.clamp_start(&rod);
    }
    assembly.finish()
}

fn forces_after(model: &Model, state: &State, settings: &Settings, dt: f64, steps: usize) -> Vec<JointForce> {
    let mut simulation = Simulation::new(model, state, settings, None).unwrap();
    let mut forces = vec![JointForce { force: Vector3::repeat(f64::NAN), ..JointForce::default() }; model.joints.len()];
    simulation.store_joint_forces(&mut forces);
    assert!(forces.iter().all(|force| *force == JointForce::default()), "nothing is known before the first step");
    for _ in 0..steps {
        simulation.step(dt).unwrap();
    }
    simulation.store_joint_forces(&mut forces);
    forces
}

#[test]
fn joints_of_a_hanging_rod_carry_what_is_below_them() {
    // Alone, and in the lanes of a group; the forces do not depend on the time step.
    for rods in [1, 8] {
        let (model, state) = hanging(rods);
        for (dt, steps) in [(DT, 50), (0.5 * DT, 100)] {
            for formulation in Formulation::ALL {
                let step = StepParams {
                    formulation,
                    relative_tolerance: 1e-10,
                    motion_tolerance: 1e-10,
                    ..StepParams::DEFAULT
                };
                let forces = forces_after(&model, &state, &Settings { step, ..Settings::default() }, dt, steps);
                for (force, joint) in forces.iter().zip(&model.joints) {
                    let lower = match (joint.a, joint.b) {
                        (rod::Body::Segment(i), rod::Body::Segment(k)) => i.max(k),
                        (rod::Body::Segment(i), _) | (_, rod::Body::Segment(i)) => i,
                        _ => unreachable!("a joint holds a segment"),
                    };
                    let rod = model.segments[lower].rod;
                    let below = model.segments[lower..].iter().filter(|segment| segment.rod == rod);
                    let weight = below.map(|segment| segment.mass()).sum::<f64>() * 9.81;
                    let tension = force.tension(&model, &state, joint);
                    assert!(
                        (tension - weight).abs() < 1e-3 * weight,
                        "{formulation}, {dt}: {tension} N, not {weight} N"
                    );
                    assert!(force.moment.norm() < 5e-9, "nothing bends");
                }
            }
        }
    }
}

#[test]
fn a_cantilever_carries_the_moment_of_its_tip_load() {
    let (length, segments, tip) = (2.0, 20, Vector3::new(0.0, 0.3, -0.2));
    let mut assembly = Assembly::new(Vector3::zeros());
    let nodes = shape::straight(Vector3::zeros(), Vector3::x(), length, segments);
    let rod = assembly.rod(&RodSpec::new(nodes, 0.02, material(1e7, 1000.0)));
    assembly.clamp_start(&rod);
    let offset = 0.5 * length / segments as f64;
    assembly.load(Load { segment: rod.end - 1, offset, force: tip, torque: Vector3::zeros(), follows: false });
    let (model, first) = assembly.finish();
    for formulation in Formulation::ALL {
        let (model, mut state) = (formulation.measured(&model), first.clone());
        let report = equilibrium(&model, &mut state, &StaticParams::default()).unwrap();
        assert!(report.converged);
        let end = state.positions[rod.end - 1] + state.axis(rod.end - 1) * offset;
        let step = StepParams {
            formulation,
            relative_tolerance: 1e-12,
            motion_tolerance: 1e-12,
            absolute_tolerance: 1e-12,
            ..StepParams::DEFAULT
        };
        let forces = forces_after(&model, &state, &Settings { step, ..Settings::default() }, DT, 1);
        for (force, joint) in forces.iter().zip(&model.joints) {
            let a = model.pose(joint.a, &state);
            let place = a.position + a.orientation * Vector3::z() * joint.offset_a;
            // Of the part beyond the joint on the part before it: M = F x with the shape's arm.
            let moment = (end - place).cross(&tip);
            let found = a.orientation * force.moment;
            assert!((force.force - tip).norm() < 1e-5 * tip.norm(), "{formulation}: {} N", force.force);
            let error = (found - moment).norm();
            assert!(error < 1e-5 * tip.norm() * length, "{formulation}: {found} N m, not {moment}");
        }
    }
}

/// Straight rods whose first segment is led away from another that is fixed, and back, until it presses the rod along its axis with up to 390 kN, where two
/// segments buckle from 12 N on.
#[test]
fn a_rod_that_is_pressed_along_its_axis_buckles() {
    let (mut known, mut bent) = (0, 0);
    for (k, integrator) in (0..20).flat_map(|k| Integrator::ALL.map(|integrator| (k, integrator))) {
        let mut assembly = Assembly::new(Vector3::z() * -9.81);
        let stiff = Material { youngs_modulus: 2e8, torsion_modulus: 8e7, density: 100.0 };
        let nodes = shape::straight(Vector3::zeros(), Vector3::x(), 0.0431, 7);
        let rod = assembly.rod(&RodSpec::new(nodes, 1e-3, stiff));
        assembly.fix(rod.start).fix(3);
        let (mut model, state) = assembly.finish();
        let from = model.pose(Body::Segment(rod.start), &state);
        let shifts = [[0.0; 3], [-3.55e-4, 6.44e-4, 8.85e-5], [2.45e-4, 3.44e-4, 2.885e-4]].map(Vector3::from);
        let frame = |(place, shift): (usize, &Vector3<f64>)| Keyframe {
            time: 0.1 * place as f64,
            position: from.position + shift * (1.0 + 0.05 * f64::from(k)),
            turn: Vector3::zeros(),
        };
        let frames: Vec<_> = shifts.iter().enumerate().map(frame).collect();
        let motion = Motion::new(from.orientation, &frames, Interpolation::Linear).unwrap();
        model.motions.push(Driven::new(Body::Segment(rod.start), Arc::new(motion)));
        let step = StepParams { integrator, ..StepParams::DEFAULT };
        let mut simulation = Simulation::new(&model, &state, &Settings { step, ..Settings::default() }, None).unwrap();
        let (mut forces, mut now) = (vec![JointForce::default(); model.joints.len()], state.clone());
        for number in 1..=10 {
            let status = simulation.step(0.02).unwrap().status;
            simulation.store(&mut now);
            simulation.store_joint_forces(&mut forces);
            let between = model.joints.iter().zip(&forces).filter(|(joint, _)| matches!(joint.b, Body::Segment(1..=3)));
            let press = between.map(|(joint, force)| -force.tension(&model, &now, joint)).fold(0.0, f64::max);
            let is_known = status <= Status::ConvergedInSubsteps;
            assert!(!is_known || press < 50.0, "{k}, {integrator}, step {number}: {status:?}, pressed by {press} N");
            (known, bent) = (known + u32::from(is_known), bent + u32::from(press > 1.0));
        }
    }
    assert!(known > 360 && bent > 20, "{known} of 400 steps are known, a rod is pressed in {bent}");
}

//! Pinned ends, hinges and springs: joints that leave turns free, and grips that yield.

use std::f64::consts::{PI, TAU};

use dynamics::formulation::Formulation;
use dynamics::simulation::{Settings, Simulation};
use dynamics::step::{Status, StepParams};
use jointed::linear::solvers::SolverKind;
use nalgebra::Vector3;
use rod::Integrator;
use rod::{Assembly, Damping, Freedom, JointForce, Model, Reaction, RodSpec, Springs, State, measure, shape};
use statics::{StaticParams, equilibrium};

use crate::common::{GRAVITY, material, settings};

const LENGTH: f64 = 1.0;
const SEGMENTS: usize = 10;

/// A rod from the origin, clamped at its start face; its last joint is the clamp.
fn clamped(direction: Vector3<f64>, youngs_modulus: f64) -> (Model, State) {
    let mut assembly = Assembly::new(GRAVITY);
    let nodes = shape::straight(Vector3::zeros(), direction, LENGTH, SEGMENTS);
    let rod = assembly.rod(&RodSpec::new(nodes, 0.01, material(youngs_modulus, 1000.0)));
    assembly.clamp_start(&rod);
    assembly.finish()
}

fn sharp(formulation: Formulation) -> Settings {
    let step = StepParams {
        relative_tolerance: 1e-10,
        motion_tolerance: 1e-10,
        absolute_tolerance: 1e-10,
        max_iterations: 60,
        formulation,
        integrator: Integrator::Euler,
        ..StepParams::DEFAULT
    };
    Settings { step, solver: SolverKind::Direct }
}

/// Times [s] at which the tip's displacement along `along` changes its sign, interpolated.
fn crossings(
    model: &Model,
    state: &State,
    settings: &Settings,
    dt: f64,
    steps: usize,
    along: &Vector3<f64>,
) -> Vec<f64> {
    let mut simulation = Simulation::new(model, state, settings, None).unwrap();
    let mut now = state.clone();
    let mut before = now.positions[SEGMENTS - 1].dot(along);
    let mut times = Vec::new();
    for step in 1..=steps {
        assert!(simulation.step(dt).unwrap().status <= Status::ConvergedInSubsteps);
        simulation.store(&mut now);
        let x = now.positions[SEGMENTS - 1].dot(along);
        if before * x < 0.0 {
            times.push(dt * (step as f64 - x / (x - before)));
        }
        before = x;
    }
    times
}

/// Period [s] of small swings of the discrete rod about its end, were it rigid.
fn period(model: &Model) -> f64 {
    let (mut inertia, mut moment) = (0.0, 0.0);
    for (i, segment) in model.segments.iter().enumerate() {
        let arm = (i as f64 + 0.5) * LENGTH / SEGMENTS as f64;
        inertia += segment.mass() * arm * arm + segment.transverse_inertia();
        moment += segment.mass() * 9.81 * arm;
    }
    TAU * (inertia / moment).sqrt()
}

#[test]
fn a_pinned_rod_swings_as_a_physical_pendulum() {
    let angle = 0.05_f64;
    let along = Vector3::new(angle.cos(), angle.sin(), 0.0);
    // A ball joint in any direction; a hinge about the axis across.
    for hinge in [false, true] {
        for solver in [SolverKind::Direct, SolverKind::Sparse] {
            let direction = -Vector3::z() + along * angle;
            let (mut model, state) = clamped(direction, 1e11);
            let clamp = SEGMENTS - 1;
            if hinge {
                model.hinge(clamp, &Vector3::z().cross(&along))
            } else {
                model.pin(clamp)
            }
            let expected = period(&model);
            // The theory of a slender rod, 2 pi sqrt(2 l / 3 g), but for the inertia of its thickness.
            assert!((expected / (TAU * (2.0 * LENGTH / (3.0 * 9.81)).sqrt()) - 1.0).abs() < 1e-4);
            let settings = Settings { solver, ..sharp(Formulation::Newton) };
            // Implicit Euler's period is off in the second order of w dt, (w dt)^2 / 3 of it at most, and swings by the angle
            // lengthen it by angle^2 / 16.
            let dt = 2e-3;
            let times = crossings(&model, &state, &settings, dt, 1200, &along);
            let found = times[2] - times[0];
            let off = (TAU / expected * dt).powi(2) + angle * angle / 16.0;
            assert!((found / expected - 1.0).abs() < off + 1e-5, "{hinge}, {solver}: {found} s of {expected} s");
        }
    }
}

#[test]
fn a_pinned_end_takes_no_moment_and_springs_bear_the_weight_as_well() {
    let formulation = Formulation::Newton;
    for pinned in [true, false] {
        let (mut model, state) = clamped(Vector3::x(), 1e7);
        if pinned {
            model.pin(SEGMENTS - 1);
        } else {
            model.soften(SEGMENTS - 1, &Springs { force: [400.0, 400.0, 600.0], moment: [2.0, 2.0, 1.0] });
        }
        let weight: f64 = model.segments.iter().map(|segment| 9.81 * segment.mass()).sum();
        let mut simulation = Simulation::new(&model, &state, &sharp(formulation), None).unwrap();
        let mut forces = vec![JointForce::default(); model.joints.len()];
        let (mut before, mut after) = (state.clone(), state.clone());
        for step in 0..300 {
            std::mem::swap(&mut before, &mut after);
            // It swings through more than a half turn: beyond where a Darboux vector tells the angle.
            assert_eq!(simulation.step(5e-3).unwrap().status, Status::Converged, "step {step}");
            simulation.store(&mut after);
            simulation.store_joint_forces(&mut forces);
            let held = Reaction::all(&model, [&before, &after], [0.0, 5e-3], &forces, &[])[0];
            assert_eq!(held.moment.norm() == 0.0, pinned);
            let change = |i: usize| (after.velocities[i] - before.velocities[i]) / 5e-3 - GRAVITY;
            let needed: Vector3<f64> =
                model.segments.iter().enumerate().map(|(i, segment)| change(i) * segment.mass()).sum();
            assert!((held.force - needed).norm() < 1e-6 * weight.max(needed.norm()), "{formulation}, step {step}");
            let end = after.positions[0] - after.axis(0) * (0.5 * LENGTH / SEGMENTS as f64);
            assert!(!pinned || end.norm() < 1e-6, "{formulation}, step {step}: {end}");
        }
    }
}

#[test]
fn a_spinning_pinned_rod_passes_a_half_turn() {
    // Without weight a rigid rod that is pinned at its end turns on for ever: 3 turns, through the half turns on the way.
    for hinge in [false, true] {
        for formulation in Formulation::ALL {
            let (mut model, mut state) = clamped(Vector3::x(), 1e11);
            model.gravity = Vector3::zeros();
            if hinge {
                model.hinge(SEGMENTS - 1, &Vector3::y())
            } else {
                model.pin(SEGMENTS - 1)
            }
            let spin = Vector3::y() * 3.0;
            for i in 0..SEGMENTS {
                state.velocities[i] = spin.cross(&state.positions[i]);
                state.angular_velocities[i] = spin;
            }
            let mut simulation =
                Simulation::new(&model, &state, &settings(formulation, SolverKind::Direct), None).unwrap();
            let mut now = state.clone();
            let dt = 5e-3;
            let mut turned = 0.0;
            for step in 0..1300 {
                let before = now.axis(SEGMENTS / 2);
                assert!(
                    simulation.step(dt).unwrap().status <= Status::ConvergedInSubsteps,
                    "{formulation}, step {step}"
                );
                simulation.store(&mut now);
                turned += before.angle(&now.axis(SEGMENTS / 2));
                assert!(now.axis(0).y.abs() < 1e-6, "it stays in its plane");
            }
            // A little is lost to the time step: the centrifugal pull acts where the step ends.
            assert!(turned > 2.5 * TAU && turned < 3.2 * TAU, "{formulation}, hinge {hinge}: {turned} rad");
        }
    }
}

#[test]
fn a_hinge_is_stiff_about_the_other_axes() {
    // A horizontal rod under its weight: a hinge about z bears it as the clamp does, one about y lets it swing down.
    let fallen = |prepare: &dyn Fn(&mut Model)| {
        let (mut model, mut state) = clamped(Vector3::x(), 1e8);
        prepare(&mut model);
        let report = equilibrium(&model, &mut state, &StaticParams::default()).unwrap();
        assert!(report.converged);
        -state.positions[SEGMENTS - 1].z
    };
    let rigid = fallen(&|_| {});
    let upright = fallen(&|model| model.hinge(SEGMENTS - 1, &Vector3::z()));
    assert!((upright / rigid - 1.0).abs() < 1e-3, "{upright} m, a clamp {rigid} m");
    // About the rod's own axis it hangs down as far: only twist is free.
    let swivel = fallen(&|model| model.hinge(SEGMENTS - 1, &Vector3::x()));
    assert!((swivel / rigid - 1.0).abs() < 1e-3, "{swivel} m, a clamp {rigid} m");
    let lying = fallen(&|model| model.hinge(SEGMENTS - 1, &Vector3::y()));
    assert!((lying - 0.95 * LENGTH).abs() < 1e-3, "{lying} m");
    let pinned = fallen(&|model| model.pin(SEGMENTS - 1));
    assert!((pinned - 0.95 * LENGTH).abs() < 1e-3, "{pinned} m");
}

#[test]
fn springs_yield_by_force_over_stiffness() {
    const YOUNG: f64 = 1e9;
    // Along the rod's axis, hanging; across it, with a stiff rod that is held at its start alone.
    let (force, torque) = (3.0, 0.2);
    let (rate, turning) = (200.0, 5.0);
    let yields = |springs: Springs, load: Vector3<f64>, moment: Vector3<f64>| {
        let (mut model, mut state) = clamped(Vector3::x(), YOUNG);
        model.gravity = Vector3::zeros();
        model.soften(SEGMENTS - 1, &springs);
        let segment = SEGMENTS - 1;
        model.loads.push(rod::Load { segment, offset: 0.0, force: load, torque: moment, follows: false });
        let first = state.clone();
        let report = equilibrium(&model, &mut state, &StaticParams::default()).unwrap();
        assert!(report.movement < 1e-8, "{springs:?}, {load}, {moment}: {report:?}");
        let start = |state: &State| state.positions[0] - state.axis(0) * (0.5 * LENGTH / SEGMENTS as f64);
        (start(&state) - start(&first), first.orientations[0].rotation_to(&state.orientations[0]).scaled_axis())
    };
    let soft = |[across, along]: [f64; 2], [bend, twist]: [f64; 2]| Springs {
        force: [across, across, along],
        moment: [bend, bend, twist],
    };
    let none = f64::INFINITY;
    let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
    let (shift, _) = yields(soft([none, rate], [none; 2]), x * force, z * torque);
    assert!((shift - x * (force / rate)).norm() < 1e-5, "{shift}");
    let (shift, _) = yields(soft([rate, none], [none; 2]), y * force, z * torque);
    assert!((shift - y * (force / rate)).norm() < 1e-5, "{shift}");
    let (shift, turn) = yields(soft([none; 2], [none, turning]), z * 0.0, x * torque);
    // The half segment bends and twists, too, in series.
    let stiffness = YOUNG * 0.25 * PI * 0.01_f64.powi(4);
    let half = 0.5 * LENGTH / SEGMENTS as f64;
    let angle = torque * (1.0 / turning + half / (2.0 * stiffness));
    assert!(shift.norm() < 1e-6 && (turn - x * angle).norm() < 1e-5, "{shift} {turn}");
    let angle = torque * (1.0 / turning + half / stiffness);
    let (_, turn) = yields(soft([none; 2], [turning, none]), z * 0.0, y * torque);
    assert!((turn - y * angle).norm() < 1e-5, "{turn} {angle}");
    assert_eq!(soft([none; 2], [none; 2]), Springs::RIGID);
    // Of three springs each yields along or about its own axis: d1, d2, d3, which are here -z, y, x.
    let rates = [300.0, rate, 100.0];
    let all = Springs { force: rates, ..Springs::RIGID };
    for (axis, rate) in [-z, y, x].into_iter().zip(rates) {
        let (shift, _) = yields(all, axis * force, z * 0.0);
        assert!((shift - axis * (force / rate)).norm() < 1e-5, "{rate}: {shift}");
    }
    let (shift, _) = yields(all, (x + y - z) * force, z * 0.0);
    let expected = (x / rates[2] + y / rates[1] - z / rates[0]) * force;
    assert!((shift - expected).norm() < 1e-5, "{shift} {expected}");
    for (k, axis) in [-z, y, x].into_iter().enumerate() {
        let mut moment = [40.0, 30.0, 20.0];
        moment[k] = turning;
        let compliance = if k == 2 { half / (2.0 * stiffness) } else { half / stiffness };
        let (_, turn) = yields(Springs { force: [none; 3], moment }, z * 0.0, axis * torque);
        let angle = torque * (1.0 / turning + compliance);
        assert!((turn - axis * angle).norm() < 1e-5, "{k}: {turn} {angle}");
    }
}

/// A face that slides along its grip carries any stroke, of either end of a rod and of one segment as of several: it gains the
/// speed of its mass, `F t / m`, and the work of the force is its energy.
#[test]
fn a_grip_lets_a_rod_slide_through_any_stroke() {
    const FORCE: f64 = 2.0;
    for (segments, at_end, integrator) in
        [(1, true, Integrator::Euler), (1, false, Integrator::Bdf2), (8, true, Integrator::Bdf2)]
    {
        for (formulation, pull) in [(Formulation::Newton, FORCE), (Formulation::Newton, -FORCE)] {
            let mut assembly = Assembly::new(Vector3::zeros());
            let nodes = shape::straight(Vector3::zeros(), Vector3::x(), LENGTH, segments);
            let rod = assembly.rod(&RodSpec::new(nodes, 0.005, material(1e9, 1000.0)));
            _ = if at_end { assembly.clamp_end(&rod) } else { assembly.clamp_start(&rod) };
            let (mut model, state) = assembly.finish();
            let joint = model.joints.len() - 1;
            let soft = Springs { force: [f64::INFINITY, f64::INFINITY, 1e-8], ..Springs::RIGID };
            model.soften(joint, &soft);
            let segment = if at_end { segments - 1 } else { 0 };
            let force = Vector3::new(pull, 0.01, 0.0);
            model.loads.push(rod::Load { segment, offset: 0.0, force, torque: Vector3::zeros(), follows: false });
            let mut settings = settings(formulation, SolverKind::Direct);
            settings.step.integrator = integrator;
            let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
            let mut now = state.clone();
            for step in 0..200 {
                let status = simulation.step(0.01).unwrap().status;
                assert!(status <= Status::ConvergedInSubsteps, "{segments} {at_end} {formulation}, step {step}");
            }
            simulation.store(&mut now);
            let mass: f64 = model.segments.iter().map(|segment| segment.mass()).sum();
            let (speed, way) = (now.velocities[segment].x, (now.positions[segment] - state.positions[segment]).x);
            let expected = pull / mass * 2.0;
            assert!((speed / expected - 1.0).abs() < 1e-3, "{segments} {at_end} {formulation}: {speed} {expected}");
            assert!(way.abs() > 40.0 && (way / (expected * 1.0) - 1.0).abs() < 0.01, "{way}");
            let kinetic = measure::energy(&model, &now).kinetic;
            assert!((kinetic / (0.5 * mass * expected * expected) - 1.0).abs() < 0.01, "{kinetic}");
            assert!(now.positions.iter().all(|x| x.yz().norm() < 0.02), "{segments} {at_end} {formulation}");
        }
    }
}

#[test]
fn a_ball_joint_between_two_rods_makes_a_double_pendulum() {
    // Released from rest it keeps its energy but for what the time step takes, and the ball transmits no moment.
    let mut assembly = Assembly::new(GRAVITY);
    let line =
        |from: Vector3<f64>| RodSpec::new(shape::straight(from, Vector3::x(), 0.5, 4), 0.01, material(1e10, 1000.0));
    let upper = assembly.rod(&line(Vector3::zeros()));
    assembly.clamp_start(&upper);
    let lower = assembly.rod(&line(Vector3::x() * 0.5));
    assembly.branch(upper.end - 1, 1.0, &lower);
    let (mut model, state) = assembly.finish();
    let last = model.joints.len() - 1;
    for joint in [3, last] {
        model.pin(joint);
    }
    assert_eq!(model.joints[last].freedom, Freedom::Ball);
    let mut simulation = Simulation::new(&model, &state, &sharp(Formulation::Newton), None).unwrap();
    let mut now = state.clone();
    let begin = measure::energy(&model, &state).total();
    let mut forces = vec![JointForce::default(); model.joints.len()];
    let mut bent = 0.0_f64;
    for step in 0..400 {
        assert!(simulation.step(2e-3).unwrap().status <= Status::ConvergedInSubsteps, "step {step}");
        simulation.store(&mut now);
        simulation.store_joint_forces(&mut forces);
        assert_eq!(forces[last].moment.norm(), 0.0);
        bent = bent.max(now.axis(upper.start).angle(&now.axis(lower.start)));
        assert!(measure::worst_gap(&model, &now) < 1e-6);
    }
    let weight: f64 = model.segments.iter().map(|segment| 9.81 * segment.mass()).sum();
    let energy = measure::energy(&model, &now).total();
    assert!(energy < begin + 1e-6 * weight && energy > begin - 0.1 * weight, "{begin} J, then {energy} J");
    assert!(bent > 0.3, "the two swing apart: {bent} rad");
}

#[test]
fn a_hinge_that_is_turned_keeps_what_it_holds_to_its_axis() {
    // Thrown out of its plane, a hinged stiff rod stays in it; a pinned one does not.
    let run = |hinge: bool| {
        let (mut model, state) = clamped(Vector3::x(), 1e11);
        model.damping = Damping { linear: 0.1, angular: 0.1 };
        if hinge {
            model.hinge(SEGMENTS - 1, &Vector3::y())
        } else {
            model.pin(SEGMENTS - 1)
        }
        let zero = Vector3::zeros();
        model.loads.push(rod::Load {
            segment: SEGMENTS - 1,
            offset: 0.0,
            force: Vector3::y() * 0.5,
            torque: zero,
            follows: false,
        });
        let mut simulation = Simulation::new(&model, &state, &sharp(Formulation::Newton), None).unwrap();
        let mut now = state.clone();
        let mut aside = 0.0_f64;
        for _ in 0..400 {
            assert!(simulation.step(5e-3).unwrap().status <= Status::ConvergedInSubsteps);
            simulation.store(&mut now);
            aside = aside.max(now.positions[SEGMENTS - 1].y.abs());
        }
        aside
    };
    let (held, free) = (run(true), run(false));
    assert!(held < 0.02 && free > 0.1, "{held} m behind a hinge, {free} m behind a ball joint");
}

#[test]
fn ordinary_joints_know_nothing_of_it() {
    let (model, state) = clamped(Vector3::x(), 1e7);
    let joint = model.joints[0];
    assert!(!joint.has_rest_frames());
    let [a, b] = [0, 1].map(|i| &state.orientations[i]);
    let strain = model.strain_measure.strain(a, b, joint.length);
    let rest = model.strain_measure.at_rest(&joint.rest_darboux, joint.length);
    assert_eq!(measure::bend_strain(&model, &state, &joint), strain - rest);
}

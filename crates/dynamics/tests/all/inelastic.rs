//! Joints that are not elastic: closed forms, conserved quantities, alternating loads, contacts, snapshots.

use std::f64::consts::PI;
use std::sync::Arc;

use dynamics::batch::Batch;
use dynamics::simulation::{Settings, Simulation, SimulationError};
use dynamics::step::{Status, StepParams};
use nalgebra::Vector3;
use rod::measure::{dissipated, energy};
use rod::{
    Assembly, Body, Change, Changing, Driven, InnerDamping, Integrator, Interpolation, JointLaw, Keyframe, Load,
    Material, MaxwellBranch, Model, MomentTable, Motion, Plasticity, RodSpec, State, StrandFriction, Track, Unloading,
    shape,
};

pub(crate) const LENGTH: f64 = 1.0;
pub(crate) const SEGMENTS: usize = 20;
pub(crate) const RADIUS: f64 = 2e-3;

/// Light, so that it follows slow loads. With this radius, 2.513 N m^2 in bending and 2.011 N m^2 in twist.
pub(crate) const WIRE: Material = Material { youngs_modulus: 2e11, torsion_modulus: 8e10, density: 8.0 };

pub(crate) fn bending() -> f64 {
    WIRE.youngs_modulus * PI * RADIUS.powi(4) / 4.0
}

fn torsion() -> f64 {
    WIRE.torsion_modulus * PI * RADIUS.powi(4) / 2.0
}

pub(crate) fn settings(integrator: Integrator) -> Settings {
    Settings { step: StepParams { integrator, ..StepParams::DEFAULT }, ..Settings::default() }
}

pub(crate) fn plastic(isotropic: f64, kinematic: f64) -> JointLaw {
    JointLaw::Plastic(Plasticity { moments: Vector3::new(0.5, 0.5, 0.4), isotropic, kinematic })
}

/// A straight wire along x, clamped at its start, with a torque at its end that changes over time [s], [N m].
pub(crate) fn cantilever(law: &JointLaw, torque: &[(f64, Vector3<f64>)], damping: f64) -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::zeros());
    let nodes = shape::straight(Vector3::zeros(), Vector3::x(), LENGTH, SEGMENTS);
    let inner_damping = InnerDamping { bending: damping, twist: damping, stretch: 0.0 };
    let spec = RodSpec { laws: vec![law.clone()], inner_damping, ..RodSpec::new(nodes, RADIUS, WIRE) };
    let rod = assembly.rod(&spec);
    assembly.clamp_start(&rod);
    assembly.load(Load {
        segment: rod.end - 1,
        offset: 0.0,
        force: Vector3::zeros(),
        torque: torque[0].1,
        follows: false,
    });
    let track = Track::new(torque, Interpolation::Linear).unwrap();
    assembly.model_mut().changes.push(Change { of: Changing::Torque(0), track: Arc::new(track) });
    assembly.finish()
}

/// Steps `model` and shows each step's end.
pub(crate) fn run(
    (model, state): &(Model, State),
    settings: &Settings,
    (dt, steps): (f64, usize),
    mut see: impl FnMut(f64, &State),
) -> (Simulation, State) {
    let mut simulation = Simulation::new(model, state, settings, None).unwrap();
    let mut state = state.clone();
    for step in 0..steps {
        // Wires that crumple turn joints past half a turn.
        let status = simulation.step(dt).unwrap().status;
        assert!(status <= Status::PastHalfTurn, "step {step}: {status:?}");
        simulation.store(&mut state);
        see(simulation.time(), &state);
    }
    (simulation, state)
}

/// Angle by which the last segment has turned about `axis` [rad], over the length that bends.
pub(crate) fn angle(state: &State, axis: &Vector3<f64>) -> f64 {
    let [first, .., last] = &state.orientations[..] else { panic!() };
    // The clamp holds over half a segment, as each joint bends over a whole one.
    let turn = (last * first.inverse()).scaled_axis().dot(axis);
    turn / (LENGTH * (SEGMENTS as f64 - 1.0) / SEGMENTS as f64)
}

#[test]
fn a_wire_that_is_bent_over_springs_back_to_its_plastic_curvature() {
    // M = EI k up to M_y, then with the slope EI h / (1 + h); released, the curvature falls by M / EI.
    let (hardening, most) = (0.1, 0.7);
    let (bending, yields) = (bending(), 0.5);
    let bent = most / bending + (most - yields) / (hardening * bending);
    let left = bent - most / bending;
    for integrator in [Integrator::Euler, Integrator::Bdf2] {
        for (isotropic, kinematic) in [(hardening, 0.0), (0.0, hardening), (0.04, 0.06)] {
            let torque = [0.0, most, most, 0.0, 0.0].map(|m| Vector3::y() * m);
            let times = [0.0, 2.0, 3.0, 5.0, 6.0];
            let track: Vec<_> = times.into_iter().zip(torque).collect();
            let case = cantilever(&plastic(isotropic, kinematic), &track, 0.005);
            let mut seen = Vec::new();
            let (simulation, _) = run(&case, &settings(integrator), (0.02, 300), |_, state| {
                seen.push(angle(state, &Vector3::y()));
            });
            let (top, end) = (seen[149], seen[299]);
            println!("{integrator:?}: {top} {bent} {end} {left}, iterations {}", simulation.counters().iterations);
            assert!((top / bent - 1.0).abs() < 0.01, "{integrator:?}: {top} of {bent}");
            assert!((end / left - 1.0).abs() < 0.01, "{integrator:?}: {end} of {left}");
        }
    }
}

/// From zero to +M and -M in turns, so many quarters of a second long.
fn to_and_fro(axis: Vector3<f64>, most: f64, cycles: usize) -> Vec<(f64, Vector3<f64>)> {
    let value = |k: usize| [0.0, most, 0.0, -most][k % 4];
    (0..=4 * cycles).map(|k| (k as f64, axis * value(k))).collect()
}

/// Per cycle of the last: the work of the end's torque, what joints have lost, and the largest curvature.
fn cycle(law: &JointLaw, axis: Vector3<f64>, most: f64, integrator: Integrator) -> [f64; 3] {
    let (cycles, steps) = (3, 400);
    let torque = to_and_fro(axis, most, cycles);
    let case = cantilever(law, &torque, 1e-4);
    let dt = 4.0 / steps as f64;
    let (mut work, mut last, mut before, mut largest) = (vec![0.0], 0.0, 0.0, 0.0_f64);
    let mut lost = vec![0.0];
    run(&case, &settings(integrator), (dt, cycles * steps), |time, state| {
        let phase = (time + 1.0).rem_euclid(4.0);
        let moment = most * if phase < 2.0 { phase - 1.0 } else { 3.0 - phase };
        let turned = angle(state, &axis) * LENGTH;
        work.push(work.last().unwrap() + 0.5 * (moment + last) * (turned - before));
        lost.push(dissipated(&case.0, state));
        (last, before, largest) = (moment, turned, largest.max(turned / LENGTH));
    });
    let of_last = |sum: &[f64]| (sum[cycles * steps] - sum[(cycles - 1) * steps]) / LENGTH;
    // The clamp bends over half a segment, the loaded one at its centre not at all.
    [of_last(&work), of_last(&lost) / (LENGTH - 0.5 * LENGTH / SEGMENTS as f64), largest]
}

#[test]
fn loops_of_moment_and_curvature_take_their_area() {
    let (most, hardening) = (0.65, 0.1);
    let ways = [(Vector3::y(), bending(), 0.5), (Vector3::x(), torsion(), 0.4)];
    for integrator in [Integrator::Euler, Integrator::Bdf2] {
        for (axis, stiffness, yields) in ways {
            let [work, lost, _] = cycle(&plastic(0.0, hardening), axis, most, integrator);
            let expected = 4.0 * yields * (most - yields) / (hardening * stiffness);
            println!("{integrator:?} {axis:?} {work} {lost} {expected}");
            assert!((lost / expected - 1.0).abs() < 0.01, "{axis:?}: {lost} of {expected}");
            assert!((work / expected - 1.0).abs() < 0.01, "{axis:?}: {work} of {expected}");
        }
        // Friction in a steady loop to the curvatures +-K: 4 M_f (K - (M_f / s) tanh(s K / M_f)); twist is elastic.
        let (moment, stiffness) = (0.2, 5.0);
        let law = JointLaw::Friction(StrandFriction { moment, stiffness });
        let [work, lost, bent] = cycle(&law, Vector3::y(), most, integrator);
        let expected = 4.0 * moment * (bent - moment / stiffness * (stiffness * bent / moment).tanh());
        println!("{integrator:?} {work} {lost} {expected}, {bent}");
        assert!((lost / expected - 1.0).abs() < 0.01, "{lost} of {expected}");
        assert!((work / expected - 1.0).abs() < 0.01, "{work} of {expected}");
        let [work, lost, _] = cycle(&law, Vector3::x(), most, integrator);
        assert!(work.abs() < 1e-3 * expected && lost.abs() < 1e-3 * expected, "{work} {lost}");
    }
}

#[test]
fn the_standard_linear_solid_creeps_and_relaxes() {
    let (share, time) = (0.6, 0.5);
    let law = JointLaw::Viscoelastic(vec![MaxwellBranch { share, time }]);
    let moment = 0.2;
    for integrator in [Integrator::Euler, Integrator::Bdf2] {
        let torque = [(0.0, Vector3::y() * moment)];
        let case = cantilever(&law, &torque, 0.002);
        run(&case, &settings(integrator), (0.005, 400), |now, state| {
            let lasting = moment / (bending() * (1.0 - share));
            let expected = lasting * (1.0 - share * (-(1.0 - share) * now / time).exp());
            let found = angle(state, &Vector3::y());
            assert!(now < 0.1 || (found / expected - 1.0).abs() < 0.01, "{integrator:?} {now}: {found} of {expected}");
        });
        // Drawn as an arc, at rest straight, and held at both ends: the moment relaxes everywhere alike.
        let mut assembly = Assembly::new(Vector3::zeros());
        let bent = 0.5;
        let nodes = (0..=SEGMENTS).map(|k| LENGTH * k as f64 / SEGMENTS as f64 * bent);
        let nodes = nodes.map(|turn| Vector3::new(turn.sin(), 0.0, turn.cos() - 1.0) / bent).collect();
        let rest = rod::RestShape::Straight;
        let rod = assembly.rod(&RodSpec { laws: vec![law.clone()], rest, ..RodSpec::new(nodes, RADIUS, WIRE) });
        assembly.clamp_start(&rod).clamp_end(&rod);
        let (model, state) = assembly.finish();
        let mut simulation = Simulation::new(&model, &state, &settings(integrator), None).unwrap();
        let mut forces = vec![Default::default(); model.joints.len()];
        for step in 1..=300 {
            assert_eq!(simulation.step(0.005).unwrap().status, Status::Converged);
            simulation.store_joint_forces(&mut forces);
            let now = 0.005 * f64::from(step);
            // The first step strains it at a constant rate.
            let expected = bending() * bent * (1.0 - share + share * (-(now - 0.0025) / time).exp());
            let found = forces[SEGMENTS / 2].moment.norm();
            assert!((found / expected - 1.0).abs() < 0.01, "{integrator:?} {now}: {found} of {expected}");
        }
    }
}

#[test]
fn moment_and_torque_together_yield_on_the_ellipse() {
    // A torque along the diagonal of x and y bends the straight wire and twists it, as long as it hardly turns.
    let (moment, torque) = (0.5, 0.4);
    let law = plastic(0.05, 0.0);
    for share in [0.3_f64, 0.8, 1.3] {
        let direction = Vector3::new(torque * share.sin(), moment * share.cos(), 0.0);
        let mut first = None;
        let track = [(0.0, Vector3::zeros()), (4.0, direction * 1.05)];
        let case = cantilever(&law, &track, 0.002);
        run(&case, &settings(Integrator::Bdf2), (0.01, 400), |time, state| {
            // The joint at the clamp, which turns least.
            if first.is_none() && state.internals[0].hardening > 0.0 || state.internals[SEGMENTS - 1].hardening > 0.0 {
                first = first.or(Some(time));
            }
        });
        let at = 1.05 * first.unwrap() / 4.0;
        assert!((at - 1.0).abs() < 0.03, "{share}: {at} of the yield surface");
    }
}

/// The pose of the end of a wire along x that is bent to this curvature, less its first one: position and turn.
fn bent_end(time: f64, curvature: f64) -> Keyframe {
    let turn = curvature * LENGTH;
    let end = if turn == 0.0 {
        Vector3::zeros()
    } else {
        Vector3::new(turn.sin() / curvature - LENGTH, 0.0, (turn.cos() - 1.0) / curvature)
    };
    Keyframe { time, position: Vector3::x() * LENGTH + end, turn: Vector3::y() * turn }
}

/// A straight wire between two grips, whose end goes through these curvatures over time [s], [1/m].
fn between_grips(law: &JointLaw, curvatures: &[(f64, f64)]) -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::zeros());
    let nodes = shape::straight(Vector3::zeros(), Vector3::x(), LENGTH, SEGMENTS);
    let rod = assembly.rod(&RodSpec { laws: vec![law.clone()], ..RodSpec::new(nodes, RADIUS, WIRE) });
    assembly.clamp_start(&rod).clamp_end(&rod);
    let (mut model, state) = assembly.finish();
    let keys: Vec<_> = curvatures
        .windows(2)
        .flat_map(|pair| {
            let [(from, first), (to, second)] = [pair[0], pair[1]];
            (0..40).map(move |k| {
                let share = f64::from(k) / 40.0;
                bent_end(from + (to - from) * share, first + (second - first) * share)
            })
        })
        .chain(curvatures.last().map(|&(time, curvature)| bent_end(time, curvature)))
        .collect();
    let motion = Motion::new(model.anchors[1].orientation, &keys, Interpolation::Linear).unwrap();
    model.motions.push(Driven::new(Body::Anchor(1), Arc::new(motion)));
    (model, state)
}

#[test]
fn without_hardening_the_moment_stays() {
    // Which joints flow nothing but inertia says; none bears more than its yield moment and the least hardening.
    let yields = 0.5;
    let ways = [(0.0, 0.0), (1.0, 1.2)];
    for integrator in [Integrator::Euler, Integrator::Bdf2] {
        let mut case = between_grips(&plastic(0.0, 0.0), &ways);
        case.0.segments.iter_mut().for_each(|segment| segment.density = 800.0);
        let mut simulation = Simulation::new(&case.0, &case.1, &settings(integrator), None).unwrap();
        let (mut state, mut forces) = (case.1.clone(), vec![Default::default(); case.0.joints.len()]);
        // As hinges move on the wire snaps, and bears less for a while.
        let mut late = 0.0;
        for step in 1..=100 {
            assert!(simulation.step(0.01).unwrap().status <= Status::PastHalfTurn, "{step}");
            simulation.store(&mut state);
            simulation.store_joint_forces(&mut forces);
            let mid = forces.iter().map(|force: &rod::JointForce| force.moment.norm()).fold(0.0, f64::max);
            // Where the wire flows most it hardens by a thousandth of the elastic stiffness, as all do.
            for (own, at) in case.0.laws.iter().zip(&state.internals) {
                let most = yields + 1e-3 * bending() * at.parts[0].norm();
                let found = forces[own.joint].moment.norm();
                assert!(found < 1.001 * most, "{step}, joint {}: {found} of {most}", own.joint);
            }
            if step >= 80 {
                late = f64::max(late, mid);
            }
        }
        assert!(late > 0.995 * yields, "{late}");
    }
}

#[test]
fn energy_is_kept_or_lost_in_joints() {
    // A light wire rings after a blow, without any other damping: what it has less is what its joints have lost, and a little
    // of the integrator. Nothing is gained.
    for law in [plastic(0.02, 0.05), JointLaw::Friction(StrandFriction { moment: 0.05, stiffness: 2.0 })] {
        let mut assembly = Assembly::new(Vector3::zeros());
        let nodes = shape::straight(Vector3::zeros(), Vector3::x(), LENGTH, SEGMENTS);
        let heavy = Material { density: 8000.0, ..WIRE };
        let rod = assembly.rod(&RodSpec { laws: vec![law], ..RodSpec::new(nodes, RADIUS, heavy) });
        assembly.clamp_start(&rod);
        rod.clone().for_each(|i| assembly.state_mut().velocities[i].z = 6.0 * (i as f64 / SEGMENTS as f64).powi(2));
        let (model, state) = assembly.finish();
        let first = energy(&model, &state).total();
        let mut before = first;
        let (_, end) = run(&(model.clone(), state), &settings(Integrator::Bdf2), (5e-4, 2000), |time, state| {
            let now = energy(&model, state).total() + dissipated(&model, state);
            assert!(now <= before + 2e-3 * first, "{time}: {now} after {before}");
            before = now;
        });
        let (left, lost) = (energy(&model, &end).total(), dissipated(&model, &end));
        println!("first {first} left {left} lost {lost}");
        assert!(lost > 0.3 * first, "{lost} of {first}");
        assert!((left + lost) / first > 0.95, "{left} and {lost} of {first}");
    }
}

#[test]
fn a_coil_spring_keeps_a_set_from_an_overload() {
    // A close-coiled spring of wire of length L on the radius R: the pull F twists it by F R, and the ends part by R L times the twist.
    let (radius, turns, pitch, parts) = (0.02, 5.0, 0.003, 240);
    let wire = 1e-3_f64;
    let stiffness = WIRE.torsion_modulus * PI * wire.powi(4) / 2.0;
    let (yields, hardening, stroke) = (0.1, 0.05, 0.02);
    let law = JointLaw::Plastic(Plasticity {
        moments: Vector3::new(0.12, 0.12, yields),
        isotropic: 0.0,
        kinematic: hardening,
    });
    let mut assembly = Assembly::new(Vector3::zeros());
    let nodes = shape::helix(Vector3::zeros(), radius, pitch * turns, turns, parts);
    let spec = RodSpec { laws: vec![law], ..RodSpec::new(nodes, wire, WIRE) };
    let rod = assembly.rod(&spec);
    assembly.clamp_start(&rod).clamp_end(&rod);
    let (mut model, state) = assembly.finish();
    let axis = Vector3::z();
    let lifted =
        |time, by: f64| Keyframe { time, position: model.anchors[1].position + axis * by, turn: Vector3::zeros() };
    let keys = [lifted(0.0, 0.0), lifted(1.0, stroke), lifted(2.0, 0.0)];
    let motion = Motion::new(model.anchors[1].orientation, &keys, Interpolation::Linear).unwrap();
    model.motions.push(Driven::new(Body::Anchor(1), Arc::new(motion)));
    let length = model.segments.iter().map(|segment| segment.length).sum::<f64>();
    let twist = stroke / (radius * length);
    let plastic_twist = (stiffness * twist - yields) / (stiffness * (1.0 + hardening));
    let expected = radius * length * plastic_twist;
    let mut simulation = Simulation::new(&model, &state, &settings(Integrator::Bdf2), None).unwrap();
    let mut forces = vec![rod::JointForce::default(); model.joints.len()];
    let (mut set, mut before) = (0.0, (stroke, 1.0));
    for step in 1..=200 {
        let status = simulation.step(0.01).unwrap().status;
        assert!(status <= Status::ConvergedInSubsteps, "{status:?}");
        simulation.store_joint_forces(&mut forces);
        if step > 100 {
            let stretched = stroke * f64::from(200 - step) / 100.0;
            let pull = forces.last().unwrap().force.z;
            if pull * before.1 < 0.0 {
                set = stretched + (before.0 - stretched) * pull / (pull - before.1);
            }
            before = (stretched, pull);
        } else if step == 100 {
            before.1 = forces.last().unwrap().force.z;
        }
    }
    println!("set {set} of {expected}, iterations {}", simulation.counters().iterations);
    assert!((set / expected - 1.0).abs() < 0.01, "{set} of {expected}");
}

#[test]
fn what_joints_remember_goes_on_from_snapshots_and_states() {
    for law in [
        plastic(0.02, 0.05),
        JointLaw::Friction(StrandFriction { moment: 0.1, stiffness: 2.0 }),
        JointLaw::Viscoelastic(vec![MaxwellBranch { share: 0.5, time: 0.1 }]),
    ] {
        let mut case = between_grips(&law, &[(0.0, 0.0), (1.0, 0.8), (2.0, -0.3)]);
        case.0.segments.iter_mut().for_each(|segment| segment.density = 8000.0);
        let settings = settings(Integrator::Bdf2);
        let (mut first, there) = run(&case, &settings, (0.01, 60), |_, _| {});
        let snapshot = first.snapshot();
        let ends = |simulation: &mut Simulation| {
            (0..60).for_each(|_| assert!(simulation.step(0.01).unwrap().status <= Status::PastHalfTurn));
            let mut state = case.1.clone();
            simulation.store(&mut state);
            state
        };
        let end = ends(&mut first);
        first.restore(&snapshot).unwrap();
        assert_eq!(ends(&mut first), end, "taken back");
        let mut second = Simulation::new(&case.0, &case.1, &settings, None).unwrap();
        second.restore(&snapshot).unwrap();
        assert_eq!(ends(&mut second), end, "in another simulation");
        // From a state alone a simulation knows what its joints remember, but not of the steps before.
        let third = Simulation::new(&case.0, &there, &settings, None).unwrap();
        let mut state = case.1.clone();
        third.store(&mut state);
        assert_eq!(state, there);
    }
}

#[test]
fn all_solvers_come_to_the_same_wire() {
    use jointed::linear::solvers::SolverKind;
    let law = plastic(0.02, 0.05);
    let track = [(0.0, Vector3::zeros()), (1.0, Vector3::new(0.3, 0.5, 0.1)), (2.0, Vector3::new(-0.3, 0.2, 0.3))];
    let case = cantilever(&law, &track, 0.002);
    let ends = ["direct", "sparse", "cg-jacobi"].map(|name| {
        let solver: SolverKind = name.parse().unwrap();
        let settings = Settings { solver, ..settings(Integrator::Bdf2) };
        run(&case, &settings, (0.02, 100), |_, _| {}).1
    });
    for end in &ends[1..] {
        let apart = end.positions.iter().zip(&ends[0].positions).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(apart < 1e-3 * LENGTH, "{apart} m");
    }
}

#[test]
fn what_is_not_known_is_refused() {
    let case = cantilever(&plastic(0.0, 0.0), &[(0.0, Vector3::zeros())], 0.0);
    let formulation = dynamics::formulation::Formulation::Xpbd;
    let step = StepParams { formulation, ..StepParams::DEFAULT };
    let found = Simulation::new(&case.0, &case.1, &Settings { step, ..Settings::default() }, None).err();
    assert!(matches!(found, Some(SimulationError::Inelastic("formulation newton"))), "{found:?}");
    for (law, what) in [
        (plastic(-1.0, 0.0), "hardening"),
        (JointLaw::Friction(StrandFriction { moment: 0.0, stiffness: 1.0 }), "moment of friction"),
        (JointLaw::Viscoelastic(vec![MaxwellBranch { share: 0.6, time: 1.0 }; 2]), "sum of the shares"),
    ] {
        let case = cantilever(&law, &[(0.0, Vector3::zeros())], 0.0);
        let found = case.0.validate(&case.1).unwrap_err().to_string();
        assert!(found.contains(what), "{found}");
    }
}

/// Slopes of the wire's stiffness, of a half and of a fifth of it.
pub(crate) fn table(unloading: Unloading) -> JointLaw {
    let stiffness = bending();
    let points = vec![[0.1, 0.1 * stiffness], [0.3, 0.2 * stiffness], [0.8, 0.3 * stiffness]];
    JointLaw::Tabulated(MomentTable { points, unloading })
}

/// Curvature at which the table bears a moment.
pub(crate) fn bent_by(moment: f64) -> f64 {
    match moment / bending() {
        m if m <= 0.1 => m,
        m if m <= 0.2 => 0.1 + (m - 0.1) / 0.5,
        m => 0.3 + (m - 0.2) / 0.2,
    }
}

#[test]
fn a_wire_follows_a_table_of_moments_and_goes_back_by_its_rule() {
    let most = 0.35 * bending();
    let torque: Vec<_> = [0.0, most, most, 0.0, 0.0].map(|m| Vector3::y() * m).into();
    let track: Vec<_> = [0.0, 2.0, 3.0, 5.0, 6.0].into_iter().zip(torque).collect();
    for integrator in [Integrator::Euler, Integrator::Bdf2] {
        for unloading in [Unloading::Elastic, Unloading::Masing] {
            let case = cantilever(&table(unloading), &track, 1e-3);
            let mut seen = Vec::new();
            let (simulation, state) = run(&case, &settings(integrator), (0.02, 300), |_, state| {
                seen.push(angle(state, &Vector3::y()));
            });
            // Masing: the way back is the curve at twice its size.
            let left = match unloading {
                Unloading::Elastic => 0.0,
                Unloading::Masing => bent_by(most) - 2.0 * bent_by(0.5 * most),
            };
            let (half, top, end) = (seen[49], seen[149], seen[299]);
            println!(
                "{integrator:?} {unloading:?}: {half} {top} {end} {left}, iterations {}",
                simulation.counters().iterations
            );
            assert!((half / bent_by(0.5 * most) - 1.0).abs() < 0.01, "{half} of {}", bent_by(0.5 * most));
            assert!((top / bent_by(most) - 1.0).abs() < 0.01, "{top} of {}", bent_by(most));
            assert!((end - left).abs() < 0.01 * bent_by(most), "{end} of {left}");
            assert_eq!(dissipated(&case.0, &state) > 0.0, unloading == Unloading::Masing);
        }
    }
}

#[test]
fn loops_by_masings_rule_take_their_area() {
    let most = 0.35 * bending();
    // Steps of the end's curvature: 8 times the energy of the curve less 4 times moment and curvature.
    let bent = bent_by(most);
    let energy = bending() * (0.5 * 0.1 * 0.1 + 0.15 * 0.2 + 0.5 * (0.2 + 0.35) * (bent - 0.3));
    let expected = 8.0 * energy - 4.0 * most * bent;
    for integrator in [Integrator::Euler, Integrator::Bdf2] {
        let [work, lost, largest] = cycle(&table(Unloading::Masing), Vector3::y(), most, integrator);
        println!("{integrator:?}: {work} {lost} {expected}, {largest} {bent}");
        assert!((lost / expected - 1.0).abs() < 0.01, "{lost} of {expected}");
        assert!((work / expected - 1.0).abs() < 0.01, "{work} of {expected}");
    }
}

/// What has yielded beside what has not, in one batch: each goes on as it does alone.
#[test]
fn copies_keep_what_their_own_joints_remember() {
    let torque = [(0.0, Vector3::zeros()), (0.2, Vector3::y() * 0.9), (0.4, Vector3::zeros())];
    let (model, fresh) = cantilever(&plastic(0.1, 0.0), &torque, 1e-3);
    let settings = settings(Integrator::Bdf2);
    let mut bent = fresh.clone();
    let mut simulation = Simulation::new(&model, &bent, &settings, None).unwrap();
    (0..30).for_each(|_| _ = simulation.step(0.01).unwrap());
    simulation.store(&mut bent);
    assert!(!bent.internals.is_empty());
    let states = [&fresh, &bent, &fresh];
    let mut batch = Batch::new(&states.map(|state| (&model, state)), &settings, None).unwrap();
    (0..10).for_each(|_| assert!(batch.step(0.01).is_ok()));
    for (copy, state) in states.into_iter().enumerate() {
        let mut alone = Simulation::new(&model, state, &settings, None).unwrap();
        (0..10).for_each(|_| _ = alone.step(0.01).unwrap());
        let [mut one, mut other] = [state.clone(), state.clone()];
        alone.store(&mut one);
        batch.store(copy, &mut other);
        assert_eq!(one.positions, other.positions, "copy {copy}");
    }
}

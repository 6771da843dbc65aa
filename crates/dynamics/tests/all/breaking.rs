//! Joints that break: where and when, against closed forms; momentum over a chain of breaks; contacts, snapshots, refusals.

use std::f64::consts::PI;
use std::sync::Arc;

use dynamics::formulation::Formulation;
use dynamics::simulation::{Settings, Simulation, SimulationError};
use dynamics::step::{Status, StepParams};
use jointed::linear::cg::CgParams;
use jointed::linear::solvers::SolverKind;
use nalgebra::Vector3;
use rod::measure::{angular_momentum, energy, linear_momentum};
use rod::{
    Assembly, Break, Change, Changing, Freedom, Integrator, Interpolation, JointForce, Load, Material, Model, Obstacle,
    ObstacleShape, RestShape, RodSpec, State, Strength, Surface, Track, shape,
};

const INTEGRATORS: [Integrator; 2] = [Integrator::Euler, Integrator::Bdf2];

const GLASS: Material = Material { youngs_modulus: 1e10, torsion_modulus: 4e9, density: 1500.0 };

fn settings(integrator: Integrator) -> Settings {
    Settings { step: StepParams { integrator, ..StepParams::DEFAULT }, ..Settings::default() }
}

fn tension(tension: f64) -> Strength {
    Strength { tension, ..Strength::UNLIMITED }
}

fn curvature(curvature: f64) -> Strength {
    Strength { curvature, ..Strength::UNLIMITED }
}

/// Steps and shows each step's end.
fn run(
    simulation: &mut Simulation,
    state: &mut State,
    (dt, steps): (f64, usize),
    mut see: impl FnMut(&mut Simulation, &State),
) {
    for step in 0..steps {
        let status = simulation.step(dt).unwrap().status;
        assert!(status <= Status::ConvergedInSubsteps, "step {step}: {status:?}");
        simulation.store(state);
        see(simulation, state);
    }
}

/// A thread of 20 segments and 1 kg/m that hangs down from a clamp, with a force at its end that grows from 0 by `rate` [N/s].
fn thread(strength: Vec<Strength>, rate: f64) -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::z() * -10.0);
    let radius = (1.0 / (GLASS.density * PI)).sqrt();
    let nodes = shape::straight(Vector3::zeros(), -Vector3::z(), 2.0, 20);
    let rod = assembly.rod(&RodSpec { strengths: strength, ..RodSpec::new(nodes, radius, GLASS) });
    assembly.clamp_start(&rod);
    assembly.load(Load {
        segment: rod.end - 1,
        offset: 0.05,
        force: Vector3::zeros(),
        torque: Vector3::zeros(),
        follows: false,
    });
    let track = Track::new(&[(0.0, Vector3::zeros()), (10.0, Vector3::z() * (-10.0 * rate))], Interpolation::Linear);
    assembly.model_mut().changes.push(Change { of: Changing::Force(0), track: Arc::new(track.unwrap()) });
    assembly.finish()
}

#[test]
fn a_thread_breaks_where_its_tension_comes_to_its_strength_and_its_end_falls() {
    // Tension at joint k, counted from the clamp: the weight below, 1 N a segment, and the force. Joint 7 bears 16 N, the clamp 30 N.
    let mut strengths = vec![tension(30.0); 20];
    strengths[7] = tension(16.0);
    for integrator in INTEGRATORS {
        let (model, mut state) = thread(strengths.clone(), 5.0);
        assert_eq!(model.breakable.len(), 20);
        let mut simulation = Simulation::new(&model, &state, &settings(integrator), None).unwrap();
        let start = state.positions[19].z;
        let (dt, mut most) = (0.01, 0.0_f64);
        let mut forces = vec![JointForce::default(); model.joints.len()];
        run(&mut simulation, &mut state, (dt, 100), |simulation, state| {
            simulation.store_joint_forces(&mut forces);
            let of = |k: usize| forces[k].tension(&model, state, &model.joints[k]);
            // Joint 19 of the model is the clamp; joints of segments 6 and 7, and of 7 and 8, have the weaker strength.
            most = most.max(of(6)).max(of(7));
        });
        // 13 segments hang below joint 6 and 12 below joint 7: 13 + 5 t = 16.
        let breaks = simulation.breaks();
        let [Break { joint: 6, time, load }] = breaks[..] else { panic!("{integrator:?}: {breaks:?}") };
        assert!((time - 0.6).abs() <= dt * 1.001, "{integrator:?}: {time}");
        assert!(load.tension > 16.0 && load.tension < 16.0 + 2.0 * dt * 5.0, "{integrator:?}: {load:?}");
        assert!(most <= 16.0, "no step ends with more than its strength: {most} N");
        // The end falls with g, and with the force over its mass.
        let t = simulation.time() - time;
        let mass = 1.3;
        let fallen = start - 0.5 * t * t * (10.0 + 5.0 * time / mass) - 5.0 * t.powi(3) / (6.0 * mass);
        assert!(
            (state.positions[19].z / fallen - 1.0).abs() < 0.01,
            "{integrator:?}: {} {fallen}",
            state.positions[19].z
        );
        simulation.store_joint_forces(&mut forces);
        assert_eq!(forces[6], JointForce::default());
        let held = forces[19].tension(&model, &state, &model.joints[19]);
        let clamp = forces.last().unwrap();
        assert!((clamp.force.norm() - 7.0).abs() < 0.01, "what hangs still weighs 7 N: {} {held}", clamp.force);
    }
}

#[test]
fn a_cantilever_breaks_at_its_clamp_where_force_times_length_is_its_moment() {
    for integrator in INTEGRATORS {
        let mut assembly = Assembly::new(Vector3::zeros());
        let nodes = shape::straight(Vector3::zeros(), Vector3::x(), 1.0, 20);
        let strengths = vec![Strength { moment: 2.0, ..Strength::UNLIMITED }];
        let light = Material { density: 1.0, ..GLASS };
        let rod = assembly.rod(&RodSpec { strengths, ..RodSpec::new(nodes, 0.01, light) });
        assembly.clamp_start(&rod);
        let load = Load {
            segment: rod.end - 1,
            offset: 0.025,
            force: Vector3::zeros(),
            torque: Vector3::zeros(),
            follows: false,
        };
        assembly.load(load);
        let track = Track::new(&[(0.0, Vector3::zeros()), (4.0, Vector3::z() * 4.0)], Interpolation::Linear).unwrap();
        assembly.model_mut().changes.push(Change { of: Changing::Force(0), track: Arc::new(track) });
        let (model, mut state) = assembly.finish();
        let mut simulation = Simulation::new(&model, &state, &settings(integrator), None).unwrap();
        run(&mut simulation, &mut state, (0.005, 420), |_, _| {});
        let breaks = simulation.breaks();
        assert_eq!(breaks.len(), 1, "{breaks:?}");
        assert_eq!(model.joints[breaks[0].joint].b, rod::Body::Segment(0), "at the clamp");
        assert!((breaks[0].time / 2.0 - 1.0).abs() < 0.01, "{integrator:?}: {breaks:?}");
    }
}

/// A rod that is bent to an arc and held at its start; its end is let go of as the run begins. So many segments there never break.
fn bent(segments: usize, strength: Strength, whole: usize) -> (Model, State, f64) {
    let (length, curvature) = (0.24, 2.0);
    let mut assembly = Assembly::new(Vector3::zeros());
    let nodes = (0..=segments).map(|k| {
        let angle = curvature * length * k as f64 / segments as f64;
        Vector3::new(angle.sin(), 0.0, 1.0 - angle.cos()) / curvature
    });
    let spec = RodSpec::new(nodes.collect(), 6e-4, GLASS);
    let strengths = (0..segments).map(|i| if i + whole < segments { strength } else { Strength::UNLIMITED }).collect();
    let rod = assembly.rod(&RodSpec { rest: RestShape::Straight, strengths, ..spec });
    assembly.clamp_start(&rod);
    let (model, state) = assembly.finish();
    (model, state, curvature)
}

#[test]
fn a_bent_rod_that_is_let_go_breaks_up_to_1_43_times_its_curvature() {
    // Near the end waves are as short as segments for a while. Audoly and Neukirch (2005): the waves from the end that is let go bend the rod further, up to 2 S(sqrt 2) = 1.4281 of its curvature with
    // Fresnel's S, before they come to the clamp. Bending waves take about 3.545 sqrt(c t), c^2 = EI / (rho A).
    let (segments, near, share_of_rod) = (480, 30, 0.15);
    let c = (GLASS.youngs_modulus / GLASS.density).sqrt() * 6e-4 / 2.0;
    let end = (share_of_rod * 0.24 / 3.545_f64).powi(2) / c;
    for (share, breaks) in [(1.38, true), (1.48, false)] {
        for integrator in INTEGRATORS {
            let (model, mut state, bent) = bent(segments, curvature(share * 2.0), near);
            let mut simulation = Simulation::new(&model, &state, &settings(integrator), None).unwrap();
            let mut most = 0.0_f64;
            run(&mut simulation, &mut state, (end / 400.0, 400), |_, state| {
                let of = |k: usize| rod::curvature(&model, state, &model.joints[k]) / bent;
                most = (0..segments - near).map(of).fold(most, f64::max);
            });
            println!("{share} {integrator:?}: {most}, {:?}", simulation.breaks().first());
            assert_eq!(!simulation.breaks().is_empty(), breaks, "{share} {integrator:?}: {most}");
            if !breaks {
                assert!((most / 1.4281 - 1.0).abs() < 0.01, "{integrator:?}: {most}");
            }
        }
    }
}

/// A rod in free flight whose parts fly apart, and turn.
fn flying(strength: Strength) -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::zeros());
    let nodes = shape::straight(Vector3::zeros(), Vector3::x(), 1.0, 40);
    assembly.rod(&RodSpec { strengths: vec![strength], ..RodSpec::new(nodes, 0.005, GLASS) });
    let (model, mut state) = assembly.finish();
    for (x, v) in state.positions.iter().zip(&mut state.velocities) {
        *v = Vector3::new(1.0 + 20.0 * (x.x - 0.5).powi(3), 2.0, -0.5)
            + Vector3::new(0.0, (9.0 * x.x).sin(), (5.0 * x.x).cos()) * 4.0;
    }
    for (i, w) in state.angular_velocities.iter_mut().enumerate() {
        *w = Vector3::new(3.0, (i as f64).sin(), 0.0);
    }
    (model, state)
}

#[test]
fn a_chain_of_breaks_conserves_momentum_and_gains_no_energy() {
    for integrator in INTEGRATORS {
        for strength in [tension(60.0), curvature(0.2), Strength { moment: 1.0, ..Strength::UNLIMITED }] {
            let (mut model, mut state) = flying(strength);
            let mut simulation = Simulation::new(&model, &state, &settings(integrator), None).unwrap();
            let before = [linear_momentum(&model, &state), angular_momentum(&model, &state)];
            let mass: f64 = model.segments.iter().map(rod::Segment::mass).sum();
            let mut last = energy(&model, &state).total();
            let (first, mut gained) = (last, 0.0_f64);
            run(&mut simulation, &mut state, (2e-4, 400), |simulation, state| {
                simulation.store_model(&mut model);
                let now = energy(&model, state).total();
                gained = gained.max(now - last);
                last = now;
            });
            let after = [linear_momentum(&model, &state), angular_momentum(&model, &state)];
            let scale = mass * 4.0;
            let off: [f64; 2] = [0, 1].map(|k| (after[k] - before[k]).norm() / scale);
            let breaks = simulation.breaks();
            println!(
                "{integrator:?} {strength:?}: {} breaks, off by {off:?}, gained {gained:e} of {first} J",
                breaks.len()
            );
            assert!(breaks.len() >= 3, "{} breaks", breaks.len());
            assert!(off[0] < 1e-9 && off[1] < 1e-3, "{integrator:?} {strength:?}: {off:?}");
            assert!(gained < 1e-3 * first, "{integrator:?} {strength:?}: {gained} J of {first} J");
            let broken = model.joints.iter().filter(|joint| joint.freedom == Freedom::Broken).count();
            assert_eq!(broken, breaks.len());
            assert!(breaks.windows(2).all(|pair| pair[0].time <= pair[1].time));
        }
    }
}

#[test]
fn pieces_touch_what_is_below_them_and_a_snapshot_goes_on_with_the_same_bits() {
    let (model, state, _) = bent(60, curvature(2.5), 0);
    let mut model = model;
    model.gravity = Vector3::z() * -9.81;
    let floor = ObstacleShape::HalfSpace { point: Vector3::z() * -0.05, normal: Vector3::z_axis() };
    model.contacts.obstacles.push(Obstacle { shape: floor, surface: Surface::default(), motion: None });
    let mut first = Simulation::new(&model, &state, &settings(Integrator::Bdf2), None).unwrap();
    let mut at = state.clone();
    run(&mut first, &mut at, (1e-4, 300), |_, _| {});
    let snapshot = first.snapshot();
    let then = first.breaks();
    assert!(!then.is_empty());
    run(&mut first, &mut at, (1e-4, 700), |_, _| {});
    // Another simulation, in which nothing has broken yet.
    let mut second = Simulation::new(&model, &state, &settings(Integrator::Bdf2), None).unwrap();
    second.restore(&snapshot).unwrap();
    assert_eq!(second.breaks(), then);
    let mut again = state.clone();
    run(&mut second, &mut again, (1e-4, 700), |_, _| {});
    assert_eq!((again, second.breaks()), (at.clone(), first.breaks()));
    assert!(at.positions.iter().all(|x| x.z > -0.05));
    // And back to the start, where all is whole.
    let start = Simulation::new(&model, &state, &settings(Integrator::Bdf2), None).unwrap().snapshot();
    first.restore(&start).unwrap();
    assert!(first.breaks().is_empty());
    let mut whole = model.clone();
    first.store_model(&mut whole);
    assert_eq!(whole, model);
}

#[test]
fn a_strength_that_is_never_reached_changes_no_bit() {
    let (model, state, _) = bent(40, curvature(100.0), 0);
    let mut elastic = model.clone();
    elastic.breakable.clear();
    let ends = [&model, &elastic].map(|model| {
        let mut simulation = Simulation::new(model, &state, &settings(Integrator::Bdf2), None).unwrap();
        let mut end = state.clone();
        run(&mut simulation, &mut end, (1e-4, 200), |_, _| {});
        (end, simulation.counters().iterations)
    });
    assert_eq!(ends[0], ends[1]);
}

#[test]
fn what_knows_no_breaks_refuses_them() {
    let (model, state) = thread(vec![tension(1.0)], 1.0);
    let step = StepParams { formulation: Formulation::Xpbd, ..StepParams::DEFAULT };
    let error = Simulation::new(&model, &state, &Settings { step, ..Settings::default() }, None).err();
    assert!(matches!(error, Some(SimulationError::Breakable(_))), "{error:?}");
    let solver = SolverKind::Cg(CgParams::default());
    let error = Simulation::new(&model, &state, &Settings { solver, ..Settings::default() }, None).err();
    assert!(matches!(error, Some(SimulationError::Loose(_))), "{error:?}");
    for (strength, name) in [(f64::NAN, "strength"), (0.0, "strength"), (-1.0, "strength")] {
        let (model, state) = thread(vec![tension(strength)], 1.0);
        let error = model.validate(&state).unwrap_err().to_string();
        assert!(error.contains(name), "{error}");
    }
}

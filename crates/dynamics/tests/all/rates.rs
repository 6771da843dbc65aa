//! Angular velocities of states are true rates, angle / dt, however fast a segment spins.

use dynamics::formulation::Formulation;
use dynamics::simulation::{Settings, Simulation};
use dynamics::step::{Status, StepParams};
use nalgebra::{UnitQuaternion, Vector3};
use rod::Integrator;
use rod::{Assembly, Friction, Load, Model, Obstacle, ObstacleShape, RodSpec, State, Surface, shape};

use crate::common::{integrated, material};

const DT: f64 = 0.02;
/// 2 rad a step about the axis, and about one across it.
const RATES: [Vector3<f64>; 2] = [Vector3::new(100.0, 0.0, 0.0), Vector3::new(0.0, 60.0, -80.0)];

/// Segments of one piece each that spin and feel nothing: three alike rods are stepped in lanes, one alone.
fn spinning(rods: usize, rate: Vector3<f64>) -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::zeros());
    for k in 0..rods {
        let nodes = shape::straight(Vector3::y() * k as f64, Vector3::x(), 0.1, 1);
        assembly.rod(&RodSpec::new(nodes, 0.02, material(1e6, 1000.0)));
    }
    assembly.state_mut().angular_velocities.fill(rate);
    assembly.finish()
}

fn simulation(model: &Model, state: &State, (formulation, integrator): (Formulation, Integrator)) -> Simulation {
    let step = StepParams { formulation, integrator, ..StepParams::DEFAULT };
    let settings = Settings { step, ..Settings::default() };
    Simulation::new(model, state, &settings, None).unwrap()
}

/// The state once all segments have turned by a rotation vector [rad].
fn turned(state: &State, by: Vector3<f64>) -> State {
    let turn = UnitQuaternion::from_scaled_axis(by);
    State { orientations: state.orientations.iter().map(|q| turn * q).collect(), ..state.clone() }
}

fn apart(a: &State, b: &State) -> f64 {
    let spins = a.angular_velocities.iter().zip(&b.angular_velocities).map(|(a, b)| (a - b).norm() / b.norm());
    let turns = a.orientations.iter().zip(&b.orientations).map(|(a, b)| (a * b.inverse()).imag().norm());
    spins.chain(turns).fold(0.0, f64::max)
}

/// A torque spins a segment up to more than a turn a step: beyond a right angle a step its momentum is known from substeps alone.
#[test]
fn a_torque_spins_a_segment_up_beyond_a_right_angle_a_step() {
    for rods in [1, 3] {
        for way in integrated() {
            let (mut model, state) = spinning(rods, Vector3::zeros());
            let (rate, steps) = (8.0 / DT, 60);
            let torque = Vector3::x() * (model.segments[0].axial_inertia() * rate / (f64::from(steps) * DT));
            let load = |segment| Load { segment, offset: 0.0, force: Vector3::zeros(), torque, follows: false };
            model.loads.extend((0..rods).map(load));
            let mut simulation = simulation(&model, &state, way);
            let mut now = state.clone();
            for step in 1..=steps {
                let report = simulation.step(DT).unwrap();
                assert!(report.status.is_solved(), "{way:?}, step {step}: {:?}", report.status);
                simulation.store(&mut now);
                let expected = Vector3::x() * (rate * f64::from(step) / f64::from(steps));
                let error = (now.angular_velocities[0] - expected).norm() / rate;
                // As a step is divided for the first time, half of what the last one gained is lost.
                assert!(error < 1.5 / f64::from(steps), "{way:?}, {rods} rods, step {step}: {error:e}");
            }
        }
    }
}

#[test]
fn a_free_segment_turns_at_the_rate_that_it_was_given_and_says_so() {
    for rods in [1, 3] {
        for rate in RATES {
            for way in integrated() {
                let (model, state) = spinning(rods, rate);
                let mut simulation = simulation(&model, &state, way);
                let mut now = state.clone();
                simulation.store(&mut now);
                assert_eq!(now, state, "given rates stay until a step is done");
                for step in 1..=100 {
                    simulation.step(DT).unwrap();
                    simulation.store(&mut now);
                    let error = apart(&now, &turned(&state, rate * (f64::from(step) * DT)));
                    assert!(error < 1e-9, "{way:?}, {rate}, step {step}: {error:e}");
                }
            }
        }
    }
}

/// A discrete momentum of a short step, `I sin(angle) / dt`, may be that of no turn of a long one: what rolls fast would turn faster
/// after each step that was done in parts.
#[test]
fn the_rate_goes_on_in_steps_of_another_length() {
    for rods in [1, 3] {
        for rate in RATES {
            for formulation in Formulation::ALL {
                let (model, state) = spinning(rods, rate);
                let mut simulation = simulation(&model, &state, (formulation, Integrator::Euler));
                let (mut now, mut time) = (state.clone(), 0.0);
                for share in [0.5, 0.5, 1.0, 1.0, 0.25, 0.25, 0.5, 1.0, 0.125, 1.0] {
                    simulation.step(share * DT).unwrap();
                    simulation.store(&mut now);
                    time += share * DT;
                    let error = apart(&now, &turned(&state, rate * time));
                    assert!(error < 1e-9, "{formulation:?}, {rate}, {time} s: {error:e}");
                }
            }
        }
    }
}

/// A rod that rolls on the ground by more than a radian a step wins nothing where steps become shorter or longer, and none is halved.
#[test]
fn what_rolls_fast_is_not_halved_as_steps_change_their_length() {
    const RADIUS: f64 = 0.005;
    let mut assembly = Assembly::new(Vector3::z() * -9.81);
    let nodes = shape::straight(Vector3::z() * RADIUS, Vector3::y(), 0.5, 1);
    assembly.rod(&RodSpec::new(nodes, RADIUS, material(1e6, 1000.0)));
    let (mut model, mut state) = assembly.finish();
    let ground = ObstacleShape::HalfSpace { point: Vector3::zeros(), normal: Vector3::z_axis() };
    let surface = Surface { friction: Friction::new(0.4), ..Surface::default() };
    model.contacts.obstacles.push(Obstacle::new(ground, surface));
    let speed = 0.56;
    (state.velocities[0], state.angular_velocities[0]) = (Vector3::x() * speed, Vector3::y() * (speed / RADIUS));
    let mut simulation = simulation(&model, &state, (Formulation::Xpbd, Integrator::Euler));
    for share in [1.0, 1.0, 0.5, 0.5, 1.0, 0.25, 0.25, 0.5, 1.0, 0.125, 1.0, 1.0] {
        assert_eq!(simulation.step(0.01 * share).unwrap().status, Status::Converged, "{share}");
    }
    simulation.store(&mut state);
    let [v, w] = [state.velocities[0].x, state.angular_velocities[0].y * RADIUS];
    let energy = (v * v + 0.5 * w * w) / (1.5 * speed * speed);
    assert!((0.97..1.0).contains(&energy), "{energy}: {v} {w}");
}

#[test]
fn a_stored_state_goes_on_as_if_it_had_not_been_stored() {
    for rods in [1, 3] {
        let (model, state) = spinning(rods, RATES[1]);
        let mut through = simulation(&model, &state, (Formulation::Newton, Integrator::Euler));
        let mut stored = state.clone();
        for _ in 0..20 {
            through.step(DT).unwrap();
            // A simulation of its own for each step.
            let mut next = simulation(&model, &stored, (Formulation::Newton, Integrator::Euler));
            next.step(DT).unwrap();
            next.store(&mut stored);
        }
        let mut end = state.clone();
        through.store(&mut end);
        let error = apart(&stored, &end);
        assert!(error < 1e-11, "{error:e}");
    }
}

#[test]
fn a_rate_that_is_given_between_steps_is_that_of_the_step_that_follows() {
    for (rods, integrator) in [1, 3].into_iter().flat_map(|rods| Integrator::ALL.map(|integrator| (rods, integrator))) {
        let (model, mut state) = spinning(rods, RATES[0]);
        let mut simulation = simulation(&model, &state, (Formulation::Newton, integrator));
        // About the segment's own axis, so that nothing precesses.
        for (share, dt) in [(1.2, 0.5 * DT), (-1.0, DT), (0.0, 0.1 * DT), (0.1, DT)] {
            let rate = RATES[0] * share;
            simulation.store(&mut state);
            state.angular_velocities.fill(rate);
            simulation.set_velocities(&state);
            let before = state.clone();
            simulation.store(&mut state);
            assert_eq!(state, before);
            simulation.step(dt).unwrap();
            simulation.store(&mut state);
            for (q, before) in state.orientations.iter().zip(&before.orientations) {
                let turn = (q * before.inverse()).scaled_axis();
                assert!((turn - rate * dt).norm() < 1e-11, "{turn}, not {}", rate * dt);
            }
        }
    }
}

#[test]
fn more_than_half_a_turn_a_step_is_divided_from_the_start() {
    let rate = Vector3::new(0.0, 0.0, 500.0);
    for integrator in Integrator::ALL {
        let (model, state) = spinning(1, rate);
        let mut simulation = simulation(&model, &state, (Formulation::Xpbd, integrator));
        let mut end = state.clone();
        simulation.step(DT).unwrap();
        simulation.store(&mut end);
        assert!(simulation.counters().retries > 0);
        assert!((end.angular_velocities[0] - rate).norm() < 1e-9 * rate.norm());
        let turn = UnitQuaternion::from_scaled_axis(rate * DT) * state.orientations[0];
        assert!((end.orientations[0] * turn.inverse()).imag().norm() < 1e-9);
    }
}

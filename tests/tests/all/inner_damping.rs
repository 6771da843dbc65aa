//! Inner damping against theory: a mode of circular frequency omega has the damping ratio omega tau / 2.

use std::f64::consts::PI;

use acceptance::vibration::{Mode, bending_mode};
use acceptance::{Beam, tight};
use cosserat::assembly::{Assembly, InnerDamping, RestShape, RodSpec, Stretch, shape};
use cosserat::simulation::{Formulation, Simulation};
use cosserat::state::{Model, State, measure};
use nalgebra::Vector3;

/// A cantilever along x with inner damping whose segments begin with the velocities of `kick`: (v, w) at x / L.
fn kicked(
    beam: &Beam,
    stretch: Stretch,
    inner_damping: InnerDamping,
    kick: impl Fn(f64) -> [Vector3<f64>; 2],
) -> (Model, State, Vec<f64>) {
    let mut assembly = Assembly::new(Vector3::zeros());
    let rod = assembly.rod(&RodSpec { stretch, inner_damping, ..beam.spec(Vector3::zeros(), Vector3::x()) });
    assembly.clamp_start(&rod);
    let places: Vec<f64> = rod.map(|i| (i as f64 + 0.5) / beam.segments as f64).collect();
    let state = assembly.state_mut();
    for (i, &place) in places.iter().enumerate() {
        [state.velocities[i], state.angular_velocities[i]] = kick(place);
    }
    let (model, state) = assembly.finish();
    (model, state, places)
}

/// Checks what damping adds to the decay of a mode, and that no other damping does.
fn check(case: &str, exact: f64, mode: impl Fn(InnerDamping, f64) -> Mode, with: impl Fn(f64) -> InnerDamping) {
    // The time step's own damping is of the same size as that with tau = dt.
    let dt = 0.02 / exact;
    let free = mode(InnerDamping::NONE, dt);
    assert!((free.frequency / exact - 1.0).abs() < 2e-3, "{case}: {} instead of {exact}", free.frequency);
    for tau in [dt, 10.0 * dt] {
        let damped = mode(with(tau), dt);
        println!("{case}: omega {:.5}, tau {:.5}", damped.frequency / exact, damped.relaxation / tau);
        assert!((damped.relaxation / tau - 1.0).abs() < 0.01, "{case}: {} instead of {tau}", damped.relaxation);
        let ratio = (damped.decay - free.decay) / exact;
        let theory = 0.5 * exact * tau;
        assert!((ratio / theory - 1.0).abs() < 0.01, "{case}: damping ratio {ratio} instead of {theory}");
    }
    let InnerDamping { bending, twist, stretch } = with(1.0);
    let others = [(1.0 - bending), (1.0 - twist), (1.0 - stretch)].map(|other| other * 10.0 * dt);
    let other = mode(InnerDamping { bending: others[0], twist: others[1], stretch: others[2] }, dt);
    assert!((other.decay / free.decay - 1.0).abs() < 1e-3, "{case}: {} and {}", other.decay, free.decay);
}

#[test]
fn bending_modes_decay_at_their_rates() {
    let beam = Beam { radius: 0.001, ..Beam::rubber(160) };
    for (index, beta) in [1.875104, 4.694091, 7.854757].into_iter().enumerate() {
        let exact = beta * beta * (beam.bending() / beam.line_density()).sqrt() / beam.length.powi(2);
        let small = 1e-4 * beam.length * exact;
        let mode = |damping, dt| {
            let (model, state, places) = kicked(&beam, Stretch::ZERO_STRETCH, damping, |x| {
                let (shape, slope) = bending_mode(beta, x);
                [Vector3::z() * (small * shape), -Vector3::y() * (small * slope / beam.length)]
            });
            let weights: Vec<f64> = places.iter().map(|&x| bending_mode(beta, x).0).collect();
            let along = |state: &State| weights.iter().zip(&state.positions).map(|(weight, x)| weight * x.z).sum();
            Mode::seen(&model, &state, dt, 400, along)
        };
        let with = |bending| InnerDamping { bending, ..InnerDamping::NONE };
        check(&format!("bending mode {}", index + 1), exact, mode, with);
    }
}

#[test]
fn the_first_twisting_mode_decays_at_its_rate() {
    let beam = Beam::rubber(80);
    let exact = 0.5 * PI / beam.length * (beam.material.torsion_modulus / beam.material.density).sqrt();
    let shape = |x: f64| (0.5 * PI * x).sin();
    let mode = |damping, dt| {
        let kick = |x: f64| [Vector3::zeros(), Vector3::x() * (1e-3 * exact * shape(x))];
        let (model, state, places) = kicked(&beam, Stretch::ZERO_STRETCH, damping, kick);
        let rest = state.orientations[0];
        Mode::seen(&model, &state, dt, 400, |state| {
            places.iter().zip(&state.orientations).map(|(&x, q)| shape(x) * (rest.inverse() * q).imag().z).sum()
        })
    };
    check("twist", exact, mode, |twist| InnerDamping { twist, ..InnerDamping::NONE });
}

#[test]
fn the_first_stretching_mode_decays_at_its_rate() {
    let beam = Beam::rubber(80);
    let exact = 0.5 * PI / beam.length * (beam.material.youngs_modulus / beam.material.density).sqrt();
    let shape = |x: f64| (0.5 * PI * x).sin();
    let mode = |damping, dt| {
        let kick = |x: f64| [Vector3::x() * (1e-5 * beam.length * exact * shape(x)), Vector3::zeros()];
        let (model, state, places) = kicked(&beam, Stretch::Physical, damping, kick);
        let first = state.clone();
        Mode::seen(&model, &state, dt, 400, |state| {
            places.iter().enumerate().map(|(i, &x)| shape(x) * (state.positions[i] - first.positions[i]).x).sum()
        })
    };
    check("stretch", exact, mode, |stretch| InnerDamping { stretch, ..InnerDamping::NONE });
}

/// A rod that turns as one piece, bent and stretched by its spin, loses what it loses without damping.
#[test]
fn a_rigid_spin_loses_nothing() {
    let energy_after = |time: f64| {
        let beam = Beam::rubber(20);
        let inner_damping = InnerDamping { bending: time, twist: time, stretch: time };
        let mut assembly = Assembly::new(Vector3::zeros());
        assembly.rod(&RodSpec { inner_damping, ..beam.spec(-Vector3::x() * 0.5 * beam.length, Vector3::x()) });
        let spin = Vector3::new(5.0, 0.0, 3.0);
        let state = assembly.state_mut();
        for i in 0..state.positions.len() {
            state.velocities[i] = spin.cross(&state.positions[i]);
            state.angular_velocities[i] = spin;
        }
        let (model, state) = assembly.finish();
        let (_, end) = acceptance::run(&model, &state, &tight(), 0.002, 200);
        measure::energy(&model, &end).total()
    };
    let [free, damped] = [0.0, 0.02].map(energy_after);
    println!("energy of a spin: {free} without, {damped} with damping");
    assert!((damped / free - 1.0).abs() < 1e-6, "{damped} instead of {free}");
}

/// Whatever the relaxation time, a bent and twisted rod never gains energy.
#[test]
fn energy_never_grows() {
    for formulation in Formulation::ALL {
        for ratio in [0.1, 1.0, 1e3] {
            let (dt, time) = (0.005, 0.005 * ratio);
            let mut assembly = Assembly::new(Vector3::zeros());
            let nodes = shape::helix(Vector3::zeros(), 0.2, 0.3, 1.5, 30);
            let inner_damping = InnerDamping { bending: time, twist: time, stretch: time };
            let spec = RodSpec {
                inner_damping,
                rest: RestShape::Straight,
                ..RodSpec::new(nodes, 0.01, Beam::rubber(1).material)
            };
            let rod = assembly.rod(&spec);
            assembly.clamp_start(&rod);
            let (model, mut state) = assembly.finish();
            let mut settings = tight();
            settings.step.formulation = formulation;
            let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
            let mut before = measure::energy(&model, &state).total();
            let first = before;
            for step in 0..100 {
                simulation.step(dt).unwrap();
                simulation.store(&mut state);
                let now = measure::energy(&model, &state).total();
                assert!(
                    now <= before + 1e-6 * first,
                    "{formulation}, tau / dt = {ratio}, step {step}: {before} to {now}"
                );
                before = now;
            }
            assert!(before < first);
        }
    }
}

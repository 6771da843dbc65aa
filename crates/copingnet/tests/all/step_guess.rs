//! The learned start of a whole step: a wrong network costs time, never the motion.

use copingnet::{Encoding, Features, GnStepGuess, Head, NetworkConfig, Trained, Weights};
use dynamics::counters::Counters;
use dynamics::formulation::Formulation;
use dynamics::guess::InitialGuess;
use dynamics::simulation::{Settings, Simulation};
use dynamics::step::{Status, StepParams};
use graph::{Graph, Norms, planar_normal};
use rod::{Model, State};

use crate::moving::in_motion;

fn encoding() -> Encoding {
    let features = Features::History;
    Encoding { features, head: Head::Turns, norms: Norms::default(), whitening: features.unwhitened() }
}

fn sizes() -> NetworkConfig {
    let network = NetworkConfig { gn_blocks: 1, width: 16, scans: 2, ..NetworkConfig::default() };
    Features::History.configure(Head::Turns, network)
}

/// Some steps of implicit Euler, from a network's starts or from the predictions.
fn moved(model: &Model, state: &State, dts: &[f64], weights: Option<&Weights>) -> (State, Counters) {
    let step = StepParams {
        formulation: Formulation::Newton,
        relative_tolerance: 1e-10,
        motion_tolerance: 1e-10,
        ..StepParams::default()
    };
    let settings = Settings { step, ..Settings::default() };
    let trained = weights.map(|weights| Trained::new(weights, encoding()));
    let normal = planar_normal(model, state);
    let mut simulation = Simulation::new(
        model,
        state,
        &settings,
        Some(&|model, members, topology| {
            let graph = Graph::new(model, members, topology);
            let guess = GnStepGuess::new(trained.as_ref()?, graph, normal);
            Some(Box::new(guess) as Box<dyn InitialGuess>)
        }),
    )
    .unwrap();
    for &dt in dts {
        assert_eq!(simulation.step(dt).unwrap().status, Status::Converged);
    }
    let mut end = state.clone();
    simulation.store(&mut end);
    (end, simulation.counters())
}

fn farthest(a: &State, b: &State) -> f64 {
    a.positions.iter().zip(&b.positions).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

#[test]
fn no_network_changes_the_motion() {
    let mut dropped = 0;
    for which in 0..4 {
        let (model, state) = in_motion(which);
        let (expected, zero) = moved(&model, &state, &[0.02; 12], None);
        assert_eq!(zero.guesses_used + zero.guesses_dropped, 0);
        for scale in [0.0, 1.0, 30.0, 1e4, f32::NAN] {
            let mut weights = crate::common::weights(sizes(), 1.0);
            weights.values_mut().iter_mut().for_each(|x| *x *= scale);
            let (found, counters) = moved(&model, &state, &[0.02; 12], Some(&weights));
            let apart = farthest(&found, &expected);
            assert!(apart < 1e-7, "scene {which}, scale {scale}: {apart:e}");
            assert_eq!(counters.guesses_used + counters.guesses_dropped, 12);
            // What leads further than a body's length from the prediction is not followed.
            assert!(!(scale <= 1.0 && counters.guesses_used == 0), "scale {scale}");
            assert!(!scale.is_nan() || counters.guesses_used == 0, "scale {scale}");
            dropped += if scale == 1e4 { counters.guesses_dropped } else { 0 };
        }
    }
    assert!(dropped > 0);
}

#[test]
fn another_time_step_begins_without_a_history() {
    let (model, state) = in_motion(1);
    let dts: Vec<f64> = [0.02; 6].into_iter().chain([0.01; 6]).chain([0.05; 6]).collect();
    let (expected, _) = moved(&model, &state, &dts, None);
    let (found, counters) = moved(&model, &state, &dts, Some(&crate::common::weights(sizes(), 0.1)));
    assert!(farthest(&found, &expected) < 1e-7);
    assert_eq!(counters.guesses_used + counters.guesses_dropped, 18);
    assert!(counters.guesses_used > 12, "{}", counters.guesses_used);
}

#[test]
fn a_silent_network_continues_the_last_steps() {
    let (model, state) = in_motion(0);
    let (_, zero) = moved(&model, &state, &[0.02; 30], None);
    let (_, continued) = moved(&model, &state, &[0.02; 30], Some(&Weights::zeros(sizes())));
    assert_eq!(continued.guesses_dropped, 0);
    assert!(continued.iterations < zero.iterations, "{} {}", continued.iterations, zero.iterations);
}

#[test]
fn planar_rods_stay_in_their_plane() {
    let (model, state) = in_motion(0);
    let (end, _) = moved(&model, &state, &[0.02; 12], Some(&crate::common::weights(sizes(), 1.0)));
    assert!(end.positions.iter().all(|x| x.y.abs() < 1e-12), "{:?}", end.positions);
}

#[test]
fn the_first_step_alone_allocates() {
    let (model, state) = in_motion(2);
    let step = StepParams { formulation: Formulation::Newton, ..StepParams::default() };
    let settings = Settings { step, ..Settings::default() };
    let trained = Trained::new(&crate::common::weights(sizes(), 0.1), encoding());
    let guess = |model: &_, members: &_, topology: &_| {
        let graph = Graph::new(model, members, topology);
        Some(Box::new(GnStepGuess::new(&trained, graph, None)) as Box<dyn InitialGuess>)
    };
    let mut simulation = Simulation::new(&model, &state, &settings, Some(&guess)).unwrap();
    simulation.step(0.02).unwrap();
    let count = allocation_counter::measure(|| {
        for _ in 0..5 {
            simulation.step(0.02).unwrap();
        }
    });
    assert_eq!((count.count_total, simulation.counters().retries), (0, 0));
}

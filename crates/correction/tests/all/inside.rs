//! Corrections inside the simulation, of cables whose truth is known.

use correction::inside::{Inside, Law, fit};
use correction::moments::Moments;
use identify::cable::{Cable, Resolution};
use identify::fit::Stage;
use identify::metric::mean_error;
use identify::parameter::Parameters;
use identify::predict::predict;
use identify::recording::{GRIPPED, Recording};
use identify::simulated::{self, recordings};
use nalgebra::Vector2;

const EVEN: Law = Law { curvature: false, moments: None };

fn cables(recordings: &[Recording]) -> Vec<Cable> {
    recordings.iter().map(|recording| Cable::new(recording, Resolution::SEARCH.segments).unwrap()).collect()
}

/// Recordings of an even cable.
fn even(count: usize) -> Vec<Recording> {
    let plan = simulated::Plan { recordings: count, ..simulated::Plan::default() };
    recordings(&Parameters::default(), &plan).unwrap()
}

/// The same grips on a cable with this law.
fn of(truth: &Inside, mut recordings: Vec<Recording>) -> Vec<Recording> {
    let predictions = truth.predict(&recordings, &cables(&recordings)).unwrap();
    for (recording, prediction) in recordings.iter_mut().zip(predictions) {
        // The first two frames are those that the cable begins with.
        for (real, predicted) in recording.markers.iter_mut().zip(prediction.markers).skip(2) {
            real[GRIPPED..][..predicted.len()].copy_from_slice(&predicted);
        }
    }
    recordings
}

fn error(inside: &Inside, recordings: &[Recording]) -> f64 {
    let predictions = inside.predict(recordings, &cables(recordings)).unwrap();
    recordings.iter().zip(&predictions).map(|(own, predicted)| mean_error(own, predicted)).sum::<f64>()
        / recordings.len() as f64
}

#[test]
fn without_a_law_a_cable_is_even() {
    let recordings = even(3);
    let even = Inside { parameters: Parameters::default(), law: EVEN, curvatures: Vec::new() };
    let silent = Law { curvature: false, moments: Some(Moments::new(3, 1)) };
    let expected = predict(&cables(&recordings), &Parameters::default(), usize::MAX, 1).unwrap();
    for law in [EVEN, silent] {
        let found = Inside { law, ..even.clone() }.predict(&recordings, &cables(&recordings)).unwrap();
        assert_eq!(found, expected);
    }
}

#[test]
fn laws_are_found_on_some_recordings_and_hold_on_others() {
    let begin = Inside { parameters: Parameters::default(), law: EVEN, curvatures: Vec::new() };
    let knots = even(1)[0].count() + 2 - 2 * GRIPPED;
    let curvatures = (0..knots).map(|k| Vector2::new((0.9 * k as f64).sin(), 1.0) * 4.0).collect();
    let curved = Inside { law: Law { curvature: true, moments: None }, curvatures, ..begin.clone() };
    // It reads as the one that is trained does at first, and says something of it.
    let mut moments = Moments::new(2, 1);
    moments.numbers_mut().iter_mut().rev().take(4).for_each(|x| *x = 2.0);
    let bearing = Inside { law: Law { curvature: false, moments: Some(moments) }, ..begin.clone() };
    for truth in [curved, bearing] {
        let recordings = of(&truth, even(10));
        let (own, others) = recordings.split_at(8);
        let law = Law { moments: truth.law.moments.as_ref().map(|_| Moments::new(2, 1)), ..truth.law.clone() };
        let stages = [Stage::of_all(20, 3), Stage::of_all(60, 10)];
        let found = fit(own, &cables(own), &Parameters::default(), law, &stages, &mut || true).unwrap().unwrap();
        let (before, after) = (error(&begin, others), error(&found, others));
        assert!(before > 1e-4 && after < 0.3 * before, "{before} m, then {after} m");
    }
}

//! Corrections of a simulated noodle that was identified wrongly.

use std::path::PathBuf;

use correction::film::{Film, Guess};
use correction::inputs::Kind;
use correction::network::Shape;
use correction::noodle::{errors, held};
use correction::training::{ASIDE, Plan, train};
use cosserat::state::Pose;
use identify::noodle::{Noodle, NoodleRecording, Number, Numbers};
use identify::predict::predict;
use identify::recording::Recording;
use nalgebra::{UnitQuaternion, Vector3};

const FRAMES: usize = 300;

/// A noodle that is heavier and bent at rest, on a clamp that sways in its own way, beside a simulation that does not know it.
fn film(index: usize, heading: f64) -> (Recording, Film) {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading);
    let phase = 1.7 * index as f64;
    let time: Vec<f64> = (0..FRAMES).map(|frame| 0.02 * frame as f64).collect();
    let pose = |&time: &f64| {
        let sway = |speed: f64| (speed * time + phase).sin() - phase.sin();
        let position = turn * Vector3::new(0.1 * sway(2.0), 0.15 * sway(2.7), 0.8 + 0.08 * sway(3.3));
        (time, Pose { position, orientation: turn })
    };
    let clamp: Vec<(f64, Pose)> = time.iter().map(pose).collect();
    let markers = clamp.iter().map(|(_, pose)| vec![pose.position; 3]).collect();
    let recording = Recording { path: PathBuf::from(format!("noodle-{index}")), time, markers };
    let mut recording = NoodleRecording { recording, clamp };
    let noodle = Noodle::new(&recording, 8).unwrap();
    let known = Numbers::start(1.2);
    let mut truth = known;
    (truth[Number::Bending], truth[Number::Curvature2]) = (0.7 * known[Number::Bending], 0.3);
    let simulated = |numbers| predict(std::slice::from_ref(&noodle), numbers, FRAMES, 1).unwrap().remove(0);
    for (row, here) in recording.recording.markers.iter_mut().zip(simulated(&truth).markers) {
        row[1..].copy_from_slice(&here);
    }
    let recording = held(&recording.recording, &noodle);
    let film = Film::simulated(&recording, &simulated(&known));
    (recording, film)
}

/// From two recordings, each in parts, of which some are kept aside, it is learned what a third one differs by, and the same in another heading.
#[test]
fn what_a_noodle_was_not_known_to_be_is_learned() {
    let films: Vec<_> = (0..2).map(|k| film(k, 0.0)).flat_map(|(own, film)| film.parts(&own, ASIDE)).collect();
    let shape = Shape { width: 16, blocks: 0, scans: 0 };
    let plan = Plan { guess: Guess::Physics, kind: Kind::Perceptron, shape, members: 1, epochs: 150, seed: 1 };
    let found = train(&films, &plan, &mut |_| true).unwrap();
    let [aside, better] = found.aside[0];
    assert!(better < 0.5 * aside, "{better} of {aside}");
    let tips = [0.0, 2.1].map(|heading| {
        let (recording, film) = film(2, heading);
        let tip = |prediction| errors(&recording, &prediction)[0].1;
        let (guess, corrected) = (tip(film.uncorrected()), tip(film.corrected(&found.correction.add(&film))));
        assert!(corrected < 0.6 * guess, "{corrected} m, before {guess} m");
        corrected
    });
    assert!((tips[0] / tips[1] - 1.0).abs() < 1e-2, "{tips:?}");
}

/// All parts together are the whole, and no frame is in two of them.
#[test]
fn parts_are_a_recording_cut_in_pieces() {
    let (recording, film) = film(0, 0.0);
    let parts = film.parts(&recording, ASIDE);
    for frame in 0..FRAMES {
        let own: Vec<_> = parts.iter().filter(|(_, part)| !part.real[frame][2].x.is_nan()).collect();
        assert_eq!(own.len(), 1, "frame {frame}");
        assert_eq!((&own[0].0.markers[frame], &own[0].1.real[frame]), (&film.real[frame], &film.real[frame]));
    }
}

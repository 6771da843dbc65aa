//! Corrections of a simulated cable that was identified wrongly.

use correction::correction::Correction;
use correction::film::{Film, Guess, Markers};
use correction::inputs::Kind;
use correction::network::Shape;
use correction::training::{Plan, Trained, train};
use identify::branched::{Branch, Tree};
use identify::cable::{Cable, Resolution};
use identify::metric::mean_error;
use identify::parameter::{Parameter, Parameters};
use identify::predict::{Prediction, predict};
use identify::recording::{Grips, Recording};
use identify::simulated::{Plan as Recorded, recordings};
use nalgebra::{Rotation3, Vector3};

/// Recordings of a cable that is curved at rest.
fn recorded(count: usize) -> Vec<Recording> {
    let mut truth = Parameters::default();
    truth[Parameter::Curvature1] = 4.0;
    let plan = Recorded { recordings: count, ..Recorded::default() };
    recordings(&truth, &plan).unwrap()
}

/// Such recordings, beside simulations that do not know of the curvature.
fn films(count: usize) -> Vec<(Recording, Film)> {
    simulated(recorded(count))
}

fn simulated(recordings: Vec<Recording>) -> Vec<(Recording, Film)> {
    let segments = Resolution::SEARCH.segments;
    let cables: Vec<Cable> = recordings.iter().map(|recording| Cable::new(recording, segments).unwrap()).collect();
    let predictions = predict(&cables, &Parameters::default(), usize::MAX, 1).unwrap();
    assert!(predictions.iter().all(|prediction| prediction.unsolved == 0));
    let film = |(recording, prediction): (Recording, _)| {
        let film = Film::simulated(&recording, &prediction);
        (recording, film)
    };
    recordings.into_iter().zip(predictions).map(film).collect()
}

fn plan(kind: Kind) -> Plan {
    let shape = Shape { width: 16, blocks: usize::from(kind == Kind::Graph), scans: 0 };
    Plan { guess: Guess::Physics, kind, shape, members: 1, epochs: 100, seed: 1 }
}

fn trained(films: &[(Recording, Film)], plan: &Plan) -> Trained {
    train(films, plan, &mut |_| true).unwrap()
}

fn error(films: &[(Recording, Film)], correction: Option<&Correction>) -> f64 {
    let of = |(recording, film): &(Recording, Film)| {
        let found = correction.map_or_else(|| film.uncorrected(), |correction| film.corrected(&correction.add(film)));
        mean_error(recording, &found)
    };
    films.iter().map(of).sum::<f64>() / films.len() as f64
}

#[test]
fn what_a_cable_was_not_known_to_be_is_learned() {
    let films = films(28);
    let (learned, held_out) = films.split_at(21);
    for kind in Kind::ALL {
        let found = trained(learned, &plan(kind));
        let (guess, corrected) = (error(held_out, None), error(held_out, Some(&found.correction)));
        assert!(corrected < 0.5 * guess, "{kind}: {corrected} m, before {guess} m");
        let [aside, better] = found.aside[0];
        assert!(better < aside, "{kind}");
        // Nothing is added at first, and never more than the bound.
        for (_, film) in held_out {
            let added = found.correction.add(film);
            assert!(added[0].iter().all(|x| x.norm() == 0.0));
            assert!(added.iter().flatten().all(|x| x.norm() <= 3_f64.sqrt() * found.correction.bound));
        }
    }
}

/// Branches that sag as no simulation knows: the correction of a cable with branches takes most of it, on films that it did not learn from.
#[test]
fn branches_are_corrected() {
    let tree = Tree { parent: 6, branches: vec![Branch { junction: 2, markers: 6..9 }], grips: Grips::Ends };
    let film = |k: usize| {
        let place = |time: f64, marker: usize| {
            let sway = 0.1 * (5.0 * time + k as f64).sin();
            let (along, down) = if marker < 6 { (0.1 * marker as f64, 0.0) } else { (0.2, 0.1 * (marker - 5) as f64) };
            Vector3::new(along, sway, -down)
        };
        let time: Vec<f64> = (0..60).map(|frame| 0.01 * f64::from(frame)).collect();
        let row = |time: &f64, sags: bool| -> Vec<Vector3<f64>> {
            let sag = |marker: usize| {
                if sags && marker >= 6 {
                    Vector3::z() * (-0.05 * (1.0 - (-time / 0.1).exp()))
                } else {
                    Vector3::zeros()
                }
            };
            (0..9).map(|marker| place(*time, marker) + sag(marker)).collect()
        };
        let free = Markers::of_tree(&tree).free;
        let of = |time: &f64| free.iter().map(|&marker| row(time, false)[marker]).collect();
        let prediction = Prediction { markers: time.iter().map(of).collect(), unsolved: 0 };
        let markers = time.iter().map(|time| row(time, true)).collect();
        let recording = Recording { path: format!("{k}").into(), time, markers };
        let film = Film::with(&recording, Markers::of_tree(&tree), &prediction);
        (recording, film)
    };
    let films: Vec<(Recording, Film)> = (0..14).map(film).collect();
    assert_eq!(films[0].1.markers.free, [2, 3, 6, 7, 8]);
    let found = trained(&films[..10], &plan(Kind::Perceptron)).correction;
    let off = |film: &Film, added: Option<Vec<Vec<Vector3<f64>>>>| {
        let prediction = added.map_or_else(|| film.uncorrected(), |added| film.corrected(&added));
        (prediction.markers[59][4] - film.real[59][8]).norm()
    };
    for (_, film) in &films[10..] {
        let (before, after) = (off(film, None), off(film, Some(found.add(film))));
        assert!(before > 0.04 && after < 0.3 * before, "{before} {after}");
    }
}

/// The grips' ways ten times as fast, which cracks the cable like a whip: no training has seen the like. All steps are solved, and what a network
/// adds is bounded.
#[test]
fn violent_motions_leave_it_bounded() {
    let films = films(14);
    let mut fast = recorded(7);
    fast.iter_mut().flat_map(|recording| &mut recording.time).for_each(|time| *time *= 0.1);
    let fast = simulated(fast);
    let far = |films: &[(Recording, Film)]| error(films, None);
    assert!(far(&fast) > 2.0 * far(&films), "{} {}", far(&fast), far(&films));
    for kind in Kind::ALL {
        let found = trained(&films, &Plan { epochs: 20, ..plan(kind) }).correction;
        for (_, film) in &fast {
            assert!(film.uncorrected().markers.iter().flatten().all(|marker| marker.norm() < 1.0));
            let added = found.add(film);
            assert!(added.iter().flatten().all(|x| x.norm() <= 3_f64.sqrt() * found.bound), "{kind}");
            let worth = found.worths(&[film])[0];
            assert!(worth.distance > 2.0 * found.applicability.like_m, "{kind}: {worth:?}");
        }
        let learned: Vec<&Film> = films.iter().map(|(_, film)| film).collect();
        assert!(found.worths(&learned).iter().all(|worth| worth.applies));
    }
}

#[test]
fn any_number_of_threads_learns_the_same_bits_and_a_file_keeps_them() {
    let films = films(7);
    let plan = Plan { epochs: 2, members: 2, ..plan(Kind::Graph) };
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| trained(&films, &plan))
    };
    let (one, three) = (with(1), with(3));
    assert_eq!(one, three);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("correction.toml");
    one.correction.write(&path).unwrap();
    assert_eq!(Correction::read(&path).unwrap(), one.correction);
    std::fs::write(&path, "schema_version = 1").unwrap();
    assert!(Correction::read(&path).unwrap_err().contains("correction.toml"));
}

#[test]
fn a_correction_is_the_same_in_every_place_and_heading() {
    let films = films(7);
    let found = trained(&films, &Plan { epochs: 2, ..plan(Kind::Graph) }).correction;
    let (_, film) = &films[0];
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), 2.1);
    let moved = |rows: &Vec<Vec<Vector3<f64>>>| -> Vec<Vec<Vector3<f64>>> {
        rows.iter().map(|row| row.iter().map(|x| turn * x + Vector3::new(3.0, -1.0, 0.5)).collect()).collect()
    };
    let elsewhere = Film { real: moved(&film.real), guess: moved(&film.guess), ..film.clone() };
    for (here, there) in found.add(film).iter().flatten().zip(found.add(&elsewhere).iter().flatten()) {
        assert!((turn * here - there).norm() < 1e-4 * found.bound, "{here} {there}");
    }
}

/// Frames go through a network in pieces; the last one may be a single frame.
#[test]
fn a_single_frame_is_learned_from_and_corrected() {
    let mut films = films(2);
    for (recording, film) in &mut films {
        recording.markers.truncate(6);
        recording.time.truncate(6);
        *film = Film::blended(recording);
    }
    for kind in Kind::ALL {
        // One film is kept aside, and of the other's six frames each of these epochs looks at one.
        let found = trained(&films, &Plan { guess: Guess::Blend, epochs: 3, ..plan(kind) }).correction;
        let film = |frames: usize| Film {
            real: films[0].1.real[..frames].to_vec(),
            guess: films[0].1.guess[..frames].to_vec(),
            time: films[0].1.time[..frames].to_vec(),
            ..films[0].1.clone()
        };
        assert_eq!(found.add(&film(1)), found.add(&film(6))[..1]);
    }
}

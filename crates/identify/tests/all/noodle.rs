//! Noodles: a simulated one is identified back, and bad files give one error.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use cosserat::scene;
use cosserat::simulation::{Settings, Simulation};
use cosserat::state::Pose;
use cosserat::statics::{StaticParams, equilibrium};
use identify::confidence::known;
use identify::fit::{Search, Stage, fit};
use identify::kind::{Clamped, Kind};
use identify::noodle::{Noodle, NoodleRecording, Number, Numbers, is_noodle, read, tip_error};
use identify::predict::{predict, step_params};
use identify::recording::{Reading, Recording};
use identify::specimen::Specimen;
use nalgebra::{UnitQuaternion, Vector3};

const SEGMENTS: usize = 8;
const FRAMES: usize = 400;

/// A clamp that sways and turns in its own way, 50 frames a second; the markers are those of a noodle with `truth`, off by up to 2 mm.
fn recording(truth: &Numbers, index: usize) -> (Recording, Noodle) {
    let phase = 1.7 * index as f64;
    let time: Vec<f64> = (0..FRAMES).map(|frame| 0.02 * frame as f64).collect();
    let pose = |&time: &f64| {
        let sway = |speed: f64| (speed * time + phase).sin() - phase.sin();
        let position = Vector3::new(0.1 * sway(2.0), 0.15 * sway(2.7), 0.8 + 0.08 * sway(3.3));
        let orientation = UnitQuaternion::from_euler_angles(0.4 * sway(1.3), 0.3 * sway(1.9), 0.2 * sway(2.3));
        Pose { position, orientation }
    };
    let clamp: Vec<(f64, Pose)> = time.iter().map(|time| (*time, pose(time))).collect();
    let markers = clamp.iter().map(|(_, pose)| vec![pose.position; 3]).collect();
    let recording = Recording { path: PathBuf::from(format!("noodle-{index}")), time, markers };
    let mut recording = NoodleRecording { recording, clamp };
    let noodle = Noodle::new(&recording, SEGMENTS).unwrap();
    let predicted = predict(std::slice::from_ref(&noodle), truth, FRAMES, 1).unwrap().remove(0);
    let markers = recording.recording.markers.iter_mut().zip(predicted.markers);
    for (frame, (marker, here)) in markers.flat_map(|(row, here)| row.iter_mut().skip(1).zip(here)).enumerate() {
        // Far from any frequency of the noodle.
        *marker = here + Vector3::new(1.0, 2.0, 3.0).map(|rate: f64| 2e-3 * (1e3 * rate * frame as f64).sin());
    }
    (recording.recording, noodle)
}

fn truth() -> Numbers {
    let mut truth = Numbers::start(1.2);
    for (number, value) in [
        (Number::Middle, 0.45),
        (Number::Bending, 2.0),
        (Number::InnerDamping, 0.03),
        (Number::Curvature2, 0.2),
        (Number::HeadingY, 0.15),
    ] {
        truth[number] = value;
    }
    truth
}

#[test]
fn a_simulated_noodle_is_identified_back() {
    let truth = truth();
    let (mut recordings, noodles): (Vec<_>, Vec<_>) = (0..2).map(|index| recording(&truth, index)).unzip();
    // Lost for a second, and an outlier.
    recordings[0].markers[50..100].iter_mut().for_each(|row| row[2].x = f64::NAN);
    recordings[1].markers[70][1].y += 0.3;
    let stages = vec![Stage { frames: None, every: 1, iterations: 40 }];
    let search = Search { huber: 0.1, independent: 1.0, ..Search::of(Number::ALL.to_vec(), stages) };
    let fit = fit(&recordings, &noodles, &Numbers::start(1.1), &search, &mut |_| true).unwrap();
    let (known, found) = (known(&fit), fit.parameters);
    for number in [Number::Length, Number::Middle, Number::Bending] {
        let error = found[number] / truth[number] - 1.0;
        assert!(error.abs() < 0.05, "{}: {} for {}", number.name(), found[number], truth[number]);
    }
    let holds = known
        .iter()
        .filter_map(|known| known.interval.map(|[low, high]| (low..=high).contains(&truth[known.parameter])));
    let holds: Vec<bool> = holds.collect();
    let inside = holds.iter().filter(|holds| **holds).count();
    // Of eleven intervals of 95 %, two or more miss in one case of ten.
    assert!(holds.len() >= 9 && inside + 2 >= holds.len(), "{inside}: {known:?}");
    let (fresh, noodle) = recording(&truth, 2);
    let error = tip_error(&fresh, &predict(&[noodle], &found, FRAMES, 1).unwrap()[0], f64::INFINITY);
    assert!(error < 5e-3, "{error} m");
}

#[test]
fn the_scene_moves_as_the_prediction_does() {
    let truth = truth();
    let (recording, noodle) = recording(&truth, 1);
    let folder = tempfile::tempdir().unwrap();
    let path = identify::noodle::scene::write(folder.path(), &noodle, "noodle-1", &truth, 1).unwrap();
    let mut scene = scene::load(&path).unwrap();
    assert!(scene.begins_at_rest && scene.run.steps == recording.frames() - 1);
    assert!(equilibrium(&scene.model, &mut scene.state, &StaticParams::default()).unwrap().converged);
    let settings = Settings { step: step_params(), ..Settings::default() };
    let mut simulation = Simulation::new(&scene.model, &scene.state, &settings, None).unwrap();
    let mut state = scene.state.clone();
    let prediction = predict(std::slice::from_ref(&noodle), &truth, 60, 1).unwrap().remove(0);
    for (frame, predicted) in prediction.markers.iter().enumerate().skip(1) {
        simulation.step(scene.run.dt).unwrap();
        simulation.store(&mut state);
        for (marker, (here, predicted)) in
            noodle.markers(&truth, &scene.model, &state).iter().zip(predicted).enumerate()
        {
            // Both solve steps to the same tolerance from other starts.
            assert!((here - predicted).norm() < 1e-5, "frame {frame}, marker {marker}");
        }
    }
}

fn table(folder: &Path, change: impl Fn(usize, &mut Vec<String>)) -> PathBuf {
    let mut text = String::new();
    let names = ["t", "p_b_x", "p_b_y", "p_b_z", "phi_b_z", "phi_b_y", "phi_b_x"];
    let mut header: Vec<String> = names.map(str::to_owned).to_vec();
    header.extend(["m", "e"].iter().flat_map(|name| ["x", "y", "z"].map(|axis| format!("p_{name}_{axis}"))));
    change(1, &mut header);
    let _ = writeln!(text, "{}", header.join(","));
    for row in 2..122 {
        let mut cells = vec![format!("{}", 0.01 * f64::from(row)); 1];
        cells.extend(["0", "0", "1", "0.3", "0.2", "0.1", "0.5", "0", "0.8", "1", "0", "0.5"].map(str::to_owned));
        change(row as usize, &mut cells);
        let _ = writeln!(text, "{}", cells.join(","));
    }
    let path = folder.join("noodle.csv");
    fs::write(&path, text).unwrap();
    path
}

#[test]
fn a_table_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = table(folder.path(), |_, _| {});
    assert!(is_noodle(&path));
    let NoodleRecording { recording, clamp } = read(&path, 1.0).unwrap();
    assert_eq!((recording.time.len(), recording.time[0]), (120, 0.0));
    let markers = [[0.0, 0.0, 1.0], [0.5, 0.0, 0.8], [1.0, 0.0, 0.5]].map(Vector3::from);
    assert_eq!(recording.markers[3], markers);
    // About x first, then y, then z of the world.
    let turn = |axis, angle| UnitQuaternion::from_axis_angle(&axis, angle);
    let expected = turn(Vector3::z_axis(), 0.3) * turn(Vector3::y_axis(), 0.2) * turn(Vector3::x_axis(), 0.1);
    assert!(clamp[7].1.orientation.angle_to(&expected) < 1e-7);
}

#[test]
fn strangers_are_named_and_the_others_go_on() {
    let folder = tempfile::tempdir().unwrap();
    let written = |name: &str, change: &dyn Fn(usize, &mut Vec<String>)| {
        let path = folder.path().join(name);
        fs::rename(table(folder.path(), change), &path).unwrap();
        path
    };
    let mangled = |row: usize, cells: &mut Vec<String>| {
        if row == 9 {
            cells[2] = "far".to_owned();
        }
    };
    let longer = |row: usize, cells: &mut Vec<String>| {
        if row > 1 {
            cells[10] = "1.5".to_owned();
        }
    };
    let lost = |row: usize, cells: &mut Vec<String>| {
        if (20..50).contains(&row) {
            cells[7..10].iter_mut().for_each(String::clear);
        }
    };
    let paths = [
        written("mangled.csv", &mangled),
        written("longer.csv", &longer),
        written("lost.csv", &lost),
        written("a.csv", &|_, _| {}),
        written("b.csv", &|_, _| {}),
    ];
    let (_, [train, _]) = Clamped::read([&paths, &[]], Reading::default(), SEGMENTS).unwrap();
    assert_eq!(train.good.len(), 3);
    let told: Vec<String> = train.bad.iter().map(ToString::to_string).collect();
    assert_eq!(told.len(), 2, "{told:?}");
    for parts in [["mangled.csv: frame 7, column p_b_y", "\"far\""], ["longer.csv: ", "m long, but most are"]] {
        assert!(told.iter().any(|told| parts.iter().all(|part| told.contains(part))), "{told:?}");
    }
}

#[test]
fn bad_tables_give_one_error_with_frame_and_column() {
    let folder = tempfile::tempdir().unwrap();
    let told =
        |change: &dyn Fn(usize, &mut Vec<String>)| read(&table(folder.path(), change), 1.0).unwrap_err().to_string();
    let cell = |at: usize, column: usize, text: &'static str| {
        move |row: usize, cells: &mut Vec<String>| {
            if row == at {
                cells[column] = text.to_owned();
            }
        }
    };
    for (message, parts) in [
        (told(&cell(1, 9, "other")), ["noodle.csv", "p_m_z"]),
        (told(&cell(5, 12, "far")), ["frame 3, column p_e_z", "\"far\""]),
        (told(&cell(9, 2, "NaN")), ["frame 7, column p_b_y", "finite"]),
        (told(&cell(9, 10, "40")), ["frame 7, marker 2", "swapped"]),
        (
            told(&|row, cells: &mut Vec<String>| {
                if row > 1 {
                    cells[7].clear()
                }
            }),
            ["marker 1", "lost in all"],
        ),
        (
            told(&|row, cells: &mut Vec<String>| {
                if row > 1 {
                    cells[7] = "900".to_owned()
                }
            }),
            ["noodle.csv", "--unit-m"],
        ),
        (told(&cell(7, 0, "0")), ["frame 5, column t", "not after"]),
    ] {
        assert!(parts.iter().all(|part| message.contains(part)), "{message}");
    }
}

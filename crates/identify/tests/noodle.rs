//! Noodles: a simulated one is identified back, and bad files give one error.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use identify::noodle::{Number, Numbers, Recording, Resolution, fit, is_noodle, predict, read, tip_error};
use nalgebra::{UnitQuaternion, Vector3};
use rod::Pose;

const RESOLUTION: Resolution = Resolution { segments: 8, frames: 1 };
const FRAMES: usize = 400;

/// A clamp that sways and turns in its own way, 50 frames a second; the markers are those of a noodle with `truth`, off by up to 2 mm.
fn recording(truth: &Numbers, index: usize) -> Recording {
    let phase = 1.7 * index as f64;
    let time: Vec<f64> = (0..FRAMES).map(|frame| 0.02 * frame as f64).collect();
    let pose = |&time: &f64| {
        let sway = |speed: f64| (speed * time + phase).sin() - phase.sin();
        let position = Vector3::new(0.1 * sway(2.0), 0.15 * sway(2.7), 0.8 + 0.08 * sway(3.3));
        let orientation = UnitQuaternion::from_euler_angles(0.4 * sway(1.3), 0.3 * sway(1.9), 0.2 * sway(2.3));
        Pose { position, orientation }
    };
    let clamp = time.iter().map(pose).collect();
    let markers = vec![[Vector3::zeros(); 2]; FRAMES];
    let mut recording = Recording { path: PathBuf::from(format!("noodle-{index}")), time, clamp, markers };
    let mut markers = predict(&recording, truth, RESOLUTION).unwrap();
    for (frame, marker) in markers.iter_mut().flatten().enumerate() {
        // Far from any frequency of the noodle.
        *marker += Vector3::new(1.0, 2.0, 3.0).map(|rate: f64| 2e-3 * (1e3 * rate * frame as f64).sin());
    }
    recording.markers = markers;
    recording
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
    let found = fit(&[recording(&truth, 0), recording(&truth, 1)], RESOLUTION, &mut || true).unwrap();
    for number in [Number::Length, Number::Middle, Number::Bending] {
        let error = found.numbers[number] / truth[number] - 1.0;
        assert!(error.abs() < 0.05, "{}: {} for {}", number.name(), found.numbers[number], truth[number]);
    }
    let inside = Number::ALL
        .iter()
        .zip(&found.intervals)
        .filter(|(number, interval)| interval.is_some_and(|[low, high]| (low..=high).contains(&truth[**number])));
    let (inside, known) = (inside.count(), found.intervals.iter().flatten().count());
    // Of eleven intervals of 95 %, two or more miss in one case of ten.
    assert!(known >= 9 && inside + 2 >= known, "{inside} of {known}: {:?}", found.intervals);
    let fresh = recording(&truth, 2);
    let error = tip_error(&fresh, &predict(&fresh, &found.numbers, RESOLUTION).unwrap(), f64::INFINITY);
    assert!(error < 5e-3, "{error} m");
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
    let recording = read(&path).unwrap();
    assert_eq!((recording.time.len(), recording.time[0]), (120, 0.0));
    assert_eq!(recording.markers[3], [Vector3::new(0.5, 0.0, 0.8), Vector3::new(1.0, 0.0, 0.5)]);
    // About x first, then y, then z of the world.
    let turn = |axis, angle| UnitQuaternion::from_axis_angle(&axis, angle);
    let expected = turn(Vector3::z_axis(), 0.3) * turn(Vector3::y_axis(), 0.2) * turn(Vector3::x_axis(), 0.1);
    assert!(recording.clamp[7].orientation.angle_to(&expected) < 1e-7);
}

#[test]
fn bad_tables_give_one_error_with_row_and_column() {
    let folder = tempfile::tempdir().unwrap();
    let told = |change: &dyn Fn(usize, &mut Vec<String>)| read(&table(folder.path(), change)).unwrap_err().to_string();
    let cell = |at: usize, column: usize, text: &'static str| {
        move |row: usize, cells: &mut Vec<String>| {
            if row == at {
                cells[column] = text.to_owned();
            }
        }
    };
    for (message, parts) in [
        (told(&cell(1, 9, "other")), ["noodle.csv", "p_m_z"]),
        (told(&cell(5, 12, "far")), ["row 5, column p_e_z", "\"far\""]),
        (told(&cell(9, 2, "NaN")), ["row 9, column p_b_y", "finite"]),
        (told(&cell(7, 0, "0")), ["row 7, column t", "not after"]),
    ] {
        assert!(parts.iter().all(|part| message.contains(part)), "{message}");
    }
}

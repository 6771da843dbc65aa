//! Runs of what is driven that go on: with a longer course, another one, from a frame; grips with times.

use std::fs;
use std::path::Path;

use crate::common::{refused, runs};
use cosserat::state::State;
use export::{Trajectory, read_trajectory};
use serde_json::Value;

fn trajectory(folder: &str) -> Trajectory {
    read_trajectory(&Path::new(folder).join("trajectory.safetensors")).expect("a trajectory")
}

/// A course of poses against x at 0.5 m/s, from `from` to `end` [s], with all times less `less` [s].
fn course(from: f64, end: f64, less: f64) -> String {
    let mut table = "time_s,x_m,y_m,z_m,qw,qx,qy,qz\n".to_owned();
    for k in 0..=20 {
        let time = from + (end - from) * f64::from(k) / 20.0;
        table += &format!("{:?},{:?},0,0,1,0,0,0\n", time - less, -0.5 * time);
    }
    table
}

/// A rod whose start is driven by the course in this file, at a face or with its first segment.
fn scene(place: &Path, name: &str, what: &str, course: &str) -> String {
    let (file, table) = (place.join(format!("{name}.toml")), place.join(format!("{name}.csv")));
    fs::write(table, course).expect("a table");
    let text = format!(
        "run.dt_s = 0.02\n[[rods]]\nname = \"cable\"\nradius_m = 0.01\nyoungs_modulus_pa = 1e7\ndensity_kg_m3 = 1000\n\
         shape.straight = {{ length_m = 1, segments = 10 }}\nmotions = [{{ at = \"{what}\", file = \"{name}.csv\" }}]\n"
    );
    fs::write(&file, text).expect("a scene");
    file.to_str().expect("UTF-8").to_owned()
}

#[test]
fn a_run_goes_on_with_a_longer_course_and_with_another_one() {
    let place = tempfile::tempdir().expect("a folder");
    let place = place.path();
    let out = |name: &str| place.join(name).to_str().expect("UTF-8").to_owned();
    for what in ["start-face", "start-segment"] {
        let short = scene(place, "short", what, &course(0.0, 0.4, 0.0));
        let long = scene(place, "long", what, &format!("{}0.8,-0.2,0.1,0,1,0,0,0\n", course(0.0, 0.4, 0.0)));
        let [first, second, whole] = ["first", "second", "whole"].map(out);
        runs(&[&short, "--steps", "18", "--snapshot", "--out", &first]);
        runs(&[&long, "--steps", "40", "--trajectory", "--out", &whole]);
        runs(&[&long, "--steps", "22", "--trajectory", "--out", &second, "--from", &first]);
        let [after, expected] = [&second, &whole].map(|folder| trajectory(folder));
        assert_eq!(after.states[..], expected.states[18..], "{what}");
        assert_eq!(after.time[..], expected.time[18..], "{what}");
        assert!(after.states[22].positions[0].y > 0.05, "it goes the longer way");

        // Another one must be where the first one left the rod.
        let jump = scene(place, "jump", what, &course(0.0, 0.3, 0.0));
        let error = refused(&[&jump, "--from", &first]);
        let body = if what == "start-face" { "the start face of cable" } else { "segment 0 of cable" };
        assert!(error.contains(&format!("at 0.36 s the motion of {body} is 0.03 m away")), "{error}");
        assert!(error.contains("their times are those of the whole run"), "{error}");
    }
    // One that has nothing before takes hold there.
    let other = scene(place, "other", "start-face", &course(0.4, 0.8, 0.0));
    let [first, second, third] = ["first", "second", "third"].map(out);
    let short = scene(place, "short", "start-face", &course(0.0, 0.4, 0.0));
    runs(&[&short, "--steps", "20", "--snapshot", "--out", &first]);
    runs(&[&other, "--steps", "10", "--trajectory", "--snapshot", "--out", &second, "--from", &first]);
    runs(&[&other, "--steps", "10", "--trajectory", "--out", &third, "--from", &second]);
    for (folder, x) in [(&second, -0.3), (&third, -0.4)] {
        let end = trajectory(folder).states.pop().expect("frames");
        let face = end.positions[0] - end.axis(0) * 0.05;
        assert!((face.x - x).abs() < 1e-3, "{face}");
    }
}

#[test]
fn a_frame_is_taken_hold_of_where_it_is() {
    let place = tempfile::tempdir().expect("a folder");
    let place = place.path();
    let out = |name: &str| place.join(name).to_str().expect("UTF-8").to_owned();
    let [first, second] = ["first", "second"].map(out);
    let long = scene(place, "long", "start-face", &course(0.0, 0.8, 0.0));
    runs(&[&long, "--steps", "20", "--out", &first]);
    let frame = format!("{first}@20");

    // With its times shifted, the course leads on from there.
    let shifted = scene(place, "shifted", "start-face", &course(0.4, 0.8, 0.4));
    runs(&[&shifted, "--steps", "20", "--trajectory", "--out", &second, "--from", &frame]);
    let (before, after) = (trajectory(&first), trajectory(&second));
    assert_eq!((after.time[0], &after.states[0]), (0.0, &before.states[20]));
    let face = |state: &State| state.positions[0] - state.axis(0) * 0.05;
    for (k, state) in after.states.iter().enumerate() {
        let x = -0.5 * (0.4 + 0.02 * k as f64);
        assert!((face(state).x - x).abs() < 0.005 && face(state).z.abs() < 0.01, "frame {k}: {}", face(state));
    }
    // As it is, it begins elsewhere.
    let error = refused(&[&long, "--from", &frame]);
    assert!(
        error.contains("at 0 s the motion of the start face of cable is 0.2 m away from where that run left it"),
        "{error}"
    );
    assert!(error.contains("with a frame, time is 0 again"), "{error}");

    // A clamp holds the face where it is, and what is given by shifts begins there.
    for held in [
        "clamp = [\"start-face\"]",
        "motions = [{ at = \"start-face\", times_s = [0, 1], shifts_m = [[0, 0, 0], [0, 0, 0]] }]",
    ] {
        let text = fs::read_to_string(&long).expect("a scene");
        let (rod, _) = text.split_once("motions").expect("motions");
        let file = out("held.toml");
        fs::write(&file, format!("{rod}{held}\n")).expect("a scene");
        runs(&[&file, "--steps", "30", "--trajectory", "--snapshot", "--out", &second, "--from", &frame]);
        let begun = trajectory(&second);
        let moved = face(&begun.states[30]) - face(&begun.states[0]);
        assert!(moved.norm() < 0.005, "{held}: {moved}");
        // It is held there in a run that goes on from that one, too.
        let third = out("third");
        runs(&[&file, "--steps", "30", "--trajectory", "--out", &third, "--from", &second]);
        let moved = face(&trajectory(&third).states[30]) - face(&begun.states[0]);
        assert!(moved.norm() < 0.005, "{held}: {moved}");
    }
}

/// Grips that take hold and let go on the way are as they were in snapshots, and in files that are made later.
#[test]
fn grips_with_times_go_on_and_are_exported_later() {
    let place = tempfile::tempdir().expect("a folder");
    let place = place.path();
    let out = |name: &str| place.join(name).to_str().expect("UTF-8").to_owned();
    let file = out("taken.toml");
    let text = "run.dt_s = 0.01\n[[rods]]\nname = \"cable\"\nradius_m = 0.01\nyoungs_modulus_pa = 1e7\n\
                density_kg_m3 = 1000\nshape.straight = { length_m = 1, segments = 10 }\n\
                [[rods.grips]]\nat = \"start-face\"\nuntil_s = 0.4\n\
                [[rods.motions]]\nat = \"end-face\"\nfrom_s = 0.1\nuntil_s = 0.5\ntimes_s = [0, 1]\nshifts_m = [[0, 0, 0], [-0.02, 0, 0.02]]\n\
                [[rods.motions]]\nsegment = 4\nfrom_s = 0.3\ntimes_s = [0, 1]\nshifts_m = [[0, 0, 0], [0, 0.02, 0]]\n";
    fs::write(&file, text).expect("a scene");
    let [whole, first, second] = ["whole", "first", "second"].map(out);
    let formats = ["--export", "csv,glb"];
    runs(&[&[&file, "--steps", "60", "--trajectory", "--out", &whole][..], &formats].concat());
    let expected = trajectory(&whole);
    for steps in [5, 20, 35, 45, 55] {
        runs(&[&file, "--steps", &steps.to_string(), "--snapshot", "--out", &first]);
        let left = (60 - steps).to_string();
        runs(&[&file, "--steps", &left, "--trajectory", "--out", &second, "--from", &first]);
        assert_eq!(trajectory(&second).states[..], expected.states[steps..], "from step {steps}");
        // A run begins with the energy that the one before ended with.
        let [end, start] = [(&first, "energy_end_j"), (&second, "energy_start_j")].map(|(folder, key)| {
            let summary = fs::read(Path::new(folder).join("summary.json")).expect("a summary");
            serde_json::from_slice::<Value>(&summary).expect("JSON")[key].as_f64().expect("an energy")
        });
        assert!((end - start).abs() <= 1e-9 * end.abs(), "from step {steps}: {end} J, then {start} J");
    }
    let names = ["joints.csv", "reactions.csv", "segments.csv", "run.glb"];
    let read = || names.map(|name| fs::read(Path::new(&whole).join(name)).expect(name));
    let of_run = read();
    runs(&[&["export", &whole, "--scene", &file][..], &formats].concat());
    assert!(read() == of_run);
    let summary = fs::read(Path::new(&whole).join("summary.json")).expect("a summary");
    let summary: Value = serde_json::from_slice(&summary).expect("JSON");
    let held = summary["held"].as_array().expect("a list");
    let times: Vec<_> = held.iter().map(|hold| hold["time_s"].as_f64().expect("a time")).collect();
    assert!(held.len() == 2 && (times[0] - 0.1).abs() < 1e-9 && (times[1] - 0.3).abs() < 1e-9, "{summary}");
}

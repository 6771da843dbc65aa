//! What `--out` writes, and what Ctrl-C leaves of it.

use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

#[cfg(unix)]
use crate::common::interrupt;
use crate::common::{json, run, simulate, texts};
use safetensors::{Dtype, SafeTensors};
use serde_json::Value;

const SEGMENTS: usize = 60;

/// Values and shape of a tensor.
fn tensor(file: &[u8], name: &str) -> (Vec<f64>, Vec<usize>) {
    let tensors = SafeTensors::deserialize(file).expect("a safetensors file");
    let view = tensors.tensor(name).expect(name);
    assert_eq!(view.dtype(), Dtype::F64);
    let values = view.data().chunks_exact(8).map(|bytes| f64::from_le_bytes(bytes.try_into().expect("8 bytes")));
    (values.collect(), view.shape().to_vec())
}

/// Checks that the files are whole and agree with each other; returns the summary.
fn check(folder: &Path, dt: f64) -> Value {
    let mut names: Vec<String> = fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name().into_string().expect("UTF-8"))
        .collect();
    names.sort();
    assert_eq!(
        names,
        ["run-scene.toml", "run.json", "summary.json", "trajectory.safetensors"],
        "and no temporary files"
    );

    let summary: Value =
        serde_json::from_slice(&fs::read(folder.join("summary.json")).expect("a summary")).expect("JSON");
    let frames = summary["steps"].as_u64().expect("steps") as usize + 1;
    let file = fs::read(folder.join("trajectory.safetensors")).expect("a trajectory");
    let mut frame = vec![0.0; 13 * SEGMENTS];
    let parts = [("positions", 3), ("orientations", 4), ("velocities", 3), ("angular_velocities", 3)];
    let mut column = 0;
    for (name, width) in parts {
        let (values, shape) = tensor(&file, name);
        assert_eq!(shape, [frames, SEGMENTS, width], "{name}");
        assert!(values.iter().all(|x| x.is_finite()), "{name}");
        let last = &values[(frames - 1) * SEGMENTS * width..];
        for (i, value) in last.chunks_exact(width).enumerate() {
            frame[13 * i + column..13 * i + column + width].copy_from_slice(value);
        }
        column += width;
    }
    let bytes: Vec<u8> = frame.iter().flat_map(|x| x.to_le_bytes()).collect();
    assert_eq!(summary["final_state_hash"], blake3::hash(&bytes).to_hex().as_str(), "the last frame is the summary's");

    let (time, shape) = tensor(&file, "time");
    assert_eq!(shape, [frames]);
    assert!(time.iter().enumerate().all(|(k, t)| (t - k as f64 * dt).abs() < 1e-9 * (1.0 + t)));
    summary
}

#[test]
fn files_agree_with_each_other_and_with_the_printed_summary() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("a").join("b");
    let printed = json(&["helix", "--steps", "30", "--out", out.to_str().expect("UTF-8")]);
    let mut summary = check(&out, 0.02);
    assert_eq!(summary["steps"], 30);
    let named = summary.as_object_mut().and_then(|summary| summary.remove("names")).expect("names in the file alone");
    assert_eq!(named["rods"]["0"]["name"], "helix");
    assert_eq!(summary, printed);
    // A second run takes the first one's place.
    json(&["helix", "--steps", "7", "--out", out.to_str().expect("UTF-8")]);
    summary = check(&out, 0.02);
    assert_eq!(summary["steps"], 7);
}

/// Frames that are written do not change what the summary says.
#[test]
fn energy_and_length_mean_the_same_with_and_without_out() {
    let folder = tempfile::tempdir().expect("a folder");
    let arguments = ["helix", "--steps", "450", "--dt", "0.01"];
    let without = json(&arguments);
    let with = json(&[&arguments[..], &["--out", folder.path().to_str().expect("UTF-8")]].concat());
    for key in
        ["energy_start_j", "energy_end_j", "energy_highest_j", "length_drift", "frames_measured", "final_state_hash"]
    {
        assert_eq!(with[key], without[key], "{key}");
    }
    // Every third frame of 450, and the first.
    assert_eq!(with["frames_measured"], 151);
    let number = |key: &str| with[key].as_f64().expect("a number");
    assert!(number("energy_highest_j") >= number("energy_start_j").max(number("energy_end_j")));
    assert!((0.0..1e-5).contains(&number("length_drift")) && number("length_drift") > 0.0);
}

#[test]
fn no_steps_write_the_first_frame() {
    let folder = tempfile::tempdir().expect("a folder");
    json(&["helix", "--steps", "0", "--out", folder.path().to_str().expect("UTF-8")]);
    assert_eq!(check(folder.path(), 0.02)["frames_measured"], 1);
}

/// Numbers that are not finite end the run with exit code 1, and none of them is written.
#[test]
fn a_run_that_fails_writes_finite_numbers_only() {
    for dt in ["1e300", "1e10", "1e-300", "1e150"] {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().to_str().expect("UTF-8");
        let output = run(&["helix", "--dt", dt, "--out", path, "--quiet"]);
        let (code, out, err) = texts(&output);
        assert_eq!((code, out), (Some(1), ""), "{dt}");
        assert!(err.starts_with("error: numbers are not finite: helix stopped after step "), "{err}");
        assert_eq!(err.lines().count(), 1, "{err}");
        let summary = fs::read_to_string(folder.path().join("summary.json")).expect("a summary");
        let summary: Value = serde_json::from_str(&summary).expect("JSON");
        assert_eq!(summary["status"], "not finite");
        assert_eq!(crate::common::nulls(&summary, ""), [".linear_tolerance"], "{dt}");
        let file = fs::read(folder.path().join("trajectory.safetensors")).expect("a trajectory");
        for name in ["positions", "orientations", "velocities", "angular_velocities", "time"] {
            assert!(tensor(&file, name).0.iter().all(|x| x.is_finite()), "{dt}: {name}");
        }
        // With --json, the object is there all the same.
        let output = run(&["helix", "--dt", dt, "--json"]);
        let printed: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        assert_eq!((output.status.code(), &printed["status"]), (Some(1), &"not finite".into()));
    }
}

/// Ctrl-C in the middle of a run: exit code 130, whole files, and the summary of what was done.
#[test]
#[cfg(unix)]
fn an_interrupted_run_keeps_its_results() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().to_str().expect("UTF-8");
    let child = simulate(&["helix", "--steps", "1000000000", "--out", out, "--json"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    // The folder is taken when the program listens to Ctrl-C already.
    let begin = Instant::now();
    while fs::read_dir(out).expect("a folder").next().is_none() && begin.elapsed() < Duration::from_secs(10) {
        std::thread::sleep(Duration::from_millis(5));
    }
    std::thread::sleep(Duration::from_millis(200));
    // Pressed twice in a hurry, as people do.
    interrupt(child.id());
    interrupt(child.id());
    let output = child.wait_with_output().expect("it ends");
    let (code, printed, err) = texts(&output);
    assert_eq!((code, err), (Some(130), ""));
    let mut summary = check(Path::new(out), 0.02);
    summary.as_object_mut().expect("an object").remove("names");
    assert_eq!(serde_json::from_str::<Value>(printed).expect("one JSON object"), summary);
    assert_eq!((&summary["interrupted"], &summary["status"]), (&true.into(), &"converged".into()));
    assert_eq!(summary["steps_asked"], 1_000_000_000);
    assert!(summary["steps"].as_u64().is_some_and(|steps| (1..1_000_000_000).contains(&steps)));
}

/// The equilibrium, then each shape as it swings once, and what the scene's damping of 7 / s takes of a swing.
#[test]
fn modes_write_their_shapes_and_the_page_that_plays_them() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().to_str().unwrap();
    let report = json(&["modes", "heavy-cantilever", "--count", "3", "--view", "--out", path]);
    let modes = report["modes"].as_array().unwrap();
    assert_eq!(modes.len(), 3);
    for mode in modes {
        let of = |key: &str| mode[key].as_f64().unwrap();
        let ratio = 7.0 / (2.0 * std::f64::consts::TAU * of("frequency_hz"));
        assert!((of("damping_ratio") / ratio - 1.0).abs() < 1e-3, "{mode}: {ratio} expected");
    }
    let file = fs::read(folder.path().join("trajectory.safetensors")).unwrap();
    let (positions, shape) = tensor(&file, "positions");
    assert_eq!(shape, [1 + 3 * 24, 100, 3]);
    let frame = |k: usize| &positions[300 * k..300 * (k + 1)];
    let moved = |a: usize, b: usize| frame(a).iter().zip(frame(b)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(moved(0, 6) > 0.01, "a quarter of a swing");
    assert!(moved(0, 12) < 1e-12, "half of it");
    assert!(fs::read_to_string(folder.path().join("view.html")).unwrap().starts_with("<!doctype html>"));
}

/// Frames at exact times, with time steps that are no longer than the scene's.
#[test]
fn frames_a_second_are_at_their_times() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().to_str().expect("UTF-8");
    let output =
        run(&["helix", "--steps", "26", "--fps", "24", "--trajectory", "--view", "--export", "glb", "--out", out]);
    let (code, said, err) = texts(&output);
    assert_eq!((code, err), (Some(0), ""));
    let expected = "24 frames a second, a frame every 3 steps; the time step is 0.0139 s instead of 0.02 s, so that frames fall on steps";
    assert!(said.lines().any(|line| line == expected), "{said}");
    let kept = export::read_trajectory(&folder.path().join("trajectory.safetensors")).expect("a trajectory");
    // 0.52 s are 12.48 frames.
    assert_eq!(kept.time.len(), 14);
    assert!(kept.time.iter().enumerate().all(|(k, time)| (time - k as f64 / 24.0).abs() < 1e-15 * (1.0 + k as f64)));
    assert_eq!(kept.info.dt, 1.0 / 24.0 / 3.0);
    let shown = view::read_run(&folder.path().join("view.json")).expect("a run").decode().expect("a motion");
    assert_eq!(shown.frames(), 14);
    let summary: Value =
        serde_json::from_slice(&fs::read(folder.path().join("summary.json")).expect("a file")).expect("JSON");
    assert_eq!((&summary["fps"], &summary["steps"]), (&24.0.into(), &39.into()));
}

/// What is not asked for is not written.
#[test]
fn a_flag_writes_its_files_alone() {
    let place = tempfile::tempdir().expect("a folder");
    for (flag, files) in [
        (&["--view"][..], &["view.html", "view.json"][..]),
        (&["--plot"], &["energy.svg", "iterations.svg", "length.svg", "snapshots.svg", "stages.svg"]),
        (&["--export", "csv"], &["joints.csv", "reactions.csv", "segments.csv"]),
        (&["--export", "glb"], &["run.glb"]),
        (&["--contact-forces"], &["contacts.csv"]),
        (&["--envelope"], &["envelope.csv"]),
        (&["--snapshot"], &["snapshot.safetensors"]),
        (&["--snapshot-every", "0.03"], &["snapshot.safetensors"]),
        (&["--trajectory"], &["trajectory.safetensors"]),
        (&[], &["trajectory.safetensors"]),
    ] {
        let out = place.path().join("out");
        let path = out.to_str().expect("UTF-8");
        let output = run(&[&["two-rods", "--steps", "3", "--quiet", "--out", path], flag].concat());
        assert_eq!(texts(&output), (Some(0), "", ""), "{flag:?}");
        let mut names: Vec<_> = fs::read_dir(&out)
            .expect("a folder")
            .map(|entry| entry.expect("an entry").file_name().into_string().expect("UTF-8"))
            .filter(|name| !["run-scene.toml", "run.json", "summary.json"].contains(&name.as_str()))
            .collect();
        names.sort();
        assert_eq!(names, files, "{flag:?}");
    }
}

/// A scene's own file that leaves out materials hears what they are.
#[test]
fn defaults_are_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("rope.toml");
    fs::write(&path, "[[rods]]\nname = \"rope\"\nradius_m = 0.01\nshape.straight = { length_m = 1, segments = 5 }\n")
        .expect("a scene");
    let file = path.to_str().expect("UTF-8");
    let output = run(&[file, "--steps", "1", "--set", "rods.rope.density_kg_m3=1000"]);
    let (_, said, _) = texts(&output);
    assert!(said.contains("\ndefaults, as the file does not say: rope: youngs_modulus_pa = 100000\n"), "{said}");
    assert_eq!(json(&[file, "--steps", "1"])["defaults"].as_array().expect("a list").len(), 1);
    assert!(json(&["helix", "--steps", "1"]).get("defaults").is_none());
}

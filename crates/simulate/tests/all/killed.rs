//! Runs that are killed, and go on from their last snapshot.

use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use crate::common::{run, runs, simulate, texts};
use export::{Trajectory, read_trajectory, read_words};

fn trajectory(folder: &str) -> Trajectory {
    read_trajectory(&Path::new(folder).join("trajectory.safetensors")).expect("a trajectory")
}

/// Time of the snapshot that a run has left on the way [s], if it has.
fn time_of_snapshot(folder: &str) -> Option<f64> {
    let (of, _) = read_words(&Path::new(folder).join("unfinished/snapshot.safetensors")).ok()?;
    of["time_s"].parse().ok()
}

/// Kills a run as `kill -9` does, when it has written a snapshot at this time [s] or later.
fn kill_after(time: f64, folder: &str, arguments: &[&str]) -> f64 {
    let arguments = [arguments, &["--quiet", "--out", folder]].concat();
    let mut child = simulate(&arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it starts");
    let begin = Instant::now();
    while time_of_snapshot(folder).is_none_or(|now| now < time) {
        assert!(begin.elapsed() < Duration::from_secs(120), "no snapshot of {time} s");
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().expect("a signal");
    child.wait().expect("an end");
    time_of_snapshot(folder).expect("a whole snapshot")
}

#[test]
fn a_run_that_is_killed_goes_on_from_its_last_snapshot() {
    let place = tempfile::tempdir().expect("a folder");
    let [own, whole, second] = ["own", "whole", "second"].map(|name| place.path().join(name));
    let [own, whole, second] = [&own, &whole, &second].map(|path| path.to_str().expect("UTF-8"));
    runs(&["helix", "--steps", "3", "--trajectory", "--snapshot", "--out", own]);
    let earlier = trajectory(own);

    // Of 0.15 s no whole number of steps of 0.02 s; the third ends at 0.46 s.
    let long = ["helix", "--steps", "1000000000", "--snapshot-every", "0.15"];
    let time = kill_after(0.45, own, &long);
    let steps = (time / 0.02).round() as usize;
    let multiple = (time * (1.0 + 1e-12) / 0.15).floor() * 0.15;
    assert!((time - 0.02 * steps as f64).abs() < 1e-9 && time - multiple < 0.02 - 1e-9, "{time} s");
    // The earlier run is there as it was.
    assert_eq!(trajectory(own), earlier);

    runs(&["helix", "--steps", &(steps + 25).to_string(), "--trajectory", "--out", whole]);
    let expected = trajectory(whole);
    let output = run(&["helix", "--steps", "25", "--trajectory", "--out", second, "--from", own]);
    let (code, said, err) = texts(&output);
    assert_eq!((code, err), (Some(0), ""));
    assert!(said.contains("the last snapshot of a run that did not come to its end"), "{said}");
    let after = trajectory(second);
    assert_eq!(after.states[..], expected.states[steps..]);
    assert_eq!(after.time[..], expected.time[steps..]);

    // Killed again on its way in the same folder, it has lost nothing of what it had.
    let again = [&long[..], &["--from", own]].concat();
    assert!(kill_after(time, own, &again) >= time);
    // Its scene is there, too, by its name.
    let output = run(&["--steps", "2", "--from", own]);
    assert!(texts(&output).1.starts_with("helix: "), "{output:?}");
    runs(&["helix", "--steps", "2", "--trajectory", "--out", own, "--from", own]);
    assert!(trajectory(own).time[0] >= time);
    let mut names: Vec<_> =
        fs::read_dir(own).expect("a folder").map(|entry| entry.expect("an entry").file_name()).collect();
    names.sort();
    assert_eq!(names, ["run-scene.toml", "run.json", "summary.json", "trajectory.safetensors"]);
}

#[test]
fn snapshots_on_the_way_end_with_that_of_the_end() {
    let place = tempfile::tempdir().expect("a folder");
    let [own, second, whole] = ["own", "second", "whole"].map(|name| place.path().join(name));
    let [own, second, whole] = [&own, &second, &whole].map(|path| path.to_str().expect("UTF-8"));
    runs(&["two-rods", "--steps", "13", "--snapshot-every", "0.1", "--out", own]);
    runs(&["two-rods", "--steps", "12", "--trajectory", "--out", second, "--from", own]);
    runs(&["two-rods", "--steps", "25", "--trajectory", "--out", whole]);
    assert_eq!(trajectory(second).states[..], trajectory(whole).states[13..]);
    for (value, expected) in [("0", "finite number > 0"), ("-1", "finite number > 0"), ("x", "finite number > 0")] {
        let output = run(&["helix", "--snapshot-every", value]);
        let (code, _, err) = texts(&output);
        assert!(code == Some(2) && err.contains(expected), "{err}");
    }
}

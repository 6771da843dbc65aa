//! Runs that begin where others have left off.

use std::path::Path;

use crate::common::{run, runs, simulate, texts};
use export::read_trajectory;

/// The folders of two runs.
fn folders(place: &Path) -> [String; 2] {
    ["first", "second"].map(|name| place.join(name).to_str().expect("UTF-8").to_owned())
}

fn trajectory(folder: &str) -> export::Trajectory {
    read_trajectory(&Path::new(folder).join("trajectory.safetensors")).expect("a trajectory")
}

#[test]
fn a_run_begins_with_another_ones_last_frame_or_a_named_one() {
    let place = tempfile::tempdir().expect("a folder");
    let [first, second] = folders(place.path());
    runs(&["helix", "--steps", "30", "--out", &first]);
    let before = trajectory(&first);
    for (from, frame) in [(first.clone(), 30), (format!("{first}@0"), 0), (format!("{first}@12"), 12)] {
        runs(&["helix", "--steps", "2", "--out", &second, "--from", &from]);
        let after = trajectory(&second);
        assert_eq!(after.states[0], before.states[frame], "{from}");
        assert_eq!(after.time[0], 0.0, "time begins anew");
    }
    // It may even take the folder that it begins from.
    runs(&["helix", "--steps", "2", "--out", &first, "--from", &first]);
    assert_eq!(trajectory(&first).states[0], before.states[30]);
}

/// Where no folder is named, a run does not take that of the run that it goes on from.
#[test]
fn a_run_that_goes_on_leaves_the_folder_that_it_begins_with() {
    let place = tempfile::tempdir().expect("a folder");
    for (from, own) in [(None, "out/helix"), (Some("out/helix"), "out/helix-2"), (Some("out/helix-2"), "out/helix-3")] {
        let mut arguments = vec!["helix", "--steps", "2", "--plot", "--trajectory", "--quiet"];
        arguments.extend(from.iter().flat_map(|from| ["--from", from]));
        let output = simulate(&arguments).current_dir(&place).output().expect("it starts");
        assert_eq!(texts(&output), (Some(0), "", ""), "{from:?}");
        let begun = trajectory(place.path().join(own).to_str().expect("UTF-8"));
        if let Some(from) = from {
            let before = trajectory(place.path().join(from).to_str().expect("UTF-8"));
            assert_eq!((begun.states.len(), &begun.states[0]), (3, &before.states[2]), "{from}");
        }
    }
}

#[test]
fn an_equilibrium_stays_where_it_is() {
    let place = tempfile::tempdir().expect("a folder");
    let [first, second] = folders(place.path());
    assert_eq!(run(&["static", "heavy-cantilever", "--out", &first]).status.code(), Some(0));
    runs(&["heavy-cantilever", "--steps", "50", "--out", &second, "--from", &first]);
    let states = trajectory(&second).states;
    let (rest, end) = (&states[0], &states[50]);
    let moved = rest.positions.iter().zip(&end.positions).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    assert!(moved < 1e-6, "the tip moved by {moved} m");
    // Found again from there, at once.
    let again = run(&["static", "heavy-cantilever", "--json", "--from", &first]);
    let again: serde_json::Value = serde_json::from_slice(&again.stdout).expect("JSON");
    assert!(again["linear_solves"].as_u64().expect("a number") < 20, "{again}");
}

#[test]
fn what_is_no_run_of_the_scene_is_refused() {
    let place = tempfile::tempdir().expect("a folder");
    let [first, _] = folders(place.path());
    runs(&["helix", "--steps", "3", "--out", &first]);
    let frame = format!("{first}@4");
    for (arguments, expected) in [
        (["helix", "--from", "nowhere"], "--from nowhere: there is no trajectory.safetensors in it, and no snapshot"),
        (["helix", "--from", "out@x"], "the frame x must be a whole number from 0 on"),
        (["helix", "--from", &frame], "frame 4, but the run has the frames 0 to 3"),
        (["bending-rod", "--from", &first], "the run has 60 segments, but the scene bending-rod has 30"),
    ] {
        let output = run(&arguments);
        let (code, _, err) = texts(&output);
        assert_eq!(code, Some(2), "{err}");
        assert!(err.contains(expected), "{err}");
    }
}

#[test]
fn a_frame_of_rods_of_other_lengths_or_radii_is_refused() {
    let place = tempfile::tempdir().expect("a folder");
    let [first, second] = folders(place.path());
    let scene = |name: &str, length: f64, radius: f64| {
        let path = place.path().join(format!("{name}.toml"));
        let text =
            format!("[[rods]]\nradius_m = {radius}\nshape.straight = {{ length_m = {length}, segments = 10 }}\n");
        std::fs::write(&path, text).expect("a file");
        path.to_str().expect("UTF-8").to_owned()
    };
    let own = scene("own", 1.0, 0.01);
    runs(&[&own, "--steps", "2", "--out", &first]);
    runs(&[&own, "--steps", "2", "--out", &second, "--from", &first]);
    for other in [scene("longer", 2.0, 0.01), scene("thicker", 1.0, 0.02)] {
        for from in [first.clone(), format!("{first}@1")] {
            let output = run(&[&other, "--from", &from]);
            let (code, _, error) = texts(&output);
            assert_eq!(code, Some(2), "{error}");
            assert!(
                error.contains("the run, of the scene own, has segments of other lengths or radii than the scene"),
                "{error}"
            );
        }
    }
}

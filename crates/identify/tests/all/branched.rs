//! Cables with branches: their files, and a simulated one that is identified back.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use cosserat::scene;
use cosserat::simulation::{Settings, Simulation};
use identify::branched::{Branch, BranchedCable, Number, Numbers, Tree};
use identify::confidence::known;
use identify::fit::fit;
use identify::kind::Kind;
use identify::parameter::Parameter;
use identify::predict::{predict, step_params};
use identify::quantity::Quantity;
use identify::recording::{Grips, Reading, Recording, is_flat, read_flat};
use identify::specimen::Specimen;
use nalgebra::Vector3;
use serde_json::{Value, json};

/// Segments between two markers.
const PARTS: usize = 2;

fn tree() -> Tree {
    Tree { parent: 8, branches: vec![Branch { junction: 4, markers: 8..11 }], grips: Grips::Ends }
}

/// A parent that hangs between two grips, which sway in a way of their own, and a branch that hangs on it.
fn grips(index: usize, frames: usize) -> Recording {
    let phase = 1.3 * index as f64;
    let row = |frame: usize| {
        let sway = |speed: f64| (0.01 * speed * frame as f64 + phase).sin() - phase.sin();
        let shift = |s: f64| Vector3::new(0.04 * sway(4.0 + s), 0.08 * sway(5.0 - s), 0.06 * sway(3.0 + s));
        let on_parent = |k: usize| {
            let s = k as f64 / 7.0;
            shift(s) + Vector3::new(0.5 * s, 0.0, -1.1 * s * (1.0 - s))
        };
        let mut markers: Vec<_> = (0..8).map(on_parent).collect();
        let junction = markers[4];
        let along = Vector3::new(0.3, 0.4, -0.8).normalize();
        markers.extend((1..4).map(|k| junction + along * (0.06 * k as f64)));
        markers
    };
    let time = (0..frames).map(|frame| 0.01 * frame as f64).collect();
    Recording { path: PathBuf::from(format!("tree-{index}")), time, markers: (0..frames).map(row).collect() }
}

/// The same with the free markers of a cable with `truth` from the third frame on.
fn recorded(truth: &Numbers, index: usize, frames: usize) -> Recording {
    simulated(&tree(), truth, grips(index, frames))
}

/// A recording with the free markers of such a cable from the third frame on.
fn simulated(tree: &Tree, truth: &Numbers, mut recording: Recording) -> Recording {
    let cable = BranchedCable::new(&recording, tree, PARTS).unwrap();
    let predicted = predict(&[cable], truth, recording.frames(), 1).unwrap().remove(0);
    assert_eq!(predicted.unsolved, 0);
    for (real, predicted) in recording.markers.iter_mut().zip(predicted.markers).skip(2) {
        tree.free().zip(predicted).for_each(|(marker, predicted)| real[marker] = predicted);
    }
    recording
}

fn truth() -> Numbers {
    let mut truth = start(&tree(), &[grips(0, 3)]);
    for (number, value) in [
        (Number::Parent(Parameter::Bending), 0.05),
        (Number::Parent(Parameter::InnerDamping), 0.08),
        (Number::BranchMass(0), 1.6),
        (Number::Side(0), 0.2),
        (Number::Curvature(1), 1.5),
    ] {
        truth[number] = value;
    }
    truth
}

/// Where a search for the cable of some recordings begins.
fn start(tree: &Tree, recordings: &[Recording]) -> Numbers {
    let of = |recording| BranchedCable::new(recording, tree, PARTS).unwrap();
    tree.start(&recordings.iter().map(of).collect::<Vec<_>>())
}

#[test]
fn a_prediction_begins_where_the_recording_does() {
    let recording = grips(1, 5);
    assert_eq!(Tree::of(&[recorded(&truth(), 1, 60)], Grips::Ends).unwrap(), tree());
    assert_eq!(tree().ways(), [(0..8).collect(), vec![4, 8, 9, 10]]);
    let cable = BranchedCable::new(&recording, &tree(), PARTS).unwrap();
    let (model, state) = cable.model(&truth()).unwrap();
    model.validate(&state).unwrap();
    assert_eq!((model.segments.len(), model.rods()), (PARTS * (5 + 3) + 1, 2));
    let prediction = predict(&[cable], &truth(), 1, 1).unwrap().remove(0);
    for (marker, predicted) in tree().free().zip(&prediction.markers[0]) {
        assert!((predicted - recording.markers[0][marker]).norm() < 1e-9, "{marker}");
    }
}

/// Runs a cable's scene over 30 frames: its markers are where they are predicted, to this distance [m]. Both solve steps to the same tolerance from
/// other starts.
fn moves_as_predicted(scene: &scene::Scene, cable: &BranchedCable, truth: &Numbers, allowed: f64) {
    let settings = Settings { step: step_params(), ..Settings::default() };
    let mut simulation = Simulation::new(&scene.model, &scene.state, &settings, None).unwrap();
    let mut state = scene.state.clone();
    let prediction = predict(std::slice::from_ref(cable), truth, 30, 1).unwrap().remove(0);
    for (frame, predicted) in prediction.markers.iter().enumerate().skip(1) {
        simulation.step(0.01).unwrap();
        simulation.store(&mut state);
        for (marker, (here, predicted)) in cable.markers(truth, &scene.model, &state).iter().zip(predicted).enumerate()
        {
            let far = (here - predicted).norm();
            assert!(far < allowed, "frame {frame}, marker {marker}: {far} m");
        }
    }
}

#[test]
fn the_scene_moves_as_the_prediction_does() {
    let mut truth = truth();
    (truth[Number::Parent(Parameter::Roll)], truth[Number::BranchBending(0)]) = (0.3, 0.4);
    let cable = BranchedCable::new(&grips(1, 30), &tree(), PARTS).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = identify::branched::scene::write(folder.path(), &cable, "tree-1", &truth, 1).unwrap();
    let scene = scene::load(&path).unwrap();
    let (model, first) = cable.model(&truth).unwrap();
    let far = scene.state.orientations.iter().zip(&first.orientations).map(|(a, b)| a.angle_to(b)).fold(0.0, f64::max);
    assert!(far < 1e-6, "{far} rad");
    for (k, (written, own)) in scene.model.joints.iter().zip(&model.joints).enumerate() {
        assert!((written.bend_compliance / own.bend_compliance - 1.0).abs() < 1e-9, "{k}");
        assert!((written.rest_darboux - own.rest_darboux).norm() < 1e-6, "{k}");
    }
    moves_as_predicted(&scene, &cable, &truth, 1e-5);
}

#[test]
fn a_branch_hangs_still_in_the_first_frame() {
    // Its parent is so stiff that it hardly moves, and so is nothing but a holder; all stand still.
    let mut recording = grips(0, 30);
    let first = recording.markers[0].clone();
    recording.markers.iter_mut().for_each(|markers| markers.clone_from(&first));
    let mut numbers = start(&tree(), std::slice::from_ref(&recording));
    let cable = |numbers: &Numbers| {
        let cable = BranchedCable::new(&recording, &tree(), PARTS).unwrap();
        let predicted = predict(&[cable], numbers, 30, 1).unwrap().remove(0);
        let bend = |markers: &Vec<Vector3<f64>>| {
            let [_, _, .., a, b, c] = markers[..] else { panic!("{} markers", markers.len()) };
            (b - a).angle(&(c - b))
        };
        predicted.markers.iter().map(bend).fold(0.0, f64::max)
    };
    numbers.parent[Parameter::Bending] = 50.0;
    numbers[Number::BranchBending(0)] = 2e-4;
    // EI / (rho A) is 0.01 m^4/s^2: from rest as it is drawn, gravity would bend it by 0.06 rad.
    let found = cable(&numbers);
    assert!(found < 0.02, "{found} rad");
}

#[test]
fn a_simulated_tree_is_identified_back() {
    let truth = truth();
    let recordings: Vec<_> = (0..3).map(|index| recorded(&truth, index, 90)).collect();
    let of = |recording: &Recording| BranchedCable::new(recording, &tree(), PARTS).unwrap();
    let cables: Vec<_> = recordings.iter().map(of).collect();
    let found = fit(&recordings, &cables, &tree().start(&cables), &tree().search(), &mut |_| true).unwrap();
    assert!(known(&found).iter().all(|known| known.interval.is_none()), "three recordings are fewer than the numbers");
    let found = found.parameters;
    for number in [Number::Parent(Parameter::Bending), Number::BranchMass(0)] {
        let error = found[number] / truth[number] - 1.0;
        assert!(error.abs() < 0.05, "{number}: {}", found[number]);
    }
    let fresh = recorded(&truth, 3, 90);
    let error = |numbers: &Numbers| tree().errors(&fresh, &predict(&[of(&fresh)], numbers, 90, 1).unwrap()[0])[0].1;
    let start = error(&start(&tree(), &recordings));
    assert!(error(&found) < 0.05 * start, "{} m, where the search began {start} m", error(&found));
}

/// A cable whose second branch hangs on the first.
fn branched_twice() -> Tree {
    let branches = [(4, 8..11), (9, 11..13)].map(|(junction, markers)| Branch { junction, markers }).to_vec();
    Tree { branches, ..tree() }
}

/// The grips of a cable whose second branch hangs on the first, in the middle of it.
fn grips_of_twice(index: usize, frames: usize) -> Recording {
    let mut recording = grips(index, frames);
    let along = Vector3::new(-0.2, 0.5, -0.6).normalize();
    for markers in &mut recording.markers {
        let junction = markers[9];
        markers.extend((1..3).map(|k| junction + along * (0.05 * k as f64)));
    }
    recording
}

#[test]
fn a_branch_on_a_branch_is_found_and_identified_back() {
    let tree = branched_twice();
    let first: Vec<_> = (0..8).map(|index| grips_of_twice(index, 80)).collect();
    let mut truth = start(&tree, &first);
    for (number, value) in [
        (Number::Parent(Parameter::Bending), 0.05),
        (Number::Parent(Parameter::InnerDamping), 0.08),
        (Number::BranchMass(0), 0.8),
        (Number::BranchMass(1), 1.4),
    ] {
        truth[number] = value;
    }
    let recordings: Vec<_> = first.into_iter().map(|recording| simulated(&tree, &truth, recording)).collect();
    assert_eq!(Tree::of(&recordings, Grips::Ends).unwrap(), tree);
    assert_eq!((tree.host(0), tree.host(1)), (None, Some(0)));
    let cables: Vec<_> = recordings.iter().map(|own| BranchedCable::new(own, &tree, PARTS).unwrap()).collect();
    let (model, state) = cables[0].model(&truth).unwrap();
    model.validate(&state).unwrap();
    assert_eq!(model.rods(), 3);
    let found = fit(&recordings, &cables, &tree.start(&cables), &tree.search(), &mut |_| true).unwrap().parameters;
    for number in [Number::Parent(Parameter::Bending), Number::BranchMass(0), Number::BranchMass(1)] {
        let error = found[number] / truth[number] - 1.0;
        assert!(error.abs() < 0.1, "{number}: {} for {}", found[number], truth[number]);
    }
    let fresh = simulated(&tree, &truth, grips_of_twice(9, 80));
    let cable = [BranchedCable::new(&fresh, &tree, PARTS).unwrap()];
    let error = |numbers: &Numbers| tree.errors(&fresh, &predict(&cable, numbers, 80, 1).unwrap()[0])[0].1;
    let [before, after] = [error(&tree.start(&cables)), error(&found)];
    assert!(after < 0.1 * before, "{after} m, where the search began {before} m");
}

/// The same cable as [`tree`], held at its marker 2, so that the first two are free.
fn held_in_the_middle() -> Tree {
    Tree { grips: Grips::Middle(2), ..tree() }
}

#[test]
fn a_grip_in_the_middle_leaves_an_end_free() {
    let tree = held_in_the_middle();
    assert_eq!(tree.free().collect::<Vec<_>>(), [0, 1, 3, 4, 5, 8, 9, 10]);
    let truth = start(&tree, &[grips(0, 3)]);
    let recording = simulated(&tree, &truth, grips(1, 60));
    assert_eq!(Tree::of(std::slice::from_ref(&recording), Grips::Middle(2)).unwrap(), tree);
    let cable = BranchedCable::new(&recording, &tree, PARTS).unwrap();
    let (model, state) = cable.model(&truth).unwrap();
    model.validate(&state).unwrap();
    for (marker, here) in tree.free().zip(cable.markers(&truth, &model, &state)) {
        assert!((here - recording.markers[0][marker]).norm() < 1e-9, "marker {marker}");
    }
    // Where the grip stands still, the free end does. It is 0.2 m long: from rest as it is drawn, gravity would lower it by
    // g l^4 / (8 EI / (rho A)), a tenth of a metre.
    let mut still = grips(0, 40);
    let first = still.markers[0].clone();
    still.markers.iter_mut().for_each(|markers| markers.clone_from(&first));
    let cable = BranchedCable::new(&still, &tree, PARTS).unwrap();
    let predicted = predict(&[cable], &truth, 40, 1).unwrap().remove(0);
    for markers in &predicted.markers {
        assert!((markers[0] - first[0]).norm() < 3e-3, "{} m", (markers[0] - first[0]).norm());
    }
}

#[test]
fn a_scene_with_a_grip_in_the_middle_and_a_branch_on_a_branch_moves_as_the_prediction_does() {
    let tree = Tree { grips: Grips::Middle(2), ..branched_twice() };
    let mut truth = start(&tree, &[grips_of_twice(0, 3)]);
    (truth[Number::BranchBending(1)], truth[Number::Beside { axis: 1, marker: 4 }]) = (0.4, 0.004);
    let cable = BranchedCable::new(&grips_of_twice(1, 30), &tree, PARTS).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = identify::branched::scene::write(folder.path(), &cable, "tree-1", &truth, 1).unwrap();
    let scene = scene::load(&path).unwrap();
    moves_as_predicted(&scene, &cable, &truth, 2e-5);
}

#[test]
fn markers_beside_the_rod_are_found() {
    let beside = Number::Beside { axis: 0, marker: 3 };
    let mut truth = truth();
    truth[beside] = 0.008;
    let recordings: Vec<_> = (0..8).map(|index| recorded(&truth, index, 80)).collect();
    let of = |recording: &Recording| BranchedCable::new(recording, &tree(), PARTS).unwrap();
    let cables: Vec<_> = recordings.iter().map(of).collect();
    let (model, state) = cables[0].model(&truth).unwrap();
    for (marker, here) in tree().free().zip(cables[0].markers(&truth, &model, &state)) {
        // The frames in which they lie beside it are those of rods that were drawn a little otherwise.
        assert!((here - recordings[0].markers[0][marker]).norm() < 2e-4, "marker {marker}");
    }
    // All else is known. A rod that is drawn lower is longer and hangs lower, so that a shift of all markers is told by what is expected
    // of them alone; that of one against its neighbours is seen. A run remembers its first shape, so that a mean is a part of the way.
    let each: Vec<_> = recordings.iter().collect();
    let against_neighbours = |usual: f64| {
        let mut found = truth.clone();
        found[beside] = 0.0;
        for _ in 0..20 {
            found = BranchedCable::averaged(&cables, &each, &found, 1, usual).unwrap().unwrap();
        }
        let at = |marker| found[Number::Beside { axis: 0, marker }];
        at(3) - 0.5 * (at(2) + at(4))
    };
    let [free, expected] = [0.0, 0.02].map(against_neighbours);
    assert!((free / truth[beside] - 1.0).abs() < 0.1, "{free} m for {} m", truth[beside]);
    assert!(0.0 < expected && expected < free, "{expected} m, and without anything expected {free} m");
}

#[test]
fn grips_that_do_not_fit_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = pickle(folder.path(), "a.pkl", &recorded(&truth(), 1, 60));
    let csv = folder.path().join("plain.csv");
    fs::write(&csv, "time_s,m0_x,m0_y,m0_z\n").unwrap();
    for (file, grips, part) in [
        (&path, "3,-1", "M,-2,-1"),
        (&path, "6,-2,-1", "it must be one of 1 to 4"),
        (&path, "4,-2,-1", "which is in a grip"),
        (&csv, "2,-2,-1", "not of a cable with branches"),
    ] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_identify"));
        let output =
            command.arg(file).args(["--grips", grips, "--out"]).arg(folder.path().join("no")).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{grips}: {said}");
        assert!(said.contains(part), "{grips}: {said}");
    }
}

/// Runs the program on a result of an earlier identification, and takes what it writes.
#[test]
fn recordings_are_played_beside_predictions() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    fs::create_dir(path("eval")).unwrap();
    for index in 0..2 {
        pickle(&folder.path().join("eval"), &format!("{index}.pkl"), &recorded(&truth(), index, 40));
    }
    let value = |number: &Number| {
        (number.to_string(), json!({ "value": truth()[*number], "unit": number.unit(), "interval": null }))
    };
    let seen = (0..2).map(Number::Seen);
    let numbers: serde_json::Map<String, Value> =
        Number::all(&tree()).into_iter().chain(seen).map(|number| value(&number)).collect();
    let earlier = json!({
        "kind": "cable with branches", "parameters": numbers, "free": [], "segments": PARTS, "steps": 1, "huber_m": 0.005,
        "stages": [], "rods": tree().ways(), "recordings": [], "rate_per_s": 100.0, "unit_m": 1.0, "stopped": false,
        "seconds": 1.0, "errors_m": {},
    });
    fs::write(path("result.json"), earlier.to_string()).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_identify"));
    command.args([&path("eval"), "--from", &path("result.json"), "--out", &path("out"), "--quiet"]);
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8(output.stdout).unwrap();
    let page = fs::read_to_string(folder.path().join("out/index.html")).unwrap();
    for name in ["parent", "branch 1", "root mean square"] {
        assert!(page.contains(name) && said.contains(name), "{name}: {said}");
    }
    for name in ["worst.html", "median.html"] {
        let page = fs::read_to_string(folder.path().join("out").join(name)).unwrap();
        assert!(page.contains("\"recording\"") && page.contains("\"prediction\""), "{name}");
    }
    // What is doubtful is said first.
    let mut doubtful = earlier.clone();
    doubtful["free"] = json!(["inner-damping"]);
    doubtful["parameters"]["inner-damping"]["value"] = json!(10.0);
    fs::write(path("doubtful.json"), doubtful.to_string()).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_identify"));
    command.args([&path("eval"), "--from", &path("doubtful.json"), "--out", &path("doubtful"), "--quiet"]);
    let said = String::from_utf8(command.output().unwrap().stdout).unwrap();
    assert!(said.starts_with("warning: ") && said.lines().next().unwrap().contains("ended at its bound"), "{said}");
    assert!(said.contains("inner-damping ended at its bound"), "{said}");
    let page = fs::read_to_string(folder.path().join("doubtful/index.html")).unwrap();
    assert!(page.contains("inner-damping ended at its bound"));
    // What is of another cable is refused.
    for (change, part) in [
        (json!({ "rods": [(0..8).collect::<Vec<_>>(), vec![3, 8, 9, 10]] }), "other branches"),
        (json!({ "kind": "noodle" }), "of a noodle"),
    ] {
        let mut other = earlier.clone();
        other.as_object_mut().unwrap().extend(change.as_object().unwrap().clone());
        fs::write(path("other.json"), other.to_string()).unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_identify"));
        let output =
            command.args([&path("eval"), "--from", &path("other.json"), "--out", &path("no")]).output().unwrap();
        assert_eq!(output.status.code(), Some(2));
        assert!(String::from_utf8_lossy(&output.stderr).contains(part), "{}", String::from_utf8_lossy(&output.stderr));
    }
    // They were simulated with these numbers: all but the second frame, which is as it was drawn, is predicted.
    let result: Value = serde_json::from_str(&fs::read_to_string(path("out/result.json")).unwrap()).unwrap();
    let errors: Vec<f64> =
        result["errors_m"].as_object().unwrap().values().map(|errors| errors["mean"].as_f64().unwrap()).collect();
    assert_eq!(errors.len(), 2);
    assert!(errors.iter().all(|&error| error < 1e-5), "{errors:?} m");
}

/// A pickle of a list of a tuple of three lists, those of the axes x, y and z of the file, y up.
fn pickle(folder: &Path, name: &str, recording: &Recording) -> PathBuf {
    let mut bytes = b"\x80\x04](".to_vec();
    bytes.push(b'(');
    for axis in [|at: &Vector3<f64>| -at.y, |at: &Vector3<f64>| at.z, |at: &Vector3<f64>| -at.x] {
        bytes.extend(b"](");
        for at in recording.markers.iter().flatten() {
            bytes.push(b'G');
            bytes.extend(axis(at).to_be_bytes());
        }
        bytes.push(b'e');
    }
    bytes.extend(b"te.");
    let path = folder.join(name);
    fs::write(&path, bytes).unwrap();
    path
}

#[test]
fn flat_pickles_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let recording = grips(2, 24);
    let path = pickle(folder.path(), "tree.pkl", &recording);
    assert!(is_flat(&path));
    let read = read_flat(&path, Reading { rate: 50.0, ..Reading::default() }).unwrap();
    assert_eq!((read.frames(), read.count()), (24, 11));
    assert_eq!(read.markers, recording.markers);
    assert!((read.time[3] - 0.06).abs() < 1e-12);
}

#[test]
fn strangers_are_named_and_the_others_go_on() {
    let folder = tempfile::tempdir().unwrap();
    let written = |name: &str, change: &dyn Fn(&mut Recording)| {
        let mut recording = recorded(&truth(), 1, 60);
        change(&mut recording);
        pickle(folder.path(), name, &recording)
    };
    let mut paths = vec![
        written("fewer.pkl", &|own| own.markers.iter_mut().for_each(|row| row.truncate(10))),
        written("swapped.pkl", &|own| own.markers[7].swap(2, 10)),
        written("larger.pkl", &|own| own.markers.iter_mut().flatten().for_each(|at| *at *= 1.5)),
    ];
    paths.extend((0..4).map(|index| written(&format!("{index}.pkl"), &|own| *own = recorded(&truth(), index, 60))));
    let (found, [train, eval]) = Tree::read([&paths, &[]], Reading::default(), PARTS).unwrap();
    assert_eq!((found, train.good.len(), eval.good.len(), eval.bad.len()), (tree(), 4, 0, 0));
    let told: Vec<String> = train.bad.iter().map(ToString::to_string).collect();
    assert_eq!(told.len(), 3, "{told:?}");
    for parts in [
        ["fewer.pkl: 10 markers", "most recordings have 11"],
        ["swapped.pkl: frame 7", "swapped"],
        ["larger.pkl: ", "m long, but most are"],
    ] {
        assert!(told.iter().any(|told| parts.iter().all(|part| told.contains(part))), "{told:?}");
    }
}

#[test]
fn bad_recordings_give_one_error_with_frame_and_marker() {
    let folder = tempfile::tempdir().unwrap();
    let told = |change: &dyn Fn(&mut Recording)| {
        let mut recording = grips(0, 30);
        change(&mut recording);
        let read = read_flat(&pickle(folder.path(), "bad.pkl", &recording), Reading::default());
        read.and_then(|recording| tree().checked(recording)).unwrap_err().to_string()
    };
    for (message, parts) in [
        (told(&|bad| bad.markers[4][9].x = f64::INFINITY), ["bad.pkl: frame 4, marker 9", "infinite"]),
        (told(&|bad| bad.markers[1][10].y = f64::NAN), ["bad.pkl: frame 1, marker 10", "first two frames"]),
        (told(&|bad| bad.markers[7].swap(5, 10)), ["bad.pkl: frame 7, marker 4", "swapped"]),
        (told(&|bad| bad.markers.iter_mut().for_each(|row| row.truncate(10))), ["bad.pkl: 10 markers", "must be 11"]),
        (told(&|bad| bad.markers.truncate(1)), ["bad.pkl: 11 positions", "3 frames or more"]),
    ] {
        assert!(parts.iter().all(|part| message.contains(part)), "{message}");
    }
    let other = folder.path().join("other.pkl");
    fs::write(&other, b"\x80\x04](K\x01K\x02e.").unwrap();
    assert!(!is_flat(&other));
    assert!(
        read_flat(&other, Reading::default()).unwrap_err().to_string().contains("other.pkl: an array of the shape [2]")
    );
}

//! Runs that go on from a snapshot, frames that are kept, and what probes and contacts say.

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use crate::common::{json, refused, run, runs};
use export::{Trajectory, read_trajectory};

/// Names in a folder, as flags take them.
fn names<const N: usize>(place: &Path, names: [&str; N]) -> [String; N] {
    names.map(|name| place.join(name).to_str().expect("UTF-8").to_owned())
}

fn trajectory(folder: &str) -> Trajectory {
    read_trajectory(&Path::new(folder).join("trajectory.safetensors")).expect("a trajectory")
}

/// A table's header and rows.
fn table(folder: &str, name: &str) -> (Vec<String>, Vec<Vec<String>>) {
    let mut reader = csv::Reader::from_path(Path::new(folder).join(name)).expect(name);
    let strings = |record: &csv::StringRecord| record.iter().map(str::to_owned).collect();
    let header = strings(reader.headers().expect("a header"));
    (header, reader.records().map(|record| strings(&record.expect("a row"))).collect())
}

#[test]
fn a_run_goes_on_from_its_snapshot_as_if_it_had_not_ended() {
    // Wind; motions; guesses; contacts; conjugate gradients from the last solutions.
    for scene in [
        &["tree-20"][..],
        &["strip"],
        &["strip", "--formulation", "xpbd"],
        &["helix-on-plane"],
        &["helix", "--guess", "quadratic"],
    ] {
        let place = tempfile::tempdir().expect("a folder");
        let [whole, first, second] = names(place.path(), ["whole", "first", "second"]);
        runs(&[scene, &["--steps", "40", "--out", &whole]].concat());
        runs(&[scene, &["--steps", "25", "--out", &first, "--snapshot", "--trajectory"]].concat());
        runs(&[scene, &["--steps", "15", "--out", &second, "--from", &first]].concat());
        let [whole, first, second] = [whole, first, second].map(|folder| trajectory(&folder));
        assert_eq!(first.states[..], whole.states[..26], "{scene:?}");
        assert_eq!(second.states[..], whole.states[25..], "{scene:?}");
        assert_eq!(second.time[..], whole.time[25..], "{scene:?}");
    }
}

#[cfg(unix)]
#[test]
fn a_run_that_is_interrupted_leaves_its_snapshot() {
    let place = tempfile::tempdir().expect("a folder");
    let [first, second] = names(place.path(), ["first", "second"]);
    let arguments =
        ["helix", "--steps", "1000000000", "--every", "1000", "--out", &first, "--snapshot", "--trajectory", "--quiet"];
    let mut child = crate::common::simulate(&arguments).spawn().expect("the program starts");
    let begin = Instant::now();
    while !Path::new(&first).join("unfinished").exists() && begin.elapsed() < Duration::from_secs(10) {
        std::thread::sleep(Duration::from_millis(5));
    }
    std::thread::sleep(Duration::from_millis(200));
    crate::common::interrupt(child.id());
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
    runs(&["helix", "--steps", "2", "--out", &second, "--from", &first]);
    let [first, second] = [&first, &second].map(|folder| trajectory(folder));
    assert_eq!(second.states.first(), first.states.last());
    assert_eq!(second.time.first(), first.time.last());
}

#[test]
fn a_snapshot_of_something_else_is_refused_and_a_frame_is_not() {
    let place = tempfile::tempdir().expect("a folder");
    let [first, second, file] = names(place.path(), ["first", "second", "helix.toml"]);
    runs(&["helix", "--steps", "3", "--out", &first, "--snapshot", "--trajectory"]);
    let text = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../scene/scenes/helix.toml")).expect("a scene");
    fs::write(&file, format!("damping = {{ linear_per_s = 0.5 }}\n{text}")).expect("a file");
    let frame = format!("{first}@3");

    let error = refused(&[&file, "--from", &first]);
    assert!(error.contains("snapshot.safetensors is of another model (helix) than the scene helix"), "{error}");
    let error = refused(&["helix", "--formulation", "xpbd", "--from", &first]);
    assert!(
        error.contains("the snapshot is of a run with another formulation, integrator, solver or guess"),
        "{error}"
    );
    for arguments in [[&file, "--from", &frame], ["helix", "--from", &frame]] {
        runs(&[&arguments[..], &["--steps", "2", "--out", &second]].concat());
        assert_eq!(trajectory(&second).states[0], trajectory(&first).states[3]);
        assert_eq!(trajectory(&second).time[0], 0.0);
    }

    let snapshot = Path::new(&first).join("snapshot.safetensors");
    let mut bytes = fs::read(&snapshot).expect("a snapshot");
    let last = bytes.len() - 1;
    bytes[last] ^= 1;
    fs::write(&snapshot, bytes).expect("a file");
    let error = refused(&["helix", "--from", &first]);
    assert!(error.contains("damaged") && error.contains("checksum"), "{error}");
}

#[test]
fn every_n_th_frame_is_kept_and_the_last_one() {
    let place = tempfile::tempdir().expect("a folder");
    let [whole, some] = names(place.path(), ["whole", "some"]);
    let flags = ["two-arms", "--steps", "10", "--export", "csv", "--trajectory"];
    runs(&[&flags[..], &["--out", &whole]].concat());
    runs(&[&flags[..], &["--out", &some, "--view", "--plot", "--every", "4"]].concat());
    let [all, kept] = [&whole, &some].map(|folder| trajectory(folder));
    let frames = [0, 4, 8, 10];
    assert_eq!(kept.states, frames.map(|k| all.states[k].clone()));
    assert_eq!(kept.time, frames.map(|k| all.time[k]));
    assert_eq!(kept.forces, frames.map(|k| all.forces[k].clone()));
    let (_, rows) = table(&some, "segments.csv");
    assert_eq!(rows.len(), 4 * all.states[0].len());
    // What holds an anchor has no inertia: it is the same whatever frames are kept.
    let reactions = |folder: &str, frame: &str| {
        let (_, rows) = table(folder, "reactions.csv");
        let rows = rows.into_iter().filter(|row| row[0] == frame && row[2].starts_with("anchor"));
        rows.map(|row| row[2..].to_vec()).collect::<Vec<_>>()
    };
    assert_eq!(reactions(&some, "2"), reactions(&whole, "8"));
    assert!(refused(&["helix", "--every", "2"]).contains("no file is asked for"));
    assert!(refused(&["helix", "--every", "0", "--out", &some]).contains("it must be a whole number from 1 on"));
}

/// A rod that falls on the ground from a scene that asks for probes.
const SCENE: &str = "run = { dt_s = 0.02, steps = 300, every = 75 }
damping = { linear_per_s = 3, angular_per_s = 3 }

[[obstacles]]
shape.plane = {}
friction = 0.5

[[rods]]
name = \"rod\"
radius_m = 0.01
density_kg_m3 = 1000
youngs_modulus_pa = 1e8
shape.straight = { start_m = [0, 0, 0.0101], length_m = 0.5, segments = 10 }

[[rods]]
name = \"held\"
radius_m = 0.01
density_kg_m3 = 1000
youngs_modulus_pa = 1e9
clamp = [\"start-face\"]
shape.straight = { start_m = [0, 1, 0.5], length_m = 0.5, segments = 10 }

[[probes]]
name = \"tip\"
rod = \"held\"
at = \"end-face\"
quantities = [\"position\", \"velocity\"]

[[probes]]
name = \"grip\"
rod = \"held\"
at = \"start-face\"
quantities = [\"reaction\", \"tension\"]
";

#[test]
fn probes_and_contacts_say_what_the_rods_weigh() {
    let place = tempfile::tempdir().expect("a folder");
    let [file, out] = names(place.path(), ["scene.toml", "out"]);
    fs::write(&file, SCENE).expect("a file");
    // A gap of 1e-5 radii is good enough, which is 3e-5 of what gravity does in a step.
    runs(&[&file, "--out", &out, "--trajectory", "--contact-forces", "--contact-tolerance", "1e-5"]);
    let weight = 9.81 * 1000.0 * std::f64::consts::PI * 1e-4 * 0.5;
    let number = |text: &str| text.parse::<f64>().expect(text);

    let (header, rows) = table(&out, "probes.csv");
    assert_eq!(header[..5], ["frame", "time_s", "tip.x_m", "tip.y_m", "tip.z_m"]);
    assert_eq!(rows.iter().map(|row| number(&row[1])).collect::<Vec<_>>(), [0.0, 1.5, 3.0, 4.5, 6.0]);
    let column = |name: &str| header.iter().position(|own| own == name).expect(name);
    let up = column("grip.reaction_force_z_n");
    assert_eq!(rows[0][up], "", "nothing is known before the first step");
    let states = trajectory(&out).states;
    for (row, state) in rows.iter().zip(&states) {
        let end = state.positions[19] + state.axis(19) * 0.025;
        assert!((number(&row[2]) - end.x).abs() < 1e-15 && (number(&row[4]) - end.z).abs() < 1e-15);
    }
    let borne = number(&rows[4][up]);
    assert!((borne / weight - 1.0).abs() < 0.01, "the clamp bears {borne} N of {weight} N");

    let (header, rows) = table(&out, "contacts.csv");
    let [frame, other, up] =
        ["frame", "other", "force_z_n"].map(|name| header.iter().position(|own| own == name).expect(name));
    let last = rows.iter().filter(|row| row[frame] == "4");
    let borne: f64 = last.map(|row| number(&row[up])).sum();
    assert!((borne / weight - 1.0).abs() < 1e-3, "the ground bears {borne} N of {weight} N");
    assert!(rows.iter().all(|row| row[other] == "obstacle 0" && row[frame] != "0"));
}

#[test]
fn a_scene_says_where_it_begins_and_the_flag_wins() {
    let place = tempfile::tempdir().expect("a folder");
    let [file, rest, first, out] = names(place.path(), ["hang.toml", "rest", "first", "out"]);
    let rod = "[[rods]]\nclamp = [\"start-face\"]\nyoungs_modulus_pa = 1e9\n\
               shape.straight = { length_m = 1, segments = 10 }\n";
    fs::write(&file, rod).expect("a file");
    assert_eq!(run(&["static", &file, "--out", &rest]).status.code(), Some(0));
    runs(&[&file, "--steps", "5", "--out", &first]);
    fs::write(&file, format!("run = {{ from = \"rest\", steps = 20 }}\n{rod}")).expect("a file");
    runs(&[&file, "--out", &out]);
    let [end, begun] = [&rest, &out].map(|folder| trajectory(folder).states);
    assert_eq!(begun[0], end[1]);
    let moved = begun[20].positions[9] - begun[0].positions[9];
    assert!(moved.norm() < 1e-6, "it is at rest, and moved by {moved} m");
    runs(&[&file, "--out", &out, "--from", &format!("{first}@2")]);
    assert_eq!(trajectory(&out).states[0], trajectory(&first).states[2]);
    assert_eq!(json(&[&file, "--steps", "1"])["status"], "converged");

    // Or in the equilibrium itself.
    fs::write(&file, format!("run = {{ begin = \"equilibrium\", steps = 20 }}\n{rod}")).expect("a file");
    runs(&[&file, "--out", &out]);
    let begun = trajectory(&out).states;
    assert_eq!(begun[0], end[1]);
    let moved = begun[20].positions[9] - begun[0].positions[9];
    assert!(moved.norm() < 1e-6, "it is at rest, and moved by {moved} m");
    runs(&[&file, "--out", &out, "--from", &format!("{first}@2")]);
    assert_eq!(trajectory(&out).states[0], trajectory(&first).states[2]);

    fs::write(&file, format!("run.from = \"nowhere\"\n{rod}")).expect("a file");
    let error = refused(&[&file]);
    assert!(error.contains("hang: run.from ") && error.contains("there is no trajectory.safetensors in it"), "{error}");
}

/// Two cables, one of which hangs on a body that is driven, and a body by itself.
const NAMED: &str = "run = { dt_s = 0.02, steps = 6 }
obstacles = [{ shape.plane = { point_m = [0, 0, -9] } }]

[[bodies]]
name = \"hand\"
shape.box = { sides_m = [0.2, 0.2, 0.2] }
touches = false
mass_kg = 1
motions = [{ times_s = [0, 1], shifts_m = [[0, 0, 0], [0.1, 0, 0]] }]

[[bodies]]
name = \"ball\"
shape.sphere = { radius_m = 0.1 }
mass_kg = 1
position_m = [3, 0, 0]

[[rods]]
name = \"cable\"
branch_of = { body = \"hand\", at_m = [0, 0, -0.1] }
shape.straight = { direction = [0, 0, -1], length_m = 1, segments = 4 }

[[rods]]
name = \"rope\"
clamp = [\"start-face\"]
shape.straight = { start_m = [1, 0, 0], direction = [1, 0, 0], length_m = 1, segments = 5 }

[[probes]]
rod = \"cable\"
at = \"end-face\"
quantities = [\"position\"]
";

#[test]
fn named_rods_alone_are_drawn_and_tabulated() {
    let place = tempfile::tempdir().expect("a folder");
    let [scene, whole, some] = names(place.path(), ["named.toml", "whole", "some"]);
    fs::write(&scene, NAMED).expect("a file");
    let files = ["--view", "--plot", "--export", "csv,vtp,glb,obj", "--trajectory"];
    runs(&[&[&scene, "--out", &whole][..], &files].concat());
    runs(&[&[&scene, "--out", &some, "--rods", "rope,ball"][..], &files].concat());
    // The motion, and what is read of it, is all there.
    assert_eq!(trajectory(&some), trajectory(&whole));
    assert_eq!(table(&some, "probes.csv"), table(&whole, "probes.csv"));
    // Rows are those of rods 1 and 3 of hand, ball, cable and rope; segments are counted among these.
    let ((header, all), (same, rows)) = (table(&whole, "segments.csv"), table(&some, "segments.csv"));
    let kept = all.into_iter().filter(|row| ["1", "3"].contains(&row[2].as_str())).map(|mut row| {
        let segment: usize = row[4].parse().expect("a number");
        row[4] = if segment == 1 { 0 } else { segment - 5 }.to_string();
        row
    });
    assert_eq!((header, kept.collect::<Vec<_>>()), (same, rows));
    // The rope's joints: 4 between its segments, and that to its anchor. What they transmit is what they transmit.
    let [(_, all), (_, rows)] = [&whole, &some].map(|folder| table(folder, "joints.csv"));
    let rope: Vec<_> = all.iter().filter(|row| row[5].parse().is_ok_and(|b: usize| b >= 6)).collect();
    assert_eq!(rows.len(), 7 * 5);
    assert_eq!(
        rope.iter().map(|row| &row[6..]).collect::<Vec<_>>(),
        rows.iter().map(|row| &row[6..]).collect::<Vec<_>>()
    );
    let obj = fs::read_to_string(Path::new(&some).join("obj").join("frame_0000.obj")).expect("a file");
    let objects: Vec<_> = obj.lines().filter_map(|line| line.strip_prefix("o ")).collect();
    assert_eq!(objects, ["rope", "ball", "obstacle-0"]);

    let error = refused(&[&scene, "--out", &some, "--rods", "rop"]);
    assert_eq!(
        error,
        "error: --rods: the scene named has no rod or body `rop`; did you mean `rope`? (it has hand, ball, cable, rope)\n"
    );
    assert!(refused(&[&scene, "--rods", "rope"]).contains("no file is asked for"));
    let error = refused(&[&scene, "--out", &some, "--export", "csv", "--rods", "hand"]);
    assert!(error.contains("what holds `hand` holds `cable`, too, and reactions.csv would lack its part"), "{error}");
    runs(&[&scene, "--out", &some, "--export", "vtp", "--rods", "hand"]);
}

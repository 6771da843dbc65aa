//! What `--view`, `--plot` and `--export` write, and that a run without them is the same run.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use crate::common::{builtin_names, json, run, simulate, texts};
use export::{Trajectory, read_trajectory};
use gltf::Gltf;
use roxmltree::Document;
use serde_json::Value;
use vtkio::Vtk;

fn trajectory(folder: &Path) -> Trajectory {
    read_trajectory(&folder.join("trajectory.safetensors")).expect("a trajectory")
}

/// The whole of a summary that does not depend on the clock.
fn without_times(mut summary: Value) -> Value {
    let entries = summary.as_object_mut().expect("an object");
    for key in ["wall_s", "times_real_time", "stages_s"] {
        entries.remove(key).unwrap_or_else(|| panic!("no {key}"));
    }
    summary
}

#[test]
fn a_run_that_is_looked_at_is_the_same_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let out_text = out.to_str().expect("UTF-8");
    let scene = ["two-rods", "--steps", "30"];
    let plain = json(&scene);
    let all = ["--view", "--plot", "--export", "vtp,glb,csv,obj", "--out", out_text];
    let looked_at = json(&[&scene[..], &all].concat());
    assert_eq!(without_times(plain), without_times(looked_at));
    for plot in ["energy.svg", "length.svg", "iterations.svg", "stages.svg"] {
        let text = fs::read_to_string(out.join(plot)).expect(plot);
        let svg = Document::parse(&text).expect(plot);
        assert!(svg.descendants().any(|node| node.has_tag_name("path") || node.has_tag_name("polyline")), "{plot}");
    }
}

#[test]
fn the_player_shows_what_the_trajectory_has() {
    let folder = tempfile::tempdir().expect("a folder");
    for (scene, steps) in [("helix", 40), ("tree-10", 20), ("net-on-sphere", 12), ("hair", 3)] {
        let out = folder.path().join(scene);
        let steps = steps.to_string();
        let output = run(&[
            scene,
            "--steps",
            &steps,
            "--view",
            "--quiet",
            "--trajectory",
            "--out",
            out.to_str().expect("UTF-8"),
        ]);
        assert_eq!(texts(&output), (Some(0), "", ""), "{scene}");
        let shown = view::read_run(&out.join("view.json")).expect(scene);
        let decoded = shown.decode().expect(scene);
        let exact = trajectory(&out);
        assert_eq!(decoded.frames(), exact.states.len(), "{scene}");
        for (frame, state) in exact.states.iter().enumerate() {
            for (i, (x, q)) in state.positions.iter().zip(&state.orientations).enumerate() {
                let (own_x, own_q) = (decoded.position(frame, i), decoded.orientation(frame, i));
                let off = (own_x.expect("a position") - x).amax();
                assert!(off <= shown.position_precision() * (1.0 + 1e-9), "{scene}, {frame}, {i}: {off} m");
                let turn = own_q.expect("an orientation").angle_to(q);
                assert!(turn <= view::ORIENTATION_PRECISION, "{scene}, {frame}, {i}: {turn} rad");
            }
        }
        let page = fs::read_to_string(out.join("view.html")).expect("a page");
        assert!(page.contains("<canvas") && !page.contains("http://") && !page.contains("https://"), "{scene}");
    }
}

#[test]
fn several_runs_make_one_page() {
    let folder = tempfile::tempdir().expect("a folder");
    let [a, b, page] = ["a", "b", "both.html"].map(|name| folder.path().join(name).to_string_lossy().into_owned());
    for (out, formulation) in [(&a, "xpbd"), (&b, "newton")] {
        let output = run(&["helix", "--steps", "5", "--view", "--formulation", formulation, "--quiet", "--out", out]);
        assert_eq!(texts(&output), (Some(0), "", ""));
    }
    let output = run(&["view", &a, &b, "--out", &page]);
    assert_eq!(texts(&output).0, Some(0));
    let text = fs::read_to_string(&page).expect("a page");
    assert!(text.contains("helix: xpbd, direct") && text.contains("helix: newton"));
    // Its own page may be made anew.
    let output = run(&["view", &a, "--out", &page]);
    assert_eq!(texts(&output).0, Some(0));
    assert!(!fs::read_to_string(&page).expect("a page").contains("helix: newton"));
    // A folder without a run to look at is one error, and no page.
    fs::remove_file(folder.path().join("b/view.json")).expect("a file");
    fs::remove_file(&page).expect("a file");
    let output = run(&["view", &a, &b, "--out", &page]);
    let (code, _, error) = texts(&output);
    assert_eq!(code, Some(2));
    assert!(error.starts_with("error: RUNS") && error.contains("view.json") && error.lines().count() == 1, "{error}");
    assert!(!Path::new(&page).exists());
}

/// A page that somebody else wrote is not written over: neither the one named, nor `view.html` in the current folder.
#[test]
fn a_page_that_is_not_ours_stays() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let output = run(&["helix", "--steps", "2", "--view", "--quiet", "--out", out.to_str().expect("UTF-8")]);
    assert_eq!(texts(&output), (Some(0), "", ""));
    for (name, mine) in [("view.html", "<!doctype html>\n<html lang=\"en\">\n<p>mine</p>\n"), ("empty.html", "")] {
        let page = folder.path().join(name);
        fs::write(&page, mine).expect("a file");
        let flags: &[&str] = if name == "view.html" { &[] } else { &["--out", name] };
        let output = simulate(&[&["view", "out"], flags].concat()).current_dir(&folder).output().expect("it starts");
        let why = "is in the way and is no page of runs: move it, or choose another name";
        assert_eq!(texts(&output), (Some(2), "", format!("error: --out: {name} {why}\n").as_str()));
        assert_eq!(fs::read_to_string(&page).expect("a file"), mine);
    }
    let output = simulate(&["view", "out", "--out", "out/"]).current_dir(&folder).output().expect("it starts");
    let why = "error: --out: out/ is a folder; give the page a name, such as out/view.html\n";
    assert_eq!(texts(&output), (Some(2), "", why));
}

#[test]
fn every_shipped_scene_can_be_taken_along() {
    let folder = tempfile::tempdir().expect("a folder");
    for scene in builtin_names() {
        let out = folder.path().join(scene);
        let flags = [
            "--steps",
            "2",
            "--quiet",
            "--trajectory",
            "--export",
            "vtp,csv,obj,glb",
            "--out",
            out.to_str().expect("UTF-8"),
        ];
        let output = run(&[&[scene][..], &flags].concat());
        assert_eq!(texts(&output), (Some(0), "", ""), "{scene}");
        let exact = trajectory(&out);
        let (frames, segments) = (exact.states.len(), exact.states[0].len());
        assert_eq!(frames, 3, "{scene}");

        let index = fs::read_to_string(out.join("run.pvd")).expect("an index");
        let index = Document::parse(&index).expect("XML");
        let (still, files): (Vec<&str>, Vec<&str>) =
            index.descendants().filter_map(|node| node.attribute("file")).partition(|file| *file == "obstacles.vtp");
        assert_eq!(files.len(), frames, "{scene}");
        for file in files {
            Vtk::import(out.join(file)).unwrap_or_else(|error| panic!("{scene}, {file}: {error}"));
        }

        let glb = Gltf::from_slice(&fs::read(out.join("run.glb")).expect("a file")).expect("a valid glTF file");
        let bones: BTreeSet<usize> = glb.skins().flat_map(|skin| skin.joints().map(|joint| joint.index())).collect();
        // A rigid body needs no bone: its surface hangs on its own node.
        let model = scene::builtin(scene).expect("a scene").model;
        let bodies = model.segments.iter().filter(|segment| segment.body.is_some()).count();
        let moving = model.contacts.obstacles.iter().filter(|obstacle| obstacle.motion.is_some()).count();
        assert_eq!(bones.len(), segments - bodies, "{scene}");
        let channels = glb.animations().next().expect("an animation").channels().count();
        assert_eq!(channels, 2 * (segments + moving), "{scene}");
        let obstacles = model.contacts.obstacles.len();
        assert_eq!(still.len(), if obstacles > moving { frames } else { 0 }, "{scene}");
        if obstacles > moving {
            Vtk::import(out.join("obstacles.vtp")).unwrap_or_else(|error| panic!("{scene}: {error}"));
        }

        let rows = |file: &str| csv::Reader::from_path(out.join(file)).expect(file).into_records().count();
        assert_eq!(rows("segments.csv"), frames * segments, "{scene}");
        assert_eq!(rows("joints.csv"), frames * exact.forces[0].len(), "{scene}");
        assert_eq!(fs::read_dir(out.join("obj")).expect("a folder").count(), frames, "{scene}");
        fs::remove_dir_all(&out).expect("an own folder");
    }
}

#[test]
fn places_that_are_taken_are_one_error_before_the_run() {
    let folder = tempfile::tempdir().expect("a folder");
    for (flag, taken) in [("--view", "view.html"), ("--view", "view.json"), ("--plot", "energy.svg")] {
        let out = folder.path().join(format!("{flag}-{taken}"));
        fs::create_dir_all(out.join(taken)).expect("a folder");
        let output = run(&["helix", "--steps", "2", flag, "--out", out.to_str().expect("UTF-8")]);
        let (code, _, error) = texts(&output);
        assert_eq!(code, Some(2));
        assert!(error.starts_with("error: --out") && error.contains(taken) && error.lines().count() == 1, "{error}");
        assert_eq!(fs::read_dir(&out).expect("a folder").count(), 1, "nothing is left");
    }
    let error = run(&["helix", "--export", "stl"]);
    assert!(texts(&error).2.contains("vtp, glb, csv, obj"));
}

//! What `--view`, `--plot` and `--export` write, and that a run without them is the same run.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use crate::common::{builtin_names, json, run, simulate, texts};
use cosserat::scene;
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

/// The columns of a table by their names, empty cells as not a number.
fn columns(path: &Path) -> BTreeMap<String, Vec<f64>> {
    let text = fs::read_to_string(path).expect("a table");
    let mut lines = text.lines().map(|line| line.split(','));
    let names: Vec<String> = lines.next().expect("a head").map(str::to_owned).collect();
    let rows: Vec<Vec<f64>> = lines.map(|line| line.map(|cell| cell.parse().unwrap_or(f64::NAN)).collect()).collect();
    let column = |k: usize| rows.iter().map(|row| row[k]).collect();
    names.into_iter().enumerate().map(|(k, name)| (name, column(k))).collect()
}

/// Asserts that lines of the player's curves have the values of tables, to five digits.
fn assert_lines(curve: &view::Curve, unit: &str, exact: &[(&str, &[f64])]) {
    assert_eq!(curve.unit, unit, "{}", curve.label);
    let names: Vec<&str> = curve.lines.iter().map(|line| line.name.as_str()).collect();
    assert_eq!(names, exact.iter().map(|(name, _)| *name).collect::<Vec<_>>(), "{}", curve.label);
    for (line, (name, values)) in curve.lines.iter().zip(exact) {
        assert_eq!(line.values().len(), values.len(), "{}, {name}", curve.label);
        for (frame, (shown, exact)) in line.values().iter().zip(*values).enumerate() {
            let off = shown.map_or(f64::NAN, |shown| (f64::from(shown) - exact).abs() / exact.abs().max(1e-30));
            assert!(
                off < 1e-4 || (exact.is_nan() && shown.is_none()),
                "{}, {name}, {frame}: {shown:?}, {exact}",
                curve.label
            );
        }
    }
}

#[test]
fn the_player_has_the_curves_of_probes_and_reactions() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("probed.toml");
    let rods = ["near", "far"].map(|name| {
        format!(
            "[[rods]]\nname = \"{name}\"\nshape.straight = {{ length_m = 1, segments = 6, direction = [1, 0, 0] }}\nclamp = [\"start-face\"]\n"
        )
    });
    let probe = |name: &str, rod: &str| {
        format!(
            "[[probes]]\nname = \"{name}\"\nrod = \"{rod}\"\nat = \"end-face\"\nquantities = [\"tension\", \"position\"]\n"
        )
    };
    let text = [
        rods.concat(),
        probe("a", "near"),
        probe("b", "far"),
        "[run]\ndt_s = 0.01\nsteps = 12\nevery = 3\n".to_owned(),
    ];
    fs::write(&path, text.concat()).expect("a scene");
    let out = folder.path().join("out");
    let scene = path.to_str().expect("UTF-8");
    let output = run(&[scene, "--view", "--export", "csv", "--quiet", "--out", out.to_str().expect("UTF-8")]);
    assert_eq!(texts(&output), (Some(0), "", ""));
    let shown = view::read_run(&out.join("view.json")).expect("a run");
    let curves: BTreeMap<&str, &view::Curve> =
        shown.curves().iter().map(|curve| (curve.label.as_str(), curve)).collect();
    let labels: Vec<&str> = curves.keys().copied().collect();
    let of_grips = ["far, start: force", "far, start: moment", "near, start: force", "near, start: moment"];
    assert_eq!(labels, [&["a: position", "b: position"][..], &of_grips, &["tension"]].concat());
    let read = columns(&out.join("probes.csv"));
    assert_lines(curves["tension"], "N", &[("a", &read["a.tension_n"]), ("b", &read["b.tension_n"])]);
    let axes = ["x", "y", "z"];
    let position = axes.map(|axis| (axis, read[&format!("b.{axis}_m")].as_slice()));
    assert_lines(curves["b: position"], "m", &position);
    // Rows of reactions are of the one anchor and the other, in turns, in all frames but the first.
    let read = columns(&out.join("reactions.csv"));
    for (k, rod) in ["near", "far"].into_iter().enumerate() {
        for (what, unit) in [("force", "n"), ("moment", "n_m")] {
            let values = axes.map(|axis| {
                let all = &read[&format!("{what}_{axis}_{unit}")];
                [f64::NAN].into_iter().chain(all.iter().copied().skip(k).step_by(2)).collect::<Vec<_>>()
            });
            let lines: Vec<(&str, &[f64])> = axes.into_iter().zip(values.iter().map(Vec::as_slice)).collect();
            assert_lines(
                curves[format!("{rod}, start: {what}").as_str()],
                &unit.replace("n_m", "N m").replace('n', "N"),
                &lines,
            );
        }
    }
}

#[test]
fn the_player_has_names_grips_and_contacts_of_what_is_shown() {
    let folder = tempfile::tempdir().expect("a folder");
    let seen = |name: &str, arguments: &[&str]| -> Value {
        let out = folder.path().join(name);
        let output = run(&[arguments, &["--view", "--quiet", "--out", out.to_str().expect("UTF-8")]].concat());
        assert_eq!(texts(&output), (Some(0), "", ""), "{name}");
        view::read_run(&out.join("view.json")).expect(name);
        serde_json::from_str(&fs::read_to_string(out.join("view.json")).expect(name)).expect(name)
    };
    let plane = seen("plane", &["helix-on-plane", "--steps", "60"]);
    assert_eq!(plane["rods"].as_array().map(Vec::len), Some(1));
    assert_eq!(plane["obstacle_names"].as_array().map(Vec::len), Some(1));
    let counts: Vec<u64> = serde_json::from_value(plane["contacts"]["counts"].clone()).expect("counts");
    assert_eq!((counts.len(), counts[0]), (61, 0));
    assert!(counts.iter().any(|&count| count > 0), "nothing touches the plane");
    // Two rods touch, of which one is shown: contacts are those of its segments.
    let both = seen("both", &["two-rods", "--steps", "30"]);
    let names: Vec<String> = serde_json::from_value(both["rods"].clone()).expect("names");
    let one = seen("one", &["two-rods", "--steps", "30", "--rods", &names[0]]);
    assert!(one["segments"]["length"].as_array().map(Vec::len) < both["segments"]["length"].as_array().map(Vec::len));
    // What touches nothing has none of it.
    let helix = seen("helix", &["helix", "--steps", "5"]);
    assert_eq!(
        (&helix["contacts"], &helix["obstacle_names"], &helix["chapters"]),
        (&Value::Null, &Value::Null, &Value::Null)
    );
    assert_eq!(helix["grips"].as_array().map(Vec::len), Some(1));
}

#[test]
fn the_page_of_modes_has_their_frequencies() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("modes");
    let output = run(&["modes", "plucked-string", "--count", "3", "--view", "--out", out.to_str().expect("UTF-8")]);
    let (code, printed, err) = texts(&output);
    assert_eq!((code, err), (Some(0), ""));
    let shown: Value = serde_json::from_str(&fs::read_to_string(out.join("view.json")).expect("a run")).expect("JSON");
    let chapters = shown["chapters"].as_array().expect("chapters");
    assert_eq!((chapters.len(), &chapters[0]["label"]), (4, &Value::from("at rest")));
    for (k, chapter) in chapters[1..].iter().enumerate() {
        let label = chapter["label"].as_str().expect("a label");
        assert!(label.starts_with(&format!("mode {k}: ")) && label.ends_with(" Hz"), "{label}");
        assert!(printed.contains(label), "{printed}");
        assert_eq!(chapter["frame"], 1 + 24 * k);
    }
    assert_eq!(shown["time"].as_array().map(Vec::len), Some(1 + 3 * 24));
    assert!(shown["energy"].as_array().expect("energies").iter().all(Value::is_null));
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
    assert!(text.contains("helix: xpbd, euler, direct") && text.contains("helix: newton, euler"));
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
    assert!(error.starts_with("error: ") && error.contains("view.json") && error.lines().count() == 1, "{error}");
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

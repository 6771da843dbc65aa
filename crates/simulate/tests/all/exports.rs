//! Files for other programs from a run on the disk: those that the run itself would have written.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::common::{run, runs, texts};

/// All files below a folder with their contents; those of the run alone, which know how long it took, left out.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry")) {
        let name = entry.file_name().into_string().expect("UTF-8");
        if entry.path().is_dir() {
            found.extend(contents(&entry.path()).into_iter().map(|(file, bytes)| (format!("{name}/{file}"), bytes)));
        } else if !["trajectory.safetensors", "summary.json"].contains(&name.as_str()) {
            found.insert(name, fs::read(entry.path()).expect("a file"));
        }
    }
    found
}

#[test]
fn files_from_the_disk_are_those_of_the_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let [all, few, later] = ["all", "few", "later"].map(|name| folder.path().join(name));
    let [at_all, at_few, at_later] = [&all, &few, &later].map(|path| path.to_str().expect("UTF-8"));
    for (scene, of_run, rods) in [
        ("helix-on-plane", &[][..], &[][..]),
        ("two-rods", &[], &["--rods", "upper"][..]),
        // By the paper's measure of strains.
        ("slack-rod", &["--formulation", "xpbd"], &[]),
    ] {
        let flags = [&["--export", "vtp,glb,csv,obj"][..], rods].concat();
        let run_of = |more: &[&str]| runs(&[&[scene, "--steps", "7"][..], of_run, more].concat());
        run_of(&[&flags[..], &["--out", at_all]].concat());
        run_of(&[&flags[..], &["--every", "3", "--out", at_few]].concat());
        // It keeps forces, of all rods.
        run_of(&["--export", "obj", "--trajectory", "--out", at_later]);
        assert_ne!(contents(&later), contents(&all));
        runs(&[&["export", at_later][..], &flags].concat());
        let without_record = |folder: &Path| {
            let mut found = contents(folder);
            assert!(found.remove("run.json").is_some() && found.contains_key("vtp/frame_0003.vtp"), "{scene}");
            found
        };
        assert!(without_record(&later) == without_record(&all), "{scene}");
        runs(&[&["export", at_later, "--every", "3"][..], &flags].concat());
        assert!(without_record(&later) == without_record(&few), "{scene}");
    }
    // They are the run's now: the next one removes them.
    runs(&["helix", "--steps", "1", "--out", at_later]);
    assert_eq!(contents(&later).keys().collect::<Vec<_>>(), ["run-scene.toml", "run.json"]);
}

/// A joint that has broken has no curvature, in files of the run and from the disk.
#[test]
fn what_has_broken_has_no_curvature() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().to_str().expect("UTF-8");
    runs(&["spaghetti", "--steps", "80", "--every", "40", "--export", "csv", "--trajectory", "--out", path]);
    let [joints, breaks] = ["joints.csv", "breaks.csv"].map(|name| fs::read_to_string(folder.path().join(name)));
    let (joints, breaks) = (joints.expect("a table"), breaks.expect("a table"));
    let broken = breaks.lines().nth(1).and_then(|row| row.split(',').nth(1)).expect("a joint that broke");
    let curvatures: Vec<f64> = joints
        .lines()
        .map(|row| row.split(',').collect::<Vec<_>>())
        .filter(|row| row[2] == broken)
        .map(|row| row[7].parse().expect("a curvature"))
        .collect();
    let [first, middle, last] = curvatures[..] else { panic!("{curvatures:?}") };
    assert!(first > 10.0 && middle >= 0.0 && last == 0.0, "{curvatures:?}");
    runs(&["export", path, "--export", "csv"]);
    assert!(fs::read_to_string(folder.path().join("joints.csv")).expect("a table") == joints);
}

#[test]
fn forces_that_were_not_kept_are_left_out() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let path = out.to_str().expect("UTF-8");
    runs(&["helix", "--steps", "2", "--out", path]);
    let output = run(&["export", path, "--export", "csv,csv"]);
    let said = format!(
        "wrote segments.csv, joints.csv, reactions.csv to {path}\n\
         without forces of joints: the run has kept none, as one with --export does\n"
    );
    assert_eq!(texts(&output), (Some(0), said.as_str(), ""));
    let joints = fs::read_to_string(out.join("joints.csv")).expect("a table");
    assert!(joints.starts_with("frame,time_s,joint,a,a_name,b,b_name,curvature_per_m\n"), "{joints}");
}

#[test]
fn mistakes_are_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let [own, arms, file] = ["own", "arms", "cord.toml"].map(at);
    let (own, arms, file) = (own.as_str(), arms.as_str(), file.as_str());
    fs::write(file, "[[rods]]\nradius_m = 0.01\nshape.straight = { length_m = 1, segments = 5 }\n").expect("a file");
    runs(&[file, "--steps", "1", "--out", own]);
    runs(&["two-arms", "--steps", "1", "--out", arms]);
    fs::write(Path::new(own).join("run.glb"), "mine").expect("a file");
    fs::remove_file(Path::new(own).join("run-scene.toml")).expect("the scene of the run");
    for (arguments, expected) in [
        (
            vec![folder.path().to_str().expect("UTF-8")],
            "has no trajectory.safetensors, which a run with --trajectory writes",
        ),
        (
            vec![own],
            "a run of the scene `cord`, which does not come with the program, without its run-scene.toml: say --scene FILE.toml",
        ),
        (vec![own, "--scene", "helix"], "--scene: the scene helix has 60 segments, but the run in "),
        (vec![own, "--scene", "helicks"], "--scene: there is no scene `helicks`; did you mean `helix`?"),
        (vec![own, "--scene", file, "--rods", "rope"], "--rods: the scene cord has no rod or body `rope`"),
        (vec![own, "--scene", file], "run.glb"),
        (vec![arms, "--scene", "helix"], "--scene: the scene helix has 60 segments, but the run in "),
    ] {
        let output = run(&[&["export", "--export", "glb"][..], &arguments].concat());
        let (code, out, err) = texts(&output);
        assert_eq!((code, out), (Some(2), ""), "{arguments:?}");
        assert!(err.starts_with("error: ") && err.contains(expected) && err.lines().count() == 1, "{err}");
    }
    assert_eq!(fs::read(Path::new(own).join("run.glb")).expect("a file"), b"mine");
    runs(&["export", own, "--scene", file, "--export", "csv"]);
}

//! A run has its folder to itself: whose files go, whose stay, and what a run leaves that does not come to its end.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::common::{run, runs, simulate, texts};
use serde_json::Value;

/// Names in a folder, in order.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder");
    let mut names: Vec<String> =
        entries.map(|entry| entry.expect("an entry").file_name().into_string().expect("UTF-8")).collect();
    names.sort();
    names
}

fn read(file: &Path) -> Value {
    serde_json::from_slice(&fs::read(file).expect("a file")).expect("JSON")
}

const ALWAYS: [&str; 3] = ["run-scene.toml", "run.json", "summary.json"];

/// The names that every run writes, and these.
fn with(more: &[&str]) -> Vec<String> {
    let mut names: Vec<String> = ALWAYS.iter().chain(more).map(|&name| name.to_owned()).collect();
    names.sort();
    names
}

#[test]
fn a_folder_holds_the_last_run_alone_and_what_is_not_a_run_s() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let path = out.to_str().expect("UTF-8");
    runs(&["helix", "--steps", "4", "--view", "--out", path]);
    assert_eq!(names(&out), with(&["view.html", "view.json"]));
    fs::write(out.join("notes.txt"), "mine").expect("a file");
    runs(&["tree-10", "--steps", "3", "--export", "vtp,glb,csv,obj", "--out", path]);
    let exported = ["joints.csv", "notes.txt", "obj", "reactions.csv", "run.glb", "run.pvd", "segments.csv", "vtp"];
    assert_eq!(names(&out), with(&exported));
    assert_eq!(fs::read_dir(out.join("vtp")).expect("frames").count(), 4);
    runs(&["knot", "--steps", "2", "--plot", "--out", path]);
    let plots = ["energy.svg", "iterations.svg", "length.svg", "notes.txt", "snapshots.svg", "stages.svg"];
    assert_eq!(names(&out), with(&plots));
    assert_eq!(read(&out.join("summary.json"))["scene"], "knot");
    runs(&["bending-rod", "--steps", "1", "--out", path]);
    assert_eq!(names(&out), with(&["notes.txt", "trajectory.safetensors"]));
    assert_eq!(fs::read_to_string(out.join("notes.txt")).expect("a file"), "mine");

    // The run's own record says what is its.
    let record = read(&out.join("run.json"));
    assert_eq!(record["finished"], true);
    let files = record["files"].as_array().expect("names");
    assert_eq!(files.len(), 3, "{record}");
}

#[test]
fn without_out_each_scene_has_a_folder() {
    let folder = tempfile::tempdir().expect("a folder");
    for scene in ["helix", "random-rod"] {
        let output = simulate(&[scene, "--steps", "2", "--view"]).current_dir(&folder).output().expect("it starts");
        let (code, out, err) = texts(&output);
        assert_eq!((code, err), (Some(0), ""));
        assert!(out.starts_with(&format!("{scene}: ")), "{out}");
        let page = Path::new("out").join(scene).join("view.html");
        assert_eq!(out.lines().last(), Some(format!("open {}", page.display()).as_str()));
        assert!(folder.path().join(page).exists());
        assert_eq!(read(&folder.path().join("out").join(scene).join("summary.json"))["scene"], scene);
    }
    // Both are runs that can be looked at together.
    let output = simulate(&["view", "out/helix", "out/random-rod"]).current_dir(&folder).output().expect("it starts");
    assert_eq!(texts(&output), (Some(0), "open view.html\n", ""));
}

/// A static equilibrium owns its folder, too.
#[test]
fn an_equilibrium_takes_the_place_of_a_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().to_str().expect("UTF-8");
    runs(&["helix", "--steps", "2", "--view", "--out", path]);
    let output = run(&["static", "heavy-cantilever", "--out", path]);
    let (code, out, err) = texts(&output);
    assert_eq!((code, err), (Some(0), ""));
    assert!(out.contains(&format!("written to {path}: trajectory.safetensors, ")), "{out}");
    assert_eq!(names(folder.path()), with(&["trajectory.safetensors"]));
}

/// What is not ours is named before anything is computed, and nothing is touched: not even an earlier run.
#[test]
fn somebody_else_s_file_in_the_way_is_one_error() {
    for (mine, flags) in
        [("summary.json", &[][..]), ("view.html", &["--view"]), ("run.json", &[]), ("vtp", &["--export", "vtp"])]
    {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().to_str().expect("UTF-8");
        let file = folder.path().join(mine);
        fs::write(&file, "mine").expect("a file");
        let output = run(&[&["helix", "--steps", "1000000000", "--out", path][..], flags].concat());
        let (code, out, err) = texts(&output);
        assert_eq!((code, out), (Some(2), ""), "{mine}");
        let way_out = "is in the way and is not from an earlier run: move it, or choose another folder";
        assert_eq!(err, format!("error: --out: {} {way_out}\n", file.display()));
        assert_eq!(names(folder.path()), [mine]);
        assert_eq!(fs::read_to_string(&file).expect("a file"), "mine");
    }
}

/// Waits until a run has taken its folder.
fn wait_for_record(folder: &Path) {
    let begin = Instant::now();
    while !folder.join("unfinished").join("run.json").exists() {
        assert!(begin.elapsed() < Duration::from_secs(30), "no record in {}", folder.display());
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
#[cfg(unix)]
fn a_second_run_at_the_same_time_is_one_error_and_a_killed_one_leaves_the_earlier_one() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().to_str().expect("UTF-8");
    runs(&["knot", "--steps", "3", "--export", "vtp", "--trajectory", "--out", path]);
    let earlier = names(folder.path());
    let whole = fs::read(folder.path().join("trajectory.safetensors")).expect("a trajectory");
    let long = ["helix", "--steps", "1000000000", "--quiet", "--export", "vtp", "--out", path];
    let mut first = simulate(&long).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it starts");
    wait_for_record(folder.path());
    let output = run(&["knot", "--steps", "2", "--out", path]);
    let (code, out, err) = texts(&output);
    assert_eq!((code, out), (Some(2), ""));
    assert_eq!(
        err,
        format!("error: --out: another run is writing into {path}: wait for its end, or choose another folder\n")
    );
    // Long enough for frames to be on the disk; then as by kill -9.
    std::thread::sleep(Duration::from_millis(300));
    first.kill().expect("a signal");
    first.wait().expect("an end");
    // As if it had been killed while it wrote these.
    let unfinished = folder.path().join("unfinished");
    fs::write(unfinished.join(".summary.json-a1B2c3.tmp"), "half").expect("a file");
    fs::create_dir(unfinished.join(".vtp-Zz9Yy8.tmp")).expect("a folder");
    fs::write(unfinished.join(".vtp-Zz9Yy8.tmp/frame_0000.vtp"), "half").expect("a file");
    // The earlier run is there, whole.
    assert_eq!(read(&folder.path().join("run.json"))["finished"], true);
    assert_eq!(read(&folder.path().join("summary.json"))["steps"], 3);
    assert_eq!(fs::read(folder.path().join("trajectory.safetensors")).expect("a trajectory"), whole);
    assert_eq!(fs::read_dir(folder.path().join("vtp")).expect("frames").count(), 4);
    let now: Vec<_> = names(folder.path()).into_iter().filter(|name| name != "unfinished").collect();
    assert_eq!(now, earlier);
    runs(&["knot", "--steps", "2", "--view", "--out", path]);
    assert_eq!(names(folder.path()), with(&["view.html", "view.json"]));
}

/// Runs in a shell in which no file can be larger than so many KiB, as where a disk is full.
#[cfg(unix)]
fn limited(kib: usize, arguments: &[&str]) -> std::process::Output {
    let blocks = (2 * kib).to_string();
    Command::new("sh")
        .args(["-c", "trap '' XFSZ; ulimit -f \"$1\"; shift; exec \"$@\"", "sh", &blocks])
        .arg(env!("CARGO_BIN_EXE_simulate"))
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .expect("a shell")
}

/// A disk that fills up: the frames so far are a trajectory, and summary and error say how far it is and why.
#[test]
#[cfg(unix)]
fn what_was_computed_is_kept_where_the_disk_is_full() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().to_str().expect("UTF-8");
    let output = limited(2048, &["helix", "--steps", "1000000", "--trajectory", "--view", "--out", path]);
    let (code, out, err) = texts(&output);
    assert_eq!(code, Some(2), "{err}");
    let why = format!("cannot write into {path}: File too large");
    assert!(err.starts_with(&format!("error: --out: {why}")) && err.lines().count() == 1, "{err}");
    assert!(out.contains(" of 1000000, "), "{out}");
    assert_eq!(names(folder.path()), with(&["trajectory.safetensors"]));

    let summary = read(&folder.path().join("summary.json"));
    let incomplete = &summary["incomplete"];
    assert!(incomplete["why"].as_str().is_some_and(|text| text.starts_with(&why)), "{summary}");
    let kept = export::read_trajectory(&folder.path().join("trajectory.safetensors")).expect("a trajectory");
    let frames = kept.states.len();
    assert!((250..350).contains(&frames), "{frames} frames of 60 segments in 2 MiB");
    assert_eq!(incomplete["frames"], frames);
    let computed = incomplete["frames_computed"].as_u64().expect("a number");
    assert_eq!(summary["steps"].as_u64(), Some(computed - 1));
    assert!(computed as usize > frames && (computed as usize) < frames + 400, "{summary}");
    assert!(err.contains(&format!(" has {frames} of {computed} frames, without ")), "{err}");
    assert_eq!(
        read(&folder.path().join("run.json"))["files"],
        serde_json::json!(["trajectory.safetensors", "summary.json", "run-scene.toml"])
    );
    // They are the frames of the run on a larger disk.
    let whole = tempfile::tempdir().expect("a folder");
    runs(&["helix", "--steps", &frames.to_string(), "--out", whole.path().to_str().expect("UTF-8")]);
    let whole = export::read_trajectory(&whole.path().join("trajectory.safetensors")).expect("a trajectory");
    assert!(whole.states[..frames] == kept.states[..]);
}

/// Room for the trajectory, but not for a table: the summary names what is missing.
#[test]
#[cfg(unix)]
fn files_that_do_not_fit_are_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().to_str().expect("UTF-8");
    let output = limited(450, &["helix", "--steps", "40", "--quiet", "--export", "csv", "--out", path]);
    let (code, out, err) = texts(&output);
    assert_eq!((code, out), (Some(2), ""), "{err}");
    assert!(err.contains("cannot write ") && err.contains("segments.csv: File too large"), "{err}");
    assert!(err.ends_with(" has 41 of 41 frames, without segments.csv, joints.csv, reactions.csv\n"), "{err}");
    // The motion was not asked for, but others can be made of it later.
    assert_eq!(names(folder.path()), with(&["trajectory.safetensors"]));
    let summary = read(&folder.path().join("summary.json"));
    assert_eq!(summary["incomplete"]["missing"], serde_json::json!(["segments.csv", "joints.csv", "reactions.csv"]));
}

//! A run's folder: what is whose, and what goes.

use std::fs;
use std::path::Path;

use export::{ExportError, RunFolder, write_json};

/// All files and folders below a directory, folders with a slash, in order.
fn names(directory: &Path) -> Vec<String> {
    let mut names = Vec::new();
    for entry in fs::read_dir(directory).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        if path.is_dir() {
            names.extend(self::names(&path).into_iter().map(|below| format!("{name}/{below}")));
            names.push(format!("{name}/"));
        } else {
            names.push(name);
        }
    }
    names.sort();
    names
}

/// A run that writes these files, frames into folders of frames, and ends.
fn run(directory: &Path, files: &[&str]) {
    let folder = RunFolder::take(directory, files, &[]).unwrap();
    let place = folder.path().to_owned();
    for name in files {
        match name.strip_suffix('/') {
            Some(extension) => {
                fs::create_dir(place.join(extension)).unwrap();
                fs::write(place.join(format!("{extension}/frame_0000.{extension}")), "ours").unwrap();
            }
            None => fs::write(place.join(name), "ours").unwrap(),
        }
    }
    folder.finish(&files.iter().map(|&name| name.to_owned()).collect::<Vec<_>>()).unwrap();
}

#[test]
fn only_the_last_run_s_files_and_those_of_others_stay() {
    let directory = tempfile::tempdir().unwrap();
    let directory = &directory.path().join("a/b");
    run(directory, &["summary.json", "view.html"]);
    fs::write(directory.join("notes.txt"), "mine").unwrap();
    fs::write(directory.join(".summary.json-mine.tmp"), "mine").unwrap();
    run(directory, &["summary.json", "vtp/", "obj/"]);
    fs::write(directory.join("obj/model.obj"), "mine").unwrap();
    run(directory, &["summary.json", "energy.svg"]);
    assert_eq!(
        names(directory),
        [".summary.json-mine.tmp", "energy.svg", "notes.txt", "obj/", "obj/model.obj", "run.json", "summary.json"]
    );
}

#[test]
fn what_is_added_to_a_run_is_the_run_s() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    run(directory, &["summary.json"]);
    fs::write(directory.join("energy.svg"), "mine").unwrap();
    let error = RunFolder::add(directory, &["obj/", "energy.svg"]).unwrap_err();
    assert!(matches!(&error, ExportError::Taken { path } if path.ends_with("energy.svg")), "{error}");
    for _ in 0..2 {
        let folder = RunFolder::add(directory, &["view.html"]).unwrap();
        fs::write(folder.path().join("view.html"), "ours").unwrap();
    }
    assert_eq!(names(directory), ["energy.svg", "run.json", "summary.json", "view.html"]);
    let record = fs::read_to_string(directory.join("run.json")).unwrap();
    let record: serde_json::Value = serde_json::from_str(&record).unwrap();
    assert_eq!(record["files"], serde_json::json!(["summary.json", "view.html"]));
    assert_eq!(record["finished"], true);
    run(directory, &["summary.json"]);
    assert_eq!(names(directory), ["energy.svg", "run.json", "summary.json"]);
}

#[test]
fn what_is_in_the_way_is_named_and_nothing_is_touched() {
    type Make = fn(&Path);
    let file: Make = |path| fs::write(path, "mine").unwrap();
    let folder: Make = |path| fs::create_dir(path).unwrap();
    let frames: Make = |path| {
        fs::create_dir_all(path).unwrap();
        fs::write(path.join("frame_0000.vtp"), "mine").unwrap();
    };
    let with_notes: Make = |path| {
        fs::create_dir_all(path).unwrap();
        fs::write(path.join("notes.txt"), "mine").unwrap();
    };
    for (earlier, name, make, taken) in [
        (&[][..], "summary.json", file, "summary.json"),
        (&[], "summary.json", folder, "summary.json"),
        (&[], "vtp", file, "vtp"),
        (&[], "vtp", frames, "vtp"),
        (&[], "run.json", file, "run.json"),
        (&[], "run.json", folder, "run.json"),
        (&["energy.svg"], "summary.json", file, "summary.json"),
        (&["vtp/"], "vtp", with_notes, "vtp/notes.txt"),
    ] {
        let directory = tempfile::tempdir().unwrap();
        if !earlier.is_empty() {
            run(directory.path(), earlier);
        }
        make(&directory.path().join(name));
        let before = names(directory.path());
        let error = RunFolder::take(directory.path(), &["energy.svg", "summary.json", "vtp/"], &[]).unwrap_err();
        let path = directory.path().join(taken);
        assert!(matches!(&error, ExportError::Taken { path: found } if *found == path), "{name}: {error}");
        assert_eq!(names(directory.path()), before, "{name}");
    }
}

/// A record is text that anybody can write: names in it that lead out of the folder are nobody's to remove.
#[test]
fn a_record_that_names_other_places_is_not_ours() {
    let directory = tempfile::tempdir().unwrap();
    let keep = directory.path().join("keep");
    fs::write(&keep, "mine").unwrap();
    let folder = directory.path().join("run");
    fs::create_dir(&folder).unwrap();
    for name in ["../keep", "/etc/passwd", "..", ".", "", "a/../../keep", "a//"] {
        let record = serde_json::json!({"format": "rods-run-1", "finished": true, "files": [name]});
        write_json(&folder.join("run.json"), &record).unwrap();
        let error = RunFolder::take(&folder, &["summary.json"], &[]).unwrap_err();
        assert!(matches!(error, ExportError::Taken { .. }), "{name}: {error}");
    }
    assert!(keep.exists());
}

/// A process that is killed leaves an earlier run as it was, and the next one removes what is left of it, but for what that is
/// to keep.
#[test]
fn a_killed_run_leaves_the_earlier_one_as_it_was() {
    let directory = tempfile::tempdir().unwrap();
    let directory = directory.path();
    run(directory, &["summary.json", "vtp/"]);
    let whole = names(directory);
    let record = fs::read(directory.join("run.json")).unwrap();
    let unfinished = directory.join(RunFolder::UNFINISHED);
    for _ in 0..2 {
        // Dropped without an end, as by a process that is killed.
        drop(RunFolder::take(directory, &["table.csv", "vtp/", "snapshot"], &["snapshot"]).unwrap());
        assert_eq!(fs::read(directory.join("run.json")).unwrap(), record);
        for file in [".table.csv-a1B2c3.tmp", ".run.json-Zz9Yy8.tmp", "table.csv", "snapshot"] {
            fs::write(unfinished.join(file), "half").unwrap();
        }
        fs::create_dir(unfinished.join(".vtp-a1B2c3.tmp")).unwrap();
        fs::write(unfinished.join(".vtp-a1B2c3.tmp/frame_0000.vtp"), "half").unwrap();
    }
    let folder = RunFolder::take(directory, &["summary.json"], &["snapshot"]).unwrap();
    assert_eq!(names(&unfinished), ["run.json", "snapshot"]);
    drop(folder);
    let mut with_unfinished = whole;
    with_unfinished.extend(["unfinished/", "unfinished/run.json", "unfinished/snapshot"].map(str::to_owned));
    with_unfinished.sort();
    assert_eq!(names(directory), with_unfinished);
    run(directory, &["summary.json"]);
    assert_eq!(names(directory), ["run.json", "summary.json"]);
    assert_eq!(fs::read_to_string(directory.join("run.json")).unwrap().matches("summary.json").count(), 1);
}

#[test]
fn an_unfinished_folder_that_is_no_run_s_is_in_the_way() {
    let directory = tempfile::tempdir().unwrap();
    let unfinished = directory.path().join(RunFolder::UNFINISHED);
    fs::create_dir(&unfinished).unwrap();
    fs::write(unfinished.join("novel.txt"), "mine").unwrap();
    let error = RunFolder::take(directory.path(), &["summary.json"], &[]).unwrap_err();
    assert!(matches!(&error, ExportError::Taken { path } if *path == unfinished), "{error}");
    assert_eq!(names(directory.path()), ["unfinished/", "unfinished/novel.txt"]);
    // Beside a run's files, it stays.
    fs::remove_file(unfinished.join("novel.txt")).unwrap();
    let folder = RunFolder::take(directory.path(), &["summary.json"], &[]).unwrap();
    fs::write(unfinished.join("novel.txt"), "mine").unwrap();
    folder.finish(&[]).unwrap();
    assert_eq!(names(directory.path()), ["run.json", "unfinished/", "unfinished/novel.txt"]);
}

#[test]
#[cfg(unix)]
fn a_folder_is_one_run_s_at_a_time() {
    let directory = tempfile::tempdir().unwrap();
    let first = RunFolder::take(directory.path(), &["summary.json"], &[]).unwrap();
    let error = RunFolder::take(directory.path(), &["summary.json"], &[]).unwrap_err();
    assert!(matches!(error, ExportError::Busy { .. }), "{error}");
    assert_eq!(first.directory(), directory.path());
    first.finish(&[]).unwrap();
    RunFolder::take(directory.path(), &["summary.json"], &[]).unwrap();
}

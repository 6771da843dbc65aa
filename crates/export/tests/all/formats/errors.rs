//! What goes wrong is one clear error, and nothing is half-written.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use export::{ExportError, Format, Names, TrajectoryReader};
use rod::Model;

use super::runs::{Run, runs, straight, straight_of};

/// All files below a directory with their content, folders with a slash, in order.
fn content(directory: &Path) -> Vec<(String, Vec<u8>)> {
    let mut found = Vec::new();
    for entry in fs::read_dir(directory).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        if path.is_dir() {
            let below = content(&path).into_iter().map(|(below, bytes)| (format!("{name}/{below}"), bytes));
            found.extend(below);
            found.push((format!("{name}/"), Vec::new()));
        } else {
            found.push((name, fs::read(&path).unwrap()));
        }
    }
    found.sort();
    found
}

/// Writes a format of a model without names.
fn write_format(
    format: Format,
    directory: &Path,
    reader: &mut TrajectoryReader,
    model: &Model,
) -> Result<Vec<PathBuf>, ExportError> {
    export::write_format(format, directory, reader, model, &Names::new(model, &[], &[]))
}

/// A recorded run and its model.
fn recorded(run: &Run) -> (tempfile::TempDir, TrajectoryReader, &Model) {
    let directory = tempfile::tempdir().unwrap();
    let reader = TrajectoryReader::open(&run.record(directory.path())).unwrap();
    (directory, reader, &run.model)
}

#[test]
fn names_are_read_as_written() {
    for format in Format::ALL {
        assert_eq!(format.to_string().parse(), Ok(format));
    }
    assert_eq!("gltf".parse::<Format>(), Err("expected one of vtp, glb, csv, obj, usda".to_owned()));
}

#[test]
fn the_directory_is_made_and_an_earlier_export_replaced() {
    let (long, short) = (straight(4), straight(2));
    let (_keep, mut four, model) = recorded(&long);
    let (_keep_too, mut two, _) = recorded(&short);
    let directory = tempfile::tempdir().unwrap();
    let [again, fresh] = ["new/deep", "fresh"].map(|name| directory.path().join(name));
    for format in Format::ALL {
        write_format(format, &again, &mut four, model).unwrap();
    }
    assert_eq!(fs::read_dir(again.join("vtp")).unwrap().count(), 4);
    for format in Format::ALL {
        let made = write_format(format, &again, &mut two, model).unwrap();
        assert!(made.iter().all(|path| path.exists()));
        write_format(format, &fresh, &mut two, model).unwrap();
    }
    assert!(content(&again) == content(&fresh));
    let names: Vec<_> = content(&fresh).into_iter().map(|(name, _)| name).collect();
    assert_eq!(
        names.join(" "),
        "joints.csv obj/ obj/frame_0000.obj obj/frame_0001.obj reactions.csv run.glb run.pvd run.usda segments.csv vtp/ vtp/frame_0000.vtp \
         vtp/frame_0001.vtp"
    );
}

#[test]
fn what_is_in_the_way_is_named_and_stays() {
    let run = straight(2);
    let (_keep, mut reader, model) = recorded(&run);
    let file = |path: &Path| fs::write(path, "mine").unwrap();
    let folder = |path: &Path| fs::create_dir(path).unwrap();
    let other = |path: &Path| {
        fs::create_dir(path).unwrap();
        fs::write(path.join("frame_0000.txt"), "mine").unwrap();
    };
    let foreign = "it holds frame_0000.txt, which no export wrote";
    type Obstacle<'a> = (Format, &'a str, &'a dyn Fn(&Path), &'a str, &'a str);
    let obstacles: [Obstacle; 8] = [
        (Format::Vtp, "vtp", &file, "replace", "not a directory"),
        (Format::Vtp, "vtp", &other, "replace", foreign),
        (Format::Vtp, "run.pvd", &folder, "write", "is a directory"),
        (Format::Glb, "run.glb", &folder, "write", "is a directory"),
        (Format::Csv, "segments.csv", &folder, "write", "is a directory"),
        (Format::Csv, "joints.csv", &folder, "write", "is a directory"),
        (Format::Obj, "obj", &file, "replace", "not a directory"),
        (Format::Obj, "obj", &other, "replace", foreign),
    ];
    for (format, name, make, action, cause) in obstacles {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join(name);
        make(&path);
        let before = content(directory.path());
        let error = write_format(format, directory.path(), &mut reader, model).unwrap_err();
        assert_eq!(error.to_string(), format!("cannot {action} {}: {cause}", path.display()));
        assert!(content(directory.path()) == before, "{name}");
    }
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("file");
    file(&path);
    for format in Format::ALL {
        let error = write_format(format, &path, &mut reader, model).unwrap_err().to_string();
        assert!(error.starts_with(&format!("cannot create the directory {}: ", path.display())), "{error}");
    }
}

#[test]
fn a_trajectory_of_another_model_is_refused() {
    let runs = runs();
    let (of_tree, of_ring) = (&runs[4], &runs[2]);
    let (directory, mut reader, model) = recorded(of_tree);
    let before = content(directory.path());
    for format in Format::ALL {
        let error = write_format(format, directory.path(), &mut reader, &of_ring.model).unwrap_err();
        assert!(matches!(error, ExportError::Segments { .. }), "{error}");
        let mut fewer = model.clone();
        fewer.joints.pop();
        let error = write_format(format, directory.path(), &mut reader, &fewer).unwrap_err();
        assert!(matches!(error, ExportError::Joints { .. }), "{error}");
    }
    assert!(content(directory.path()) == before);
}

#[test]
fn nothing_to_show_is_no_glb_and_else_an_empty_export() {
    let (empty, none) = (straight(0), Model::default());
    let (directory, mut reader, model) = recorded(&empty);
    let error = write_format(Format::Glb, directory.path(), &mut reader, model).unwrap_err().to_string();
    assert_eq!(error, "glb cannot hold this: 0 frames of 5 segments, but there must be at least one of both");
    assert_eq!(content(directory.path()).len(), 1);
    let error = write_format(Format::Usda, directory.path(), &mut reader, model).unwrap_err().to_string();
    assert_eq!(error, "usda cannot hold this: it has no frame");
    assert_eq!(content(directory.path()).len(), 1);
    for format in [Format::Vtp, Format::Csv, Format::Obj] {
        write_format(format, directory.path(), &mut reader, model).unwrap();
    }
    let of_nothing = Run { model: none, states: vec![rod::State::default()], times: vec![0.0], ..straight(0) };
    let (directory, mut reader, model) = recorded(&of_nothing);
    let error = write_format(Format::Glb, directory.path(), &mut reader, model).unwrap_err().to_string();
    assert_eq!(error, "glb cannot hold this: 1 frames of 0 segments, but there must be at least one of both");
    for format in [Format::Vtp, Format::Csv, Format::Obj, Format::Usda] {
        write_format(format, directory.path(), &mut reader, model).unwrap();
    }
}

#[test]
#[cfg(unix)]
fn an_unwritable_directory_is_named() {
    use std::os::unix::fs::PermissionsExt;
    let run = straight(2);
    let (directory, mut reader, model) = recorded(&run);
    let locked = directory.path().join("locked");
    fs::create_dir(&locked).unwrap();
    fs::set_permissions(&locked, fs::Permissions::from_mode(0o555)).unwrap();
    if fs::write(locked.join("probe"), "").is_ok() {
        return; // The superuser may write everywhere.
    }
    for format in Format::ALL {
        let error = write_format(format, &locked, &mut reader, model).unwrap_err().to_string();
        assert!(error.starts_with("cannot ") && error.ends_with(": permission denied"), "{error}");
        assert!(error.contains(locked.to_str().unwrap()), "{error}");
    }
}

/// Segments of a rod that needs more than the limit in every format.
#[cfg(unix)]
const SEGMENTS: usize = 1000;

/// Names the directory to export into, where the system takes no more than some KiB a file.
#[cfg(unix)]
const LIMITED: &str = "EXPORT_TEST_LIMITED";

/// The system refuses half-way, as it does where a disk is full: this test runs itself in a shell that limits the size
/// of files.
#[test]
#[cfg(unix)]
fn what_the_disk_does_not_take_leaves_the_earlier_export() {
    if let Some(directory) = env::var_os(LIMITED) {
        return export_within_limits(Path::new(&directory));
    }
    let run = straight_of(SEGMENTS, 3);
    let (directory, mut reader, model) = recorded(&run);
    for format in Format::ALL {
        write_format(format, directory.path(), &mut reader, model).unwrap();
    }
    let before = content(directory.path());
    let output = Command::new("sh")
        .args(["-c", "trap '' XFSZ; ulimit -f 8; exec \"$0\" \"$@\""])
        .arg(env::current_exe().unwrap())
        .args(["--exact", "formats::errors::what_the_disk_does_not_take_leaves_the_earlier_export", "--nocapture"])
        .env(LIMITED, directory.path())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && said.contains("all refused"), "{output:?}");
    assert!(content(directory.path()) == before);
}

/// Exports what is larger than the limit.
#[cfg(unix)]
fn export_within_limits(directory: &Path) {
    let run = straight_of(SEGMENTS, 1);
    let mut reader = TrajectoryReader::open(&directory.join("trajectory.safetensors")).unwrap();
    let large = ["vtp/frame_0000.vtp", "run.glb", "segments.csv", "obj/frame_0000.obj", "run.usda"];
    for (format, name) in Format::ALL.into_iter().zip(large) {
        let error = write_format(format, directory, &mut reader, &run.model).unwrap_err();
        let path = directory.join(name);
        assert_eq!(error.to_string(), format!("cannot write {}: File too large (os error 27)", path.display()));
    }
    println!("all refused");
}

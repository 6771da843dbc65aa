//! Files are complete or not there, and an error names the file and the cause.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use export::{ExportError, write_atomically, write_json};

fn names(directory: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(directory).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_file_is_written_and_replaced() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.txt");
    for text in ["first", "second"] {
        write_atomically(&path, |writer| writer.write_all(text.as_bytes())).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), text);
    }
    assert_eq!(names(directory.path()), ["a.txt"]);
}

#[test]
fn after_an_error_the_old_file_is_there_and_nothing_else() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.txt");
    fs::write(&path, "old").unwrap();
    let error = write_atomically(&path, |writer| {
        writer.write_all(&vec![b'x'; 3 << 20])?;
        Err(io::ErrorKind::StorageFull.into())
    })
    .unwrap_err();
    assert_eq!(error.to_string(), format!("cannot write {}: no storage space", path.display()));
    assert_eq!(fs::read_to_string(&path).unwrap(), "old");
    assert_eq!(names(directory.path()), ["a.txt"]);
}

#[test]
fn impossible_places_are_named() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("file");
    fs::write(&file, "").unwrap();
    fs::create_dir(directory.path().join("taken")).unwrap();
    for path in [file.join("below"), directory.path().join("missing/a"), directory.path().join("taken"), "/".into()] {
        let error = write_atomically(&path, |writer| writer.write_all(b"x")).unwrap_err();
        let text = error.to_string();
        let cause = text.strip_prefix(&format!("cannot write {}: ", path.display())).expect(&text);
        assert!(!cause.contains('/'), "{text}");
    }
    assert_eq!(names(directory.path()), ["file", "taken"]);
}

#[test]
#[cfg(unix)]
fn permissions_are_those_of_other_files() {
    use std::os::unix::fs::PermissionsExt;
    let directory = tempfile::tempdir().unwrap();
    let (ours, plain) = (directory.path().join("ours"), directory.path().join("plain"));
    write_atomically(&ours, |writer| writer.write_all(b"x")).unwrap();
    fs::write(&plain, "x").unwrap();
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
    assert_eq!(mode(&ours), mode(&plain));
}

#[test]
#[cfg(unix)]
fn an_unwritable_directory_is_named() {
    use std::os::unix::fs::PermissionsExt;
    let directory = tempfile::tempdir().unwrap();
    fs::set_permissions(directory.path(), fs::Permissions::from_mode(0o555)).unwrap();
    if fs::write(directory.path().join("probe"), "").is_ok() {
        return; // The superuser may write everywhere.
    }
    let path = directory.path().join("a.txt");
    let error = write_atomically(&path, |writer| writer.write_all(b"x")).unwrap_err();
    assert_eq!(error.to_string(), format!("cannot write {}: permission denied", path.display()));
}

#[test]
fn json_is_written_or_refused() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.json");
    write_json(&path, &[1.5, 2.0]).unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), "[\n  1.5,\n  2.0\n]\n");
    let no_json_key = std::collections::BTreeMap::from([((1, 2), 3)]);
    let error = write_json(&path, &no_json_key).unwrap_err();
    assert!(matches!(error, ExportError::Io { .. }));
    assert_eq!(names(directory.path()), ["a.json"]);
    assert_eq!(fs::read_to_string(&path).unwrap(), "[\n  1.5,\n  2.0\n]\n");
}

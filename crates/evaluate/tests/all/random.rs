//! Random scenes keep the laws of mechanics; `laws` has the test of a hundred.

use std::process::Command;

#[test]
fn random_scenes_are_counted_and_write_nothing_where_all_laws_hold() {
    let folder = tempfile::TempDir::new().expect("a folder");
    let mut command = Command::new(env!("CARGO_BIN_EXE_evaluate"));
    let output = command.args(["random", "--count", "5"]).current_dir(&folder).output().expect("the program runs");
    let text = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{text}");
    assert!(text.contains("5 scenes of seed 1, "), "{text}");
    assert!(!folder.path().join("out").exists(), "{text}");
}

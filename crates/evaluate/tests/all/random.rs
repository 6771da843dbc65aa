//! Random scenes keep the laws of mechanics, but for faults that are known.

use std::collections::BTreeSet;
use std::process::{Command, Output};

use laws::KNOWN;
use tempfile::TempDir;

fn random(folder: &TempDir, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_evaluate"));
    command.arg("random").args(arguments).current_dir(folder).output().expect("the program runs")
}

/// Scene and law of each line that tells of a broken law.
fn broken(text: &str) -> BTreeSet<(u64, String)> {
    let of = |line: &str| {
        let (_, rest) = line.split_once(", scene ")?;
        let (scene, rest) = rest.split_once(": ")?;
        let (law, _) = rest.split_once(" is broken")?;
        Some((scene.parse().ok()?, law.to_owned()))
    };
    text.lines().filter_map(of).collect()
}

#[test]
fn a_hundred_random_scenes_break_no_law_but_as_is_known() {
    let folder = TempDir::new().expect("a folder");
    let output = random(&folder, &["--count", "100", "--seed", "1", "--out", "out"]);
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    let known: BTreeSet<_> =
        KNOWN.iter().flat_map(|known| known.scenes.iter().map(|scene| (*scene, known.law.to_string()))).collect();
    assert_eq!(broken(&text), known, "{text}");
    assert_eq!(output.status.code(), Some(if known.is_empty() { 0 } else { 1 }), "{text}");
    assert!(text.contains("formulation newton") && text.contains("Scenes that break a law"), "{text}");
    for (scene, law) in known {
        assert!(folder.path().join(format!("out/1-{scene}-{law}.toml")).is_file(), "{scene}, {law}");
    }
}

#[test]
fn one_scene_is_drawn_again_by_itself() {
    let folder = TempDir::new().expect("a folder");
    for _ in 0..2 {
        let output = random(&folder, &["--seed", "3", "--only", "5", "--out", "out", "--quiet"]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
        let drawn = std::fs::read_to_string(folder.path().join("out/3-5-drawn.toml")).expect("the scene");
        assert_eq!(drawn, laws::draw(3, 5).file());
    }
    let wrong = random(&folder, &["--count", "0"]);
    assert_eq!(wrong.status.code(), Some(2));
}

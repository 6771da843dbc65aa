//! What is printed for a person: no noise, no blanks at the ends of lines, no numbers that cannot be meant.

mod common;

use common::{run, texts};

/// Standard output of a run that goes well, after a check that no line ends in a blank.
fn printed(arguments: &[&str]) -> String {
    let output = run(arguments);
    let (code, out, err) = texts(&output);
    assert_eq!((code, err), (Some(0), ""), "{arguments:?}");
    for line in out.lines() {
        assert_eq!(line, line.trim_end(), "{arguments:?}");
    }
    out.to_owned()
}

#[test]
fn energies_that_are_rounding_errors_are_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("rest.toml");
    // At rest and free: what is not 0 is rounding errors of turning and placing the rod.
    let scene = "gravity_m_s2 = [0, 0, 0]\n[[rods]]\nshape.straight = { length_m = 4, segments = 30, direction = [1, 2, 3], \
                 start_m = [0.1, 0.7, 0.3] }\n";
    std::fs::write(&path, scene).expect("a scene");
    let path = path.to_str().expect("UTF-8");
    let exact = common::json(&[path, "--steps", "50"])["energy_highest_j"].as_f64().expect("a number");
    assert!(exact > 0.0 && exact < 1e-15, "{exact}: this scene is to have noise");
    let out = printed(&[path, "--steps", "50"]);
    assert!(out.contains("energy: 0 J at the start, 0 J at the end, 0 J at its highest"), "{out}");
    let out = printed(&["static", path]);
    assert!(out.contains("energy: 0 J at the start, 0 J at rest"), "{out}");
    // What is small and meant stays.
    std::fs::write(path, scene.replace("[0, 0, 0]", "[0, 0, -1e-4]")).expect("a scene");
    let out = printed(&[path, "--steps", "50"]);
    assert!(!out.contains("J at the start, 0 J at the end"), "{out}");
}

#[test]
fn times_of_stages_are_told_where_they_are_asked_for() {
    let stages = ["drag", "predict", "guess", "assemble", "linear solve", "update"];
    let is_row = |out: &str, stage: &str| out.lines().any(|line| line.trim_start().starts_with(stage));
    let plain = printed(&["helix", "--steps", "5"]);
    assert!(!plain.contains("us a step"), "{plain}");
    let timed = printed(&["helix", "--steps", "5", "--times"]);
    assert!(timed.contains("us a step"), "{timed}");
    for stage in stages {
        assert!(is_row(&timed, stage) && !is_row(&plain, stage), "{stage}: {timed}");
    }
}

/// Of places that are near enough to touch, no more than all of them press.
#[test]
fn contacts_that_press_are_among_those_that_are_near() {
    for scene in ["helix-on-plane", "hair", "two-rods"] {
        let out = printed(&[scene, "--steps", "25"]);
        let line = out.lines().find(|line| line.starts_with("contacts: ")).expect("contacts");
        let words: Vec<&str> = line.split(' ').collect();
        let number = |word: usize| words[word].parse::<f64>().unwrap_or_else(|_| panic!("{line}"));
        assert!(number(1) > 0.0 && (0.0..=100.0).contains(&number(9)), "{line}");
        assert_eq!(words[10..12], ["%", "press"], "{line}");
    }
}

#[test]
fn a_random_scene_goes_by_the_name_that_it_was_asked_for() {
    for scene in ["random-rod", "random-helix", "random-knot", "random-tree"] {
        let out = printed(&[scene, "--steps", "1"]);
        assert!(out.starts_with(&format!("{scene}: ")) && !out.contains("sampled"), "{out}");
    }
}

#[test]
fn no_table_is_padded() {
    for arguments in [&["list"][..], &["static", "tree-10"], &["hair", "--steps", "2", "--times"]] {
        printed(arguments);
    }
}

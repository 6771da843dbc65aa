//! Starts of whole steps on the command line.
#![cfg(feature = "gn")]

mod common;

use std::fs;

use common::{builtin_names, json, nulls, run, texts};
use serde_json::Value;

/// A few small simulations.
const SMALL: [&str; 7] = ["steps", "--simulations", "2", "--steps", "12", "--dt", "0.05"];

fn median(cell: &Value, key: &str) -> f64 {
    cell[key]["median"].as_f64().unwrap_or_else(|| panic!("{key} of {cell}"))
}

#[test]
fn the_table_has_every_start_in_every_kind_of_scenes() {
    let report = json(&SMALL);
    let sheets = report["sheets"].as_array().expect("sheets");
    // Rods and helices, Table 1's and slack ones, two tolerances.
    assert_eq!(sheets.len(), 8);
    for sheet in sheets {
        let cells = sheet["cells"].as_array().expect("cells");
        let names: Vec<&str> = cells.iter().map(|cell| cell["guess"].as_str().expect("a name")).collect();
        assert_eq!(names, ["zero", "step-previous", "step-linear", "step-quadratic", "gn-step"]);
        assert_eq!(nulls(sheet, ""), [""; 0]);
        let fewest = cells[..4].iter().map(|cell| median(cell, "iteration_ratio")).fold(f64::INFINITY, f64::min);
        assert!((fewest - 1.0).abs() < 0.2 && median(&cells[0], "guess_us") == 0.0, "{sheet}");
        let network = sheet["networks"][0]["network"].as_str().expect("a network");
        assert!(network.starts_with(&format!("recipe step, scenario {}, ", sheet["scenario"].as_str().expect("one"))));
    }
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("steps.csv");
    let output = run(&[&SMALL[..], &["--scenario", "rod", "--csv", file.to_str().expect("UTF-8")]].concat());
    let (code, out, err) = texts(&output);
    assert_eq!((code, err), (Some(0), ""));
    assert!(out.contains("gn-step needs fewer outer iterations than every start without learning in"), "{out}");
    let csv = fs::read_to_string(file).expect("a file");
    let columns = csv.lines().next().expect("a header").split(',').count();
    assert_eq!(csv.lines().count(), 1 + 4 * 5);
    // The network's name stands in quotes, with commas in it.
    assert!(csv.lines().filter(|line| !line.contains('"')).all(|line| line.split(',').count() == columns));
}

#[test]
fn the_network_of_the_program_saves_outer_iterations_and_leaves_the_motion_alone() {
    for (scene, dt) in [("helix", "0.02"), ("helix", "0.05"), ("bending-rod", "0.05"), ("bending-rod", "0.1")] {
        let one = |guess: &str| {
            json(&[
                scene,
                "--formulation",
                "newton",
                "--dt",
                dt,
                "--steps",
                "60",
                "--tolerance",
                "1e-8",
                "--guess",
                guess,
            ])
        };
        let (learned, continued) = (one("gn-step"), one("step-quadratic"));
        let count = |summary: &Value, key: &str| summary["work"][key].as_u64().expect("a count");
        assert_eq!(count(&learned, "guesses_used") + count(&learned, "guesses_dropped"), 60);
        let iterations = [&learned, &continued].map(|summary| count(summary, "outer_iterations"));
        assert!(iterations[0] < iterations[1], "{scene} {dt}: {iterations:?}");
        let energy = |summary: &Value| summary["energy_end_j"].as_f64().expect("an energy");
        let (a, b) = (energy(&learned), energy(&continued));
        assert!((a - b).abs() < 1e-5 * a.abs().max(b.abs()), "{scene} {dt}: {a} {b}");
        for key in ["status", "scene"] {
            assert_eq!(learned[key], continued[key]);
        }
    }
}

/// What the start does without a network, its history and its way to a whole state, is not what saves iterations.
#[test]
fn a_network_that_says_nothing_saves_less() {
    let folder = tempfile::tempdir().expect("a folder");
    let built_in = concat!(env!("CARGO_MANIFEST_DIR"), "/../../checkpoints/helix-step");
    let mut silent = copingnet::Checkpoint::load(std::path::Path::new(built_in)).expect("a checkpoint");
    silent.weights.values_mut().fill(0.0);
    let path = folder.path().join("silent");
    silent.save(&path).expect("it is written");
    let flags = ["steps", "--simulations", "4", "--steps", "60", "--scenario", "helix", "--guess", "gn-step"];
    let iterations = |more: &[&str]| -> f64 {
        let report = json(&[&flags[..], more].concat());
        report["sheets"].as_array().expect("sheets").iter().map(|sheet| median(&sheet["cells"][1], "iterations")).sum()
    };
    let (trained, silent) = (iterations(&[]), iterations(&["--checkpoint", path.to_str().expect("UTF-8")]));
    assert!(trained < 0.95 * silent, "{trained} {silent}");
}

#[test]
fn every_scene_is_taken_and_slack_ones_are_no_strangers() {
    // The largest takes seconds.
    for scene in builtin_names().into_iter().filter(|name| *name != "long-chain") {
        let flags = [scene, "--formulation", "newton", "--guess", "gn-step", "--steps", "3"];
        let summary = json(&flags);
        let status = |summary: &Value| summary["status"].as_str().expect("text").to_owned();
        let (own, other) = (status(&summary), status(&json(&[&flags[..3], &flags[5..]].concat())));
        // Another start may need a shorter step or do without.
        assert!(own == other || (own.starts_with("converged") && other.starts_with("converged")), "{scene}: {own}");
        assert_eq!(nulls(&summary, ""), [".linear_tolerance"], "{scene}");
    }
    let says = |scene: &str| {
        let output = run(&[scene, "--formulation", "newton", "--guess", "gn-step", "--steps", "1"]);
        texts(&output).1.contains("nothing is like this scene")
    };
    assert_eq!((says("slack-rod"), says("stiff-rod")), (false, true));
}

#[test]
fn mistakes_get_one_error_that_says_what_is_allowed() {
    let cases: [(&[&str], &str); 6] = [
        (&["--guess", "gn-step"], "--guess gn-step needs --formulation newton, but the formulation is xpbd-geometric"),
        (
            &["--guess", "gn-step", "--formulation", "newton", "--end-to-end"],
            "--end-to-end needs a guess of linear solves (--guess knn, gn or gn-best), but the guess is gn-step",
        ),
        (&["steps", "--guess", "gn"], "--guess gn starts linear solves, but starts of whole steps are compared here"),
        (&["guesses", "--guess", "gn-step"], "--guess gn-step starts whole steps, but guesses of linear solves"),
        (&["steps", "--seed", "0"], "--seed 0, but it must differ from the training scenes' seed"),
        (&["steps", "--dt", "0"], "'0' for '--dt <DT>': it must be a finite number > 0"),
    ];
    for (arguments, expected) in cases {
        let output = run(arguments);
        let (code, out, err) = texts(&output);
        assert_eq!((code, out), (Some(2), ""), "{arguments:?}");
        assert!(err.contains(expected), "{arguments:?}: {err}");
    }
}

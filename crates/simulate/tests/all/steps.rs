//! Starts of whole steps on the command line.

use crate::common::{builtin_names, json, learned_from, nulls, run, texts};
use serde_json::Value;

#[test]
fn the_network_of_the_program_saves_outer_iterations_and_leaves_the_motion_alone() {
    for (scene, dt) in [("helix", "0.02"), ("helix", "0.05"), ("bending-rod", "0.05"), ("bending-rod", "0.1")] {
        let one = |guess: &str| {
            json(&[
                scene,
                "--formulation",
                "newton",
                "--tangent",
                "positive",
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

#[test]
fn every_scene_is_taken_and_slack_ones_are_no_strangers() {
    // The largest takes seconds.
    for scene in builtin_names().into_iter().filter(|name| *name != "long-chain" && learned_from(name)) {
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
    let cases: [(&[&str], &str); 2] = [
        (
            &["--guess", "gn-step", "--formulation", "xpbd"],
            "--guess gn-step needs --formulation newton, but the formulation is xpbd",
        ),
        (
            &["--guess", "gn-step", "--formulation", "newton", "--end-to-end"],
            "--end-to-end needs a guess of linear solves (--guess knn, gn or gn-best), but the guess is gn-step",
        ),
    ];
    for (arguments, expected) in cases {
        let output = run(arguments);
        let (code, out, err) = texts(&output);
        assert_eq!((code, out), (Some(2), ""), "{arguments:?}");
        assert!(err.contains(expected), "{arguments:?}: {err}");
    }
}

//! Learned guesses on the command line: the data set on first use, starts, end to end.

use std::fs;

use crate::common::{json, nulls, run, texts};
use serde_json::Value;

/// All in one, so that the data set is made once.
#[test]
fn nearest_neighbours_from_the_first_use_on() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let data = path("data");
    let with_data = |arguments: &[&str]| [arguments, &["--data", &data]].concat().join(" ");
    let words = |text: &str| text.split(' ').map(str::to_owned).collect::<Vec<_>>();
    let out = |arguments: &[&str]| {
        let all = words(&with_data(arguments));
        let output = run(&all.iter().map(String::as_str).collect::<Vec<_>>());
        let (code, out, err) = texts(&output);
        assert_eq!((code, err), (Some(0), ""), "{arguments:?}");
        out.to_owned()
    };
    let summary = |arguments: &[&str]| {
        let all = words(&with_data(arguments));
        json(&all.iter().map(String::as_str).collect::<Vec<_>>())
    };
    let count = |summary: &Value, key: &str| summary["work"][key].as_u64().expect("a count");

    // The first use generates the data set and says so; the second does not.
    let cg = ["--guess", "knn", "--solver", "cg", "--steps", "5"];
    let first = out(&cg);
    assert!(first.starts_with("generating the paper's data set (rod) in "), "{first}");
    assert!(first.contains("generated in ") && first.contains("data points of "), "{first}");
    assert!(first.contains("solver cg-block-jacobi, guess knn\n") && !first.contains("nothing is like"), "{first}");
    assert!(!out(&cg).contains("generat"));

    // A start changes iterations, not the motion; restricted to the plane it is as good.
    let plain = summary(&["--solver", "cg", "--guess", "knn", "--linear-tolerance", "1e-9", "--steps", "5"]);
    let planar =
        summary(&["--planar", "--solver", "cg", "--guess", "knn", "--linear-tolerance", "1e-9", "--steps", "5"]);
    assert_eq!(nulls(&plain, ""), [""; 0]);
    for (summary, is_planar) in [(&plain, false), (&planar, true)] {
        assert_eq!(
            (&summary["guess"], &summary["planar"], &summary["end_to_end"]),
            (&"knn".into(), &is_planar.into(), &0.into())
        );
        assert_eq!((count(summary, "guesses_dropped"), &summary["status"]), (0, &"converged".into()));
        assert_eq!(count(summary, "guesses_used"), count(summary, "outer_iterations"));
    }

    // End to end nothing is solved, and the status is as bad as the residuals.
    let end = summary(&["--guess", "knn", "--end-to-end", "--steps", "20", "--formulation", "xpbd"]);
    assert_eq!(
        (&end["solver"], &end["end_to_end"], &end["status"]),
        (&"none".into(), &1.into(), &"out of iterations".into())
    );
    assert_eq!([count(&end, "outer_iterations"), count(&end, "not_converged"), count(&end, "guesses_used")], [20; 3]);
    assert!(end["worst_residuals"]["stretch_per_length"].as_f64().is_some_and(|worst| worst > 1e-3));
    let text = out(&["--guess", "knn", "--end-to-end=2", "--steps", "5"]);
    assert!(text.contains("solver none, guess knn, end to end with at most 2 a step"), "{text}");

    // Contacts follow the predictions.
    let touching = summary(&["two-rods", "--guess", "knn", "--end-to-end", "--steps", "60"]);
    assert_eq!(nulls(&touching, ""), [".linear_tolerance"]);
    assert!(count(&touching, "contact_solves") > 0);
    assert_eq!((&touching["status"], count(&touching, "retries")), (&"out of iterations".into(), 0));

    // A foreign scene works and says so; the data set may be chosen.
    let text = out(&["helix", "--guess", "knn", "--solver", "cg", "--steps", "2", "--scenario", "rod"]);
    assert!(text.contains("nothing is like this scene: segments = 60.0, not 10.0 to 55.0"), "{text}");

    // What is not a data set is one error.
    fs::write(folder.path().join("data/rod/manifest.toml"), "schema_version = 1\n").expect("a file");
    let output = run(&["--guess", "knn", "--solver", "cg", "--data", &data]);
    let (code, _, err) = texts(&output);
    assert_eq!(code, Some(2));
    assert!(err.starts_with("error: --data: ") && err.contains("manifest.toml"), "{err}");
}

//! The README's numbers of learned guesses are those of the report beside it.

use std::collections::HashMap;

const README: &str = include_str!("../../../../README.md");

/// Rows of a table of a page of the report, each by the names of its columns.
fn table(page: &str, name: &str) -> Vec<HashMap<String, String>> {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../report").join(page);
    let mut reader = csv::Reader::from_path(folder.join("csv").join(name)).unwrap();
    reader.deserialize().map(Result::unwrap).collect()
}

/// The README with one blank between its words.
fn readme() -> String {
    README.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Least and largest time saved [per cent] by a start, of `what`, for at least so many segments; and the most segments.
fn saved(file: &str, what: &str, start: &str, least_segments: f64) -> [f64; 3] {
    let rows = table("paper", file);
    let chart = format!("{what}: time saved");
    let number = |row: &HashMap<String, String>, key: &str| row[key].parse::<f64>().unwrap();
    let rows = rows.iter().filter(|row| row["chart"] == chart && row["series"] == start);
    let rows: Vec<_> = rows.filter(|row| number(row, "x") >= least_segments).collect();
    assert!(rows.len() > 4, "{start} in {file}");
    let fold = |key: &str, first: f64, choose: fn(f64, f64) -> f64| {
        rows.iter().map(|row| number(row, key)).fold(first, choose)
    };
    [fold("y", f64::MAX, f64::min), fold("y", f64::MIN, f64::max), fold("x", f64::MIN, f64::max)]
}

/// `gn` as it is and kept in the plane, and what it is held against: each says what it saves of the solve and of the whole.
#[test]
fn time_saved_by_learned_guesses_is_the_reports() {
    let (text, file, least) = (readme(), "performance-rod-segments-raw.csv", 30.0);
    for (series, begins) in [
        ("gn", "`gn`, the paper's network,"),
        ("gn, planar", "`gn, planar`, kept in the rod's plane,"),
        ("fischer", "Fischer's projection, which learns nothing,"),
        ("direct", "the direct solver"),
    ] {
        let [solve, whole] = ["projection", "whole simulation"].map(|what| {
            let [low, high, most] = saved(file, what, series, least);
            let range = format!("rods of {least} to {most} segments)");
            assert!(text.contains(&range), "{range}");
            match series {
                "direct" => format!("over {:.0} %", low.floor()),
                _ => format!("{low:.0} to {high:.0} %"),
            }
        });
        let said = format!("{begins} {solve} and {whole}");
        assert!(text.contains(&said), "{said}");
    }
}

#[test]
fn networks_are_beaten_where_the_readme_says_so() {
    let text = readme();
    let overview = table("solvers", "precision-overview.csv");
    let reached = overview.iter().filter(|row| row["best learned"] != "none reaches it").count();
    let said = format!(
        "of {} combinations of scene and error, conjugate gradients from a learned guess reached the error in {reached} \
         and were fastest in none",
        overview.len()
    );
    assert!(text.contains(&said), "{said}");
    let direct = overview.iter().filter(|row| row["fastest of all"].contains("direct")).count();
    assert!(2 * direct > overview.len() && text.contains("Mostly the direct solver was"), "{direct}");
}

/// Where `gn-step` needs less than 0.99 of the time of the best start without learning: nowhere is it the fastest of all.
#[test]
fn a_learned_start_of_steps_wins_where_the_readme_says_so() {
    let overview = table("solvers", "precision-overview.csv");
    let ratio = |row: &HashMap<String, String>| row["newton: time, to without learning"].parse::<f64>().ok();
    let wins: Vec<_> = overview.iter().filter(|row| ratio(row).is_some_and(|ratio| ratio < 0.99)).collect();
    let [first, second] = wins[..] else { panic!("{wins:?}") };
    assert_eq!(first["scene"], second["scene"]);
    let said = format!(
        "On `{}`, at errors of {} and {}, it takes {:.2} of the time of `newton`'s best start without learning; `xpbd` is faster still.",
        first["scene"],
        first["error"],
        second["error"],
        ratio(first).unwrap()
    );
    assert!(readme().contains(&said), "{said}");
    for row in [first, second] {
        assert_eq!(format!("{:.2}", ratio(row).unwrap()), "0.82");
        assert!(row["fastest of all"].starts_with("xpbd,"), "{}", row["fastest of all"]);
    }
    assert!(overview.iter().all(|row| !row["fastest of all"].contains("gn")));
}

//! The README's numbers of learned guesses are those of the report beside it.

use std::collections::HashMap;

const README: &str = include_str!("../../../README.md");

/// Rows of a table of the report, each by the names of its columns.
fn table(name: &str) -> Vec<HashMap<String, String>> {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../report/csv");
    let mut reader = csv::Reader::from_path(folder.join(name)).unwrap();
    reader.deserialize().map(Result::unwrap).collect()
}

/// Least and largest time saved [per cent] by a start, of `what`, for at least so many segments.
fn saved(file: &str, what: &str, start: &str, least_segments: f64) -> [f64; 2] {
    let rows = table(file);
    let chart = format!("{what}: time saved");
    let rows = rows.iter().filter(|row| row["chart"] == chart && row["series"] == start);
    let number = |row: &HashMap<String, String>, key: &str| row[key].parse::<f64>().unwrap();
    let saved: Vec<f64> = rows.filter(|row| number(row, "x") >= least_segments).map(|row| number(row, "y")).collect();
    assert!(saved.len() > 4, "{start} in {file}");
    [saved.iter().copied().fold(f64::MAX, f64::min), saved.iter().copied().fold(f64::MIN, f64::max)]
}

#[test]
fn time_saved_by_learned_guesses_is_the_reports() {
    let scenes = [("performance-rod-segments-raw.csv", 30.0), ("performance-helix-segments-raw.csv", 20.0)];
    for (series, begins) in
        [("gn", "`gn`, "), ("gn, planar", "`gn, planar`"), ("fischer", "Fischer's "), ("direct", "direct ")]
    {
        let row =
            README.lines().map(str::trim).find(|line| line.strip_prefix("| ").is_some_and(|l| l.starts_with(begins)));
        let cells: Vec<&str> = row.unwrap().split('|').map(str::trim).skip(2).take(4).collect();
        let mut columns =
            scenes.into_iter().flat_map(|scene| ["projection", "whole simulation"].map(|what| (scene, what)));
        for cell in cells {
            let ((file, least), what) = columns.next().unwrap();
            // Helices do not stay in a plane.
            if cell.is_empty() && series == "gn, planar" && file.contains("helix") {
                continue;
            }
            let [low, high] = saved(file, what, series, least);
            let expected = match series {
                "direct" => format!("over {:.0} %", low.floor()),
                _ => format!("{low:.0} to {high:.0} %"),
            };
            assert_eq!(cell, expected, "{series}, {what}, {file}");
        }
    }
}

#[test]
fn networks_are_beaten_where_the_readme_says_so() {
    let overview = table("precision-overview.csv");
    let reached = overview.iter().filter(|row| row["best learned"] != "none reaches it").count();
    let said = format!("We tested {} combinations", overview.len());
    assert!(README.contains(&said), "{said}");
    let said = format!("reached the error in {reached} and were fastest in none");
    assert!(README.replace("\n  ", " ").contains(&said), "{said}");
    assert!(overview.iter().all(|row| !row["fastest of all"].contains("gn")), "a learned guess is the fastest");
    let helix = overview.iter().find(|row| row["scene"] == "helix" && row["error"] == "1e-6").unwrap();
    let ratio: f64 = helix["newton: time, to without learning"].parse().unwrap();
    let said = format!("takes {ratio:.2} of the time of the best start without learning");
    assert!(README.replace("\n  ", " ").contains(&said), "{said}");
}

//! The checker finds each kind of planted fault.

use std::fs;
use std::path::Path;

use report::{Axis, Block, Charts, Column, Conditions, Figure, LineChart, Page, Section, Series, Table, check};

fn page() -> Page {
    let conditions = Conditions::new("revision", "abc");
    let chart = LineChart {
        x: Axis::linear("x"),
        series: vec![Series::new("a", [(1.0, 1.0), (2.0, 3.0)])],
        ..LineChart::default()
    };
    let figure = Figure {
        id: "figure".into(),
        title: "Figure".into(),
        caption: "See [](#table).".into(),
        charts: Charts::Lines(vec![chart]),
        conditions: conditions.clone(),
    };
    let table = Table {
        id: "table".into(),
        title: "Table".into(),
        caption: String::new(),
        columns: vec![Column::text("a"), Column::number("b")],
        rows: vec![vec!["c".into(), "1".into()]],
        conditions: conditions.clone(),
    };
    let blocks = vec![Block::Figure(figure), Block::Table(table)];
    let sections = vec![Section { id: "section".into(), title: "Section".into(), blocks }];
    Page { title: "Page".into(), lead: vec![], conditions, sections }
}

/// The problems of the page after `spoil` had its way with the directory.
fn problems(spoil: impl FnOnce(&Path)) -> Vec<String> {
    let directory = tempfile::tempdir().unwrap();
    page().write(directory.path()).unwrap();
    spoil(directory.path());
    check(directory.path()).unwrap()
}

/// The problems of the page after `from` was replaced by `to` in its HTML.
fn after_replacing(from: &str, to: &str) -> Vec<String> {
    problems(|directory| {
        let path = directory.join("index.html");
        let html = fs::read_to_string(&path).unwrap();
        assert!(html.contains(from), "{from:?} is not in the page");
        fs::write(path, html.replacen(from, to, 1)).unwrap();
    })
}

#[test]
fn a_whole_page_has_no_problems() {
    assert_eq!(problems(|_| ()), [""; 0]);
}

#[test]
fn faults_of_the_page_are_found() {
    let link = |address: &str| format!("<main><a href=\"{address}\">x</a>");
    let image = "<main><img src=\"//example.org/a.png\"/>";
    let cases = [
        ("</main>", "</mian>", "index.html is not well-formed"),
        ("id=\"section\"", "id=\"other\"", "\"#section\" leads nowhere: no such id"),
        ("id=\"section\"", "id=\"table\"", "the id \"table\" is used twice"),
        ("<main>", &link("csv/none.csv"), "\"csv/none.csv\" leads nowhere: no such file"),
        ("<main>", &link("../other.html"), "leads out of the page's directory"),
        ("<main>", &link("/etc/hosts"), "leads out of the page's directory"),
        ("<main>", &link("mailto:a@b"), "leads out of the page's directory"),
        ("<main>", &link("https://example.org"), "leads out of the page's directory"),
        ("<main>", &link("//example.org"), "leads out of the page's directory"),
        ("<main>", image, "\"//example.org/a.png\" leads out of the page's directory"),
        ("<main>", "<main style=\"background:url( 'https://e.org/a')\">", "a style loads"),
        ("<style>", "<style>p{background:url(//e.org/a)}", "a style loads"),
        ("<style>", "<style>@import \"a.css\";", "a style loads"),
        ("<main>", "<main><table></table>", "a table is in no figure"),
        ("<main>", "<main><svg role=\"img\" aria-label=\"x\"></svg>", "a svg is in no figure"),
        ("<main>", "<main><figure></figure>", "a figure has no id"),
        ("role=\"img\" aria-label=", "role=\"img\" title=", "a chart has no description"),
        ("csv/table.csv", "index.html", "\"table\" has no link to its CSV file"),
    ];
    for (from, to, problem) in cases {
        let found = after_replacing(from, to);
        assert!(found.iter().any(|text| text.contains(problem)), "{to:?}: {found:?}");
    }
}

#[test]
fn missing_conditions_are_found() {
    let spoil = |from: &str, to: &str| {
        problems(|directory| {
            let path = directory.join("index.html");
            let html = fs::read_to_string(&path).unwrap();
            let (head, main) = html.split_once("<main>").unwrap();
            assert!(main.contains(from));
            fs::write(&path, format!("{head}<main>{}", main.replace(from, to))).unwrap();
        })
    };
    let expected = ["\"figure\" has no conditions, or empty ones", "\"table\" has no conditions, or empty ones"];
    assert_eq!(spoil("<dt>revision</dt><dd>abc</dd>", ""), expected);
    assert_eq!(spoil("<dd>abc</dd>", "<dd> </dd>"), expected);
    assert_eq!(spoil("<dd>abc</dd>", ""), expected);
}

#[test]
fn faults_of_csv_files_are_found() {
    let spoil =
        |name: &'static str, bytes: &'static str| problems(move |dir| fs::write(dir.join(name), bytes).unwrap());
    assert_eq!(spoil("csv/table.csv", "a,b\n"), ["csv/table.csv: no rows"]);
    assert_eq!(spoil("csv/table.csv", ""), ["csv/table.csv: no rows"]);
    let ragged = spoil("csv/table.csv", "a,b\n1,2\n3\n");
    assert!(
        ragged.len() == 1 && ragged[0].starts_with("csv/table.csv: ") && ragged[0].contains("1 fields"),
        "{ragged:?}"
    );
    assert_eq!(spoil("csv/old.csv", "a\n1\n"), ["csv/old.csv: the page does not mention it"]);
    let missing = problems(|directory| fs::remove_file(directory.join("csv/figure.csv")).unwrap());
    assert_eq!(missing, ["\"csv/figure.csv\" leads nowhere: no such file"]);
}

#[test]
fn a_missing_page_is_an_error() {
    let directory = tempfile::tempdir().unwrap();
    let error = check(directory.path()).unwrap_err().to_string();
    assert!(error.contains("index.html") && error.starts_with("cannot read"), "{error}");
}

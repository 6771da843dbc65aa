//! Pages as they are written: what stands in the files, and what is refused.

use std::collections::BTreeSet;
use std::fs;

use report::{
    Axis, Bar, BarChart, Block, Cell, Charts, Column, Conditions, Figure, HeatMap, LineChart, Page, Reference, Section,
    Series, Table, check,
};
use roxmltree::{Document, ParsingOptions};

/// What has a meaning in HTML and in CSV.
const ODD: &str = "<b>&\"'</b>,\n\u{1}";
/// The same as it is read back from XML, white space apart.
const READ: &str = "<b>&\"'</b>, \u{fffd}";

fn conditions() -> Conditions {
    Conditions::new("revision", "abc").with("seeds", "0 to 9")
}

fn lines(id: &str, chart: LineChart) -> Figure {
    Figure {
        id: id.into(),
        title: id.into(),
        caption: String::new(),
        charts: Charts::Lines(vec![chart]),
        conditions: conditions(),
    }
}

fn table(id: &str) -> Table {
    Table {
        id: id.into(),
        title: "Numbers".into(),
        caption: String::new(),
        columns: vec![Column::text("name"), Column::number("value")],
        rows: vec![vec!["a".into(), "1".into()]],
        conditions: conditions(),
    }
}

fn page(blocks: Vec<Block>) -> Page {
    let sections = vec![Section { id: "first".into(), title: "First".into(), blocks }];
    Page { title: "Page".into(), lead: vec!["Lead.".into()], conditions: conditions(), sections }
}

/// Writes a page and reads its HTML and the CSV file of `id`.
fn written(page: &Page, id: &str) -> (String, String) {
    let directory = tempfile::tempdir().unwrap();
    let path = page.write(directory.path()).unwrap();
    assert_eq!(check(directory.path()).unwrap(), [""; 0]);
    let csv = fs::read_to_string(directory.path().join(format!("csv/{id}.csv"))).unwrap();
    (fs::read_to_string(path).unwrap(), csv)
}

fn parse(html: &str) -> Document<'_> {
    Document::parse_with_options(html, ParsingOptions { allow_dtd: true, ..Default::default() }).unwrap()
}

fn records(csv: &str) -> Vec<Vec<String>> {
    let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(csv.as_bytes());
    reader.records().map(|record| record.unwrap().iter().map(String::from).collect()).collect()
}

fn odd_charts() -> Vec<Charts> {
    let odd = || ODD.to_owned();
    let line = LineChart {
        title: odd(),
        x: Axis::linear(ODD),
        y: Axis::linear(ODD),
        series: vec![Series::new(ODD, [(1.0, 2.0)])],
        references: vec![Reference::Vertical { x: 1.0, label: odd() }, Reference::Horizontal { y: 1.0, label: odd() }],
        emphasis: Some(odd()),
        ..LineChart::default()
    };
    let heat = HeatMap {
        title: odd(),
        row_label: odd(),
        column_label: odd(),
        value_label: odd(),
        rows: vec![odd()],
        columns: vec![odd()],
        values: vec![vec![Some(1.0)]],
        ..HeatMap::default()
    };
    let bar = Bar { name: odd(), values: vec![1.0] };
    let bars = BarChart { title: odd(), label: odd(), parts: vec![odd()], bars: vec![bar] };
    vec![Charts::Lines(vec![line]), Charts::Heat(vec![heat]), Charts::Bars(vec![bars])]
}

#[test]
fn text_is_escaped_in_every_place() {
    let odd = || ODD.to_owned();
    let conditions = || Conditions::new(ODD, ODD);
    let mut blocks: Vec<Block> = vec![Block::Paragraph(format!("{ODD} `{ODD}` **{ODD}**"))];
    for (i, charts) in odd_charts().into_iter().enumerate() {
        let (title, caption) = (odd(), odd());
        blocks.push(Block::Figure(Figure { id: format!("f{i}"), title, caption, charts, conditions: conditions() }));
    }
    let odd_table = Table {
        title: odd(),
        caption: odd(),
        columns: vec![Column::text(ODD)],
        rows: vec![vec![Cell::strong(ODD)]],
        conditions: conditions(),
        ..table("table")
    };
    blocks.push(Block::Table(odd_table));
    let sections = vec![Section { id: "first".into(), title: odd(), blocks }];
    let page = Page { title: odd(), lead: vec![odd()], conditions: conditions(), sections };

    let (html, csv) = written(&page, "table");
    let document = parse(&html);
    assert!(!document.descendants().any(|node| node.has_tag_name("b")), "the text's own element came through");
    assert!(!html.contains("<b>"));
    // Everywhere the text is there in full: the number of places was counted by hand where it is fixed.
    let squeeze = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let whole = |tag: &str| {
        let nodes = document.descendants().filter(|node| node.has_tag_name(tag));
        let texts: Vec<String> =
            nodes.map(|node| node.descendants().filter_map(|n| n.text().filter(|_| n.is_text())).collect()).collect();
        texts.iter().filter(|text| squeeze(text).contains(READ)).count()
    };
    for (tag, count) in [("h1", 1), ("h2", 1), ("h3", 4), ("code", 1), ("strong", 1), ("dt", 5), ("dd", 5)] {
        assert_eq!(whole(tag), count, "{tag}");
    }
    assert_eq!(whole("th"), 2);
    assert_eq!(records(&csv), [[ODD], [ODD]]);
}

#[test]
fn what_cannot_be_drawn_leaves_a_gap_and_stays_in_the_csv_file() {
    let points = [
        (1.0, 1.0),
        (2.0, 0.1),
        (3.0, 0.0),
        (4.0, f64::NAN),
        (f64::INFINITY, 1.0),
        (5.0, -1.0),
        (6.0, 0.2),
        (7.0, 0.3),
    ];
    let chart = LineChart {
        x: Axis::log("x"),
        y: Axis::log("y"),
        series: vec![Series::new("a", points)],
        ..LineChart::default()
    };
    let (html, csv) = written(&page(vec![Block::Figure(lines("gap", chart))]), "gap");
    let document = parse(&html);
    let figure = document.descendants().find(|node| node.has_tag_name("figure")).unwrap();
    let chart = figure.descendants().find(|node| node.attribute("role") == Some("img")).unwrap();
    let class = |class: &'static str| chart.descendants().filter(move |node| node.attribute("class") == Some(class));
    assert_eq!(class("line").count(), 2);
    assert_eq!(class("marker").count(), 4);
    assert!(
        !chart
            .descendants()
            .flat_map(|node| node.attributes())
            .any(|a| a.value().contains("NaN") || a.value().contains("inf"))
    );
    let values: Vec<_> = records(&csv).into_iter().skip(1).map(|row| (row[2].clone(), row[3].clone())).collect();
    let expected = [
        ("1.0", "1.0"),
        ("2.0", "0.1"),
        ("3.0", "0.0"),
        ("4.0", "NaN"),
        ("inf", "1.0"),
        ("5.0", "-1.0"),
        ("6.0", "0.2"),
        ("7.0", "0.3"),
    ];
    assert_eq!(values, expected.map(|(x, y)| (x.to_owned(), y.to_owned())));
}

#[test]
fn charts_without_data_say_so() {
    let nothing = Series::new("a", [(0.0, f64::NAN)]);
    let empty = LineChart { x: Axis::log("x"), series: vec![nothing], ..LineChart::default() };
    let heat =
        HeatMap { rows: vec!["a".into()], columns: vec!["b".into()], values: vec![vec![None]], ..HeatMap::default() };
    let bars = BarChart {
        parts: vec!["a".into()],
        bars: vec![Bar { name: "b".into(), values: vec![f64::NAN] }],
        ..BarChart::default()
    };
    for charts in [Charts::Lines(vec![empty]), Charts::Heat(vec![heat]), Charts::Bars(vec![bars])] {
        let figure = Figure { charts, ..lines("empty", LineChart::default()) };
        assert!(figure.svg().contains("no data"));
        assert!(written(&page(vec![Block::Figure(figure)]), "empty").0.contains("no data"));
    }
}

#[test]
fn a_single_point_has_axes_about_it() {
    for axis in [Axis::linear("x"), Axis::log("x")] {
        let chart = LineChart {
            x: axis.clone(),
            y: axis,
            series: vec![Series::new("a", [(3.0, 3.0)])],
            ..LineChart::default()
        };
        let svg = lines("one", chart).svg();
        assert!(!svg.contains("no data") && !svg.contains("NaN") && svg.contains("class=\"marker\""), "{svg}");
    }
}

#[test]
fn drawings_are_well_formed_and_stand_alone() {
    let many = |i: i32| Series::new(format!("series {i}"), (1..=12).map(|k| (f64::from(k * i), f64::from(k).powi(-i))));
    let many = LineChart {
        x: Axis::log("x"),
        y: Axis::log("y"),
        series: (1..=25).map(many).collect(),
        ..LineChart::default()
    };
    let several = Charts::Lines(vec![many.clone(), LineChart::default(), many.clone()]);
    for charts in odd_charts().into_iter().chain([Charts::Lines(vec![many]), several, Charts::Heat(vec![])]) {
        let svg = Figure { charts, ..lines("a", LineChart::default()) }.svg();
        let document = Document::parse(&svg).unwrap();
        let root = document.root_element();
        assert_eq!(root.tag_name().namespace(), Some("http://www.w3.org/2000/svg"));
        assert_eq!((root.attribute("role"), root.attribute("aria-label")), (Some("img"), Some("a")));
        assert!(svg.contains("seeds: 0 to 9") && !svg.contains("var("));
    }
}

#[test]
fn a_name_has_one_colour_throughout_a_page() {
    let chart = |names: &[&str]| LineChart {
        series: names.iter().map(|name| Series::new(*name, [(1.0, 1.0)])).collect(),
        ..LineChart::default()
    };
    let mut keyed = chart(&["other"]);
    keyed.series[0].colour = Some("b".into());
    let figures = [chart(&["a", "b"]), chart(&["c", "b"]), keyed];
    let blocks =
        figures.into_iter().enumerate().map(|(i, chart)| Block::Figure(lines(&format!("f{i}"), chart))).collect();
    let (html, _) = written(&page(blocks), "f0");
    let document = parse(&html);
    let groups =
        document.descendants().filter_map(|node| node.attribute("class")).filter(|class| class.starts_with("series"));
    assert_eq!(groups.collect::<Vec<_>>(), ["series s0", "series s1", "series s2", "series s1", "series s1"]);
}

#[test]
fn the_same_page_has_the_same_bytes() {
    let blocks = odd_charts()
        .into_iter()
        .enumerate()
        .map(|(i, charts)| Block::Figure(Figure { charts, ..lines(&format!("f{i}"), LineChart::default()) }));
    let page = page(blocks.collect());
    assert_eq!(written(&page, "f0"), written(&page.clone(), "f0"));
    assert_eq!(
        written(&page, "f1").1,
        "chart,row,column,value,quantity\n".to_owned() + &format!("{0},{0},{0},1.0,{0}\n", "\"<b>&\"\"'</b>,\n\u{1}\"")
    );
}

#[test]
fn heat_maps_print_their_numbers() {
    let map = HeatMap {
        rows: vec!["a".into(), "b".into()],
        columns: vec!["c".into(), "d".into()],
        values: vec![vec![Some(0.5), Some(2.0)], vec![Some(f64::NAN), None]],
        centre: Some(1.0),
        ..HeatMap::default()
    };
    let figure = Figure { charts: Charts::Heat(vec![map]), ..lines("map", LineChart::default()) };
    let (html, csv) = written(&page(vec![Block::Figure(figure)]), "map");
    let document = parse(&html);
    let cells =
        document.descendants().filter(|node| node.attribute("class").is_some_and(|class| class.starts_with("cell")));
    let cells: Vec<_> =
        cells.map(|node| (node.attribute("class").unwrap(), node.attribute("fill-opacity").unwrap())).collect();
    // Two is twice as far from one as a half is; what is no number has no colour, nor has nothing.
    assert_eq!(cells, [("cell low", "0.5"), ("cell high", "1"), ("cell missing", "1"), ("cell missing", "1")]);
    let texts: Vec<_> =
        document.descendants().filter(|node| node.has_tag_name("text")).filter_map(|node| node.text()).collect();
    assert!(["0.500", "2.00", "NaN", "–"].iter().all(|text| texts.contains(text)), "{texts:?}");
    assert_eq!(records(&csv)[3..], [["", "b", "c", "NaN", ""], ["", "b", "d", "", ""]]);
}

#[test]
fn what_does_not_fit_is_refused_before_anything_is_written() {
    let refused = |page: Page| {
        let directory = tempfile::tempdir().unwrap();
        let error = page.write(&directory.path().join("new")).unwrap_err();
        assert!(!directory.path().join("new").exists());
        error.to_string()
    };
    for id in ["", "A", "a b", "../a", "1a", "contents/", "é", &"a".repeat(81)] {
        let error = refused(page(vec![Block::Table(table(id))]));
        assert!(error.contains("an id has a to z"), "{id}: {error}");
    }
    for id in ["first", "contents", "b"] {
        let error = refused(page(vec![Block::Table(table("b")), Block::Table(table(id))]));
        assert!(error.contains("more than one"), "{id}: {error}");
    }
    let empty = Table { conditions: conditions().with("machine", " "), ..table("a") };
    let error = refused(page(vec![Block::Table(empty)]));
    assert!(error.starts_with("\"a\": the condition \"machine\" has the value \" \""), "{error}");
    let ragged = Table { rows: vec![vec!["a".into()]], ..table("a") };
    assert_eq!(refused(page(vec![Block::Table(ragged)])), "\"a\": row 1 has 1 entries instead of 2");
    let heat = HeatMap { rows: vec!["a".into()], ..HeatMap::default() };
    let bars = BarChart {
        parts: vec!["a".into()],
        bars: vec![Bar { name: "b".into(), values: vec![] }],
        ..BarChart::default()
    };
    for (charts, what) in [(Charts::Heat(vec![heat]), "values"), (Charts::Bars(vec![bars]), "bar \"b\"")] {
        let figure = Figure { charts, ..lines("a", LineChart::default()) };
        let error = refused(page(vec![Block::Figure(figure)]));
        assert_eq!(error, format!("\"a\": {what} has 0 entries instead of 1"));
    }
}

/// Colours of the page and of its charts come from one list.
#[test]
fn every_colour_of_the_styles_is_there_and_is_used() {
    let (html, _) = written(&page(vec![Block::Table(table("a"))]), "a");
    let names = |start: &str, end: char| -> BTreeSet<String> {
        html.split(start).skip(1).filter_map(|rest| Some(rest.split_once(end)?.0.to_owned())).collect()
    };
    let used = names("var(--", ')');
    let defined: BTreeSet<String> = names("--", ':').into_iter().filter(|name| !name.contains(')')).collect();
    assert_eq!(used, defined);
    assert!(used.contains("s9"));
}

#[test]
fn links_read_as_numbers() {
    let blocks =
        vec![Block::Paragraph("See [](#b) and [](#a).".into()), Block::Table(table("a")), Block::Table(table("b"))];
    let (html, _) = written(&page(blocks), "a");
    assert!(html.contains("<p>See <a href=\"#b\">Table 2</a> and <a href=\"#a\">Table 1</a>.</p>"));
}

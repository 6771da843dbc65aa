//! A page with every kind of block, from made-up numbers: `cargo run -p report --example sample -- out`.

use std::error::Error;
use std::path::Path;

use report::{
    Aspect, Axis, Bar, BarChart, Block, Cell, Charts, ColourScale, Column, Conditions, Details, Figure, HeatMap,
    LineChart, LineStyle, NumberFormat, Page, Point, Reference, Scale, Section, Series, Table,
};

const SOLVERS: [&str; 4] = ["direct", "sparse", "cg, Jacobi", "cg, block Cholesky"];
const GUESSES: [&str; 5] = ["zero", "last step", "nearest neighbour", "network", "network, whole step"];

fn main() -> Result<(), Box<dyn Error>> {
    let directory = std::env::args().nth(1).unwrap_or("sample".into());
    let directory = Path::new(&directory);
    let path = page().write(directory)?;
    println!("{}", path.display());
    report::check(directory)?.iter().for_each(|problem| println!("{problem}"));
    for figure in [error_time(), scenes(), ratios(), stages()] {
        std::fs::write(directory.join(format!("{}.svg", figure.id)), figure.svg()?)?;
    }
    Ok(())
}

fn conditions() -> Conditions {
    Conditions::new("revision", "0123abc")
        .with("machine", "two cores of a made-up processor at 3 GHz")
        .with("numbers", "made up, to show the form of a page")
}

fn page() -> Page {
    let text = "A page of **made-up numbers**. Solvers are compared at equal error, see [](#error-time); costs are in \
                [](#costs). The command was `sample`.";
    let folded = Details { summary: "All measurements (60 rows)".into(), blocks: vec![Block::Table(measurements())] };
    Page {
        title: "Made-up evidence: error against time, costs and shapes".into(),
        lead: vec![text.into(), "Each figure and table names its conditions and has a CSV file.".into()],
        conditions: conditions(),
        sections: vec![
            Section {
                id: "comparison".into(),
                title: "Error against run time".into(),
                blocks: vec![
                    Block::Paragraph("Lower left is better. Times are medians of five runs.".into()),
                    Block::Figure(error_time()),
                    Block::Figure(scenes()),
                    Block::Table(table()),
                    Block::Details(folded),
                ],
            },
            Section {
                id: "more".into(),
                title: "Generalisation, cost and shape".into(),
                blocks: vec![
                    Block::Figure(training()),
                    Block::Figure(ratios()),
                    Block::Figure(stages()),
                    Block::Figure(shapes()),
                ],
            },
        ],
    }
}

/// Twenty curves: a colour for each solver, a marker for each guess.
fn error_time() -> Figure {
    let mut chart = curves(1.0, true);
    chart.references.push(Reference::Horizontal { y: 1e-3, label: "error compared at".into() });
    chart.emphasis = Some("on the Pareto front".into());
    Figure {
        id: "error-time".into(),
        title: "Error against run time, cantilever".into(),
        caption: "Each curve is one solver and one guess, its points tolerances from 10⁻¹ to 10⁻¹². Dashed: a learned \
                  guess. Below `1e-9`, the reference's own error hides the curve's."
            .into(),
        charts: chart.into(),
        conditions: conditions().with("time", "includes inference, features and guards; median of 5"),
    }
}

fn scenes() -> Figure {
    let names = ["cantilever", "helix under its weight", "tree in the wind", "knot"];
    let chart = |(i, name): (usize, &&str)| LineChart { title: name.to_string(), ..curves(1.0 + i as f64, i % 2 == 0) };
    Figure {
        id: "error-time-scenes".into(),
        title: "The same for four scenes".into(),
        caption: "A colour is the same solver in all charts.".into(),
        charts: Charts::Lines(names.iter().enumerate().map(chart).collect()),
        conditions: conditions().with("seeds", "0 to 9"),
    }
}

fn curves(weight: f64, all: bool) -> LineChart {
    let mut series = Vec::new();
    for (s, solver) in SOLVERS.iter().enumerate() {
        for (g, guess) in GUESSES.iter().enumerate().filter(|(g, _)| all || *g < 2) {
            let point = |k: u32| {
                let error = 10f64.powi(-(k as i32)) * (1.0 + 0.3 * ((7 * k + g as u32) % 5) as f64);
                let effort = 1.0 + 0.4 * s as f64 + (0.3 + 0.2 * s as f64) * f64::from(k) * (1.0 - 0.12 * g as f64);
                let note = format!("tolerance 1e-{k}");
                let emphasis = s == 0 && g == 3 && k % 3 == 1;
                Point { x: 0.02 * weight * effort, y: error.max(1e-9), band: None, emphasis, note }
            };
            series.push(Series {
                style: if g < 3 { LineStyle::Solid } else { LineStyle::Dashed },
                colour: Some(solver.to_string()),
                marker: Some(guess.to_string()),
                ..Series::new(format!("{solver}; {guess}"), (1..=12).map(point))
            });
        }
    }
    let (x, y) = (Axis::log("time per step [ms]"), Axis::log("relative error of positions [1]"));
    LineChart { x, y, series, ..LineChart::default() }
}

fn table() -> Table {
    let row = |(i, scene): (usize, &&str)| {
        let ratio = 0.8 + 0.15 * i as f64;
        let cell = format!("{ratio:.2}");
        let best = if ratio < 1.0 { Cell::strong(cell) } else { cell.into() };
        vec![
            Cell::from(*scene),
            "sparse, last step".into(),
            format!("{:.3}", 0.2 * ratio).into(),
            best,
            Cell::muted("–"),
        ]
    };
    Table {
        id: "ratios-table".into(),
        title: "Time at equal error, as a ratio to the strongest rival".into(),
        caption: "Below 1 the network wins; bold where it does.".into(),
        columns: vec![
            Column::text("scene"),
            Column::text("strongest rival"),
            Column::number("time per step [ms]"),
            Column::number("ratio"),
            Column::number("the paper says"),
        ],
        rows: ["cantilever", "helix", "tree in the wind", "knot"].iter().enumerate().map(row).collect(),
        conditions: conditions().with("error compared at", "1e-3"),
    }
}

fn measurements() -> Table {
    let row = |i: usize| {
        let numbers = [10.0 / (1.0 + i as f64), 0.1 * i as f64, 3.0 + i as f64];
        let names = [SOLVERS[i % 4], GUESSES[i % 5]].map(Cell::from);
        let numbers = numbers.map(|value| Cell::from(NumberFormat::Significant(3).format(value)));
        names.into_iter().chain(numbers).collect()
    };
    let names = ["guess", "error [1]", "time [ms]", "iterations"].map(Column::number);
    Table {
        id: "measurements".into(),
        title: "All measurements".into(),
        caption: String::new(),
        columns: [Column::text("solver")].into_iter().chain(names).collect(),
        rows: (0..60).map(row).collect(),
        conditions: conditions(),
    }
}

/// Bands of quartiles, reference lines, stairs, and a chart without data.
fn training() -> Figure {
    let band = |name: &str, gain: f64| {
        let point = |k: u32| {
            let y = 1.0 - gain * (1.0 - (-0.3 * f64::from(k)).exp()) + 0.02 * f64::from(k);
            Point { x: f64::from(k) * 10.0, y, band: Some([0.9 * y, 1.15 * y]), ..Point::default() }
        };
        Series::new(name, (1..=12).map(point))
    };
    let stairs = Series {
        style: LineStyle::Step,
        markers: false,
        ..Series::new("best so far", (0..30).map(|i| (f64::from(i), 1.0 / f64::from(1 + i))))
    };
    let points = Series {
        style: LineStyle::Points,
        ..Series::new("each run", (0..30).map(|i| (f64::from(i), 1.0 / f64::from(1 + i % 7))))
    };
    let references = vec![
        Reference::Horizontal { y: 1.0, label: "zero start = 1".into() },
        Reference::Vertical { x: 60.0, label: "training range".into() },
    ];
    let lengths = LineChart {
        title: "Longer rods than trained on".into(),
        x: Axis::linear("segments"),
        y: Axis::linear("iterations, ratio to the zero start"),
        series: vec![band("network", 0.6), band("nearest neighbour", 0.35)],
        references,
        ..LineChart::default()
    };
    let runs = LineChart {
        title: "Runs".into(),
        x: Axis::linear("run"),
        y: Axis::log("loss"),
        series: vec![stairs, points],
        ..LineChart::default()
    };
    let empty =
        LineChart { title: "Not measured".into(), x: Axis::linear("x"), y: Axis::log("y"), ..LineChart::default() };
    Figure {
        id: "training".into(),
        title: "Lengths and runs".into(),
        caption: "Bands are quartiles.".into(),
        charts: Charts::Lines(vec![lengths, runs, empty]),
        conditions: conditions(),
    }
}

fn ratios() -> Figure {
    let value = |i: usize, j: usize| (i + j != 6).then(|| 2f64.powf(0.5 * i as f64 - 0.35 * j as f64));
    let map = |title: &str, colours| HeatMap {
        title: title.into(),
        row_label: "rods".into(),
        column_label: "segments".into(),
        value_label: "time, ratio to the direct solver".into(),
        rows: ["1", "8", "64", "512"].map(String::from).to_vec(),
        columns: ["10", "20", "50", "100", "200"].map(String::from).to_vec(),
        values: (0..4).map(|i| (0..5).map(|j| value(i, j)).collect()).collect(),
        format: NumberFormat::Fixed(2),
        scale: Scale::Log,
        colours,
    };
    Figure {
        id: "ratios".into(),
        title: "Ratios by size".into(),
        caption: "Blue is faster than the direct solver, orange is slower.".into(),
        charts: Charts::Heat(vec![
            map("About 1", ColourScale::Diverging { centre: 1.0 }),
            map("From the smallest", ColourScale::Sequential),
        ]),
        conditions: conditions(),
    }
}

fn stages() -> Figure {
    let bar = |(i, name): (usize, &&str)| Bar {
        name: name.to_string(),
        values: vec![0.1, 0.2 + 0.1 * i as f64, 0.05 * i as f64, 0.3, 0.12],
    };
    let chart = BarChart {
        title: String::new(),
        label: "time per step [ms]".into(),
        parts: ["predict", "evaluate", "guess", "solve", "update"].map(String::from).to_vec(),
        bars: ["cantilever", "helix under its weight", "tree in the wind", "knot"]
            .iter()
            .enumerate()
            .map(bar)
            .collect(),
    };
    Figure {
        id: "costs".into(),
        title: "Cost of each stage".into(),
        caption: "At the end of each bar is its sum.".into(),
        charts: chart.into(),
        conditions: conditions(),
    }
}

/// Planar shapes with equal scales.
fn shapes() -> Figure {
    let rod = |k: u32| {
        let bend = 0.4 * f64::from(k);
        let point = |i: u32| {
            let s = f64::from(i) / 40.0;
            (s * (1.0 - 0.05 * bend * bend * s), -bend * s * s / 2.0)
        };
        Series { markers: false, ..Series::new(format!("t = {:.1} s", 0.2 * f64::from(k)), (0..=40).map(point)) }
    };
    let (x, y) = (Axis::linear("x [m]"), Axis::linear("z [m]"));
    let chart = LineChart { x, y, series: (0..5).map(rod).collect(), aspect: Aspect::Equal, ..LineChart::default() };
    Figure {
        id: "shapes".into(),
        title: "A cantilever falls".into(),
        caption: "Centrelines, the scales of both axes equal.".into(),
        charts: chart.into(),
        conditions: conditions(),
    }
}

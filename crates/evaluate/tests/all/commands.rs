//! What a user measures by hand: tables on the terminal and in files, and mistakes.

use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use copingnet::Checkpoint;
use tempfile::TempDir;

/// Runs `evaluate` with these arguments in a folder.
fn evaluate(folder: &TempDir, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_evaluate")).args(arguments).current_dir(folder).output().expect("the program runs")
}

/// What a run that goes well prints; its files are in `out`.
fn measured(folder: &TempDir, arguments: &[&str]) -> String {
    let output = evaluate(folder, &[arguments, &["--out", "out"]].concat());
    assert!(output.status.success() && output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    assert!(
        !text.contains("NaN") && !text.contains("inf") && text.lines().all(|line| line == line.trim_end()),
        "{text}"
    );
    text
}

/// The rows of a table that was written, by the names of its columns.
fn table(folder: &TempDir, id: &str) -> Vec<BTreeMap<String, String>> {
    let page =
        [("cables", "equilibria/csv"), ("branched", "branched/csv")].into_iter().find(|(name, _)| id.starts_with(name));
    let file = folder.path().join("out").join(page.map_or("csv", |(_, page)| page));
    let file = file.join(format!("{id}.csv"));
    let mut reader = csv::Reader::from_path(&file).unwrap_or_else(|error| panic!("{id}: {error}"));
    reader.deserialize().collect::<Result<_, _>>().expect("rows")
}

fn column<'a>(rows: &'a [BTreeMap<String, String>], name: &str) -> Vec<&'a str> {
    rows.iter().map(|row| row.get(name).unwrap_or_else(|| panic!("{name} of {row:?}")).as_str()).collect()
}

/// Median of a cell, with quartiles or without.
fn median(row: &BTreeMap<String, String>, column: &str) -> f64 {
    row[column].split(' ').next().and_then(|text| text.parse().ok()).unwrap_or_else(|| panic!("{column} of {row:?}"))
}

/// A network of the program with all weights multiplied by `scale`.
fn scaled(folder: &TempDir, name: &str, scale: f32) -> String {
    let built_in = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../checkpoints").join(name);
    let mut network = Checkpoint::load(&built_in).expect("a checkpoint");
    network.weights.values_mut().iter_mut().for_each(|value| *value *= scale);
    network.save(&folder.path().join("scaled")).expect("it is written");
    folder.path().join("scaled").to_str().expect("UTF-8").to_owned()
}

/// The hash in the card of a network of the program.
fn weights(name: &str) -> String {
    let card = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../checkpoints/{name}.toml"));
    let card = fs::read_to_string(card).expect("a card");
    let (_, rest) = card.split_once("weights_blake3 = \"").expect("a hash");
    rest[..64].to_owned()
}

#[test]
fn a_comparison_shows_every_way_and_start() {
    let folder = TempDir::new().expect("a folder");
    let text = measured(&folder, &["compare", "helix", "--steps", "3", "--with", "gn,gn-best", "--scenario", "rod"]);
    assert!(text.contains("after the first 2 steps"), "{text}");
    let foreign =
        "gn, gn-best learned from random scenes (rod), where nothing is like this scene: segments = 60.0, not";
    assert!(text.contains(foreign), "{text}");
    let ways = table(&folder, "compare-runs");
    for way in ["xpbd, direct", "newton, direct, step-quadratic", "xpbd, cg block-jacobi, frozen"] {
        assert!(column(&ways, "way").contains(&way), "{way}");
    }
    // In a plane those that know nothing of it stand twice.
    let text = measured(&folder, &["compare", "--steps", "3", "--with", "gn,gn-best,fischer-2"]);
    assert!(!text.contains("nothing is like"), "{text}");
    let ways = table(&folder, "compare-runs");
    let starts = table(&folder, "compare-starts");
    for name in ["fischer-2", "gn", "gn, planar", "gn-best"] {
        assert!(column(&ways, "way").contains(&format!("xpbd, cg raw, {name}").as_str()), "{name}");
        assert!(column(&starts, "guess").contains(&name), "{name}");
    }
    assert!(!column(&starts, "guess").contains(&"gn-best, planar"));
    let page = fs::read_to_string(folder.path().join("out/index.html")).expect("a page");
    assert!(page.contains(&weights("rod-paper")) && page.contains(&weights("rod-best")));
    // A network out of its mind.
    let wild = scaled(&folder, "rod-best", 1e30);
    let text = measured(&folder, &["compare", "--steps", "3", "--with", "gn-best", "--checkpoint", &wild]);
    assert!(text.contains("would show: gn-best 9 of 9\n"), "{text}");
}

/// What a scene lacks takes no time and no column; errors mean something up to the first contact.
#[test]
fn a_comparison_shows_where_contacts_begin() {
    let folder = TempDir::new().expect("a folder");
    let text = measured(&folder, &["compare", "net", "--steps", "2"]);
    assert!(!text.contains("Contacts from"), "{text}");
    let ways = table(&folder, "compare-runs");
    assert!(!ways[0].contains_key("contact [us]") && !ways[0].contains_key("drag [us]"));
    let text = measured(&folder, &["compare", "helix-on-plane", "--steps", "11"]);
    let (_, after) = text.split_once("Contacts from step ").expect("contacts");
    let first: usize = after.split(' ').next().and_then(|step| step.parse().ok()).expect("a step");
    assert!((2..=11).contains(&first), "{first}");
    let ways = table(&folder, "compare-runs");
    assert!(column(&ways, "contact [us]").iter().all(|us| us.parse::<f64>().is_ok_and(|us| us > 0.0)), "{ways:?}");
}

/// Rows come as they are done, and are kept; Euler's rule brakes the pendulum, and the program says so.
#[test]
fn experiments_are_held_against_their_known_results() {
    let folder = TempDir::new().expect("a folder");
    let cheap = "catenary,pendulum,two-ropes";
    let text = measured(&folder, &["benchmark", "--only", cheap]);
    assert!(text.lines().any(|line| line.starts_with("pendulum        period [s]")), "{text}");
    assert!(text.ends_with("9 of 9 quantities within what is allowed\n"), "{text}");
    let rows = table(&folder, "benchmark-results");
    let names: Vec<_> = column(&rows, "experiment").into_iter().filter(|name| !name.is_empty()).collect();
    assert_eq!(names, cheap.split(',').collect::<Vec<_>>());
    assert!(column(&rows, "verdict").iter().all(|verdict| *verdict == "right"), "{rows:?}");
    assert!(column(&rows, "status").iter().all(|status| status.starts_with("converged")), "{rows:?}");
    let flags = ["benchmark", "--only", "pendulum", "--integrator", "euler", "--out", "out"];
    let output = evaluate(&folder, &flags);
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!((output.status.code(), &*error), (Some(1), "error: not right: pendulum\n"));
    let rows = table(&folder, "benchmark-results");
    let energy = rows.iter().find(|row| row["quantity"].starts_with("energy")).expect("the energy");
    assert_eq!(energy["verdict"], "off");
}

#[test]
fn the_stability_table_runs_some_cases() {
    let folder = TempDir::new().expect("a folder");
    measured(&folder, &["stress", "--only", "modulus 1e1", "--formulation", "xpbd,newton"]);
    let rows = table(&folder, "stability-cases");
    assert_eq!(column(&rows, "formulation"), ["xpbd", "newton"].repeat(3));
    assert!(column(&rows, "status").iter().all(|status| *status == "converged"));
    measured(&folder, &["stress", "--only", "modulus 1e10", "--formulation", "xpbd", "--integrator", "bdf2"]);
    let rows = table(&folder, "stability-cases");
    assert_eq!((column(&rows, "status"), rows.len()), (vec!["converged"], 1));
}

/// All in one, so that the data set is made once.
#[test]
fn guesses_are_measured_on_random_scenes_by_step() {
    let folder = TempDir::new().expect("a folder");
    let guesses = "previous,linear,quadratic,fischer,frozen,knn";
    let flags = ["guesses", "--scenario", "rod", "--simulations", "2", "--steps", "62", "--guess", guesses];
    let text = measured(&folder, &flags);
    assert!(text.contains("rod, 2 simulations, step 3: iterations"), "{text}");
    // Six buckets, eight guesses (knn twice) and the zero start, nine columns.
    for bucket in 0..6 {
        let rows = table(&folder, &format!("guesses-rod-{bucket}-iterations"));
        assert_eq!((rows.len(), rows[0].len()), (8, 10), "{rows:?}");
        let rows = table(&folder, &format!("guesses-rod-{bucket}-time"));
        assert_eq!((column(&rows, "guess")[0], column(&rows, "guess")[8]), ("zero", "direct solve"));
        assert!(median(&rows[8], "jacobi 1e-2") > 0.0);
    }
    let of = |name: &str, bucket: usize| {
        let rows = table(&folder, &format!("guesses-rod-{bucket}-iterations"));
        let row = rows.iter().find(|row| row["guess"] == name).unwrap_or_else(|| panic!("{name} of {rows:?}"));
        median(row, "jacobi 1e-2")
    };
    assert_eq!(of("fischer", 0), 100.0);
    assert!(of("fischer", 4) < 20.0 && of("knn, planar", 1) > 10.0);
    let text = measured(&folder, &["guesses", "--simulations", "1", "--steps", "4", "--guess", "fischer,gn,gn-best"]);
    assert!(text.lines().all(|line| line.chars().count() <= 120), "{text}");
    assert!(!text.contains("after the impulse:") && !text.contains("dropped"), "{text}");
    let names = |scenario: &str| {
        let rows = table(&folder, &format!("guesses-{scenario}-0-iterations"));
        column(&rows, "guess").join("; ")
    };
    assert_eq!(names("rod"), "zero; fischer; gn; gn, planar; gn-best");
    assert_eq!(names("helix"), "zero; fischer; gn; gn-best");
    let page = fs::read_to_string(folder.path().join("out/index.html")).expect("a page");
    assert!(["rod-paper", "rod-best", "helix-paper", "helix-best"].iter().all(|name| page.contains(&weights(name))));
    measured(&folder, &["compare", "--steps", "3", "--with", "knn"]);
    assert!(column(&table(&folder, "compare-runs"), "way").contains(&"xpbd, cg jacobi, knn, planar"));
    // What the command before wrote into the folder is gone.
    assert!(!folder.path().join("out/csv/guesses-rod-0-iterations.csv").exists());
    // A network out of its mind.
    let wild = scaled(&folder, "rod-best", 1e30);
    let flags = ["guesses", "--scenario", "rod", "--simulations", "1", "--steps", "2", "--guess", "gn-best"];
    let text = measured(&folder, &[&flags[..], &["--checkpoint", &wild]].concat());
    assert!(text.contains("\nStarts dropped, since their rounding errors would show: gn-best 18 of 18\n"), "{text}");
}

/// A few small simulations.
const SMALL: [&str; 7] = ["steps", "--simulations", "2", "--steps", "12", "--dt", "0.05"];

#[test]
fn starts_of_steps_are_measured_in_every_kind_of_scenes() {
    let folder = TempDir::new().expect("a folder");
    let text = measured(&folder, &SMALL);
    assert!(text.lines().all(|line| line.chars().count() <= 120), "{text}");
    for kind in ["rod", "slack-rod", "helix", "slack-helix"] {
        let rows = table(&folder, &format!("steps-{kind}"));
        assert_eq!(rows.len(), 10);
        for (rows, tolerance) in rows.chunks(5).zip(["1e-3", "1e-6"]) {
            let names = ["zero", "step-previous", "step-linear", "step-quadratic", "gn-step"];
            assert_eq!(column(rows, "start"), names);
            assert!(rows.iter().all(|row| (row["dt [s]"].as_str(), row["tolerance"].as_str()) == ("0.05", tolerance)));
            let fewest = rows[..4].iter().map(|row| median(row, "outer %")).fold(f64::INFINITY, f64::min);
            assert!((fewest - 100.0).abs() < 20.0, "{fewest}");
            assert!(median(&rows[0], "error") < 1e-2);
            assert_eq!(median(&rows[0], "again %"), 0.0);
        }
    }
    let page = fs::read_to_string(folder.path().join("out/index.html")).expect("a page");
    assert!(page.contains("recipe step, scenario rod, ") && page.contains(&weights("helix-step")));
}

/// What the start does without a network, its history and its way to a whole state, is not what saves iterations.
#[test]
fn a_network_that_says_nothing_saves_less() {
    let folder = TempDir::new().expect("a folder");
    let silent = scaled(&folder, "helix-step", 0.0);
    let flags = ["steps", "--simulations", "4", "--steps", "60", "--scenario", "helix", "--guess", "gn-step"];
    let iterations = |more: &[&str]| -> f64 {
        measured(&folder, &[&flags[..], more].concat());
        let kinds = ["steps-helix", "steps-slack-helix"].map(|id| table(&folder, id));
        let is_asked = |row: &&BTreeMap<String, String>| row["start"] == "gn-step" && row["dt [s]"] != "0.1";
        let own: Vec<_> = kinds.iter().flatten().filter(is_asked).collect();
        assert_eq!(own.len(), 8);
        own.into_iter().map(|row| median(row, "outer")).sum()
    };
    let (trained, silent) = (iterations(&[]), iterations(&["--checkpoint", &silent]));
    assert!(trained < 0.95 * silent, "{trained} {silent}");
}

#[test]
fn mistakes_get_one_error_that_says_what_is_allowed() {
    let folder = TempDir::new().expect("a folder");
    fs::write(folder.path().join("file"), "").expect("a file");
    let rod = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../checkpoints/rod-best");
    let rod = rod.to_str().expect("UTF-8");
    let seed = "--seed 0, but it must differ from the data sets' seed: learned guesses have seen those scenes";
    let cases: [(&[&str], &str); 16] = [
        (&["compare", "--steps", "0"], "'0' for '--steps <STEPS>': it must be a whole number of at least 1"),
        (&["compare", "bend"], "there is no builtin scene `bend`"),
        (&["compare", "--with", "best"], "or a learned one: knn, gn, gn-best, gn-step"),
        (
            &["compare", "--checkpoint", "x", "--with", "knn"],
            "--checkpoint needs the guess gn, gn-best or gn-step, but asked for: knn",
        ),
        (&["compare", "--out", "file/out"], "--out: cannot create file/out"),
        (&["guesses", "--seed", "0"], seed),
        (&["steps", "--seed", "0"], seed),
        (
            &["guesses", "--simulations", "0"],
            "'0' for '--simulations <SIMULATIONS>': it must be a whole number of at least 1",
        ),
        (
            &["guesses", "--guess", "zero,step-linear"],
            "--guess step-linear starts whole steps, but guesses of linear solves are compared here",
        ),
        (&["guesses", "--data", "x", "--guess", "fischer"], "--data needs the guess knn, but asked for: fischer"),
        (
            &["guesses", "--scenario", "helix", "--guess", "gn-best", "--checkpoint", rod],
            "scenario = \"rod\", but it must be helix unless --scenario says otherwise",
        ),
        (&["steps", "--guess", "gn"], "--guess gn starts linear solves, but starts of whole steps are compared here"),
        (&["steps", "--scenario", "tree"], "--scenario tree, but starts of whole steps are compared on rod and helix"),
        (&["steps", "--dt", "0"], "'0' for '--dt <DT>': it must be a finite number > 0"),
        (&["stress", "--only", "jelly"], "--only jelly: no case's name holds this text; there are: "),
        (
            &["benchmark", "--only", "rope"],
            "--only rope: there is no such experiment; there are: catenary, cantilever, ",
        ),
    ];
    for (arguments, expected) in cases {
        let output = evaluate(&folder, arguments);
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!((output.status.code(), output.stdout.is_empty()), (Some(2), true), "{arguments:?}: {error}");
        assert!(error.starts_with("error: ") && error.contains(expected), "{arguments:?}: {error}");
    }
    let help = evaluate(&folder, &["guesses", "--help"]);
    let default = "[default: previous,linear,quadratic,fischer,frozen,knn,gn,gn-best]";
    assert!(String::from_utf8_lossy(&help.stdout).contains(default));
}

/// `evaluate ... | head -1`: the reader goes away before the first line.
#[test]
fn a_closed_pipe_is_no_panic() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_evaluate"))
        .args(["stress", "--only", "2 segments"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("it ends");
    assert_eq!((output.status.code(), output.stderr.is_empty()), (Some(0), true));
}

/// Ctrl-C: the tables of what was done so far.
#[test]
#[cfg(unix)]
fn interrupted_tables_are_printed() {
    for arguments in [&["compare", "helix", "--steps", "1000000"][..], &["stress", "--formulation", "xpbd"]] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_evaluate"))
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("it starts");
        // The first line comes when the program listens to Ctrl-C already.
        let mut stdout = BufReader::new(child.stdout.take().expect("a pipe"));
        let mut out = String::new();
        stdout.read_line(&mut out).expect("a line");
        std::thread::sleep(Duration::from_millis(200));
        let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill starts");
        stdout.read_to_string(&mut out).expect("the rest");
        let output = child.wait_with_output().expect("it ends");
        assert!(killed.success() && output.stderr.is_empty());
        assert_eq!(output.status.code(), Some(130), "{arguments:?}");
        assert!(out.lines().count() > 4 && !out.contains("NaN"), "{out}");
        assert!(
            arguments[0] != "compare" || out.contains(" of 1000000 steps: what follows is of these alone"),
            "{out}"
        );
    }
}

#[test]
fn starts_of_cables_are_compared() {
    let folder = tempfile::tempdir().unwrap();
    measured(&folder, &["cables", "--quick"]);
    let gain = table(&folder, "cables-gain");
    assert_eq!(gain.len(), 1);
    assert_eq!((gain[0]["set"].as_str(), gain[0]["rival"].contains("twists")), ("30 segments", true), "{gain:?}");
    let rows = table(&folder, "cables-1");
    let of = |start: &str, levels: &str| {
        let own = rows.iter().find(|row| row["start"] == start && row["coarse levels"] == levels);
        own.unwrap_or_else(|| panic!("no row {start}, {levels}: {rows:?}"))
    };
    let percent = |row: &BTreeMap<String, String>, column: &str| row[column].parse::<f64>().expect("a number");
    let is_continued = |row: &&BTreeMap<String, String>| row["start"].contains("continuation");
    assert!(rows.iter().all(|row| percent(row, "failed %") == 0.0 || is_continued(&row)), "{rows:?}");
    assert_eq!(rows.iter().filter(is_continued).count(), 4);
    let (sag, all) = (of("Hermite with sag", "-"), of("two curves, both twists", "11"));
    assert!(percent(all, "lowest %") > 95.0 && percent(all, "lowest %") > percent(sag, "lowest %"));
    assert!(median(all, "solves") < 0.6 * median(sag, "solves"));
    let learned = of("learned, one or two proposals", "11");
    assert!(percent(learned, "lowest %") > 95.0);
    assert!(4.0 * percent(learned, "coarse solves") < percent(all, "coarse solves"));
    let near = of("nearest of 200, k-d tree", "-");
    assert_eq!(near["solves"], of("nearest of 200, one by one", "-")["solves"]);
    let paths = table(&folder, "cables-paths");
    assert_eq!(paths.len(), 4);
    assert!(median(&paths[0], "solves") < median(&paths[2], "solves"));
}

#[test]
fn starts_of_branched_cables_are_compared() {
    let folder = tempfile::tempdir().unwrap();
    measured(&folder, &["branched", "--quick"]);
    let gain = table(&folder, "branched-gain");
    assert_eq!(gain.len(), 2);
    assert!(gain.iter().all(|row| !row["rival"].starts_with("learned")), "{gain:?}");
    let rows = table(&folder, "branched-all");
    let of = |start: &str, levels: &str| {
        let own = rows.iter().find(|row| row["start"] == start && row["coarse levels"] == levels);
        own.unwrap_or_else(|| panic!("no row {start}, {levels}: {rows:?}"))
    };
    let number = |row: &BTreeMap<String, String>, column: &str| row[column].parse::<f64>().expect("a number");
    let (learned, poses) = (of("learned, proposals: 4", "7"), of("even turns, two poses, classes: 4", "7"));
    for row in [learned, poses] {
        assert!(number(row, "lowest %") >= 90.0 && number(row, "failed %") == 0.0, "{row:?}");
    }
    assert!(3.0 * number(learned, "coarse solves") < number(poses, "coarse solves"));
    assert_eq!(rows.iter().filter(|row| row["start"].starts_with("nearest of 100,")).count(), 2);
}

//! The report as a user makes it: one section of it, small.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use tempfile::TempDir;

/// Runs `evaluate` with these arguments in a folder.
fn evaluate(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_evaluate")).args(arguments).current_dir(folder).output().expect("the program runs")
}

/// The smallest report with measured numbers.
const NEEDS: [&str; 5] = ["report", "--quick", "--only", "needs", "--quiet"];

fn error(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(2), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stderr.clone()).expect("UTF-8")
}

fn make(folder: &Path) -> String {
    let output = evaluate(folder, &NEEDS);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    fs::read_to_string(folder.join("report/accuracy/index.html")).expect("a page")
}

#[test]
fn a_report_is_whole_names_its_conditions_and_is_kept() {
    let folder = TempDir::new().expect("a folder");
    let page = make(folder.path());
    for condition in ["machine", "revision", "threads", "networks", "steps", "Measured on ", "sources BLAKE3"] {
        assert!(page.contains(condition), "no {condition}");
    }
    let checked = evaluate(folder.path(), &["check"]);
    assert!(checked.status.success(), "{}", String::from_utf8_lossy(&checked.stderr));
    // Nothing is measured twice: the same bytes, times and all.
    assert_eq!(make(folder.path()), page);
    // Measured anew, all but times is the same.
    let again = TempDir::new().expect("a folder");
    make(again.path());
    let cells = [&folder, &again].map(|folder| folder.path().join("data/report"));
    let [first, second] = [0, 1].map(|k| cells[k].to_str().expect("UTF-8"));
    let compared = evaluate(folder.path(), &["agree", first, second]);
    let text = String::from_utf8_lossy(&compared.stdout);
    assert!(compared.status.success(), "{text}{}", String::from_utf8_lossy(&compared.stderr));
    assert!(text.contains(" cells in both, 0 in one alone; 0 differences beside times"), "{text}");
    assert!(error(&evaluate(folder.path(), &["agree", first, "nowhere"])).contains("nowhere"));
}

/// Pages are written one by one: that of the sections asked for, in its folder, and no other.
#[test]
fn a_page_is_written_when_its_sections_are_asked_for() {
    let folder = TempDir::new().expect("a folder");
    make(folder.path());
    let first = fs::read(folder.path().join("report/accuracy/index.html")).expect("a page");
    let sections = ["report", "--quick", "--only", "newton,equilibria,gradients", "--quiet"];
    let output = evaluate(folder.path(), &sections);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let page = fs::read_to_string(folder.path().join("report/tangent/index.html")).expect("a page");
    for part in ["id=\"newton-left\"", "id=\"equilibria-cost\"", "id=\"gradients-ratio\"", "Measured on "] {
        assert!(page.contains(part), "no {part}");
    }
    assert!(!page.contains("networks") && !page.contains("id=\"claims\""));
    assert_eq!(fs::read(folder.path().join("report/accuracy/index.html")).expect("a page"), first);
}

/// What another section's report left goes; a file that no report wrote stays.
#[test]
fn only_what_a_report_wrote_is_removed() {
    let folder = TempDir::new().expect("a folder");
    let page = folder.path().join("report/paper");
    let is_there = |name: &str| page.join(name).exists();
    assert!(evaluate(folder.path(), &["long-term", "--quick", "--quiet", "--out", "report"]).status.success());
    assert!(is_there("csv/long-term-worst.csv") && is_there("svg/long-term-length.svg"));
    fs::write(page.join("svg/mine.svg"), "mine").expect("written");
    assert!(evaluate(folder.path(), &["ablation", "--quick", "--quiet", "--out", "report"]).status.success());
    assert!(is_there("svg/mine.svg") && is_there("csv/claims-table.csv"));
    assert!(!is_there("csv/long-term-worst.csv") && !is_there("svg/long-term-length.svg"));
}

#[test]
fn shards_make_the_report_when_all_cells_are_there() {
    let folder = TempDir::new().expect("a folder");
    let page = folder.path().join("report/accuracy/index.html");
    let shard = |text| evaluate(folder.path(), &["report", "--quick", "--only", "needs", "--shard", text]);
    let first = shard("0/2");
    assert!(first.status.success() && !page.exists());
    assert!(String::from_utf8_lossy(&first.stdout).contains("3 cells of others are not"), "{first:?}");
    assert!(shard("1/2").status.success() && page.exists());
    assert!(error(&shard("2/2")).contains("i/n"));
}

#[test]
fn faults_of_a_report_are_found() {
    let folder = TempDir::new().expect("a folder");
    make(folder.path());
    fs::remove_file(folder.path().join("report/accuracy/csv/needs-choices.csv")).expect("a file");
    let checked = evaluate(folder.path(), &["check"]);
    assert_eq!(checked.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&checked.stderr).contains("needs-choices.csv"));
    let nowhere = error(&evaluate(folder.path(), &["check", "nowhere"]));
    assert!(nowhere.contains("nowhere"), "{nowhere}");
}

#[test]
fn damaged_results_and_wrong_flags_are_one_error() {
    let folder = TempDir::new().expect("a folder");
    make(folder.path());
    let cells = folder.path().join("data/report/needs");
    let cell = fs::read_dir(cells).expect("cells").next().expect("a cell").expect("an entry").path();
    let text = fs::read_to_string(&cell).expect("text");
    fs::write(&cell, text.replace("segments = ", "segments = 1")).expect("written");
    let message = error(&evaluate(folder.path(), &NEEDS));
    let name = cell.file_name().expect("a name").to_string_lossy().into_owned();
    assert!(
        message.contains(&name) && message.contains("checksum") && message.starts_with("error: --cells"),
        "{message}"
    );
    let message = error(&evaluate(folder.path(), &["report", "--only", "nothing"]));
    assert!(message.contains("nothing") && message.contains("needs"), "{message}");
    fs::write(folder.path().join("file"), "").expect("written");
    let message = error(&evaluate(folder.path(), &["report", "--quick", "--only", "ablation", "--out", "file/report"]));
    assert!(message.contains("--out"), "{message}");
}

#[test]
fn a_section_has_a_command_of_its_own() {
    let folder = TempDir::new().expect("a folder");
    assert!(evaluate(folder.path(), &["ablation", "--quick", "--quiet"]).status.success());
    assert!(folder.path().join("out/ablation/paper/index.html").exists() && !folder.path().join("report").exists());
    assert_eq!(evaluate(folder.path(), &["ablations"]).status.code(), Some(2));
}

/// Whatever was measured before Ctrl-C is there for the next run.
#[cfg(unix)]
#[test]
fn an_interrupted_report_goes_on() {
    let folder = TempDir::new().expect("a folder");
    let arguments = ["report", "--quick", "--only", "performance", "--quiet"];
    let cells = || {
        let entries = fs::read_dir(folder.path().join("data/report/performance")).into_iter().flatten();
        entries
            .filter(|entry| entry.as_ref().is_ok_and(|entry| entry.path().extension().is_some_and(|e| e == "toml")))
            .count()
    };
    let mut first = Command::new(env!("CARGO_BIN_EXE_evaluate"))
        .args(arguments)
        .current_dir(folder.path())
        .spawn()
        .expect("the program runs");
    while cells() < 3 {
        assert!(first.try_wait().expect("a child").is_none(), "it ended before it was interrupted");
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    let killed = Command::new("kill").args(["-INT", &first.id().to_string()]).status().expect("kill starts");
    assert!(killed.success());
    assert_eq!(first.wait().expect("a child").code(), Some(130));
    let kept = cells();
    assert!(kept >= 3 && !folder.path().join("report").exists());
    assert!(evaluate(folder.path(), &arguments).status.success());
    assert!(cells() > kept && folder.path().join("report/paper/index.html").exists());
}

/// The first page quotes the others; what they do not have it says is not measured. It is made when asked for, and anew where there is one.
#[test]
fn the_first_page_quotes_the_others() {
    let folder = TempDir::new().expect("a folder");
    make(folder.path());
    let page = folder.path().join("report/index.html");
    assert!(!page.exists(), "a part of the report has no first page");
    assert!(evaluate(folder.path(), &["report", "--first-page"]).status.success());
    let first = fs::read_to_string(&page).expect("a page");
    make(folder.path());
    assert_eq!(fs::read_to_string(&page).expect("a page"), first, "it is made anew where there is one");
    let text = fs::read_to_string(&page).expect("a page");
    assert!(text.contains("not measured") && text.contains("times real time, with the direct solver"), "{text}");
    // The same number as on the page that it quotes.
    let choices = fs::read_to_string(folder.path().join("report/accuracy/csv/needs-choices.csv")).expect("a table");
    let tree = choices.lines().find(|line| line.starts_with("tree-70,newton")).expect("a row");
    let rate = tree.rsplit(',').next().expect("a number");
    assert!(text.contains(&format!(">{rate} times real time")), "{rate}");
}

//! The program: files of queries and of answers, and what is refused.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensors};
use tempfile::TempDir;

fn run(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_equilibria")).current_dir(folder).args(arguments).output().unwrap()
}

fn succeeds(folder: &Path, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// The error of a call that is refused.
fn refused(folder: &Path, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}");
    String::from_utf8(output.stderr).unwrap()
}

/// A folder with a file of queries.
fn sampled(count: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let said = succeeds(folder.path(), &["sample", "--count", count, "--seed", "4", "--out", "queries.csv"]);
    assert!(said.contains("queries.csv"), "{said}");
    folder
}

fn lines(folder: &Path, file: &str) -> Vec<Vec<String>> {
    let mut reader = csv::ReaderBuilder::new().has_headers(false).from_path(folder.join(file)).unwrap();
    reader.records().map(|record| record.unwrap().iter().map(str::to_owned).collect()).collect()
}

/// The columns of a table as tensors.
fn tensors(table: &[Vec<String>]) -> Vec<(String, Vec<u8>)> {
    let column = |(k, name): (usize, &String)| {
        let values = table[1..].iter().map(|row| row[k].parse().unwrap_or(f64::NAN));
        (name.clone(), values.flat_map(f64::to_le_bytes).collect())
    };
    table[0].iter().enumerate().map(column).collect()
}

fn write_tensors(file: &Path, columns: &[(String, Vec<u8>)]) {
    let view = |bytes| TensorView::new(Dtype::F64, vec![<[u8]>::len(bytes) / 8], bytes).unwrap();
    let views = columns.iter().map(|(name, bytes)| (name, view(bytes)));
    safetensors::serialize_to_file(views, None, file).unwrap();
}

/// Tensors are answered as a table of the same numbers is, a free end and a row that cannot be included.
#[test]
fn tensors_are_queries_too() {
    let folder = sampled("12");
    let file = folder.path().join("queries.csv");
    let mut table = lines(folder.path(), "queries.csv");
    let place = |name: &str| table[0].iter().position(|own| own == name).unwrap();
    let (length, end) = (place("length_m"), place("end_x_m"));
    table[3][length] = "0.01".into();
    table[5][end..end + 7].fill(String::new());
    let text: Vec<String> = table.iter().map(|row| row.join(",")).collect();
    fs::write(file, text.join("\n")).unwrap();
    let mut columns = tensors(&table);
    write_tensors(&folder.path().join("queries.safetensors"), &columns);
    for (queries, out) in [("queries.csv", "a"), ("queries.safetensors", "b")] {
        let said = succeeds(folder.path(), &[queries, "--out", out, "--segments", "20"]);
        assert!(said.contains("11 of 12"), "{said}");
    }
    for name in ["answers.csv", "shapes.safetensors"] {
        let [a, b] = ["a", "b"].map(|out| fs::read(folder.path().join(out).join(name)).unwrap());
        assert!(a == b, "{name}");
    }
    let refuse = |columns: &[(String, Vec<u8>)]| {
        write_tensors(&folder.path().join("wrong.safetensors"), columns);
        refused(folder.path(), &["wrong.safetensors", "--out", "wrong"])
    };
    columns[0].1.truncate(16);
    assert!(refuse(&columns).contains("[rows], the same in all"));
    columns.remove(0);
    assert!(refuse(&columns).contains("is missing"));
    fs::write(folder.path().join("wrong.safetensors"), "nothing").unwrap();
    let said = refused(folder.path(), &["wrong.safetensors", "--out", "wrong"]);
    assert!(said.contains("wrong.safetensors: is no safetensors file"), "{said}");
}

#[test]
fn every_row_is_answered() {
    let folder = sampled("40");
    let said = succeeds(folder.path(), &["queries.csv", "--out", "answers", "--segments", "20"]);
    assert!(said.contains("40 of 40 queries answered"), "{said}");
    let table = lines(folder.path(), "answers/answers.csv");
    assert_eq!((table.len(), table[0].len()), (41, 20));
    for (k, row) in table[1..].iter().enumerate() {
        assert_eq!(row[..3], [k.to_string(), "found".to_owned(), "0".to_owned()]);
        assert!(row[5].parse::<f64>().unwrap() <= 1e-8, "{row:?}");
    }
    let bytes = fs::read(folder.path().join("answers/shapes.safetensors")).unwrap();
    let shapes = SafeTensors::deserialize(&bytes).unwrap();
    assert_eq!(shapes.tensor("positions").unwrap().shape(), [40, 20, 3]);
    assert_eq!(shapes.tensor("orientations").unwrap().shape(), [40, 20, 4]);
    assert_eq!(shapes.tensor("row").unwrap().shape(), [40]);
    let branches = succeeds(folder.path(), &["queries.csv", "--out", "branches", "--segments", "20", "--branches"]);
    assert!(branches.contains("40 of 40"));
    assert!(lines(folder.path(), "branches/answers.csv").len() > 70);
}

#[test]
fn shards_have_the_rows_of_the_whole() {
    let folder = sampled("20");
    succeeds(folder.path(), &["queries.csv", "--out", "whole"]);
    let whole = lines(folder.path(), "whole/answers.csv");
    let mut rows = Vec::new();
    for part in 0..3 {
        let shard = format!("{part}/3");
        succeeds(folder.path(), &["queries.csv", "--out", "parts", "--shard", &shard]);
        rows.extend(lines(folder.path(), &format!("parts/answers-{part}-of-3.csv")).split_off(1));
        assert!(folder.path().join(format!("parts/shapes-{part}-of-3.safetensors")).exists());
    }
    rows.sort_by_key(|row| row[0].parse::<usize>().unwrap());
    assert_eq!(rows, whole[1..]);
}

#[test]
fn a_row_that_cannot_be_has_its_own_error() {
    let folder = sampled("4");
    let path = folder.path().join("queries.csv");
    let text = fs::read_to_string(&path).unwrap();
    let mut rows: Vec<Vec<String>> = text.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect();
    let column = |name: &str| rows[0].iter().position(|own| own == name).unwrap();
    let [x, turn, length, end] = ["end_x_m", "start_qw", "length_m", "end_qz"].map(column);
    rows[1][x] = "7".to_owned();
    rows[2][turn] = "NaN".to_owned();
    rows[3][length] = "long".to_owned();
    rows[4][x..=end].fill(String::new());
    let text: Vec<String> = rows.iter().map(|row| row.join(",")).collect();
    fs::write(&path, text.join("\n")).unwrap();
    let said = succeeds(folder.path(), &["queries.csv", "--out", "answers"]);
    assert!(said.contains("1 of 4 queries answered"), "{said}");
    let table = lines(folder.path(), "answers/answers.csv");
    for (row, words) in
        [(1, "m apart, but the cable is 1 m long"), (2, "orientation of the start"), (3, "length_m = `long`")]
    {
        assert!(table[row][1].contains(words), "{:?}", table[row]);
        assert!(table[row][2..].iter().all(String::is_empty));
    }
    assert_eq!(table[4][1], "found");
    // The end is free.
    assert!(table[4][14..].iter().all(|number| number == "0"), "{:?}", table[4]);
}

#[test]
fn what_is_no_table_of_queries_is_refused() {
    let folder = sampled("2");
    let text = fs::read_to_string(folder.path().join("queries.csv")).unwrap();
    let header = text.lines().next().unwrap();
    for (content, words) in [
        (text.replace("length_m", "lenght_m"), "column `lenght_m` is not known"),
        (text.replace("start_qz", "start_qx"), "two columns `start_qx`"),
        (text.replace("1,1,", "1,1,1,1,"), "line 2: this row has not as many values"),
        (header.to_owned(), "there are no rows"),
        ("length_m\n1\n".to_owned(), "column `ei_n_m2` is missing"),
    ] {
        fs::write(folder.path().join("wrong.csv"), content).unwrap();
        let error = refused(folder.path(), &["wrong.csv", "--out", "none"]);
        assert!(error.contains("wrong.csv: line") && error.contains(words), "{error}");
    }
    assert!(!folder.path().join("none").exists());
    for (arguments, words) in [
        (&["none.csv"][..], "none.csv"),
        (&[][..], "no file of queries"),
        (&["queries.csv", "--segments", "3"][..], "--segments = 3, but it must be from 8 to 10000"),
        (&["queries.csv", "--tolerance", "NaN"][..], "--tolerance = NaN"),
        (&["queries.csv", "--shard", "3/3"][..], "from 0 to n - 1"),
        (&["sample", "--distance", "0.9", "0.1"][..], "--distance 0.9 0.1"),
    ] {
        let error = refused(folder.path(), arguments);
        assert!(error.contains(words), "{error}");
    }
}

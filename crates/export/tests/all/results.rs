//! Results are found by their keys, and whatever was done to their files is said with the file's name.

use std::collections::BTreeMap;
use std::fs;

use export::{Results, ResultsError, Stored};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Key {
    scene: String,
    seed: u64,
    tolerance: f64,
    part: Option<u32>,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Value {
    error: f64,
    rows: Vec<Row>,
    revision: Option<String>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Row {
    name: String,
    ratio: Option<f64>,
    spread: Option<[f64; 2]>,
}

fn key(seed: u64) -> Key {
    Key { scene: "rod \"a\"\n".to_owned(), seed, tolerance: 1e-300, part: None }
}

fn value() -> Value {
    let row = |name: &str, ratio, spread| Row { name: name.to_owned(), ratio, spread };
    let rows = vec![row("first", Some(0.1 + 0.2), None), row("second", None, Some([-0.0, f64::NEG_INFINITY]))];
    Value { error: f64::INFINITY, rows, revision: None }
}

fn store(directory: &tempfile::TempDir) -> Results<Key, Value> {
    Results::new(directory.path().join("results"), 3)
}

#[test]
fn a_result_comes_back_by_its_key_alone() {
    let directory = tempfile::tempdir().unwrap();
    let results = store(&directory);
    assert_eq!(results.get(&key(0)).unwrap(), None);
    assert!(results.all().unwrap().is_empty() && !results.directory().exists());
    let file = results.put(&key(0), &value()).unwrap();
    assert_eq!(file, results.file(&key(0)).unwrap());
    let back = results.get(&key(0)).unwrap().unwrap();
    assert_eq!(back, value());
    assert!(back.rows[1].spread.unwrap()[0].is_sign_negative());
    let others = [
        key(1),
        Key { scene: "rod".to_owned(), ..key(0) },
        Key { tolerance: 1e-299, ..key(0) },
        Key { part: Some(0), ..key(0) },
    ];
    for other in others {
        assert_eq!(results.get(&other).unwrap(), None, "{other:?}");
    }
    // A new version of the format finds nothing old.
    assert_eq!(Results::<Key, Value>::new(results.directory(), 4).get(&key(0)).unwrap(), None);
    assert_eq!(names(&results), [file.file_name().unwrap().to_str().unwrap()]);
}

#[test]
fn what_is_not_a_number_stays_so() {
    let directory = tempfile::tempdir().unwrap();
    let results = store(&directory);
    results.put(&key(0), &Value { error: f64::NAN, ..value() }).unwrap();
    assert!(results.get(&key(0)).unwrap().unwrap().error.is_nan());
}

#[test]
fn a_second_result_of_a_key_replaces_the_first() {
    let directory = tempfile::tempdir().unwrap();
    let results = store(&directory);
    results.put(&key(0), &value()).unwrap();
    results.put(&key(0), &Value::default()).unwrap();
    assert_eq!(results.get(&key(0)).unwrap(), Some(Value::default()));
    assert_eq!(names(&results).len(), 1);
    // Many at once leave one whole file.
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| (0..20).for_each(|_| drop(results.put(&key(0), &value()).unwrap())));
        }
    });
    assert_eq!(results.get(&key(0)).unwrap(), Some(value()));
    assert_eq!(names(&results).len(), 1);
}

#[test]
fn a_file_that_was_changed_or_cut_off_anywhere_is_named() {
    let directory = tempfile::tempdir().unwrap();
    let results = store(&directory);
    let file = results.put(&key(0), &value()).unwrap();
    let whole = fs::read(&file).unwrap();
    let complaint = |bytes: &[u8]| {
        fs::write(&file, bytes).unwrap();
        let error = results.get(&key(0)).unwrap_err();
        assert!(error.to_string().starts_with(file.to_str().unwrap()), "{error}");
        error
    };
    for length in 0..whole.len() {
        complaint(&whole[..length]);
    }
    for at in 0..whole.len() {
        let mut bytes = whole.clone();
        bytes[at] ^= 1 << (at % 8);
        complaint(&bytes);
    }
    assert!(complaint(b"").to_string().contains("schema_version = missing"));
    assert_eq!(results.all().unwrap().iter().filter(|entry| entry.is_err()).count(), 1);
    fs::write(&file, &whole).unwrap();
    assert_eq!(results.get(&key(0)).unwrap(), Some(value()));
}

#[test]
fn a_file_under_the_name_of_another_key_is_named() {
    let directory = tempfile::tempdir().unwrap();
    let results = store(&directory);
    let first = results.put(&key(0), &value()).unwrap();
    let second = results.file(&key(1)).unwrap();
    fs::rename(&first, &second).unwrap();
    let error = results.get(&key(1)).unwrap_err();
    assert!(matches!(error, ResultsError::Key { .. }));
    let [text, name] = [error.to_string(), first.file_name().unwrap().to_string_lossy().into_owned()];
    assert!(text.starts_with(second.to_str().unwrap()) && text.contains(&name) && text.contains("seed = 0"), "{text}");
}

#[test]
fn all_results_are_listed_and_what_is_no_result_is_left_out() {
    let directory = tempfile::tempdir().unwrap();
    let results = store(&directory);
    for seed in 0..3 {
        results.put(&key(seed), &Value { error: seed as f64, ..value() }).unwrap();
    }
    // A write that was cut off, and a note of the user's.
    fs::write(results.directory().join(".half.toml-x.tmp"), "half").unwrap();
    fs::write(results.directory().join("note.txt"), "mine").unwrap();
    let mut all: Vec<Stored<Key, Value>> = results.all().unwrap().into_iter().map(Result::unwrap).collect();
    all.sort_by_key(|stored| stored.key.seed);
    assert_eq!(
        all.iter().map(|stored| (stored.key.seed, stored.value.error)).collect::<Vec<_>>(),
        [(0, 0.0), (1, 1.0), (2, 2.0)]
    );
    assert_eq!(all[1].file, results.file(&key(1)).unwrap());
}

#[test]
fn what_would_not_come_back_is_refused() {
    fn refused<V: Serialize + DeserializeOwned>(value: V) -> String {
        let directory = tempfile::tempdir().unwrap();
        let results = Results::<u32, V>::new(directory.path(), 1);
        let text = results.put(&7, &value).unwrap_err().to_string();
        assert!(text.contains(results.file(&7).unwrap().to_str().unwrap()), "{text}");
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 0);
        text
    }
    refused(vec![Some(1), None]);
    refused(BTreeMap::from([("a".to_owned(), None::<f64>)]));
    refused(u64::MAX);
    refused((None::<u32>, 1));
    let directory = tempfile::tempdir().unwrap();
    let keys = Results::<Vec<Option<u32>>, u32>::new(directory.path(), 1);
    assert!(keys.put(&vec![None], &1).unwrap_err().to_string().contains("the key has no form in TOML"));
    // Lists, numbers and text alone are fine.
    let plain = Results::<(u32, String), Vec<f64>>::new(directory.path(), 1);
    plain.put(&(1, "a".to_owned()), &vec![1.5, f64::INFINITY]).unwrap();
    assert_eq!(plain.get(&(1, "a".to_owned())).unwrap(), Some(vec![1.5, f64::INFINITY]));
}

#[test]
fn a_place_where_no_folder_can_be_is_named() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("file");
    fs::write(&file, "").unwrap();
    let results = Results::<Key, Value>::new(file.join("below"), 1);
    for error in [results.put(&key(0), &value()).unwrap_err(), results.get(&key(0)).unwrap_err()] {
        assert!(error.to_string().contains("file/below"), "{error}");
    }
}

fn names(results: &Results<Key, Value>) -> Vec<String> {
    let entries = fs::read_dir(results.directory()).unwrap();
    entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
}

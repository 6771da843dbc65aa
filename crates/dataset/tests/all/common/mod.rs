//! Small data sets to test with.
#![allow(dead_code, missing_docs, unreachable_pub)]

use std::path::Path;

use dataset::{Config, Dataset, Scenario, generate};

/// A few short trajectories in shards of two.
pub fn small(scenario: Scenario) -> Config {
    Config {
        seed: 5,
        train_trajectories: 5,
        validation_trajectories: 2,
        steps: 4,
        record_every: if scenario == Scenario::Tree { 3 } else { 1 },
        trajectories_per_shard: 2,
        ..Config::table_1(scenario)
    }
}

pub fn generated(directory: &Path, config: &Config) -> Dataset {
    let generated = generate(directory, config, None, &|_| ()).unwrap();
    assert!(generated.manifest.is_some());
    Dataset::open(directory).unwrap()
}

/// Names and contents of all files but the manifest, whose revision may change.
pub fn files(directory: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files: Vec<_> = std::fs::read_dir(directory)
        .unwrap()
        .map(|entry| {
            let path = entry.unwrap().path();
            (path.file_name().unwrap().to_str().unwrap().to_owned(), std::fs::read(path).unwrap())
        })
        .filter(|(name, _)| name != dataset::MANIFEST)
        .collect();
    files.sort();
    files
}

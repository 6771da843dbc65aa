//! Folders of made-up outcomes.

use std::path::PathBuf;

use evaluation::ablation::{Architecture, Budget, FREE, Grid, GuessSavings, Source, Sweep, Test};
use evaluation::guesses::Spread;
use tempfile::TempDir;

use super::*;

fn sweep() -> Sweep {
    let source = |scenario: &str| Source {
        scenario: scenario.to_owned(),
        data_blake3: "00".to_owned(),
        samples: 10,
        nodes: 300,
    };
    Sweep {
        schema_version: SCHEMA_VERSION,
        seeds: vec![0, 1],
        grid: Grid {
            gn_blocks: vec![1, 2],
            widths: vec![4, 8],
            mlp_layers: vec![1, 2],
            benchmark: Architecture { gn_blocks: 1, mlp_layers: 2, width: 8 },
        },
        budget: Budget {
            recipe: "paper".to_owned(),
            features: "paper".to_owned(),
            head: "full".to_owned(),
            loss: "mse".to_owned(),
            scans: 0,
            epochs: 2,
            batch: 32,
            learning_rate: 1e-3,
            schedule: "cosine".to_owned(),
            measure_every: 1,
            validation_scenes: 30,
            backend: "ndarray".to_owned(),
        },
        test: Test { seed: 1, simulations: 4, steps: 30 },
        sources: vec![source("rod"), source("helix")],
    }
}

fn outcome(weights: &str) -> NetworkOutcome {
    let spread = Some(Spread { mean: 0.5, lower: 0.25, median: 0.5, upper: 0.75 });
    let row = GuessSavings {
        guess: FREE.to_owned(),
        preconditioner: "raw".to_owned(),
        tolerance: 1e-4,
        solves: 12,
        dropped: 0,
        iteration_ratio: spread,
        speed_up: spread,
        zero_us: spread,
        inference_us: None,
    };
    NetworkOutcome {
        parameters: 100,
        weights_blake3: weights.to_owned(),
        best_epoch: 2,
        final_loss: f64::NAN,
        training_s: 1.5,
        measuring_s: 0.5,
        machine: "Example \"9000\", 2 cores".to_owned(),
        threads: 1,
        program_version: "0.1.0".to_owned(),
        git_revision: None,
        rows: vec![row],
    }
}

/// Two folders, with every second cell each.
struct Shards {
    directory: TempDir,
    sweep: Sweep,
}

impl Shards {
    fn new() -> Self {
        let own = Self { directory: tempfile::tempdir().unwrap(), sweep: sweep() };
        for part in 0..2 {
            let folder = own.folder(part);
            folder.prepare(&own.sweep).unwrap();
            for key in own.sweep.keys().iter().skip(part).step_by(2) {
                folder.cells.put(key, &outcome("aa")).unwrap();
            }
        }
        own
    }

    fn path(&self, part: usize) -> PathBuf {
        self.directory.path().join(part.to_string())
    }

    fn folder(&self, part: usize) -> Folder {
        Folder::new(&self.path(part))
    }

    /// File of a cell, which is in the folder of its parity.
    fn file(&self, k: usize) -> PathBuf {
        self.folder(k % 2).cells.file(&self.sweep.keys()[k]).unwrap()
    }

    fn merge(&self, partial: bool) -> Result<()> {
        let out = Some(self.directory.path().join("all"));
        merge(&MergeArgs { folders: vec![self.path(0), self.path(1)], out, partial })
    }

    fn complaint(&self) -> String {
        let message = self.merge(false).unwrap_err().to_string();
        assert!(!self.directory.path().join("all").exists());
        message
    }

    fn summary(&self) -> Summary {
        let file = self.directory.path().join("all").join(SUMMARY);
        export::unseal(&file, &fs::read(&file).unwrap(), SCHEMA_VERSION).unwrap()
    }
}

#[test]
fn a_sweep_has_each_cell_once_and_costly_ones_first() {
    let keys = sweep().keys();
    // Four of the grid and one of one layer, for each seed and kind of scenes.
    assert_eq!(keys.len(), 2 * 2 * 5);
    assert!(keys.iter().enumerate().all(|(k, key)| !keys[..k].contains(key)));
    assert_eq!(keys[0].architecture, Architecture { gn_blocks: 2, mlp_layers: 2, width: 8 });
    let paper = Grid {
        gn_blocks: vec![1, 2, 3, 4, 5],
        widths: vec![8, 16, 32, 64],
        mlp_layers: vec![1, 2, 3, 4],
        benchmark: Architecture::BENCHMARK,
    };
    assert_eq!(paper.architectures().len(), 23);
}

#[test]
fn all_shards_together_make_the_sweep() {
    let shards = Shards::new();
    shards.merge(false).unwrap();
    let summary = shards.summary();
    assert_eq!((summary.cells.len(), summary.lost.len()), (20, 0));
    assert_eq!(summary.sweep, shards.sweep);
    let cells = summary.cells.iter().zip(shards.sweep.keys());
    assert!(cells.into_iter().all(|(cell, key)| (cell.seed, cell.architecture) == (key.seed, key.architecture)));
    assert!(summary.cells[0].outcome.final_loss.is_nan());
}

#[test]
fn lost_cells_are_named() {
    let shards = Shards::new();
    for k in [0, 7] {
        fs::remove_file(shards.file(k)).unwrap();
    }
    let message = shards.complaint();
    let keys = shards.sweep.keys();
    for words in ["2 of 20 cells are lost", "--partial", &keys[0].to_string(), &keys[7].to_string()] {
        assert!(message.contains(words), "{message}");
    }
    shards.merge(true).unwrap();
    let summary = shards.summary();
    assert_eq!(summary.lost, [keys[0].to_string(), keys[7].to_string()]);
    assert_eq!(summary.cells.len(), 18);
}

#[test]
fn doubled_cells_must_have_the_same_weights() {
    let shards = Shards::new();
    let key = &shards.sweep.keys()[0];
    // Another machine's times, but the same training.
    shards.folder(1).cells.put(key, &NetworkOutcome { training_s: 9.0, ..outcome("aa") }).unwrap();
    shards.merge(false).unwrap();
    assert_eq!(shards.summary().cells[0].outcome.training_s, 1.5);
    fs::remove_dir_all(shards.directory.path().join("all")).unwrap();
    let second = shards.folder(1).cells.put(key, &outcome("bb")).unwrap();
    let message = shards.complaint();
    for file in [shards.file(0), second] {
        assert!(message.contains(file.to_str().unwrap()), "{message}");
    }
}

#[test]
fn damaged_cells_are_named() {
    let shards = Shards::new();
    let file = shards.file(3);
    let text = fs::read_to_string(&file).unwrap();
    fs::write(&file, text.replace("training_s = 1.5", "training_s = 1.4")).unwrap();
    let message = shards.complaint();
    assert!(message.contains("1 of 20 cells are lost") && message.contains(file.to_str().unwrap()), "{message}");
    // Half of a file, under the name of another cell.
    fs::write(&file, &text[..text.len() / 2]).unwrap();
    assert!(shards.complaint().contains(file.to_str().unwrap()));
    fs::copy(shards.file(4), &file).unwrap();
    let message = shards.complaint();
    assert!(message.contains(file.to_str().unwrap()) && message.contains("another key"), "{message}");
    // Whole elsewhere, the cell is not lost.
    fs::write(&file, "").unwrap();
    shards.folder(0).cells.put(&shards.sweep.keys()[3], &outcome("aa")).unwrap();
    shards.merge(false).unwrap();
}

#[test]
fn folders_of_different_sweeps_are_told_apart() {
    let shards = Shards::new();
    let mut other = shards.sweep.clone();
    other.budget.epochs = 3;
    let message = shards.folder(1).check(&other).unwrap_err().to_string();
    assert!(message.contains("sweep.toml") && message.contains("with epochs = 2, not epochs = 3"), "{message}");
    shards.folder(1).prepare(&other).unwrap();
    let message = shards.complaint();
    assert!(message.contains("1/sweep.toml") && message.contains("0/sweep.toml"), "{message}");
    assert!(message.contains("with epochs = 3, not epochs = 2"), "{message}");
    // A cell that was copied to where it does not belong.
    let stray = &other.keys()[0];
    shards.folder(1).prepare(&shards.sweep).unwrap();
    let file = shards.folder(1).cells.put(stray, &outcome("aa")).unwrap();
    assert!(shards.complaint().contains(file.to_str().unwrap()));
    fs::remove_file(shards.path(1).join("sweep.toml")).unwrap();
    assert!(shards.complaint().contains("no folder of a sweep"));
}

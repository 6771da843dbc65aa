//! The data sets, generated where they are absent.

use std::path::Path;

use anyhow::{Context, Result};
use dataset::{Config, Dataset, MANIFEST, Scenario, generate};
use indicatif::{ProgressBar, ProgressDrawTarget};

/// Opens the paper's data set of a scenario in `directory`; generates it, or what is missing of it, if need be.
pub(crate) fn open(directory: &Path, scenario: Scenario, quiet: bool) -> Result<Dataset> {
    let config = Config::table_1(scenario);
    if !directory.join(MANIFEST).exists() {
        let count = config.train_trajectories + config.validation_trajectories;
        if !quiet {
            println!("generating {count} trajectories ({scenario}) in {}, once and for all", directory.display());
        }
        let bar = ProgressBar::new(count as u64);
        bar.set_draw_target(if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() });
        generate(directory, &config, None, &|made| bar.set_position(made.done as u64)).context("--data")?;
        bar.finish_and_clear();
    }
    let dataset = Dataset::open(directory).context("--data")?;
    if dataset.manifest().config != config {
        // Says which setting differs.
        generate(directory, &config, None, &|_| ()).context("--data")?;
    }
    Ok(dataset)
}

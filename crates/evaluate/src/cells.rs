//! What is measured, cell by cell: kept in files, so that a report that was cut off goes on, and several processes
//! share it.

use std::collections::{BTreeMap, VecDeque};
use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::Result;
use export::Results;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use terminal::Progress;

use crate::agreement::Agreement;
use crate::context::Context;

/// Version of what a cell means; older ones are measured anew.
const SCHEMA_VERSION: u32 = 1;

/// Before the next cell is tried where another process measures one.
const PATIENCE: Duration = Duration::from_millis(100);

/// A section of the report: what is measured for it, and how it is shown.
pub(crate) trait Section {
    /// All that a cell depends on, beside the program and the networks.
    type Key: Serialize + DeserializeOwned;
    /// What is measured.
    type Value: Serialize + DeserializeOwned;
    /// Its anchor in the page, and the name of its folder.
    const ID: &'static str;

    /// The cells, in the order in which they are measured.
    fn keys(&self, context: &Context) -> Result<Vec<Self::Key>>;

    /// How long a cell takes, about [s]: for the estimate of the time left.
    fn seconds(&self, key: &Self::Key) -> f64;

    /// Measures a cell. `go_on` says now and then whether to go on; `None` if not.
    fn measure(
        &mut self,
        context: &Context,
        key: &Self::Key,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Option<Self::Value>>;

    /// The section of the page.
    fn show(&self, context: &Context, cells: &[(&Self::Key, &Self::Value)]) -> Result<report::Section>;

    /// What we measure where the paper says a number, by the names of [`evaluation::paper::claims`].
    fn claims(&self, _: &Context, _: &[(&Self::Key, &Self::Value)]) -> Result<BTreeMap<String, String>> {
        Ok(BTreeMap::new())
    }
}

/// What a file is named by.
#[derive(Serialize, Deserialize)]
struct FullKey<K> {
    section: String,
    /// Of all networks' weights.
    networks_blake3: String,
    cell: K,
}

/// What stands in a file.
#[derive(Serialize, Deserialize)]
struct Record<V> {
    machine: String,
    /// Of the program's source.
    #[serde(skip_serializing_if = "Option::is_none")]
    revision: Option<String>,
    /// How long it took.
    seconds: f64,
    value: V,
}

/// Where the cells of all sections were measured.
#[derive(Clone, Debug, Default)]
pub(crate) struct Provenance {
    pub(crate) machines: Vec<String>,
    pub(crate) revisions: Vec<String>,
    /// Time of all measurements [s].
    pub(crate) seconds: f64,
}

impl Provenance {
    /// Adds a measurement that took so many `seconds`.
    pub(crate) fn add(&mut self, machine: &str, revision: Option<&str>, seconds: f64) {
        for (known, name) in [(&mut self.machines, machine), (&mut self.revisions, revision.unwrap_or("unknown"))] {
            if !known.iter().any(|known| known == name) {
                known.push(name.to_owned());
            }
        }
        self.seconds += seconds;
    }
}

/// What to do about cells that other processes are measuring.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Others {
    /// Leave them.
    Skip,
    /// Wait for them.
    Wait,
}

/// A section with its cells, whatever they are made of.
pub(crate) trait Job {
    /// Reads what was measured before. Returns how long the rest takes, about [s].
    fn prepare(&mut self, context: &Context) -> Result<f64>;
    /// Measures the rest; what other processes measure is left to them, or waited for. Returns whether it was not
    /// interrupted.
    fn run(&mut self, context: &Context, progress: &Progress, others: Others) -> Result<bool>;
    /// The section of the page.
    fn show(&self, context: &Context) -> Result<report::Section>;
    /// What we measure where the paper says a number.
    fn claims(&self, context: &Context) -> Result<BTreeMap<String, String>>;
    /// Compares what two runs have measured, in these folders; `None` where a section measures nothing itself.
    fn compare(&self, folders: [&Path; 2]) -> Result<Option<Agreement>>;
    /// Adds where its cells were measured.
    fn add_to(&self, provenance: &mut Provenance);
}

/// A [`Job`] of a [`Section`].
pub(crate) struct Cells<S: Section> {
    section: S,
    cells: Vec<Cell<S>>,
}

struct Cell<S: Section> {
    key: FullKey<S::Key>,
    record: Option<Record<S::Value>>,
}

impl<S: Section> Cells<S> {
    pub(crate) fn new(section: S) -> Self {
        Self { section, cells: Vec::new() }
    }

    fn measured(&self) -> Vec<(&S::Key, &S::Value)> {
        self.cells.iter().filter_map(|cell| Some((&cell.key.cell, &cell.record.as_ref()?.value))).collect()
    }
}

impl<S: Section> Job for Cells<S> {
    fn prepare(&mut self, context: &Context) -> Result<f64> {
        let results = results::<S>(&context.cells);
        let mut rest = 0.0;
        for cell in self.section.keys(context)? {
            let networks_blake3 = context.library.networks_blake3().to_owned();
            let key = FullKey { section: S::ID.to_owned(), networks_blake3, cell };
            let record = results.get(&key)?;
            if record.is_none() {
                rest += self.section.seconds(&key.cell);
            }
            self.cells.push(Cell { key, record });
        }
        Ok(rest)
    }

    fn run(&mut self, context: &Context, progress: &Progress, others: Others) -> Result<bool> {
        let Self { section, cells } = self;
        let results = results::<S>(&context.cells);
        let mut rest: VecDeque<&mut Cell<S>> = cells.iter_mut().filter(|cell| cell.record.is_none()).collect();
        while let Some(cell) = rest.pop_front() {
            if progress.stopped() {
                return Ok(false);
            }
            let Some(_claim) = results.claim(&cell.key)? else {
                if others == Others::Wait {
                    rest.push_back(cell);
                    std::thread::sleep(PATIENCE);
                }
                continue;
            };
            cell.record = results.get(&cell.key)?;
            if cell.record.is_none() {
                let begin = Instant::now();
                let Some(value) = section.measure(context, &cell.key.cell, &mut || !progress.stopped())? else {
                    return Ok(false);
                };
                let (machine, revision) = (context.machine.clone(), context.revision.clone());
                let record = Record { machine, revision, seconds: begin.elapsed().as_secs_f64(), value };
                results.put(&cell.key, cell.record.insert(record))?;
            }
            progress.advance_by(ticks(section.seconds(&cell.key.cell)));
        }
        Ok(true)
    }

    fn show(&self, context: &Context) -> Result<report::Section> {
        self.section.show(context, &self.measured())
    }

    fn claims(&self, context: &Context) -> Result<BTreeMap<String, String>> {
        self.section.claims(context, &self.measured())
    }

    fn compare(&self, folders: [&Path; 2]) -> Result<Option<Agreement>> {
        let mut agreement = Agreement::default();
        let mut second = all::<S>(folders[1])?;
        for (name, value) in all::<S>(folders[0])? {
            match second.remove(&name) {
                Some(other) => agreement.add(&format!("{}/{name}", S::ID), [&value, &other])?,
                None => agreement.add_alone(),
            }
        }
        second.values().for_each(|_| agreement.add_alone());
        Ok(Some(agreement))
    }

    fn add_to(&self, provenance: &mut Provenance) {
        for record in self.cells.iter().filter_map(|cell| cell.record.as_ref()) {
            provenance.add(&record.machine, record.revision.as_deref(), record.seconds);
        }
    }
}

fn results<S: Section>(directory: &Path) -> Results<FullKey<S::Key>, Record<S::Value>> {
    Results::new(directory.join(S::ID), SCHEMA_VERSION)
}

/// What was measured, by the files' names.
fn all<S: Section>(directory: &Path) -> Result<BTreeMap<String, S::Value>> {
    let stored = results::<S>(directory).all()?.into_iter();
    let named = stored.map(|found| {
        let stored = found?;
        let name = stored.file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Ok((name, stored.value.value))
    });
    named.collect()
}

/// Seconds as ticks of the progress bar.
pub(crate) fn ticks(seconds: f64) -> usize {
    (1e3 * seconds) as usize
}

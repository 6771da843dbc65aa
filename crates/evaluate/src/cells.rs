//! What is measured, cell by cell: kept in files, so that a report that was cut off goes on.

use std::collections::BTreeMap;
use std::time::Instant;

use anyhow::Result;
use export::Results;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use terminal::Progress;

use crate::context::Context;
use crate::sources::{Provenance, REVISION, blake3_of, today};

/// Version of what a cell means; older ones are measured anew.
pub(crate) const SCHEMA_VERSION: u32 = 3;

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

    /// How long a cell takes, about [s]: for the estimate of the time left, and to make shards alike.
    fn seconds(&self, key: &Self::Key) -> f64;

    /// Whether a cell needs what was computed for the one before it, so that one shard measures both.
    fn go_together(_: &Self::Key, _: &Self::Key) -> bool {
        false
    }

    /// Measures a cell. `go_on` says now and then whether to go on; `None` if not.
    fn measure(
        &mut self,
        context: &Context,
        key: &Self::Key,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Option<Self::Value>>;

    /// The section of the page.
    fn show(&self, context: &Context, cells: &[(&Self::Key, &Self::Value)]) -> Result<report::Section>;

    /// What we measure where the paper says a number, by the ids of its claims.
    fn claims(&self, _: &Context, _: &[(&Self::Key, &Self::Value)]) -> Result<BTreeMap<String, String>> {
        Ok(BTreeMap::new())
    }
}

/// What a file is named by.
#[derive(Serialize, Deserialize)]
pub(crate) struct FullKey<K> {
    pub(crate) section: String,
    /// Of the sources that decide what is measured.
    sources_blake3: String,
    /// Of all networks' weights.
    networks_blake3: String,
    pub(crate) cell: K,
}

/// What stands in a file.
#[derive(Serialize, Deserialize)]
pub(crate) struct Record<V> {
    machine: String,
    /// Of the program that measured it.
    revision: String,
    /// Date (UTC).
    measured: String,
    /// How long it took.
    seconds: f64,
    pub(crate) value: V,
}

/// A section with its cells, whatever they are made of.
pub(crate) trait Job {
    /// Reads what was measured before. Returns how long the rest of this process's shard takes, about [s].
    fn prepare(&mut self, context: &Context) -> Result<f64>;
    /// Measures the rest. Returns whether it was not interrupted.
    fn run(&mut self, _: &Context, _: &Progress) -> Result<bool> {
        Ok(true)
    }
    /// Number of cells that nobody has measured so far; what other processes measured meanwhile is read.
    fn missing(&mut self, _: &Context) -> Result<usize> {
        Ok(0)
    }
    /// The section of the page.
    fn show(&self, context: &Context) -> Result<report::Section>;
    /// What we measure where the paper says a number.
    fn claims(&self, context: &Context) -> Result<BTreeMap<String, String>>;
    /// Where its cells were measured.
    fn provenance(&self) -> Provenance;
}

/// A [`Job`] of a [`Section`].
pub(crate) struct Cells<S: Section> {
    section: S,
    cells: Vec<Kept<S>>,
}

/// A cell with what is kept of it.
struct Kept<S: Section> {
    key: FullKey<S::Key>,
    record: Option<Record<S::Value>>,
    /// Whether it is in this process's shard.
    is_own: bool,
}

impl<S: Section> Cells<S> {
    pub(crate) fn new(section: S) -> Self {
        Self { section, cells: Vec::new() }
    }

    fn measured(&self) -> Vec<(&S::Key, &S::Value)> {
        self.cells.iter().filter_map(|cell| Some((&cell.key.cell, &cell.record.as_ref()?.value))).collect()
    }

    fn results(context: &Context) -> Results<FullKey<S::Key>, Record<S::Value>> {
        Results::new(context.cells.join(S::ID), SCHEMA_VERSION)
    }
}

impl<S: Section> Job for Cells<S> {
    fn prepare(&mut self, context: &Context) -> Result<f64> {
        let results = Self::results(context);
        for cell in self.section.keys(context)? {
            let key = FullKey {
                section: S::ID.to_owned(),
                sources_blake3: blake3_of(S::ID).to_owned(),
                networks_blake3: context.library.networks_blake3.clone(),
                cell,
            };
            let record = results.get(&key)?;
            self.cells.push(Kept { key, record, is_own: false });
        }
        // A shard is a part of the time that all cells take.
        let (shard, shards) = context.shard;
        let seconds = |cells: &[Kept<S>]| cells.iter().map(|cell| self.section.seconds(&cell.key.cell)).sum::<f64>();
        let (all, mut before) = (seconds(&self.cells), 0.0);
        for group in self.cells.chunk_by_mut(|cell, next| S::go_together(&cell.key.cell, &next.key.cell)) {
            let own = seconds(group);
            let place = ((before + 0.5 * own) / all * shards as f64) as usize;
            before += own;
            group.iter_mut().for_each(|cell| cell.is_own = place.min(shards - 1) == shard);
        }
        let rest = self.cells.iter().filter(|cell| cell.is_own && cell.record.is_none());
        Ok(rest.map(|cell| self.section.seconds(&cell.key.cell)).sum())
    }

    fn run(&mut self, context: &Context, progress: &Progress) -> Result<bool> {
        let results = Self::results(context);
        for cell in self.cells.iter_mut().filter(|cell| cell.is_own && cell.record.is_none()) {
            if progress.stopped() {
                return Ok(false);
            }
            let begin = Instant::now();
            let measured = self.section.measure(context, &cell.key.cell, &mut || !progress.stopped())?;
            let Some(value) = measured else { return Ok(false) };
            let (machine, revision) = (context.machine.clone(), REVISION.to_owned());
            let seconds = begin.elapsed().as_secs_f64();
            let record = Record { machine, revision, measured: today(), seconds, value };
            results.put(&cell.key, cell.record.insert(record))?;
            progress.advance_by(ticks(self.section.seconds(&cell.key.cell)));
        }
        Ok(true)
    }

    fn missing(&mut self, context: &Context) -> Result<usize> {
        let (results, mut missing) = (Self::results(context), 0);
        for cell in self.cells.iter_mut().filter(|cell| cell.record.is_none()) {
            cell.record = results.get(&cell.key)?;
            missing += usize::from(cell.record.is_none());
        }
        Ok(missing)
    }

    fn show(&self, context: &Context) -> Result<report::Section> {
        self.section.show(context, &self.measured())
    }

    fn claims(&self, context: &Context) -> Result<BTreeMap<String, String>> {
        self.section.claims(context, &self.measured())
    }

    fn provenance(&self) -> Provenance {
        let mut provenance = Provenance::default();
        for record in self.cells.iter().filter_map(|cell| cell.record.as_ref()) {
            // The cells' keys have the hash of the sources, so that it is the program's.
            let revision = format!("{} (sources BLAKE3 {})", record.revision, &blake3_of(S::ID)[..12]);
            provenance.add(&record.machine, &revision, Some(&record.measured), record.seconds);
        }
        provenance
    }
}

/// Seconds as ticks of the progress bar.
pub(crate) fn ticks(seconds: f64) -> usize {
    (1e3 * seconds) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_other_sources_or_networks_measured_is_not_found() {
        let folder = tempfile::tempdir().unwrap();
        let results = Results::<FullKey<u32>, Record<f64>>::new(folder.path(), SCHEMA_VERSION);
        let key = |section: &str, sources: &str, networks: &str| {
            let [section, sources_blake3, networks_blake3] = [section, sources, networks].map(str::to_owned);
            FullKey { section, sources_blake3, networks_blake3, cell: 7 }
        };
        let record =
            Record { machine: String::new(), revision: String::new(), measured: today(), seconds: 1.0, value: 2.0 };
        results.put(&key("a", "b", "c"), &record).unwrap();
        assert_eq!(results.get(&key("a", "b", "c")).unwrap().map(|record| record.value), Some(2.0));
        for other in [key("x", "b", "c"), key("a", "x", "c"), key("a", "b", "x")] {
            assert!(results.get(&other).unwrap().is_none());
        }
    }

    /// Cells of three groups, one of which takes as long as both others.
    struct Groups;

    impl Section for Groups {
        type Key = [u32; 2];
        type Value = ();
        const ID: &'static str = "groups";

        fn keys(&self, _: &Context) -> Result<Vec<[u32; 2]>> {
            Ok([(0, 2), (1, 8), (2, 6)].into_iter().flat_map(|(group, n)| (0..n).map(move |k| [group, k])).collect())
        }

        fn seconds(&self, _: &[u32; 2]) -> f64 {
            0.1
        }

        fn go_together(key: &[u32; 2], next: &[u32; 2]) -> bool {
            key[0] == next[0]
        }

        fn measure(&mut self, _: &Context, _: &[u32; 2], _: &mut dyn FnMut() -> bool) -> Result<Option<()>> {
            Ok(None)
        }

        fn show(&self, _: &Context, _: &[(&[u32; 2], &())]) -> Result<report::Section> {
            unreachable!("nothing is measured")
        }
    }

    #[test]
    fn each_cell_is_in_one_shard_and_so_are_all_that_go_together() {
        for shards in 1..=5 {
            let mut owners = std::collections::BTreeSet::new();
            let mut count = 0;
            for shard in 0..shards {
                let mut cells = Cells::new(Groups);
                let rest = cells.prepare(&Context { shard: (shard, shards), ..Context::for_tests() }).unwrap();
                let own: Vec<_> = cells.cells.iter().filter(|cell| cell.is_own).map(|cell| cell.key.cell).collect();
                assert!((rest - 0.1 * own.len() as f64).abs() < 1e-12);
                assert!(shards != 2 || own.len() == [10, 6][shard], "{own:?}");
                count += own.len();
                owners.extend(own.iter().map(|[group, _]| (*group, shard)));
            }
            assert_eq!((count, owners.len()), (16, 3), "{owners:?}");
        }
    }
}

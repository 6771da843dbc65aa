//! Which sources the program is made of, as they were when it was built, and where and when cells were measured.

use std::collections::BTreeSet;
use std::process::Command;

// From the build script: ROOT, the folder of the sources; REVISION, the last one that changed them, and whether they were
// changed since; IS_DIRTY, whether they were; BY_SECTION, hashes by the sections' names.
include!(concat!(env!("OUT_DIR"), "/sources.rs"));

/// Hash of the sources that decide what a section measures.
pub(crate) fn blake3_of(section: &str) -> &'static str {
    BY_SECTION.iter().find(|(name, _)| *name == section).map_or("unknown", |(_, blake3)| blake3)
}

/// Where, when and by which sources something was measured.
#[derive(Clone, Debug, Default)]
pub(crate) struct Provenance {
    machines: BTreeSet<String>,
    revisions: BTreeSet<String>,
    dates: BTreeSet<String>,
    /// Time of all measurements [s].
    pub(crate) seconds: f64,
}

impl Provenance {
    /// Adds a measurement that took so many `seconds`.
    pub(crate) fn add(&mut self, machine: &str, revision: &str, date: Option<&str>, seconds: f64) {
        self.machines.insert(machine.to_owned());
        self.revisions.insert(revision.to_owned());
        self.dates.extend(date.map(str::to_owned));
        self.seconds += seconds;
    }

    /// In a sentence; `None` where nothing was measured.
    pub(crate) fn words(&self) -> Option<String> {
        let dates = match (self.dates.first(), self.dates.last()) {
            (Some(first), Some(last)) if first != last => format!(" from {first} to {last}"),
            (Some(date), _) => format!(" on {date}"),
            _ => String::new(),
        };
        let [revisions, machines] =
            [&self.revisions, &self.machines].map(|names| Vec::from_iter(names.iter().map(String::as_str)).join("; "));
        let minutes = (self.seconds / 60.0).ceil();
        let words = format!("Measured{dates} in {minutes:.0} minutes, machine: {machines}, revision: {revisions}.");
        (!self.machines.is_empty()).then_some(words)
    }

    /// What the sentences of a page say, all sections together: the inverse of [`Provenance::words`].
    pub(crate) fn of_page(html: &str) -> Self {
        let mut all = Self::default();
        for sentence in html.split("<p>Measured").skip(1).filter_map(|rest| rest.split("</p>").next()) {
            let Some((when, rest)) = sentence.split_once(" minutes, machine: ") else { continue };
            let Some((machines, revisions)) = rest.split_once(", revision: ") else { continue };
            let (dates, minutes) = when.rsplit_once(" in ").unwrap_or(("", "0"));
            let dates = dates.split_whitespace().filter(|word| word.starts_with(|c: char| c.is_ascii_digit()));
            all.dates.extend(dates.map(str::to_owned));
            all.machines.extend(machines.split("; ").map(str::to_owned));
            // Without the hash of each section's sources.
            let revisions = revisions.trim_end_matches('.').split("; ");
            all.revisions.extend(revisions.filter_map(|text| text.split(' ').next()).map(str::to_owned));
            all.seconds += 60.0 * minutes.parse().unwrap_or(0.0);
        }
        all
    }

    /// Dates, machines and revisions as text, and minutes.
    pub(crate) fn texts(&self) -> [String; 4] {
        let list = |names: &BTreeSet<String>| Vec::from_iter(names.iter().map(String::as_str)).join("; ");
        let short: BTreeSet<String> = self.revisions.iter().map(|name| name.chars().take(8).collect()).collect();
        [list(&self.dates), list(&self.machines), list(&short), format!("{:.0}", self.seconds / 60.0)]
    }
}

/// The date (UTC), such as 2026-11-22, as the system's `date` tells it; "unknown" where there is none.
pub(crate) fn today() -> String {
    let said = Command::new("date").args(["-u", "+%F"]).output();
    said.map_or_else(|_| "unknown".to_owned(), |said| String::from_utf8_lossy(&said.stdout).trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_date_is_year_month_and_day() {
        let date = today();
        let parts: Vec<u32> = date.split('-').map(|part| part.parse().unwrap()).collect();
        assert!(matches!(parts[..], [2026..=9999, 1..=12, 1..=31]) && date.len() == 10, "{date}");
    }

    #[test]
    fn every_section_that_measures_has_sources_of_its_own() {
        let hashes = crate::sections::SECTIONS.each_ref().map(|section| blake3_of(section.name));
        assert!(!hashes.contains(&"unknown"), "{hashes:?}");
        assert_eq!(BTreeSet::from(hashes).len(), hashes.len());
    }

    #[test]
    fn where_something_was_measured_is_told_once() {
        let mut provenance = Provenance::default();
        assert_eq!(provenance.words(), None);
        for (machine, date) in [("b", "2026-11-23"), ("a", "2026-11-22"), ("b", "2026-11-24")] {
            provenance.add(machine, "abc", Some(date), 30.0);
        }
        let words = provenance.words().unwrap();
        assert_eq!(words, "Measured from 2026-11-22 to 2026-11-24 in 2 minutes, machine: a; b, revision: abc.");
        let page = format!(
            "<p>Before.</p><p>{words}</p><h2>Next</h2><p>Measured in 3 minutes, machine: c, revision: 0123456789 (sources 1).</p>"
        );
        assert_eq!(Provenance::of_page(&page).texts(), ["2026-11-22; 2026-11-24", "a; b; c", "01234567; abc", "5"]);
    }
}

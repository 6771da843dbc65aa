//! Whether two runs have measured the same: everything but times.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context as _, Result};
use evaluation::precision::GivenUp;
use serde::Deserialize;
use terminal::say;
use toml::Value;

use crate::Outcome;
use crate::cells::{FullKey, Record, SCHEMA_VERSION};

/// Names of what depends on the clock, with all that is below them; so does what ends in "_us" or "_s", but for [`STEP`].
const TIMES: &str =
    "contact_share direct_projection inference_ratio median_us projection ratio seconds time total yardstick";
/// The time step, which is given.
const STEP: &str = "dt_s";
/// Differences of a section that are shown.
const SHOWN: usize = 10;
/// Characters of a value that are shown.
const SHORT: usize = 60;

/// A cell's file, whatever it is of.
#[derive(Deserialize)]
struct Stored {
    key: FullKey<Value>,
    value: Record<Value>,
}

/// The cells of a run by section and cell, whatever program and networks they were measured with.
fn cells(folder: &Path) -> Result<BTreeMap<[String; 2], Value>> {
    let mut cells = BTreeMap::new();
    for section in entries(folder)?.iter().filter(|path| path.is_dir()) {
        for file in entries(section)?.iter().filter(|path| path.extension().is_some_and(|end| end == "toml")) {
            let bytes = std::fs::read(file).with_context(|| format!("cannot read {}", file.display()))?;
            let Stored { key, value } = export::unseal(file, &bytes, SCHEMA_VERSION)?;
            cells.insert([key.section, key.cell.to_string()], value.value);
        }
    }
    Ok(cells)
}

fn entries(folder: &Path) -> Result<Vec<std::path::PathBuf>> {
    let read = || std::fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<std::io::Result<_>>();
    read().with_context(|| format!("cannot read {}", folder.display()))
}

/// Says what differs between two runs, by their folders of cells. Returns whether nothing does.
pub(crate) fn runs(folders: [&Path; 2]) -> Result<Outcome> {
    let [first, mut second] = [cells(folders[0])?, cells(folders[1])?];
    let (mut in_both, mut alone, mut differences) = (0, 0, Vec::new());
    for ([section, cell], value) in first {
        match second.remove(&[section.clone(), cell.clone()]) {
            Some(other) => {
                in_both += 1;
                compare(&format!("{section} {cell}: value"), [&value, &other], &mut differences);
            }
            None => alone += 1,
        }
    }
    alone += second.len();
    say!("{in_both} cells in both, {alone} in one alone; {} differences beside times", differences.len())?;
    for difference in differences.iter().take(SHOWN) {
        terminal::complain(format_args!("{difference}"));
    }
    Ok(if differences.is_empty() { Outcome::Done } else { Outcome::Faulty })
}

/// Adds what differs in two values at a place, beside times and what was given up because it took too long.
fn compare(place: &str, [first, second]: [&Value; 2], differences: &mut Vec<String>) {
    let is_listed = |name: &str| TIMES.split(' ').any(|time| time == name);
    let is_time = |name: &str| name != STEP && (name.ends_with("_us") || name.ends_with("_s") || is_listed(name));
    match (first, second) {
        _ if took_too_long(first) || took_too_long(second) => {}
        (Value::Table(a), Value::Table(b)) if a.keys().eq(b.keys()) => {
            for ((name, a), b) in a.iter().zip(b.values()).filter(|((name, _), _)| !is_time(name)) {
                compare(&format!("{place}.{name}"), [a, b], differences);
            }
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            for (k, (a, b)) in a.iter().zip(b).enumerate() {
                compare(&format!("{place}.{k}"), [a, b], differences);
            }
        }
        (Value::Float(a), Value::Float(b)) if a.is_nan() && b.is_nan() => {}
        _ if first == second => {}
        _ => {
            let [first, second] =
                [first, second].map(|value| value.to_string().chars().take(SHORT).collect::<String>());
            differences.push(format!("{place}: {first} and {second}"));
        }
    }
}

/// Whether something was given up for the time that it took, as [`GivenUp::OverBudget`].
fn took_too_long(value: &Value) -> bool {
    let Some(parts) = value.get("given_up").and_then(Value::as_array) else { return false };
    Value::try_from(GivenUp::OverBudget).is_ok_and(|over_budget| parts.contains(&over_budget))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn differences(first: &str, second: &str) -> Vec<String> {
        let [first, second] = [first, second].map(|text| toml::from_str::<Value>(text).unwrap());
        let mut differences = Vec::new();
        compare("a", [&first, &second], &mut differences);
        differences
    }

    #[test]
    fn all_but_times_has_to_be_the_same() {
        let same = differences("x = nan\ntime = 1.0\nsolve_s = 2.0", "x = nan\ntime = 3.0\nsolve_s = 1.0");
        assert!(same.is_empty(), "{same:?}");
        for (first, second) in [
            ("x = 1.0", "x = 1.0000000000000002"),
            ("dt_s = 0.1", "dt_s = 0.2"),
            ("x = [1, 2]", "x = [1]"),
            ("[[list]]\nx = 1", "[[list]]\nx = 2"),
            ("x = 1", "y = 1"),
        ] {
            assert_eq!(differences(first, second).len(), 1, "{first}");
        }
        let over = "[[list]]\ngiven_up = [3, \"OverBudget\"]\nx = 1";
        assert!(differences(over, "[[list]]\nx = 2").is_empty());
        assert_eq!(differences(&over.replace("OverBudget", "Stopped"), "[[list]]\nx = 2").len(), 1);
        assert_eq!(differences("[[list]]\nx = 1", "[[list]]\nx = 2"), ["a.list.0.x: 1 and 2"]);
    }
}

//! Whether two runs have measured the same: everything but times.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context as _, Result};
use evaluation::precision::GivenUp;
use serde::Deserialize;
use terminal::say;
use toml::Value;

use crate::cells::{FullKey, Record, SCHEMA_VERSION};
use crate::outcome::Outcome;

/// Names of what depends on the clock, with all that is below them; so does what ends in "_us" or "_s", but for the time
/// step "dt_s", which is given.
const TIMES: &str =
    "contact_share direct_projection inference_ratio median_us projection ratio seconds time total yardstick";
/// Differences of a section that are shown.
const SHOWN: usize = 10;

/// A cell's file, whatever it is of.
#[derive(Deserialize)]
struct Stored {
    key: FullKey<Value>,
    value: Record<Value>,
}

/// The cells of a run by section and cell, whatever program and networks they were measured with.
fn cells(folder: &Path) -> Result<BTreeMap<[String; 2], Value>> {
    let mut all = BTreeMap::new();
    for entry in folder.read_dir().with_context(|| format!("cannot read {}", folder.display()))? {
        let path = entry?.path();
        if path.is_dir() {
            all.append(&mut cells(&path)?);
        } else if path.extension().is_some_and(|end| end == "toml") {
            let bytes = std::fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
            let Stored { key, value } = export::unseal(&path, &bytes, SCHEMA_VERSION)?;
            all.insert([key.section, key.cell.to_string()], value.value);
        }
    }
    Ok(all)
}

/// Says what differs between two runs, by their folders of cells. Returns whether nothing does.
pub(crate) fn runs(folders: [&Path; 2]) -> Result<Outcome> {
    let [first, second] = [cells(folders[0])?, cells(folders[1])?];
    let (mut in_both, mut differences) = (0, Vec::new());
    for (key, value) in &first {
        if let Some(other) = second.get(key) {
            in_both += 1;
            compare(&format!("{}: value", key.join(" ")), [value, other], &mut differences);
        }
    }
    let alone = first.len() + second.len() - 2 * in_both;
    say!("{in_both} cells in both, {alone} in one alone; {} differences beside times", differences.len())?;
    for difference in differences.iter().take(SHOWN) {
        terminal::complain(format_args!("{difference}"));
    }
    Ok(if differences.is_empty() { Outcome::Done } else { Outcome::Faulty })
}

/// Adds what differs in two values at a place, beside times and what was given up because it took too long.
fn compare(place: &str, [first, second]: [&Value; 2], differences: &mut Vec<String>) {
    let is_time = |name: &str| {
        TIMES.split(' ').any(|time| time == name) || name.ends_with("_us") || (name.ends_with("_s") && name != "dt_s")
    };
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
        _ => differences.push(format!("{place}: {:.60} and {:.60}", first.to_string(), second.to_string())),
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

//! Whether two runs of the report agree: in everything but times, and in the order of times.

use std::collections::BTreeMap;
use std::fmt;

use evaluation::precision::GivenUp;
use serde::Serialize;
use toml::Value;

/// Names of what depends on the clock, with all that is below them; so does what ends in "_us" or "_s", but for [`STEP`].
const TIMES: [&str; 11] = [
    "contact_share",
    "direct_projection",
    "guess_share",
    "inference_ratio",
    "median_us",
    "projection",
    "ratio",
    "seconds",
    "time",
    "total",
    "yardstick",
];
/// The time step, which is given.
const STEP: &str = "dt_s";
/// Times that are nearer to each other than by this factor have no order.
const APART: f64 = 1.25;
/// Times of a sort that are compared each with each; of more, as many that lie evenly among them.
const MOST: usize = 2000;

/// Two values at the same place of two runs.
type Pair = [f64; 2];

/// What two runs of a section have in common.
#[derive(Debug, Default)]
pub(crate) struct Agreement {
    /// Cells that both have.
    cells: usize,
    /// Cells that one of them has.
    alone: usize,
    /// Parts that one of them gave up because they took too long: how far they came depends on the clock.
    given_up: usize,
    /// Places with different values that are no times.
    differences: Vec<String>,
    /// Times by their sort: the place without its numbers.
    times: BTreeMap<String, Vec<Pair>>,
}

impl Agreement {
    /// Adds a cell that one run alone has.
    pub(crate) fn add_alone(&mut self) {
        self.alone += 1;
    }

    /// Adds a cell of both runs; `name` says which.
    ///
    /// # Errors
    /// If a value has no form in TOML.
    pub(crate) fn add(&mut self, name: &str, values: [&impl Serialize; 2]) -> Result<(), toml::ser::Error> {
        let [first, second] = [Value::try_from(values[0])?, Value::try_from(values[1])?];
        self.cells += 1;
        self.compare(&mut Place { cell: name, path: Vec::new(), is_time: false }, &first, &second);
        Ok(())
    }

    /// What differs beside times, one line each.
    pub(crate) fn differences(&self) -> &[String] {
        &self.differences
    }

    fn compare(&mut self, place: &mut Place<'_>, first: &Value, second: &Value) {
        if !place.is_time && [first, second].into_iter().any(took_too_long) {
            self.given_up += 1;
            return;
        }
        match (first, second) {
            (Value::Table(a), Value::Table(b)) if place.is_time || a.keys().eq(b.keys()) => {
                for (key, a) in a {
                    let Some(b) = b.get(key) else { continue };
                    let before = place.enter(key.clone());
                    self.compare(place, a, b);
                    place.leave(before);
                }
            }
            (Value::Array(a), Value::Array(b)) if place.is_time || a.len() == b.len() => {
                for (k, (a, b)) in a.iter().zip(b).enumerate() {
                    let before = place.enter(k.to_string());
                    self.compare(place, a, b);
                    place.leave(before);
                }
            }
            _ if place.is_time => {
                if let (Some(a), Some(b)) = (number(first), number(second)) {
                    self.times.entry(place.sort()).or_default().push([a, b]);
                }
            }
            _ if is_same(first, second) => {}
            _ => self.differences.push(format!("{place}: {} and {}", short(first), short(second))),
        }
    }

    /// Pairs of times that lie apart in the first run, and how many of them have the same order in the second.
    fn order(&self) -> [usize; 2] {
        let (mut apart, mut same) = (0, 0);
        for times in self.times.values() {
            let some: Vec<Pair> = times.iter().step_by(times.len().div_ceil(MOST)).copied().collect();
            for (k, a) in some.iter().enumerate() {
                for b in &some[..k] {
                    let [low, high] = if a[0] < b[0] { [a, b] } else { [b, a] };
                    if low[0] > 0.0 && high[0] > APART * low[0] {
                        apart += 1;
                        same += usize::from(high[1] > low[1]);
                    }
                }
            }
        }
        [apart, same]
    }
}

impl fmt::Display for Agreement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { cells, alone, given_up, differences, .. } = self;
        write!(f, "{cells} cells in both, {alone} in one alone; {} differences beside times", differences.len())?;
        if *given_up > 0 {
            write!(f, "; {given_up} parts left out that took too long in one of them")?;
        }
        match self.order() {
            [0, _] => Ok(()),
            [apart, same] => {
                let share = 100.0 * same as f64 / apart as f64;
                write!(f, "; of {apart} pairs of times that are {APART} times apart, {share:.1} % have the same order")
            }
        }
    }
}

/// A place in the value of a cell.
struct Place<'a> {
    cell: &'a str,
    path: Vec<String>,
    is_time: bool,
}

impl Place<'_> {
    /// Goes into a part; what it returns leads back.
    fn enter(&mut self, name: String) -> bool {
        let before = self.is_time;
        let is_duration = (name.ends_with("_us") || name.ends_with("_s")) && name != STEP;
        self.is_time |= is_duration || TIMES.contains(&name.as_str());
        self.path.push(name);
        before
    }

    fn leave(&mut self, before: bool) {
        self.path.pop();
        self.is_time = before;
    }

    /// The path without places in lists.
    fn sort(&self) -> String {
        let names = self.path.iter().filter(|part| part.parse::<usize>().is_err());
        names.map(String::as_str).collect::<Vec<_>>().join(".")
    }
}

impl fmt::Display for Place<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.cell, self.path.join("."))
    }
}

/// Whether something was given up for the time that it took, as [`GivenUp::OverBudget`].
fn took_too_long(value: &Value) -> bool {
    let Some(parts) = value.get("given_up").and_then(Value::as_array) else { return false };
    Value::try_from(GivenUp::OverBudget).is_ok_and(|over_budget| parts.contains(&over_budget))
}

fn number(value: &Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|integer| integer as f64))
}

/// Whether two leaves are the same, NaN like NaN.
fn is_same(first: &Value, second: &Value) -> bool {
    first == second || matches!((first, second), (Value::Float(a), Value::Float(b)) if a.is_nan() && b.is_nan())
}

/// A value in a few words.
fn short(value: &Value) -> String {
    match value {
        Value::Array(array) => format!("a list of {}", array.len()),
        Value::Table(table) => format!("{:?}", table.keys().collect::<Vec<_>>()),
        leaf => leaf.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn agreement(cells: &[[&str; 2]]) -> Agreement {
        let mut agreement = Agreement::default();
        for texts in cells {
            let [first, second] = texts.map(|text| toml::from_str::<Value>(text).unwrap());
            agreement.add("a", [&first, &second]).unwrap();
        }
        agreement
    }

    #[test]
    fn all_but_times_has_to_be_the_same() {
        let same = agreement(&[["x = nan\ntime = 1.0\nsolve_s = 2.0", "x = nan\ntime = 3.0\nsolve_s = 1.0"]]);
        assert!(same.differences().is_empty(), "{:?}", same.differences());
        for (first, second) in [
            ("x = 1.0", "x = 1.0000000000000002"),
            ("dt_s = 0.1", "dt_s = 0.2"),
            ("x = [1, 2]", "x = [1]"),
            ("[[list]]\nx = 1", "[[list]]\nx = 2"),
            ("x = 1", "y = 1"),
        ] {
            assert_eq!(agreement(&[[first, second]]).differences().len(), 1, "{first}");
        }
        let over = "[[list]]\ngiven_up = [3, \"OverBudget\"]\nx = 1";
        let left_out = agreement(&[[over, "[[list]]\nx = 2"]]);
        assert_eq!((left_out.differences().len(), left_out.given_up), (0, 1));
        let stopped = over.replace("OverBudget", "Stopped");
        assert_eq!(agreement(&[[stopped.as_str(), "[[list]]\nx = 2"]]).differences().len(), 1);
        let named = agreement(&[["[[list]]\nx = 1", "[[list]]\nx = 2"]]);
        assert_eq!(named.differences(), ["a: list.0.x: 1 and 2"]);
    }

    #[test]
    fn times_are_ordered_where_they_lie_apart() {
        let of = |second: [&str; 3]| {
            let cells = ["time = 1.0", "time = 1.1", "time = 2.0"].into_iter().zip(second);
            agreement(&cells.map(|(first, second)| [first, second]).collect::<Vec<_>>()).order()
        };
        assert_eq!(of(["time = 5.0", "time = 4.0", "time = 9.0"]), [2, 2]);
        assert_eq!(of(["time = 5.0", "time = 4.0", "time = 4.5"]), [2, 1]);
        // Times of different sorts have no order.
        assert_eq!(agreement(&[["time = 1.0\n[total]\nx = 3.0", "time = 1.0\n[total]\nx = 0.5"]]).order(), [0, 0]);
    }
}

//! Smaller cases that still break a law.

use solver::formulation::Formulation;
use solver::integrator::Integrator;
use solver::linear::solvers::SolverKind;
use toml::{Table, Value};

use crate::case::Case;
use crate::check::{Pools, check_in};
use crate::laws::{Broken, Law};
use crate::random::short;

/// Runs at most that look for a smaller case.
const RUNS: usize = 400;

/// The smallest case found that breaks the law as `case` does, and how it does: parts of the scene file are left out, counts
/// made smaller and numbers shorter, one after the other, as long as that goes on.
///
/// # Errors
/// If the system gives no threads.
pub fn shrink(case: &Case, law: Law) -> Result<(Case, Option<Broken>), rayon::ThreadPoolBuildError> {
    Ok(shrink_in(case, law, &Pools::new()?, &|| false))
}

/// The same in pools that are there, until it is to stop.
pub(crate) fn shrink_in(case: &Case, law: Law, pools: &Pools, stop: &dyn Fn() -> bool) -> (Case, Option<Broken>) {
    let mut best = case.clone();
    let mut how = check_in(&best, pools).breaks(law).cloned();
    if how.is_none() {
        return (best, how);
    }
    let mut left = RUNS;
    let mut take = |best: &mut Case, candidate: Case| {
        if left == 0 || stop() || candidate == *best {
            return false;
        }
        left -= 1;
        let found = check_in(&candidate, pools).breaks(law).cloned();
        let Some(found) = found else { return false };
        how = Some(found);
        *best = candidate;
        true
    };
    loop {
        let mut goes_on = false;
        for simpler in ways(&best) {
            goes_on |= take(&mut best, simpler);
        }
        let mut k = 0;
        // What is taken out makes place for the next part.
        while let Some(path) = paths(&best).get(k).cloned() {
            let smaller = edited(&best, |table| remove(table, &path));
            if smaller.is_some_and(|smaller| take(&mut best, smaller)) {
                goes_on = true;
            } else {
                k += 1;
            }
        }
        for path in paths(&best) {
            for change in [halved, shorter] {
                let smaller = edited(&best, |table| change_at(table, &path, change));
                goes_on |= smaller.is_some_and(|smaller| take(&mut best, smaller));
            }
        }
        if !goes_on {
            let used = best.files.iter().filter(|(name, _)| best.text.contains(name.as_str())).cloned().collect();
            best.files = used;
            return (best, how);
        }
    }
}

/// Simpler ways to solve it.
fn ways(case: &Case) -> Vec<Case> {
    let mut all = Vec::new();
    let mut add = |change: &dyn Fn(&mut Case)| {
        let mut other = case.clone();
        change(&mut other);
        all.push(other);
    };
    add(&|case| case.way.solver = SolverKind::Direct);
    add(&|case| case.way.integrator = Integrator::Euler);
    add(&|case| case.way.formulation = Formulation::XpbdGeometric);
    all
}

/// A step into a document.
#[derive(Clone, Debug)]
enum Part {
    Key(String),
    Index(usize),
}

/// All places of a document, the outer ones first, but for its root.
fn paths(case: &Case) -> Vec<Vec<Part>> {
    let Ok(table) = case.text.parse::<Table>() else { return Vec::new() };
    let mut level = vec![(Vec::new(), Value::Table(table))];
    let mut all = Vec::new();
    while !level.is_empty() {
        let mut next = Vec::new();
        for (path, value) in level {
            let mut add = |part: Part, value: Value| {
                let mut longer: Vec<Part> = path.clone();
                longer.push(part);
                all.push(longer.clone());
                next.push((longer, value));
            };
            match value {
                Value::Table(table) => table.into_iter().for_each(|(key, value)| add(Part::Key(key), value)),
                Value::Array(list) => {
                    list.into_iter().enumerate().rev().for_each(|(k, value)| add(Part::Index(k), value))
                }
                _ => {}
            }
        }
        level = next;
    }
    all
}

/// The case with its document changed; `None` where the change does nothing.
fn edited(case: &Case, change: impl FnOnce(&mut Value) -> Option<()>) -> Option<Case> {
    let mut root = Value::Table(case.text.parse::<Table>().ok()?);
    change(&mut root)?;
    let text = toml::to_string(&root).ok()?;
    Some(Case { text, ..case.clone() })
}

fn at<'a>(mut value: &'a mut Value, path: &[Part]) -> Option<&'a mut Value> {
    for part in path {
        value = match part {
            Part::Key(key) => value.get_mut(key.as_str())?,
            Part::Index(k) => value.get_mut(*k)?,
        };
    }
    Some(value)
}

fn remove(root: &mut Value, path: &[Part]) -> Option<()> {
    let (last, rest) = path.split_last()?;
    match (at(root, rest)?, last) {
        (Value::Table(table), Part::Key(key)) => table.remove(key).map(|_| ()),
        (Value::Array(list), Part::Index(k)) if *k < list.len() => {
            // Numbers of vectors are no parts.
            if list.iter().all(|item| item.is_float() || item.is_integer()) {
                return None;
            }
            list.remove(*k);
            Some(())
        }
        _ => None,
    }
}

fn change_at(root: &mut Value, path: &[Part], change: fn(&Value) -> Option<Value>) -> Option<()> {
    let value = at(root, path)?;
    let other = change(value)?;
    if other == *value {
        return None;
    }
    *value = other;
    Some(())
}

/// Half of a whole number above 1.
fn halved(value: &Value) -> Option<Value> {
    value.as_integer().filter(|&count| count > 1).map(|count| Value::Integer(count / 2))
}

/// A number to one digit.
fn shorter(value: &Value) -> Option<Value> {
    let number = value.as_float()?;
    let rounded: f64 = format!("{:.0e}", short(number)).parse().ok()?;
    Some(Value::Float(rounded))
}

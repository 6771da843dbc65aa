//! Smaller cases that still break a law.

use cosserat::simulation::{Formulation, Integrator, SolverKind};
use toml::{Table, Value};

use crate::case::{Case, Method};
use crate::check::check;
use crate::law::Violation;

/// Runs at most that look for a smaller case.
const RUNS: usize = 400;

/// The smallest case found that breaks the law as `case` does, by the square root of its ratio at least, and how: parts of the scene file are left out, counts
/// made smaller and numbers shorter, one after the other, as long as that goes on (delta debugging: Zeller and Hildebrandt 2002).
pub fn shrink(case: &Case, violation: &Violation) -> (Case, Violation) {
    let is_clear = |other: &&Violation| other.ratio >= violation.ratio.sqrt();
    minimal(case, violation.clone(), &|case| check(case).breaks(violation.law).filter(is_clear).cloned())
}

/// The smallest case found for which `breaks` gives something, as it does for `case`: `how`.
fn minimal<T>(case: &Case, mut how: T, breaks: &dyn Fn(&Case) -> Option<T>) -> (Case, T) {
    let (mut best, mut left) = (case.clone(), RUNS);
    let mut take = |best: &mut Case, candidate: Option<Case>| {
        let Some(candidate) = candidate.filter(|candidate| left > 0 && candidate != best) else { return false };
        left -= 1;
        let Some(found) = breaks(&candidate) else { return false };
        (*best, how) = (candidate, found);
        true
    };
    loop {
        let mut goes_on = false;
        for method in simpler(best.method) {
            let candidate = Some(Case { method, ..best.clone() });
            goes_on |= take(&mut best, candidate);
        }
        let mut k = 0;
        // What is taken out makes place for the next part.
        while let Some(path) = paths(&best).get(k) {
            let candidate = edited(&best, |table| remove(table, path));
            if take(&mut best, candidate) { goes_on = true } else { k += 1 }
        }
        for path in paths(&best) {
            for change in [halved, shorter] {
                let candidate = edited(&best, |table| {
                    let value = at(table, &path)?;
                    *value = change(value)?;
                    Some(())
                });
                goes_on |= take(&mut best, candidate);
            }
        }
        if !goes_on {
            best.files.retain(|(name, _)| best.text.contains(name.as_str()));
            return (best, how);
        }
    }
}

/// Simpler methods to solve it.
fn simpler(method: Method) -> [Method; 3] {
    [
        Method { solver: SolverKind::Direct, ..method },
        Method { integrator: Integrator::Euler, ..method },
        Method { formulation: Formulation::default(), ..method },
    ]
}

/// A step into a document.
#[derive(Clone, Debug)]
enum Part {
    Key(String),
    Index(usize),
}

/// All places of a document, the outer ones first, but for its root.
fn paths(case: &Case) -> Vec<Vec<Part>> {
    fn below(value: &Value, path: &[Part], all: &mut Vec<Vec<Part>>) {
        let parts: Vec<(Part, &Value)> = match value {
            Value::Table(table) => table.iter().map(|(key, value)| (Part::Key(key.clone()), value)).collect(),
            Value::Array(list) => list.iter().enumerate().rev().map(|(k, value)| (Part::Index(k), value)).collect(),
            _ => Vec::new(),
        };
        for (part, value) in parts {
            let path = [path, &[part]].concat();
            all.push(path.clone());
            below(value, &path, all);
        }
    }
    let mut all = Vec::new();
    if let Ok(table) = case.text.parse() {
        below(&Value::Table(table), &[], &mut all);
    }
    all.sort_by_key(Vec::len);
    all
}

/// The case with its document changed; `None` where the change does nothing.
fn edited(case: &Case, change: impl FnOnce(&mut Value) -> Option<()>) -> Option<Case> {
    let mut root = Value::Table(case.text.parse::<Table>().ok()?);
    change(&mut root)?;
    Some(Case { text: toml::to_string(&root).ok()?, ..case.clone() })
}

fn at<'a>(root: &'a mut Value, path: &[Part]) -> Option<&'a mut Value> {
    path.iter().try_fold(root, |value, part| match part {
        Part::Key(key) => value.get_mut(key.as_str()),
        Part::Index(k) => value.get_mut(*k),
    })
}

fn remove(root: &mut Value, path: &[Part]) -> Option<()> {
    let (last, rest) = path.split_last()?;
    match (at(root, rest)?, last) {
        (Value::Table(table), Part::Key(key)) => table.remove(key).map(|_| ()),
        // Numbers of vectors are no parts.
        (Value::Array(list), Part::Index(_)) if list.iter().all(|item| item.is_float() || item.is_integer()) => None,
        (Value::Array(list), Part::Index(k)) => (*k < list.len()).then(|| drop(list.remove(*k))),
        _ => None,
    }
}

/// Half of a whole number above 1.
fn halved(value: &Value) -> Option<Value> {
    value.as_integer().filter(|&count| count > 1).map(|count| Value::Integer(count / 2))
}

/// A number to one digit.
fn shorter(value: &Value) -> Option<Value> {
    let rounded = format!("{:.0e}", value.as_float()?).parse().ok()?;
    Some(Value::Float(rounded))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_matter_is_left_out() {
        let text = "[contact]\nfriction = 0.3\n[[obstacles]]\nshape.plane = { point_m = [0, 0, -1] }\n[[rods]]\nradius_m = 0.0123\n\
                    shape.straight = { length_m = 1, segments = 16 }\n[[rods]]\nclamp = [\"start-face\"]\nradius_m = 0.0456\n\
                    shape.helix = { radius_m = 0.1, height_m = 1.234, winding = 2, segments = 9 }\n";
        let method = Method { formulation: Formulation::Xpbd, integrator: Integrator::Bdf2, ..Method::default() };
        let case = Case { text: text.to_owned(), files: vec![("a.csv".to_owned(), String::new())], method };
        // The fault: a helix of two segments or more, with this integrator.
        let breaks = |case: &Case| {
            let table: Table = case.text.parse().ok()?;
            let rods = table.get("rods")?.as_array()?;
            let segments = rods.iter().find_map(|rod| rod.get("shape")?.get("helix")?.get("segments")?.as_integer())?;
            (segments >= 2 && case.method.integrator == Integrator::Bdf2).then_some(())
        };
        let (small, ()) = minimal(&case, (), &breaks);
        assert_eq!(small.text, "[[rods]]\n\n[rods.shape.helix]\nsegments = 2\n");
        assert_eq!(small.method, Method { integrator: Integrator::Bdf2, ..Method::default() });
        assert!(small.files.is_empty());
    }
}

//! When training has paid for itself: a number that outsiders ask for and the paper does not give.

use super::speedup::{SceneRun, WaySums};
use crate::guesses::Spread;

/// A guess against another way to simulate the same scenes.
#[derive(Clone, Debug, PartialEq)]
pub struct BreakEven {
    /// Name of the other way.
    pub against: String,
    /// Median over the runs of the time that the guess saves a step [s]; negative where it loses.
    pub saved_s: Option<f64>,
    /// Steps after which the training has paid for itself; `None` for never.
    pub steps: Option<u64>,
}

/// Steps after which a training of so long has paid for itself, by the time saved a step [s]; `None` for never.
pub fn steps(training_s: f64, saved_s: f64) -> Option<u64> {
    let steps = (training_s / saved_s).ceil();
    // A number too large for a whole one becomes the largest.
    (saved_s > 0.0 && steps >= 0.0).then_some(steps as u64)
}

/// Holds a guess that took so long to train [s] against all other ways of these runs; empty where no run has it. Runs in
/// which one of the two was given up are left out.
pub fn against(training_s: f64, runs: &[SceneRun], guess: &str) -> Vec<BreakEven> {
    let find = |run: &SceneRun, name: &str| -> Option<f64> {
        let is_it = |way: &&WaySums| way.name == name && way.given_up.is_none();
        run.ways.iter().find(is_it).map(|way| way.sums.total_s / run.steps as f64)
    };
    let others = runs.iter().flat_map(|run| run.ways.iter()).map(|way| way.name.as_str());
    let mut names: Vec<&str> = Vec::new();
    for name in others {
        if name != guess && !names.contains(&name) {
            names.push(name);
        }
    }
    let hold = |name: &str| {
        let saved = runs.iter().filter_map(|run| Some(find(run, name)? - find(run, guess)?));
        let saved_s = Spread::of(saved).map(|spread| spread.median);
        let steps = saved_s.and_then(|saved_s| steps(training_s, saved_s));
        BreakEven { against: name.to_owned(), saved_s, steps }
    };
    if runs.iter().all(|run| find(run, guess).is_none()) {
        return Vec::new();
    }
    names.into_iter().map(hold).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::Cost;

    #[test]
    fn a_training_pays_only_where_time_is_saved() {
        assert_eq!(steps(3600.0, 1e-3), Some(3_600_000));
        assert_eq!(steps(1.0, 0.3), Some(4));
        assert_eq!((steps(1.0, 0.0), steps(1.0, -1e-6), steps(1.0, f64::NAN)), (None, None, None));
        assert_eq!((steps(0.0, 1e-6), steps(0.0, -1e-6)), (Some(0), None));
        assert_eq!(steps(f64::NAN, 1.0), None);
    }

    #[test]
    fn a_guess_is_held_against_every_other_way() {
        let way = |name: &str, total_s| WaySums {
            name: name.to_owned(),
            status: "converged".to_owned(),
            given_up: None,
            sums: Cost { total_s, ..Cost::default() },
            error: None,
        };
        let run = |net: f64| SceneRun {
            steps: 100,
            segments: 3,
            ways: vec![way("zero", 5.0), way("net", net), way("direct", 1.0)],
        };
        let mut lost = run(4.0);
        lost.ways[0].given_up = Some(7);
        let found = against(60.0, &[run(4.0), run(3.0), run(4.5), lost], "net");
        assert_eq!(found.len(), 2);
        assert_eq!((found[0].against.as_str(), found[0].steps), ("zero", Some(6000)));
        assert!((found[0].saved_s.unwrap() - 0.01).abs() < 1e-12);
        assert_eq!((found[1].against.as_str(), found[1].steps), ("direct", None));
        assert!(found[1].saved_s.unwrap() < 0.0);
        assert!(against(60.0, &[run(4.0)], "another").is_empty());
    }
}

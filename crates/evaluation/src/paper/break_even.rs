//! When training has paid for itself: a number that outsiders ask for and the paper does not give.

use super::speedup::SceneRun;
use crate::guesses::Spread;

/// Steps after which a training of so long has paid for itself, by the time saved a step [s]; `None` for never.
pub fn steps(training_s: f64, saved_s: f64) -> Option<u64> {
    let steps = (training_s / saved_s).ceil();
    // A number too large for a whole one becomes the largest.
    (saved_s > 0.0 && steps >= 0.0).then_some(steps as u64)
}

/// Time of a step in the way of this name [s]; `None` where the run has no such way, or it was given up.
pub fn step_s(run: &SceneRun, way: &str) -> Option<f64> {
    let own = run.ways.iter().find(|own| own.name == way && own.given_up.is_none())?;
    Some(own.sums.total_s / run.steps as f64)
}

/// Median over the runs of the time that a guess saves a step against another way [s], negative where it loses. Runs in
/// which one of the two was given up are left out.
pub fn saved_s(runs: &[SceneRun], guess: &str, against: &str) -> Option<f64> {
    let saved = runs.iter().filter_map(|run| Some(step_s(run, against)? - step_s(run, guess)?));
    Some(Spread::of(saved)?.median)
}

#[cfg(test)]
mod tests {
    use super::super::speedup::WaySums;
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
    fn a_guess_is_held_against_other_ways() {
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
        let runs = [run(4.0), run(3.0), run(4.5), lost];
        assert!((saved_s(&runs, "net", "zero").unwrap() - 0.01).abs() < 1e-12);
        assert!(saved_s(&runs, "net", "direct").unwrap() < 0.0);
        assert_eq!((saved_s(&runs, "another", "zero"), step_s(&runs[3], "zero")), (None, None));
    }
}

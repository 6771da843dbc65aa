//! Times that other programs on the same machine do not lengthen.

use std::time::Instant;

use crate::clock::thread_time;
use crate::guesses::Spread;

/// What `f` returns, and the share of the wall's time in which this thread ran meanwhile; 1 where it is not known, or where
/// the thread has others beside it.
pub(super) fn with_share<T>(f: impl FnOnce() -> T) -> (T, f64) {
    let (own, wall) = (thread_time(), Instant::now());
    let value = f();
    let wall = wall.elapsed().as_secs_f64();
    let is_known = rayon::current_num_threads() == 1 && wall > 0.0;
    let own = own.zip(thread_time()).filter(|_| is_known);
    (value, own.map_or(1.0, |(before, now)| ((now - before).as_secs_f64() / wall).min(1.0)))
}

/// Time of a run, in units of `unit` [s], by the times [s] of its turns: a list a repetition, all of them complete; `None`
/// without repetitions. An interruption spoils a turn, not a run: so each turn has its median and quartiles over the
/// repetitions, and a run their sums.
pub(super) fn of_run(repetitions: &[Vec<f64>], unit: f64) -> Option<Spread> {
    let mut sum = Spread { mean: 0.0, lower: 0.0, median: 0.0, upper: 0.0 };
    for turn in 0..repetitions.first()?.len() {
        let turn = Spread::of(repetitions.iter().map(|turns| turns[turn] / unit))?;
        sum.mean += turn.mean;
        sum.lower += turn.lower;
        sum.median += turn.median;
        sum.upper += turn.upper;
    }
    Some(sum)
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn an_interruption_spoils_a_turn_alone() {
        assert_eq!(of_run(&[], 1.0), None);
        let turns = [[1.0, 2.0, 90.0], [1.0, 50.0, 3.0], [70.0, 2.0, 3.0]].map(|times| times.to_vec());
        let spread = of_run(&turns, 2.0).unwrap();
        assert_eq!((spread.median, spread.lower), (3.0, 3.0));
        assert_eq!(spread.mean, 222.0 / 3.0 / 2.0);
    }

    #[test]
    fn a_thread_that_sleeps_does_not_run() {
        let asleep = || {
            let ((), share) = with_share(|| std::thread::sleep(Duration::from_millis(20)));
            share
        };
        let share = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(asleep);
        assert!(share(1) < if cfg!(unix) { 0.9 } else { 1.1 });
        assert_eq!(share(2), 1.0);
    }
}

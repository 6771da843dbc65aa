//! Times that other programs on the same machine do not lengthen.

use std::time::{Duration, Instant};

use crate::guesses::Spread;

/// A moment on the wall's clock and on the thread's own.
pub(super) struct Moment {
    own: Option<Duration>,
    wall: Instant,
}

impl Moment {
    pub(super) fn now() -> Self {
        let own = thread_time();
        Self { own, wall: Instant::now() }
    }

    /// Of the wall's time since then, the share in which this thread ran; 1 where it is not known, or where the thread
    /// has others beside it.
    pub(super) fn share(&self) -> f64 {
        let wall = self.wall.elapsed().as_secs_f64();
        match self.own.zip(thread_time()) {
            Some((before, now)) if rayon::current_num_threads() == 1 && wall > 0.0 => {
                ((now - before).as_secs_f64() / wall).min(1.0)
            }
            _ => 1.0,
        }
    }
}

/// For how long this thread has run.
#[cfg(unix)]
fn thread_time() -> Option<Duration> {
    use rustix::time::{ClockId, clock_gettime};

    clock_gettime(ClockId::ThreadCPUTime).try_into().ok()
}

/// For how long this thread has run: not known here.
#[cfg(not(unix))]
fn thread_time() -> Option<Duration> {
    None
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
            let start = Moment::now();
            std::thread::sleep(Duration::from_millis(20));
            start.share()
        };
        let share = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(asleep);
        assert!(share(1) < if cfg!(unix) { 0.9 } else { 1.1 });
        assert_eq!(share(2), 1.0);
    }
}

//! Pacing: when the next step is due, so that simulated time follows the clock.

use std::time::{Duration, Instant};

/// A simulation that is further behind catches up no more [s].
const BEHIND: f64 = 0.1;
/// Time over which the speed is measured [s].
const MEASURED: f64 = 0.5;

/// Follows the clock at some pace.
#[derive(Debug)]
pub(crate) struct Pacer {
    /// Simulated seconds a second.
    pace: f64,
    /// Where simulated time is to be when.
    origin: Option<(Instant, f64)>,
    /// When the speed was measured last, and the simulated time then.
    mark: Option<(Instant, f64)>,
    speed: f64,
}

impl Pacer {
    pub(crate) fn new() -> Self {
        Self { pace: 1.0, origin: None, mark: None, speed: f64::NAN }
    }

    pub(crate) fn pace(&self) -> f64 {
        self.pace
    }

    pub(crate) fn set_pace(&mut self, pace: f64) {
        self.pace = pace;
        self.stop();
    }

    /// Begins anew: time stood, or is another one.
    pub(crate) fn stop(&mut self) {
        (self.origin, self.mark, self.speed) = (None, None, f64::NAN);
    }

    /// Simulated seconds a second, as measured last; NaN before.
    pub(crate) fn speed(&self) -> f64 {
        self.speed
    }

    /// How long a step of `dt` [s] from simulated `time` [s] must wait.
    pub(crate) fn wait(&mut self, now: Instant, time: f64, dt: f64) -> Duration {
        let (since, begin) = *self.origin.get_or_insert((now, time));
        let target = begin + now.duration_since(since).as_secs_f64() * self.pace;
        let ahead = (time + dt - target) / self.pace;
        if ahead < -BEHIND {
            self.origin = Some((now, time));
        }
        Duration::from_secs_f64(ahead.clamp(0.0, 1.0))
    }

    /// Takes down that simulated time has come to `time` [s].
    pub(crate) fn came(&mut self, now: Instant, time: f64) {
        let (since, before) = *self.mark.get_or_insert((now, time));
        let elapsed = now.duration_since(since).as_secs_f64();
        if elapsed >= MEASURED {
            self.speed = (time - before) / elapsed;
            self.mark = Some((now, time));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_follow_the_clock_and_debts_are_forgotten() {
        let mut pacer = Pacer::new();
        let start = Instant::now();
        let at = |seconds: f64| start + Duration::from_secs_f64(seconds);
        let wait = |pacer: &mut Pacer, now: f64, time: f64| pacer.wait(at(now), time, 0.01).as_secs_f64();
        assert!((wait(&mut pacer, 0.0, 0.0) - 0.01).abs() < 1e-9);
        assert!((wait(&mut pacer, 0.004, 0.0) - 0.006).abs() < 1e-9);
        assert_eq!(wait(&mut pacer, 0.05, 0.02), 0.0);
        // A second behind: it goes on from there, without a rush.
        assert_eq!(wait(&mut pacer, 1.05, 0.03), 0.0);
        assert!((wait(&mut pacer, 1.05, 0.03) - 0.01).abs() < 1e-9);
        pacer.set_pace(0.5);
        assert!((wait(&mut pacer, 2.0, 0.03) - 0.02).abs() < 1e-9);
    }

    #[test]
    fn the_speed_is_simulated_time_over_time() {
        let mut pacer = Pacer::new();
        let start = Instant::now();
        assert!(pacer.speed().is_nan());
        for k in 0..=10 {
            pacer.came(start + Duration::from_millis(100 * k), 0.05 * k as f64);
        }
        assert!((pacer.speed() - 0.5).abs() < 1e-9);
    }
}

//! `--fps`: frames at exact times.

use std::fmt::{self, Display, Formatter};

use anyhow::{Result, bail};
use cosserat::scene::RunDefaults;

use crate::numbers::number;

/// Steps of a run, at most.
const MOST_STEPS: f64 = 1e12;
/// Share of a step by which a sum of steps may miss a time.
const ROUNDING: f64 = 1e-9;

/// Time step and steps of a run that has so many frames a second.
pub(crate) struct Rate {
    fps: f64,
    /// As it is run.
    pub(crate) run: RunDefaults,
    /// As it was asked for.
    asked: RunDefaults,
}

impl Rate {
    /// Of `fps` frames a second, with a time step that is no longer than the one asked for: frames are `every` so many whole steps
    /// apart. It takes as long as was asked for, and on to the next frame.
    ///
    /// # Errors
    /// If these are too many steps.
    pub(crate) fn new(fps: f64, asked: &RunDefaults) -> Result<Self> {
        let between = 1.0 / fps;
        let every = (between / asked.dt * (1.0 - ROUNDING)).ceil().max(1.0);
        let frames = (asked.dt * asked.steps as f64 * fps * (1.0 - ROUNDING)).ceil();
        let steps = frames * every;
        // False of what is not a number, too.
        if !(steps <= MOST_STEPS && between.is_finite()) {
            bail!("--fps {fps}: these are {} time steps, but it may be {MOST_STEPS:e} at most", number(steps));
        }
        let run = RunDefaults { dt: between / every, steps: steps as usize, every: every as usize, ..*asked };
        Ok(Self { fps, run, asked: *asked })
    }
}

impl Display for Rate {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self { fps, run, asked } = self;
        write!(f, "{fps} frames a second, a frame every {} steps", run.every)?;
        if (run.dt / asked.dt - 1.0).abs() > ROUNDING {
            write!(
                f,
                "; the time step is {} s instead of {} s, so that frames fall on steps",
                number(run.dt),
                asked.dt
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(fps: f64, dt: f64, steps: usize) -> (f64, usize, usize) {
        let Rate { run: RunDefaults { dt, steps, every, .. }, .. } =
            Rate::new(fps, &RunDefaults { dt, steps, every: 7, integrator: None }).unwrap();
        (dt, steps, every)
    }

    #[test]
    fn frames_fall_on_steps_that_are_no_longer_than_asked_for() {
        assert_eq!(of(24.0, 0.005, 400), (1.0 / 24.0 / 9.0, 48 * 9, 9));
        // Whole already, but for rounding.
        assert_eq!(of(25.0, 0.01, 100), (0.01, 100, 4));
        assert_eq!(of(10.0, 0.1, 10), (0.1, 10, 1));
        // Frames that are closer than steps.
        assert_eq!(of(100.0, 0.04, 10), (0.01, 40, 1));
        // On to the next frame after 0.1 s.
        assert_eq!(of(24.0, 0.05, 2), (1.0 / 24.0, 3, 1));
        assert_eq!(of(24.0, 0.05, 0).1, 0);
        assert!(Rate::new(1e300, &RunDefaults { dt: 1.0, steps: 5, every: 1, integrator: None }).is_err());
        assert!(Rate::new(1e-310, &RunDefaults { dt: 1.0, steps: 5, every: 1, integrator: None }).is_err());
    }
}

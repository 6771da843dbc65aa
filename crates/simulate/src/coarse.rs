//! Whether the time step is too long for what swings: how much of its energy the integrator takes in a period.

use std::f64::consts::PI;
use std::fmt::{self, Display, Formatter};

use cosserat::scene::Scene;
use cosserat::simulation::Integrator;
use cosserat::state::{Body, Joint, Mode, Model, Restoring};
use serde::Serialize;

use crate::measured::Measured;
use crate::numbers::{number, share};

/// Part of its energy that a swing may lose in a period before a run says so.
const MUCH: f64 = 0.2;
/// The part that it loses at the time step that is advised.
const LITTLE: f64 = 0.05;
/// Rods lighter than this share of the heaviest one do not count.
const LIGHT: f64 = 0.1;
/// Part of the energy at stake below which nothing that swung has been lost.
const UNMOVED: f64 = 1e-3;

/// A swing that the integrator damps much: the fastest of the rods' first modes, of rods that are not light.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct TooCoarse {
    rod: String,
    /// What pulls the rod back: bending, gravity or tension.
    mode: &'static str,
    /// An estimate, see [`Model::first_modes`].
    frequency_hz: f64,
    /// Part of its energy that the integrator takes in a period.
    lost_a_period: f64,
    #[serde(flatten)]
    loss: Loss,
}

/// What an integrator takes from a motion, and how to keep it.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Loss {
    /// Part of the energy that it takes in a period.
    #[serde(skip)]
    pub(crate) part: f64,
    /// The time step at which it takes a twentieth [s].
    advised_dt_s: f64,
    /// The same part with the integrator bdf2 at this time step, where that is another one.
    #[serde(skip_serializing_if = "Option::is_none")]
    lost_with_bdf2: Option<f64>,
    #[serde(skip)]
    integrator: &'static str,
    #[serde(skip)]
    dt: f64,
}

impl Loss {
    /// That of a motion with `x = w dt` in steps of `dt` [s], which loses so many `times` as much as an oscillation does; `None`
    /// where that is little.
    pub(crate) fn of(integrator: Integrator, x: f64, times: f64, dt: f64) -> Option<Self> {
        let lost = |integrator| lost(integrator, x, times);
        let part = lost(integrator);
        (part > MUCH).then(|| Self {
            part,
            advised_dt_s: allowed(integrator, LITTLE, times) * dt / x,
            lost_with_bdf2: (integrator != Integrator::Bdf2).then(|| lost(Integrator::Bdf2)),
            integrator: integrator.name(),
            dt,
        })
    }

    /// Says it in words; `what` it is taken from, and in what time.
    pub(crate) fn tell(&self, f: &mut Formatter<'_>, what: fmt::Arguments<'_>) -> fmt::Result {
        let Self { part, advised_dt_s, lost_with_bdf2, integrator, dt } = self;
        let [taken, little] = [*part, LITTLE].map(|part| 100.0 * part);
        write!(
            f,
            "time step: {integrator} at {dt:?} s takes about {taken:.0} % of {what}; --dt {} takes {little:.0} %",
            short(*advised_dt_s)
        )?;
        match lost_with_bdf2 {
            Some(with_bdf2) if with_bdf2 < part => write!(f, ", --integrator bdf2 {} %", share(100.0 * with_bdf2)),
            _ => Ok(()),
        }
    }
}

/// Part of the energy that an integrator takes in a period, by `x = w dt`, so many `times` what it takes from an oscillation of
/// angular frequency w: there its rate is `w^2 dt` with Euler's rule, `w^4 dt^3 / 2` with backward differences of second order.
fn lost(integrator: Integrator, x: f64, times: f64) -> f64 {
    let in_a_period = match integrator {
        Integrator::Euler => 2.0 * PI * x,
        Integrator::Bdf2 => PI * x.powi(3),
    };
    -(-times * in_a_period).exp_m1()
}

/// `w dt` at which [`lost`] is `part`.
fn allowed(integrator: Integrator, part: f64, times: f64) -> f64 {
    let in_a_period = -(-part).ln_1p() / times;
    match integrator {
        Integrator::Euler => in_a_period / (2.0 * PI),
        Integrator::Bdf2 => (in_a_period / PI).cbrt(),
    }
}

/// Rate at which the scene itself takes energy from a swing [1/s]: damping, and of inner damping what it takes from bending.
fn meant(model: &Model, mode: &Mode) -> f64 {
    let of_rod = |joint: &&Joint| matches!(joint.b, Body::Segment(i) if model.segments[i].rod == mode.rod);
    let inner = model.joints.iter().filter(of_rod).map(|joint| joint.inner_damping.bending).fold(0.0, f64::max);
    let inner = if mode.restoring == Restoring::Bending { inner * mode.frequency.powi(2) } else { 0.0 };
    model.damping.linear + inner
}

/// The weight of all lifted by the rods' length; without gravity the highest energy there was [J].
pub(crate) fn at_stake(model: &Model, measured: &Measured) -> f64 {
    let [mass, length] = model.segments.iter().fold([0.0; 2], |[m, l], own| [m + own.mass(), l + own.length]);
    let lifted = mass * model.gravity.norm() * length;
    if lifted > 0.0 { lifted } else { measured.energy_highest.abs() }
}

impl TooCoarse {
    /// That of a run of `steps` steps; `None` where the integrator takes little, or less than the scene's own damping does,
    /// where the run is shorter than a period, and where nothing was lost.
    pub(crate) fn of(scene: &Scene, integrator: Integrator, steps: usize, measured: &Measured) -> Option<Self> {
        if measured.energy_highest - measured.energy_end < UNMOVED * at_stake(&scene.model, measured) {
            return None;
        }
        let (model, dt) = (&scene.model, scene.run.dt);
        let modes = model.first_modes(&scene.state);
        let heaviest = modes.iter().map(|mode| mode.mass).fold(0.0, f64::max);
        let counts = |mode: &&Mode| {
            let periods = steps as f64 * dt * mode.frequency / (2.0 * PI);
            let part = lost(integrator, mode.frequency * dt, 1.0);
            let rate = -(-part).ln_1p() * mode.frequency / (2.0 * PI);
            // What swings faster than the step resolves stands still from the first step on, and no one waits for it.
            let is_resolved = mode.frequency * dt < 1.0;
            mode.mass >= LIGHT * heaviest && periods >= 1.0 && rate > meant(model, mode) && is_resolved
        };
        let mode = modes.iter().filter(counts).max_by(|a, b| a.frequency.total_cmp(&b.frequency))?;
        let loss = Loss::of(integrator, mode.frequency * dt, 1.0, dt)?;
        Some(Self {
            rod: scene.rods.get(mode.rod).map_or_else(String::new, |rod| rod.name.clone()),
            mode: match mode.restoring {
                Restoring::Bending => "bending",
                Restoring::Gravity => "gravity",
                Restoring::Tension => "tension",
            },
            frequency_hz: mode.frequency / (2.0 * PI),
            lost_a_period: loss.part,
            loss,
        })
    }
}

impl Display for TooCoarse {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self { rod, mode, frequency_hz, loss, .. } = self;
        let hertz = number(*frequency_hz);
        loss.tell(f, format_args!("its energy from the first swing of {rod} ({mode}, {hertz} Hz) in each period"))
    }
}

/// A number to two digits, as a flag takes it.
fn short(x: f64) -> String {
    let digits = (1.0 - x.abs().log10().floor()).max(0.0) as usize;
    format!("{x:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_lost_is_that_of_the_rules() {
        // One step of Euler's rule keeps 1 / (1 + x^2) of an oscillation's energy; 2 pi / x steps are a period.
        for x in [0.01_f64, 0.03, 0.1] {
            let exact = 1.0 - (1.0 + x * x).powf(-2.0 * PI / x);
            assert!((lost(Integrator::Euler, x, 1.0) / exact - 1.0).abs() < 0.01, "{x}");
        }
        // Its steps: (3 - 2 i x) z'' = 4 z' - z for y' = i w y, from a swing that goes on for two periods.
        for x in [0.03_f64, 0.1] {
            let (mut before, mut now) = ([x.cos(), -x.sin()], [1.0, 0.0]);
            let steps = (4.0 * PI / x).round() as usize;
            for _ in 0..steps {
                let [re, im] = [0, 1].map(|k| 4.0 * now[k] - before[k]);
                let size = 9.0 + 4.0 * x * x;
                let next = [(3.0 * re - 2.0 * x * im) / size, (3.0 * im + 2.0 * x * re) / size];
                (before, now) = (now, next);
            }
            let kept = (now[0].powi(2) + now[1].powi(2)).sqrt();
            assert!((lost(Integrator::Bdf2, x, 1.0) / (1.0 - kept) - 1.0).abs() < 0.1, "{x}: {kept}");
        }
        for integrator in [Integrator::Euler, Integrator::Bdf2] {
            for times in [1.0, 2.0] {
                assert!((lost(integrator, allowed(integrator, 0.05, times), times) - 0.05).abs() < 1e-12);
            }
        }
        assert_eq!([0.0031416, 0.12, 2.5, 30.0].map(short), ["0.0031", "0.12", "2.5", "30"]);
    }
}

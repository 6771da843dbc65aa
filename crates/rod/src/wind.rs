//! Wind: a mean velocity, which may turn, and gusts that it carries along.

use std::f64::consts::TAU;

use nalgebra::{Rotation3, Vector2, Vector3};

use crate::ModelError;

/// Strength, size and pace of gusts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gusts {
    /// Turbulence intensity: root mean square of each component of the fluctuation over the mean wind's speed.
    pub strength: f64,
    /// Typical distance from gust to gust [m]; gusts range from half to twice of it.
    pub length: f64,
    /// Typical time in which gusts change while the wind carries them along [s].
    pub time: f64,
    /// The same seed gives the same gusts.
    pub seed: u64,
}

/// Velocity of the air at any place and time: steady, gusty, turning about the vertical (world z), or all of it.
///
/// Gusts are a sum of random Fourier modes, each across its wave vector, so that they neither compress nor thin the air
/// (Kraichnan 1970). The mean wind carries them along (Taylor's frozen turbulence, 1938), and they change slowly. Their
/// amplitude grows with the cube root of the wave length (Kolmogorov 1941).
#[derive(Clone, Debug, PartialEq)]
pub struct Wind {
    mean: Vector3<f64>,
    gusts: Option<Gusts>,
    rotation_period: Option<f64>,
    modes: Option<Box<Modes>>,
}

/// Number of Fourier modes: groups of three with amplitudes at right angles, so that all components are as strong.
const MODES: usize = 12;

/// Fourier modes `a cos(2 pi (k . (x - drift) + f t + phase))`, one a column.
#[derive(Clone, Debug, PartialEq)]
struct Modes {
    amplitude: [[f64; MODES]; 3],
    /// Wave vectors [1/m].
    wave: [[f64; MODES]; 3],
    /// Frequencies [1/s].
    frequency: [f64; MODES],
    /// Phases [turns].
    phase: [f64; MODES],
}

/// The wind at one time.
#[derive(Clone, Debug)]
pub struct WindNow<'a> {
    mean: Vector3<f64>,
    modes: Option<(&'a Modes, [f64; MODES])>,
}

impl Wind {
    /// Wind with the `mean` velocity [m/s], `gusts` and the period [s] in which the mean velocity turns about the vertical,
    /// anticlockwise as seen from above. [`crate::Model::validate`] checks the numbers.
    pub fn new(mean: Vector3<f64>, gusts: Option<Gusts>, rotation_period: Option<f64>) -> Self {
        let modes = gusts.as_ref().map(|gusts| Box::new(Modes::new(gusts, mean.norm())));
        Self { mean, gusts, rotation_period, modes }
    }

    /// Wind that is the same everywhere and always: `velocity` [m/s].
    pub fn steady(velocity: Vector3<f64>) -> Self {
        Self::new(velocity, None, None)
    }

    /// Whether it blows the same at all times.
    pub fn is_steady(&self) -> bool {
        let turns = self.rotation_period.is_some() && self.mean.xy() != Vector2::zeros();
        self.gusts.is_none_or(|gusts| gusts.strength == 0.0) && !turns
    }

    /// Whether it differs from place to place.
    pub fn has_gusts(&self) -> bool {
        self.gusts.is_some()
    }

    /// Velocity [m/s] at `position` [m] and `time` [s].
    pub fn velocity(&self, position: &Vector3<f64>, time: f64) -> Vector3<f64> {
        self.at(time).velocity(position)
    }

    /// The wind everywhere at `time` [s].
    pub fn at(&self, time: f64) -> WindNow<'_> {
        let (mean, drift) = match self.rotation_period {
            None => (self.mean, self.mean * time),
            Some(period) => {
                let rate = TAU / period;
                let (sin, cos) = (rate * time).sin_cos();
                let aside = Vector3::z().cross(&self.mean);
                let across = Vector3::new(self.mean.x, self.mean.y, 0.0);
                let drift = (across * sin + aside * (1.0 - cos)) / rate + Vector3::z() * (self.mean.z * time);
                (Rotation3::from_axis_angle(&Vector3::z_axis(), rate * time) * self.mean, drift)
            }
        };
        WindNow { mean, modes: self.modes.as_deref().map(|modes| (modes, modes.phases(&drift, time))) }
    }

    pub(crate) fn validate(&self) -> Result<(), ModelError> {
        let fail =
            |quantity, value, allowed| Err(ModelError::Value { what: "model", index: 0, quantity, value, allowed });
        if let Some(&value) = self.mean.iter().find(|v| !v.is_finite()) {
            return fail("wind velocity", value, "finite");
        }
        if let Some(gusts) = &self.gusts {
            if !(gusts.strength.is_finite() && gusts.strength >= 0.0) {
                return fail("gust strength", gusts.strength, "finite and >= 0");
            }
            for (quantity, value) in [("gust length", gusts.length), ("gust time", gusts.time)] {
                if !(value.is_finite() && value > 0.0) {
                    return fail(quantity, value, "finite and > 0");
                }
            }
        }
        match self.rotation_period {
            Some(period) if !(period.is_finite() && period > 0.0) => {
                fail("rotation period of the wind", period, "finite and > 0")
            }
            _ => Ok(()),
        }
    }
}

impl WindNow<'_> {
    /// Velocity [m/s] at `position` [m].
    #[inline(always)]
    pub fn velocity(&self, position: &Vector3<f64>) -> Vector3<f64> {
        match &self.modes {
            None => self.mean,
            Some((modes, phases)) => self.mean + modes.sum(position, phases),
        }
    }
}

impl Modes {
    fn new(gusts: &Gusts, speed: f64) -> Self {
        let zero = [0.0; MODES];
        let mut modes = Self { amplitude: [zero; 3], wave: [zero; 3], frequency: zero, phase: zero };
        let mut random = SplitMix(gusts.seed);
        let mut power = 0.0;
        for group in 0..MODES / 3 {
            let along = random.direction();
            let aside = along.cross(&random.direction()).try_normalize(1e-9).unwrap_or_else(|| any_normal(&along));
            // From half to twice the typical length, a share for each group.
            let share = (group as f64 + random.unit()) / (MODES / 3) as f64;
            let length = gusts.length * (2.0 * share - 1.0).exp2();
            let amplitude = (length / gusts.length).cbrt();
            for (k, a) in [along, aside, along.cross(&aside)].into_iter().enumerate() {
                let mode = 3 * group + k;
                let across = any_normal(&a);
                let (sin, cos) = (TAU * random.unit()).sin_cos();
                let wave = (across * cos + a.cross(&across) * sin) / length;
                for axis in 0..3 {
                    modes.amplitude[axis][mode] = a[axis] * amplitude;
                    modes.wave[axis][mode] = wave[axis];
                }
                let sign = if random.unit() < 0.5 { -1.0 } else { 1.0 };
                modes.frequency[mode] = sign * (2.0 * random.unit() - 1.0).exp2() / gusts.time;
                modes.phase[mode] = random.unit();
            }
            power += 0.5 * amplitude * amplitude;
        }
        let scale = gusts.strength * speed / power.sqrt();
        modes.amplitude.iter_mut().flatten().for_each(|a| *a *= scale);
        modes
    }

    /// Phases [turns] at the origin.
    fn phases(&self, drift: &Vector3<f64>, time: f64) -> [f64; MODES] {
        let [x, y, z] = &self.wave;
        std::array::from_fn(|k| {
            self.phase[k] + self.frequency[k] * time - (x[k] * drift.x + y[k] * drift.y + z[k] * drift.z)
        })
    }

    #[inline(always)]
    fn sum(&self, at: &Vector3<f64>, phases: &[f64; MODES]) -> Vector3<f64> {
        let [x, y, z] = &self.wave;
        let mut waves = [0.0; MODES];
        for k in 0..MODES {
            waves[k] = cosine(phases[k] + x[k] * at.x + y[k] * at.y + z[k] * at.z);
        }
        let mut sum = [0.0; 3];
        for (sum, amplitude) in sum.iter_mut().zip(&self.amplitude) {
            for k in 0..MODES {
                *sum += amplitude[k] * waves[k];
            }
        }
        Vector3::from(sum)
    }
}

/// Cosine of an angle in turns, to rounding, in plain arithmetic that runs in vector registers.
#[inline(always)]
fn cosine(turns: f64) -> f64 {
    // Adding and taking away 1.5 * 2^52 rounds to the nearest whole number.
    const WHOLE: f64 = 6_755_399_441_055_744.0;
    let turn = turns - ((turns + WHOLE) - WHOLE);
    // The sine of x = pi / 2 - |angle|, which lies within a quarter turn: its Taylor series.
    let x = TAU * (0.25 - turn.abs());
    let y = x * x;
    let mut sum = 0.0;
    for factorial in SINE {
        sum = sum * y + factorial;
    }
    x * sum
}

/// Taylor coefficients of sin(x) / x in x^2, the highest first: up to x^20.
const SINE: [f64; 11] = {
    let mut coefficients = [1.0; 11];
    let mut k = 1;
    while k < 11 {
        coefficients[10 - k] = -coefficients[11 - k] / ((2 * k) * (2 * k + 1)) as f64;
        k += 1;
    }
    coefficients
};

/// A unit vector at a right angle to `v`.
fn any_normal(v: &Vector3<f64>) -> Vector3<f64> {
    let helper = if v.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() };
    v.cross(&helper).normalize()
}

/// Random numbers that depend on a seed alone (SplitMix64: Steele, Lea and Flood 2014).
struct SplitMix(u64);

impl SplitMix {
    /// Uniform in [0, 1).
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A unit vector, uniform on the sphere.
    fn direction(&mut self) -> Vector3<f64> {
        let z = 2.0 * self.unit() - 1.0;
        let (sin, cos) = (TAU * self.unit()).sin_cos();
        let across = (1.0 - z * z).sqrt();
        Vector3::new(across * cos, across * sin, z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MEAN: Vector3<f64> = Vector3::new(6.0, 2.0, 1.0);

    fn gusts(seed: u64) -> Gusts {
        Gusts { strength: 0.3, length: 4.0, time: 3.0, seed }
    }

    /// Places and times far beyond the gusts' size and pace.
    fn samples(seed: u64) -> impl Iterator<Item = (Vector3<f64>, f64)> {
        let mut random = SplitMix(seed);
        let mut far = move || (random.unit() - 0.5) * 4000.0;
        (0..100_000).map(move |_| (Vector3::new(far(), far(), far()), far().abs()))
    }

    #[test]
    fn cosines_are_right_to_rounding() {
        for k in 0..100_000 {
            let turns = -3.0 + 7.1e-5 * f64::from(k);
            assert!((cosine(turns) - (TAU * (turns - turns.round())).cos()).abs() < 4e-16, "{turns}");
        }
    }

    #[test]
    fn fluctuations_have_no_mean_and_the_strength_asked_for() {
        for seed in 0..3 {
            for period in [None, Some(7.0)] {
                let wind = Wind::new(MEAN, Some(gusts(seed)), period);
                let calm = Wind::new(MEAN, None, period);
                let (mut sum, mut squares, mut count) = (Vector3::zeros(), Vector3::zeros(), 0.0);
                for (x, t) in samples(seed) {
                    let own = wind.velocity(&x, t) - calm.velocity(&x, t);
                    sum += own;
                    squares += own.component_mul(&own);
                    count += 1.0;
                }
                let strength = 0.3 * MEAN.norm();
                assert!((sum / count).norm() < 0.02 * strength, "{}", sum / count);
                for square in squares.iter() {
                    assert!(((square / count).sqrt() / strength - 1.0).abs() < 0.02, "{squares}");
                }
            }
        }
    }

    #[test]
    fn wind_is_smooth_and_does_not_compress_the_air() {
        let wind = Wind::new(MEAN, Some(gusts(5)), Some(20.0));
        // Along any axis of space and time the third differences fall with the cube of the distance.
        let third = |f: &dyn Fn(f64) -> Vector3<f64>, h: f64| {
            (f(1.5 * h) - f(0.5 * h) * 3.0 + f(-0.5 * h) * 3.0 - f(-1.5 * h)).norm()
        };
        for (x, t) in samples(1).take(200) {
            let mut divergence = 0.0;
            for axis in 0..4 {
                let along = |s: f64| match axis {
                    3 => wind.velocity(&x, t + s),
                    _ => wind.velocity(&(x + Vector3::ith(axis, s)), t),
                };
                // Wave lengths of 2 m, and as short a time for them to pass by.
                let bound = 2.0 * MEAN.norm() * (TAU * if axis == 3 { 4.0 } else { 0.5 }).powi(3);
                for h in [1e-2, 1e-3] {
                    assert!(third(&along, h) < bound * h.powi(3) + 1e-12, "{x} {t} {axis} {h}");
                }
                if axis < 3 {
                    divergence += (along(1e-4) - along(-1e-4))[axis] / 2e-4;
                }
            }
            assert!(divergence.abs() < 1e-5, "{divergence}");
        }
    }

    #[test]
    fn gusts_are_carried_along() {
        // They change so slowly that only the drift is left.
        let frozen = |period| Wind::new(MEAN, Some(Gusts { time: 1e9, ..gusts(2) }), period);
        let wind = frozen(None);
        let here = wind.velocity(&Vector3::new(1.0, 2.0, 3.0), 0.0);
        assert!((wind.velocity(&(Vector3::new(1.0, 2.0, 3.0) + MEAN * 4.0), 4.0) - here).norm() < 1e-7);
        // In a turning wind, too: following the mean wind's way one meets the same gust.
        let (wind, calm) = (frozen(Some(5.0)), Wind::new(MEAN, None, Some(5.0)));
        let mut x = Vector3::zeros();
        for k in 0..30_000 {
            x += calm.velocity(&x, (f64::from(k) + 0.5) * 1e-4) * 1e-4;
        }
        let gust = |x: &Vector3<f64>, t: f64| wind.velocity(x, t) - calm.velocity(x, t);
        assert!((gust(&x, 3.0) - gust(&Vector3::zeros(), 0.0)).norm() < 1e-6);
    }

    #[test]
    fn turning_wind_turns_about_the_vertical() {
        let wind = Wind::new(MEAN, None, Some(8.0));
        let quarter = wind.velocity(&Vector3::zeros(), 2.0);
        assert!((quarter - Vector3::new(-MEAN.y, MEAN.x, MEAN.z)).norm() < 1e-12);
        assert!((wind.velocity(&Vector3::x(), 8.0) - MEAN).norm() < 1e-12);
    }

    #[test]
    fn seeds_tell_gusts_apart_and_nothing_else_does() {
        let at = |seed| Wind::new(MEAN, Some(gusts(seed)), None).velocity(&Vector3::x(), 1.0);
        assert_eq!(at(1), at(1));
        assert!((at(1) - at(2)).norm() > 1e-3);
    }
}

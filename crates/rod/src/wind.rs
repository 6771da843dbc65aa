//! Wind: a mean velocity, which may turn, and gusts that it carries along.

use std::f64::consts::TAU;

use nalgebra::{Rotation3, Vector2, Vector3};

use crate::ModelError;

/// Strength, size and pace of gusts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gusts {
    /// Turbulence intensity: root mean square of each component of the fluctuation over the mean wind's speed.
    pub strength: f64,
    /// Integral length scale L of the fluctuation along the wind [m].
    pub length: f64,
    /// Lifetime of the eddies of the size L while the wind carries them along [s]; smaller ones live shorter.
    pub time: f64,
    /// The same seed gives the same gusts.
    pub seed: u64,
}

/// Velocity of the air at any place and time: steady, gusty, turning about the vertical (world z), or all of it.
///
/// Gusts are isotropic turbulence with the spectrum of von Karman (1948),
/// `E(k) ~ (k l)^4 / (1 + (k l)^2)^(17/6)` with l = 1.339 L, from k l = 0.2 to 100. They are a sum of random Fourier modes, each
/// across its wave vector, so that they neither compress nor thin the air (Kraichnan 1970). The mean wind carries them along
/// (Taylor's frozen turbulence, 1938). Each mode fades within its lifetime `min(T, 10 L / U) (k l)^(-2/3)`, without the last
/// factor below k l = 1, and another one takes its place, so that gusts never repeat.
#[derive(Clone, Debug, PartialEq)]
pub struct Wind {
    mean: Vector3<f64>,
    gusts: Option<Gusts>,
    rotation_period: Option<f64>,
    spectrum: Option<Box<Spectrum>>,
}

/// Bands of wave numbers, equally wide in their logarithm; in each one mode fades in while one fades out.
const BANDS: usize = 8;

/// Modes at any time.
const MODES: usize = 2 * BANDS;

/// Limits of the wave numbers k l.
const WAVE_NUMBERS: [f64; 2] = [0.2, 100.0];

/// l / L of von Karman's spectrum.
const VON_KARMAN: f64 = 1.339;

/// What modes are drawn from.
#[derive(Clone, Debug, PartialEq)]
struct Spectrum {
    seed: u64,
    /// The length l [m].
    length: f64,
    /// Lifetime of modes at each band's middle [s].
    lifetime: [f64; BANDS],
    /// Mean square of a mode's amplitude along an axis, over `E(k) k` [m^2/s^2].
    scale: f64,
}

/// Fourier modes `a cos(2 pi (k . x + phase))` at one time.
#[derive(Clone, Debug)]
struct Modes {
    amplitude: [[f64; MODES]; 3],
    /// Wave vectors [turns/m].
    wave: [[f64; MODES]; 3],
    /// Phases at the origin [turns].
    phase: [f64; MODES],
}

/// The wind at one time.
#[derive(Clone, Debug)]
pub struct WindNow {
    mean: Vector3<f64>,
    modes: Option<Modes>,
}

impl Wind {
    /// Wind with the `mean` velocity [m/s], `gusts` and the period [s] in which the mean velocity turns about the vertical,
    /// anticlockwise as seen from above. [`crate::Model::validate`] checks the numbers.
    pub fn new(mean: Vector3<f64>, gusts: Option<Gusts>, rotation_period: Option<f64>) -> Self {
        let spectrum = gusts.as_ref().map(|gusts| Box::new(Spectrum::new(gusts, mean.norm())));
        Self { mean, gusts, rotation_period, spectrum }
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
    pub fn at(&self, time: f64) -> WindNow {
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
        WindNow { mean, modes: self.spectrum.as_ref().map(|spectrum| spectrum.modes(&drift, time)) }
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

impl WindNow {
    /// Velocity [m/s] at `position` [m].
    #[inline(always)]
    pub fn velocity(&self, position: &Vector3<f64>) -> Vector3<f64> {
        match &self.modes {
            None => self.mean,
            Some(modes) => self.mean + modes.sum(position),
        }
    }
}

impl Spectrum {
    fn new(gusts: &Gusts, speed: f64) -> Self {
        let length = VON_KARMAN * gusts.length;
        let lifetime = gusts.time.min(10.0 * gusts.length / speed);
        let lifetime = std::array::from_fn(|band| lifetime * Self::wave_number(band, 0.5).max(1.0).powf(-2.0 / 3.0));
        // The energy of all bands, by the midpoint rule.
        const POINTS: usize = 64;
        let shares = (0..BANDS).flat_map(|band| (0..POINTS).map(move |i| (band, (i as f64 + 0.5) / POINTS as f64)));
        let energy: f64 = shares.map(|(band, share)| energy(Self::wave_number(band, share)) / POINTS as f64).sum();
        // What is across a random direction has two thirds of an amplitude's square.
        let scale = 1.5 * (gusts.strength * speed).powi(2) / energy;
        Self { seed: gusts.seed, length, lifetime, scale }
    }

    /// k l in a band, a share of its width above its lower limit.
    fn wave_number(band: usize, share: f64) -> f64 {
        let [low, high] = WAVE_NUMBERS;
        low * (high / low).powf((band as f64 + share) / BANDS as f64)
    }

    /// The modes at `time` [s], which the wind has carried by `drift` [m].
    fn modes(&self, drift: &Vector3<f64>, time: f64) -> Modes {
        let zero = [0.0; MODES];
        let mut modes = Modes { amplitude: [zero; 3], wave: [zero; 3], phase: zero };
        for (band, lifetime) in self.lifetime.iter().enumerate() {
            // Bands change at times of their own.
            let age = time / lifetime + 0.618_034 * (band + 1) as f64;
            let first = age.floor();
            let share = age - first;
            let faded = 0.25 * share.powi(3) * (10.0 - share * (15.0 - 6.0 * share));
            // The square of both is 1: the mean energy is the same at all times.
            let (sin, cos) = (TAU * faded).sin_cos();
            for (number, weight) in [(first as i64, cos), (first as i64 + 1, sin)] {
                let mode = 2 * band + usize::from(number & 1 == 1);
                self.mode(band, number, weight, drift, &mut modes, mode);
            }
        }
        modes
    }

    /// Draws mode `number` of a band, which is as strong as `weight` says.
    fn mode(&self, band: usize, number: i64, weight: f64, drift: &Vector3<f64>, modes: &mut Modes, mode: usize) {
        let mut random = SplitMix::of(self.seed, band as u64, number as u64);
        let wave_number = Self::wave_number(band, random.unit());
        let direction = random.direction();
        let any = Vector3::from_fn(|_, _| random.normal());
        let across = any - direction * direction.dot(&any);
        // The mean square of the cosine is a half.
        let amplitude = across * (weight * (2.0 * self.scale * energy(wave_number)).sqrt());
        let wave = direction * (wave_number / (TAU * self.length));
        modes.phase[mode] = random.unit() - wave.dot(drift);
        for axis in 0..3 {
            modes.amplitude[axis][mode] = amplitude[axis];
            modes.wave[axis][mode] = wave[axis];
        }
    }
}

/// `x E(x)` of von Karman's spectrum at x = k l.
fn energy(x: f64) -> f64 {
    x.powi(5) / (1.0 + x * x).powf(17.0 / 6.0)
}

impl Modes {
    #[inline(always)]
    fn sum(&self, at: &Vector3<f64>) -> Vector3<f64> {
        let [x, y, z] = &self.wave;
        let mut waves = [0.0; MODES];
        for k in 0..MODES {
            waves[k] = cosine(self.phase[k] + x[k] * at.x + y[k] * at.y + z[k] * at.z);
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

/// Random numbers that depend on a seed alone (SplitMix64: Steele, Lea and Flood 2014).
struct SplitMix(u64);

impl SplitMix {
    /// The numbers of one mode.
    fn of(seed: u64, band: u64, number: u64) -> Self {
        let spread = |x: u64, odd: u64| x.wrapping_add(1).wrapping_mul(odd);
        let mut random = Self(seed ^ spread(band, 0xd1b5_4a32_d192_ed03) ^ spread(number, 0x8cb9_2ba7_2f3d_8dd7));
        random.unit();
        random
    }

    /// Normal, of the variance 1 (Box and Muller 1958).
    fn normal(&mut self) -> f64 {
        (-2.0 * (1.0 - self.unit()).ln()).sqrt() * (TAU * self.unit()).cos()
    }

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
                // The largest wave number, and the time that it takes to pass by.
                let wave = WAVE_NUMBERS[1] / (VON_KARMAN * 4.0);
                let bound = 2.0 * MEAN.norm() * (wave * if axis == 3 { MEAN.norm() } else { 1.0 }).powi(3);
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

    /// Following the mean wind's way one meets the same gusts, as long as they live; staying in a place one does not.
    #[test]
    fn gusts_are_carried_along() {
        for period in [None, Some(50.0)] {
            let calm = Wind::new(MEAN, None, period);
            let wind = Wind::new(MEAN, Some(gusts(2)), period);
            let gust = |x: &Vector3<f64>, t: f64| wind.velocity(x, t) - calm.velocity(x, t);
            let (mut size, mut along, mut here) = (0.0, 0.0, 0.0);
            for (at, t) in samples(4).take(20_000) {
                let mut x = at;
                for k in 0..10 {
                    x += calm.velocity(&x, t + (f64::from(k) + 0.5) * 0.06) * 0.06;
                }
                let before = gust(&at, t);
                size += before.norm_squared();
                along += before.dot(&gust(&x, t + 0.6));
                here += before.dot(&gust(&at, t + 0.6));
            }
            assert!(along > 0.5 * size && here < 0.3 * size, "{along} {here} {size}");
        }
    }

    /// Drag on a rod in gusts that pass in L / U = 0.6 s, over six hours.
    #[test]
    fn drag_forgets_gusts_within_five_integral_scales() {
        let speed = MEAN.norm();
        for seed in 0..3 {
            let wind = Wind::new(MEAN, Some(gusts(seed)), None);
            let (step, count) = (0.3, 72_000);
            let drag: Vec<f64> = (0..count)
                .map(|k| {
                    let v = wind.velocity(&Vector3::zeros(), step * f64::from(k));
                    v.norm() * v.dot(&MEAN) / speed
                })
                .collect();
            let mean = drag.iter().sum::<f64>() / f64::from(count);
            let correlation = |lag: usize| -> f64 {
                let (a, b) = (&drag[lag..], &drag[..drag.len() - lag]);
                a.iter().zip(b).map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>() / a.len() as f64
            };
            let variance = correlation(0);
            assert!((variance.sqrt() / (0.6 * speed * speed) - 1.0).abs() < 0.1, "{}", variance.sqrt());
            let scale = 4.0 / speed;
            for lag in ((5.0 * scale / step) as usize + 1)..(600.0 / step) as usize {
                assert!((correlation(lag) / variance).abs() < 0.1, "{lag}: {}", correlation(lag) / variance);
            }
        }
    }

    /// Von Karman's spectrum along the wind, `n S / s^2 = 4 f / (1 + 70.8 f^2)^(5/6)` with `f = n L / U` (ESDU 85020).
    #[test]
    fn gusts_along_the_wind_have_the_spectrum_of_von_karman() {
        let mean = Vector3::x() * 10.0;
        let strength = 0.2;
        let (step, length) = (0.05, 1024);
        for f in [0.1, 0.3, 1.0, 2.0] {
            // A whole number of cycles in a record, near n.
            let cycles = (f * 10.0 / 5.0 * step * length as f64).round();
            let n = cycles / (step * length as f64);
            let (mut power, mut records) = (0.0, 0.0);
            for seed in 0..200 {
                let gusts = Gusts { strength, length: 5.0, time: 5.0, seed };
                let wind = Wind::new(mean, Some(gusts), None);
                let (mut re, mut im) = (0.0, 0.0);
                for k in 0..length {
                    let share = k as f64 / length as f64;
                    let window = 1.0 - (TAU * share).cos();
                    let u = (wind.velocity(&Vector3::zeros(), 1e3 + step * k as f64).x - 10.0) * window;
                    let (sin, cos) = (TAU * cycles * share).sin_cos();
                    (re, im) = (re + u * cos, im + u * sin);
                }
                // One-sided; the window's mean square is 1.5.
                power += 2.0 * (re * re + im * im) * step / (1.5 * length as f64);
                records += 1.0;
            }
            let found = n * power / records / (strength * 10.0_f64).powi(2);
            let f = n * 5.0 / 10.0;
            let expected = 4.0 * f / (1.0 + 70.8 * f * f).powf(5.0 / 6.0);
            println!("f = {f}: {found}, by the formula {expected}");
            assert!((found / expected).ln().abs() < 0.3_f64.ln_1p(), "f = {f}: {found} instead of {expected}");
        }
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

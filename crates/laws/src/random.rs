//! Random numbers that depend on a seed and a stream alone, short ones as a person would write them.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// The numbers of one stream.
pub(crate) struct Random(ChaCha8Rng);

impl Random {
    pub(crate) fn new(seed: u64, stream: u64) -> Self {
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        generator.set_stream(stream);
        Self(generator)
    }

    /// Uniform in [low, high), to three digits.
    pub(crate) fn uniform(&mut self, low: f64, high: f64) -> f64 {
        short(self.exact(low, high))
    }

    /// Between two numbers > 0, with an even logarithm, to three digits.
    pub(crate) fn even_log(&mut self, low: f64, high: f64) -> f64 {
        short(self.exact(low.ln(), high.ln()).exp())
    }

    /// Uniform among low, ..., high.
    pub(crate) fn whole(&mut self, low: usize, high: usize) -> usize {
        (self.exact(low as f64, high as f64 + 1.0) as usize).min(high)
    }

    /// True with this probability.
    pub(crate) fn chance(&mut self, probability: f64) -> bool {
        self.exact(0.0, 1.0) < probability
    }

    /// One of these.
    pub(crate) fn pick<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.whole(0, of.len() - 1)]
    }

    /// A unit vector, of even direction, to three digits.
    pub(crate) fn direction(&mut self) -> Vector3<f64> {
        let (z, angle) = (self.exact(-1.0, 1.0), self.exact(0.0, TAU));
        let across = (1.0 - z * z).sqrt();
        Vector3::new(across * angle.cos(), across * angle.sin(), z).map(short)
    }

    /// A vector within a box of this half side.
    pub(crate) fn vector(&mut self, half: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.uniform(-half, half))
    }

    fn exact(&mut self, low: f64, high: f64) -> f64 {
        let unit = (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        low + (high - low) * unit
    }
}

/// To three digits.
pub(crate) fn short(x: f64) -> f64 {
    format!("{x:.2e}").parse().unwrap_or(x)
}

/// A vector whose debug format is a list of TOML.
pub(crate) fn list(v: Vector3<f64>) -> [f64; 3] {
    v.into()
}

//! Random numbers as a person would write them: short ones.

use std::f64::consts::TAU;

use cosserat::scene;
use nalgebra::Vector3;

/// The numbers of one stream.
pub(crate) struct Random(scene::Random);

impl Random {
    pub(crate) fn new(seed: u64, stream: u64) -> Self {
        Self(scene::Random::new(seed, stream))
    }

    /// Uniform in [low, high), to three digits.
    pub(crate) fn uniform(&mut self, low: f64, high: f64) -> f64 {
        short(self.0.uniform(low, high))
    }

    /// Between two numbers > 0, with an even logarithm, to three digits.
    pub(crate) fn even_log(&mut self, low: f64, high: f64) -> f64 {
        short(self.0.uniform(low.ln(), high.ln()).exp())
    }

    /// Uniform among low, ..., high.
    pub(crate) fn whole(&mut self, low: usize, high: usize) -> usize {
        self.0.whole(low, high)
    }

    /// True with this probability.
    pub(crate) fn chance(&mut self, probability: f64) -> bool {
        self.0.uniform(0.0, 1.0) < probability
    }

    /// One of these.
    pub(crate) fn pick<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.whole(0, of.len() - 1)]
    }

    /// A unit vector, of even direction, to three digits.
    pub(crate) fn direction(&mut self) -> Vector3<f64> {
        let (z, angle) = (self.0.uniform(-1.0, 1.0), self.0.uniform(0.0, TAU));
        let across = (1.0 - z * z).sqrt();
        Vector3::new(across * angle.cos(), across * angle.sin(), z).map(short)
    }

    /// A vector within a box of this half side.
    pub(crate) fn vector(&mut self, half: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.uniform(-half, half))
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

//! Inputs of unit size: measured once over a training set, applied ever after.

use crate::Channel;

/// Shift and scale of each feature, from means and spreads over a training set.
///
/// Scalars get mean 0 and spread 1. Components of vectors keep their zero (spread about it 1), so that a mirror still
/// only changes signs. Features that are all alike are left as they are but for their mean.
#[derive(Clone, Debug, PartialEq)]
pub struct Whitening {
    /// What is taken off first. `[features]`
    pub shift: Vec<f32>,
    /// What is multiplied with then. `[features]`
    pub scale: Vec<f32>,
}

impl Whitening {
    /// Whitened features are cut off at this magnitude.
    pub const CLIP: f32 = 6.0;

    /// Changes nothing.
    pub fn identity(features: usize) -> Self {
        Self { shift: vec![0.0; features], scale: vec![1.0; features] }
    }

    /// Measures `rows` `[any, channels]`; the sums run in their order.
    pub fn fit<'a>(channels: &[Channel], rows: impl IntoIterator<Item = &'a [f32]>) -> Self {
        // Welford's update: mean and sum of squares about it.
        let mut sums = vec![(0.0_f64, 0.0_f64); channels.len()];
        let mut count = 0.0;
        for rows in rows {
            for row in rows.chunks_exact(channels.len().max(1)) {
                count += 1.0;
                for ((mean, squares), &x) in sums.iter_mut().zip(row) {
                    let apart = f64::from(x) - *mean;
                    *mean += apart / count;
                    *squares += apart * (f64::from(x) - *mean);
                }
            }
        }
        let mut whitening = Self::identity(channels.len());
        for (k, (&(mean, squares), channel)) in sums.iter().zip(channels).enumerate() {
            let variance = squares / f64::max(count, 1.0);
            let (shift, spread) = match channel.is_vector() {
                true => (0.0, (variance + mean * mean).sqrt()),
                false => (mean, variance.sqrt()),
            };
            whitening.shift[k] = shift as f32;
            // Rounding alone spreads what is all alike, zeros included.
            if spread > 1e-6 * mean.abs().max(1e-3) {
                whitening.scale[k] = (1.0 / spread) as f32;
            }
        }
        whitening
    }

    /// Whitens and clips `rows` in place. `[any, features]`
    pub fn apply(&self, rows: &mut [f32]) {
        for row in rows.chunks_exact_mut(self.shift.len().max(1)) {
            for ((x, shift), scale) in row.iter_mut().zip(&self.shift).zip(&self.scale) {
                *x = ((*x - shift) * scale).clamp(-Self::CLIP, Self::CLIP);
            }
        }
    }
}

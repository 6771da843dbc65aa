//! Adam (Kingma and Ba 2015) on one list of numbers: its state is three lists, which a resumed training reads back to
//! the bit.

/// How to step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AdamParams {
    /// Decay of the gradients' mean.
    pub(crate) beta_1: f64,
    /// Decay of their squares' mean.
    pub(crate) beta_2: f64,
    /// Largest norm of a gradient; it is scaled down to it.
    pub(crate) clip: f64,
}

/// The optimiser's state.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Adam {
    /// Steps taken.
    pub(crate) steps: u64,
    /// Mean of the gradients.
    pub(crate) mean: Vec<f32>,
    /// Mean of their squares.
    pub(crate) square: Vec<f32>,
}

impl Adam {
    pub(crate) fn new(count: usize) -> Self {
        Self { steps: 0, mean: vec![0.0; count], square: vec![0.0; count] }
    }

    /// One step of size `rate` against the gradient. A gradient that is not finite is left out; returns its norm.
    pub(crate) fn step(&mut self, params: &AdamParams, rate: f64, gradient: &[f32], values: &mut [f32]) -> f64 {
        let norm = gradient.iter().map(|&g| f64::from(g) * f64::from(g)).sum::<f64>().sqrt();
        if !norm.is_finite() {
            return norm;
        }
        self.steps += 1;
        let scale = if norm > params.clip { params.clip / norm } else { 1.0 };
        let correct = |beta: f64| 1.0 - beta.powf(self.steps as f64);
        let (first, second) = (correct(params.beta_1), correct(params.beta_2));
        for (((value, &g), mean), square) in values.iter_mut().zip(gradient).zip(&mut self.mean).zip(&mut self.square) {
            let g = f64::from(g) * scale;
            let m = params.beta_1 * f64::from(*mean) + (1.0 - params.beta_1) * g;
            let s = params.beta_2 * f64::from(*square) + (1.0 - params.beta_2) * g * g;
            (*mean, *square) = (m as f32, s as f32);
            *value -= (rate * (m / first) / ((s / second).sqrt() + 1e-8)) as f32;
        }
        norm
    }
}

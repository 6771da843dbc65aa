//! Adam (Kingma and Ba 2015) on one list of numbers: its state is three lists, which a resumed training reads back to
//! the bit.

/// How to step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdamParams {
    /// Decay of the gradients' mean.
    pub beta_1: f64,
    /// Decay of their squares' mean.
    pub beta_2: f64,
    /// Largest norm of a gradient; it is scaled down to it.
    pub clip: f64,
}

/// The optimiser's state.
#[derive(Clone, Debug, PartialEq)]
pub struct Adam {
    /// Steps taken.
    pub steps: u64,
    /// Mean of the gradients.
    pub mean: Vec<f32>,
    /// Mean of their squares.
    pub square: Vec<f32>,
}

impl Adam {
    /// Before the first step on so many numbers.
    pub fn new(count: usize) -> Self {
        Self { steps: 0, mean: vec![0.0; count], square: vec![0.0; count] }
    }

    /// One step of size `rate` against the gradient. A gradient that is not finite is left out; returns its norm.
    pub fn step(&mut self, params: &AdamParams, rate: f64, gradient: &[f32], values: &mut [f32]) -> f64 {
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

#[cfg(test)]
mod tests {
    use super::*;

    const PARAMS: AdamParams = AdamParams { beta_1: 0.9, beta_2: 0.999, clip: f64::INFINITY };

    #[test]
    fn two_steps_are_those_by_hand() {
        let (mut adam, mut values) = (Adam::new(3), [1.0, -2.0, 0.5]);
        assert_eq!(adam.step(&PARAMS, 0.125, &[1.0, -4.0, 0.0], &mut values), 17.0_f64.sqrt());
        // The first step is as long for every gradient, but for none: mean g, mean of squares g^2.
        for (value, expected) in values.iter().zip([0.875, -1.875, 0.5]) {
            assert!((value - expected).abs() < 2e-7, "{value} {expected}");
        }
        assert_eq!((adam.mean[0], adam.mean[1], adam.square[0]), (0.1, -0.4, 0.001));
        // 0.09 - 0.05 over 1 - 0.81; 0.000999 + 0.00025 over 1 - 0.998001.
        adam.step(&PARAMS, 0.125, &[-0.5, 0.0, 0.0], &mut values);
        let step = 0.125 * (0.04 / 0.19) / (0.001249_f64 / 0.001999).sqrt();
        assert!((f64::from(values[0]) - (0.875 - step)).abs() < 2e-7, "{}", values[0]);
        assert_eq!(adam.steps, 2);
    }

    #[test]
    fn long_gradients_are_cut_and_short_ones_are_not() {
        let step = |clip: f64, gradient: [f32; 2]| {
            let (mut adam, mut values) = (Adam::new(2), [1.0, 1.0]);
            let norm = adam.step(&AdamParams { clip, ..PARAMS }, 0.1, &gradient, &mut values);
            (norm, adam, values)
        };
        let (norm, cut, _) = step(1.0, [3.0, -4.0]);
        assert_eq!(norm, 5.0);
        assert_eq!((cut.mean, cut.square), (vec![0.06, -0.08], vec![0.00036, 0.00064]));
        assert_eq!(step(5.0, [3.0, -4.0]), step(f64::INFINITY, [3.0, -4.0]));
        // Squares beyond single precision.
        let (norm, long, values) = step(1.0, [3e30, -4e30]);
        assert!((norm / 5e30 - 1.0).abs() < 1e-7 && long.mean == [0.06, -0.08] && values[0] < 1.0);
    }

    #[test]
    fn gradients_that_are_not_finite_are_left_out() {
        let (mut adam, mut values) = (Adam::new(2), [1.0, 1.0]);
        adam.step(&PARAMS, 0.1, &[1.0, 2.0], &mut values);
        let before = (adam.clone(), values);
        for wrong in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert!(!adam.step(&PARAMS, 0.1, &[1.0, wrong], &mut values).is_finite());
            assert_eq!((&adam, &values), (&before.0, &before.1));
        }
    }
}

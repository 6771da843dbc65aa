//! Least squares of few parameters: the method of Levenberg and Marquardt, with the caller's residuals and their Jacobian.
//!
//! A step solves `(J^T J + mu D) dx = -J^T r` with D the diagonal of J^T J, largest so far. mu follows the share of the promised
//! decrease that a step brought about (Nielsen 1999), so that near a solution the steps are those of Gauss and Newton.

use nalgebra::{DMatrix, DVector};

/// When a search ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params {
    /// Evaluations at most; at least 1.
    pub evaluations: usize,
    /// A step shorter than this, in units in which a parameter changes the residuals by their own size, is the last.
    pub tolerance: f64,
    /// The first damping, as a share of the diagonal of J^T J.
    pub damping: f64,
}

impl Default for Params {
    fn default() -> Self {
        Self { evaluations: 100, tolerance: 1e-10, damping: 1e-3 }
    }
}

/// Where a search has come to.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// The parameters.
    pub x: DVector<f64>,
    /// The residuals there.
    pub residuals: DVector<f64>,
    /// Their Jacobian: a row a residual, a column a parameter.
    pub jacobian: DMatrix<f64>,
    /// Evaluations taken.
    pub evaluations: usize,
    /// Whether the last step was shorter than the tolerance.
    pub converged: bool,
}

/// The least sum of squares near `x`. `evaluate` returns residuals and their Jacobian, or `None` where there are none: such a
/// step is taken back. `None` where there are none at the start, or they are not finite.
pub fn least_squares(
    x: DVector<f64>,
    params: &Params,
    mut evaluate: impl FnMut(&DVector<f64>) -> Option<(DVector<f64>, DMatrix<f64>)>,
) -> Option<Fit> {
    let is_finite = |(r, j): &(DVector<f64>, DMatrix<f64>)| r.iter().chain(j.iter()).all(|x| x.is_finite());
    let (residuals, jacobian) = evaluate(&x).filter(is_finite)?;
    let mut fit = Fit { x, residuals, jacobian, evaluations: 1, converged: false };
    let mut scale: DVector<f64> = DVector::zeros(fit.x.len());
    let (mut damping, mut growth) = (params.damping, 2.0);
    while fit.evaluations < params.evaluations {
        let normal = fit.jacobian.tr_mul(&fit.jacobian);
        let down = -fit.jacobian.tr_mul(&fit.residuals);
        scale.iter_mut().zip(normal.diagonal().iter()).for_each(|(own, &now)| *own = own.max(now));
        // A parameter that changes nothing stays.
        let least = scale.max() * f64::EPSILON * f64::EPSILON;
        let mut damped = normal.clone();
        (0..scale.len()).for_each(|k| damped[(k, k)] += damping * scale[k] + least.max(f64::MIN_POSITIVE));
        let Some(step) = damped.cholesky().map(|factor| factor.solve(&down)) else { return Some(fit) };
        let size = step.iter().zip(&scale).map(|(dx, scale)| dx * dx * scale).sum::<f64>().sqrt();
        let unit = fit.residuals.norm().max(f64::MIN_POSITIVE);
        if down.iter().all(|x| *x == 0.0) || size <= params.tolerance * unit {
            fit.converged = true;
            return Some(fit);
        }
        let x = &fit.x + &step;
        fit.evaluations += 1;
        let promised = 2.0 * step.dot(&down) - step.dot(&(&normal * &step));
        let tried = evaluate(&x).filter(is_finite);
        let won = tried.as_ref().map_or(-1.0, |(r, _)| fit.residuals.norm_squared() - r.norm_squared());
        match tried {
            Some((residuals, jacobian)) if won > 0.0 => {
                let share = won / promised;
                (damping, growth) = (damping * (1.0 - (2.0 * share - 1.0).powi(3)).clamp(1.0 / 3.0, 2.0), 2.0);
                (fit.x, fit.residuals, fit.jacobian) = (x, residuals, jacobian);
            }
            // Rounding errors of the sum are all that is left.
            Some(_) if promised <= 1e-14 * fit.residuals.norm_squared() => {
                fit.converged = true;
                return Some(fit);
            }
            _ => (damping, growth) = (damping * growth, 2.0 * growth),
        }
    }
    Some(fit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_valley_of_rosenbrock_is_walked_to_its_end() {
        let fit = least_squares(DVector::from_vec(vec![-1.2, 1.0]), &Params::default(), |x| {
            let residuals = DVector::from_vec(vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]]);
            Some((residuals, DMatrix::from_row_slice(2, 2, &[-20.0 * x[0], 10.0, -1.0, 0.0])))
        });
        let fit = fit.unwrap();
        assert!((fit.x - DVector::from_vec(vec![1.0, 1.0])).norm() < 1e-9);
        assert!(fit.evaluations < 40, "{} evaluations", fit.evaluations);
    }

    /// Residuals remain: the solution is where their gradient is zero.
    #[test]
    fn a_decay_is_fitted_beyond_a_wall() {
        let data: Vec<f64> = (0..20).map(|k| (-0.3 * f64::from(k)).exp() + 0.01 * f64::from(k % 3)).collect();
        let fit = least_squares(DVector::from_vec(vec![2.0, 1.5]), &Params::default(), |x| {
            // There is nothing to evaluate where it grows.
            (x[1] > 0.0).then(|| {
                let of = |k: usize| (-x[1] * k as f64).exp();
                let residuals = DVector::from_fn(20, |k, _| x[0] * of(k) - data[k]);
                let jacobian = DMatrix::from_fn(20, 2, |k, c| if c == 0 { of(k) } else { -x[0] * k as f64 * of(k) });
                (residuals, jacobian)
            })
        });
        let fit = fit.unwrap();
        assert!(fit.converged && fit.jacobian.tr_mul(&fit.residuals).norm() < 1e-9, "{fit:?}");
        assert!((fit.x[1] - 0.3).abs() < 0.05);
    }

    #[test]
    fn where_nothing_can_be_evaluated_there_is_no_fit() {
        assert_eq!(least_squares(DVector::zeros(1), &Params::default(), |_| None), None);
    }
}

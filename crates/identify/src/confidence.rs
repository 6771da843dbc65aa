//! How well recordings determine what is identified.

use cosserat::optimise::Normal;
use nalgebra::{DMatrix, DVector};
use report::significant;

use crate::fit::{Fit, LONGEST};
use crate::quantity::Quantity;
use crate::specimen::Numbers;

/// A quantity and what is known of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Known<Q> {
    /// The quantity.
    pub parameter: Q,
    /// Its value.
    pub value: f64,
    /// Where it lies with a confidence of 95 %; `None` where the recordings do not tell, or it was not searched for: it is held
    /// at its value.
    pub interval: Option<[f64; 2]>,
}

impl<Q: Quantity> Known<Q> {
    /// Its interval with three digits, or why there is none.
    pub fn told(&self) -> String {
        match self.interval {
            Some([low, high]) => format!("{} to {}", significant(low, 3), significant(high, 3)),
            None if self.parameter.bounds().contains(&self.value) => "held at its bound".to_owned(),
            None => "held: not searched for, or not determined".to_owned(),
        }
    }
}

/// The quantile of the standard normal distribution that a two-sided 95 % interval ends at.
const QUANTILE: f64 = 1.959_964;
/// The end of that of Student's distribution with few degrees of freedom.
const FEW_DEGREES: [(f64, f64); 3] = [(1.0, 12.706_205), (2.0, 4.302_653), (3.0, 3.182_446)];
/// Widest interval that counts as determined, in factors or, of quantities that may be zero, in shares of their bounds.
const WIDEST: [f64; 2] = [30.0, 0.5];

/// What the recordings of a fit tell of each quantity.
///
/// The variance is the jackknife's, with recordings, or parts of them, as its n independent units: `(n - 1) / n` times the sum of squares of
/// how the fits without each unit scatter (Efron and Stein, Annals of Statistics 9, 1981). It needs no model of the noise, errors may be alike
/// all along a unit, and a quantity that a single unit determines is seen as undetermined. Student's distribution with n - 1 degrees of freedom
/// gives the interval.
pub fn known<N: Numbers>(fit: &Fit<N>) -> Vec<Known<N::Quantity>> {
    let inner = inner(fit);
    let units: Vec<Normal> = fit.normals.iter().flatten().cloned().collect();
    let is_enough = units.len() > inner.len();
    let changes = is_enough.then(|| changes(fit, &inner, &units)).flatten();
    let half = changes.map(|changes| spreads(&changes) * student(units.len() as f64 - 1.0));
    let of = |parameter: N::Quantity| {
        let value = fit.parameters[parameter];
        let place = inner.iter().position(|&k| fit.free[k] == parameter);
        let interval = place.zip(half.as_ref()).and_then(|(k, half)| interval(parameter, value, half[k]));
        Known { parameter, value, interval }
    };
    fit.parameters.quantities().into_iter().map(of).collect()
}

/// The numbers that a fit would have come to without each of its recordings, by one step of Newton's method from where it ended (approximate
/// leave-one-out, Beirami et al., NeurIPS 2017); `None` where the other recordings do not determine them.
pub fn without_each<N: Numbers>(fit: &Fit<N>) -> Option<Vec<N>> {
    let inner = inner(fit);
    let recordings: Vec<Normal> = fit.normals.iter().map(|parts| parts.iter().sum()).collect();
    let numbers = |change: DVector<f64>| {
        let share = (LONGEST / change.amax()).min(1.0);
        let mut numbers = fit.parameters.clone();
        for (&k, change) in inner.iter().zip(&change) {
            let of = fit.free[k];
            numbers[of] = of.value(of.coordinate(numbers[of]) + share * change);
        }
        numbers
    };
    Some(changes(fit, &inner, &recordings)?.into_iter().map(numbers).collect())
}

/// Which of what is free is not at its bound.
fn inner<N: Numbers>(fit: &Fit<N>) -> Vec<usize> {
    (0..fit.free.len()).filter(|&k| !fit.free[k].is_at_bound(fit.parameters[fit.free[k]])).collect()
}

/// By how much the coordinates of some of what is free change without each unit: `(H - H_i)^-1 g_i`, with H the sum of Gauss and Newton's
/// matrices and of what is expected, H_i the matrix and g_i the gradient of the unit. `None` where what is left determines nothing.
fn changes<N: Numbers>(fit: &Fit<N>, inner: &[usize], units: &[Normal]) -> Option<Vec<DVector<f64>>> {
    let own = |matrix: &DMatrix<f64>| matrix.select_rows(inner).select_columns(inner);
    let sum: Normal = units.iter().chain([&fit.expected]).sum();
    let without = |unit: &Normal| {
        let change = (own(&sum.matrix) - own(&unit.matrix)).cholesky()?.solve(&unit.gradient.select_rows(inner));
        change.iter().all(|x| x.is_finite()).then_some(change)
    };
    units.iter().map(without).collect()
}

/// Standard deviations of the coordinates by the jackknife.
fn spreads(changes: &[DVector<f64>]) -> DVector<f64> {
    let count = changes.len() as f64;
    let mean: DVector<f64> = changes.iter().sum::<DVector<f64>>() / count;
    let squares: DVector<f64> = changes.iter().map(|change| (change - &mean).map(|x| x * x)).sum();
    squares.map(|sum| (sum * (count - 1.0) / count).sqrt())
}

/// The end of a two-sided 95 % interval of Student's distribution, in standard deviations (Abramowitz and Stegun, 26.7.5; within 0.3 % from four
/// degrees of freedom on, and as tabulated below).
fn student(freedom: f64) -> f64 {
    let x = QUANTILE;
    if let Some((_, tabulated)) = FEW_DEGREES.iter().find(|(few, _)| freedom <= *few) {
        return *tabulated;
    }
    let terms = [
        (x.powi(3) + x) / 4.0,
        (5.0 * x.powi(5) + 16.0 * x.powi(3) + 3.0 * x) / 96.0,
        (3.0 * x.powi(7) + 19.0 * x.powi(5) + 17.0 * x.powi(3) - 15.0 * x) / 384.0,
    ];
    x + terms.iter().rev().fold(0.0, |sum, term| (sum + term) / freedom)
}

/// The interval of a value whose coordinate lies so far to either side, if it is narrow enough to tell anything.
fn interval<Q: Quantity>(parameter: Q, value: f64, half: f64) -> Option<[f64; 2]> {
    let middle = parameter.coordinate(value);
    let ends = [-1.0, 1.0].map(|side| parameter.value(middle + side * half));
    let [least, most] = parameter.bounds();
    let is_known = match parameter.is_logarithmic() {
        true => 2.0 * half < WIDEST[0].ln(),
        false => ends[1] - ends[0] < WIDEST[1] * (most - least),
    };
    (half.is_finite() && is_known).then_some(ends)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameter::{Parameter, Parameters};

    /// A fit of one curvature to numbers, each with a weight: the mean.
    fn mean(values: &[f64], weights: &[f64]) -> Fit<Parameters> {
        let sum: f64 = weights.iter().sum();
        let mean = values.iter().zip(weights).map(|(value, weight)| value * weight).sum::<f64>() / sum;
        let normal = |(value, weight): (&f64, &f64)| {
            let jacobian = DMatrix::from_element(1, 1, weight.sqrt());
            vec![Normal::new(&DVector::from_element(1, weight.sqrt() * (mean - value)), &jacobian)]
        };
        let mut parameters = Parameters::default();
        parameters[Parameter::Curvature1] = mean;
        let normals = values.iter().zip(weights).map(normal).collect();
        Fit { parameters, free: vec![Parameter::Curvature1], normals, expected: Normal::zero(1), stopped: false }
    }

    fn interval_of(fit: &Fit<Parameters>) -> Option<[f64; 2]> {
        known(fit).into_iter().find(|known| known.parameter == Parameter::Curvature1)?.interval
    }

    #[test]
    fn the_interval_of_a_mean_is_students() {
        // Mean 3, standard deviation sqrt(2.5), 4 degrees of freedom: 3 -+ 2.776 sqrt(2.5 / 5).
        let [low, high] = interval_of(&mean(&[1.0, 2.0, 3.0, 4.0, 5.0], &[1.0; 5])).unwrap();
        for (found, expected) in [(low, 3.0 - 1.963), (high, 3.0 + 1.963)] {
            assert!((found - expected).abs() < 0.01, "{found} {expected}");
        }
    }

    /// A single recording with a weight of a million draws the fit to what it says. The others say something else by 4: no interval of
    /// a thousandth is right.
    #[test]
    fn what_one_recording_alone_determines_has_a_wide_interval() {
        let mut weights = [1.0; 12];
        weights[0] = 1e6;
        let mut values: Vec<f64> = (0..12).map(|k| 4.0 + 0.1 * f64::from(k)).collect();
        values[0] = 0.0;
        let interval = interval_of(&mean(&values, &weights));
        assert!(interval.is_none_or(|[low, high]| high - low > 4.0), "{interval:?}");
    }

    #[test]
    fn the_fit_without_a_recording_is_that_of_the_others() {
        let values = [1.0, 2.0, 3.0, 4.0, 7.0];
        let without = without_each(&mean(&values, &[1.0; 5])).unwrap();
        assert!((without[4][Parameter::Curvature1] - 2.5).abs() < 1e-12);
    }
}

//! How well recordings determine what is identified.

use cosserat::optimise::Normal;
use nalgebra::DMatrix;
use report::significant;

use crate::fit::Fit;
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

/// Half of a 95 % interval, in standard deviations.
const WIDTH: f64 = 1.96;
/// Widest interval that counts as determined, in factors or, of quantities that may be zero, in shares of their bounds.
const WIDEST: [f64; 2] = [30.0, 0.5];

/// What the recordings of a fit tell of each quantity.
///
/// The spread is the sandwich estimate with recordings, or parts of them, as its independent units (White, Econometrica 48, 1980; Liang
/// and Zeger, Biometrika 73, 1986): `H^-1 (sum g g^T) H^-1 n / (n - p)` with H the sum of Gauss and Newton's matrices and g the
/// gradient of a unit. What is expected of quantities beside adds to H alone. It needs no model of the noise, and errors may be alike all along a unit.
pub fn known<N: Numbers>(fit: &Fit<N>) -> Vec<Known<N::Quantity>> {
    let is_inner = |k: &usize| !fit.free[*k].is_at_bound(fit.parameters[fit.free[*k]]);
    let inner: Vec<usize> = (0..fit.free.len()).filter(is_inner).collect();
    let spreads = spreads(&fit.normals, &fit.expected, &inner);
    let of = |parameter: N::Quantity| {
        let value = fit.parameters[parameter];
        let place = inner.iter().position(|&k| fit.free[k] == parameter);
        let interval = place.zip(spreads.as_ref()).and_then(|(k, spreads)| interval(parameter, value, spreads[k]));
        Known { parameter, value, interval }
    };
    fit.parameters.quantities().into_iter().map(of).collect()
}

/// Standard deviations of the coordinates of some of what is free; `None` where the matrix is singular, or there are too few units.
fn spreads(normals: &[Normal], expected: &Normal, inner: &[usize]) -> Option<Vec<f64>> {
    let (units, count) = (normals.len(), inner.len());
    let freedom = units.checked_sub(count).filter(|&freedom| freedom > 0)? as f64;
    let sum: Normal = normals.iter().chain([expected]).sum();
    let inverse = sum.matrix.select_rows(inner).select_columns(inner).try_inverse()?;
    let mut scores = DMatrix::zeros(count, count);
    for normal in normals {
        let gradient = normal.gradient.select_rows(inner);
        scores += &gradient * gradient.transpose();
    }
    let covariance = &inverse * scores * &inverse * (units as f64 / freedom);
    Some(covariance.diagonal().iter().map(|variance| variance.sqrt()).collect())
}

/// The interval of a value whose coordinate has this spread, if it is narrow enough to tell anything.
fn interval<Q: Quantity>(parameter: Q, value: f64, spread: f64) -> Option<[f64; 2]> {
    let middle = parameter.coordinate(value);
    let ends = [-1.0, 1.0].map(|side| parameter.value(middle + side * WIDTH * spread));
    let [least, most] = parameter.bounds();
    let is_known = match parameter.is_logarithmic() {
        true => 2.0 * WIDTH * spread < WIDEST[0].ln(),
        false => ends[1] - ends[0] < WIDEST[1] * (most - least),
    };
    (spread.is_finite() && is_known).then_some(ends)
}

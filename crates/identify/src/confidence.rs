//! How well recordings determine the parameters of a cable.

use nalgebra::DMatrix;
use optimise::Normal;
use report::significant;

use crate::fit::Fit;
use crate::parameter::{Parameter, Parameters};

/// A parameter and what is known of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Known {
    /// The parameter.
    pub parameter: Parameter,
    /// Its value.
    pub value: f64,
    /// Where it lies with a confidence of 95 %; `None` where the recordings do not tell, or it was not searched for: it is held
    /// at its value.
    pub interval: Option<[f64; 2]>,
}

impl Known {
    /// Its interval with three digits, or why there is none.
    pub fn told(&self) -> String {
        let [least, most] = self.parameter.bounds();
        match self.interval {
            Some([low, high]) => format!("{} to {}", significant(low, 3), significant(high, 3)),
            None if self.value == least || self.value == most => "held at its bound".to_owned(),
            None => "held: not searched for, or not determined".to_owned(),
        }
    }
}

/// Half of a 95 % interval, in standard deviations.
pub(crate) const WIDTH: f64 = 1.96;
/// Widest interval of a parameter that counts as determined, in factors or, of those that may be zero, in shares of its bounds.
const WIDEST: [f64; 2] = [30.0, 0.5];

/// What the recordings of a fit tell of each parameter.
///
/// The spread is the sandwich estimate with recordings as its independent units (White, Econometrica 48, 1980; Liang and Zeger,
/// Biometrika 73, 1986): `H^-1 (sum g g^T) H^-1 n / (n - p)` with H the sum of Gauss and Newton's matrices and g a recording's
/// gradient. It needs no model of the noise, and errors may be alike all along a recording.
pub fn known(fit: &Fit) -> Vec<Known> {
    let inner: Vec<usize> = (0..fit.free.len()).filter(|&k| !is_at_bound(fit.free[k], &fit.parameters)).collect();
    let spreads = spreads(&fit.normals, &inner);
    let of = |parameter: Parameter| {
        let value = fit.parameters[parameter];
        let place = inner.iter().position(|&k| fit.free[k] == parameter);
        let interval = place.zip(spreads.as_ref()).and_then(|(k, spreads)| interval(parameter, value, spreads[k]));
        Known { parameter, value, interval }
    };
    Parameter::ALL.into_iter().map(of).collect()
}

/// Standard deviations of the coordinates of some of the free parameters; `None` where the matrix is singular, or there are
/// too few recordings.
pub(crate) fn spreads(normals: &[Normal], inner: &[usize]) -> Option<Vec<f64>> {
    let (recordings, count) = (normals.len(), inner.len());
    let freedom = recordings.checked_sub(count).filter(|&freedom| freedom > 0)? as f64;
    let sum: Normal = normals.iter().sum();
    let inverse = sum.matrix.select_rows(inner).select_columns(inner).try_inverse()?;
    let mut scores = DMatrix::zeros(count, count);
    for normal in normals {
        let gradient = normal.gradient.select_rows(inner);
        scores += &gradient * gradient.transpose();
    }
    let covariance = &inverse * scores * &inverse * (recordings as f64 / freedom);
    Some(covariance.diagonal().iter().map(|variance| variance.sqrt()).collect())
}

/// The interval of a value whose coordinate has this spread, if it is narrow enough to tell anything.
fn interval(parameter: Parameter, value: f64, spread: f64) -> Option<[f64; 2]> {
    let middle = parameter.coordinate(value);
    let ends = [-1.0, 1.0].map(|side| parameter.value(middle + side * WIDTH * spread));
    let [least, most] = parameter.bounds();
    let is_known = match parameter.is_logarithmic() {
        true => 2.0 * WIDTH * spread < WIDEST[0].ln(),
        false => ends[1] - ends[0] < WIDEST[1] * (most - least),
    };
    (spread.is_finite() && is_known).then_some(ends)
}

/// Whether a parameter went as far as it may.
fn is_at_bound(parameter: Parameter, parameters: &Parameters) -> bool {
    let [value, least, most] =
        [parameters[parameter], parameter.bounds()[0], parameter.bounds()[1]].map(|value| parameter.coordinate(value));
    value - least < 1e-6 || most - value < 1e-6
}

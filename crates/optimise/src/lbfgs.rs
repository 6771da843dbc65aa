//! L-BFGS: the least of a smooth function of many parameters, from its gradient.

use std::collections::VecDeque;

use nalgebra::DVector;

/// A step must lower the function by this part of what its slope promises,
const DECREASE: f64 = 1e-4;
/// and leave no more than this part of the slope.
const SLOPE: f64 = 0.9;
/// Most evaluations along a line.
const TRIALS: usize = 40;

/// How to search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LbfgsParams {
    /// Most iterations: directions.
    pub iterations: usize,
    /// The search ends where the gradient's norm is at most this part of the first one's.
    pub tolerance: f64,
    /// Length of the first step, in the norm of all parameters.
    pub first_step: f64,
    /// Steps that are remembered; at least 1.
    pub memory: usize,
}

impl Default for LbfgsParams {
    fn default() -> Self {
        Self { iterations: 200, tolerance: 1e-6, first_step: 1.0, memory: 10 }
    }
}

/// Where a search has come to.
#[derive(Clone, Debug, PartialEq)]
pub struct Minimum {
    /// The parameters.
    pub x: DVector<f64>,
    /// The function there; not finite where it has no value at the start.
    pub value: f64,
    /// Its gradient there.
    pub gradient: DVector<f64>,
    /// Iterations done.
    pub iterations: usize,
    /// Evaluations of the function with its gradient.
    pub evaluations: usize,
    /// Whether the gradient is as small as was asked for.
    pub converged: bool,
}

/// The least value of a function near `x`, by the method of Liu and Nocedal (1989). `evaluate` returns value and gradient; where
/// they are not finite, there is none. Lines are searched by halving and doubling for the weak conditions of Wolfe (Lewis and
/// Overton 2013), which takes 1 evaluation in most iterations.
///
/// ```
/// use std::convert::Infallible;
///
/// use nalgebra::DVector;
/// use optimise::{LbfgsParams, lbfgs};
///
/// // A bowl that is steeper along each next parameter.
/// let bowl = |x: &DVector<f64>| {
///     let gradient = DVector::from_fn(x.len(), |k, _| (k as f64 + 1.0) * (x[k] - 1.0));
///     Ok::<_, Infallible>((0.5 * gradient.dot(&x.add_scalar(-1.0)), gradient))
/// };
/// let minimum = lbfgs(DVector::zeros(50), &LbfgsParams::default(), bowl)?;
/// assert!(minimum.converged && minimum.x.add_scalar(-1.0).norm() < 1e-3);
/// # Ok::<(), Infallible>(())
/// ```
///
/// # Errors
/// Those of `evaluate`.
pub fn lbfgs<E>(
    x: DVector<f64>,
    params: &LbfgsParams,
    mut evaluate: impl FnMut(&DVector<f64>) -> Result<(f64, DVector<f64>), E>,
) -> Result<Minimum, E> {
    let (value, gradient) = evaluate(&x)?;
    let wanted = params.tolerance * gradient.norm();
    let mut at = Minimum { x, value, gradient, iterations: 0, evaluations: 1, converged: false };
    let mut memory = Memory { pairs: VecDeque::with_capacity(params.memory) };
    while has_value(at.value, &at.gradient) {
        at.converged = at.gradient.norm() <= wanted;
        if at.converged || at.iterations == params.iterations {
            break;
        }
        let way = match memory.pairs.is_empty() {
            true => &at.gradient * (-params.first_step / at.gradient.norm()),
            false => memory.way(&at.gradient),
        };
        match searched(&at, &way, &mut evaluate)? {
            (trials, Some((x, value, gradient))) => {
                memory.remember(&x - &at.x, &gradient - &at.gradient, params.memory);
                at.evaluations += trials;
                (at.x, at.value, at.gradient) = (x, value, gradient);
            }
            // The direction is of no use: from the gradient once more, and if it was that, this is all.
            (trials, None) => {
                at.evaluations += trials;
                if memory.pairs.is_empty() {
                    break;
                }
                memory.pairs.clear();
            }
        }
        at.iterations += 1;
    }
    Ok(at)
}

/// Whether a function has a value and a gradient.
fn has_value(value: f64, gradient: &DVector<f64>) -> bool {
    value.is_finite() && gradient.iter().all(|x| x.is_finite())
}

/// A place with its value and gradient.
type Place = (DVector<f64>, f64, DVector<f64>);

/// Evaluations along a line, and the place on it that meets both conditions, if any was found.
fn searched<E>(
    at: &Minimum,
    way: &DVector<f64>,
    evaluate: &mut impl FnMut(&DVector<f64>) -> Result<(f64, DVector<f64>), E>,
) -> Result<(usize, Option<Place>), E> {
    let slope = at.gradient.dot(way);
    let (mut near, mut far, mut share) = (0.0, f64::INFINITY, 1.0);
    // A value of NaN is no descent either.
    let is_descent = slope < 0.0;
    for trial in 1..=if is_descent { TRIALS } else { 0 } {
        let x = &at.x + way * share;
        let (value, gradient) = evaluate(&x)?;
        if !has_value(value, &gradient) || value > at.value + DECREASE * share * slope {
            far = share;
        } else if gradient.dot(way) < SLOPE * slope {
            near = share;
        } else {
            return Ok((trial, Some((x, value, gradient))));
        }
        share = if far.is_finite() { 0.5 * (near + far) } else { 2.0 * near };
    }
    Ok((if is_descent { TRIALS } else { 0 }, None))
}

/// The last steps, oldest first.
struct Memory {
    /// What the parameters and the gradient changed by, and one over their product.
    pairs: VecDeque<(DVector<f64>, DVector<f64>, f64)>,
}

impl Memory {
    fn remember(&mut self, step: DVector<f64>, change: DVector<f64>, most: usize) {
        if self.pairs.len() >= most.max(1) {
            self.pairs.pop_front();
        }
        // Positive, by the second condition of Wolfe, but for rounding errors.
        let product = step.dot(&change);
        if product > f64::MIN_POSITIVE {
            self.pairs.push_back((step, change, 1.0 / product));
        }
    }

    /// The direction: two loops over what is remembered.
    fn way(&self, gradient: &DVector<f64>) -> DVector<f64> {
        let mut way = -gradient;
        let mut shares = Vec::with_capacity(self.pairs.len());
        for (step, change, inverse) in self.pairs.iter().rev() {
            let share = inverse * step.dot(&way);
            way.axpy(-share, change, 1.0);
            shares.push(share);
        }
        if let Some((_, change, inverse)) = self.pairs.back() {
            way /= inverse * change.norm_squared();
        }
        for ((step, change, inverse), share) in self.pairs.iter().zip(shares.into_iter().rev()) {
            let back = inverse * change.dot(&way);
            way.axpy(share - back, step, 1.0);
        }
        way
    }
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;

    /// Rosenbrock's function of many parameters, in pairs.
    fn valleys(x: &DVector<f64>) -> Result<(f64, DVector<f64>), Infallible> {
        let mut gradient = DVector::zeros(x.len());
        let mut value = 0.0;
        for k in (0..x.len()).step_by(2) {
            let [over, ahead] = [x[k + 1] - x[k] * x[k], 1.0 - x[k]];
            value += 100.0 * over * over + ahead * ahead;
            gradient[k] = -400.0 * over * x[k] - 2.0 * ahead;
            gradient[k + 1] = 200.0 * over;
        }
        Ok((value, gradient))
    }

    #[test]
    fn valleys_are_walked_to_their_ends() {
        let start = DVector::from_fn(100, |k, _| if k % 2 == 0 { -1.2 } else { 1.0 });
        let params = LbfgsParams { tolerance: 1e-9, ..LbfgsParams::default() };
        let minimum = lbfgs(start, &params, valleys).unwrap();
        assert!(minimum.converged && minimum.x.add_scalar(-1.0).norm() < 1e-6, "{minimum:?}");
        assert!(minimum.evaluations < 70, "{} evaluations", minimum.evaluations);
    }

    /// A quadratic function of n parameters takes about n iterations where all is remembered.
    #[test]
    fn with_all_remembered_a_bowl_takes_as_many_iterations_as_it_has_parameters() {
        let bowl = |x: &DVector<f64>| {
            let gradient = DVector::from_fn(x.len(), |k, _| 10f64.powi(k as i32) * x[k]);
            Ok::<_, Infallible>((0.5 * gradient.dot(x), gradient))
        };
        let params = LbfgsParams { memory: 20, tolerance: 1e-8, ..LbfgsParams::default() };
        let minimum = lbfgs(DVector::from_element(5, 1.0), &params, bowl).unwrap();
        assert!(minimum.converged && minimum.iterations <= 30, "{minimum:?}");
    }

    #[test]
    fn a_wall_is_not_crossed() {
        // x - ln x: without a value below zero, least at 1.
        let wall =
            |x: &DVector<f64>| Ok::<_, Infallible>((x[0] - x[0].ln(), DVector::from_element(1, 1.0 - 1.0 / x[0])));
        let params = LbfgsParams { first_step: 100.0, tolerance: 1e-10, ..LbfgsParams::default() };
        let minimum = lbfgs(DVector::from_element(1, 5.0), &params, wall).unwrap();
        assert!(minimum.converged && (minimum.x[0] - 1.0).abs() < 1e-8, "{minimum:?}");
    }

    #[test]
    fn where_there_is_no_value_at_the_start_the_search_ends_there() {
        let none = |x: &DVector<f64>| Ok::<_, Infallible>((f64::NAN, x.clone()));
        let minimum = lbfgs(DVector::from_element(2, 5.0), &LbfgsParams::default(), none).unwrap();
        assert!(!minimum.converged && minimum.evaluations == 1, "{minimum:?}");
    }
}

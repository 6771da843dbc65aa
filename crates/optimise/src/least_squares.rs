//! Least squares: the method of Gauss and Newton with Marquardt's damping, within bounds.

use std::iter::Sum;

use nalgebra::{DMatrix, DVector};

/// Least damping, as a share of the diagonal.
const LEAST: f64 = 1e-6;
/// Most damping: steps as short as this changes nothing.
const MOST: f64 = 1e6;
/// Damping after a step that lowers the loss is so much of what it was, and after one that does not,
const CALMER: f64 = 0.2;
/// so much.
const STRICTER: f64 = 8.0;
/// A parabola is lower twice as far where it has fallen by more than this part of what its slope promised.
const FURTHER: f64 = 2.0 / 3.0;
/// So much of the mean of the diagonal is added to it, for parameters that change nothing.
const REGULAR: f64 = 1e-9;

/// What residuals r(x) are near a place x, with their Jacobian J: the loss and its expansion to second order.
#[derive(Clone, Debug, PartialEq)]
pub struct Normal {
    /// Half the sum of squares, or Huber's loss.
    pub loss: f64,
    /// Residuals that count.
    pub count: usize,
    /// Gradient of the loss, `J^T W r`.
    pub gradient: DVector<f64>,
    /// Gauss and Newton's matrix, `J^T W J`.
    pub matrix: DMatrix<f64>,
}

impl Normal {
    /// No residuals, and so many parameters.
    pub fn zero(parameters: usize) -> Self {
        let (gradient, matrix) = (DVector::zeros(parameters), DMatrix::zeros(parameters, parameters));
        Self { loss: 0.0, count: 0, gradient, matrix }
    }

    /// Residuals and their Jacobian: a row a residual, a column a parameter.
    pub fn new(residuals: &DVector<f64>, jacobian: &DMatrix<f64>) -> Self {
        Self {
            loss: 0.5 * residuals.norm_squared(),
            count: residuals.len(),
            gradient: jacobian.tr_mul(residuals),
            matrix: jacobian.tr_mul(jacobian),
        }
    }

    /// Adds a residual with its row of the Jacobian. Beyond `huber` it counts linearly and no longer squared (Huber 1964;
    /// infinite: always squared), by the weights of Holland and Welsch (1977).
    pub fn add(&mut self, residual: f64, slopes: &[f64], huber: f64) {
        let far = residual.abs();
        let weight = if far <= huber { 1.0 } else { huber / far };
        self.count += 1;
        self.loss += if far <= huber { 0.5 * far * far } else { huber * (far - 0.5 * huber) };
        for (a, &slope) in slopes.iter().enumerate() {
            self.gradient[a] += weight * slope * residual;
            for (b, &other) in slopes[..=a].iter().enumerate() {
                let term = weight * slope * other;
                self.matrix[(a, b)] += term;
                if a != b {
                    self.matrix[(b, a)] += term;
                }
            }
        }
    }
}

impl<'a> Sum<&'a Normal> for Normal {
    /// All residuals together; of nothing, without parameters.
    fn sum<I: Iterator<Item = &'a Normal>>(normals: I) -> Self {
        let add = |mut sum: Normal, normal: &Normal| {
            sum.loss += normal.loss;
            sum.count += normal.count;
            sum.gradient += &normal.gradient;
            sum.matrix += &normal.matrix;
            sum
        };
        let mut normals = normals;
        let first = normals.next().cloned();
        first.map_or_else(|| Normal::zero(0), |first| normals.fold(first, add))
    }
}

/// Residuals that depend on parameters.
pub trait Residuals {
    /// What ends a search.
    type Error;

    /// The loss at `x`; not finite where there is none.
    ///
    /// # Errors
    /// Those of the problem.
    fn loss(&mut self, x: &DVector<f64>) -> Result<f64, Self::Error>;

    /// The loss and its expansion at `x`. It is asked for at the start and where a step led to that lowered the loss.
    ///
    /// # Errors
    /// Those of the problem.
    fn normal(&mut self, x: &DVector<f64>) -> Result<Normal, Self::Error>;
}

/// A search for the least loss, step by step (Marquardt 1963): `(H + mu diag H) dx = -g` with H and g of a [`Normal`]. The damping
/// mu becomes less with each step that lowers the loss, so that near a solution steps are those of Gauss and Newton.
///
/// ```
/// use std::convert::Infallible;
///
/// use nalgebra::{DMatrix, DVector};
/// use optimise::{LeastSquares, Normal, Residuals};
///
/// /// Rosenbrock's valley.
/// struct Valley;
///
/// impl Residuals for Valley {
///     type Error = Infallible;
///
///     fn loss(&mut self, x: &DVector<f64>) -> Result<f64, Infallible> {
///         Ok(self.normal(x)?.loss)
///     }
///
///     fn normal(&mut self, x: &DVector<f64>) -> Result<Normal, Infallible> {
///         let residuals = DVector::from_vec(vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]]);
///         Ok(Normal::new(&residuals, &DMatrix::from_row_slice(2, 2, &[-20.0 * x[0], 10.0, -1.0, 0.0])))
///     }
/// }
///
/// let mut search = LeastSquares::new(DVector::from_vec(vec![-1.2, 1.0]));
/// let fit = search.run(&mut Valley, 40)?;
/// assert!(fit.converged && (search.x - DVector::from_element(2, 1.0)).norm() < 1e-12);
/// # Ok::<(), Infallible>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct LeastSquares {
    /// The best parameters so far.
    pub x: DVector<f64>,
    /// The least and the largest value of each; empty: anything.
    pub bounds: Vec<[f64; 2]>,
    /// Furthest way of a parameter in a step, before it is stretched.
    pub longest: f64,
    /// The search ends where a step lowers the loss, or promises to, by no more than this part of it.
    pub tolerance: f64,
    /// Damping of the next step, as a share of the diagonal.
    pub damping: f64,
}

/// What a step came to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// The loss where it began.
    pub before: f64,
    /// The loss that it came to: `before`, if none was lower.
    pub loss: f64,
    /// Residuals that count.
    pub count: usize,
    /// Places that were tried.
    pub trials: usize,
    /// Whether this was the last: there is no more to win than the tolerance asks for.
    pub converged: bool,
}

/// What a search came to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// The loss; not finite where there is none at the start.
    pub loss: f64,
    /// Steps that were taken.
    pub steps: usize,
    /// Whether the last of them promised no more than the tolerance asks for.
    pub converged: bool,
}

/// Where damped equations lead.
struct Way {
    way: DVector<f64>,
    /// Whether a parameter would have gone further, but for its bound or the longest way.
    is_cut: bool,
}

impl LeastSquares {
    /// A search from `x`, without bounds, to a change of the loss of 1e-12.
    pub fn new(x: DVector<f64>) -> Self {
        Self { x, bounds: Vec::new(), longest: f64::INFINITY, tolerance: 1e-12, damping: 1e-2 }
    }

    /// At most so many steps.
    ///
    /// # Errors
    /// Those of the problem.
    pub fn run<P: Residuals>(&mut self, problem: &mut P, steps: usize) -> Result<Fit, P::Error> {
        let mut fit = Fit { loss: f64::NAN, steps: 0, converged: false };
        for _ in 0..steps {
            let step = self.step(problem)?;
            fit = Fit { loss: step.loss, steps: fit.steps + 1, converged: step.converged };
            // Not even the shortest step is lower: there is nothing to follow.
            if step.converged || step.loss.is_nan() || step.loss >= step.before {
                break;
            }
        }
        Ok(fit)
    }

    /// A step: with more and more damping, until the loss is lower, and then further as long as that pays.
    ///
    /// # Errors
    /// Those of the problem.
    pub fn step<P: Residuals>(&mut self, problem: &mut P) -> Result<Step, P::Error> {
        let normal = problem.normal(&self.x)?;
        let before = normal.loss;
        let mut step = Step { before, loss: before, count: normal.count, trials: 0, converged: false };
        while let Some(Way { way, is_cut }) = self.way(&normal) {
            let promised = -(normal.gradient.dot(&way) + 0.5 * way.dot(&(&normal.matrix * &way)));
            let is_short = way.norm() <= 4.0 * f64::EPSILON * self.x.norm();
            // Of a way that is cut short in some parameters alone the promise says nothing.
            if is_short || promised <= 0.0 && !is_cut {
                step.converged = true;
                break;
            }
            let loss = problem.loss(&(&self.x + &way))?;
            step.trials += 1;
            if loss < before {
                step.loss = loss;
                let slope = -normal.gradient.dot(&way);
                self.stretch(problem, way, slope, &mut step)?;
                self.damping = (self.damping * CALMER).max(LEAST);
                step.converged = before - step.loss <= self.tolerance * before;
                break;
            }
            if loss.is_finite() && promised <= self.tolerance * before && !is_cut {
                step.converged = true;
                break;
            }
            if self.damping >= MOST {
                break;
            }
            self.damping = (self.damping * STRICTER).min(MOST);
        }
        Ok(step)
    }

    /// Goes a `way` that lowers the loss, and twice as far, again and again, as long as the parabola through what was found is lower there and so is
    /// the loss. Far residuals of Huber's loss, which bend it less than their weights tell, make steps too short, always the same way.
    fn stretch<P: Residuals>(
        &mut self,
        problem: &mut P,
        mut way: DVector<f64>,
        mut slope: f64,
        step: &mut Step,
    ) -> Result<(), P::Error> {
        let from = self.x.clone();
        self.x += &way;
        while step.before - step.loss > FURTHER * slope {
            (way, slope) = (way * 2.0, slope * 2.0);
            let mut x = &from + &way;
            x.iter_mut().zip(&self.bounds).for_each(|(x, [least, most])| *x = x.clamp(*least, *most));
            let loss = problem.loss(&x)?;
            step.trials += 1;
            if loss.is_nan() || loss >= step.loss {
                break;
            }
            (self.x, step.loss) = (x, loss);
        }
        Ok(())
    }

    /// Where the damped equations lead. What would leave its bounds stays there, and the others move without it. `None` where
    /// the equations have no solution.
    fn way(&self, normal: &Normal) -> Option<Way> {
        let bounds = |k: usize| self.bounds.get(k).copied().unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        let mut moving: Vec<usize> = (0..self.x.len()).collect();
        loop {
            let mut matrix = normal.matrix.select_rows(&moving).select_columns(&moving);
            let least = REGULAR * matrix.trace().max(f64::MIN_POSITIVE);
            for k in 0..moving.len() {
                matrix[(k, k)] += self.damping * matrix[(k, k)] + least;
            }
            let part = -matrix.cholesky()?.solve(&normal.gradient.select_rows(&moving));
            let mut way = DVector::zeros(self.x.len());
            moving.iter().zip(&part).for_each(|(&k, part)| way[k] = part.clamp(-self.longest, self.longest));
            let is_out = |&k: &usize| {
                let ([least, most], at) = (bounds(k), self.x[k]);
                (at + way[k] <= least && at <= least + 1e-9) || (at + way[k] >= most && at >= most - 1e-9)
            };
            if let Some(out) = moving.iter().position(is_out) {
                moving.remove(out);
                continue;
            }
            for &k in &moving {
                let [least, most] = bounds(k);
                let to = self.x[k] + way[k];
                if !(least..=most).contains(&to) {
                    way[k] = to.clamp(least, most) - self.x[k];
                }
            }
            let is_cut = moving.iter().zip(&part).any(|(&k, part)| way[k] != *part);
            return Some(Way { way, is_cut });
        }
    }
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;

    /// Observations k of `x0 exp(-x1 k)`, and how often they were looked at.
    struct Decay {
        data: Vec<f64>,
        huber: f64,
        normals: usize,
    }

    impl Residuals for Decay {
        type Error = Infallible;

        fn loss(&mut self, x: &DVector<f64>) -> Result<f64, Infallible> {
            // There is nothing to look at where it grows.
            let normals = self.normals;
            let loss = if x[1] > 0.0 { self.normal(x)?.loss } else { f64::INFINITY };
            self.normals = normals;
            Ok(loss)
        }

        fn normal(&mut self, x: &DVector<f64>) -> Result<Normal, Infallible> {
            self.normals += 1;
            let mut normal = Normal::zero(2);
            for (k, data) in self.data.iter().enumerate() {
                let decay = (-x[1] * k as f64).exp();
                normal.add(x[0] * decay - data, &[decay, -x[0] * k as f64 * decay], self.huber);
            }
            Ok(normal)
        }
    }

    /// With noise, so that the loss at the end is not zero.
    fn decay(huber: f64) -> Decay {
        let data = (0..20).map(|k| (-0.3 * f64::from(k)).exp() + 1e-3 * f64::from(k % 3)).collect();
        Decay { data, huber, normals: 0 }
    }

    #[test]
    fn at_the_end_the_gradient_is_zero_and_the_wall_was_not_crossed() {
        let mut problem = decay(f64::INFINITY);
        let mut search = LeastSquares::new(DVector::from_vec(vec![2.0, 1.5]));
        let fit = search.run(&mut problem, 40).unwrap();
        assert!(fit.converged && fit.steps == problem.normals && fit.steps < 15, "{fit:?}");
        let end = problem.normal(&search.x).unwrap();
        assert!(end.gradient.norm() < 1e-7, "{}", end.gradient);
        assert!((search.x[1] - 0.3).abs() < 0.01, "{}", search.x);
    }

    #[test]
    fn an_outlier_moves_huber_by_less() {
        let mut apart = [f64::INFINITY, 1e-2].map(|huber| {
            let mut problem = decay(huber);
            problem.data[3] += 1.0;
            let mut search = LeastSquares::new(DVector::from_vec(vec![2.0, 1.5]));
            assert!(search.run(&mut problem, 60).unwrap().converged);
            (search.x[1] - 0.3).abs()
        });
        apart[1] *= 5.0;
        assert!(apart[1] < apart[0], "{apart:?}");
    }

    #[test]
    fn what_would_leave_its_bounds_stays_and_the_other_is_the_best_beside_it() {
        let mut problem = decay(f64::INFINITY);
        let mut search = LeastSquares::new(DVector::from_vec(vec![2.0, 1.5]));
        search.bounds = vec![[0.0, 10.0], [0.5, 2.0]];
        assert!(search.run(&mut problem, 40).unwrap().converged);
        assert_eq!(search.x[1], 0.5);
        let end = problem.normal(&search.x).unwrap();
        assert!(end.gradient[0].abs() < 1e-9 && end.gradient[1] > 0.0, "{}", end.gradient);
    }

    #[test]
    fn normals_of_parts_are_the_normal_of_all() {
        let (residuals, jacobian) =
            (DVector::from_fn(6, |k, _| k as f64 - 2.0), DMatrix::from_fn(6, 2, |k, c| (k + c) as f64));
        let part = |rows: std::ops::Range<usize>| {
            let mut normal = Normal::zero(2);
            rows.for_each(|k| normal.add(residuals[k], &[jacobian[(k, 0)], jacobian[(k, 1)]], f64::INFINITY));
            normal
        };
        let sum: Normal = [part(0..4), part(4..6)].iter().sum();
        assert_eq!(sum, Normal::new(&residuals, &jacobian));
    }

    /// Most residuals are far, and their weights tell a loss that is bent more than it is: steps of their own length take three times as many.
    #[test]
    fn far_residuals_do_not_make_it_slow() {
        struct Far;
        impl Residuals for Far {
            type Error = Infallible;

            fn loss(&mut self, x: &DVector<f64>) -> Result<f64, Infallible> {
                Ok(self.normal(x)?.loss)
            }

            fn normal(&mut self, x: &DVector<f64>) -> Result<Normal, Infallible> {
                let mut normal = Normal::zero(2);
                for k in 0..101 {
                    let t = f64::from(k) / 100.0;
                    let data = 20.0 * (7.0 * f64::from(k)).sin() + if k % 3 == 0 { 30.0 } else { 0.0 };
                    normal.add(x[0] + x[1] * t - data, &[1.0, t], 0.1);
                }
                Ok(normal)
            }
        }
        let mut search = LeastSquares { tolerance: 1e-6, ..LeastSquares::new(DVector::from_vec(vec![60.0, -80.0])) };
        let fit = search.run(&mut Far, 60).unwrap();
        assert!(fit.converged && fit.steps <= 12, "{fit:?}");
    }

    /// A narrow valley that a bound cuts off: a step along it that is cut in one parameter leaves the valley.
    #[test]
    fn a_step_that_a_bound_cuts_is_not_the_last() {
        struct Valley;
        impl Residuals for Valley {
            type Error = Infallible;

            fn loss(&mut self, x: &DVector<f64>) -> Result<f64, Infallible> {
                Ok(self.normal(x)?.loss)
            }

            fn normal(&mut self, x: &DVector<f64>) -> Result<Normal, Infallible> {
                let residuals = DVector::from_vec(vec![x[0] + x[1], 0.01 * (x[0] - x[1] - 40.0)]);
                Ok(Normal::new(&residuals, &DMatrix::from_row_slice(2, 2, &[1.0, 1.0, 0.01, -0.01])))
            }
        }
        let mut search = LeastSquares::new(DVector::zeros(2));
        search.bounds = vec![[-1.0, 0.5], [-100.0, 100.0]];
        assert!(search.run(&mut Valley, 40).unwrap().converged);
        // Of the sum, and a hundredth of the difference, in y alone.
        let y = (-0.5 + 1e-4 * (0.5 - 40.0)) / (1.0 + 1e-4);
        assert!((search.x - DVector::from_vec(vec![0.5, y])).norm() < 1e-6);
    }

    #[test]
    fn where_nothing_has_a_value_the_search_ends_where_it_began() {
        let mut problem = decay(f64::INFINITY);
        problem.data[0] = f64::NAN;
        let mut search = LeastSquares::new(DVector::from_vec(vec![2.0, 1.5]));
        let fit = search.run(&mut problem, 40).unwrap();
        assert!(!fit.converged && fit.loss.is_nan() && fit.steps == 1, "{fit:?}");
        assert_eq!(search.x, DVector::from_vec(vec![2.0, 1.5]));
    }
}

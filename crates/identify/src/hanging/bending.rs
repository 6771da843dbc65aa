//! The stiffness of bending with which a wire hangs as it was photographed.

use cosserat::derivative::{DerivativeError, Equilibrium, Parameter, Rods};
use cosserat::optimise::{LeastSquares, Normal, Residuals};
use cosserat::statics::StaticParams;
use nalgebra::{DVector, Vector3};

use super::wire::in_space;
use super::{HangingError, Photograph, Wire};

/// Lengths over which gravity bends a wire, `(EI / (rho A g))^(1/3)`, in its lengths, between which it is searched.
const BOUNDS: [f64; 2] = [5e-3, 0.5];
/// Stiffnesses that are tried before the search, evenly by their logarithm.
const TRIED: usize = 8;
/// Most iterations.
const ITERATIONS: usize = 30;

/// A wire with the stiffness that a photograph shows.
#[derive(Clone, Debug, PartialEq)]
pub struct Bent {
    /// EI [N m^2].
    pub bending: f64,
    /// Distances of the photographed points from the places of the wire at the same shares of the length [m].
    pub distances: Vec<f64>,
}

impl Bent {
    /// Their mean [m].
    pub fn mean_distance(&self) -> f64 {
        self.distances.iter().sum::<f64>() / self.distances.len() as f64
    }
}

/// The stiffness of bending of a wire by least squares over the points of one photograph. Points and wire are compared at
/// the same shares of their lengths. Derivatives are those of the equilibrium.
///
/// # Errors
/// If the wire does not reach from grip to grip, or does not come to rest.
pub fn bending(wire: &Wire, photograph: &Photograph) -> Result<Bent, HangingError> {
    let weight = wire.line_density * crate::cable::GRAVITY;
    let bounds = BOUNDS.map(|share| (weight * (share * wire.length).powi(3)).ln());
    let mut shape = Shape { wire, photograph, shares: shares(photograph) };
    let mut best = (f64::INFINITY, bounds[0]);
    for k in 0..TRIED {
        let x = bounds[0] + (bounds[1] - bounds[0]) * (k as f64 + 0.5) / TRIED as f64;
        let loss = shape.loss(&DVector::from_element(1, x))?;
        if loss < best.0 {
            best = (loss, x);
        }
    }
    let mut search = LeastSquares::new(DVector::from_element(1, best.1));
    search.bounds = vec![bounds];
    search.run(&mut shape, ITERATIONS)?;
    if bounds.iter().any(|end| (search.x[0] - end).abs() < 1e-6) {
        return Err(HangingError::NoBending { bending: search.x[0].exp() });
    }
    let residuals = shape.at(search.x[0])?;
    Ok(Bent { bending: search.x[0].exp(), distances: residuals.iter().map(|(r, _)| r.norm()).collect() })
}

/// Shares of the length at which the points of a photograph lie.
fn shares(photograph: &Photograph) -> Vec<f64> {
    let length = photograph.length();
    let mut at = 0.0;
    let way = photograph.points.windows(2).map(|pair| {
        at += (pair[1] - pair[0]).norm() / length;
        at.min(1.0)
    });
    std::iter::once(0.0).chain(way).collect()
}

/// A residual [m], and its derivative with the logarithm of the stiffness [m].
type Residual = (Vector3<f64>, Vector3<f64>);

struct Shape<'a> {
    wire: &'a Wire,
    photograph: &'a Photograph,
    shares: Vec<f64>,
}

impl Shape<'_> {
    /// How far the wire at rest is from the points, with the logarithm of a stiffness.
    fn at(&self, x: f64) -> Result<Vec<Residual>, HangingError> {
        // Twist is zero in a plane.
        let (model, state) = self.wire.model(self.photograph, x.exp(), 1.0)?;
        let mut equilibrium = Equilibrium::new(&model, &state, &StaticParams::default())?;
        let change = equilibrium.forward(&Parameter::Bending(Rods::All).variation(&model))?;
        let state = equilibrium.state();
        let place = |share: f64| {
            let along = share * state.len() as f64;
            let i = (along as usize).min(state.len() - 1);
            let arm = state.axis(i) * ((along - i as f64 - 0.5) * model.segments[i].length);
            (state.positions[i] + arm, change.positions[i] + change.turns[i].cross(&arm))
        };
        let residual = |(&share, point): (&f64, _)| {
            let (place, change) = place(share);
            (place - in_space(point), change)
        };
        Ok(self.shares.iter().zip(&self.photograph.points).map(residual).collect())
    }
}

impl Residuals for Shape<'_> {
    type Error = HangingError;

    fn loss(&mut self, x: &DVector<f64>) -> Result<f64, HangingError> {
        match self.normal(x) {
            Ok(normal) => Ok(normal.loss),
            // A stiffness with which nothing comes to rest is none.
            Err(HangingError::Equilibrium(DerivativeError::NotAtRest | DerivativeError::Neutral)) => Ok(f64::INFINITY),
            Err(error) => Err(error),
        }
    }

    fn normal(&mut self, x: &DVector<f64>) -> Result<Normal, HangingError> {
        let residuals = self.at(x[0])?;
        let mut normal = Normal::zero(1);
        for (residual, slope) in residuals {
            (0..3).for_each(|axis| normal.add(residual[axis], &[slope[axis]], f64::INFINITY));
        }
        Ok(normal)
    }
}

//! From the turns on a coarse cut to those on a finer one.

use nalgebra::{Quaternion, UnitQuaternion};

use crate::scaled::{Cut, Scaled};

/// Cubic interpolation of orientations by their places along the cable, grips included.
#[derive(Clone, Debug)]
pub(crate) struct Finer {
    /// For each fine segment the first of four coarse places, and their weights.
    weights: Vec<(usize, [f64; 4])>,
    /// Orientations on the coarse cut, with the grips before and after.
    knots: Vec<Quaternion<f64>>,
}

impl Finer {
    pub(crate) fn new(coarse: &Cut, fine: &Cut) -> Self {
        let mut places = vec![0.0];
        places.extend((0..coarse.segments).map(|k| coarse.place(k)));
        places.push(1.0);
        let weights = (0..fine.segments).map(|k| {
            let x = fine.place(k);
            let after = places.iter().position(|&place| place > x).unwrap_or(places.len() - 1);
            let first = after.saturating_sub(2).min(places.len() - 4);
            let own = &places[first..first + 4];
            let weight = |j: usize| {
                let others = (0..4).filter(|&k| k != j);
                others.map(|k| (x - own[k]) / (own[j] - own[k])).product()
            };
            (first, [0, 1, 2, 3].map(weight))
        });
        Self { weights: weights.collect(), knots: vec![Quaternion::identity(); places.len()] }
    }

    /// Interpolates; the free end goes on as the last segment.
    pub(crate) fn fill(&mut self, query: &Scaled, coarse: &[UnitQuaternion<f64>], fine: &mut [UnitQuaternion<f64>]) {
        let last = if query.held { &query.ends[1] } else { &coarse[coarse.len() - 1] };
        let all = std::iter::once(&query.ends[0]).chain(coarse).chain(std::iter::once(last));
        let mut before = *query.ends[0].quaternion();
        for (knot, q) in self.knots.iter_mut().zip(all) {
            // Of both signs the one that goes on from the one before.
            before = if before.dot(q.quaternion()) < 0.0 { -q.into_inner() } else { *q.quaternion() };
            *knot = before;
        }
        for (out, (first, weights)) in fine.iter_mut().zip(&self.weights) {
            let own = &self.knots[*first..first + 4];
            let sum = own[0] * weights[0] + own[1] * weights[1] + own[2] * weights[2] + own[3] * weights[3];
            *out = UnitQuaternion::from_quaternion(sum);
        }
    }
}

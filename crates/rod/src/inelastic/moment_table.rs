//! Bending by a table of moment over curvature.
//!
//! The moment M(k) is linear between the points of the table and beyond the last one, alike about all axes across the rod; twist is elastic. Unloading
//! goes back along the curve, or follows Masing's rule: each way back is the curve at twice its size, from where it turned. The second is the sum of a
//! spring and of springs in series with dry friction (Besseling 1958; Iwan, "A distributed-element model for hysteresis", 1966): with the slopes S_i
//! before and S_(i+1) behind the point k_i of the table
//!
//! ```text
//! M = S_n k + sum s_i (k - p_i)      s_i = S_i - S_(i+1),  |k - p_i| <= k_i
//! ```
//!
//! Its return mapping moves each p_i by as much as |k - p_i| is beyond k_i. Where several axes bend each friction has a circle for its surface.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::variables::{Answer, InternalVariables, LEAST_HARDENING, RESOLVENT};

/// How a joint unloads that follows a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unloading {
    /// Back along the curve: nothing is lost.
    Elastic,
    /// By Masing's rule: friction, with loops.
    Masing,
}

/// A table of moment over curvature.
#[derive(Clone, Debug, PartialEq)]
pub struct MomentTable {
    /// Curvatures [1/m] and moments [N m] from the first point after the origin on, both ascending.
    pub points: Vec<[f64; 2]>,
    /// How it unloads.
    pub unloading: Unloading,
}

impl MomentTable {
    /// Slopes from each point, the origin among them, to the next [N m^2]; beyond the last point the last one goes on.
    fn slopes(&self) -> impl Iterator<Item = f64> {
        let before = std::iter::once(&[0.0; 2]).chain(&self.points);
        before.zip(&self.points).map(|(a, b)| (b[1] - a[1]) / (b[0] - a[0]))
    }

    /// Bending stiffness at rest [N m^2].
    pub fn stiffness(&self) -> f64 {
        self.slopes().next().unwrap_or(0.0)
    }

    /// Moment at the first point [N m].
    pub(super) fn first_moment(&self) -> f64 {
        self.points.first().map_or(0.0, |point| point[1])
    }

    pub(super) fn mistake(&self) -> Option<(&'static str, f64, &'static str)> {
        if self.points.is_empty() {
            return Some(("number of points of a table of moments", 0.0, "1 or more"));
        }
        if let Some(value) = self.points.iter().flatten().find(|x| !(x.is_finite() && **x > 0.0)) {
            return Some(("curvature or moment of a table", *value, "finite and > 0"));
        }
        let least = LEAST_HARDENING * self.stiffness();
        let mut before = f64::INFINITY;
        for slope in self.slopes() {
            if !slope.is_finite() || slope < least {
                return Some((
                    "slope of a table of moments",
                    slope,
                    "0.001 of the first one or more, at ascending curvatures",
                ));
            }
            if self.unloading == Unloading::Masing && slope > before * (1.0 + 1e-9) {
                return Some((
                    "slope of a table of moments",
                    slope,
                    "at most that before, where it unloads by Masing's rule",
                ));
            }
            before = slope;
        }
        None
    }

    /// How many vectors it remembers.
    pub(super) fn parts(&self) -> usize {
        if self.unloading == Unloading::Masing { self.points.len() - 1 } else { 0 }
    }

    /// Stiffness, curvature at which it slips, and place of each friction, where it is after going to a curvature.
    fn frictions(&self, at: &InternalVariables) -> impl Iterator<Item = (f64, f64, Vector2<f64>)> {
        let slopes = self.slopes().zip(self.slopes().skip(1));
        let places = (0..).map(|i| at.parts.get(i).map_or_else(Vector2::zeros, |place| place.xy()));
        slopes.zip(&self.points).zip(places).map(|(((first, second), point), place)| (first - second, point[0], place))
    }

    /// Moment, slope and energy of the curve at a curvature.
    fn curve(&self, curvature: f64) -> [f64; 3] {
        let (mut from, mut moment, mut energy) = (0.0, 0.0, 0.0);
        let count = self.points.len();
        for (k, (slope, point)) in self.slopes().zip(&self.points).enumerate() {
            let by = if k + 1 == count { curvature - from } else { curvature.min(point[0]) - from };
            energy += by * (moment + 0.5 * slope * by);
            moment += slope * by;
            if curvature <= point[0] || k + 1 == count {
                return [moment, slope, energy];
            }
            from = point[0];
        }
        [0.0; 3]
    }

    pub(super) fn answer(&self, stiffness: &Vector3<f64>, strain: &Vector3<f64>, at: &InternalVariables) -> Answer {
        let bent = strain.xy();
        let mut moment = (stiffness.component_mul(strain)).component_mul(&Vector3::z());
        let mut tangent = Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, stiffness.z));
        let mut add = |direction: &Vector2<f64>, size: f64, along: f64, across: f64| {
            let unit = direction.push(0.0);
            moment += unit * size;
            let plane = Matrix3::from_diagonal(&Vector3::new(across, across, 0.0));
            tangent += plane + unit * unit.transpose() * (along - across);
        };
        match self.unloading {
            Unloading::Elastic => {
                let size = bent.norm();
                let [moment, slope, _] = self.curve(size);
                match size > 0.0 {
                    true => add(&(bent / size), moment, slope, moment / size),
                    false => add(&Vector2::zeros(), 0.0, slope, slope),
                }
            }
            Unloading::Masing => {
                let last = self.slopes().last().unwrap_or(0.0);
                add(&Vector2::zeros(), 0.0, last, last);
                for (own, most, place) in self.frictions(at) {
                    let off = bent - place;
                    let size = off.norm();
                    match size > most {
                        true => add(&(off / size), own * most, 0.0, own * most / size),
                        false if size > 0.0 => add(&(off / size), own * size, own, own),
                        false => add(&Vector2::zeros(), 0.0, own, own),
                    }
                }
                moment += (bent * last).push(0.0);
            }
        }
        Answer { moment, tangent }
    }

    /// See [`super::JointLaw::sudden`]: no friction slips.
    pub(super) fn sudden(&self, stiffness: &Vector3<f64>, strain: &Vector3<f64>, at: &InternalVariables) -> Answer {
        match self.unloading {
            Unloading::Elastic => self.answer(stiffness, strain, at),
            Unloading::Masing => {
                let first = Vector3::new(self.stiffness(), self.stiffness(), stiffness.z);
                let moment = first.component_mul(&(strain - self.set(at)));
                Answer { moment, tangent: Matrix3::from_diagonal(&first) }
            }
        }
    }

    /// See [`super::JointLaw::resolve`]: the resolvent, by Newton's method.
    pub(super) fn resolve(
        &self,
        stiffness: &Vector3<f64>,
        [strain, moment]: [&Vector3<f64>; 2],
        at: &InternalVariables,
    ) -> Vector3<f64> {
        let resolvent = Vector3::new(self.stiffness(), self.stiffness(), stiffness.z) * RESOLVENT;
        let target = moment + resolvent.component_mul(strain);
        let mut here = *strain;
        for _ in 0..20 {
            let Answer { moment, tangent } = self.answer(stiffness, &here, at);
            let missed = target - moment - resolvent.component_mul(&here);
            if missed.norm() <= 1e-13 * target.norm() {
                return here;
            }
            let slope = tangent + Matrix3::from_diagonal(&resolvent);
            here += slope.try_inverse().unwrap_or_default() * missed;
        }
        *strain
    }

    pub(super) fn advance(&self, strain: &Vector3<f64>, at: &mut InternalVariables) {
        let bent = strain.xy();
        let mut lost = 0.0;
        let moved: Vec<Vector2<f64>> = match self.unloading {
            Unloading::Elastic => return,
            Unloading::Masing => self
                .frictions(at)
                .map(|(own, most, place)| {
                    let off = bent - place;
                    let beyond = (off.norm() - most).max(0.0);
                    lost += own * most * beyond;
                    if beyond > 0.0 { place + off * (beyond / off.norm()) } else { place }
                })
                .collect(),
        };
        at.dissipated += lost;
        at.parts.iter_mut().zip(moved).for_each(|(part, place)| *part = place.push(0.0));
    }

    pub(super) fn stored(&self, stiffness: &Vector3<f64>, strain: &Vector3<f64>, at: &InternalVariables) -> f64 {
        let bent = strain.xy();
        let of_bending = match self.unloading {
            Unloading::Elastic => self.curve(bent.norm())[2],
            Unloading::Masing => {
                let last = self.slopes().last().unwrap_or(0.0);
                let of = |(own, _, place): (f64, f64, Vector2<f64>)| own * (bent - place).norm_squared();
                0.5 * (last * bent.norm_squared() + self.frictions(at).map(of).sum::<f64>())
            }
        };
        of_bending + 0.5 * stiffness.z * strain.z * strain.z
    }

    /// The curvature at which it bears no moment.
    pub(super) fn set(&self, at: &InternalVariables) -> Vector3<f64> {
        let sum: Vector2<f64> = match self.unloading {
            Unloading::Elastic => Vector2::zeros(),
            Unloading::Masing => self.frictions(at).map(|(own, _, place)| place * own).sum(),
        };
        (sum / self.stiffness()).push(0.0)
    }
}

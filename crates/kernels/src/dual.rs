//! Dual numbers: a value with its derivatives along some directions, so that a kernel differentiates itself.

// Slopes are numbered as in the formulas.
#![allow(clippy::needless_range_loop)]

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use crate::lane::Real;

/// A value with its derivatives along `D` directions, to first order. It has one lane.
///
/// Where a function has a kink (`abs`, `max`, `select`) the derivative is that of the side that the value is on; that of a
/// square root of zero is taken as zero.
///
/// Its operations are calls, not inlined: kernels are so long that code for all slopes of all operations would take minutes to
/// compile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<const D: usize> {
    /// The value.
    pub value: f64,
    /// Its derivatives.
    pub slope: [f64; D],
}

impl<const D: usize> Dual<D> {
    /// `f(self)`, given its value and its derivative.
    #[inline(always)]
    fn chain(self, value: f64, derivative: f64) -> Self {
        let mut slope = self.slope;
        for x in &mut slope {
            *x *= derivative;
        }
        Self { value, slope }
    }

    /// `a self + b other` of the slopes.
    #[inline(always)]
    fn mixed(self, a: f64, other: Self, b: f64, value: f64) -> Self {
        let mut slope = [0.0; D];
        for k in 0..D {
            slope[k] = a * self.slope[k] + b * other.slope[k];
        }
        Self { value, slope }
    }
}

impl<const D: usize> Add for Dual<D> {
    type Output = Self;
    #[inline(never)]
    fn add(self, other: Self) -> Self {
        let mut slope = self.slope;
        for k in 0..D {
            slope[k] += other.slope[k];
        }
        Self { value: self.value + other.value, slope }
    }
}

impl<const D: usize> Sub for Dual<D> {
    type Output = Self;
    #[inline(never)]
    fn sub(self, other: Self) -> Self {
        let mut slope = self.slope;
        for k in 0..D {
            slope[k] -= other.slope[k];
        }
        Self { value: self.value - other.value, slope }
    }
}

impl<const D: usize> Mul for Dual<D> {
    type Output = Self;
    #[inline(never)]
    fn mul(self, other: Self) -> Self {
        self.mixed(other.value, other, self.value, self.value * other.value)
    }
}

impl<const D: usize> Div for Dual<D> {
    type Output = Self;
    #[inline(never)]
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        let inverse = 1.0 / other.value;
        self.mixed(inverse, other, -value * inverse, value)
    }
}

impl<const D: usize> Neg for Dual<D> {
    type Output = Self;
    #[inline(never)]
    fn neg(self) -> Self {
        self.chain(-self.value, -1.0)
    }
}

impl<const D: usize> AddAssign for Dual<D> {
    #[inline(never)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const D: usize> SubAssign for Dual<D> {
    #[inline(never)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<const D: usize> Real for Dual<D> {
    const LANES: usize = 1;
    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self { value, slope: [0.0; D] }
    }
    #[inline(always)]
    fn lane(self, _lane: usize) -> f64 {
        self.value
    }
    /// Makes it a constant.
    #[inline(always)]
    fn set_lane(&mut self, _lane: usize, value: f64) {
        *self = Self::splat(value);
    }
    #[inline(always)]
    fn copy_lane(&mut self, _lane: usize, from: Self) {
        *self = from;
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.chain(root, if root > 0.0 { 0.5 / root } else { 0.0 })
    }
    #[inline(always)]
    fn exp(self) -> Self {
        let value = self.value.exp();
        self.chain(value, value)
    }
    #[inline(always)]
    fn sin(self) -> Self {
        self.chain(self.value.sin(), self.value.cos())
    }
    /// Its derivative at 1 is taken as zero.
    #[inline(always)]
    fn asin(self) -> Self {
        let cosine = (1.0 - self.value * self.value).sqrt();
        self.chain(self.value.asin(), if cosine > 0.0 { 1.0 / cosine } else { 0.0 })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        if self.value < 0.0 { -self } else { self }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self.value > other.value { self } else { other }
    }
    #[inline(always)]
    fn select(self, then: Self, otherwise: Self) -> Self {
        if self.value >= 0.0 { then } else { otherwise }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every operation against central differences.
    #[test]
    fn slopes_are_derivatives() {
        fn all<T: Real>(x: T, y: T) -> [T; 10] {
            let mut sum = x;
            sum += y;
            sum -= x * y;
            [
                x + y,
                x - y,
                x * y,
                x / y,
                -x,
                sum,
                (x * x + y).sqrt(),
                (x.exp() * y.sin()).abs(),
                (x * T::splat(0.3)).asin(),
                x.max(y).select(x * y, y),
            ]
        }
        for (x, y) in [(0.7, -1.3), (1.9, 0.4), (-0.6, 2.2)] {
            let found = all(Dual { value: x, slope: [1.0, 0.0] }, Dual { value: y, slope: [0.0, 1.0] });
            let h = 1e-6;
            for (direction, [dx, dy]) in [[h, 0.0], [0.0, h]].into_iter().enumerate() {
                let (ahead, behind) = (all(x + dx, y + dy), all(x - dx, y - dy));
                for k in 0..10 {
                    if found[k].value.is_nan() {
                        continue;
                    }
                    let slope = (ahead[k] - behind[k]) / (2.0 * h);
                    assert!((found[k].slope[direction] - slope).abs() < 1e-8, "{k} at {x}, {y}");
                }
            }
            assert_eq!(found.map(|x| x.value.to_bits()), all(x, y).map(f64::to_bits));
        }
        assert_eq!(Dual { value: 0.0, slope: [1.0] }.sqrt().slope, [0.0]);
    }
}

//! Numbers that a kernel can be run on: one `f64`, or several rods at once, one a lane.
//!
//! All kernels are written once, over [`Real`]. Lanes never mix, and products and sums are rounded one by one (no fused
//! multiply-add), so that a rod's bits do not depend on the lanes beside it nor on the machine's vector width.

use crate::dispatch::in_lanes;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A real number or a small vector of them, with lane-wise arithmetic.
pub trait Real:
    Copy
    + PartialEq
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
{
    /// Number of lanes.
    const LANES: usize;
    /// Whether there are several. A branch on this constant alone leaves no code where it is not taken.
    const IN_LANES: bool = Self::LANES > 1;
    /// The same value in every lane.
    fn splat(value: f64) -> Self;
    /// Value of one lane.
    fn lane(self, lane: usize) -> f64;
    /// Sets the value of one lane.
    fn set_lane(&mut self, lane: usize, value: f64);
    /// Takes one lane over from another, with all that it carries.
    #[inline(always)]
    fn copy_lane(&mut self, lane: usize, from: Self) {
        self.set_lane(lane, from.lane(lane));
    }
    /// Square root.
    fn sqrt(self) -> Self;
    /// Exponential.
    fn exp(self) -> Self;
    /// Sine.
    fn sin(self) -> Self;
    /// Inverse of the sine, in [-pi / 2, pi / 2].
    fn asin(self) -> Self;
    /// Magnitude.
    fn abs(self) -> Self;
    /// The larger of two; `other` where `self` is not a number.
    fn max(self, other: Self) -> Self;
    /// `then` where `self` >= 0, else `otherwise`.
    fn select(self, then: Self, otherwise: Self) -> Self;
    /// Zero.
    #[inline(always)]
    fn zero() -> Self {
        Self::splat(0.0)
    }
    /// Runs a kernel over such numbers with the widest vector instructions of the machine, where that pays: over lanes. Over
    /// `f64` they are worth 1 % of the time of 23 scenes, and code three times as large: `docs/decisions/crates.md`.
    #[inline(always)]
    fn dispatch<R>(kernel: impl FnOnce() -> R) -> R {
        kernel()
    }
}

impl Real for f64 {
    const LANES: usize = 1;
    #[inline(always)]
    fn splat(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn lane(self, _lane: usize) -> f64 {
        self
    }
    #[inline(always)]
    fn set_lane(&mut self, _lane: usize, value: f64) {
        *self = value;
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn exp(self) -> Self {
        f64::exp(self)
    }
    #[inline(always)]
    fn sin(self) -> Self {
        f64::sin(self)
    }
    #[inline(always)]
    fn asin(self) -> Self {
        f64::asin(self)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn select(self, then: Self, otherwise: Self) -> Self {
        if self >= 0.0 { then } else { otherwise }
    }
}

/// `N` numbers side by side.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub struct Lanes<const N: usize>(pub [f64; N]);

impl<const N: usize> Lanes<N> {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        let mut out = self;
        for lane in 0..N {
            out.0[lane] = f(self.0[lane], other.0[lane]);
        }
        out
    }
}

impl<const N: usize> Add for Lanes<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}

impl<const N: usize> Sub for Lanes<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
}

impl<const N: usize> Mul for Lanes<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
}

impl<const N: usize> Div for Lanes<N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.zip(other, |a, b| a / b)
    }
}

impl<const N: usize> Neg for Lanes<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.zip(self, |a, _| -a)
    }
}

impl<const N: usize> AddAssign for Lanes<N> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const N: usize> SubAssign for Lanes<N> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<const N: usize> Real for Lanes<N> {
    const LANES: usize = N;
    #[inline(always)]
    fn dispatch<R>(kernel: impl FnOnce() -> R) -> R {
        in_lanes(kernel)
    }
    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self([value; N])
    }
    #[inline(always)]
    fn lane(self, lane: usize) -> f64 {
        self.0[lane]
    }
    #[inline(always)]
    fn set_lane(&mut self, lane: usize, value: f64) {
        self.0[lane] = value;
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.zip(self, |a, _| a.sqrt())
    }
    #[inline(always)]
    fn exp(self) -> Self {
        self.zip(self, |a, _| a.exp())
    }
    #[inline(always)]
    fn sin(self) -> Self {
        self.zip(self, |a, _| a.sin())
    }
    #[inline(always)]
    fn asin(self) -> Self {
        self.zip(self, |a, _| a.asin())
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.zip(self, |a, _| a.abs())
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn select(self, then: Self, otherwise: Self) -> Self {
        let mut out = otherwise;
        for lane in 0..N {
            out.0[lane] = if self.0[lane] >= 0.0 { then.0[lane] } else { otherwise.0[lane] };
        }
        out
    }
}

/// Two numbers that do not depend on each other: what is computed for two places of a rod at once.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(16))]
pub struct Both<T>(pub [T; 2]);

impl<T: Real> Both<T> {
    /// One of the two in an array of such numbers.
    #[inline(always)]
    pub fn pick<const N: usize>(both: [Self; N], which: usize) -> [T; N] {
        let mut out = [T::zero(); N];
        for k in 0..N {
            out[k] = both[k].0[which];
        }
        out
    }

    /// Arrays of numbers side by side.
    #[inline(always)]
    pub fn zip<const N: usize>(a: [T; N], b: [T; N]) -> [Self; N] {
        let mut out = [Self([T::zero(); 2]); N];
        for k in 0..N {
            out[k] = Self([a[k], b[k]]);
        }
        out
    }

    #[inline(always)]
    fn apply(self, other: Self, f: impl Fn(T, T) -> T) -> Self {
        Self([f(self.0[0], other.0[0]), f(self.0[1], other.0[1])])
    }
}

impl<T: Real> Add for Both<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.apply(other, |a, b| a + b)
    }
}

impl<T: Real> Sub for Both<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.apply(other, |a, b| a - b)
    }
}

impl<T: Real> Mul for Both<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.apply(other, |a, b| a * b)
    }
}

impl<T: Real> Div for Both<T> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.apply(other, |a, b| a / b)
    }
}

impl<T: Real> Neg for Both<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self([-self.0[0], -self.0[1]])
    }
}

impl<T: Real> AddAssign for Both<T> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<T: Real> SubAssign for Both<T> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<T: Real> Real for Both<T> {
    const LANES: usize = 2 * T::LANES;
    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self([T::splat(value); 2])
    }
    #[inline(always)]
    fn lane(self, lane: usize) -> f64 {
        self.0[lane / T::LANES].lane(lane % T::LANES)
    }
    #[inline(always)]
    fn set_lane(&mut self, lane: usize, value: f64) {
        self.0[lane / T::LANES].set_lane(lane % T::LANES, value);
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self([self.0[0].sqrt(), self.0[1].sqrt()])
    }
    #[inline(always)]
    fn exp(self) -> Self {
        Self([self.0[0].exp(), self.0[1].exp()])
    }
    #[inline(always)]
    fn sin(self) -> Self {
        Self([self.0[0].sin(), self.0[1].sin()])
    }
    #[inline(always)]
    fn asin(self) -> Self {
        Self([self.0[0].asin(), self.0[1].asin()])
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self([self.0[0].abs(), self.0[1].abs()])
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.apply(other, |a, b| a.max(b))
    }
    #[inline(always)]
    fn select(self, then: Self, otherwise: Self) -> Self {
        let pick = |k: usize| self.0[k].select(then.0[k], otherwise.0[k]);
        Self([pick(0), pick(1)])
    }
}

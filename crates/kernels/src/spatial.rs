//! A spatial vector: a linear and an angular part.

use std::ops::Neg;

use crate::lane::{Both, Real};
use crate::math::Vec3;

/// A linear and an angular part: of a body's velocity, wrench or correction (dx, dphi), in world axes unless said
/// otherwise; of a joint's rows or multipliers, where `linear` is stretch-shear (world axes) and `angular` is bend-twist
/// (frame of body a, or world axes in world rows).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spatial<T> {
    /// Linear part: velocity, force, shift, or stretch-shear.
    pub linear: Vec3<T>,
    /// Angular part: angular velocity, torque, rotation vector, or bend-twist.
    pub angular: Vec3<T>,
}

impl<T: Real> Spatial<T> {
    /// The same in every lane.
    #[inline(always)]
    pub fn splat(x: Spatial<f64>) -> Self {
        Self { linear: Vec3::splat(x.linear), angular: Vec3::splat(x.angular) }
    }

    /// Zero.
    #[inline(always)]
    pub fn zero() -> Self {
        Self { linear: Vec3::zero(), angular: Vec3::zero() }
    }

    /// Scalar product.
    #[inline(always)]
    pub fn dot(self, other: Self) -> T {
        self.linear.dot(other.linear) + self.angular.dot(other.angular)
    }

    /// `self + k other`.
    #[inline(always)]
    pub fn plus(self, other: Self, k: T) -> Self {
        Self { linear: self.linear + other.linear * k, angular: self.angular + other.angular * k }
    }

    /// Two side by side.
    #[inline(always)]
    pub fn both(a: Self, b: Self) -> Spatial<Both<T>> {
        Spatial { linear: Vec3::both(a.linear, b.linear), angular: Vec3::both(a.angular, b.angular) }
    }

    /// All six numbers, the linear part first.
    #[inline(always)]
    pub fn to_array(self) -> [T; 6] {
        let ([a, b, c], [d, e, f]) = (self.linear.0, self.angular.0);
        [a, b, c, d, e, f]
    }

    /// From all six numbers, the linear part first.
    #[inline(always)]
    pub fn from_array([a, b, c, d, e, f]: [T; 6]) -> Self {
        Self { linear: Vec3([a, b, c]), angular: Vec3([d, e, f]) }
    }
}

impl<T: Real> Neg for Spatial<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { linear: -self.linear, angular: -self.angular }
    }
}

impl<T: Real> Spatial<Both<T>> {
    /// One of the two.
    #[inline(always)]
    pub fn one(self, k: usize) -> Spatial<T> {
        Spatial { linear: self.linear.one(k), angular: self.angular.one(k) }
    }
}

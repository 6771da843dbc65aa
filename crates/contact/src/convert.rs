//! Between the kernels' vectors and nalgebra's.

use kernels::math::Vec3;
use nalgebra::Vector3;

/// A vector of the kernels as one of nalgebra.
pub fn to_nalgebra(v: Vec3<f64>) -> Vector3<f64> {
    Vector3::from(v.0)
}

pub(crate) fn to_kernel(v: &Vector3<f64>) -> Vec3<f64> {
    Vec3([v.x, v.y, v.z])
}

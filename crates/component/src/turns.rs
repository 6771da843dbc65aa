//! The turn of a body over a step, its rate and its momentum.

use kernels::lane::Real;
use kernels::math::Vec3;

/// Angular momentum in the body's frame at the end of a step that turned with w, of which `turning` is I w and `u` is
/// (dt / 2) w: see [`super::Component::predict`].
#[inline(always)]
pub(super) fn angular_momentum<T: Real>(turning: Vec3<T>, u: Vec3<T>) -> Vec3<T> {
    let s = (T::splat(1.0) - u.norm_squared()).max(T::zero()).sqrt();
    turning * s - u.cross(turning)
}

/// The rate [rad/s] for which `variable` stands after a step of `dt` [s]: the inverse of [`super::state::variable`].
pub(super) fn rate<T: Real>(variable: Vec3<T>, dt: T) -> Vec3<T> {
    let (sine, one) = (variable.norm_squared().sqrt() * (dt * T::splat(0.5)), T::splat(1.0));
    let sine = (sine - one).select(one, sine);
    variable * (-sine).select(one, sine.asin() / sine)
}

/// What `I phi` leaves out of a body's change of discrete momentum (times the step's length) as it is turned by `phi` after
/// a turn by about `theta`: the share of second order, `([I theta x - theta x I] phi + phi x I theta) / 2`. `inertia` is I in
/// world axes.
#[inline(always)]
pub(super) fn gyroscopic<T: Real>(inertia: impl Fn(Vec3<T>) -> Vec3<T>, theta: Vec3<T>, phi: Vec3<T>) -> Vec3<T> {
    let sum = inertia(theta.cross(phi)) - theta.cross(inertia(phi)) + phi.cross(inertia(theta));
    sum * T::splat(0.5)
}

//! Blocks of the dual system `A = J M^-1 J^T + alpha~`, in world rows.

use crate::block::{Block, assemble};
use crate::system::System;
use kernels::lane::Real;
use kernels::math::{Sym3, map_rows, sum, transposed};

/// `sigma` of a body in a joint: +1 for body a, -1 for body b, with the connector's place z.
#[inline(always)]
fn end<T: Real>(system: &System<T>, joint: u32, body: u32) -> (f64, T) {
    let terms = &system.joints[joint as usize];
    if system.topology.joints[joint as usize][0] == body { (1.0, terms.offsets[0]) } else { (-1.0, terms.offsets[1]) }
}

/// `[r]x W` and `[r]x W [r]x^T` of a joint's body a (`end` 0) or b (1), with the arm r of its connector: `z P` and `z^2 S`
/// with P = [d]x W and S = [d]x W [d]x^T where the connector lies on the axis.
#[inline(always)]
fn lever<T: Real>(system: &System<T>, joint: u32, end: usize) -> ([[T; 3]; 3], Sym3<T>) {
    let body = &system.bodies[system.topology.joints[joint as usize][end] as usize];
    let z = system.joints[joint as usize].offsets[end];
    if let Some(across) = system.across.get(joint as usize) {
        let arm = body.axis * z + across[end];
        let p = body.inverse_inertia.crossed(arm);
        return (p, Sym3::crossed_twice(p, arm));
    }
    let p = body.inverse_inertia.crossed(body.axis);
    let s = Sym3::crossed_twice(p, body.axis);
    (map_rows(p, |row| row * z), s * (z * z))
}

/// D of a joint, in world rows.
///
/// With the arms r of each body: stretch-stretch `sum (1/m) I + [r]x W [r]x^T + alpha~_s`, stretch-bend `sum [r]x W`,
/// bend-bend `sum W + alpha~_b`.
#[inline(always)]
pub(crate) fn joint_diagonal<T: Real>(system: &System<T>, joint: u32) -> Block<T> {
    let [a, b] = system.topology.joints[joint as usize].map(|body| &system.bodies[body as usize]);
    let ((pa, sa), (pb, sb)) = (lever(system, joint, 0), lever(system, joint, 1));
    let stretch = Sym3::identity(a.inverse_mass + b.inverse_mass) + sa + sb + system.stretch_compliance(joint as usize);
    let bend = a.inverse_inertia + b.inverse_inertia + system.bend_compliance(joint as usize);
    let mixed = sum(pa, pb);
    assemble(stretch.full(), mixed, transposed(mixed), bend.full())
}

/// The block that couples two joints through body `via`: rows of `joint`, columns of `other`.
///
/// `sigma sigma' [ (1/m) I + z z' S, z P; z' P^T, W ]`, or with arms r and r' off the axis
/// `sigma sigma' [ (1/m) I + [r]x W [r']x^T, [r]x W; ([r']x W)^T, W ]`.
#[inline(always)]
pub(crate) fn joint_coupling<T: Real>(system: &System<T>, joint: u32, other: u32, via: u32) -> Block<T> {
    let body = &system.bodies[via as usize];
    let ((sigma, z), (sigma_other, z_other)) = (end(system, joint, via), end(system, other, via));
    let sign = T::splat(sigma * sigma_other);
    if !system.across.is_empty() {
        let arm = |joint: u32, z: T| {
            let is_a = system.topology.joints[joint as usize][0] == via;
            body.axis * z + system.across[joint as usize][usize::from(!is_a)]
        };
        let (arm, arm_other) = (arm(joint, z), arm(other, z_other));
        let p = body.inverse_inertia.crossed(arm);
        let shift = sum(Sym3::identity(body.inverse_mass).full(), map_rows(p, |row| arm_other.cross(row)));
        let [stretch, mixed, turned, bend] =
            [shift, p, transposed(body.inverse_inertia.crossed(arm_other)), body.inverse_inertia.full()]
                .map(|part| map_rows(part, |row| row * sign));
        return assemble(stretch, mixed, turned, bend);
    }
    let p = body.inverse_inertia.crossed(body.axis);
    let s = Sym3::crossed_twice(p, body.axis);
    let stretch = Sym3::identity(body.inverse_mass * sign) + s * (z * z_other * sign);
    assemble(
        stretch.full(),
        map_rows(p, |row| row * (z * sign)),
        map_rows(transposed(p), |row| row * (z_other * sign)),
        map_rows(body.inverse_inertia.full(), |row| row * sign),
    )
}

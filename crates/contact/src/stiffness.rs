//! Geometric stiffness of contacts: how the torque of a contact's force changes as the nearest place moves along an axis.
//!
//! Two axes u_a and u_b cross at the distance D, with the normal n. A tilt `tau = (u x n) . dphi` of one of them moves the nearest places,
//! and the gap g, which is that of the nearest places, falls short of its linearisation. The force f on the contact has the energy `-f g`,
//! whose second derivative with respect to the two tilts is
//!
//! ```text
//! f D / (1 - c^2) [1 c; c 1],   c = u_a . u_b
//! ```
//!
//! and for each body alone at most `f D / (1 - |c|)`, the largest eigenvalue; `f D` where a place moves along one axis alone, as on a sphere. This bound is
//! added to the rotational mass of formulation `newton`, as the geometric stiffness of pulls is (Tournier et al. 2015): without it the places on
//! axes that are nearly parallel, and on those that lie on a large sphere, swing from iteration to iteration. It changes the matrix, and no
//! solution ([figures](../../../../docs/decisions/stopping.md)).

use kernels::math::Vec3;

/// Least `1 - |c|`: axes nearer to each other touch along a line, whose ends hold them.
const LEAST: f64 = 1e-3;

/// What a force is multiplied by to be the stiffness against a tilt of each of two axes at this distance, of which the places on some move \[m\].
pub(super) fn tilt_arms(axes: [[Vec3<f64>; 2]; 2], moves: [bool; 2], distance: f64) -> [f64; 2] {
    let [u, v] = axes.map(|[from, to]| to - from);
    let apart = match moves {
        [true, true] => 1.0 - u.dot(v).abs() / (u.norm_squared() * v.norm_squared()).sqrt(),
        _ => 1.0,
    };
    moves.map(|moves| if moves { distance / apart.max(LEAST) } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A needle lies across another one at a distance; tilted by a little about the nearest place, the gap of the nearest places is less than the
    /// linearised one by half the arm times the tilt's square.
    #[test]
    fn the_gap_falls_short_of_its_linearisation_by_the_arm() {
        let (distance, half) = (0.3, 2.0);
        for crossing in [0.5_f64, 1.0, 1.5] {
            let other = Vec3([crossing.cos(), crossing.sin(), 0.0]) * half;
            let axes = |tilt: f64, along: f64| {
                let end = Vec3([tilt.cos(), 0.0, tilt.sin()]) * half;
                let up = Vec3([0.0, 0.0, distance]);
                let middle = Vec3([along, 0.0, 0.0]);
                [[up - end + middle, up + end + middle], [-other, other]]
            };
            let gap = |tilt: f64| {
                let [a, b] = axes(tilt, 0.0);
                let normal = (a[1] - a[0]).cross(b[1] - b[0]);
                ((a[0] - b[0]).dot(normal) / normal.norm_squared().sqrt()).abs()
            };
            let tilt = 1e-3;
            let short = 2.0 * gap(0.0) - gap(tilt) - gap(-tilt);
            let [one, _] = tilt_arms(axes(0.0, 0.0), [true, true], distance);
            let (exact, bound) = (short / tilt.powi(2), one);
            let expected = distance / (1.0 - crossing.cos().powi(2));
            assert!((exact / expected - 1.0).abs() < 1e-4 && bound >= exact, "{exact}, {expected}, {bound}");
        }
        let sphere =
            tilt_arms([[Vec3([-1.0, 0.0, 0.3]), Vec3([1.0, 0.0, 0.3])], [Vec3::zero(); 2]], [true, false], 0.3);
        assert_eq!(sphere, [0.3, 0.0]);
    }
}

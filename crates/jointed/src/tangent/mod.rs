//! The exact tangent of a step: Newton's matrix of formulation `newton`, and its elimination along chains, trees and rings.
//!
//! The equations of a step are `g = M (p - p*) - J^T lambda - loads = 0` and `C + alpha~ lambda = 0`. With the unknowns
//! (dp, -dlambda) a Newton step solves
//!
//! ```text
//! [ K   J^T ] [  dp     ]   [ -g                   ]
//! [ J  -a~  ] [ -dlambda] = [ -(C + alpha~ lambda) ]      K = d(M (p - p*)) / dp - d(J^T lambda + loads) / dp
//! ```
//!
//! The last part of K is how forces and torques of joints change as bodies turn. It couples the two bodies of a joint, so
//! that `J K^-1 J^T` would fill: bodies and joints are eliminated together ([`elimination`]), which stays regular however
//! small compliances are. K is symmetric where g is the gradient of an energy. What is not is
//! left out: a part of the inertia that is of first order in the turn from the predicted pose, BDF2's gyroscopic share (half
//! of which would couple tilts of an axis to the spin about it, which is light, as the whole does not), and how frames turn in
//! which stretch is measured (of first order in the strain, and in what inner damping of stretch remembers of it). Steps
//! bring the inertia's part in by a second solve with the same factor, so that convergence is quadratic.

mod cholesky;
mod condensation;
pub mod curvature;
mod cut_body;
pub mod elimination;
pub mod jacobian;
mod node;
mod problem;
mod stiffness;
mod tree_elimination;
mod two_sided;

use kernels::Spatial;
use kernels::lane::{Both, Real};
use kernels::math::{Sym3, Vec3};

pub use condensation::Root;

/// Newton's equations of a step for one connected set of bodies, or for several in lanes, in world axes and world rows.
#[derive(Clone, Debug)]
pub struct Equations<T = f64> {
    /// One entry a body.
    pub bodies: Vec<BodyEquation<T>>,
    /// One entry a joint.
    pub joints: Vec<JointEquation<T>>,
    /// What contacts add to bodies, in the order of the bodies.
    pub rows: Vec<BodyRow<T>>,
    /// The compliances of bend-twist as roots, where joints yield far more to one moment than to others: one a joint, or none.
    pub roots: Vec<Root<T>>,
    /// Compliance to bending of the stiffest joint that bends, times the square of its length [1/kg]; infinite where none does.
    pub stiffest: T,
}

/// What K has besides of a body alone: `stiffness` times the square of `row . (dx, dphi)`.
#[derive(Clone, Copy, Debug)]
pub struct BodyRow<T = f64> {
    /// The body.
    pub body: u32,
    /// Of a shift by 1 m and of a turn by 1 rad.
    pub row: [T; 6],
    /// Its stiffness.
    pub stiffness: T,
}

impl<T: Real> Default for Equations<T> {
    fn default() -> Self {
        Self {
            bodies: Vec::new(),
            joints: Vec::new(),
            rows: Vec::new(),
            roots: Vec::new(),
            stiffest: T::splat(f64::INFINITY),
        }
    }
}

impl<T: Real> Equations<T> {
    /// Takes from the right-hand sides what a solution accounts for: dp, one entry a body, and dlambda, one a joint, for joints
    /// with these bodies a and b. What is left are the equations of what the solution lacks.
    pub fn subtract(&mut self, ends: &[[u32; 2]], corrections: &[Spatial<T>], multipliers: &[Spatial<T>]) {
        for (body, dp) in self.bodies.iter_mut().zip(corrections).filter(|(body, _)| !body.is_held()) {
            body.defect.linear -= dp.linear * body.mass;
            body.defect.angular -= body.turning.apply(dp.angular);
        }
        for ((joint, ends), dlambda) in self.joints.iter_mut().zip(ends).zip(multipliers) {
            let [a, b] = ends.map(|body| body as usize);
            let (on_a, on_b, [arm_a, arm_b]) = (corrections[a], corrections[b], joint.arms);
            let (force, torque) = (dlambda.linear, dlambda.angular);
            joint.rhs.linear -= on_a.linear + on_a.angular.cross(arm_a) - on_b.linear - on_b.angular.cross(arm_b);
            joint.rhs.linear -= joint.compliance[0].apply(force);
            joint.rhs.angular -= on_b.angular - on_a.angular + joint.compliance[1].apply(torque);
            let coupled = [joint.coupling.apply(on_b.angular), joint.coupling.transposed().apply(on_a.angular)];
            for (body, sign, arm, coupled) in [(a, 1.0, arm_a, coupled[0]), (b, -1.0, arm_b, coupled[1])] {
                if !self.bodies[body].is_held() {
                    let defect = &mut self.bodies[body].defect;
                    defect.linear += force * T::splat(sign);
                    defect.angular += (arm.cross(force) - torque) * T::splat(sign) - coupled;
                }
            }
        }
    }
}

/// A body's share of the equations.
#[derive(Clone, Copy, Debug)]
pub struct BodyEquation<T = f64> {
    /// Mass [kg]; infinite, in all lanes, where the body is held, and then all else is ignored.
    pub mass: T,
    /// The rotations' block of K: inertia, and what joints and loads add [kg m^2].
    pub turning: Sym3<T>,
    /// `-g`: impulse times dt [kg m] and angular impulse times dt [kg m^2].
    pub defect: Spatial<T>,
}

impl<T: Real> BodyEquation<T> {
    /// A body that is held.
    #[inline(always)]
    pub fn held() -> Self {
        Self { mass: T::splat(f64::INFINITY), turning: Sym3::zero(), defect: Spatial::zero() }
    }

    /// Whether it is held.
    #[inline(always)]
    pub fn is_held(&self) -> bool {
        self.mass.lane(0) == f64::INFINITY
    }
}

/// A joint's share of the equations. Its Jacobian is `sigma [I, -[r]x; 0, -I]` with sigma = +1 for body a, -1 for body b.
#[derive(Clone, Copy, Debug)]
pub struct JointEquation<T = f64> {
    /// Length of the joint [m]: the scale of its rows.
    pub length: T,
    /// Arms r of the connectors of bodies a and b [m].
    pub arms: [Vec3<T>; 2],
    /// alpha~ of stretch-shear [1/kg] and of bend-twist [1/(kg m^2)].
    pub compliance: [Sym3<T>; 2],
    /// The block of K that couples the turns of bodies a (rows) and b (columns) [kg m^2].
    pub coupling: Coupling<T>,
    /// `-(C + alpha~ lambda)`: stretch-shear [m] and bend-twist [rad].
    pub rhs: Spatial<T>,
}

/// How the turns of a joint's bodies are coupled: `-(S + [h]x)` with a symmetric S, and h half of the torque that it transmits. See
/// [`curvature::of_bend_twist`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coupling<T> {
    /// S [kg m^2].
    pub(crate) symmetric: Sym3<T>,
    /// h [kg m^2].
    pub(crate) half_torque: Vec3<T>,
}

impl<T: Real> Coupling<T> {
    /// Times a turn.
    #[inline(always)]
    pub fn apply(self, x: Vec3<T>) -> Vec3<T> {
        x.cross(self.half_torque) - self.symmetric.apply(x)
    }

    /// The transpose.
    #[inline(always)]
    pub(crate) fn transposed(self) -> Self {
        Self { symmetric: self.symmetric, half_torque: -self.half_torque }
    }

    /// All nine entries, row by row.
    #[inline(always)]
    pub(crate) fn full(self) -> [[T; 3]; 3] {
        let [x, y, z] = self.half_torque.0;
        let [[xx, xy, xz], [_, yy, yz], [.., zz]] = self.symmetric.full();
        [[-xx, z - xy, -y - xz], [-z - xy, -yy, x - yz], [y - xz, -x - yz, -zz]]
    }

    /// Two side by side.
    #[inline(always)]
    pub(crate) fn both(a: Self, b: Self) -> Coupling<Both<T>> {
        let symmetric = Sym3(Both::zip(a.symmetric.0, b.symmetric.0));
        Coupling { symmetric, half_torque: Vec3::both(a.half_torque, b.half_torque) }
    }
}

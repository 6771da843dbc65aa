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
pub mod curvature;
pub mod elimination;
mod far;
mod halves;
pub mod jacobian;
mod node;
mod problem;
mod series;
mod stiffness;
mod sweep;

use nalgebra::{Matrix3, Vector3, Vector6};

/// Newton's equations of a step for one connected set of bodies, in world axes and world rows.
#[derive(Clone, Debug, Default)]
pub struct Equations {
    /// One entry a body.
    pub bodies: Vec<BodyEquation>,
    /// One entry a joint.
    pub joints: Vec<JointEquation>,
    /// What contacts add to bodies, in the order of the bodies.
    pub rows: Vec<BodyRow>,
}

/// What K has besides of a body alone: `stiffness` times the square of `row . (dx, dphi)`.
#[derive(Clone, Copy, Debug)]
pub struct BodyRow {
    /// The body.
    pub body: u32,
    /// Of a shift by 1 m and of a turn by 1 rad.
    pub row: [f64; 6],
    /// Its stiffness.
    pub stiffness: f64,
}

impl Equations {
    /// Takes from the right-hand sides what a solution accounts for: dp, one entry a body, and dlambda, one a joint, for joints
    /// with these bodies a and b. What is left are the equations of what the solution lacks.
    pub fn subtract(&mut self, ends: &[[u32; 2]], corrections: &[Vector6<f64>], multipliers: &[Vector6<f64>]) {
        let of = |x: &Vector6<f64>| -> [Vector3<f64>; 2] { [x.fixed_rows::<3>(0).into(), x.fixed_rows::<3>(3).into()] };
        for (body, dp) in self.bodies.iter_mut().zip(corrections).filter(|(body, _)| !body.is_held()) {
            let [shift, turn] = of(dp);
            body.defect[0] -= shift * body.mass;
            body.defect[1] -= body.turning * turn;
        }
        for ((joint, ends), dlambda) in self.joints.iter_mut().zip(ends).zip(multipliers) {
            let [a, b] = ends.map(|body| body as usize);
            let ([shift_a, turn_a], [shift_b, turn_b]) = (of(&corrections[a]), of(&corrections[b]));
            let [force, torque] = of(dlambda);
            joint.rhs[0] -= shift_a + turn_a.cross(&joint.arms[0]) - shift_b - turn_b.cross(&joint.arms[1]);
            joint.rhs[0] -= joint.compliance[0] * force;
            joint.rhs[1] -= turn_b - turn_a + joint.compliance[1] * torque;
            let (on_a, on_b) = (joint.coupling * turn_b, joint.coupling.transpose() * turn_a);
            for (body, sign, arm, coupled) in [(a, 1.0, joint.arms[0], on_a), (b, -1.0, joint.arms[1], on_b)] {
                if !self.bodies[body].is_held() {
                    self.bodies[body].defect[0] += force * sign;
                    self.bodies[body].defect[1] += (arm.cross(&force) - torque) * sign - coupled;
                }
            }
        }
    }
}

/// A body's share of the equations.
#[derive(Clone, Copy, Debug)]
pub struct BodyEquation {
    /// Mass [kg]; infinite where the body is held, and then all else is ignored.
    pub mass: f64,
    /// The rotations' block of K: inertia, and what joints and loads add [kg m^2].
    pub turning: Matrix3<f64>,
    /// `-g`: impulse times dt [kg m] and angular impulse times dt [kg m^2].
    pub defect: [Vector3<f64>; 2],
}

impl BodyEquation {
    /// A body that is held.
    pub fn held() -> Self {
        Self { mass: f64::INFINITY, turning: Matrix3::zeros(), defect: [Vector3::zeros(); 2] }
    }

    /// Whether it is held.
    pub fn is_held(&self) -> bool {
        self.mass == f64::INFINITY
    }
}

/// A joint's share of the equations. Its Jacobian is `sigma [I, -[r]x; 0, -I]` with sigma = +1 for body a, -1 for body b.
#[derive(Clone, Copy, Debug)]
pub struct JointEquation {
    /// Length of the joint [m]: the scale of its rows.
    pub length: f64,
    /// Arms r of the connectors of bodies a and b [m].
    pub arms: [Vector3<f64>; 2],
    /// alpha~ of stretch-shear [1/kg] and of bend-twist [1/(kg m^2)].
    pub compliance: [Matrix3<f64>; 2],
    /// The block of K that couples the turns of bodies a (rows) and b (columns) [kg m^2].
    pub coupling: Matrix3<f64>,
    /// `-(C + alpha~ lambda)`: stretch-shear [m] and bend-twist [rad].
    pub rhs: [Vector3<f64>; 2],
}

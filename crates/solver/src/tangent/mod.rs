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
//! left out: a part of the inertia that is of first order in the turn from the predicted pose, BDF2's gyroscopic share, and
//! how frames turn in which stretch is measured (of first order in the strain). So convergence is nearly quadratic.

mod cholesky;
pub mod curvature;
pub mod elimination;
mod far;
mod halves;
mod node;
mod problem;
mod series;
mod stiffness;
mod sweep;

use nalgebra::{Matrix3, Vector3};

/// Newton's equations of a step for one connected set of bodies, in world axes and world rows.
#[derive(Clone, Debug, Default)]
pub struct Equations {
    /// One entry a body.
    pub bodies: Vec<BodyEquation>,
    /// One entry a joint.
    pub joints: Vec<JointEquation>,
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

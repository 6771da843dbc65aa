//! The whole Jacobian of a step's equations, which is not quite symmetric, and its factor: what derivatives are made of.
//!
//! In the unknowns (dp, y = -dlambda) of [`crate::tangent`] it is `A = [K', J^T; J', -alpha~]`. K' has in its turns' blocks
//! what K leaves out, and J' how the frames turn in which stretch is measured.
//!
//! It is eliminated from the leaves to the roots, a body and the joint at its inner end at a time: with the block Z of both,
//! B of what follows in their rows, and E of them in the rows that follow, `D <- D - E Z^-1 B`. J is its own inverse, so that
//! `Z^-1` takes the inverse of 6 x 6 numbers, `N = K_o J_o' alpha~ + J_o^T`, which are regular however small compliances are:
//! `y = N^-1 (f - K_o J_o' c)` and `dp = J_o' (alpha~ y + c)` for the right-hand sides f and c. N^-1 and K_o are all that is kept.
//! All that is held counts as one body, the root: to begin at a held end would make a spring of the first joint, beside whose
//! stiffness that of bending drowns. Joints that close loops, which may lead through what is held, come last, as a dense
//! border. Refinement follows every solve, as a dense border of what is stiff costs digits.

mod factor;

use std::sync::Arc;

use nalgebra::{Matrix3, Matrix6, SMatrix, Vector3, Vector6};

use super::{Equations, JointEquation};
use crate::topology::Topology;

pub use factor::Factor;

/// A number for each row, or each column, of the equations: six a body, and six a joint.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Field {
    /// (dx, dphi), or force and torque, one entry a body; zero of bodies that are held, unless said otherwise.
    pub bodies: Vec<Vector6<f64>>,
    /// Stretch-shear and bend-twist in world rows, one entry a joint.
    pub joints: Vec<Vector6<f64>>,
}

impl Field {
    /// Zero.
    pub fn zero(topology: &Topology) -> Self {
        Self {
            bodies: vec![Vector6::zeros(); topology.bodies()],
            joints: vec![Vector6::zeros(); topology.joints.len()],
        }
    }

    /// The largest entries of bodies and of joints.
    fn sizes(&self) -> [f64; 2] {
        [&self.bodies, &self.joints].map(|list| list.iter().map(Vector6::amax).fold(0.0, f64::max))
    }

    /// Makes all of it zero.
    pub(crate) fn clear(&mut self) {
        self.bodies.fill(Vector6::zeros());
        self.joints.fill(Vector6::zeros());
    }

    fn subtract_from(&mut self, other: &Self) {
        let pairs = |own: &mut Vec<Vector6<f64>>, other: &[Vector6<f64>]| {
            own.iter_mut().zip(other).for_each(|(own, other)| *own = other - *own);
        };
        pairs(&mut self.bodies, &other.bodies);
        pairs(&mut self.joints, &other.joints);
    }

    fn add(&mut self, other: &Self, share: f64) {
        self.bodies.iter_mut().zip(&other.bodies).for_each(|(own, other)| *own += other * share);
        self.joints.iter_mut().zip(&other.joints).for_each(|(own, other)| *own += other * share);
    }
}

/// The Jacobian, block by block.
#[derive(Clone, Debug)]
pub struct Jacobian {
    topology: Arc<Topology>,
    /// Whether a body is held, one entry a body.
    held: Vec<bool>,
    /// K' of a body with itself.
    bodies: Vec<Matrix6<f64>>,
    joints: Vec<JointBlocks>,
}

/// A joint's blocks.
#[derive(Clone, Copy, Debug)]
struct JointBlocks {
    /// Arms of the connectors of bodies a and b.
    arms: [Vector3<f64>; 2],
    /// What stands in the place of `-[r]x` in J' of body a.
    tilted: Matrix3<f64>,
    /// alpha~ of stretch-shear and of bend-twist.
    compliance: [Matrix3<f64>; 2],
    /// K' of body a (rows) with body b (columns), of their turns.
    coupling: Matrix3<f64>,
}

impl JointBlocks {
    /// J of body a (0) or b (1), as forces see it.
    fn forces(&self, end: usize) -> Rows {
        Rows { sigma: [1.0, -1.0][end], mixed: -self.arms[end].cross_matrix() }
    }

    /// J' of body a (0) or b (1), as movements see it.
    fn movements(&self, end: usize) -> Rows {
        if end == 0 { Rows { sigma: 1.0, mixed: self.tilted } } else { self.forces(1) }
    }

    /// `alpha~ x`.
    fn yielded<const C: usize>(&self, x: &SMatrix<f64, 6, C>) -> SMatrix<f64, 6, C> {
        let [stretch, bend] = &self.compliance;
        stacked(stretch * x.fixed_rows::<3>(0), bend * x.fixed_rows::<3>(3))
    }

    /// `x alpha~`.
    fn yielding(&self, x: &Matrix6<f64>) -> Matrix6<f64> {
        let [stretch, bend] = &self.compliance;
        beside(x.fixed_columns::<3>(0) * stretch, x.fixed_columns::<3>(3) * bend)
    }
}

fn by_rows(rows: [[f64; 3]; 3]) -> Matrix3<f64> {
    Matrix3::from_fn(|r, c| rows[r][c])
}

fn stacked<const C: usize>(above: SMatrix<f64, 3, C>, below: SMatrix<f64, 3, C>) -> SMatrix<f64, 6, C> {
    SMatrix::from_fn(|r, c| if r < 3 { above[(r, c)] } else { below[(r - 3, c)] })
}

fn beside(left: SMatrix<f64, 6, 3>, right: SMatrix<f64, 6, 3>) -> Matrix6<f64> {
    let mut out = Matrix6::zeros();
    out.fixed_columns_mut::<3>(0).copy_from(&left);
    out.fixed_columns_mut::<3>(3).copy_from(&right);
    out
}

/// Adds a coupling of turns times the turns of x to the turns of `out`.
fn add_turned<const C: usize>(out: &mut SMatrix<f64, 6, C>, coupling: &Matrix3<f64>, x: &SMatrix<f64, 6, C>) {
    let mut turns = out.fixed_rows_mut::<3>(3);
    turns += coupling * x.fixed_rows::<3>(3);
}

/// A block `sigma [I, M; 0, -I]`.
#[derive(Clone, Copy, Debug)]
struct Rows {
    sigma: f64,
    mixed: Matrix3<f64>,
}

impl Rows {
    /// `R x`.
    fn apply<const C: usize>(&self, x: &SMatrix<f64, 6, C>) -> SMatrix<f64, 6, C> {
        let (above, below) = (x.fixed_rows::<3>(0), x.fixed_rows::<3>(3));
        stacked((above + self.mixed * below) * self.sigma, below * -self.sigma)
    }

    /// `R^T x`.
    fn tr_apply<const C: usize>(&self, x: &SMatrix<f64, 6, C>) -> SMatrix<f64, 6, C> {
        let (above, below) = (x.fixed_rows::<3>(0), x.fixed_rows::<3>(3));
        stacked(above * self.sigma, (self.mixed.tr_mul(&above) - below) * self.sigma)
    }

    /// `x R`.
    fn after(&self, x: &Matrix6<f64>) -> Matrix6<f64> {
        let (left, right) = (x.fixed_columns::<3>(0), x.fixed_columns::<3>(3));
        beside(left * self.sigma, (left * self.mixed - right) * self.sigma)
    }
}

impl Jacobian {
    /// That of `equations`, with the exact blocks of the turns of each body with itself, and of each joint's stretch-shear rows
    /// with those of body a.
    pub fn new(topology: &Arc<Topology>, equations: &Equations, whole: (&[Matrix3<f64>], &[Matrix3<f64>])) -> Self {
        let held: Vec<bool> = equations.bodies.iter().map(|body| body.is_held()).collect();
        let joint = |(joint, tilted): (&JointEquation, &Matrix3<f64>)| JointBlocks {
            arms: joint.arms.map(|arm| Vector3::from(arm.0)),
            tilted: *tilted,
            compliance: joint.compliance.map(|part| by_rows(part.full())),
            coupling: by_rows(joint.coupling.full()),
        };
        let joints = equations.joints.iter().zip(whole.1).map(joint).collect();
        let own = equations.bodies.iter().zip(whole.0).map(|(body, turning)| {
            let mut block = Matrix6::identity();
            if !body.is_held() {
                block.fixed_view_mut::<3, 3>(0, 0).copy_from(&(Matrix3::identity() * body.mass));
                block.fixed_view_mut::<3, 3>(3, 3).copy_from(turning);
            }
            block
        });
        Self { topology: topology.clone(), held, bodies: own.collect(), joints }
    }

    /// Adds to K' of a body with itself.
    pub fn add(&mut self, body: usize, block: &Matrix6<f64>) {
        self.bodies[body] += block;
    }

    /// `A x`, or `A^T x`. Movements of held bodies in x count. `A x` has no rows of held bodies; in those of `A^T x` is what
    /// moving them would do.
    pub fn apply(&self, x: &Field, transposed: bool, out: &mut Field) {
        for (i, (own, body)) in out.bodies.iter_mut().zip(&self.bodies).enumerate() {
            *own = match (self.held[i], transposed) {
                (true, _) => Vector6::zeros(),
                (false, true) => body.tr_mul(&x.bodies[i]),
                (false, false) => body * x.bodies[i],
            };
        }
        for (j, (joint, ends)) in self.joints.iter().zip(&self.topology.joints).enumerate() {
            let [a, b] = ends.map(|body| body as usize);
            let (mut movements, mut forces) = ([0, 1].map(|k| joint.movements(k)), [0, 1].map(|k| joint.forces(k)));
            if transposed {
                std::mem::swap(&mut movements, &mut forces);
            }
            let y = &x.joints[j];
            out.joints[j] = movements[0].apply(&x.bodies[a]) + movements[1].apply(&x.bodies[b]) - joint.yielded(y);
            out.bodies[a] += forces[0].tr_apply(y);
            out.bodies[b] += forces[1].tr_apply(y);
            add_turned(&mut out.bodies[a], &joint.coupling, &x.bodies[b]);
            add_turned(&mut out.bodies[b], &joint.coupling.transpose(), &x.bodies[a]);
        }
        if !transposed {
            out.bodies
                .iter_mut()
                .zip(&self.held)
                .filter(|(_, held)| **held)
                .for_each(|(own, _)| *own = Vector6::zeros());
        }
    }
}

/// `x` of three numbers each as a shift and a turn.
pub(crate) fn split(x: &Vector6<f64>) -> [Vector3<f64>; 2] {
    [x.fixed_rows::<3>(0).into(), x.fixed_rows::<3>(3).into()]
}

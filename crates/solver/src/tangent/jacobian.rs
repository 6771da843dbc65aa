//! The whole Jacobian of a step's equations, which is not quite symmetric, and its factor: what derivatives are made of.
//!
//! In the unknowns (dp, y = -dlambda) of [`crate::tangent`] it is `A = [K', J^T; J', -alpha~]`. K' has in its turns' blocks
//! what K leaves out, and J' how the frames turn in which stretch is measured.
//!
//! It is eliminated from the leaves to the roots, a body and the joint at its inner end at a time: with the block Z of both,
//! B of what follows in their rows, and E of them in the rows that follow, `D <- D - E Z^-1 B`. J is its own inverse, so that
//! `Z^-1` takes the inverse of 6 x 6 numbers, `N = K_o J_o' alpha~ + J_o^T`, which are regular however small compliances are.
//! Loops are cut at bodies that come last, as a dense border. One step of refinement follows every solve.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Dyn, LU, Matrix3, Matrix6, Vector3, Vector6};

use super::Equations;
use crate::topology::{Node, Topology};

/// Most bodies at which loops are cut.
const MOST_CUTS: usize = 16;

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
        Self { bodies: vec![Vector6::zeros(); topology.bodies()], joints: vec![Vector6::zeros(); topology.joints.len()] }
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
    /// J of bodies a and b, as forces see it.
    forces: [Matrix6<f64>; 2],
    /// J' of bodies a and b, as movements see it.
    movements: [Matrix6<f64>; 2],
    compliance: Matrix6<f64>,
    /// K' of body a (rows) with body b (columns), of their turns.
    coupling: Matrix6<f64>,
}

/// `sigma [I, M; 0, -I]`.
fn rows(sigma: f64, mixed: &Matrix3<f64>) -> Matrix6<f64> {
    let mut out = Matrix6::zeros();
    for k in 0..3 {
        out[(k, k)] = sigma;
        out[(3 + k, 3 + k)] = -sigma;
    }
    out.fixed_view_mut::<3, 3>(0, 3).copy_from(&(mixed * sigma));
    out
}

impl Jacobian {
    /// That of `equations`. `turned` has what the right-hand sides, `-g` of a body's turns and those of a joint's
    /// stretch-shear rows, change by where all bodies are turned alike about an axis (one a column): what neighbours and arms
    /// have in it is known, and the rest is a body's or a joint's own.
    pub fn new(topology: &Arc<Topology>, equations: &Equations, turned: (&[Matrix3<f64>], &[Matrix3<f64>])) -> Self {
        let held: Vec<bool> = equations.bodies.iter().map(|body| body.is_held()).collect();
        let mut turning: Vec<Matrix3<f64>> = turned.0.iter().map(|change| -change).collect();
        let mut joints = Vec::with_capacity(equations.joints.len());
        for ((joint, ends), change) in equations.joints.iter().zip(&topology.joints).zip(turned.1) {
            let [a, b] = ends.map(|body| body as usize);
            turning[a] -= joint.coupling;
            turning[b] -= joint.coupling.transpose();
            let [on_a, on_b] = joint.arms.map(|arm| -arm.cross_matrix());
            let tilted = -change + on_b;
            let mut compliance = Matrix6::zeros();
            compliance.fixed_view_mut::<3, 3>(0, 0).copy_from(&joint.compliance[0]);
            compliance.fixed_view_mut::<3, 3>(3, 3).copy_from(&joint.compliance[1]);
            let mut coupling = Matrix6::zeros();
            coupling.fixed_view_mut::<3, 3>(3, 3).copy_from(&joint.coupling);
            joints.push(JointBlocks {
                forces: [rows(1.0, &on_a), rows(-1.0, &on_b)],
                movements: [rows(1.0, &tilted), rows(-1.0, &on_b)],
                compliance,
                coupling,
            });
        }
        let own = equations.bodies.iter().zip(&turning).map(|(body, turning)| {
            let mut block = Matrix6::identity();
            if !body.is_held() {
                block.fixed_view_mut::<3, 3>(0, 0).copy_from(&(Matrix3::identity() * body.mass));
                block.fixed_view_mut::<3, 3>(3, 3).copy_from(turning);
            }
            block
        });
        Self { topology: topology.clone(), held, bodies: own.collect(), joints }
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
            let (movements, forces) =
                if transposed { (&joint.forces, &joint.movements) } else { (&joint.movements, &joint.forces) };
            let y = &x.joints[j];
            let (on_a, on_b) = (joint.coupling * x.bodies[b], joint.coupling.tr_mul(&x.bodies[a]));
            out.joints[j] = movements[0] * x.bodies[a] + movements[1] * x.bodies[b] - joint.compliance * y;
            out.bodies[a] += forces[0].tr_mul(y) + on_a;
            out.bodies[b] += forces[1].tr_mul(y) + on_b;
        }
        if !transposed {
            out.bodies.iter_mut().zip(&self.held).filter(|(_, held)| **held).for_each(|(own, _)| *own = Vector6::zeros());
        }
    }
}

/// A factor of a [`Jacobian`].
#[derive(Clone, Debug)]
pub struct Factor {
    /// Who is joined to whom, with the cut bodies as held ones.
    topology: Arc<Topology>,
    /// Bodies at which loops are cut.
    cuts: Vec<usize>,
    /// One entry a node.
    nodes: Vec<NodeFactor>,
    /// What is left of each body; of a root its inverse.
    left: Vec<Matrix6<f64>>,
    roots: Vec<usize>,
    /// How all others move with the cut bodies, a column a movement.
    border: Vec<Field>,
    schur: Option<LU<f64, Dyn, Dyn>>,
    residual: Field,
    change: Field,
}

/// A node that has been eliminated: a body and a joint, or a joint alone whose outer body is held.
#[derive(Clone, Copy, Debug)]
struct NodeFactor {
    /// Z^-1: rows of the body's movement and of y, columns of forces and of what the joint misses.
    inverse: [[Matrix6<f64>; 2]; 2],
    /// Their movement and y for a movement of the inner body.
    follow: [Matrix6<f64>; 2],
}

/// A node's neighbours in A.
struct Couplings<'a> {
    joint: &'a JointBlocks,
    /// J^T of the inner body.
    force: &'a Matrix6<f64>,
    /// J' of the inner body.
    movement: &'a Matrix6<f64>,
    /// K' of the outer body (rows) with the inner one.
    coupling: Matrix6<f64>,
    /// Place of the outer body in the joint.
    outer: usize,
}

impl Jacobian {
    fn couplings(&self, node: &Node) -> Couplings<'_> {
        let joint = &self.joints[node.joint as usize];
        let outer = usize::from(self.topology.joints[node.joint as usize][0] != node.outer);
        let coupling = if outer == 0 { joint.coupling } else { joint.coupling.transpose() };
        Couplings { joint, force: &joint.forces[1 - outer], movement: &joint.movements[1 - outer], coupling, outer }
    }
}

/// Bodies without which there are no loops; `None` where they are too many.
fn cuts_of(topology: &Topology) -> Option<(Vec<usize>, Topology)> {
    let (mut cuts, mut current) = (Vec::new(), topology.clone());
    while current.elimination.is_none() {
        if cuts.len() == MOST_CUTS {
            return None;
        }
        // Of what is left where leaves are taken off one by one, the body with the most joints.
        let moves = |body: u32| !current.fixed[body as usize];
        let mut joints: Vec<[u32; 2]> =
            current.joints.iter().copied().filter(|ends| ends.iter().all(|&body| moves(body))).collect();
        let degrees = loop {
            let mut degrees = vec![0_u32; current.bodies()];
            joints.iter().flatten().for_each(|&body| degrees[body as usize] += 1);
            let before = joints.len();
            joints.retain(|ends| ends.iter().all(|&body| degrees[body as usize] > 1));
            if joints.len() == before {
                break degrees;
            }
        };
        let (most, _) = degrees.iter().enumerate().rev().max_by_key(|(_, degree)| **degree).filter(|(_, d)| **d > 0)?;
        let mut fixed = current.fixed.clone();
        fixed[most] = true;
        cuts.push(most);
        current = Topology::new(current.joints.clone(), fixed);
    }
    Some((cuts, current))
}

impl Factor {
    /// Memory for Jacobians of this connectivity; `None` where there are too many loops.
    pub fn new(topology: &Topology) -> Option<Self> {
        let (cuts, cut) = cuts_of(topology)?;
        let nodes = cut.elimination.as_deref().map_or(0, <[Node]>::len);
        let node = NodeFactor { inverse: [[Matrix6::zeros(); 2]; 2], follow: [Matrix6::zeros(); 2] };
        let mut outer = vec![false; cut.bodies()];
        cut.elimination.iter().flatten().for_each(|node| outer[node.outer as usize] = true);
        let roots = (0..cut.bodies()).filter(|&body| !outer[body] && !cut.fixed[body]).collect();
        Some(Self {
            nodes: vec![node; nodes],
            left: vec![Matrix6::zeros(); cut.bodies()],
            roots,
            border: vec![Field::zero(&cut); 6 * cuts.len()],
            schur: None,
            residual: Field::zero(&cut),
            change: Field::zero(&cut),
            cuts,
            topology: Arc::new(cut),
        })
    }

    fn is_apart(&self, body: u32) -> bool {
        self.topology.fixed[body as usize]
    }

    /// Factors; returns whether it could: not where the equations are singular, numbers are not finite, or a joint without
    /// compliance holds on to a body that is held.
    pub fn factor(&mut self, jacobian: &Jacobian) -> bool {
        self.factor_tree(jacobian).and_then(|()| self.factor_border(jacobian)).is_some()
    }

    fn factor_tree(&mut self, jacobian: &Jacobian) -> Option<()> {
        let topology = self.topology.clone();
        self.left.copy_from_slice(&jacobian.bodies);
        for (k, node) in topology.elimination.iter().flatten().enumerate() {
            let own = jacobian.couplings(node);
            let compliance = &own.joint.compliance;
            let (inverse, follow) = if self.is_apart(node.outer) {
                let stiffness = compliance.try_inverse()?;
                let none = Matrix6::zeros();
                ([[none, none], [none, -stiffness]], [none, stiffness * own.movement])
            } else {
                let back = &own.joint.movements[own.outer];
                let r = self.left[node.outer as usize] * back;
                let n = (r * compliance + own.joint.forces[own.outer].transpose()).try_inverse()?;
                let (yielded, missed) = (compliance * n, n * r);
                let inverse = [[back * yielded, back * (Matrix6::identity() - compliance * missed)], [n, -missed]];
                let follow = [0, 1].map(|row| -(inverse[row][0] * own.coupling + inverse[row][1] * own.movement));
                (inverse, follow)
            };
            self.nodes[k] = NodeFactor { inverse, follow };
            if !self.is_apart(node.inner) {
                let added = own.coupling.tr_mul(&follow[0]) + own.force.tr_mul(&follow[1]);
                self.left[node.inner as usize] += added;
            }
        }
        for &root in &self.roots {
            self.left[root] = self.left[root].try_inverse()?;
        }
        self.roots.iter().all(|&root| self.left[root].iter().all(|x| x.is_finite())).then_some(())
    }

    fn factor_border(&mut self, jacobian: &Jacobian) -> Option<()> {
        if self.cuts.is_empty() {
            return Some(());
        }
        let count = self.border.len();
        let mut schur = DMatrix::zeros(count, count);
        let mut border = std::mem::take(&mut self.border);
        let mut column = Field::zero(&self.topology);
        for (c, own) in border.iter_mut().enumerate() {
            let mut unit = Field::zero(&self.topology);
            unit.bodies[self.cuts[c / 6]][c % 6] = 1.0;
            jacobian.apply(&unit, false, &mut column);
            let at_cuts = self.at_cuts(&column);
            *own = column.clone();
            self.solve_tree(jacobian, own, false);
            jacobian.apply(own, false, &mut column);
            schur.set_column(c, &(at_cuts - self.at_cuts(&column)));
        }
        self.border = border;
        let schur = schur.lu();
        let regular = schur.is_invertible();
        self.schur = Some(schur);
        regular.then_some(())
    }

    fn at_cuts(&self, x: &Field) -> DVector<f64> {
        DVector::from_iterator(6 * self.cuts.len(), self.cuts.iter().flat_map(|&cut| x.bodies[cut].iter().copied()))
    }

    /// Solves `A x = b`, or `A^T x = b`, in the place of b. Rows of held bodies are zero after it.
    pub fn solve(&mut self, jacobian: &Jacobian, x: &mut Field, transposed: bool) {
        let (mut residual, mut change) = (std::mem::take(&mut self.residual), std::mem::take(&mut self.change));
        change.bodies.copy_from_slice(&x.bodies);
        change.joints.copy_from_slice(&x.joints);
        self.solve_once(jacobian, x, transposed);
        jacobian.apply(x, transposed, &mut residual);
        residual.subtract_from(&change);
        self.solve_once(jacobian, &mut residual, transposed);
        x.add(&residual, 1.0);
        (self.residual, self.change) = (residual, change);
    }

    fn solve_once(&self, jacobian: &Jacobian, x: &mut Field, transposed: bool) {
        let Some(schur) = &self.schur else { return self.solve_tree(jacobian, x, transposed) };
        let right = self.at_cuts(x);
        let rest = |of: &Field| {
            let mut column = Field::zero(&self.topology);
            jacobian.apply(of, transposed, &mut column);
            column
        };
        if !transposed {
            self.solve_tree(jacobian, x, false);
            let mut right = right - self.at_cuts(&rest(x));
            schur.solve_mut(&mut right);
            self.border.iter().zip(&right).for_each(|(border, &share)| x.add(border, -share));
            self.set_cuts(x, &right);
            return;
        }
        // B^T A^-T b is (A^-1 B)^T b.
        let mut right = DVector::from_iterator(
            right.len(),
            self.border.iter().zip(&right).map(|(border, own)| own - dot(border, x)),
        );
        // schur^T = (P^T L U)^T.
        if let Some(inverse) = schur.try_inverse() {
            right = inverse.tr_mul(&right);
        }
        let mut moved = Field::zero(&self.topology);
        self.set_cuts(&mut moved, &right);
        x.add(&rest(&moved), -1.0);
        self.solve_tree(jacobian, x, true);
        self.set_cuts(x, &right);
    }

    fn set_cuts(&self, x: &mut Field, values: &DVector<f64>) {
        for (k, &cut) in self.cuts.iter().enumerate() {
            x.bodies[cut] = values.fixed_rows::<6>(6 * k).into();
        }
    }

    /// Solves with the cut bodies held.
    fn solve_tree(&self, jacobian: &Jacobian, x: &mut Field, transposed: bool) {
        let Field { bodies, joints } = x;
        for (body, _) in self.topology.fixed.iter().enumerate().filter(|(_, fixed)| **fixed) {
            bodies[body] = Vector6::zeros();
        }
        let nodes = self.topology.elimination.as_deref().unwrap_or(&[]);
        for (node, factor) in nodes.iter().zip(&self.nodes) {
            if self.is_apart(node.inner) {
                continue;
            }
            let (inner, f, c) = (node.inner as usize, bodies[node.outer as usize], joints[node.joint as usize]);
            if transposed {
                bodies[inner] += factor.follow[0].tr_mul(&f) + factor.follow[1].tr_mul(&c);
            } else {
                let own = jacobian.couplings(node);
                let [[a, b], [d, e]] = &factor.inverse;
                bodies[inner] -= own.coupling.tr_mul(&(a * f + b * c)) + own.force.tr_mul(&(d * f + e * c));
            }
        }
        for &root in &self.roots {
            bodies[root] = if transposed { self.left[root].tr_mul(&bodies[root]) } else { self.left[root] * bodies[root] };
        }
        for (node, factor) in nodes.iter().zip(&self.nodes).rev() {
            let (outer, joint) = (node.outer as usize, node.joint as usize);
            let (f, c, v) = (bodies[outer], joints[joint], bodies[node.inner as usize]);
            let [[a, b], [d, e]] = &factor.inverse;
            let (moved, y) = if transposed {
                let own = jacobian.couplings(node);
                let (f, c) = (f - own.coupling * v, c - own.force * v);
                (a.tr_mul(&f) + d.tr_mul(&c), b.tr_mul(&f) + e.tr_mul(&c))
            } else {
                (a * f + b * c + factor.follow[0] * v, d * f + e * c + factor.follow[1] * v)
            };
            joints[joint] = y;
            if !self.is_apart(node.outer) {
                bodies[outer] = moved;
            }
        }
    }
}

fn dot(a: &Field, b: &Field) -> f64 {
    let sum = |a: &[Vector6<f64>], b: &[Vector6<f64>]| a.iter().zip(b).map(|(a, b)| a.dot(b)).sum::<f64>();
    sum(&a.bodies, &b.bodies) + sum(&a.joints, &b.joints)
}

/// `x` of three numbers each as a shift and a turn.
pub(crate) fn split(x: &Vector6<f64>) -> [Vector3<f64>; 2] {
    [x.fixed_rows::<3>(0).into(), x.fixed_rows::<3>(3).into()]
}

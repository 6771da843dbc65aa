//! The factor of a step's whole Jacobian: see [`super`].

use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, Vector6};

use super::{Field, Jacobian, add_turned};
use crate::topology::Topology;

/// Most joints that close loops.
const MOST_CUTS: usize = 32;
/// Most steps of refinement of a solve.
const MOST_REFINEMENTS: usize = 10;
/// A change of a solution by this share is its last.
const EXACT: f64 = 1e-13;

/// A factor of a [`Jacobian`].
#[derive(Clone, Debug)]
pub struct Factor {
    /// Bodies from the leaves to the roots, each with the joint at its inner end.
    nodes: Vec<Node>,
    /// One entry a node.
    factors: Vec<NodeFactor>,
    /// What is left of each body; of a root its inverse.
    left: Vec<Matrix6<f64>>,
    /// Bodies that no joint leads further from.
    roots: Vec<usize>,
    held: Vec<bool>,
    /// Joints that close loops.
    cuts: Vec<usize>,
    /// How all else answers what these transmit, a column a number.
    border: Vec<Field>,
    schur: Option<DMatrix<f64>>,
    residual: Field,
    right: Field,
}

/// A body and the joint at its inner end.
#[derive(Clone, Copy, Debug)]
struct Node {
    body: usize,
    joint: usize,
    /// Place of the body in the joint.
    end: usize,
    /// The body at the other end, unless it is held.
    inner: Option<usize>,
}

/// A node that has been eliminated.
#[derive(Clone, Copy, Debug)]
struct NodeFactor {
    /// Z^-1: rows of the body's movement and of y, columns of forces and of what the joint misses.
    inverse: [[Matrix6<f64>; 2]; 2],
    /// Their movement and y for a movement of the inner body.
    follow: [Matrix6<f64>; 2],
}

impl Jacobian {
    /// K' of a node's body (rows) with its inner body.
    fn coupling(&self, node: &Node) -> Matrix3<f64> {
        let coupling = &self.joints[node.joint].coupling;
        if node.end == 0 { *coupling } else { coupling.transpose() }
    }
}

impl Factor {
    /// Memory for Jacobians of this connectivity; `None` where there are too many loops.
    pub fn new(topology: &Topology) -> Option<Self> {
        let bodies = topology.bodies();
        let mut joints_of = vec![Vec::new(); bodies];
        for (j, ends) in topology.joints.iter().enumerate() {
            ends.iter().enumerate().for_each(|(end, &body)| joints_of[body as usize].push((j, end)));
        }
        let (mut met, mut is_used) = (topology.fixed.clone(), vec![false; topology.joints.len()]);
        let (mut nodes, mut roots) = (Vec::new(), Vec::new());
        // From all that is held at once, then from a body of each set that is free.
        let mut front: Vec<usize> = (0..bodies).filter(|&body| topology.fixed[body]).collect();
        let mut next_root = 0;
        loop {
            while !front.is_empty() {
                let mut beyond = Vec::new();
                for inner in front {
                    for &(joint, end) in &joints_of[inner] {
                        let body = topology.joints[joint][1 - end] as usize;
                        if !met[body] {
                            (met[body], is_used[joint]) = (true, true);
                            let inner = (!topology.fixed[inner]).then_some(inner);
                            nodes.push(Node { body, joint, end: 1 - end, inner });
                            beyond.push(body);
                        }
                    }
                }
                front = beyond;
            }
            match (next_root..bodies).find(|&body| !met[body]) {
                None => break,
                Some(root) => {
                    (met[root], next_root) = (true, root + 1);
                    roots.push(root);
                    front = vec![root];
                }
            }
        }
        nodes.reverse();
        let cuts: Vec<usize> = (0..is_used.len()).filter(|&joint| !is_used[joint]).collect();
        let none = NodeFactor { inverse: [[Matrix6::zeros(); 2]; 2], follow: [Matrix6::zeros(); 2] };
        (cuts.len() <= MOST_CUTS).then(|| Self {
            factors: vec![none; nodes.len()],
            nodes,
            left: vec![Matrix6::zeros(); bodies],
            roots,
            held: topology.fixed.clone(),
            border: vec![Field::zero(topology); 6 * cuts.len()],
            cuts,
            schur: None,
            residual: Field::zero(topology),
            right: Field::zero(topology),
        })
    }

    /// Factors; returns whether it could: not where the equations are singular, or numbers are not finite.
    pub fn factor(&mut self, jacobian: &Jacobian) -> bool {
        self.factor_tree(jacobian).and_then(|()| self.factor_border(jacobian)).is_some()
    }

    fn factor_tree(&mut self, jacobian: &Jacobian) -> Option<()> {
        self.left.copy_from_slice(&jacobian.bodies);
        for (node, factor) in self.nodes.iter().zip(&mut self.factors) {
            let joint = &jacobian.joints[node.joint];
            let (own, other) = (node.end, 1 - node.end);
            let back = &joint.movements[own];
            let r = back.after(&self.left[node.body]);
            let n = (joint.yielding(&r) + joint.forces[own].tr_apply(&Matrix6::identity())).try_inverse()?;
            let missed = n * r;
            let rest = Matrix6::identity() - joint.yielded(&missed);
            factor.inverse = [[back.apply(&joint.yielded(&n)), back.apply(&rest)], [n, -missed]];
            let Some(inner) = node.inner else { continue };
            let coupling = jacobian.coupling(node);
            let [above, below] = &factor.inverse;
            for (follow, row) in factor.follow.iter_mut().zip([above, below]) {
                *follow = -joint.movements[other].after(&row[1]);
                let mut turns = follow.fixed_columns_mut::<3>(3);
                turns -= row[0].fixed_columns::<3>(3) * coupling;
            }
            let left = &mut self.left[inner];
            *left += joint.forces[other].tr_apply(&factor.follow[1]);
            add_turned(left, &coupling.transpose(), &factor.follow[0]);
        }
        for &root in &self.roots {
            self.left[root] = self.left[root].try_inverse()?;
        }
        let is_finite = |factor: &NodeFactor| factor.inverse[1][0].iter().all(|x| x.is_finite());
        self.factors.iter().all(is_finite).then_some(())
    }

    fn factor_border(&mut self, jacobian: &Jacobian) -> Option<()> {
        if self.cuts.is_empty() {
            return Some(());
        }
        let count = self.border.len();
        let mut schur = DMatrix::zeros(count, count);
        let mut border = std::mem::take(&mut self.border);
        let (mut unit, mut column) = (self.residual.clone(), self.residual.clone());
        for (c, own) in border.iter_mut().enumerate() {
            unit.clear();
            unit.joints[self.cuts[c / 6]][c % 6] = 1.0;
            jacobian.apply(&unit, false, &mut column);
            let at_cuts = self.at_cuts(&column);
            *own = column.clone();
            self.solve_tree(jacobian, own, false);
            jacobian.apply(own, false, &mut column);
            schur.set_column(c, &(at_cuts - self.at_cuts(&column)));
        }
        self.border = border;
        self.schur = schur.try_inverse();
        self.schur.is_some().then_some(())
    }

    fn at_cuts(&self, x: &Field) -> DVector<f64> {
        DVector::from_iterator(6 * self.cuts.len(), self.cuts.iter().flat_map(|&cut| x.joints[cut].iter().copied()))
    }

    fn set_cuts(&self, x: &mut Field, values: &DVector<f64>) {
        for (k, &cut) in self.cuts.iter().enumerate() {
            x.joints[cut] = values.fixed_rows::<6>(6 * k).into();
        }
    }

    /// Solves `A x = b`, or `A^T x = b`, in the place of b. Rows of held bodies are zero after it.
    pub fn solve(&mut self, jacobian: &Jacobian, x: &mut Field, transposed: bool) {
        let (mut residual, mut right) = (std::mem::take(&mut self.residual), std::mem::take(&mut self.right));
        right.bodies.copy_from_slice(&x.bodies);
        right.joints.copy_from_slice(&x.joints);
        self.solve_once(jacobian, x, transposed);
        let mut before = [f64::INFINITY; 2];
        for _ in 0..MOST_REFINEMENTS {
            jacobian.apply(x, transposed, &mut residual);
            residual.subtract_from(&right);
            self.solve_once(jacobian, &mut residual, transposed);
            let (change, size) = (residual.sizes(), x.sizes());
            // Rounding errors do not become less.
            if (0..2).all(|k| change[k] > 0.5 * before[k]) {
                break;
            }
            before = change;
            x.add(&residual, 1.0);
            if (0..2).all(|k| change[k] <= EXACT * size[k]) {
                break;
            }
        }
        (self.residual, self.right) = (residual, right);
    }

    fn solve_once(&self, jacobian: &Jacobian, x: &mut Field, transposed: bool) {
        let Some(inverse) = &self.schur else { return self.solve_tree(jacobian, x, transposed) };
        let right = self.at_cuts(x);
        let rest = |of: &Field| {
            let mut column = of.clone();
            jacobian.apply(of, transposed, &mut column);
            column
        };
        if !transposed {
            self.solve_tree(jacobian, x, false);
            let cut = inverse * (right - self.at_cuts(&rest(x)));
            self.border.iter().zip(&cut).for_each(|(border, &share)| x.add(border, -share));
            self.set_cuts(x, &cut);
            return;
        }
        // B^T T^-T f is (T^-1 B)^T f.
        let answers = self.border.iter().zip(&right).map(|(border, own)| own - dot(border, x));
        let cut = inverse.tr_mul(&DVector::from_iterator(right.len(), answers));
        let mut moved = x.clone();
        moved.clear();
        self.set_cuts(&mut moved, &cut);
        x.add(&rest(&moved), -1.0);
        self.solve_tree(jacobian, x, true);
        self.set_cuts(x, &cut);
    }

    /// Solves without the joints that close loops.
    fn solve_tree(&self, jacobian: &Jacobian, x: &mut Field, transposed: bool) {
        let Field { bodies, joints } = x;
        bodies.iter_mut().zip(&self.held).filter(|(_, held)| **held).for_each(|(body, _)| *body = Vector6::zeros());
        self.cuts.iter().for_each(|&cut| joints[cut] = Vector6::zeros());
        for (node, factor) in self.nodes.iter().zip(&self.factors) {
            let Some(inner) = node.inner else { continue };
            let (f, c) = (bodies[node.body], joints[node.joint]);
            if transposed {
                bodies[inner] += factor.follow[0].tr_mul(&f) + factor.follow[1].tr_mul(&c);
            } else {
                let [[a, b], [d, e]] = &factor.inverse;
                let force = &jacobian.joints[node.joint].forces[1 - node.end];
                bodies[inner] -= force.tr_apply(&(d * f + e * c));
                add_turned(&mut bodies[inner], &-jacobian.coupling(node).transpose(), &(a * f + b * c));
            }
        }
        for &root in &self.roots {
            bodies[root] =
                if transposed { self.left[root].tr_mul(&bodies[root]) } else { self.left[root] * bodies[root] };
        }
        for (node, factor) in self.nodes.iter().zip(&self.factors).rev() {
            let (mut f, mut c) = (bodies[node.body], joints[node.joint]);
            let [[a, b], [d, e]] = &factor.inverse;
            let inner = node.inner.map(|inner| bodies[inner]);
            if transposed {
                if let Some(v) = inner {
                    add_turned(&mut f, &-jacobian.coupling(node), &v);
                    c -= jacobian.joints[node.joint].forces[1 - node.end].apply(&v);
                }
                bodies[node.body] = a.tr_mul(&f) + d.tr_mul(&c);
                joints[node.joint] = b.tr_mul(&f) + e.tr_mul(&c);
            } else {
                let (mut moved, mut y) = (a * f + b * c, d * f + e * c);
                if let Some(v) = inner {
                    moved += factor.follow[0] * v;
                    y += factor.follow[1] * v;
                }
                bodies[node.body] = moved;
                joints[node.joint] = y;
            }
        }
    }
}

fn dot(a: &Field, b: &Field) -> f64 {
    let sum = |a: &[Vector6<f64>], b: &[Vector6<f64>]| a.iter().zip(b).map(|(a, b)| a.dot(b)).sum::<f64>();
    sum(&a.bodies, &b.bodies) + sum(&a.joints, &b.joints)
}

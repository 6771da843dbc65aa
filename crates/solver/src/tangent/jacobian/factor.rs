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
    /// `N^-1` of [`super`], one entry a node.
    factors: Vec<Matrix6<f64>>,
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
        (cuts.len() <= MOST_CUTS).then(|| Self {
            factors: vec![Matrix6::zeros(); nodes.len()],
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
            let back = joint.movements(own);
            let k = self.left[node.body];
            let r = back.after(&k);
            let n = (joint.yielding(&r) + joint.forces(own).tr_apply(&Matrix6::identity())).try_inverse()?;
            *factor = n;
            let Some(inner) = node.inner else { continue };
            // The node's answer to a movement of the inner body, which couples turns and moves the joint.
            let coupling = jacobian.coupling(node);
            let moved = joint.movements(other).after(&-Matrix6::identity());
            let mut force = Matrix6::zeros();
            force.fixed_view_mut::<3, 3>(3, 3).copy_from(&-coupling);
            let y = n * (force - r * moved);
            let movement = back.apply(&(joint.yielded(&y) + moved));
            let left = &mut self.left[inner];
            *left += joint.forces(other).tr_apply(&y);
            add_turned(left, &coupling.transpose(), &movement);
        }
        for &root in &self.roots {
            self.left[root] = self.left[root].try_inverse()?;
        }
        self.factors.iter().flatten().all(|x| x.is_finite()).then_some(())
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
        for (node, n) in self.nodes.iter().zip(&self.factors) {
            let Some(inner) = node.inner else { continue };
            let (joint, other) = (&jacobian.joints[node.joint], 1 - node.end);
            let [moved, y] = self.answer(jacobian, (node, n), [bodies[node.body], joints[node.joint]], transposed);
            let rows = if transposed { joint.movements(other) } else { joint.forces(other) };
            bodies[inner] -= rows.tr_apply(&y);
            add_turned(&mut bodies[inner], &-jacobian.coupling(node).transpose(), &moved);
        }
        for &root in &self.roots {
            bodies[root] =
                if transposed { self.left[root].tr_mul(&bodies[root]) } else { self.left[root] * bodies[root] };
        }
        for (node, n) in self.nodes.iter().zip(&self.factors).rev() {
            let (mut f, mut c) = (bodies[node.body], joints[node.joint]);
            if let Some(inner) = node.inner {
                let (joint, other) = (&jacobian.joints[node.joint], 1 - node.end);
                let rows = if transposed { joint.forces(other) } else { joint.movements(other) };
                add_turned(&mut f, &-jacobian.coupling(node), &bodies[inner]);
                c -= rows.apply(&bodies[inner]);
            }
            [bodies[node.body], joints[node.joint]] = self.answer(jacobian, (node, n), [f, c], transposed);
        }
    }

    /// `Z^-1 (f, c)` of a node, or `Z^-T (f, c)`: with the inner body held.
    fn answer(
        &self,
        jacobian: &Jacobian,
        (node, n): (&Node, &Matrix6<f64>),
        [f, c]: [Vector6<f64>; 2],
        transposed: bool,
    ) -> [Vector6<f64>; 2] {
        let (joint, k) = (&jacobian.joints[node.joint], &self.left[node.body]);
        let back = joint.movements(node.end);
        if transposed {
            let moved = n.tr_mul(&(joint.yielded(&back.tr_apply(&f)) + c));
            [moved, back.tr_apply(&(f - k.tr_mul(&moved)))]
        } else {
            let y = n * (f - k * back.apply(&c));
            [back.apply(&(joint.yielded(&y) + c)), y]
        }
    }
}

fn dot(a: &Field, b: &Field) -> f64 {
    let sum = |a: &[Vector6<f64>], b: &[Vector6<f64>]| a.iter().zip(b).map(|(a, b)| a.dot(b)).sum::<f64>();
    sum(&a.bodies, &b.bodies) + sum(&a.joints, &b.joints)
}

//! The factor of a step's whole Jacobian: see [`super`].

use nalgebra::{DMatrix, DVector};

use super::blocks::{self, add_to_turns, add_turned, inverse, minus, product, total};
use super::{Field, Jacobian};
use crate::block::Block;
use crate::topology::Topology;
use kernels::Spatial;
use kernels::lane::Real;
use kernels::math::Vec3;

/// Most joints that close loops.
const MOST_CUTS: usize = 32;
/// Most steps of refinement of a solve.
const MOST_REFINEMENTS: usize = 10;
/// A change of a solution by this share is its last.
const EXACT: f64 = 1e-13;

/// A factor of a [`Jacobian`].
#[derive(Clone, Debug)]
pub struct Factor<T = f64> {
    /// Bodies from the leaves to the roots, each with the joint at its inner end.
    nodes: Vec<Node>,
    /// `N^-1` of [`super`], one entry a node.
    factors: Vec<Block<T>>,
    /// What is left of each body; of a root its inverse.
    left: Vec<Block<T>>,
    /// Bodies that no joint leads further from.
    roots: Vec<usize>,
    held: Vec<bool>,
    /// Joints that close loops.
    cuts: Vec<usize>,
    /// How all else answers what these transmit, a column a number.
    border: Vec<Field<T>>,
    /// The inverse of what is left for them, one a lane.
    schur: Vec<DMatrix<f64>>,
    residual: Field<T>,
    right: Field<T>,
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

impl<T: Real> Factor<T> {
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
            factors: vec![[[T::zero(); 6]; 6]; nodes.len()],
            nodes,
            left: vec![[[T::zero(); 6]; 6]; bodies],
            roots,
            held: topology.fixed.clone(),
            border: vec![Field::zero(topology); 6 * cuts.len()],
            cuts,
            schur: Vec::new(),
            residual: Field::zero(topology),
            right: Field::zero(topology),
        })
    }

    /// Factors; returns whether it could in so many lanes: not where the equations are singular, or numbers are not finite.
    pub fn factor(&mut self, jacobian: &Jacobian<T>, lanes: usize) -> bool {
        let sum = T::dispatch(
            #[inline(always)]
            || self.factor_tree(jacobian),
        );
        let is_finite = (0..lanes.min(T::LANES)).all(|lane| sum.lane(lane).is_finite());
        is_finite && self.factor_border(jacobian, lanes).is_some()
    }

    /// Returns a number that is not finite where the factor is not.
    #[inline(always)]
    fn factor_tree(&mut self, jacobian: &Jacobian<T>) -> T {
        let Self { nodes, factors, left, roots, .. } = self;
        for (left, (mass, turning)) in left.iter_mut().zip(&jacobian.bodies) {
            *left = blocks::of_body(*mass, *turning);
        }
        for (body, block) in &jacobian.added {
            blocks::add(&mut left[*body], block);
        }
        let mut sum = T::zero();
        // Nodes, then roots.
        for k in 0..nodes.len() + roots.len() {
            let node = nodes.get(k);
            let r = node.map(|node| jacobian.joints[node.joint].movements(node.end).after(&left[node.body]));
            let n = inverse(&match (node, &r) {
                (Some(node), Some(r)) => {
                    let joint = &jacobian.joints[node.joint];
                    let mut n = joint.yielding(r);
                    blocks::add(&mut n, &joint.forces(node.end).transposed());
                    n
                }
                _ => left[roots[k - nodes.len()]],
            });
            sum += total(&n);
            let (Some(node), Some(r)) = (node, r) else {
                left[roots[k - nodes.len()]] = n;
                continue;
            };
            factors[k] = n;
            let Some(inner) = node.inner else { continue };
            let joint = &jacobian.joints[node.joint];
            // The node's answer to a movement of the inner body, which couples turns and moves the joint.
            let (own, other) = (node.end, 1 - node.end);
            let (back, ahead) = (joint.movements(own), joint.movements(other));
            let mut force = ahead.after(&r);
            add_to_turns(&mut force, minus(joint.coupling(own)));
            let y = product(&n, &force);
            let mut turns = joint.bent(&y);
            for (k, row) in turns.iter_mut().enumerate() {
                row[3 + k] += ahead.sigma;
                for x in row {
                    *x = *x * -back.sigma;
                }
            }
            let left = &mut left[inner];
            blocks::add(left, &joint.forces(other).tr_times(&y));
            add_turned(left, joint.coupling(other), &turns);
        }
        sum
    }

    fn factor_border(&mut self, jacobian: &Jacobian<T>, lanes: usize) -> Option<()> {
        self.schur.clear();
        if self.cuts.is_empty() {
            return Some(());
        }
        let count = self.border.len();
        let mut schur = vec![DMatrix::zeros(count, count); T::LANES];
        let mut border = std::mem::take(&mut self.border);
        let (mut unit, mut column) = (self.residual.clone(), self.residual.clone());
        for (c, own) in border.iter_mut().enumerate() {
            unit.clear();
            let mut entry = [T::zero(); 6];
            entry[c % 6] = T::splat(1.0);
            unit.joints[self.cuts[c / 6]] = Spatial::from_array(entry);
            jacobian.apply(&unit, false, &mut column);
            let at_cuts = self.at_cuts(&column);
            own.clone_from(&column);
            self.solve_tree(jacobian, own, false);
            jacobian.apply(own, false, &mut column);
            let of_tree = self.at_cuts(&column);
            for (lane, schur) in schur.iter_mut().enumerate() {
                for (r, (own, of_tree)) in at_cuts.iter().zip(&of_tree).enumerate() {
                    schur[(r, c)] = own.lane(lane) - of_tree.lane(lane);
                }
            }
        }
        self.border = border;
        for (lane, schur) in schur.into_iter().enumerate() {
            match schur.try_inverse() {
                Some(inverse) => self.schur.push(inverse),
                None if lane < lanes => return None,
                None => self.schur.push(DMatrix::zeros(count, count)),
            }
        }
        Some(())
    }

    /// What joints that close loops have in a field.
    fn at_cuts(&self, x: &Field<T>) -> Vec<T> {
        self.cuts.iter().flat_map(|&cut| x.joints[cut].to_array()).collect()
    }

    fn set_cuts(&self, x: &mut Field<T>, values: &[T]) {
        for (&cut, own) in self.cuts.iter().zip(values.as_chunks().0) {
            x.joints[cut] = Spatial::from_array(*own);
        }
    }

    /// Answers of joints that close loops, lane by lane.
    fn of_cuts(&self, right: &[T], transposed: bool) -> Vec<T> {
        let mut out = right.to_vec();
        for (lane, inverse) in self.schur.iter().enumerate() {
            let own = DVector::from_iterator(right.len(), right.iter().map(|x| x.lane(lane)));
            let own = if transposed { inverse.tr_mul(&own) } else { inverse * own };
            out.iter_mut().zip(&own).for_each(|(out, own)| out.set_lane(lane, *own));
        }
        out
    }

    /// Solves `A x = b`, or `A^T x = b`, in the place of b. Rows of held bodies are zero after it.
    pub fn solve(&mut self, jacobian: &Jacobian<T>, x: &mut Field<T>, transposed: bool) {
        let (mut residual, mut right) = (std::mem::take(&mut self.residual), std::mem::take(&mut self.right));
        right.bodies.copy_from_slice(&x.bodies);
        right.joints.copy_from_slice(&x.joints);
        self.solve_once(jacobian, x, transposed);
        let mut before = [T::splat(f64::INFINITY); 2];
        // In which lanes a solution is still being refined.
        let mut active = T::splat(1.0);
        for _ in 0..MOST_REFINEMENTS {
            jacobian.apply(x, transposed, &mut residual);
            T::dispatch(
                #[inline(always)]
                || residual.with(&right).for_each(|(own, right)| *own = right.plus(*own, T::splat(-1.0))),
            );
            self.solve_once(jacobian, &mut residual, transposed);
            active = T::dispatch(
                #[inline(always)]
                || refine(x, &residual, &mut before, active),
            );
            if (0..T::LANES).all(|lane| active.lane(lane) < 0.0) {
                break;
            }
        }
        (self.residual, self.right) = (residual, right);
    }

    fn solve_once(&self, jacobian: &Jacobian<T>, x: &mut Field<T>, transposed: bool) {
        if self.cuts.is_empty() {
            return self.solve_tree(jacobian, x, transposed);
        }
        let right = self.at_cuts(x);
        let rest = |of: &Field<T>| {
            let mut column = of.clone();
            jacobian.apply(of, transposed, &mut column);
            column
        };
        let less = |a: &[T], b: &[T]| -> Vec<T> { a.iter().zip(b).map(|(a, b)| *a - *b).collect() };
        if !transposed {
            self.solve_tree(jacobian, x, false);
            let cut = self.of_cuts(&less(&right, &self.at_cuts(&rest(x))), false);
            self.border.iter().zip(&cut).for_each(|(border, &share)| x.add(border, -share));
            self.set_cuts(x, &cut);
            return;
        }
        // B^T T^-T f is (T^-1 B)^T f.
        let answers: Vec<T> = self.border.iter().map(|border| border.dot(x)).collect();
        let cut = self.of_cuts(&less(&right, &answers), true);
        let mut moved = x.clone();
        moved.clear();
        self.set_cuts(&mut moved, &cut);
        x.add(&rest(&moved), T::splat(-1.0));
        self.solve_tree(jacobian, x, true);
        self.set_cuts(x, &cut);
    }

    /// Solves without the joints that close loops.
    fn solve_tree(&self, jacobian: &Jacobian<T>, x: &mut Field<T>, transposed: bool) {
        T::dispatch(
            #[inline(always)]
            || match transposed {
                true => self.solve_all::<true>(jacobian, x),
                false => self.solve_all::<false>(jacobian, x),
            },
        );
    }

    #[inline(always)]
    fn solve_all<const TRANSPOSED: bool>(&self, jacobian: &Jacobian<T>, x: &mut Field<T>) {
        let Field { bodies, joints } = x;
        let one = T::splat(1.0);
        bodies.iter_mut().zip(&self.held).filter(|(_, held)| **held).for_each(|(body, _)| *body = Spatial::zero());
        self.cuts.iter().for_each(|&cut| joints[cut] = Spatial::zero());
        for (node, n) in self.nodes.iter().zip(&self.factors) {
            let Some(inner) = node.inner else { continue };
            let (joint, other) = (&jacobian.joints[node.joint], 1 - node.end);
            let own = [bodies[node.body], joints[node.joint]];
            let [moved, y] = self.answer::<TRANSPOSED>(jacobian, (node, n), own);
            let rows = if TRANSPOSED { joint.movements(other) } else { joint.forces(other) };
            bodies[inner] = bodies[inner].plus(rows.tr_apply(y), -one);
            bodies[inner].angular -= joint.coupling(other).apply(moved.angular);
        }
        for &root in &self.roots {
            let left = &self.left[root];
            bodies[root] =
                if TRANSPOSED { blocks::tr_apply(left, bodies[root]) } else { blocks::apply(left, bodies[root]) };
        }
        for (node, n) in self.nodes.iter().zip(&self.factors).rev() {
            let (mut f, mut c) = (bodies[node.body], joints[node.joint]);
            if let Some(inner) = node.inner {
                let (joint, other) = (&jacobian.joints[node.joint], 1 - node.end);
                let rows = if TRANSPOSED { joint.forces(other) } else { joint.movements(other) };
                f.angular -= joint.coupling(node.end).apply(bodies[inner].angular);
                c = c.plus(rows.apply(bodies[inner]), -one);
            }
            [bodies[node.body], joints[node.joint]] = self.answer::<TRANSPOSED>(jacobian, (node, n), [f, c]);
        }
    }

    /// `Z^-1 (f, c)` of a node, or `Z^-T (f, c)`: with the inner body held.
    #[inline(always)]
    fn answer<const TRANSPOSED: bool>(
        &self,
        jacobian: &Jacobian<T>,
        (node, n): (&Node, &Block<T>),
        [f, c]: [Spatial<T>; 2],
    ) -> [Spatial<T>; 2] {
        let (joint, k) = (&jacobian.joints[node.joint], &self.left[node.body]);
        let (back, one) = (joint.movements(node.end), T::splat(1.0));
        if TRANSPOSED {
            let moved = blocks::tr_apply(n, joint.yielded(back.tr_apply(f)).plus(c, one));
            [moved, back.tr_apply(f.plus(blocks::tr_apply(k, moved), -one))]
        } else {
            let y = blocks::apply(n, f.plus(blocks::apply(k, back.apply(c)), -one));
            [back.apply(joint.yielded(y).plus(c, one)), y]
        }
    }
}

/// Takes a change over into a solution, in the lanes that are `active` and where it is less than the one `before`; returns the
/// lanes in which another one may follow.
#[inline(always)]
fn refine<T: Real>(x: &mut Field<T>, change: &Field<T>, before: &mut [T; 2], active: T) -> T {
    let (changed, size) = (change.sizes(), x.sizes());
    let (no, half) = (T::splat(-1.0), T::splat(0.5));
    // Rounding errors do not become less.
    let falls = |k: usize| before[k] * half - changed[k];
    let active = active.select(falls(0).max(falls(1)).select(active, no), no);
    *before = changed;
    let select = |own: Vec3<T>, by: Vec3<T>| {
        let [x, y, z] = (own + by).0;
        Vec3([active.select(x, own.0[0]), active.select(y, own.0[1]), active.select(z, own.0[2])])
    };
    for (own, by) in x.with(change) {
        *own = Spatial { linear: select(own.linear, by.linear), angular: select(own.angular, by.angular) };
    }
    let exact = |k: usize| changed[k] - size[k] * T::splat(EXACT);
    let left = exact(0).max(exact(1));
    // Nothing is left where both are not more than their share.
    (-left).select(no, active)
}

//! The direct solver: block elimination along the tree of unknowns, O(N) and without fill.
//!
//! A node's blocks are put together when it is eliminated and never stored; what remains is its share of the factor,
//! 63 numbers. What eliminated children take from their parent waits on a stack (post-order keeps it in place: one block
//! deep on a chain).

use crate::kernel::block::{Block, NodeFactor};
use crate::kernel::dispatch::vectorized;
use crate::kernel::lane::Real;
use crate::kernel::math::{Sym3, Vec3};
use crate::linear::{LinearInfo, LinearSolver};
use crate::system::{Six, System};
use crate::topology::{NONE, Node, Topology, Unknown};

/// Factor of a system whose graph is a tree, and the memory to solve with it.
#[derive(Clone, Debug)]
pub struct TreeFactor<T> {
    nodes: Vec<NodeFactor<T>>,
    /// One entry a node: the right-hand side on the way up, the solution on the way down.
    unknowns: Vec<[T; 6]>,
    blocks: Vec<Block<T>>,
    shares: Vec<[T; 6]>,
}

/// `sigma` of a body in a joint: +1 for body a, -1 for body b, with the connector's place z.
#[inline(always)]
fn end<T: Real>(system: &System<T>, joint: u32, body: u32) -> (f64, T) {
    let terms = &system.joints[joint as usize];
    if system.topology.joints[joint as usize][0] == body { (1.0, terms.offsets[0]) } else { (-1.0, terms.offsets[1]) }
}

/// The four 3x3 parts of a block.
#[inline(always)]
fn assemble<T: Real>(ss: [[T; 3]; 3], sb: [[T; 3]; 3], bs: [[T; 3]; 3], bb: [[T; 3]; 3]) -> Block<T> {
    let mut block = [[T::zero(); 6]; 6];
    for r in 0..3 {
        for c in 0..3 {
            block[r][c] = ss[r][c];
            block[r][c + 3] = sb[r][c];
            block[r + 3][c] = bs[r][c];
            block[r + 3][c + 3] = bb[r][c];
        }
    }
    block
}

#[inline(always)]
fn scaled<T: Real>(m: [[T; 3]; 3], k: T) -> [[T; 3]; 3] {
    m.map(|row| row.map(|x| x * k))
}

#[inline(always)]
fn summed<T: Real>(a: [[T; 3]; 3], b: [[T; 3]; 3]) -> [[T; 3]; 3] {
    [(Vec3(a[0]) + Vec3(b[0])).0, (Vec3(a[1]) + Vec3(b[1])).0, (Vec3(a[2]) + Vec3(b[2])).0]
}

/// D of a joint, in world rows.
///
/// With P = [d]x W and S = [d]x W [d]x^T of each body: stretch-stretch `sum (1/m) I + z^2 S + alpha~_s`, stretch-bend
/// `sum z P`, bend-bend `sum W + alpha~_b`.
#[inline(always)]
pub fn joint_diagonal<T: Real>(system: &System<T>, joint: u32) -> Block<T> {
    let terms = &system.joints[joint as usize];
    let [a, b] = system.topology.joints[joint as usize].map(|body| &system.bodies[body as usize]);
    let [za, zb] = terms.offsets;
    let (pa, pb) = (a.inverse_inertia.crossed(a.axis), b.inverse_inertia.crossed(b.axis));
    let (sa, sb) = (Sym3::crossed_twice(pa, a.axis), Sym3::crossed_twice(pb, b.axis));
    let stretch = Sym3::identity(a.inverse_mass + b.inverse_mass)
        + sa * (za * za)
        + sb * (zb * zb)
        + terms.stretch_compliance(a.axis);
    let bend = a.inverse_inertia + b.inverse_inertia + terms.bend_compliance(a.axis);
    let mixed = summed(scaled(pa, za), scaled(pb, zb));
    assemble(stretch.full(), mixed, crate::kernel::math::transposed(mixed), bend.full())
}

/// The block that couples two joints through body `via`: rows of `joint`, columns of `other`.
///
/// `sigma sigma' [ (1/m) I + z z' S, z P; z' P^T, W ]`.
#[inline(always)]
pub fn joint_coupling<T: Real>(system: &System<T>, joint: u32, other: u32, via: u32) -> Block<T> {
    let body = &system.bodies[via as usize];
    let ((sigma, z), (sigma_other, z_other)) = (end(system, joint, via), end(system, other, via));
    let sign = T::splat(sigma * sigma_other);
    let p = body.inverse_inertia.crossed(body.axis);
    let s = Sym3::crossed_twice(p, body.axis);
    let stretch = Sym3::identity(body.inverse_mass * sign) + s * (z * z_other * sign);
    assemble(
        stretch.full(),
        scaled(p, z * sign),
        scaled(crate::kernel::math::transposed(p), z_other * sign),
        scaled(body.inverse_inertia.full(), sign),
    )
}

/// J of a joint with respect to a body, in world rows: `sigma [I, -z [d]x; 0, -I]`.
#[inline(always)]
fn jacobian<T: Real>(system: &System<T>, joint: u32, body: u32) -> Block<T> {
    let (sigma, z) = end(system, joint, body);
    let k = T::splat(sigma);
    let [x, y, w] = (system.bodies[body as usize].axis * (z * k)).0;
    let o = T::zero();
    assemble(Sym3::identity(k).full(), [[o, w, -y], [-w, o, x], [y, -x, o]], [[o; 3]; 3], Sym3::identity(-k).full())
}

/// D of a body that is an unknown itself: -M.
#[inline(always)]
fn body_diagonal<T: Real>(system: &System<T>, body: u32) -> Block<T> {
    let terms = &system.bodies[body as usize];
    let minus = T::splat(-1.0);
    let o = [[T::zero(); 3]; 3];
    let mass = Sym3::identity(minus / terms.inverse_mass);
    assemble(mass.full(), o, o, (terms.inverse_inertia.inverse() * minus).full())
}

#[inline(always)]
fn coupling<T: Real>(system: &System<T>, node: &Node, parent: &Node) -> Block<T> {
    match (node.unknown, parent.unknown) {
        (Unknown::Joint(joint), Unknown::Joint(other)) => joint_coupling(system, joint, other, node.via),
        (Unknown::Joint(joint), Unknown::Body(body)) => jacobian(system, joint, body),
        (Unknown::Body(body), Unknown::Joint(joint)) => {
            let j = jacobian(system, joint, body);
            let mut out = j;
            for r in 0..6 {
                for c in 0..6 {
                    out[r][c] = j[c][r];
                }
            }
            out
        }
        // Bodies are coupled through joints alone.
        (Unknown::Body(_), Unknown::Body(_)) => [[T::zero(); 6]; 6],
    }
}

impl<T: Real> TreeFactor<T> {
    /// Memory for an elimination order of `nodes` nodes with this stack depth.
    pub fn new(nodes: usize, stack_depth: usize) -> Self {
        Self {
            nodes: vec![NodeFactor::zero(); nodes],
            unknowns: vec![[T::zero(); 6]; nodes],
            blocks: Vec::with_capacity(stack_depth),
            shares: Vec::with_capacity(stack_depth),
        }
    }

    /// Factors the system and carries its right-hand side up the tree at the same time.
    #[inline(always)]
    pub fn factor(&mut self, system: &System<T>, order: &[Node]) {
        self.blocks.clear();
        self.shares.clear();
        for (index, node) in order.iter().enumerate() {
            let (mut d, mut r) = match node.unknown {
                Unknown::Joint(joint) => {
                    let terms = &system.joints[joint as usize];
                    let q_a = system.bodies[system.topology.joints[joint as usize][0] as usize].orientation;
                    (joint_diagonal(system, joint), terms.to_world(terms.rhs, q_a).to_array())
                }
                Unknown::Body(body) => (body_diagonal(system, body), [T::zero(); 6]),
            };
            for _ in 0..node.children {
                let (Some(block), Some(share)) = (self.blocks.pop(), self.shares.pop()) else { break };
                for row in 0..6 {
                    for column in 0..6 {
                        d[row][column] -= block[row][column];
                    }
                    r[row] -= share[row];
                }
            }
            let factor = &mut self.nodes[index];
            if node.parent == NONE {
                factor.factor_root(d);
                factor.forward(&mut r);
            } else {
                let b = coupling(system, node, &order[node.parent as usize]);
                let schur = factor.factor(d, b);
                factor.forward(&mut r);
                self.blocks.push(schur);
                self.shares.push(factor.passed_on(&r));
            }
            self.unknowns[index] = r;
        }
    }

    /// Goes down the tree; `take(joint, x)` gets each joint's multipliers in world rows.
    #[inline(always)]
    pub fn back_substitute(&mut self, order: &[Node], mut take: impl FnMut(usize, Six<T>)) {
        for (index, node) in order.iter().enumerate().rev() {
            let (below, above) = self.unknowns.split_at_mut(index + 1);
            let parent = if node.parent == NONE { None } else { Some(&above[node.parent as usize - index - 1]) };
            self.nodes[index].backward(&mut below[index], parent);
            if let Unknown::Joint(joint) = node.unknown {
                take(joint as usize, Six::from_array(below[index]));
            }
        }
    }
}

/// The direct solver for graphs without loops.
#[derive(Clone, Debug)]
pub struct Direct<T> {
    factor: TreeFactor<T>,
}

impl<T: Real> Direct<T> {
    /// Memory for systems of this connectivity; `None` where it has a loop.
    pub fn new(topology: &Topology) -> Option<Self> {
        topology.elimination.is_some().then(|| Self::for_tree(topology))
    }

    /// Memory for systems of this connectivity, which must have no loop: the multipliers of one with a loop stay zero.
    pub(crate) fn for_tree(topology: &Topology) -> Self {
        let nodes = topology.elimination.as_deref().map_or(0, <[Node]>::len);
        Self { factor: TreeFactor::new(nodes, topology.stack_depth) }
    }
}

impl<T: Real> LinearSolver<T> for Direct<T> {
    fn solve(&mut self, system: &System<T>, _has_start: bool, dlambda: &mut [Six<T>]) -> LinearInfo {
        let order = system.topology.elimination.as_deref().unwrap_or(&[]);
        vectorized(
            #[inline(always)]
            || {
                self.factor.factor(system, order);
                self.factor.back_substitute(
                    order,
                    #[inline(always)]
                    |joint, x| {
                        let q_a = system.bodies[system.topology.joints[joint][0] as usize].orientation;
                        dlambda[joint] = system.joints[joint].multipliers_from_world(x, q_a);
                    },
                );
            },
        );
        LinearInfo::default()
    }

    fn uses_start(&self) -> bool {
        false
    }
}

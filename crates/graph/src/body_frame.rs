//! Features that neither a shift nor a rotation of the scene changes, nor the size of the right-hand side.
//!
//! Vectors stand in body frames: a node's in its own, an edge's in that of its body a (the sender), where the
//! multipliers of bend-twist are. Everything that scales with the right-hand side b is divided by
//!
//! ```text
//! s = sqrt(mean |xp|^2 + n l^4 mean |b_bend|^2)
//! ```
//!
//! with the translations xp that close the gaps (means over the n nodes that move and over the edges; l is the joint's),
//! so that inputs do not change when b is multiplied, and outputs times s do as dlambda does. Outputs are in units of
//! their rod's mean mass m and length l over the segments that move: dx in s, dphi in s / l, stretch-shear multipliers
//! in m n s, bend-twist multipliers in m n s l^2.
//!
//! [`Features`] holds the memory; filling allocates nothing. Inputs are neither whitened nor clipped here: see
//! [`crate::Whitening`].

use component::Component;
use kernels::Spatial;
use kernels::dispatch::vectorized;
use kernels::math::Vec3;

use crate::particular::Particular;
use crate::{Channel, Graph, put};

/// Inputs a node that stay the same over a scene: whether it moves, i / n, 1 / i, 1 / (n - i + 1), ln n, ln(r / l),
/// ln(m / mean m).
///
/// i counts the joints from the clamp, n those on the longest way through the node; all but the first are 0 where the
/// node is fixed. n of the logarithm is the number of nodes that move.
pub const NODE_CONSTANT: usize = 7;
/// Inputs a node that change: xp / s, the ways to the clamp and to the rod's tip over the length of all that moves.
pub const NODE_CHANGING: usize = 9;
/// Inputs an edge that stay the same over a scene and a time step: rest rotation (l / 2) Omega_0, ln of the compliances
/// of bending and twist (alpha~ m l^4), the connectors' places over the segments' lengths, whether the ends move.
pub const EDGE_CONSTANT: usize = 9;
/// Inputs an edge that change: b_stretch / s, asinh of b_bend, the force and the moment that xp needs, asinh of what
/// these leave of b_bend, the relative rotation Im(conj(q_a) q_b). Bend-twist rows are in units of s / (l^2 sqrt(n)).
pub const EDGE_CHANGING: usize = 18;
/// Outputs a node: dx, dphi in its own frame.
pub const NODE_TARGET: usize = 6;
/// Outputs an edge: dlambda in the sender's frame, stretch-shear first.
pub const EDGE_TARGET: usize = 6;

/// Kinds of the constant inputs of a node.
pub const NODE_CONSTANT_CHANNELS: [Channel; NODE_CONSTANT] = [Channel::Scalar; NODE_CONSTANT];
/// Kinds of the changing inputs of a node.
pub const NODE_CHANGING_CHANNELS: [Channel; NODE_CHANGING] = vectors([true; 3]);
/// Kinds of the constant inputs of an edge.
pub const EDGE_CONSTANT_CHANNELS: [Channel; EDGE_CONSTANT] = {
    let ([a, b, c], s) = (Channel::AXIAL, Channel::Scalar);
    [a, b, c, s, s, s, s, s, s]
};
/// Kinds of the changing inputs of an edge.
pub const EDGE_CHANGING_CHANNELS: [Channel; EDGE_CHANGING] = vectors([true, false, true, false, false, false]);
/// Kinds of the outputs of a node.
pub const NODE_TARGET_CHANNELS: [Channel; NODE_TARGET] = vectors([true, false]);
/// Kinds of the outputs of an edge.
pub const EDGE_TARGET_CHANNELS: [Channel; EDGE_TARGET] = vectors([true, false]);

/// Components of vectors, polar where true and axial where false.
const fn vectors<const V: usize, const N: usize>(polar: [bool; V]) -> [Channel; N] {
    let mut out = [Channel::Scalar; N];
    let mut k = 0;
    while k < N {
        out[k] = if polar[k / 3] { Channel::POLAR[k % 3] } else { Channel::AXIAL[k % 3] };
        k += 1;
    }
    out
}

/// Fills what stays the same of the nodes. `[nodes, 7]`
pub fn fill_constant_nodes(graph: &Graph, nodes: &mut [f32]) {
    let mut moving = (0.0, 0.0);
    for node in graph.nodes().iter().filter(|node| node.free[0]) {
        moving = (moving.0 + 1.0, moving.1 + node.mass);
    }
    let (count, mass) = moving;
    for (row, node) in nodes.chunks_exact_mut(NODE_CONSTANT).zip(graph.nodes()) {
        if !node.free[0] {
            row.fill(0.0);
            continue;
        }
        // A set without a fixed body has a first node of depth 0: it counts as the first beyond a clamp.
        let (i, left) = (f64::from(node.depth.max(1)), f64::from(node.height));
        let size = (node.radius / node.length).ln();
        let inputs =
            [1.0, i / (i + left - 1.0), 1.0 / i, 1.0 / left, f64::ln(count), size, (node.mass * count / mass).ln()];
        put(row, inputs);
    }
}

/// Fills what stays the same of the edges over a scene and a time step `dt` [s]; once more when `dt` changes. `[edges, 9]`
pub fn fill_constant_edges(graph: &Graph, dt: f64, edges: &mut [f32]) {
    for (k, (row, edge)) in edges.chunks_exact_mut(EDGE_CONSTANT).zip(graph.edges()).enumerate() {
        let ends = [graph.senders()[k], graph.receivers()[k]].map(|i| &graph.nodes()[i as usize]);
        let [mass, length] = graph.nodes()[edge.outer as usize].rod_scale;
        // A compliance of zero is as good as one that adds a millionth of a millionth to the matrix.
        let compliance = |alpha: f64| (alpha / (dt * dt) * mass * length.powi(4)).max(1e-12).ln();
        let [x, y, z] = edge.rest_darboux.map(|omega| 0.5 * edge.length * omega);
        let [bend, twist] = edge.bend_compliance.map(compliance);
        let [a, b] = [0, 1].map(|k: usize| edge.offsets[k] / ends[k].length);
        let [a_moves, b_moves] = ends.map(|node| f64::from(u8::from(node.free[0])));
        put(row, [x, y, z, bend, twist, a, b, a_moves, b_moves]);
    }
}

/// Inverse hyperbolic sine with an absolute error of some 1e-7, as much as features keep.
#[inline(always)]
fn asinh(x: f32) -> f32 {
    // Beyond that its square is infinite.
    let size = x.abs().min(1e15);
    ln(size + (size * size + 1.0).sqrt()).copysign(x)
}

/// Natural logarithm of a finite number >= 1, without a call: `x = m 2^k` with m in [1 / sqrt(2), sqrt(2)), and of m the
/// series of the inverse hyperbolic tangent.
#[inline(always)]
fn ln(x: f32) -> f32 {
    const HALF_OCTAVE: u32 = 0x3f80_0000 - ROOT_HALF;
    const ROOT_HALF: u32 = 0x3f35_04f3;
    const MANTISSA: u32 = (1 << 23) - 1;
    let bits = x.to_bits() + HALF_OCTAVE;
    let exponent = (bits >> 23) as i32 - 127;
    let m = f32::from_bits((bits & MANTISSA) + ROOT_HALF);
    let t = (m - 1.0) / (m + 1.0);
    let s = t * t;
    2.0 * t * (1.0 + s * (1.0 / 3.0 + s * (0.2 + s * (1.0 / 7.0)))) + exponent as f32 * std::f32::consts::LN_2
}

/// The features of one graph that change from solve to solve.
#[derive(Clone, Debug)]
pub struct Features {
    particular: Particular,
    /// Number of nodes that move.
    moving: f64,
    /// Length of all nodes that move [m].
    length: f64,
    /// Of each edge 1 / (m n) and 1 / (m n l^2): its multipliers' units, but for 1 / s.
    units: Vec<[f64; 2]>,
    /// Of each edge, the six inputs that pass through asinh.
    squashed: Vec<f32>,
}

impl Features {
    /// Memory for a graph.
    pub fn new(graph: &Graph) -> Self {
        let moving = || graph.nodes().iter().filter(|node| node.free[0]);
        let length: f64 = moving().map(|node| node.length).sum();
        let count = moving().count() as f64;
        let units = |edge: &crate::Edge| {
            let [mass, length] = graph.nodes()[edge.outer as usize].rod_scale;
            let unit = 1.0 / (mass * count.max(1.0));
            [unit, unit / (length * length)]
        };
        let units = graph.edges().iter().map(units).collect();
        let squashed = vec![0.0; 6 * graph.edges().len()];
        Self { particular: Particular::new(graph), moving: count, length, units, squashed }
    }

    /// Fills the changing inputs of nodes `[nodes, 9]` and edges `[edges, 18]` for the component's system, and returns
    /// the scale s [m] of its right-hand side.
    pub fn fill(&mut self, graph: &Graph, component: &Component<f64>, nodes: &mut [f32], edges: &mut [f32]) -> f64 {
        vectorized(
            #[inline(always)]
            || {
                self.particular.solve(graph, component);
                let scale = self.scale(graph, component);
                let inverse = if scale > 0.0 { 1.0 / scale } else { 0.0 };
                self.fill_nodes(graph, component, inverse, nodes);
                self.fill_edges(graph, component, inverse, edges);
                scale
            },
        )
    }

    /// s [m].
    #[inline(always)]
    fn scale(&self, graph: &Graph, component: &Component<f64>) -> f64 {
        let shift: f64 = self.particular.shift.iter().map(|x| x.norm_squared()).sum();
        let squared = |(edge, terms): (&crate::Edge, &jointed::system::JointTerms<f64>)| {
            terms.rhs.angular.norm_squared() * edge.length.powi(4)
        };
        let bend: f64 = graph.edges().iter().zip(&component.system.joints).map(squared).sum();
        (shift / self.moving.max(1.0) + self.moving * bend / (graph.edges().len() as f64).max(1.0)).sqrt()
    }

    #[inline(always)]
    fn fill_nodes(&self, graph: &Graph, component: &Component<f64>, inverse: f64, nodes: &mut [f32]) {
        let way = if self.length > 0.0 { 1.0 / self.length } else { 0.0 };
        let width = nodes.len() / graph.nodes().len().max(1);
        for (i, (row, node)) in nodes.chunks_exact_mut(width.max(1)).zip(graph.nodes()).enumerate() {
            let pose = &component.poses[i];
            let to = |other: u32| pose.q.rotate_back((component.poses[other as usize].x - pose.x) * way).0;
            put(row, pose.q.rotate_back(self.particular.shift[i] * inverse).0);
            put(&mut row[3..], to(node.root));
            put(&mut row[6..], to(node.tip));
        }
    }

    #[inline(always)]
    fn fill_edges(&mut self, graph: &Graph, component: &Component<f64>, inverse: f64, edges: &mut [f32]) {
        let system = &component.system;
        for (k, (row, edge)) in edges.chunks_exact_mut(EDGE_CHANGING).zip(graph.edges()).enumerate() {
            let terms = &system.joints[k];
            let q_a = system.bodies[system.topology.joints[k][0] as usize].orientation;
            let [stretch_unit, bend_unit] = self.multiplier_units(k, inverse);
            let rows = edge.length * edge.length * self.moving.sqrt() * inverse;
            let particular = terms.multipliers_from_world(self.particular.world[k], q_a);
            let [x, y, z] = particular.angular.0;
            let compliance = [terms.bend, terms.bend, terms.bend + terms.twist_extra];
            let left = terms.rhs.angular - Vec3([x * compliance[0], y * compliance[1], z * compliance[2]]);
            let ([a, b, c], [d, e, f]) = ((terms.rhs.angular * rows).0, (left * rows).0);
            put(&mut self.squashed[6 * k..], [a, b, c, d, e, f]);
            put(row, q_a.rotate_back(terms.rhs.linear * inverse).0);
            put(&mut row[6..], q_a.rotate_back(particular.linear * stretch_unit).0);
            put(&mut row[9..], (particular.angular * bend_unit).0);
            put(&mut row[15..], q_a.rotate_back(terms.t).0);
        }
        // In one go, many in a register.
        for x in &mut self.squashed {
            *x = asinh(*x);
        }
        for (row, squashed) in edges.chunks_exact_mut(EDGE_CHANGING).zip(self.squashed.chunks_exact(6)) {
            row[3..6].copy_from_slice(&squashed[..3]);
            row[12..15].copy_from_slice(&squashed[3..]);
        }
    }

    /// 1 / (m n s) and 1 / (m n s l^2) of an edge, for `inverse` = 1 / s.
    #[inline(always)]
    pub(crate) fn multiplier_units(&self, edge: usize, inverse: f64) -> [f64; 2] {
        self.units[edge].map(|unit| unit * inverse)
    }

    /// Fills the targets of the nodes for the corrections `dp`, at the scale s of the inputs. `[nodes, 6]`
    pub fn fill_node_targets(
        &self,
        graph: &Graph,
        component: &Component<f64>,
        scale: f64,
        dp: &[Spatial<f64>],
        targets: &mut [f32],
    ) {
        let inverse = if scale > 0.0 { 1.0 / scale } else { 0.0 };
        for (i, (row, dp)) in targets.chunks_exact_mut(NODE_TARGET).zip(dp).enumerate() {
            let (q, [_, length]) = (component.poses[i].q, graph.nodes()[i].rod_scale);
            put(row, q.rotate_back(dp.linear * inverse).0);
            put(&mut row[3..], q.rotate_back(dp.angular * (inverse * length)).0);
        }
    }

    /// Fills the targets of the edges for the multipliers `dlambda`, at the scale s of the inputs. `[edges, 6]`
    pub fn fill_edge_targets(
        &self,
        graph: &Graph,
        component: &Component<f64>,
        scale: f64,
        dlambda: &[Spatial<f64>],
        targets: &mut [f32],
    ) {
        let inverse = if scale > 0.0 { 1.0 / scale } else { 0.0 };
        for (k, (row, dlambda)) in targets.chunks_exact_mut(EDGE_TARGET).zip(dlambda).enumerate() {
            let q_a = component.poses[graph.senders()[k] as usize].q;
            let [stretch, bend] = self.multiplier_units(k, inverse);
            put(row, q_a.rotate_back(dlambda.linear * stretch).0);
            put(&mut row[3..], (dlambda.angular * bend).0);
        }
    }

    /// The multipliers that outputs of the edges `[edges, 6]` stand for, at the scale s of the inputs.
    pub fn dlambda(
        &self,
        graph: &Graph,
        component: &Component<f64>,
        scale: f64,
        outputs: &[f32],
        dlambda: &mut [Spatial<f64>],
    ) {
        for (k, (row, dlambda)) in outputs.chunks_exact(EDGE_TARGET).zip(dlambda).enumerate() {
            let q_a = component.poses[graph.senders()[k] as usize].q;
            let [stretch, bend] = self.multiplier_units(k, 1.0);
            let value = |k: usize| f64::from(row[k]) * scale;
            dlambda.linear = q_a.rotate(Vec3([0, 1, 2].map(value)) * (1.0 / stretch));
            dlambda.angular = Vec3([3, 4, 5].map(value)) * (1.0 / bend);
        }
    }

    /// Gradients of a number with respect to outputs of the edges `[edges, 6]`, from its `gradient` with respect to the
    /// multipliers that [`Self::dlambda`] makes of them.
    pub fn dlambda_adjoint(
        &self,
        graph: &Graph,
        component: &Component<f64>,
        scale: f64,
        gradient: &[Spatial<f64>],
        outputs: &mut [f32],
    ) {
        for (k, (row, gradient)) in outputs.chunks_exact_mut(EDGE_TARGET).zip(gradient).enumerate() {
            let q_a = component.poses[graph.senders()[k] as usize].q;
            let [stretch, bend] = self.multiplier_units(k, 1.0);
            put(row, q_a.rotate_back(gradient.linear * (scale / stretch)).0);
            put(&mut row[3..], (gradient.angular * (scale / bend)).0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inverse_hyperbolic_sine_is_near_enough() {
        for k in -600..600 {
            let exact = 0.05 * f64::from(k);
            let apart = f64::from(asinh(exact.sinh() as f32)) - exact;
            assert!(apart.abs() < 1e-6 * exact.abs().max(1.0), "{exact} {apart}");
        }
        assert_eq!(asinh(0.0), 0.0);
        assert!(asinh(f32::MAX).is_finite());
    }
}

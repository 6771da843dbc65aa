//! The paper's features and targets (section 3.1), in world axes and SI units.
//!
//! Nodes `(x, q, r, rho, l, alpha, f0, f1, f2)`, edges `(omega, Y, T)`, targets `(dx, dphi)` and `dlambda`. What the
//! paper leaves open:
//!
//! - *q* is written x, y, z, w. Its sign is the solver's, which follows the motion without a jump.
//! - *f1, f2*: "zero if the left or right segment of the rod is fixed" is read as the neighbour on that side (an anchor
//!   of the ground included): the rod's own ends, the other reading, would be the same for all of a training set.
//! - *alpha* runs along each rod of a tree ([`crate::Node::alpha`]).
//! - *Y and T* are normalised to their logarithm over the range of Table 1 ([`normalized_modulus`]); the other inputs
//!   are in SI units here, and brought to unit size with a training set's means and spreads ([`crate::Whitening`]) before
//!   a network reads them: "the generated dataset is normalized" is read so.
//! - *Norms*: one for each of dx, dphi and the two parts of dlambda, for their units differ; the largest magnitude of any
//!   component over the training samples, so that every target lies in [-1, 1].
//! - *Direction*: one edge a joint, from its body a to its body b.

use component::BodyPose;
use kernels::Spatial;
use serde::{Deserialize, Serialize};

use crate::{Graph, put};

/// Inputs a node.
pub const NODE: usize = 14;
/// How many of them, from the first, change from solve to solve: x and q.
pub const NODE_CHANGING: usize = 7;
/// How many stay the same over a scene.
pub const NODE_CONSTANT: usize = NODE - NODE_CHANGING;
/// Inputs an edge, all constant over a scene.
pub const EDGE: usize = 5;
/// Outputs a node: dx, dphi.
pub const NODE_TARGET: usize = 6;
/// Outputs an edge: dlambda of stretch-shear, of bend-twist.
pub const EDGE_TARGET: usize = 6;
/// Range of both moduli in Table 1 [Pa].
pub const MODULUS_RANGE_PA: [f64; 2] = [1e4, 1e6];

/// Logarithm of a modulus [Pa], scaled so that the ends of [`MODULUS_RANGE_PA`] give -1 and 1; it goes on beyond them.
pub fn normalized_modulus(modulus: f64) -> f64 {
    let [low, high] = MODULUS_RANGE_PA.map(f64::ln);
    2.0 * (modulus.ln() - low) / (high - low) - 1.0
}

/// Fills what stays the same of the nodes, the last 7 columns of `nodes`. `[nodes, 14]`, or `[nodes, 7]`
pub fn fill_constant_nodes(graph: &Graph, nodes: &mut [f32]) {
    let columns = (nodes.len() / graph.nodes().len().max(1)).max(NODE_CONSTANT);
    for (row, node) in nodes.chunks_exact_mut(columns).zip(graph.nodes()) {
        let [f0, f1, f2] = node.free.map(|free| f64::from(u8::from(free)));
        put(&mut row[columns - NODE_CONSTANT..], [node.radius, node.density, node.length, node.alpha, f0, f1, f2]);
    }
}

/// Fills what changes of the nodes, columns 0 to 6 of `nodes`, from the poses, one a node. `[nodes, 7]`, or more columns
pub fn fill_changing_nodes(poses: &[BodyPose<f64>], nodes: &mut [f32]) {
    let columns = (nodes.len() / poses.len().max(1)).max(NODE_CHANGING);
    for (row, pose) in nodes.chunks_exact_mut(columns).zip(poses) {
        let ([x, y, z], [i, j, k]) = (pose.x.0, pose.q.v.0);
        put(row, [x, y, z, i, j, k, pose.q.w]);
    }
}

/// Fills the edges, which stay the same over a scene. `[edges, 5]`
pub fn fill_edges(graph: &Graph, edges: &mut [f32]) {
    for (row, edge) in edges.chunks_exact_mut(EDGE).zip(graph.edges()) {
        let [x, y, z] = edge.rest_darboux;
        put(row, [x, y, z, normalized_modulus(edge.youngs_modulus), normalized_modulus(edge.torsion_modulus)]);
    }
}

/// The recorded norms: what outputs in [-1, 1] are multiplied with.
/// In files, their units are in their names.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Norms {
    /// Of dx [m].
    #[serde(rename = "dx_m")]
    pub dx: f64,
    /// Of dphi [rad].
    #[serde(rename = "dphi_rad")]
    pub dphi: f64,
    /// Of dlambda's stretch-shear part [N s^2].
    #[serde(rename = "dlambda_stretch_n_s2")]
    pub dlambda_stretch: f64,
    /// Of dlambda's bend-twist part [N m^2 s^2].
    #[serde(rename = "dlambda_bend_n_m2_s2")]
    pub dlambda_bend: f64,
}

impl Norms {
    /// Widens the norms to hold these corrections; numbers that are not finite are left out.
    pub fn include(&mut self, dp: &[Spatial<f64>], dlambda: &[Spatial<f64>]) {
        let largest =
            |norm: f64, part: [f64; 3]| part.iter().map(|x| x.abs()).filter(|x| x.is_finite()).fold(norm, f64::max);
        for dp in dp {
            self.dx = largest(self.dx, dp.linear.0);
            self.dphi = largest(self.dphi, dp.angular.0);
        }
        for dlambda in dlambda {
            self.dlambda_stretch = largest(self.dlambda_stretch, dlambda.linear.0);
            self.dlambda_bend = largest(self.dlambda_bend, dlambda.angular.0);
        }
    }

    /// The larger of two, norm by norm.
    pub fn union(self, other: Self) -> Self {
        Self {
            dx: self.dx.max(other.dx),
            dphi: self.dphi.max(other.dphi),
            dlambda_stretch: self.dlambda_stretch.max(other.dlambda_stretch),
            dlambda_bend: self.dlambda_bend.max(other.dlambda_bend),
        }
    }

    /// Fills the targets of the nodes, `dp` over the norms. `[nodes, 6]`
    pub fn fill_node_targets(&self, dp: &[Spatial<f64>], targets: &mut [f32]) {
        fill_scaled([self.dx, self.dphi], dp, targets);
    }

    /// Fills the targets of the edges, `dlambda` over the norms. `[edges, 6]`
    pub fn fill_edge_targets(&self, dlambda: &[Spatial<f64>], targets: &mut [f32]) {
        fill_scaled([self.dlambda_stretch, self.dlambda_bend], dlambda, targets);
    }

    /// The multipliers that outputs of the edges `[edges, 6]` stand for.
    pub fn dlambda(&self, outputs: &[f32], dlambda: &mut [Spatial<f64>]) {
        read_scaled([self.dlambda_stretch, self.dlambda_bend], outputs, dlambda);
    }

    /// Gradients of a number with respect to outputs of the edges `[edges, 6]`, from those with respect to the
    /// multipliers that [`Self::dlambda`] makes of them.
    pub fn dlambda_adjoint(&self, gradient: &[Spatial<f64>], outputs: &mut [f32]) {
        for (row, gradient) in outputs.chunks_exact_mut(6).zip(gradient) {
            put(row, (gradient.linear * self.dlambda_stretch).0);
            put(&mut row[3..], (gradient.angular * self.dlambda_bend).0);
        }
    }

    /// The corrections that outputs of the nodes `[nodes, 6]` stand for.
    pub fn dp(&self, outputs: &[f32], dp: &mut [Spatial<f64>]) {
        read_scaled([self.dx, self.dphi], outputs, dp);
    }
}

fn fill_scaled(norms: [f64; 2], values: &[Spatial<f64>], targets: &mut [f32]) {
    let [first, second] = norms.map(|norm| if norm > 0.0 { 1.0 / norm } else { 0.0 });
    for (row, value) in targets.chunks_exact_mut(6).zip(values) {
        let [a, b, c, d, e, f] = value.to_array();
        put(row, [a * first, b * first, c * first, d * second, e * second, f * second]);
    }
}

fn read_scaled([first, second]: [f64; 2], outputs: &[f32], values: &mut [Spatial<f64>]) {
    for (row, value) in outputs.chunks_exact(6).zip(values) {
        let scaled = |k: usize| f64::from(row[k]) * if k < 3 { first } else { second };
        *value = Spatial::from_array(std::array::from_fn(scaled));
    }
}

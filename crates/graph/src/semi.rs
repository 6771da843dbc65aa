//! Multipliers from the turns of the segments ("semi"): what a network cannot know from nearby is not left to it.
//!
//! With the turns dphi given, the stretch-shear rows of the linear system, their tiny compliance neglected, say where the
//! segments go, and where they go says which forces the joints carry; the bend-twist rows say which moments:
//!
//! ```text
//! dx_a + z_a dphi_a x d_a - dx_b - z_b dphi_b x d_b = b_stretch      outwards along the visits, dx = 0 where fixed
//! force on a node through the joint towards the clamp = sum of m dx over it and all nodes beyond       inwards again
//! dlambda_bend = alpha~^-1 (b_bend - G (dphi_b - dphi_a)) + what the network adds
//! ```
//!
//! The exact solution's turns need nothing added. Moments are not taken from the forces (statics), because forces sum up
//! the turns' errors, which the bend-twist rows keep local: conjugate gradients remove local errors first. Of a set
//! without a fixed body the mean shift is taken out, because no force acts on it from outside. Edges that close a loop, or
//! a way between two fixed bodies, carry no force: what else they carry, statics does not say.
//!
//! Inputs here are outputs of a network: dphi in the node's own frame, in s / l, and what it adds to bend-twist
//! multipliers in the sender's frame, in m n s l^2, as in [`crate::body_frame`]. The map is affine: [`Semi::adjoint`]
//! takes gradients back through it.

use component::Component;
use jointed::system::System;
use kernels::Spatial;
use kernels::math::Vec3;

use crate::body_frame::Features;
use crate::particular::{mass, take_out_mean};
use crate::{Channel, Graph, put};

/// Outputs a node: dphi in its own frame.
pub const NODE_OUTPUT: usize = 3;
/// Outputs an edge: what is added to the bend-twist multipliers, in the sender's frame.
pub const EDGE_OUTPUT: usize = 3;
/// Least compliance of bending and of twist that moments are derived with, alpha~ m l^4 in the scale of the edge's rod.
const LEAST_COMPLIANCE: f64 = 1e-12;

/// Kinds of the outputs of a node.
pub const NODE_OUTPUT_CHANNELS: [Channel; NODE_OUTPUT] = Channel::AXIAL;
/// Kinds of the outputs of an edge.
pub const EDGE_OUTPUT_CHANNELS: [Channel; EDGE_OUTPUT] = Channel::AXIAL;

/// The head of one graph: its memory. Calls allocate nothing.
#[derive(Clone, Debug)]
pub struct Semi {
    /// Turns dphi in world axes, one a node [rad], or the gradient with respect to them.
    turns: Vec<Vec3<f64>>,
    /// Shifts dx, one a node [m], then forces; or the gradients with respect to them.
    shifts: Vec<Vec3<f64>>,
    /// Whether nothing holds the set.
    is_free: bool,
}

/// +1 for an edge's sender, -1 for its receiver.
fn sign(is_sender: bool) -> f64 {
    if is_sender { 1.0 } else { -1.0 }
}

fn vec3(row: &[f32]) -> Vec3<f64> {
    Vec3([0, 1, 2].map(|k: usize| f64::from(row[k])))
}

impl Semi {
    /// Memory for a graph.
    pub fn new(graph: &Graph) -> Self {
        let zero = vec![Vec3::zero(); graph.nodes().len()];
        Self { turns: zero.clone(), shifts: zero, is_free: graph.is_free() }
    }

    /// The multipliers that outputs of the nodes `[nodes, 3]` and of the edges `[edges, 3]` stand for, one entry an edge,
    /// at the scale s [m] that `features` returned for the component's system.
    #[expect(clippy::too_many_arguments, reason = "what it reads, then what it writes")]
    pub fn dlambda(
        &mut self,
        graph: &Graph,
        component: &Component<f64>,
        features: &Features,
        scale: f64,
        node_outputs: &[f32],
        edge_outputs: &[f32],
        dlambda: &mut [Spatial<f64>],
    ) {
        for (i, (turn, row)) in self.turns.iter_mut().zip(node_outputs.chunks_exact(NODE_OUTPUT)).enumerate() {
            *turn = component.poses[i].q.rotate(vec3(row)) * turn_unit(graph, i, scale);
        }
        for (k, row) in edge_outputs.chunks_exact(EDGE_OUTPUT).enumerate() {
            let [_, unit] = features.multiplier_units(k, 1.0);
            dlambda[k] = Spatial { linear: Vec3::zero(), angular: vec3(row) * (scale / unit) };
        }
        self.add_derived(graph, &component.system, dlambda);
    }

    /// The gradients of a number with respect to the outputs, `[nodes, 3]` and `[edges, 3]`, from its `gradient` with
    /// respect to the multipliers, one entry an edge.
    #[expect(clippy::too_many_arguments, reason = "what it reads, then what it writes")]
    pub fn adjoint(
        &mut self,
        graph: &Graph,
        component: &Component<f64>,
        features: &Features,
        scale: f64,
        gradient: &[Spatial<f64>],
        node_gradient: &mut [f32],
        edge_gradient: &mut [f32],
    ) {
        self.derived_adjoint(graph, &component.system, gradient);
        for (i, (turn, row)) in self.turns.iter().zip(node_gradient.chunks_exact_mut(NODE_OUTPUT)).enumerate() {
            put(row, component.poses[i].q.rotate_back(*turn * turn_unit(graph, i, scale)).0);
        }
        for (k, row) in edge_gradient.chunks_exact_mut(EDGE_OUTPUT).enumerate() {
            let [_, unit] = features.multiplier_units(k, 1.0);
            put(row, (gradient[k].angular * (scale / unit)).0);
        }
    }

    /// Adds to `dlambda` what follows from `turns`.
    fn add_derived(&mut self, graph: &Graph, system: &System<f64>, dlambda: &mut [Spatial<f64>]) {
        let Self { turns, shifts, is_free } = self;
        shifts.fill(Vec3::zero());
        for visit in graph.visits() {
            let (node, parent, edge) = (visit.node as usize, visit.parent as usize, visit.edge as usize);
            let [own, other] = visit.of_node(system.joints[edge].offsets);
            shifts[node] = shifts[parent] + turns[parent].cross(system.bodies[parent].axis) * other
                - turns[node].cross(system.bodies[node].axis) * own
                + system.joints[edge].rhs.linear * sign(visit.is_sender);
        }
        if *is_free {
            take_out_mean(system, shifts);
        }
        for (node, shift) in shifts.iter_mut().enumerate() {
            *shift = *shift * mass(system, node);
        }
        for visit in graph.visits().iter().rev() {
            let force = shifts[visit.node as usize];
            dlambda[visit.edge as usize].linear += force * sign(visit.is_sender);
            shifts[visit.parent as usize] += force;
        }
        for (k, (dlambda, terms)) in dlambda.iter_mut().zip(&system.joints).enumerate() {
            let [a, b] = system.topology.joints[k].map(|body| body as usize);
            let turn = Spatial { linear: Vec3::zero(), angular: turns[b] - turns[a] };
            let left = terms.rhs.angular - terms.from_world(turn, system.bodies[a].orientation).angular;
            dlambda.angular += scaled(left, stiffness(graph, system, k));
        }
    }

    /// The adjoint of [`Self::add_derived`]: from `gradient` to `turns`.
    fn derived_adjoint(&mut self, graph: &Graph, system: &System<f64>, gradient: &[Spatial<f64>]) {
        let Self { turns, shifts, is_free } = self;
        turns.fill(Vec3::zero());
        shifts.fill(Vec3::zero());
        for visit in graph.visits() {
            let own = gradient[visit.edge as usize].linear * sign(visit.is_sender);
            shifts[visit.node as usize] = shifts[visit.parent as usize] + own;
        }
        // Of (1 - 1 m^T / sum m), then m, the adjoint is m, then (1 - m 1^T / sum m): m (1 - 1 m^T / sum m) again.
        if *is_free {
            take_out_mean(system, shifts);
        }
        for (node, shift) in shifts.iter_mut().enumerate() {
            *shift = *shift * mass(system, node);
        }
        for visit in graph.visits().iter().rev() {
            let (node, parent, edge) = (visit.node as usize, visit.parent as usize, visit.edge as usize);
            let [own, other] = visit.of_node(system.joints[edge].offsets);
            let shift = shifts[node];
            shifts[parent] += shift;
            turns[parent] += system.bodies[parent].axis.cross(shift) * other;
            turns[node] -= system.bodies[node].axis.cross(shift) * own;
        }
        for (k, (gradient, terms)) in gradient.iter().zip(&system.joints).enumerate() {
            let [a, b] = system.topology.joints[k].map(|body| body as usize);
            let moment =
                Spatial { linear: Vec3::zero(), angular: scaled(gradient.angular, stiffness(graph, system, k)) };
            let turn = terms.multipliers_to_world(moment, system.bodies[a].orientation).angular;
            turns[a] += turn;
            turns[b] -= turn;
        }
    }
}

/// s / l of a node [rad]; 0 where it is fixed.
fn turn_unit(graph: &Graph, node: usize, scale: f64) -> f64 {
    let node = &graph.nodes()[node];
    if node.free[0] { scale / node.rod_scale[1] } else { 0.0 }
}

/// 1 / alpha~ of an edge's bend-twist rows [kg m^4].
fn stiffness(graph: &Graph, system: &System<f64>, edge: usize) -> Vec3<f64> {
    let terms = &system.joints[edge];
    let [mass, length] = graph.nodes()[graph.edges()[edge].outer as usize].rod_scale;
    let least = LEAST_COMPLIANCE / (mass * length.powi(4));
    Vec3([terms.bend, terms.bend, terms.bend + terms.twist_extra].map(|alpha| 1.0 / alpha.max(least)))
}

/// Entry by entry.
fn scaled(x: Vec3<f64>, k: Vec3<f64>) -> Vec3<f64> {
    Vec3([x.0[0] * k.0[0], x.0[1] * k.0[1], x.0[2] * k.0[2]])
}

/// Fills the outputs of the nodes that stand for the corrections `dp` of the exact solution, at the scale s [m] of its
/// inputs; those of the edges are 0. `[nodes, 3]`
pub fn fill_node_targets(
    graph: &Graph,
    component: &Component<f64>,
    scale: f64,
    dp: &[Spatial<f64>],
    targets: &mut [f32],
) {
    let inverse = if scale > 0.0 { 1.0 / scale } else { 0.0 };
    for (i, (row, dp)) in targets.chunks_exact_mut(NODE_OUTPUT).zip(dp).enumerate() {
        let unit = graph.nodes()[i].rod_scale[1] * inverse;
        put(row, component.poses[i].q.rotate_back(dp.angular * unit).0);
    }
}

#[cfg(test)]
mod tests {
    use component::split;
    use nalgebra::Vector3;
    use rod::{Assembly, Material, RodSpec, shape};

    use super::*;

    #[test]
    fn the_walks_are_each_others_transpose() {
        for is_held in [true, false] {
            let material = Material { youngs_modulus: 1e5, torsion_modulus: 3e4, density: 300.0 };
            let mut assembly = Assembly::new(Vector3::zeros());
            let trunk = assembly.rod(&RodSpec::new(shape::helix(Vector3::zeros(), 0.3, 0.5, 1.0, 9), 0.03, material));
            let tip = assembly.state_mut().positions[trunk.start + 4];
            let branch = assembly.rod(&RodSpec::new(shape::straight(tip, Vector3::y(), 0.4, 3), 0.02, material));
            assembly.branch(trunk.start + 4, 0.5, &branch);
            if is_held {
                assembly.clamp_start(&trunk);
            }
            let (model, state) = assembly.finish();
            let (members, topology) = split(&model).swap_remove(0);
            let graph = Graph::new(&model, &members, &topology);
            let mut component = Component::<f64>::new(&model, &state, topology.into(), &[&members]);
            component.predict(0.0, 0.02, dynamics::formulation::Formulation::Xpbd);
            component.evaluate(dynamics::formulation::Formulation::Xpbd);
            // The linear part alone.
            component.system.joints.iter_mut().for_each(|joint| joint.rhs = Spatial::zero());

            let mut semi = Semi::new(&graph);
            let vector = |i: usize, seed: f64| Vec3([0.0, 1.0, 2.0].map(|k| (7.0 * i as f64 + 2.3 * k + seed).sin()));
            let turns: Vec<_> = (0..graph.nodes().len()).map(|i| vector(i, 1.0)).collect();
            let weights: Vec<_> =
                (0..graph.edges().len()).map(|k| Spatial { linear: vector(k, 2.0), angular: vector(k, 3.0) }).collect();
            let mut dlambda = vec![Spatial::zero(); graph.edges().len()];
            semi.turns.clone_from(&turns);
            semi.add_derived(&graph, &component.system, &mut dlambda);
            let forwards: f64 = dlambda.iter().zip(&weights).map(|(x, y)| x.dot(*y)).sum();
            semi.derived_adjoint(&graph, &component.system, &weights);
            let products = || semi.turns.iter().zip(&turns).map(|(x, y)| x.dot(*y));
            let (back, size): (f64, f64) = (products().sum(), products().map(f64::abs).sum());
            assert!((forwards - back).abs() < 1e-13 * size && size > 0.0, "{forwards} {back} of {size}");
        }
    }
}

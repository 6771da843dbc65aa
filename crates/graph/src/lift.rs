//! From orientations to a whole state: positions that close all joints, and the multipliers that go with them. It is for
//! graphs without loops, and without two fixed bodies: a joint that closes a way stays open.
//!
//! A rod that does not stretch is known by the orientations of its segments. Outwards from the clamp, connectors meet:
//! `x = x_parent + z_parent d_parent - z d`. Inwards, the joint on the way to a node carries the sum of `m (x - x*)` over
//! it and all nodes beyond, and the bend-twist rows with zero residual say `alpha~ lambda_b = -C_b`. Of a set without a
//! fixed body, the mass centre stays where the prediction has it.

use component::{BodyPose, Component};
use kernels::Spatial;
use kernels::dispatch::vectorized;
use kernels::math::Vec3;

use crate::Graph;
use crate::particular::{mass, take_out_mean};

/// Makes positions and multipliers of orientations: its memory. Calls allocate nothing.
#[derive(Clone, Debug)]
pub struct Lift {
    /// Shifts x - x* [m], then forces.
    shifts: Vec<Vec3<f64>>,
    is_free: bool,
}

impl Lift {
    /// Memory for a graph.
    pub fn new(graph: &Graph) -> Self {
        Self { shifts: vec![Vec3::zero(); graph.nodes().len()], is_free: graph.is_free() }
    }

    /// Replaces the positions of `poses` and all of `lambda` by what goes with the orientations of `poses`, one entry a
    /// node and one an edge. The component's poses are the prediction p*, and its system is evaluated there.
    pub fn fill(
        &mut self,
        graph: &Graph,
        component: &Component<f64>,
        poses: &mut [BodyPose<f64>],
        lambda: &mut [Spatial<f64>],
    ) {
        vectorized(
            #[inline(always)]
            || self.fill_all(graph, component, poses, lambda),
        );
    }

    #[inline(always)]
    fn fill_all(
        &mut self,
        graph: &Graph,
        component: &Component<f64>,
        poses: &mut [BodyPose<f64>],
        lambda: &mut [Spatial<f64>],
    ) {
        let Self { shifts, is_free } = self;
        for visit in graph.visits() {
            let (node, parent) = (visit.node as usize, visit.parent as usize);
            let [own, other] = visit.of_node(graph.edges()[visit.edge as usize].offsets);
            poses[node].x = poses[parent].x + poses[parent].q.axis() * other - poses[node].q.axis() * own;
        }
        for ((shift, pose), predicted) in shifts.iter_mut().zip(poses.iter()).zip(&component.poses) {
            *shift = pose.x - predicted.x;
        }
        if *is_free {
            take_out_mean(&component.system, shifts);
            for ((shift, pose), predicted) in shifts.iter().zip(poses.iter_mut()).zip(&component.poses) {
                pose.x = predicted.x + *shift;
            }
        }
        for (node, shift) in shifts.iter_mut().enumerate() {
            *shift = *shift * mass(&component.system, node);
        }
        lambda.fill(Spatial::zero());
        let dt = component.dt();
        for visit in graph.visits().iter().rev() {
            let (node, parent, k) = (visit.node as usize, visit.parent as usize, visit.edge as usize);
            let force = shifts[node];
            shifts[parent] += force;
            let edge = &graph.edges()[k];
            let (q_a, q_b) = (poses[graph.senders()[k] as usize].q, poses[graph.receivers()[k] as usize].q);
            let [x, y, z] = edge.rest_darboux;
            let strain = (q_a.conj() * q_b).upper().v * (2.0 / edge.length) - Vec3([x, y, z]);
            let [bend, twist] = edge.bend_compliance.map(|alpha| if alpha > 0.0 { -dt * dt / alpha } else { 0.0 });
            let [x, y, z] = strain.0;
            let sign = if visit.is_sender { 1.0 } else { -1.0 };
            lambda[k] = Spatial { linear: force * sign, angular: Vec3([x * bend, y * bend, z * twist]) };
        }
    }
}

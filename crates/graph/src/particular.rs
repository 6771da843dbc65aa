//! A particular solution that costs one walk out and one walk back: translations that close the gaps, and the forces
//! and moments that move the segments so.
//!
//! With dphi = 0 the stretch-shear rows of a joint read `dx_a - dx_b = b_s`, so that outwards from the clamp
//! `xp = xp_parent -/+ b_s`. Inwards again, J^T lambda = M (xp, 0) gives each joint on the way the force that all
//! segments beyond it need together, and the moment that keeps them from turning. Of a set without a fixed body the mean
//! shift is taken out, because no force acts on it from outside. Edges that close a loop carry nothing.

use component::Component;
use jointed::system::System;
use kernels::Spatial;
use kernels::math::Vec3;

use crate::Graph;

/// Memory for the particular solution of one graph, and the solution.
#[derive(Clone, Debug)]
pub(crate) struct Particular {
    /// Translations xp, one a node [m].
    pub(crate) shift: Vec<Vec3<f64>>,
    /// Multipliers in world rows: a force [kg m] and a torque [kg m^2] an edge.
    pub(crate) world: Vec<Spatial<f64>>,
    /// What a node's joint towards the clamp has to carry.
    need: Vec<Spatial<f64>>,
}

impl Particular {
    pub(crate) fn new(graph: &Graph) -> Self {
        let (nodes, edges) = (graph.nodes().len(), graph.edges().len());
        Self {
            shift: vec![Vec3::zero(); nodes],
            world: vec![Spatial::zero(); edges],
            need: vec![Spatial::zero(); nodes],
        }
    }

    /// Solves for the right-hand side of the component's system.
    #[inline(always)]
    pub(crate) fn solve(&mut self, graph: &Graph, component: &Component<f64>) {
        let Self { shift, world, need } = self;
        let system = &component.system;
        let sign = |is_sender: bool| if is_sender { 1.0 } else { -1.0 };
        shift.fill(Vec3::zero());
        world.fill(Spatial::zero());
        for visit in graph.visits() {
            let gap = system.joints[visit.edge as usize].rhs.linear * sign(visit.is_sender);
            shift[visit.node as usize] = shift[visit.parent as usize] + gap;
        }
        if graph.is_free() {
            take_out_mean(system, shift);
        }
        for (node, (need, &shift)) in need.iter_mut().zip(shift.iter()).enumerate() {
            *need = Spatial { linear: shift * mass(system, node), angular: Vec3::zero() };
        }
        for visit in graph.visits().iter().rev() {
            let (node, parent, edge) = (visit.node as usize, visit.parent as usize, visit.edge as usize);
            let [own, other] = visit.of_node(system.joints[edge].offsets);
            // On the sender acts +f at its connector and -torque; on the receiver the opposite.
            let force = need[node].linear;
            let moment = need[node].angular + system.bodies[node].axis.cross(force) * own;
            world[edge] = Spatial { linear: force * sign(visit.is_sender), angular: moment * sign(visit.is_sender) };
            need[parent].linear += force;
            need[parent].angular += moment - system.bodies[parent].axis.cross(force) * other;
        }
    }
}

/// Mass of a node in the linear system [kg], 0 where it is fixed. In air it is more than the segment's own.
#[inline(always)]
pub(crate) fn mass(system: &System<f64>, node: usize) -> f64 {
    let inverse = system.bodies[node].inverse_mass;
    if inverse > 0.0 { 1.0 / inverse } else { 0.0 }
}

/// Takes the mean, weighted by mass, out of shifts, one a node, of a set without a fixed body.
pub(crate) fn take_out_mean(system: &System<f64>, shift: &mut [Vec3<f64>]) {
    let (mut sum, mut all) = (Vec3::zero(), 0.0);
    for (node, &shift) in shift.iter().enumerate() {
        let mass = mass(system, node);
        sum += shift * mass;
        all += mass;
    }
    let mean = sum * (1.0 / all);
    shift.iter_mut().for_each(|shift| *shift -= mean);
}

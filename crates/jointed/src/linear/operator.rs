//! The matrix `A = J M^-1 J^T + alpha~` as a product, in the original rows and SI units: stretch-shear in world axes [m],
//! bend-twist in the frame of body a [1/m]. Nothing is multiplied out, so that it works on any graph, loops included.

use crate::block::Block;
use crate::linear::dual::joint_diagonal;
use crate::system::System;
use crate::topology::Topology;
use kernels::Spatial;
use kernels::math::{Sym3, Vec3, transposed};

/// What a product needs of a joint.
#[derive(Clone, Copy, Debug)]
struct JointRows {
    /// Connectors' arms z d of bodies a and b [m].
    arms: [Vec3<f64>; 2],
    /// G, from a world rotation vector to bend-twist [1/m].
    g: [[f64; 3]; 3],
    /// d3 of body a, and alpha~ of stretch-shear across it and what is added along it.
    axis: Vec3<f64>,
    shear: f64,
    stretch_extra: f64,
    /// alpha~ of bend-twist, a diagonal.
    bend: Vec3<f64>,
}

/// What a product needs of a body: M^-1.
#[derive(Clone, Copy, Debug)]
struct Mobility {
    inverse_mass: f64,
    inverse_inertia: Sym3<f64>,
}

/// `A` of one system, ready for products.
#[derive(Clone, Debug)]
pub struct Operator {
    joints: Vec<JointRows>,
    bodies: Vec<Mobility>,
    /// Per joint: d2 of body a, and what alpha~ has along it beyond that along d1; empty where no joint has it.
    second_shear: Vec<(Vec3<f64>, f64)>,
    /// Per joint: what alpha~ of bend-twist has beside its diagonal; empty where all are diagonal.
    couplings: Vec<Vec3<f64>>,
    /// Per body: impulses, then corrections.
    scratch: Vec<Spatial<f64>>,
}

/// Matrix times vector.
#[inline(always)]
fn times(m: &[[f64; 3]; 3], x: Vec3<f64>) -> Vec3<f64> {
    Vec3([Vec3(m[0]).dot(x), Vec3(m[1]).dot(x), Vec3(m[2]).dot(x)])
}

/// Transposed matrix times vector.
#[inline(always)]
fn times_transposed(m: &[[f64; 3]; 3], x: Vec3<f64>) -> Vec3<f64> {
    Vec3(m[0]) * x.0[0] + Vec3(m[1]) * x.0[1] + Vec3(m[2]) * x.0[2]
}

/// Entry by entry.
#[inline(always)]
fn scaled_by(x: Vec3<f64>, k: Vec3<f64>) -> Vec3<f64> {
    Vec3([x.0[0] * k.0[0], x.0[1] * k.0[1], x.0[2] * k.0[2]])
}

/// A symmetric matrix without a diagonal, of these entries (12), (13) and (23), times a vector.
#[inline(always)]
fn coupled(Vec3([of_12, of_13, of_23]): Vec3<f64>, Vec3([x, y, z]): Vec3<f64>) -> Vec3<f64> {
    Vec3([of_12 * y + of_13 * z, of_12 * x + of_23 * z, of_13 * x + of_23 * y])
}

impl Operator {
    /// Memory for systems of this connectivity.
    pub fn new(topology: &Topology) -> Self {
        let zero = Vec3::zero();
        let joint =
            JointRows { arms: [zero; 2], g: [[0.0; 3]; 3], axis: zero, shear: 0.0, stretch_extra: 0.0, bend: zero };
        let body = Mobility { inverse_mass: 0.0, inverse_inertia: Sym3::zero() };
        Self {
            joints: vec![joint; topology.joints.len()],
            bodies: vec![body; topology.bodies()],
            second_shear: Vec::new(),
            couplings: Vec::new(),
            scratch: vec![Spatial::zero(); topology.bodies()],
        }
    }

    /// Takes over a system's matrix.
    #[inline(always)]
    pub fn prepare(&mut self, system: &System<f64>) {
        for (own, body) in self.bodies.iter_mut().zip(&system.bodies) {
            *own = Mobility { inverse_mass: body.inverse_mass, inverse_inertia: body.inverse_inertia };
        }
        let joints = self.joints.iter_mut().zip(&system.joints).zip(&system.topology.joints);
        for (k, ((own, terms), &[a, b])) in joints.enumerate() {
            let frame = system.frame(k);
            let (first, second) = (&system.bodies[a as usize], &system.bodies[b as usize]);
            // The columns of G are the images of the world axes.
            let column = |e: Vec3<f64>| frame.rotate_back(terms.rows.forward(terms.t, e)).0.map(|x| x / terms.length);
            let columns = [column(Vec3([1.0, 0.0, 0.0])), column(Vec3([0.0, 1.0, 0.0])), column(Vec3([0.0, 0.0, 1.0]))];
            let mut arms = [first.axis * terms.offsets[0], second.axis * terms.offsets[1]];
            if let Some([at_a, at_b]) = system.across.get(k) {
                arms = [arms[0] + *at_a, arms[1] + *at_b];
            }
            *own = JointRows {
                arms,
                g: transposed(columns),
                axis: first.axis,
                shear: terms.shear,
                stretch_extra: terms.stretch_extra,
                bend: system.bend_twist_compliance(k),
            };
        }
        self.second_shear.clear();
        self.second_shear.extend((0..system.shear_extra.len()).filter_map(|k| system.second_shear(k)));
        self.couplings.clone_from(&system.bend_couplings);
    }

    /// `out = A x`; returns `x^T A x`. One entry a joint.
    #[inline(always)]
    pub fn apply(&mut self, topology: &Topology, x: &[Spatial<f64>], out: &mut [Spatial<f64>]) -> f64 {
        let Self { joints, bodies, second_shear, couplings, scratch } = self;
        scratch.fill(Spatial::zero());
        for ((rows, x), &[a, b]) in joints.iter().zip(x).zip(&topology.joints) {
            let torque = times_transposed(&rows.g, x.angular);
            let on_a = &mut scratch[a as usize];
            on_a.linear += x.linear;
            on_a.angular += rows.arms[0].cross(x.linear) - torque;
            let on_b = &mut scratch[b as usize];
            on_b.linear -= x.linear;
            on_b.angular -= rows.arms[1].cross(x.linear) - torque;
        }
        for (impulse, body) in scratch.iter_mut().zip(bodies.iter()) {
            impulse.linear = impulse.linear * body.inverse_mass;
            impulse.angular = body.inverse_inertia.apply(impulse.angular);
        }
        let mut product = 0.0;
        for (((rows, x), out), &[a, b]) in joints.iter().zip(x).zip(out.iter_mut()).zip(&topology.joints) {
            let (on_a, on_b) = (&scratch[a as usize], &scratch[b as usize]);
            let gap = on_a.linear - on_b.linear + on_a.angular.cross(rows.arms[0]) - on_b.angular.cross(rows.arms[1]);
            let along = rows.axis * (rows.stretch_extra * rows.axis.dot(x.linear));
            *out = Spatial {
                linear: gap + x.linear * rows.shear + along,
                angular: times(&rows.g, on_b.angular - on_a.angular) + scaled_by(x.angular, rows.bend),
            };
            product += x.dot(*out);
        }
        for ((&couplings, x), out) in couplings.iter().zip(x).zip(out.iter_mut()) {
            let coupled = coupled(couplings, x.angular);
            out.angular += coupled;
            product += coupled.dot(x.angular);
        }
        for ((&(d2, extra), x), out) in second_shear.iter().zip(x).zip(out) {
            let along = d2.dot(x.linear);
            out.linear += d2 * (extra * along);
            product += extra * along * along;
        }
        product
    }

    /// D of a joint, the 6x6 block on the diagonal of A.
    #[inline(always)]
    pub(crate) fn diagonal_block(&self, system: &System<f64>, joint: usize) -> Block<f64> {
        let rows = &self.joints[joint];
        let [a, b] = system.topology.joints[joint].map(|body| body as usize);
        let mut block = joint_diagonal(system, joint as u32);
        let w = (self.bodies[a].inverse_inertia + self.bodies[b].inverse_inertia).full();
        for c in 0..3 {
            // The mixed part times G^T; G (W_a + W_b) G^T + alpha~ in place of the world rows' own.
            let g_c = Vec3(rows.g[c]);
            let turned = times(&w, g_c);
            let mixed = [0, 1, 2].map(|r| Vec3([block[r][3], block[r][4], block[r][5]]).dot(g_c));
            for r in 0..3 {
                block[3 + c][r] = mixed[r];
                block[3 + c][3 + r] = Vec3(rows.g[r]).dot(turned);
            }
            block[3 + c][3 + c] += rows.bend.0[c];
        }
        if let Some(&Vec3(couplings)) = self.couplings.get(joint) {
            for ([r, c], value) in [[3, 4], [3, 5], [4, 5]].into_iter().zip(couplings) {
                block[r][c] += value;
                block[c][r] += value;
            }
        }
        let mixed = [block[3], block[4], block[5]];
        for (r, row) in block.iter_mut().enumerate().take(3) {
            for (c, column) in mixed.iter().enumerate() {
                row[3 + c] = column[r];
            }
        }
        block
    }

    /// The diagonal of A in a joint's rows.
    #[inline(always)]
    pub fn diagonal(&self, system: &System<f64>, joint: usize) -> Spatial<f64> {
        let block = self.diagonal_block(system, joint);
        let mut out = [0.0; 6];
        for k in 0..6 {
            out[k] = block[k][k];
        }
        Spatial::from_array(out)
    }
}

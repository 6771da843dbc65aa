//! The same outer iteration of a chain, written plainly with nalgebra: 6x6 blocks, block-tridiagonal Cholesky.
//!
//! Formulation `xpbd` without geometric stiffness: it does a little less than what it is compared with.

use nalgebra::{Cholesky, Matrix3, Matrix6, SMatrix, UnitQuaternion, Vector3, Vector6};
use rod::{Body, Joint, Model, State};

type Block = Matrix6<f64>;

/// A chain of segments and the memory for its outer iterations.
pub(crate) struct Rival {
    model: Model,
    pub(crate) state: State,
    inverse_masses: Vec<Block>,
    jacobians: Vec<[Block; 2]>,
    diagonal: Vec<Block>,
    below: Vec<Block>,
    factors: Vec<Cholesky<f64, nalgebra::U6>>,
    rhs: Vec<Vector6<f64>>,
    pub(crate) lambda: Vec<Vector6<f64>>,
    dt: f64,
}

fn set<const R: usize>(block: &mut Block, row: usize, column: usize, part: &SMatrix<f64, R, 3>) {
    block.fixed_view_mut::<R, 3>(row, column).copy_from(part);
}

impl Rival {
    pub(crate) fn new(model: &Model, state: &State, dt: f64) -> Self {
        let (n, joints) = (model.segments.len(), model.joints.len());
        Self {
            model: model.clone(),
            state: state.clone(),
            inverse_masses: vec![Block::zeros(); n],
            jacobians: vec![[Block::zeros(); 2]; joints],
            diagonal: vec![Block::zeros(); joints],
            below: vec![Block::zeros(); joints],
            factors: Vec::with_capacity(joints),
            rhs: vec![Vector6::zeros(); joints],
            lambda: vec![Vector6::zeros(); joints],
            dt,
        }
    }

    fn bodies(joint: &Joint) -> [usize; 2] {
        [joint.a, joint.b].map(|body| if let Body::Segment(i) = body { i } else { unreachable!() })
    }

    /// One outer iteration: constraints, Jacobians, blocks, factor, substitution, update.
    pub(crate) fn iterate(&mut self) {
        self.evaluate();
        self.assemble();
        self.solve();
        self.update();
    }

    fn evaluate(&mut self) {
        for (i, segment) in self.model.segments.iter().enumerate() {
            if !segment.fixed {
                let r = self.state.orientations[i].to_rotation_matrix();
                let (t, a) = (1.0 / segment.transverse_inertia(), 1.0 / segment.axial_inertia());
                let inertia = r.matrix() * Matrix3::from_diagonal(&Vector3::new(t, t, a)) * r.matrix().transpose();
                let block = &mut self.inverse_masses[i];
                set(block, 0, 0, &(Matrix3::identity() / segment.mass()));
                set(block, 3, 3, &inertia);
            }
        }
        for (k, joint) in self.model.joints.iter().enumerate() {
            let [a, b] = Self::bodies(joint);
            let (qa, qb) = (self.state.orientations[a], self.state.orientations[b]);
            let arms = [qa * Vector3::z() * joint.offset_a, qb * Vector3::z() * joint.offset_b];
            let gap = self.state.positions[a] + arms[0] - self.state.positions[b] - arms[1];
            let mut relative = qa.conjugate().into_inner() * qb.into_inner();
            if relative.w < 0.0 {
                relative = -relative;
            }
            let strain = relative.imag() * (2.0 / joint.length) - joint.rest_darboux;
            let g = (Matrix3::identity() * relative.w - relative.imag().cross_matrix()) / joint.length
                * qa.to_rotation_matrix().matrix().transpose();
            for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
                let jacobian = &mut self.jacobians[k][side];
                set(jacobian, 0, 0, &(Matrix3::identity() * sign));
                set(jacobian, 0, 3, &(arms[side].cross_matrix() * -sign));
                set(jacobian, 3, 3, &(g * -sign));
            }
            let lambda = self.lambda[k];
            let stretch = gap + self.stretch_compliance(k) * lambda.fixed_rows::<3>(0);
            let bend = strain + self.bend_compliance(k) * lambda.fixed_rows::<3>(3);
            self.rhs[k].fixed_rows_mut::<3>(0).copy_from(&-stretch);
            self.rhs[k].fixed_rows_mut::<3>(3).copy_from(&-bend);
        }
    }

    fn stretch_compliance(&self, k: usize) -> Matrix3<f64> {
        let joint = &self.model.joints[k];
        let axis = self.state.orientations[Self::bodies(joint)[0]] * Vector3::z();
        let extra = joint.stretch_compliance - joint.shear_compliance;
        (Matrix3::identity() * joint.shear_compliance + axis * axis.transpose() * extra) / (self.dt * self.dt)
    }

    fn bend_compliance(&self, k: usize) -> Matrix3<f64> {
        let joint = &self.model.joints[k];
        let diagonal = Vector3::new(joint.bend_compliance, joint.bend_compliance, joint.twist_compliance);
        Matrix3::from_diagonal(&diagonal) / (self.dt * self.dt)
    }

    fn assemble(&mut self) {
        for (k, joint) in self.model.joints.iter().enumerate() {
            let [a, b] = Self::bodies(joint);
            let [ja, jb] = &self.jacobians[k];
            let weighted = ja * self.inverse_masses[a];
            let mut d = weighted * ja.transpose() + jb * self.inverse_masses[b] * jb.transpose();
            let mut part = d.fixed_view_mut::<3, 3>(0, 0);
            part += self.stretch_compliance(k);
            let mut part = d.fixed_view_mut::<3, 3>(3, 3);
            part += self.bend_compliance(k);
            self.diagonal[k] = d;
            if k > 0 {
                self.below[k] = weighted * self.jacobians[k - 1][1].transpose();
            }
        }
    }

    /// Leaves dlambda in `rhs`.
    fn solve(&mut self) {
        self.factors.clear();
        for k in 0..self.diagonal.len() {
            let mut d = self.diagonal[k];
            if k > 0 {
                let weighted = self.factors[k - 1].solve(&self.below[k].transpose());
                d -= self.below[k] * weighted;
                self.rhs[k] = self.rhs[k] - self.below[k] * self.factors[k - 1].solve(&self.rhs[k - 1]);
            }
            self.factors.push(Cholesky::new(d).expect("the matrix is positive definite"));
        }
        for k in (0..self.rhs.len()).rev() {
            if k + 1 < self.rhs.len() {
                self.rhs[k] = self.rhs[k] - self.below[k + 1].transpose() * self.rhs[k + 1];
            }
            self.rhs[k] = self.factors[k].solve(&self.rhs[k]);
        }
    }

    fn update(&mut self) {
        let mut impulse = Vector6::zeros();
        for i in 0..self.model.segments.len() {
            if i < self.rhs.len() {
                self.lambda[i] += self.rhs[i];
                impulse += self.jacobians[i][0].transpose() * self.rhs[i];
            }
            let correction = self.inverse_masses[i] * impulse;
            self.state.positions[i] += correction.fixed_rows::<3>(0);
            let half = Vector3::from(correction.fixed_rows::<3>(3)) * 0.5;
            let turn = nalgebra::Quaternion::from_parts(1.0, half);
            self.state.orientations[i] = UnitQuaternion::new_normalize(turn * self.state.orientations[i].into_inner());
            if i < self.rhs.len() {
                impulse = self.jacobians[i][1].transpose() * self.rhs[i];
            }
        }
    }
}

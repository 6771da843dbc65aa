//! Rows that hinges leave free, as a border of the equations of an equilibrium.
//!
//! The factor has these rows held by what the joint bends by: beside a compliance without end all else would lose its digits. With
//! e what a turn s of a hinge does in the joints' rows, s is free and transmits nothing:
//!
//! ```text
//! [ A    e ] [ x ]   [ r ]
//! [ e^T  0 ] [ s ] = [ 0 ]      e^T A^-1 e s = e^T A^-1 r,   x = A^-1 (r - e s)
//! ```

use component::Component;
use jointed::tangent::jacobian::{Factor, Field, Jacobian};
use jointed::topology::Topology;
use kernels::Spatial;
use nalgebra::{DMatrix, DVector, Dyn, LU};

/// Hinges of a set.
#[derive(Clone, Debug, Default)]
pub(super) struct Hinges {
    /// Joints, with what their turns do in their rows.
    rows: Vec<(usize, Spatial<f64>)>,
    /// Of `e^T A^-1 e`, and of its transpose.
    factors: Option<[LU<f64, Dyn, Dyn>; 2]>,
}

impl Hinges {
    /// Those of a component at its last evaluation, whose Jacobian with [`Component::hold_hinges`] has been factored; `None`
    /// where a hinge turns without resistance.
    pub(super) fn new(
        component: &Component<f64>,
        topology: &Topology,
        jacobian: &Jacobian,
        factor: &mut Factor,
    ) -> Option<Self> {
        let rows: Vec<_> = component.hinges().map(|joint| (joint, component.free_row(joint))).collect();
        if rows.is_empty() {
            return Some(Self::default());
        }
        let mut out = Self { rows, factors: None };
        let mut schur = DMatrix::zeros(out.rows.len(), out.rows.len());
        let mut answer = Field::zero(topology);
        for (k, (joint, row)) in out.rows.iter().enumerate() {
            answer.clear();
            answer.joints[*joint] = *row;
            factor.solve(jacobian, &mut answer, false);
            schur.set_column(k, &out.taken(&answer));
        }
        let factors = [schur.clone().lu(), schur.transpose().lu()];
        let is_regular = factors[0].u().diagonal().iter().all(|x| x.is_finite() && *x != 0.0);
        out.factors = Some(factors);
        is_regular.then_some(out)
    }

    /// `e^T x`.
    fn taken(&self, x: &Field) -> DVector<f64> {
        DVector::from_iterator(self.rows.len(), self.rows.iter().map(|(joint, row)| row.dot(x.joints[*joint])))
    }

    /// Solves the equations, or the transposed ones, in the place of their right-hand sides.
    pub(super) fn solve(&self, jacobian: &Jacobian, factor: &mut Factor, field: &mut Field, transposed: bool) {
        let Some(factors) = &self.factors else { return factor.solve(jacobian, field, transposed) };
        let mut right = field.clone();
        factor.solve(jacobian, field, transposed);
        let mut turns = self.taken(field);
        factors[usize::from(transposed)].solve_mut(&mut turns);
        for ((joint, row), turn) in self.rows.iter().zip(&turns) {
            right.joints[*joint] = right.joints[*joint].plus(*row, -*turn);
        }
        factor.solve(jacobian, &mut right, transposed);
        *field = right;
    }
}

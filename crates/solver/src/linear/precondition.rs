//! Preconditioners of the conjugate gradients: what stands in for A^-1.

mod frozen;
mod local;

use names::names;

use crate::kernel::Spatial;
use crate::linear::operator::Operator;
use crate::system::System;
use crate::topology::Topology;

pub use frozen::Frozen;
use local::{BlockJacobi, Jacobi, Raw};

/// Which preconditioner to use. Each is symmetric and positive definite.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum PreconditionerKind {
    /// None: SI units as they are, metres beside 1/metres.
    Raw,
    /// The diagonal of A.
    Jacobi,
    /// The 6x6 blocks on the diagonal of A.
    #[default]
    BlockJacobi,
    /// The factor of the rest shape, turned along with the segments.
    Frozen,
}

names!(PreconditionerKind { Raw = "raw", Jacobi = "jacobi", BlockJacobi = "block-jacobi", Frozen = "frozen" });

/// A preconditioner of a chosen kind, with its memory.
pub struct Preconditioner(Chosen);

enum Chosen {
    Raw(Raw),
    Jacobi(Jacobi),
    BlockJacobi(BlockJacobi),
    Frozen(Box<Frozen>),
}

impl Preconditioner {
    /// Memory for systems of this connectivity. `frozen` holds the rest shape where the kind needs it; without it, the
    /// 6x6 blocks take its place.
    pub fn new(kind: PreconditionerKind, topology: &Topology, frozen: Option<Frozen>) -> Self {
        let joints = topology.joints.len();
        Self(match (kind, frozen) {
            (PreconditionerKind::Raw, _) => Chosen::Raw(Raw),
            (PreconditionerKind::Jacobi, _) => Chosen::Jacobi(Jacobi::new(joints)),
            (PreconditionerKind::Frozen, Some(frozen)) => Chosen::Frozen(Box::new(frozen)),
            (PreconditionerKind::BlockJacobi | PreconditionerKind::Frozen, _) => {
                Chosen::BlockJacobi(BlockJacobi::new(joints))
            }
        })
    }

    /// Takes over a system's matrix, which `operator` holds already.
    #[inline(always)]
    pub fn prepare(&mut self, operator: &Operator, system: &System<f64>) {
        match &mut self.0 {
            Chosen::Raw(m) => m.prepare(operator, system),
            Chosen::Jacobi(m) => m.prepare(operator, system),
            Chosen::BlockJacobi(m) => m.prepare(operator, system),
            Chosen::Frozen(m) => m.prepare(operator, system),
        }
    }

    /// `z = M^-1 r`, one entry a joint; returns `r^T z`.
    #[inline(always)]
    pub fn apply(&mut self, system: &System<f64>, r: &[Spatial<f64>], z: &mut [Spatial<f64>]) -> f64 {
        match &mut self.0 {
            Chosen::Raw(m) => m.apply(system, r, z),
            Chosen::Jacobi(m) => m.apply(system, r, z),
            Chosen::BlockJacobi(m) => m.apply(system, r, z),
            Chosen::Frozen(m) => m.apply(system, r, z),
        }
    }
}

/// `z = M^-1 r` with M standing in for A.
trait Precondition {
    /// Takes over a system's matrix.
    fn prepare(&mut self, operator: &Operator, system: &System<f64>);

    /// `z = M^-1 r`; returns `r^T z`.
    fn apply(&mut self, system: &System<f64>, r: &[Spatial<f64>], z: &mut [Spatial<f64>]) -> f64;
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nalgebra::{DMatrix, Vector3};
    use rod::{Assembly, Material, RodSpec, shape};

    use super::*;
    use crate::component::{Component, split};
    use crate::formulation::Formulation;

    /// The first outer iteration of a shaken rod with a branch, and its frozen factor.
    fn branched() -> (Component<f64>, Frozen) {
        let material = Material { youngs_modulus: 1e5, torsion_modulus: 3e4, density: 300.0 };
        let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
        let trunk = assembly.rod(&RodSpec::new(shape::helix(Vector3::zeros(), 0.3, 0.5, 1.0, 8), 0.03, material));
        let tip = assembly.state_mut().positions[trunk.start + 4];
        let branch = assembly.rod(&RodSpec::new(shape::straight(tip, Vector3::y(), 0.4, 3), 0.02, material));
        assembly.branch(trunk.start + 4, 0.5, &branch).clamp_start(&trunk);
        let (model, mut state) = assembly.finish();
        for (i, (v, w)) in state.velocities.iter_mut().zip(&mut state.angular_velocities).enumerate() {
            *v = Vector3::new((i as f64).sin(), (3.0 * i as f64).cos(), 0.5);
            *w = Vector3::new(4.0, (i as f64).cos(), -6.0);
        }
        let (members, topology) = split(&model).swap_remove(0);
        let frozen = Frozen::new(&model, &members, &topology).unwrap();
        let mut component = Component::new(&model, &state, Arc::new(topology), &[&members]);
        component.predict(0.0, 0.02, Formulation::XpbdGeometric);
        component.evaluate(Formulation::XpbdGeometric);
        (component, frozen)
    }

    fn dense(preconditioner: &mut Preconditioner, component: &Component<f64>) -> DMatrix<f64> {
        let system = &component.system;
        let mut operator = Operator::new(&system.topology);
        operator.prepare(system);
        preconditioner.prepare(&operator, system);
        let joints = system.joints.len();
        let mut out = DMatrix::zeros(6 * joints, 6 * joints);
        let mut z = vec![Spatial::zero(); joints];
        for column in 0..6 * joints {
            let mut r = vec![Spatial::zero(); joints];
            let mut unit = [0.0; 6];
            unit[column % 6] = 1.0;
            r[column / 6] = Spatial::from_array(unit);
            let product = preconditioner.apply(system, &r, &mut z);
            let values: Vec<f64> = z.iter().flat_map(|z| z.to_array()).collect();
            out.column_mut(column).copy_from_slice(&values);
            assert_eq!(product, out[(column, column)]);
        }
        out
    }

    #[test]
    fn preconditioners_are_symmetric_and_positive_definite() {
        let (component, frozen) = branched();
        let mut frozen = Some(frozen);
        for name in PreconditionerKind::ALL {
            let frozen = if name == PreconditionerKind::Frozen { frozen.take() } else { None };
            let mut preconditioner = Preconditioner::new(name, &component.system.topology, frozen);
            let inverse = dense(&mut preconditioner, &component);
            let n = inverse.nrows();
            let scaled = DMatrix::from_fn(n, n, |r, c| inverse[(r, c)] / (inverse[(r, r)] * inverse[(c, c)]).sqrt());
            assert!((&scaled - scaled.transpose()).amax() < 1e-11, "{name}");
            assert!(scaled.symmetric_eigenvalues().min() > 0.0, "{name}");
        }
    }

    #[test]
    fn names_are_read_back() {
        for kind in PreconditionerKind::ALL {
            assert_eq!(kind.to_string().parse(), Ok(kind));
        }
        assert!("none".parse::<PreconditionerKind>().unwrap_err().contains("block-jacobi"));
    }
}

use std::sync::Arc;

use jointed::linear::operator::Operator;
use jointed::linear::precondition::*;
use kernels::Spatial;
use nalgebra::{DMatrix, Vector3};
use rod::{Assembly, Material, RodSpec, shape};

use crate::formulation::Formulation;
use crate::{Component, split};

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
    component.predict(0.0, 0.02, Formulation::Newton);
    component.evaluate(Formulation::Newton);
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

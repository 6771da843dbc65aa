//! Restriction of predictions to a planar rod's plane.

use graph::{corrections, planar_normal, project_to_plane};
use jointed::linear::LinearSolver;
use jointed::linear::direct::Direct;
use kernels::Spatial;
use nalgebra::Vector3;
use rod::{Air, Gusts, Wind};

use crate::common::{advance, component, rod};

#[test]
fn the_exact_solution_stays_and_what_leaves_the_plane_goes() {
    let (model, mut state) = rod(20, 0.4);
    let normal = planar_normal(&model, &state).unwrap();
    advance(&model, &mut state, 10);
    let (mut component, graph, _) = component(&model, &state);
    let mut exact = component.dlambda.clone();
    Direct::<f64>::new(&component.system.topology).unwrap().solve(&component.system, false, &mut exact);
    component.dlambda.copy_from_slice(&exact);
    let mut exact_dp = vec![Spatial::zero(); graph.nodes().len()];
    corrections(&component, &exact, &mut exact_dp);
    let close = |a: &[Spatial<f64>], b: &[Spatial<f64>]| {
        let apart = |(a, b): (&Spatial<f64>, &Spatial<f64>)| {
            let d = a.plus(*b, -1.0);
            d.dot(d)
        };
        let size: f64 = b.iter().map(|b| b.dot(*b)).sum();
        a.iter().zip(b).map(apart).sum::<f64>() <= 1e-20 * size
    };
    let (mut dp, mut dlambda) = (exact_dp.clone(), exact.clone());
    project_to_plane(&component, normal, &mut dp, &mut dlambda);
    assert!(close(&dp, &exact_dp) && close(&dlambda, &exact));

    // The plane is that of x and z. In a body's frame its normal is d2, one of the multipliers' bend-twist axes.
    for dp in &mut dp {
        dp.linear.0[1] += 0.3;
        dp.angular.0[0] -= 0.2;
        dp.angular.0[2] += 0.1;
    }
    for dlambda in &mut dlambda {
        dlambda.linear.0[1] -= 0.5;
        dlambda.angular.0[0] += 0.7;
        dlambda.angular.0[2] += 0.9;
    }
    project_to_plane(&component, normal, &mut dp, &mut []);
    project_to_plane(&component, normal, &mut [], &mut dlambda);
    assert!(close(&dp, &exact_dp) && close(&dlambda, &exact));
}

#[test]
fn wind_across_the_plane_leaves_none() {
    let (mut model, state) = rod(5, 0.2);
    let mut with = |velocity: Vector3<f64>, gusts: Option<Gusts>| {
        let wind = Wind::new(velocity, gusts, None);
        model.air = Some(Air { density: 1.2, normal_drag: 1.1, tangential_drag: 0.01, wind });
        planar_normal(&model, &state).is_some()
    };
    // The plane is that of x and z.
    assert!(with(Vector3::zeros(), None) && with(Vector3::new(3.0, 0.0, 1.0), None));
    assert!(!with(Vector3::y(), None));
    assert!(!with(Vector3::x(), Some(Gusts { strength: 0.3, length: 5.0, time: 2.0, seed: 1 })));
}

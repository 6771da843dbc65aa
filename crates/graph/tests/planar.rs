//! Restriction of predictions to a planar rod's plane.

mod common;

use common::{advance, component, rod};
use graph::{corrections, planar_normal, project_to_plane};
use solver::linear::LinearSolver;
use solver::linear::direct::Direct;
use solver::system::Six;

#[test]
fn the_exact_solution_stays_and_what_leaves_the_plane_goes() {
    let (model, mut state) = rod(20, 0.4);
    let normal = planar_normal(&model, &state).unwrap();
    advance(&model, &mut state, 10);
    let (mut component, graph, _) = component(&model, &state);
    let mut exact = component.dlambda.clone();
    Direct::<f64>::new(&component.system.topology).unwrap().solve(&component.system, false, &mut exact);
    component.dlambda.copy_from_slice(&exact);
    let mut exact_dp = vec![Six::zero(); graph.nodes().len()];
    corrections(&component, &exact, &mut exact_dp);
    let close = |a: &[Six<f64>], b: &[Six<f64>]| {
        let apart = |(a, b): (&Six<f64>, &Six<f64>)| {
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
        dp.stretch.0[1] += 0.3;
        dp.bend.0[0] -= 0.2;
        dp.bend.0[2] += 0.1;
    }
    for dlambda in &mut dlambda {
        dlambda.stretch.0[1] -= 0.5;
        dlambda.bend.0[0] += 0.7;
        dlambda.bend.0[2] += 0.9;
    }
    project_to_plane(&component, normal, &mut dp, &mut []);
    project_to_plane(&component, normal, &mut [], &mut dlambda);
    assert!(close(&dp, &exact_dp) && close(&dlambda, &exact));
}

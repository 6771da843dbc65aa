//! The paper's features: layout, values computed by hand, flags, norms.

use graph::paper::{self, fill_changing_nodes, fill_constant_nodes, fill_edges, normalized_modulus};
use graph::{Batch, Norms, corrections};
use jointed::linear::LinearSolver;
use jointed::linear::direct::Direct;
use kernels::Spatial;
use nalgebra::Vector3;
use rod::{Assembly, Material, RodSpec, shape};

use crate::common::{component, helix, rod, tree, zeros};

#[test]
fn a_rod_has_the_values_computed_by_hand() {
    let (model, state) = rod(4, 0.0);
    let (component, graph, _) = component(&model, &state);
    let mut nodes = vec![f32::NAN; 4 * paper::NODE];
    fill_constant_nodes(&graph, &mut nodes);
    fill_changing_nodes(&component.poses, &mut nodes);
    let half = 0.5_f32.sqrt();
    // x, q (the z axis turned to x: a quarter turn about y), r, rho, l, alpha, flags.
    let expected = |x: f32, z: f32, alpha: f32, flags: [f32; 3]| {
        let [f0, f1, f2] = flags;
        [x, 0.0, z, 0.0, half, 0.0, half, 0.05, 100.0, 0.75, alpha, f0, f1, f2]
    };
    // The prediction lets all but the clamp fall by g dt^2.
    let fall = -9.81 * 0.02 * 0.02;
    crate::common::assert_close(&nodes[..14], &expected(0.375, 0.0, 0.0, [0.0, 1.0, 1.0]), 1e-6);
    crate::common::assert_close(&nodes[14..28], &expected(1.125, fall, 1.0 / 3.0, [1.0, 0.0, 1.0]), 1e-6);
    crate::common::assert_close(&nodes[28..42], &expected(1.875, fall, 2.0 / 3.0, [1.0, 1.0, 1.0]), 1e-6);
    crate::common::assert_close(&nodes[42..], &expected(2.625, fall, 1.0, [1.0, 1.0, 1.0]), 1e-6);

    let mut edges = vec![f32::NAN; 3 * paper::EDGE];
    fill_edges(&graph, &mut edges);
    let torsion = (2e5_f32 / 1e5).log10();
    for row in edges.chunks(paper::EDGE) {
        crate::common::assert_close(row, &[0.0, 0.0, 0.0, 0.0, torsion], 1e-6);
    }
    assert_eq!((graph.senders(), graph.receivers()), ([0, 1, 2].as_slice(), [1, 2, 3].as_slice()));
}

#[test]
fn moduli_are_scaled_over_the_range_of_table_1() {
    for (modulus, scaled) in [(1e4, -1.0), (1e5, 0.0), (1e6, 1.0), (1e7, 2.0)] {
        assert!((normalized_modulus(modulus) - scaled).abs() < 1e-12);
    }
}

#[test]
fn a_helix_has_its_rest_darboux_vectors() {
    let (model, state) = helix(50);
    let (_, graph, members) = component(&model, &state);
    let mut edges = vec![f32::NAN; 49 * paper::EDGE];
    fill_edges(&graph, &mut edges);
    for (row, &joint) in edges.chunks(paper::EDGE).zip(&members.joints) {
        let omega = model.joints[joint].rest_darboux;
        crate::common::assert_close(&row[..3], &[omega.x as f32, omega.y as f32, omega.z as f32], 1e-6);
    }
}

#[test]
fn rods_of_a_tree_have_their_own_arc_length_and_anchors_are_fixed_nodes() {
    let (model, state) = tree(false);
    let (component, graph, _) = component(&model, &state);
    let mut nodes = vec![f32::NAN; graph.nodes().len() * paper::NODE];
    fill_constant_nodes(&graph, &mut nodes);
    fill_changing_nodes(&component.poses, &mut nodes);
    let alpha: Vec<f32> = nodes.chunks(paper::NODE).map(|row| row[10]).collect();
    let third = 1.0_f32 / 3.0;
    let expected = [0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 0.0, third, 2.0 * third, 1.0, 0.0, 0.5, 1.0, 0.0];
    crate::common::assert_close(&alpha, &expected, 1e-6);
    // The anchor comes last: fixed, at the origin, on the trunk's first segment's left.
    assert_eq!(nodes[13 * paper::NODE + 11], 0.0);
    crate::common::assert_close(&nodes[13 * paper::NODE..13 * paper::NODE + 3], &[0.0; 3], 1e-6);
    assert_eq!(nodes[11..14], [1.0, 0.0, 1.0]);
}

#[test]
fn unequal_segments_and_lone_ones_have_an_alpha() {
    let mut assembly = Assembly::new(Vector3::zeros());
    let at = |x: f64| Vector3::new(x, 0.0, 0.0);
    let material = Material { youngs_modulus: 1e5, torsion_modulus: 1e5, density: 1.0 };
    assembly.rod(&RodSpec::new(vec![at(0.0), at(1.0), at(3.0), at(4.0)], 0.1, material));
    let (model, state) = assembly.finish();
    let (_, graph, _) = component(&model, &state);
    let alpha: Vec<f64> = graph.nodes().iter().map(|node| node.alpha).collect();
    assert_eq!(alpha, [0.0, 0.5, 1.0]);

    let mut assembly = Assembly::new(Vector3::zeros());
    let lone = assembly.rod(&RodSpec::new(shape::straight(at(0.0), at(1.0), 1.0, 1), 0.1, material));
    assembly.clamp_start(&lone);
    let (model, state) = assembly.finish();
    let (_, graph, _) = component(&model, &state);
    assert_eq!(graph.nodes().iter().map(|node| node.alpha).collect::<Vec<_>>(), [0.0, 0.0]);
    assert_eq!(graph.nodes()[0].free, [true, false, true]);
}

#[test]
fn targets_over_the_norms_reach_one_and_are_read_back() {
    let (model, mut state) = helix(30);
    crate::common::advance(&model, &mut state, 5);
    let (mut component, ..) = component(&model, &state);
    let mut dlambda = zeros(29);
    Direct::new(&component.system.topology).unwrap().solve(&component.system, false, &mut dlambda);
    component.dlambda.copy_from_slice(&dlambda);
    let mut dp = zeros(30);
    corrections(&component, &dlambda, &mut dp);
    let mut norms = Norms::default();
    norms.include(&dp, &dlambda);
    let mut node_targets = vec![f32::NAN; 30 * paper::NODE_TARGET];
    let mut edge_targets = vec![f32::NAN; 29 * paper::EDGE_TARGET];
    norms.fill_node_targets(&dp, &mut node_targets);
    norms.fill_edge_targets(&dlambda, &mut edge_targets);
    for targets in [&node_targets, &edge_targets] {
        for part in 0..2 {
            let part = targets.chunks(6).flat_map(|row| row[3 * part..3 * part + 3].iter());
            assert_eq!(part.map(|x| x.abs()).fold(0.0, f32::max), 1.0);
        }
    }
    let mut back = zeros(29);
    norms.dlambda(&edge_targets, &mut back);
    for (a, b) in back.iter().zip(&dlambda) {
        assert!(a.linear.0.iter().zip(b.linear.0).all(|(a, b)| (a - b).abs() <= 1e-7 * norms.dlambda_stretch));
        assert!(a.angular.0.iter().zip(b.angular.0).all(|(a, b)| (a - b).abs() <= 1e-7 * norms.dlambda_bend));
    }

    // The corrections are what the solver's own update makes of the multipliers.
    let before = component.poses.clone();
    component.update(dynamics::formulation::Formulation::Xpbd, 1.0);
    for ((old, new), dp) in before.iter().zip(&component.poses).zip(&dp) {
        assert!((old.x + dp.linear - new.x).norm_squared() < 1e-28);
        let turned = old.q.turned(dp.angular);
        assert!((turned.v - new.q.v).norm_squared() < 1e-28);
    }
    assert_eq!(dp[0], Spatial::zero());
}

#[test]
fn graphs_are_joined_by_concatenation() {
    let graphs = [rod(3, 0.0), tree(false), rod(4, 0.3)].map(|(model, state)| component(&model, &state).1);
    let mut batch = Batch::default();
    for _ in 0..2 {
        batch.clear();
        let rows: Vec<_> = graphs.iter().map(|graph| batch.push(graph)).collect();
        assert_eq!(rows, [(0..3, 0..2), (3..17, 2..15), (17..21, 15..18)]);
        assert_eq!((batch.n_node.as_slice(), batch.n_edge.as_slice()), ([3, 14, 4].as_slice(), [2, 13, 3].as_slice()));
        assert_eq!((batch.nodes(), batch.edges()), (21, 18));
        assert_eq!((&batch.senders[..2], &batch.senders[15..]), ([0, 1].as_slice(), [17, 18, 19].as_slice()));
        assert_eq!(batch.receivers[15..], [18, 19, 20]);
    }
}

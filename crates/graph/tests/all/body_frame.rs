//! The body-frame features: what they must not depend on, what they say of the right-hand side, and no allocations.

use graph::body_frame::{self, Features};
use graph::{Channel, Normal, Whitening, corrections, mask, planar_normal};
use jointed::linear::LinearSolver;
use jointed::linear::direct::Direct;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use rod::{Model, State};

use crate::common::{All, advance, assert_close, component, features, helix, moved, rod, tree, zeros};

fn in_motion(which: usize) -> (Model, State) {
    let (model, mut state) = match which {
        0 => rod(12, 0.4),
        1 => helix(40),
        _ => tree(false),
    };
    advance(&model, &mut state, 7);
    (model, state)
}

fn assert_alike(a: &All, b: &All) {
    assert!((a.scale / b.scale - 1.0).abs() < 1e-6, "{} {}", a.scale, b.scale);
    assert_close(&a.node_constant, &b.node_constant, 1e-6);
    assert_close(&a.edge_constant, &b.edge_constant, 1e-6);
    assert_close(&a.nodes, &b.nodes, 1e-5);
    assert_close(&a.edges, &b.edges, 1e-5);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 32, ..ProptestConfig::default() })]
    #[test]
    fn rigid_motions_change_nothing(
        which in 0..3_usize,
        axis in prop::array::uniform3(-1.0..1.0_f64),
        angle in 0.0..6.0_f64,
        shift in prop::array::uniform3(-10.0..10.0_f64),
    ) {
        let (model, state) = in_motion(which);
        let turn = UnitQuaternion::from_scaled_axis(Vector3::from(axis).normalize() * angle);
        let (turned, turned_state) = moved(&model, &state, turn, Vector3::from(shift));
        let (a, graph, _) = component(&model, &state);
        let (b, ..) = component(&turned, &turned_state);
        assert_alike(&features(&graph, &a), &features(&graph, &b));
    }

    #[test]
    fn a_multiple_of_the_right_hand_side_changes_the_scale_alone(which in 0..3_usize, factor in 1e-6..1e6_f64) {
        let (model, state) = in_motion(which);
        let (mut component, graph, _) = component(&model, &state);
        let before = features(&graph, &component);
        for joint in &mut component.system.joints {
            joint.rhs.linear = joint.rhs.linear * factor;
            joint.rhs.angular = joint.rhs.angular * factor;
        }
        let mut after = features(&graph, &component);
        after.scale /= factor;
        assert_alike(&before, &after);
    }
}

#[test]
fn a_reflection_changes_the_signs_that_the_channels_say() {
    // Mirror in world y. A frame stays a rotation when its d2 is mirrored, too: R' = S R S.
    let s = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, 1.0));
    for which in 0..3 {
        let (model, state) = in_motion(which);
        let (mut other, mut mirrored) = (model.clone(), state.clone());
        let flip = |q: &mut UnitQuaternion<f64>| {
            let r = s * q.to_rotation_matrix().matrix() * s;
            *q = UnitQuaternion::from_matrix(&r);
        };
        other.gravity = s * other.gravity;
        for anchor in &mut other.anchors {
            anchor.position = s * anchor.position;
            flip(&mut anchor.orientation);
        }
        for joint in &mut other.joints {
            joint.rest_darboux = -(s * joint.rest_darboux);
        }
        mirrored.orientations.iter_mut().for_each(flip);
        mirrored.positions.iter_mut().chain(&mut mirrored.velocities).for_each(|x| *x = s * *x);
        mirrored.angular_velocities.iter_mut().for_each(|w| *w = -(s * *w));
        let (a, graph, _) = component(&model, &state);
        let (b, other_graph, _) = component(&other, &mirrored);
        let (a, mut b) = (features(&graph, &a), features(&other_graph, &b));
        let signs = |channels: &[Channel], rows: &mut [f32]| {
            for row in rows.chunks_mut(channels.len()) {
                for (x, channel) in row.iter_mut().zip(channels) {
                    *x *= if channel.is_even(Normal::D2) { 1.0 } else { -1.0 };
                }
            }
        };
        signs(&body_frame::NODE_CHANGING_CHANNELS, &mut b.nodes);
        signs(&body_frame::EDGE_CHANGING_CHANNELS, &mut b.edges);
        signs(&body_frame::EDGE_CONSTANT_CHANNELS, &mut b.edge_constant);
        assert_alike(&a, &b);
    }
}

#[test]
fn planar_rods_are_seen_and_their_features_pass_the_mask() {
    let (model, state) = in_motion(0);
    assert_eq!(planar_normal(&model, &state), Some(Normal::D2));
    let roll = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 1.0);
    let (turned, turned_state) = moved(&model, &state, roll, Vector3::zeros());
    assert_eq!(planar_normal(&turned, &turned_state), Some(Normal::D2));
    let mut tilted = model.clone();
    tilted.gravity.y = 1.0;
    assert_eq!(planar_normal(&tilted, &state), None);
    for which in 1..3 {
        let (model, state) = in_motion(which);
        assert_eq!(planar_normal(&model, &state), None);
    }

    let (component, graph, _) = component(&turned, &turned_state);
    let all = features(&graph, &component);
    let mut masked = (all.nodes.clone(), all.edges.clone());
    mask(&body_frame::NODE_CHANGING_CHANNELS, Normal::D2, &mut masked.0);
    mask(&body_frame::EDGE_CHANGING_CHANNELS, Normal::D2, &mut masked.1);
    assert_close(&all.nodes, &masked.0, 1e-9);
    assert_close(&all.edges, &masked.1, 1e-9);
}

#[test]
fn swapping_two_branches_permutes_the_rows() {
    let ((a, mut a_state), (b, mut b_state)) = (tree(false), tree(true));
    advance(&a, &mut a_state, 5);
    advance(&b, &mut b_state, 5);
    let (a, a_graph, _) = component(&a, &a_state);
    let (b, b_graph, _) = component(&b, &b_state);
    let (a_all, b_all) = (features(&a_graph, &a), features(&b_graph, &b));
    // Trunk 0..6, then a branch of 4 and one of 3, or the other way round; the anchor is last.
    let node = |i: u32| match i {
        6..10 => i + 3,
        10..13 => i - 4,
        _ => i,
    };
    let row = |rows: &[f32], i: usize, n: usize| rows[i * n..(i + 1) * n].to_vec();
    for i in 0..14 {
        let j = node(i as u32) as usize;
        for (a, b, n) in [(&a_all.nodes, &b_all.nodes, 9), (&a_all.node_constant, &b_all.node_constant, 7)] {
            assert_close(&row(a, i, n), &row(b, j, n), 1e-5);
        }
    }
    for k in 0..a_graph.edges().len() {
        let ends = (node(a_graph.senders()[k]), node(a_graph.receivers()[k]));
        let same = |&j: &usize| (b_graph.senders()[j], b_graph.receivers()[j]) == ends;
        let j = (0..b_graph.edges().len()).find(same).unwrap();
        for (a, b, n) in [(&a_all.edges, &b_all.edges, 18), (&a_all.edge_constant, &b_all.edge_constant, 9)] {
            assert_close(&row(a, k, n), &row(b, j, n), 1e-5);
        }
    }
}

#[test]
fn the_particular_solution_closes_the_gaps_and_balances_momentum() {
    for which in 0..3 {
        let (model, state) = in_motion(which);
        let (component, graph, _) = component(&model, &state);
        let all = features(&graph, &component);
        // Force and moment stand in the units of the outputs.
        let outputs: Vec<f32> = all.edges.chunks(18).flat_map(|row| row[6..12].to_vec()).collect();
        let mut dlambda = zeros(graph.edges().len());
        Features::new(&graph).dlambda(&graph, &component, all.scale, &outputs, &mut dlambda);
        let mut dp = zeros(graph.nodes().len());
        corrections(&component, &dlambda, &mut dp);
        for (i, dp) in dp.iter().enumerate() {
            let xp = component.poses[i].q.rotate_back(dp.linear).0.map(|x| (x / all.scale) as f32);
            assert_close(&all.nodes[9 * i..9 * i + 3], &xp, 1e-5);
            let turn = dp.angular.norm_squared().sqrt() * graph.nodes()[i].rod_scale[1];
            assert!(turn < 1e-2 * all.scale, "{which}: {i} turns by {turn}, scale {}", all.scale);
        }
        // With it the stretch rows are met but for their tiny compliance.
        for (k, terms) in component.system.joints.iter().enumerate() {
            let [a, b] = component.system.topology.joints[k].map(|body| body as usize);
            let left = terms.rhs.linear - (dp[a].linear - dp[b].linear);
            assert!(left.norm_squared().sqrt() < 1e-5 * all.scale);
        }
    }
}

#[test]
fn targets_are_read_back_and_depend_on_no_rigid_motion() {
    let (model, state) = in_motion(2);
    let turn = UnitQuaternion::from_euler_angles(0.5, 1.0, 2.0);
    let (turned, turned_state) = moved(&model, &state, turn, Vector3::new(1.0, 2.0, 3.0));
    let mut found = Vec::new();
    for (model, state) in [(&model, &state), (&turned, &turned_state)] {
        let (component, graph, _) = component(model, state);
        let mut features = Features::new(&graph);
        let (mut nodes, mut edges) = (vec![0.0; 14 * 9], vec![0.0; 13 * 18]);
        let scale = features.fill(&graph, &component, &mut nodes, &mut edges);
        let (mut dlambda, mut dp) = (zeros(13), zeros(14));
        Direct::new(&component.system.topology).unwrap().solve(&component.system, false, &mut dlambda);
        corrections(&component, &dlambda, &mut dp);
        let (mut node_targets, mut edge_targets) = (vec![0.0; 14 * 6], vec![0.0; 13 * 6]);
        features.fill_node_targets(&graph, &component, scale, &dp, &mut node_targets);
        features.fill_edge_targets(&graph, &component, scale, &dlambda, &mut edge_targets);
        let mut back = zeros(13);
        features.dlambda(&graph, &component, scale, &edge_targets, &mut back);
        for (a, b) in back.iter().zip(&dlambda) {
            assert!(a.plus(*b, -1.0).dot(a.plus(*b, -1.0)) <= 1e-10 * b.dot(*b));
        }
        found.push((node_targets, edge_targets));
    }
    assert_close(&found[0].0, &found[1].0, 1e-4);
    assert_close(&found[0].1, &found[1].1, 1e-4);
}

#[test]
fn nothing_to_do_gives_zeros() {
    let (mut model, state) = rod(5, 0.0);
    model.gravity = Vector3::zeros();
    let (component, graph, _) = component(&model, &state);
    let all = features(&graph, &component);
    assert!(all.scale < 1e-12);
    assert!(all.nodes.iter().chain(&all.edges).all(|x| x.is_finite()));
}

#[test]
fn free_rods_move_about_their_centre_of_mass() {
    let (mut model, mut state) = rod(8, 0.2);
    model.segments[0].fixed = false;
    for (i, v) in state.velocities.iter_mut().enumerate() {
        *v = Vector3::new(0.1 * i as f64, (i as f64).sin(), 0.0);
    }
    let (component, graph, _) = component(&model, &state);
    let all = features(&graph, &component);
    for axis in 0..3 {
        // All frames are alike here, so that the rows can be added.
        let sum: f32 = all.nodes.chunks(9).map(|row| row[axis]).sum();
        assert!(sum.abs() < 1e-4, "{sum}");
    }
}

#[test]
fn filling_does_not_allocate() {
    let (model, state) = in_motion(2);
    let (component, graph, _) = component(&model, &state);
    let mut own = Features::new(&graph);
    let (mut nodes, mut edges) = (vec![0.0; 14 * 14], vec![0.0; 13 * 18]);
    let count = allocation_counter::measure(|| {
        own.fill(&graph, &component, &mut nodes, &mut edges);
        graph::paper::fill_constant_nodes(&graph, &mut nodes);
        graph::paper::fill_changing_nodes(&component.poses, &mut nodes);
        body_frame::fill_constant_nodes(&graph, &mut nodes);
        body_frame::fill_constant_edges(&graph, 0.02, &mut edges);
    });
    assert_eq!(count.count_total, 0);
}

#[test]
fn whitening_gives_unit_size_and_keeps_the_zero_of_vectors() {
    let channels = [Channel::Scalar, Channel::Polar(1), Channel::Scalar];
    let mut rows: Vec<f32> = (0..100).flat_map(|i| [5.0 + i as f32, 3.0, 7.0]).collect();
    let whitening = Whitening::fit(&channels, rows.chunks(30));
    whitening.apply(&mut rows);
    let column = |k: usize| rows.chunks(3).map(move |row| row[k]);
    let mean: f32 = column(0).sum::<f32>() / 100.0;
    let square: f32 = column(0).map(|x| x * x).sum::<f32>() / 100.0;
    assert!(mean.abs() < 1e-5 && (square - 1.0).abs() < 1e-5);
    assert!(column(1).all(|x| x == 1.0) && column(2).all(|x| x == 0.0));
    // Zeros but for rounding are not blown up.
    let noise = [1e-16, 0.0, 2e-16];
    assert_eq!(Whitening::fit(&[Channel::Polar(0)], [noise.as_slice()]), Whitening::identity(1));
    let mut far = [1e9, -1e9, 7.5];
    whitening.apply(&mut far);
    assert_eq!(far, [6.0, -6.0, 0.5]);
}

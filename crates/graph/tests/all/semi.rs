//! The head that derives forces from turns: exact outputs give the exact multipliers, and gradients come back.

use component::Component;
use dynamics::formulation::Formulation;
use graph::body_frame::{EDGE_CHANGING, Features, NODE_CHANGING};
use graph::semi::{self, Semi};
use graph::{Graph, corrections};
use jointed::linear::LinearSolver;
use jointed::linear::direct::Direct;
use kernels::Spatial;
use rod::{Model, State};

use crate::common::{advance, component, helix, rod, tree, zeros};

/// A planar rod, a helix, a tree, a rod that nothing holds, and the tree in air.
fn in_motion(which: usize) -> (Model, State) {
    let (model, mut state) = match which {
        0 => rod(12, 0.4),
        1 => helix(40),
        2 | 4 => tree(false),
        _ => {
            let (mut model, mut state) = rod(8, 0.2);
            model.segments[0].fixed = false;
            state.velocities.iter_mut().enumerate().for_each(|(i, v)| v.y = (i as f64).sin());
            (model, state)
        }
    };
    advance(&model, &mut state, 7);
    (model, state)
}

/// The component, its graph and features, and its scale.
fn prepared(which: usize) -> (Component<f64>, Graph, Features, f64) {
    let (model, state) = in_motion(which);
    let (mut component, graph, _) = component(&model, &state);
    if which == 4 {
        // Drag makes segments heavier, each by its own share.
        for segment in 0..component.segments() {
            let [inverse_mass, transverse] = component.inertia(segment);
            component.set_inertia(segment, [inverse_mass / (1.1 + 0.1 * segment as f64), transverse * 1.3]);
        }
        component.evaluate(Formulation::Xpbd);
    }
    let mut features = Features::new(&graph);
    let mut nodes = vec![0.0; NODE_CHANGING * graph.nodes().len()];
    let mut edges = vec![0.0; EDGE_CHANGING * graph.edges().len()];
    let scale = features.fill(&graph, &component, &mut nodes, &mut edges);
    (component, graph, features, scale)
}

/// `count` numbers in [-1, 1] without a pattern, in single precision.
fn numbers(count: usize, seed: f64) -> Vec<f32> {
    (0..count).map(|i| (17.3 * i as f64 + seed).sin() as f32).collect()
}

#[test]
fn exact_outputs_give_the_exact_multipliers() {
    for which in 0..5 {
        let (component, graph, features, scale) = prepared(which);
        let (n, m) = (graph.nodes().len(), graph.edges().len());
        let (mut exact, mut dp, mut found) = (zeros(m), zeros(n), zeros(m));
        Direct::new(&component.system.topology).unwrap().solve(&component.system, false, &mut exact);
        corrections(&component, &exact, &mut dp);
        let (mut nodes, edges) = (vec![f32::NAN; 3 * n], vec![0.0; 3 * m]);
        semi::fill_node_targets(&graph, &component, scale, &dp, &mut nodes);
        Semi::new(&graph).dlambda(&graph, &component, &features, scale, &nodes, &edges, &mut found);
        let sizes = exact.iter().fold((0.0_f64, 0.0_f64), |(force, moment), x| {
            (force.max(x.linear.norm_squared()), moment.max(x.angular.norm_squared()))
        });
        for (k, (found, exact)) in found.iter().zip(&exact).enumerate() {
            let apart = found.plus(*exact, -1.0);
            // The neglected compliance of stretch is some 1e-6 of what is kept, and turns are in single precision.
            assert!(apart.linear.norm_squared() <= 1e-9 * sizes.0, "{which} {k}: {found:?} {exact:?}");
            assert!(apart.angular.norm_squared() <= 1e-14 * sizes.1, "{which} {k}: {found:?} {exact:?}");
        }
    }
}

#[test]
fn any_outputs_meet_the_stretch_rows() {
    for which in 0..5 {
        let (component, graph, features, scale) = prepared(which);
        let (n, m) = (graph.nodes().len(), graph.edges().len());
        let (nodes, edges) = (numbers(3 * n, 1.0), numbers(3 * m, 2.0));
        let mut dlambda = zeros(m);
        Semi::new(&graph).dlambda(&graph, &component, &features, scale, &nodes, &edges, &mut dlambda);
        let mut dp = zeros(n);
        corrections(&component, &dlambda, &mut dp);
        for (i, (dp, node)) in dp.iter_mut().zip(graph.nodes()).enumerate() {
            let own = [0, 1, 2].map(|k: usize| f64::from(nodes[3 * i + k]) * scale / node.rod_scale[1]);
            let turn = component.poses[i].q.rotate(kernels::math::Vec3(own));
            dp.angular = if node.free[0] { turn } else { Spatial::zero().angular };
        }
        for (k, terms) in component.system.joints.iter().enumerate() {
            let left = component.system.constraint_change(k, &dp).linear - terms.rhs.linear;
            assert!(left.norm_squared().sqrt() < 1e-9 * scale, "{which} {k}: {left:?}");
        }
    }
}

#[test]
fn gradients_are_the_transpose_of_the_map() {
    for which in 0..5 {
        let (component, graph, features, scale) = prepared(which);
        let (n, m) = (graph.nodes().len(), graph.edges().len());
        let mut semi = Semi::new(&graph);
        let mut at = |nodes: &[f32], edges: &[f32]| {
            let mut dlambda = zeros(m);
            semi.dlambda(&graph, &component, &features, scale, nodes, edges, &mut dlambda);
            dlambda
        };
        let (nodes, edges) = (numbers(3 * n, 1.0), numbers(3 * m, 2.0));
        let origin = at(&vec![0.0; 3 * n], &vec![0.0; 3 * m]);
        let image: Vec<Spatial<f64>> = at(&nodes, &edges).iter().zip(&origin).map(|(x, o)| x.plus(*o, -1.0)).collect();
        let spatial = |row: &[f32]| Spatial::from_array([0, 1, 2, 3, 4, 5].map(|k: usize| f64::from(row[k])));
        let weights: Vec<Spatial<f64>> = numbers(6 * m, 3.0).chunks(6).map(spatial).collect();
        let (mut by_nodes, mut by_edges) = (vec![f32::NAN; 3 * n], vec![f32::NAN; 3 * m]);
        semi.adjoint(&graph, &component, &features, scale, &weights, &mut by_nodes, &mut by_edges);
        let products = || {
            let pairs = by_nodes.iter().zip(&nodes).chain(by_edges.iter().zip(&edges));
            pairs.map(|(a, b)| f64::from(*a) * f64::from(*b))
        };
        let expected: f64 = image.iter().zip(&weights).map(|(x, y)| x.dot(*y)).sum();
        let (found, size): (f64, f64) = (products().sum(), products().map(f64::abs).sum());
        // Gradients are in single precision; the walks themselves are tested beside their code.
        assert!((found - expected).abs() < 1e-7 * size, "{which}: {found} {expected} of {size}");
    }
}

#[test]
fn calls_do_not_allocate() {
    let (component, graph, features, scale) = prepared(2);
    let (n, m) = (graph.nodes().len(), graph.edges().len());
    let (mut semi, mut nodes, mut edges, mut dlambda) =
        (Semi::new(&graph), numbers(3 * n, 1.0), numbers(3 * m, 2.0), zeros(m));
    let count = allocation_counter::measure(|| {
        semi.dlambda(&graph, &component, &features, scale, &nodes, &edges, &mut dlambda);
        semi.adjoint(&graph, &component, &features, scale, &dlambda, &mut nodes, &mut edges);
    });
    assert_eq!(count.count_total, 0);
}

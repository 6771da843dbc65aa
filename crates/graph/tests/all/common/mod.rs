//! Rods and trees in motion, and their features.
#![allow(dead_code, missing_docs, unreachable_pub)]

use std::sync::Arc;

use component::{Component, Members, split};
use dynamics::formulation::Formulation;
use dynamics::simulation::{Settings, Simulation};
use dynamics::step::StepParams;
use graph::{Graph, body_frame};
use kernels::Spatial;
use nalgebra::{UnitQuaternion, Vector3};
use rod::{Assembly, Material, Model, RodSpec, State, shape};

pub const DT: f64 = 0.02;
const SOFT: Material = Material { youngs_modulus: 1e5, torsion_modulus: 2e5, density: 100.0 };

/// A straight rod in the plane of x and z, its first segment fixed.
pub fn rod(segments: usize, angle: f64) -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    let direction = Vector3::new(angle.cos(), 0.0, angle.sin());
    let nodes = shape::straight(Vector3::zeros(), direction, 3.0, segments);
    let rod = assembly.rod(&RodSpec::new(nodes, 0.05, SOFT));
    assembly.fix(rod.start);
    assembly.finish()
}

/// A trunk clamped at its foot, with branches and a twig; `order` permutes the rods that are not the trunk.
pub fn tree(swapped: bool) -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::new(1.0, 0.0, -9.81));
    let line = |from: Vector3<f64>, direction: Vector3<f64>, n| {
        RodSpec::new(shape::straight(from, direction, 0.15 * n as f64, n), 0.02, SOFT)
    };
    let trunk = assembly.rod(&line(Vector3::zeros(), Vector3::z(), 6));
    assembly.clamp_start(&trunk);
    let mut branches = [(2, 1.0, Vector3::new(1.0, 0.2, 0.5), 4_usize), (4, 0.5, Vector3::new(-1.0, 0.0, 1.0), 3)];
    if swapped {
        branches.reverse();
    }
    for (parent, fraction, direction, n) in branches {
        let from = Vector3::new(0.0, 0.0, 0.15 * (parent as f64 + fraction));
        let branch = assembly.rod(&line(from, direction, n));
        assembly.branch(parent, fraction, &branch);
    }
    assembly.finish()
}

/// A helix, its first segment fixed.
pub fn helix(segments: usize) -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    let rod = assembly.rod(&RodSpec::new(shape::helix(Vector3::zeros(), 0.5, 0.5, 2.5, segments), 0.05, SOFT));
    assembly.fix(rod.start);
    assembly.finish()
}

/// The state after some steps.
pub fn advance(model: &Model, state: &mut State, steps: usize) {
    let step = StepParams { formulation: Formulation::Xpbd, ..StepParams::default() };
    let mut simulation = Simulation::new(model, state, &Settings { step, ..Settings::default() }, None).unwrap();
    for _ in 0..steps {
        simulation.step(DT).unwrap();
    }
    simulation.store(state);
}

/// Moves everything: x' = R x + shift.
pub fn moved(model: &Model, state: &State, turn: UnitQuaternion<f64>, shift: Vector3<f64>) -> (Model, State) {
    let (mut model, mut state) = (model.clone(), state.clone());
    model.gravity = turn * model.gravity;
    for anchor in &mut model.anchors {
        anchor.position = turn * anchor.position + shift;
        anchor.orientation = turn * anchor.orientation;
    }
    state.positions.iter_mut().for_each(|x| *x = turn * *x + shift);
    state.orientations.iter_mut().for_each(|q| *q = turn * *q);
    state.velocities.iter_mut().chain(&mut state.angular_velocities).for_each(|v| *v = turn * *v);
    (model, state)
}

/// The first linear system of the next step.
pub fn component(model: &Model, state: &State) -> (Component<f64>, Graph, Members) {
    let (members, topology) = split(model).swap_remove(0);
    let graph = Graph::new(model, &members, &topology);
    let mut component = Component::new(model, state, Arc::new(topology), &[&members]);
    component.predict(0.0, DT, Formulation::Xpbd);
    component.evaluate(Formulation::Xpbd);
    (component, graph, members)
}

/// All body-frame features, row by row.
#[derive(Debug)]
pub struct All {
    pub scale: f64,
    pub node_constant: Vec<f32>,
    pub edge_constant: Vec<f32>,
    pub nodes: Vec<f32>,
    pub edges: Vec<f32>,
}

pub fn features(graph: &Graph, component: &Component<f64>) -> All {
    let (n, m) = (graph.nodes().len(), graph.edges().len());
    let mut all = All {
        scale: 0.0,
        node_constant: vec![f32::NAN; n * body_frame::NODE_CONSTANT],
        edge_constant: vec![f32::NAN; m * body_frame::EDGE_CONSTANT],
        nodes: vec![f32::NAN; n * body_frame::NODE_CHANGING],
        edges: vec![f32::NAN; m * body_frame::EDGE_CHANGING],
    };
    body_frame::fill_constant_nodes(graph, &mut all.node_constant);
    body_frame::fill_constant_edges(graph, DT, &mut all.edge_constant);
    all.scale = body_frame::Features::new(graph).fill(graph, component, &mut all.nodes, &mut all.edges);
    all
}

pub fn assert_close(a: &[f32], b: &[f32], tolerance: f32) {
    assert_eq!(a.len(), b.len());
    for (i, (x, y)) in a.iter().zip(b).enumerate() {
        assert!((x - y).abs() <= tolerance * (1.0 + x.abs()), "{i}: {x} {y}");
    }
}

pub fn zeros(n: usize) -> Vec<Spatial<f64>> {
    vec![Spatial::zero(); n]
}

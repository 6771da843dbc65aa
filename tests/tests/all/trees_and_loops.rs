//! Trees and loops: statics of branches, closure of rings, reactions of clamps.

use std::f64::consts::TAU;

use acceptance::{Beam, assert_order, end_of, relaxed, run, tight};
use cosserat::assembly::{Assembly, RodSpec, shape};
use cosserat::internals::component::{Component, split};
use cosserat::internals::jointed::linear::LinearSolver;
use cosserat::internals::kernels::Spatial;
use cosserat::internals::kernels::math::Vec3;
use cosserat::simulation::{Formulation, Settings, SolverKind};
use cosserat::state::{Body, Joint, Model, State, measure};
use cosserat::statics::{StaticParams, equilibrium};
use nalgebra::{Rotation3, Vector3};

/// Gravity so small that the beam theory of small deflections holds to 1e-8.
fn small_gravity(beam: &Beam) -> f64 {
    beam.gravity_for(1e-4)
}

/// A trunk along x, clamped at the origin, with two level branches of half its length, of as long segments, at its end,
/// at `angle` [rad] to either side of straight on. Returns the drops of the trunk's and of the branches' ends.
fn two_branches(segments: usize, angle: f64, branch_joint: impl Fn(&mut Joint)) -> [f64; 3] {
    let beam = Beam::rubber(segments);
    let (mut assembly, trunk) = beam.cantilever(Vector3::new(0.0, 0.0, -small_gravity(&beam)));
    let mut ends = vec![trunk.end - 1];
    for side in [1.0, -1.0] {
        let direction = Rotation3::from_axis_angle(&Vector3::z_axis(), side * angle) * Vector3::x();
        let branch = Beam { length: 0.5 * beam.length, segments: segments / 2, ..beam };
        let branch = assembly.rod(&branch.spec(Vector3::x() * beam.length, direction));
        assembly.branch(trunk.end - 1, 1.0, &branch);
        assembly.model_mut().measure_bent_from_rest(&[]);
        branch_joint(assembly.model_mut().joints.last_mut().unwrap());
        ends.push(branch.end - 1);
    }
    let (model, state) = relaxed(assembly);
    [0, 1, 2].map(|k| -end_of(&model, &state, ends[k]).z)
}

/// Drops of the trunk's and the branches' ends by beam theory: the branches hang on the trunk's end with their weight and,
/// at an angle to it, with a moment; their own ends drop with the trunk's end and slope, and bend besides.
fn beam_theory(beam: &Beam, angle: f64) -> [f64; 2] {
    let (length, bending) = (beam.length, beam.bending());
    let load = beam.line_density() * small_gravity(beam);
    let branch = 0.5 * length;
    let force = 2.0 * load * branch;
    let moment = force * 0.5 * branch * angle.cos();
    let drop = load * length.powi(4) / (8.0 * bending)
        + force * length.powi(3) / (3.0 * bending)
        + moment * length.powi(2) / (2.0 * bending);
    let slope =
        load * length.powi(3) / (6.0 * bending) + force * length.powi(2) / (2.0 * bending) + moment * length / bending;
    [drop, drop + slope * branch * angle.cos() + load * branch.powi(4) / (8.0 * bending)]
}

/// A T, with branches square to the trunk: a branch's joint bends over one segment, half a segment more than lies between
/// the trunk's end and the branch's first centre, an error of first order in the branch's own bending. With the half
/// segment alone the second order comes back, given that the joint resists bending and twist alike: its Darboux vector
/// lives half-way between trunk and branch, where the branch's bending is part bending, part twist.
#[test]
fn a_t_droops_as_beam_theory_says() {
    let angle = 0.25 * TAU;
    let drops = droops("T", angle, |_| {});
    assert_order("T, end of the trunk", &drops.map(|[trunk, _]| trunk), 2.0);
    assert_order("T, end of a branch", &drops.map(|[_, branch]| branch), 1.0);
    let halved = droops("T", angle, |joint| {
        joint.length *= 0.5;
        joint.rest_darboux *= 2.0;
        joint.bend_compliance *= 2.0;
        joint.twist_compliance = joint.bend_compliance;
    });
    assert_order("T, end of a branch, joint of half a segment", &halved.map(|[_, branch]| branch), 2.0);
    assert!(drops[2][1].abs() < 1e-3 && halved[2][1].abs() < 1e-4);
}

/// A Y, whose joints also bend for the trunk's last half segment: most of the error of first order is gone.
#[test]
fn a_y_droops_as_beam_theory_says() {
    let drops = droops("Y", 0.1 * TAU, |_| {});
    assert_order("Y, end of the trunk", &drops.map(|[trunk, _]| trunk), 2.0);
    assert!(drops.iter().all(|[_, branch]| branch.abs() < 2e-4));
}

/// Relative errors of the drops of the trunk's and the branches' ends at N = 40, 80, 160.
fn droops(case: &str, angle: f64, branch_joint: impl Fn(&mut Joint)) -> [[f64; 2]; 3] {
    let exact = beam_theory(&Beam::rubber(1), angle);
    [40, 80, 160].map(|segments| {
        let [trunk, left, right] = two_branches(segments, angle, &branch_joint);
        assert!((left / right - 1.0).abs() < 1e-9, "{case}: the two sides differ: {left} and {right}");
        let errors = [trunk / exact[0] - 1.0, left / exact[1] - 1.0];
        println!("{case}, N = {segments}: trunk {:.2e}, branches {:.2e}", errors[0], errors[1]);
        errors
    })
}

/// A clamped trunk with five branches, two of them at the same place.
fn tree(gravity: Vector3<f64>) -> (Model, State) {
    let beam = Beam::rubber(20);
    let mut assembly = Assembly::new(gravity);
    let trunk = assembly.rod(&beam.spec(Vector3::zeros(), Vector3::z()));
    for (k, place) in [4, 9, 9, 14, 19].into_iter().enumerate() {
        let angle = TAU * 0.4 * k as f64;
        let direction = Vector3::new(angle.cos(), angle.sin(), 0.7);
        let short = Beam { length: 0.4, segments: 8, ..beam };
        let root = Vector3::z() * (beam.segment_length() * (place as f64 + 1.0));
        let branch = assembly.rod(&short.spec(root, direction));
        assembly.branch(trunk.start + place, 1.0, &branch);
    }
    assembly.clamp_start(&trunk);
    assembly.finish()
}

/// Elimination along the tree against sparse Cholesky, on one linear system of a tree in motion.
#[test]
fn the_tree_solver_solves_what_the_sparse_one_does() {
    let (model, state) = tree(Vector3::new(0.0, 0.0, -9.81));
    for (formulation, dt) in Formulation::ALL.into_iter().flat_map(|f| [(f, 0.01), (f, 1.0)]) {
        let (members, topology) = split(&model).remove(0);
        let topology = std::sync::Arc::new(topology);
        let mut component = Component::new(&model, &state, topology.clone(), &[&members]);
        component.predict(0.0, dt, formulation);
        component.evaluate(formulation);
        let [mut tree, mut sparse] = [SolverKind::Direct, SolverKind::Sparse].map(|kind| {
            let mut solver: Box<dyn LinearSolver> = kind.build(&model, &members, &topology).unwrap();
            let mut x = vec![Spatial::zero(); model.joints.len()];
            solver.solve(&component.system, false, &mut x);
            x.into_iter()
        });
        let (mut error, mut size) = (0.0, 0.0);
        while let (Some(a), Some(b)) = (tree.next(), sparse.next()) {
            let difference = a.plus(b, -1.0);
            error += difference.dot(difference);
            size += b.dot(b);
        }
        let error = (error / size).sqrt();
        println!("tree against sparse solver, {formulation}, dt = {dt} s: {error:.1e}");
        assert!(error < 1e-6, "{formulation}, dt = {dt}: {error}");
    }
}

#[test]
fn a_ring_that_hangs_by_one_segment_stays_closed() {
    for formulation in Formulation::ALL {
        let mut settings = Settings::default();
        settings.step.formulation = formulation;
        // Newton's matrix leaves out how the joints' torques turn: as the ring's moments grow, its momentum residual falls
        // by no more than a third an iteration.
        settings.step.max_iterations = 100;
        let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
        let nodes = shape::ring(Vector3::zeros(), 0.5, 60);
        let rod = assembly.rod(&RodSpec { closed: true, ..RodSpec::new(nodes, 0.01, Beam::rubber(1).material) });
        assembly.fix(rod.start);
        let (model, state) = assembly.finish();
        // It falls from level to hanging and swings.
        let (_, end) = run(&model, &state, &settings, 0.01, 100);
        let lowest = end.positions.iter().map(|x| x.z).fold(0.0, f64::min);
        let gap = measure::worst_gap(&model, &end);
        println!("ring, {formulation}: worst gap {gap:.1e} of a segment, lowest point {lowest:.3} m");
        assert!(lowest < -0.5, "{formulation}: {lowest}");
        assert!(gap < 1e-5, "{formulation}: {gap}");
    }
}

/// Force on the rods from the clamped or fixed bodies that `holds`, over one step from rest.
fn reaction(model: &Model, state: &State, formulation: Formulation, holds: impl Fn(Body) -> bool) -> Vector3<f64> {
    let dt = 0.01;
    let mut settings = tight();
    settings.step.formulation = formulation;
    let (simulation, end) = run(model, state, &settings, dt, 1);
    let moved = end.positions.iter().zip(&state.positions).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    assert!(moved < 1e-7, "{formulation}: an equilibrium moves by {moved}");
    let component = simulation.singles().next().expect("one set of segments");
    let mut force = Vector3::zeros();
    for (joint, lambda) in model.joints.iter().zip(&component.lambda) {
        let Vec3(on_a) = lambda.linear;
        // lambda / dt^2 acts on body a, its opposite on body b.
        let on_a = Vector3::from(on_a) / (dt * dt);
        force += if holds(joint.a) { -on_a } else { Vector3::zeros() };
        force += if holds(joint.b) { on_a } else { Vector3::zeros() };
    }
    force
}

#[test]
fn the_clamp_carries_weight_and_loads() {
    let beam = Beam::rubber(30);
    let gravity = Vector3::new(0.0, 0.0, -beam.gravity_for(5.0));
    let (mut assembly, rod) = beam.cantilever(gravity);
    let push = Vector3::new(0.1, 0.3, -0.2) * beam.bending();
    assembly.load(beam.end_load(&rod, push, Vector3::zeros()));
    // Both formulations have an equilibrium of the same joints.
    assembly.model_mut().measure_as_in_paper();
    let (model, state) = relaxed(assembly);
    let expected = -(gravity * beam.line_density() * beam.length + push);
    for formulation in Formulation::ALL {
        let force = reaction(&model, &state, formulation, |body| matches!(body, Body::Anchor(_)));
        println!("reaction, {formulation}: off by {:.1e}", (force - expected).norm() / expected.norm());
        assert!((force - expected).norm() < 1e-6 * expected.norm(), "{formulation}: {force} instead of {expected}");
    }
}

#[test]
fn the_nail_carries_a_ring_and_the_root_a_tree() {
    let beam = Beam::rubber(20);
    let gravity = Vector3::new(0.0, 0.0, -beam.gravity_for(20.0));
    let weight = |model: &Model| gravity * model.segments.iter().map(|s| s.mass()).sum::<f64>();

    let mut assembly = Assembly::new(gravity);
    let nodes = shape::ring(Vector3::zeros(), 0.2, 40).iter().map(|x| Vector3::new(x.x, 0.0, x.y)).collect();
    let ring = assembly.rod(&RodSpec { closed: true, ..RodSpec::new(nodes, beam.radius, beam.material) });
    assembly.fix(ring.start + 9);
    assembly.model_mut().measure_as_in_paper();
    let (model, state) = relaxed(assembly);
    let hung = weight(&model) * (39.0 / 40.0);
    for formulation in Formulation::ALL {
        let force = reaction(&model, &state, formulation, |body| body == Body::Segment(9));
        assert!((force + hung).norm() < 1e-6 * hung.norm(), "ring, {formulation}: {force} instead of {hung}");
    }

    let (mut model, mut state) = tree(gravity);
    model.measure_as_in_paper();
    let report = equilibrium(&model, &mut state, &StaticParams::default()).unwrap();
    assert!(report.converged, "{report:?}");
    for formulation in Formulation::ALL {
        let force = reaction(&model, &state, formulation, |body| matches!(body, Body::Anchor(_)));
        let expected = -weight(&model);
        assert!((force - expected).norm() < 1e-6 * expected.norm(), "tree, {formulation}: {force}");
    }
}

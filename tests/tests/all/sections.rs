//! Sections that are not round against theory: frequencies, lateral buckling, torsion, snapping through.

use std::f64::consts::PI;

use acceptance::vibration::{Mode, bending_mode};
use acceptance::{end_of, relaxed};
use cosserat::assembly::{Assembly, Load, Material, RestShape, RodSpec, Section, shape};
use cosserat::scene;
use cosserat::simulation::{Settings, Simulation, Status};
use cosserat::state::{Model, State};
use cosserat::statics::{StaticParams, equilibrium};
use nalgebra::{UnitQuaternion, Vector3};

const RUBBER: Material = Material { youngs_modulus: 1e7, torsion_modulus: 4e6, density: 1000.0 };

/// One metre along x with d1 along y, so that d2 points up.
fn along_x(section: Section, segments: usize) -> RodSpec {
    let nodes = shape::straight(Vector3::zeros(), Vector3::x(), 1.0, segments);
    let radius = section.contact_radius().unwrap();
    RodSpec { sections: vec![section], d1: Some(Vector3::y()), ..RodSpec::new(nodes, radius, RUBBER) }
}

/// A cantilever with a load at its end face.
fn loaded(spec: &RodSpec, force: Vector3<f64>, torque: Vector3<f64>) -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::zeros());
    let rod = assembly.rod(spec);
    assembly.clamp_start(&rod);
    assembly.load(Load { segment: rod.end - 1, offset: 0.5 / rod.len() as f64, force, torque, follows: false });
    relaxed(assembly)
}

#[test]
fn a_rectangular_cantilever_has_two_frequencies() {
    let (width, height) = (2e-3, 5e-3);
    let section = Section::Rectangle { width, height };
    let beta = 1.875104;
    let line_density = RUBBER.density * width * height;
    // In the plane of d1 it bends about d2, and the other way round.
    let [up, aside] =
        section.second_moments().map(|moment| beta * beta * (RUBBER.youngs_modulus * moment / line_density).sqrt());
    let frequency = |direction: Vector3<f64>, exact: f64| {
        let mut assembly = Assembly::new(Vector3::zeros());
        let rod = assembly.rod(&along_x(section, 80));
        assembly.clamp_start(&rod);
        let modes: Vec<(f64, f64)> = rod.map(|i| bending_mode(beta, (i as f64 + 0.5) / 80.0)).collect();
        let state = assembly.state_mut();
        for (i, (weight, slope)) in modes.iter().enumerate() {
            state.velocities[i] = direction * (1e-4 * exact * weight);
            state.angular_velocities[i] = Vector3::x().cross(&direction) * (1e-4 * exact * slope);
        }
        let (model, state) = assembly.finish();
        let along =
            |state: &State| modes.iter().zip(&state.positions).map(|(mode, x)| mode.0 * x.dot(&direction)).sum();
        Mode::seen(&model, &state, 0.02 / exact, 400, along).frequency
    };
    let found = [frequency(Vector3::z(), up), frequency(Vector3::y(), aside)];
    println!("rectangle: {found:.4?} rad/s, theory {up:.4}, {aside:.4}");
    assert!((found[0] / up - 1.0).abs() < 2e-3 && (found[1] / aside - 1.0).abs() < 2e-3);
    assert!((found[0] / found[1] / (height / width) - 1.0).abs() < 1e-3);
}

/// Both directions of a small load at once: F L^3 / (3 E I) each, about its own axis.
#[test]
fn a_rectangular_cantilever_bends_less_about_its_wide_side() {
    let section = Section::Rectangle { width: 8e-3, height: 20e-3 };
    let (model, state) = loaded(&along_x(section, 80), Vector3::new(0.0, 1e-4, 1e-4), Vector3::zeros());
    let tip = end_of(&model, &state, 79);
    let [up, aside] = section.second_moments().map(|moment| 1e-4 / (3.0 * RUBBER.youngs_modulus * moment));
    assert!((tip.z / up - 1.0).abs() < 1e-3 && (tip.y / aside - 1.0).abs() < 1e-3, "{tip}: {aside}, {up}");
}

#[test]
fn an_elliptic_bar_twists_as_saint_venant_says() {
    let (width, height) = (0.02, 0.01);
    let (a, b): (f64, f64) = (0.5 * width, 0.5 * height);
    let stiffness = RUBBER.torsion_modulus * PI * a.powi(3) * b.powi(3) / (a * a + b * b);
    let spec = along_x(Section::Ellipse { width, height }, 40);
    let (_, state) = loaded(&spec, Vector3::zeros(), Vector3::x() * (0.5 * stiffness));
    // From the clamp to the last centre.
    let turn = state.orientations[39].angle_to(&state.orientations[0]);
    assert!((turn / (0.5 * 39.0 / 40.0) - 1.0).abs() < 1e-4, "{turn}");
}

/// Prandtl's lateral buckling of a strip on edge under a load P at its tip: P L^2 = 4.013 sqrt(E I G J) (Timoshenko and Gere,
/// Theory of Elastic Stability, section 6.3). Pushed aside a little, it gives by 1 / (1 - (P / P_crit)^2) near there.
#[test]
fn a_strip_on_edge_buckles_sideways_at_prandtls_load() {
    let section = Section::Rectangle { width: 1e-3, height: 30e-3 };
    let stiffness = section.stiffness(&RUBBER);
    let theory = 4.013 * (stiffness.bending[1] * stiffness.torsion).sqrt();
    let aside = |load: f64| {
        let push = 1e-5 * stiffness.bending[1];
        let (model, state) = loaded(&along_x(section, 60), Vector3::new(0.0, push, -load), Vector3::zeros());
        end_of(&model, &state, 59).y
    };
    let [low, high] = [0.9, 0.97].map(|share: f64| ((share * theory).powi(2), 1.0 / aside(share * theory)));
    let critical = (high.0 + (high.0 - low.0) * high.1 / (low.1 - high.1)).sqrt();
    println!("lateral buckling: {:.4} of the theory's load", critical / theory);
    assert!((critical / theory - 1.0).abs() < 0.02, "{critical} instead of {theory}");
}

/// An arch of a strip whose ends were brought together by Delta L, and one of them turned by alpha: it snaps through at
/// alpha = 1.7818 sqrt(Delta L / L) (Gomez, Moulton and Vella, Nature Physics 13, 2017).
#[test]
fn an_arch_snaps_through_where_theory_says() {
    let (segments, span, rise) = (100, 1.0, 0.045);
    let node = |i: usize| {
        let x = span * i as f64 / segments as f64;
        Vector3::new(x, 0.5 * rise * (1.0 - (2.0 * PI * x).cos()), 0.0)
    };
    let nodes: Vec<_> = (0..=segments).map(node).collect();
    let length: f64 = nodes.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
    let critical = 1.7818 * ((length - span) / length).sqrt();
    let section = Section::Rectangle { width: 20e-3, height: 1e-3 };
    let spec = RodSpec { nodes, rest: RestShape::Straight, d1: Some(Vector3::z()), ..along_x(section, segments) };
    let mut assembly = Assembly::new(Vector3::zeros());
    let rod = assembly.rod(&spec);
    assembly.clamp_start(&rod).clamp_end(&rod);
    let (mut model, mut state) = assembly.finish();
    // d1 up, d3 along x.
    let level = UnitQuaternion::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(
        nalgebra::Matrix3::from_columns(&[Vector3::z(), -Vector3::y(), Vector3::x()]),
    ));
    let mut height_at = |share: f64| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -share * critical);
        model.anchors[0].orientation = turn * level;
        model.anchors[1].orientation = level;
        let params = StaticParams { max_steps: 40_000, ..StaticParams::default() };
        assert!(equilibrium(&model, &mut state, &params).unwrap().converged, "{share}");
        state.positions[segments / 2].y / rise
    };
    let heights = [0.0, 0.5, 0.8, 0.95, 1.05].map(&mut height_at);
    println!("snapping through: heights {heights:.3?} at 0, 0.5, 0.8, 0.95, 1.05 of the theory's angle");
    assert!((heights[0] - 1.0).abs() < 0.02 && heights[3] > 0.3 && heights[4] < -0.5, "{heights:?}");
}

/// The builtin scene, in time: its end is turned by so little a step that it snaps near the theory's angle.
#[test]
fn the_builtin_strip_snaps_through() {
    let scene = scene::builtin("strip").unwrap();
    let mut simulation = Simulation::new(&scene.model, &scene.state, &Settings::default(), None).unwrap();
    let mut state = scene.state.clone();
    let critical = 1.7818 * 0.01_f64.sqrt();
    let mut snapped = None;
    for step in 0..scene.run.steps {
        assert_eq!(simulation.step(scene.run.dt).unwrap().status, Status::Converged, "step {step}");
        simulation.store(&mut state);
        let time = scene.run.dt * (step + 1) as f64;
        let angle = 15_f64.to_radians() * ((time - 1.5) / 3.0).clamp(0.0, 1.0);
        if time > 1.5 && state.positions[25].y < 0.0 {
            snapped.get_or_insert(angle / critical);
        }
    }
    println!("the builtin strip snaps at {snapped:.3?} of the theory's angle");
    assert!(snapped.is_some_and(|share| (0.97..1.15).contains(&share)), "{snapped:?}");
    assert!(state.positions[25].y < -0.05);
}

/// Two pieces: beyond the joint of the sections the curvature is the other one's.
#[test]
fn a_stepped_rod_bends_as_its_pieces() {
    let sections = [0.02, 0.01].map(|radius| Section::Circle { radius });
    let list: Vec<Section> = (0..80).map(|i| sections[i / 40]).collect();
    let spec = RodSpec { sections: list, ..along_x(sections[0], 80) };
    let (model, state) = loaded(&spec, Vector3::z() * 1e-4, Vector3::zeros());
    let [thick, thin] = sections.map(|section| section.stiffness(&RUBBER).bending[0]);
    // integral of F (L - s)^2 / B(s).
    let exact = 1e-4 / 3.0 * ((1.0 - 0.125) / thick + 0.125 / thin);
    let tip = end_of(&model, &state, 79).z;
    assert!((tip / exact - 1.0).abs() < 1e-3, "{tip} instead of {exact}");
    let mass: f64 = model.segments.iter().map(|segment| segment.mass()).sum();
    assert!((mass / (RUBBER.density * PI * 0.5 * (4e-4 + 1e-4)) - 1.0).abs() < 1e-12);
}

/// What is said by its stiffnesses moves as what they were computed from, to the last bit.
#[test]
fn a_section_that_is_known_is_the_same_as_what_it_was_measured_of() {
    let section = Section::Rectangle { width: 0.03, height: 0.01 };
    let known = Section::Known { stiffness: section.stiffness(&RUBBER), inertia: section.line_inertia(&RUBBER) };
    let end = [section, known].map(|section| {
        let mut assembly = Assembly::new(Vector3::new(0.0, 3.0, -9.81));
        let rod = assembly.rod(&RodSpec { sections: vec![section], ..along_x(Section::Circle { radius: 0.01 }, 20) });
        assembly.clamp_start(&rod);
        let (model, state) = assembly.finish();
        acceptance::run(&model, &state, &acceptance::tight(), 0.01, 30).1
    });
    assert_eq!(end[0], end[1]);
}

/// A rectangle that lies the other way round, its frame turned by a right angle, is the same rod.
#[test]
fn a_rectangle_turned_by_a_right_angle_is_the_same_rod() {
    let end = [([0.03, 0.01], Vector3::y()), ([0.01, 0.03], Vector3::z())].map(|([width, height], d1)| {
        let mut assembly = Assembly::new(Vector3::new(0.0, 3.0, -9.81));
        let spec = along_x(Section::Rectangle { width, height }, 20);
        let rod = assembly.rod(&RodSpec { d1: Some(d1), twist: 1.0, ..spec });
        assembly.clamp_start(&rod);
        let (model, state) = assembly.finish();
        acceptance::run(&model, &state, &acceptance::tight(), 0.01, 30).1
    });
    for i in 0..20 {
        assert!((end[0].positions[i] - end[1].positions[i]).norm() < 1e-9, "segment {i}");
    }
}

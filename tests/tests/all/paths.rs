//! Equilibria along a course: where they become unstable, and where they turn back.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use acceptance::Beam;
use cosserat::assembly::{Assembly, RestShape, RodSpec, Section, Stretch};
use cosserat::motion::{Change, Changing, Driven, Interpolation, Keyframe, Motion, Track};
use cosserat::scene;
use cosserat::state::{Body, JointForce, Model, State};
use cosserat::statics::{PathEnd, PathEventKind, PathParams, PathPoint, PathReport, StaticParams, equilibrium, path};
use nalgebra::Vector3;

fn followed(model: &Model, state: &State, until: f64) -> (PathReport, Vec<PathPoint>, Vec<State>) {
    let (mut points, mut states) = (Vec::new(), Vec::new());
    let mut each = |point: &PathPoint, state: &State, _: &[JointForce]| {
        points.push(*point);
        states.push(state.clone());
        true
    };
    let report = path(model, &mut state.clone(), &PathParams::until(until), &mut each).unwrap();
    println!(
        "{} points, {} solves, {:?}, {:?}",
        report.points,
        report.solves,
        report.end,
        &report.events[..report.events.len().min(5)]
    );
    assert_eq!(report.points, points.len());
    (report, points, states)
}

/// A motion of an anchor that begins where it is: shifts and turns since the start [rad] at times [s].
fn moved(model: &mut Model, anchor: usize, keyframes: &[(f64, Vector3<f64>, Vector3<f64>)]) {
    let pose = model.anchors[anchor];
    let mut last = Vector3::zeros();
    let keyframe = |&(time, shift, turn): &(f64, Vector3<f64>, Vector3<f64>)| {
        let since = turn - last;
        last = turn;
        Keyframe { time, position: pose.position + shift, turn: since }
    };
    let keyframes: Vec<Keyframe> = keyframes.iter().map(keyframe).collect();
    let motion = Motion::new(pose.orientation, &keyframes, Interpolation::Linear).unwrap();
    model.motions.push(Driven::new(Body::Anchor(anchor), Arc::new(motion)));
}

/// Greenhill (1881): a column clamped at its foot buckles at `rho g A L^3 / B = 7.8373`, in two directions at once.
#[test]
fn greenhills_column_buckles_where_he_says() {
    let theory = 7.837_347;
    let errors = [25, 50, 100].map(|segments| {
        let beam = Beam::rubber(segments);
        let mut assembly = Assembly::new(Vector3::zeros());
        let rod = assembly.rod(&beam.spec(Vector3::zeros(), Vector3::z()));
        assembly.clamp_start(&rod);
        let (mut model, state) = assembly.finish();
        let most = beam.gravity_for(10.0);
        let values = [(0.0, Vector3::zeros()), (1.0, Vector3::z() * -most)];
        let track = Arc::new(Track::new(&values, Interpolation::Linear).unwrap());
        model.changes.push(Change { of: Changing::Gravity, track });
        let (report, points, states) = followed(&model, &state, 1.0);
        assert_eq!(report.end, PathEnd::Until);
        let [event] = report.events[..] else { panic!("{:?}", report.events) };
        assert_eq!((event.kind, event.unstable), (PathEventKind::Bifurcation, [0, 2]));
        assert!((points[event.point].time - event.time).abs() < 1e-6);
        // It goes on straight.
        let aside = states.last().unwrap().positions.iter().map(|x| x.xy().norm()).fold(0.0, f64::max);
        assert!(aside < 1e-9, "{aside}");
        event.time * 10.0 / theory - 1.0
    });
    acceptance::assert_order("Greenhill", &errors, 2.0);
    assert!(errors[2].abs() < 1e-3);
}

/// Michell (1889): a straight rod bent to a circle, whose ends are turned against each other, leaves its plane at the twist
/// `2 pi sqrt(3) B / C`, in two directions at once. The grip at its ends takes nothing but its motions as a whole.
#[test]
fn michells_ring_leaves_its_plane_where_he_says() {
    let errors = [120, 240].map(|segments| {
        let beam = Beam::rubber(segments);
        let theory = TAU * 3.0_f64.sqrt() * beam.bending() / beam.torsion();
        let node = |k: usize| {
            let (sin, cos) = (TAU * k as f64 / segments as f64).sin_cos();
            Vector3::new(sin, 1.0 - cos, 0.0) / TAU
        };
        let mut assembly = Assembly::new(Vector3::zeros());
        let nodes: Vec<_> = (0..=segments).map(node).collect();
        // Without twist the ring swings freely about the tangent at its grip.
        let (first, more) = (10.0, 8.0);
        let share = (segments - 1) as f64 / segments as f64;
        let spec = RodSpec::new(nodes, beam.radius, beam.material);
        let rod = assembly.rod(&RodSpec { rest: RestShape::Straight, twist: first * share, ..spec });
        assembly.clamp_start(&rod).clamp_end(&rod);
        let (mut model, state) = assembly.finish();
        let tangent = model.anchors[1].orientation * Vector3::z();
        moved(&mut model, 1, &[(0.0, Vector3::zeros(), Vector3::zeros()), (1.0, Vector3::zeros(), tangent * more)]);
        let (report, ..) = followed(&model, &state, 1.0);
        // The path goes on in the plane, or with the ring that leaves it, which is unstable and leads back.
        let [event] = report.events[..] else { panic!("{:?}", report.events) };
        let in_plane = (report.end, event.kind, event.unstable) == (PathEnd::Until, PathEventKind::Bifurcation, [0, 2]);
        let beyond = (report.end, event.kind, event.unstable) == (PathEnd::Start, PathEventKind::Fold, [0, 1]);
        assert!(in_plane || beyond, "{report:?}");
        (first + event.time * more) / theory - 1.0
    });
    println!("{errors:?}");
    assert!(errors[0].abs() < 1e-3 && errors[1].abs() < 0.3 * errors[0].abs());
}

/// Share of its length by which the strip below is pushed together: between the first and the second load of buckling.
const PUSHED: f64 = 1.6e-3;

/// Thickness of the strip [m], of length 1.
const THICKNESS: f64 = 0.0175;

/// A strip that gives way along its axis, pushed together and bent to one side. Its start turns further to that side, to `most`
/// [rad] at time 1, then to the other one; with the state at rest, and the sign of the first turn about z.
fn strip(segments: usize, most: f64) -> (Model, State, f64) {
    let beam = Beam::rubber(segments);
    let mut assembly = Assembly::new(Vector3::zeros());
    let sections = vec![Section::Rectangle { width: 0.1, height: THICKNESS }];
    let spec = beam.spec(Vector3::zeros(), Vector3::x());
    let rod = assembly.rod(&RodSpec { sections, d1: Some(Vector3::z()), stretch: Stretch::Physical, ..spec });
    assembly.clamp_start(&rod).clamp_end(&rod);
    let (mut model, mut state) = assembly.finish();
    model.anchors[1].position.x -= PUSHED;
    assert!(equilibrium(&model, &mut state, &StaticParams::default()).unwrap().converged);
    let side = state.positions[segments / 2].y.signum();
    let zero = Vector3::zeros();
    let turn = Vector3::z() * (side * most);
    moved(&mut model, 0, &[(0.0, zero, zero), (1.0, zero, turn), (3.0, zero, -turn)]);
    (model, state, side)
}

/// Angle of the fold [rad]: the largest of all shallow shapes `w'''' + k^2 w'' = 0`, `w(0) = w(1) = w'(1) = 0`, `w'(0) = angle`
/// whose push is `k^2 I / A + int w'^2 / 2`, with k between the load of the strip's arch, 2 pi, and that of the straight strip.
fn fold_of_shallow_strip() -> f64 {
    let radius_squared = THICKNESS * THICKNESS / 12.0;
    let angle = |k: f64| {
        // w = a + b x + c sin(k x) + d cos(k x), with w'(0) = 1.
        let (sin, cos) = k.sin_cos();
        let matrix = nalgebra::Matrix4::new(
            1.0,
            0.0,
            0.0,
            1.0, //
            1.0,
            1.0,
            sin,
            cos, //
            0.0,
            1.0,
            k,
            0.0, //
            0.0,
            1.0,
            k * cos,
            -k * sin,
        );
        let [_, b, c, d]: [f64; 4] = matrix.lu().solve(&nalgebra::Vector4::new(0.0, 0.0, 1.0, 0.0)).unwrap().into();
        let steps = 1000;
        let slope = |x: f64| b + c * k * (k * x).cos() - d * k * (k * x).sin();
        let squared: f64 =
            (0..steps).map(|i| slope((f64::from(i) + 0.5) / f64::from(steps)).powi(2)).sum::<f64>() / f64::from(steps);
        (2.0 * (PUSHED - k * k * radius_squared) / squared).sqrt()
    };
    let last = (PUSHED / radius_squared).sqrt();
    assert!(last > TAU && last < 8.98, "{last}");
    (1..2000).map(|i| angle(TAU + (last - TAU) * f64::from(i) / 2000.0)).fold(0.0, f64::max)
}

/// A strip between two clamps, one of which turns, snaps through: its path has two folds, mirror images of each other, and a
/// part between them that is unstable.
#[test]
fn a_strip_snaps_through_at_two_folds() {
    let (theory, most) = (fold_of_shallow_strip(), 0.08);
    let errors = [25, 50, 100].map(|segments| {
        let (model, state, _) = strip(segments, most);
        let (report, points, _) = followed(&model, &state, 3.0);
        assert_eq!(report.end, PathEnd::Until);
        let [first, second] = report.events[..] else { panic!("{:?}", report.events) };
        assert_eq!((first.kind, first.unstable), (PathEventKind::Fold, [0, 1]));
        assert_eq!((second.kind, second.unstable), (PathEventKind::Fold, [1, 0]));
        let angle = |time: f64| (time - 2.0) * most;
        assert!((angle(first.time) + angle(second.time)).abs() < 1e-5 * angle(first.time), "{report:?}");
        assert_eq!(points.last().map(|point| point.time), Some(3.0));
        angle(first.time) / theory - 1.0
    });
    println!("against the theory of shallow strips, {theory} rad: {errors:?}");
    // Shapes that are not quite shallow differ by terms of the order of the push.
    assert!(errors[2].abs() < 2.0 * PUSHED, "{errors:?}");
    let [coarse, fine] = [errors[0] - errors[1], errors[1] - errors[2]];
    assert!((coarse / fine / 4.0 - 1.0).abs() < 0.15, "of second order: {errors:?}");
}

/// Driven up and down in small steps, each from the equilibrium before, the strip jumps where the path has its folds.
#[test]
fn steps_of_the_load_jump_at_the_folds() {
    let most = 0.08;
    let (mut model, state, side) = strip(25, most);
    let (report, _, states) = followed(&model, &state, 3.0);
    let [first, second] = report.events[..] else { panic!("{:?}", report.events) };
    model.motions.clear();
    let pose = model.anchors[0].orientation;
    let jump = |begin: &State, from: f64, to: f64| {
        let mut model = model.clone();
        let mut state = begin.clone();
        let steps = 12;
        let mut jumps = Vec::new();
        for k in 0..=steps {
            let time = from + (to - from) * f64::from(k) / f64::from(steps);
            let turn = nalgebra::UnitQuaternion::from_scaled_axis(Vector3::z() * (side * (2.0 - time) * most));
            model.anchors[0].orientation = turn * pose;
            let before = state.clone();
            let params = StaticParams { leave_unstable: false, ..StaticParams::default() };
            assert!(equilibrium(&model, &mut state, &params).unwrap().converged, "{time}");
            let moved = state.positions.iter().zip(&before.positions).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            if moved > 0.01 {
                jumps.push(time);
            }
        }
        jumps
    };
    let width = 0.012;
    for (event, way) in [(first, 1.0), (second, -1.0)] {
        // The equilibrium of the path a little before the fold, on its stable side.
        let stable = if way > 0.0 { event.point - 1 } else { event.point };
        let from = event.time - way * 0.5 * width;
        let jumps = jump(&states[stable], from, event.time + way * 0.5 * width);
        println!("{way}: fold at {}, jumps at {jumps:?}", event.time);
        assert_eq!(jumps.len(), 1, "{jumps:?}");
        assert!((jumps[0] - event.time).abs() < width / 12.0 * 1.01, "{jumps:?}, fold at {}", event.time);
    }
}

/// Beyond Euler's load a strut that is pushed a little aside has a stable path, and no bifurcation.
#[test]
fn an_imperfect_strut_bends_without_a_bifurcation() {
    let beam = Beam::rubber(20);
    for (aside, events) in [(0.0, 1), (1e-3, 0)] {
        let (mut assembly, rod) = beam.cantilever(Vector3::zeros());
        let euler = PI.powi(2) * beam.bending() / (4.0 * beam.length.powi(2));
        assembly.load(beam.end_load(&rod, Vector3::y() * (aside * euler), Vector3::zeros()));
        let (mut model, state) = assembly.finish();
        let start = model.loads[0].force;
        let values = [(0.0, start), (1.0, start - Vector3::x() * (2.0 * euler))];
        let track = Arc::new(Track::new(&values, Interpolation::Linear).unwrap());
        model.changes.push(Change { of: Changing::Force(0), track });
        let (report, points, states) = followed(&model, &state, 1.0);
        assert_eq!(report.events.len(), events);
        for event in &report.events {
            assert_eq!((event.kind, event.unstable), (PathEventKind::Bifurcation, [0, 2]));
            assert!((2.0 * event.time - 1.0).abs() < 2e-3, "{event:?}");
        }
        let end = states.last().unwrap().positions.last().unwrap();
        assert_eq!(points.last().unwrap().unstable > 0, events > 0);
        assert_eq!(end.x < 0.5, events == 0, "{end}");
    }
}

/// However long the steps are, one ends beside the bifurcation for some of them: the way goes straight on all the same, and the
/// bifurcation is the only one.
#[test]
fn a_column_stays_straight_whatever_the_steps() {
    let beam = Beam::rubber(20);
    let mut assembly = Assembly::new(Vector3::zeros());
    let rod = assembly.rod(&beam.spec(Vector3::zeros(), Vector3::z()));
    assembly.clamp_start(&rod);
    let (mut model, state) = assembly.finish();
    let values = [(0.0, Vector3::zeros()), (1.0, Vector3::z() * -beam.gravity_for(10.0))];
    let track = Arc::new(Track::new(&values, Interpolation::Linear).unwrap());
    model.changes.push(Change { of: Changing::Gravity, track });
    let mut failed = Vec::new();
    for k in 0..40 {
        let longest_step = 0.005 * 1.06_f64.powi(k);
        let mut end = state.clone();
        let params = PathParams { longest_step, ..PathParams::until(1.0) };
        let report = path(&model, &mut end, &params, &mut |_, _, _| true).unwrap();
        let aside = end.positions.iter().map(|x| x.xy().norm()).fold(0.0, f64::max);
        if report.end != PathEnd::Until || report.events.len() != 1 || aside > 1e-9 {
            failed.push((longest_step, report.end, report.events.len(), aside));
        }
    }
    assert!(failed.is_empty(), "{failed:?}");
}

/// The teller stops the path.
#[test]
fn a_path_ends_where_it_is_stopped() {
    let (model, state, _) = strip(20, 0.1);
    let mut count = 0;
    let mut each = |_: &PathPoint, _: &State, _: &[JointForce]| {
        count += 1;
        count < 3
    };
    let report = path(&model, &mut state.clone(), &PathParams::until(3.0), &mut each).unwrap();
    assert_eq!((report.end, report.points), (PathEnd::Stopped, 3));
}

/// Lee's frame of two bars of 120 m, B = 1.44e7 N m^2 and EA = 4.32e7 N: a force down on the second bar, 24 m from the corner,
/// 40,000 N at time 1. `grips` hold its two faces.
fn lees_frame(grips: &str) -> (Model, State) {
    let up = (0..=40).map(|k| format!("[0, 0, {}]", 3 * k));
    let across = (1..=40).map(|k| format!("[{}, 0, 120]", 3 * k));
    let nodes: Vec<String> = up.chain(across).collect();
    let scene = scene::parse(
        &format!(
            "gravity_m_s2 = [0, 0, 0]\nbending = \"rest-rotation\"\n[[rods]]\nradius_m = 1\nstretch = \"physical\"\n\
             section.stiffness = {{ bending_n_m2 = [1.44e9, 1.44e7], torsion_n_m2 = 1.44e8, mass_kg_m = 1, stretch_n = 4.32e7, \
             shear_n = 1e10 }}\nframe.d1 = [1, 0, 0]\nshape.polyline = {{ nodes_m = [{}] }}\n{grips}\n[[rods.loads]]\nsegment = \
             48\nfraction = 0\ntimes_s = [0, 1]\nforces_n = [[0, 0, 0], [0, 0, -40000]]\n",
            nodes.join(", ")
        ),
        "frame.toml",
    )
    .unwrap();
    (scene.model, scene.state)
}

/// Lee, Manuel and Rossow (1968): the frame folds at 18,555 N. Hinges hold its faces, or springs so soft that they do not count.
#[test]
fn lees_frame_folds_between_hinges_and_between_soft_springs() {
    for joint in ["joint = \"hinge\"\naxis = [0, 1, 0]", "stiffness_n_m_rad = [inf, 1e-3, inf]"] {
        let grip = |at: &str| format!("[[rods.grips]]\nat = \"{at}-face\"\n{joint}\n");
        let (model, state) = lees_frame(&(grip("start") + &grip("end")));
        let (report, ..) = followed(&model, &state, 1.0);
        assert_eq!(report.start.stable, Some(true), "{joint}");
        let first = report.events[0];
        assert_eq!(first.kind, PathEventKind::Fold, "{joint}");
        assert!((40_000.0 * first.time / 18_555.0 - 1.0).abs() < 5e-3, "{joint}: {} N", 40_000.0 * first.time);
    }
}

/// Euler: `pi^2 B / L^2` between two hinges, of which one slides along the strut.
#[test]
fn a_strut_between_hinges_buckles_at_eulers_load() {
    let scene = scene::parse(
        "gravity_m_s2 = [0, 0, 0]\n[[rods]]\nradius_m = 0.01\nyoungs_modulus_pa = 2e9\ntorsion_modulus_pa = 8e8\n\
         density_kg_m3 = 1000\nshape.straight = { length_m = 1, segments = 40 }\n[[rods.grips]]\nat = \"start-face\"\njoint = \
         \"hinge\"\naxis = [0, 1, 0]\n[[rods.grips]]\nat = \"end-face\"\njoint = \"hinge\"\naxis = [0, 1, 0]\nstiffness_n_m = \
         [inf, 1e-6]\n[[rods.loads]]\nat = \"end-face\"\ntimes_s = [0, 1]\nforces_n = [[0, 0, 0], [-400, 0, 0]]\n",
        "strut.toml",
    )
    .unwrap();
    let (report, ..) = followed(&scene.model, &scene.state, 0.5);
    let load = 400.0 * report.events[0].time;
    let theory = PI.powi(2) * 2e9 * PI * 1e-8 / 4.0;
    println!("buckles at {load} N, theory {theory} N");
    assert_eq!(report.events[0].kind, PathEventKind::Bifurcation);
    assert!((load / theory - 1.0).abs() < 2e-3, "{load} N");
}

/// Of a rod that nothing changes, joints bear all along what they bear at the start.
#[test]
fn rods_that_stand_still_beside_a_path_keep_their_forces() {
    let rod = |more: &str| {
        format!(
            "[[rods]]\nradius_m = 0.01\nyoungs_modulus_pa = 4e8\ndensity_kg_m3 = 1000\nclamp = [\"start-face\"]\n{more}\n"
        )
    };
    let text = [
        rod("shape.straight = { length_m = 1, segments = 10 }\n\
             loads = [{ at = \"end-face\", times_s = [0, 1], forces_n = [[0, 0, 0], [0, 0, 1]] }]"),
        rod("shape.straight = { start_m = [0, 1, 0], length_m = 1, segments = 10 }"),
    ];
    let scene = scene::parse(&text.concat(), "two.toml").unwrap();
    let still = scene.model.joints.iter().position(|joint| [joint.a, joint.b].contains(&Body::Anchor(1))).unwrap();
    let mut each = |_: &PathPoint, _: &State, forces: &[JointForce]| {
        let weight = PI * 1e-4 * 1000.0 * 9.81;
        assert!((forces[still].force.norm() / weight - 1.0).abs() < 1e-6, "{:?}", forces[still]);
        true
    };
    let report = path(&scene.model, &mut scene.state.clone(), &PathParams::until(1.0), &mut each).unwrap();
    assert_eq!(report.end, PathEnd::Until);
}

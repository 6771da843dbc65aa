//! Contacts against their laws: rest and slip on an incline, the capstan, momentum in a collision, no penetration.

use std::f64::consts::{PI, TAU};

use acceptance::Beam;
use nalgebra::{Unit, UnitQuaternion, Vector3};
use rod::{
    Assembly, Contacts, Friction, Load, Material, Model, Obstacle, ObstacleShape, RodSpec, State, Surface, measure,
    shape,
};
use solver::counters::Counters;
use solver::simulation::{Settings, Simulation};
use solver::step::Status;

fn surface(friction: f64) -> Surface {
    Surface { friction: Friction::new(friction), restitution: 0.0 }
}

fn plane(point: Vector3<f64>, normal: Vector3<f64>, friction: f64) -> Obstacle {
    Obstacle {
        shape: ObstacleShape::HalfSpace { point, normal: Unit::new_normalize(normal) },
        surface: surface(friction),
    }
}

/// Runs, asserts that all steps converge and that nothing is ever deeper than 2 % of a radius in anything else.
fn run(model: &Model, state: &State, dt: f64, steps: usize) -> (State, Counters) {
    let mut simulation = Simulation::new(model, state, &Settings::default(), None).unwrap();
    for step in 0..steps {
        let report = simulation.step(dt).unwrap();
        assert!(report.status <= Status::ConvergedInSubsteps, "step {step}: {:?}", report.status);
    }
    let mut end = state.clone();
    simulation.store(&mut end);
    let counters = simulation.counters();
    println!(
        "  iterations/step {:.2}, retries {}, candidates/search {:.1}, solves/iter {:.1} sweeps/iter {:.1}, deepest {:.1e}, contact {:?} total {:?}",
        counters.iterations as f64 / steps as f64,
        counters.retries,
        counters.contact_candidates as f64 / counters.contact_searches as f64,
        counters.contact_solves as f64 / counters.iterations as f64,
        counters.contact_sweeps as f64 / counters.iterations as f64,
        counters.deepest_penetration,
        counters.times.contact,
        counters.times.total(),
    );
    assert!(counters.deepest_penetration < 0.02);
    (end, counters)
}

/// How far a rod of 10 segments along the slope slides down within a second on an incline of `angle`.
fn slide(angle: f64, friction: f64) -> f64 {
    let beam = Beam { segments: 10, ..Beam::rubber(10) };
    let gravity = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -angle) * Vector3::new(0.0, 0.0, -9.81);
    let mut assembly = Assembly::new(gravity);
    assembly.rod(&beam.spec(Vector3::new(0.0, 0.0, beam.radius), Vector3::x()));
    let (mut model, state) = assembly.finish();
    model.contacts.obstacles.push(plane(Vector3::zeros(), Vector3::z(), friction));
    let (end, _) = run(&model, &state, 0.01, 100);
    (end.positions[5] - state.positions[5]).norm()
}

#[test]
fn a_rod_rests_on_an_incline_below_the_angle_of_friction_and_slides_above() {
    for friction in [0.1, 0.5, 1.0] {
        let angle = |factor: f64| (friction * factor).atan();
        let (below, above) = (slide(angle(0.99), friction), slide(angle(1.01), friction));
        // a = g (sin - mu cos) over a second.
        let theory = 0.5 * 9.81 * (angle(1.01).sin() - friction * angle(1.01).cos());
        println!("mu {friction}: below {below:.2e} m, above {above:.4} m, theory {theory:.4} m");
        assert!(below < 1e-4, "{below}");
        assert!((above / theory - 1.0).abs() < 0.05, "{above} {theory}");
    }
}
#[test]
fn a_fast_rod_stops_on_the_ground() {
    let beam = Beam::rubber(20);
    for (velocity, direction) in [(50.0, Vector3::x()), (50.0, Vector3::new(1.0, 0.0, 1.0)), (1.0, Vector3::z())] {
        let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
        assembly.rod(&beam.spec(Vector3::new(0.0, 0.0, 0.5), direction));
        let (mut model, mut state) = assembly.finish();
        for v in &mut state.velocities {
            v.z = -velocity;
        }
        model.contacts.obstacles.push(plane(Vector3::zeros(), Vector3::z(), 0.3));
        model.contacts.between_segments = Some(surface(0.3));
        let (end, _) = run(&model, &state, 0.02, 100);
        let lowest = end.positions.iter().map(|x| x.z).fold(f64::INFINITY, f64::min);
        println!("{velocity} m/s: lowest centre {lowest}");
    }
}

#[test]
fn two_free_rods_collide_and_keep_their_momentum() {
    let beam = Beam::rubber(15);
    for restitution in [0.0, 0.5] {
        let mut assembly = Assembly::new(Vector3::zeros());
        let first = assembly.rod(&beam.spec(Vector3::zeros(), Vector3::x()));
        assembly.rod(&beam.spec(Vector3::new(0.43, -0.5, 0.2), Vector3::new(0.1, 1.0, 0.0)));
        let (mut model, mut state) = assembly.finish();
        for (i, v) in state.velocities.iter_mut().enumerate() {
            *v = if first.contains(&i) { Vector3::new(0.0, 0.3, 5.0) } else { Vector3::new(0.2, 0.0, -10.0) };
        }
        model.contacts.between_segments = Some(Surface { friction: Friction::new(0.4), restitution });
        let (end, counters) = run(&model, &state, 0.01, 50);
        assert!(counters.contact_solves > 0);
        let (before, after) = (measure::linear_momentum(&model, &state), measure::linear_momentum(&model, &end));
        let scale: f64 = model.segments.iter().zip(&state.velocities).map(|(s, v)| s.mass() * v.norm()).sum();
        let (l0, l1) = (measure::angular_momentum(&model, &state), measure::angular_momentum(&model, &end));
        println!(
            "{restitution}: {:e} angular {:e} of {:e}",
            (after - before).norm() / scale,
            (l1 - l0).norm(),
            l0.norm()
        );
        let (e0, e1) = (measure::energy(&model, &state).total(), measure::energy(&model, &end).total());
        println!("energy {e0} {e1}");
        assert!((after - before).norm() < 1e-9 * scale);
        assert!(e1 < e0);
    }
}

/// How far a rope over a cylinder, wound through `angle`, moves within a second when pulled with 1 N and with `pull`.
fn capstan_model(angle: f64, friction: f64, pull: f64) -> (Model, State) {
    let radius = 0.005;
    let drum = 0.1;
    let wound = drum + radius;
    let per_turn = 48.0;
    let arc = (per_turn * angle / TAU).ceil() as usize;
    let step = angle / arc as f64;
    // Segments touch the drum in their middles; the pitch keeps the turns apart.
    let reach = wound / (0.5 * step).cos();
    let pitch = if angle > PI { 4.0 * radius / TAU } else { 0.0 };
    let mut nodes = Vec::new();
    let tail = 8;
    let node = |k: f64| {
        let at = step * k;
        Vector3::new(reach * at.cos(), pitch * at, reach * at.sin())
    };
    let (first, last) = (node(-0.5), node(arc as f64 + 0.5));
    let along = |from: Vector3<f64>, to: Vector3<f64>| (to - from).normalize();
    let (start, end) = (along(node(0.5), first), along(node(arc as f64 - 0.5), last));
    let length = (node(1.5) - node(0.5)).norm();
    for k in (1..=tail).rev() {
        nodes.push(first + start * (length * k as f64));
    }
    nodes.extend((0..=arc + 1).map(|k| node(k as f64 - 0.5)));
    nodes.extend((1..=tail).map(|k| last + end * (length * k as f64)));
    let material = Material { youngs_modulus: 1e4, torsion_modulus: 1e4, density: 1000.0 };
    let mut assembly = Assembly::new(Vector3::zeros());
    let rest = rod::RestShape::Straight;
    let rope = assembly.rod(&RodSpec { rest, ..RodSpec::new(nodes, radius, material) });
    let load =
        |segment, sign: f64, force| Load { segment, offset: sign * 0.5 * length, force, torque: Vector3::zeros() };
    assembly.load(load(rope.start, -1.0, start * 0.05));
    assembly.load(load(rope.end - 1, 1.0, end * (0.05 * pull)));
    let (mut model, state) = assembly.finish();
    let shape = ObstacleShape::Capsule { start: Vector3::y() * -1.0, end: Vector3::y(), radius: drum };
    model.contacts.obstacles.push(Obstacle { shape, surface: surface(friction) });
    (model, state)
}

fn capstan(angle: f64, friction: f64, pull: f64) -> f64 {
    let (model, state) = capstan_model(angle, friction, pull);
    let mut settings = Settings::default();
    if let Ok(f) = std::env::var("F") {
        settings.step.formulation = f.parse().unwrap();
    }
    let newton = settings.step.formulation.momentum();
    let build = |m: &Model, s: &solver::component::Members, t: &solver::topology::Topology| {
        solver::guess::GuessKind::StepQuadratic.build(m, s, t)
    };
    let mut simulation = Simulation::new(&model, &state, &settings, if newton { Some(&build) } else { None }).unwrap();
    for _ in 0..50 {
        simulation.step(0.01).unwrap();
    }
    let mut end = state.clone();
    simulation.store(&mut end);
    let counters = simulation.counters();
    println!(
        "it {} retries {} sweeps {} total {:?} deepest {:.1e} speed {:.4}",
        counters.iterations,
        counters.retries,
        counters.contact_sweeps,
        counters.times.total(),
        counters.deepest_penetration,
        end.velocities[0].norm()
    );
    let moved = |i: usize| (end.positions[i] - state.positions[i]).norm();
    println!("    {:.4} {:.4}", moved(0), moved(end.positions.len() - 1));
    moved(0)
}

#[test]
fn a_capstan_holds_up_to_the_exponential_of_the_angle() {
    for (degrees, friction) in [(90.0_f64, 0.3), (180.0, 0.3), (360.0, 0.3)] {
        let angle = degrees.to_radians();
        let ratio = (friction * angle).exp();
        for factor in [0.95, 1.05] {
            let moved = capstan(angle, friction, ratio * factor);
            println!("{degrees} degrees, {factor} of {ratio:.3}: {moved:.4} m");
        }
    }
}

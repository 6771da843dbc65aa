//! Rods that run inside other rods: theory, conserved quantities.

use std::f64::consts::PI;
use std::ops::Range;
use std::sync::Arc;

use dynamics::formulation::Formulation;
use dynamics::simulation::{Settings, Simulation};
use dynamics::step::{Status, StepParams};
use nalgebra::Vector3;
use rod::measure::energy;
use rod::{
    Assembly, Body, Change, Changing, Driven, Friction, Integrator, Interpolation, JointForce, Load, Material, Model,
    Motion, Pose, RestShape, RodSpec, Sheath, State, Track,
};

use crate::sliding::settings;

/// Radii of the rods inside and outside, and the clearance of the two [m].
const INNER: f64 = 0.5e-3;
const OUTER: f64 = 2e-3;
const CLEARANCE: f64 = 0.5e-3;

fn rope(youngs_modulus: f64) -> Material {
    Material { youngs_modulus, torsion_modulus: 0.4 * youngs_modulus, density: 1000.0 }
}

/// The way along x up to 0, then on a circle of radius `r` towards z by the angle `turn`, then straight on: its point at a distance [m].
fn way(r: f64, turn: f64, s: f64) -> Vector3<f64> {
    let angle = (s / r).clamp(0.0, turn);
    let end = Vector3::new(angle.sin(), 0.0, 1.0 - angle.cos()) * r;
    end + Vector3::new(angle.cos(), 0.0, angle.sin()) * (s - angle * r)
}

/// Nodes on a way from one distance to another, in so many segments.
fn nodes(way: impl Fn(f64) -> Vector3<f64>, [from, to]: [f64; 2], segments: usize) -> Vec<Vector3<f64>> {
    (0..=segments).map(|k| way(from + (to - from) * k as f64 / segments as f64)).collect()
}

fn spec(nodes: Vec<Vector3<f64>>, radius: f64, youngs_modulus: f64) -> RodSpec {
    RodSpec { rest: RestShape::Straight, ..RodSpec::new(nodes, radius, rope(youngs_modulus)) }
}

fn sheath(model: &mut Model, inner: &Range<usize>, outer: &Range<usize>, friction: f64) {
    let (inner, outer, friction) = (inner.clone(), outer.clone(), Friction::new(friction));
    model.contacts.sheaths.push(Sheath { inner, outer, clearance: CLEARANCE, friction });
}

/// A rope through a fixed sheath that turns by an angle, with 12 segments in the turn; a load pulls its start, its end is led at a speed
/// [m/s] along the rope.
fn through(turn: f64, friction: f64, load: f64, speed: f64) -> (Model, State, Range<usize>) {
    let r = 0.1;
    let length = r * turn / 12.0;
    let mut assembly = Assembly::new(Vector3::zeros());
    let along = |s: f64| way(r, turn, s);
    let outer = assembly.rod(&spec(nodes(along, [-2.0 * length, r * turn + 2.0 * length], 16), OUTER, 1e9));
    outer.clone().for_each(|i| _ = assembly.fix(i));
    let own = 0.83 * length;
    let inner = nodes(along, [-18.0 * own, r * turn + 18.0 * own], 36 + (12.0 / 0.83) as usize);
    let inner = assembly.rod(&spec(inner, INNER, 1e7));
    let pull = -Vector3::x() * load;
    assembly.load(Load {
        segment: inner.start,
        offset: -0.5 * own,
        force: pull,
        torque: Vector3::zeros(),
        follows: false,
    });
    assembly.clamp_end(&inner);
    assembly.damping(rod::Damping { linear: 5.0, angular: 5.0 });
    let (mut model, state) = assembly.finish();
    let from = model.anchors[0];
    let axis = Vector3::new(turn.cos(), 0.0, turn.sin());
    let at = |time: f64, way: f64| (time, Pose { position: from.position + axis * way, ..from });
    let ramp = (1..=10).map(|k| 0.1 * f64::from(k) * 0.1).map(|t| at(t, 0.5 * speed * t * t / 0.1));
    let keys: Vec<_> = [at(0.0, 0.0)].into_iter().chain(ramp).chain([at(10.1, 0.05 * speed + 10.0 * speed)]).collect();
    let motion = Motion::through(&keys, Interpolation::Linear).unwrap();
    model.motions.push(Driven::new(Body::Anchor(0), Arc::new(motion)));
    sheath(&mut model, &inner, &outer, friction);
    (model, state, inner)
}

/// Steps `model` and shows each step's end, with the forces of its joints.
fn run(
    model: &Model,
    state: &State,
    integrator: Integrator,
    (dt, steps): (f64, usize),
    mut see: impl FnMut(f64, &State, &[JointForce]),
) -> Simulation {
    let mut simulation = Simulation::new(model, state, &settings(integrator), None).unwrap();
    let (mut state, mut forces) = (state.clone(), vec![JointForce::default(); model.joints.len()]);
    for step in 0..steps {
        let status = simulation.step(dt).unwrap().status;
        assert!(status <= Status::ConvergedInSubsteps, "step {step}: {status:?}");
        simulation.store(&mut state);
        simulation.store_joint_forces(&mut forces);
        see(simulation.time(), &state, &forces);
    }
    simulation
}

/// A wire in a tube, both along such nodes, each in so many segments.
fn pair(
    along: impl Fn(f64) -> Vector3<f64>,
    [tube, wire]: [[f64; 2]; 2],
    segments: [usize; 2],
    gravity: f64,
) -> (Assembly, Range<usize>, Range<usize>) {
    let mut assembly = Assembly::new(Vector3::z() * -gravity);
    let outer = assembly.rod(&spec(nodes(&along, tube, segments[0]), OUTER, 1e8));
    let inner = assembly.rod(&spec(nodes(&along, wire, segments[1]), INNER, 1e9));
    (assembly, outer, inner)
}

/// A rope that is led through a curved sheath needs exp(mu theta) times the tension at its other end, or that share of it where it is let in;
/// without friction the same. Nothing jerks as segments pass from one segment of the sheath to the next, and out of its mouths.
#[test]
fn a_rope_slides_at_the_capstan_factor() {
    for turn in [1.0_f64, 2.0] {
        for friction in [0.0, 0.2, 0.5] {
            for speed in [0.05, -0.05] {
                let load = 10.0;
                let (model, state, _) = through(turn, friction, load, speed);
                let mut seen = Vec::new();
                let simulation = run(&model, &state, Integrator::Bdf2, (0.002, 600), |time, _, forces| {
                    if time > 0.5 {
                        seen.push(forces[model.joints.len() - 1].force.norm());
                    }
                });
                let mean = seen.iter().sum::<f64>() / seen.len() as f64;
                let expected = load * (friction * turn * speed.signum()).exp();
                let jump = seen.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
                let (low, high) =
                    seen.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), &f| (low.min(f), high.max(f)));
                let what = format!("{turn} rad, friction {friction}, {speed} m/s");
                let counters = simulation.counters();
                println!(
                    "{what}: {} of expected, swing {}, jump {}, {} iterations",
                    mean / expected,
                    (high - low) / mean,
                    jump / mean,
                    counters.iterations as f64 / counters.steps as f64
                );
                assert!((mean / expected - 1.0).abs() < 0.02, "{what}: {mean} N, {expected} N");
                let is_smooth = jump < 1e-3 * mean && high - low < 0.01 * mean;
                assert!(is_smooth, "{what}: {low} to {high} N, {jump} N at once");
            }
        }
    }
}

/// A straight wire is pushed into a fixed bent sheath from outside: without friction by the energy of bending that each length takes with it, half the
/// bending stiffness times the curvature squared; with friction by what the walls' normal forces rub besides.
#[test]
fn a_wire_is_pushed_in_by_its_bending_and_friction() {
    let (r, turn, speed, segments) = (0.1, 2.0, 0.1, 50);
    for friction in [0.0, 0.1, 0.3] {
        let mut assembly = Assembly::new(Vector3::zeros());
        let along = |s: f64| way(r, turn, s);
        let outer = assembly.rod(&spec(nodes(along, [-0.05, 0.25], 60), OUTER, 1e9));
        outer.clone().for_each(|i| _ = assembly.fix(i));
        let wire = assembly.rod(&spec(nodes(along, [-0.3, -0.06], segments), INNER, 1e9));
        assembly.clamp_start(&wire);
        assembly.damping(rod::Damping { linear: 1.0, angular: 1.0 });
        let (mut model, state) = assembly.finish();
        let from = model.anchors[0];
        let at = |time: f64, way: f64| (time, Pose { position: from.position + Vector3::x() * way, ..from });
        let keys = [at(0.0, 0.0), at(2.0, 2.0 * speed)];
        let motion = Motion::through(&keys, Interpolation::Linear).unwrap();
        model.motions.push(Driven::new(Body::Anchor(0), Arc::new(motion)));
        sheath(&mut model, &wire, &outer, friction);
        let mut simulation = Simulation::new(&model, &state, &settings(Integrator::Bdf2), None).unwrap();
        let (mut forces, mut pressing) = (vec![JointForce::default(); model.joints.len()], Vec::new());
        let (mut pushed, mut rubbed, mut steps) = (0.0, 0.0, 0.0);
        let clamp = model.joints.len() - 1;
        for step in 0..1700 {
            let status = simulation.step(0.001).unwrap().status;
            assert!(status <= Status::ConvergedInSubsteps, "step {step}: {status:?}");
            if step >= 1100 {
                simulation.store_joint_forces(&mut forces);
                simulation.store_contact_forces(&mut pressing);
                pushed += forces[clamp].force.x.abs();
                rubbed += pressing.iter().map(|own| own.force.dot(&own.normal) * friction).sum::<f64>();
                steps += 1.0;
            }
        }
        let (pushed, rubbed) = (pushed / steps, rubbed / steps);
        let stiffness = 1e9 * 0.25 * PI * INNER.powi(4);
        let bent = 0.5 * stiffness / (r * r);
        let mut end = state.clone();
        simulation.store(&mut end);
        let tip = end.positions[wire.end - 1];
        println!(
            "friction {friction}: pushed {pushed} N, bending {bent} N, rubbed {rubbed} N, tip {tip:?}, {} iterations, {} retries",
            simulation.counters().iterations as f64 / 1700.0,
            simulation.counters().retries
        );
        assert!(tip.z > 0.05, "the tip is in the bend: {tip}");
        assert!(
            (pushed / (bent + rubbed) - 1.0).abs() < 0.05,
            "friction {friction}: {pushed} N, {bent} N + {rubbed} N"
        );
    }
}

/// A Bowden cable: a soft housing held at its ends; what is pulled at one end of the wire comes out of the other.
#[test]
fn a_bowden_cable_passes_on_its_way() {
    let (r, turn) = (0.1, 2.0);
    let (mut assembly, outer, wire) =
        pair(|s| way(r, turn, s), [[-0.04, r * turn + 0.04], [-0.1, r * turn + 0.1]], [28, 47], 0.0);
    assembly.clamp_start(&outer).clamp_end(&outer).clamp_end(&wire);
    let axis = Vector3::new(turn.cos(), 0.0, turn.sin());
    let load =
        Load { segment: wire.start, offset: 0.0, force: -Vector3::x() * 5.0, torque: Vector3::zeros(), follows: false };
    assembly.load(load).add_mass(wire.start, 0.05);
    assembly.damping(rod::Damping { linear: 20.0, angular: 20.0 });
    let (mut model, state) = assembly.finish();
    let track = Track::new(&[(0.0, Vector3::zeros()), (0.2, load.force)], Interpolation::Linear).unwrap();
    model.changes.push(Change { of: Changing::Force(0), track: Arc::new(track) });
    let from = *model.anchors.last().unwrap();
    let at = |time: f64, way: f64| (time, Pose { position: from.position + axis * way, ..from });
    let keys = [at(0.0, 0.0), at(0.5, 0.0), at(1.0, 0.03)];
    let motion = Motion::through(&keys, Interpolation::Smooth).unwrap();
    model.motions.push(Driven::new(Body::Anchor(model.anchors.len() - 1), Arc::new(motion)));
    sheath(&mut model, &wire, &outer, 0.1);
    let (mut ends, mut bent) = (Vec::new(), 0.0_f64);
    let simulation = run(&model, &state, Integrator::Bdf2, (0.002, 600), |_, now, _| {
        ends.push(now.positions[wire.start]);
        bent = outer.clone().map(|i| (now.positions[i] - state.positions[i]).norm()).fold(bent, f64::max);
    });
    let way = (ends[599] - ends[240]).x;
    println!(
        "30 mm in, {} mm out; the housing moves by {bent} m; {} iterations, {} retries",
        way * 1e3,
        simulation.counters().iterations as f64 / 600.0,
        simulation.counters().retries
    );
    assert!((way - 0.03).abs() < turn * CLEARANCE, "{way} m");
    assert!(bent > 2.0 * CLEARANCE, "the housing gives way: {bent} m");
}

/// Thick rods, one in the other along x, under gravity, with a torque about x on each segment of the inner one, which grows for half a second.
fn turned(friction: f64, torque: f64, damping: f64) -> (Model, State, Range<usize>) {
    let mut assembly = Assembly::new(-Vector3::z() * 9.81);
    let outer = assembly.rod(&spec(nodes(|s| Vector3::x() * s, [0.0, 1.0], 7), 0.02, 1e9));
    outer.clone().for_each(|i| _ = assembly.fix(i));
    let low = |s: f64| Vector3::new(s, 0.0, -0.005);
    let inner = assembly.rod(&spec(nodes(low, [0.1, 0.9], 8), 0.01, 1e9));
    for segment in inner.clone() {
        assembly.load(Load {
            segment,
            offset: 0.0,
            force: Vector3::zeros(),
            torque: Vector3::x() * torque,
            follows: false,
        });
    }
    assembly.damping(rod::Damping { linear: damping, angular: damping });
    let (mut model, state) = assembly.finish();
    if damping > 0.0 {
        let track = Track::new(&[(0.0, Vector3::zeros()), (1.0, Vector3::x() * torque)], Interpolation::Linear);
        let track = Arc::new(track.unwrap());
        model.changes.extend((0..8).map(|k| Change { of: Changing::Torque(k), track: track.clone() }));
    }
    let friction = Friction::new(friction);
    model.contacts.sheaths.push(Sheath { inner: inner.clone(), outer, clearance: 0.005, friction });
    (model, state, inner)
}

/// A torque on a rod that lies in a tube rolls it up the wall until its weight has the same torque about the place where it touches, and turns it
/// on the spot beyond the angle of friction; without friction it turns freely.
#[test]
fn friction_carries_twist_up_to_its_limit() {
    let friction = 0.3_f64;
    let weight = 1000.0 * PI * 1e-4 * 0.1 * 9.81;
    let limit = weight * 0.01 * friction / (1.0 + friction * friction).sqrt();
    for (share, slips) in [(0.97, false), (1.03, true)] {
        let (model, state, inner) = turned(friction, share * limit, 20.0);
        let mut rates = Vec::new();
        run(&model, &state, Integrator::Euler, (0.002, 1200), |_, state, _| {
            rates.push(state.angular_velocities[inner.start].x);
        });
        let rate = rates[1150..].iter().sum::<f64>() / 50.0;
        println!("{share}: {rate} rad/s");
        assert_eq!(rate > 0.1, slips, "{share}: {rate} rad/s");
    }
    let (model, state, inner) = turned(0.0, limit, 0.0);
    let inertia = model.segments[inner.start].axial_inertia();
    let mut last = (0.0, 0.0);
    run(&model, &state, Integrator::Bdf2, (5e-4, 100), |time, state, _| {
        last = (time, state.angular_velocities[inner.start].x);
    });
    assert!((last.1 / (limit / inertia * last.0) - 1.0).abs() < 1e-4, "{last:?}");
}

/// Two free rods, one in the other, that slide and turn against each other in a bend: their momentum stays, their angular momentum with an error that
/// falls with the time step, as Euler's rule has it, and their energy never grows.
#[test]
fn free_rods_keep_their_momentum() {
    let (assembly, outer, inner) = pair(|s| way(0.2, 1.0, s), [[-0.05, 0.25], [-0.1, 0.3]], [24, 37], 0.0);
    let (mut model, mut state) = assembly.finish();
    for i in inner.clone() {
        state.velocities[i] = state.axis(i) * 0.5 + Vector3::y() * 0.1;
    }
    for i in outer.clone() {
        state.angular_velocities[i] = state.axis(i) * 3.0;
    }
    sheath(&mut model, &inner, &outer, 0.3);
    let sums = |state: &State| {
        let mut sums = [Vector3::zeros(); 2];
        for (i, segment) in model.segments.iter().enumerate() {
            let (p, q) = (state.velocities[i] * segment.mass(), state.orientations[i]);
            let w = q.inverse() * state.angular_velocities[i];
            let (across, along) = (segment.transverse_inertia(), segment.axial_inertia());
            let spin = q * Vector3::new(w.x * across, w.y * across, w.z * along);
            sums[0] += p;
            sums[1] += state.positions[i].cross(&p) + spin;
        }
        sums
    };
    let before = sums(&state);
    let mut errors = Vec::new();
    for dt in [1e-3, 2.5e-4] {
        let (mut last, mut off) = (energy(&model, &state).total(), [0.0_f64; 2]);
        run(&model, &state, Integrator::Euler, (dt, (0.1 / dt) as usize), |time, state, _| {
            let now = energy(&model, state).total();
            assert!(now <= last * (1.0 + 1e-9), "energy grows from {last} to {now} J at {time} s");
            last = now;
            let after = sums(state);
            off = [0, 1].map(|k| off[k].max((after[k] - before[k]).norm() / before[k].norm()));
        });
        println!("{dt} s: momenta off by {off:?}");
        assert!(off[0] < 1e-10, "{dt} s: {off:?}");
        errors.push(off[1]);
    }
    assert!(errors[1] < 0.01 && errors[1] < 0.35 * errors[0], "{errors:?}");
}

/// A run that goes on from a snapshot has the same bits; a step allocates nothing.
#[test]
fn snapshots_go_on_with_the_same_bits() {
    let (model, state, _) = through(1.0, 0.2, 10.0, 0.05);
    let mut simulation = run(&model, &state, Integrator::Bdf2, (0.002, 150), |_, _, _| {});
    let snapshot = simulation.snapshot();
    let mut other = Simulation::new(&model, &state, &settings(Integrator::Bdf2), None).unwrap();
    other.restore(&snapshot).unwrap();
    let mut ends = [state.clone(), state];
    for (simulation, end) in [&mut simulation, &mut other].into_iter().zip(&mut ends) {
        (0..50).for_each(|_| _ = simulation.step(0.002).unwrap());
        simulation.store(end);
    }
    assert_eq!(ends[0], ends[1]);
    let steps = || (0..50).for_each(|_| _ = simulation.step(0.002).unwrap());
    assert_eq!(allocation_counter::measure(steps).count_total, 0);
}

#[test]
fn what_has_no_sheaths_is_refused_by_name() {
    let (model, state, inner) = through(1.0, 0.2, 10.0, 0.05);
    let step = StepParams { formulation: Formulation::Xpbd, ..StepParams::DEFAULT };
    let refused = Simulation::new(&model, &state, &Settings { step, ..Settings::default() }, None);
    assert_eq!(refused.err().map(|error| error.to_string()).unwrap_or_default(), "sheaths need formulation newton");
    let wrong = |change: &dyn Fn(&mut Model)| {
        let mut model = model.clone();
        change(&mut model);
        model.validate(&state).err().map(|error| error.to_string()).unwrap_or_default()
    };
    let bore = "but it must be > 0, and less than the outer rod's radius less the inner one's";
    for clearance in [0.0, 0.0016] {
        let found = wrong(&|model| model.contacts.sheaths[0].clearance = clearance);
        assert_eq!(found, format!("sheath 0: clearance = {clearance}, {bore}"));
    }
    let found = wrong(&|model| model.contacts.sheaths[0].friction = Friction::new(-1.0));
    assert_eq!(found, "sheath 0: friction = -1, but it must be finite and >= 0");
    let found = wrong(&|model| _ = model.joints.remove(inner.start + 3 - 1));
    assert!(found.ends_with("but it must be joined to the next"), "{found}");
    let found = wrong(&|model| model.contacts.sheaths[0].outer = inner.clone());
    assert!(found.ends_with("no segment of the rod that runs through it"), "{found}");
    let found = wrong(&|model| {
        let Sheath { inner, outer, .. } = model.contacts.sheaths[0].clone();
        model.segments.iter_mut().for_each(|segment| segment.radius = 1e-3);
        model.contacts.sheaths.push(Sheath { inner: outer, outer: inner, ..model.contacts.sheaths[0].clone() });
    });
    assert!(!found.is_empty());
    // What is drawn in the wall is refused, too.
    let mut thin = model.clone();
    thin.contacts.sheaths[0].clearance = 1e-5;
    let refused =
        Simulation::new(&thin, &state, &settings(Integrator::Euler), None).err().map(|error| error.to_string());
    assert!(refused.is_some_and(|error| error.contains("overlaps the wall of sheath 0 by")));
}

/// A wire that is let out of a straight tube sags under its weight without jerks, as one segment after the other leaves the mouth.
#[test]
fn a_wire_leaves_a_tube_without_jerks() {
    let speed = 0.05;
    let (mut assembly, outer, wire) = pair(|s| Vector3::x() * s, [[-0.05, 0.25], [-0.1, 0.3]], [15, 40], 9.81);
    outer.clone().for_each(|i| _ = assembly.fix(i));
    assembly.clamp_start(&wire);
    assembly.damping(rod::Damping { linear: 10.0, angular: 10.0 });
    let (mut model, state) = assembly.finish();
    let from = model.anchors[0];
    let at = |time: f64, way: f64| (time, Pose { position: from.position + Vector3::x() * way, ..from });
    let keys = [at(0.0, 0.0), at(1.0, 0.0), at(3.0, 2.0 * speed)];
    let motion = Motion::through(&keys, Interpolation::Linear).unwrap();
    model.motions.push(Driven::new(Body::Anchor(0), Arc::new(motion)));
    sheath(&mut model, &wire, &outer, 0.1);
    let mut heights = Vec::new();
    run(&model, &state, Integrator::Bdf2, (0.002, 1500), |_, state, _| heights.push(state.positions[wire.end - 1].z));
    let falls: Vec<f64> = heights.windows(2).map(|pair| (pair[1] - pair[0]) / 0.002).collect();
    let changes = falls.windows(2).skip(550).map(|pair| (pair[1] - pair[0]).abs());
    let largest = changes.fold(0.0, f64::max);
    println!("the tip's fall changes by {largest} m/s in a step");
    // 0.036 m/s without the funnel behind the mouth.
    assert!(largest < 0.025, "{largest} m/s");
}

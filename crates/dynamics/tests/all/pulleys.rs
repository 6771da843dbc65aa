//! Rods that run over pulleys: theory, conserved quantities, refinement.

use std::f64::consts::{FRAC_PI_2, PI};
use std::ops::Range;
use std::sync::Arc;

use dynamics::simulation::Simulation;
use dynamics::step::Status;
use nalgebra::{UnitQuaternion, Vector3};
use rod::measure::energy;
use rod::{
    Assembly, Body, BodyShape, Change, Changing, Integrator, Interpolation, Joint, Load, Material, Model, OnPulley,
    Pose, Pulley, RestShape, RigidBody, RodSpec, State, Track, Wheel,
};

use crate::sliding::{G, settings};

const R: f64 = 0.1;

fn rope(density: f64) -> Material {
    Material { youngs_modulus: 3e8, torsion_modulus: 1e4, density }
}

fn here(position: Vector3<f64>) -> Pose {
    Pose { position, orientation: UnitQuaternion::identity() }
}

/// A fixed pulley about the y axis.
fn fixed(model: &mut Model, segments: Range<usize>, centre: Vector3<f64>, wheel: Wheel) {
    let holder = Body::Anchor(model.anchors.len());
    model.anchors.push(here(centre));
    add(model, segments, holder, Vector3::zeros(), wheel);
}

/// A pulley about the y axis on a holder that is not turned.
fn add(model: &mut Model, segments: Range<usize>, holder: Body, centre: Vector3<f64>, wheel: Wheel) {
    model.pulleys.push(Pulley { segments, holder, centre, axis: Vector3::y_axis(), radius: R, wheel });
}

/// Steps `model` and shows each step's end.
fn run(
    model: &Model,
    state: &State,
    integrator: Integrator,
    (dt, steps): (f64, usize),
    mut see: impl FnMut(f64, &State, &[OnPulley]),
) -> Simulation {
    let mut simulation = Simulation::new(model, state, &settings(integrator), None).unwrap();
    let (mut state, mut on) = (state.clone(), vec![OnPulley::default(); model.pulleys.len()]);
    for step in 0..steps {
        let status = simulation.step(dt).unwrap().status;
        assert!(status <= Status::ConvergedInSubsteps, "step {step}: {status:?}");
        simulation.store(&mut state);
        simulation.store_pulleys(&mut on);
        see(simulation.time(), &state, &on);
    }
    simulation
}

/// Nodes of a rope in the plane of x and z that goes straight for so many segments, turns about a wheel by so many segments, left (> 0) or right,
/// and so on; and the middles of the wheels. Segments on the wheels turn it by `turn` each.
fn reeved(
    turn: f64,
    from: Vector3<f64>,
    mut heading: f64,
    legs: &[(usize, i32)],
) -> (Vec<Vector3<f64>>, Vec<Vector3<f64>>) {
    let length = R * turn;
    let rim = 0.5 * length / (0.5 * turn).tan();
    let (mut nodes, mut middles) = (vec![from], Vec::new());
    for &(straight, on) in legs {
        let along = |heading: f64| Vector3::new(heading.cos(), 0.0, heading.sin()) * length;
        let mut at = nodes[nodes.len() - 1];
        nodes.extend((1..=straight).map(|k| at + along(heading) * k as f64));
        at = nodes[nodes.len() - 1];
        if on != 0 {
            let inwards = Vector3::new(-heading.sin(), 0.0, heading.cos()) * f64::from(on.signum());
            middles.push(at - along(heading) * 0.5 + inwards * rim);
        }
        for _ in 0..on.abs() {
            heading += turn * f64::from(on.signum());
            at += along(heading);
            nodes.push(at);
        }
    }
    (nodes, middles)
}

/// A rope of such nodes, without bending stiffness to speak of.
fn spec(nodes: Vec<Vector3<f64>>, density: f64) -> RodSpec {
    RodSpec { rest: RestShape::Straight, ..RodSpec::new(nodes, 0.001, rope(density)) }
}

/// A taut rope around a held wheel, ten segments on it, pulled by forces at its ends which grow to these in half a second.
fn bent(wrap: f64, pulls: [f64; 2], friction: f64) -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::zeros());
    let step = R * wrap / 10.0;
    let (nodes, middles) = reeved(0.1 * wrap, Vector3::zeros(), 0.5 * wrap, &[(6, -10), (6, 0)]);
    let ends = [nodes[0] - nodes[1], nodes[nodes.len() - 1] - nodes[nodes.len() - 2]].map(|x| x.normalize());
    let rod = assembly.rod(&spec(nodes, 1000.0));
    for (segment, side, end) in [(rod.start, 0, -0.5), (rod.end - 1, 1, 0.5)] {
        let force = ends[side] * pulls[side];
        assembly.load(Load { segment, offset: end * step, force, torque: Vector3::zeros(), follows: false });
    }
    assembly.add_mass(rod.start, 0.3).add_mass(rod.end - 1, 0.3);
    assembly.damping(rod::Damping { linear: 5.0, angular: 5.0 });
    let (mut model, state) = assembly.finish();
    for k in 0..2 {
        let force = model.loads[k].force;
        let track = Track::new(&[(0.0, Vector3::zeros()), (0.5, force)], Interpolation::Linear).unwrap();
        model.changes.push(Change { of: Changing::Force(k), track: Arc::new(track) });
    }
    fixed(&mut model, rod, middles[0], Wheel::Held { friction });
    (model, state)
}

/// A rope slips on a held wheel where its tensions differ by exp(mu theta), with ten segments on it, in both directions.
#[test]
fn a_rope_slips_at_the_capstan_factor() {
    let friction = 0.3_f64;
    for wrap in [0.5, 1.0, 2.0, 3.0] {
        for is_forwards in [true, false] {
            for (share, slips) in [(0.99, false), (1.01, true)] {
                let mut pulls = [10.0 * (-friction * wrap).exp(), 10.0 * share];
                if !is_forwards {
                    pulls.reverse();
                }
                let (model, state) = bent(wrap, pulls, friction);
                let mut turned = Vec::new();
                run(&model, &state, Integrator::Bdf2, (0.004, 250), |_, _, on| turned.push(on[0].turned));
                let way = (turned[249] - turned[150]).abs();
                assert_eq!(way > 0.01, slips, "wrap {wrap}, forwards {is_forwards}, {share}: {way} rad");
            }
        }
    }
}

/// Lets gravity grow over the first tenth of a second, so that ropes without stretch begin without a jerk.
fn ease(model: &mut Model) {
    let track = Track::new(&[(0.0, Vector3::zeros()), (0.1, model.gravity)], Interpolation::Linear).unwrap();
    model.gravity = Vector3::zeros();
    model.changes.push(Change { of: Changing::Gravity, track: Arc::new(track) });
}

/// Two weights on a rope over one pulley, with so many segments on it.
fn weights(masses: [f64; 2], on: i32, density: f64) -> (Model, State, Range<usize>, Vector3<f64>) {
    let mut assembly = Assembly::new(Vector3::z() * -G);
    let hanging = on as usize;
    let (nodes, middles) = reeved(PI / f64::from(on), Vector3::zeros(), FRAC_PI_2, &[(3 * hanging, -on), (hanging, 0)]);
    let rope = assembly.rod(&spec(nodes, density));
    assembly.add_mass(rope.start, masses[0]).add_mass(rope.end - 1, masses[1]);
    let (mut model, state) = assembly.finish();
    ease(&mut model);
    (model, state, rope, middles[0])
}

/// The acceleration of the heavier weight, downwards, and what the pulley did at the end, with the means of its force and its torque.
fn fall((model, state): (&Model, &State), rope: &Range<usize>, dt: f64) -> (f64, OnPulley) {
    let mut ways = Vec::new();
    let mut last = OnPulley::default();
    let (mut force, mut torque, mut count) = (0.0, 0.0, 0.0);
    let steps = (0.3 / dt).round() as usize;
    run(model, state, Integrator::Bdf2, (dt, steps), |time, state, on| {
        let [first, end] = [rope.start, rope.end - 1].map(|i| state.positions[i].z);
        ways.push((time, 0.5 * (first - end)));
        last = on[0];
        if time > 0.15 {
            force += on[0].force.norm();
            torque += on[0].torque;
            count += 1.0;
        }
    });
    (last.force, last.torque) = (Vector3::z() * (force / count), torque / count);
    // Once the first swing is gone: the parabola through three of them.
    let [a, b, c] = [0.4, 0.69, 0.98].map(|share| ways[(share * steps as f64) as usize]);
    let slope = |a: (f64, f64), b: (f64, f64)| (b.1 - a.1) / (b.0 - a.0);
    (2.0 * (slope(b, c) - slope(a, b)) / (c.0 - a.0), last)
}

/// A wheel of this mass, a disc, on a hinge about the y axis, as the holder of a pulley.
fn disc(model: &mut Model, state: &mut State, mass: f64, middle: Vector3<f64>) -> Body {
    let mut assembly = Assembly::new(Vector3::zeros());
    let orientation = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -FRAC_PI_2);
    assembly.body(
        RigidBody::new(BodyShape::Cylinder { radius: R, length: 0.02 }, mass),
        Pose { position: middle, orientation },
    );
    let (own, own_state) = assembly.finish();
    let wheel = Body::Segment(model.segments.len());
    model.append(&own);
    state.append(&own_state, 0);
    let anchor = Body::Anchor(model.anchors.len());
    model.anchors.push(Pose { position: middle, orientation });
    let joint = Joint {
        a: anchor,
        b: wheel,
        offset_a: 0.0,
        offset_b: 0.0,
        rest_darboux: Vector3::zeros(),
        stretch_compliance: 1e-8,
        shear_compliance: 1e-8,
        ..model.joints[0]
    };
    model.joints.push(joint);
    model.hinge(model.joints.len() - 1, &Vector3::y());
    wheel
}

#[test]
fn atwoods_machine() {
    for on in [10, 20] {
        let (mut model, state, rope, middle) = weights([1.0, 2.0], on, 1000.0);
        fixed(&mut model, rope.clone(), middle, Wheel::Free);
        let (found, last) = fall((&model, &state), &rope, 0.001);
        assert!((found / (G / 3.0) - 1.0).abs() < 0.01, "{on} segments: {found} m/s^2");
        assert!((last.force.norm() / (8.0 / 3.0 * G) - 1.0).abs() < 0.01, "{on} segments: {last:?}");
        assert_eq!(last.torque, 0.0);
    }
    // A wheel of 1 kg that the rope turns: I = m R^2 / 2. Not so with 10 or 16 segments on the wheel, where the rope begins to swing: an open fault.
    for on in [12, 20] {
        let (mut model, mut state, rope, middle) = weights([1.0, 2.0], on, 1000.0);
        let holder = disc(&mut model, &mut state, 1.0, middle);
        let axis = Vector3::z_axis();
        let wheel = Wheel::Held { friction: 1.0 };
        model.pulleys.push(Pulley { segments: rope.clone(), holder, centre: Vector3::zeros(), axis, radius: R, wheel });
        let (found, last) = fall((&model, &state), &rope, 0.001);
        assert!((found / (G / 3.5) - 1.0).abs() < 0.01, "{on} segments: {found} m/s^2");
        assert!(last.torque < 0.0, "{on} segments: {last:?}");
    }
}

/// A driven wheel takes the rope along at R omega below the limits of friction and torque, and slips at them.
#[test]
fn a_driven_wheel() {
    let (friction, rate) = (0.3_f64, -2.0);
    let driven = |max_torque| Wheel::Driven { friction, rates: vec![[0.0, 0.0], [0.1, rate]], max_torque };
    let case = |heavy: f64, max_torque: f64| {
        let (mut model, state, rope, middle) = weights([1.0, heavy], 10, 1000.0);
        fixed(&mut model, rope.clone(), middle, driven(max_torque));
        let (found, last) = fall((&model, &state), &rope, 0.001);
        (found, last)
    };
    // Raised by the drive, which needs 0.2 kg g.
    let (_, last) = case(1.2, 1.0);
    assert!((last.rate / rate - 1.0).abs() < 1e-2, "{last:?}");
    assert!((last.torque / (-0.2 * G * R) - 1.0).abs() < 0.05, "{last:?}");
    // Friction bears less than the weights' difference.
    let (found, _) = case(3.0, 1e9);
    let factor = 3.0 * (G - found) / (G + found);
    assert!((factor / (friction * PI).exp() - 1.0).abs() < 0.01, "{factor}");
    // So does the drive.
    let (found, last) = case(1.5, 0.2);
    let theory = (0.5 * G - 0.2 / R) / 2.5;
    // To 1 % of the lesser tension.
    assert!((found - theory).abs() * 2.5 < 0.01 * (G + theory), "{found}, {theory}");
    assert!((last.torque + 0.2).abs() < 1e-9, "{last:?}");
}

/// A block that hangs in `parts` parts of a rope, whose other end a weight of 1 kg pulls.
fn tackle(parts: usize, block: f64) -> (Model, State, Range<usize>, usize) {
    let on = 8;
    let mut assembly = Assembly::new(Vector3::z() * -G);
    let mut legs = Vec::new();
    for part in 0..parts {
        let sign = if part % 2 == 0 { 1 } else { -1 };
        legs.push((if part == 0 { 16 } else { 10 }, sign * on));
    }
    legs.push((16, 0));
    let (nodes, middles) = reeved(PI / f64::from(on), Vector3::zeros(), -FRAC_PI_2, &legs);
    let rope = assembly.rod(&spec(nodes, 1000.0));
    let place = middles.iter().step_by(2).sum::<Vector3<f64>>() / (parts / 2) as f64;
    let body = assembly.body(RigidBody::new(BodyShape::Sphere { radius: 0.05 }, block), here(place));
    assembly.add_mass(rope.end - 1, 1.0).clamp_start(&rope);
    let (mut model, state) = assembly.finish();
    model.pin(model.joints.len() - 1);
    ease(&mut model);
    for (k, &middle) in middles.iter().enumerate() {
        if k % 2 == 0 {
            add(&mut model, rope.clone(), Body::Segment(body), middle - place, Wheel::Free);
        } else {
            fixed(&mut model, rope.clone(), middle, Wheel::Free);
        }
    }
    (model, state, rope, body)
}

/// A block in n parts of a rope moves as n times the rope's tension drives it, and the weight n times as fast.
#[test]
fn block_and_tackle() {
    for parts in [2, 4] {
        let n = parts as f64;
        for block in [2.0 * n, 0.5 * n] {
            let (model, state, rope, body) = tackle(parts, block);
            let theory = G * (n - block) / (block + n * n);
            let mut ways = Vec::new();
            run(&model, &state, Integrator::Bdf2, (0.001, 400), |time, state, _| {
                ways.push((time, state.positions[body].z, state.positions[rope.end - 1].z));
            });
            let [a, b, c] = [180, 280, 380].map(|k| ways[k]);
            let found = (c.1 - 2.0 * b.1 + a.1) / (b.0 - a.0).powi(2);
            let of_weight = (c.2 - 2.0 * b.2 + a.2) / (b.0 - a.0).powi(2);
            let advantage = block * (G + found) / (G + of_weight);
            assert!((advantage / n - 1.0).abs() < 0.01, "{parts} parts: an advantage of {advantage}");
            assert!((of_weight / found / -n - 1.0).abs() < 0.01, "{parts} parts: {of_weight}, {found} m/s^2");
            assert!((found / theory - 1.0).abs() < 0.02, "{parts} parts: {found}, {theory} m/s^2");
        }
    }
}

/// A rope that runs over three fixed pulleys without friction, forty segments of it, loses less than 1 % of what its tension works.
#[test]
fn three_pulleys_keep_the_energy() {
    let mut assembly = Assembly::new(Vector3::z() * -G);
    let (nodes, middles) = reeved(PI / 15.0, Vector3::zeros(), FRAC_PI_2, &[(70, -10), (14, 5), (14, -10), (10, 0)]);
    let rope = assembly.rod(&spec(nodes, 1000.0));
    assembly.add_mass(rope.start, 1.0).add_mass(rope.end - 1, 1.2);
    let (mut model, state) = assembly.finish();
    middles.iter().for_each(|&middle| fixed(&mut model, rope.clone(), middle, Wheel::Free));
    let mut eased = model.clone();
    ease(&mut eased);
    let mut begun = state.clone();
    run(&eased, &state, Integrator::Bdf2, (0.001, 150), |_, state, _| begun.clone_from(state));
    for dt in [0.004, 0.002] {
        let before = energy(&model, &begun).total();
        let (mut lost, mut way) = (0.0_f64, 0.0);
        run(&model, &begun, Integrator::Bdf2, (dt, (1.3 / dt) as usize), |_, state, on| {
            lost = before - energy(&model, state).total();
            way = on[0].turned * R;
        });
        let work = 2.0 * 1.2 / 2.2 * G * way;
        assert!(way > 0.6, "{way} m");
        assert!(lost.abs() < 0.01 * work, "{dt}: {lost} J of {work} J");
    }
}

/// The force changes smoothly as segments pass on, by less than 1 % in steps of a fiftieth of one.
#[test]
fn the_force_is_smooth_along_the_rod() {
    for on in [6, 10] {
        let (mut model, state, rope, middle) = weights([1.0, 1.0], on, 1000.0);
        let rates = vec![[0.0, 0.0], [0.2, 0.0], [0.4, -0.5]];
        fixed(&mut model, rope.clone(), middle, Wheel::Driven { friction: 1.0, rates, max_torque: 1e9 });
        model.damping = rod::Damping { linear: 1.0, angular: 1.0 };
        let mut seen = Vec::new();
        run(&model, &state, Integrator::Bdf2, (0.005, 600), |_, _, on| seen.push(on[0]));
        let settled = &seen[200..];
        let passed = (settled[settled.len() - 1].turned - settled[0].turned) / PI * f64::from(on);
        let forces: Vec<f64> = settled.iter().map(|on| on.force.norm()).collect();
        let largest = forces.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
        let (low, high) = forces.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), &f| (low.min(f), high.max(f)));
        assert!(passed.abs() > 1.2, "{passed} segments have passed");
        assert!(largest < 0.01 * high && high - low < 0.01 * high, "{on}: {low} to {high} N, {largest} N at once");
    }
}

/// A run that goes on from a snapshot has the same bits.
#[test]
fn snapshots_go_on_with_the_same_bits() {
    let (mut model, state, rope, middle) = weights([1.0, 1.5], 10, 1000.0);
    fixed(&mut model, rope, middle, Wheel::Held { friction: 0.05 });
    let mut simulation = run(&model, &state, Integrator::Bdf2, (0.001, 150), |_, _, _| {});
    let snapshot = simulation.snapshot();
    let mut other = Simulation::new(&model, &state, &settings(Integrator::Bdf2), None).unwrap();
    other.restore(&snapshot).unwrap();
    let mut ends = [state.clone(), state];
    for (simulation, end) in [&mut simulation, &mut other].into_iter().zip(&mut ends) {
        (0..20).for_each(|_| _ = simulation.step(0.001).unwrap());
        simulation.store(end);
    }
    assert_eq!(ends[0], ends[1]);
}

#[test]
fn what_has_no_pulleys_is_refused_by_name() {
    use dynamics::formulation::Formulation;
    use dynamics::simulation::Settings;
    use dynamics::step::StepParams;
    let (mut model, state, rope, middle) = weights([1.0, 1.5], 10, 1000.0);
    fixed(&mut model, rope, middle, Wheel::Free);
    let step = StepParams { formulation: Formulation::Xpbd, ..StepParams::DEFAULT };
    let refused = Simulation::new(&model, &state, &Settings { step, ..Settings::default() }, None);
    assert_eq!(refused.err().map(|error| error.to_string()).unwrap_or_default(), "pulleys need formulation newton");
    let wrong = |change: &dyn Fn(&mut Pulley)| {
        let mut model = model.clone();
        change(&mut model.pulleys[0]);
        model.validate(&state).err().map(|error| error.to_string()).unwrap_or_default()
    };
    assert_eq!(wrong(&|own| own.radius = 0.0), "pulley 0: radius = 0, but it must be finite and > 0");
    let long = wrong(&|own| own.radius = 0.01);
    assert!(long.ends_with("but it must be at most the radius"), "{long}");
    assert_eq!(
        wrong(&|own| own.wheel = Wheel::Held { friction: -1.0 }),
        "pulley 0: friction = -1, but it must be finite and >= 0"
    );
}

/// Two sheaves on one axle: each has the part of the rope in its own plane.
#[test]
fn sheaves_beside_each_other_have_their_own_parts() {
    let (mut all, middles) = reeved(0.1 * PI, Vector3::zeros(), FRAC_PI_2, &[(6, -10), (6, 0)]);
    let (down, length) = (all[all.len() - 1], 0.1 * PI * R);
    let beside = Vector3::y() * (2.0 * length);
    all.push(down + 0.5 * beside);
    // Up beside it, and over the second one.
    all.extend(reeved(0.1 * PI, down + beside, FRAC_PI_2, &[(6, 10), (6, 0)]).0);
    let mut assembly = Assembly::new(Vector3::zeros());
    let rod = assembly.rod(&spec(all, 1000.0));
    assembly.fix(rod.start).fix(rod.end - 1);
    let (mut model, state) = assembly.finish();
    for at in [middles[0], middles[0] + beside] {
        fixed(&mut model, rod.clone(), at, Wheel::Free);
    }
    let mut simulation = Simulation::new(&model, &state, &settings(Integrator::Bdf2), None).unwrap();
    simulation.step(1e-3).unwrap();
    let mut on = vec![OnPulley::default(); 2];
    simulation.store_pulleys(&mut on);
    // Neither is pulled sideways by the distance of the other.
    for one in on {
        assert!(one.wrap > 2.5 && one.force.y.abs() < 1e-3 * 3e8 * PI * 1e-6, "{one:?}");
    }
}

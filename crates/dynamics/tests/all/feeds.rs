//! Rods that are fed out of stores and into them: weights, pendulums and catenaries of a length that changes, limits, contacts, snapshots.

use dynamics::simulation::{Simulation, SimulationError};
use nalgebra::{UnitQuaternion, Vector3};
use rod::{
    Assembly, Body, Contacts, Feed, Freedom, Friction, Integrator, Material, Model, Obstacle, ObstacleShape, Pose,
    RodSpec, Sliding, SlidingJoint, State, Surface, shape,
};

use crate::sliding::{self, G, settings};

/// A feed at this speed without limits, out of a store.
fn steady(speed: f64) -> Feed {
    Feed { speeds: vec![[0.0, speed]], max_force: f64::INFINITY, is_stored: true, lengths: [0.0, f64::INFINITY] }
}

/// A straight rope of 2 m in this direction, of so many segments and this mass a metre, of which the eyelet at the origin leaves so much outside;
/// with a weight of this mass on its last segment.
fn rope(
    direction: Vector3<f64>,
    (segments, per_metre): (usize, f64),
    outside: f64,
    weight: f64,
    feed: Feed,
) -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::z() * -G);
    let radius = 0.004_f64;
    let density = per_metre / (std::f64::consts::PI * radius.powi(2));
    let material = Material { youngs_modulus: 1e5, torsion_modulus: 4e4, density };
    let start = direction * (outside - 2.0);
    let rope = assembly.rod(&RodSpec::new(shape::straight(start, direction, 2.0, segments), radius, material));
    let (mut model, state) = assembly.finish();
    model.segments[rope.end - 1].added_mass = weight;
    let identity = UnitQuaternion::identity();
    model.anchors.push(Pose { position: Vector3::zeros(), orientation: identity });
    model.sliding_joints.push(SlidingJoint {
        segments: rope,
        holder: Body::Anchor(model.anchors.len() - 1),
        place: Vector3::zeros(),
        start: 2.0 - outside,
        friction: 0.0,
        feed: Some(feed),
    });
    (model, state)
}

/// Steps a model whose first eyelet has a feed, and shows each step's end.
fn run(
    (model, state): &(Model, State),
    integrator: Integrator,
    times: (f64, usize),
    mut see: impl FnMut(f64, &State, Sliding),
) -> Simulation {
    sliding::run(model, state, &settings(integrator), times, |time, state, sliding| see(time, state, sliding[0]))
}

/// The eyelet bears what hangs outside, to the last part of a segment: paid out and taken in, at any place along a segment.
#[test]
fn a_store_bears_what_hangs_out_of_it() {
    for speed in [0.2, -0.2] {
        let hanging = rope(-Vector3::z(), (20, 0.5), 1.0, 1.0, steady(speed));
        let mut seen = 0;
        run(&hanging, Integrator::Bdf2, (0.005, 700), |time, state, sliding| {
            // The first steps jerk.
            if time > 0.1 {
                let expected = G * (1.0 + 0.5 * (2.0 - sliding.place));
                let force = sliding.force.z;
                assert!((force / expected - 1.0).abs() < 1e-6, "{time} s: {force} N, {expected} N");
                assert!((state.positions[19].z + 2.0 - sliding.place - 0.05).abs() < 1e-6, "{}", state.positions[19]);
                seen += 1;
            }
            assert!((sliding.place - (1.0 - speed * time)).abs() < 1e-9, "{} m at {time} s", sliding.place);
        });
        assert!(seen > 600);
    }
}

/// A pendulum of the length l at this time that is hoisted at the speed v: theta'' = -(2 l' theta' + g sin theta) / l, by Runge and Kutta's rule.
fn hoisted(length: f64, speed: f64, angle: f64, time: f64) -> f64 {
    let count = 40_000;
    let h = time / f64::from(count);
    let rates =
        |t: f64, [theta, rate]: [f64; 2]| [rate, -(2.0 * speed * rate + G * theta.sin()) / (length + speed * t)];
    let mut now = [angle, 0.0];
    for k in 0..count {
        let t = h * f64::from(k);
        let at = |by: [f64; 2], h: f64| [now[0] + by[0] * h, now[1] + by[1] * h];
        let first = rates(t, now);
        let second = rates(t + 0.5 * h, at(first, 0.5 * h));
        let third = rates(t + 0.5 * h, at(second, 0.5 * h));
        let fourth = rates(t + h, at(third, h));
        now = [0, 1].map(|i| now[i] + h / 6.0 * (first[i] + 2.0 * second[i] + 2.0 * third[i] + fourth[i]));
    }
    now[0]
}

/// A swinging weight that is hoisted over seven segments swings wider, as theory says, to the second order of the time step.
#[test]
fn a_hoisted_pendulum_swings_as_theory_says() {
    let angle = 0.5_f64;
    let end = |dt: f64| {
        let direction = Vector3::new(angle.sin(), 0.0, -angle.cos());
        let swinging = rope(direction, (40, 1e-4), 1.0, 1.0, steady(-0.1));
        let mut last = 0.0;
        run(&swinging, Integrator::Bdf2, (dt, (3.5 / dt).round() as usize), |_, state, _| {
            last = state.positions[39].x.atan2(-state.positions[39].z);
        });
        last
    };
    let expected = hoisted(0.975, -0.1, angle, 3.5);
    let [coarse, fine] = [0.004, 0.002].map(|dt| (end(dt) - expected).abs());
    assert!(fine < 1e-3 && coarse > 3.0 * fine, "{coarse} rad, {fine} rad of {expected} rad");
}

/// The pull of a hanging line at the eyelet is that of a catenary at each length, and changes smoothly from segment to segment.
#[test]
fn a_line_that_is_paid_out_hangs_in_a_catenary_at_each_length() {
    let speeds = vec![[0.0, 0.08], [2.5, 0.08], [3.0, 0.015], [15.0, 0.015], [16.0, -0.015], [30.0, -0.015]];
    let (mut model, state) = rope(Vector3::x(), (80, 0.05), 1.0, 0.0, Feed { speeds, ..steady(0.0) });
    let anchor = Body::Anchor(model.anchors.len());
    model.anchors.push(Pose { position: Vector3::x(), orientation: UnitQuaternion::identity() });
    let last = model.joints[78];
    model.joints.push(rod::Joint { a: Body::Segment(79), b: anchor, offset_b: 0.0, freedom: Freedom::Ball, ..last });
    model.damping = rod::Damping { linear: 2.0, angular: 2.0 };
    let (mut seen, mut before) = (0, f64::NAN);
    run(&(model, state), Integrator::Bdf2, (0.01, 2800), |time, _, sliding| {
        let length = 2.0 - sliding.place;
        // sinh(x) / x = length / span, by bisection.
        let (mut low, mut high) = (1e-6_f64, 5.0_f64);
        for _ in 0..100 {
            let x = 0.5 * (low + high);
            if x.sinh() / x < length { low = x } else { high = x }
        }
        let expected = 0.05 * G * 0.5 / low;
        let pull = -sliding.force.x;
        if time > 6.0 {
            // The line's own inertia pulls where the speed changes.
            let is_steady = !(15.0..=17.0).contains(&time);
            assert!(
                !is_steady || (pull / expected - 1.0).abs() < 0.015,
                "{time} s, {length} m: {pull} N, {expected} N"
            );
            assert!((pull / before - 1.0).abs() < 0.005, "{time} s: from {before} N to {pull} N");
            seen += 1;
        }
        before = pull;
    });
    assert!(seen > 2000);
}

/// A drive that is too weak slips: the weight falls as it does under that pull, down to the largest length; a strong one hoists to the least.
#[test]
fn a_drive_slips_at_its_largest_force_and_stops_at_its_lengths() {
    let feed = Feed { max_force: 8.0, lengths: [0.0, 0.9], ..steady(-0.5) };
    let falling = rope(-Vector3::z(), (40, 1e-6), 0.5, 1.0, feed);
    let mut last = (0.0, Sliding::default());
    run(&falling, Integrator::Bdf2, (0.005, 80), |time, _, sliding| {
        assert!((sliding.force.z - 8.0).abs() < 1e-3, "{}", sliding.force.z);
        last = (time, sliding);
    });
    let (time, sliding) = last;
    let expected = 0.5 + 0.5 * (G - 8.0) * time * time;
    assert!((2.0 - sliding.place - expected).abs() < 1e-3, "{} m, {expected} m", 2.0 - sliding.place);
    run(&falling, Integrator::Bdf2, (0.005, 200), |_, _, sliding| last.1 = sliding);
    assert!((last.1.place - 1.1).abs() < 1e-9 && (last.1.force.z / G - 1.0).abs() < 1e-3, "{:?}", last.1);
    let feed = Feed { max_force: 20.0, lengths: [0.3, f64::INFINITY], ..steady(-0.5) };
    let hoisted = rope(-Vector3::z(), (40, 1e-6), 1.0, 1.0, feed);
    run(&hoisted, Integrator::Bdf2, (0.005, 400), |_, _, sliding| last.1 = sliding);
    assert!((last.1.place - 1.7).abs() < 1e-9 && (last.1.force.z / G - 1.0).abs() < 1e-3, "{:?}", last.1);
}

/// A rope above the ground, whose stored part is in the way of a sphere and of the rope itself.
fn over_the_ground(feed: Feed) -> (Model, State) {
    let (mut model, mut state) = rope(-Vector3::z(), (100, 0.05), 0.25, 0.0, feed);
    let surface = Surface { friction: Friction::new(0.4), restitution: 0.0 };
    let normal = nalgebra::Unit::new_normalize(Vector3::z());
    let plane = ObstacleShape::HalfSpace { point: Vector3::z() * -0.3, normal };
    let sphere = ObstacleShape::Sphere { centre: Vector3::z() * 0.5, radius: 0.1 };
    model.contacts = Contacts {
        obstacles: [plane, sphere].map(|shape| Obstacle::new(shape, surface)).to_vec(),
        between_segments: Some(surface),
        ..Contacts::default()
    };
    model.damping = rod::Damping { linear: 2.0, angular: 2.0 };
    // Off the vertical, so that the rope buckles to one side.
    let tilt = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.05);
    for (x, q) in state.positions.iter_mut().zip(&mut state.orientations) {
        (*x, *q) = (tilt * *x, tilt * *q);
    }
    (model, state)
}

/// What is stored touches nothing, and a rope that is laid on the ground lies on it with what is outside.
#[test]
fn a_rope_is_laid_on_the_ground_and_taken_up_again() {
    let speeds = vec![[0.0, 0.3], [1.0, 0.3], [1.2, -0.3], [2.2, -0.3], [2.4, 0.0]];
    let feed = Feed { speeds, max_force: 2.0, ..steady(0.0) };
    let laid = over_the_ground(feed);
    let (mut lowest, mut longest, mut last) = (0.0_f64, 0.0_f64, Sliding::default());
    run(&laid, Integrator::Bdf2, (0.002, 2500), |_, state, sliding| {
        lowest = state.positions.iter().map(|x| x.z).fold(lowest, f64::min);
        longest = longest.max(2.0 - sliding.place);
        last = sliding;
    });
    assert!(longest > 0.5, "{longest} m");
    assert!((lowest + 0.296).abs() < 1e-4, "{lowest} m");
    // It hangs again, and the eyelet bears it.
    let expected = 0.05 * G * (2.0 - last.place);
    assert!(2.0 - last.place < 0.25 && (last.force.z / expected - 1.0).abs() < 0.01, "{last:?}, {expected} N");
}

/// A snapshot goes on with the same bits, also in another simulation and with other segments stored than there are then.
#[test]
fn a_snapshot_knows_what_is_stored() {
    for (model, state) in [rope(-Vector3::z(), (20, 0.5), 1.0, 1.0, steady(0.4)), over_the_ground(steady(0.4))] {
        let mut simulation = Simulation::new(&model, &state, &settings(Integrator::Bdf2), None).unwrap();
        simulation.set_feed(0, 0.5).unwrap();
        (0..100).for_each(|_| _ = simulation.step(0.004).unwrap());
        let snapshot = simulation.snapshot();
        let mut ends = Vec::new();
        let mut other = Simulation::new(&model, &state, &settings(Integrator::Bdf2), None).unwrap();
        other.restore(&snapshot).unwrap();
        for mut simulation in [simulation, other] {
            for _ in 0..2 {
                (0..100).for_each(|_| _ = simulation.step(0.004).unwrap());
                let (mut end, mut sliding) = (state.clone(), [Sliding::default()]);
                simulation.store(&mut end);
                simulation.store_sliding(&mut sliding);
                ends.push((end, sliding));
                simulation.restore(&snapshot).unwrap();
            }
        }
        assert!(ends.windows(2).all(|pair| pair[0] == pair[1]));
    }
}

#[test]
fn what_a_feed_cannot_be_is_said() {
    let (model, state) = rope(-Vector3::z(), (20, 0.5), 1.0, 1.0, steady(0.2));
    let mut simulation = Simulation::new(&model, &state, &settings(Integrator::Bdf2), None).unwrap();
    assert!(matches!(simulation.set_feed(1, 0.1), Err(SimulationError::NoFeed(1))));
    assert!(matches!(simulation.set_feed(0, f64::NAN), Err(SimulationError::NotFinite(_))));
    let mistake = |change: &dyn Fn(&mut Model)| {
        let mut model = model.clone();
        change(&mut model);
        model.validate(&state).err().map(|error| error.to_string()).unwrap_or_default()
    };
    let own = |change: &dyn Fn(&mut SlidingJoint)| mistake(&|model| change(&mut model.sliding_joints[0]));
    let of_feed = |change: &dyn Fn(&mut Feed)| own(&|joint| joint.feed.iter_mut().for_each(change));
    for (found, expected) in [
        (own(&|joint| joint.friction = 0.1), "friction = 0.1, but it must be 0 where a feed drives the rod"),
        (of_feed(&|feed| feed.max_force = -1.0), "largest force of the feed = -1, but it must be >= 0"),
        (
            of_feed(&|feed| feed.speeds = vec![[1.0, 0.0], [1.0, 2.0]]),
            "time of a speed of the feed = 1, but it must be later than the one before",
        ),
        (
            of_feed(&|feed| feed.lengths = [0.2, 0.1]),
            "least length beyond the eyelet = 0.2, but it must be >= 0 and not above the largest length",
        ),
        (
            of_feed(&|feed| feed.lengths = [1.5, 2.0]),
            "start = 1, but it must be where the lengths beyond the eyelet and the segments that are joined to others allow it",
        ),
        (
            mistake(&|model| model.segments[3].fixed = true),
            "fixed segments = 1, but it must be 0 in a rod that is stored",
        ),
        (
            mistake(&|model| {
                let other = SlidingJoint { start: 0.9, feed: None, ..model.sliding_joints[0].clone() };
                model.sliding_joints.push(other);
            }),
            "start = 1, but it must be before all other eyelets of a rod that is stored",
        ),
    ] {
        assert_eq!(found, format!("sliding joint 0: {expected}"));
    }
}

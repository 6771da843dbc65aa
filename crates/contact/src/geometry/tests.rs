//! Contacts of capsules against closed forms, symmetries and brute force.

use component::BodyPose;
use kernels::math::Quat;
use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;
use rod::{BodyShape, Friction};

use super::super::motion_bound::MotionBound;
use super::*;

/// A pose whose axis points along `direction`, rolled about it by `roll` [rad].
fn pose(centre: Vector3<f64>, direction: Vector3<f64>, roll: f64) -> BodyPose<f64> {
    let turn = UnitQuaternion::rotation_between(&Vector3::z(), &direction)
        .unwrap_or(UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
    let q = turn * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), roll);
    BodyPose { x: to_kernel(&centre), q: Quat { v: to_kernel(&q.imag()), w: q.w } }
}

/// A body that moves from `start` to `now`.
fn moving(start: BodyPose<f64>, now: BodyPose<f64>, half: f64, radius: f64) -> Side {
    let shape = Shape::new(0, 0, half, radius);
    Side { start, now, ends: shape.place(&now), ends_before: shape.place(&start), radius }
}

/// A body at rest.
fn still(centre: Vector3<f64>, direction: Vector3<f64>, half: f64, radius: f64) -> Side {
    let pose = pose(centre, direction, 0.0);
    moving(pose, pose, half, radius)
}

fn contact(own: &Side, other: &Side, feature: Feature, poses: Poses) -> Contact {
    let mut contact =
        Contact::new((0, Partner::Segment(1), feature), Friction::default(), own.radius.min(other.radius));
    contact.between(own, other, feature, poses);
    contact
}

fn nearest_contact(own: &Side, other: &Side) -> Contact {
    contact(own, other, Feature::Nearest, Poses::Now)
}

#[track_caller]
fn assert_near(found: Vec3<f64>, expected: [f64; 3]) {
    assert!((to_nalgebra(found) - Vector3::from(expected)).norm() < 1e-12, "{found:?} {expected:?}");
}

#[test]
fn crossing_capsules_touch_along_the_normal_of_both_axes() {
    let own = still(Vector3::new(0.3, 0.1, 0.5), Vector3::x(), 1.0, 0.2);
    let other = still(Vector3::new(0.0, 0.4, 0.0), Vector3::y(), 1.0, 0.1);
    let found = nearest_contact(&own, &other);
    assert!((found.gap - (0.5 - 0.3)).abs() < 1e-12, "{}", found.gap);
    assert_near(found.normal, [0.0, 0.0, 1.0]);
    // Halfway between the surfaces, at x = 0, y = 0.1, z = (0.3 + 0.1) / 2.
    assert_near(found.arms[0], [-0.3, 0.0, -0.3]);
    assert_near(found.arms[1], [0.0, -0.3, 0.2]);
    assert_near(found.slip, [0.0; 3]);
    assert!(!found.is_duplicate);
}

#[test]
fn ends_touch_along_the_line_between_them() {
    let own = still(Vector3::zeros(), Vector3::x(), 1.0, 0.2);
    let ahead = nearest_contact(&own, &still(Vector3::new(3.0, 0.0, 0.0), Vector3::x(), 1.0, 0.3));
    assert!((ahead.gap - 0.5).abs() < 1e-12);
    assert_near(ahead.normal, [-1.0, 0.0, 0.0]);
    // 3, 4, 5: from the end (1, 0, 0) to the other's middle.
    let aside = nearest_contact(&own, &still(Vector3::new(4.0, 4.0, 0.0), Vector3::z(), 2.0, 0.3));
    assert!((aside.gap - 4.5).abs() < 1e-12);
    assert_near(aside.normal, [-0.6, -0.8, 0.0]);
}

#[test]
fn parallel_capsules_touch_at_the_ends_of_what_they_share() {
    let own = still(Vector3::zeros(), Vector3::x(), 1.0, 0.1);
    let other = still(Vector3::new(0.5, 0.0, 1.0), Vector3::x(), 1.0, 0.1);
    // Own runs from -1 to 1, the other from -0.5 to 1.5: they share -0.5 to 1.
    for (feature, shared) in [
        (Feature::Own(0), None),
        (Feature::Own(1), Some(1.0)),
        (Feature::Partners(0), Some(-0.5)),
        (Feature::Partners(1), None),
    ] {
        let found = contact(&own, &other, feature, Poses::Now);
        assert_eq!(found.is_duplicate, shared.is_none(), "{feature:?}");
        if let Some(x) = shared {
            assert!((found.gap - 0.8).abs() < 1e-12);
            assert_near(found.normal, [0.0, 0.0, -1.0]);
            assert!((found.arms[0].0[0] - x).abs() < 1e-12);
        }
    }
}

#[test]
fn axes_that_cross_are_pushed_apart_across_both() {
    let own = still(Vector3::zeros(), Vector3::x(), 1.0, 0.2);
    for direction in [Vector3::y(), Vector3::z(), Vector3::new(1.0, 1.0, 1.0).normalize()] {
        let found = nearest_contact(&own, &still(Vector3::zeros(), direction, 1.0, 0.1));
        assert!((found.gap + 0.3).abs() < 1e-12, "{}", found.gap);
        let normal = to_nalgebra(found.normal);
        assert!((normal.norm() - 1.0).abs() < 1e-12);
        assert!(normal.x.abs() < 1e-9 && normal.dot(&direction).abs() < 1e-9, "{normal}");
    }
    // The same place twice: across the axis.
    let same = nearest_contact(&own, &still(Vector3::zeros(), Vector3::x(), 1.0, 0.1));
    assert!(same.normal.0[0].abs() < 1e-12 && (same.normal.norm_squared() - 1.0).abs() < 1e-12);
}

#[test]
fn slip_is_what_the_surfaces_move_past_each_other() {
    let (radius, angle) = (0.1, 1e-3);
    let start = pose(Vector3::new(0.0, 0.0, 2.0 * radius), Vector3::x(), 0.0);
    let other = still(Vector3::zeros(), Vector3::y(), 1.0, radius);
    let slipped = |shift: Vector3<f64>, roll: f64| {
        let now = pose(Vector3::new(0.0, 0.0, 2.0 * radius) + shift, Vector3::x(), roll);
        nearest_contact(&moving(start, now, 1.0, radius), &other).slip
    };
    // Along the normal it is no slip, across it is the way.
    assert_near(slipped(Vector3::new(0.01, 0.02, 0.03), 0.0), [0.01, 0.02, 0.0]);
    // Turning about the x axis takes the lowest point along y.
    let turned = to_nalgebra(slipped(Vector3::zeros(), angle));
    assert!((turned - Vector3::new(0.0, radius * angle, 0.0)).norm() < radius * angle * angle, "{turned}");
    // Rolling: the centre moves against it, and nothing slips.
    let rolled = to_nalgebra(slipped(Vector3::new(0.0, -radius * angle, 0.0), angle));
    assert!(rolled.norm() < radius * angle * angle, "{rolled}");
}

#[test]
fn a_fast_body_keeps_to_the_side_it_came_from() {
    let at = |z: f64| pose(Vector3::new(0.0, 0.0, z), Vector3::x(), 0.0);
    let own = moving(at(1.0), at(-1.0), 1.0, 0.1);
    let other = still(Vector3::zeros(), Vector3::y(), 1.0, 0.1);
    let found = nearest_contact(&own, &other);
    assert_near(found.normal, [0.0, 0.0, 1.0]);
    assert!((found.gap + 1.2).abs() < 1e-9, "{}", found.gap);
    // One that was there from the start is pushed out where it is.
    let slow = nearest_contact(&moving(at(-1.0), at(-1.0), 1.0, 0.1), &other);
    assert_near(slow.normal, [0.0, 0.0, -1.0]);
}

/// A rod that falls over another one and turns by more than a right angle from the normal of its first touch: normals alone would
/// say that it is on its side.
#[test]
fn a_body_that_turns_far_as_it_passes_has_passed() {
    let start = pose(Vector3::new(0.0, 0.0, 0.3), Vector3::x(), 0.0);
    let tilted = Vector3::new(-0.5, 0.0, 0.75_f64.sqrt());
    let now = pose(Vector3::new(0.8, 0.0, 0.3), tilted, 0.0);
    let other = still(Vector3::zeros(), Vector3::y(), 1.0, 0.1);
    let passed = nearest_contact(&moving(start, now, 1.0, 0.1), &other);
    // As deep as it is beyond, and both radii.
    let distance = 0.8 * 0.75_f64.sqrt() + 0.3 * 0.5;
    assert!((passed.gap + distance + 0.2).abs() < 1e-12, "{}", passed.gap);
    // The same turn further up meets nothing.
    let up = |mut pose: BodyPose<f64>| {
        pose.x.0[2] += 1.5;
        pose
    };
    let above = nearest_contact(&moving(up(start), up(now), 1.0, 0.1), &other);
    assert!(above.gap > 0.0, "{}", above.gap);
}

#[test]
fn settling_normals_lie_between_the_last_and_the_new() {
    let other = still(Vector3::zeros(), Vector3::y(), 1.0, 0.1);
    let at = |x: f64, z: f64| still(Vector3::new(x, 0.0, z), Vector3::y(), 1.0, 0.1);
    let mut found = nearest_contact(&at(0.0, 1.0), &other);
    found.between(&at(1.0, 0.0), &other, Feature::Nearest, Poses::Settling);
    let half = 0.5_f64.sqrt();
    assert_near(found.normal, [half, 0.0, half]);
    // Along any other normal the bodies are nearer.
    assert!((found.gap - (half - 0.2)).abs() < 1e-12, "{}", found.gap);
}

/// Least distance of two axes on a grid of places, and how far that may be above the least of all.
fn sampled(a: [Vec3<f64>; 2], b: [Vec3<f64>; 2]) -> (f64, f64) {
    const PLACES: usize = 200;
    let (a, b) = (a.map(to_nalgebra), b.map(to_nalgebra));
    let places = |line: [Vector3<f64>; 2]| {
        (0..=PLACES).map(move |k| line[0].lerp(&line[1], k as f64 / PLACES as f64)).collect::<Vec<_>>()
    };
    let (on_a, on_b) = (places(a), places(b));
    let least = on_a.iter().flat_map(|p| on_b.iter().map(move |q| (p - q).norm())).fold(f64::INFINITY, f64::min);
    (least, 0.5 * ((a[1] - a[0]).norm() + (b[1] - b[0]).norm()) / PLACES as f64)
}

/// Vectors in a cube of side 2.
fn place() -> impl Strategy<Value = Vector3<f64>> {
    [-1.0..1.0, -1.0..1.0, -1.0..1.0].prop_map(Vector3::from)
}

fn direction() -> impl Strategy<Value = Vector3<f64>> {
    place().prop_filter("a direction", |v| v.norm() > 0.1).prop_map(|v| v.normalize())
}

/// A body at rest, anywhere.
fn body() -> impl Strategy<Value = (Vector3<f64>, Vector3<f64>, f64, f64)> {
    (place(), direction(), 0.05..1.0, 0.01..0.3)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// What is told without an evaluation is no more than what it would find.
    #[test]
    fn a_gap_is_no_less_than_at_the_start_less_the_ways(
        a in body(), b in body(), common in place(), moves in [place(), place()], turns in [place(), place()], by in 0.0..0.5,
    ) {
        let side = |(centre, along, half, radius): (Vector3<f64>, Vector3<f64>, f64, f64), k: usize| {
            let (start, room) = (pose(centre, along, 0.0), by * radius);
            let turned: Vector3<f64> = along + turns[k] * (room / half);
            let now = pose(centre + common * 3.0 + moves[k] * room, turned.normalize(), 0.0);
            (moving(start, now, half, radius), moving(start, start, half, radius), MotionBound::between(&start, &now, half))
        };
        let ((now_a, start_a, way_a), (now_b, start_b, way_b)) = (side(a, 0), side(b, 1));
        let (start, now) = (nearest_contact(&start_a, &start_b).gap, nearest_contact(&now_a, &now_b).gap);
        let nearer = way_a.towards(way_b);
        prop_assume!(start > nearer);
        prop_assert!(now >= start - nearer - 1e-12, "{now} {start} {nearer}");
    }

    #[test]
    fn gaps_are_distances((x, d, h, r) in body(), (y, e, g, s) in body()) {
        let (own, other) = (still(x, d, h, r), still(y, e, g, s));
        let found = nearest_contact(&own, &other);
        let (least, above) = sampled(own.ends, other.ends);
        let distance = found.gap + r + s;
        prop_assert!(distance <= least + 1e-12 && least <= distance + above, "{distance} {least} {above}");
    }

    #[test]
    fn the_partner_sees_the_same_from_the_other_side((x, d, h, r) in body(), (y, e, g, s) in body()) {
        let (own, other) = (still(x, d, h, r), still(y, e, g, s));
        let (one, two) = (nearest_contact(&own, &other), nearest_contact(&other, &own));
        prop_assert!((one.gap - two.gap).abs() < 1e-12);
        // Axes that nearly cross, or lie side by side, leave normals or places open.
        let separate = one.gap + r + s > 1e-3 && d.cross(&e).norm() > 1e-3;
        if separate {
            prop_assert!(to_nalgebra(one.normal + two.normal).norm() < 1e-6);
            prop_assert!(to_nalgebra(one.arms[0] - two.arms[1]).norm() < 1e-6);
        }
    }

    #[test]
    fn turning_the_world_turns_the_contact(
        (x, d, h, r) in body(), (y, e, g, s) in body(), axis in direction(), angle in 0.0..6.0, shift in place(),
    ) {
        let turn = UnitQuaternion::from_axis_angle(&nalgebra::Unit::new_normalize(axis), angle);
        let one = nearest_contact(&still(x, d, h, r), &still(y, e, g, s));
        let turned = |x: Vector3<f64>| turn * x + shift;
        let two = nearest_contact(&still(turned(x), turn * d, h, r), &still(turned(y), turn * e, g, s));
        prop_assert!((one.gap - two.gap).abs() < 1e-12);
        if one.gap + r + s > 1e-3 && d.cross(&e).norm() > 1e-3 {
            prop_assert!((turn * to_nalgebra(one.normal) - to_nalgebra(two.normal)).norm() < 1e-6);
            prop_assert!((turn * to_nalgebra(one.arms[0]) - to_nalgebra(two.arms[0])).norm() < 1e-6);
        }
    }

    #[test]
    fn frames_are_orthonormal_and_vectors_come_back((x, d, h, r) in body(), (y, e, g, s) in body(), v in place()) {
        let found = nearest_contact(&still(x, d, h, r), &still(y, e, g, s));
        let [n, t1, t2] = found.frame.map(to_nalgebra);
        prop_assert!((n.cross(&t1) - t2).norm() < 1e-12 && n.dot(&t1).abs() < 1e-12);
        prop_assert!((n.norm() - 1.0).abs() < 1e-12 && (t1.norm() - 1.0).abs() < 1e-12);
        let back = found.world(found.local(to_kernel(&v)));
        prop_assert!((to_nalgebra(back) - v).norm() < 1e-12);
    }
}

#[test]
fn keys_come_back_from_their_words() {
    let most = u32::MAX;
    let partners = [
        Partner::Segment(most),
        Partner::Obstacle(7),
        Partner::Face(most, 0),
        Partner::Face(0, most),
        Partner::Edge(most, most),
        Partner::Corner(2, most),
        Partner::BodyFace(4, most),
        Partner::BodyEdge(most, 1),
    ];
    for partner in partners {
        let of_meshes = [Feature::Corner(most), Feature::Face(0), Feature::Edge(most)];
        for feature in Feature::PARALLEL.into_iter().chain(of_meshes) {
            let own = (most, partner, feature);
            assert_eq!(key(words(own)), own);
        }
    }
}

/// Two capsules that lie across each other at an angle, and the second one after a tilt by which the nearest places move.
fn tilted(angle: f64, tilt: f64) -> [Side; 3] {
    let along = Vector3::new(angle.cos(), angle.sin(), 0.0);
    let own = still(Vector3::new(0.0, 0.0, 0.2), Vector3::x(), 1.0, 0.1);
    let beside = still(Vector3::zeros(), along, 1.0, 0.1);
    let after = still(Vector3::zeros(), (along + Vector3::z() * tilt).normalize(), 1.0, 0.1);
    [own, beside, after]
}

#[test]
fn nearest_places_of_nearly_parallel_axes_stay_unless_others_are_nearer() {
    let places = |angle: f64, tilt: f64, steady: f64| {
        let [own, before, after] = tilted(angle, tilt);
        let mut contact = nearest_contact(&own, &before);
        contact.hysteresis = steady;
        contact.between(&own, &after, Feature::Nearest, Poses::Now);
        (contact.arms[0].0[0], contact.gap)
    };
    // They move by about the tilt times the distance over the squared sine: 0.05.
    let (moved, least) = places(0.1, 2.5e-3, 0.0);
    let (stayed, gap) = places(0.1, 2.5e-3, 1e-4);
    assert!(moved.abs() > 0.04 && stayed.abs() < 1e-3, "{moved} {stayed}");
    assert!(gap > least && gap - least <= 1e-4, "{gap} {least}");
    // Further than that they are nearer by more.
    let (moved, least) = places(0.1, 1e-2, 0.0);
    assert_eq!(places(0.1, 1e-2, 1e-4), (moved, least));
    // Axes that cross have one nearest place.
    assert_eq!(places(0.5, 2.5e-3, 1e-4), places(0.5, 2.5e-3, 0.0));
}

#[test]
fn places_that_settle_go_half_way_and_say_how_much_nearer_others_are() {
    let [own, before, after] = tilted(0.1, 1e-2);
    let mut contact = nearest_contact(&own, &before);
    let start = contact.arms[0].0[0];
    contact.between(&own, &after, Feature::Nearest, Poses::Now);
    let (least, nearest) = (contact.gap, contact.arms[0].0[0]);
    assert_eq!(contact.distance, least);
    let mut contact = nearest_contact(&own, &before);
    contact.hysteresis = 1e-5;
    contact.between(&own, &after, Feature::Nearest, Poses::Settling);
    assert!((contact.arms[0].0[0] - 0.5 * (start + nearest)).abs() < 1e-3, "{start} {nearest}");
    // Penetration is that of the nearest places.
    assert!((contact.distance - least).abs() < 1e-13, "{} {least}", contact.distance);
    // Distances grow with the square of the way from the nearest places.
    let all = (own.at(0.5) - after.at(0.5)).norm_squared().sqrt() - (least + 0.2);
    assert!((contact.closer_by - 0.25 * all).abs() < 1e-5, "{} {all}", contact.closer_by);
    // A quarter of it is left each time, up to where places stay.
    while contact.closer_by > 0.0 {
        let before = contact.closer_by;
        contact.between(&own, &after, Feature::Nearest, Poses::Settling);
        assert!(contact.closer_by < 0.3 * before, "{} {before}", contact.closer_by);
    }
    assert!((contact.arms[0].0[0] - nearest).abs() < 0.03);
}

/// An impulse that turns with its normal keeps its share along it, its friction's size, and its length.
#[test]
fn an_impulse_turns_with_its_normal() {
    let mut contact = Contact::new((0, Partner::Obstacle(0), Feature::Nearest), Friction::default(), 0.1);
    let unit = |v: Vec3<f64>| v * (1.0 / v.norm_squared().sqrt());
    let (before, after) = (unit(Vec3([0.1, -0.2, 1.0])), unit(Vec3([0.4, 0.1, 0.9])));
    let impulse = Vec3([0.3, -0.7, 2.0]);
    (contact.impulse, contact.normal) = (impulse, after);
    contact.turn_impulse(before);
    let size = |v: Vec3<f64>| v.norm_squared().sqrt();
    assert!((size(contact.impulse) - size(impulse)).abs() < 1e-14);
    assert!((contact.impulse.dot(after) - impulse.dot(before)).abs() < 1e-14);
    // What is across both normals stays.
    let across = before.cross(after);
    assert!((contact.impulse.dot(across) - impulse.dot(across)).abs() < 1e-14);
    // The other side of a body is another contact.
    (contact.impulse, contact.normal) = (impulse, -before);
    contact.turn_impulse(before);
    assert_eq!(contact.impulse, impulse);
}

/// The gap of an end that goes from one place to another with the side of a box of 2 m at x = 1, where it touches that.
fn gap_with_side(from: [f64; 3], to: [f64; 3]) -> Option<f64> {
    let mesh = BodyShape::Box { sides: Vector3::repeat(2.0) }.mesh();
    let parts = TriangleMesh::new(&mesh.positions, &mesh.triangles);
    let here = BodyPose { x: Vec3::zero(), q: Quat::identity() };
    let carrier = Carrier { mesh: &parts, frames: [here; 2], body: None };
    let [start, now] = [from, to].map(|end| pose(Vector3::from(end) + Vector3::z(), Vector3::z(), 0.0));
    let own = moving(start, now, 1.0, 0.2);
    let side = parts.faces().iter().enumerate().filter(|(_, face)| face.normal.x > 0.9);
    let gaps = side.filter_map(|(k, face)| {
        let key = (0, Partner::Face(0, k as u32), Feature::Own(0));
        let mut contact = Contact::new(key, Friction::default(), 0.2);
        contact.with_face(&own, &carrier, face, 0);
        (!contact.is_duplicate).then(|| {
            assert_near(contact.normal, [1.0, 0.0, 0.0]);
            contact.gap
        })
    });
    gaps.reduce(f64::min)
}

#[test]
fn an_end_that_comes_around_an_edge_touches_the_side_where_it_is() {
    // From above the top, on the inner side of the plane x = 1, which it passes above the edge.
    let around = gap_with_side([0.95, 0.3, 1.3], [1.1, 0.3, 0.9]).unwrap();
    assert!((around - (0.1 - 0.2)).abs() < 1e-12, "{around}");
    // Through the side itself, where it counts as not yet through, and from beside it through the top, which is not the side's matter.
    let through = gap_with_side([1.1, 0.3, 0.5], [0.9, 0.3, 0.5]).unwrap();
    assert!((through - (-0.1 - 0.2)).abs() < 1e-12, "{through}");
    assert_eq!(gap_with_side([1.1, 0.3, 1.3], [0.9, 0.3, 0.8]), None);
}

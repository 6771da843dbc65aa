//! The first touch of moving capsules against dense sampling in time, and whether they pass through each other against the same.

use collision::sweep::{TOLERANCE, Touch, crosses, first_touch};
use collision::{Capsule, MovingCapsule, closest};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn vector(random: &mut ChaCha8Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| random.random_range(-1.0..1.0))
}

fn distance(a: &MovingCapsule, b: &MovingCapsule, time: f64) -> f64 {
    let [a, b] = [a, b].map(|c| c.at(time)).map(|c| [c.start, c.end]);
    closest::segments(&a, &b).distance
}

/// The touch is what it says, and dense samples before it are further apart than the radii.
fn check(a: &MovingCapsule, b: &MovingCapsule) -> Option<Touch> {
    const SAMPLES: usize = 2000;
    let radii = a.radius + b.radius;
    let touch = first_touch(a, b);
    let until = touch.map_or(1.0, |touch| touch.time);
    for k in 0..=SAMPLES {
        let time = k as f64 / SAMPLES as f64 * until;
        if time < until || touch.is_none() {
            let distance = distance(a, b, time);
            assert!(distance > radii, "{distance} at {time} is below {radii}, but {touch:?}");
        }
    }
    if let Some(Touch { time, s, t, normal, distance }) = touch {
        let [at_a, at_b] = [a.at(time), b.at(time)];
        let between = at_a.start.lerp(&at_a.end, s) - at_b.start.lerp(&at_b.end, t);
        assert!((0.0..=1.0).contains(&time));
        assert!((between - normal * distance).norm() < 1e-12, "{touch:?}");
        assert!((normal.norm() - 1.0).abs() < 1e-12);
        assert!(distance <= radii * (1.0 + TOLERANCE), "{touch:?}: advances used up");
        assert!(time == 0.0 || distance > radii, "{touch:?} is past the first time");
    }
    touch
}

#[test]
fn agrees_with_dense_samples() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut touches = [0; 3];
    for k in 0..6000 {
        let mut next = || vector(&mut random);
        let mut a = MovingCapsule { from: [next(), next()], to: [next(), next()], radius: 0.02 };
        let mut b = MovingCapsule { from: [next(), next()], to: [next(), next()], radius: 0.03 };
        match k % 4 {
            // A fixed capsule, a fixed sphere, and a motion without turning.
            1 => b.to = b.from,
            2 => b = MovingCapsule::fixed(&Capsule { start: b.from[0], end: b.from[0], radius: 0.1 }),
            3 => a.to = a.from.map(|end| end + a.to[0]),
            _ => (),
        }
        let touch = check(&a, &b);
        touches[touch.map_or(0, |touch| if touch.time == 0.0 { 1 } else { 2 })] += 1;
    }
    assert!(touches[0] > 500 && touches[1] > 50 && touches[2] > 500, "{touches:?}");
}

#[test]
fn known_times() {
    let rod = |z: f64| [Vector3::new(-1.0, 0.0, z), Vector3::new(1.0, 0.0, z)];
    let fixed = MovingCapsule::fixed(&Capsule {
        start: Vector3::new(0.0, -1.0, 0.0),
        end: Vector3::new(0.0, 1.0, 0.0),
        radius: 0.1,
    });
    let falling = MovingCapsule { from: rod(1.0), to: rod(-1.0), radius: 0.1 };
    let touch = check(&falling, &fixed).unwrap();
    assert!((touch.time - 0.4).abs() < 1e-3 && (touch.s - 0.5).abs() < 1e-12 && (touch.t - 0.5).abs() < 1e-12);
    assert!((touch.normal - Vector3::z()).norm() < 1e-12);
    // Fast as a bullet: it passes through within one step.
    let bullet = MovingCapsule { from: rod(1000.0), to: rod(-1000.0), radius: 1e-3 };
    assert!((check(&bullet, &fixed).unwrap().time - (1000.0 - 0.101) / 2000.0).abs() < 1e-6);
    // Away from each other, both at rest, and one that stops before.
    assert_eq!(check(&MovingCapsule { from: rod(0.5), to: rod(2.0), radius: 0.1 }, &fixed), None);
    assert_eq!(check(&MovingCapsule { from: rod(0.5), to: rod(0.5), radius: 0.1 }, &fixed), None);
    assert_eq!(check(&MovingCapsule { from: rod(1.0), to: rod(0.21), radius: 0.1 }, &fixed), None);
}

#[test]
fn touching_from_the_start() {
    let along = |z: f64| [Vector3::new(-1.0, 0.0, z), Vector3::new(1.0, 0.0, z)];
    let across = [Vector3::new(0.0, -1.0, 0.0), Vector3::new(0.0, 1.0, 0.0)];
    let fixed = MovingCapsule { from: across, to: across, radius: 0.1 };
    let leaving = MovingCapsule { from: along(0.15), to: along(1.0), radius: 0.1 };
    let touch = check(&leaving, &fixed).unwrap();
    assert_eq!(touch.time, 0.0);
    assert!((touch.normal - Vector3::z()).norm() < 1e-12);
    // Crossing lines, a line on itself, and points on each other: the normal is against the motion.
    let down = check(&MovingCapsule { from: along(0.0), to: along(-1.0), radius: 0.1 }, &fixed).unwrap();
    assert!((down.normal - Vector3::z()).norm() < 1e-12 && down.distance == 0.0);
    let itself = check(&MovingCapsule { from: across, to: along(-1.0), radius: 0.1 }, &fixed).unwrap();
    assert!(itself.normal.y.abs() < 1e-12 && itself.normal.z >= 0.0);
    let dot = |z: f64| [Vector3::new(0.0, 0.0, z); 2];
    let point = MovingCapsule { from: dot(0.0), to: dot(0.0), radius: 0.1 };
    let dropped = check(&MovingCapsule { from: dot(0.0), to: dot(-1.0), radius: 0.1 }, &point).unwrap();
    assert!((dropped.normal - Vector3::z()).norm() < 1e-12);
    check(&point, &point).unwrap();
}

#[test]
fn grazing_motions() {
    // A rod passes another in a height of about the sum of radii, straight or turning on the spot as it passes.
    let across = [Vector3::new(0.0, -1.0, 0.0), Vector3::new(0.0, 1.0, 0.0)];
    let fixed = MovingCapsule { from: across, to: across, radius: 0.05 };
    for turn in [0.0, 0.3, 1.0] {
        for excess in [-1e-2, -1e-4, 0.0, 1e-4, 4e-4, 6e-4, 2e-3, 1e-2] {
            let z = 0.1 * (1.0 + excess);
            let rod = |x: f64, turn: f64| [Vector3::new(x - turn, -0.7, z), Vector3::new(x + turn, 0.7, z)];
            let passing = MovingCapsule { from: rod(-1.0, turn), to: rod(1.0, -turn), radius: 0.05 };
            let touch = check(&passing, &fixed);
            if excess < 0.5 * TOLERANCE {
                assert!(touch.is_some(), "turn {turn}, excess {excess}");
            } else if excess > TOLERANCE {
                assert_eq!(touch, None, "turn {turn}, excess {excess}");
            }
        }
    }
}

#[test]
fn swept_boxes_hold_the_motion() {
    let mut random = ChaCha8Rng::seed_from_u64(2);
    for _ in 0..100 {
        let mut next = || vector(&mut random);
        let moving = MovingCapsule { from: [next(), next()], to: [next(), next()], radius: 0.1 };
        let swept = moving.aabb();
        for k in 0..=20 {
            let aabb = moving.at(f64::from(k) / 20.0).aabb();
            assert!((swept.min - aabb.min).max() < 1e-15 && (aabb.max - swept.max).max() < 1e-15);
        }
    }
}

/// The least distance of two centre lines over the step, by dense samples, and denser ones about the nearest.
fn nearest(a: &MovingCapsule, b: &MovingCapsule) -> f64 {
    const SAMPLES: usize = 400;
    let (mut from, mut to, mut least) = (0.0_f64, 1.0_f64, f64::INFINITY);
    for _ in 0..5 {
        let step = (to - from) / SAMPLES as f64;
        let times = (0..=SAMPLES).map(|k| from + step * k as f64);
        let (time, found) =
            times.map(|time| (time, distance(a, b, time))).min_by(|one, other| one.1.total_cmp(&other.1)).unwrap();
        least = least.min(found);
        (from, to) = ((time - step).max(0.0), (time + step).min(1.0));
    }
    least
}

#[test]
fn lines_cross_where_they_come_to_meet() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut crossed = 0;
    for k in 0..1500 {
        let mut next = || vector(&mut random);
        let a = MovingCapsule { from: [next(), next()], to: [next(), next()], radius: 0.02 };
        let mut b = MovingCapsule { from: [next(), next()], to: [next(), next()], radius: 0.03 };
        if k % 2 == 0 {
            b.to = b.from;
        }
        let least = nearest(&a, &b);
        let found = crosses(&a, &b);
        assert_eq!(found, least < 1e-6, "{least}: {a:?} {b:?}");
        assert_eq!(crosses(&b, &a), found);
        crossed += usize::from(found);
    }
    assert!((150..1350).contains(&crossed), "{crossed}");
}

#[test]
fn known_crossings() {
    let rod = |x: f64, z: f64| [Vector3::new(x - 1.0, 0.0, z), Vector3::new(x + 1.0, 0.0, z)];
    let moving = |from, to| MovingCapsule { from, to, radius: 0.1 };
    let across = [Vector3::new(0.0, -1.0, 0.0), Vector3::new(0.0, 1.0, 0.0)];
    let fixed = moving(across, across);
    // Through it, however fast; past its end; up to it; and past the end of the one that falls.
    assert!(crosses(&moving(rod(0.0, 1.0), rod(0.0, -1.0)), &fixed));
    assert!(crosses(&moving(rod(0.9, 1000.0), rod(0.9, -1000.0)), &fixed));
    assert!(!crosses(&moving(rod(0.0, 1.0), rod(0.0, 1e-9)), &fixed));
    assert!(!crosses(&moving(rod(1.1, 1.0), rod(1.1, -1.0)), &fixed));
    // Half a turn about its middle, beside the other one, and a turn within one plane.
    let [near, far] = [0.5, 1.5].map(|x| [Vector3::new(-x, 0.0, 0.2), Vector3::new(x, 0.0, 0.2)]);
    let turned = |[a, b]: [Vector3<f64>; 2]| [b, a];
    assert!(!crosses(&moving(near, turned(near)), &fixed));
    assert!(!crosses(&moving(far, far), &fixed));
    assert!(!crosses(&moving(rod(0.0, 0.0), across), &fixed));
}

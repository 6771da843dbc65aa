//! Closest points against parry, and against a finer search where parry gives up digits.

use collision::closest::{Closest, point, segments};
use nalgebra::{Rotation3, Vector3};
use parry3d_f64::math::{Pose, Vector};
use parry3d_f64::query;
use parry3d_f64::shape::Segment;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

type Line = [Vector3<f64>; 2];

fn vector(random: &mut ChaCha8Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| random.random_range(-1.0..1.0))
}

fn parry(a: &Line, b: &Line) -> f64 {
    let segment = |line: &Line| {
        let [p, q] = line.map(|v| Vector::new(v.x, v.y, v.z));
        Segment::new(p, q)
    };
    query::distance(&Pose::IDENTITY, &segment(a), &Pose::IDENTITY, &segment(b)).unwrap().distance
}

/// The distance from the point at s of a to b.
fn distance_at(a: &Line, b: &Line, s: f64) -> f64 {
    let p = a[0] + (a[1] - a[0]) * s;
    let along = b[1] - b[0];
    let t = if along.norm_squared() > 0.0 { (p - b[0]).dot(&along) / along.norm_squared() } else { 0.0 };
    (p - b[0] - along * t.clamp(0.0, 1.0)).norm()
}

/// The distance by a search along a: it is convex in s.
fn searched(a: &Line, b: &Line) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..120 {
        let third = (high - low) / 3.0;
        if distance_at(a, b, low + third) < distance_at(a, b, high - third) { high -= third } else { low += third }
    }
    [low, 0.0, 1.0].map(|s| distance_at(a, b, s)).into_iter().fold(f64::INFINITY, f64::min)
}

/// The result is in its bounds and agrees with itself.
fn check(a: &Line, b: &Line, size: f64) -> Closest {
    let closest = segments(a, b);
    let Closest { s, t, on_a, on_b, separation, distance } = closest;
    assert!((0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t), "{closest:?}");
    let norm = |v: Vector3<f64>| (v / size).norm();
    assert!(norm(on_a - a[0] - (a[1] - a[0]) * s) <= 1e-15);
    assert!(norm(on_b - b[0] - (b[1] - b[0]) * t) <= 1e-15);
    assert!(norm(on_a - on_b - separation) <= 1e-14, "{closest:?}");
    assert!((norm(separation) - distance / size).abs() <= 1e-14, "{closest:?}");
    closest
}

#[test]
fn agrees_with_parry() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for k in 0..100_000 {
        let mut next = || vector(&mut random);
        let (a, mut b) = ([next(), next()], [next(), next()]);
        match k % 5 {
            0 => b[1] = b[0] + (b[1] - b[0]) * 1e-3,
            1 => b[1] = b[0],
            2 => b[0] = a[1],
            _ => (),
        }
        let (distance, expected) = (check(&a, &b, 4.0).distance, parry(&a, &b));
        assert!((distance - expected).abs() < 1e-13, "{a:?} {b:?}: {distance}, parry {expected}");
    }
}

#[test]
fn nearly_parallel_lines_keep_their_digits() {
    let mut random = ChaCha8Rng::seed_from_u64(2);
    for _ in 0..20_000 {
        let angle = 10f64.powf(random.random_range(-18.0..-1.0));
        let along = vector(&mut random).normalize();
        let across = along.cross(&vector(&mut random)).normalize();
        let turned = Rotation3::new(across.cross(&along) * angle) * along;
        // Lines that cross at their middles, are shifted along each other, and lifted.
        let shift = along * random.random_range(-1.0..1.0);
        let lift = across * [0.0, 1e-9, 0.1][random.random_range(0..3)];
        let (a, b) = ([-along, along], [shift + lift - turned, shift + lift + turned]);
        let distance = check(&a, &b, 4.0).distance;
        let expected = searched(&a, &b);
        assert!((distance - expected).abs() < 2e-15, "angle {angle}: {distance}, searched {expected}");
    }
}

#[test]
fn parallel_lines() {
    let line = |x0: f64, x1: f64, y: f64| [Vector3::new(x0, y, 0.0), Vector3::new(x1, y, 0.0)];
    for (a, b, expected) in [
        (line(0.0, 1.0, 0.0), line(0.5, 2.0, 0.3), 0.3),
        (line(0.0, 1.0, 0.0), line(2.0, 0.5, 0.3), 0.3),
        (line(0.0, 1.0, 0.0), line(1.3, 2.0, 0.4), 0.5),
        (line(0.0, 1.0, 0.0), line(-2.0, -0.3, 0.4), 0.5),
        (line(0.0, 1.0, 0.0), line(-0.3, -2.0, 0.4), 0.5),
        (line(0.0, 1.0, 0.0), line(0.0, 1.0, 0.0), 0.0),
        (line(0.0, 1.0, 0.0), line(0.2, 0.2, 0.3), 0.3),
    ] {
        let distance = check(&a, &b, 1.0).distance;
        assert!((distance - expected).abs() < 1e-15, "{a:?} {b:?}: {distance}");
    }
}

#[test]
fn any_scale() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    for exponent in [-300, -160, -80, -30, 30, 80, 160, 300] {
        let scale = 10f64.powi(exponent);
        for _ in 0..1000 {
            let mut next = || vector(&mut random);
            let (a, b) = ([next(), next()], [next(), next()]);
            let [big_a, big_b] = [a, b].map(|line| line.map(|v| v * scale));
            let expected = segments(&a, &b);
            let closest = check(&big_a, &big_b, 4.0 * scale);
            assert!((closest.distance / scale - expected.distance).abs() < 1e-14, "10^{exponent}: {closest:?}");
        }
    }
}

#[test]
fn lengths_of_all_sizes_together() {
    let mut random = ChaCha8Rng::seed_from_u64(4);
    for _ in 0..20_000 {
        let mut size = || 10f64.powf(random.random_range(-40.0..0.0));
        let sizes = [size(), size(), size()];
        let mut next = || vector(&mut random);
        let (from_a, along_a, along_b) = (next() * sizes[2], next() * sizes[0], next() * sizes[1]);
        let (a, b) = ([from_a, from_a + along_a], [Vector3::zeros(), along_b]);
        let largest = sizes.into_iter().fold(0.0, f64::max);
        let distance = check(&a, &b, 4.0 * largest).distance;
        let expected = searched(&a, &b);
        assert!((distance - expected).abs() < 1e-14 * largest, "{a:?} {b:?}: {distance}, searched {expected}");
    }
}

#[test]
fn points() {
    let line = [Vector3::new(1.0, 1.0, 1.0), Vector3::new(1.0, 1.0, 3.0)];
    assert_eq!(point(&line, &Vector3::new(5.0, 0.0, 1.5)), 0.25);
    assert_eq!(point(&line, &Vector3::new(5.0, 0.0, 0.5)), 0.0);
    assert_eq!(point(&line, &Vector3::new(5.0, 0.0, 3.5)), 1.0);
    assert_eq!(point(&[line[0], line[0]], &line[1]), 0.0);
    let same = segments(&[line[0], line[0]], &[line[0], line[0]]);
    assert_eq!((same.distance, same.on_a), (0.0, line[0]));
}

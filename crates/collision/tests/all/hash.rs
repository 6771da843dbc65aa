//! The spatial hash finds exactly the pairs that brute force finds.

use collision::{Aabb, SpatialHash};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn brute_force(boxes: &[Aabb]) -> Vec<[u32; 2]> {
    let finite = |b: &Aabb| b.min.iter().chain(&b.max).all(|x| x.is_finite());
    let mut pairs = Vec::new();
    for (i, a) in boxes.iter().enumerate() {
        for (j, b) in boxes.iter().enumerate().skip(i + 1) {
            if finite(a) && finite(b) && a.overlaps(b) {
                pairs.push([i as u32, j as u32]);
            }
        }
    }
    pairs
}

/// Pairs of the hash, sorted; each must be there once.
fn hashed(hash: &mut SpatialHash, boxes: &[Aabb]) -> Vec<[u32; 2]> {
    let mut pairs = Vec::new();
    hash.rebuild(boxes);
    hash.pairs(|_, _| true, &mut pairs);
    pairs.sort_unstable();
    pairs
}

fn check(boxes: &[Aabb]) {
    assert_eq!(hashed(&mut SpatialHash::new(), boxes), brute_force(boxes));
}

fn vector(random: &mut ChaCha8Rng, size: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| random.random_range(-size..=size))
}

/// How the boxes of a scene are made.
struct Style {
    /// Powers of ten of the sizes, from and to.
    sizes: [f64; 2],
    world: f64,
    centre: Vector3<f64>,
    /// Coordinates are rounded to multiples of this, so that faces touch and fall on cells' faces.
    raster: Option<f64>,
    /// Part of the boxes that copy another one, or are points.
    special: f64,
}

fn scene(random: &mut ChaCha8Rng, count: usize, style: &Style) -> Vec<Aabb> {
    let mut boxes: Vec<Aabb> = Vec::with_capacity(count);
    for _ in 0..count {
        let special = random.random_range(0.0..1.0) < style.special;
        if special && !boxes.is_empty() && random.random_range(0..2) == 0 {
            boxes.push(boxes[random.random_range(0..boxes.len())]);
            continue;
        }
        let size = if special { 0.0 } else { 10f64.powf(random.random_range(style.sizes[0]..=style.sizes[1])) };
        let corner = style.centre + vector(random, style.world);
        let extents = vector(random, 1.0).map(|x| x.abs() * size);
        let round = |x: f64| style.raster.map_or(x, |raster| (x / raster).round() * raster);
        boxes.push(Aabb { min: corner.map(round), max: (corner + extents).map(round) });
    }
    boxes
}

#[test]
fn finds_what_brute_force_finds() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut hash = SpatialHash::new();
    let (mut total, mut possible) = (0, 0);
    for k in 0..10_000 {
        let spread = random.random_range(0.0..4.5);
        let largest = random.random_range(-1.0..1.0);
        let centre = match k % 4 {
            0 => Vector3::zeros(),
            1 => vector(&mut random, 3.0),
            2 => vector(&mut random, 1e6),
            _ => vector(&mut random, 1e12),
        };
        let style = Style {
            sizes: [largest - spread, largest],
            world: 10f64.powf(random.random_range(-1.5..0.8)),
            centre,
            raster: (k % 3 == 0).then_some(0.125),
            special: 0.1,
        };
        let count = if k % 200 == 0 { 500 } else { random.random_range(2..=60) };
        let boxes = scene(&mut random, count, &style);
        let expected = brute_force(&boxes);
        assert_eq!(hashed(&mut hash, &boxes), expected, "scene {k}");
        total += expected.len();
        possible += count * (count - 1) / 2;
    }
    let part = total as f64 / possible as f64;
    assert!((0.05..0.6).contains(&part), "{part} of all pairs overlap: too few or too many to show anything");
}

#[test]
fn sizes_from_tiny_to_huge() {
    let mut random = ChaCha8Rng::seed_from_u64(2);
    for exponents in [[-320.0, 308.0], [-20.0, 20.0], [-320.0, -300.0], [290.0, 308.0]] {
        for _ in 0..200 {
            let boxes: Vec<_> = (0..40)
                .map(|_| {
                    let mut coordinate = || {
                        let size = 10f64.powf(random.random_range(exponents[0]..exponents[1]));
                        if random.random_range(0..2) == 0 { size } else { -size }
                    };
                    let (a, b) = (Vector3::from_fn(|_, _| coordinate()), Vector3::from_fn(|_, _| coordinate()));
                    Aabb { min: a.inf(&b), max: a.sup(&b) }
                })
                .collect();
            check(&boxes);
        }
    }
    let all = Aabb { min: Vector3::repeat(-f64::MAX), max: Vector3::repeat(f64::MAX) };
    let point = |x: f64| Aabb { min: Vector3::repeat(x), max: Vector3::repeat(x) };
    check(&[all, all, point(0.0), point(-0.0), point(5e-324), point(-5e-324), point(f64::MAX), point(-f64::MAX)]);
}

#[test]
fn boxes_on_the_faces_of_cells() {
    // Extents that are powers of two, or one rounding above or below, at corners of cells.
    let mut boxes = Vec::new();
    for extent in [0.5, 1.0_f64.next_down(), 1.0, 1.0_f64.next_up(), 2.0] {
        for corner in [-2.0, -1.0, (-1.0_f64).next_up(), -0.0, 1.0_f64.next_down(), 1.0, 1e9] {
            let min = Vector3::new(corner, 0.0, -extent);
            boxes.push(Aabb { min, max: min + Vector3::repeat(extent) });
        }
    }
    check(&boxes);
}

#[test]
fn identical_boxes() {
    let one = Aabb { min: Vector3::new(1.0, 2.0, 3.0), max: Vector3::new(1.5, 2.9, 3.1) };
    check(&[one; 50]);
    check(&[Aabb { min: one.min, max: one.min }; 50]);
}

#[test]
fn boxes_that_are_not_finite_overlap_nothing() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let style = Style { sizes: [-2.0, 0.0], world: 0.6, centre: Vector3::zeros(), raster: None, special: 0.0 };
    let mut boxes = scene(&mut random, 200, &style);
    for (k, bad) in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY].into_iter().cycle().take(30).enumerate() {
        let aabb = &mut boxes[k * 5];
        if k % 2 == 0 { aabb.min[k % 3] = bad } else { aabb.max[k % 3] = bad }
    }
    assert!(brute_force(&boxes).len() > 100);
    check(&boxes);
    check(&[Aabb { min: Vector3::repeat(f64::NAN), max: Vector3::repeat(f64::NAN) }; 3]);
}

#[test]
fn few_boxes() {
    check(&[]);
    check(&[Aabb { min: Vector3::zeros(), max: Vector3::zeros() }]);
}

#[test]
fn unwanted_pairs_are_left_out() {
    let one = Aabb { min: Vector3::zeros(), max: Vector3::repeat(1.0) };
    let mut hash = SpatialHash::new();
    hash.rebuild(&[one; 4]);
    let mut pairs = Vec::new();
    hash.pairs(|i, j| j - i > 1, &mut pairs);
    pairs.sort_unstable();
    assert_eq!(pairs, [[0, 2], [0, 3], [1, 3]]);
}

#[test]
fn as_many_boxes_again_allocate_nothing() {
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let style = Style { sizes: [-2.0, 0.0], world: 3.0, centre: Vector3::zeros(), raster: None, special: 0.0 };
    let boxes = scene(&mut random, 1000, &style);
    let mut hash = SpatialHash::new();
    let mut pairs = Vec::new();
    let mut run = || {
        pairs.clear();
        hash.rebuild(&boxes);
        hash.pairs(|_, _| true, &mut pairs);
    };
    run();
    assert_eq!(allocation_counter::measure(run).count_total, 0);
}

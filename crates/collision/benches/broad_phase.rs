//! Time per segment from capsules to distances of near pairs: `cargo bench -p collision`.
//!
//! Capsules at constant density, either in random order of memory or by cells of space. A second table has lengths and radii
//! mixed over a factor of 1000: many small ones, few large ones. Every figure is the median of some repeats.

use std::time::Instant;

use collision::closest;
use collision::{Aabb, Capsule, SpatialHash};
use nalgebra::Vector3;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const NUMBERS: [usize; 3] = [10_000, 100_000, 1_000_000];
/// Segments that a figure is the median of repeats over, at least, and the least number of repeats.
const WORK: usize = 2_000_000;
const REPEATS: usize = 7;

/// Pairs whose capsules are copied together before their distances are taken.
const BATCH: usize = 64;

/// Makes that many capsules.
type Make = fn(usize, &mut ChaCha8Rng) -> Vec<Capsule>;

struct Figures {
    /// Nanoseconds per segment: boxes, rebuild, pairs, distances, and all of these.
    times: [f64; 5],
    overlaps: f64,
    touching: f64,
    /// Nanoseconds per segment to sort the pairs, which is not in the sum.
    sort: f64,
}

/// Capsules of length 1, about six of whose boxes overlap each box.
fn alike(count: usize, random: &mut ChaCha8Rng) -> Vec<Capsule> {
    let side = 0.62 * (count as f64).cbrt();
    (0..count).map(|_| capsule(&vector(random, side), 1.0, random)).collect()
}

/// One in a hundred has a length of 0.001 to 1, log-uniform. The others are of length 0.001 and gather in crowds, as dense
/// as above, each around a point on one of these.
fn mixed(count: usize, random: &mut ChaCha8Rng) -> Vec<Capsule> {
    let side = 0.093 * (count as f64).cbrt();
    let mut capsules = Vec::new();
    for _ in 0..count / 100 {
        let large = capsule(&vector(random, side), 10f64.powf(random.random_range(-3.0..0.0)), random);
        let crowd = large.start + (large.end - large.start) * random.random_range(0.0..1.0);
        capsules.push(large);
        for _ in 0..99 {
            let start = crowd + vector(random, 0.62e-3 * 99f64.cbrt());
            capsules.push(capsule(&start, 1e-3, random));
        }
    }
    capsules
}

fn vector(random: &mut ChaCha8Rng, side: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| random.random_range(0.0..side))
}

/// A capsule of any direction, as thick as a twentieth of its length.
fn capsule(start: &Vector3<f64>, length: f64, random: &mut ChaCha8Rng) -> Capsule {
    let direction = loop {
        let v = vector(random, 2.0) - Vector3::repeat(1.0);
        if (0.01..1.0).contains(&v.norm_squared()) {
            break v.normalize();
        }
    };
    Capsule { start: *start, end: start + direction * length, radius: 0.05 * length }
}

fn measure(capsules: &[Capsule]) -> Figures {
    let mut hash = SpatialHash::new();
    let (mut boxes, mut pairs): (Vec<Aabb>, Vec<[u32; 2]>) = (Vec::new(), Vec::new());
    let mut samples: Vec<[f64; 6]> = Vec::new();
    let mut batch = Vec::with_capacity(BATCH);
    let mut touching = 0;
    let count = capsules.len() as f64;
    for _ in 0..REPEATS.max(WORK / capsules.len()) + 1 {
        let start = Instant::now();
        boxes.clear();
        boxes.extend(capsules.iter().map(Capsule::aabb));
        let boxed = Instant::now();
        hash.rebuild(&boxes);
        let built = Instant::now();
        pairs.clear();
        hash.pairs(|_, _| true, &mut pairs);
        let paired = Instant::now();
        touching = 0;
        for chunk in pairs.chunks(BATCH) {
            // Copies of what lies scattered in memory do not wait for each other.
            batch.clear();
            batch.extend(chunk.iter().map(|&[i, j]| (capsules[i as usize], capsules[j as usize])));
            for (a, b) in &batch {
                let distance = closest::segments(&[a.start, a.end], &[b.start, b.end]).distance;
                touching += usize::from(distance < a.radius + b.radius);
            }
        }
        let end = Instant::now();
        pairs.sort_unstable();
        let sorted = Instant::now();
        let instants = [start, boxed, built, paired, end];
        let mut sample = [0.0; 6];
        for k in 0..4 {
            sample[k] = (instants[k + 1] - instants[k]).as_secs_f64();
        }
        sample[4] = (end - start).as_secs_f64();
        sample[5] = (sorted - end).as_secs_f64();
        samples.push(sample.map(|x| x * 1e9 / count));
    }
    // The first one warms up.
    samples.remove(0);
    let medians: [f64; 6] = std::array::from_fn(|k| {
        samples.sort_by(|a, b| a[k].total_cmp(&b[k]));
        samples[samples.len() / 2][k]
    });
    let [a, b, c, d, all, sort] = medians;
    let overlaps = 2.0 * pairs.len() as f64 / count;
    Figures { times: [a, b, c, d, all], overlaps, touching: 2.0 * touching as f64 / count, sort }
}

fn table(title: &str, cell: f64, make: Make) {
    println!("\n{title}: time per segment [ns]");
    println!("   segments  order     boxes  rebuild  pairs  distances     all  ratio  overlaps  touching   (sort)");
    let mut first = [None; 2];
    for count in NUMBERS {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut capsules = make(count, &mut random);
        capsules.sort_by_key(|c| [c.start.z, c.start.y, c.start.x].map(|x| (x / cell).floor() as i64));
        for (order, first) in ["coherent", "random"].into_iter().zip(&mut first) {
            if order == "random" {
                capsules.shuffle(&mut random);
            }
            let Figures { times: [boxes, rebuild, pairs, distances, all], overlaps, touching, sort } =
                measure(&capsules);
            let ratio = all / *first.get_or_insert(all);
            println!(
                "{count:>11}  {order:<8}  {boxes:>5.1}  {rebuild:>7.1}  {pairs:>5.1}  {distances:>9.1}  {all:>6.1}  \
                 {ratio:>5.2}  {overlaps:>8.2}  {touching:>8.2}  {sort:>7.1}"
            );
        }
    }
}

fn main() {
    table("Capsules of one length", 2.0, alike);
    table("Lengths and radii over a factor of 1000", 0.01, mixed);
}

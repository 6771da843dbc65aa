//! Time per segment from capsules to distances of near pairs: `cargo bench -p collision`.
//!
//! Capsules at constant density, either in random order of memory or along cells of space. A second table has lengths and
//! radii mixed over a factor of 1000, log-uniform volumes: many small ones, few large ones. Every figure is the median.

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

/// Sizes of capsules in lengths of the largest, drawn with a uniform number.
type Size = fn(f64) -> f64;

struct Figures {
    /// Nanoseconds per segment: boxes, rebuild, pairs, distances, and all of these.
    times: [f64; 5],
    overlaps: f64,
    touching: f64,
    /// Nanoseconds per segment to sort the pairs, which is not in the sum.
    sort: f64,
}

fn capsules(count: usize, world: f64, size: Size, random: &mut ChaCha8Rng) -> Vec<Capsule> {
    let side = world * (count as f64).cbrt();
    let mut capsules: Vec<Capsule> = (0..count)
        .map(|_| {
            let size = size(random.random_range(0.0..1.0));
            let direction = loop {
                let v = Vector3::from_fn(|_, _| random.random_range(-1.0..1.0));
                if (0.01..1.0).contains(&v.norm_squared()) {
                    break v.normalize();
                }
            };
            let start = Vector3::from_fn(|_, _| random.random_range(0.0..side));
            Capsule { start, end: start + direction * size, radius: 0.05 * size }
        })
        .collect();
    // Coherent order: cells of two lengths, row by row.
    let cell = |x: f64| (x / 2.0).floor() as i64;
    capsules.sort_by_key(|c| [cell(c.start.z), cell(c.start.y), cell(c.start.x)]);
    capsules
}

fn measure(capsules: &[Capsule]) -> Figures {
    let mut hash = SpatialHash::new();
    let (mut boxes, mut pairs): (Vec<Aabb>, Vec<[u32; 2]>) = (Vec::new(), Vec::new());
    let mut samples: Vec<[f64; 6]> = Vec::new();
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
        for &[i, j] in &pairs {
            let (a, b) = (&capsules[i as usize], &capsules[j as usize]);
            let distance = closest::segments(&[a.start, a.end], &[b.start, b.end]).distance;
            touching += usize::from(distance < a.radius + b.radius);
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

fn table(title: &str, world: f64, size: Size) {
    println!("\n{title}: time per segment [ns]");
    println!("   segments  order     boxes  rebuild  pairs  distances     all  ratio  overlaps  touching   (sort)");
    let mut first = [None; 2];
    for count in NUMBERS {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut capsules = capsules(count, world, size, &mut random);
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
    table("Capsules of one length", 0.62, |_| 1.0);
    // The number above a size falls with its cube.
    table("Lengths and radii over a factor of 1000", 0.0045, |x| {
        (1e-9_f64).max(1e-9 / (1.0 - x * (1.0 - 1e-9))).cbrt()
    });
}

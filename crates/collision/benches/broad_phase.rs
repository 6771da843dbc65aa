//! Time per segment from capsules to distances of near pairs: `cargo bench -p cosserat-collision`.
//!
//! Capsules at constant density, either in random order of memory or by cells of space. A second table has lengths and radii
//! mixed over a factor of 1000: many small ones, few large ones. Every figure is the median of some repeats, which take turns.

use std::time::Instant;

use collision::closest;
use collision::{Aabb, Capsule, SpatialHash};
use nalgebra::Vector3;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const NUMBERS: [usize; 3] = [10_000, 100_000, 1_000_000];
/// All runs of a table take turns in this number of rounds, each with at least so many segments a round.
const ROUNDS: usize = 9;
const WORK: usize = 300_000;
/// Pairs whose capsules are copied together before their distances are taken.
const BATCH: usize = 64;

/// Makes that many capsules.
type Make = fn(usize, &mut ChaCha8Rng) -> Vec<Capsule>;

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

/// Capsules, and what measuring them needs.
struct Run {
    capsules: Vec<Capsule>,
    boxes: Vec<Aabb>,
    hash: SpatialHash,
    pairs: Vec<[u32; 2]>,
    touching: usize,
    /// Nanoseconds per segment: boxes, rebuild, pairs, distances, all of these, and sorting the pairs, which is not in them.
    samples: Vec<[f64; 6]>,
}

impl Run {
    fn new(capsules: Vec<Capsule>) -> Self {
        let hash = SpatialHash::new();
        Self { capsules, boxes: Vec::new(), hash, pairs: Vec::new(), touching: 0, samples: Vec::new() }
    }

    fn sample(&mut self) {
        let Self { capsules, boxes, hash, pairs, .. } = self;
        let start = Instant::now();
        boxes.clear();
        boxes.extend(capsules.iter().map(Capsule::aabb));
        let boxed = Instant::now();
        hash.rebuild(boxes);
        let built = Instant::now();
        pairs.clear();
        hash.pairs(|_, _| true, pairs);
        let paired = Instant::now();
        self.touching = 0;
        let mut batch = Vec::with_capacity(BATCH);
        for chunk in pairs.chunks(BATCH) {
            // Copies of what lies scattered in memory do not wait for each other.
            batch.clear();
            batch.extend(chunk.iter().map(|&[i, j]| (capsules[i as usize], capsules[j as usize])));
            for (a, b) in &batch {
                let distance = closest::segments(&[a.start, a.end], &[b.start, b.end]).distance;
                self.touching += usize::from(distance < a.radius + b.radius);
            }
        }
        let end = Instant::now();
        pairs.sort_unstable();
        let sorted = Instant::now();
        let times = [built - boxed, paired - built, end - paired, end - start, sorted - end];
        let [rebuild, found, distances, all, sort] = times.map(|time| time.as_secs_f64());
        let sample = [(boxed - start).as_secs_f64(), rebuild, found, distances, all, sort];
        self.samples.push(sample.map(|x| x * 1e9 / capsules.len() as f64));
    }

    fn medians(&mut self) -> [f64; 6] {
        std::array::from_fn(|k| {
            self.samples.sort_by(|a, b| a[k].total_cmp(&b[k]));
            self.samples[self.samples.len() / 2][k]
        })
    }
}

fn table(title: &str, cell: f64, make: Make) {
    let mut runs = Vec::new();
    for count in NUMBERS {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut capsules = make(count, &mut random);
        capsules.sort_by_key(|c| [c.start.z, c.start.y, c.start.x].map(|x| (x / cell).floor() as i64));
        runs.push(("coherent", Run::new(capsules.clone())));
        capsules.shuffle(&mut random);
        runs.push(("random", Run::new(capsules)));
    }
    for (_, run) in &mut runs {
        // Memory is allocated and touched for the first time.
        run.sample();
        run.samples.clear();
    }
    for _ in 0..ROUNDS {
        for (_, run) in &mut runs {
            for _ in 0..(WORK / run.capsules.len()).max(1) {
                run.sample();
            }
        }
    }
    println!("\n{title}: time per segment [ns]");
    println!("   segments  order     boxes  rebuild  pairs  distances     all  ratio  overlaps  touching   (sort)");
    let mut first = [None; 2];
    for (k, (order, run)) in runs.iter_mut().enumerate() {
        let [boxes, rebuild, pairs, distances, all, sort] = run.medians();
        let ratio = all / *first[k % 2].get_or_insert(all);
        let count = run.capsules.len();
        let [overlaps, touching] = [run.pairs.len(), run.touching].map(|n| 2.0 * n as f64 / count as f64);
        println!(
            "{count:>11}  {order:<8}  {boxes:>5.1}  {rebuild:>7.1}  {pairs:>5.1}  {distances:>9.1}  {all:>6.1}  \
             {ratio:>5.2}  {overlaps:>8.2}  {touching:>8.2}  {sort:>7.1}"
        );
    }
}

fn main() {
    table("Capsules of one length", 2.0, alike);
    table("Lengths and radii over a factor of 1000", 0.01, mixed);
}

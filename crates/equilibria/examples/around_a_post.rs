//! A planner that carries the end of a cable from one side of a post to the other.
//!
//! One end is held; a gripper holds the other. The planner draws thousands of the gripper's poses, asks for the equilibrium at
//! each, at once and without a history, and keeps those in which the cable touches neither post nor floor. Between poses that are
//! near, and whose shapes are, it may go, and of all ways it takes the shortest (a probabilistic roadmap; Kavraki et al. 1996).
//! It goes along that way in small steps, each from the shape before, as the cable itself does. Where that touches something, or
//! the cable snaps, it may not go from the one pose to the other, and looks for another way (Bohlin and Kavraki 2000).
//!
//! `cargo run -p equilibria --example around_a_post -- [FOLDER]` asks twice, from curves and from the learned start, prints what
//! both took, and writes a page that plays the way: FOLDER/around-a-post.html (`target` unless told).

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashSet};
use std::error::Error;
use std::path::Path;
use std::time::Instant;

use cosserat::assembly::{Assembly, Material, Obstacle, ObstacleShape, RodSpec, Surface, shape};
use equilibria::known::{Known, Previous};
use equilibria::learned::Learned;
use equilibria::start::{Curves, Starts};
use equilibria::{Answer, Cable, Equilibrium, Grip, Params, ParamsError, Query, solve_from};
use nalgebra::{UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use view::{Frame, Recorder};

/// Poses that are drawn.
const POSES: usize = 10_000;
const SEED: u64 = 1;
/// Radius of the cable [m], and how far from post and floor it stays [m].
const RADIUS: f64 = 0.005;
const CLEARANCE: f64 = 0.01;
/// The post stands here [m], so high, and so thick.
const POST: [f64; 2] = [0.35, 0.0];
const HEIGHT: f64 = 0.5;
const POST_RADIUS: f64 = 0.03;
/// Poses to which a pose is joined at most, and how far the cable may move on the way [m].
const NEIGHBOURS: usize = 16;
const FARTHEST: f64 = 0.12;
/// How far the cable moves from frame to frame [m].
const STEP: f64 = 0.01;

/// The gripper: position [m] and heading about the vertical [rad].
#[derive(Clone, Copy, Debug, PartialEq)]
struct Pose {
    position: Vector3<f64>,
    heading: f64,
}

impl Pose {
    fn new(x: f64, y: f64, z: f64, heading: f64) -> Self {
        Self { position: Vector3::new(x, y, z), heading }
    }

    fn between(&self, other: &Self, share: f64) -> Self {
        let position = self.position.lerp(&other.position, share);
        Self { position, heading: self.heading + share * (other.heading - self.heading) }
    }

    fn distance(&self, other: &Self) -> f64 {
        (self.position - other.position).norm() + 0.2 * (self.heading - other.heading).abs()
    }
}

/// From the gripper's start to its goal, the other side of the post.
const ENDS: [[f64; 4]; 2] = [[0.6, -0.3, 0.45, -0.6], [0.6, 0.3, 0.45, 0.6]];

fn level(heading: f64) -> UnitQuaternion<f64> {
    let along_x = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::FRAC_PI_2);
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading) * along_x
}

/// The cable with its end in the gripper; its start is held level.
fn query(pose: &Pose) -> Query {
    let start = Grip { position: Vector3::new(0.0, 0.0, 0.4), orientation: level(0.0) };
    let end = Grip { position: pose.position, orientation: level(pose.heading) };
    Query { cable: Cable::new(1.0, 0.02, 0.016, 0.6), start, end: Some(end) }
}

/// Poses in which the cable reaches the gripper with room to spare, and no grip bends it by more than 60 degrees off the way.
fn poses(count: usize) -> Vec<Pose> {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let mut out: Vec<Pose> = ENDS.map(|[x, y, z, heading]| Pose::new(x, y, z, heading)).to_vec();
    while out.len() < count {
        let own = Pose::new(
            rng.random_range(0.1..0.9),
            rng.random_range(-0.5..0.5),
            rng.random_range(0.1..1.0),
            rng.random_range(-1.6..1.6),
        );
        let asked = query(&own);
        let chord = own.position - asked.start.position;
        let distance = chord.norm();
        let is_easy =
            |q: &UnitQuaternion<f64>| (q * Vector3::z()).dot(&chord) >= 60.0_f64.to_radians().cos() * distance;
        if (0.1..0.95).contains(&distance) && is_easy(&asked.start.orientation) && is_easy(&level(own.heading)) {
            out.push(own);
        }
    }
    out
}

/// How far the cable is from post and floor [m], at its joints and centres.
fn clearance(positions: &[Vector3<f64>]) -> f64 {
    let of = |x: &Vector3<f64>| {
        let off = Vector3::new(x.x - POST[0], x.y - POST[1], (x.z - HEIGHT).max(0.0));
        (off.norm() - POST_RADIUS).min(x.z) - RADIUS
    };
    let between = positions.windows(2).map(|pair| of(&pair[0].lerp(&pair[1], 0.5)));
    positions.iter().map(of).chain(between).fold(f64::INFINITY, f64::min)
}

fn moved(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

/// The lowest equilibrium of each pose; `None` where there is none at which the cable is free.
type Shapes = Vec<Option<Equilibrium>>;

/// Those of all poses, and the time that they took [s].
fn shapes(poses: &[Pose], starts: &dyn Starts) -> Result<(Shapes, f64), ParamsError> {
    let queries: Vec<Query> = poses.iter().map(query).collect();
    let params = Params { segments: 50, tolerance: 1e-6, ..Params::default() };
    let begin = Instant::now();
    let answers = solve_from(&queries, &params, starts)?;
    let time = begin.elapsed().as_secs_f64();
    let free = answers.into_iter().map(|answer| {
        let own = answer.ok()?.equilibria.into_iter().next()?;
        (clearance(&own.positions) > CLEARANCE).then_some(own)
    });
    Ok((free.collect(), time))
}

/// The shortest way from the first pose to the second along poses that are near, on none of the closed ways between two; `None` if
/// there is none.
fn shortest(poses: &[Pose], shapes: &[Option<Equilibrium>], closed: &HashSet<[usize; 2]>) -> Option<Vec<usize>> {
    let free: Vec<usize> = (0..poses.len()).filter(|&k| shapes[k].is_some()).collect();
    let neighbours = |from: usize| {
        let mut near: Vec<(f64, usize)> =
            free.iter().filter(|&&k| k != from).map(|&k| (poses[from].distance(&poses[k]), k)).collect();
        let count = NEIGHBOURS.min(near.len());
        if count < near.len() {
            near.select_nth_unstable_by(count, |a, b| a.0.total_cmp(&b.0));
        }
        near.truncate(count);
        near
    };
    let passes = |a: usize, b: usize| {
        let (Some(a), Some(b)) = (&shapes[a], &shapes[b]) else { return false };
        let halfway: Vec<Vector3<f64>> = a.positions.iter().zip(&b.positions).map(|(a, b)| a.lerp(b, 0.5)).collect();
        moved(&a.positions, &b.positions) < FARTHEST && clearance(&halfway) > CLEARANCE
    };
    let mut best = vec![(f64::INFINITY, usize::MAX); poses.len()];
    best[0].0 = 0.0;
    let mut is_done = vec![false; poses.len()];
    let mut open = BinaryHeap::from([Reverse((Length(0.0), 0))]);
    while let Some(Reverse((_, own))) = open.pop() {
        if std::mem::replace(&mut is_done[own], true) {
            continue;
        }
        if own == 1 {
            let mut way = vec![1];
            while way[way.len() - 1] != 0 {
                way.push(best[way[way.len() - 1]].1);
            }
            way.reverse();
            return Some(way);
        }
        for (distance, next) in neighbours(own) {
            let length = best[own].0 + distance;
            if length < best[next].0 && !closed.contains(&[own, next]) && passes(own, next) {
                best[next] = (length, own);
                open.push(Reverse((Length(length), next)));
            }
        }
    }
    None
}

/// A length that can be compared.
#[derive(PartialEq)]
struct Length(f64);

impl Eq for Length {}

impl PartialOrd for Length {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Length {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

/// The cable's shapes along the gripper's way from pose to pose, each from the one before; where the cable snaps or touches
/// something on it, `Err` of the two poses.
fn followed(
    poses: &[Pose],
    way: &[usize],
    first: &Equilibrium,
) -> Result<Result<Vec<Equilibrium>, [usize; 2]>, Box<dyn Error>> {
    let params = Params { segments: first.positions.len(), levels: Vec::new(), again: false, ..Params::default() };
    let mut out = vec![first.clone()];
    for pair in way.windows(2) {
        let [from, to] = [poses[pair[0]], poses[pair[1]]];
        let count = (from.distance(&to) / (0.5 * STEP)).ceil().max(1.0) as usize;
        for k in 1..=count {
            let asked = query(&from.between(&to, k as f64 / count as f64));
            let before = &out[out.len() - 1];
            let known = Known::of(&asked, &Answer { equilibria: vec![before.clone()], ..Answer::default() });
            let answer = solve_from(&[asked], &params, &Previous(known.into_iter().collect()))?.remove(0);
            let next = answer.ok().and_then(|own| own.equilibria.into_iter().next()).filter(|next| {
                clearance(&next.positions) > 0.5 * CLEARANCE && moved(&before.positions, &next.positions) < STEP
            });
            let Some(next) = next else { return Ok(Err([pair[0], pair[1]])) };
            out.push(next);
        }
    }
    Ok(Ok(out))
}

/// A page that plays them.
fn play(path: &Path, frames: &[Equilibrium]) -> Result<(), Box<dyn Error>> {
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    let material = Material { youngs_modulus: 1.0, torsion_modulus: 1.0, density: 1000.0 };
    let segments = frames[0].positions.len();
    assembly.rod(&RodSpec::new(shape::straight(Vector3::zeros(), Vector3::x(), 1.0, segments), RADIUS, material));
    let [x, y] = POST;
    let axis = [Vector3::new(x, y, 0.0), Vector3::new(x, y, HEIGHT)];
    let post = ObstacleShape::Capsule { start: axis[0], end: axis[1], radius: POST_RADIUS };
    let floor = ObstacleShape::HalfSpace { point: Vector3::zeros(), normal: Vector3::z_axis() };
    for shape in [post, floor] {
        assembly.model_mut().contacts.obstacles.push(Obstacle { shape, surface: Surface::default(), motion: None });
    }
    let (model, mut state) = assembly.finish();
    let dt = 0.02;
    let mut recorder = Recorder::new("around a post", dt, &model);
    for (k, frame) in frames.iter().enumerate() {
        state.positions.clone_from(&frame.positions);
        state.orientations.clone_from(&frame.orientations);
        recorder.push(&Frame {
            time: k as f64 * dt,
            state: &state,
            forces: &[],
            energy: frame.energy,
            length_ratio: 1.0,
            iterations: 0.0,
        });
    }
    Ok(view::write_page(path, &[recorder.finish()])?)
}

/// A plan: the shapes on the way, how many of the poses were free, and the time of the questions [s].
struct Plan {
    frames: Vec<Equilibrium>,
    poses: usize,
    free: usize,
    time: f64,
}

fn plan(poses: &[Pose], starts: &dyn Starts) -> Result<Plan, Box<dyn Error>> {
    let (shapes, time) = shapes(poses, starts)?;
    let first = shapes[0].as_ref().ok_or("the cable touches something where it begins")?;
    let mut closed = HashSet::new();
    loop {
        let way = shortest(poses, &shapes, &closed).ok_or("no way around the post: draw more poses")?;
        match followed(poses, &way, first)? {
            Ok(frames) => {
                return Ok(Plan { frames, poses: way.len(), free: shapes.iter().flatten().count(), time });
            }
            Err(pair) => closed.insert(pair),
        };
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "target".into());
    let poses = poses(POSES);
    // What is read once, and memory, are not timed.
    shapes(&poses[..500], &Learned::default())?;
    let mut times = Vec::new();
    for (name, starts) in [("curves", &Curves::default() as &dyn Starts), ("learned", &Learned::default())] {
        let Plan { frames, poses: stations, free, time } = plan(&poses, starts)?;
        let nearest = frames.iter().map(|own| clearance(&own.positions)).fold(f64::INFINITY, f64::min);
        let jump = frames.windows(2).map(|pair| moved(&pair[0].positions, &pair[1].positions)).fold(0.0, f64::max);
        println!(
            "{name}: {POSES} poses (seed {SEED}) in {time:.3} s, {free} of them free; a way over {stations} of them: {} \
             frames, never nearer than {:.1} mm, at most {:.1} mm from frame to frame",
            frames.len(),
            1e3 * nearest,
            1e3 * jump
        );
        std::fs::create_dir_all(&folder)?;
        play(&Path::new(&folder).join("around-a-post.html"), &frames)?;
        times.push(time);
    }
    println!("curves over learned: {:.2} (on {} threads)", times[0] / times[1], rayon::current_num_threads());
    println!("{folder}/around-a-post.html plays the way");
    Ok(())
}

/// With either start there is a way, on which the cable touches nothing and does not jump, to the goal.
#[test]
fn there_is_a_way_around_the_post() -> Result<(), Box<dyn Error>> {
    let poses = poses(4000);
    for starts in [&Curves::default() as &dyn Starts, &Learned::default()] {
        let Plan { frames, .. } = plan(&poses, starts)?;
        for own in &frames {
            assert!(clearance(&own.positions) >= 0.5 * CLEARANCE);
        }
        for pair in frames.windows(2) {
            assert!(moved(&pair[0].positions, &pair[1].positions) < STEP);
        }
        // The last segment lies in the gripper at its goal.
        let last = &frames[frames.len() - 1];
        let half = 0.5 / last.positions.len() as f64;
        let end = last.positions[last.positions.len() - 1] + last.orientations.last().unwrap() * Vector3::z() * half;
        assert!((end - poses[1].position).norm() < 1e-6, "{end}");
    }
    Ok(())
}

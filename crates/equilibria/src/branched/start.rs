//! Where searches for branched cables begin without learning: a place and a pose of the junction, and curves to it.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::query::ARMS;
use super::star::{Junction, Star};
use crate::scaled::Cut;
use crate::start::{Starts, twist, untwisted};

/// Classes of twist of three arms, see [`SIGNS`].
pub const CLASSES: usize = 4;
/// Signs of the quaternions in which the arms end, of each class. Quaternions that go on without a jump from a grip's end in that of
/// the arm's end at the junction or in its negative. Changing all three signs is a whole turn of the junction, and so no change.
pub const SIGNS: [[f64; ARMS]; CLASSES] = [[1.0, 1.0, 1.0], [-1.0, 1.0, 1.0], [1.0, -1.0, 1.0], [1.0, 1.0, -1.0]];

/// The junction and the forces of a start.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Begin {
    /// The junction, its place over L from the first grip.
    pub junction: Junction,
    /// Forces on the grips with the sign of the pull along the arms, over B / L^2.
    pub forces: [Vector3<f64>; ARMS],
}

/// How arms are drawn from their grips to the junction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// Turns go evenly, without regard to the place.
    Even,
    /// The cubic that is as long as the arm.
    Hermite,
    /// One that sags.
    Sagging,
}

/// How the junction is turned at first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pose {
    /// As the triangle of the grips: [`reference()`].
    Triangle,
    /// As straight arms would turn it: the mean of the quaternions that the grips' frames ask for, with the class's signs and
    /// weights of `EI / length`.
    Mean,
    /// The sum of both.
    Both,
}

/// Where the junction is at first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Site {
    /// The mean of the grips' places, each over the length of its arm.
    Middle,
    /// Below it by what the arms are longer than the way there.
    Low,
}

/// Starts without learning: all sites, poses and shapes, each in the first few classes of twist, those in which the grips' frames
/// agree best on the junction's coming first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stars {
    /// Sites.
    pub sites: Vec<Site>,
    /// Poses.
    pub poses: Vec<Pose>,
    /// Shapes.
    pub shapes: Vec<Shape>,
    /// Number of classes, 1 to 4.
    pub classes: usize,
}

/// Turns that go evenly, with two poses of the junction and all classes.
impl Default for Stars {
    fn default() -> Self {
        Self {
            sites: vec![Site::Middle],
            poses: vec![Pose::Mean, Pose::Triangle],
            shapes: vec![Shape::Even],
            classes: CLASSES,
        }
    }
}

impl Stars {
    /// Many: both sites, two poses, two shapes, all classes. Where the default leads nowhere, these may lead further.
    pub fn all() -> Self {
        Self {
            sites: vec![Site::Middle, Site::Low],
            poses: vec![Pose::Mean, Pose::Triangle],
            shapes: vec![Shape::Hermite, Shape::Sagging],
            classes: CLASSES,
        }
    }
}

impl Starts<Star> for Stars {
    fn count(&self) -> usize {
        self.sites.len() * self.poses.len() * self.shapes.len() * self.classes.min(CLASSES)
    }

    fn fill(&self, _: usize, star: &Star, cut: &Cut, turns: &mut [UnitQuaternion<f64>], begins: &mut [Begin]) -> usize {
        let triangle = reference(star);
        let means = SIGNS.map(|signs| mean(star, signs));
        let mut order = [0, 1, 2, 3];
        order.sort_by(|&a, &b| means[b].norm().total_cmp(&means[a].norm()));
        let mut places = begins.iter_mut().zip(turns.chunks_mut(ARMS * cut.segments));
        for &class in &order[..self.classes.min(CLASSES)] {
            for pose in &self.poses {
                let orientation = match pose {
                    Pose::Triangle => triangle.orientation,
                    Pose::Mean => unit(means[class], triangle.orientation),
                    Pose::Both => {
                        let other = triangle.orientation.into_inner();
                        let sign = if other.dot(&means[class]) < 0.0 { -1.0 } else { 1.0 };
                        unit(means[class] + other * (sign * stiffness(star).iter().sum::<f64>()), triangle.orientation)
                    }
                };
                // Turns that go evenly take the shorter way to the junction, where the class has it.
                let signs = match pose {
                    Pose::Triangle => signs_towards(star, &orientation, SIGNS[class]),
                    _ => SIGNS[class],
                };
                for site in &self.sites {
                    let position = match site {
                        Site::Middle => triangle.position,
                        Site::Low => triangle.position - Vector3::z() * slack(star, &triangle.position),
                    };
                    let junction = Junction { position, orientation };
                    for shape in &self.shapes {
                        let Some((begin, out)) = places.next() else { continue };
                        begin.junction = junction;
                        let side = match shape {
                            Shape::Sagging => Some([-Vector3::z(); ARMS]),
                            Shape::Hermite => None,
                            Shape::Even => {
                                even(star, &junction, signs, cut, out);
                                continue;
                            }
                        };
                        draw(star, &junction, signs, side, cut, out);
                    }
                }
            }
        }
        self.count()
    }
}

/// Random starts: classes in turns, the junction near its mean pose by up to a radian or so, arms that bow to random sides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RandomStars {
    /// How many of each query.
    pub count: usize,
    /// The seed.
    pub seed: u64,
}

impl Starts<Star> for RandomStars {
    fn count(&self) -> usize {
        self.count
    }

    fn fill(
        &self,
        index: usize,
        star: &Star,
        cut: &Cut,
        turns: &mut [UnitQuaternion<f64>],
        begins: &mut [Begin],
    ) -> usize {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        rng.set_stream(index as u64);
        let mut direction = || {
            let (z, angle): (f64, f64) = (rng.random_range(-1.0..1.0), rng.random_range(0.0..TAU));
            Vector3::new(angle.cos(), angle.sin(), 0.0) * f64::sqrt(1.0 - z * z) + Vector3::z() * z
        };
        let triangle = reference(star);
        for (k, (begin, out)) in begins.iter_mut().zip(turns.chunks_mut(ARMS * cut.segments)).enumerate() {
            let signs = SIGNS[k % CLASSES];
            let base = unit(mean(star, signs), triangle.orientation);
            let turn = UnitQuaternion::from_scaled_axis((direction() + direction()) * 0.6);
            let position = triangle.position + (direction() + direction()) * 0.25;
            begin.junction = Junction { position, orientation: base * turn };
            let sides = [direction(), direction(), direction()];
            draw(star, &begin.junction, signs, Some(sides), cut, out);
        }
        self.count
    }
}

/// The junction in the middle of the grips, each over the length of its arm, and turned as they lie: its z across their plane,
/// its arms as near to the ways there as may be.
pub fn reference(star: &Star) -> Junction {
    let weights = star.lengths.map(|length| 1.0 / length);
    let sum: f64 = weights.iter().sum();
    let middle = star.places.iter().zip(weights).map(|(x, w)| x * w).sum::<Vector3<f64>>() / sum;
    let ways = star.places.map(|x| x - middle);
    let [a, b, c] = star.places;
    let normal = (b - a).cross(&(c - a)).try_normalize(1e-12).unwrap_or_else(Vector3::z);
    let other = if normal.x.abs() < 0.5 { Vector3::x() } else { Vector3::y() };
    let x = (other - normal * normal.dot(&other)).normalize();
    let y = normal.cross(&x);
    let (mut sin, mut cos) = (0.0, 0.0);
    for (way, direction) in ways.iter().zip(&star.directions) {
        let own = direction * Vector3::z();
        let (u, v) = (x.dot(way), y.dot(way));
        // The arm runs towards the junction.
        cos -= u * own.x + v * own.y;
        sin -= v * own.x - u * own.y;
    }
    let norm = f64::hypot(sin, cos);
    let (sin, cos) = if norm > 1e-12 { (sin / norm, cos / norm) } else { (0.0, 1.0) };
    let columns = [x * cos + y * sin, y * cos - x * sin, normal];
    let turn = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&columns));
    Junction { position: middle, orientation: UnitQuaternion::from_rotation_matrix(&turn) }
}

/// Bending stiffness over length of each arm.
fn stiffness(star: &Star) -> [f64; ARMS] {
    [0, 1, 2].map(|k| star.arms[k].stiffness[0] / star.lengths[k])
}

/// The sum of the junction's quaternions that the grips' frames ask for, with a class's signs, weighted by the arms' stiffness.
fn mean(star: &Star, signs: [f64; ARMS]) -> Quaternion<f64> {
    let weights = stiffness(star);
    let mut sum = Quaternion::new(0.0, 0.0, 0.0, 0.0);
    for k in 0..ARMS {
        sum += (star.arms[k].ends[0] * star.directions[k].inverse()).into_inner() * (signs[k] * weights[k]);
    }
    sum
}

fn unit(q: Quaternion<f64>, otherwise: UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    if q.norm() > 1e-9 { UnitQuaternion::from_quaternion(q) } else { otherwise }
}

/// A class's signs, of both triples that mean the same the one in which the grips' frames are nearer to this pose.
fn signs_towards(star: &Star, pose: &UnitQuaternion<f64>, signs: [f64; ARMS]) -> [f64; ARMS] {
    if mean(star, signs).dot(pose.quaternion()) < 0.0 { signs.map(|sign| -sign) } else { signs }
}

/// How far below a place the arms hang, about.
fn slack(star: &Star, place: &Vector3<f64>) -> f64 {
    let of = |k: usize| {
        let share: f64 = (place - star.places[k]).norm() / star.lengths[k];
        star.lengths[k] * (1.0 - share * share).max(0.0).sqrt()
    };
    0.5 * [0, 1, 2].map(of).into_iter().fold(f64::INFINITY, f64::min)
}

/// Quaternions that go evenly from the grips' to the arms' ends.
fn even(star: &Star, junction: &Junction, signs: [f64; ARMS], cut: &Cut, out: &mut [UnitQuaternion<f64>]) {
    for (k, out) in out.chunks_mut(cut.segments).enumerate() {
        let start = star.arms[k].ends[0].into_inner();
        let end = (junction.orientation * star.directions[k]).into_inner() * signs[k];
        for (i, q) in out.iter_mut().enumerate() {
            let place = cut.place(i);
            *q = unit(start * (1.0 - place) + end * place, junction.orientation);
        }
    }
}

/// Curves from the grips to the junction that bow to some sides or are cubics, twisted as the class asks for.
fn draw(
    star: &Star,
    junction: &Junction,
    signs: [f64; ARMS],
    sides: Option<[Vector3<f64>; ARMS]>,
    cut: &Cut,
    out: &mut [UnitQuaternion<f64>],
) {
    for (k, out) in out.chunks_mut(cut.segments).enumerate() {
        let own = star.arm(k, junction);
        let twists = untwisted(&own, cut, sides.map(|sides| sides[k]), out);
        twist(cut, twists[usize::from(signs[k] < 0.0)], out);
    }
}

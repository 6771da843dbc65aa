//! Cables of a given length between two points.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};

/// A cable of a given length between two points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hung {
    /// Where it starts [m].
    pub from: Vector3<f64>,
    /// Where it ends [m].
    pub to: Vector3<f64>,
    /// Its length [m].
    pub length: f64,
    /// Unit vector along its start, if it is given.
    pub start_direction: Option<Vector3<f64>>,
    /// Unit vector along its end, if it is given.
    pub end_direction: Option<Vector3<f64>>,
    /// Gravitational acceleration [m/s^2]; only its direction matters.
    pub gravity: Vector3<f64>,
}

/// Fewest segments of a [`Hung`] cable.
pub const HUNG_SEGMENTS: usize = 8;

/// How much shorter than the distance of its ends a cable may be for a straight one, as a part of its length.
const STRAIGHT: f64 = 1e-13;
/// Largest error of the far end, in lengths of the cable.
const REACHED: f64 = 1e-12;
/// Turn between neighbours from which a curve counts as folded [rad].
const FOLD: f64 = PI / 3.0;
/// Most times that a fold is opened further.
const OPENINGS: i32 = 16;

impl Hung {
    /// `segments + 1` nodes [m], at least [`HUNG_SEGMENTS`] segments of `length / segments` each. `None` where a cable of
    /// this length does not reach, or no curve is found.
    ///
    /// Without directions it is the catenary of a chain of as many rigid segments, free to turn at their joints: the pull
    /// at the centre of a segment, which changes by the segment's weight from one to the next, is along it. So it is at rest
    /// but for its bending stiffness. Where that would fold by more than 60 degrees between two segments (ends one above
    /// the other, or a slack cable in few segments), the fold is opened sideways. It lies in the plane of gravity and both
    /// ends; with ends one above the other in that of world x (world y where gravity is along x). Without gravity it is an
    /// arc of a circle, bulging towards world -z, or x where -z is along its chord.
    ///
    /// With directions the first two or last two segments have them, and the tangents in between follow a Bezier curve of
    /// which gravity and the ends' distance are part: a smooth start, no equilibrium.
    pub fn nodes(&self, segments: usize) -> Option<Vec<Vector3<f64>>> {
        let (way, weightless) = ((self.to - self.from) / self.length, self.gravity == Vector3::zeros());
        let is_free = self.start_direction.is_none() && self.end_direction.is_none();
        let enough = segments >= HUNG_SEGMENTS && way.iter().all(|x| x.is_finite());
        if !enough || way.norm() > 1.0 + STRAIGHT {
            return None;
        }
        let tangents = if is_free && way.norm() >= 1.0 - STRAIGHT {
            vec![way.normalize(); segments]
        } else if is_free && weightless {
            arc(&way, segments)
        } else if is_free {
            self.catenary(&way, segments)?
        } else {
            self.directed(&way, segments)?
        };
        Some(self.laid(&tangents))
    }

    /// Unit vectors against gravity (world z where there is none) and across it: towards the other end, or world x or y.
    fn axes(&self, way: &Vector3<f64>) -> [Vector3<f64>; 2] {
        let up = -self.gravity.try_normalize(0.0).unwrap_or_else(|| -Vector3::z());
        let across = |v: &Vector3<f64>| v - up * up.dot(v);
        let own = across(way).try_normalize(1e-9);
        let world = if up.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
        [up, own.unwrap_or_else(|| across(&world).normalize())]
    }

    fn catenary(&self, way: &Vector3<f64>, segments: usize) -> Option<Vec<Vector3<f64>>> {
        let [up, across] = self.axes(way);
        let share = |k: usize| (k as f64 + 0.5) / segments as f64;
        // The place of the lowest point, if the cable hung straight down from both ends.
        let lowest = 0.5 * (1.0 - way.dot(&up));
        let opened = |by: f64| {
            let pull = |k: usize| {
                let u = share(k);
                Pull::Free(up * (u - 0.5) + across * (by * (1.0 - 4.0 * (u - lowest).powi(2))))
            };
            solve(way, &across, &(0..segments).map(pull).collect::<Vec<_>>())
        };
        let openings = (0..OPENINGS).map(|k| 2f64.powi(k) / segments as f64);
        smoothest(std::iter::once(0.0).chain(openings).map(opened), FOLD.cos())
    }

    fn directed(&self, way: &Vector3<f64>, segments: usize) -> Option<Vec<Vector3<f64>>> {
        let [up, across] = self.axes(way);
        let weight = if self.gravity == Vector3::zeros() { Vector3::zeros() } else { up };
        let along = self.start_direction.or(self.end_direction)?;
        let beside = (across - along * along.dot(&across)).try_normalize(0.1);
        let beside = beside.unwrap_or_else(|| (up - along * along.dot(&up)).normalize());
        let curve = |stiffness: f64, bow: Vector3<f64>, swing: Vector3<f64>| {
            let pull = |k: usize| {
                let u = ((k as f64 - 1.0) / (segments as f64 - 3.0)).clamp(0.0, 1.0);
                let (mut own, mut left) = (Vector3::zeros(), 1.0);
                for (direction, share) in [(self.start_direction, (1.0 - u).powi(3)), (self.end_direction, u.powi(3))] {
                    if let Some(direction) = direction {
                        own += direction * share;
                        left -= share;
                    }
                }
                if left <= 1e-9 {
                    return Pull::Held(own.normalize());
                }
                let middle = (weight + swing) * (u - 0.5) + bow * (1.0 - 4.0 * (u - 0.5).powi(2));
                Pull::Free(own * (stiffness / left) + middle)
            };
            solve(way, &across, &(0..segments).map(pull).collect::<Vec<_>>())
        };
        let none = Vector3::zeros();
        let plain = smoothest((-1..7).map(|k| curve(2f64.powi(k), none, none)), 1.0);
        // Three turns in all, spread evenly.
        let smooth = (6.0 * PI / segments as f64).min(FOLD).cos();
        if plain.as_ref().is_some_and(|tangents| straightest(tangents) >= smooth) {
            return plain;
        }
        let strengths = (-4..5).flat_map(|k| [beside, along.cross(&beside)].map(|side| side * 2f64.powi(k)));
        let opened = strengths.flat_map(|side| [curve(1.0, side, none), curve(1.0, none, side)]);
        smoothest(std::iter::once(plain).chain(opened), 1.0)
    }

    /// The nodes of segments along these unit vectors; what is missing to the far end is shared by all.
    fn laid(&self, tangents: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let segments = tangents.len() as f64;
        let mut reached = Vector3::zeros();
        let mut nodes = Vec::with_capacity(tangents.len() + 1);
        nodes.push(self.from);
        for tangent in tangents {
            reached += tangent;
            nodes.push(self.from + reached * (self.length / segments));
        }
        let missing = self.to - nodes[tangents.len()];
        nodes.iter_mut().enumerate().for_each(|(k, node)| *node += missing * (k as f64 / segments));
        nodes
    }
}

/// What pulls at a segment, beside the force that pulls at all.
enum Pull {
    Free(Vector3<f64>),
    /// It has this direction, whatever the force.
    Held(Vector3<f64>),
}

/// Cosine of the largest turn between neighbours.
fn straightest(tangents: &[Vector3<f64>]) -> f64 {
    tangents.windows(2).map(|pair| pair[0].dot(&pair[1])).fold(1.0, f64::min)
}

/// The first curve of which no turn has a cosine below `enough`, else the one whose largest turn is the smallest.
fn smoothest(curves: impl Iterator<Item = Option<Vec<Vector3<f64>>>>, enough: f64) -> Option<Vec<Vector3<f64>>> {
    let mut best: Option<(f64, Vec<Vector3<f64>>)> = None;
    for tangents in curves.flatten() {
        let turn = straightest(&tangents);
        if best.as_ref().is_none_or(|(least, _)| turn > *least) {
            best = Some((turn, tangents));
        }
        if turn >= enough {
            break;
        }
    }
    best.map(|(_, tangents)| tangents)
}

/// Unit vectors along the sums of each pull and one force F, whose mean is `way`.
///
/// F is where the convex function `sum |F + pull| - F . way` is least: its gradient is what misses. Newton's method, its
/// steps shortened until less misses. `None` where that does not end: the least is at a kink, where a segment feels no pull.
fn solve(way: &Vector3<f64>, across: &Vector3<f64>, pulls: &[Pull]) -> Option<Vec<Vector3<f64>>> {
    let tangents = |force: &Vector3<f64>| -> Vec<Vector3<f64>> {
        let along = |pull: &Pull| match pull {
            Pull::Free(own) => (force + own).normalize(),
            Pull::Held(direction) => *direction,
        };
        pulls.iter().map(along).collect()
    };
    let missing = |tangents: &[Vector3<f64>]| way - tangents.iter().sum::<Vector3<f64>>() / pulls.len() as f64;
    let (mut held, mut free) = (Vector3::zeros(), 0.0);
    for pull in pulls {
        match pull {
            Pull::Free(_) => free += 1.0,
            Pull::Held(direction) => held += direction,
        }
    }
    if (way * pulls.len() as f64 - held).norm() >= free {
        return None;
    }
    // That of a taut cable, which sags by as much as its length allows.
    let slack = (1.0 - way.norm()).max(1e-16);
    let mut force = way / (24.0 * slack).sqrt() + across * 1e-2;
    let mut now = tangents(&force);
    let mut miss = missing(&now);
    for _ in 0..200 {
        if !miss.iter().all(|x| x.is_finite()) {
            return None;
        }
        let mut slope = Matrix3::zeros();
        for (pull, t) in pulls.iter().zip(&now) {
            if let Pull::Free(own) = pull {
                slope += (Matrix3::identity() - t * t.transpose()) / (force + own).norm();
            }
        }
        let step = (slope / pulls.len() as f64).try_inverse()? * miss;
        let shorter = (0..40).map(|k| step * 0.5f64.powi(k)).find_map(|step| {
            let then = tangents(&(force + step));
            let left = missing(&then);
            (left.norm() < miss.norm()).then_some((step, then, left))
        });
        let Some((step, then, left)) = shorter else { break };
        force += step;
        (now, miss) = (then, left);
    }
    (miss.norm() <= REACHED).then_some(now)
}

/// Unit vectors along the sides of a regular polygon's part, whose mean is `way`, shorter than 1.
fn arc(way: &Vector3<f64>, segments: usize) -> Vec<Vector3<f64>> {
    let count = segments as f64;
    let chord = way.norm();
    let along = way.try_normalize(1e-9).unwrap_or_else(Vector3::x);
    let towards = if along.z.abs() < 1.0 - 1e-9 { -Vector3::z() } else { Vector3::x() };
    let towards = (towards - along * along.dot(&towards)).normalize();
    // sin(n a / 2) / (n sin(a / 2)), the chord by the length, falls from 1 at a = 0 to 0 at a = 2 pi / n.
    let (mut low, mut high) = (0.0, std::f64::consts::TAU / count);
    for _ in 0..100 {
        let turn = 0.5 * (low + high);
        match (0.5 * count * turn).sin() > chord * count * (0.5 * turn).sin() {
            true => low = turn,
            false => high = turn,
        }
    }
    let tangent = |k: usize| {
        let (sin, cos) = ((k as f64 - 0.5 * (count - 1.0)) * low).sin_cos();
        along * cos - towards * sin
    };
    (0..segments).map(tangent).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hung(to: Vector3<f64>, length: f64) -> Hung {
        let gravity = Vector3::z() * -9.81;
        Hung { from: Vector3::zeros(), to, length, start_direction: None, end_direction: None, gravity }
    }

    /// The nodes, after a check of both ends and of all lengths; and the largest turn between neighbours [degrees].
    fn checked(hung: &Hung, segments: usize) -> (Vec<Vector3<f64>>, f64) {
        let nodes = hung.nodes(segments).unwrap_or_else(|| panic!("{hung:?}"));
        assert_eq!((nodes.len(), nodes[0]), (segments + 1, hung.from));
        assert!((nodes[segments] - hung.to).norm() <= 1e-15 * hung.length.max(hung.to.norm()), "{hung:?}");
        let sides: Vec<_> = nodes.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let total: f64 = sides.iter().map(Vector3::norm).sum();
        assert!((total / hung.length - 1.0).abs() < 1e-12, "{total} m, {hung:?}");
        for side in &sides {
            assert!((side.norm() * segments as f64 / hung.length - 1.0).abs() < 1e-9, "{hung:?}");
        }
        let turn = sides.windows(2).map(|pair| pair[0].angle(&pair[1])).fold(0.0, f64::max);
        (nodes, turn.to_degrees())
    }

    /// `a` of `z = a cosh(x / a)` of a cable between ends of one height: `2 a sinh(d / 2 a) = length`, by bisection.
    fn parameter(d: f64, length: f64) -> f64 {
        let (mut low, mut high) = (d / 200.0, d * 1e6);
        for _ in 0..200 {
            let a = (low * high).sqrt();
            if 2.0 * a * (0.5 * d / a).sinh() > length { low = a } else { high = a }
        }
        low
    }

    #[test]
    fn a_level_cable_is_the_catenary_up_to_its_segments() {
        for (length, within) in [(2.2, 1e-3), (3.0, 1e-3), (10.0, 3e-3)] {
            let sag = parameter(2.0, length) * ((1.0 / parameter(2.0, length)).cosh() - 1.0);
            let errors = [100, 200].map(|segments| {
                let (nodes, _) = checked(&hung(Vector3::x() * 2.0, length), segments);
                (-nodes[segments / 2].z / sag - 1.0).abs()
            });
            assert!(errors[0] < within && errors[1] < 0.3 * errors[0], "{length}: {errors:?}");
        }
    }

    /// Each joint's forces balance: the pull along a segment changes by its weight, and nothing else, to the next.
    #[test]
    fn a_chain_is_at_rest_whatever_its_ends() {
        for to in [Vector3::new(1.0, 2.0, 0.7), Vector3::new(0.0, 1.0, -2.0), Vector3::new(2.9999, 0.0, 0.0)] {
            let (nodes, _) = checked(&hung(to, 3.0), 40);
            let slopes: Vec<f64> =
                nodes.windows(2).map(|pair| pair[1] - pair[0]).map(|side| side.z / side.xy().norm()).collect();
            // In units of the horizontal pull the vertical one grows by the same from segment to segment.
            let step = (slopes[39] - slopes[0]) / 39.0;
            for pair in slopes.windows(2) {
                assert!((pair[1] - pair[0] - step).abs() < 1e-8 * slopes[39].abs().max(1e-3), "{to}: {slopes:?}");
            }
            let normal = to.cross(&Vector3::z()).normalize();
            assert!(nodes.iter().all(|node| node.dot(&normal).abs() < 1e-12), "in the plane of both ends and gravity");
        }
    }

    #[test]
    fn nearly_straight_very_slack_and_folded_cables_are_found() {
        for segments in [8, 9, 30, 101] {
            for excess in [0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 0.1, 1.0, 10.0, 1e4] {
                for to in
                    [Vector3::new(3.0, -4.0, 12.0), Vector3::z() * 13.0, -Vector3::z(), Vector3::new(1e-7, 0.0, 1.0)]
                {
                    let (_, turn) = checked(&hung(to, to.norm() * (1.0 + excess)), segments);
                    assert!(turn < 66.0, "{segments}, {excess}, {to}: {turn} degrees");
                }
            }
            let (nodes, turn) = checked(&hung(Vector3::zeros(), 2.0), segments);
            assert!(turn < 61.0 && nodes.iter().all(|node| node.y.abs() < 1e-12), "{segments}: {turn} degrees");
        }
        assert_eq!(hung(Vector3::x(), 0.999).nodes(30), None);
    }

    #[test]
    fn it_hangs_along_gravity_and_in_an_arc_without_it() {
        let below = |gravity: Vector3<f64>, to: Vector3<f64>| {
            let (nodes, _) = checked(&Hung { gravity, ..hung(to, 3.0) }, 60);
            nodes[30] - to * 0.5
        };
        let sideways = below(Vector3::x() * 9.81, Vector3::y() * 2.0);
        assert!(sideways.x > 0.9 && sideways.y.abs() < 1e-9 && sideways.z.abs() < 1e-9);
        let arc = Hung { gravity: Vector3::zeros(), ..hung(Vector3::y() * 2.0, 3.0) };
        let (nodes, _) = checked(&arc, 60);
        let turn = |k: usize| (nodes[k] - nodes[k - 1]).angle(&(nodes[k + 1] - nodes[k]));
        assert!((2..60).all(|k| (turn(k) - turn(1)).abs() < 1e-9) && nodes[30].z < -0.9);
        assert!(below(Vector3::zeros(), Vector3::z() * 2.0).x > 0.9);
        let (closed, _) = checked(&Hung { gravity: Vector3::zeros(), ..hung(Vector3::zeros(), 3.0) }, 60);
        assert!((closed[30] - closed[0]).norm() * std::f64::consts::PI > 2.99);
    }

    #[test]
    fn directions_are_those_of_the_first_and_the_last_segments() {
        let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
        let cases = [
            (x, Some(x), Some(x)),
            (x, Some(-x), Some(-x)),
            (x, Some(z), Some(-z)),
            (x, Some(-z), None),
            (x, None, Some(y)),
            (x + y + z, Some(y), Some(-z)),
            (Vector3::zeros(), Some(x), Some(-x)),
            (Vector3::zeros(), Some(x), Some(x)),
            (-z, Some(-z), Some(z)),
            (-z, Some(z), Some(z)),
        ];
        for (way, start_direction, end_direction) in cases {
            for gravity in [Vector3::zeros(), z * -9.81, x * 9.81] {
                for length in [2.0, 2.5, 8.0] {
                    let own = Hung { start_direction, end_direction, gravity, ..hung(way, length) };
                    let (nodes, turn) = checked(&own, 100);
                    for (direction, ks) in [(start_direction, [0, 1]), (end_direction, [98, 99])] {
                        let Some(direction) = direction else { continue };
                        for k in ks {
                            let side = (nodes[k + 1] - nodes[k]).normalize();
                            assert!((side - direction).norm() < 1e-9, "segment {k}, {own:?}");
                        }
                    }
                    assert!(turn < 16.0, "{turn} degrees, {own:?}");
                }
            }
        }
    }
}

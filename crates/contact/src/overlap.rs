//! Bodies that overlap where a simulation begins.

use std::cell::OnceCell;
use std::cmp::Reverse;
use std::fmt;
use std::sync::Arc;

use collision::{Aabb, Capsule, SpatialHash, TriangleMesh, closest};
use component::BodyPose;
use kernels::math::Quat;
use nalgebra::Vector3;
use rod::{BodyShape, Mesh, Model, ObstacleShape, Pose, State};
use thiserror::Error;

use super::convert::to_kernel;
use super::exclusion::PairFilter;
use super::sheath::Tube;

/// Bodies overlap where a simulation begins: the pair that does so most.
#[derive(Clone, Debug, Error, PartialEq)]
#[error(
    "segment {segment} (rod {rod}) {other} by {} m at the start{}; move them apart, or allow it (`allow_overlap`)",
    short(*.depth),
    more(*.pairs)
)]
pub struct Overlap {
    /// Index of the segment in the model.
    pub segment: usize,
    /// Index of its rod.
    pub rod: usize,
    /// What it overlaps.
    pub other: Overlapped,
    /// How deep \[m\].
    pub depth: f64,
    /// How many pairs overlap in all.
    pub pairs: usize,
}

/// What a segment overlaps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overlapped {
    /// Another segment.
    Segment {
        /// Its index in the model.
        index: usize,
        /// Index of its rod.
        rod: usize,
    },
    /// An obstacle.
    Obstacle {
        /// Its index in the model.
        index: usize,
        /// What it is: [`ObstacleShape::kind`].
        kind: &'static str,
    },
    /// The wall of a sheath.
    Sheath {
        /// Its index in [`rod::Contacts::sheaths`].
        index: usize,
    },
}

impl fmt::Display for Overlapped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Overlapped::Segment { index, rod } => write!(f, "and segment {index} (rod {rod}) overlap"),
            Overlapped::Obstacle { index, kind } => write!(f, "overlaps obstacle {index} (a {kind})"),
            Overlapped::Sheath { index } => write!(f, "overlaps the wall of sheath {index}"),
        }
    }
}

/// `depth` to four digits.
fn short(depth: f64) -> f64 {
    format!("{depth:.3e}").parse().unwrap_or(depth)
}

/// The pairs that an error does not name.
fn more(pairs: usize) -> String {
    match pairs {
        0 | 1 => String::new(),
        2 => ", and another pair too".to_owned(),
        pairs => format!(", and {} other pairs too", pairs - 1),
    }
}

/// Refuses a start at which bodies of a pair in `filter` overlap by more than `tolerance` times the smaller radius, if the
/// model does not allow it. In a contact with an obstacle the segment's radius counts.
///
/// # Errors
/// The deepest overlap.
pub fn refuse_overlaps(model: &Model, state: &State, filter: &PairFilter, tolerance: f64) -> Result<(), Overlap> {
    if model.contacts.allow_overlap {
        return Ok(());
    }
    let capsules: Vec<Capsule> = (0..model.segments.len()).map(|i| capsule(model, state, i)).collect();
    let mut worst: Option<Overlap> = None;
    let mut pairs = 0;
    let mut see = |segment: usize, other: Overlapped, depth: f64, radius: f64| {
        if depth.is_nan() || depth <= tolerance * radius {
            return;
        }
        pairs += 1;
        let key = |found: &Overlap| match found.other {
            Overlapped::Segment { index, .. } => (0, found.segment, index),
            Overlapped::Obstacle { index, .. } => (1, found.segment, index),
            Overlapped::Sheath { index } => (2, found.segment, index),
        };
        let found = Overlap { segment, rod: model.segments[segment].rod, other, depth, pairs: 0 };
        let is_worse = |old: &Overlap| {
            depth.total_cmp(&old.depth).then_with(|| Reverse(key(&found)).cmp(&Reverse(key(old)))).is_gt()
        };
        if worst.as_ref().is_none_or(is_worse) {
            worst = Some(found);
        }
    };
    let bodies: Vec<(usize, Standing)> = model
        .segments
        .iter()
        .enumerate()
        .filter_map(|(i, segment)| {
            let pose = Pose { position: state.positions[i], orientation: state.orientations[i] };
            let round = match segment.body.as_ref().map(|body| &body.shape) {
                Some(&BodyShape::Cylinder { radius, length }) => Some([radius, length]),
                _ => None,
            };
            Some((i, Standing::new(Arc::new(segment.surface()?), pose, round)))
        })
        .collect();
    for (i, body) in &bodies {
        let other = Overlapped::Segment { index: *i, rod: model.segments[*i].rod };
        for (a, own) in capsules.iter().enumerate().filter(|&(a, _)| filter.touches_mesh(a as u32, *i as u32)) {
            see(a, other, own.radius - body.distance(own), own.radius);
        }
    }
    let mut obstacles = Vec::new();
    for (index, obstacle) in model.contacts.obstacles.iter().enumerate() {
        let other = Overlapped::Obstacle { index, kind: obstacle.shape.kind() };
        let touches = |i: usize| !model.segments[i].fixed && model.segments[i].capsule().is_some();
        let free = || bodies.iter().filter(|(i, _)| !model.segments[*i].fixed);
        if let ObstacleShape::HalfSpace { point, normal } = &obstacle.shape {
            for (i, body) in free() {
                let lowest = body.corners().map(|corner| normal.dot(&(corner - point))).fold(f64::INFINITY, f64::min);
                see(*i, other, -lowest, model.segments[*i].radius);
            }
            for (i, own) in capsules.iter().enumerate().filter(|&(i, _)| touches(i)) {
                let height = normal.dot(&(own.start - point)).min(normal.dot(&(own.end - point)));
                see(i, other, own.radius - height, own.radius);
            }
        } else if let Some(([start, end], radius)) = obstacle.shape.capsule() {
            let capsule = Capsule { start, end, radius };
            for (i, body) in free() {
                see(*i, other, radius - body.distance(&capsule), model.segments[*i].radius);
            }
            obstacles.push((other, capsule));
        } else if let Some((mesh, orientation)) = obstacle.shape.surface() {
            let round = match &obstacle.shape {
                ObstacleShape::Cylinder { start, end, radius } => Some([*radius, (end - start).norm()]),
                _ => None,
            };
            let standing = Standing::new(mesh, Pose { position: obstacle.shape.pivot(), orientation }, round);
            for (i, own) in capsules.iter().enumerate().filter(|&(i, _)| touches(i)) {
                see(i, other, own.radius - standing.distance(own), own.radius);
            }
            for (i, body) in free().filter(|(_, body)| body.is_near(&standing.pose.position, standing.reach)) {
                see(*i, other, body.depth(&standing).max(standing.depth(body)), model.segments[*i].radius);
            }
        }
    }
    for (index, sheath) in model.contacts.sheaths.iter().enumerate() {
        let free = |i: u32| !model.segments[i as usize].fixed;
        let radius = |i: u32| model.segments[i as usize].radius;
        let pose = |i: u32| in_kernel_pose(state, i as usize);
        Tube::new(model, sheath).depths(radius, &pose, |inner, outer, depth| {
            if free(inner) || free(outer) {
                see(inner as usize, Overlapped::Sheath { index }, depth, radius(inner));
            }
        });
    }
    if filter.has_pairs(obstacles.len()) {
        let bodies = capsules.iter().chain(obstacles.iter().map(|(_, capsule)| capsule));
        let mut hash = SpatialHash::new();
        hash.rebuild(&bodies.map(Capsule::aabb).collect::<Vec<_>>());
        let mut candidates = Vec::new();
        hash.pairs(|a, b| filter.contains(a, b), &mut candidates);
        for [a, b] in candidates.into_iter().map(|pair| pair.map(|i| i as usize)) {
            let own = &capsules[a];
            let (other, capsule, radius) = match b.checked_sub(capsules.len()) {
                None => {
                    let other = Overlapped::Segment { index: b, rod: model.segments[b].rod };
                    (other, &capsules[b], own.radius.min(capsules[b].radius))
                }
                Some(k) => (obstacles[k].0, &obstacles[k].1, own.radius),
            };
            let distance = closest::segments(&[own.start, own.end], &[capsule.start, capsule.end]).distance;
            see(a, other, own.radius + capsule.radius - distance, radius);
        }
    }
    worst.map_or(Ok(()), |worst| Err(Overlap { pairs, ..worst }))
}

/// A surface where it stands.
struct Standing {
    mesh: Arc<Mesh>,
    pose: Pose,
    /// Distance of its farthest corner from the pose's position [m].
    reach: f64,
    /// Its faces and edges, which take time to find: once something is near.
    parts: OnceCell<TriangleMesh>,
    /// Radius and length of a cylinder about its z axis, whose side is round.
    round: Option<[f64; 2]>,
}

impl Standing {
    fn new(mesh: Arc<Mesh>, pose: Pose, round: Option<[f64; 2]>) -> Self {
        let mut own = Self { mesh, pose, reach: 0.0, parts: OnceCell::new(), round };
        own.reach = own.corners().map(|corner| (corner - pose.position).norm()).fold(0.0, f64::max);
        own
    }

    fn parts(&self) -> &TriangleMesh {
        self.parts.get_or_init(|| {
            let parts = TriangleMesh::new(&self.mesh.positions, &self.mesh.triangles);
            match self.round {
                Some([radius, length]) => parts.with_round_side(radius, length),
                None => parts,
            }
        })
    }

    /// The corners of its triangles in the world.
    fn corners(&self) -> impl Iterator<Item = Vector3<f64>> {
        let places = self.mesh.triangles.iter().flatten().map(|&i| &self.mesh.positions[i as usize]);
        places.map(|place| self.to_world(place))
    }

    fn to_world(&self, place: &Vector3<f64>) -> Vector3<f64> {
        self.pose.position + self.pose.orientation * place
    }

    fn own_place(&self, place: &Vector3<f64>) -> Vector3<f64> {
        self.pose.orientation.inverse() * (place - self.pose.position)
    }

    /// Whether it may meet what is not further than `reach` [m] from a place.
    fn is_near(&self, place: &Vector3<f64>, reach: f64) -> bool {
        (place - self.pose.position).norm() <= self.reach + reach
    }

    /// How far the axis of a capsule is from it [m]: negative inside, and infinite beyond the capsule's radius.
    fn distance(&self, capsule: &Capsule) -> f64 {
        let half = 0.5 * (capsule.end - capsule.start).norm();
        if !self.is_near(&((capsule.start + capsule.end) * 0.5), half + capsule.radius) {
            return f64::INFINITY;
        }
        let [start, end] = [capsule.start, capsule.end].map(|place| self.own_place(&place));
        let (own, capsule) = (self.parts(), Capsule { start, end, ..*capsule });
        let mut least = f64::INFINITY;
        own.face_tree()
            .overlaps(&capsule.aabb(), |k| least = least.min(own.faces()[k as usize].distance(&[start, end])));
        let least = match own.encloses(&((start + end) * 0.5)) {
            true if least.is_finite() => -least,
            // Deep inside; how deep does not matter.
            true => -capsule.radius,
            false => least,
        };
        let Some(side) = own.round_side() else { return least };
        let near = closest::segments(&[start, end], &side.ends);
        let is_beside = near.separation.z.abs() < 1e-9 * near.distance;
        if is_beside { least.min(near.distance - side.radius) } else { least }
    }

    /// How deep its edges, and places within them, lie inside of another one [m]; how far they stand out of a surface that is
    /// open and that they pierce.
    fn depth(&self, other: &Self) -> f64 {
        let (of, within) = (self.parts(), other.parts());
        let place = |own: &Vector3<f64>| other.own_place(&self.to_world(own));
        let inside = |place: Vector3<f64>| if within.encloses(&place) { within.distance(&place) } else { 0.0 };
        // How deep a place is that both enclose.
        let in_both = |own: Vector3<f64>| if of.encloses(&own) { inside(place(&own)) } else { 0.0 };
        let middle = of.corners().iter().sum::<Vector3<f64>>() / of.corners().len().max(1) as f64;
        let (mut cuts, mut deepest) = (Vec::new(), in_both(middle));
        for edge in of.edges() {
            let [a, b] = edge.ends.each_ref().map(place);
            for end in edge.ends {
                deepest = deepest.max(in_both(end + (middle - end) * WITHIN));
            }
            cuts.clear();
            within.face_tree().overlaps(&Aabb { min: a.inf(&b), max: a.sup(&b) }, |k| {
                let face = &within.faces()[k as usize];
                let (from, to) = (face.height(&a), face.height(&b));
                let cut = from / (from - to);
                if from * to < 0.0 && face.holds(&(a + (b - a) * cut), 0.0) {
                    cuts.push(cut);
                    if !within.is_closed() {
                        deepest = deepest.max(from.abs().min(to.abs()));
                    }
                }
            });
            // Its ends, and the middles of the parts into which the other one cuts it.
            cuts.extend([0.0, 0.0, 1.0, 1.0]);
            cuts.sort_unstable_by(f64::total_cmp);
            for pair in cuts.windows(2) {
                deepest = deepest.max(inside(a + (b - a) * (0.5 * (pair[0] + pair[1]))));
            }
        }
        deepest
    }
}

/// How far within a mesh, as a share of the way to the middle of its corners, places are looked at beside those on its edges:
/// what shares planes with another one has none of its edges inside it.
const WITHIN: f64 = 0.1;

/// The pose of a segment in a state.
fn in_kernel_pose(state: &State, i: usize) -> BodyPose<f64> {
    let q = state.orientations[i];
    BodyPose { x: to_kernel(&state.positions[i]), q: Quat { v: to_kernel(&q.imag()), w: q.w } }
}

/// A segment's capsule; that of a rigid body that touches nothing is of no use.
fn capsule(model: &Model, state: &State, i: usize) -> Capsule {
    let (half, radius) = model.segments[i].capsule().unwrap_or((0.0, model.segments[i].radius));
    let arm = state.axis(i) * half;
    Capsule { start: state.positions[i] - arm, end: state.positions[i] + arm, radius }
}

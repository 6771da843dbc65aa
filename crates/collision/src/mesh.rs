//! Surfaces of triangles as the faces and edges that something can touch.
//!
//! A segment of a line and a triangle that do not cross are nearest at an end of the segment and the inside of the triangle,
//! or at places of the segment and of one of the triangle's edges (Ericson, "Real-Time Collision Detection", 2005, section
//! 5.1.10). So faces are for ends, and edges for segments. An edge between triangles of one plane is nearest to nothing to
//! which they are not as near, and is left out.

use std::collections::HashMap;

use nalgebra::Vector3;

use crate::bvh::Bvh;
use crate::closest;
use crate::shape::Aabb;

/// Two triangles lie in one plane if the angle between them differs from half a turn by less than this [rad]. Places with
/// the digits of f32 give angles of 1e-5 in meshes with triangles of a hundredth of their size.
pub const FLAT: f64 = 1e-4;

/// A triangle.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// Its corners [m].
    pub corners: [Vector3<f64>; 3],
    /// Unit normal; corners are counterclockwise as seen from where it points.
    pub normal: Vector3<f64>,
    /// For each corner k, the unit vector in the plane that points out of the triangle across the edge from there to the next
    /// corner.
    pub outward: [Vector3<f64>; 3],
}

/// An edge that is nearest to something.
#[derive(Clone, Debug, PartialEq)]
pub struct Edge {
    /// Its ends [m].
    pub ends: [Vector3<f64>; 2],
    /// For each of the two triangles at it the unit vector in its plane that points out of it; that of the only one twice.
    /// Zero where there are more than two.
    pub outward: [Vector3<f64>; 2],
}

/// A surface, with hierarchies to find its parts.
#[derive(Clone, Debug)]
pub struct TriangleMesh {
    faces: Vec<Face>,
    edges: Vec<Edge>,
    face_tree: Bvh,
    edge_tree: Bvh,
    corners: Vec<Vector3<f64>>,
    tips: Vec<Vector3<f64>>,
    corner_tree: Bvh,
    closed: bool,
    round: Option<RoundSide>,
}

/// The round side of a cylinder about the z axis, for which flat faces of the mesh stand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoundSide {
    /// Ends of its axis [m].
    pub ends: [Vector3<f64>; 2],
    /// Its radius [m].
    pub radius: f64,
}

/// Sine of the angle to the axis below which an edge, and of that to a plane across it below which a face is of the round side.
const SIDE: f64 = 1e-6;

/// An edge while the mesh is built: its ends, the first two triangles at it with their edges, how many there are, and whether two
/// run through it in opposite directions.
struct Shared {
    ends: [u32; 2],
    outward: [Vector3<f64>; 2],
    count: usize,
    is_opposite: bool,
}

impl TriangleMesh {
    /// The mesh of triangles that are given by indices of finite `positions` [m]. Vertices at the same place are one; triangles
    /// without an area are left out.
    ///
    /// # Panics
    /// If an index is out of range.
    pub fn new(positions: &[Vector3<f64>], triangles: &[[u32; 3]]) -> Self {
        let mut known = HashMap::new();
        // 0 and -0 are the same place.
        let bits = |place: &Vector3<f64>| [place.x, place.y, place.z].map(|x| (x + 0.0).to_bits());
        let same: Vec<u32> =
            positions.iter().enumerate().map(|(i, place)| *known.entry(bits(place)).or_insert(i as u32)).collect();
        let mut faces = Vec::with_capacity(triangles.len());
        let mut shared: Vec<Shared> = Vec::new();
        let mut places: HashMap<[u32; 2], usize> = HashMap::new();
        for triangle in triangles {
            let vertices = triangle.map(|i| same[i as usize]);
            let Some(face) = Face::new(vertices.map(|i| positions[i as usize])) else { continue };
            for k in 0..3 {
                let (from, to) = (vertices[k], vertices[(k + 1) % 3]);
                let place = *places.entry([from.min(to), from.max(to)]).or_insert(shared.len());
                if place == shared.len() {
                    let outward = [face.outward[k]; 2];
                    shared.push(Shared { ends: [from, to], outward, count: 1, is_opposite: false });
                    continue;
                }
                let edge = &mut shared[place];
                edge.outward[1] = face.outward[k];
                edge.count += 1;
                edge.is_opposite = edge.count == 2 && edge.ends == [to, from];
            }
            faces.push(face);
        }
        let closed = shared.iter().all(|edge| edge.is_opposite);
        let edges: Vec<Edge> = shared.iter().filter_map(|edge| edge.part(positions)).collect();
        let room = |places: &[Vector3<f64>]| Aabb {
            min: places.iter().skip(1).fold(places[0], |min, place| min.inf(place)),
            max: places.iter().skip(1).fold(places[0], |max, place| max.sup(place)),
        };
        let mut ends: Vec<u32> = shared.iter().filter(|edge| !edge.is_flat()).flat_map(|edge| edge.ends).collect();
        ends.sort_unstable();
        ends.dedup();
        let corners: Vec<Vector3<f64>> = ends.iter().map(|&i| positions[i as usize]).collect();
        let mut tips = vec![Vector3::zeros(); corners.len()];
        for edge in shared.iter().filter(|edge| !edge.is_flat()) {
            let along = edge.ends.map(|i| positions[i as usize]);
            let along = (along[1] - along[0]).try_normalize(0.0).unwrap_or_default();
            for (end, out) in edge.ends.iter().zip([-along, along]) {
                if let Ok(corner) = ends.binary_search(end) {
                    tips[corner] += out;
                }
            }
        }
        let corner_tree = Bvh::new(&corners.iter().map(|&place| Aabb { min: place, max: place }).collect::<Vec<_>>());
        let face_tree = Bvh::new(&faces.iter().map(|face| room(&face.corners)).collect::<Vec<_>>());
        let edge_tree = Bvh::new(&edges.iter().map(|edge| room(&edge.ends)).collect::<Vec<_>>());
        Self { faces, edges, face_tree, edge_tree, corners, tips, corner_tree, closed, round: None }
    }

    /// The mesh of a cylinder about the z axis, from `-length / 2` to `length / 2` [m], with its round side as it is: faces and edges
    /// along the axis stand for that where something has no use of it.
    pub fn with_round_side(mut self, radius: f64, length: f64) -> Self {
        self.round = Some(RoundSide { ends: [-0.5, 0.5].map(|share| Vector3::z() * (share * length)), radius });
        self
    }

    /// The round side, if it has one.
    pub fn round_side(&self) -> Option<&RoundSide> {
        self.round.as_ref()
    }

    /// Whether a face stands for a part of the round side.
    pub fn is_round_face(&self, face: usize) -> bool {
        self.round.is_some() && self.faces[face].normal.z.abs() < SIDE
    }

    /// Whether an edge stands for a part of the round side.
    pub fn is_round_edge(&self, edge: usize) -> bool {
        let [start, end] = self.edges[edge].ends;
        self.round.is_some() && (end - start).normalize().xy().norm() < SIDE
    }

    /// The triangles.
    pub fn faces(&self) -> &[Face] {
        &self.faces
    }

    /// The edges that are nearest to something.
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// Ends of those edges [m]: in any direction one of them is as far out as any place of the surface.
    pub fn corners(&self) -> &[Vector3<f64>] {
        &self.corners
    }

    /// For each corner the direction in which it points, against its edges; not of unit length. Where the surface is convex, a
    /// plane that touches it at the corner alone has it on its other side.
    pub fn tips(&self) -> &[Vector3<f64>] {
        &self.tips
    }

    /// Corners in a box.
    pub fn corner_tree(&self) -> &Bvh {
        &self.corner_tree
    }

    /// Triangles whose boxes overlap a box.
    pub fn face_tree(&self) -> &Bvh {
        &self.face_tree
    }

    /// Edges whose boxes overlap a box.
    pub fn edge_tree(&self) -> &Bvh {
        &self.edge_tree
    }

    /// Whether each edge has two triangles, which run through it in opposite directions.
    pub fn is_closed(&self) -> bool {
        self.closed
    }

    /// Whether a place lies inside: the surface is closed, looks outwards and winds around it.
    pub fn encloses(&self, place: &Vector3<f64>) -> bool {
        let is_in = |room: &Aabb| (0..3).all(|k| room.min[k] < place[k] && place[k] < room.max[k]);
        if !self.closed || !self.face_tree.bounds().is_some_and(is_in) {
            return false;
        }
        let top = self.face_tree.bounds().map_or(place.z, |room| room.max.z);
        let above = Aabb { min: *place, max: Vector3::new(place.x, place.y, top) };
        let mut winding = 0;
        self.face_tree.overlaps(&above, |k| winding += self.faces[k as usize].winding_above(place));
        winding > 0
    }

    /// Whether what was at a place, off the surface, and is at this height above a face now [m] may be on that side of the face without passing
    /// through any: of a closed surface the outer side, unless it was inside.
    pub fn is_outside(&self, place: &Vector3<f64>, height: f64) -> bool {
        !self.closed || (height > 0.0) != self.encloses(place)
    }

    /// Distance of a place from the surface [m].
    pub fn distance(&self, place: &Vector3<f64>) -> f64 {
        self.face_tree.nearest(place, |k| (self.faces[k as usize].nearest(place) - place).norm())
    }
}

impl Shared {
    /// Whether its triangles lie in one plane.
    fn is_flat(&self) -> bool {
        self.count == 2 && (self.outward[0] + self.outward[1]).norm() < FLAT
    }

    /// It as an edge, unless its triangles lie in one plane.
    fn part(&self, positions: &[Vector3<f64>]) -> Option<Edge> {
        let outward = if self.count > 2 { [Vector3::zeros(); 2] } else { self.outward };
        (!self.is_flat()).then(|| Edge { ends: self.ends.map(|i| positions[i as usize]), outward })
    }
}

impl Face {
    /// A triangle; `None` if it has no area.
    fn new(corners: [Vector3<f64>; 3]) -> Option<Self> {
        let [a, b, c] = corners;
        let normal =
            (b - a).cross(&(c - a)).try_normalize(0.0).filter(|normal| normal.iter().all(|x| x.is_finite()))?;
        let mut outward = [Vector3::zeros(); 3];
        for (k, outward) in outward.iter_mut().enumerate() {
            *outward = (corners[(k + 1) % 3] - corners[k]).cross(&normal).try_normalize(0.0)?;
        }
        Some(Self { corners, normal, outward })
    }

    /// Height of a place above the plane, on the side of the normal [m].
    #[inline]
    pub fn height(&self, place: &Vector3<f64>) -> f64 {
        self.normal.dot(&(place - self.corners[0]))
    }

    /// Whether a place lies above or below the triangle, or not further beside it than `slack` [m] from each of its edges' lines.
    #[inline]
    pub fn holds(&self, place: &Vector3<f64>, slack: f64) -> bool {
        self.outward.iter().zip(&self.corners).all(|(outward, corner)| outward.dot(&(place - corner)) <= slack)
    }

    /// The point of the triangle that is nearest to a place.
    pub fn nearest(&self, place: &Vector3<f64>) -> Vector3<f64> {
        if self.holds(place, 0.0) {
            return place - self.normal * self.height(place);
        }
        let on_edge = |k: usize| {
            let edge = [self.corners[k], self.corners[(k + 1) % 3]];
            edge[0] + (edge[1] - edge[0]) * closest::point(&edge, place)
        };
        let distance = |point: &Vector3<f64>| (point - place).norm_squared();
        let [a, b, c] = [on_edge(0), on_edge(1), on_edge(2)];
        [b, c].into_iter().fold(a, |best, point| if distance(&point) < distance(&best) { point } else { best })
    }

    /// Distance to a segment [m].
    pub fn distance(&self, segment: &[Vector3<f64>; 2]) -> f64 {
        let [from, to] = segment.each_ref().map(|end| self.height(end));
        if from * to < 0.0 && self.holds(&(segment[0] + (segment[1] - segment[0]) * (from / (from - to))), 0.0) {
            return 0.0;
        }
        let ends = segment.iter().map(|end| (self.nearest(end) - end).norm());
        let edges = (0..3).map(|k| closest::segments(segment, &[self.corners[k], self.corners[(k + 1) % 3]]).distance);
        ends.chain(edges).fold(f64::INFINITY, f64::min)
    }

    /// What it adds to the winding number of a place: 1 where it is right above the place and looks upwards, -1 where it looks
    /// downwards. Triangles that share an edge see it alike, so that of those above an edge or a corner as many count as above
    /// a place beside it.
    fn winding_above(&self, place: &Vector3<f64>) -> i32 {
        let mut turns = 0;
        for k in 0..3 {
            let (from, to) = (&self.corners[k], &self.corners[(k + 1) % 3]);
            let upwards = to.y > place.y;
            if (from.y > place.y) == upwards {
                continue;
            }
            let (low, high) = if upwards { (from, to) } else { (to, from) };
            // Whether the edge passes on the side where x is larger.
            let side = (high.x - low.x) * (place.y - low.y) - (high.y - low.y) * (place.x - low.x);
            if side > 0.0 {
                turns += if upwards { 1 } else { -1 };
            }
        }
        // The height is on the side of the normal; below the triangle where both signs differ.
        if f64::from(turns) * self.height(place) < 0.0 { turns } else { 0 }
    }
}

impl Edge {
    /// Whether the edge, and none of its triangles, is what is nearest of the surface in a unit direction from it; `slack`
    /// is a sine.
    #[inline]
    pub fn faces(&self, direction: &Vector3<f64>, slack: f64) -> bool {
        self.outward.iter().all(|outward| outward.dot(direction) >= -slack)
    }
}

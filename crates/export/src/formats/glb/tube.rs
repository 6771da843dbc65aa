//! The rods' surface as a mesh with a skin: round tubes with rounded ends.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};
use std::io::{self, Write};

use nalgebra::Vector3;
use rod::{Model, State};

use super::super::centrelines::{Centrelines, Node};

/// Vertices of a ring about the centreline.
const SIDES: usize = 8;

/// A mesh of a rod with its skin: arrays with one entry a vertex, and the vertices of each triangle, counterclockwise from outside.
#[derive(Default)]
pub(super) struct Tube {
    /// Index of the rod.
    pub(super) rod: usize,
    /// Which part of the rod it is, from 0.
    pub(super) part: usize,
    /// The segments that it moves with, in increasing order: the joints of its skin.
    pub(super) segments: Vec<usize>,
    /// Places [m] in the world's axes.
    pub(super) positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    /// The joints of the skin that a vertex moves with, and how much with each.
    joints: Vec<[u16; 4]>,
    weights: Vec<[f32; 4]>,
    pub(super) indices: Vec<u32>,
}

/// Vertices about a node.
#[derive(Clone, Copy)]
struct Ring {
    node: Node,
    centre: Vector3<f64>,
    radius: f64,
    /// Along the centreline.
    tangent: Vector3<f64>,
    /// Direction of the first vertex, across the tangent.
    side: Vector3<f64>,
    /// Latitude on the sphere about the node [rad]: zero on the tube, a quarter turn at the pole of a rounded end.
    latitude: f64,
}

/// Rings, each joined to the next, and the last to the first if it is closed.
struct Piece {
    rings: Vec<Ring>,
    closed: bool,
}

impl Tube {
    /// The surfaces of all rods in `state`: one tube each, or more where one would move with more than `most` segments.
    /// Vertices between two segments move half with each. Rigid bodies are no tubes.
    pub(super) fn all(model: &Model, lines: &Centrelines, state: &State, most: usize) -> Vec<Self> {
        let mut tubes: Vec<(Self, Vec<Piece>)> = Vec::new();
        for chain in lines.chains.iter().filter(|chain| model.segments[lines.first(chain)].body.is_none()) {
            let rings = rings(model, &lines.nodes[chain.nodes.clone()], chain.closed, state);
            for piece in pieces(rings, chain.closed, most) {
                let segments = piece.segments();
                match tubes.last_mut() {
                    Some((tube, pieces)) if tube.rod == chain.rod && tube.segments.len() + segments.len() <= most => {
                        tube.segments.extend(segments);
                        pieces.push(piece);
                    }
                    last => {
                        let part = last.filter(|(tube, _)| tube.rod == chain.rod).map_or(0, |(tube, _)| tube.part + 1);
                        tubes.push((Self { rod: chain.rod, part, segments, ..Self::default() }, vec![piece]));
                    }
                }
            }
        }
        let finish = |(mut tube, pieces): (Self, Vec<Piece>)| {
            tube.segments.sort_unstable();
            tube.segments.dedup();
            pieces.iter().for_each(|piece| tube.add(piece));
            tube
        };
        tubes.into_iter().map(finish).collect()
    }

    fn add(&mut self, Piece { rings, closed }: &Piece) {
        let first = self.positions.len();
        for ring in rings {
            for direction in (0..SIDES).map(|k| ring.direction(k)) {
                let normal = direction * ring.latitude.cos() + ring.tangent * ring.latitude.sin();
                let position = ring.centre + normal * ring.radius;
                self.positions.push(position.map(|x| x as f32).into());
                self.normals.push(normal.map(|x| x as f32).into());
                let (joints, weights) = self.bones(&ring.node);
                self.joints.push(joints);
                self.weights.push(weights);
            }
        }
        for (k, pair) in rings.windows(2).enumerate() {
            self.join(first + k * SIDES, first + (k + 1) * SIDES, 0, [&pair[0], &pair[1]].map(Ring::is_pole));
        }
        if let (true, [start, .., end]) = (closed, rings.as_slice()) {
            self.join(first + (rings.len() - 1) * SIDES, first, end.shift(start), [false; 2]);
        }
    }

    /// Triangles between two rings, given their first vertices; the second begins `shift` vertices further on. A ring
    /// that is a pole is a point.
    fn join(&mut self, lower: usize, upper: usize, shift: usize, [lower_pole, upper_pole]: [bool; 2]) {
        for k in 0..SIDES {
            let [a, b] = [k, k + 1].map(|k| (lower + k % SIDES) as u32);
            let [d, c] = [k, k + 1].map(|k| (upper + (k + shift) % SIDES) as u32);
            if !lower_pole {
                self.indices.extend([a, b, c]);
            }
            if !upper_pole {
                self.indices.extend([a, c, d]);
            }
        }
    }

    /// Joints of the skin that the vertices of a node move with, and their weights.
    fn bones(&self, node: &Node) -> ([u16; 4], [f32; 4]) {
        let joint = |segment: usize| self.segments.binary_search(&segment).unwrap_or_default() as u16;
        match (node.before.map(joint), node.after.map(joint)) {
            (Some(before), Some(after)) => ([before, after, 0, 0], [0.5, 0.5, 0.0, 0.0]),
            (one, other) => ([one.or(other).unwrap_or_default(), 0, 0, 0], [1.0, 0.0, 0.0, 0.0]),
        }
    }

    /// Writes indices, places, normals, joints and weights.
    pub(super) fn write(&self, writer: &mut impl Write) -> io::Result<()> {
        self.indices.iter().try_for_each(|index| writer.write_all(&index.to_le_bytes()))?;
        write_floats(writer, self.positions.iter().chain(&self.normals).flatten().copied())?;
        self.joints.iter().flatten().try_for_each(|joint| writer.write_all(&joint.to_le_bytes()))?;
        write_floats(writer, self.weights.iter().flatten().copied())
    }
}

impl Piece {
    /// The segments about its nodes, in increasing order.
    fn segments(&self) -> Vec<usize> {
        let mut segments: Vec<usize> =
            self.rings.iter().flat_map(|ring| [ring.node.before, ring.node.after]).flatten().collect();
        segments.sort_unstable();
        segments.dedup();
        segments
    }
}

/// A chain whole, or cut into overlapping pieces that move with at most so many segments each, three or more.
fn pieces(rings: Vec<Ring>, closed: bool, most: usize) -> Vec<Piece> {
    let mut whole = Piece { rings, closed };
    if whole.segments().len() <= most {
        return vec![whole];
    }
    let rings = &mut whole.rings;
    if let (true, [start, .., end]) = (closed, rings.as_slice()) {
        let again = Ring { side: start.direction(end.shift(start)), ..*start };
        rings.push(again);
    }
    // Rings in a row are on one segment more than they are.
    let count = most - 1;
    let piece = |begin: usize| {
        let end = rings.len().min(begin + count);
        Piece { rings: rings[begin..end].to_vec(), closed: false }
    };
    (0..rings.len() - 1).step_by(count - 1).map(piece).collect()
}

impl Ring {
    /// Direction of vertex `k` from the centreline.
    fn direction(&self, k: usize) -> Vector3<f64> {
        let (sin, cos) = (TAU * k as f64 / SIDES as f64).sin_cos();
        self.side * cos + self.tangent.cross(&self.side) * sin
    }

    fn is_pole(&self) -> bool {
        self.latitude.abs() == FRAC_PI_2
    }

    /// The vertex of `other` that is nearest in direction to the first one of this ring.
    fn shift(&self, other: &Ring) -> usize {
        let side = across(&self.side, &other.tangent);
        let angle = side.dot(&other.tangent.cross(&other.side)).atan2(side.dot(&other.side));
        (angle * SIDES as f64 / TAU).round().rem_euclid(SIDES as f64) as usize
    }
}

/// Rings of a chain in order, with those of rounded ends if it is open. Their sides follow the centreline without turning
/// about it.
fn rings(model: &Model, nodes: &[Node], closed: bool, state: &State) -> Vec<Ring> {
    let mut side = Vector3::zeros();
    let mut rings = Vec::with_capacity(nodes.len() + 4);
    for (k, &node) in nodes.iter().enumerate() {
        let tangent = tangent(&node, state);
        side = across(&side, &tangent);
        let latitudes: &[f64] = match k {
            _ if closed => &[0.0],
            0 => &[-FRAC_PI_2, -FRAC_PI_4, 0.0],
            _ if k + 1 == nodes.len() => &[0.0, FRAC_PI_4, FRAC_PI_2],
            _ => &[0.0],
        };
        let (centre, radius) = (node.position(model, state), node.radius(model));
        rings.extend(latitudes.iter().map(|&latitude| Ring { node, centre, radius, tangent, side, latitude }));
    }
    rings
}

/// The direction of `side` across `tangent`, any such direction if there is none.
fn across(side: &Vector3<f64>, tangent: &Vector3<f64>) -> Vector3<f64> {
    let any = if tangent.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() };
    [*side, any].iter().find_map(|v| (v - tangent * tangent.dot(v)).try_normalize(1e-6)).unwrap_or(any)
}

/// Direction of the centreline at a node: halfway between its segments', or that of the one after in a hairpin.
fn tangent(node: &Node, state: &State) -> Vector3<f64> {
    let axes = [node.after, node.before].map(|segment| segment.map(|i| state.axis(i)));
    let sum: Vector3<f64> = axes.iter().flatten().sum();
    sum.try_normalize(1e-6).or(axes[0]).unwrap_or_else(Vector3::z)
}

/// Writes numbers as glTF has them (section 3.6.2.2).
pub(super) fn write_floats(writer: &mut impl Write, values: impl IntoIterator<Item = f32>) -> io::Result<()> {
    values.into_iter().try_for_each(|value| writer.write_all(&value.to_le_bytes()))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use rod::{Assembly, Material, RodSpec, shape};

    use super::*;

    /// A vertex, as numbers that can be compared: its place [0.1 mm] and the segments that it moves with.
    type Vertex = ([i32; 3], Vec<usize>);

    /// How often each triangle is there, whatever its tube and its first vertex.
    fn triangles(tubes: &[Tube]) -> BTreeMap<[Vertex; 3], usize> {
        let mut found = BTreeMap::new();
        for tube in tubes {
            let vertex = |&index: &u32| {
                let i = index as usize;
                let moving = tube.joints[i].iter().zip(tube.weights[i]).filter(|(_, weight)| *weight > 0.0);
                let segments = moving.map(|(&joint, _)| tube.segments[joint as usize]).collect();
                (tube.positions[i].map(|x| (1e4 * x).round() as i32), segments)
            };
            for corners in tube.indices.as_chunks::<3>().0 {
                let mut corners = corners.each_ref().map(vertex);
                let least = (0..3).min_by_key(|&k| corners[k].clone()).unwrap_or(0);
                corners.rotate_left(least);
                *found.entry(corners).or_default() += 1;
            }
        }
        found
    }

    #[test]
    fn cut_tubes_are_the_whole_one() {
        let material = Material { youngs_modulus: 1e6, torsion_modulus: 1e6, density: 1e3 };
        let mut assembly = Assembly::new(Vector3::zeros());
        let line = |y: f64, segments| shape::straight(Vector3::y() * y, Vector3::x(), 2.0, segments);
        let ring = shape::ring(Vector3::zeros(), 1.0, 11);
        for (nodes, closed) in [(line(2.0, 2), false), (ring, true), (line(3.0, 8), false)] {
            assembly.rod(&RodSpec { closed, twist: 1.0, ..RodSpec::new(nodes, 0.03, material) });
        }
        let (model, state) = assembly.finish();
        let lines = Centrelines::new(&model);
        let whole = Tube::all(&model, &lines, &state, 11);
        assert_eq!(whole.iter().map(|tube| (tube.rod, tube.part)).collect::<Vec<_>>(), [(0, 0), (1, 0), (2, 0)]);
        for most in [3, 4, 5, 8, 10] {
            let tubes = Tube::all(&model, &lines, &state, most);
            assert!(tubes.len() > 3 && tubes.iter().all(|tube| tube.segments.len() <= most), "{most}");
            assert!(triangles(&tubes) == triangles(&whole), "{most}");
        }
    }
}

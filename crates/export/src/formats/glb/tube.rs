//! The rods' surface as a mesh with a skin: round tubes with rounded ends.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};
use std::io::{self, Write};

use nalgebra::Vector3;
use rod::{Model, State};

use super::super::centrelines::{Centrelines, Chain, Node};
use super::write_floats;

/// Vertices of a ring about the centreline.
const SIDES: usize = 8;

/// A mesh: arrays with one entry a vertex, and the vertices of each triangle, counterclockwise from outside.
#[derive(Default)]
pub(super) struct Tube {
    /// Places [m] in the world's axes.
    pub(super) positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    /// The segments that a vertex moves with, and how much with each.
    joints: Vec<[u16; 4]>,
    weights: Vec<[f32; 4]>,
    pub(super) indices: Vec<u32>,
}

/// Vertices about a node.
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

impl Tube {
    /// The surface of all rods in `state`. Vertices between two segments move half with each.
    pub(super) fn new(model: &Model, lines: &Centrelines, state: &State) -> Self {
        let mut tube = Self::default();
        for chain in &lines.chains {
            tube.add(chain, &rings(model, &lines.nodes[chain.nodes.clone()], chain.closed, state));
        }
        tube
    }

    fn add(&mut self, chain: &Chain, rings: &[Ring]) {
        let first = self.positions.len();
        for ring in rings {
            for direction in (0..SIDES).map(|k| ring.direction(k)) {
                let normal = direction * ring.latitude.cos() + ring.tangent * ring.latitude.sin();
                let position = ring.centre + normal * ring.radius;
                self.positions.push(position.map(|x| x as f32).into());
                self.normals.push(normal.map(|x| x as f32).into());
                let (joints, weights) = bones(&ring.node);
                self.joints.push(joints);
                self.weights.push(weights);
            }
        }
        for (k, pair) in rings.windows(2).enumerate() {
            self.join(first + k * SIDES, first + (k + 1) * SIDES, 0, [&pair[0], &pair[1]].map(Ring::is_pole));
        }
        if let (true, [start, .., end]) = (chain.closed, rings) {
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

    /// Writes indices, places, normals, joints and weights.
    pub(super) fn write(&self, writer: &mut impl Write) -> io::Result<()> {
        self.indices.iter().try_for_each(|index| writer.write_all(&index.to_le_bytes()))?;
        write_floats(writer, self.positions.iter().chain(&self.normals).flatten().copied())?;
        self.joints.iter().flatten().try_for_each(|joint| writer.write_all(&joint.to_le_bytes()))?;
        write_floats(writer, self.weights.iter().flatten().copied())
    }
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

/// Segments that the vertices of a node move with, and their weights.
fn bones(node: &Node) -> ([u16; 4], [f32; 4]) {
    match (node.before, node.after) {
        (Some(before), Some(after)) => ([before as u16, after as u16, 0, 0], [0.5, 0.5, 0.0, 0.0]),
        (one, other) => ([one.or(other).unwrap_or_default() as u16, 0, 0, 0], [1.0, 0.0, 0.0, 0.0]),
    }
}

//! Obstacles.

use nalgebra::Vector3;

use super::Draft;
use crate::random::{short, vector};

impl Draft {
    pub(super) fn obstacle(&mut self) {
        let size = self.size;
        let gap = size * self.random.even_log(0.002, 0.3);
        let radius = short(size * self.random.even_log(0.03, 0.2));
        let rods = self.rods.len().max(1) as f64;
        let place = Vector3::new(
            self.random.uniform(-0.2, 1.0) * size,
            self.random.uniform(-0.1, 0.3 * rods) * size,
            self.lowest - gap - radius,
        )
        .map(short);
        let way = self.random.direction();
        let end = (place + way * size * 0.3).map(short);
        self.entry("obstacles");
        let shape = match self.random.whole(0, 7) {
            0..=2 => {
                let tilt = if self.random.chance(0.5) { self.random.vector(0.3) } else { Vector3::zeros() };
                let point = Vector3::new(0.0, 0.0, short(self.lowest - gap));
                format!("plane = {{ point_m = {}, normal = {} }}", vector(point), vector(Vector3::z() + tilt))
            }
            3 => format!("sphere = {{ centre_m = {}, radius_m = {radius:?} }}", vector(place)),
            4 => format!("capsule = {{ start_m = {}, end_m = {}, radius_m = {radius:?} }}", vector(place), vector(end)),
            5 => {
                let sides = [0; 3].map(|_| self.random.uniform(0.05, 0.4) * size).map(short);
                let turn = self.random.vector(60.0);
                format!("box = {{ centre_m = {}, sides_m = {sides:?}, turn_deg = {} }}", vector(place), vector(turn))
            }
            6 => {
                format!("cylinder = {{ start_m = {}, end_m = {}, radius_m = {radius:?} }}", vector(place), vector(end))
            }
            _ => {
                let name = self.file("obj", tetrahedron(1.0));
                let turn = self.random.vector(60.0);
                format!(
                    "mesh = {{ file = \"{name}\", scale = {:?}, position_m = {}, turn_deg = {} }}",
                    2.0 * radius,
                    vector(place),
                    vector(turn)
                )
            }
        };
        self.line("shape", format!("{{ {shape} }}"));
        self.surface();
        if self.random.chance(0.25) {
            self.table("obstacles.motion");
            self.way_of(0.4);
        }
    }
}

/// A tetrahedron about the origin with edges of about this length [m], as an OBJ file.
pub(super) fn tetrahedron(edge: f64) -> String {
    let a = 0.35 * edge;
    let corners = [[a, a, a], [a, -a, -a], [-a, a, -a], [-a, -a, a]];
    let mut text: String = corners.iter().map(|[x, y, z]| format!("v {x:?} {y:?} {z:?}\n")).collect();
    text.push_str("f 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n");
    text
}

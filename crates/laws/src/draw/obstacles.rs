//! Obstacles.

use nalgebra::Vector3;

use super::Draft;
use crate::random::{list, short};

impl Draft {
    pub(super) fn obstacle(&mut self) {
        let size = self.size;
        let gap = size * self.random.even_log(0.001, 0.1);
        let radius = short(size * self.random.even_log(0.03, 0.2));
        let rods = self.rods.len().max(1) as f64;
        let place = Vector3::new(
            self.random.uniform(-0.2, 1.0) * size,
            self.random.uniform(-0.1, 0.3 * rods) * size,
            self.lowest - gap - radius,
        );
        let way = self.random.direction();
        let [place, end] = [place, place + way * size * 0.3].map(|x| list(x.map(short)));
        let shape = match self.random.whole(0, 7) {
            0..=2 => {
                let tilt = if self.random.chance(0.5) { self.random.vector(0.3) } else { Vector3::zeros() };
                let normal = list(Vector3::z() + tilt);
                format!("plane = {{ point_m = [0, 0, {:?}], normal = {normal:?} }}", short(self.lowest - gap))
            }
            3 => format!("sphere = {{ centre_m = {place:?}, radius_m = {radius:?} }}"),
            4 => format!("capsule = {{ start_m = {place:?}, end_m = {end:?}, radius_m = {radius:?} }}"),
            5 => {
                let sides = [0; 3].map(|_| short(self.random.uniform(0.05, 0.4) * size));
                let turn = list(self.random.vector(60.0));
                format!("box = {{ centre_m = {place:?}, sides_m = {sides:?}, turn_deg = {turn:?} }}")
            }
            6 => format!("cylinder = {{ start_m = {place:?}, end_m = {end:?}, radius_m = {radius:?} }}"),
            _ => {
                let (name, turn) = (self.file("obj", tetrahedron(2.0 * radius)), list(self.random.vector(60.0)));
                format!("mesh = {{ file = \"{name}\", position_m = {place:?}, turn_deg = {turn:?} }}")
            }
        };
        put!(self, "\n[[obstacles]]\nshape = {{ {shape} }}");
        self.surface();
        if self.random.chance(0.25) {
            put!(self, "\n[obstacles.motion]");
            self.way_of(0.4);
        }
    }
}

/// A tetrahedron about the origin with edges of about this length [m], as an OBJ file.
pub(super) fn tetrahedron(edge: f64) -> String {
    let a = 0.35 * edge;
    let corners = [[a, a, a], [a, -a, -a], [-a, a, -a], [-a, -a, a]];
    let text: String = corners.iter().map(|[x, y, z]| format!("v {x:?} {y:?} {z:?}\n")).collect();
    text + "f 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n"
}

//! Rods, bodies, nets, trees, crowds and frames.

use std::f64::consts::PI;

use nalgebra::Vector3;

use super::{Draft, Drawn};
use crate::random::{list, number, short, vector};

/// Shape of a rod as the file has it.
struct Shape {
    text: String,
    segments: usize,
    /// Where it begins and ends [m], where that is known.
    ends: Option<[Vector3<f64>; 2]>,
    is_open: bool,
    is_hung: bool,
}

impl Draft {
    /// A place that is likely to be free: rods lie beside each other, and some of them near.
    fn place(&mut self) -> Vector3<f64> {
        let count = self.rods.len() as f64;
        let (y, z) = (self.random.even_log(0.01, 0.3), self.random.uniform(-0.3, 0.3));
        let x = self.random.uniform(-0.3, 0.3);
        Vector3::new(x, count * 0.15 + y, z * 0.5) * self.size
    }

    fn count(&mut self, least: usize, most: usize) -> usize {
        let most = most.min(self.room).max(least);
        let count = self.random.whole(least, most);
        self.room = self.room.saturating_sub(count);
        count
    }

    fn shape(&mut self, start: Option<Vector3<f64>>) -> Shape {
        let (size, has_start) = (self.size, start.is_some());
        let begin = start.unwrap_or_default();
        let at = if has_start { format!("start_m = {}, ", vector(begin)) } else { String::new() };
        let direction = match self.random.whole(0, 3) {
            0 => Vector3::x(),
            1 => -Vector3::z(),
            2 => Vector3::new(self.random.uniform(-1.0, 1.0), 0.0, self.random.uniform(-1.0, 1.0)),
            _ => self.random.direction(),
        };
        let direction = if direction.norm() < 0.1 { Vector3::x() } else { direction };
        let whole = size * self.random.uniform(0.4, 1.0);
        let open = |text: String, segments| Shape { text, segments, ends: None, is_open: true, is_hung: false };
        match self.random.whole(0, 19) {
            0 | 1 => {
                let (segments, winding) = (self.count(6, 24), self.random.uniform(0.5, 2.0));
                let (radius, height) = (short(0.15 * whole), short(0.6 * whole));
                let text = format!(
                    "shape.helix = {{ {at}radius_m = {radius:?}, height_m = {height:?}, winding = {winding:?}, \
                     segments = {segments} }}"
                );
                open(text, segments)
            }
            2 | 3 => {
                let (segments, angle) = (self.count(2, 14), self.random.uniform(20.0, 300.0));
                let radius = short(0.3 * whole);
                let towards = direction.cross(&Vector3::new(0.3, 0.8, 0.51)).map(short);
                let towards = if towards.norm() < 0.1 { Vector3::z() } else { towards };
                let text = format!(
                    "shape.arc = {{ {at}direction = {}, towards = {}, radius_m = {radius:?}, angle_deg = {angle:?}, \
                     segments = {segments} }}",
                    vector(direction),
                    vector(towards)
                );
                open(text, segments)
            }
            4 if has_start => {
                let segments = self.count(6, 16);
                let text = format!(
                    "shape.ring = {{ centre_m = {}, radius_m = {:?}, segments = {segments} }}",
                    vector(begin),
                    short(0.25 * whole)
                );
                Shape { is_open: false, ..open(text, segments) }
            }
            5 => {
                let segments = self.count(2, 8);
                let mut nodes = vec![begin];
                let mut way = direction.normalize();
                for _ in 0..segments {
                    way = (way + self.random.vector(0.4)).normalize();
                    nodes.push(
                        (nodes[nodes.len() - 1] + way * (0.7 * whole / segments as f64))
                            .map(|x| (x * 1e9).round() / 1e9),
                    );
                }
                let ends = has_start.then(|| [nodes[0], nodes[segments]]);
                let text = format!("shape.polyline = {{ nodes_m = {} }}", list(nodes.iter().map(|&node| vector(node))));
                Shape { ends, ..open(text, segments) }
            }
            6 if has_start => {
                let segments = self.count(8, 16);
                let to = begin + Vector3::new(short(0.6 * whole), 0.0, short(0.1 * whole));
                let length = short(0.61 * whole * self.random.uniform(1.05, 1.6));
                let text = format!(
                    "shape.hung = {{ from_m = {}, to_m = {}, length_m = {length:?}, segments = {segments} }}",
                    vector(begin),
                    vector(to)
                );
                Shape { is_hung: true, ..open(text, segments) }
            }
            7 if has_start => {
                let mut text = "x_m,y_m,z_m\n".to_owned();
                let (count, bend) = (self.random.whole(4, 8), self.random.uniform(-0.3, 0.3));
                for k in 0..count {
                    let t = k as f64 / (count - 1) as f64;
                    let place =
                        begin + (direction.normalize() * t + Vector3::new(0.1, bend, 0.2) * (t * t)) * (0.7 * whole);
                    text.push_str(&format!("{:?},{:?},{:?}\n", place.x, place.y, place.z));
                }
                let (segments, name) = (self.count(3, 12), self.file("csv", text));
                open(format!("shape.curve = {{ file = \"{name}\", segments = {segments} }}"), segments)
            }
            8 if self.room >= 60 && self.random.chance(0.3) => {
                self.room = 0;
                let length = short(3.0 * whole);
                let text = format!(
                    "shape.knot = {{ {at}loop_m = {:?}, length_m = {length:?}, segments = 72 }}",
                    short(length / 8.9)
                );
                open(text, 72)
            }
            _ => {
                let segments = self.count(1, 16);
                let length = short(whole);
                let end = (begin + direction.normalize() * length).map(|x| (x * 1e9).round() / 1e9);
                let text = format!(
                    "shape.straight = {{ {at}direction = {}, length_m = {length:?}, segments = {segments} }}",
                    vector(direction)
                );
                Shape { ends: has_start.then_some([begin, end]), ..open(text, segments) }
            }
        }
    }

    /// Sections and materials; gives radius [m] and weight a length [N/m].
    fn material(&mut self, most_radius: f64) -> [f64; 2] {
        let radius = short(most_radius * self.random.even_log(0.2, 1.0));
        let modulus = self.random.even_log(1e5, 1e10);
        let density = self.random.even_log(200.0, 8000.0);
        self.number("youngs_modulus_pa", modulus);
        if self.random.chance(0.4) {
            self.number("torsion_modulus_pa", short(modulus / 2.6));
        }
        self.number("density_kg_m3", density);
        let mut weight = density * PI * radius.powi(2) * 9.81;
        match self.random.whole(0, 11) {
            0 => {
                let end = short(radius * self.random.uniform(0.4, 1.0));
                self.line("radius_m", list([radius, end].map(number)));
            }
            1 => self.line(
                "section",
                format!("{{ tube = {{ outer_radius_m = {radius:?}, inner_radius_m = {:?} }} }}", short(0.8 * radius)),
            ),
            2 => {
                let height = short(radius * self.random.uniform(0.5, 2.0));
                self.line(
                    "section",
                    format!("{{ rectangle = {{ width_m = {:?}, height_m = {height:?} }} }}", 2.0 * radius),
                );
            }
            3 => {
                let height = short(radius * self.random.uniform(0.5, 2.0));
                self.line(
                    "section",
                    format!("{{ ellipse = {{ width_m = {:?}, height_m = {height:?} }} }}", 2.0 * radius),
                );
            }
            4 => {
                let (bending, mass) = (short(modulus * radius.powi(4)), short(weight / 9.81));
                self.number("radius_m", radius);
                let other = short(bending * self.random.uniform(0.5, 2.0));
                self.line(
                    "section",
                    format!("{{ stiffness = {{ bending_n_m2 = [{bending:?}, {other:?}], torsion_n_m2 = {bending:?}, mass_kg_m = {mass:?} }} }}"),
                );
            }
            5 => {
                let until = self.random.uniform(0.2, 0.8);
                self.line(
                    "pieces",
                    format!(
                        "[{{ until = {until:?}, section.tube = {{ outer_radius_m = {radius:?}, inner_radius_m = {:?} }} }}, \
                         {{ section.circle = {{ radius_m = {radius:?} }} }}]",
                        short(0.5 * radius)
                    ),
                );
                weight *= 0.9;
            }
            _ => self.number("radius_m", radius),
        }
        [radius, weight]
    }

    /// What a rod is made of beyond its section.
    fn making(&mut self, shape: &Shape) {
        let is_physical = match self.random.whole(0, 9) {
            0 | 1 => true,
            2 => {
                let compliance = self.random.even_log(1e-9, 1e-5);
                self.line("stretch", format!("{{ compliance_m_per_n = {compliance:?} }}"));
                false
            }
            _ => false,
        };
        if is_physical {
            // Sections given by their stiffness alone know no stretch of their own.
            if self.text.rsplit("[[rods]]").next().is_some_and(|rod| rod.contains("stiffness")) {
                return;
            }
            self.line("stretch", "\"physical\"");
            if self.random.chance(0.3) && !shape.is_hung {
                let strain = self.random.uniform(-0.03, 0.1);
                self.number("strain", strain);
            }
        }
        if self.random.chance(0.15) {
            let times = [0; 3].map(|_| self.random.even_log(1e-4, 0.1));
            let [bending, twist, stretch] = times.map(number);
            let stretch = if is_physical { format!(", stretch_s = {stretch}") } else { String::new() };
            self.line("inner_damping", format!("{{ bending_s = {bending}, twist_s = {twist}{stretch} }}"));
        }
        match self.random.whole(0, 9) {
            0 | 1 => self.line("rest", "\"straight\""),
            2 => {
                let darboux = self.random.vector(0.5 / self.size);
                self.line("rest", format!("{{ darboux_per_m = {} }}", vector(darboux)));
            }
            _ => {}
        }
        if shape.is_open && shape.segments > 2 && self.random.chance(0.15) {
            let twist = self.random.uniform(-40.0, 40.0) * (shape.segments - 1) as f64;
            self.number("twist_deg", short(twist));
        }
    }

    fn name(&mut self) -> String {
        format!("r{}", self.rods.len())
    }

    pub(super) fn rod(&mut self) {
        if self.room < 2 {
            return;
        }
        let parent = self.rods.last().filter(|rod| rod.is_one).map(|rod| (rod.name.clone(), rod.segments, rod.radius));
        let parent = parent.filter(|_| self.random.chance(0.25));
        let start = match parent {
            Some(_) => None,
            None => Some(self.place()),
        };
        self.entry("rods");
        let name = self.name();
        self.line("name", format!("\"{name}\""));
        let shape = self.shape(start);
        self.text.push_str(&shape.text);
        self.text.push('\n');
        let most = 0.05 * self.size;
        let [radius, weight] = self.material(parent.as_ref().map_or(most, |parent| most.min(parent.2)));
        self.making(&shape);
        if let Some((parent, segments, _)) = &parent {
            let (segment, fraction) = (self.random.whole(0, segments - 1), self.random.pick(&[1.0, 1.0, 0.5, 0.3]));
            self.line("branch_of", format!("{{ rod = \"{parent}\", segment = {segment}, fraction = {fraction:?} }}"));
            let joint = self.random.pick(&["rigid", "rigid", "ball", "hinge"]);
            if joint != "rigid" {
                self.line("branch_joint", format!("\"{joint}\""));
            }
        }
        let is_one = parent.is_none();
        let is_open = shape.is_open;
        self.motion_at_first(&shape);
        if is_open {
            self.hold(&shape.segments, shape.is_hung, parent.is_some());
            self.load(weight * 0.7 * self.size);
        }
        if self.random.chance(0.1) {
            let mass = short(weight / 9.81 * self.size * self.random.uniform(0.0, 5.0));
            self.entry("rods.masses");
            self.line("segment", -1);
            self.number("mass_kg", mass);
        }
        let ends = shape.ends;
        self.lowest = self.lowest.min(ends.map_or(-0.3 * self.size, |[a, b]| a.z.min(b.z)));
        self.rods.push(Drawn { name, segments: shape.segments, ends, radius, is_open, is_one });
    }

    /// First velocities.
    fn motion_at_first(&mut self, shape: &Shape) {
        let speed = (self.size * 10.0).sqrt() * self.random.even_log(0.01, 1.0);
        if self.random.chance(0.3) {
            let velocity = self.random.direction() * speed;
            self.line("velocity_m_s", vector(velocity.map(short)));
        }
        if self.random.chance(0.15) {
            let spin = self.random.direction() * (speed / self.size);
            self.line("angular_velocity_rad_s", vector(spin.map(short)));
        }
        if shape.segments > 1 && self.random.chance(0.05) {
            let velocity = self.random.direction() * speed;
            self.line("velocities", format!("[{{ segment = -1, velocity_m_s = {} }}]", vector(velocity.map(short))));
        }
    }

    fn load(&mut self, weight: f64) {
        if !self.random.chance(0.2) {
            return;
        }
        self.entry("rods.loads");
        if self.random.chance(0.6) {
            self.line("at", "\"end-face\"");
        } else {
            self.line("segment", -1);
            let fraction = self.random.uniform(0.0, 1.0);
            self.number("fraction", fraction);
        }
        let force = (self.random.direction() * weight * self.random.even_log(0.1, 5.0)).map(short);
        if self.random.chance(0.3) {
            let times = list([0.0, self.end()].map(number));
            self.line("times_s", times);
            self.line("forces_n", list([vector(Vector3::zeros()), vector(force)]));
            let interpolation = self.random.pick(&["held", "linear", "smooth"]);
            self.line("interpolation", format!("\"{interpolation}\""));
            return;
        }
        self.line("force_n", vector(force));
        if self.random.chance(0.3) {
            let torque = (self.random.direction() * weight * self.size * 0.02).map(short);
            self.line("torque_n_m", vector(torque));
        }
    }

    /// A rigid body, at a rod's end or by itself.
    pub(super) fn body(&mut self) {
        let size = short(self.size * self.random.even_log(0.02, 0.12));
        let end = self.rods.last().filter(|rod| rod.is_one && rod.is_open);
        let end = end.and_then(|rod| Some((rod.name.clone(), rod.ends?)));
        let way = self.random.direction();
        let (place, rod) = match &end {
            Some((name, [_, end])) if self.random.chance(0.75) => (end + way * (0.8 * size), Some(name.clone())),
            _ => (Vector3::new(0.5 * self.size, -0.35 * self.size, 0.3 * self.size), None),
        };
        self.entry("bodies");
        self.line("name", "\"body\"");
        let shape = match self.random.whole(0, 5) {
            0 | 1 => format!("shape.sphere = {{ radius_m = {size:?} }}"),
            2 => format!("shape.capsule = {{ radius_m = {:?}, length_m = {size:?} }}", short(0.5 * size)),
            3 => format!("shape.cylinder = {{ radius_m = {:?}, length_m = {size:?} }}", short(0.5 * size)),
            4 => format!("shape.box = {{ sides_m = [{size:?}, {:?}, {:?}] }}", short(0.7 * size), short(1.3 * size)),
            _ => {
                let file = self.file("obj", super::obstacles::tetrahedron(size));
                format!("shape.mesh = {{ file = \"{file}\" }}")
            }
        };
        self.text.push_str(&shape);
        self.text.push('\n');
        let density = self.random.even_log(200.0, 8000.0);
        self.number("density_kg_m3", density);
        self.line("position_m", vector(place.map(|x| (x * 1e9).round() / 1e9)));
        if self.random.chance(0.4) {
            let turn = self.random.vector(90.0);
            self.line("turn_deg", vector(turn));
        }
        if self.random.chance(0.3) {
            let speed = (self.size * 10.0).sqrt() * self.random.even_log(0.01, 0.5);
            let velocity = (self.random.direction() * speed).map(short);
            let spin = (self.random.direction() * speed / self.size * 3.0).map(short);
            self.line("velocity_m_s", vector(velocity));
            self.line("angular_velocity_rad_s", vector(spin));
        }
        if let Some(rod) = rod {
            let joint = format!("\n[[joins]]\na = {{ rod = \"{rod}\" }}\nb = {{ body = \"body\" }}\n");
            self.text.push_str(&joint);
        }
    }

    pub(super) fn net(&mut self) {
        let (x, y) = (self.random.whole(1, 3), self.random.whole(1, 3));
        let side = short(0.2 * self.size);
        let is_woven = self.touches && self.random.chance(0.4);
        let radius = short(side * self.random.even_log(0.01, 0.05));
        self.entry("nets");
        self.line("name", "\"net\"");
        self.line("size_m", format!("[{:?}, {:?}]", side * x as f64, side * y as f64));
        self.line("meshes", format!("[{x}, {y}]"));
        self.line("segments", if is_woven { 2 } else { 1 });
        self.line("woven", is_woven);
        self.number("radius_m", radius);
        let modulus = self.random.even_log(1e5, 1e9);
        self.number("youngs_modulus_pa", modulus);
        self.lowest = -2.0 * radius;
        self.rods.push(Drawn { name: "net".into(), segments: 99, ends: None, radius, is_open: false, is_one: false });
    }

    pub(super) fn tree(&mut self) {
        self.entry("rods");
        self.line("name", "\"r0\"");
        let (length, segments) = (short(0.5 * self.size), self.random.whole(3, 6));
        self.text.push_str(&format!(
            "shape.straight = {{ direction = [0, 0, 1], length_m = {length:?}, segments = {segments} }}\n"
        ));
        let [radius, _] = self.material(0.03 * self.size);
        self.line("clamp", "[\"start-face\"]");
        let (branches, levels, seed) = (self.random.whole(2, 6), self.random.whole(1, 2), self.random.whole(0, 99));
        self.line("tree", format!("{{ branches = {branches}, levels = {levels}, segments = 3, seed = {seed} }}"));
        let name = "r0".to_owned();
        self.rods.push(Drawn { name, segments, ends: None, radius, is_open: true, is_one: false });
    }

    /// A heap, or strands on a ball.
    pub(super) fn crowd(&mut self, count: usize) {
        let segments = (self.room / count).clamp(2, 12);
        let length = short(self.size * self.random.uniform(0.3, 1.0));
        self.entry("rods");
        self.line("name", "\"r0\"");
        self.text.push_str(&format!("shape.straight = {{ length_m = {length:?}, segments = {segments} }}\n"));
        let [radius, _] = self.material(0.02 * self.size);
        if self.random.chance(0.5) {
            let spacing = short(radius * self.random.uniform(2.1, 6.0));
            let seed = self.random.whole(0, 99);
            self.line("heap", format!("{{ count = {count}, spacing_m = {spacing:?}, seed = {seed} }}"));
        } else {
            self.line("clamp", "[\"start-segment\"]");
            let (ball, seed) = (short(0.5 * self.size), self.random.whole(0, 99));
            self.line(
                "strands",
                format!(
                    "{{ count = {count}, on = {{ radius_m = {ball:?} }}, gap_m = {:?}, seed = {seed} }}",
                    short(0.01 * self.size)
                ),
            );
        }
        self.lowest = -self.size;
        let name = "r0".to_owned();
        self.rods.push(Drawn { name, segments, ends: None, radius, is_open: true, is_one: false });
    }

    /// Two rods joined at both ends: a loop.
    pub(super) fn frame(&mut self) {
        let start = self.place();
        let (length, segments) = (short(0.6 * self.size), self.count(2, 8));
        let end = start + Vector3::x() * length;
        self.entry("rods");
        self.line("name", "\"r0\"");
        self.text.push_str(&format!(
            "shape.straight = {{ start_m = {}, length_m = {length:?}, segments = {segments} }}\n",
            vector(start)
        ));
        let [radius, _] = self.material(0.02 * self.size);
        self.hold(&segments, false, false);
        self.entry("rods");
        self.line("name", "\"r1\"");
        let apex = start + Vector3::new(0.3, 0.25, 0.2) * self.size;
        let nodes = [end, 0.5 * (end + apex), apex, 0.5 * (start + apex), start];
        self.text.push_str(&format!("shape.polyline = {{ nodes_m = {} }}\n", list(nodes.map(vector))));
        self.material(0.02 * self.size);
        let joints = ["rigid", "ball", "hinge"];
        for (a, b) in [
            ("segment = -1, fraction = 1", "segment = 0, fraction = 0"),
            ("segment = 0, fraction = 0", "segment = -1, fraction = 1"),
        ] {
            let joint = self.random.pick(&joints);
            self.text.push_str(&format!(
                "\n[[joins]]\na = {{ rod = \"r0\", {a} }}\nb = {{ rod = \"r1\", {b} }}\njoint = \"{joint}\"\n"
            ));
        }
        self.lowest = start.z;
        self.rods.push(Drawn {
            name: "r0".into(),
            segments,
            ends: Some([start, end]),
            radius,
            is_open: true,
            is_one: false,
        });
    }
}

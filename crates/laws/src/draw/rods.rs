//! Rods, bodies, nets, trees, crowds and frames.

use std::f64::consts::PI;

use nalgebra::Vector3;

use super::obstacles::tetrahedron;
use super::{Draft, Drawn};
use crate::random::{list, short};

/// Shape of a rod as the file has it.
struct Shape {
    text: String,
    segments: usize,
    /// Where it begins and ends [m], where that is known.
    ends: Option<[Vector3<f64>; 2]>,
    is_open: bool,
    is_hung: bool,
}

/// To a nanometre.
fn even(x: Vector3<f64>) -> Vector3<f64> {
    x.map(|x| (x * 1e9).round() / 1e9)
}

impl Draft {
    /// A place that is likely to be free: rods lie beside each other, and some of them near.
    fn place(&mut self) -> Vector3<f64> {
        let count = self.rods.len() as f64;
        let (y, z) = (self.random.even_log(0.01, 0.3), self.random.uniform(-0.15, 0.15));
        Vector3::new(self.random.uniform(-0.3, 0.3), count * 0.1 + y, z) * self.size
    }

    fn count(&mut self, least: usize, most: usize) -> usize {
        let count = self.random.whole(least, most.min(self.room).max(least));
        self.room = self.room.saturating_sub(count);
        count
    }

    /// The name of the next rod, which begins with it.
    fn begin(&mut self) -> String {
        let name = format!("r{}", self.rods.len());
        put!(self, "\n[[rods]]\nname = \"{name}\"");
        name
    }

    fn shape(&mut self, start: Option<Vector3<f64>>) -> Shape {
        let (has_start, begin) = (start.is_some(), start.unwrap_or_default());
        let from = list(begin);
        let at = if has_start { format!("start_m = {from:?}, ") } else { String::new() };
        let direction = match self.random.whole(0, 3) {
            0 => Vector3::x(),
            1 => -Vector3::z(),
            2 => Vector3::new(self.random.uniform(-1.0, 1.0), 0.0, self.random.uniform(-1.0, 1.0)),
            _ => self.random.direction(),
        };
        let direction = if direction.norm() < 0.1 { Vector3::x() } else { direction };
        let (way, along) = (direction.normalize(), list(direction));
        let whole = self.size * self.random.uniform(0.4, 1.0);
        let (mut ends, mut is_open, mut is_hung) = (None, true, false);
        let (mut text, segments) = match self.random.whole(0, 19) {
            0 | 1 => {
                let (segments, winding) = (self.count(6, 24), self.random.uniform(0.5, 2.0));
                let (radius, height) = (short(0.15 * whole), short(0.6 * whole));
                let text =
                    format!("helix = {{ {at}radius_m = {radius:?}, height_m = {height:?}, winding = {winding:?}");
                (text, segments)
            }
            2 | 3 => {
                let (segments, angle) = (self.count(2, 14), self.random.uniform(20.0, 300.0));
                let towards = direction.cross(&Vector3::new(0.3, 0.8, 0.51)).map(short);
                let towards = list(if towards.norm() < 0.1 { Vector3::z() } else { towards });
                let radius = short(0.3 * whole);
                let bend = format!(
                    "direction = {along:?}, towards = {towards:?}, radius_m = {radius:?}, angle_deg = {angle:?}"
                );
                (format!("arc = {{ {at}{bend}"), segments)
            }
            4 if has_start => {
                is_open = false;
                let text = format!("ring = {{ centre_m = {from:?}, radius_m = {:?}", short(0.25 * whole));
                (text, self.count(6, 16))
            }
            5 => {
                let segments = self.count(2, 8);
                let (mut nodes, mut way) = (vec![begin], way);
                for k in 0..segments {
                    way = (way + self.random.vector(0.4)).normalize();
                    nodes.push(even(nodes[k] + way * (0.7 * whole / segments as f64)));
                }
                ends = has_start.then(|| [nodes[0], nodes[segments]]);
                let nodes: Vec<_> = nodes.into_iter().map(list).collect();
                (format!("polyline = {{ nodes_m = {nodes:?}"), segments)
            }
            6 if has_start => {
                is_hung = true;
                let segments = self.count(8, 16);
                let to = list(begin + Vector3::new(short(0.6 * whole), 0.0, short(0.1 * whole)));
                let length = short(0.61 * whole * self.random.uniform(1.05, 1.6));
                (format!("hung = {{ from_m = {from:?}, to_m = {to:?}, length_m = {length:?}"), segments)
            }
            7 if has_start => {
                let (count, bend) = (self.random.whole(4, 8), self.random.uniform(-0.3, 0.3));
                let place = |k: usize| {
                    let t = k as f64 / (count - 1) as f64;
                    let [x, y, z] = list(begin + (way * t + Vector3::new(0.1, bend, 0.2) * (t * t)) * (0.7 * whole));
                    format!("{x:?},{y:?},{z:?}\n")
                };
                let text = (0..count).map(place).fold("x_m,y_m,z_m\n".to_owned(), |all, line| all + &line);
                let (segments, name) = (self.count(3, 12), self.file("csv", text));
                (format!("curve = {{ file = \"{name}\""), segments)
            }
            8 if self.room >= 60 && self.random.chance(0.3) => {
                self.room = 0;
                let length = short(3.0 * whole);
                (format!("knot = {{ {at}loop_m = {:?}, length_m = {length:?}", short(length / 8.9)), 72)
            }
            _ => {
                let (segments, length) = (self.count(1, 16), short(whole));
                ends = has_start.then(|| [begin, even(begin + way * length)]);
                (format!("straight = {{ {at}direction = {along:?}, length_m = {length:?}"), segments)
            }
        };
        if !text.starts_with("polyline") {
            text += &format!(", segments = {segments}");
        }
        Shape { text: format!("shape.{text} }}"), segments, ends, is_open, is_hung }
    }

    /// Sections and materials; gives radius [m] and weight a length [N/m].
    fn material(&mut self, most_radius: f64) -> [f64; 2] {
        let radius = short(most_radius * self.random.even_log(0.2, 1.0));
        let modulus = self.random.even_log(1e5, 1e10);
        let density = self.random.even_log(200.0, 8000.0);
        let (has_torsion, which) = (self.random.chance(0.4), self.random.whole(0, 11));
        // A stiffness says all of it.
        if which != 4 {
            put!(self, "youngs_modulus_pa = {modulus:?}\ndensity_kg_m3 = {density:?}");
            if has_torsion {
                put!(self, "torsion_modulus_pa = {:?}", short(modulus / 2.6));
            }
        }
        let mut weight = density * PI * radius.powi(2) * 9.81;
        let tube = |share: f64| {
            format!("tube = {{ outer_radius_m = {radius:?}, inner_radius_m = {:?} }}", short(share * radius))
        };
        match which {
            0 => put!(self, "radius_m = [{radius:?}, {:?}]", short(radius * self.random.uniform(0.4, 1.0))),
            1 => put!(self, "section.{}", tube(0.8)),
            2 | 3 => {
                let height = short(radius * self.random.uniform(0.5, 2.0));
                let shape = if which == 2 { "rectangle" } else { "ellipse" };
                put!(self, "section.{shape} = {{ width_m = {:?}, height_m = {height:?} }}", 2.0 * radius);
            }
            4 => {
                let (bending, mass) = (short(modulus * radius.powi(4)), short(weight / 9.81));
                let other = short(bending * self.random.uniform(0.5, 2.0));
                let numbers = format!(
                    "bending_n_m2 = [{bending:?}, {other:?}], torsion_n_m2 = {bending:?}, mass_kg_m = {mass:?}"
                );
                put!(self, "radius_m = {radius:?}\nsection.stiffness = {{ {numbers} }}");
            }
            5 => {
                let (until, circle) = (self.random.uniform(0.2, 0.8), format!("circle = {{ radius_m = {radius:?} }}"));
                let tube = tube(0.5);
                put!(self, "pieces = [{{ until = {until:?}, section.{tube} }}, {{ section.{circle} }}]");
                weight *= 0.9;
            }
            _ => put!(self, "radius_m = {radius:?}"),
        }
        [radius, weight]
    }

    /// What a rod is made of beyond its section.
    fn making(&mut self, shape: &Shape) {
        let mut is_physical = false;
        match self.random.whole(0, 9) {
            0 | 1 => {
                // Sections given by their stiffness alone know no stretch of their own.
                if self.text.rsplit("[[rods]]").next().is_some_and(|rod| rod.contains("stiffness")) {
                    return;
                }
                is_physical = true;
                put!(self, "stretch = \"physical\"");
                if self.random.chance(0.3) && !shape.is_hung {
                    put!(self, "strain = {:?}", self.random.uniform(-0.03, 0.1));
                }
            }
            2 => put!(self, "stretch = {{ compliance_m_per_n = {:?} }}", self.random.even_log(1e-9, 1e-5)),
            _ => {}
        }
        if self.random.chance(0.15) {
            let [bending, twist, stretch] = [0; 3].map(|_| self.random.even_log(1e-4, 0.1));
            let stretch = if is_physical { format!(", stretch_s = {stretch:?}") } else { String::new() };
            put!(self, "inner_damping = {{ bending_s = {bending:?}, twist_s = {twist:?}{stretch} }}");
        }
        match self.random.whole(0, 9) {
            _ if shape.segments > 1 && self.driven.chance(0.1) => self.rest_over_time(),
            0 | 1 => put!(self, "rest = \"straight\""),
            2 => put!(self, "rest = {{ darboux_per_m = {:?} }}", list(self.random.vector(0.5 / self.size))),
            _ => {}
        }
        if shape.is_open && shape.segments > 2 && self.random.chance(0.15) {
            put!(self, "twist_deg = {:?}", short(self.random.uniform(-40.0, 40.0) * (shape.segments - 1) as f64));
        }
    }

    /// Joints that are not elastic, which yield or slip under a share of the moment of the rod's own weight, or many times it.
    fn law(&mut self, weight: f64) {
        if !self.is_newton || !self.added.chance(0.2) {
            return;
        }
        let moment = short(weight * self.size * self.size * self.added.even_log(0.01, 10.0));
        match self.added.whole(0, 3) {
            0 => {
                let torque = short(moment * self.added.uniform(0.5, 1.5));
                let [isotropic, kinematic] =
                    [0; 2].map(|_| if self.added.chance(0.4) { 0.0 } else { self.added.even_log(1e-3, 1.0) });
                let hardening = format!("hardening_isotropic = {isotropic:?}, hardening_kinematic = {kinematic:?}");
                put!(self, "yield = {{ moment_n_m = {moment:?}, torque_n_m = {torque:?}, {hardening} }}");
            }
            1 => {
                let stiffness = short(moment * self.size * self.added.even_log(0.1, 10.0));
                put!(self, "strand_friction = {{ moment_n_m = {moment:?}, stiffness_n_m2 = {stiffness:?} }}");
            }
            2 => {
                let (bent, share) = (self.added.even_log(0.1, 10.0) / self.size, self.added.even_log(0.01, 0.9));
                let curvatures = [short(bent), short(3.0 * bent)];
                let moments = [short(moment), short(moment * (1.0 + 2.0 * share))];
                let unloading = if self.added.chance(0.5) { "masing" } else { "elastic" };
                put!(
                    self,
                    "moment_table = {{ curvatures_per_m = {curvatures:?}, moments_n_m = {moments:?}, unloading = \"{unloading}\" }}"
                );
            }
            _ => {
                let branches = (0..self.added.whole(1, 3)).map(|_| {
                    let (share, time) = (self.added.uniform(0.02, 0.3), self.added.even_log(0.1, 1000.0) * self.dt);
                    format!("{{ share = {share:?}, time_s = {:?} }}", short(time))
                });
                let branches: Vec<String> = branches.collect();
                put!(self, "relaxation = [{}]", branches.join(", "));
            }
        }
    }

    /// Joints that can break, at a share of what the rod's own weight asks of them, or at many times it.
    fn strength(&mut self, weight: f64) {
        if !self.is_newton || !self.added.chance(0.12) {
            return;
        }
        let mut times = || self.added.even_log(0.1, 100.0);
        let force = weight * self.size;
        let (tension, moment, curvature) = (force * times(), force * self.size * times(), 0.1 * times() / self.size);
        let key = match self.added.whole(0, 2) {
            0 => format!("tension_n = {:?}", short(tension)),
            1 => format!("moment_n_m = {:?}", short(moment)),
            _ => format!("curvature_per_m = {:?}", short(curvature)),
        };
        put!(self, "strength = {{ {key} }}");
    }

    pub(super) fn rod(&mut self) {
        if self.room < 2 {
            return;
        }
        let parent = self.rods.last().filter(|rod| rod.is_one).map(|rod| (rod.name.clone(), rod.segments, rod.radius));
        let parent = parent.filter(|_| self.random.chance(0.25));
        let start = if parent.is_some() { None } else { Some(self.place()) };
        let name = self.begin();
        let shape = self.shape(start);
        put!(self, "{}", shape.text);
        let most = 0.05 * self.size;
        let [radius, weight] = self.material(parent.as_ref().map_or(most, |parent| most.min(parent.2)));
        self.making(&shape);
        self.law(weight);
        self.strength(weight);
        if let Some((parent, segments, _)) = &parent {
            let (segment, fraction) = (self.random.whole(0, segments - 1), self.random.pick(&[1.0, 1.0, 0.5, 0.3]));
            put!(self, "branch_of = {{ rod = \"{parent}\", segment = {segment}, fraction = {fraction:?} }}");
            let joint = self.random.pick(&["rigid", "rigid", "ball", "hinge"]);
            put!(self, "branch_joint = \"{joint}\"");
            if joint == "hinge" && self.driven.chance(0.4) {
                let torque = weight * self.size * self.size * self.driven.even_log(0.01, 1.0);
                put!(self, "branch_motor.torque_n_m = {:?}", short(torque));
            }
        }
        self.motion_at_first(&shape);
        if shape.is_hung {
            put!(self, "clamp = [\"start-face\", \"end-face\"]");
        } else if shape.is_open {
            self.hold(shape.segments, parent.is_some());
        }
        if shape.is_open {
            self.load(weight * 0.7 * self.size);
        }
        self.foundation(weight);
        if self.random.chance(0.1) {
            let mass = short(weight / 9.81 * self.size * self.random.uniform(0.0, 5.0));
            put!(self, "\n[[rods.masses]]\nsegment = -1\nmass_kg = {mass:?}");
        }
        let Shape { segments, ends, is_open, .. } = shape;
        self.lowest = self.lowest.min(ends.map_or(-0.3 * self.size, |[a, b]| a.z.min(b.z)));
        self.rods.push(Drawn { name, segments, ends, radius, is_open, is_one: parent.is_none() });
    }

    /// A velocity up to this speed, even in its logarithm.
    fn velocity(&mut self, most: f64) -> [f64; 3] {
        let speed = most * self.random.even_log(0.01, 1.0);
        list((self.random.direction() * speed).map(short))
    }

    /// First velocities.
    fn motion_at_first(&mut self, shape: &Shape) {
        let speed = (self.size * 10.0).sqrt();
        if self.random.chance(0.3) {
            put!(self, "velocity_m_s = {:?}", self.velocity(speed));
        }
        if self.random.chance(0.15) {
            put!(self, "angular_velocity_rad_s = {:?}", self.velocity(speed / self.size));
        }
        if shape.segments > 1 && self.random.chance(0.05) {
            put!(self, "velocities = [{{ segment = -1, velocity_m_s = {:?} }}]", self.velocity(speed));
        }
    }

    fn load(&mut self, weight: f64) {
        if !self.random.chance(0.2) {
            return;
        }
        put!(self, "\n[[rods.loads]]");
        if self.random.chance(0.6) {
            put!(self, "at = \"end-face\"");
        } else {
            put!(self, "segment = -1\nfraction = {:?}", self.random.uniform(0.0, 1.0));
        }
        let force = list((self.random.direction() * weight * self.random.even_log(0.1, 5.0)).map(short));
        if self.random.chance(0.3) {
            put!(self, "times_s = [0, {:?}]\nforces_n = [[0, 0, 0], {force:?}]", self.end());
            put!(self, "interpolation = \"{}\"", self.random.pick(&["held", "linear", "smooth"]));
            return;
        }
        put!(self, "force_n = {force:?}");
        if self.driven.chance(0.2) {
            put!(self, "follows = true");
        }
        if self.random.chance(0.3) {
            let torque = self.random.direction() * weight * self.size * 0.02;
            put!(self, "torque_n_m = {:?}", list(torque.map(short)));
        }
    }

    /// A rest shape that changes within the run, once or over and over.
    fn rest_over_time(&mut self) {
        let (most, end) = (0.5 / self.size, self.end());
        let [first, second] = [0; 2].map(|_| list(self.driven.vector(most)));
        let period = short(end * self.driven.even_log(0.2, 1.0));
        let how = self.driven.pick(&["held", "linear", "smooth"]);
        put!(
            self,
            "rest_over_time = {{ times_s = [0, {:?}, {period:?}], darboux_per_m = [{first:?}, {second:?}, {first:?}], \
             interpolation = \"{how}\", repeats = {} }}",
            short(0.4 * period),
            self.driven.chance(0.5)
        );
    }

    /// Springs along a part of a rod, which bear its weight on a way of a hundredth of the scene's size, or more, or less.
    fn foundation(&mut self, weight: f64) {
        if !self.driven.chance(0.08) {
            return;
        }
        let [across, along] = [0; 2].map(|_| short(weight / (0.01 * self.driven.even_log(0.01, 100.0))));
        put!(self, "\n[[rods.foundations]]\nacross_n_m2 = {across:?}\nalong_n_m2 = {along:?}");
        if self.driven.chance(0.5) {
            put!(self, "damping_s = {:?}", short(self.dt * self.driven.even_log(0.1, 10.0)));
        }
        if self.driven.chance(0.3) {
            put!(self, "until = 0.6");
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
            _ => (Vector3::new(0.5, -0.35, 0.3) * self.size, None),
        };
        let [half, less, more] = [0.5, 0.7, 1.3].map(|share| short(share * size));
        let shape = match self.random.whole(0, 5) {
            0 | 1 => format!("sphere = {{ radius_m = {size:?} }}"),
            2 => format!("capsule = {{ radius_m = {half:?}, length_m = {size:?} }}"),
            3 => format!("cylinder = {{ radius_m = {half:?}, length_m = {size:?} }}"),
            4 => format!("box = {{ sides_m = [{size:?}, {less:?}, {more:?}] }}"),
            _ => format!("mesh = {{ file = \"{}\" }}", self.file("obj", tetrahedron(size))),
        };
        put!(self, "\n[[bodies]]\nname = \"body\"\nshape.{shape}\nposition_m = {:?}", list(even(place)));
        put!(self, "density_kg_m3 = {:?}", self.random.even_log(200.0, 8000.0));
        if self.random.chance(0.4) {
            put!(self, "turn_deg = {:?}", list(self.random.vector(90.0)));
        }
        if self.random.chance(0.3) {
            let speed = 0.5 * (self.size * 10.0).sqrt();
            put!(self, "velocity_m_s = {:?}", self.velocity(speed));
            put!(self, "angular_velocity_rad_s = {:?}", self.velocity(3.0 * speed / self.size));
        }
        if let Some(rod) = rod {
            put!(self, "\n[[joins]]\na = {{ rod = \"{rod}\" }}\nb = {{ body = \"body\" }}");
        }
    }

    /// Notes what nothing but its name is known of.
    fn note(&mut self, name: &str, segments: usize, radius: f64, lowest: f64) {
        self.lowest = lowest;
        self.rods.push(Drawn { name: name.into(), segments, ends: None, radius, is_open: false, is_one: false });
    }

    pub(super) fn net(&mut self) {
        let meshes = [0; 2].map(|_| self.random.whole(1, 3));
        let side = short(0.2 * self.size);
        let is_woven = self.touches && self.random.chance(0.4);
        let radius = short(side * self.random.even_log(0.01, 0.05));
        let (size, segments) = (meshes.map(|count| side * count as f64), if is_woven { 2 } else { 1 });
        put!(self, "\n[[nets]]\nname = \"net\"\nsize_m = {size:?}\nmeshes = {meshes:?}\nsegments = {segments}");
        put!(self, "woven = {is_woven}\nradius_m = {radius:?}");
        put!(self, "youngs_modulus_pa = {:?}", self.random.even_log(1e5, 1e9));
        self.note("net", 99, radius, -2.0 * radius);
    }

    pub(super) fn tree(&mut self) {
        let name = self.begin();
        let (length, segments) = (short(0.5 * self.size), self.random.whole(3, 6));
        put!(self, "shape.straight = {{ direction = [0, 0, 1], length_m = {length:?}, segments = {segments} }}");
        let [radius, _] = self.material(0.03 * self.size);
        let (branches, levels, seed) = (self.random.whole(2, 6), self.random.whole(1, 2), self.random.whole(0, 99));
        put!(self, "clamp = [\"start-face\"]");
        put!(self, "tree = {{ branches = {branches}, levels = {levels}, segments = 3, seed = {seed} }}");
        self.note(&name, segments, radius, self.lowest);
    }

    /// A heap, or strands on a ball.
    pub(super) fn crowd(&mut self, count: usize) {
        let name = self.begin();
        let segments = (self.room / count).clamp(2, 12);
        let length = short(self.size * self.random.uniform(0.3, 1.0));
        put!(self, "shape.straight = {{ length_m = {length:?}, segments = {segments} }}");
        let [radius, _] = self.material(0.02 * self.size);
        if self.random.chance(0.5) {
            let (spacing, seed) = (short(radius * self.random.uniform(2.1, 6.0)), self.random.whole(0, 99));
            put!(self, "heap = {{ count = {count}, spacing_m = {spacing:?}, seed = {seed} }}");
        } else {
            let (ball, gap, seed) = (short(0.5 * self.size), short(0.01 * self.size), self.random.whole(0, 99));
            put!(self, "clamp = [\"start-segment\"]");
            put!(
                self,
                "strands = {{ count = {count}, on = {{ radius_m = {ball:?} }}, gap_m = {gap:?}, seed = {seed} }}"
            );
        }
        self.note(&name, segments, radius, -self.size);
    }

    /// Two rods joined at both ends: a loop.
    pub(super) fn frame(&mut self) {
        let start = self.place();
        let (length, segments) = (short(0.6 * self.size), self.count(2, 8));
        let end = start + Vector3::x() * length;
        self.begin();
        put!(self, "shape.straight = {{ start_m = {:?}, length_m = {length:?}, segments = {segments} }}", list(start));
        let [radius, _] = self.material(0.02 * self.size);
        self.hold(segments, false);
        let apex = start + Vector3::new(0.3, 0.25, 0.2) * self.size;
        let nodes = [end, 0.5 * (end + apex), apex, 0.5 * (start + apex), start].map(list);
        put!(self, "\n[[rods]]\nname = \"other\"\nshape.polyline = {{ nodes_m = {nodes:?} }}");
        self.material(0.02 * self.size);
        let [first, last] = ["segment = 0, fraction = 0", "segment = -1, fraction = 1"];
        for (a, b) in [(last, first), (first, last)] {
            let joint = self.random.pick(&["rigid", "ball", "hinge"]);
            put!(self, "\n[[joins]]\na = {{ rod = \"r0\", {a} }}\nb = {{ rod = \"other\", {b} }}\njoint = \"{joint}\"");
        }
        let (name, ends) = ("r0".to_owned(), Some([start, end]));
        self.lowest = start.z;
        self.rods.push(Drawn { name, segments, ends, radius, is_open: true, is_one: false });
    }
}

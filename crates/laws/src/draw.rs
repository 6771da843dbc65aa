//! Scenes at random: features of `docs/scenes.md`, combined.

/// Appends a line to a draft's text.
macro_rules! put {
    ($draft:expr, $($text:tt)*) => {{
        let line = format!($($text)*);
        $draft.text.push_str(&line);
        $draft.text.push('\n');
    }};
}

mod held;
mod obstacles;
mod rods;

use cosserat::simulation::{Formulation, Integrator, PreconditionerKind, SolverKind};
use nalgebra::Vector3;

use crate::case::{Case, Method};
use crate::check::refusal;
use crate::random::{Random, list, short};

/// Tries at a scene, of which the first that is accepted counts: bodies that overlap at the start are refused, for instance.
const TRIES: u64 = 64;

/// Scene `index` of `seed`: the same for both, whatever else was drawn. It is accepted by the reader of scene files and by
/// the solver.
pub fn draw(seed: u64, index: u64) -> Case {
    let tries = (0..TRIES).map(|one| Draft::new(seed, index * TRIES + one).case());
    tries.into_iter().find(|case| refusal(case).is_none()).unwrap_or_else(|| {
        let text = "[[rods]]\nshape.straight = { length_m = 1, segments = 4 }\n".to_owned();
        Case { text, files: Vec::new(), method: Method::default() }
    })
}

/// A rod that was drawn, for what refers to it.
struct Drawn {
    name: String,
    segments: usize,
    /// Where it begins and ends [m], of straight rods and polylines alone.
    ends: Option<[Vector3<f64>; 2]>,
    radius: f64,
    /// Whether its faces may be held and loaded, and nothing but a copy was made of it.
    is_open: bool,
    is_one: bool,
}

/// A scene being drawn.
struct Draft {
    random: Random,
    /// What is drawn from here leaves all else of a scene as it is: features that were added to the first ones.
    added: Random,
    /// Draws what drives rods from inside and along them: scenes of old seeds keep the rest.
    driven: Random,
    text: String,
    files: Vec<(String, String)>,
    /// Size of all that is drawn [m].
    size: f64,
    dt: f64,
    steps: usize,
    /// Whether segments touch each other.
    touches: bool,
    /// Whether joints may have laws.
    is_newton: bool,
    rods: Vec<Drawn>,
    /// Segments that may still be drawn.
    room: usize,
    /// Height below which nothing was drawn yet [m].
    lowest: f64,
}

impl Draft {
    fn new(seed: u64, stream: u64) -> Self {
        let (mut random, added) = (Random::new(seed, stream), Random::new(seed, !stream));
        let size = random.even_log(0.03, 5.0);
        let steps = random.pick(&[6, 20, 40, 60]);
        // Parts of the time in which something falls by its size.
        let dt = short(random.even_log(0.01, 0.1) * (size / 10.0).sqrt());
        let (text, files, rods) = (String::new(), Vec::new(), Vec::new());
        Self {
            random,
            added,
            driven: Random::new(!seed, stream),
            text,
            files,
            size,
            dt,
            steps,
            touches: false,
            is_newton: false,
            rods,
            room: 60,
            lowest: 0.0,
        }
    }

    /// End of the run [s].
    fn end(&self) -> f64 {
        self.dt * self.steps as f64
    }

    fn case(mut self) -> Case {
        let weightless = self.random.chance(0.15);
        self.touches = self.random.chance(0.6);
        let method = self.method();
        self.is_newton = method.formulation == Formulation::Newton;
        if weightless {
            put!(self, "gravity_m_s2 = [0, 0, 0]");
        } else if self.random.chance(0.08) {
            let (other, end) = (list(self.random.direction() * 9.81), self.end());
            let how = self.random.pick(&["held", "linear", "smooth"]);
            put!(
                self,
                "gravity_over_time = {{ times_s = [0, {end:?}], values_m_s2 = [[0, 0, -9.81], {other:?}], interpolation = \"{how}\" }}"
            );
        }
        self.surroundings();
        // Large ones are solved by other means, and take few steps.
        let is_large = self.random.chance(0.02);
        if is_large {
            (self.room, self.steps) = (400, 3);
        }
        let run = self.text.len();
        match self.random.whole(0, 19) {
            _ if is_large => self.crowd(25),
            0 | 1 => self.crowd(4),
            2 => self.net(),
            3 => self.tree(),
            4 => self.frame(),
            _ => (0..self.random.pick(&[1, 1, 2, 2, 3, 4])).for_each(|_| self.rod()),
        }
        if self.random.chance(0.25) {
            self.body();
        }
        if self.random.chance(0.7) {
            (0..self.random.pick(&[1, 1, 1, 2, 3])).for_each(|_| self.obstacle());
        }
        if method.formulation == Formulation::Newton && self.random.chance(0.2) {
            (0..self.random.pick(&[1, 1, 2])).for_each(|_| self.eyelet());
        }
        if method.formulation == Formulation::Newton && self.added.chance(0.1) {
            self.pulley();
        }
        if method.formulation == Formulation::Newton && self.added.chance(0.1) {
            self.sheath();
        }
        if self.random.chance(0.08) {
            self.copies();
        }
        self.text.insert_str(run, &format!("\n[run]\ndt_s = {:?}\nsteps = {}\n", self.dt, self.steps));
        // The paper's measure is not for joints that are bent far at rest.
        let is_bent = self.text.contains("branch_of") || self.text.contains("[[joins]]");
        if self.random.chance(if is_bent { 0.9 } else { 0.2 }) {
            self.text.insert_str(0, "bending = \"rest-rotation\"\n");
        }
        Case { text: self.text, files: self.files, method }
    }

    fn method(&mut self) -> Method {
        let random = &mut self.random;
        let formulation = match random.whole(0, 6) {
            0..=4 => Formulation::Newton,
            _ => Formulation::Xpbd,
        };
        let integrator = random.pick(&[Integrator::Euler, Integrator::Euler, Integrator::Bdf2]);
        let solver = match random.whole(0, 9) {
            0 => SolverKind::Sparse,
            1 => SolverKind::cg(PreconditionerKind::BlockJacobi),
            _ => SolverKind::Direct,
        };
        Method { formulation, integrator, solver }
    }

    fn surroundings(&mut self) {
        if self.random.chance(0.15) {
            let [linear, angular] = [0; 2].map(|_| self.random.uniform(0.0, 5.0));
            put!(self, "\n[damping]\nlinear_per_s = {linear:?}\nangular_per_s = {angular:?}");
        }
        if self.touches {
            put!(self, "\n[contact]");
            self.surface();
        }
        if !self.random.chance(0.2) {
            return;
        }
        put!(self, "\n[air]");
        if self.driven.chance(0.3) {
            put!(self, "buoyancy = true");
        }
        if self.random.chance(0.3) {
            put!(self, "density_kg_m3 = {:?}", self.random.even_log(1.0, 1000.0));
        }
        if self.random.chance(0.6) {
            let speed = self.random.even_log(0.5, 20.0);
            put!(self, "\n[air.wind]\nvelocity_m_s = {:?}", list(self.random.direction() * speed));
            if self.random.chance(0.2) {
                put!(self, "rotation_period_s = {:?}", self.random.uniform(0.5, 10.0));
            }
            if self.random.chance(0.5) {
                put!(self, "\n[air.wind.gusts]\nstrength = {:?}", self.random.uniform(0.05, 0.5));
                put!(self, "length_m = {:?}", self.random.even_log(0.1, 10.0));
                put!(self, "time_s = {:?}", self.random.even_log(0.1, 5.0));
                put!(self, "seed = {}", self.random.whole(0, 9));
            }
        }
    }

    /// Friction and restitution.
    fn surface(&mut self) {
        match self.random.whole(0, 3) {
            0 => {}
            1 | 2 => put!(self, "friction = {:?}", self.random.uniform(0.0, 1.0)),
            _ => {
                let at_rest = self.random.uniform(0.1, 0.9);
                let sliding = self.random.uniform(0.0, at_rest).min(at_rest);
                put!(self, "friction = {{ at_rest = {at_rest:?}, sliding = {sliding:?} }}");
            }
        }
        if self.random.chance(0.3) {
            put!(self, "restitution = {:?}", self.random.uniform(0.0, 1.0));
        }
    }

    /// The name of a file beside the scene with this text.
    fn file(&mut self, end: &str, text: String) -> String {
        let name = format!("file-{}.{end}", self.files.len());
        self.files.push((name.clone(), text));
        name
    }

    /// An eyelet of the world or of another rod.
    fn eyelet(&mut self) {
        let open: Vec<(String, usize)> =
            self.rods.iter().filter(|rod| rod.is_open).map(|rod| (rod.name.clone(), rod.segments)).collect();
        if open.is_empty() {
            return;
        }
        let (name, segments) = self.random.pick(&open.iter().collect::<Vec<_>>()).clone();
        let (segment, fraction) = (self.random.whole(0, segments - 1), self.random.uniform(0.0, 1.0));
        put!(self, "\n[[eyelets]]\nat = {{ rod = \"{name}\", segment = {segment}, fraction = {fraction:?} }}");
        let friction = self.random.chance(0.6).then(|| self.random.uniform(0.0, 0.6));
        if self.added.chance(0.2) {
            self.feed();
        } else if let Some(friction) = friction {
            put!(self, "friction = {friction:?}");
        }
        let others: Vec<_> = open.iter().filter(|(other, _)| *other != name).collect();
        if !others.is_empty() && self.random.chance(0.3) {
            let (other, segments) = self.random.pick(&others).clone();
            put!(self, "on = {{ rod = \"{other}\", segment = {} }}", self.random.whole(0, segments - 1));
        }
    }

    /// A pulley beside a straight rod.
    fn pulley(&mut self) {
        let straight = |rod: &&Drawn| rod.is_open && rod.is_one;
        let Some((name, [from, to], segments)) =
            self.rods.iter().filter(straight).find_map(|rod| Some((rod.name.clone(), rod.ends?, rod.segments)))
        else {
            return;
        };
        let along = to - from;
        let length = along.norm() / segments as f64;
        let axis = along.cross(&self.added.direction());
        if axis.norm() < 0.1 * along.norm() {
            return;
        }
        let radius = short(length * self.added.uniform(1.5, 5.0));
        let centre = from + along * self.added.uniform(0.2, 0.8) + axis.cross(&along).normalize() * radius;
        let (centre, axis) = (list(centre), list(axis.normalize()));
        put!(self, "\n[[pulleys]]\nrod = \"{name}\"\ncentre_m = {centre:?}\naxis = {axis:?}\nradius_m = {radius:?}");
        match self.added.whole(0, 3) {
            0 => {}
            1 => put!(self, "friction = {:?}", self.added.uniform(0.0, 1.0)),
            2 => put!(self, "friction = {:?}\ninertia_kg_m2 = {:?}", self.added.uniform(0.0, 1.0), radius * radius),
            _ => {
                let (friction, rate) = (self.added.uniform(0.0, 1.0), self.added.uniform(-1.0, 1.0));
                let torque = self.added.uniform(0.0, 10.0);
                put!(self, "friction = {friction:?}\ndrive = {{ rate_rad_s = {rate:?}, max_torque_n_m = {torque:?} }}");
            }
        }
    }

    /// A wire inside of a straight rod, which sticks out of it or not.
    fn sheath(&mut self) {
        let straight = |rod: &&Drawn| rod.is_open && rod.is_one;
        let Some((name, [from, to], radius)) =
            self.rods.iter().filter(straight).find_map(|rod| Some((rod.name.clone(), rod.ends?, rod.radius)))
        else {
            return;
        };
        let own = short(radius * self.added.uniform(0.1, 0.7));
        let clearance = short((radius - own) * self.added.uniform(0.1, 0.9));
        let [start, end] = [self.added.uniform(-0.3, 0.4), self.added.uniform(0.6, 1.3)];
        let (start, way) = (from + (to - from) * start, (to - from) * (end - start));
        let segments = self.added.whole(3, 16);
        let (modulus, density) = (self.added.even_log(1e6, 1e10), self.added.even_log(300.0, 9000.0));
        put!(self, "\n[[rods]]\nname = \"wire\"\nradius_m = {own:?}\nyoungs_modulus_pa = {modulus:?}");
        put!(self, "torsion_modulus_pa = {:?}\ndensity_kg_m3 = {density:?}", 0.4 * modulus);
        let (start, length, direction) = (list(start), way.norm(), list(way.normalize()));
        put!(
            self,
            "shape.straight = {{ start_m = {start:?}, direction = {direction:?}, length_m = {length:?}, segments = {segments} }}"
        );
        put!(self, "\n[[sheaths]]\nrod = \"wire\"\ninside = \"{name}\"\nclearance_m = {clearance:?}");
        if self.added.chance(0.7) {
            put!(self, "friction = {:?}", self.added.uniform(0.0, 0.8));
        }
    }

    /// What drives a rod through an eyelet, out of a store or not.
    fn feed(&mut self) {
        let mut keys = format!("speed_m_s = {:?}", self.size * self.added.uniform(-0.5, 0.5));
        if self.added.chance(0.5) {
            keys += &format!(", max_force_n = {:?}", self.added.uniform(0.0, 100.0));
        }
        if self.added.chance(0.3) {
            keys += ", store = false";
        }
        put!(self, "feed = {{ {keys} }}");
    }

    fn copies(&mut self) {
        let Some(rod) = self.rods.iter().find(|rod| rod.is_one && rod.segments <= 12) else { return };
        put!(self, "\n[[copies]]\nrods = [\"{}\"]", rod.name);
        put!(self, "shifts_m = [{:?}]", list(self.random.direction() * (2.0 * self.size)));
        put!(self, "turns_deg = [{:?}]", list(self.random.vector(90.0)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn most_first_tries_are_accepted_and_others_say_that_places_are_taken() {
        let refusal = |index| refusal(&Draft::new(7, index * TRIES).case());
        let refused: Vec<String> = (0..300).filter_map(refusal).collect();
        let other: Vec<_> = refused
            .iter()
            .filter(|why| {
                ![
                    "overlap",
                    "apart",
                    "cg-block-jacobi knows no",
                    "full circles",
                    "drives this segment",
                    "sliding joints need",
                    "pulleys need",
                    "sheaths need",
                    "around it",
                    "off the pulley's groove",
                    "goes with a rod that has no held segments",
                    "goes with an elastic rod",
                    "rod that does not break",
                    "what is joined to others stays out of the store",
                    "must be before all other eyelets",
                    "a feed that has a store",
                ]
                .iter()
                .any(|known| why.contains(known))
            })
            .collect();
        assert!(other.is_empty(), "{other:#?}");
        assert!(refused.len() < 100, "{} refused", refused.len());
    }
}

//! Scenes at random: features of `docs/scenes.md`, combined.

mod held;
mod obstacles;
mod rods;

use std::fmt::Write as _;

use nalgebra::Vector3;
use solver::formulation::Formulation;
use solver::integrator::Integrator;
use solver::linear::precondition::PreconditionerKind;
use solver::linear::solvers::SolverKind;

use crate::case::{Case, Way};
use crate::check::is_accepted;
use crate::random::{Random, list, number, vector};

/// Tries at a scene, of which the first that is accepted counts: bodies that overlap at the start are refused, for instance.
const TRIES: u64 = 64;

/// Scene `index` of `seed`: the same for both, whatever else was drawn. It is accepted by the reader of scene files and by
/// the solver.
pub fn draw(seed: u64, index: u64) -> Case {
    let tries = (0..TRIES).map(|one| Draft::new(Random::new(seed, index * TRIES + one)).case());
    tries.into_iter().find(is_accepted).unwrap_or_else(|| {
        let text = "[[rods]]\nshape.straight = { length_m = 1, segments = 4 }\n".to_owned();
        Case { text, files: Vec::new(), way: Way::default() }
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

/// A scene under way.
struct Draft {
    random: Random,
    text: String,
    files: Vec<(String, String)>,
    /// Size of all that is drawn [m].
    size: f64,
    dt: f64,
    steps: usize,
    gravity: f64,
    /// Whether segments touch each other.
    touches: bool,
    rods: Vec<Drawn>,
    /// Segments that may still be drawn.
    room: usize,
    /// Height below which nothing was drawn yet [m].
    lowest: f64,
}

impl Draft {
    fn new(mut random: Random) -> Self {
        let size = random.even_log(0.03, 5.0);
        let steps = random.pick(&[6, 12, 20, 30, 40]);
        // Parts of the time in which something falls by its size.
        let dt = random.even_log(0.005, 0.1) * (size / 10.0).sqrt();
        let dt = crate::random::short(dt);
        let gravity = if random.chance(0.15) { 0.0 } else { 9.81 };
        let touches = random.chance(0.5);
        let (text, files, rods) = (String::new(), Vec::new(), Vec::new());
        Self { random, text, files, size, dt, steps, gravity, touches, rods, room: 60, lowest: 0.0 }
    }

    /// End of the run [s].
    fn end(&self) -> f64 {
        self.dt * self.steps as f64
    }

    fn line(&mut self, key: &str, value: impl std::fmt::Display) {
        let _ = writeln!(self.text, "{key} = {value}");
    }

    fn number(&mut self, key: &str, value: f64) {
        self.line(key, number(value));
    }

    fn table(&mut self, name: &str) {
        let _ = writeln!(self.text, "\n[{name}]");
    }

    fn entry(&mut self, name: &str) {
        let _ = writeln!(self.text, "\n[[{name}]]");
    }

    fn case(mut self) -> Case {
        let way = self.way();
        self.top();
        self.surroundings();
        // Large ones show what threads do, and take few steps.
        let is_large = self.random.chance(0.02);
        if is_large {
            self.room = 400;
            self.steps = 3;
        }
        let run = self.text.len();
        match self.random.whole(0, 19) {
            _ if is_large => self.crowd(25),
            0 => self.crowd(4),
            1 => self.net(),
            2 => self.tree(),
            3 => self.frame(),
            _ => {
                for _ in 0..self.random.pick(&[1, 1, 2, 2, 3, 4]) {
                    self.rod();
                }
            }
        }
        if self.random.chance(0.25) {
            self.body();
        }
        if self.random.chance(0.55) {
            for _ in 0..self.random.pick(&[1, 1, 1, 2, 3]) {
                self.obstacle();
            }
        }
        self.probes();
        if self.random.chance(0.08) {
            self.copies();
        }
        let table = format!("\n[run]\ndt_s = {}\nsteps = {}\n", number(self.dt), self.steps);
        self.text.insert_str(run, &table);
        // The paper's measure is not for joints that are bent far at rest.
        let is_bent = self.text.contains("branch_of") || self.text.contains("[[joins]]");
        if self.random.chance(if is_bent { 0.9 } else { 0.2 }) {
            self.text.insert_str(0, "bending = \"rest-rotation\"\n");
        }
        Case { text: self.text, files: self.files, way }
    }

    fn way(&mut self) -> Way {
        let random = &mut self.random;
        let default = Formulation::XpbdGeometric;
        let formulation = random.pick(&[
            default,
            default,
            default,
            default,
            Formulation::Newton,
            Formulation::Newton,
            Formulation::Xpbd,
        ]);
        let integrator = random.pick(&[Integrator::Euler, Integrator::Euler, Integrator::Bdf2]);
        let solver = match random.whole(0, 9) {
            0 => SolverKind::Sparse,
            1 => SolverKind::cg(PreconditionerKind::BlockJacobi),
            _ => SolverKind::Direct,
        };
        Way { formulation, integrator, solver }
    }

    fn top(&mut self) {
        let g = self.gravity;
        if g == 0.0 {
            self.line("gravity_m_s2", "[0, 0, 0]");
        } else if self.random.chance(0.08) {
            let other = self.random.direction() * g;
            let times = list([0.0, self.end()].map(number));
            let interpolation = self.random.pick(&["held", "linear", "smooth"]);
            let values = list([vector(Vector3::new(0.0, 0.0, -g)), vector(other)]);
            let table = format!("{{ times_s = {times}, values_m_s2 = {values}, interpolation = \"{interpolation}\" }}");
            self.line("gravity_over_time", table);
        }
    }

    fn surroundings(&mut self) {
        if self.random.chance(0.15) {
            self.table("damping");
            let (linear, angular) = (self.random.uniform(0.0, 5.0), self.random.uniform(0.0, 5.0));
            self.number("linear_per_s", linear);
            self.number("angular_per_s", angular);
        }
        if self.touches {
            self.table("contact");
            self.surface();
        }
        if self.random.chance(0.2) {
            self.table("air");
            if self.random.chance(0.3) {
                let density = self.random.even_log(1.0, 1000.0);
                self.number("density_kg_m3", density);
            }
            if self.random.chance(0.6) {
                let speed = self.random.even_log(0.5, 20.0);
                let velocity = self.random.direction() * speed;
                self.table("air.wind");
                self.line("velocity_m_s", vector(velocity));
                if self.random.chance(0.2) {
                    let period = self.random.uniform(0.5, 10.0);
                    self.number("rotation_period_s", period);
                }
                if self.random.chance(0.5) {
                    let strength = self.random.uniform(0.05, 0.5);
                    let (length, time) = (self.random.even_log(0.1, 10.0), self.random.even_log(0.1, 5.0));
                    let seed = self.random.whole(0, 9);
                    self.table("air.wind.gusts");
                    self.number("strength", strength);
                    self.number("length_m", length);
                    self.number("time_s", time);
                    self.line("seed", seed);
                }
            }
        }
    }

    /// Friction and restitution.
    fn surface(&mut self) {
        match self.random.whole(0, 3) {
            0 => {}
            1 | 2 => {
                let friction = self.random.uniform(0.0, 1.0);
                self.number("friction", friction);
            }
            _ => {
                let at_rest = self.random.uniform(0.1, 0.9);
                let sliding = self.random.uniform(0.0, at_rest);
                let table = format!("{{ at_rest = {}, sliding = {} }}", number(at_rest), number(sliding.min(at_rest)));
                self.line("friction", table);
            }
        }
        if self.random.chance(0.3) {
            let restitution = self.random.uniform(0.0, 1.0);
            self.number("restitution", restitution);
        }
    }

    /// A file beside the scene.
    fn file(&mut self, end: &str, text: String) -> String {
        let name = format!("file-{}.{end}", self.files.len());
        self.files.push((name.clone(), text));
        name
    }

    fn probes(&mut self) {
        let Some(rod) = self.rods.first().map(|rod| (rod.name.clone(), rod.is_one, rod.is_open)) else { return };
        let (name, true, is_open) = rod else { return };
        if self.random.chance(0.3) {
            self.entry("probes");
            self.line("rod", format!("\"{name}\""));
            if is_open && self.random.chance(0.7) {
                let at = self.random.pick(&["start-face", "end-face", "start-segment", "end-segment"]);
                self.line("at", format!("\"{at}\""));
            } else {
                self.line("segment", -1);
            }
            self.line("quantities", "[\"position\", \"orientation\", \"velocity\", \"angular-velocity\"]");
        }
    }

    fn copies(&mut self) {
        let Some(rod) = self.rods.iter().find(|rod| rod.is_one && rod.segments <= 12) else { return };
        let name = rod.name.clone();
        let shift = self.random.direction() * (2.0 * self.size);
        let turn = self.random.vector(90.0);
        self.entry("copies");
        self.line("rods", format!("[\"{name}\"]"));
        self.line("shifts_m", list([vector(shift)]));
        self.line("turns_deg", list([vector(turn)]));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::refusal;

    #[test]
    fn most_first_tries_are_accepted_and_others_say_that_places_are_taken() {
        let mut refused = Vec::new();
        for index in 0..300 {
            let case = Draft::new(Random::new(7, index * TRIES)).case();
            refused.extend(refusal(&case).map(|words| format!("{index}: {words}")));
        }
        println!("{}", refused.join("\n"));
        let known = ["overlap", "further apart", "apart"];
        let other: Vec<_> = refused.iter().filter(|words| !known.iter().any(|known| words.contains(known))).collect();
        assert!(other.is_empty(), "{other:#?}");
        assert!(refused.len() < 100, "{} refused", refused.len());
    }
}

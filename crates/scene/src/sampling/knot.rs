//! The paper's knot: the ends of a loosely knotted rope are pulled apart.
//!
//! The paper gives the rope (N = 110, r = 0.01 m, l = 11 m, Y = T = 1e4 Pa) and 20 runs of 100 frames to train on, not what
//! differs between them. Here it is the size of the loose knot, how fast and how unevenly the ends are pulled, and the
//! friction. The rest is the builtin scene `knot`'s.
//!
//! A loose knot takes about 5.4 loops of rope, of which 0.5 m are left to a tight one, five segments. In 100 frames the
//! slowest ends take up a quarter of the slack of the largest knot, the fastest 96 % of the smallest one's.

use super::number::number;
use crate::defaults;
use crate::random::Random;

/// Steps of a knot (paper: 100 frames).
pub const KNOT_STEPS: usize = 100;

/// Parameters of a rope with a knot. The rope itself is the paper's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knot {
    /// Width of the loose knot's loops [m].
    pub loop_diameter: f64,
    /// Speeds of the start and of the end, away from each other [m/s].
    pub speeds: [f64; 2],
    /// Coefficient of friction between strands.
    pub friction: f64,
}

impl Default for Knot {
    /// The builtin scene `knot`.
    fn default() -> Self {
        Self { loop_diameter: 0.8, speeds: [0.2; 2], friction: 0.2 }
    }
}

impl Knot {
    /// Number of segments N (paper).
    pub const SEGMENTS: usize = 110;
    /// Length of the rope [m] (paper).
    pub const LENGTH: f64 = 11.0;
    /// Radius of the section [m] (paper).
    pub const RADIUS: f64 = 0.01;
    /// Young's and torsion modulus [Pa] (paper).
    pub const MODULUS: f64 = 1e4;
    /// Density [kg/m^3]; not in the paper.
    pub const DENSITY: f64 = 1000.0;

    /// Sample `index` of `seed`: loops of 0.8 to 1 m, ends that part at 0.6 to 1.85 m/s of which the start has a third to
    /// two thirds, friction of 0.1 to 0.4.
    pub fn sample(seed: u64, index: u64) -> Self {
        let mut random = Random::new(seed, index);
        let loop_diameter = random.uniform(0.8, 1.0);
        let apart = random.uniform(0.6, 1.85);
        let start = apart * random.uniform(1.0 / 3.0, 2.0 / 3.0);
        Self { loop_diameter, speeds: [start, apart - start], friction: random.uniform(0.1, 0.4) }
    }

    /// The text of a scene file.
    pub(super) fn to_toml(self) -> String {
        let [start, end] = self.speeds;
        format!(
            "bending = \"paper\"\ngravity_m_s2 = [0, 0, 0]\nrun = {{ dt_s = {}, steps = {KNOT_STEPS}, integrator = \"euler\" }}\ndamping = {{ linear_per_s = 0.5 }}\n\
             contact = {{ friction = {} }}\n\n[[rods]]\nname = \"rope\"\nradius_m = {}\nyoungs_modulus_pa = {}\n\
             torsion_modulus_pa = {}\ndensity_kg_m3 = {}\nrest = \"straight\"\nclamp = [\"start-segment\", \"end-segment\"]\n\
             shape.knot = {{ loop_m = {}, length_m = {}, segments = {} }}\nvelocities = [\n    \
             {{ segment = 0, velocity_m_s = [{}, 0, 0] }},\n    {{ segment = -1, velocity_m_s = [{}, 0, 0] }},\n]\n",
            number(defaults::DT),
            number(self.friction),
            number(Self::RADIUS),
            number(Self::MODULUS),
            number(Self::MODULUS),
            number(Self::DENSITY),
            number(self.loop_diameter),
            number(Self::LENGTH),
            Self::SEGMENTS,
            number(-start),
            number(end),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Parameters;

    #[test]
    fn samples_stay_in_their_ranges_and_differ() {
        let knots: Vec<Knot> = (0..500).map(|i| Knot::sample(1, i)).collect();
        for knot in &knots {
            let apart = knot.speeds[0] + knot.speeds[1];
            assert!((0.8..1.0).contains(&knot.loop_diameter) && (0.1..0.4).contains(&knot.friction));
            assert!((0.6..1.85).contains(&apart) && knot.speeds.iter().all(|&v| (0.2..1.24).contains(&v)), "{knot:?}");
        }
        let mean = |f: fn(&Knot) -> f64| knots.iter().map(f).sum::<f64>() / 500.0;
        assert!(
            (mean(|knot| knot.loop_diameter) - 0.9).abs() < 0.01 && (mean(|knot| knot.friction) - 0.25).abs() < 0.02
        );
        // Fixed for all versions: data sets are named by seed and index.
        let Knot { loop_diameter, speeds: [start, end], friction } = Knot::sample(0, 0);
        assert_eq!(
            format!("{loop_diameter:.6} {start:.6} {end:.6} {friction:.6}"),
            "0.941815 0.669690 0.512712 0.118051"
        );
    }

    #[test]
    fn no_sample_asks_for_more_rope_than_its_knot_has() {
        for index in 0..100 {
            let scene = Parameters::Knot(Knot::sample(2, index)).scene().unwrap();
            let (positions, velocities) = (&scene.state.positions, &scene.state.velocities);
            let last = positions.len() - 1;
            let time = scene.run.dt * scene.run.steps as f64;
            let between = |t: f64| (positions[last] + velocities[last] * t - positions[0] - velocities[0] * t).norm();
            // Between the centres of its fixed segments the rope is 10.9 m long.
            assert!(10.9 - between(time) > 0.5, "{index}: {} m are left to the knot", 10.9 - between(time));
            assert!((between(time) - between(0.0)) / (10.4 - between(0.0)) > 0.24, "{index}");
            assert_eq!((scene.model.segments.len(), scene.run.steps), (110, 100));
            assert!(scene.model.segments[0].fixed && scene.model.segments[last].fixed);
        }
    }
}

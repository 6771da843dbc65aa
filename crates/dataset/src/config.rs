//! What to generate.

use std::collections::BTreeMap;

use cosserat::scene;
use cosserat::scene::sampling::{Family, KNOT_STEPS, Knot, Parameters, TREE_STEPS, Tree};
use cosserat::simulation::{Formulation, Integrator, StepParams};
use names::names;
use serde::{Deserialize, Serialize};

use crate::DatasetError;

/// Which of the paper's scenarios.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Scenario {
    /// Initially straight bending rods.
    Rod,
    /// Elastic helices.
    Helix,
    /// Ropes with a knot that is pulled tight.
    Knot,
    /// Trees in wind.
    Tree,
}

names!(Scenario { Rod = "rod", Helix = "helix", Knot = "knot", Tree = "tree" });

impl Scenario {
    /// Whether starts of whole steps are learned from it: in free motion, held at one place.
    pub fn teaches_steps(self) -> bool {
        matches!(self, Self::Rod | Self::Helix)
    }

    /// The family that its scenes are drawn from.
    pub fn family(self) -> Family {
        match self {
            Self::Rod => Family::Rod,
            Self::Helix => Family::Helix,
            Self::Knot => Family::Knot,
            Self::Tree => Family::Tree,
        }
    }

    /// Parameters of trajectory `index` of a `seed`.
    pub fn sample(self, seed: u64, index: u64) -> Parameters {
        Parameters::sample(self.family(), seed, index)
    }

    /// Range of every parameter, with the unit in its name: Table 1's with what [`scene::defaults`] fixes, and those of
    /// [`Knot`] and [`Tree`].
    pub fn ranges(self) -> BTreeMap<String, [f64; 2]> {
        let mut radius = [scene::defaults::RADIUS; 2];
        let mut density = scene::defaults::DENSITY;
        let own: &[(&str, [f64; 2])] = match self {
            Self::Rod => &[
                ("segments", [10.0, 55.0]),
                ("youngs_modulus_pa", [1e4, 1e6]),
                ("initial_angle_deg", [0.0, 45.0]),
                ("length_m", [1.0, 5.0]),
            ],
            Self::Helix => &[
                ("segments", [45.0, 105.0]),
                ("torsion_modulus_pa", [1e4, 1e6]),
                ("helix_radius_m", [0.4, 0.6]),
                ("helix_height_m", [0.4, 0.6]),
                ("winding", [2.0, 3.0]),
            ],
            Self::Knot => {
                (radius, density) = ([Knot::RADIUS; 2], Knot::DENSITY);
                &[
                    ("segments", [Knot::SEGMENTS as f64; 2]),
                    ("length_m", [Knot::LENGTH; 2]),
                    ("youngs_modulus_pa", [Knot::MODULUS; 2]),
                    ("torsion_modulus_pa", [Knot::MODULUS; 2]),
                    ("loop_m", [0.8, 1.0]),
                    ("closing_speed_m_s", [0.6, 1.85]),
                    ("start_share_of_speed", [1.0 / 3.0, 2.0 / 3.0]),
                    ("friction", [0.1, 0.4]),
                ]
            }
            Self::Tree => {
                let [foot, top] = Tree::TRUNK_RADII;
                let thinnest = top * (Tree::RADIUS_RATIO * Tree::RADIUS_RATIO).powi(Tree::LEVELS);
                (radius, density) = ([thinnest, foot], Tree::DENSITY);
                &[
                    ("rods", [70.0; 2]),
                    ("youngs_modulus_pa", [Tree::YOUNGS_MODULUS; 2]),
                    ("torsion_modulus_pa", [Tree::TORSION_MODULUS; 2]),
                    ("wind_speed_m_s", [6.0, 18.0]),
                    ("wind_angle_deg", [0.0, 360.0]),
                ]
            }
        };
        let fixed = [("radius_m", radius), ("density_kg_m3", [density; 2])];
        own.iter().chain(&fixed).map(|&(name, range)| (name.to_owned(), range)).collect()
    }

    /// The same with the slack variants ([`Parameters::slack`]), which starts of whole steps are trained on, too.
    pub fn ranges_with_slack(self) -> BTreeMap<String, [f64; 2]> {
        let mut ranges = self.ranges();
        let (radius, density) = match self.sample(0, 0).slack() {
            Some(Parameters::Rod(rod)) => (rod.radius, rod.density),
            Some(Parameters::Helix(helix)) => (helix.radius, helix.density),
            _ => return ranges,
        };
        for (name, value) in [("radius_m", radius), ("density_kg_m3", density)] {
            if let Some([low, high]) = ranges.get_mut(name) {
                (*low, *high) = (low.min(value), high.max(value));
            }
        }
        ranges
    }
}

/// Part of the trajectories.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Split {
    /// To train on.
    Train,
    /// To choose models by; never seen in training.
    Validation,
}

names!(Split { Train = "train", Validation = "validation" });

/// What to generate. The default is the paper's set of rods.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Which scenes.
    pub scenario: Scenario,
    /// Seed of the scenes' parameters, at most 2^63 - 1. Trajectory i uses stream i; training comes first.
    pub seed: u64,
    /// Number of training trajectories (Table 1: 256).
    pub train_trajectories: usize,
    /// Number of validation trajectories (Table 1: 100).
    pub validation_trajectories: usize,
    /// Steps of a trajectory (Table 1: 50).
    pub steps: usize,
    /// Of how many steps one is kept, from the first on; all, unless a set would be too large.
    #[serde(default = "all", skip_serializing_if = "is_all")]
    pub record_every: usize,
    /// Time step [s] (Table 1: 0.02).
    pub dt_s: f64,
    /// Residual at which a step's outer iterations end, relative to the prediction's; not in the paper.
    pub relative_tolerance: f64,
    /// Residual that is always good enough (gaps in segment lengths, angles in radians); not in the paper.
    pub absolute_tolerance: f64,
    /// Cap on a step's outer iterations; not in the paper.
    pub max_iterations: usize,
    /// How many times a step that does not converge may be halved.
    pub max_halvings: u32,
    /// Trajectories in a file.
    pub trajectories_per_shard: usize,
}

/// Every step is kept.
fn all() -> usize {
    1
}

fn is_all(every: &usize) -> bool {
    *every == all()
}

impl Default for Config {
    fn default() -> Self {
        Self::table_1(Scenario::Rod)
    }
}

impl Config {
    /// The paper's set of a scenario: Table 1's for rods and helices; 20 runs of 100 frames for knots, to which we add ten
    /// for validation; 100 topologies for trees and ten for validation, 100 steps each, of which every fifth is kept.
    pub fn table_1(scenario: Scenario) -> Self {
        let step = StepParams::default();
        let (train_trajectories, validation_trajectories, steps, record_every) = match scenario {
            Scenario::Rod | Scenario::Helix => (256, 100, scene::sampling::STEPS, 1),
            Scenario::Knot => (20, 10, KNOT_STEPS, 1),
            Scenario::Tree => (100, 10, TREE_STEPS, 5),
        };
        Self {
            scenario,
            seed: 0,
            train_trajectories,
            validation_trajectories,
            steps,
            record_every,
            dt_s: scene::defaults::DT,
            relative_tolerance: step.relative_tolerance,
            absolute_tolerance: step.absolute_tolerance,
            max_iterations: step.max_iterations,
            max_halvings: step.max_halvings,
            trajectories_per_shard: 32,
        }
    }

    /// Number of trajectories of a split.
    pub fn trajectories(&self, split: Split) -> usize {
        match split {
            Split::Train => self.train_trajectories,
            Split::Validation => self.validation_trajectories,
        }
    }

    /// Checks every setting.
    ///
    /// # Errors
    /// The first that is not allowed.
    pub fn check(&self) -> Result<(), DatasetError> {
        let wrong = |key, value: String, allowed| Err(DatasetError::Setting { key, value, allowed });
        let count = "1 to 1000000";
        let is_count = |n: usize| (1..=1_000_000).contains(&n);
        let counts = [
            ("train_trajectories", self.train_trajectories),
            ("steps", self.steps),
            ("record_every", self.record_every),
            ("max_iterations", self.max_iterations),
            ("trajectories_per_shard", self.trajectories_per_shard),
        ];
        if let Some((key, value)) = counts.into_iter().find(|&(_, n)| !is_count(n)) {
            return wrong(key, value.to_string(), count);
        }
        if self.validation_trajectories > 1_000_000 {
            return wrong("validation_trajectories", self.validation_trajectories.to_string(), "0 to 1000000");
        }
        if i64::try_from(self.seed).is_err() {
            return wrong("seed", self.seed.to_string(), "at most 9223372036854775807");
        }
        if self.max_halvings > 20 {
            return wrong("max_halvings", self.max_halvings.to_string(), "at most 20");
        }
        let positive = [
            ("dt_s", self.dt_s),
            ("relative_tolerance", self.relative_tolerance),
            ("absolute_tolerance", self.absolute_tolerance),
        ];
        match positive.into_iter().find(|(_, x)| !(x.is_finite() && *x > 0.0)) {
            Some((key, value)) => wrong(key, value.to_string(), "finite and > 0"),
            None => Ok(()),
        }
    }

    /// How a step is solved: the paper's formulation and integrator, to the tolerances.
    pub(crate) fn step(&self) -> StepParams {
        StepParams {
            formulation: Formulation::Xpbd,
            integrator: Integrator::Euler,
            relative_tolerance: self.relative_tolerance,
            absolute_tolerance: self.absolute_tolerance,
            max_iterations: self.max_iterations,
            max_halvings: self.max_halvings,
            ..StepParams::default()
        }
    }

    /// The files, in order: training, then validation.
    pub(crate) fn shards(&self) -> Vec<Plan> {
        let mut plans = Vec::new();
        for split in Split::ALL {
            let before = if split == Split::Train { 0 } else { self.train_trajectories };
            let count = self.trajectories(split);
            for (number, first) in (0..count).step_by(self.trajectories_per_shard).enumerate() {
                let trajectories = self.trajectories_per_shard.min(count - first);
                let name = format!("{}-{number:04}", split.name());
                plans.push(Plan { name, split, first: (before + first) as u64, trajectories });
            }
        }
        plans
    }
}

/// What goes into one file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Plan {
    /// File name without extension.
    pub(crate) name: String,
    pub(crate) split: Split,
    /// Index of the first trajectory.
    pub(crate) first: u64,
    pub(crate) trajectories: usize,
}

impl Plan {
    /// Name of the shard's file.
    pub(crate) fn file(&self) -> String {
        format!("{}.safetensors", self.name)
    }

    /// Name of the file that says what is in it.
    pub(crate) fn entry_file(&self) -> String {
        format!("{}.done.toml", self.name)
    }
}

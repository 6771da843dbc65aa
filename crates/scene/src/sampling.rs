//! The paper's random scenes: rods and helices (Table 1) with the variations of its supplement, knots, and trees in wind.
//!
//! Sample `index` of a `seed` is the same however many are drawn, in whatever order: each has a stream of its own.
//! What the paper leaves open is declared in [`crate::defaults`]; the initial angle is measured upwards from the
//! horizontal in the plane of world x and z, so that the rod swings down in that plane; a helix hangs downwards.

mod knot;
mod number;
mod table_1;
mod tree;

use crate::{Scene, SceneError, parse};

pub use knot::{KNOT_STEPS, Knot};
pub use table_1::{Helix, Rod, STEPS};
pub use tree::{TREE_STEPS, Tree};

/// The paper's scenarios (section 4 and supplement).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Initially straight bending rod, its first segment fixed.
    Rod,
    /// Elastic helix, its first segment fixed.
    Helix,
    /// Rope with a knot, both ends pulled.
    Knot,
    /// Tree in wind, its trunk's foot held.
    Tree,
}

/// Parameters of a scene of any family.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Parameters {
    /// A bending rod.
    Rod(Rod),
    /// A helix.
    Helix(Helix),
    /// A knot.
    Knot(Knot),
    /// A tree.
    Tree(Tree),
}

impl Parameters {
    /// Sample `index` of `seed` from the family's ranges: Table 1's for rods and helices.
    pub fn sample(family: Family, seed: u64, index: u64) -> Self {
        match family {
            Family::Rod => Self::Rod(Rod::sample(seed, index)),
            Family::Helix => Self::Helix(Helix::sample(seed, index)),
            Family::Knot => Self::Knot(Knot::sample(seed, index)),
            Family::Tree => Self::Tree(Tree::sample(seed, index)),
        }
    }

    /// The family.
    pub fn family(&self) -> Family {
        match self {
            Self::Rod(_) => Family::Rod,
            Self::Helix(_) => Family::Helix,
            Self::Knot(_) => Family::Knot,
            Self::Tree(_) => Family::Tree,
        }
    }

    /// The same scene slack: a rod as thin as a rope (radius 1 cm, 1000 kg/m^3), a helix of a thin wire (radius 2 cm),
    /// and the logarithm of the modulus half as far above that of 1e4 Pa. Here a step takes many outer iterations. Knots
    /// and trees have no such variant.
    pub fn slack(self) -> Option<Self> {
        let softened = |modulus: f64| 1e4 * (modulus / 1e4).sqrt();
        match self {
            Self::Rod(p) => {
                let youngs_modulus = softened(p.youngs_modulus);
                Some(Self::Rod(Rod { youngs_modulus, radius: 0.01, density: 1000.0, ..p }))
            }
            Self::Helix(p) => {
                Some(Self::Helix(Helix { torsion_modulus: softened(p.torsion_modulus), radius: 0.02, ..p }))
            }
            Self::Knot(_) | Self::Tree(_) => None,
        }
    }

    /// The scene, at the paper's time step of 0.02 s and its number of steps.
    ///
    /// # Errors
    /// As [`parse`] for [`Parameters::to_toml`]: a parameter set by hand is outside of what a scene file allows.
    pub fn scene(&self) -> Result<Scene, SceneError> {
        let file = match self {
            Self::Rod(_) => "random-rod.toml",
            Self::Helix(_) => "random-helix.toml",
            Self::Knot(_) => "random-knot.toml",
            Self::Tree(_) => "random-tree.toml",
        };
        parse(&self.to_toml(), file)
    }

    /// The scene as the text of a scene file, every number in full.
    pub fn to_toml(&self) -> String {
        match self {
            Self::Rod(p) => p.to_toml(),
            Self::Helix(p) => p.to_toml(),
            Self::Knot(p) => p.to_toml(),
            Self::Tree(p) => p.to_toml(),
        }
    }
}

/// The figures (a) to (g) of the supplement's "Dynamic Results", each with its scenes in the order of the text.
///
/// (a) to (d) vary the rod's angle, N, length and Y; (e) to (g) the helix's (HR, HH, HW), N and T (there called G).
pub fn supplement() -> Vec<(char, Vec<Parameters>)> {
    fn rods<T: Copy>(values: &[T], vary: fn(&mut Rod, T)) -> Vec<Parameters> {
        let with = |&value: &T| {
            let mut rod = Rod::default();
            vary(&mut rod, value);
            Parameters::Rod(rod)
        };
        values.iter().map(with).collect()
    }
    fn helices<T: Copy>(values: &[T], vary: fn(&mut Helix, T)) -> Vec<Parameters> {
        let with = |&value: &T| {
            let mut helix = Helix::default();
            vary(&mut helix, value);
            Parameters::Helix(helix)
        };
        values.iter().map(with).collect()
    }
    let shapes = [(0.4, 0.4, 2.0), (0.4, 0.4, 3.0), (0.5, 0.5, 2.0), (0.5, 0.5, 3.0)];
    vec![
        ('a', rods(&[0.0, 15.0, 30.0, 45.0], |rod, angle| rod.angle_deg = angle)),
        ('b', rods(&[10, 20, 40, 60], |rod, segments| rod.segments = segments)),
        ('c', rods(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], |rod, length| rod.length = length)),
        ('d', rods(&[2e4, 5e4, 1e5, 2e5, 5e5, 1e6], |rod, modulus| rod.youngs_modulus = modulus)),
        ('e', helices(&shapes, |helix, shape| (helix.helix_radius, helix.helix_height, helix.winding) = shape)),
        ('f', helices(&[30, 60, 80, 100], |helix, segments| helix.segments = segments)),
        ('g', helices(&[2e4, 5e4, 1e5, 1e6], |helix, modulus| helix.torsion_modulus = modulus)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_stay_within_table_1_and_fill_it() {
        let rods: Vec<Rod> = (0..2000).map(|i| Rod::sample(1, i)).collect();
        assert!(rods.iter().all(|p| (10..=55).contains(&p.segments) && (1.0..5.0).contains(&p.length)));
        assert!(rods.iter().all(|p| (1e4..1e6).contains(&p.youngs_modulus) && (0.0..45.0).contains(&p.angle_deg)));
        for n in 10..=55 {
            assert!(rods.iter().any(|p| p.segments == n), "no rod of {n} segments");
        }
        let mean = |f: fn(&Rod) -> f64| rods.iter().map(f).sum::<f64>() / rods.len() as f64;
        assert!((mean(|p| p.youngs_modulus.log10()) - 5.0).abs() < 0.05);
        assert!((mean(|p| p.angle_deg) - 22.5).abs() < 1.0);
        assert!((mean(|p| p.length) - 3.0).abs() < 0.1);
        let helices: Vec<Helix> = (0..2000).map(|i| Helix::sample(1, i)).collect();
        assert!(helices.iter().all(|p| (45..=105).contains(&p.segments) && (2.0..3.0).contains(&p.winding)));
        assert!(helices.iter().all(|p| (0.4..0.6).contains(&p.helix_radius) && (0.4..0.6).contains(&p.helix_height)));
    }

    #[test]
    fn a_sample_depends_on_seed_and_index_alone() {
        assert_eq!(Rod::sample(7, 123), Rod::sample(7, 123));
        assert_ne!(Rod::sample(7, 123), Rod::sample(7, 124));
        assert_ne!(Rod::sample(7, 123), Rod::sample(8, 123));
        // Fixed for all versions: data sets are named by seed and index.
        let p = Rod::sample(0, 0);
        let text = format!("{} {:.6e} {:.6} {:.6}", p.segments, p.youngs_modulus, p.angle_deg, p.length);
        assert_eq!(text, "42 8.547585e4 31.461446 1.240685");
    }

    #[test]
    fn slack_scenes_are_thin_and_soft() {
        for index in 0..100 {
            let Some(Parameters::Rod(rod)) = Parameters::sample(Family::Rod, 1, index).slack() else { panic!("a rod") };
            assert!((1e4..1e5).contains(&rod.youngs_modulus) && (rod.radius, rod.density) == (0.01, 1000.0));
            assert_eq!(rod.length, Rod::sample(1, index).length);
            let Some(Parameters::Helix(helix)) = Parameters::sample(Family::Helix, 1, index).slack() else {
                panic!("a helix")
            };
            assert!((1e4..1e5).contains(&helix.torsion_modulus) && helix.radius == 0.02);
            assert_eq!(helix.winding, Helix::sample(1, index).winding);
        }
    }

    #[test]
    fn the_scene_has_the_parameters() {
        let parameters = Parameters::sample(Family::Rod, 3, 5);
        let Parameters::Rod(p) = parameters else { panic!("a rod was asked for") };
        let scene = parameters.scene().unwrap();
        assert_eq!((scene.model.segments.len(), scene.run.steps, scene.run.dt), (p.segments, 50, 0.02));
        let axis = scene.state.axis(p.segments - 1);
        assert!((axis.z.asin().to_degrees() - p.angle_deg).abs() < 1e-9 && axis.y.abs() < 1e-12);
        assert!(scene.model.joints.iter().all(|j| j.youngs_modulus == p.youngs_modulus));
        assert!(scene.model.segments.iter().enumerate().all(|(i, s)| s.fixed == (i == 0)));
        assert!((rod::measure::rod_lengths(&scene.model, &scene.state)[0] - p.length).abs() < 1e-9);

        let helix = Parameters::sample(Family::Helix, 3, 5);
        let Parameters::Helix(p) = helix else { panic!("a helix was asked for") };
        let scene = helix.scene().unwrap();
        assert_eq!(scene.model.segments.len(), p.segments);
        assert!(
            scene
                .model
                .joints
                .iter()
                .all(|j| (j.youngs_modulus, j.torsion_modulus) == (p.torsion_modulus, p.torsion_modulus))
        );
    }

    #[test]
    fn the_defaults_are_the_builtin_scenes() {
        for (name, parameters) in [
            ("bending-rod", Parameters::Rod(Rod::default())),
            ("helix", Parameters::Helix(Helix::default())),
            ("knot", Parameters::Knot(Knot::default())),
        ] {
            let (ours, file) = (parameters.scene().unwrap(), crate::builtin(name).unwrap());
            assert_eq!((ours.model, ours.state), (file.model, file.state), "{name}");
        }
    }

    #[test]
    fn the_supplement_has_seven_figures() {
        let figures = supplement();
        let sizes: Vec<_> = figures.iter().map(|(_, scenes)| scenes.len()).collect();
        assert_eq!(sizes, [4, 4, 6, 6, 4, 4, 4]);
        for parameters in figures.iter().flat_map(|(_, scenes)| scenes) {
            parameters.scene().unwrap();
        }
    }

    #[test]
    fn parameters_set_by_hand_are_checked() {
        let error = Parameters::Rod(Rod { length: f64::NAN, ..Rod::default() }).scene().unwrap_err();
        assert_eq!(
            error.to_string(),
            "random-rod.toml:12: rods[0].shape.straight.length_m = nan, but it must be finite and > 0 [m]"
        );
    }
}

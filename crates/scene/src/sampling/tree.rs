//! The paper's trees in wind.
//!
//! The paper gives numbers: 100 topologies of 70 rods with 1056 nodes in the mean to train on; 30 topologies each of 10, 20,
//! 40 and 70 rods with 204, 355, 654 and 1061 nodes to test with; and a wind field. What a tree looks like and how the wind
//! blows is declared here: the trunk, wood and kind of branching of the builtin scenes `tree-10` to `tree-70`, branches cut
//! into segments of 7.2 cm, whatever the tree's size, and gusty wind from any side at 6 to 18 m/s.

use super::number::number;
use crate::defaults;
use crate::random::Random;

/// Steps of a tree (paper: averages over runs of 100 steps).
pub const TREE_STEPS: usize = 100;

/// Parameters of a tree in wind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tree {
    /// Number of rods, the trunk included; at least 4, so that each of three levels has a branch.
    pub rods: usize,
    /// Seed of the topology, below 2^32.
    pub seed: u64,
    /// Mean speed of the wind [m/s].
    pub wind_speed: f64,
    /// Direction that the wind blows to, from world x towards y [degrees].
    pub wind_angle_deg: f64,
    /// Seed of the gusts, below 2^32.
    pub gust_seed: u64,
}

impl Default for Tree {
    /// 70 rods in wind of 14 m/s along world x, both seeds 1.
    fn default() -> Self {
        Self { rods: 70, seed: 1, wind_speed: 14.0, wind_angle_deg: 0.0, gust_seed: 1 }
    }
}

impl Tree {
    /// Radii of the trunk at its foot and at its top [m].
    pub const TRUNK_RADII: [f64; 2] = [0.04, 0.016];
    /// Radius of a branch where it begins over its parent's there, and at its end over that at its beginning.
    pub const RADIUS_RATIO: f64 = 0.6;
    /// Levels of branches.
    pub const LEVELS: i32 = 3;
    /// Density of the wood [kg/m^3].
    pub const DENSITY: f64 = 700.0;
    /// Young's modulus of the wood [Pa].
    pub const YOUNGS_MODULUS: f64 = 4e9;
    /// Torsion modulus of the wood [Pa].
    pub const TORSION_MODULUS: f64 = 5e8;

    /// Sample `index` of `seed`, a tree of 70 rods: any topology, wind of 6 to 18 m/s from any side, any gusts.
    pub fn sample(seed: u64, index: u64) -> Self {
        let mut random = Random::new(seed, index);
        let mut any = || random.whole(0, u32::MAX as usize) as u64;
        let (seed, gust_seed) = (any(), any());
        let (wind_speed, wind_angle_deg) = (random.uniform(6.0, 18.0), random.uniform(0.0, 360.0));
        Self { seed, gust_seed, wind_speed, wind_angle_deg, ..Self::default() }
    }

    /// The text of a scene file.
    pub(super) fn to_toml(self) -> String {
        let (sin, cos) = self.wind_angle_deg.to_radians().sin_cos();
        let [foot, top] = Self::TRUNK_RADII.map(number);
        format!(
            "bending = \"paper\"\nrun = {{ dt_s = {}, steps = {TREE_STEPS}, integrator = \"euler\" }}\n\n[air]\nwind = {{ velocity_m_s = [{}, {}, 0], gusts = {{ \
             strength = 0.3, length_m = 2.4, time_s = 4, seed = {} }} }}\n\n[[rods]]\nname = \"trunk\"\n\
             radius_m = [{foot}, {top}]\nyoungs_modulus_pa = {}\ntorsion_modulus_pa = {}\ndensity_kg_m3 = {}\n\
             clamp = [\"start-face\"]\nshape.straight = {{ direction = [0, 0, 1], length_m = 4, segments = 65 }}\n\
             tree = {{ branches = {}, levels = {}, segment_m = 0.072, length_ratio = 0.6, radius_ratio = {}, \
             angle_deg = 45, seed = {} }}\n",
            number(defaults::DT),
            number(self.wind_speed * cos),
            number(self.wind_speed * sin),
            self.gust_seed,
            number(Self::YOUNGS_MODULUS),
            number(Self::TORSION_MODULUS),
            number(Self::DENSITY),
            self.rods.saturating_sub(1),
            Self::LEVELS,
            number(Self::RADIUS_RATIO),
            self.seed,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scene;
    use crate::sampling::Parameters;

    fn scene(tree: Tree) -> Scene {
        Parameters::Tree(tree).scene().unwrap()
    }

    #[test]
    fn trees_have_the_papers_numbers_of_nodes_in_the_mean() {
        for (rods, nodes) in [(10, 204.0), (20, 355.0), (40, 654.0), (70, 1061.0)] {
            let trees: Vec<Scene> = (0..30).map(|i| scene(Tree { rods, ..Tree::sample(1, i) })).collect();
            let mean = trees.iter().map(|tree| tree.model.segments.len() as f64).sum::<f64>() / 30.0;
            assert!((mean / nodes - 1.0).abs() < 0.07, "{rods} rods: {mean} nodes, not {nodes}");
            for tree in &trees {
                assert_eq!((tree.rods.len(), tree.model.anchors.len()), (rods, 1));
                assert_eq!(tree.model.joints.len(), tree.model.segments.len());
            }
        }
    }

    #[test]
    fn samples_differ_in_topology_wind_and_gusts() {
        let trees: Vec<Tree> = (0..500).map(|i| Tree::sample(1, i)).collect();
        assert!(trees.iter().all(|tree| (6.0..18.0).contains(&tree.wind_speed) && tree.rods == 70));
        let mean = |f: fn(&Tree) -> f64| trees.iter().map(f).sum::<f64>() / 500.0;
        assert!(
            (mean(|tree| tree.wind_speed) - 12.0).abs() < 0.5
                && (mean(|tree| tree.wind_angle_deg) - 180.0).abs() < 15.0
        );
        let [a, b] = [scene(trees[0]), scene(trees[1])];
        assert_ne!(a.model.joints.len(), b.model.joints.len());
        let wind = |scene: &Scene| scene.model.air.as_ref().unwrap().wind.velocity(&nalgebra::Vector3::zeros(), 0.5);
        assert_ne!(wind(&a), wind(&b));
        // Fixed for all versions: data sets are named by seed and index.
        let Tree { seed, gust_seed, wind_speed, wind_angle_deg, .. } = Tree::sample(0, 0);
        assert_eq!(
            format!("{seed} {gust_seed} {wind_speed:.6} {wind_angle_deg:.6}"),
            "3045455719 2001118559 14.389719 21.661620"
        );
    }

    #[test]
    fn radii_stay_between_the_trunks_foot_and_the_thinnest_twig() {
        let least = Tree::TRUNK_RADII[1] * (Tree::RADIUS_RATIO * Tree::RADIUS_RATIO).powi(Tree::LEVELS);
        for index in 0..5 {
            let tree = scene(Tree::sample(3, index));
            assert!(tree.model.segments.iter().all(|segment| (least..=Tree::TRUNK_RADII[0]).contains(&segment.radius)));
        }
    }
}

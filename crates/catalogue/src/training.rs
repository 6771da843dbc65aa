//! What learned guesses come from: the paper's data sets, generated on first use.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result};
use dataset::{Config, Dataset, MANIFEST, Scenario, generate, open_as};
use rod::{Body, Joint};
use scene::Scene;

use crate::name::GuessName;
#[cfg(feature = "gn")]
use crate::network::Network;
use crate::sources::{Sources, check_sources};
use terminal::say;

/// Folder of the data sets, one a scenario.
const DATA: &str = "data";

/// Which scenario, and where what was learned from it is.
#[derive(Clone, Debug)]
pub struct Training {
    /// Which scenes were learned from.
    pub scenario: Scenario,
    directory: PathBuf,
    /// A network of one's own in the place of one that is built in.
    #[cfg(feature = "gn")]
    pub own: Option<Network>,
    /// Whether nothing may be printed.
    pub quiet: bool,
}

impl Training {
    /// Of each of these scenarios, for the guesses that are asked for.
    ///
    /// # Errors
    /// If what the arguments name is for none of them, or is no checkpoint.
    pub fn of(args: &Sources, names: &[GuessName], scenarios: &[Scenario], quiet: bool) -> Result<Vec<Self>> {
        check_sources(args, names)?;
        #[cfg(feature = "gn")]
        let own = crate::network::own(args, names, scenarios)?;
        let data = args.data.as_deref().unwrap_or(Path::new(DATA));
        let training = |&scenario: &Scenario| Self {
            scenario,
            directory: data.join(scenario.name()),
            #[cfg(feature = "gn")]
            own: own.clone(),
            quiet,
        };
        Ok(scenarios.iter().map(training).collect())
    }

    /// For a scene: of the scenario asked for, else of the one that is most like it ([`fitting`]).
    ///
    /// # Errors
    /// As [`Self::of`].
    pub fn for_scene(
        args: &Sources,
        names: &[GuessName],
        scenario: Option<Scenario>,
        scene: &Scene,
        quiet: bool,
    ) -> Result<Self> {
        Ok(Self::of(args, names, &[scenario.unwrap_or_else(|| fitting(scene))], quiet)?.remove(0))
    }

    /// Where the data set is.
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// Opens the data set; generates it, or what is missing of it, if it is not complete.
    pub fn dataset(&self) -> Result<Dataset> {
        let config = Config::table_1(self.scenario);
        let Self { scenario, directory, quiet, .. } = self;
        if !directory.join(MANIFEST).exists() {
            let count = config.train_trajectories + config.validation_trajectories;
            if !quiet {
                let place = directory.display();
                say!(
                    "generating the paper's data set ({scenario}) in {place}: {count} trajectories, once and for all"
                )?;
            }
            let begin = Instant::now();
            let bar = terminal::bar(count, "trajectories", *quiet)?;
            generate(directory, &config, None, &|made| bar.set_position(made.done as u64)).context("--data")?;
            bar.finish_and_clear();
            if !quiet {
                say!("generated in {:.1} s", begin.elapsed().as_secs_f64())?;
            }
        }
        open_as(directory, &config).context("--data")
    }

    /// Says so where a scene is unlike all that the learned ones of these guesses learned from.
    pub fn say_foreign(&self, names: &[GuessName], scene: &Scene) -> Result<()> {
        let solves = self.scenario;
        let steps = if solves.teaches_steps() { solves } else { Scenario::Rod };
        for (of_steps, scenario, ranges) in [(false, solves, solves.ranges()), (true, steps, steps.ranges_with_slack())]
        {
            let learned = names.iter().filter(|name| name.is_learned() && name.helps_steps() == of_steps);
            let learned = learned.map(GuessName::to_string).collect::<Vec<_>>().join(", ");
            match foreign(scene, &ranges) {
                Some(what) if !(self.quiet || learned.is_empty()) => {
                    say!(
                        "{learned} learned from random scenes ({scenario}), where nothing is like this scene: {what}"
                    )?;
                }
                _ => {}
            }
        }
        Ok(())
    }
}

/// The scenario that is most like a scene: trees where rods hang together without loops, knots where a single rod that can
/// touch itself is held at both ends, else helices where joints are bent or twisted at rest, else rods.
pub fn fitting(scene: &Scene) -> Scenario {
    let model = &scene.model;
    let rod_of = |body: Body| match body {
        Body::Segment(segment) => Some(model.segments[segment].rod),
        Body::Anchor(_) => None,
    };
    let branches = |joint: &Joint| rod_of(joint.a).zip(rod_of(joint.b)).is_some_and(|(a, b)| a != b);
    // Each set without a loop has one joint less than bodies.
    if model.joints.iter().any(branches) && model.joints.len() < model.segments.len() + model.anchors.len() {
        return Scenario::Tree;
    }
    let ends = [model.segments.first(), model.segments.last()];
    let is_held = ends.iter().all(|end| end.is_some_and(|end| end.fixed));
    if scene.rods.len() == 1 && model.contacts.between_segments.is_some() && is_held {
        return Scenario::Knot;
    }
    // Where ropes of a net cross, joints are turned at rest.
    let own = model.joints.iter().filter(|joint| !branches(joint));
    let is_straight = own.map(|joint| joint.rest_darboux.norm() * joint.length).all(|angle| angle < 1e-9);
    if is_straight { Scenario::Rod } else { Scenario::Helix }
}

/// What makes a scene unlike all that was learned from, in words.
pub(crate) fn foreign(scene: &Scene, ranges: &BTreeMap<String, [f64; 2]>) -> Option<String> {
    let model = &scene.model;
    // Rods are held by their first segment, trees by an anchor.
    let trees = ranges.get("rods");
    let rods = trees.map_or(1, |&[rods, _]| rods as usize);
    if scene.rods.len() != rods || model.joints.len() + usize::from(trees.is_none()) != model.segments.len() {
        let (rods, joints) = (scene.rods.len(), model.joints.len());
        return Some(format!("{rods} rods with {} segments and {joints} joints", model.segments.len()));
    }
    let outside = |name: &str, value: f64| {
        let &[low, high] = ranges.get(name)?;
        let is_within = low * (1.0 - 1e-9) <= value && value <= high * (1.0 + 1e-9);
        (!is_within).then(|| {
            if low == high {
                format!("{name} = {value:?}, not {low:?}")
            } else {
                format!("{name} = {value:?}, not {low:?} to {high:?}")
            }
        })
    };
    let length: f64 = model.segments.iter().map(|segment| segment.length).sum();
    let whole = [("segments", model.segments.len() as f64), ("length_m", length)];
    let of_segments = model.segments.iter().flat_map(|s| [("radius_m", s.radius), ("density_kg_m3", s.density)]);
    let of_joints = model
        .joints
        .iter()
        .flat_map(|j| [("youngs_modulus_pa", j.youngs_modulus), ("torsion_modulus_pa", j.torsion_modulus)]);
    whole.into_iter().chain(of_segments).chain(of_joints).find_map(|(name, value)| outside(name, value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_fit_the_scenario_that_they_are_like() {
        for scenario in Scenario::ALL {
            let scene = scenario.sample(3, 1).scene().unwrap();
            assert_eq!((fitting(&scene), foreign(&scene, &scenario.ranges())), (scenario, None));
        }
        for (name, scenario) in [
            ("bending-rod", Scenario::Rod),
            ("clamped-ends", Scenario::Rod),
            ("two-rods", Scenario::Rod),
            ("hair", Scenario::Rod),
            ("net", Scenario::Rod),
            ("helix-on-plane", Scenario::Helix),
            ("knot", Scenario::Knot),
            ("branch", Scenario::Tree),
            ("tree", Scenario::Tree),
            ("tree-10", Scenario::Tree),
        ] {
            assert_eq!(fitting(&scene::builtin(name).unwrap()), scenario, "{name}");
        }
    }
}

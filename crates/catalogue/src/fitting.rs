//! Which of the training scenarios a scene is like, how it is unlike it, and whether it takes a learned start.

use std::collections::BTreeMap;

use cosserat::scene::Scene;
use cosserat::simulation::{Integrator, StepParams, Tangent};
use cosserat::state::{Body, Joint};
use dataset::Scenario;

use crate::name::{GuessName, Recipe};

/// Longest time step at which a learned start is taken [s]: a little longer than the paper's.
const LONGEST_STEP: f64 = 0.025;

/// The learned start that the rules take for a scene like this one, and why; `None` where there is none.
///
/// That is `gn-step` for formulation `newton` with the positive matrix and without contacts, on helices like those that it
/// learned from, at the paper's time step. With the exact tangent a step takes so few iterations that the network costs more
/// than it saves. `evaluate precision` measures what this rests on: it runs `gn-step` beside the other starts.
pub fn learned_start(scene: &Scene, step: &StepParams) -> Option<(GuessName, String)> {
    let is_taken = cfg!(feature = "gn")
        && step.formulation.momentum()
        && step.integrator == Integrator::Euler
        && step.tangent == Tangent::Positive
        && scene.model.contacts.is_empty()
        && scene.model.beyond_the_paper().is_none()
        && scene.run.dt <= LONGEST_STEP
        && fitting(scene) == Scenario::Helix
        && foreign(scene, &Scenario::Helix.ranges_with_slack()).is_none();
    let name = GuessName::Network(Recipe::Step);
    let like = "the scene is a helix like those that it learned from";
    is_taken.then(|| (name, format!("guess {name}: {like}, in time steps of at most {LONGEST_STEP} s")))
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
    let length: f64 = model.segments.iter().map(|segment| segment.length).sum();
    let whole = [("segments", model.segments.len() as f64), ("length_m", length)].into_iter();
    let of_segments = model.segments.iter().flat_map(|s| [("radius_m", s.radius), ("density_kg_m3", s.density)]);
    let moduli = |j: &Joint| [("youngs_modulus_pa", j.youngs_modulus), ("torsion_modulus_pa", j.torsion_modulus)];
    whole.chain(of_segments).chain(model.joints.iter().flat_map(moduli)).find_map(|(name, value)| {
        let &[low, high] = ranges.get(name)?;
        let is_within = low * (1.0 - 1e-9) <= value && value <= high * (1.0 + 1e-9);
        let to = if low == high { String::new() } else { format!(" to {high:?}") };
        (!is_within).then(|| format!("{name} = {value:?}, not {low:?}{to}"))
    })
}

#[cfg(test)]
mod tests {
    use cosserat::scene;

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

    #[cfg(feature = "gn")]
    #[test]
    fn it_is_for_helices_like_those_of_its_training() {
        use cosserat::simulation::Formulation;

        let step = |formulation| StepParams {
            formulation,
            tangent: Tangent::Positive,
            integrator: Integrator::Euler,
            ..StepParams::DEFAULT
        };
        let chosen = |name: &str, step: StepParams| learned_start(&scene::builtin(name).unwrap(), &step).is_some();
        let newton = step(Formulation::Newton);
        assert!(chosen("helix", newton));
        assert!(!chosen("helix", step(Formulation::Xpbd)));
        assert!(!chosen("helix", StepParams { tangent: Tangent::Auto, ..newton }));
        assert!(!chosen("helix", StepParams { integrator: Integrator::Bdf2, ..newton }));
        for name in ["bending-rod", "helix-on-plane", "michell-ring", "tree-10", "bend-45", "hair"] {
            assert!(!chosen(name, newton), "{name}");
        }
        let mut slow = scene::builtin("helix").unwrap();
        slow.run.dt = 0.05;
        assert!(learned_start(&slow, &newton).is_none());
    }
}

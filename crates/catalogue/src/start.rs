//! Whether a learned start of steps is better than all that `solver::auto` knows of.

use dataset::Scenario;
use scene::Scene;
use solver::formulation::Formulation;

use crate::name::{GuessName, LearnedName, Recipe};
use crate::training::{fitting, foreign};

/// Longest time step of the regime in which the network paid [s].
const LONGEST_STEP: f64 = 0.025;

/// The learned start that takes less time than any other on scenes like this one, and why; `None` where there is none.
///
/// That is `gn-step` for formulation `newton` on helices like those that it learned from, at the paper's time step: on 50
/// held-out ones it took .97 of the time of the best start without learning (1e-6, .96 on slack ones at 1e-3), and .8 to
/// .9 of it at equal error on the builtin one. On rods, at longer time steps and on all that is unlike its training it
/// did not pay.
pub fn learned_start(scene: &Scene, formulation: Formulation) -> Option<(GuessName, String)> {
    let pays = cfg!(feature = "gn")
        && formulation.momentum()
        && scene.model.contacts.is_empty()
        && scene.run.dt <= LONGEST_STEP
        && fitting(scene) == Scenario::Helix
        && foreign(scene, &Scenario::Helix.ranges_with_slack()).is_none();
    let name = GuessName::Learned(LearnedName::Network(Recipe::Step));
    pays.then(|| (name, format!("guess {name}: on helices like those that it learned from it saves the most time")))
}

#[cfg(all(test, feature = "gn"))]
mod tests {
    use super::*;

    #[test]
    fn it_is_for_helices_like_those_of_its_training() {
        let chosen = |name: &str, formulation| learned_start(&scene::builtin(name).unwrap(), formulation).is_some();
        assert!(chosen("helix", Formulation::Newton));
        assert!(!chosen("helix", Formulation::Xpbd));
        for name in ["bending-rod", "helix-on-plane", "michell-ring", "tree-10", "bend-45", "hair"] {
            assert!(!chosen(name, Formulation::Newton), "{name}");
        }
        let mut slow = scene::builtin("helix").unwrap();
        slow.run.dt = 0.05;
        assert!(learned_start(&slow, Formulation::Newton).is_none());
    }
}

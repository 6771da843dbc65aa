//! No shipped, random or stress scene starts with an overlap: all of them become simulations.

use std::num::NonZeroUsize;

use cosserat::scene;
use cosserat::scene::sampling::{Family, Parameters};
use cosserat::simulation::{Settings, Simulation};
use cosserat::state::{Model, State};
use evaluation::stress;

/// Makes a simulation of a scene; returns whether anything can touch in it.
fn starts(name: &str, model: &Model, state: &State) -> bool {
    if let Err(error) = Simulation::new(model, state, &Settings::default(), None) {
        panic!("{name}: {error}");
    }
    !model.contacts.is_empty()
}

#[test]
fn builtin_scenes_start_as_they_are_and_with_their_segments_cut() {
    for factor in [1, 2, 3] {
        let cut = NonZeroUsize::new(factor).unwrap();
        let touching = scene::builtins().into_iter().filter(|builtin| {
            let scene = scene::builtin_refined(builtin.name, cut).unwrap();
            starts(&format!("{}, cut into {factor}", builtin.name), &scene.model, &scene.state)
        });
        assert!(touching.count() >= 5);
    }
}

#[test]
fn random_scenes_start() {
    let mut touching = 0;
    for family in [Family::Rod, Family::Helix, Family::Knot, Family::Tree] {
        for (seed, index) in (0..3).flat_map(|seed| (0..10).map(move |index| (seed, index))) {
            let scene = Parameters::sample(family, seed, index).scene().unwrap();
            let name = format!("{family:?} {index} of seed {seed}");
            touching += usize::from(starts(&name, &scene.model, &scene.state));
        }
    }
    assert!(touching >= 30, "{touching} with contacts");
}

#[test]
fn stress_cases_start() {
    let touching = stress::cases().into_iter().filter(|case| starts(&case.name, &case.model, &case.state));
    assert!(touching.count() >= 3);
}

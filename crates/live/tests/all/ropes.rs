//! What the tests handle: a rope of 1 m.

use dynamics::simulation::{Settings, Simulation};
use live::{Rebuild, with_hands};
use nalgebra::Vector3;
use rod::{Assembly, Damping, Material, Model, RodSpec, State, shape};

/// A rope of 40 segments along x that nothing holds, with damping [1/s] against the air, and loads for hands.
pub(crate) fn rope(damping: f64) -> (Model, State) {
    let rubber = Material { youngs_modulus: 2e6, torsion_modulus: 7e5, density: 1100.0 };
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    assembly.rod(&RodSpec::new(shape::straight(Vector3::zeros(), Vector3::x(), 1.0, 40), 0.005, rubber));
    let (mut model, state) = assembly.finish();
    model.damping = Damping { linear: damping, angular: damping };
    (with_hands(&model), state)
}

pub(crate) fn simulation(model: &Model, state: &State) -> Simulation {
    Simulation::new(model, state, &Settings::default(), None).expect("a simulation")
}

pub(crate) fn rebuild(state: &State) -> Rebuild<'_> {
    Box::new(|model| Simulation::new(model, state, &Settings::default(), None).map_err(|error| error.to_string()))
}

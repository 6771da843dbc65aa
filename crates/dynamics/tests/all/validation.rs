//! Parameters of steps and of static analyses that are not allowed are named with their value before the first step.

use dynamics::simulation::{Settings, Simulation, SimulationError};
use dynamics::step::StepParams;

use crate::common::{material, rod};

#[test]
fn step_parameters_are_checked() {
    let (model, state) = rod(1.0, 3, 0.02, material(1e6, 1000.0));
    let default = StepParams::DEFAULT;
    let error = |step: StepParams| {
        let settings = Settings { step, ..Settings::default() };
        match Simulation::new(&model, &state, &settings, None) {
            Err(error @ SimulationError::Step(_)) => error.to_string(),
            Err(error) => panic!("another error: {error}"),
            Ok(_) => String::new(),
        }
    };
    for x in [-1e-9, f64::NAN, f64::INFINITY] {
        let allowed = "but it must be finite and >= 0";
        assert_eq!(
            error(StepParams { relative_tolerance: x, ..default }),
            format!("step parameter relative_tolerance = {x}, {allowed}")
        );
        assert_eq!(
            error(StepParams { absolute_tolerance: x, ..default }),
            format!("step parameter absolute_tolerance = {x}, {allowed}")
        );
    }
    for x in [0.0, -1.0, f64::NAN] {
        assert_eq!(
            error(StepParams { contact_tolerance: x, ..default }),
            format!("step parameter contact_tolerance = {x}, but it must be finite and > 0")
        );
    }
    assert_eq!(
        error(StepParams { max_iterations: 0, ..default }),
        "step parameter max_iterations = 0, but it must be >= 1"
    );
    assert_eq!(
        error(StepParams { max_halvings: 31, ..default }),
        "step parameter max_halvings = 31, but it must be <= 30"
    );
    for allowed in [default, StepParams { relative_tolerance: 0.0, absolute_tolerance: 0.0, ..default }] {
        assert_eq!(error(allowed), "");
    }
}

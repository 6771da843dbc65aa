//! Experiments with a known result: those that take at most a second give it.

use cosserat::simulation::{Formulation, Integrator, Settings, Status, StepParams};
use evaluation::benchmark::{Outcome, experiments};

fn run(name: &str, integrator: Integrator) -> Outcome {
    let step = StepParams { formulation: Formulation::Newton, integrator, ..StepParams::DEFAULT };
    let settings = Settings { step, ..Settings::default() };
    let all = experiments();
    let experiment = all.iter().find(|experiment| experiment.name == name).expect(name);
    let mut steps = 0;
    let mut count = || {
        steps += 1;
        true
    };
    let outcome = experiment.run(&settings, &mut count).expect(name);
    assert_eq!(steps, experiment.steps, "{name}");
    outcome
}

fn is_right(name: &str) {
    let outcome = run(name, Integrator::Bdf2);
    assert!(outcome.status <= Status::ConvergedInSubsteps, "{name}: {}", outcome.status.name());
    for quantity in &outcome.quantities {
        assert!(quantity.is_right(), "{name}: {quantity:?}");
    }
}

#[test]
fn hanging_rods_are_right() {
    is_right("catenary");
    is_right("cantilever");
}

#[test]
fn swinging_and_whipping_rods_are_right() {
    is_right("pendulum");
    is_right("whip");
}

/// Euler's rule brakes the pendulum, and the experiment says so.
#[test]
fn what_is_off_is_told() {
    let outcome = run("pendulum", Integrator::Euler);
    assert!(outcome.quantities.iter().any(|quantity| quantity.name.starts_with("energy") && !quantity.is_right()));
    assert!(!outcome.is_right());
}

#[test]
fn friction_on_drums_and_pegs_is_right() {
    is_right("capstan");
    is_right("obstacle-course");
}

#[test]
fn ropes_that_touch_are_right() {
    is_right("two-ropes");
    is_right("knot");
    is_right("packing");
}

#[test]
fn a_run_that_is_interrupted_has_no_result() {
    let experiment = &experiments()[0];
    assert!(experiment.run(&Settings::default(), &mut || false).is_err());
}

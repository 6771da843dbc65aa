//! The scene `drum`: friction alone winds the rope, and lets it slip where it is too weak for the weight.

use nalgebra::Vector3;
use rod::{Friction, State};
use scene::Scene;
use solver::component::Members;
use solver::formulation::Formulation;
use solver::guess::GuessKind;
use solver::simulation::{Settings, Simulation};
use solver::step::Status;
use solver::topology::Topology;

/// Radii of drum and rope [m].
const DRUM: f64 = 0.1;
const ROPE: f64 = 0.005;

/// Runs the scene with formulation `newton`, which balances forces; `look` sees each state with its time.
fn run(scene: &Scene, mut look: impl FnMut(f64, &State)) {
    let mut settings = Settings::default();
    settings.step.formulation = Formulation::Newton;
    let build = |m: &rod::Model, s: &Members, t: &Topology| GuessKind::StepAdaptive.build(m, s, t);
    let mut simulation = Simulation::new(&scene.model, &scene.state, &settings, Some(&build)).unwrap();
    let mut now = scene.state.clone();
    for step in 0..scene.run.steps {
        let report = simulation.step(scene.run.dt).unwrap();
        assert!(report.status <= Status::ConvergedInSubsteps, "step {step}: {:?}", report.status);
        simulation.store(&mut now);
        look(simulation.time(), &now);
    }
    let deepest = simulation.counters().deepest_penetration;
    assert!(deepest < 0.02, "{deepest}");
}

/// The rope's axis is wound at the radius R + r: the weight follows the drum's turn there and back.
#[test]
fn the_drum_hoists_the_weight_by_friction() {
    let scene = scene::builtin("drum").unwrap();
    let drum = &scene.model.contacts.obstacles[0];
    let turned = |time: f64| {
        // From -y the drum turns to lift; the angle is below a whole turn.
        let turn = drum.at(time).pose.orientation * Vector3::x();
        turn.z.atan2(turn.x).rem_euclid(std::f64::consts::TAU)
    };
    let mut worst = 0.0_f64;
    let mut highest = 0.0_f64;
    run(&scene, |time, now| {
        let lifted = now.positions[0].z - scene.state.positions[0].z;
        let expected = (DRUM + ROPE) * turned(time);
        if time > 0.51 {
            worst = worst.max((lifted - expected).abs());
        }
        highest = highest.max(lifted);
    });
    println!("lifted by {highest:.4} m, {worst:.4} m off the drum's turn at worst");
    // 240 degrees; the weight swings a little, and what a contact's tolerance lets slip is a thousandth of a radius a step.
    assert!(highest > 0.43 && worst < 0.01, "{highest} {worst}");
}

/// One and a half turns hold a ratio of pulls of exp(3 pi mu): at a coefficient of 0.2 only 6.6 of the 20 there are.
#[test]
fn on_a_smoother_drum_the_weight_comes_down() {
    let mut scene = scene::builtin("drum").unwrap();
    scene.model.contacts.obstacles[0].surface.friction = Friction::new(0.2);
    scene.run.steps = 30;
    let mut lifted = 0.0;
    run(&scene, |_, now| lifted = now.positions[0].z - scene.state.positions[0].z);
    assert!(lifted < -0.15, "{lifted}");
}

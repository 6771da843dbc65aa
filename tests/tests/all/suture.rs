//! A suture pulled through a ring: while it slides, the pull is the weight's times `exp(mu theta)` (Euler and Eytelwein).

use cosserat::guess::{GuessKind, Members, Topology};
use cosserat::scene;
use cosserat::simulation::{Formulation, Settings, Simulation, Status};
use cosserat::state::{JointForce, Model};

const FRICTION: f64 = 0.2;
/// Radii of the ring's rim and of the suture [m].
const RIM: f64 = 0.004;
const SUTURE: f64 = 0.00025;

#[test]
fn the_pull_on_a_sliding_suture_is_the_weight_s_and_the_rim_s_friction() {
    let scene = scene::builtin("suture").unwrap();
    let mut settings = Settings::default();
    settings.step.formulation = Formulation::Newton;
    let build =
        |model: &Model, members: &Members, topology: &Topology| GuessKind::StepAdaptive.build(model, members, topology);
    let mut simulation = Simulation::new(&scene.model, &scene.state, &settings, Some(&build)).unwrap();
    let mut forces = vec![JointForce::default(); scene.model.joints.len()];
    let mut state = scene.state.clone();
    let (mut steps, mut log_ratio, mut angle) = (0.0, 0.0, 0.0);
    for step in 0..scene.run.steps {
        let report = simulation.step(scene.run.dt).unwrap();
        assert!(report.status <= Status::ConvergedInSubsteps, "step {step}: {:?}", report.status);
        // It is drawn at 13 to 20 mm/s then.
        let time = simulation.time();
        if time < 1.4 {
            continue;
        } else if time > 2.6 {
            break;
        }
        simulation.store_joint_forces(&mut forces);
        simulation.store(&mut state);
        // The straight runs on either side of the rim; the tail swings a little.
        let (tail, pull) = (4, scene.model.segments.len() - 5);
        log_ratio += (forces[pull].force.norm() / forces[tail].force.norm()).ln();
        angle += state.axis(tail).angle(&state.axis(pull));
        steps += 1.0;
    }
    let [log_ratio, angle] = [log_ratio, angle].map(|sum| sum / steps);
    // Friction acts at the suture's surface: about the rim's axis its lever arm is that of the rim.
    let expected = FRICTION * angle * RIM / (RIM + SUTURE);
    println!("ln(pull / weight) = {log_ratio:.4}, expected {expected:.4} for {angle:.3} rad");
    // Four or five segments touch the rim; with segments twice as long, 5 % are missing.
    assert!((log_ratio / expected - 1.0).abs() < 0.02, "{log_ratio} {expected}");
}

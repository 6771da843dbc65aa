//! Rods that run through eyelets: theory, conserved quantities, refinement.

use dynamics::simulation::{Settings, Simulation};
use dynamics::step::{Status, StepParams};
use nalgebra::{UnitQuaternion, Vector3};
use rod::measure::energy;
use rod::{Assembly, Body, Integrator, Material, Model, Pose, RodSpec, Sliding, SlidingJoint, State};

fn settings(integrator: Integrator) -> Settings {
    Settings { step: StepParams { integrator, ..StepParams::DEFAULT }, ..Settings::default() }
}

/// A rope that hangs over an eyelet at the origin: so many segments of 0.1 m on the left and on the right, straight down but for two in the
/// middle, with masses at its ends.
fn hung(left: usize, right: usize, masses: [f64; 2], friction: f64, bending: f64) -> (Model, State) {
    let mut assembly = Assembly::new(Vector3::z() * -9.81);
    let h = 0.1;
    let mut nodes = Vec::new();
    for k in (1..=left).rev() {
        nodes.push(Vector3::new(-0.02 - 0.05, 0.0, -h * (k as f64 - 0.3)));
    }
    nodes.push(Vector3::new(-0.05, 0.0, 0.0));
    nodes.push(Vector3::new(0.05, 0.0, 0.0));
    for k in 1..=right {
        nodes.push(Vector3::new(0.02 + 0.05, 0.0, -h * (k as f64 - 0.3)));
    }
    let material = Material { youngs_modulus: bending, torsion_modulus: bending, density: 100.0 };
    let rod = assembly.rod(&RodSpec { rest: rod::RestShape::Straight, ..RodSpec::new(nodes, 0.002, material) });
    assembly.add_mass(rod.start, masses[0]).add_mass(rod.end - 1, masses[1]);
    let (mut model, state) = assembly.finish();
    model.anchors.push(Pose { position: Vector3::zeros(), orientation: UnitQuaternion::identity() });
    let lengths = model.segments.iter().map(|segment| segment.length);
    let middle: f64 = lengths.clone().take(left).sum::<f64>() + 0.05;
    model.sliding_joints.push(SlidingJoint {
        segments: rod,
        holder: Body::Anchor(0),
        place: Vector3::zeros(),
        start: middle,
        friction,
    });
    (model, state)
}

#[test]
fn try_it() {
    for (friction, masses) in [(0.0, [1.0, 1.0]), (0.0, [1.0, 1.8]), (0.2, [1.0, 1.2]), (0.2, [1.0, 2.5])] {
        let (model, mut state) = hung(10, 10, masses, friction, 1e6);
        let mut simulation = Simulation::new(&model, &state, &settings(Integrator::Bdf2), None).unwrap();
        let mut sliding = [Sliding { place: 0.0, rate: 0.0, force: Vector3::zeros() }];
        println!("friction {friction} masses {masses:?}");
        for step in 0..60 {
            let report = simulation.step(0.01).unwrap();
            simulation.store(&mut state);
            simulation.store_sliding(&mut sliding);
            if step % 6 == 5 {
                println!(
                    "{} {:?} {:.5} {:.4} {:?} E {:.6} it {}",
                    step,
                    report.status,
                    sliding[0].place,
                    sliding[0].rate,
                    sliding[0].force.as_slice(),
                    energy(&model, &state).total(),
                    simulation.counters().iterations
                );
            }
            if report.status > Status::ConvergedInSubsteps {
                break;
            }
        }
    }
}

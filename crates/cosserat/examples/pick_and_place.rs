//! A gripper picks a cable up from where it hangs, carries it aside and lets it go: what is held is decided on the way.

use std::error::Error;
use std::sync::Arc;

use cosserat::prelude::*;

const DT: f64 = 0.01;

/// What came of it: places [m] of the segment that the gripper holds, as it takes it, as it lets it go, and later.
struct Places {
    taken: Vector3<f64>,
    released: Vector3<f64>,
    fallen: Vector3<f64>,
}

fn work() -> Result<Places, Box<dyn Error>> {
    let cable = Material { youngs_modulus: 5e6, torsion_modulus: 2e6, density: 1200.0 };
    let nodes = shape::straight(Vector3::zeros(), Vector3::new(0.2, 0.0, -1.0), 1.0, 40);
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    let rod = assembly.rod(&RodSpec::new(nodes, 0.006, cable));
    assembly.clamp_start(&rod);
    assembly.damping(Damping { linear: 1.0, angular: 1.0 });
    let (mut model, mut state) = assembly.finish();
    // A pin: the cable turns freely about its upper end.
    let pin = model.joints_of(&rod)[0];
    model.pin(pin);

    let mut simulation = Simulation::new(&model, &state, &Settings::default(), None)?;
    let go = |simulation: &mut Simulation, state: &mut State, steps: usize| {
        for _ in 0..steps {
            simulation.step(DT)?;
        }
        simulation.store(state);
        Ok::<_, SimulationError>(())
    };
    go(&mut simulation, &mut state, 100)?;

    // The gripper is wherever it is, and takes the cable's last segment along as one rigid body.
    let held = Body::Segment(rod.end - 1);
    let taken = state.positions[rod.end - 1];
    let (now, home) = (simulation.time(), Vector3::new(0.0, 0.3, -1.0));
    let frame =
        |time: f64, shift: Vector3<f64>| Keyframe { time: now + time, position: home + shift, turn: Vector3::zeros() };
    let frames = [frame(0.0, Vector3::zeros()), frame(1.5, Vector3::new(0.0, 0.3, 0.3))];
    let motion = Motion::new(UnitQuaternion::identity(), &frames, Interpolation::Smooth)?;
    simulation.attach(held, Some(Arc::new(motion)))?;
    go(&mut simulation, &mut state, 150)?;
    let released = state.positions[rod.end - 1];

    simulation.release(held)?;
    go(&mut simulation, &mut state, 500)?;
    Ok(Places { taken, released, fallen: state.positions[rod.end - 1] })
}

fn main() -> Result<(), Box<dyn Error>> {
    let Places { taken, released, fallen } = work()?;
    for (what, x) in [("taken", taken), ("released", released), ("five seconds later", fallen)] {
        println!("{what}: x = {:6.3} m, y = {:6.3} m, z = {:6.3} m", x.x, x.y, x.z);
    }
    Ok(())
}

#[test]
fn the_cable_is_carried_as_the_gripper_goes_and_swings_back() -> Result<(), Box<dyn Error>> {
    let Places { taken, released, fallen } = work()?;
    assert!((released - taken - Vector3::new(0.0, 0.3, 0.3)).norm() < 1e-12);
    // It hangs under its pin again.
    assert!(fallen.xy().norm() < 0.1 && fallen.z < -0.95, "{fallen}");
    Ok(())
}

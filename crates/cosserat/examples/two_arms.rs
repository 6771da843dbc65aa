//! A cable between two arms that a program moves: one lifts its end, then the other turns its own, and the program reads
//! what each arm has to hold.
//!
//! What an arm does next is decided on the way: a motion begins at the time at which it is given, from where the grip is.

use std::error::Error;
use std::f64::consts::TAU;
use std::sync::Arc;

use cosserat::prelude::*;

const DT: f64 = 0.01;

/// An arm that holds a face of the cable.
struct Arm {
    body: Body,
    /// Where the grip is, and where it goes next.
    pose: Pose,
}

impl Arm {
    /// Moves the grip by `shift` [m] and turns it by the rotation vector `turn` [rad], in `seconds` from now on.
    fn go(&mut self, simulation: &mut Simulation, shift: Vector3<f64>, turn: Vector3<f64>, seconds: f64) {
        let (now, from) = (simulation.time(), self.pose);
        let frames = [
            Keyframe { time: now, position: from.position, turn: Vector3::zeros() },
            Keyframe { time: now + seconds, position: from.position + shift, turn },
        ];
        let motion = Motion::new(from.orientation, &frames, Interpolation::Smooth).expect("two times in order");
        self.pose = motion.at(now + seconds).pose;
        simulation.drive(&Driven::new(self.body, Arc::new(motion))).expect("an anchor of the model");
    }
}

/// What came of the work.
struct Held {
    /// The cable's weight [N].
    weight: f64,
    /// What the arms hold at the end of each task.
    arms: Vec<[Reaction; 2]>,
}

fn work() -> Result<Held, Box<dyn Error>> {
    let cable = Material { youngs_modulus: 5e6, torsion_modulus: 2e6, density: 1200.0 };
    let nodes = shape::straight(Vector3::zeros(), Vector3::x(), 1.0, 40);
    let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
    let rod = assembly.rod(&RodSpec::new(nodes, 0.006, cable));
    assembly.clamp_start(&rod).clamp_end(&rod);
    assembly.damping(Damping { linear: 2.0, angular: 2.0 });
    let (mut model, mut state) = assembly.finish();
    let weight = model.segments.iter().map(|segment| 9.81 * segment.mass()).sum();

    let mut arms = [0, 1].map(|i| Arm { body: Body::Anchor(i), pose: model.anchors[i] });
    let mut simulation = Simulation::new(&model, &state, &Settings::default(), None)?;
    let mut forces = vec![JointForce::default(); model.joints.len()];
    let (mut before, mut held) = (state.clone(), Held { weight, arms: Vec::new() });
    for task in 0..3 {
        match task {
            0 => arms[1].go(&mut simulation, Vector3::x() * -0.3, Vector3::zeros(), 1.0),
            1 => arms[0].go(&mut simulation, Vector3::z() * 0.2, Vector3::zeros(), 1.0),
            _ => arms[1].go(&mut simulation, Vector3::zeros(), Vector3::x() * TAU, 2.0),
        }
        for _ in 0..500 {
            simulation.store(&mut before);
            simulation.step(DT)?;
        }
        simulation.store(&mut state);
        simulation.store_joint_forces(&mut forces);
        // The model's anchors are where the arms have taken them.
        for (i, arm) in arms.iter().enumerate() {
            model.anchors[i] = arm.pose;
        }
        let all = Reaction::all(&model, [&before, &state], [0.0, DT], &forces, &[]);
        held.arms.push([all[0], all[1]]);
    }
    Ok(held)
}

fn main() -> Result<(), Box<dyn Error>> {
    let Held { weight, arms: held } = work()?;
    println!("the cable weighs {weight:.3} N");
    for (task, arms) in ["pushed together", "one end lifted", "twisted by a turn"].iter().zip(held) {
        for (arm, Reaction { force, moment, .. }) in arms.iter().enumerate() {
            println!("{task}: arm {arm} holds {:6.3} N up, and {:7.4} N m about x", force.z, moment.x);
        }
    }
    Ok(())
}

#[test]
fn the_arms_carry_the_cable_and_its_twist() -> Result<(), Box<dyn Error>> {
    let Held { weight, arms: held } = work()?;
    for [first, second] in &held {
        let carried = first.force.z + second.force.z;
        assert!((carried - weight).abs() < 2e-3 * weight, "{carried} N of {weight} N");
    }
    // The higher arm carries more; a turn takes a moment that nothing else asked for.
    assert!(held[1][0].force.z > held[1][1].force.z);
    assert!(held[2][1].moment.x.abs() > 10.0 * held[0][1].moment.x.abs());
    Ok(())
}

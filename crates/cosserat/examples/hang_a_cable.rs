//! A cable between two clamps comes to rest: its sag, and the tension at the grips.

use std::error::Error;

use cosserat::prelude::*;

/// Distance of the grips, and the cable's length between them [m].
const SPAN: f64 = 20.0;
const LENGTH: f64 = 20.5;
const SEGMENTS: usize = 100;

/// What is read off the cable at rest.
struct Hanging {
    /// How far its lowest point is below the grips [m].
    sag: f64,
    /// Tension in its first and in its last joint [N].
    tensions: [f64; 2],
    /// Weight of its free segments [N].
    weight: f64,
    /// What both grips bear of it, upwards [N].
    borne: f64,
}

fn hang() -> Result<Hanging, Box<dyn Error>> {
    let (gravity, to) = (Vector3::new(0.0, 0.0, -9.81), Vector3::x() * SPAN);
    let (from, start_direction, end_direction) = (Vector3::zeros(), None, None);
    let catenary = shape::Hung { from, to, length: LENGTH, start_direction, end_direction, gravity };
    let nodes = catenary.nodes(SEGMENTS).ok_or("the cable is too short")?;
    let rope = Material { youngs_modulus: 1e8, torsion_modulus: 4e7, density: 1200.0 };
    let straight_at_rest = RodSpec { rest: RestShape::Straight, ..RodSpec::new(nodes, 0.01, rope) };
    let mut assembly = Assembly::new(gravity);
    let cable = assembly.rod(&straight_at_rest);
    assembly.fix(cable.start).fix(cable.end - 1);
    let (model, mut state) = assembly.finish();

    let report = statics::equilibrium(&model, &mut state, &StaticParams::default())?;
    if !report.converged {
        return Err("the cable does not come to rest".into());
    }

    // A short step of implicit Euler from rest moves nothing and says what the joints transmit.
    let step = StepParams { formulation: Formulation::Newton, ..StepParams::default() };
    let mut simulation = Simulation::new(&model, &state, &Settings { step, ..Settings::default() }, None)?;
    simulation.step(1e-3)?;
    let mut forces = vec![JointForce::default(); model.joints.len()];
    simulation.store_joint_forces(&mut forces);

    let joints = model.joints_of(&cable);
    let [first, last] = [joints[0], joints[joints.len() - 1]];
    let free = model.segments.iter().filter(|segment| !segment.fixed);
    Ok(Hanging {
        sag: -state.positions.iter().map(|x| x.z).fold(0.0, f64::min),
        tensions: [first, last].map(|joint| forces[joint].tension(&model, &state, &model.joints[joint])),
        weight: 9.81 * free.map(Segment::mass).sum::<f64>(),
        // A joint's force is that of its second body on its first: of the cable on the first grip, of the last grip on the
        // cable.
        borne: forces[last].force.z - forces[first].force.z,
    })
}

fn main() -> Result<(), Box<dyn Error>> {
    let cable = hang()?;
    println!("A cable of {LENGTH} m between two grips {SPAN} m apart sags by {:.3} m.", cable.sag);
    println!("Tension at the grips: {:.2} N and {:.2} N.", cable.tensions[0], cable.tensions[1]);
    println!("The grips bear {:.4} N of its free part's weight of {:.4} N.", cable.borne, cable.weight);
    Ok(())
}

#[test]
fn the_grips_bear_the_weight_of_a_catenary() -> Result<(), Box<dyn Error>> {
    let cable = hang()?;
    assert!((cable.borne / cable.weight - 1.0).abs() < 1e-6, "{} N of {} N", cable.borne, cable.weight);
    // Each is measured along the axis of its joint's first body: the grip here, the cable's last free segment there.
    assert!((cable.tensions[0] / cable.tensions[1] - 1.0).abs() < 1e-3);
    // A catenary of parameter a has the length 2 a sinh(span / 2a); the tension at its ends is w (a + sag).
    let length = |a: f64| 2.0 * a * (SPAN / (2.0 * a)).sinh();
    let (mut low, mut high) = (1.0, 1e3);
    for _ in 0..100 {
        let a = 0.5 * (low + high);
        *(if length(a) > LENGTH { &mut low } else { &mut high }) = a;
    }
    let sag = low * ((SPAN / (2.0 * low)).cosh() - 1.0);
    let weight_per_metre = cable.weight / (LENGTH * (1.0 - 2.0 / SEGMENTS as f64));
    let tension = weight_per_metre * (low + sag);
    // The clamps hold the first and the last segment in a direction that is not quite the catenary's.
    assert!((cable.sag / sag - 1.0).abs() < 0.02, "{} m, a catenary {sag} m", cable.sag);
    assert!((cable.tensions[0] / tension - 1.0).abs() < 0.02, "{} N, a catenary {tension} N", cable.tensions[0]);
    Ok(())
}

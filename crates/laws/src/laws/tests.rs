//! Steps that keep all laws, and what a law says where they are spoilt.

use cosserat::scene;
use cosserat::simulation::{ContactForce, Formulation, Integrator, Simulation, SolverKind, Status, Touched};
use cosserat::state::{JointForce, Model, State};
use nalgebra::{UnitQuaternion, Vector3};

use super::*;
use crate::case::Method;
use crate::exclusion::Excluded;
use crate::law::Law;

/// With Euler's rule a step knows nothing of those before the last.
const METHOD: Method =
    Method { formulation: Formulation::Newton, integrator: Integrator::Euler, solver: SolverKind::Direct };

/// A step of a scene, with all that laws look at.
struct Seen {
    model: Model,
    states: [State; 3],
    forces: [Vec<JointForce>; 2],
    contacts: Vec<ContactForce>,
    time: f64,
    dt: f64,
    status: Status,
}

/// The last of some steps of a scene.
fn seen(text: &str, steps: usize) -> Seen {
    let scene = scene::parse(text, "scene.toml").unwrap();
    let mut simulation = Simulation::new(&scene.model, &scene.state, &METHOD.settings(), None).unwrap();
    let mut states = [scene.state.clone(), scene.state.clone(), scene.state.clone()];
    let none = vec![JointForce::default(); scene.model.joints.len()];
    let mut forces = [none.clone(), none];
    let mut status = Status::Converged;
    for _ in 0..steps {
        status = simulation.step(scene.run.dt).unwrap().status;
        states.rotate_left(1);
        forces.swap(0, 1);
        simulation.store(&mut states[2]);
        simulation.store_joint_forces(&mut forces[1]);
    }
    let mut contacts = Vec::new();
    simulation.store_contact_forces(&mut contacts);
    let (time, dt) = (simulation.time(), scene.run.dt);
    Seen { model: scene.model, states, forces, contacts, time, dt, status }
}

impl Seen {
    /// Laws that are broken.
    fn broken(&self) -> Vec<Law> {
        let excluded = Excluded::new(&self.model);
        let [earlier, before, after] = &self.states;
        let step = Step {
            number: 1,
            model: &self.model,
            model_before: &self.model,
            states: [before, after],
            earlier: Some(earlier),
            forces: [&self.forces[0], &self.forces[1]],
            contacts: &self.contacts,
            sliding: &[],
            time: self.time,
            dt: self.dt,
            status: self.status,
            method: &METHOD,
            excluded: &excluded,
        };
        let mut violations = Vec::new();
        laws(&step, &mut EnergyBalance::default(), &mut violations);
        let mut laws: Vec<Law> = violations.iter().map(|one| one.law).collect();
        laws.sort();
        laws.dedup();
        laws
    }
}

const HANGING: &str = "run.dt_s = 0.005\n[[rods]]\nradius_m = 0.01\nyoungs_modulus_pa = 1e7\nclamp = [\"start-face\"]\n\
                       shape.straight = { length_m = 1, segments = 6 }\n";

const LYING: &str = "run.dt_s = 0.005\n[[obstacles]]\nshape.plane = { point_m = [0, 0, -0.0101] }\nfriction = 0.4\n[[rods]]\n\
                     radius_m = 0.01\nyoungs_modulus_pa = 1e7\nvelocity_m_s = [1, 0, 0]\n\
                     shape.straight = { length_m = 1, segments = 6 }\n";

#[test]
fn a_rod_that_swings_keeps_all_laws_until_its_numbers_are_spoilt() {
    let good = seen(HANGING, 10);
    assert_eq!((good.broken(), good.status), (vec![], Status::Converged));
    let spoilt = |spoil: &dyn Fn(&mut Seen)| {
        let mut seen = seen(HANGING, 10);
        spoil(&mut seen);
        seen.broken()
    };
    let pushed = spoilt(&|seen| seen.states[2].velocities[5].x += 0.5);
    assert!(pushed.contains(&Law::LinearMomentum) && pushed.contains(&Law::Energy), "{pushed:?}");
    // To and fro: the sum stays.
    let turned = spoilt(&|seen| {
        seen.states[2].velocities[5].z += 0.1;
        seen.states[2].velocities[4].z -= 0.1;
    });
    assert!(turned.contains(&Law::AngularMomentum) && !turned.contains(&Law::LinearMomentum), "{turned:?}");
    let apart = spoilt(&|seen| seen.states[2].positions[5].x += 0.2);
    assert!(apart.contains(&Law::Residual) && apart.contains(&Law::Open), "{apart:?}");
    let bent = spoilt(&|seen| {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::y() * 1e-4);
        seen.states[2].orientations[3] = turn * seen.states[2].orientations[3];
    });
    assert_eq!(bent, [Law::Residual]);
    assert_eq!(spoilt(&|seen| seen.forces[1][0].force.x = f64::NAN), [Law::Finite]);
    // What is not solved may be anything but not finite, and gapes.
    assert_eq!(
        spoilt(&|seen| {
            seen.states[2].positions[5].x += 0.2;
            seen.status = Status::Apart;
        }),
        []
    );
}

#[test]
fn a_rod_that_slides_keeps_all_laws_until_its_contacts_are_spoilt() {
    let good = seen(LYING, 10);
    assert_eq!((good.broken(), good.status), (vec![], Status::Converged));
    assert!(good.contacts.iter().all(|contact| contact.force.x < 0.0 && contact.slip.x > 0.0), "{:?}", good.contacts);
    let spoilt = |spoil: &dyn Fn(&mut Seen)| {
        let mut seen = seen(LYING, 10);
        spoil(&mut seen);
        seen.broken()
    };
    let pulled = spoilt(&|seen| seen.contacts[0].force.z *= -1.0);
    assert!(pulled.contains(&Law::Cone) && pulled.contains(&Law::LinearMomentum), "{pulled:?}");
    let rough = spoilt(&|seen| seen.contacts[0].force.x *= 2.0);
    assert!(rough.contains(&Law::Cone), "{rough:?}");
    let driven = spoilt(&|seen| seen.contacts[0].force.x *= -1.0);
    assert!(driven.contains(&Law::Friction) && !driven.contains(&Law::Cone), "{driven:?}");
    let deep = spoilt(&|seen| seen.states[2].positions.iter_mut().for_each(|x| x.z -= 1e-4));
    assert!(deep.contains(&Law::Depth) && !deep.contains(&Law::Passing), "{deep:?}");
    let through = spoilt(&|seen| seen.states[2].positions.iter_mut().for_each(|x| x.z -= 0.02));
    assert!(through.contains(&Law::Passing), "{through:?}");
    let nothing = spoilt(&|seen| seen.contacts[0].other = Touched::Segment(3));
    assert!(nothing.contains(&Law::Cone), "{nothing:?}");
}

#[test]
fn axes_that_pass_through_each_other_are_seen() {
    let text = "[contact]\n[[rods]]\nradius_m = 0.01\nshape.straight = { length_m = 1, segments = 2 }\n[[rods]]\n\
                radius_m = 0.01\nshape.straight = { start_m = [0.3, -0.5, 0.1], direction = [0, 1, 0], length_m = 1, segments = 2 }\n";
    let mut seen = seen(text, 1);
    assert_eq!(seen.broken(), []);
    for x in &mut seen.states[2].positions[2..4] {
        x.z -= 0.2;
    }
    assert!(seen.broken().contains(&Law::Passing));
    // Beside each other they may.
    for k in 1..3 {
        seen.states[k].positions[2..4].iter_mut().for_each(|x| x.x += 2.0);
    }
    assert!(!seen.broken().contains(&Law::Passing));
}

//! More contacts than their matrix may have blocks: a status of its own, without substeps.

use dynamics::formulation::ContactProjection;
use dynamics::simulation::{Settings, Simulation};
use dynamics::step::Status;
use nalgebra::{Unit, Vector3};
use rod::{Assembly, Material, Obstacle, ObstacleShape, RodSpec, Surface, shape};

/// A rod of eight segments that rests on the ground presses it at nine places: 81 blocks.
#[test]
fn too_many_contacts_are_said_and_no_step_is_halved() {
    let radius = 0.02;
    let rubber = Material { youngs_modulus: 1e7, torsion_modulus: 4e6, density: 1000.0 };
    let mut assembly = Assembly::new(Vector3::z() * -9.81);
    let nodes = shape::straight(Vector3::z() * radius, Vector3::x(), 1.0, 8);
    assembly.rod(&RodSpec::new(nodes, radius, rubber));
    let (mut model, state) = assembly.finish();
    let ground = ObstacleShape::HalfSpace { point: Vector3::zeros(), normal: Unit::new_normalize(Vector3::z()) };
    model.contacts.obstacles.push(Obstacle::new(ground, Surface::default()));
    for contact_projection in [ContactProjection::Coupled, ContactProjection::Alternating] {
        for max_blocks in [81, 80] {
            let mut settings = Settings::default();
            settings.step.contact_projection = contact_projection;
            settings.step.contact.max_blocks = max_blocks;
            let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
            let status = simulation.step(0.02).unwrap().status;
            let counters = simulation.counters();
            if max_blocks == 81 {
                assert!(status <= Status::ConvergedInSubsteps, "{contact_projection:?}: {status:?}");
                assert!(counters.contact_solves > 0);
                continue;
            }
            assert_eq!(status, Status::TooManyContacts, "{contact_projection:?}");
            let mut after = state.clone();
            simulation.store(&mut after);
            assert_eq!(after, state, "the segments stay where they were");
            assert_eq!((counters.retries, counters.contact_solves, counters.not_converged), (0, 0, 1));
        }
    }
}

//! Forces of contacts, as a program reads them off.

use dynamics::formulation::Formulation;
use dynamics::simulation::{ContactForce, Simulation, Touched, contact_wrenches};
use dynamics::step::Status;
use jointed::linear::solvers::SolverKind;
use nalgebra::Vector3;
use rod::{
    Air, Assembly, Contacts, Damping, Friction, Model, Obstacle, ObstacleShape, Reaction, RodSpec, State, Surface,
    Wind, shape,
};

use crate::common::*;

/// A rod on the ground, or two: the second lies across the first. The ground slopes by `slope`.
fn lying(rods: usize, slope: f64, friction: f64) -> (Model, State) {
    let normal = Vector3::new(-slope, 0.0, 1.0).normalize();
    let along = Vector3::new(1.0, 0.0, slope).normalize();
    let mut assembly = Assembly::new(GRAVITY);
    for k in 0..rods {
        let direction = if k == 0 { along } else { Vector3::y() };
        let height = 0.0101 + 0.0202 * k as f64;
        let nodes = shape::straight(direction * -0.25 + normal * height, direction, 0.5, 10);
        assembly.rod(&RodSpec::new(nodes, 0.01, material(1e8, 1000.0)));
    }
    assembly.damping(Damping { linear: 1.0, angular: 1.0 });
    let surface = Surface { friction: Friction::new(friction), restitution: 0.0 };
    let shape = ObstacleShape::HalfSpace { point: Vector3::zeros(), normal: nalgebra::Unit::new_normalize(normal) };
    assembly.model_mut().contacts = Contacts {
        between_segments: (rods > 1).then_some(surface),
        obstacles: vec![Obstacle::new(shape, surface)],
        allow_overlap: false,
        sheaths: Vec::new(),
    };
    assembly.finish()
}

fn weight(model: &Model) -> f64 {
    model.segments.iter().map(|segment| 9.81 * segment.mass()).sum()
}

/// The forces after so many steps, contacts solved to a tolerance, and the change of the momentum in the last one over its
/// time [N].
fn forces(
    (model, state): (&Model, &State),
    formulation: Formulation,
    steps: usize,
    tolerance: f64,
) -> (Vec<ContactForce>, Vector3<f64>) {
    let mut settings = settings(formulation, SolverKind::Direct);
    settings.step.contact_tolerance = tolerance;
    let mut simulation = Simulation::new(model, state, &settings, None).unwrap();
    let (mut before, mut after, mut forces) = (state.clone(), state.clone(), Vec::new());
    simulation.store_contact_forces(&mut forces);
    assert!(forces.is_empty(), "before the first step");
    let mut status = Status::Converged;
    for _ in 0..steps {
        std::mem::swap(&mut before, &mut after);
        status = simulation.step(DT).unwrap().status;
        simulation.store(&mut after);
    }
    assert_eq!(status, Status::Converged, "{formulation}: of a step in parts forces are those of the last part");
    simulation.store_contact_forces(&mut forces);
    let momentum = |state: &State| -> Vector3<f64> {
        model.segments.iter().zip(&state.velocities).map(|(segment, v)| v * segment.mass()).sum()
    };
    // What damping takes is no force of contacts.
    let kept = (-model.damping.linear * DT).exp();
    (forces, (momentum(&after) - momentum(&before) * kept) / DT)
}

#[test]
fn the_ground_bears_the_weight_of_what_rests_on_it() {
    for formulation in Formulation::ALL {
        let (model, state) = lying(1, 0.0, 0.5);
        let (forces, _) = forces((&model, &state), formulation, 300, 1e-5);
        let sum: Vector3<f64> = forces.iter().map(|contact| contact.force).sum();
        // At rest nothing but the weight is left. A step is good enough with a gap of 1e-5 of the radius, which over dt^2 is
        // 3e-5 of gravity; velocities that are not damped away yet are the rest.
        let weight = weight(&model);
        assert!((sum - Vector3::z() * weight).norm() < 1e-3 * weight, "{formulation}: {sum} of {weight}");
        for contact in &forces {
            assert_eq!(contact.other, Touched::Obstacle(0));
            assert!((contact.normal - Vector3::z()).norm() < 1e-12);
            assert!(contact.place.z.abs() < 1e-3 * 0.01 + 1e-12, "{}", contact.place);
            let along = (contact.place - state.positions[contact.segment]).x.abs();
            assert!(along < 0.03, "{along} m from the centre of its segment");
        }
    }
}

#[test]
fn forces_are_what_changes_the_momentum_at_any_time() {
    // While it falls, hits and slides: to rounding errors, for contacts and joints push their bodies and nothing else.
    for formulation in Formulation::ALL {
        for (rods, steps) in [(1, 3), (1, 20), (2, 10), (2, 60)] {
            let (model, mut state) = lying(rods, 0.2, 0.3);
            state.velocities.iter_mut().for_each(|v| *v = Vector3::new(0.1, 0.3, -0.2));
            let (forces, change) = forces((&model, &state), formulation, steps, 1e-3);
            let ground = forces.iter().filter(|contact| matches!(contact.other, Touched::Obstacle(_)));
            let sum: Vector3<f64> = ground.map(|contact| contact.force).sum();
            let expected = change + Vector3::z() * weight(&model);
            let apart = (sum - expected).norm() / weight(&model);
            assert!(apart < 1e-8, "{formulation}, {rods} rods after {steps} steps: {sum} {expected}");
        }
    }
}

#[test]
fn friction_holds_on_a_slope_and_slides_within_its_cone() {
    for (friction, slides) in [(0.5, false), (0.1, true)] {
        let (model, state) = lying(1, 0.2, friction);
        let (forces, _) = forces((&model, &state), Formulation::Newton, 100, 1e-3);
        assert!(!forces.is_empty());
        let slip = forces.iter().map(|contact| contact.slip.norm()).fold(0.0, f64::max);
        assert_eq!(slip > 1e-4, slides, "{slip} m in a step");
        for ContactForce { normal, force, .. } in &forces {
            let pressing = force.dot(normal);
            let rubbing = (force - normal * pressing).norm();
            assert!(pressing >= 0.0 && rubbing <= friction * pressing * (1.0 + 1e-6) + 1e-9, "{rubbing} {pressing}");
        }
        let pressing: f64 = forces.iter().map(|contact| contact.force.dot(&contact.normal)).sum();
        let expected = weight(&model) / 1.04_f64.sqrt();
        assert!((pressing / expected - 1.0).abs() < 1e-2, "{pressing} N of {expected} N");
    }
}

#[test]
fn a_rod_bears_the_one_that_lies_on_it() {
    let (model, state) = lying(2, 0.0, 0.5);
    let (forces, _) = forces((&model, &state), Formulation::Newton, 300, 1e-3);
    let between: Vec<_> = forces.iter().filter(|contact| matches!(contact.other, Touched::Segment(_))).collect();
    assert!(!between.is_empty());
    for contact in between {
        // The lower rod's segments come first, and the one that lies on it pushes it down.
        assert!(contact.segment < 10 && contact.force.z < 0.0 && contact.normal.z < 0.0, "{contact:?}");
    }
}

/// A held rod carries another one that lies across it off its middle, in air that blows on both.
#[test]
fn a_grip_bears_what_presses_on_its_segment_and_the_air_on_it() {
    let held = shape::straight(Vector3::zeros(), Vector3::x(), 0.5, 1);
    let across = shape::straight(Vector3::new(0.35, -0.25, 0.0202), Vector3::y(), 0.5, 10);
    let mut assembly = Assembly::new(GRAVITY);
    let rod = assembly.rod(&RodSpec::new(held, 0.01, material(1e8, 1000.0)));
    assembly.rod(&RodSpec::new(across, 0.01, material(1e8, 1000.0)));
    assembly.fix(rod.start);
    let wind = Wind::steady(Vector3::new(0.0, 0.0, -3.0));
    assembly.air(Air { density: 1.2, normal_drag: 1.1, tangential_drag: 0.05, wind });
    let surface = Surface { friction: Friction::new(0.5), restitution: 0.0 };
    assembly.model_mut().contacts.between_segments = Some(surface);
    let (model, state) = assembly.finish();
    // A rod of these sizes weighs 1.541 N, and the wind presses it down with 0.5 rho C 2r L v^2.
    let drag = 0.5 * 1.2 * 1.1 * 0.02 * 0.5 * 9.0;
    let expected = weight(&model) + 2.0 * drag;
    let mut simulation =
        Simulation::new(&model, &state, &settings(Formulation::Newton, SolverKind::Direct), None).unwrap();
    let (mut before, mut after) = (state.clone(), state.clone());
    for _ in 0..200 {
        std::mem::swap(&mut before, &mut after);
        simulation.step(DT).unwrap();
        simulation.store(&mut after);
    }
    let (mut forces, mut contacts) = (Vec::new(), Vec::new());
    simulation.store_contact_forces(&mut forces);
    contact_wrenches(&forces, &after, &mut contacts);
    let end = simulation.time();
    let joints = vec![rod::JointForce::default(); model.joints.len()];
    let reaction = Reaction::all(&model, [&before, &after], [end - DT, end], &joints, &contacts)[0];
    assert!((reaction.force.z - expected).abs() < 1e-3 * expected, "{} N, not {expected}", reaction.force.z);
    // The other rod lies 0.1 m from the middle of the held one.
    let moment = -0.1 * 0.5 * expected;
    assert!((reaction.moment.y - moment).abs() < 2e-3 * moment.abs(), "{} N m, not {moment}", reaction.moment.y);
    let given = reaction.parts;
    assert!((given.drag.force.z + drag).abs() < 1e-12 && given.contacts.force.z < -0.5 * weight(&model), "{given:?}");
}

/// A thin cylinder that tumbles falls onto a slope: it turns so far in a step that contacts are looked for anew within it.
#[test]
fn friction_takes_energy_where_contacts_are_found_anew_within_a_step() {
    let normal = nalgebra::Unit::new_normalize(Vector3::new(-0.3, 0.2, 0.9));
    for (spin, fall, restitution) in [(2.0, 1.0, 0.0), (6.0, 1.0, 0.0), (9.0, 0.5, 0.0), (3.0, 1.0, 1.0)] {
        let mut assembly = Assembly::new(GRAVITY);
        let nodes = shape::straight(Vector3::zeros(), Vector3::x(), 0.5, 1);
        assembly.rod(&RodSpec::new(nodes, 0.01, material(1e6, 1000.0)));
        let surface = Surface { friction: Friction::new(0.6), restitution };
        let shape = ObstacleShape::HalfSpace { point: Vector3::z() * -0.3, normal };
        assembly.model_mut().contacts.obstacles = vec![Obstacle::new(shape, surface)];
        let state = assembly.state_mut();
        (state.velocities[0], state.angular_velocities[0]) =
            (Vector3::new(0.5, 1.0, -fall), Vector3::new(-3.0, spin, -1.0));
        let (model, state) = assembly.finish();
        let settings = settings(Formulation::Newton, SolverKind::Direct);
        let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
        let (mut forces, mut slid) = (Vec::new(), 0);
        for step in 1..=20 {
            let status = simulation.step(DT).unwrap().status;
            simulation.store_contact_forces(&mut forces);
            for contact in forces.iter().filter(|_| status <= Status::ConvergedInSubsteps) {
                let across = contact.force - contact.normal * contact.force.dot(&contact.normal);
                let (work, most) = (across.dot(&contact.slip), across.norm() * contact.slip.norm());
                // The direction of friction is exact to 2 % of the slip; slip below a thousandth of the radius is none.
                let allowed = 0.03 * most + 1e-5 * across.norm();
                assert!(
                    work <= allowed,
                    "spin {spin}, step {step}: friction does {work} J of work of at most {most} J"
                );
                slid += u32::from(contact.slip.norm() > 1e-4);
            }
        }
        assert!(slid > 0, "spin {spin}: it slides");
    }
}

/// A rod slides over a drum, whose normal turns as it goes on: what has no friction feels a force along the normal where it is.
#[test]
fn without_friction_forces_are_along_the_normals_of_the_end() {
    for formulation in Formulation::ALL {
        let mut assembly = Assembly::new(GRAVITY);
        let nodes = shape::straight(Vector3::new(-0.25, 0.0, 0.1202), Vector3::x(), 0.5, 1);
        assembly.rod(&RodSpec::new(nodes, 0.02, material(1e7, 1000.0)));
        assembly.state_mut().velocities.fill(Vector3::new(0.1, 1.0, -0.1));
        let drum = ObstacleShape::Capsule { start: Vector3::x() * -1.0, end: Vector3::new(1.0, 0.1, 0.0), radius: 0.1 };
        assembly.model_mut().contacts.obstacles = vec![Obstacle::new(drum, Surface::default())];
        let (model, state) = assembly.finish();
        let mut simulation = Simulation::new(&model, &state, &settings(formulation, SolverKind::Direct), None).unwrap();
        let (mut forces, mut seen) = (Vec::new(), 0);
        for step in 0..20 {
            assert!(simulation.step(0.005).unwrap().status <= Status::ConvergedInSubsteps);
            simulation.store_contact_forces(&mut forces);
            for ContactForce { normal, force, .. } in &forces {
                let across = (force - normal * force.dot(normal)).norm();
                // With a momentum residual the last correction, within the tolerance, turns normals still.
                let most = if formulation.momentum() { 1e-3 } else { 1e-9 };
                assert!(across <= most * force.norm(), "{formulation}, step {step}: {across} N of {} N", force.norm());
                seen += 1;
            }
        }
        assert!(seen > 3, "{formulation}: {seen} contacts");
    }
}

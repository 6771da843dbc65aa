//! Rods at rest on obstacles, without friction, against the theory of beams.

use acceptance::Beam;
use cosserat::assembly::{Assembly, Obstacle, ObstacleShape, Surface};
use cosserat::internals::collision::closest;
use cosserat::scene;
use cosserat::state::{Model, State};
use cosserat::statics::{StaticError, StaticParams, StaticReport, equilibrium};
use nalgebra::{Unit, Vector3};

fn obstacle(shape: ObstacleShape) -> Obstacle {
    Obstacle { shape, surface: Surface::default(), motion: None }
}

/// The ground, below which by a radius the axis of `beam` is at z = 0.
fn ground(beam: &Beam) -> Obstacle {
    obstacle(ObstacleShape::HalfSpace { point: Vector3::z() * -beam.radius, normal: Unit::new_unchecked(Vector3::z()) })
}

fn found(model: &Model, state: &State) -> (State, StaticReport) {
    let mut end = state.clone();
    let report = equilibrium(model, &mut end, &StaticParams::default()).unwrap();
    println!("{} solves, {} contacts press", report.steps, report.contacts.len());
    assert!(report.converged && report.stable == Some(true), "{report:?}");
    (end, report)
}

fn pressed(report: &StaticReport) -> f64 {
    report.contacts.iter().map(|contact| contact.force.z).sum()
}

/// A beam on the ground whose end is held level and lifted by h: `a = (72 B h / q)^(1/4)` of it is off the ground, where its
/// moment vanishes, and the grip carries `2 q a / 3`.
#[test]
fn a_beam_that_is_lifted_at_one_end_leaves_the_ground() {
    let (lifted, height) = (0.5, 2e-3);
    let errors = [50, 100, 200].map(|segments| {
        let beam = Beam::rubber(segments);
        let weight = 72.0 * beam.bending() * height / f64::powi(lifted, 4);
        let mut assembly = Assembly::new(Vector3::z() * -(weight / beam.line_density()));
        let rod = assembly.rod(&beam.spec(Vector3::zeros(), Vector3::x()));
        assembly.clamp_end(&rod);
        let (mut model, state) = assembly.finish();
        model.anchors[0].position.z += height;
        model.contacts.obstacles.push(ground(&beam));
        let (end, report) = found(&model, &state);
        let lowest = end.positions.iter().map(|x| x.z).fold(f64::INFINITY, f64::min);
        assert!(lowest > -1e-6 * beam.length, "{lowest}");
        assert!(report.contacts.iter().all(|contact| contact.force.z > 0.0));
        let off = 1.5 * (beam.length - pressed(&report) / weight);
        println!("{segments} segments: {off} m off the ground, theory {lifted}");
        // The place where it leaves the ground goes on by a segment or two in each.
        assert!(report.steps <= segments / 2 + 10, "{} solves", report.steps);
        off / lifted - 1.0
    });
    assert!(errors[2].abs() < 3e-3, "{errors:?}");
    assert!(errors[2].abs() < errors[0].abs(), "{errors:?}");
}

/// A cantilever that a ball or a post across it pushes up by d at a distance a from its clamp: `3 B d / a^3`.
#[test]
fn a_cantilever_is_pressed_by_a_ball_and_by_a_post() {
    let (beam, place, pushed, radius) = (Beam::rubber(100), 0.8, 1e-3, 0.02);
    let theory = 3.0 * beam.bending() * pushed / f64::powi(place, 3);
    let centre = Vector3::new(place, 0.0, pushed - radius - beam.radius);
    let aside = Vector3::y() * 0.3;
    for shape in [
        ObstacleShape::Sphere { centre, radius },
        ObstacleShape::Capsule { start: centre - aside, end: centre + aside, radius },
    ] {
        let (assembly, _) = beam.cantilever(Vector3::zeros());
        let (mut model, state) = assembly.finish();
        model.contacts.obstacles.push(obstacle(shape.clone()));
        let (_, report) = found(&model, &state);
        let force = pressed(&report);
        println!("{shape:?}: {force} N, theory {theory}");
        assert!((force / theory - 1.0).abs() < 2e-3, "{force} instead of {theory}");
        assert!(report.steps <= 15, "{} solves", report.steps);
    }
}

/// A cable between two grips that sags onto a post: it touches it and enters it nowhere.
#[test]
fn a_cable_sags_onto_a_post() {
    let beam = Beam { radius: 5e-3, ..Beam::rubber(60) };
    let mut assembly = Assembly::new(Vector3::z() * -beam.gravity_for(20.0));
    let rod = assembly.rod(&beam.spec(Vector3::zeros(), Vector3::x()));
    assembly.clamp_start(&rod).clamp_end(&rod);
    let (mut model, state) = assembly.finish();
    model.anchors[1].position.x -= 0.01;
    let (start, stop) = (Vector3::new(0.5, -1.0, -0.08), Vector3::new(0.5, 1.0, -0.08));
    model.contacts.obstacles.push(obstacle(ObstacleShape::Capsule { start, end: stop, radius: 0.05 }));
    let (end, report) = found(&model, &state);
    assert!(pressed(&report) > 0.0);
    for (k, x) in end.positions.iter().enumerate() {
        let half = end.axis(k) * (0.5 * beam.segment_length());
        let near = closest::segments(&[x - half, x + half], &[start, stop]);
        let gap = near.distance - 0.05 - beam.radius;
        assert!(gap > -1e-8, "segment {k} overlaps by {gap}");
    }
}

/// A rod that nothing holds lies down on the ground.
#[test]
fn a_free_rod_lies_on_the_ground() {
    let beam = Beam::rubber(20);
    let mut assembly = Assembly::new(Vector3::z() * -9.81);
    assembly.rod(&beam.spec(Vector3::z() * 0.1, Vector3::x()));
    let (mut model, state) = assembly.finish();
    model.contacts.obstacles.push(ground(&beam));
    let (end, report) = found(&model, &state);
    let weight = 9.81 * beam.line_density() * beam.length;
    assert!((pressed(&report) / weight - 1.0).abs() < 1e-4, "{}", pressed(&report));
    assert!(end.positions.iter().all(|x| x.z.abs() < 1e-6));
}

#[test]
fn contacts_that_are_not_known_are_refused() {
    let beam = Beam::rubber(5);
    let (assembly, _) = beam.cantilever(Vector3::zeros());
    let (mut model, mut state) = assembly.finish();
    model.contacts.between_segments = Some(Surface::default());
    let error = equilibrium(&model, &mut state, &StaticParams::default()).unwrap_err();
    assert!(matches!(error, StaticError::UnknownContacts(what) if what.contains("between segments")), "{error}");
    model.contacts.between_segments = None;
    let (start, end) = (-Vector3::z(), -2.0 * Vector3::z());
    model.contacts.obstacles.push(obstacle(ObstacleShape::Cylinder { start, end, radius: 0.1 }));
    let error = equilibrium(&model, &mut state, &StaticParams::default()).unwrap_err();
    assert!(matches!(error, StaticError::UnknownContacts(what) if what.contains("cylinders")), "{error}");
}

/// What is joined to a thinner beam's end touches by itself: a thick branch, and a body.
#[test]
fn what_is_thicker_than_its_beam_rests_on_the_ground_itself() {
    let scene = |rest: &str| {
        let text = format!(
            "obstacles = [{{ shape.plane = {{ point_m = [0, 0, -0.055] }} }}]\n[[rods]]\nname = \"beam\"\nradius_m = 0.005\n\
             youngs_modulus_pa = 3.9e10\ndensity_kg_m3 = 1000\nclamp = [\"start-face\"]\nshape.straight = {{ length_m = 1, segments = 20 }}\n{rest}"
        );
        scene::parse(&text, "beam.toml").unwrap()
    };
    let branch = "[[rods]]\nradius_m = 0.05\nyoungs_modulus_pa = 1e8\ndensity_kg_m3 = 300\nbranch_of = { rod = \"beam\" }\n\
                  shape.straight = { direction = [1, 0, 0], length_m = 0.3, segments = 3 }";
    let body = "[[bodies]]\nname = \"weight\"\nshape.capsule = { radius_m = 0.05, length_m = 0.1 }\nmass_kg = 0.6\n\
                position_m = [1.0, 0, 0.05]\n[[joins]]\na = { rod = \"beam\" }\nb = { body = \"weight\", at_m = [0, 0, -0.05] }";
    for rest in [branch, body] {
        let scene = scene(rest);
        let (end, _) = found(&scene.model, &scene.state);
        for (i, segment) in scene.model.segments.iter().enumerate().skip(20) {
            let (half, radius) = segment.capsule().unwrap();
            let low = end.positions[i].z - half * end.axis(i).z.abs() - radius;
            assert!(low > -0.055 - 1e-4, "{rest}: {low}");
        }
    }
}

/// Between ball joints a rod may spin about itself: an equilibrium all the same.
#[test]
fn a_rod_that_may_spin_rests_on_a_slope() {
    let text = "obstacles = [{ shape.plane = { point_m = [0, 0, -0.4], normal = [0, -0.3, 1] } }]\n[[rods]]\nradius_m = 0.01\n\
                youngs_modulus_pa = 1e5\ndensity_kg_m3 = 1000\nshape.hung = { to_m = [2, 0, 0], length_m = 2.4, segments = 20 }\n\
                grips = [{ at = \"start-face\", joint = \"ball\" }, { at = \"end-face\", joint = \"ball\" }]";
    let scene = scene::parse(text, "slope.toml").unwrap();
    let mut end = scene.state.clone();
    let report = equilibrium(&scene.model, &mut end, &StaticParams::default()).unwrap();
    assert!(report.converged, "{report:?}");
    let energy = cosserat::state::measure::energy(&scene.model, &end).total();
    assert!((energy + 2.4597).abs() < 1e-3, "{energy} J");
}

//! Rods that touch boxes, cylinders and triangle meshes: statics, exact surfaces that meshes stand for, and high speeds.

use std::collections::HashMap;
use std::sync::Arc;

use dynamics::formulation::Formulation;
use dynamics::simulation::{Settings, Simulation, Touched};
use dynamics::step::Status;
use nalgebra::{Unit, UnitQuaternion, Vector3};
use rod::Integrator;
use rod::{
    Assembly, BodyShape, Carried, Contacts, Damping, Friction, Mesh, Model, Motion, Obstacle, ObstacleShape, Pose,
    RestShape, RigidBody, RodSpec, SolidMesh, State, Surface, shape,
};

use crate::common::material;

pub(crate) const GRAVITY: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);
pub(crate) const DT: f64 = 0.01;
pub(crate) const RADIUS: f64 = 0.01;

pub(crate) fn rough(friction: f64) -> Surface {
    Surface { friction: Friction::new(friction), restitution: 0.0 }
}

pub(crate) fn at(position: Vector3<f64>) -> Pose {
    Pose { position, orientation: UnitQuaternion::identity() }
}

fn ground() -> ObstacleShape {
    ObstacleShape::HalfSpace { point: Vector3::zeros(), normal: Unit::new_normalize(Vector3::z()) }
}

fn mesh(positions: Vec<Vector3<f64>>, triangles: Vec<[u32; 3]>) -> ObstacleShape {
    let mesh = Arc::new(Mesh::new(positions, triangles).unwrap());
    ObstacleShape::Mesh { pose: at(Vector3::zeros()), mesh }
}

/// A square of side `2 reach` about the origin at height 0, `count` fields along each side, their corners moved about.
pub(crate) fn sheet(reach: f64, count: u32) -> ObstacleShape {
    let place = |i: u32, j: u32| {
        let shift = |k: u32| 0.6 * (f64::from((i * 7919 + j * 104_729 + k * 31) % 101) / 101.0 - 0.5);
        let along = |i: u32, k: u32| reach * (2.0 * (f64::from(i) + shift(k)) / f64::from(count) - 1.0);
        Vector3::new(along(i, 0), along(j, 1), 0.0)
    };
    let positions = (0..=count).flat_map(|i| (0..=count).map(move |j| place(i, j))).collect();
    let cell = |i: u32, j: u32| {
        let [a, b] = [i * (count + 1) + j, (i + 1) * (count + 1) + j];
        [[a, b, b + 1], [a, b + 1, a + 1]]
    };
    mesh(positions, (0..count).flat_map(|i| (0..count).flat_map(move |j| cell(i, j))).collect())
}

/// An icosahedron whose triangles are divided in four so often, its vertices on a sphere about the origin.
fn ball(radius: f64, divisions: u32) -> ObstacleShape {
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut places: Vec<Vector3<f64>> = Vec::new();
    for (a, b) in [(1.0, golden), (1.0, -golden), (-1.0, golden), (-1.0, -golden)] {
        places.extend([Vector3::new(0.0, a, b), Vector3::new(a, b, 0.0), Vector3::new(b, 0.0, a)]);
    }
    let mut triangles = Vec::new();
    for a in 0..12_usize {
        for b in a + 1..12 {
            for c in b + 1..12 {
                let [p, q, r] = [places[a], places[b], places[c]];
                if [(p, q), (q, r), (r, p)].iter().all(|(x, y)| ((x - y).norm() - 2.0).abs() < 1e-9) {
                    let outwards = (q - p).cross(&(r - p)).dot(&p) > 0.0;
                    triangles.push(if outwards { [a, b, c] } else { [a, c, b] }.map(|i| i as u32));
                }
            }
        }
    }
    assert_eq!(triangles.len(), 20);
    for _ in 0..divisions {
        let mut middles = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                places.push((places[a as usize] + places[b as usize]) * 0.5);
                places.len() as u32 - 1
            })
        };
        let divided = triangles.iter().flat_map(|&[a, b, c]| {
            let [x, y, z] = [middle(a, b), middle(b, c), middle(c, a)];
            [[a, x, z], [x, b, y], [z, y, c], [x, y, z]]
        });
        triangles = divided.collect();
        places.iter_mut().for_each(|place| *place = place.normalize());
    }
    mesh(places.into_iter().map(|place| place.normalize() * radius).collect(), triangles)
}

/// An obstacle that goes on at these velocities from the start.
pub(crate) fn steady(shape: ObstacleShape, surface: Surface, v: Vector3<f64>, w: Vector3<f64>) -> Obstacle {
    let still = Obstacle::new(shape, surface);
    let motion = Motion::at_velocities(&still.at(0.0).pose, &[(0.0, v, w)]).unwrap();
    Obstacle { motion: Some(Carried::new(Arc::new(motion))), ..still }
}

/// A straight rod among obstacles.
fn rod(start: Vector3<f64>, along: Vector3<f64>, segments: usize, youngs_modulus: f64) -> Assembly {
    let mut assembly = Assembly::new(GRAVITY);
    let nodes = shape::straight(start, along, along.norm(), segments);
    assembly
        .rod(&RodSpec { rest: RestShape::Straight, ..RodSpec::new(nodes, RADIUS, material(youngs_modulus, 1000.0)) });
    assembly
}

/// A formulation whose result does not depend on the way to it, and contacts solved sharply.
pub(crate) fn sharp() -> Settings {
    let mut settings = Settings::default();
    settings.step.formulation = Formulation::Newton;
    settings.step.integrator = Integrator::Euler;
    settings.step.contact_tolerance = 1e-7;
    settings.step.contact.slip_direction_tolerance = 1e-3;
    settings
}

/// Steps; every step converges, and `look` sees each state.
pub(crate) fn run(
    (model, state): (&Model, &State),
    settings: &Settings,
    steps: usize,
    mut look: impl FnMut(usize, &State),
) -> Simulation {
    let mut simulation = Simulation::new(model, state, settings, None).unwrap();
    let mut now = state.clone();
    for step in 0..steps {
        let report = simulation.step(DT).unwrap();
        assert!(report.status <= Status::ConvergedInSubsteps, "step {step}: {:?}", report.status);
        simulation.store(&mut now);
        look(step, &now);
    }
    simulation
}

fn weight(model: &Model) -> f64 {
    model.segments.iter().map(|segment| 9.81 * segment.mass()).sum()
}

/// Sum of the forces of contacts with each obstacle [N].
pub(crate) fn reactions(simulation: &Simulation, obstacles: usize) -> Vec<Vector3<f64>> {
    let mut forces = Vec::new();
    simulation.store_contact_forces(&mut forces);
    let mut sums = vec![Vector3::zeros(); obstacles];
    for contact in forces {
        let Touched::Obstacle(k) = contact.other else { panic!("{contact:?}") };
        sums[k] += contact.force;
    }
    sums
}

#[test]
fn a_rod_that_falls_on_a_box_rests_on_its_top() {
    let mut assembly = rod(Vector3::new(-0.25, 0.03, 0.03), Vector3::x() * 0.5, 10, 1e8);
    assembly.damping(Damping { linear: 2.0, angular: 2.0 });
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.4);
    let pose = Pose { position: Vector3::new(0.0, 0.0, -0.2), orientation: turn };
    let block = ObstacleShape::Box { pose, sides: Vector3::new(0.8, 0.8, 0.4) };
    assembly.model_mut().contacts.obstacles = vec![Obstacle::new(block, rough(0.5))];
    let (model, state) = assembly.finish();
    let mut end = state.clone();
    let simulation = run((&model, &state), &sharp(), 400, |_, now| end.clone_from(now));
    let sum = reactions(&simulation, 1)[0];
    assert!((sum - Vector3::z() * weight(&model)).norm() < 1e-3 * weight(&model), "{sum}");
    for place in &end.positions {
        assert!((place.z - RADIUS).abs() < 1e-3 * RADIUS, "{place}");
    }
}

/// The lever law: a rod on two edges presses on each as the other's distance from its centre of mass says.
#[test]
fn a_rod_on_two_edges_is_in_static_balance() {
    let mut assembly = rod(Vector3::new(-0.3, 0.0, RADIUS), Vector3::x() * 0.6, 12, 1e9);
    assembly.damping(Damping { linear: 2.0, angular: 2.0 });
    let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::FRAC_PI_4);
    let supports = [-0.237, 0.114];
    let prism = |x: f64| {
        let pose = Pose { position: Vector3::new(x, 0.0, -0.1 * 2.0_f64.sqrt()), orientation: turn };
        Obstacle::new(ObstacleShape::Box { pose, sides: Vector3::repeat(0.2) }, rough(0.3))
    };
    assembly.model_mut().contacts.obstacles = supports.map(prism).into();
    let (model, state) = assembly.finish();
    let simulation = run((&model, &state), &sharp(), 400, |_, _| {});
    let (forces, span) = (reactions(&simulation, 2), supports[1] - supports[0]);
    for (force, share) in forces.iter().zip([supports[1] / span, -supports[0] / span]) {
        let expected = share * weight(&model);
        assert!((force.z / expected - 1.0).abs() < 2e-3, "{force}, expected {expected} N");
        assert!(force.y.abs() < 1e-3 * expected, "{force}");
    }
}

/// A rod that slides over triangles of one plane does as on the half-space: it never catches on an edge within.
#[test]
fn a_mesh_of_the_ground_is_the_ground() {
    // With 1e-5 sweeps leave more where the rod, which does not stretch, comes to rest: steps are halved.
    let mut settings = sharp();
    settings.step.contact_tolerance = 1e-4;
    for (velocity, belt) in
        [(Vector3::new(1.0, 0.7, 0.0), None), (Vector3::zeros(), Some(Vector3::new(0.4, -0.2, 0.0)))]
    {
        let mut assembly = rod(Vector3::new(-0.3, -0.3, 0.03), Vector3::new(0.4, 0.1, 0.02), 10, 1e6);
        assembly.state_mut().velocities.fill(velocity);
        let (mut model, state) = assembly.finish();
        let mut ways = Vec::new();
        for shape in [ground(), sheet(1.0, 40)] {
            let obstacle = match belt {
                None => Obstacle::new(shape, rough(0.2)),
                Some(speed) => steady(shape, rough(0.2), speed, Vector3::zeros()),
            };
            model.contacts.obstacles = vec![obstacle];
            let mut way = Vec::new();
            run((&model, &state), &settings, 100, |_, now| way.push(now.positions.clone()));
            ways.push(way);
        }
        let moved = (ways[0][99][5] - state.positions[5]).xy().norm();
        assert!(moved > 0.2, "it slides: {moved}");
        let worst = ways[0].iter().flatten().zip(ways[1].iter().flatten()).map(|(a, b)| (a - b).norm());
        let worst = worst.fold(0.0, f64::max);
        // 1.06e-5 m at contact tolerances of 1e-7 and 1e-9 alike.
        assert!(worst < 1.5e-3 * RADIUS, "{worst}");
    }
}

/// A sphere of 80 000 triangles: its flats are up to 2e-5 m below it, and lean by up to 0.009 rad, by which a rod of 0.8 m that
/// touches one of them rocks: 4 mm at its ends. It is a quarter of that at most.
#[test]
fn a_fine_mesh_of_a_sphere_is_nearly_the_sphere() {
    let radius = 0.5;
    let mut assembly = rod(Vector3::new(-0.4, 0.05, 0.51), Vector3::x() * 0.8, 20, 1e7);
    assembly.damping(Damping { linear: 5.0, angular: 5.0 });
    let (mut model, state) = assembly.finish();
    let mut ends = Vec::new();
    for shape in [ObstacleShape::Sphere { centre: Vector3::zeros(), radius }, ball(radius, 6)] {
        model.contacts.obstacles = vec![Obstacle::new(shape, rough(0.4))];
        let mut way = Vec::new();
        run((&model, &state), &sharp(), 50, |_, now| way.push(now.positions.clone()));
        ends.push(way);
    }
    assert!((ends[0][49][0] - state.positions[0]).norm() > 0.05, "it bends over the sphere");
    let worst = ends[0].iter().flatten().zip(ends[1].iter().flatten()).map(|(a, b)| (a - b).norm());
    let worst = worst.fold(0.0, f64::max);
    assert!(worst < 1e-3, "{worst}");
}

/// Distance of a segment's axis from a place [m].
fn distance(state: &State, model: &Model, i: usize, place: Vector3<f64>) -> f64 {
    let half = state.axis(i) * (0.5 * model.segments[i].length);
    collision::closest::segments(&[state.positions[i] - half, state.positions[i] + half], &[place; 2]).distance
}

/// At 50 m/s and steps of 0.02 s a rod moves by fifty times its diameter in a step, and stays out; the sheet has 100,352
/// triangles.
#[test]
fn fast_rods_stay_out_of_meshes_boxes_and_sheets() {
    let block = ObstacleShape::Box { pose: at(Vector3::z() * -0.3), sides: Vector3::new(0.6, 0.5, 0.6) };
    let drum = ObstacleShape::Cylinder { start: -Vector3::y(), end: Vector3::y(), radius: 0.3 };
    for (name, shape) in [("mesh", ball(0.3, 4)), ("box", block), ("cylinder", drum), ("sheet", sheet(2.0, 224))] {
        let mut assembly = rod(Vector3::new(-0.5, 0.02, 0.5), Vector3::new(1.0, 0.0, 0.1), 20, 1e7);
        assembly.state_mut().velocities.fill(Vector3::new(0.0, 0.0, -50.0));
        assembly.model_mut().contacts.obstacles = vec![Obstacle::new(shape, rough(0.3))];
        let (model, state) = assembly.finish();
        let mut simulation = Simulation::new(&model, &state, &Settings::default(), None).unwrap();
        let mut now = state.clone();
        for step in 0..25 {
            simulation.step(0.02).unwrap();
            simulation.store(&mut now);
            for i in 0..model.segments.len() {
                // A step is good enough with a contact that is a hundredth of the radius too deep.
                let (place, least) = (now.positions[i], 0.9 * RADIUS);
                let out = match name {
                    "mesh" => distance(&now, &model, i, Vector3::zeros()) - 0.299,
                    "box" if place.x.abs() < 0.3 && place.y.abs() < 0.25 => place.z.abs().max(place.z),
                    "cylinder" if place.y.abs() < 1.0 => place.xz().norm() - 0.299,
                    "sheet" if place.x.abs() < 1.9 && place.y.abs() < 1.9 => place.z,
                    _ => RADIUS,
                };
                assert!(out > least, "{name}, step {step}, segment {i}: {out} at {place}");
            }
        }
    }
}

#[test]
fn a_moving_box_pushes_a_rod_ahead_of_it() {
    let mut assembly = rod(Vector3::new(0.0, -0.1, 0.0), Vector3::y() * 0.2, 4, 1e8);
    let speed = Vector3::x() * 0.7;
    assembly.model_mut().gravity = Vector3::zeros();
    let block = ObstacleShape::Box { pose: at(Vector3::x() * -0.3), sides: Vector3::new(0.2, 0.6, 0.6) };
    assembly.model_mut().contacts.obstacles = vec![steady(block, rough(0.3), speed, Vector3::zeros())];
    let (model, state) = assembly.finish();
    run((&model, &state), &sharp(), 100, |step, now| {
        let face = -0.2 + 0.7 * DT * (step + 1) as f64;
        let expected = (face + RADIUS).max(0.0);
        for place in &now.positions {
            assert!((place - Vector3::new(expected, place.y, 0.0)).norm() < 1e-5 * RADIUS, "step {step}: {place}");
        }
    });
}

/// It is as far on one side before a step as on the other after it, and takes the rod along.
#[test]
fn a_box_that_passes_within_a_step_pushes_a_rod() {
    let mut assembly = rod(Vector3::new(0.0, -0.1, 0.0), Vector3::y() * 0.2, 4, 1e8);
    assembly.model_mut().gravity = Vector3::zeros();
    let block = ObstacleShape::Box { pose: at(Vector3::x() * -0.6), sides: Vector3::new(0.2, 0.6, 0.6) };
    let speed = Vector3::x() * (1.2 / DT);
    assembly.model_mut().contacts.obstacles = vec![steady(block, rough(0.0), speed, Vector3::zeros())];
    let (model, state) = assembly.finish();
    run((&model, &state), &sharp(), 1, |_, now| {
        assert!(now.positions.iter().all(|place| place.x > 0.7 + 0.99 * RADIUS), "{:?}", now.positions);
    });
}

#[test]
fn overlaps_with_meshes_are_refused() {
    let block = |z: f64| ObstacleShape::Box { pose: at(Vector3::z() * z), sides: Vector3::new(1.0, 1.0, 0.4) };
    let depth = |shape: ObstacleShape| {
        let mut assembly = rod(Vector3::new(-0.1, 0.0, 0.0), Vector3::x() * 0.2, 2, 1e8);
        assembly.model_mut().contacts.obstacles = vec![Obstacle::new(shape, rough(0.0))];
        let (model, state) = assembly.finish();
        Simulation::new(&model, &state, &Settings::default(), None).err().map(|error| error.to_string())
    };
    assert_eq!(depth(block(-0.2 - RADIUS)), None);
    let text = depth(block(-0.204)).unwrap();
    assert!(text.contains("overlaps obstacle 0 (a box) by 0.006 m at the start"), "{text}");
    assert!(depth(block(0.0)).is_some(), "inside");
    // A mesh that looks inwards is a room.
    let ObstacleShape::Mesh { mesh: own, .. } = ball(1.0, 2) else { panic!() };
    assert!(depth(mesh(own.positions.clone(), own.triangles.clone())).is_some());
    let inwards = own.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
    assert_eq!(depth(mesh(own.positions.clone(), inwards)), None);
}

/// A body that is a box lies on the ground, a rod on it: the ground bears both, and each is where it should be.
#[test]
fn a_rod_rests_on_a_box_that_rests_on_the_ground() {
    let (sides, mass) = (Vector3::new(0.3, 0.2, 0.1), 2.0);
    for shape in [BodyShape::Box { sides }, BodyShape::Cylinder { radius: 0.15, length: sides.z }] {
        let mut assembly = rod(Vector3::new(-0.1, 0.02, 0.125), Vector3::new(0.2, 0.01, 0.0), 6, 1e8);
        assembly.damping(Damping { linear: 2.0, angular: 2.0 });
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.3);
        let pose = Pose { position: Vector3::z() * 0.053, orientation: turn };
        let body = assembly.body(RigidBody::new(shape, mass), pose);
        let surface = rough(0.5);
        assembly.model_mut().contacts = Contacts {
            between_segments: Some(surface),
            obstacles: vec![Obstacle::new(ground(), surface)],
            ..Contacts::default()
        };
        let (model, state) = assembly.finish();
        let mut end = state.clone();
        let simulation = run((&model, &state), &sharp(), 300, |_, now| end.clone_from(now));
        let (mut forces, mut borne, mut carried) = (Vec::new(), Vector3::zeros(), Vector3::zeros());
        simulation.store_contact_forces(&mut forces);
        for contact in forces {
            match contact.other {
                Touched::Obstacle(_) => borne += contact.force,
                Touched::Segment(other) => {
                    assert_eq!(other, body, "{contact:?}");
                    carried += contact.force;
                }
            }
        }
        let rods = weight(&model) - 9.81 * mass;
        assert!((borne - Vector3::z() * (rods + 9.81 * mass)).norm() < 1e-3 * rods, "{borne}");
        assert!((carried - Vector3::z() * rods).norm() < 2e-3 * rods, "{carried} of {rods}");
        for (i, place) in end.positions.iter().enumerate() {
            let height = if i == body { 0.5 * sides.z } else { sides.z + RADIUS };
            assert!((place.z - height).abs() < 1e-3 * RADIUS, "segment {i}: {place}");
        }
    }
}

/// A prism of height 0.1 over an L, and a cube, as meshes.
pub(crate) fn prism(outline: &[[f64; 2]], triangles: &[[u32; 3]]) -> Mesh {
    let count = outline.len() as u32;
    let places = [-0.05, 0.05].into_iter().flat_map(|z| outline.iter().map(move |&[x, y]| Vector3::new(x, y, z)));
    let ends = triangles.iter().flat_map(|&[a, b, c]| [[a, c, b], [a + count, b + count, c + count]]);
    let sides = (0..count).flat_map(|i| {
        let j = (i + 1) % count;
        [[i, j, j + count], [i, j + count, i + count]]
    });
    Mesh::new(places.collect(), ends.chain(sides).collect()).unwrap()
}

/// What a rod and a free body give each other adds to nothing; a cube in a file moves as a box does.
#[test]
fn a_body_and_the_rod_that_hits_it_keep_their_momentum() {
    let full = |mesh| BodyShape::Mesh(Arc::new(SolidMesh::full(mesh).unwrap()));
    let h = 0.05;
    let square = prism(&[[-h, -h], [h, -h], [h, h], [-h, h]], &[[0, 1, 2], [0, 2, 3]]);
    let angle = prism(
        &[[-h, -h], [h, -h], [h, 0.0], [0.0, 0.0], [0.0, h], [-h, h]],
        &[[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]],
    );
    let ends = [BodyShape::Box { sides: Vector3::repeat(0.1) }, full(square), full(angle)].map(|shape| {
        let mut assembly = rod(Vector3::new(0.1, -0.25, 0.03), Vector3::y() * 0.5, 10, 1e7);
        assembly.model_mut().gravity = Vector3::zeros();
        assembly.state_mut().velocities.fill(Vector3::new(-3.0, 0.2, 0.1));
        let own = at(Vector3::zeros());
        let pose = if let BodyShape::Mesh(solid) = &shape { solid.pose(&own) } else { own };
        let body = assembly.body(RigidBody::new(shape, 0.3), pose);
        assembly.model_mut().contacts.between_segments = Some(rough(0.4));
        let (model, state) = assembly.finish();
        let momentum = |state: &State| -> Vector3<f64> {
            model.segments.iter().zip(&state.velocities).map(|(segment, v)| v * segment.mass()).sum()
        };
        let before = momentum(&state);
        let mut end = state.clone();
        run((&model, &state), &sharp(), 40, |step, now| {
            assert!((momentum(now) - before).norm() < 1e-9 * before.norm(), "step {step}");
            end.clone_from(now);
        });
        assert!(end.velocities[body].x < -0.5, "it was hit: {}", end.velocities[body]);
        assert!(end.angular_velocities[body].norm() > 1.0, "above its centre: {}", end.angular_velocities[body]);
        end
    });
    for (a, b) in ends[0].positions.iter().zip(&ends[1].positions) {
        assert!((a - b).norm() < 1e-6 * RADIUS, "{a} {b}");
    }
}

#[test]
fn overlaps_with_bodies_are_refused() {
    let start = |height: f64, ground_height: f64| {
        let mut assembly = rod(Vector3::new(-0.1, 0.0, height), Vector3::x() * 0.2, 2, 1e8);
        let block = BodyShape::Box { sides: Vector3::repeat(0.1) };
        assembly.body(RigidBody::new(block, 1.0), at(Vector3::zeros()));
        let normal = Unit::new_normalize(Vector3::z());
        let plane = ObstacleShape::HalfSpace { point: Vector3::z() * ground_height, normal };
        assembly.model_mut().contacts.between_segments = Some(rough(0.0));
        assembly.model_mut().contacts.obstacles = vec![Obstacle::new(plane, rough(0.0))];
        let (model, state) = assembly.finish();
        Simulation::new(&model, &state, &Settings::default(), None).err().map(|error| error.to_string())
    };
    assert_eq!(start(0.05 + RADIUS, -0.05), None);
    let text = start(0.057, -0.05).unwrap();
    assert!(text.contains("and segment 2 (rod 1) overlap by 0.003 m at the start"), "{text}");
    let text = start(0.07, -0.04).unwrap();
    assert!(text.contains("segment 2 (rod 1) overlaps obstacle 0 (a plane) by 0.01 m"), "{text}");
}

/// Boxes whose faces lie in the planes of each other's have no edges in each other, and overlap all the same; what stands
/// beside another one, or around it, does not.
#[test]
fn boxes_in_the_same_planes_overlap() {
    let is_refused = |sides: Vector3<f64>, place: Vector3<f64>, obstacle: Vector3<f64>| {
        let mut assembly = Assembly::new(GRAVITY);
        assembly.body(RigidBody::new(BodyShape::Box { sides }, 1.0), at(place));
        let block = ObstacleShape::Box { pose: at(Vector3::zeros()), sides: obstacle };
        assembly.model_mut().contacts.obstacles = vec![Obstacle::new(block, rough(0.0))];
        let (model, state) = assembly.finish();
        Simulation::new(&model, &state, &Settings::default(), None).is_err()
    };
    let (cube, along, across) = (Vector3::repeat(1.0), Vector3::new(1.0, 0.1, 0.1), Vector3::new(0.1, 1.0, 0.1));
    assert!(is_refused(cube, Vector3::zeros(), cube));
    assert!(is_refused(cube, Vector3::x() * 0.5, cube));
    assert!(is_refused(along, Vector3::zeros(), across));
    assert!(!is_refused(cube, Vector3::x(), cube));
    assert!(!is_refused(along, Vector3::z() * 0.1, across));
}

/// Energy [J] that a rod has left of a vibration in the plane on which it slides for 1.9 s, of that it began with.
fn left_of_a_vibration(ground: ObstacleShape) -> f64 {
    let mut assembly = Assembly::new(GRAVITY);
    let nodes = shape::straight(Vector3::new(-1.0, 0.0, RADIUS), Vector3::x(), 1.0, 20);
    // Its first mode has 10 rad/s.
    assembly.rod(&RodSpec::new(nodes, RADIUS, material(8e6, 1000.0)));
    let (mut model, mut state) = assembly.finish();
    for (i, velocity) in state.velocities.iter_mut().enumerate() {
        *velocity = Vector3::new(0.5, 0.3 * ((i as f64 + 0.5) / 20.0 * std::f64::consts::TAU).cos(), 0.0);
    }
    model.contacts = Contacts { obstacles: vec![Obstacle::new(ground, rough(0.0))], ..Contacts::default() };
    let own = |state: &State| {
        let mean = state.velocities.iter().sum::<Vector3<f64>>() / 20.0;
        let mass: f64 = model.segments.iter().map(|segment| segment.mass()).sum();
        let energy = rod::measure::energy(&model, state);
        energy.kinetic + energy.bend - 0.5 * mass * mean.norm_squared()
    };
    let mut settings = Settings::default();
    settings.step.integrator = Integrator::Bdf2;
    let mut simulation = Simulation::new(&model, &state, &settings, None).unwrap();
    let begin = own(&state);
    for _ in 0..190 {
        assert!(simulation.step(DT).unwrap().status <= Status::ConvergedInSubsteps);
    }
    simulation.store(&mut state);
    own(&state) / begin
}

#[test]
fn a_rod_that_slides_from_triangle_to_triangle_meets_nothing() {
    let (plane, mesh) = (left_of_a_vibration(ground()), left_of_a_vibration(sheet(2.0, 40)));
    assert!(plane > 0.85 && (mesh - plane).abs() < 0.05, "{mesh} of its energy on a mesh, {plane} on a plane");
}

//! Rigid bodies on obstacles that are no planes: statics, friction on a slope, impacts, belts.

use std::sync::Arc;

use dynamics::simulation::{Settings, Simulation};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rod::{
    Assembly, BodyShape, Damping, Model, Obstacle, ObstacleShape, Pose, RigidBody, SolidMesh, State, Surface, measure,
};

use crate::meshes::{DT, GRAVITY, at, prism, reactions, rough, run, sharp, sheet, steady};

const SIDES: Vector3<f64> = Vector3::new(0.3, 0.2, 0.1);
const MASS: f64 = 2.0;
const G: f64 = 9.81;

fn brick() -> BodyShape {
    BodyShape::Box { sides: SIDES }
}

/// The same as a mesh.
fn meshed() -> BodyShape {
    BodyShape::Mesh(Arc::new(SolidMesh::full(brick().mesh()).unwrap()))
}

/// A body of [`MASS`] alone among obstacles.
fn scene(shape: BodyShape, pose: Pose, obstacles: Vec<Obstacle>, damping: f64) -> (Model, State) {
    let mut assembly = Assembly::new(GRAVITY);
    assembly.damping(Damping { linear: damping, angular: damping });
    assembly.body(RigidBody::new(shape, MASS), pose);
    assembly.model_mut().contacts.obstacles = obstacles;
    assembly.finish()
}

fn still(shape: ObstacleShape, surface: Surface) -> Obstacle {
    Obstacle::new(shape, surface)
}

fn block(pose: Pose, sides: Vector3<f64>) -> ObstacleShape {
    ObstacleShape::Box { pose, sides }
}

/// On three balls a box presses on each as the balance of forces and moments says.
#[test]
fn a_box_on_three_balls_presses_on_each_as_statics_says() {
    let radius = 0.05;
    let places = [[-0.12, -0.07], [0.1, -0.05], [0.03, 0.08]];
    let ball = |[x, y]: [f64; 2]| ObstacleShape::Sphere { centre: Vector3::new(x, y, -radius), radius };
    let pose = at(Vector3::z() * (0.5 * SIDES.z + 0.002));
    let balls: Vec<Obstacle> = places.map(|place| still(ball(place), rough(0.0))).into();
    let balance = Matrix3::from_columns(&places.map(|[x, y]| Vector3::new(1.0, x, y)));
    let exact = balance.try_inverse().unwrap() * Vector3::new(MASS * G, 0.0, 0.0);
    for shape in [brick(), meshed()] {
        let (model, state) = scene(shape, pose, balls.clone(), 2.0);
        let mut end = state.clone();
        let simulation = run((&model, &state), &sharp(), 150, |_, now| end.clone_from(now));
        assert!((end.positions[0].z - 0.5 * SIDES.z).abs() < 1e-5, "{}", end.positions[0]);
        for (found, exact) in reactions(&simulation, 3).iter().zip(&exact) {
            assert!((found - Vector3::z() * *exact).norm() < 2e-3 * MASS * G, "{found} instead of {exact}");
        }
    }
}

/// What a body rests on bears its weight below its centre of mass.
#[test]
fn a_body_rests_on_boxes_cylinders_capsules_and_meshes() {
    let h = 0.05;
    let outline = [[-0.1, -0.1], [0.1, -0.1], [0.1, 0.0], [0.0, 0.0], [0.0, 0.1], [-0.1, 0.1]];
    let angle = prism(&outline, &[[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]]);
    let angle = Arc::new(SolidMesh::full(angle).unwrap());
    let rail = |y: f64| {
        let place = |x: f64| Vector3::new(x, y, -0.03);
        ObstacleShape::Capsule { start: place(-0.5), end: place(0.5), radius: 0.03 }
    };
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.3);
    let table = Pose { position: Vector3::new(0.01, -0.02, -0.2), orientation: turn };
    let drum =
        |length: f64| ObstacleShape::Cylinder { start: Vector3::z() * -length, end: Vector3::zeros(), radius: 0.11 };
    let cases: [(&str, Vec<ObstacleShape>); 5] = [
        ("larger box", vec![block(table, Vector3::new(0.9, 0.8, 0.4))]),
        // Its edges cross those of the body.
        ("smaller box", vec![block(table, Vector3::new(0.16, 0.15, 0.4))]),
        ("cylinder", vec![drum(0.3)]),
        ("rails", vec![rail(-0.04), rail(0.03)]),
        ("sheet", vec![sheet(1.0, 12)]),
    ];
    for (name, shapes) in cases {
        for shape in [brick(), meshed(), BodyShape::Mesh(angle.clone())] {
            let lift = Vector3::z() * (h + 0.002);
            let pose = if let BodyShape::Mesh(solid) = &shape { solid.pose(&at(lift)) } else { at(lift) };
            let obstacles: Vec<Obstacle> = shapes.iter().map(|shape| still(shape.clone(), rough(0.5))).collect();
            let (model, state) = scene(shape, pose, obstacles, 2.0);
            let mut end = state.clone();
            let simulation = run((&model, &state), &sharp(), 100, |_, now| end.clone_from(now));
            assert!((end.positions[0].z - h).abs() < 1e-5, "{name}: {}", end.positions[0]);
            let (mut forces, mut sum, mut moment) = (Vec::new(), Vector3::zeros(), Vector3::zeros());
            simulation.store_contact_forces(&mut forces);
            for contact in &forces {
                sum += contact.force;
                moment += (contact.place - end.positions[0]).cross(&contact.force);
            }
            assert!((sum - Vector3::z() * MASS * G).norm() < 1e-3 * MASS * G, "{name}: {sum}");
            assert!(moment.norm() < 1e-3 * MASS * G * h, "{name}: {moment}");
        }
    }
}

/// Below the angle of friction a box stays on a slope; above it slides with g (sin a - mu cos a).
#[test]
fn a_box_slides_down_a_slope_of_a_box_above_the_angle_of_friction() {
    let angle = 0.5_f64.atan();
    let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle);
    let (down, up) = (turn * Vector3::x(), turn * Vector3::z());
    let slope = Pose { position: up * -0.1, orientation: turn };
    let start = Pose { position: up * (0.5 * SIDES.z + 1e-6) - down * 0.8, orientation: turn };
    let steps = 40;
    for friction in [0.51, 0.4, 0.1] {
        let ramp = still(block(slope, Vector3::new(3.0, 1.0, 0.2)), rough(friction));
        let (model, state) = scene(brick(), start, vec![ramp], 0.0);
        let mut end = state.clone();
        run((&model, &state), &sharp(), steps, |_, now| end.clone_from(now));
        let way = (end.positions[0] - start.position).dot(&down);
        let acceleration = G * (angle.sin() - friction * angle.cos()).max(0.0);
        let n = steps as f64;
        let exact = acceleration * DT * DT * 0.5 * n * (n + 1.0);
        println!("friction {friction}: {way} m, theory {exact} m");
        assert!((way - exact).abs() < 2e-3 * exact.max(0.01), "friction {friction}: {way} instead of {exact}");
        assert!((end.orientations[0].angle_to(&turn)).abs() < 1e-3, "it stays flat");
    }
}

/// Two edges that cross hold each other apart along the normal of both.
#[test]
fn an_edge_rests_on_an_edge_across_it() {
    let quarter = std::f64::consts::FRAC_PI_4;
    let side = 0.1;
    let half = side * 0.5_f64.sqrt();
    // Above with its lowest edge along x, below with its highest along y.
    let above = Pose {
        position: Vector3::z() * (half + 1e-4),
        orientation: UnitQuaternion::from_axis_angle(&Vector3::x_axis(), quarter),
    };
    let below = Pose {
        position: Vector3::z() * -half,
        orientation: UnitQuaternion::from_axis_angle(&Vector3::y_axis(), quarter),
    };
    let sides = Vector3::repeat(side);
    let (model, state) = scene(BodyShape::Box { sides }, above, vec![still(block(below, sides), rough(0.5))], 0.0);
    let mut end = state.clone();
    let simulation = run((&model, &state), &sharp(), 20, |_, now| end.clone_from(now));
    assert!((end.positions[0].z - half).abs() < 1e-5, "{}", end.positions[0]);
    let reaction = reactions(&simulation, 1)[0];
    assert!((reaction - Vector3::z() * MASS * G).norm() < 1e-3 * MASS * G, "{reaction}");
}

#[test]
fn a_fast_body_does_not_pass_through_a_thin_box() {
    let plate = || block(at(Vector3::z() * -0.01), Vector3::new(2.0, 2.0, 0.02));
    let ball = BodyShape::Sphere { radius: 0.05 };
    for shape in [brick(), meshed(), ball] {
        let (model, mut state) = scene(shape, at(Vector3::z() * 0.3), vec![still(plate(), rough(0.3))], 0.0);
        state.velocities[0] = Vector3::z() * -20.0;
        run((&model, &state), &sharp(), 40, |step, now| {
            assert!(now.positions[0].z > 0.0499, "step {step}: {}", now.positions[0]);
        });
    }
}

/// In a step it goes thirty times its own length.
#[test]
fn a_very_fast_body_does_not_pass_through_a_sheet() {
    for (shape, turn) in
        [brick(), meshed()].into_iter().flat_map(|shape| [0.0, 0.7, 2.0].map(|turn| (shape.clone(), turn)))
    {
        for count in [1, 20] {
            let orientation = UnitQuaternion::from_euler_angles(turn, 0.3 * turn, -turn);
            let pose = Pose { position: Vector3::new(0.1, 0.2, 1.3), orientation };
            let (model, mut state) = scene(shape.clone(), pose, vec![still(sheet(40.0, count), rough(0.3))], 0.0);
            state.velocities[0] = Vector3::new(20.0, 0.0, -300.0);
            run((&model, &state), &Settings::default(), 20, |step, now| {
                assert!(now.positions[0].z > 0.0, "{turn}, {count}, step {step}: {}", now.positions[0]);
            });
        }
    }
}

/// Round bodies rest on what has faces.
#[test]
fn balls_and_capsules_rest_on_boxes_cylinders_and_meshes() {
    let radius = 0.05;
    let lying = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.5 * std::f64::consts::PI);
    let table = block(at(Vector3::z() * -0.2), Vector3::new(0.9, 0.8, 0.4));
    let drum = ObstacleShape::Cylinder { start: Vector3::z() * -0.4, end: Vector3::zeros(), radius: 0.3 };
    for obstacle in [table, drum, sheet(1.0, 12)] {
        for shape in [BodyShape::Sphere { radius }, BodyShape::Capsule { radius, length: 0.2 }] {
            let pose = Pose { position: Vector3::new(0.01, 0.02, radius + 0.002), orientation: lying };
            let (model, state) = scene(shape, pose, vec![still(obstacle.clone(), rough(0.3))], 2.0);
            let mut end = state.clone();
            let simulation = run((&model, &state), &sharp(), 100, |_, now| end.clone_from(now));
            assert!((end.positions[0].z - radius).abs() < 1e-5, "{}", end.positions[0]);
            let reaction = reactions(&simulation, 1)[0];
            assert!((reaction - Vector3::z() * MASS * G).norm() < 1e-3 * MASS * G, "{reaction}");
        }
    }
}

/// A belt that is a box takes a box along, which slips until it has the belt's speed.
#[test]
fn a_belt_takes_a_box_along() {
    let (speed, friction) = (1.0, 0.4);
    let belt = block(at(Vector3::z() * -0.1), Vector3::new(6.0, 1.0, 0.2));
    let belt = steady(belt, rough(friction), Vector3::x() * speed, Vector3::zeros());
    let start = at(Vector3::z() * (0.5 * SIDES.z + 1e-6));
    let (model, state) = scene(brick(), start, vec![belt], 0.0);
    run((&model, &state), &sharp(), 60, |step, now| {
        let time = DT * (step + 1) as f64;
        let exact = (friction * G * time).min(speed);
        let found = now.velocities[0].x;
        // In the first step it comes down on the belt.
        assert!((found - exact).abs() < 0.05 * speed, "step {step}: {found} instead of {exact}");
        assert!(step < 40 || (found - speed).abs() < 1e-4, "step {step}: {found}");
    });
}

#[test]
fn overlaps_of_bodies_with_obstacles_are_refused() {
    let refused = |shape: BodyShape, obstacle: ObstacleShape| {
        let (model, state) = scene(shape, at(Vector3::zeros()), vec![still(obstacle, rough(0.0))], 0.0);
        Simulation::new(&model, &state, &Settings::default(), None).err().map(|error| error.to_string())
    };
    let table = |top: f64| block(at(Vector3::z() * (top - 0.2)), Vector3::new(0.9, 0.8, 0.4));
    let post = |top: f64| block(at(Vector3::z() * (top - 0.2)), Vector3::new(0.05, 0.04, 0.4));
    let ball = |top: f64| ObstacleShape::Sphere { centre: Vector3::z() * (top - 0.1), radius: 0.1 };
    for shape in [brick(), meshed()] {
        for [apart, deep] in [[-0.05, -0.04].map(table), [-0.05, -0.04].map(post), [-0.05, -0.04].map(ball)] {
            let kind = deep.kind();
            assert_eq!(refused(shape.clone(), apart), None, "{kind}");
            let text = refused(shape.clone(), deep).unwrap();
            assert!(text.contains(&format!("overlaps obstacle 0 (a {kind}) by 0.01 m")), "{text}");
        }
    }
    assert!(refused(brick(), sheet(1.0, 5)).is_some(), "a sheet through its middle");
    assert!(refused(brick(), block(at(Vector3::zeros()), Vector3::repeat(2.0))).is_some(), "inside");
}

/// What tumbles and bounces keeps its energy with a restitution of 1, but for what a step's turn is worth, and loses some with less.
#[test]
fn tumbling_bodies_win_nothing_as_they_bounce() {
    let tilted = Pose {
        position: Vector3::z() * 0.5,
        orientation: UnitQuaternion::from_euler_angles(10_f64.to_radians(), 20_f64.to_radians(), 0.0),
    };
    let shapes = [
        BodyShape::Cylinder { radius: 0.1, length: 0.2 },
        BodyShape::Box { sides: Vector3::new(0.2, 0.15, 0.1) },
        BodyShape::Capsule { radius: 0.05, length: 0.3 },
    ];
    for shape in shapes {
        for (restitution, most) in [(1.0, 1.03), (0.9, 1.005)] {
            let floor = ObstacleShape::HalfSpace { point: Vector3::zeros(), normal: Vector3::z_axis() };
            let surface = Surface { restitution, ..rough(0.0) };
            let (model, state) = scene(shape.clone(), tilted, vec![still(floor, surface)], 0.0);
            let energy = |state: &State| measure::energy(&model, state).total();
            let start = energy(&state);
            let mut highest = start;
            run((&model, &state), &sharp(), 300, |_, now| highest = highest.max(energy(now)));
            assert!(highest < most * start, "{shape:?}, {restitution}: {highest} J of {start} J");
        }
    }
}

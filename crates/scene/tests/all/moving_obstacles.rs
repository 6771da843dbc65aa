//! Obstacles with a motion in scene files: where they are over time, and what is wrong with a motion.

use nalgebra::{UnitQuaternion, Vector3};
use rod::{Obstacle, ObstacleShape};

const ROD: &str = "[[rods]]\nradius_m = 0.01\nshape.straight = { start_m = [0, 0, 9], length_m = 1, segments = 10 }\n";

/// A scene with obstacles of these lines; the first is on line 4.
fn text(obstacles: &str) -> String {
    format!("{ROD}{obstacles}\n")
}

fn parsed(obstacles: &str) -> Vec<Obstacle> {
    scene::parse(&text(obstacles), "scenes/x.toml").unwrap().model.contacts.obstacles
}

fn error(motion: &str) -> String {
    let obstacle = format!("[[obstacles]]\nshape.sphere = {{ radius_m = 0.5 }}\n{motion}");
    scene::parse(&text(&obstacle), "scenes/x.toml").unwrap_err().to_string()
}

#[test]
fn what_has_no_motion_stands_still() {
    let [plane] = &parsed("[[obstacles]]\nshape.plane = { point_m = [0, 0, -1] }")[..] else { panic!() };
    assert_eq!((plane.motion.is_none(), plane.shape_at(7.0)), (true, plane.shape.clone()));
}

#[test]
fn shapes_turn_about_their_pivots() {
    let motion =
        "motion = { times_s = [1, 3], shifts_m = [[0, 0, 0], [0, 0, 2]], turns_deg = [[0, 0, 0], [90, 0, 0]] }";
    let shapes = [
        "shape.plane = { point_m = [0, 3, -1], normal = [0, 0, 1] }",
        "shape.sphere = { centre_m = [1, 2, 3], radius_m = 0.5 }",
        "shape.capsule = { start_m = [0, 1, 0], end_m = [0, 5, 0], radius_m = 0.5 }",
    ];
    let obstacles = parsed(&shapes.map(|shape| format!("[[obstacles]]\n{shape}\n{motion}\n")).concat());
    let near = |a: Vector3<f64>, b: [f64; 3]| assert!((a - Vector3::from(b)).norm() < 1e-12, "{a} {b:?}");
    for obstacle in &obstacles {
        assert_eq!(obstacle.at(0.5).pose.position, obstacle.shape.pivot());
        near(obstacle.at(2.0).velocity, [0.0, 0.0, 1.0]);
    }
    let end = |k: usize| obstacles[k].shape_at(3.0);
    let ObstacleShape::HalfSpace { point, normal } = end(0) else { panic!() };
    near(point, [0.0, 3.0, 1.0]);
    near(normal.into_inner(), [0.0, -1.0, 0.0]);
    let ObstacleShape::Sphere { centre, .. } = end(1) else { panic!() };
    near(centre, [1.0, 2.0, 5.0]);
    let ObstacleShape::Capsule { start, end, .. } = end(2) else { panic!() };
    near(start, [0.0, 3.0, 0.0]);
    near(end, [0.0, 3.0, 4.0]);
}

/// Two fingers that one gripper holds keep their places in it.
#[test]
fn obstacles_with_one_grippers_motion_are_one_rigid_body() {
    let motion = "motion.times_s = [0, 1]\nmotion.positions_m = [[0, 0, 2], [1, 0, 3]]\n\
                  motion.orientations = [[1, 0, 0, 0], [0.7071067811865476, 0, 0, 0.7071067811865476]]";
    let finger =
        |x: f64| format!("[[obstacles]]\nshape.sphere = {{ centre_m = [{x}, 0, 1], radius_m = 0.1 }}\n{motion}\n");
    let fingers = parsed(&[finger(-0.2), finger(0.2)].concat());
    let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * std::f64::consts::FRAC_PI_2);
    for (finger, x) in fingers.iter().zip([-0.2, 0.2]) {
        assert!((finger.at(0.0).pose.position - finger.shape.pivot()).norm() < 1e-15);
        let expected = Vector3::new(1.0, 0.0, 3.0) + turn * Vector3::new(x, 0.0, -1.0);
        assert!((finger.at(1.0).pose.position - expected).norm() < 1e-12);
    }
}

#[test]
fn tables_are_those_of_rods() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("way.csv"), "time_s,shift_x_m,shift_y_m,shift_z_m\n0,0,0,0\n2,0,4,0\n").unwrap();
    let file = folder.path().join("x.toml");
    std::fs::write(&file, text("[[obstacles]]\nshape.sphere.radius_m = 0.5\nmotion.file = \"way.csv\"")).unwrap();
    let scene = scene::load(&file).unwrap();
    assert_eq!(scene.model.contacts.obstacles[0].at(1.0).pose.position, Vector3::y() * 2.0);
}

#[test]
fn what_is_no_motion_of_an_obstacle_is_refused_with_its_key() {
    for (motion, expected) in [
        (
            "motion = { segment = 0, times_s = [0], shifts_m = [[0, 0, 0]] }",
            "6: obstacles[0].motion.segment: is a place on a rod; an obstacle moves as a whole, leave it out",
        ),
        (
            "motion = { at = \"end-face\", times_s = [0], shifts_m = [[0, 0, 0]] }",
            "6: obstacles[0].motion.at: is a place on a rod; an obstacle moves as a whole, leave it out",
        ),
        (
            "motion = { times_s = [0], shifts_m = [[0, 0, 0]], from_s = 1 }",
            "6: obstacles[0].motion.from_s: is of grips on rods; an obstacle moves all the time, leave it out",
        ),
        ("motion = {}", "6: obstacles[0].motion: give either `times_s` and lists, or a `file`"),
        (
            "motion = { times_s = [0, 1], shifts_m = [[0, 0, 1], [0, 0, 0]] }",
            "6: obstacles[0].motion.shifts_m[0] = [0, 0, 1], but it must be [0, 0, 0]: a motion begins where its body is",
        ),
        (
            "motion = { times_s = [1, 0], shifts_m = [[0, 0, 0], [0, 0, 0]] }",
            "6: obstacles[0].motion.times_s[1] = 0, but it must be later than the time before it",
        ),
    ] {
        assert_eq!(error(motion), format!("scenes/x.toml:{expected}"));
    }
}

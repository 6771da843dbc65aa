//! Rigid bodies in scene files: what their keys mean, and what is refused.

use nalgebra::{UnitQuaternion, Vector3};
use rod::{Body, BodyShape, Changing, measure};

const SCENE: &str = include_str!("../bodies.toml");

fn scene() -> scene::Scene {
    scene::parse(SCENE, "bodies.toml").unwrap()
}

#[test]
fn bodies_have_the_mass_inertia_and_pose_that_are_given() {
    let scene::Scene { model, state, rods, .. } = scene();
    let names: Vec<&str> = rods.iter().map(|rod| rod.name.as_str()).collect();
    assert_eq!(names, ["hook", "trolley", "body-2", "wall", "unseen", "cable", "sling", "line"]);
    let body = |i: usize| model.segments[i].body.as_ref().unwrap();
    assert_eq!(body(0).shape, BodyShape::Capsule { radius: 0.1, length: 0.3 });
    assert_eq!((body(0).mass, body(0).inertia), (20.0, Vector3::new(0.5, 0.6, 0.2)));
    assert!((state.axis(0) - Vector3::x()).norm() < 1e-12, "turned by 90 degrees about y");
    assert_eq!((state.velocities[0].x, state.angular_velocities[0].z), (0.1, 0.5));
    assert!((body(1).mass - 24.0).abs() < 1e-12);
    assert!((body(1).inertia - Vector3::new(0.13, 0.20, 0.25) * 2.0).norm() < 1e-12);
    let turned = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 2.0 * 0.6_f64.asin());
    assert!(state.orientations[2].angle_to(&turned) < 1e-12);
    assert_eq!(body(4).inertia, Vector3::new(0.01, 0.02, 0.03));
    assert_eq!((body(0).drag_area, body(4).drag_area), (0.04, 0.0));
    assert_eq!([0, 1, 2, 3, 4].map(|i| body(i).touches), [true, false, true, false, false]);
    assert_eq!([0, 1, 2, 3, 4].map(|i| model.segments[i].fixed), [false, true, false, true, false]);
}

#[test]
fn bodies_are_driven_loaded_and_joined_as_they_say() {
    let scene::Scene { model, state, rods, .. } = scene();
    // The trolley's and the first eyelet's.
    assert_eq!(model.motions.len(), 2);
    assert_eq!(model.motions[0].body, Body::Segment(1));
    assert!((state.velocities[1] - Vector3::x() * 0.5).norm() < 1e-12);
    assert_eq!(model.loads.iter().map(|load| (load.segment, load.offset)).collect::<Vec<_>>(), [(0, 0.0), (0, 0.0)]);
    assert_eq!((model.loads[0].force, model.loads[0].torque.x), (Vector3::new(1.0, 2.0, 3.0), 0.1));
    assert_eq!(model.changes[0].of, Changing::Force(1));
    let held: Vec<_> =
        model.joints.iter().filter(|joint| joint.mount.is_some()).map(|joint| (joint.a, joint.b)).collect();
    let of = |rod: usize, last: bool| {
        let segments = &rods[rod].segments;
        Body::Segment(if last { segments.end - 1 } else { segments.start })
    };
    let expected = [(5, false, 1), (6, false, 0), (7, false, 3), (5, true, 0), (6, true, 2), (7, true, 4)];
    assert_eq!(held, expected.map(|(rod, last, body)| (of(rod, last), Body::Segment(body))));
    assert!(measure::worst_gap(&model, &state) < 1e-9);
    for joint in &model.joints {
        assert!(measure::bend_strain(&model, &state, joint).norm() < 1e-9, "at rest as they are");
    }
    // Without `at_m` the ball is held where the sling ends: at its top.
    let place = model.joints.iter().find(|joint| joint.b == Body::Segment(2)).unwrap();
    let arm = place.arm_b(&state.orientations[2]);
    assert!((arm - Vector3::z() * 0.2).norm() < 1e-12, "{arm}");
}

/// The error of the scene with `from` replaced by `to`, without the line.
fn error(from: &str, to: &str) -> String {
    assert!(SCENE.contains(from), "{from}");
    let error = scene::parse(&SCENE.replacen(from, to, 1), "x.toml").unwrap_err().to_string();
    error.split_once(": ").unwrap().1.to_owned()
}

#[test]
fn mistakes_are_named() {
    let cases = [
        ("mass_kg = 20", "mass_kg = 0", "bodies[0].mass_kg = 0, but it must be finite and > 0 [kg]"),
        ("mass_kg = 20", "", "bodies[0]: give either `mass_kg` or `density_kg_m3`"),
        ("mass_kg = 20", "mass_kg = 20\ndensity_kg_m3 = 1", "bodies[0]: give either `mass_kg` or `density_kg_m3`"),
        (
            "radius_m = 0.1, l",
            "radius_m = -1, l",
            "bodies[0].shape.capsule.radius_m = -1, but it must be finite and > 0 [m]",
        ),
        (
            "sides_m = [0.4, 0.3, 0.2]",
            "sides_m = [0.4, 0, 0.2]",
            "bodies[1].shape.box.sides_m[1] = 0, but it must be finite and > 0 [m]",
        ),
        (
            "[0.5, 0.6, 0.2]",
            "[0.5, 0.9, 0.2]",
            "bodies[0].inertia_kg_m2 = [0.5, 0.9, 0.2], but it must be three moments of inertia > 0 [kg m^2], none larger than the sum of the other two",
        ),
        (
            "turn_deg = [0, 90, 0]",
            "turn_deg = [0, 90, 0]\norientation = [1, 0, 0, 0]",
            "bodies[0].turn_deg: give either `orientation` or `turn_deg`, not both",
        ),
        (
            "[0.8, 0, 0.6, 0]",
            "[0.8, 0, 0.8, 0]",
            "bodies[2].orientation = [0.8, 0, 0.8, 0], but it must be a unit quaternion [w, x, y, z], its norm 1 to within 1e-3",
        ),
        ("inertia_kg_m2 = [0.01, 0.02, 0.03]", "", "bodies[4]: a hidden body needs `inertia_kg_m2`"),
        (
            "shape.hidden = {}",
            "shape.hidden = {}\ntouches = true",
            "bodies[4].touches = true, but it must be false: a hidden body has nothing to touch with",
        ),
        (
            "drag_area_m2 = 0.04",
            "drag_area_m2 = -1",
            "bodies[0].drag_area_m2 = -1, but it must be finite and >= 0 [m^2]",
        ),
        (
            "fixed = true",
            "fixed = true\nvelocity_m_s = [1, 0, 0]",
            "bodies[3].velocity_m_s: this body is held; leave its velocity out, or give `motions`",
        ),
        (
            "motions = [{ times_s",
            "motions = [{ segment = 0, times_s",
            "bodies[1].motions[0].segment: a body is moved and loaded at its centre of mass; leave this out",
        ),
        (
            "loads = [{ force_n",
            "loads = [{ at = \"end-face\", force_n",
            "bodies[0].loads[0].at: a body is moved and loaded at its centre of mass; leave this out",
        ),
        (
            "loads = [{ force_n",
            "loads = [{ times_s = [0], force_n",
            "bodies[0].loads[0].times_s: goes with `forces_n` or `torques_n_m`",
        ),
        ("{ rod = \"cable\" }", "{}", "joins[0].a: missing key `rod` (or `body`)"),
        (
            "{ rod = \"cable\" }",
            "{ rod = \"cable\", body = \"hook\" }",
            "joins[0].a.body: give either `rod` or `body`, not both",
        ),
        (
            "{ rod = \"cable\" }",
            "{ rod = \"cable\", at_m = [0, 0, 0] }",
            "joins[0].a.at_m: goes with `body`, not with `rod`",
        ),
        (
            "{ rod = \"cable\" }",
            "{ rod = \"hook\" }",
            "joins[0].a.rod = \"hook\", but it must be the name of a rod that comes before it: `cable`, `sling`, `line`; `hook` is a rigid body",
        ),
        ("{ rod = \"cable\" }", "{ body = \"wall\" }", "joins[0]: one of `a` and `b` must be a `rod`"),
        (
            "{ body = \"body-2\" }",
            "{ body = \"body-2\", segment = 0 }",
            "joins[1].a.segment: goes with `rod`, not with `body`",
        ),
        (
            "{ body = \"body-2\" }",
            "{ body = \"cable\" }",
            "joins[1].a.body = \"cable\", but it must be the name of a body: `hook`, `trolley`, `body-2`, `wall`, `unseen`; `cable` is a rod",
        ),
        (
            "at_m = [-0.1, 0, 0]",
            "at_m = [-0.2, 0, 0]",
            "joins[0]: `a` and `b` are 0.1 m apart, but places to be joined must meet within 0.00280179 m; without `at_m` the body is held where the rod is",
        ),
        (
            "name = \"wall\"",
            "name = \"hook\"",
            "bodies[3].name = \"hook\", but it must be a name that no other rod has",
        ),
    ];
    for (from, to, expected) in cases {
        assert_eq!(error(from, to), expected, "{to}");
    }
}

//! Pulleys: what comes of their keys, and errors.

use nalgebra::Vector3;
use rod::{Body, Wheel};

const ROPE: &str = "[[bodies]]\nname = \"box\"\nshape.box = { sides_m = [0.1, 0.1, 0.1] }\nmass_kg = 1\nposition_m = [0, 0, 1]\n\
                    [[rods]]\nname = \"rope\"\nshape.straight = { start_m = [-1, 0, 0.1], direction = [1, 0, 0], length_m = 2, segments = 40 }\n";

fn with(keys: &str) -> Result<scene::Scene, String> {
    scene::parse(&format!("{ROPE}[[pulleys]]\n{keys}\n"), "x.toml").map_err(|error| error.to_string())
}

const PLACE: &str = "rod = \"rope\"\ncentre_m = [0, 0, 0]\naxis = [0, 2, 0]\nradius_m = 0.1\n";

#[test]
fn a_pulley_is_what_its_keys_say() {
    let scene = with(PLACE).unwrap();
    assert_eq!(scene.pulleys, ["pulley-0"]);
    let own = &scene.model.pulleys[0];
    assert_eq!((own.holder, own.segments.clone(), own.radius), (Body::Anchor(0), 1..41, 0.1));
    assert_eq!((own.wheel.clone(), *own.axis), (Wheel::Free, Vector3::y()));
    let scene = with(&format!("{PLACE}on = {{ body = \"box\" }}\nfriction = 0.2\nname = \"sheave\"")).unwrap();
    let own = &scene.model.pulleys[0];
    assert_eq!((own.holder, own.centre), (Body::Segment(0), -Vector3::z()));
    assert_eq!((own.wheel.clone(), &scene.pulleys[0][..]), (Wheel::Held { friction: 0.2 }, "sheave"));
    // A wheel that turns is a body on a hinge, whose moment of inertia is what the key says.
    let scene = with(&format!("{PLACE}friction = 0.2\ninertia_kg_m2 = 0.01\nname = \"disc\"")).unwrap();
    let own = &scene.model.pulleys[0];
    assert_eq!(own.holder, Body::Segment(41));
    assert_eq!(scene.rods[2].name, "disc");
    let disc = scene.model.segments[41].body.as_ref().unwrap();
    assert!((disc.inertia.z - 0.01).abs() < 1e-12 && !disc.touches);
    let axis = scene.state.orientations[41] * *own.axis;
    assert!((axis - Vector3::y()).norm() < 1e-9, "{axis}");
    let keys = "friction = 0.2\ndrive = { times_s = [0, 1], rates_rad_s = [0, 3], max_torque_n_m = 5 }";
    let scene = with(&format!("{PLACE}{keys}")).unwrap();
    let rates = vec![[0.0, 0.0], [1.0, 3.0]];
    assert_eq!(scene.model.pulleys[0].wheel, Wheel::Driven { friction: 0.2, rates, max_torque: 5.0 });
}

#[test]
fn errors_name_the_key() {
    for (keys, expected) in [
        ("friction = -1", "pulleys[0].friction = -1, but it must be finite and >= 0"),
        ("inertia_kg_m2 = 1", "pulleys[0].inertia_kg_m2: needs `friction`, by which the rod turns the wheel"),
        ("drive = { rate_rad_s = 1 }", "pulleys[0].drive: needs `friction`, by which the wheel takes the rod along"),
        ("friction = 1\ndrive = { max_torque_n_m = 1 }", "pulleys[0].drive: must have `rate_rad_s`, or `times_s` and"),
        (
            "friction = 1\ninertia_kg_m2 = 1\ndrive = { rate_rad_s = 1 }",
            "pulleys[0].inertia_kg_m2: does not go with `on`, `drive` and `motion`",
        ),
        ("on = { rod = \"rope\" }", "pulleys[0].on: is the rod that runs over the pulley"),
        ("on = { body = \"box\", at_m = [0, 0, 0] }", "pulleys[0].on: the axle is at `centre_m`; leave `at_m` out"),
        (
            "on = { body = \"box\" }\nmotion = { times_s = [0], shifts_m = [[0, 0, 0]] }",
            "pulleys[0].motion: does not go with `on`; leave one of them out",
        ),
        ("name = \"a,b\"", "pulleys[0].name = \"a,b\", but it must be a name without commas"),
    ] {
        let error = with(&format!("{PLACE}{keys}")).unwrap_err();
        assert!(error.contains(expected), "{error}");
    }
    for (place, expected) in [
        (
            PLACE.replace("radius_m = 0.1", "radius_m = 0.01"),
            "must be at least the length of the rod's longest segment",
        ),
        (PLACE.replace("[0, 0, 0]", "[0, 0, 5]"), "m off the pulley's groove at best; draw it along the groove"),
        (PLACE.replace("\"rope\"", "\"rop\""), "pulleys[0].rod = \"rop\", but it must be the name of a rod"),
        (PLACE.replace("rod = \"rope\"", "rod = \"box\""), "`box` is a rigid body"),
        (PLACE.replace("axis = [0, 2, 0]", ""), "pulleys[0]: missing key `axis`"),
    ] {
        let error = with(&place).unwrap_err();
        assert!(error.contains(expected), "{error}");
    }
    let two = with(&format!("{PLACE}name = \"a\"\n[[pulleys]]\n{PLACE}name = \"a\""));
    assert!(two.unwrap_err().contains("but it must be a name that no other pulley has"));
}

#[test]
fn every_key_goes_with_some_others() {
    let scene = scene::parse(include_str!("../pulleys.toml"), "pulleys.toml").unwrap();
    assert_eq!(scene.pulleys, ["wheel", "pulley-1", "pulley-2"]);
    assert_eq!(scene.model.motions.len(), 1);
}

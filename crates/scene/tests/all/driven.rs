//! Rest shapes over time, loads that turn with segments, motors, springs along rods, buoyancy: what comes of their keys, and errors.

use std::num::NonZero;

use nalgebra::Vector3;
use rod::{Body, Changing, Freedom};

const ROD: &str = "[[rods]]\nshape.straight = { direction = [0, 0, 1], length_m = 2, segments = 4 }\n";

fn parse(text: &str) -> Result<scene::Scene, String> {
    scene::parse(text, "x.toml").map_err(|error| error.to_string())
}

fn with(keys: &str) -> Result<scene::Scene, String> {
    parse(&format!("{ROD}{keys}\n"))
}

#[test]
fn rests_over_time_are_what_the_keys_say() {
    let scene = with("rest_over_time = { times_s = [0, 1], darboux_per_m = [[0, 1, 0], [0, 3, 0]] }").unwrap();
    let model = &scene.model;
    assert_eq!(model.changes.len(), 3);
    for (k, change) in model.changes.iter().enumerate() {
        assert_eq!((change.of, change.track.at(0.5)), (Changing::Rest(k), Vector3::y() * 2.0));
        assert_eq!(model.joints[k].rest_darboux, Vector3::y());
    }
    let of_joints = "rest_over_time = { times_s = [0, 1], interpolation = \"held\", darboux_of_joints_per_m = \
                     [[[0, 1, 0], [0, 2, 0], [0, 3, 0]], [[0, 0, 0], [1, 0, 0], [0, 0, 1]]] }";
    let scene = with(of_joints).unwrap();
    let at = |time: f64| scene.model.changes.iter().map(|change| change.track.at(time)).collect::<Vec<_>>();
    assert_eq!(at(0.9), [1.0, 2.0, 3.0].map(|x| Vector3::y() * x));
    assert_eq!(at(1.0), [Vector3::zeros(), Vector3::x(), Vector3::z()]);
    // Parts of a segment have what the nearest joint of the file has.
    let fine = scene::parse_refined(&format!("{ROD}{of_joints}"), "x.toml", NonZero::new(2).unwrap()).unwrap();
    let seen: Vec<_> = fine.model.changes.iter().map(|change| change.track.at(0.0).y).collect();
    assert_eq!(seen, [1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 3.0]);
}

#[test]
fn a_branch_bends_about_the_axes_of_its_drawing() {
    // Its frames are turned about its axis to fit its parent.
    let arms = "[[rods]]\nname = \"a\"\nshape.straight = { direction = [0, 1, 0], length_m = 1, segments = 2 }\n\
                [[rods]]\nbranch_of = { rod = \"a\" }\nshape.straight = { direction = [0, 0, -1], length_m = 1, segments = 4 }\n";
    let still = parse(&format!("{arms}rest = {{ darboux_per_m = [0.5, 1, 0.2] }}")).unwrap();
    let over_time = "rest_over_time = { times_s = [0, 1], darboux_per_m = [[0.5, 1, 0.2], [0.5, 1, 0.2]] }";
    let over_time = parse(&format!("{arms}{over_time}")).unwrap();
    assert_eq!(over_time.model.joints, still.model.joints);
    for change in &over_time.model.changes {
        let Changing::Rest(joint) = change.of else { panic!("{change:?}") };
        assert!((change.track.at(0.5) - still.model.joints[joint].rest_darboux).norm() < 1e-12);
    }
    assert!((still.model.joints[1].rest_darboux - Vector3::new(0.5, 1.0, 0.2)).norm() > 0.1, "they are turned");
}

#[test]
fn probes_read_the_rod_and_not_its_springs() {
    let springs = "[[rods.foundations]]\nacross_n_m2 = 100\n[[probes]]\nrod = \"rod-0\"\nsegment = 2\nquantities = [\"moment\"]\n";
    let scene = with(springs).unwrap();
    let joint = scene.probes[0].joint(&scene.model).unwrap();
    assert!(!scene.model.joints[joint].is_foundation());
    assert_eq!(scene.model.joints_of(&(0..4)), [0, 1, 2]);
}

#[test]
fn a_file_has_rests_over_time() {
    let folder = tempfile::tempdir().unwrap();
    let read = |table: &str| {
        std::fs::write(folder.path().join("rest.csv"), table).unwrap();
        std::fs::write(folder.path().join("x.toml"), format!("{ROD}rest_over_time.file = \"rest.csv\"\n")).unwrap();
        scene::load(folder.path().join("x.toml")).map_err(|error| error.to_string())
    };
    let scene = read("time_s,d1_per_m,d2_per_m,d3_per_m\n0,0,0,0\n2,1,0,0\n").unwrap();
    assert_eq!(scene.model.changes[2].track.at(1.0), Vector3::x() * 0.5);
    let head = "time_s,joint,d1_per_m,d2_per_m,d3_per_m\n";
    let scene = read(&format!("{head}0,0,0,0,0\n0,1,0,0,0\n0,2,0,0,0\n1,0,0,0,1\n1,1,0,0,2\n1,2,0,0,3\n")).unwrap();
    assert_eq!(scene.model.changes[1].track.at(1.0), Vector3::z() * 2.0);
    for (table, expected) in [
        (
            format!("{head}0,0,0,0,0\n0,2,0,0,0\n"),
            "rest.csv:3: joint = 2, but the next one is 1: each time has joints 0 to 2",
        ),
        (format!("{head}0,0,0,0,0\n1,1,0,0,0\n"), "rest.csv:3: time_s = 1, but joint 1 of 0 is missing"),
        (format!("{head}0,0,0,0,0\n"), "the last time has 1 joints of 3"),
        ("time_s,d1_per_m,d2_per_m,d3_per_m\n1,0,0,0\n1,0,0,0\n".to_owned(), "time_s = 1, but it must be later than 1"),
        (
            "time_s,d1_per_m,d2_per_m,d3_per_m\n1,0,9,0\n".to_owned(),
            "must be shorter than 2 / segment length = 4 [1/m]",
        ),
        ("time_s\n1\n".to_owned(), "there must be columns time_s, d1_per_m, d2_per_m and d3_per_m"),
        ("time_s,d1_per_m,d2_per_m,d3_per_m\n".to_owned(), "there must be a row at least"),
    ] {
        let error = read(&table).unwrap_err();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn a_load_that_follows_is_given_in_axes_as_drawn() {
    // The rod is drawn along x, so that its segments are turned.
    let rod = "[[rods]]\nshape.straight = { length_m = 2, segments = 4 }\n[[rods.loads]]\nat = \"end-face\"\nfollows = true\n";
    let scene = parse(&format!("{rod}force_n = [1, 2, 3]\ntorque_n_m = [0, 0, 1]")).unwrap();
    let load = &scene.model.loads[0];
    assert!(load.follows);
    let [force, torque] = load.in_world(&scene.state.orientations[3]);
    assert!((force - Vector3::new(1.0, 2.0, 3.0)).norm() < 1e-12 && (torque - Vector3::z()).norm() < 1e-12);
    let scene = parse(&format!("{rod}times_s = [0, 1]\nforces_n = [[0, 0, 0], [1, 2, 3]]")).unwrap();
    let end = scene.model.changes[0].track.at(1.0);
    assert!((scene.state.orientations[3] * end - Vector3::new(1.0, 2.0, 3.0)).norm() < 1e-12);
}

#[test]
fn a_motor_turns_both_rods() {
    let arms = "[[rods]]\nname = \"a\"\nshape.straight = { direction = [0, 1, 0], length_m = 1, segments = 2 }\n";
    let joint = "[[rods]]\nbranch_of = { rod = \"a\" }\nbranch_joint = \"hinge\"\n\
                 shape.straight = { length_m = 1, segments = 2 }\n";
    for motor in ["torque_n_m = 2", "times_s = [0, 1]\ntorques_n_m = [2, 2]"] {
        let scene = parse(&format!("{arms}{joint}[rods.branch_motor]\n{motor}")).unwrap();
        let model = &scene.model;
        let joint = model.joints.iter().find(|joint| joint.freedom == Freedom::Hinge).unwrap();
        assert_eq!([joint.a, joint.b], [Body::Segment(1), Body::Segment(2)]);
        let torques: Vec<_> = model
            .loads
            .iter()
            .map(|load| (load.segment, load.in_world(&scene.state.orientations[load.segment])[1]))
            .collect();
        // About the axis of `a`, along y.
        assert!(torques[0].0 == 2 && (torques[0].1 - Vector3::y() * 2.0).norm() < 1e-12, "{torques:?}");
        assert!(torques[1].0 == 1 && (torques[1].1 + Vector3::y() * 2.0).norm() < 1e-12, "{torques:?}");
    }
    let join = "[[rods]]\nname = \"b\"\nshape.straight = { start_m = [0, 1, 0], length_m = 1, segments = 2 }\n\
                [[joins]]\na = { rod = \"a\" }\nb = { rod = \"b\", segment = 0, fraction = 0 }\njoint = \"hinge\"\nmotor.torque_n_m = 1\n";
    assert_eq!(parse(&format!("{arms}{join}")).unwrap().model.loads.len(), 2);
    for (text, expected) in [
        (
            format!("{arms}{join}[[copies]]\nrods = [\"b\"]\nshifts_m = [[1, 0, 0]]"),
            "copies[0].rods: a motor turns one of these rods against another one; name that rod, too",
        ),
        (
            format!("{arms}{}", join.replace("hinge", "ball")),
            "joins[0].motor: goes with `joint = \"hinge\"` between two rods",
        ),
        (
            format!("{arms}{}branch_motor.torque_n_m = 1", joint.replace("hinge", "ball")),
            "rods[1].branch_motor: goes with `branch_joint = \"hinge\"`",
        ),
        (
            format!("{arms}{joint}branch_motor.times_s = [0]"),
            "give either `torque_n_m`, or `times_s` and `torques_n_m`",
        ),
    ] {
        let error = parse(&text).unwrap_err();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn springs_lie_along_a_part_of_a_rod() {
    let scene = with("[[rods.foundations]]\nfrom = 0.5\nacross_n_m2 = 100\nalong_n_m2 = 50\ndamping_s = 0.1").unwrap();
    let model = &scene.model;
    let springs: Vec<_> = model.joints.iter().filter(|joint| joint.freedom == Freedom::Ball).collect();
    assert_eq!(springs.iter().map(|joint| joint.b).collect::<Vec<_>>(), [Body::Segment(2), Body::Segment(3)]);
    for spring in springs {
        assert!(
            (spring.shear_compliance - 1.0 / 50.0).abs() < 1e-12
                && (spring.stretch_compliance - 1.0 / 25.0).abs() < 1e-12
        );
        assert_eq!(spring.inner_damping.stretch, 0.1);
    }
    for (keys, expected) in [
        ("from = 0.5\nuntil = 0.5\nacross_n_m2 = 1", "rods[0].foundations[0]: `until` must be greater than `from`"),
        ("from = 0.9\nacross_n_m2 = 1", "there is no segment's centre between `from` and `until`"),
        (
            "across_n_m2 = 1\n[[rods.loads]]\nat = \"end-face\"\nforce_n = [1, 0, 0]\nrepeats = true",
            "`repeats` goes with `times_s`",
        ),
        ("from = 0.1", "give `across_n_m2` or `along_n_m2` or both"),
        ("across_n_m2 = -1", "rods[0].foundations[0].across_n_m2 = -1, but it must be finite and >= 0 [N/m^2]"),
    ] {
        let error = with(&format!("[[rods.foundations]]\n{keys}")).unwrap_err();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn all_keys_together_are_a_scene() {
    let scene = scene::parse(include_str!("../driven.toml"), "driven.toml").unwrap();
    // Two rests a joint; a load that follows and one over time, two motors of two loads each, and what lifts each segment.
    assert_eq!(scene.model.loads.len(), 2 + 4 + 12);
    assert_eq!(scene.model.changes.iter().filter(|change| matches!(change.of, Changing::Rest(_))).count(), 4);
}

#[test]
fn what_floats_is_lifted_by_the_water_that_it_displaces() {
    let water = "air = { density_kg_m3 = 1000, buoyancy = true }\n";
    let ball = "[[bodies]]\nmass_kg = 1\nposition_m = [0, 0, 3]\nshape.sphere.radius_m = 0.1\n";
    let scene = parse(&format!("{water}{ROD}radius_m = 0.02\ndensity_kg_m3 = 1000\n{ball}")).unwrap();
    let model = &scene.model;
    assert_eq!(model.loads.len(), 5);
    for load in &model.loads {
        let segment = &model.segments[load.segment];
        let net = load.force.z - 9.81 * segment.mass();
        let expected = if segment.body.is_some() { 9.81 * (4.0 / 3.0 * std::f64::consts::PI - 1.0) } else { 0.0 };
        assert!((net - expected).abs() < 1e-9, "{net} N, not {expected}");
    }
    let arrows = scene.model.lifts.iter().map(|lift| lift.load).collect::<Vec<_>>();
    assert_eq!(arrows, [0, 1, 2, 3, 4]);
    let feed = "[[eyelets]]\nat = { rod = \"rod-0\", segment = 2, fraction = 0 }\nfeed = { speed_m_s = 1 }\n";
    let error = parse(&format!("{water}{ROD}{feed}")).unwrap_err();
    assert!(error.contains("air.buoyancy: does not go with a feed that has a store"), "{error}");
    let turning = "gravity_over_time = { times_s = [0, 1], values_m_s2 = [[0, 0, -9.81], [9.81, 0, 0]] }\n";
    let scene = parse(&format!("{turning}{water}{ROD}")).unwrap();
    let mut model = scene.model;
    model.set_changing(1.0);
    assert!(model.loads.iter().all(|load| load.force.x < 0.0 && load.force.z == 0.0));
}

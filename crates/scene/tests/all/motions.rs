//! Motions in scene files: what they drive, and what is wrong with them.

use nalgebra::{UnitQuaternion, Vector3};
use rod::{Body, Driven};
use scene::Scene;

/// A metre of cable along x from the origin, held at its start, with these lines for a motion.
fn text(motion: &str) -> String {
    format!(
        "run.dt_s = 0.01\n[[rods]]\nname = \"cable\"\nradius_m = 0.01\nclamp = [\"start-face\"]\n\
         shape.straight = {{ length_m = 1, segments = 10 }}\n[[rods.motions]]\n{motion}\n"
    )
}

fn parsed(motion: &str) -> Scene {
    scene::parse(&text(motion), "scenes/x.toml").unwrap()
}

fn error(motion: &str) -> String {
    scene::parse(&text(motion), "scenes/x.toml").unwrap_err().to_string()
}

#[test]
fn a_face_is_held_and_driven() {
    let scene = parsed(
        "at = \"end-face\"\ntimes_s = [1, 2, 3]\nshifts_m = [[0, 0, 0], [-0.5, 0, 0], [-0.5, 0, 0.2]]\n\
         turns_deg = [[0, 0, 0], [720, 0, 0], [0, 90, 0]]",
    );
    assert_eq!(scene.model.anchors.len(), 2);
    let driven: &Driven = &scene.model.motions[0];
    assert_eq!(driven.body, Body::Anchor(1));
    let (begin, anchor) = (driven.at(0.5).pose, scene.model.anchors[1]);
    assert!(
        (begin.position - anchor.position).norm() < 1e-15 && begin.orientation.angle_to(&anchor.orientation) < 1e-7
    );
    let there = driven.at(1.5);
    assert!((there.pose.position - Vector3::new(0.75, 0.0, 0.0)).norm() < 1e-12);
    assert!((there.angular_velocity - Vector3::x() * 4.0 * std::f64::consts::PI).norm() < 1e-12);
    let end = driven.at(9.0).pose;
    assert!((end.position - Vector3::new(0.5, 0.0, 0.2)).norm() < 1e-12);
    let quarter = UnitQuaternion::from_scaled_axis(Vector3::y() * std::f64::consts::FRAC_PI_2);
    assert!(end.orientation.angle_to(&(quarter * scene.model.anchors[1].orientation)) < 1e-7);
}

#[test]
fn a_gripper_carries_the_rod_from_where_it_holds_it() {
    let scene = parsed(
        "segment = -1\ntimes_s = [0, 1]\npositions_m = [[1, 0, 0.5], [1, 0, 0.7]]\n\
         orientations = [[0, 1, 0, 0], [0, 0.7071067811865476, 0, -0.7071067811865476]]",
    );
    assert!(scene.model.segments[9].fixed);
    let [begin, end] = [0.0, 1.0].map(|time| scene.model.motions[0].at(time).pose);
    assert!((begin.position - scene.state.positions[9]).norm() < 1e-15);
    // A quarter about y, the centre 0.5 m below the gripper and 0.05 m beside it.
    let turn = UnitQuaternion::from_scaled_axis(Vector3::y() * std::f64::consts::FRAC_PI_2);
    let expected = Vector3::new(1.0, 0.0, 0.7) + turn * Vector3::new(-0.05, 0.0, -0.5);
    assert!((end.position - expected).norm() < 1e-12, "{} {expected}", end.position);
    // The motion is what the first state's velocities are.
    assert_eq!(scene.state.velocities[9], scene.model.motions[0].at(0.0).velocity);
}

#[test]
fn velocities_lead_on_from_the_first_time() {
    let scene = parsed("segment = 9\ntimes_s = [1, 2]\nvelocities_m_s = [[0, 0, 0.1], [0, 0, 0]]");
    let at = |time: f64| scene.model.motions[0].at(time).pose.position - scene.state.positions[9];
    assert_eq!(at(0.7), Vector3::zeros());
    assert!((at(1.5) - Vector3::z() * 0.05).norm() < 1e-15 && (at(7.0) - Vector3::z() * 0.1).norm() < 1e-15);
}

#[test]
fn parts_of_a_cut_segment_go_on_as_one_rigid_body() {
    let text = text("segment = -1\ntimes_s = [0, 1]\nturns_deg = [[0, 0, 0], [0, 90, 0]]");
    let scene = scene::parse_refined(&text, "x.toml", std::num::NonZeroUsize::new(3).unwrap()).unwrap();
    assert_eq!(scene.model.motions.len(), 3);
    let at = |k: usize, time: f64| scene.model.motions[k].at(time).pose.position;
    for time in [0.0, 0.3, 1.0] {
        assert!((at(1, time) - Vector3::x() * 0.95).norm() < 1e-12, "about the segment's centre");
        assert!(((at(2, time) - at(0, time)).norm() - 0.2 / 3.0).abs() < 1e-12);
    }
}

/// Writes a table and a scene that names it, and loads the scene.
fn with_table(table: &str) -> Result<Scene, String> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("grip.csv"), table).unwrap();
    let path = folder.path().join("x.toml");
    std::fs::write(&path, text("at = \"end-face\"\nfile = \"grip.csv\"")).unwrap();
    let place = folder.path().display().to_string();
    scene::load(&path).map_err(|error| error.to_string().replace(&format!("{place}/"), ""))
}

#[test]
fn a_table_of_many_rows() {
    let rows = |k: i32| format!("{},1,0,{},1,0,0,0\n", f64::from(k) * 1e-3, 0.1 * (f64::from(k) * 1e-3).sin());
    let table: String =
        std::iter::once("time_s,x_m,y_m,z_m,qw,qx,qy,qz\n".to_owned()).chain((0..10_000).map(rows)).collect();
    let scene = with_table(&table).unwrap();
    let there = scene.model.motions[0].at(4.0).pose.position;
    assert!((there - Vector3::new(1.0, 0.0, 0.1 * 4_f64.sin())).norm() < 1e-9);
}

#[test]
fn mistakes_in_a_table_are_named_with_their_line() {
    for (table, expected) in [
        ("", "there must be a column `time_s`"),
        ("time_s\n0\n", "there must be columns of what moves beside `time_s`"),
        ("time_s,x_m,y_m\n0,0,0\n", "some of the columns x_m, y_m, z_m are missing"),
        ("time_s,z\n0,0\n", "column `z` is not known; there are time_s, shift_x_m"),
        ("time_s,time_s,x_m,y_m,z_m\n0,0,0,0,0\n", "there are two columns `time_s`"),
        ("time_s,x_m,y_m,z_m\n", "there must be at least one row of numbers"),
        ("time_s,x_m,y_m,z_m\n0,1,0,0\n1,1,0,nan\n", "grip.csv:3: z_m = nan, but it must be a finite number"),
        ("time_s,x_m,y_m,z_m\n0,1,0,0\n1,1,0\n", "grip.csv:3: this row has not as many values as the header"),
        ("time_s,x_m,y_m,z_m\n0,1e300,0,0\n", "grip.csv:2: x_m = 1e300, but it must be 1e30 in size at most"),
        ("\n\ntime_s,x_m\n1,1\n", "grip.csv:3: some of the columns"),
        ("\ntime_s,shift_x_m,shift_y_m,shift_z_m\n0,1,0,0\n", "grip.csv:3: the first shift must be zero"),
        ("time_s,x_m,y_m,z_m\n-1,1,0,0\n", "grip.csv:2: time_s = -1, but it must be >= 0"),
        ("time_s,x_m,y_m,z_m\n1,1,0,0\n1,1,0,0\n", "grip.csv:3: time_s = 1, but it must be later than the time"),
        ("time_s,qw,qx,qy,qz\n0,2,0,0,0\n", "grip.csv:2: qw, qx, qy, qz must be of norm 1"),
        ("time_s,shift_x_m,shift_y_m,shift_z_m\n0,1,0,0\n", "grip.csv:2: the first shift must be zero"),
    ] {
        let error = with_table(table).unwrap_err();
        assert!(error.contains(expected) && error.starts_with("grip.csv:") && !error.contains('\n'), "{error}");
        assert!(error.contains(" (the file that ") && error.contains("x.toml:"), "{error}");
    }
}

#[test]
fn a_table_that_is_no_text_is_named() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("grip.csv"), b"time_s,x_m,y_m,z_m\n0,1,0,0\n\x01,\xff\xfe").unwrap();
    let path = folder.path().join("x.toml");
    std::fs::write(&path, text("at = \"end-face\"\nfile = \"grip.csv\"")).unwrap();
    let error = scene::load(&path).unwrap_err().to_string();
    let named = format!(" (the file that {}:", path.display());
    assert!(error.contains(&format!("grip.csv:3: this is no CSV file: its text must be UTF-8{named}")), "{error}");
}

#[test]
fn mistakes_in_lists_are_named_with_their_key() {
    const KEY: &str = "rods[0].motions[0]";
    for (motion, expected) in [
        ("times_s = [0]\nshifts_m = [[0, 0, 0]]", "give either `at` or `segment`"),
        ("at = \"end-face\"", "give either `times_s` and lists, or a `file`"),
        ("at = \"end\"\ntimes_s = [0]", "at = \"end\", but it must be one of `start-segment`"),
        ("at = \"end-face\"\ntimes_s = [0]", "times_s: without a list of what happens at these times"),
        ("at = \"end-face\"\ntimes_s = []\nshifts_m = []", "there must be at least one keyframe"),
        ("at = \"end-face\"\ntimes_s = [0, 0]\nshifts_m = [[0,0,0],[0,0,0]]", "times_s[1] = 0, but it must be later"),
        ("at = \"end-face\"\ntimes_s = [0, 1]\nshifts_m = [[0,0,0]]", "shifts_m: has 1 entries, but `times_s` has 2"),
        ("at = \"end-face\"\ntimes_s = [0]\nshifts_m = [[0,0,1]]", "shifts_m[0] = [0,0,1], but it must be [0, 0, 0]"),
        (
            "at = \"end-face\"\ntimes_s = [0]\norientations = [[2,0,0,0]]",
            "orientations[0] = [2,0,0,0], but it must be a unit",
        ),
        (
            "at = \"end-face\"\ntimes_s = [0]\nshifts_m = [[0,0,0]]\npositions_m = [[0,0,0]]",
            "positions_m: says a second time",
        ),
        (
            "at = \"end-face\"\ntimes_s = [0]\nshifts_m = [[0,0,0]]\nangular_velocities_rad_s = [[0,0,0]]",
            "times_s: velocities and poses do not go together",
        ),
        (
            "at = \"end-face\"\ntimes_s = [0]\nvelocities_m_s = [[0,0,0]]\ninterpolation = \"smooth\"",
            "interpolation: goes with poses",
        ),
        (
            "at = \"end-face\"\nfile = \"none.csv\"",
            "file = \"none.csv\", but it must be a CSV file, and there is none at",
        ),
        (
            "at = \"end-face\"\ntimes_s = [-1]\nshifts_m = [[0,0,0]]",
            "times_s[0] = -1, but it must be finite and >= 0 [s]",
        ),
        (
            "at = \"end-face\"\ntimes_s = [0, 1]\nturns_deg = [[0,0,0], [200,0,0]]\ninterpolation = \"held\"",
            "keyframe 1: it jumps by 3.49",
        ),
        (
            "at = \"end-face\"\ntimes_s = [0]\nvelocities_m_s = [[5,0,0]]",
            "at 1 s two places that are held are 6 m apart, but there are only 1 m of the rod",
        ),
        (
            "at = \"end-face\"\ntimes_s = [0, 3]\nshifts_m = [[0,0,0], [0.2,0,0]]",
            "at 3 s two places that are held are 1.2 m apart, but there are only 1 m of the rod",
        ),
        (
            "at = \"end-face\"\ntimes_s = [0]\nshifts_m = [[0,0,0]]\n[[rods.motions]]\nat = \"end-face\"\n\
             times_s = [0]\nshifts_m = [[0,0,0]]",
            "another motion drives the same place",
        ),
        (
            "segment = 4\ntimes_s = [0]\nshifts_m = [[0,0,0]]\n[[rods.velocities]]\nsegment = 4\nvelocity_m_s = [0,0,1]",
            "a motion drives this segment; leave its velocity out",
        ),
    ] {
        let error = error(motion);
        assert!(error.starts_with("scenes/x.toml:") && error.contains(expected) && !error.contains('\n'), "{error}");
        assert!(error.contains(KEY) || error.contains("motions[1]") || error.contains("velocities[0]"), "{error}");
    }
}

#[test]
fn loads_and_gravity_over_time() {
    const CALM: &str = "times_s = [0, 1]\nshifts_m = [[0,0,0],[0,0,0]]\nat = \"end-face\"";
    let load = |lines: &str| format!("{CALM}\n[[rods.loads]]\nsegment = 4\n{lines}");
    let scene = parsed(&load("times_s = [1, 2]\nforces_n = [[0,0,1],[0,0,3]]\ntorque_n_m = [1,0,0]"));
    assert_eq!((scene.model.loads[0].force, scene.model.loads[0].torque), (Vector3::z(), Vector3::x()));
    let mut model = scene.model.clone();
    model.set_time(1.5);
    assert_eq!((model.loads[0].force, model.loads[0].torque), (Vector3::z() * 2.0, Vector3::x()));
    for (lines, expected) in [
        ("", "loads[0]: give `force_n` or `torque_n_m` or both, or `times_s` and lists"),
        ("times_s = [0]", "loads[0].times_s: goes with `forces_n` or `torques_n_m`"),
        ("forces_n = [[0,0,1]]", "loads[0].forces_n: goes with `times_s`"),
        ("force_n = [0,0,1]\ninterpolation = \"held\"", "loads[0].interpolation: goes with `times_s`"),
        ("times_s = [0]\nforce_n = [0,0,1]\nforces_n = [[0,0,1]]", "loads[0].force_n: is given over time, too"),
        ("times_s = [0, 0]\nforces_n = [[0,0,1],[0,0,1]]", "loads[0].times_s[1] = 0, but it must be later than"),
        ("times_s = [0, 1]\nforces_n = [[0,0,1]]", "loads[0].forces_n: has 1 entries, but `times_s` has 2"),
    ] {
        let error = error(&load(lines));
        assert!(error.contains(&format!("rods[0].{expected}")), "{error}");
    }
    let tilted = "gravity_over_time = { times_s = [0, 2], values_m_s2 = [[0, 0, -9.81], [9.81, 0, 0]] }\n";
    let scene = scene::parse(&format!("{tilted}{}", text(CALM)), "x.toml").unwrap();
    let mut model = scene.model.clone();
    assert_eq!(model.gravity, Vector3::z() * -9.81);
    model.set_time(5.0);
    assert_eq!(model.gravity, Vector3::x() * 9.81);
    let both = scene::parse(&format!("gravity_m_s2 = [0, 0, 0]\n{tilted}{}", text(CALM)), "x.toml").unwrap_err();
    assert!(both.to_string().contains("gravity_m_s2: does not go with `gravity_over_time`"), "{both}");
}

#[test]
fn what_moves_along_stays_within_reach_and_a_ring_has_two_ways_round() {
    // A clamp that goes on at its velocity, and the other end with it.
    let along = "at = \"end-face\"\ntimes_s = [0]\nvelocities_m_s = [[0,0,1]]\n[[rods.velocities]]\nsegment = 0\n\
                 velocity_m_s = [0,0,1]";
    let text = text(along).replace("clamp = [\"start-face\"]", "fixed_segments = [0]");
    scene::parse(&text, "x.toml").unwrap();
    let ring = "[[rods]]\nshape.ring = { radius_m = 0.5, segments = 20 }\nfixed_segments = [0]\n[[rods.motions]]\n\
                segment = -1\ntimes_s = [0, 1]\nshifts_m = [[0,0,0], [0,0,2]]";
    let error = scene::parse(ring, "x.toml").unwrap_err().to_string();
    assert!(error.contains("rods[0].motions[0]: at 1 s two places that are held are"), "{error}");
}

#[test]
fn a_table_is_read_once_for_all_strands() {
    let table = "time_s,x_m,y_m,z_m,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n1,0.1,0,0,1,0,0,0\n";
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("head.csv"), table).unwrap();
    let path = folder.path().join("x.toml");
    let hair = "[[rods]]\nradius_m = 0.001\nshape.straight = { length_m = 0.1, segments = 4 }\n\
                strands = { count = 5, on = { radius_m = 0.1 } }\n[[rods.motions]]\nat = \"start-segment\"\nfile = \"head.csv\"";
    std::fs::write(&path, hair).unwrap();
    let motions = scene::load(&path).unwrap().model.motions;
    assert_eq!(motions.len(), 5);
    assert!(motions.iter().all(|driven| std::sync::Arc::ptr_eq(&driven.carried.motion, &motions[0].carried.motion)));
}

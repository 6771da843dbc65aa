//! Runs are packed small, come back to the stated precision, and damage is one clear error.

mod motions;

use std::path::Path;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use proptest::prelude::*;
use rod::{Assembly, JointForce, Load, Material, Model, RodSpec, State, shape};
use view::{
    Channel, Curve, Frame, Line, ORIENTATION_PRECISION, Pressing, Recorder, Run, read_run, write_page, write_run,
};

/// A straight rod of so many segments.
fn rod(segments: usize, radius: f64) -> (Model, State) {
    let material = Material { youngs_modulus: 1e6, torsion_modulus: 1e6, density: 1e3 };
    let mut assembly = Assembly::new(Vector3::zeros());
    assembly.rod(&RodSpec::new(shape::straight(Vector3::zeros(), Vector3::x(), 1.0, segments), radius, material));
    assembly.finish()
}

fn record(model: &Model, states: &[State]) -> Run {
    let mut recorder = Recorder::new("run", 0.01, model);
    for (i, state) in states.iter().enumerate() {
        let time = 0.01 * i as f64;
        recorder.push(&Frame { time, state, forces: &[], energy: 1.0, length_ratio: 1.0, iterations: 2.0 });
    }
    recorder.finish()
}

fn assert_close(run: &Run, states: &[State]) {
    let decoded = run.decode().unwrap();
    assert_eq!((decoded.frames(), decoded.segments()), (states.len(), states[0].len()));
    for (frame, state) in states.iter().enumerate() {
        for i in 0..state.len() {
            let off = (decoded.position(frame, i).unwrap() - state.positions[i]).amax();
            assert!(off <= run.position_precision(), "frame {frame}, segment {i}: {off} m off");
            let angle = decoded.orientation(frame, i).unwrap().angle_to(&state.orientations[i]);
            assert!(angle <= ORIENTATION_PRECISION, "frame {frame}, segment {i}: {angle} rad off");
        }
    }
}

fn any_state(segments: usize) -> impl Strategy<Value = State> {
    let position = prop::array::uniform3(-1.0..1.0).prop_map(Vector3::from);
    let turn = prop::array::uniform4(0.01..1.0).prop_map(|[x, y, z, w]: [f64; 4]| {
        UnitQuaternion::from_quaternion(Quaternion::new(w - 0.5, x - 0.5, y - 0.5, z))
    });
    let poses = prop::collection::vec((position, turn), segments);
    poses.prop_map(move |poses| {
        let (positions, orientations) = poses.into_iter().unzip();
        let still = vec![Vector3::zeros(); segments];
        State { positions, orientations, velocities: still.clone(), angular_velocities: still, internals: Vec::new() }
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_motion_comes_back(
        states in prop::collection::vec(any_state(4), 1..6),
        size in prop::sample::select(vec![1e-6, 1.0, 3e4]),
        origin in prop::array::uniform3(-1e3..1e3),
        radius in prop::sample::select(vec![1e-5, 0.01]),
    ) {
        let mut states = states;
        for x in states.iter_mut().flat_map(|state| &mut state.positions) {
            *x = *x * size + Vector3::from(origin);
        }
        assert_close(&record(&rod(4, radius).0, &states), &states);
    }
}

#[test]
fn what_stands_still_and_single_frames_come_back() {
    let (model, state) = rod(3, 0.01);
    let start = std::slice::from_ref(&state);
    assert_close(&record(&model, start), start);
    let still = vec![state; 20];
    let run = record(&model, &still);
    assert_close(&run, &still);
    assert_eq!(run.time().len(), 20);
    let (model, point) = rod(1, 0.01);
    let run = record(&model, std::slice::from_ref(&point));
    assert_close(&run, &[point]);
    assert!(run.position_precision() < 1e-12);
}

#[test]
fn the_error_is_small_beside_the_thinnest_rod() {
    for radius in [0.01, 1e-5] {
        let (model, mut state) = rod(4, radius);
        state.positions[3].y = 50.0 * radius;
        let run = record(&model, std::slice::from_ref(&state));
        assert!(run.position_precision() <= radius / 15.0, "{} m", run.position_precision());
        assert_close(&run, &[state]);
    }
}

#[test]
fn what_is_not_finite_stays_where_it_was() {
    let (model, state) = rod(3, 0.01);
    let mut broken = state.clone();
    broken.positions[1].y = f64::NAN;
    broken.positions[2].y = 1e300;
    broken.orientations[0] = UnitQuaternion::new_unchecked(Quaternion::new(f64::NAN, 0.0, 0.0, 0.0));
    broken.velocities[1].x = f64::INFINITY;
    let mut recorder = Recorder::new("run", 0.01, &model);
    for (time, state) in [(0.0, &state), (f64::NAN, &broken)] {
        let nothing = f64::NAN;
        recorder.push(&Frame { time, state, forces: &[], energy: nothing, length_ratio: nothing, iterations: nothing });
    }
    let run = recorder.finish();
    assert_eq!(run.time(), [0.0, 0.0]);
    assert_close(&run, &[state.clone(), state]);
    assert_eq!(run.decode().unwrap().value(Channel::Speed, 1, 1), None);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("view.json");
    write_run(&path, &run).unwrap();
    assert_eq!(read_run(&path).unwrap(), run);
}

#[test]
fn a_segment_shows_the_largest_of_its_joints() {
    let (model, mut state) = rod(3, 0.01);
    state.velocities[2] = Vector3::new(0.0, 3.0, 4.0);
    let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 0.2);
    state.orientations[2] = state.orientations[1] * turn;
    let pulls = [10.0, -40.0];
    let force = |k: usize| JointForce { force: state.axis(k) * pulls[k], ..JointForce::default() };
    let forces = [force(0), force(1)];
    let mut recorder = Recorder::new("run", 0.01, &model);
    let frame = Frame { time: 0.0, state: &state, forces: &[], energy: 1.0, length_ratio: 1.0, iterations: 0.0 };
    recorder.push(&frame);
    recorder.push(&Frame { forces: &forces, ..frame });
    let run = recorder.finish();
    let decoded = run.decode().unwrap();
    let values = |channel, frame| [0, 1, 2].map(|i| decoded.value(channel, frame, i));
    assert_eq!(values(Channel::Tension, 0), [None; 3]);
    assert_eq!(values(Channel::Residual, 0), [None; 3]);
    let assert_near = |channel, expected: [f64; 3]| {
        for (found, expected) in values(channel, 1).into_iter().zip(expected) {
            let off = (found.unwrap() - expected).abs();
            assert!(off <= 0.008 * run.range(channel).high, "{channel:?}: {found:?}, not {expected}");
        }
    };
    assert_near(Channel::Tension, [10.0, -40.0, -40.0]);
    let bend = rod::curvature(&model, &state, &model.joints[1]);
    assert!(bend > 0.1);
    assert_near(Channel::Curvature, [0.0, bend, bend]);
    assert_near(Channel::Speed, [0.0, 0.0, 5.0]);
}

#[test]
fn a_tree_of_a_thousand_segments_over_300_frames_is_a_page_of_less_than_8_mb() {
    let tree = motions::tree();
    assert_eq!(tree.model.segments.len(), 1061);
    let run = tree.record("tree, newton", 300, 60.0);
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("page.html");
    write_page(&page, std::slice::from_ref(&run)).unwrap();
    let size = std::fs::metadata(&page).unwrap().len();
    println!("{size} bytes");
    assert!(size < 8_000_000, "{size} bytes");
    assert_eq!(run.decode().unwrap().frames(), 300);
}

/// The error of reading a file with that text.
fn error_of(path: &Path, text: &str) -> String {
    std::fs::write(path, text).unwrap();
    read_run(path).unwrap_err().to_string()
}

#[test]
fn damage_and_foreign_files_are_errors_that_say_what_is_wrong() {
    let (model, state) = rod(3, 0.01);
    let run = record(&model, &[state.clone(), state]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("view.json");
    write_run(&path, &run).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    let data = text.split("\"data\":\"").nth(1).unwrap().trim_end_matches("\"}\n");
    // The last characters before the padding belong to the checksum of the stream.
    let mut wrong_sum = data.to_owned();
    let place = data.trim_end_matches('=').len() - 3;
    wrong_sum.replace_range(place..=place, if &data[place..=place] == "A" { "B" } else { "A" });
    let cases = [
        ("", "EOF"),
        ("{\"a\": 1}", "unknown field `a`"),
        ("[1, 2, 3]", "not a recorded run"),
        (&text.replace("rods-1", "rods-9"), "unknown variant `rods-9`"),
        (&text.replace("\"time\":[0.0,", "\"time\":["), "energy: 2 entries where there must be 1"),
        (&text.replace("\"time\":[0.0,0.01]", "\"time\":[1.0,0.01]"), "time: all must be finite and ascending"),
        (&text.replace("\"next\":[1,", "\"next\":[7,"), "segments.next: all must be segments or null"),
        (&text.replace("\"rod\":[0,", "\"rod\":["), "segments.rod: 2 entries where there must be 3"),
        (&text.replace("\"radius\":[0.01", "\"radius\":[-0.01"), "segments.radius: all must be finite and > 0"),
        (&text.replace("\"bytes\":2", "\"bytes\":9"), "lattice.bytes: it must be 2 or 3"),
        (&text.replace("\"bytes\":2", "\"bytes\":3"), "data: 96 bytes, but 114 belong to the frames and segments"),
        (&text.replace(data, "!"), "data: no base64"),
        (&text.replace(data, "AAAA"), "data: no zlib stream"),
        (&text.replace(data, &wrong_sum), "data: no zlib stream, or a damaged one"),
        (&text[..text.len() / 2], "EOF"),
    ];
    for (text, reason) in cases {
        let error = error_of(&path, text);
        assert!(error.starts_with(&path.display().to_string()), "{error}");
        assert!(error.contains(reason), "{error}; it should say: {reason}");
    }
    // Files of before there were rods in them.
    std::fs::write(&path, text.replace(",\"rod\":[0,0,0]", "")).unwrap();
    assert_eq!(read_run(&path).unwrap().decode().unwrap().frames(), 2);
    let missing = folder.path().join("none.json");
    let error = read_run(&missing).unwrap_err().to_string();
    assert!(error.starts_with(&format!("cannot read {}", missing.display())), "{error}");
}

#[test]
fn curves_chapters_and_marks_come_back_and_damaged_ones_are_errors() {
    let (mut model, state) = rod(3, 0.01);
    model.segments[0].fixed = true;
    model.loads.push(Load { segment: 2, offset: 0.1, force: Vector3::y(), torque: Vector3::zeros(), follows: false });
    let mut recorder = Recorder::new("run", 0.01, &model);
    recorder.name(vec!["cable".to_owned()], Vec::new());
    for k in 0..2 {
        recorder.begin_chapter(&format!("part {k}"));
        let (time, nothing) = (0.01 * f64::from(k), f64::NAN);
        let values =
            Frame { time, state: &state, forces: &[], energy: nothing, length_ratio: nothing, iterations: nothing };
        recorder.push(&values);
    }
    let pressing = Pressing { segment: 1, place: state.positions[1], force: Vector3::z() };
    // Of too many contacts those that press most are kept; of none of the model's segments, none.
    let many = (0..300).map(|k| Pressing { force: Vector3::z() * f64::from(k), ..pressing });
    recorder.push_contacts(&state, many.chain([Pressing { segment: 3, ..pressing }]));
    let line = Line::new("tip", &[f64::NAN, 1.0 / 3.0]);
    assert_eq!(line.values(), [None, Some(0.33333)]);
    let names = ["Probes", "tension", "N"].map(str::to_owned);
    let [group, label, unit] = names;
    recorder.add_curve(Curve { group, label, unit, lines: vec![line] });
    let run = recorder.finish();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("view.json");
    write_run(&path, &run).unwrap();
    assert_eq!(read_run(&path).unwrap(), run);
    let text = std::fs::read_to_string(&path).unwrap();
    let cases = [
        ("\"counts\":[0,200]", "\"counts\":[0,201]", "contacts.counts: there must be 2 counts, none above 200"),
        ("\"counts\":[0,200]", "\"counts\":[0,199]", "data: more bytes, but 2985 belong"),
        ("\"frame\":1,", "\"frame\":2,", "chapters: they must begin at frames that ascend from 0 and are below 2"),
        ("[null,0.33333]", "[0.33333]", "curves: \"tension\" must have lines of 2 values each"),
        ("\"grips\":[{\"segment\":0", "\"grips\":[{\"segment\":3", "grips: each must be a place of a segment"),
        (
            "\"force\":[[0.0,1.0,0.0]]",
            "\"force\":[]",
            "loads: each must be on a segment, with one finite force or one a frame",
        ),
    ];
    for (from, to, reason) in cases {
        assert!(text.contains(from), "{from}: {text}");
        let error = error_of(&path, &text.replace(from, to));
        assert!(error.contains(reason), "{error}; it should say: {reason}");
    }
}

#[test]
fn pages_of_nothing_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("page.html");
    let error = |runs: &[Run]| write_page(&page, runs).unwrap_err().to_string();
    assert!(error(&[]).contains("there is no run to show"));
    let run = Recorder::new("nobody", 0.01, &rod(3, 0.01).0).finish();
    assert!(run.decode().is_ok());
    assert!(error(&[run]).contains("the run \"nobody\" has no frame or no segment"));
    assert!(!page.exists());
}

#[test]
fn names_cannot_break_the_page() {
    let (model, state) = rod(3, 0.01);
    let name = "</script><b>&{{script}} \"quoted\" <!--";
    let mut recorder = Recorder::new(name, 0.01, &model);
    recorder.push(&Frame { time: 0.0, state: &state, forces: &[], energy: 1.0, length_ratio: 1.0, iterations: 0.0 });
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("page.html");
    write_page(&page, &[recorder.finish()]).unwrap();
    let html = std::fs::read_to_string(page).unwrap();
    assert!(!html.contains("</script><b>") && !html.contains("<!--"));
    assert_eq!(html.matches("</script>").count(), 2);
    assert!(html.contains("<title>&lt;/script&gt;&lt;b&gt;&amp;{{script}}"));
    let json = html.split("id=\"runs\">").nth(1).unwrap().split("</script>").next().unwrap();
    let runs: Vec<Run> = serde_json::from_str(json).unwrap();
    assert_eq!(runs[0].name(), name);
}

#[test]
fn obstacles_that_move_have_a_pose_a_frame() {
    let (frames, motion) = (12, motions::driven());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("view.json");
    write_run(&path, &motion.record("driven", frames, 10.0)).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let moved = json["obstacle_motions"].as_array().unwrap();
    assert_eq!(moved.len(), motion.model.contacts.obstacles.len());
    for (k, obstacle) in motion.model.contacts.obstacles.iter().enumerate() {
        assert_eq!(moved[k]["obstacle"], k);
        let poses = moved[k]["poses"].as_array().unwrap();
        assert_eq!(poses.len(), frames);
        for (frame, found) in poses.iter().enumerate() {
            let pose = obstacle.at(0.1 * frame as f64).pose;
            let expected = pose.position.iter().chain(pose.orientation.coords.iter());
            assert!(
                found.as_array().unwrap().iter().zip(expected).all(|(a, b)| (a.as_f64().unwrap() - b).abs() < 1e-6),
                "{k}, {frame}"
            );
        }
    }
    read_run(&path).unwrap();
    // Poses of no obstacle, and no turn.
    for (from, to) in [("{\"obstacle\":0", "{\"obstacle\":7"), ("0.0,0.0,0.0,1.0]", "0.0,0.0,0.0,0.5]")] {
        std::fs::write(&path, text.replacen(from, to, 1)).unwrap();
        let error = read_run(&path).unwrap_err().to_string();
        assert!(error.contains("obstacle_motions"), "{error}");
    }
    // Runs without any have no such key.
    let still = motions::helix(1.0).record("calm", 2, 10.0);
    assert!(serde_json::to_value(&still).unwrap().get("obstacle_motions").is_none());
}

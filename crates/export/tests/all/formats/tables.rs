//! Tables by the crate csv.

use std::path::Path;

use export::{Format, Names};
use rod::{Body, Segment, curvature};

use super::runs::runs;

fn read(path: &Path) -> (Vec<String>, Vec<csv::StringRecord>) {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let columns = reader.headers().unwrap().iter().map(str::to_owned).collect();
    (columns, reader.records().collect::<Result<_, _>>().unwrap())
}

fn numbers<'a>(words: impl Iterator<Item = &'a str>) -> Vec<f64> {
    words.map(|word| word.parse().unwrap()).collect()
}

#[test]
fn every_number_of_every_segment_is_read_back() {
    for run in runs() {
        let directory = tempfile::tempdir().unwrap();
        let made = run.export(Format::Csv, directory.path());
        assert_eq!(made, ["segments.csv", "joints.csv", "reactions.csv"].map(|name| directory.path().join(name)));
        let (columns, rows) = read(&made[0]);
        assert_eq!(
            columns.join(" "),
            "frame time_s rod rod_name segment segment_of_rod x_m y_m z_m qw qx qy qz v_x_m_per_s v_y_m_per_s v_z_m_per_s w_x_rad_per_s \
             w_y_rad_per_s w_z_rad_per_s"
        );
        let mut rows = rows.iter();
        for (frame, state) in run.states.iter().enumerate() {
            for (i, segment) in run.model.segments.iter().enumerate() {
                let row = rows.next().unwrap();
                let (first, rod) = (within(run.model.segments.as_slice(), i), segment.rod);
                assert_eq!(row[3], *run.called.rod(rod));
                let mut expected = vec![frame as f64, run.times[frame], rod as f64, i as f64, first as f64];
                expected.extend(&state.positions[i]);
                let q = state.orientations[i];
                expected.extend([q.w, q.i, q.j, q.k]);
                expected.extend(state.velocities[i].iter().chain(&state.angular_velocities[i]));
                assert_eq!(
                    numbers(row.iter().enumerate().filter(|(k, _)| *k != 3).map(|(_, word)| word)),
                    expected,
                    "{}, frame {frame}",
                    run.name
                );
            }
        }
        assert!(rows.next().is_none());
    }
}

#[test]
fn every_number_of_every_joint_is_read_back() {
    for run in runs() {
        let directory = tempfile::tempdir().unwrap();
        let made = run.export(Format::Csv, directory.path());
        let (columns, rows) = read(&made[1]);
        let mut expected = "frame time_s joint a a_name b b_name curvature_per_m".to_owned();
        if !run.forces.is_empty() {
            expected += " tension_n force_x_n force_y_n force_z_n moment_x_n_m moment_y_n_m moment_z_n_m";
        }
        assert_eq!(columns.join(" "), expected);
        let mut rows = rows.iter();
        for (frame, state) in run.states.iter().enumerate() {
            for (i, joint) in run.model.joints.iter().enumerate() {
                let row = rows.next().unwrap();
                assert_eq!(numbers(row.iter().take(3)), [frame as f64, run.times[frame], i as f64]);
                for (body, (word, name)) in [joint.a, joint.b].into_iter().zip([(&row[3], &row[4]), (&row[5], &row[6])])
                {
                    assert_eq!(name, run.called.body(body));
                    match body {
                        Body::Segment(k) => assert_eq!(word.parse(), Ok(k)),
                        Body::Anchor(k) => assert_eq!(word, format!("anchor {k}")),
                    }
                }
                let mut expected = vec![curvature(&run.model, state, joint)];
                if let Some(forces) = run.forces.get(frame) {
                    expected.push(forces[i].tension(&run.model, state, joint));
                    expected.extend(forces[i].force.iter().chain(&forces[i].moment));
                }
                assert_eq!(numbers(row.iter().skip(7)), expected, "{}, frame {frame}", run.name);
            }
        }
        assert!(rows.next().is_none());
    }
}

/// Number of a segment within its rod.
fn within(segments: &[Segment], i: usize) -> usize {
    segments[..i].iter().filter(|other| other.rod == segments[i].rod).count()
}

/// What holds a rod is called after the rod and the place.
#[test]
fn reactions_say_whose_grip_it_is() {
    let mut run = runs().swap_remove(1);
    assert_eq!(run.name, "clamped");
    run.called = Names::new(&run.model, &["coil, steel".to_owned()], &[]);
    let directory = tempfile::tempdir().unwrap();
    let made = run.export(Format::Csv, directory.path());
    let (columns, rows) = read(&made[2]);
    assert_eq!(columns[..4], ["frame", "time_s", "body", "body_name"]);
    let found: Vec<_> = rows[..2].iter().map(|row| [&row[2], &row[3]]).collect();
    assert_eq!(found, [["anchor 0", "coil, steel start-face"], ["anchor 1", "coil, steel end-face"]]);
    let (_, rows) = read(&made[1]);
    assert_eq!([&rows[0][4], &rows[0][6]], ["coil, steel segment 0", "coil, steel segment 1"]);
}

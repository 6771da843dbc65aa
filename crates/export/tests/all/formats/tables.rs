//! Tables by the crate csv.

use std::path::Path;

use export::Format;
use rod::{Body, curvature};

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
            "frame time_s rod segment x_m y_m z_m q_x q_y q_z q_w v_x_m_per_s v_y_m_per_s v_z_m_per_s w_x_rad_per_s \
             w_y_rad_per_s w_z_rad_per_s"
        );
        let mut rows = rows.iter();
        for (frame, state) in run.states.iter().enumerate() {
            for (i, segment) in run.model.segments.iter().enumerate() {
                let mut expected = vec![frame as f64, run.times[frame], segment.rod as f64, i as f64];
                expected.extend(&state.positions[i]);
                let q = state.orientations[i];
                expected.extend([q.i, q.j, q.k, q.w]);
                expected.extend(state.velocities[i].iter().chain(&state.angular_velocities[i]));
                assert_eq!(numbers(rows.next().unwrap().iter()), expected, "{}, frame {frame}", run.name);
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
        let mut expected = "frame time_s joint a b curvature_per_m".to_owned();
        if !run.forces.is_empty() {
            expected += " tension_n force_x_n force_y_n force_z_n moment_x_n_m moment_y_n_m moment_z_n_m";
        }
        assert_eq!(columns.join(" "), expected);
        let mut rows = rows.iter();
        for (frame, state) in run.states.iter().enumerate() {
            for (i, joint) in run.model.joints.iter().enumerate() {
                let row = rows.next().unwrap();
                assert_eq!(numbers(row.iter().take(3)), [frame as f64, run.times[frame], i as f64]);
                for (body, word) in [joint.a, joint.b].into_iter().zip(row.iter().skip(3)) {
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
                assert_eq!(numbers(row.iter().skip(5)), expected, "{}, frame {frame}", run.name);
            }
        }
        assert!(rows.next().is_none());
    }
}

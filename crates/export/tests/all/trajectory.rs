//! Trajectories come back as they were written, and damage is noticed.

use std::fs;
use std::path::Path;

use export::{ExportError, TrajectoryInfo, TrajectoryReader, TrajectoryWriter, read_trajectory};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rod::{JointForce, State};
use safetensors::{Dtype, SafeTensors};

fn info() -> TrajectoryInfo {
    TrajectoryInfo { scene: "a \"helix\" \u{2603} \"checksum\":\"".to_owned(), dt: 0.1 + 0.2, segments_hash: None }
}

/// A state in which every number is another one.
fn state(segments: usize, frame: usize) -> State {
    let value = |i: usize, k: usize| ((frame * 1000 + i * 13 + k) as f64).sqrt() / 3.0;
    let vector = |k: usize| (0..segments).map(|i| Vector3::from_fn(|c, _| value(i, k + c))).collect();
    let quaternion = |i| UnitQuaternion::new_normalize(Quaternion::from([0, 1, 2, 3].map(|c| value(i, c) + 0.1)));
    State {
        positions: vector(0),
        orientations: (0..segments).map(quaternion).collect(),
        velocities: vector(7),
        angular_velocities: vector(10),
        internals: Vec::new(),
    }
}

fn write(directory: &Path, segments: usize, frames: usize) -> std::path::PathBuf {
    let mut writer = TrajectoryWriter::create(directory, segments, 0, info()).unwrap();
    for frame in 0..frames {
        writer.push(&state(segments, frame), &[], frame as f64 * 0.3).unwrap();
    }
    assert_eq!(writer.frames(), frames);
    writer.finish().unwrap()
}

/// Forces in which every number is another one.
fn forces(joints: usize, frame: usize) -> Vec<JointForce> {
    let value = |i: usize, k: usize| ((frame * 977 + i * 17 + k) as f64).cbrt() - 3.0;
    let vector = |i: usize, k: usize| Vector3::from_fn(|c, _| value(i, k + c));
    (0..joints).map(|i| JointForce { force: vector(i, 0), moment: vector(i, 3) }).collect()
}

fn write_with_forces(directory: &Path, segments: usize, joints: usize, frames: usize) -> std::path::PathBuf {
    let mut writer = TrajectoryWriter::create(directory, segments, joints, info()).unwrap();
    for frame in 0..frames {
        writer.push(&state(segments, frame), &forces(joints, frame), frame as f64 * 0.3).unwrap();
    }
    writer.finish().unwrap()
}

fn names(directory: &Path) -> Vec<String> {
    fs::read_dir(directory).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
}

#[test]
fn what_is_written_is_read() {
    // The last ones spill several times in the middle of the run, with many frames to a chunk and a frame above a chunk.
    for (segments, frames) in [(1, 1), (3, 7), (0, 2), (4, 0), (5, 9000), (12_000, 3)] {
        let directory = tempfile::tempdir().unwrap();
        let path = write(&directory.path().join("new/deep"), segments, frames);
        assert_eq!(path, directory.path().join("new/deep/trajectory.safetensors"));
        assert_eq!(names(path.parent().unwrap()), ["trajectory.safetensors"]);
        let trajectory = read_trajectory(&path).unwrap();
        assert_eq!(trajectory.info, info());
        assert_eq!(trajectory.time, (0..frames).map(|f| f as f64 * 0.3).collect::<Vec<_>>());
        assert_eq!(trajectory.states.len(), frames);
        assert!(trajectory.forces.len() == frames && trajectory.forces.iter().all(Vec::is_empty));
        for (frame, found) in trajectory.states.iter().enumerate() {
            assert!(*found == state(segments, frame), "{segments} segments, frame {frame}");
        }
    }
}

#[test]
fn forces_of_joints_are_read_as_written() {
    for (segments, joints, frames) in [(1, 1, 1), (3, 2, 7), (4, 5, 0), (5, 4, 9000), (12_000, 11_999, 3)] {
        let directory = tempfile::tempdir().unwrap();
        let path = write_with_forces(directory.path(), segments, joints, frames);
        let mut reader = TrajectoryReader::open(&path).unwrap();
        assert_eq!((reader.joints(), reader.segments(), reader.frames()), (joints, segments, frames));
        assert_eq!(reader.times().unwrap(), (0..frames).map(|f| f as f64 * 0.3).collect::<Vec<_>>());
        let trajectory = read_trajectory(&path).unwrap();
        for frame in 0..frames {
            assert!(trajectory.states[frame] == state(segments, frame), "{segments} segments, frame {frame}");
            assert!(trajectory.forces[frame] == forces(joints, frame), "{joints} joints, frame {frame}");
        }
        let bytes = fs::read(&path).unwrap();
        let tensors = SafeTensors::deserialize(&bytes).unwrap();
        let tensor = tensors.tensor("joint_forces").unwrap();
        assert_eq!((tensor.dtype(), tensor.shape()), (Dtype::F64, [frames, joints, 6].as_slice()));
        let written = (0..frames).flat_map(|frame| forces(joints, frame));
        let values = written.flat_map(|joint| joint.force.iter().chain(&joint.moment).copied().collect::<Vec<_>>());
        assert!(tensor.data().iter().copied().eq(values.flat_map(f64::to_le_bytes)));
    }
}

#[test]
fn of_every_few_frames_one_is_read_and_the_last() {
    let directory = tempfile::tempdir().unwrap();
    let mut reader = TrajectoryReader::open(&write_with_forces(directory.path(), 2, 3, 8)).unwrap();
    for (every, frames) in [(0, (0..8).collect()), (3, vec![0, 3, 6, 7]), (7, vec![0, 7]), (usize::MAX, vec![0, 7])] {
        reader.every(every);
        assert_eq!(reader.times().unwrap(), frames.iter().map(|&f| f as f64 * 0.3).collect::<Vec<_>>());
        let (mut found, mut transmitted) = (State::default(), Vec::new());
        for (index, &frame) in frames.iter().enumerate() {
            reader.read_frame(index, &mut found).unwrap();
            reader.read_forces(index, &mut transmitted).unwrap();
            assert!(found == state(2, frame) && transmitted == forces(3, frame), "{every}, {frame}");
        }
        let error = reader.read_frame(frames.len(), &mut found).unwrap_err();
        assert!(matches!(error, ExportError::NoFrame { frames, .. } if frames == reader.frames()), "{error}");
    }
}

#[test]
fn without_forces_the_file_is_what_it_was_before_there_were_any() {
    let directory = tempfile::tempdir().unwrap();
    let info = TrajectoryInfo { scene: "rod".to_owned(), dt: 0.01, segments_hash: None };
    let mut writer = TrajectoryWriter::create(directory.path(), 1, 0, info).unwrap();
    let state = state(1, 2);
    writer.push(&state, &[], 0.5).unwrap();
    let bytes = fs::read(writer.finish().unwrap()).unwrap();
    let length = u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
    let header = str::from_utf8(&bytes[8..8 + length]).unwrap();
    let (before, rest) = header.split_once("\"checksum\":\"").unwrap();
    assert_eq!(before, "{\"__metadata__\":{");
    assert_eq!(
        rest[64..].trim_end(),
        "\",\"dt\":\"0.01\",\"scene\":\"rod\",\"units\":\"s, m, m/s, rad/s; orientations are quaternions x, y, z, w; \
         vectors are in world axes\"},\"angular_velocities\":{\"dtype\":\"F64\",\"shape\":[1,1,3],\"data_offsets\":[88,\
         112]},\"orientations\":{\"dtype\":\"F64\",\"shape\":[1,1,4],\"data_offsets\":[32,64]},\"positions\":{\"dtype\":\
         \"F64\",\"shape\":[1,1,3],\"data_offsets\":[8,32]},\"time\":{\"dtype\":\"F64\",\"shape\":[1],\"data_offsets\":[0,\
         8]},\"velocities\":{\"dtype\":\"F64\",\"shape\":[1,1,3],\"data_offsets\":[64,88]}}"
    );
    let vectors = |v: &[Vector3<f64>]| v[0].iter().copied().collect::<Vec<_>>();
    let values = [
        vec![0.5],
        vectors(&state.positions),
        state.orientations[0].coords.iter().copied().collect(),
        vectors(&state.velocities),
        vectors(&state.angular_velocities),
    ];
    assert_eq!(bytes[8 + length..], values.concat().iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<_>>());
}

#[test]
fn the_safetensors_crate_opens_the_file() {
    let directory = tempfile::tempdir().unwrap();
    let (segments, frames) = (3, 7);
    let bytes = fs::read(write(directory.path(), segments, frames)).unwrap();
    let tensors = SafeTensors::deserialize(&bytes).unwrap();
    let shapes = [
        ("time", vec![frames]),
        ("positions", vec![frames, segments, 3]),
        ("orientations", vec![frames, segments, 4]),
        ("velocities", vec![frames, segments, 3]),
        ("angular_velocities", vec![frames, segments, 3]),
    ];
    assert_eq!(tensors.len(), shapes.len());
    for (name, shape) in shapes {
        let tensor = tensors.tensor(name).unwrap();
        assert_eq!((tensor.dtype(), tensor.shape()), (Dtype::F64, shape.as_slice()));
    }
    let positions = tensors.tensor("positions").unwrap();
    let at = ((5 * segments + 2) * 3 + 1) * 8;
    assert_eq!(positions.data()[at..at + 8], state(segments, 5).positions[2].y.to_le_bytes());
    let orientations = tensors.tensor("orientations").unwrap();
    let at = ((5 * segments + 2) * 4 + 3) * 8;
    assert_eq!(orientations.data()[at..at + 8], state(segments, 5).orientations[2].w.to_le_bytes());
    let (_, metadata) = SafeTensors::read_metadata(&bytes).unwrap();
    let texts = metadata.metadata().clone().unwrap();
    assert_eq!(texts["scene"], info().scene);
    assert_eq!(texts["dt"].parse::<f64>().unwrap(), info().dt);
    assert!(texts["units"].starts_with("s, m,"));
}

#[test]
fn the_same_run_gives_the_same_bytes() {
    let directory = tempfile::tempdir().unwrap();
    let [a, b] = ["a", "b"].map(|name| fs::read(write(&directory.path().join(name), 4, 20)).unwrap());
    assert!(a == b);
}

#[test]
fn a_flipped_bit_and_a_cut_anywhere_is_one_clear_error() {
    let directory = tempfile::tempdir().unwrap();
    for path in [write(&directory.path().join("a"), 2, 3), write_with_forces(&directory.path().join("b"), 2, 1, 3)] {
        any_damage_is_one_clear_error(directory.path(), &path);
    }
}

fn any_damage_is_one_clear_error(directory: &Path, path: &Path) {
    let bytes = fs::read(path).unwrap();
    let damaged = directory.join("damaged.safetensors");
    let check = |content: &[u8], what: &str| {
        fs::write(&damaged, content).unwrap();
        match read_trajectory(&damaged) {
            Err(error @ ExportError::Damaged { .. }) => {
                let text = error.to_string();
                assert!(text.starts_with(&format!("{} is damaged", damaged.display())), "{text}");
                assert!(!text.contains('\n'), "{text}");
            }
            other => panic!("{what}: {other:?}"),
        }
    };
    for at in 0..bytes.len() {
        let mut flipped = bytes.clone();
        flipped[at] ^= 1 << (at % 8);
        check(&flipped, &format!("bit {} of byte {at}", at % 8));
    }
    for length in 0..bytes.len() {
        check(&bytes[..length], &format!("cut to {length}"));
    }
    check(&[bytes.as_slice(), &[0]].concat(), "one byte more");
    check(&[bytes.as_slice(), &[0; 8]].concat(), "eight bytes more");
}

#[test]
fn other_safetensors_files_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("other.safetensors");
    let data = [0; 8];
    let view = safetensors::tensor::TensorView::new(Dtype::F64, vec![1], &data).unwrap();
    safetensors::serialize_to_file([("weights", view)], None, &path).unwrap();
    assert!(matches!(read_trajectory(&path), Err(ExportError::Damaged { .. })));
    let missing = directory.path().join("missing.safetensors");
    let error = read_trajectory(&missing).unwrap_err().to_string();
    assert!(error.starts_with(&format!("cannot read {}: ", missing.display())), "{error}");
}

#[test]
fn a_dropped_writer_leaves_nothing_and_keeps_the_old_file() {
    let directory = tempfile::tempdir().unwrap();
    let path = write(directory.path(), 2, 3);
    let old = fs::read(&path).unwrap();
    let mut writer = TrajectoryWriter::create(directory.path(), 2, 0, info()).unwrap();
    for frame in 0..20_000 {
        writer.push(&state(2, frame), &[], 0.0).unwrap();
    }
    drop(writer);
    assert_eq!(names(directory.path()), ["trajectory.safetensors"]);
    assert!(fs::read(&path).unwrap() == old);
}

#[test]
fn a_state_that_does_not_fit_is_refused_and_the_rest_kept() {
    let directory = tempfile::tempdir().unwrap();
    let mut writer = TrajectoryWriter::create(directory.path(), 2, 0, info()).unwrap();
    writer.push(&state(2, 0), &[], 0.0).unwrap();
    let mut ragged = state(2, 1);
    ragged.velocities.pop();
    for wrong in [state(3, 1), ragged] {
        assert!(matches!(writer.push(&wrong, &[], 0.1), Err(ExportError::Segments { expected: 2, .. })));
    }
    assert!(matches!(
        writer.push(&state(2, 1), &forces(1, 1), 0.1),
        Err(ExportError::Joints { found: 1, expected: 0 })
    ));
    assert_eq!(read_trajectory(&writer.finish().unwrap()).unwrap().states, [state(2, 0)]);

    let mut writer = TrajectoryWriter::create(directory.path(), 2, 1, info()).unwrap();
    assert!(matches!(writer.push(&state(2, 0), &[], 0.0), Err(ExportError::Joints { found: 0, expected: 1 })));
    writer.push(&state(2, 1), &forces(1, 1), 0.1).unwrap();
    let kept = read_trajectory(&writer.finish().unwrap()).unwrap();
    assert_eq!((kept.states, kept.forces), (vec![state(2, 1)], vec![forces(1, 1)]));
}

#[test]
fn impossible_places_are_named_before_the_run() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("file");
    fs::write(&file, "").unwrap();
    let error = TrajectoryWriter::create(&file, 2, 0, info()).unwrap_err().to_string();
    assert_eq!(error, format!("cannot create the directory {}: not a directory", file.display()));
    let error = TrajectoryWriter::create(&file.join("below"), 2, 0, info()).unwrap_err().to_string();
    assert!(error.starts_with(&format!("cannot create the directory {}", file.join("below").display())), "{error}");
    let taken = directory.path().join("trajectory.safetensors");
    fs::create_dir(&taken).unwrap();
    let error = TrajectoryWriter::create(directory.path(), 2, 0, info()).unwrap_err().to_string();
    assert_eq!(error, format!("cannot write {}: is a directory", taken.display()));
}

/// Names the directory to write into, where the system takes no more than so many KiB a file.
#[cfg(unix)]
const LIMITED: &str = "TRAJECTORY_TEST_LIMITED";

/// The system takes no more, as where a disk is full: what is there becomes a trajectory. This test runs itself in a shell
/// that limits the size of files, to 2 MiB.
#[test]
#[cfg(unix)]
fn frames_that_fit_are_kept_where_the_disk_takes_no_more() {
    const SEGMENTS: usize = 50;
    const LIMIT: usize = 2 << 20;
    let frame_bytes = 8 * (1 + 13 * SEGMENTS);
    if let Some(directory) = std::env::var_os(LIMITED) {
        let mut writer = TrajectoryWriter::create(Path::new(&directory), SEGMENTS, 0, info()).unwrap();
        let push = |frame| writer.push(&state(SEGMENTS, frame), &[], frame as f64);
        let error = (0..10_000).map(push).find_map(Result::err).expect("a limit");
        println!("refused: {error}");
        assert!(writer.finish().is_err());
        println!("kept: {}", writer.salvage().unwrap().1);
        return;
    }
    let directory = tempfile::tempdir().unwrap();
    let output = std::process::Command::new("sh")
        .args(["-c", "trap '' XFSZ; ulimit -f 4096; exec \"$0\" \"$@\""])
        .arg(std::env::current_exe().unwrap())
        .args(["--exact", "trajectory::frames_that_fit_are_kept_where_the_disk_takes_no_more", "--nocapture"])
        .env(LIMITED, directory.path())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{output:?}");
    let expected = format!("refused: cannot write into {}: File too large", directory.path().display());
    assert!(said.contains(&expected), "{said}");
    assert_eq!(names(directory.path()), ["trajectory.safetensors"]);
    let kept = read_trajectory(&directory.path().join("trajectory.safetensors")).unwrap();
    let frames = kept.states.len();
    assert!(said.contains(&format!("kept: {frames}\n")), "{said}");
    assert!((LIMIT - (400 << 10)..LIMIT).contains(&(frames * frame_bytes)), "{frames} frames");
    assert!(kept.states.iter().enumerate().all(|(frame, found)| *found == state(SEGMENTS, frame)));
    assert!(kept.time.iter().enumerate().all(|(frame, &time)| time == frame as f64));
}

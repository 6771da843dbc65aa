//! Binary glTF 2.0: a tube a rod that a skin bends, one glTF joint a segment, meshes of rigid bodies and obstacles, and the animation
//! of all.
//!
//! The specification is Khronos' "glTF 2.0 Specification"; section numbers are its.

use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use nalgebra::{Matrix4, Quaternion};
use rod::{Mesh, Model, Pose, State};

use super::centrelines::Centrelines;
use super::frame::Frame;
use super::solids::Solid;
use super::usda::UNEVEN_RATE;
use crate::file::stage;
use crate::{ExportError, Format, Names, TrajectoryReader};

mod document;
mod tube;

use document::{Clip, Document};
use tube::{Tube, write_floats};

/// Joints of a skin are numbered in 16 bits in vertices (section 3.7.3.3): longer rods are cut into several.
const MAX_JOINTS: usize = u16::MAX as usize;
/// Bytes of a segment's pose in a frame: translation and rotation in f32.
const POSE: usize = 28;
/// Bytes of poses that are turned from frames to segments at once.
const POSES_AT_ONCE: usize = 64 << 20;
/// Magic number and version (section 4.4.2), and the types of the two chunks.
const MAGIC: &[u8; 8] = b"glTF\x02\0\0\0";
const JSON: &[u8; 4] = b"JSON";
const BINARY: &[u8; 4] = b"BIN\0";
/// Bytes of the file's header and of the headers of its two chunks.
const HEADERS: usize = 12 + 2 * 8;

/// Writes `run.glb`. Its rest shape is the first frame's; the root node turns z up into y up.
pub(super) fn write(
    directory: &Path,
    trajectory: &mut TrajectoryReader,
    model: &Model,
    names: &Names,
) -> Result<Vec<PathBuf>, ExportError> {
    let (frames, segments) = (trajectory.frames(), model.segments.len());
    check(frames, segments).map_err(refused)?;
    let solids = Solid::all(model, trajectory)?;
    let times = trajectory.times()?;
    let keys = increasing(&times);
    let mut first = Frame::default();
    first.read(trajectory, 0)?;
    let tubes = Tube::all(model, &Centrelines::new(model), &first.state, MAX_JOINTS);
    let clips = clips(trajectory);
    let document = Document::new(&trajectory.info().scene, model, names, &tubes, &solids, &first, (&keys, &clips));
    let mut json = serde_json::to_vec(&document).map_err(|error| refused(error.to_string()))?;
    json.resize(json.len().next_multiple_of(4), b' ');
    let binary = document.bytes();
    let total = fits(HEADERS + json.len() + binary).map_err(refused)?;

    let file = stage(&directory.join("run.glb"), |writer| {
        writer.write_all(MAGIC)?;
        writer.write_all(&total.to_le_bytes())?;
        for (length, kind) in [(json.len(), JSON), (binary, BINARY)] {
            writer.write_all(&(length as u32).to_le_bytes())?;
            writer.write_all(kind)?;
            if kind == JSON {
                writer.write_all(&json)?;
            }
        }
        tubes.iter().try_for_each(|tube| tube.write(writer))?;
        let bound = tubes.iter().flat_map(|tube| &tube.segments);
        write_floats(writer, bound.flat_map(|&segment| inverse_bind(&first.state, segment)))?;
        write_floats(writer, keys)?;
        write_motion(writer, trajectory, POSES_AT_ONCE / POSE)?;
        for solid in &solids {
            write_mesh(writer, &solid.mesh)?;
            if let Some(obstacle) = solid.moving(model) {
                write_track(writer, || times.iter().map(|&time| obstacle.at(time).pose))?;
            }
        }
        Ok(())
    })?;
    Ok(vec![file.publish()?])
}

/// The parts of a trajectory that are animations of their own: all of it, or each mode, from the frame before it on.
fn clips(trajectory: &TrajectoryReader) -> Vec<Clip> {
    let frames = trajectory.frames();
    let mut clips: Vec<(usize, Clip)> = Vec::new();
    for frame in 1..frames {
        let Some((mode, frequency)) = trajectory.mode(frame) else { continue };
        match clips.last_mut() {
            Some((last, clip)) if *last == mode => clip.frames.end = frame + 1,
            _ => {
                let name = format!("mode {mode}, {frequency:.6} Hz");
                clips.push((mode, Clip { name, frames: frame - 1..frame + 1 }));
            }
        }
    }
    match clips.is_empty() {
        true => vec![Clip { name: trajectory.info().scene.clone(), frames: 0..frames }],
        false => clips.into_iter().map(|(_, clip)| clip).collect(),
    }
}

/// Writes indices, places and normals.
fn write_mesh(writer: &mut impl Write, mesh: &Mesh) -> io::Result<()> {
    mesh.triangles.as_flattened().iter().try_for_each(|corner| writer.write_all(&corner.to_le_bytes()))?;
    write_floats(writer, mesh.positions.iter().chain(&mesh.normals).flatten().map(|&x| x as f32))
}

/// Writes the translations of `poses`, then their rotations.
fn write_track<I: Iterator<Item = Pose>>(writer: &mut impl Write, poses: impl Fn() -> I) -> io::Result<()> {
    write_floats(writer, poses().flat_map(|pose| <[f32; 3]>::from(pose.position.map(|x| x as f32))))?;
    let mut last = Quaternion::identity();
    let rotation = |pose: Pose| {
        last = nearer(pose.orientation.into_inner(), &last);
        <[f32; 4]>::from(last.coords.map(|x| x as f32))
    };
    write_floats(writer, poses().flat_map(rotation))
}

/// Of q and -q, which are the same rotation, the one that is nearer the last, for the short way between them.
fn nearer(q: Quaternion<f64>, last: &Quaternion<f64>) -> Quaternion<f64> {
    if q.dot(last) < 0.0 { -q } else { q }
}

fn refused(reason: String) -> ExportError {
    ExportError::Format { format: Format::Glb, reason }
}

/// Checks that the format can hold so many frames of so many segments.
fn check(frames: usize, segments: usize) -> Result<(), String> {
    if frames == 0 || segments == 0 {
        return Err(format!("{frames} frames of {segments} segments, but there must be at least one of both"));
    }
    fits(frames.saturating_mul(segments).saturating_mul(POSE)).map(drop)
}

/// The size of a file in 32 bits.
fn fits(bytes: usize) -> Result<u32, String> {
    let gib = bytes as f64 / (1_u64 << 30) as f64;
    u32::try_from(bytes).map_err(|_| format!("{gib:.1} GiB, but at most 4 GiB are allowed: keep fewer frames"))
}

/// Times in f32, each above the one before, as they must be (section 3.11): where f32 cannot tell two of them apart, the
/// later one is moved by a rounding error. Frames whose times go back, as along a path of equilibria, come evenly, [`UNEVEN_RATE`] a second.
fn increasing(times: &[f64]) -> Vec<f32> {
    if times.windows(2).any(|pair| pair[1] < pair[0]) {
        return (0..times.len()).map(|k| k as f32 / UNEVEN_RATE as f32).collect();
    }
    let mut last = f32::NEG_INFINITY;
    let above = |&time: &f64| {
        last = (time as f32).max(last.next_up());
        last
    };
    times.iter().map(above).collect()
}

/// From the world to the frame of a segment in `state`, column by column.
fn inverse_bind(state: &State, segment: usize) -> [f32; 16] {
    let inverse = state.orientations[segment].inverse();
    let matrix = Matrix4::new_translation(&-(inverse * state.positions[segment])) * inverse.to_homogeneous();
    std::array::from_fn(|i| matrix.as_slice()[i] as f32)
}

/// Writes translations and rotations of one segment after the other, over all frames. The trajectory has one frame after
/// the other: as many frames are turned at once as have `poses` poses.
fn write_motion(writer: &mut BufWriter<&File>, trajectory: &mut TrajectoryReader, poses: usize) -> io::Result<()> {
    let (frames, segments) = (trajectory.frames(), trajectory.segments());
    let start = writer.stream_position()?;
    let at_once = (poses / segments).clamp(1, frames);
    let mut tracks = vec![(Vec::new(), Vec::new()); segments];
    let mut last: Vec<Quaternion<f64>> = Vec::new();
    let mut state = State::default();
    for begin in (0..frames).step_by(at_once) {
        for frame in begin..frames.min(begin + at_once) {
            trajectory.read_frame(frame, &mut state).map_err(io::Error::other)?;
            last.resize(segments, Quaternion::identity());
            for (i, (translations, rotations)) in tracks.iter_mut().enumerate() {
                let own = state.orientations[i].into_inner();
                let q = if frame > 0 { nearer(own, &last[i]) } else { own };
                last[i] = q;
                translations.extend(state.positions[i].iter().flat_map(|&x| (x as f32).to_le_bytes()));
                rotations.extend(q.coords.iter().flat_map(|&x| (x as f32).to_le_bytes()));
            }
        }
        for (i, (translations, rotations)) in tracks.iter_mut().enumerate() {
            let track = start + (i * frames * POSE) as u64;
            writer.seek(SeekFrom::Start(track + (begin * 12) as u64))?;
            writer.write_all(translations)?;
            writer.seek(SeekFrom::Start(track + (frames * 12 + begin * 16) as u64))?;
            writer.write_all(rotations)?;
            translations.clear();
            rotations.clear();
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use nalgebra::{UnitQuaternion, Vector3};

    use super::*;
    use crate::{TrajectoryInfo, TrajectoryWriter, write_atomically};

    #[test]
    fn motions_in_parts_are_those_in_one() {
        let directory = tempfile::tempdir().unwrap();
        let info = TrajectoryInfo { scene: String::new(), dt: 1.0, segments_hash: None };
        let (segments, frames) = (3, 7);
        let mut writer = TrajectoryWriter::create(directory.path(), segments, 0, info).unwrap();
        for frame in 0..frames {
            let vectors: Vec<_> = (0..segments).map(|i| Vector3::new(frame as f64, i as f64, 0.5)).collect();
            let state = State {
                orientations: vectors.iter().map(|v| UnitQuaternion::from_scaled_axis(*v)).collect(),
                positions: vectors.clone(),
                velocities: vectors.clone(),
                angular_velocities: vectors,
                internals: Vec::new(),
            };
            writer.push(&state, &[], frame as f64).unwrap();
        }
        let mut trajectory = TrajectoryReader::open(&writer.finish().unwrap()).unwrap();
        let path = directory.path().join("motion");
        let mut bytes = |poses: usize| {
            let write = |writer: &mut BufWriter<&File>| write_motion(writer, &mut trajectory, poses);
            write_atomically(&path, write).unwrap();
            std::fs::read(&path).unwrap()
        };
        let whole = bytes(usize::MAX);
        assert_eq!(whole.len(), segments * frames * POSE);
        for poses in [0, 3, 6, 8, 20, 21] {
            assert!(bytes(poses) == whole, "{poses}");
        }
    }

    #[test]
    fn what_does_not_fit_is_one_clear_error() {
        assert!(check(0, 1).unwrap_err().starts_with("0 frames of 1 segments"));
        assert_eq!(check(2341, 65_535).unwrap_err(), "4.0 GiB, but at most 4 GiB are allowed: keep fewer frames");
        assert_eq!(check(2340, 65_535), Ok(()));
        assert!(check(usize::MAX, 2).unwrap_err().contains("GiB"));
    }

    #[test]
    fn times_increase_where_f32_cannot_tell_them_apart() {
        let times = increasing(&[0.0, 1.0, 1.0 + 1e-9, 1.0 + 2e-9, 2.0]);
        assert!(times.windows(2).all(|pair| pair[0] < pair[1]), "{times:?}");
        assert_eq!((times[0], times[1], times[4]), (0.0, 1.0, 2.0));
    }
}

//! Reading a trajectory back.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use nalgebra::{Quaternion, Unit, Vector3};
use rod::{JointForce, State, Wrench};
use safetensors::tensor::Metadata;

use crate::ExportError;
use crate::file::CHUNK;
use crate::layout::{
    CONTACT_LOADS, FRAMES_KEY, JOINT_FORCES, Layout, MODES_KEY, Modes, SEGMENTS_KEY, TrajectoryInfo, VALUE,
    checksum_digits,
};

/// The header's length in bytes is at most this, as in the safetensors crate.
const MAX_HEADER: u64 = 100_000_000;

/// A trajectory in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    /// What the file says about itself.
    pub info: TrajectoryInfo,
    /// Time of each frame [s], `[frames]`.
    pub time: Vec<f64>,
    /// State at each frame, `[frames]`.
    pub states: Vec<State>,
    /// What each joint transmits at each frame, `[frames][joints]`; no joints where their forces were not kept.
    pub forces: Vec<Vec<JointForce>>,
}

/// Reads the whole of a trajectory; the numbers are, bit for bit, those that were written.
///
/// # Errors
/// As [`TrajectoryReader::open`].
pub fn read_trajectory(path: &Path) -> Result<Trajectory, ExportError> {
    let mut reader = TrajectoryReader::open(path)?;
    let mut states = vec![State::default(); reader.frames()];
    let mut forces = vec![Vec::new(); reader.frames()];
    let mut time = Vec::with_capacity(reader.frames());
    for (frame, (state, forces)) in states.iter_mut().zip(&mut forces).enumerate() {
        time.push(reader.read_frame(frame, state)?);
        reader.read_forces(frame, forces)?;
    }
    Ok(Trajectory { info: reader.info, time, states, forces })
}

/// A trajectory's file, read one frame at a time.
#[derive(Debug)]
pub struct TrajectoryReader {
    path: PathBuf,
    file: File,
    info: TrajectoryInfo,
    layout: Layout,
    modes: Modes,
    /// Place of the first tensor in the file.
    data_start: u64,
    /// One frame's part of a tensor.
    bytes: Vec<u8>,
    /// The segments and joints that are read, where these are not all.
    only: Option<[Vec<usize>; 2]>,
    /// Of how many frames one is read.
    every: usize,
}

impl TrajectoryReader {
    /// Opens a trajectory and checks all of it: header, size and checksum.
    ///
    /// # Errors
    /// [`ExportError::Io`] if the file cannot be read, [`ExportError::Damaged`] if it is not what a
    /// [`crate::TrajectoryWriter`] wrote.
    pub fn open(path: &Path) -> Result<Self, ExportError> {
        let unreadable = |cause| ExportError::io("read", path)(cause);
        let damaged = |reason: String| ExportError::damaged(path, reason);
        let mut file = File::open(path).map_err(unreadable)?;
        let file_bytes = file.metadata().map_err(unreadable)?.len();

        let mut length = [0; VALUE];
        if file_bytes < VALUE as u64 {
            return Err(damaged(format!("it has {file_bytes} bytes")));
        }
        file.read_exact(&mut length).map_err(unreadable)?;
        let json_bytes = u64::from_le_bytes(length);
        if json_bytes > MAX_HEADER.min(file_bytes - VALUE as u64) || !json_bytes.is_multiple_of(VALUE as u64) {
            return Err(damaged(format!("its header cannot have {json_bytes} bytes")));
        }
        let mut header = length.to_vec();
        header.resize(VALUE + json_bytes as usize, 0);
        file.read_exact(&mut header[VALUE..]).map_err(unreadable)?;
        let (info, layout, modes, data_bytes) = parse(&header[VALUE..]).map_err(damaged)?;
        let data_start = header.len() as u64;
        if data_bytes as u64 != file_bytes - data_start {
            return Err(damaged(format!("it has {} of {data_bytes} bytes of data", file_bytes - data_start)));
        }

        let digits = checksum_digits(&header).ok_or_else(|| damaged("it has no checksum".to_owned()))?;
        let expected = header[digits.clone()].to_vec();
        header[digits].fill(b'0');
        let mut checksum = blake3::Hasher::new();
        checksum.update(&header);
        let mut chunk = vec![0; CHUNK.min(data_bytes)];
        let mut left = data_bytes;
        while left > 0 {
            let chunk = &mut chunk[..left.min(CHUNK)];
            file.read_exact(chunk).map_err(unreadable)?;
            checksum.update(chunk);
            left -= chunk.len();
        }
        if checksum.finalize().to_hex().as_bytes() != expected {
            return Err(damaged("its checksum does not fit its content".to_owned()));
        }
        let path = path.to_owned();
        Ok(Self { path, file, info, layout, modes, data_start, bytes: Vec::new(), only: None, every: 1 })
    }

    /// What the file says about itself.
    pub fn info(&self) -> &TrajectoryInfo {
        &self.info
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.layout.frames.saturating_sub(1).div_ceil(self.every) + usize::from(self.layout.frames > 0)
    }

    /// The mode that a frame shows: its number and its frequency [Hz]; `None` in a motion, and in the first frame.
    pub fn mode(&self, frame: usize) -> Option<(usize, f64)> {
        self.modes.at((frame * self.every).min(self.layout.frames.saturating_sub(1)))
    }

    /// Reads one of `every` frames from here on, from the first one, and the last one, as if there were no others; of 0, all.
    pub fn every(&mut self, every: usize) {
        self.every = every.max(1);
    }

    /// Reads these segments and joints alone from here on, ascending, as if there were no others: those of a
    /// [`rod::Part`].
    ///
    /// # Panics
    /// In later reads, if there are no such segments or joints.
    pub fn only(&mut self, segments: &[usize], joints: &[usize]) {
        self.only = Some([segments.to_vec(), joints.to_vec()]);
    }

    /// Number of segments.
    pub fn segments(&self) -> usize {
        self.only.as_ref().map_or(self.layout.segments, |[segments, _]| segments.len())
    }

    /// Number of joints whose forces were kept; 0 if none were.
    pub fn joints(&self) -> usize {
        self.only.as_ref().map_or(self.layout.joints, |[_, joints]| joints.len().min(self.layout.joints))
    }

    /// Checks that the trajectory is of `found` segments.
    pub(crate) fn expect_segments(&self, found: usize) -> Result<(), ExportError> {
        let expected = self.segments();
        if found == expected { Ok(()) } else { Err(ExportError::Segments { found, expected }) }
    }

    /// Checks that the trajectory is of a model of `found` joints, as far as it knows of any.
    pub(crate) fn expect_joints(&self, found: usize) -> Result<(), ExportError> {
        let expected = self.joints();
        if [0, found].contains(&expected) { Ok(()) } else { Err(ExportError::Joints { found, expected }) }
    }

    /// Reads a frame into `state`, whose arrays are resized if need be, and returns its time [s].
    ///
    /// # Errors
    /// [`ExportError::NoFrame`], or [`ExportError::Io`] if the file cannot be read.
    pub fn read_frame(&mut self, frame: usize, state: &mut State) -> Result<f64, ExportError> {
        let time = self.part("time", frame)?.iter().map(|&bytes| f64::from_le_bytes(bytes)).sum();
        set(&mut state.positions, self.part("positions", frame)?, Vector3::from);
        let unit = |q: [f64; 4]| Unit::new_unchecked(Quaternion::from(q));
        set(&mut state.orientations, self.part("orientations", frame)?, unit);
        set(&mut state.velocities, self.part("velocities", frame)?, Vector3::from);
        set(&mut state.angular_velocities, self.part("angular_velocities", frame)?, Vector3::from);
        if let Some([segments, _]) = &self.only {
            pick(&mut state.positions, segments);
            pick(&mut state.orientations, segments);
            pick(&mut state.velocities, segments);
            pick(&mut state.angular_velocities, segments);
        }
        Ok(time)
    }

    /// Reads what each joint transmits in a frame into `forces` `[joints]`, which is left empty if no forces were kept.
    ///
    /// # Errors
    /// As [`TrajectoryReader::read_frame`].
    pub fn read_forces(&mut self, frame: usize, forces: &mut Vec<JointForce>) -> Result<(), ExportError> {
        let joint = |[fx, fy, fz, mx, my, mz]: [f64; 6]| JointForce {
            force: Vector3::new(fx, fy, fz),
            moment: Vector3::new(mx, my, mz),
        };
        set(forces, self.part(JOINT_FORCES, frame)?, joint);
        if let Some([_, joints]) = self.only.as_ref().filter(|_| self.layout.joints > 0) {
            pick(forces, joints);
        }
        Ok(())
    }

    /// Reads what contacts give to each segment in a frame into `contacts` `[segments]`, which is left empty if that was not kept.
    ///
    /// # Errors
    /// As [`TrajectoryReader::read_frame`].
    pub fn read_contacts(&mut self, frame: usize, contacts: &mut Vec<Wrench>) -> Result<(), ExportError> {
        let wrench = |[fx, fy, fz, mx, my, mz]: [f64; 6]| Wrench {
            force: Vector3::new(fx, fy, fz),
            moment: Vector3::new(mx, my, mz),
        };
        set(contacts, self.part(CONTACT_LOADS, frame)?, wrench);
        if let Some([segments, _]) = self.only.as_ref().filter(|_| self.layout.contacts) {
            pick(contacts, segments);
        }
        Ok(())
    }

    /// Times of all frames [s], `[frames]`.
    ///
    /// # Errors
    /// [`ExportError::Io`] if the file cannot be read.
    pub fn times(&mut self) -> Result<Vec<f64>, ExportError> {
        (0..self.frames())
            .map(|frame| Ok(self.part("time", frame)?.iter().map(|&t| f64::from_le_bytes(t)).sum()))
            .collect()
    }

    /// Values of `tensor` in a frame; none if the trajectory has no such tensor.
    fn part(&mut self, tensor: &str, frame: usize) -> Result<&[[u8; VALUE]], ExportError> {
        if frame >= self.frames() {
            return Err(ExportError::NoFrame { frame, frames: self.frames() });
        }
        let frames = self.layout.frames;
        let frame = (frame * self.every).min(frames - 1);
        let mut start = self.data_start;
        let mut width = 0;
        for (name, bytes) in self.layout.widths() {
            if name == tensor {
                start += (bytes * frame) as u64;
                width = bytes;
                break;
            }
            start += (bytes * frames) as u64;
        }
        self.bytes.resize(width, 0);
        let read = self.file.seek(SeekFrom::Start(start)).and_then(|_| self.file.read_exact(&mut self.bytes));
        read.map_err(ExportError::io("read", &self.path))?;
        Ok(self.bytes.as_chunks().0)
    }
}

/// Fills `target` with one item for every `N` values.
fn set<T, const N: usize>(target: &mut Vec<T>, values: &[[u8; VALUE]], item: impl Fn([f64; N]) -> T) {
    target.clear();
    target.extend(values.as_chunks::<N>().0.iter().map(|parts| item(parts.map(f64::from_le_bytes))));
}

/// Keeps the values at these places, which ascend.
fn pick<T: Copy>(values: &mut Vec<T>, places: &[usize]) {
    for (to, &from) in places.iter().enumerate() {
        values[to] = values[from];
    }
    values.truncate(places.len());
}

/// Reads a JSON header: what it says, the trajectory's size, and the bytes of all tensors; or what is wrong with it.
fn parse(json: &[u8]) -> Result<(TrajectoryInfo, Layout, Modes, usize), String> {
    let metadata: Metadata = serde_json::from_slice(json).map_err(|e| format!("its header is not valid: {e}"))?;
    let text = |key: &str| {
        let value = metadata.metadata().as_ref().and_then(|texts| texts.get(key));
        value.ok_or_else(|| format!("its header has no \"{key}\""))
    };
    let dt = text("dt")?.parse().map_err(|_| "the time step in its header is not a number".to_owned())?;
    let info = TrajectoryInfo { scene: text("scene")?.clone(), dt, segments_hash: text(SEGMENTS_KEY).ok().cloned() };

    let mut modes = Modes::default();
    if let Ok(list) = text(MODES_KEY) {
        let wrong = |_| "the modes in its header are not numbers".to_owned();
        modes.frequencies = list.split(' ').map(|word| word.parse().map_err(wrong)).collect::<Result<_, _>>()?;
        modes.frames =
            text(FRAMES_KEY)?.parse().map_err(|_| "the frames of a mode in its header are no number".to_owned())?;
    }

    let shape = metadata.info("positions").map(|tensor| tensor.shape.as_slice());
    let Some(&[frames, segments, _]) = shape else {
        return Err("it has no positions [frames, segments, 3]".to_owned());
    };
    let joints = match metadata.info(JOINT_FORCES).map(|tensor| tensor.shape.as_slice()) {
        None => 0,
        Some(&[_, joints, _]) if joints > 0 => joints,
        Some(_) => return Err("its joint_forces are not [frames, joints, 6]".to_owned()),
    };
    let layout = Layout { frames, segments, joints, contacts: metadata.info(CONTACT_LOADS).is_some() };
    let expected = layout.tensors().ok_or_else(|| "its size is impossible".to_owned())?;
    for (name, tensor) in &expected {
        let fits = metadata.info(name).is_some_and(|found| {
            (found.dtype, &found.shape, found.data_offsets) == (tensor.dtype, &tensor.shape, tensor.data_offsets)
        });
        if !fits {
            return Err(format!("it has no {name} {:?} where they should be", tensor.shape));
        }
    }
    if metadata.offset_keys().len() != expected.len() {
        return Err("it has tensors that are not a trajectory's".to_owned());
    }
    Ok((info, layout, modes, metadata.data_len()))
}

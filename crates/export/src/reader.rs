//! Reading a trajectory back.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use nalgebra::{Quaternion, Unit, Vector3};
use rod::State;
use safetensors::tensor::Metadata;

use crate::ExportError;
use crate::file::CHUNK;
use crate::layout::{Checksum, Layout, TrajectoryInfo, VALUE, checksum_digits};

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
}

/// Reads the whole of a trajectory; the numbers are, bit for bit, those that were written.
///
/// # Errors
/// As [`TrajectoryReader::open`].
pub fn read_trajectory(path: &Path) -> Result<Trajectory, ExportError> {
    let mut reader = TrajectoryReader::open(path)?;
    let mut states = vec![State::default(); reader.frames()];
    let time = states.iter_mut().enumerate().map(|(i, s)| reader.read_frame(i, s)).collect::<Result<_, _>>()?;
    Ok(Trajectory { info: reader.info, time, states })
}

/// A trajectory's file, read one frame at a time.
#[derive(Debug)]
pub struct TrajectoryReader {
    path: PathBuf,
    file: File,
    info: TrajectoryInfo,
    layout: Layout,
    /// Place of the first tensor in the file.
    data_start: u64,
    /// One frame's part of a tensor.
    bytes: Vec<u8>,
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
        let (info, layout, data_bytes) = parse(&header[VALUE..]).map_err(damaged)?;
        let data_start = header.len() as u64;
        if data_bytes as u64 != file_bytes - data_start {
            return Err(damaged(format!("it has {} of {data_bytes} bytes of data", file_bytes - data_start)));
        }

        let digits = checksum_digits(&header).ok_or_else(|| damaged("it has no checksum".to_owned()))?;
        let expected = header[digits.clone()].to_vec();
        header[digits].fill(b'0');
        let mut checksum = Checksum::new();
        checksum.update(&header);
        let mut chunk = vec![0; CHUNK.min(data_bytes)];
        let mut left = data_bytes;
        while left > 0 {
            let chunk = &mut chunk[..left.min(CHUNK)];
            file.read_exact(chunk).map_err(unreadable)?;
            checksum.update(chunk);
            left -= chunk.len();
        }
        if checksum.digits().as_bytes() != expected {
            return Err(damaged("its checksum does not fit its content".to_owned()));
        }
        Ok(Self { path: path.to_owned(), file, info, layout, data_start, bytes: Vec::new() })
    }

    /// What the file says about itself.
    pub fn info(&self) -> &TrajectoryInfo {
        &self.info
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.layout.frames
    }

    /// Number of segments.
    pub fn segments(&self) -> usize {
        self.layout.segments
    }

    /// Checks that the trajectory is of `found` segments.
    pub(crate) fn expect_segments(&self, found: usize) -> Result<(), ExportError> {
        let expected = self.segments();
        if found == expected { Ok(()) } else { Err(ExportError::Segments { found, expected }) }
    }

    /// Reads a frame into `state`, whose arrays are resized if need be, and returns its time [s].
    ///
    /// # Errors
    /// [`ExportError::NoFrame`], or [`ExportError::Io`] if the file cannot be read.
    pub fn read_frame(&mut self, frame: usize, state: &mut State) -> Result<f64, ExportError> {
        let frames = self.layout.frames;
        if frame >= frames {
            return Err(ExportError::NoFrame { frame, frames });
        }
        self.read_values(frame, state).map_err(ExportError::io("read", &self.path))
    }

    fn read_values(&mut self, frame: usize, state: &mut State) -> io::Result<f64> {
        let widths = self.layout.widths();
        let mut time = 0.0;
        let mut tensor = self.data_start;
        for (index, width) in widths.into_iter().enumerate() {
            let part = (VALUE * width) as u64;
            self.file.seek(SeekFrom::Start(tensor + part * frame as u64))?;
            self.bytes.resize(VALUE * width, 0);
            self.file.read_exact(&mut self.bytes)?;
            tensor += part * self.layout.frames as u64;
            let values = self.bytes.as_chunks::<VALUE>().0;
            match index {
                0 => time = values.iter().map(|&bytes| f64::from_le_bytes(bytes)).sum(),
                1 => set(&mut state.positions, values, Vector3::from),
                2 => set(&mut state.orientations, values, |q: [f64; 4]| Unit::new_unchecked(Quaternion::from(q))),
                3 => set(&mut state.velocities, values, Vector3::from),
                _ => set(&mut state.angular_velocities, values, Vector3::from),
            }
        }
        Ok(time)
    }
}

/// Fills `target` with one item for every `N` values.
fn set<T, const N: usize>(target: &mut Vec<T>, values: &[[u8; VALUE]], item: impl Fn([f64; N]) -> T) {
    target.clear();
    target.extend(values.as_chunks::<N>().0.iter().map(|parts| item(parts.map(f64::from_le_bytes))));
}

/// Reads a JSON header: what it says, the trajectory's size, and the bytes of all tensors; or what is wrong with it.
fn parse(json: &[u8]) -> Result<(TrajectoryInfo, Layout, usize), String> {
    let metadata: Metadata = serde_json::from_slice(json).map_err(|e| format!("its header is not valid: {e}"))?;
    let text = |key: &str| {
        let value = metadata.metadata().as_ref().and_then(|texts| texts.get(key));
        value.ok_or_else(|| format!("its header has no \"{key}\""))
    };
    let dt = text("dt")?.parse().map_err(|_| "the time step in its header is not a number".to_owned())?;
    let info = TrajectoryInfo { scene: text("scene")?.clone(), dt };

    let shape = metadata.info("positions").map(|tensor| tensor.shape.as_slice());
    let Some(&[frames, segments, _]) = shape else {
        return Err("it has no positions [frames, segments, 3]".to_owned());
    };
    let layout = Layout { frames, segments };
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
    Ok((info, layout, metadata.data_len()))
}

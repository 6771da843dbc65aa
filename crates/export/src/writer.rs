//! Writing a trajectory while the simulation runs.

use std::fs::{self, File};
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use rod::{JointForce, State};
use tempfile::NamedTempFile;

use crate::ExportError;
use crate::file::{CHUNK, temporary, write_atomically};
use crate::layout::{FILE_NAME, Layout, TrajectoryInfo};

/// Collects frames in a temporary file and turns them into `trajectory.safetensors` at the end, in constant memory.
///
/// The file has the tensors `time` `[frames]` [s], `positions` `[frames, segments, 3]` [m], `orientations`
/// `[frames, segments, 4]` (x, y, z, w), `velocities` `[frames, segments, 3]` [m/s] and `angular_velocities`
/// `[frames, segments, 3]` [rad/s], all F64, with the forces of joints also `joint_forces` `[frames, joints, 6]`
/// ([`JointForce`]: force [N], then moment [N m]), and the strings `scene`, `dt`, `units` and `checksum`.
///
/// A run that is interrupted finishes with the frames it has. A writer that is dropped leaves nothing behind. While it
/// works, the trajectory needs its size on the disk twice.
#[derive(Debug)]
pub struct TrajectoryWriter {
    path: PathBuf,
    info: TrajectoryInfo,
    layout: Layout,
    /// Frames one after the other, each with its part of every tensor in the order of the file; removed on drop.
    spool: NamedTempFile,
    /// Whole frames that are not in the spool yet.
    pending: Vec<u8>,
    /// Bytes of whole frames in the spool.
    spooled: u64,
}

impl TrajectoryWriter {
    /// Begins a trajectory of `segments` segments in `directory`, which is created if it does not exist. The forces of
    /// `joints` joints are kept, of none with 0.
    ///
    /// # Errors
    /// [`ExportError::Io`] if the directory cannot be created or written to, or a directory stands in the file's place.
    pub fn create(directory: &Path, segments: usize, joints: usize, info: TrajectoryInfo) -> Result<Self, ExportError> {
        if directory.exists() && !directory.is_dir() {
            return Err(ExportError::io("create the directory", directory)(io::ErrorKind::NotADirectory.into()));
        }
        fs::create_dir_all(directory).map_err(ExportError::io("create the directory", directory))?;
        let path = directory.join(FILE_NAME);
        if path.is_dir() {
            return Err(ExportError::io("write", &path)(io::ErrorKind::IsADirectory.into()));
        }
        let spool = temporary(directory, ".trajectory-spool-").map_err(ExportError::io("write into", directory))?;
        let layout = Layout { frames: 0, segments, joints };
        Ok(Self { path, info, layout, spool, pending: Vec::with_capacity(CHUNK), spooled: 0 })
    }

    /// Adds a frame at `time` [s] with the forces of the joints, `[joints]` as given to [`TrajectoryWriter::create`].
    ///
    /// # Errors
    /// [`ExportError::Segments`] or [`ExportError::Joints`] if something does not fit: the frame is not taken.
    /// [`ExportError::Io`] if the disk does not take the frames: they are kept, and the next call tries again.
    pub fn push(&mut self, state: &State, forces: &[JointForce], time: f64) -> Result<(), ExportError> {
        let State { positions, orientations, velocities, angular_velocities } = state;
        let expected = self.layout.segments;
        let sizes = [positions.len(), orientations.len(), velocities.len(), angular_velocities.len()];
        if let Some(&found) = sizes.iter().find(|&&n| n != expected) {
            return Err(ExportError::Segments { found, expected });
        }
        let (found, expected) = (forces.len(), self.layout.joints);
        if found != expected {
            return Err(ExportError::Joints { found, expected });
        }
        let values = std::iter::once(&time)
            .chain(positions.iter().flatten())
            .chain(orientations.iter().flat_map(|q| q.coords.iter()))
            .chain(velocities.iter().flatten())
            .chain(angular_velocities.iter().flatten())
            .chain(forces.iter().flat_map(|joint| joint.force.iter().chain(&joint.moment)));
        self.pending.extend(values.flat_map(|value| value.to_le_bytes()));
        self.layout.frames += 1;
        if self.pending.len() >= CHUNK { self.spill() } else { Ok(()) }
    }

    /// Number of frames so far.
    pub fn frames(&self) -> usize {
        self.layout.frames
    }

    /// Writes `trajectory.safetensors` with the frames so far, removes the spool and returns the file's path.
    ///
    /// # Errors
    /// [`ExportError::Io`] if the file cannot be written. A file that was there before is untouched then.
    pub fn finish(mut self) -> Result<PathBuf, ExportError> {
        self.spill()?;
        write_atomically(&self.path, |writer| self.write(writer))?;
        Ok(self.path)
    }

    /// Moves the pending frames into the spool.
    fn spill(&mut self) -> Result<(), ExportError> {
        let file = self.spool.as_file_mut();
        // An attempt that failed half-way has moved the file's position: begin where the last whole frame ended.
        file.seek(SeekFrom::Start(self.spooled))
            .and_then(|_| file.write_all(&self.pending))
            .map_err(ExportError::io("write", self.spool.path()))?;
        self.spooled += self.pending.len() as u64;
        self.pending.clear();
        Ok(())
    }

    /// Writes header and tensors, one pass over the spool for each tensor.
    fn write(&self, writer: &mut BufWriter<&File>) -> io::Result<()> {
        let (header, digits) = self.layout.header(&self.info)?;
        let mut checksum = blake3::Hasher::new();
        checksum.update(&header);
        writer.write_all(&header)?;

        let frame_bytes = self.layout.frame_bytes();
        let frames_at_once = (CHUNK / frame_bytes).max(1);
        let mut chunk = vec![0; frames_at_once * frame_bytes];
        let mut start = 0;
        for (_, bytes) in self.layout.widths() {
            let part = start..start + bytes;
            start = part.end;
            let mut spool = self.spool.as_file();
            spool.seek(SeekFrom::Start(0))?;
            let mut left = self.layout.frames;
            while left > 0 {
                let frames = left.min(frames_at_once);
                let chunk = &mut chunk[..frames * frame_bytes];
                spool.read_exact(chunk)?;
                for frame in chunk.chunks_exact(frame_bytes) {
                    checksum.update(&frame[part.clone()]);
                    writer.write_all(&frame[part.clone()])?;
                }
                left -= frames;
            }
        }
        writer.seek(SeekFrom::Start(digits as u64))?;
        writer.write_all(checksum.finalize().to_hex().as_bytes())
    }
}

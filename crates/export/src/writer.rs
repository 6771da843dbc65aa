//! Writing a trajectory while the simulation runs.

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use rod::{JointForce, State, Wrench};

use crate::ExportError;
use crate::file::{CHUNK, write_atomically};
use crate::layout::{FILE_NAME, Layout, Modes, TrajectoryInfo};

/// Bytes of frames that are given up where the disk is full, as room to begin with.
const SPARE: usize = 256 << 10;

/// Collects frames in a temporary file and turns them into `trajectory.safetensors` at the end, in constant memory.
///
/// The file has the tensors `time` `[frames]` [s], `positions` `[frames, segments, 3]` [m], `orientations`
/// `[frames, segments, 4]` (x, y, z, w), `velocities` `[frames, segments, 3]` [m/s] and `angular_velocities`
/// `[frames, segments, 3]` [rad/s], all F64, with the forces of joints also `joint_forces` `[frames, joints, 6]`
/// ([`JointForce`]: force [N], then moment [N m]), with those of contacts `contact_loads`
/// `[frames, segments, 6]` ([`Wrench`]), and the strings `scene`, `dt`, `units` and `checksum`; with modes also
/// `modes_hz` and `frames_a_mode` ([`TrajectoryWriter::show_modes`]).
///
/// A run that is interrupted finishes with the frames it has. A writer that is dropped, or whose process is killed,
/// leaves nothing behind. While it finishes, the trajectory needs its size on the disk twice; where there is no room for
/// that, [`TrajectoryWriter::salvage`] does with once.
#[derive(Debug)]
pub struct TrajectoryWriter {
    path: PathBuf,
    info: TrajectoryInfo,
    layout: Layout,
    modes: Modes,
    /// Frames one after the other, each with its part of every tensor in the order of the file. It has no name: the
    /// system removes it with the last handle.
    spool: File,
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
        // The error's kind alone: the random name that tempfile may add to it says nothing to a reader.
        let spool = tempfile::tempfile_in(directory).map_err(|error| error.kind().into());
        let spool = spool.map_err(ExportError::io("write into", directory))?;
        let layout = Layout { frames: 0, segments, joints, contacts: false };
        Ok(Self { path, info, layout, modes: Modes::default(), spool, pending: Vec::with_capacity(CHUNK), spooled: 0 })
    }

    /// Keeps what contacts give to segments, too: [`TrajectoryWriter::push_with_contacts`] in place of
    /// [`TrajectoryWriter::push`].
    pub fn keeping_contacts(mut self) -> Self {
        self.layout.contacts = true;
        self
    }

    /// Adds a frame at `time` [s] with the forces of the joints, `[joints]` as given to [`TrajectoryWriter::create`].
    ///
    /// # Errors
    /// [`ExportError::Segments`] or [`ExportError::Joints`] if something does not fit: the frame is not taken.
    /// [`ExportError::Io`] if the disk does not take the frames: they are kept, and the next call tries again.
    pub fn push(&mut self, state: &State, forces: &[JointForce], time: f64) -> Result<(), ExportError> {
        self.push_with_contacts(state, forces, &[], time)
    }

    /// [`TrajectoryWriter::push`] with what contacts give to each segment, `[segments]`; none where it is not kept.
    ///
    /// # Errors
    /// As [`TrajectoryWriter::push`].
    pub fn push_with_contacts(
        &mut self,
        state: &State,
        forces: &[JointForce],
        contacts: &[Wrench],
        time: f64,
    ) -> Result<(), ExportError> {
        // What joints with laws remember is in snapshots alone.
        let State { positions, orientations, velocities, angular_velocities, internals: _ } = state;
        let expected = self.layout.segments;
        let sizes = [positions.len(), orientations.len(), velocities.len(), angular_velocities.len()];
        if let Some(&found) = sizes.iter().find(|&&n| n != expected) {
            return Err(ExportError::Segments { found, expected });
        }
        let (found, expected) = (forces.len(), self.layout.joints);
        if found != expected {
            return Err(ExportError::Joints { found, expected });
        }
        let (found, expected) = (contacts.len(), if self.layout.contacts { self.layout.segments } else { 0 });
        if found != expected {
            return Err(ExportError::Segments { found, expected });
        }
        let values = std::iter::once(&time)
            .chain(positions.iter().flatten())
            .chain(orientations.iter().flat_map(|q| q.coords.iter()))
            .chain(velocities.iter().flatten())
            .chain(angular_velocities.iter().flatten())
            .chain(forces.iter().flat_map(|joint| joint.force.iter().chain(&joint.moment)))
            .chain(contacts.iter().flat_map(|on| on.force.iter().chain(&on.moment)));
        self.pending.extend(values.flat_map(|value| value.to_le_bytes()));
        self.layout.frames += 1;
        if self.pending.len() >= CHUNK { self.spill() } else { Ok(()) }
    }

    /// Says that the frames show modes of these frequencies [Hz], after a first one at rest, each in so many `frames`.
    pub fn show_modes(&mut self, frequencies: Vec<f64>, frames: usize) {
        self.modes = Modes { frequencies, frames };
    }

    /// Number of frames so far.
    pub fn frames(&self) -> usize {
        self.layout.frames
    }

    /// Writes `trajectory.safetensors` with the frames so far and returns the file's path.
    ///
    /// # Errors
    /// [`ExportError::Io`] if the file cannot be written. A file that was there before is untouched then, and the frames
    /// are kept.
    pub fn finish(&mut self) -> Result<PathBuf, ExportError> {
        self.spill()?;
        write_atomically(&self.path, |writer| self.write(writer.get_ref(), CHUNK, false))?;
        Ok(self.path.clone())
    }

    /// Writes `trajectory.safetensors` where the disk is full, after [`TrajectoryWriter::push`] or
    /// [`TrajectoryWriter::finish`] has failed: each frame that has gone into the file gives its room back. Some of the
    /// last frames are given up for a start, some hundred KiB of them, but half at most. Returns the file's path and how
    /// many frames it has.
    ///
    /// # Errors
    /// [`ExportError::Io`] if there is no room for a single frame, or something else takes the room meanwhile.
    pub fn salvage(mut self) -> Result<(PathBuf, usize), ExportError> {
        // As many as the disk still takes; the others are lost.
        let _ = self.spill();
        let frame_bytes = self.layout.frame_bytes();
        let spooled = self.spool.metadata().map_err(self.refused())?.len();
        let whole = self.layout.frames.min((spooled / frame_bytes as u64) as usize);
        self.layout.frames = whole - SPARE.div_ceil(frame_bytes).min(whole / 2);
        if self.layout.frames == 0 {
            return Err(self.refused()(io::ErrorKind::StorageFull.into()));
        }
        self.spool.set_len((self.layout.frames * frame_bytes) as u64).map_err(self.refused())?;
        write_atomically(&self.path, |writer| self.write(writer.get_ref(), SPARE / 4, true))?;
        Ok((self.path, self.layout.frames))
    }

    /// Moves the pending frames into the spool.
    fn spill(&mut self) -> Result<(), ExportError> {
        // An attempt that failed half-way has moved the file's position: begin where the last whole frame ended.
        let moved = self.spool.seek(SeekFrom::Start(self.spooled)).and_then(|_| self.spool.write_all(&self.pending));
        moved.map_err(self.refused())?;
        self.spooled += self.pending.len() as u64;
        self.pending.clear();
        Ok(())
    }

    /// An error of the spool: it stands in the directory, without a name.
    fn refused(&self) -> impl FnOnce(io::Error) -> ExportError {
        ExportError::io("write into", self.path.parent().unwrap_or(&self.path))
    }

    /// Writes header and tensors from the spool, about `at_once` bytes at a time, from the last frame to the first. With
    /// `consume`, what is read from the spool is cut off it before it is written.
    fn write(&self, mut file: &File, at_once: usize, consume: bool) -> io::Result<()> {
        let (header, digits) = self.layout.header(&self.info, &self.modes)?;
        file.write_all(&header)?;
        let (frames, frame_bytes) = (self.layout.frames, self.layout.frame_bytes());
        let frames_at_once = (at_once / frame_bytes).max(1);
        let mut chunk = vec![0; frames_at_once.min(frames) * frame_bytes];
        let mut part = Vec::with_capacity(chunk.len());
        let mut spool = &self.spool;
        let mut end = frames;
        while end > 0 {
            let begin = end.saturating_sub(frames_at_once);
            let chunk = &mut chunk[..(end - begin) * frame_bytes];
            spool.seek(SeekFrom::Start((begin * frame_bytes) as u64))?;
            spool.read_exact(chunk)?;
            if consume {
                spool.set_len((begin * frame_bytes) as u64)?;
            }
            let (mut tensor, mut column) = (header.len(), 0);
            for (_, bytes) in self.layout.widths() {
                part.clear();
                chunk
                    .chunks_exact(frame_bytes)
                    .for_each(|frame| part.extend_from_slice(&frame[column..column + bytes]));
                file.seek(SeekFrom::Start((tensor + begin * bytes) as u64))?;
                file.write_all(&part)?;
                tensor += frames * bytes;
                column += bytes;
            }
            end = begin;
        }
        let checksum = checksum(file)?;
        file.seek(SeekFrom::Start(digits as u64))?;
        file.write_all(checksum.to_hex().as_bytes())
    }
}

/// The checksum of a file whose digits are zeros yet.
fn checksum(mut file: &File) -> io::Result<blake3::Hash> {
    let mut checksum = blake3::Hasher::new();
    let mut left = file.seek(SeekFrom::End(0))? as usize;
    let mut chunk = vec![0; CHUNK.min(left)];
    file.seek(SeekFrom::Start(0))?;
    while left > 0 {
        let chunk = &mut chunk[..left.min(CHUNK)];
        file.read_exact(chunk)?;
        checksum.update(chunk);
        left -= chunk.len();
    }
    Ok(checksum.finalize())
}

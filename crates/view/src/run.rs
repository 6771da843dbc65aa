//! A recorded run: what is stored as `view.json`, and what the page embeds.

use std::io::Read;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::ZlibDecoder;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::body::Bodies;
use crate::channel::{Channel, Range};
use crate::chapter::{self, Chapter};
use crate::curve::Curve;
use crate::mark::{self, Contacts, Grip, Load};
use crate::obstacle::{Moved, Obstacle};
use crate::{DecodeError, Decoded, track};

/// Tracks of an orientation and the bytes of each.
pub(crate) const ORIENTATION: (usize, usize) = (3, 2);

/// Version of the format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Format {
    #[serde(rename = "rods-1")]
    Rods1,
}

/// A recorded run, made by [`crate::Recorder::finish`] or read by [`crate::read_run`].
///
/// `data` is base64 of a zlib stream of tracks: each has one integer a segment and frame, as changes from frame to
/// frame, in planes of bytes. They are x, y, z (2 or 3 bytes each, in steps from an origin), the three smallest
/// components of the quaternions (2 bytes each), and curvature, tension, residual and speed (1 byte each, on the scales
/// in `ranges`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    pub(crate) format: Format,
    pub(crate) name: String,
    /// Time step of the simulation [s].
    pub(crate) dt: f64,
    pub(crate) segments: Segments,
    /// Where they are at time 0.
    pub(crate) obstacles: Vec<Obstacle>,
    /// Of those that move; not in files of runs where none does.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) obstacle_motions: Vec<Moved>,
    /// Rigid bodies; left out where there are none.
    #[serde(default, skip_serializing_if = "Bodies::is_empty")]
    pub(crate) bodies: Bodies,
    /// Names of rods and bodies, by the numbers in `segments.rod`, and of obstacles; empty where they have none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) rods: Vec<String>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) obstacle_names: Vec<String>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) chapters: Vec<Chapter>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) curves: Vec<Curve>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) grips: Vec<Grip>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) loads: Vec<Load>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) contacts: Option<Contacts>,
    /// Time of each frame [s], ascending.
    pub(crate) time: Vec<f64>,
    /// Of each frame: energy [J], length ratio, iterations; `None` where it was not finite.
    pub(crate) energy: Vec<Option<f64>>,
    pub(crate) length_ratio: Vec<Option<f64>>,
    pub(crate) iterations: Vec<Option<f64>>,
    pub(crate) lattice: Lattice,
    /// Of the channels in the order of [`Channel::ALL`].
    pub(crate) ranges: [Range; 4],
    pub(crate) data: String,
}

/// The segments, one entry each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Segments {
    /// Lengths [m].
    pub(crate) length: Vec<f64>,
    /// Radii [m].
    pub(crate) radius: Vec<f64>,
    /// The segment of the same rod whose start is joined to the end of this one.
    pub(crate) next: Vec<Option<usize>>,
    /// Rods that the segments belong to, counted from 0; empty in files of earlier versions.
    #[serde(default)]
    pub(crate) rod: Vec<usize>,
}

/// The places that positions are rounded to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Lattice {
    /// Place of the steps 0, 0, 0 [m].
    pub(crate) origin: [f64; 3],
    /// Length of a step [m].
    pub(crate) step: f64,
    /// Bytes of a number of steps, 2 or 3.
    pub(crate) bytes: usize,
    /// No coordinate is further than this from the one that was pushed [m].
    pub(crate) precision: f64,
}

impl Run {
    /// Name of the run.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Frames recorded.
    pub fn frames(&self) -> usize {
        self.time.len()
    }

    /// Segments of each frame.
    pub fn segments(&self) -> usize {
        self.segments.length.len()
    }

    /// Time of each frame [s].
    pub fn time(&self) -> &[f64] {
        &self.time
    }

    /// No decoded coordinate is further than this from the one that was pushed [m]: half a step of the lattice in the
    /// box around all of the motion, and the rounding of single precision.
    pub fn position_precision(&self) -> f64 {
        self.lattice.precision
    }

    /// Its curves beside energy, length and iterations.
    pub fn curves(&self) -> &[Curve] {
        &self.curves
    }

    /// The range of a channel's values, and its scale.
    pub fn range(&self, channel: Channel) -> Range {
        self.ranges[channel as usize]
    }

    /// Unpacks the motion.
    ///
    /// # Errors
    /// What does not fit, for a run that was read from somewhere and that no [`crate::Recorder`] made.
    pub fn decode(&self) -> Result<Decoded, DecodeError> {
        self.validate()?;
        let segments = self.segments();
        let too_large = || DecodeError::new("time", "there are more frames than fit into memory");
        let count = self.frames().checked_mul(segments).ok_or_else(too_large)?;
        let bytes = 3 * self.lattice.bytes + ORIENTATION.0 * ORIENTATION.1 + Channel::ALL.len();
        let data = inflate(&self.data, count.checked_mul(bytes).ok_or_else(too_large)?)?;
        let mut rest = data.as_slice();
        let mut next = |bytes: usize| {
            let (planes, after) = rest.split_at(bytes * count);
            rest = after;
            track::read(planes, segments, bytes)
        };
        let positions: [Vec<u32>; 3] = std::array::from_fn(|_| next(self.lattice.bytes));
        let orientations: [Vec<u32>; 3] = std::array::from_fn(|_| next(ORIENTATION.1));
        let values: [Vec<u32>; 4] = std::array::from_fn(|_| next(1));
        let origin = Vector3::from(self.lattice.origin);
        let decoded =
            Decoded { segments, origin, step: self.lattice.step, positions, orientations, values, ranges: self.ranges };
        Ok(decoded)
    }

    fn validate(&self) -> Result<(), DecodeError> {
        let (frames, segments) = (self.frames(), self.segments());
        let count = |key, found: usize, expected: usize| {
            if found == expected {
                return Ok(());
            }
            Err(DecodeError::new(key, format!("{found} entries where there must be {expected}")))
        };
        count("energy", self.energy.len(), frames)?;
        count("length_ratio", self.length_ratio.len(), frames)?;
        count("iterations", self.iterations.len(), frames)?;
        count("segments.radius", self.segments.radius.len(), segments)?;
        count("segments.next", self.segments.next.len(), segments)?;
        if !self.segments.rod.is_empty() {
            count("segments.rod", self.segments.rod.len(), segments)?;
        }
        let all = |key, fine: bool, must: &str| if fine { Ok(()) } else { Err(DecodeError::new(key, must)) };
        let positive = |values: &[f64]| values.iter().all(|v| v.is_finite() && *v > 0.0);
        all("segments.length", positive(&self.segments.length), "all must be finite and > 0")?;
        all("segments.radius", positive(&self.segments.radius), "all must be finite and > 0")?;
        let inside = self.segments.next.iter().flatten().all(|&next| next < segments);
        all("segments.next", inside, "all must be segments or null")?;
        let ascending = self.time.iter().all(|t| t.is_finite()) && self.time.is_sorted();
        all("time", ascending, "all must be finite and ascending")?;
        let Lattice { origin, step, bytes, precision } = &self.lattice;
        let finite = origin.iter().chain([step, precision]).all(|x| x.is_finite());
        all("lattice", finite && *step >= 0.0 && *precision >= 0.0, "all must be finite, step and precision >= 0")?;
        all("lattice.bytes", matches!(bytes, 2 | 3), "it must be 2 or 3")?;
        self.obstacles.iter().try_for_each(Obstacle::validate)?;
        self.bodies.validate(segments)?;
        chapter::validate(&self.chapters, frames)?;
        self.curves.iter().try_for_each(|curve| curve.validate(frames))?;
        mark::validate(&self.grips, &self.loads, frames, segments)?;
        if let Some(contacts) = &self.contacts {
            contacts.validate(frames, segments, inflate)?;
        }
        self.obstacle_motions.iter().try_for_each(|moved| moved.validate(self.obstacles.len(), frames))?;
        self.ranges.iter().try_for_each(Range::validate)
    }
}

/// The tracks in a zlib stream in base64, `expected` bytes.
fn inflate(text: &str, expected: usize) -> Result<Vec<u8>, DecodeError> {
    let damaged = |reason: String| DecodeError::new("data", reason);
    let packed = STANDARD.decode(text).map_err(|error| damaged(format!("no base64: {error}")))?;
    let mut data = Vec::new();
    // One byte more than expected: the end of the stream, and with it the checksum, is read only beyond the last one.
    let read = ZlibDecoder::new(packed.as_slice()).take(expected as u64 + 1).read_to_end(&mut data);
    read.map_err(|error| damaged(format!("no zlib stream, or a damaged one: {error}")))?;
    if data.len() != expected {
        let found = if data.len() > expected { "more".to_owned() } else { data.len().to_string() };
        return Err(damaged(format!("{found} bytes, but {expected} belong to the frames and segments")));
    }
    Ok(data)
}

//! A motion unpacked.

use nalgebra::{UnitQuaternion, Vector3};

use crate::channel::{Channel, Range};
use crate::quaternion;

/// The motion of a run, as the page shows it.
#[derive(Clone, Debug, PartialEq)]
pub struct Decoded {
    pub(crate) segments: usize,
    pub(crate) origin: Vector3<f64>,
    pub(crate) step: f64,
    /// One track an axis, by frame and segment.
    pub(crate) positions: [Vec<u32>; 3],
    pub(crate) orientations: [Vec<u32>; 3],
    /// One track a channel.
    pub(crate) values: [Vec<u32>; 4],
    pub(crate) ranges: [Range; 4],
}

impl Decoded {
    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.positions[0].len().checked_div(self.segments).unwrap_or(0)
    }

    /// Number of segments.
    pub fn segments(&self) -> usize {
        self.segments
    }

    /// Centre of a segment [m], or `None` where there is no such frame or segment.
    pub fn position(&self, frame: usize, segment: usize) -> Option<Vector3<f64>> {
        let at = self.place(frame, segment)?;
        Some(self.origin + self.step * Vector3::from(self.positions.each_ref().map(|track| f64::from(track[at]))))
    }

    /// Orientation of a segment, or `None` where there is no such frame or segment.
    pub fn orientation(&self, frame: usize, segment: usize) -> Option<UnitQuaternion<f64>> {
        let at = self.place(frame, segment)?;
        Some(quaternion::unpack(self.orientations.each_ref().map(|track| track[at] as u16)))
    }

    /// Value of a channel at a segment, in the channel's unit; `None` where there is no such frame or segment, or where
    /// nothing is known.
    pub fn value(&self, channel: Channel, frame: usize, segment: usize) -> Option<f64> {
        let at = self.place(frame, segment)?;
        self.ranges[channel as usize].value(self.values[channel as usize][at] as u8)
    }

    fn place(&self, frame: usize, segment: usize) -> Option<usize> {
        (segment < self.segments && frame < self.frames()).then_some(frame * self.segments + segment)
    }
}

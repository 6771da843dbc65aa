//! The layout of `trajectory.safetensors`, shared by its writer and its reader.
//!
//! The format is that of safetensors: the header's length (u64), a JSON header, then the tensors one after the other,
//! all of them F64 and little endian. [`Checksum`] covers header and tensors; it stands in the header, and counts as
//! zeros there.

use std::collections::BTreeMap;
use std::io;

use safetensors::Dtype;
use safetensors::tensor::TensorInfo;
use serde::Serialize;

/// Name of the trajectory's file.
pub(crate) const FILE_NAME: &str = "trajectory.safetensors";

/// Bytes of a value.
pub(crate) const VALUE: usize = size_of::<f64>();

/// Names of the tensors in the order of the file, with the components that each has for a segment; `time` has one for a
/// frame.
const TENSORS: [(&str, Option<usize>); 5] = [
    ("time", None),
    ("positions", Some(3)),
    ("orientations", Some(4)),
    ("velocities", Some(3)),
    ("angular_velocities", Some(3)),
];

const UNITS: &str = "s, m, m/s, rad/s; orientations are quaternions x, y, z, w; vectors are in world axes";

const CHECKSUM_KEY: &str = "\"checksum\":\"";
const CHECKSUM_DIGITS: usize = 16;

/// What a trajectory says about itself beside its tensors.
#[derive(Clone, Debug, PartialEq)]
pub struct TrajectoryInfo {
    /// Name of the scene.
    pub scene: String,
    /// Time step of the simulation [s]; frames may be further apart.
    pub dt: f64,
}

/// Size of a trajectory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Layout {
    pub(crate) frames: usize,
    pub(crate) segments: usize,
}

impl Layout {
    /// Values that each tensor has for one frame, in the order of the file.
    pub(crate) fn widths(self) -> [usize; TENSORS.len()] {
        TENSORS.map(|(_, components)| components.map_or(1, |n| n * self.segments))
    }

    /// Bytes of one frame in all tensors.
    pub(crate) fn frame_bytes(self) -> usize {
        VALUE * self.widths().iter().sum::<usize>()
    }

    /// The tensors' entries in the header, or `None` if the trajectory is too large for the address space.
    pub(crate) fn tensors(self) -> Option<BTreeMap<&'static str, TensorInfo>> {
        let mut tensors = BTreeMap::new();
        let mut start = 0_usize;
        for (name, components) in TENSORS {
            let shape = match components {
                None => vec![self.frames],
                Some(n) => vec![self.frames, self.segments, n],
            };
            let end = shape.iter().try_fold(VALUE, |bytes, &n| bytes.checked_mul(n))?.checked_add(start)?;
            tensors.insert(name, TensorInfo { dtype: Dtype::F64, shape, data_offsets: (start, end) });
            start = end;
        }
        Some(tensors)
    }

    /// The header with its length in front and zeros for the checksum, and the place of the checksum's digits in it.
    pub(crate) fn header(self, info: &TrajectoryInfo) -> io::Result<(Vec<u8>, usize)> {
        #[derive(Serialize)]
        struct Header<'a> {
            __metadata__: BTreeMap<&'a str, String>,
            #[serde(flatten)]
            tensors: BTreeMap<&'a str, TensorInfo>,
        }
        let __metadata__ = BTreeMap::from([
            ("scene", info.scene.clone()),
            ("dt", format!("{:?}", info.dt)),
            ("units", UNITS.to_owned()),
            ("checksum", "0".repeat(CHECKSUM_DIGITS)),
        ]);
        let tensors = self.tensors().ok_or(io::ErrorKind::FileTooLarge)?;
        let mut json = serde_json::to_vec(&Header { __metadata__, tensors })?;
        json.resize(json.len().next_multiple_of(VALUE), b' ');
        let mut header = (json.len() as u64).to_le_bytes().to_vec();
        header.extend(json);
        let digits = checksum_digits(&header).ok_or(io::ErrorKind::InvalidData)?;
        Ok((header, digits.start))
    }
}

/// Place of the checksum's digits in the header. Quotes inside of a JSON string are escaped, so the key is found only
/// once.
pub(crate) fn checksum_digits(header: &[u8]) -> Option<std::ops::Range<usize>> {
    let key = CHECKSUM_KEY.as_bytes();
    let start = header.windows(key.len()).position(|w| w == key)? + key.len();
    (start + CHECKSUM_DIGITS <= header.len()).then_some(start..start + CHECKSUM_DIGITS)
}

/// A checksum against damage (not against forgery): FNV-1a on words of 64 bits, with a rotation that carries every bit
/// on. Each step is invertible, so one changed word always shows.
pub(crate) struct Checksum(u64);

impl Checksum {
    pub(crate) fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    /// Adds `bytes`, a multiple of eight.
    pub(crate) fn update(&mut self, bytes: &[u8]) {
        for &word in bytes.as_chunks::<VALUE>().0 {
            self.0 = (self.0 ^ u64::from_le_bytes(word)).wrapping_mul(0x0000_0100_0000_01b3).rotate_left(29);
        }
    }

    /// The digits that stand in the header.
    pub(crate) fn digits(&self) -> String {
        format!("{:0width$x}", self.0, width = CHECKSUM_DIGITS)
    }
}

//! The layout of `trajectory.safetensors`, shared by its writer and its reader.
//!
//! The format is that of safetensors: the header's length (u64), a JSON header, then the tensors one after the other,
//! all of them F64 and little endian. A BLAKE3 hash covers header and tensors; it stands in the header, and counts as
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

/// Name of the tensor that only a trajectory with what contacts give to segments has.
pub(crate) const CONTACT_LOADS: &str = "contact_loads";

/// Name of the tensor that only a trajectory with the forces of joints has.
pub(crate) const JOINT_FORCES: &str = "joint_forces";

const UNITS: &str = "s, m, m/s, rad/s; orientations are quaternions x, y, z, w; vectors are in world axes";
const UNITS_OF_FORCES: &str = "; joint_forces are forces [N], then moments [N m] in the frame of the joint's body a";

const UNITS_OF_CONTACTS: &str =
    "; contact_loads are forces [N], then moments about the segment's position [N m] in world axes";

/// Keys of [`Modes`].
pub(crate) const MODES_KEY: &str = "modes_hz";
pub(crate) const FRAMES_KEY: &str = "frames_a_mode";

/// Key of [`TrajectoryInfo::segments_hash`].
pub(crate) const SEGMENTS_KEY: &str = "segments_hash";
const CHECKSUM_KEY: &str = "\"checksum\":\"";
const CHECKSUM_DIGITS: usize = 2 * blake3::OUT_LEN;

/// What a trajectory says about itself beside its tensors.
#[derive(Clone, Debug, PartialEq)]
pub struct TrajectoryInfo {
    /// Name of the scene.
    pub scene: String,
    /// Time step of the simulation [s]; frames may be further apart.
    pub dt: f64,
    /// A hash of what the segments are, by which a run that begins with one of the frames knows them; `None` where the file
    /// has none.
    pub segments_hash: Option<String>,
}

/// The modes that a trajectory shows one after the other, after a first frame at rest.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Modes {
    /// Their frequencies [Hz]; none in the trajectory of a motion.
    pub(crate) frequencies: Vec<f64>,
    /// Frames in which each swings once.
    pub(crate) frames: usize,
}

impl Modes {
    /// The mode that a frame shows, counted among all that were written: its number and its frequency [Hz].
    pub(crate) fn at(&self, frame: usize) -> Option<(usize, f64)> {
        let mode = frame.checked_sub(1)?.checked_div(self.frames)?;
        Some((mode, *self.frequencies.get(mode)?))
    }
}

/// Size of a trajectory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Layout {
    pub(crate) frames: usize,
    pub(crate) segments: usize,
    /// Joints whose forces are kept; 0 leaves their tensor out.
    pub(crate) joints: usize,
    /// Whether what contacts give to segments is kept.
    pub(crate) contacts: bool,
}

impl Layout {
    /// Names of the tensors in the order of the file, with the sizes that each has in one frame.
    fn parts(self) -> impl Iterator<Item = (&'static str, Vec<usize>)> {
        let of_segments = |components| vec![self.segments, components];
        [
            ("time", vec![]),
            ("positions", of_segments(3)),
            ("orientations", of_segments(4)),
            ("velocities", of_segments(3)),
            ("angular_velocities", of_segments(3)),
            (JOINT_FORCES, vec![self.joints, 6]),
            (CONTACT_LOADS, of_segments(6)),
        ]
        .into_iter()
        .filter(move |&(name, _)| match name {
            JOINT_FORCES => self.joints > 0,
            CONTACT_LOADS => self.contacts,
            _ => true,
        })
    }

    /// Names of the tensors in the order of the file, with the bytes that each has for one frame.
    pub(crate) fn widths(self) -> impl Iterator<Item = (&'static str, usize)> {
        self.parts().map(|(name, sizes)| (name, VALUE * sizes.iter().product::<usize>()))
    }

    /// Bytes of one frame in all tensors.
    pub(crate) fn frame_bytes(self) -> usize {
        self.widths().map(|(_, bytes)| bytes).sum()
    }

    /// The tensors' entries in the header, or `None` if the trajectory is too large for the address space.
    pub(crate) fn tensors(self) -> Option<BTreeMap<&'static str, TensorInfo>> {
        let mut tensors = BTreeMap::new();
        let mut start = 0_usize;
        for (name, sizes) in self.parts() {
            let shape = [vec![self.frames], sizes].concat();
            let end = shape.iter().try_fold(VALUE, |bytes, &n| bytes.checked_mul(n))?.checked_add(start)?;
            tensors.insert(name, TensorInfo { dtype: Dtype::F64, shape, data_offsets: (start, end) });
            start = end;
        }
        Some(tensors)
    }

    /// The header with its length in front and zeros for the checksum, and the place of the checksum's digits in it.
    pub(crate) fn header(self, info: &TrajectoryInfo, modes: &Modes) -> io::Result<(Vec<u8>, usize)> {
        #[derive(Serialize)]
        struct Header<'a> {
            __metadata__: BTreeMap<&'a str, String>,
            #[serde(flatten)]
            tensors: BTreeMap<&'a str, TensorInfo>,
        }
        let with = |is: bool, text| if is { text } else { "" };
        let units = [UNITS, with(self.joints > 0, UNITS_OF_FORCES), with(self.contacts, UNITS_OF_CONTACTS)].concat();
        let mut __metadata__ = BTreeMap::from([
            ("scene", info.scene.clone()),
            ("dt", format!("{:?}", info.dt)),
            ("units", units),
            ("checksum", "0".repeat(CHECKSUM_DIGITS)),
        ]);
        __metadata__.extend(info.segments_hash.clone().map(|hash| (SEGMENTS_KEY, hash)));
        if !modes.frequencies.is_empty() {
            let list = modes.frequencies.iter().map(|frequency| format!("{frequency:?}")).collect::<Vec<_>>();
            __metadata__.extend([(MODES_KEY, list.join(" ")), (FRAMES_KEY, modes.frames.to_string())]);
        }
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

//! A shard's file in memory: names, types, shapes and sizes checked, so that reading cannot fail afterwards.

use std::ops::Range;
use std::path::{Path, PathBuf};

use cosserat::assembly::InnerDamping;
use cosserat::state::{Body, Freedom, Joint, Model, Pose, Segment, StrainMeasure};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use safetensors::SafeTensors;

use crate::DatasetError;
use crate::layout::{Counts, Name, TENSORS};
use crate::map::Map;

/// A shard, open for reading.
#[derive(Debug)]
pub(crate) struct Shard {
    pub(crate) file: PathBuf,
    map: Map,
    /// Place of each tensor's bytes in the file.
    tensors: Vec<Range<usize>>,
    /// Of every trajectory, what comes before it; and of all of them.
    pub(crate) starts: Vec<Counts>,
}

impl Shard {
    /// Opens a shard and checks that it is whole.
    pub(crate) fn open(file: &Path, blake3: &str) -> Result<Self, DatasetError> {
        let map = Map::open(file)?;
        let found = blake3::hash(map.bytes()).to_hex();
        if found.as_str() != blake3 {
            let allowed = format!("{blake3}, as when it was written: the file is damaged or another one");
            return Err(DatasetError::value(file, "blake3", found, allowed));
        }
        Self::from_map(file, map)
    }

    fn from_map(file: &Path, map: Map) -> Result<Self, DatasetError> {
        let damaged = |error: safetensors::SafeTensorError| {
            DatasetError::value(file, "header", error, "that of a safetensors file")
        };
        let bytes = map.bytes();
        let views = SafeTensors::deserialize(bytes).map_err(damaged)?;
        let mut tensors = Vec::with_capacity(TENSORS.len());
        let mut rows = Vec::with_capacity(TENSORS.len());
        for tensor in TENSORS {
            if tensor.is_optional() && !views.names().contains(&tensor.name) {
                tensors.push(0..0);
                rows.push(0);
                continue;
            }
            let missing = |_| DatasetError::value(file, tensor.name, "missing", "a tensor");
            let view = views.tensor(tensor.name).map_err(missing)?;
            let (found, allowed) = (view.dtype(), tensor.dtype);
            if found != allowed {
                let key = format!("{}.dtype", tensor.name);
                return Err(DatasetError::value(file, key, format!("{found:?}"), format!("{allowed:?}")));
            }
            match *view.shape() {
                [n, columns] if columns == tensor.columns => rows.push(n),
                _ => {
                    let (key, value) = (format!("{}.shape", tensor.name), format!("{:?}", view.shape()));
                    return Err(DatasetError::value(file, key, value, format!("[rows, {}]", tensor.columns)));
                }
            }
            // The views borrow from the map; their places in it do not.
            let start = view.data().as_ptr() as usize - bytes.as_ptr() as usize;
            tensors.push(start..start + view.data().len());
        }
        let mut shard = Self { file: file.to_owned(), map, tensors, starts: vec![Counts::default()] };
        shard.find_starts(rows[Name::Sizes as usize])?;
        let all = shard.counts();
        for (tensor, rows) in TENSORS.iter().zip(rows) {
            if rows != all.rows(tensor.per) && !(tensor.is_optional() && rows == 0) {
                let allowed = format!("{}, by trajectory.sizes", all.rows(tensor.per));
                return Err(DatasetError::value(file, format!("rows of {}", tensor.name), rows, allowed));
            }
        }
        Ok(shard)
    }

    fn find_starts(&mut self, trajectories: usize) -> Result<(), DatasetError> {
        for k in 0..trajectories {
            let row: Vec<u64> = self.u64s(Name::Sizes, k..k + 1).collect();
            let sizes: Vec<usize> = row.iter().filter_map(|&n| usize::try_from(n).ok()).collect();
            let next = <[usize; 4]>::try_from(sizes).ok().filter(|&[segments, ..]| segments > 0);
            let Some(next) = next.and_then(|sizes| self.starts[k].with(sizes)) else {
                let key = format!("trajectory.sizes[{k}]");
                let allowed = "segments (at least 1), anchors, joints, samples that fit into memory";
                return Err(DatasetError::value(&self.file, key, format!("{row:?}"), allowed));
            };
            self.starts.push(next);
        }
        Ok(())
    }

    /// Numbers of all that is in the shard.
    pub(crate) fn counts(&self) -> Counts {
        self.starts.last().copied().unwrap_or_default()
    }

    /// Bytes of the file.
    pub(crate) fn len(&self) -> usize {
        self.map.bytes().len()
    }

    /// Whether it has a tensor that shards may be without.
    pub(crate) fn has(&self, name: Name) -> bool {
        !self.tensors[name as usize].is_empty()
    }

    fn rows<const BYTES: usize>(&self, name: Name, rows: Range<usize>) -> &[[u8; BYTES]] {
        let columns = name.tensor().columns;
        let bytes = &self.map.bytes()[self.tensors[name as usize].clone()];
        &bytes.as_chunks::<BYTES>().0[rows.start * columns..rows.end * columns]
    }

    pub(crate) fn f64s(&self, name: Name, rows: Range<usize>) -> impl Iterator<Item = f64> + '_ {
        self.rows::<8>(name, rows).iter().map(|&bytes| f64::from_le_bytes(bytes))
    }

    pub(crate) fn u64s(&self, name: Name, rows: Range<usize>) -> impl Iterator<Item = u64> + '_ {
        self.rows::<8>(name, rows).iter().map(|&bytes| u64::from_le_bytes(bytes))
    }

    pub(crate) fn u32s(&self, name: Name, rows: Range<usize>) -> impl Iterator<Item = u32> + '_ {
        self.rows::<4>(name, rows).iter().map(|&bytes| u32::from_le_bytes(bytes))
    }

    /// `N` numbers of every row.
    pub(crate) fn arrays<const N: usize>(&self, name: Name, rows: Range<usize>) -> impl Iterator<Item = [f64; N]> + '_ {
        self.rows::<8>(name, rows).as_chunks::<N>().0.iter().map(|row| row.map(f64::from_le_bytes))
    }

    /// `N` numbers of every row of single precision.
    pub(crate) fn singles<const N: usize>(
        &self,
        name: Name,
        rows: Range<usize>,
    ) -> impl Iterator<Item = [f32; N]> + '_ {
        self.rows::<4>(name, rows).as_chunks::<N>().0.iter().map(|row| row.map(f32::from_le_bytes))
    }

    /// The model of trajectory `k`, with numbers as they stand there.
    pub(crate) fn model(&self, k: usize) -> Result<Model, DatasetError> {
        let (from, to) = (self.starts[k], self.starts[k + 1]);
        let segment = |([length, radius, density, added_mass], flags): ([f64; 4], &[u32])| Segment {
            length,
            radius,
            density,
            line_inertia: None,
            added_mass,
            fixed: flags[0] != 0,
            rod: flags[1] as usize,
            body: None,
        };
        let flags: Vec<u32> = self.u32s(Name::SegmentFlags, from.segments..to.segments).collect();
        let constants = self.arrays(Name::Segments, from.segments..to.segments);
        let segments: Vec<Segment> = constants.zip(flags.chunks_exact(2)).map(segment).collect();
        let anchor = |[x, y, z, i, j, k, w]: [f64; 7]| Pose {
            position: Vector3::new(x, y, z),
            orientation: UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k)),
        };
        let anchors: Vec<Pose> = self.arrays(Name::Anchors, from.anchors..to.anchors).map(anchor).collect();
        let bodies: Vec<u32> = self.u32s(Name::JointBodies, from.joints..to.joints).collect();
        let mut joints = Vec::with_capacity(to.joints - from.joints);
        let constants = self.arrays::<12>(Name::Joints, from.joints..to.joints);
        for (j, (constants, ends)) in constants.zip(bodies.chunks_exact(2)).enumerate() {
            let body = |i: u32| match (i as usize).checked_sub(segments.len()) {
                None => Ok(Body::Segment(i as usize)),
                Some(anchor) if anchor < anchors.len() => Ok(Body::Anchor(anchor)),
                Some(_) => {
                    let key = format!("joint.bodies[{}]", from.joints + j);
                    let allowed = format!("below {}", segments.len() + anchors.len());
                    Err(DatasetError::value(&self.file, key, i, allowed))
                }
            };
            let [offset_a, offset_b, length, x, y, z, stretch, shear, bend, twist, youngs, torsion] = constants;
            joints.push(Joint {
                a: body(ends[0])?,
                b: body(ends[1])?,
                offset_a,
                offset_b,
                length,
                rest_darboux: Vector3::new(x, y, z),
                rest_frames: [UnitQuaternion::identity(); 2],
                stretch_compliance: stretch,
                shear_compliance: shear,
                shear_extra: 0.0,
                bend_compliance: bend,
                bend_extra: 0.0,
                twist_compliance: twist,
                inner_damping: InnerDamping::NONE,
                youngs_modulus: youngs,
                torsion_modulus: torsion,
                mount: None,
                freedom: Freedom::None,
            });
        }
        let gravity = self.arrays::<3>(Name::Gravity, k..k + 1).next().map(Vector3::from).unwrap_or_default();
        let strain_measure = StrainMeasure::Sine;
        Ok(Model { segments, joints, strain_measure, anchors, gravity, ..Model::default() })
    }
}

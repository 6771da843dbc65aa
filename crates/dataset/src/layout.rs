//! The tensors of a shard, shared by its writer and its reader. The crate's description says what they hold.

use safetensors::Dtype;

/// What a tensor has one row for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Per {
    Trajectory,
    Segment,
    Anchor,
    Joint,
    Sample,
    /// A segment of a sample.
    SampleSegment,
    /// A joint of a sample.
    SampleJoint,
}

/// A tensor by name; the order is that of [`TENSORS`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub(crate) enum Name {
    Index,
    Sizes,
    Planar,
    Gravity,
    Segments,
    SegmentFlags,
    Anchors,
    Joints,
    JointBodies,
    Places,
    Dt,
    Poses,
    Lambda,
    Rhs,
    Dlambda,
    Dp,
    Inertia,
}

/// Name, type, columns, and what there is a row for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tensor {
    pub(crate) name: &'static str,
    pub(crate) dtype: Dtype,
    pub(crate) columns: usize,
    pub(crate) per: Per,
}

const fn tensor(name: &'static str, dtype: Dtype, columns: usize, per: Per) -> Tensor {
    Tensor { name, dtype, columns, per }
}

/// All tensors.
pub(crate) const TENSORS: [Tensor; 17] = [
    tensor("trajectory.index", Dtype::U64, 1, Per::Trajectory),
    tensor("trajectory.sizes", Dtype::U64, 4, Per::Trajectory),
    tensor("trajectory.planar", Dtype::U32, 1, Per::Trajectory),
    tensor("trajectory.gravity", Dtype::F64, 3, Per::Trajectory),
    tensor("segment.constants", Dtype::F64, 4, Per::Segment),
    tensor("segment.flags", Dtype::U32, 2, Per::Segment),
    tensor("anchor.poses", Dtype::F64, 7, Per::Anchor),
    tensor("joint.constants", Dtype::F64, 12, Per::Joint),
    tensor("joint.bodies", Dtype::U32, 2, Per::Joint),
    tensor("sample.place", Dtype::U32, 2, Per::Sample),
    tensor("sample.dt", Dtype::F64, 1, Per::Sample),
    tensor("sample.poses", Dtype::F64, 7, Per::SampleSegment),
    tensor("sample.lambda", Dtype::F64, 6, Per::SampleJoint),
    tensor("sample.rhs", Dtype::F32, 6, Per::SampleJoint),
    tensor("sample.dlambda", Dtype::F32, 6, Per::SampleJoint),
    tensor("sample.dp", Dtype::F32, 6, Per::SampleSegment),
    tensor("sample.inertia", Dtype::F64, 2, Per::SampleSegment),
];

impl Tensor {
    /// Whether shards may be without it.
    pub(crate) fn is_optional(self) -> bool {
        self.name == Name::Inertia.tensor().name
    }
}

impl Name {
    pub(crate) fn tensor(self) -> Tensor {
        TENSORS[self as usize]
    }
}

/// Numbers of a shard, or of what comes before a trajectory in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Counts {
    pub(crate) trajectories: usize,
    pub(crate) segments: usize,
    pub(crate) anchors: usize,
    pub(crate) joints: usize,
    pub(crate) samples: usize,
    pub(crate) sample_segments: usize,
    pub(crate) sample_joints: usize,
}

impl Counts {
    /// Rows of a tensor.
    pub(crate) fn rows(&self, per: Per) -> usize {
        match per {
            Per::Trajectory => self.trajectories,
            Per::Segment => self.segments,
            Per::Anchor => self.anchors,
            Per::Joint => self.joints,
            Per::Sample => self.samples,
            Per::SampleSegment => self.sample_segments,
            Per::SampleJoint => self.sample_joints,
        }
    }

    /// With one more trajectory of these sizes (segments, anchors, joints, samples); `None` where it does not fit into
    /// memory.
    pub(crate) fn with(self, [segments, anchors, joints, samples]: [usize; 4]) -> Option<Self> {
        Some(Self {
            trajectories: self.trajectories.checked_add(1)?,
            segments: self.segments.checked_add(segments)?,
            anchors: self.anchors.checked_add(anchors)?,
            joints: self.joints.checked_add(joints)?,
            samples: self.samples.checked_add(samples)?,
            sample_segments: self.sample_segments.checked_add(samples.checked_mul(segments)?)?,
            sample_joints: self.sample_joints.checked_add(samples.checked_mul(joints)?)?,
        })
    }
}

//! Recorded trajectories to the bytes of a shard.

use cosserat::state::Body;
use export::Tensor;

use crate::layout::{Counts, Name, TENSORS};
use crate::record::Record;

/// The shard's tensors in the making.
struct Columns(Vec<Tensor>);

impl Columns {
    fn f64s(&mut self, name: Name, values: impl IntoIterator<Item = f64>) {
        self.0[name as usize].bytes.extend(values.into_iter().flat_map(f64::to_le_bytes));
    }
    fn f32s(&mut self, name: Name, values: impl IntoIterator<Item = f32>) {
        self.0[name as usize].bytes.extend(values.into_iter().flat_map(f32::to_le_bytes));
    }
    fn u64s(&mut self, name: Name, values: impl IntoIterator<Item = u64>) {
        self.0[name as usize].bytes.extend(values.into_iter().flat_map(u64::to_le_bytes));
    }
    fn u32s(&mut self, name: Name, values: impl IntoIterator<Item = u32>) {
        self.0[name as usize].bytes.extend(values.into_iter().flat_map(u32::to_le_bytes));
    }
}

/// Numbers of the trajectories in a shard.
pub(crate) fn counts(records: &[Record]) -> Counts {
    let add = |counts: Counts, record: &Record| counts.with(sizes(record)).unwrap_or(counts);
    records.iter().fold(Counts::default(), add)
}

fn sizes(record: &Record) -> [usize; 4] {
    let model = &record.model;
    [model.segments.len(), model.anchors.len(), model.joints.len(), record.samples.dt.len()]
}

/// The shard's bytes.
pub(crate) fn shard(records: &[Record]) -> Result<Vec<u8>, safetensors::SafeTensorError> {
    let column = |tensor: &crate::layout::Tensor| Tensor { dtype: tensor.dtype, shape: vec![], bytes: vec![] };
    let mut columns = Columns(TENSORS.iter().map(column).collect());
    for record in records {
        add_constants(&mut columns, record);
        let samples = &record.samples;
        columns.u32s(Name::Places, samples.places.iter().flatten().copied());
        columns.f64s(Name::Dt, samples.dt.iter().copied());
        columns.f64s(Name::Poses, samples.poses.iter().flatten().copied());
        columns.f64s(Name::Lambda, samples.lambda.iter().flatten().copied());
        columns.f32s(Name::Rhs, samples.rhs.iter().flatten().copied());
        columns.f32s(Name::Dlambda, samples.dlambda.iter().flatten().copied());
        columns.f32s(Name::Dp, samples.dp.iter().flatten().copied());
        columns.f64s(Name::Inertia, samples.inertia.iter().flatten().copied());
    }
    let counts = counts(records);
    for (column, tensor) in columns.0.iter_mut().zip(TENSORS) {
        column.shape = vec![counts.rows(tensor.per), tensor.columns];
    }
    // No metadata: it would be written in random order.
    let named = TENSORS.iter().zip(&columns.0);
    let there = named.filter(|(tensor, column)| !(tensor.is_optional() && column.bytes.is_empty()));
    safetensors::serialize(there.map(|(tensor, column)| (tensor.name, column)), None)
}

fn add_constants(columns: &mut Columns, record: &Record) {
    let model = &record.model;
    columns.u64s(Name::Index, [record.index]);
    columns.u64s(Name::Sizes, sizes(record).map(|n| n as u64));
    columns.u32s(Name::Planar, [record.planar.map_or(0, |normal| normal.axis() as u32 + 1)]);
    columns.f64s(Name::Gravity, model.gravity.iter().copied());
    for segment in &model.segments {
        columns.f64s(Name::Segments, [segment.length, segment.radius, segment.density, segment.added_mass]);
        columns.u32s(Name::SegmentFlags, [u32::from(segment.fixed), segment.rod as u32]);
    }
    for anchor in &model.anchors {
        let q = anchor.orientation.coords;
        columns.f64s(Name::Anchors, anchor.position.iter().chain(q.iter()).copied());
    }
    for joint in &model.joints {
        columns.f64s(Name::Joints, [joint.offset_a, joint.offset_b, joint.length]);
        columns.f64s(Name::Joints, joint.rest_darboux.iter().copied());
        columns.f64s(Name::Joints, [joint.stretch_compliance, joint.shear_compliance]);
        columns.f64s(Name::Joints, [joint.bend_compliance, joint.twist_compliance]);
        columns.f64s(Name::Joints, [joint.youngs_modulus, joint.torsion_modulus]);
        let body = |body: Body| match body {
            Body::Segment(i) => i as u32,
            Body::Anchor(i) => (model.segments.len() + i) as u32,
        };
        columns.u32s(Name::JointBodies, [body(joint.a), body(joint.b)]);
    }
}

//! The JSON part of a glTF file: nodes, skins, meshes, animation, and where their numbers are in the binary part.

use rod::State;
use serde::Serialize;
use serde_json::{Value, json};

use super::tube::Tube;

/// Component types and targets of buffers (sections 5.1.3 and 5.11.5).
const U16: u16 = 5123;
const U32: u16 = 5125;
const F32: u16 = 5126;
const VERTICES: Option<u16> = Some(34962);
const INDICES: Option<u16> = Some(34963);
/// The root comes first, then the meshes, then the segments.
const ROOT: usize = 0;
const FIRST_MESH: usize = 1;
/// The quarter turn about x that takes z up to y up.
const Z_UP_TO_Y_UP: [f32; 4] = [-std::f32::consts::FRAC_1_SQRT_2, 0.0, 0.0, std::f32::consts::FRAC_1_SQRT_2];

/// The whole document.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Document {
    asset: Value,
    scene: usize,
    scenes: Value,
    nodes: Vec<Node>,
    meshes: Value,
    materials: Value,
    skins: Value,
    animations: [Animation; 1],
    buffers: [Buffer; 1],
    buffer_views: Vec<BufferView>,
    accessors: Vec<Accessor>,
}

#[derive(Default, Serialize)]
struct Node {
    name: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    translation: Option<[f32; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    rotation: Option<[f32; 4]>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    children: Vec<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    mesh: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    skin: Option<usize>,
}

#[derive(Default, Serialize)]
struct Animation {
    name: String,
    channels: Vec<Channel>,
    samplers: Vec<Sampler>,
}

#[derive(Serialize)]
struct Channel {
    sampler: usize,
    target: Target,
}

#[derive(Serialize)]
struct Target {
    node: usize,
    path: &'static str,
}

#[derive(Serialize)]
struct Sampler {
    input: usize,
    output: usize,
}

#[derive(Default, Serialize)]
#[serde(rename_all = "camelCase")]
struct Buffer {
    byte_length: usize,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct BufferView {
    buffer: usize,
    byte_offset: usize,
    byte_length: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    target: Option<u16>,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Accessor {
    buffer_view: usize,
    component_type: u16,
    count: usize,
    #[serde(rename = "type")]
    kind: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    min: Option<Vec<f32>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    max: Option<Vec<f32>>,
}

impl Document {
    /// The document of a scene: its tubes, its first state and its times [s]. The binary part holds, in this order, the
    /// arrays of each tube as [`Tube::write`] has them, the inverse bind matrices of each, the times, and for each segment
    /// its translations and its rotations.
    pub(super) fn new(scene: &str, tubes: &[Tube], first: &State, times: &[f32]) -> Self {
        let (segments, frames) = (first.positions.len(), times.len());
        let first_segment = FIRST_MESH + tubes.len();
        let roots: Vec<usize> = (ROOT..first_segment).collect();
        let mut document = Self {
            asset: json!({ "version": "2.0", "generator": env!("CARGO_PKG_NAME") }),
            scene: 0,
            scenes: json!([{ "name": scene, "nodes": roots }]),
            nodes: nodes(first, tubes.len()),
            meshes: Value::Null,
            materials: json!([{
                "name": "rod",
                "pbrMetallicRoughness":
                    { "baseColorFactor": [0.8, 0.45, 0.25, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.6 },
            }]),
            skins: Value::Null,
            animations: [Animation { name: scene.to_owned(), ..Animation::default() }],
            buffers: [Buffer::default()],
            buffer_views: Vec::new(),
            accessors: Vec::new(),
        };
        document.meshes = tubes.iter().map(|tube| document.mesh(tube)).collect();
        let mut skin = |tube: &Tube| {
            let inverse_bind = document.array(tube.segments.len(), F32, "MAT4", 64, None);
            let bones: Vec<usize> = tube.segments.iter().map(|segment| first_segment + segment).collect();
            json!({ "inverseBindMatrices": inverse_bind, "skeleton": ROOT, "joints": bones })
        };
        document.skins = tubes.iter().map(&mut skin).collect();

        let input = document.array(frames, F32, "SCALAR", 4, None);
        document.bound(input, &times.iter().map(|&time| [time]).collect::<Vec<_>>());
        for node in first_segment..first_segment + segments {
            for (path, kind, bytes) in [("translation", "VEC3", 12), ("rotation", "VEC4", 16)] {
                let output = document.array(frames, F32, kind, bytes, None);
                let [animation] = &mut document.animations;
                animation.channels.push(Channel { sampler: animation.samplers.len(), target: Target { node, path } });
                animation.samplers.push(Sampler { input, output });
            }
        }
        document
    }

    /// The mesh of a tube, whose arrays are appended.
    fn mesh(&mut self, tube: &Tube) -> Value {
        let vertices = tube.positions.len();
        let indices = self.array(tube.indices.len(), U32, "SCALAR", 4, INDICES);
        let positions = self.array(vertices, F32, "VEC3", 12, VERTICES);
        self.bound(positions, &tube.positions);
        let normals = self.array(vertices, F32, "VEC3", 12, VERTICES);
        let joints = self.array(vertices, U16, "VEC4", 8, VERTICES);
        let weights = self.array(vertices, F32, "VEC4", 16, VERTICES);
        let attributes = json!({ "POSITION": positions, "NORMAL": normals, "JOINTS_0": joints, "WEIGHTS_0": weights });
        json!({
            "name": "rods",
            "primitives": [{ "attributes": attributes, "indices": indices, "material": 0 }],
        })
    }

    /// Bytes of the binary part, a multiple of four.
    pub(super) fn bytes(&self) -> usize {
        self.buffers[0].byte_length
    }

    /// Appends an array of `count` elements of `bytes` bytes to the binary part and returns its accessor.
    fn array(
        &mut self,
        count: usize,
        component_type: u16,
        kind: &'static str,
        bytes: usize,
        target: Option<u16>,
    ) -> usize {
        let [Buffer { byte_length: end }] = &mut self.buffers;
        let view = BufferView { buffer: 0, byte_offset: *end, byte_length: count * bytes, target };
        *end += view.byte_length;
        let buffer_view = self.buffer_views.len();
        self.buffer_views.push(view);
        self.accessors.push(Accessor { buffer_view, component_type, count, kind, min: None, max: None });
        self.accessors.len() - 1
    }

    /// Tells the range of the values of an accessor.
    fn bound<const N: usize>(&mut self, accessor: usize, values: &[[f32; N]]) {
        let fold = |start: f32, pick: fn(f32, f32) -> f32| {
            Some((0..N).map(|c| values.iter().fold(start, |found, value| pick(found, value[c]))).collect())
        };
        self.accessors[accessor].min = fold(f32::INFINITY, f32::min);
        self.accessors[accessor].max = fold(f32::NEG_INFINITY, f32::max);
    }
}

/// Root, meshes and segments. A mesh is no child of the root: a skin's joints alone say where its vertices are (section
/// 3.7.3.3).
fn nodes(first: &State, meshes: usize) -> Vec<Node> {
    let segments = first.positions.len();
    let first_segment = FIRST_MESH + meshes;
    let children = (first_segment..first_segment + segments).collect();
    let root = Node { name: "root".to_owned(), rotation: Some(Z_UP_TO_Y_UP), children, ..Node::default() };
    let mesh = |i: usize| Node { name: "rods".to_owned(), mesh: Some(i), skin: Some(i), ..Node::default() };
    let segment = |i: usize| Node {
        name: format!("segment {i}"),
        translation: Some(first.positions[i].map(|x| x as f32).into()),
        rotation: Some(first.orientations[i].coords.map(|x| x as f32).into()),
        ..Node::default()
    };
    std::iter::once(root).chain((0..meshes).map(mesh)).chain((0..segments).map(segment)).collect()
}

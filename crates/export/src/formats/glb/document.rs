//! The JSON part of a glTF file: nodes, skins, meshes, animation, and where their numbers are in the binary part.

use std::ops::Range;

use nalgebra::{UnitQuaternion, Vector3};
use rod::{Mesh, Model, State};
use serde::Serialize;
use serde_json::{Value, json};

use super::super::frame::Frame;
use super::super::solids::{OBSTACLE, Owner, ROD, Solid};
use super::tube::Tube;
use crate::Names;

/// Component types and targets of buffers (sections 5.1.3 and 5.11.5).
const U16: u16 = 5123;
const U32: u16 = 5125;
const F32: u16 = 5126;
const VERTICES: Option<u16> = Some(34962);
const INDICES: Option<u16> = Some(34963);
/// The root comes first, then the tubes, then the nodes of rods, then the segments, then the obstacles.
const ROOT: usize = 0;
const FIRST_TUBE: usize = 1;
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
    #[serde(skip_serializing_if = "Vec::is_empty")]
    meshes: Vec<Value>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    materials: Vec<Value>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    skins: Vec<Value>,
    animations: Vec<Animation>,
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
    #[serde(skip_serializing_if = "Option::is_none")]
    byte_offset: Option<usize>,
    component_type: u16,
    count: usize,
    #[serde(rename = "type")]
    kind: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    min: Option<Vec<f32>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    max: Option<Vec<f32>>,
}

/// A part of the frames that is an animation.
pub(super) struct Clip {
    pub(super) name: String,
    pub(super) frames: Range<usize>,
}

impl Document {
    /// The document of a scene: its names, its tubes and solids, its first frame and the times of all frames [s]. The binary part
    /// holds, in this order, the arrays of each tube as [`Tube::write`] has them, the inverse bind matrices of each, the
    /// times, for each segment its translations and its rotations, and for each solid the indices, places and normals of
    /// its mesh, and of an obstacle that moves its translations and its rotations.
    pub(super) fn new(
        scene: &str,
        model: &Model,
        names: &Names,
        tubes: &[Tube],
        solids: &[Solid],
        first: &Frame,
        (times, clips): (&[f32], &[Clip]),
    ) -> Self {
        let segments = first.state.positions.len();
        let mut rods: Vec<usize> = tubes.iter().map(|tube| tube.rod).collect();
        rods.dedup();
        let first_rod = FIRST_TUBE + tubes.len();
        let first_segment = first_rod + rods.len();
        // A tube is no child of the root: a skin's joints alone say where its vertices are (section 3.7.3.3).
        let roots: Vec<usize> = (ROOT..first_rod).collect();
        let mut document = Self {
            asset: json!({ "version": "2.0", "generator": env!("CARGO_PKG_NAME") }),
            scene: 0,
            scenes: json!([{ "name": scene, "nodes": roots }]),
            nodes: nodes(&first.state, names, tubes, &rods),
            meshes: Vec::new(),
            materials: Vec::new(),
            skins: Vec::new(),
            animations: clips
                .iter()
                .map(|clip| Animation { name: clip.name.clone(), ..Animation::default() })
                .collect(),
            buffers: [Buffer::default()],
            buffer_views: Vec::new(),
            accessors: Vec::new(),
        };
        for tube in tubes {
            let material = match document.materials.len() {
                known if tube.part > 0 => known - 1,
                _ => document.material(&names.rod(tube.rod), ROD),
            };
            document.add_tube(tube, &name_of(tube, names), material);
        }
        for tube in tubes {
            let inverse_bind = document.array(tube.segments.len(), F32, "MAT4", 64, None);
            let bones: Vec<usize> = tube.segments.iter().map(|segment| first_segment + segment).collect();
            let bones_of = first_rod + rods.binary_search(&tube.rod).unwrap_or_default();
            document
                .skins
                .push(json!({ "name": name_of(tube, names), "inverseBindMatrices": inverse_bind, "skeleton": bones_of, "joints": bones }));
        }

        let view = document.view(4 * times.len(), None);
        let mut tracks = Vec::with_capacity(clips.len());
        for Clip { frames, .. } in clips {
            let own = timing(times, frames);
            let input = document.accessor(view, 4 * own.start, own.len(), (F32, "SCALAR"));
            document.bound(input, &times[own].iter().map(|&time| [time]).collect::<Vec<_>>());
            tracks.push((input, frames.clone()));
        }
        let tracks = tracks.as_slice();
        (first_segment..first_segment + segments).for_each(|node| document.animate(node, times.len(), tracks));
        for solid in solids {
            let name = solid.name(model, names);
            let (node, colour) = match solid.of {
                Owner::Segment(i) => (first_segment + i, ROD),
                Owner::Obstacle(_) => {
                    let at = solid.of.at(model, first).pose;
                    document.nodes.push(placed(name.to_string(), &at.position, &at.orientation));
                    (document.nodes.len() - 1, OBSTACLE)
                }
            };
            document.nodes[node].mesh = Some(document.meshes.len());
            let material = document.material(&name, colour);
            document.add_mesh(&name, &solid.mesh, material);
            if solid.moving(model).is_some() {
                document.animate(node, times.len(), tracks);
            }
        }
        // Segments of rods are below the node of their rod, rigid bodies and obstacles below the root.
        let mut below_root: Vec<usize> = (first_rod..first_segment).collect();
        for (i, segment) in model.segments.iter().enumerate() {
            match rods.binary_search(&segment.rod) {
                Ok(k) if segment.body.is_none() => document.nodes[first_rod + k].children.push(first_segment + i),
                _ => below_root.push(first_segment + i),
            }
        }
        below_root.extend(first_segment + segments..document.nodes.len());
        document.nodes[ROOT].children = below_root;
        document
    }

    /// Appends a material and returns its index.
    fn material(&mut self, name: &str, [r, g, b]: [f64; 3]) -> usize {
        self.materials.push(json!({
            "name": name,
            "pbrMetallicRoughness": { "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.6 },
        }));
        self.materials.len() - 1
    }

    /// Appends the mesh of a tube and its arrays.
    fn add_tube(&mut self, tube: &Tube, name: &str, material: usize) {
        let vertices = tube.positions.len();
        let indices = self.array(tube.indices.len(), U32, "SCALAR", 4, INDICES);
        let positions = self.array(vertices, F32, "VEC3", 12, VERTICES);
        self.bound(positions, &tube.positions);
        let normals = self.array(vertices, F32, "VEC3", 12, VERTICES);
        let joints = self.array(vertices, U16, "VEC4", 8, VERTICES);
        let weights = self.array(vertices, F32, "VEC4", 16, VERTICES);
        let attributes = json!({ "POSITION": positions, "NORMAL": normals, "JOINTS_0": joints, "WEIGHTS_0": weights });
        let primitive = json!({ "attributes": attributes, "indices": indices, "material": material });
        self.meshes.push(json!({ "name": name, "primitives": [primitive] }));
    }

    /// Appends a mesh without a skin and its arrays.
    fn add_mesh(&mut self, name: &str, mesh: &Mesh, material: usize) {
        let vertices: Vec<[f32; 3]> = mesh.positions.iter().map(|x| x.map(|x| x as f32).into()).collect();
        let indices = self.array(3 * mesh.triangles.len(), U32, "SCALAR", 4, INDICES);
        let positions = self.array(vertices.len(), F32, "VEC3", 12, VERTICES);
        self.bound(positions, &vertices);
        let normals = self.array(vertices.len(), F32, "VEC3", 12, VERTICES);
        let attributes = json!({ "POSITION": positions, "NORMAL": normals });
        let primitive = json!({ "attributes": attributes, "indices": indices, "material": material });
        self.meshes.push(json!({ "name": name, "primitives": [primitive] }));
    }

    /// Appends translations and rotations of a node in so many frames; of each animation `tracks` has the accessor of its times
    /// and its frames.
    fn animate(&mut self, node: usize, frames: usize, tracks: &[(usize, Range<usize>)]) {
        for (path, kind, bytes) in [("translation", "VEC3", 12), ("rotation", "VEC4", 16)] {
            let view = self.view(frames * bytes, None);
            for (k, (input, own)) in tracks.iter().enumerate() {
                let output = self.accessor(view, own.start * bytes, own.len(), (F32, kind));
                let animation = &mut self.animations[k];
                animation.channels.push(Channel { sampler: animation.samplers.len(), target: Target { node, path } });
                animation.samplers.push(Sampler { input: *input, output });
            }
        }
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
        let view = self.view(count * bytes, target);
        self.accessor(view, 0, count, (component_type, kind))
    }

    /// Appends so many bytes to the binary part and returns their view.
    fn view(&mut self, byte_length: usize, target: Option<u16>) -> usize {
        let [Buffer { byte_length: end }] = &mut self.buffers;
        let view = BufferView { buffer: 0, byte_offset: *end, byte_length, target };
        *end += byte_length;
        self.buffer_views.push(view);
        self.buffer_views.len() - 1
    }

    /// Appends the accessor of `count` elements of a view from a byte on.
    fn accessor(
        &mut self,
        buffer_view: usize,
        from: usize,
        count: usize,
        (component_type, kind): (u16, &'static str),
    ) -> usize {
        let byte_offset = (from > 0).then_some(from);
        self.accessors.push(Accessor { buffer_view, byte_offset, component_type, count, kind, min: None, max: None });
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

/// Which times an animation of these frames has: the first ones, so that it begins at once, where they are as far apart as its own.
fn timing(times: &[f32], frames: &Range<usize>) -> Range<usize> {
    let apart = |from: usize, k: usize| times[from + k] - times[from];
    let is_alike = |k: usize| (apart(frames.start, k) - apart(0, k)).abs() <= 1e-4 * apart(0, k);
    if (1..frames.len()).all(is_alike) { 0..frames.len() } else { frames.clone() }
}

/// Name of a tube: that of its rod, with the number of the part from the second one on.
fn name_of(tube: &Tube, names: &Names) -> String {
    let name = names.rod(tube.rod);
    if tube.part > 0 { format!("{name} part {}", tube.part + 1) } else { name.into_owned() }
}

/// Root, tubes, what the bones of each rod stand below, and segments; which are children of which is not known yet.
fn nodes(first: &State, names: &Names, tubes: &[Tube], rods: &[usize]) -> Vec<Node> {
    let root = Node { name: "root".to_owned(), rotation: Some(Z_UP_TO_Y_UP), ..Node::default() };
    let tube = |(i, tube): (usize, &Tube)| Node {
        name: name_of(tube, names),
        mesh: Some(i),
        skin: Some(i),
        ..Node::default()
    };
    let rod = |&rod: &usize| Node { name: format!("{} bones", names.rod(rod)), ..Node::default() };
    let segment = |i: usize| placed(names.segment(i), &first.positions[i], &first.orientations[i]);
    let segments = (0..first.positions.len()).map(segment);
    let tubes = tubes.iter().enumerate().map(tube);
    std::iter::once(root).chain(tubes).chain(rods.iter().map(rod)).chain(segments).collect()
}

fn placed(name: String, position: &Vector3<f64>, orientation: &UnitQuaternion<f64>) -> Node {
    Node {
        name,
        translation: Some(position.map(|x| x as f32).into()),
        rotation: Some(orientation.coords.map(|x| x as f32).into()),
        ..Node::default()
    }
}

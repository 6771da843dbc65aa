//! GLB by the crate gltf, which validates it.

use std::fs;

use export::{Format, Names};
use gltf::Gltf;
use gltf::animation::util::ReadOutputs;
use nalgebra::{Isometry3, Matrix4, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};

use super::runs::{Run, runs, straight};

/// What f32 may be off, relative to coordinates of some metres.
const ROUNDING: f64 = 2e-6;

const IDENTITY: [[f32; 4]; 4] =
    [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];

/// A file's content.
struct Content {
    /// Keyframes of each segment: time [s], pose.
    tracks: Vec<Vec<(f32, Isometry3<f64>)>>,
    /// Of each segment.
    inverse_bind: Vec<Matrix4<f64>>,
    root: Isometry3<f64>,
    positions: Vec<Vector3<f64>>,
    normals: Vec<Vector3<f64>>,
    /// The segments that a vertex moves with.
    bones: Vec<Vec<(usize, f64)>>,
    triangles: Vec<[usize; 3]>,
}

fn pose(translation: [f32; 3], [x, y, z, w]: [f32; 4]) -> Isometry3<f64> {
    // Not normalised: an interpolation that takes the long way must show.
    let q = Quaternion::new(w, x, y, z).cast::<f64>();
    assert!((q.norm() - 1.0).abs() < 1e-6);
    let translation = Vector3::from(translation).cast();
    Isometry3::from_parts(Translation3::from(translation), UnitQuaternion::new_unchecked(q))
}

fn read(bytes: &[u8]) -> Content {
    let Gltf { document, blob } = Gltf::from_slice(bytes).expect("a valid file");
    let blob = blob.unwrap();
    let blob = blob.as_slice();
    let data = move |_: gltf::Buffer| Some(blob);

    let root = document.nodes().find(|node| node.name() == Some("root")).unwrap();
    let (translation, rotation, scale) = root.transform().decomposed();
    assert_eq!(scale, [1.0; 3]);
    // Segments are one node after the other, in their order.
    let joints: Vec<usize> = document.skins().flat_map(|skin| skin.joints().map(|joint| joint.index())).collect();
    let first_segment = *joints.iter().min().unwrap();
    assert!(joints.iter().copied().eq(first_segment..first_segment + joints.len()), "each in one skin: {joints:?}");
    let mut inverse_bind = Vec::new();
    for skin in document.skins() {
        let matrices = skin.reader(data).read_inverse_bind_matrices().unwrap();
        inverse_bind.extend(matrices.map(|m| Matrix4::from(m).cast()));
        let skeleton = skin.skeleton().unwrap();
        assert!(skeleton.children().map(|child| child.index()).eq(skin.joints().map(|joint| joint.index())));
        assert_eq!(skeleton.transform().decomposed(), gltf::scene::Transform::Matrix { matrix: IDENTITY }.decomposed());
        assert!(root.children().any(|child| child.index() == skeleton.index()));
    }

    let animation = document.animations().next().unwrap();
    let mut inputs = Vec::new();
    let mut translations = vec![Vec::new(); document.nodes().count()];
    let mut rotations = translations.iter().map(|_| Vec::new()).collect::<Vec<Vec<[f32; 4]>>>();
    for channel in animation.channels() {
        assert_eq!(channel.sampler().interpolation(), gltf::animation::Interpolation::Linear);
        inputs.push(channel.sampler().input().index());
        let node = channel.target().node().index();
        match channel.reader(data).read_outputs().unwrap() {
            ReadOutputs::Translations(values) => translations[node] = values.collect(),
            ReadOutputs::Rotations(values) => rotations[node] = values.into_f32().collect(),
            _ => panic!("neither translations nor rotations"),
        }
    }
    inputs.dedup();
    assert_eq!(inputs.len(), 1, "all share their times");
    let times: Vec<f32> = animation.channels().next().unwrap().reader(data).read_inputs().unwrap().collect();
    let track = |&node: &usize| {
        let (translations, rotations): (&Vec<[f32; 3]>, _) = (&translations[node], &rotations[node]);
        assert_eq!((translations.len(), rotations.len()), (times.len(), times.len()));
        let poses = translations.iter().zip(rotations).map(|(&x, &q)| pose(x, q));
        times.iter().copied().zip(poses).collect()
    };

    let mut content = Content {
        tracks: joints.iter().map(track).collect(),
        inverse_bind,
        root: pose(translation, rotation),
        positions: Vec::new(),
        normals: Vec::new(),
        bones: Vec::new(),
        triangles: Vec::new(),
    };
    let mesh_nodes: Vec<_> = document.nodes().filter(|node| node.mesh().is_some()).collect();
    assert_eq!(mesh_nodes.len(), document.skins().count());
    for (mesh_node, skin) in mesh_nodes.iter().zip(document.skins()) {
        assert!(document.default_scene().unwrap().nodes().any(|node| node.index() == mesh_node.index()));
        assert_eq!(mesh_node.skin().unwrap().index(), skin.index());
        assert_eq!((mesh_node.name(), mesh_node.mesh().unwrap().name()), (skin.name(), skin.name()));
        let primitive = mesh_node.mesh().unwrap().primitives().next().unwrap();
        assert_eq!(primitive.material().name(), skin.name());
        let own: Vec<usize> = skin.joints().map(|joint| joint.index() - first_segment).collect();
        content.add(&primitive.reader(data), &primitive.bounding_box(), &own);
    }
    content
}

impl Content {
    /// Adds a mesh whose skin has these segments.
    fn add<'a, 's, F: Clone + Fn(gltf::Buffer<'a>) -> Option<&'s [u8]>>(
        &mut self,
        reader: &gltf::mesh::Reader<'a, 's, F>,
        bounds: &gltf::mesh::BoundingBox,
        segments: &[usize],
    ) {
        let vectors = |values: &mut dyn Iterator<Item = [f32; 3]>| -> Vec<Vector3<f64>> {
            values.map(|v| Vector3::from(v).cast()).collect()
        };
        let weights = reader.read_weights(0).unwrap().into_f32();
        let bone = |(joints, weights): ([u16; 4], [f32; 4])| {
            let used = joints.into_iter().zip(weights).filter(|bone| bone.1 != 0.0);
            used.map(|(joint, weight)| (segments[usize::from(joint)], weight.into())).collect()
        };
        let first = self.positions.len();
        let indices: Vec<usize> = reader.read_indices().unwrap().into_u32().map(|i| first + i as usize).collect();
        let positions = vectors(&mut reader.read_positions().unwrap());
        for c in 0..3 {
            let extreme = |pick: fn(f64, f64) -> f64| positions.iter().map(|p| p[c]).reduce(pick).unwrap();
            assert_eq!((extreme(f64::min), extreme(f64::max)), (bounds.min[c].into(), bounds.max[c].into()));
        }
        self.positions.extend(positions);
        self.normals.extend(vectors(&mut reader.read_normals().unwrap()));
        self.bones.extend(reader.read_joints(0).unwrap().into_u16().zip(weights).map(bone));
        self.triangles.extend(indices.as_chunks().0);
    }
}

fn export(run: &Run) -> Content {
    let directory = tempfile::tempdir().unwrap();
    let made = run.export(Format::Glb, directory.path());
    assert_eq!(made, [directory.path().join("run.glb")]);
    read(&fs::read(&made[0]).unwrap())
}

/// glTF's y is up.
fn y_up(v: Vector3<f64>) -> Vector3<f64> {
    Vector3::new(v.x, v.z, -v.y)
}

#[test]
fn the_animation_is_the_motion() {
    for run in runs() {
        let content = export(&run);
        let segments = run.model.segments.len();
        assert_eq!((content.tracks.len(), content.inverse_bind.len()), (segments, segments));
        for (i, track) in content.tracks.iter().enumerate() {
            assert_eq!(track.len(), run.times.len());
            for (frame, (time, pose)) in track.iter().enumerate() {
                let what = format!("{}, segment {i}, frame {frame}", run.name);
                assert_eq!(*time, run.times[frame] as f32);
                let (state, world) = (&run.states[frame], content.root * pose);
                let off = world.translation.vector - y_up(state.positions[i]);
                assert!(off.norm() < ROUNDING, "{what}: {off}");
                for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
                    let off = world * axis - y_up(state.orientations[i] * axis);
                    assert!(off.norm() < ROUNDING, "{what}: {off}");
                }
            }
            for pair in track.windows(2) {
                let dot = pair[0].1.rotation.coords.dot(&pair[1].1.rotation.coords);
                assert!(dot >= 0.0, "{}, segment {i}: the long way", run.name);
            }
        }
    }
}

#[test]
fn the_skin_is_at_rest_in_the_first_frame_and_follows_the_segments() {
    for run in runs() {
        let content = export(&run);
        for (vertex, bones) in content.bones.iter().enumerate() {
            assert_eq!(bones.iter().map(|(_, weight)| weight).sum::<f64>(), 1.0);
            assert!(bones.iter().all(|&(joint, _)| joint < run.model.segments.len()));
            for frame in 0..run.times.len() {
                let rest = content.positions[vertex];
                let skinned = |&(joint, weight): &(usize, f64)| {
                    let pose = content.root * content.tracks[joint][frame].1;
                    let matrix = pose.to_homogeneous() * content.inverse_bind[joint];
                    matrix.transform_point(&Point3::from(rest)).coords * weight
                };
                let found: Vector3<f64> = bones.iter().map(skinned).sum();
                let moved = |&(joint, weight): &(usize, f64)| {
                    let (first, now) = (&run.states[0], &run.states[frame]);
                    let local = first.orientations[joint].inverse() * (rest - first.positions[joint]);
                    (now.positions[joint] + now.orientations[joint] * local) * weight
                };
                let expected = y_up(bones.iter().map(moved).sum());
                assert!((found - expected).norm() < 2.0 * ROUNDING, "{}, vertex {vertex}, frame {frame}", run.name);
                assert!(frame > 0 || (found - y_up(rest)).norm() < 2.0 * ROUNDING);
            }
        }
    }
}

#[test]
fn vertices_are_a_radius_from_the_nodes_and_half_a_neighbours() {
    for run in runs() {
        let content = export(&run);
        let first = &run.states[0];
        let nodes: Vec<_> = (0..run.joints.len()).map(|node| run.node(first, node)).collect();
        // The segments that meet at each node, from the polylines.
        let mut meeting = vec![Vec::new(); nodes.len()];
        for (segment, pair) in run.lines.iter().flat_map(|line| line.windows(2)).enumerate() {
            pair.iter().for_each(|&node| meeting[node].push(segment));
        }
        let mut vertices = vec![0; nodes.len()];
        for (vertex, bones) in content.bones.iter().enumerate() {
            let mut joints: Vec<usize> = bones.iter().map(|&(joint, _)| joint).collect();
            joints.sort_unstable();
            assert!(bones.iter().all(|&(_, weight)| weight == 1.0 / bones.len() as f64));
            let distance = |node: usize| ((content.positions[vertex] - nodes[node].0).norm() - nodes[node].1).abs();
            let candidates = (0..nodes.len()).filter(|&node| {
                let mut segments = meeting[node].clone();
                segments.sort_unstable();
                segments == joints
            });
            let node = candidates.min_by(|&a, &b| distance(a).total_cmp(&distance(b))).unwrap();
            assert!(distance(node) < ROUNDING, "{}, vertex {vertex}, node {node}", run.name);
            vertices[node] += 1;
        }
        // Rounded ends have two rings more.
        let expected = meeting.iter().map(|segments| if segments.len() == 1 { 24 } else { 8 });
        assert!(vertices.iter().copied().eq(expected), "{}: {vertices:?}", run.name);
    }
}

#[test]
fn triangles_face_outwards() {
    for run in runs().into_iter().filter(|run| run.name != "hairpin") {
        let content = export(&run);
        for triangle in &content.triangles {
            let [a, b, c] = triangle.map(|i| content.positions[i]);
            let normal = (b - a).cross(&(c - a));
            assert!(normal.norm() > 0.0, "{}: {triangle:?}", run.name);
            let outwards: Vector3<f64> = triangle.iter().map(|&i| content.normals[i]).sum();
            assert!(normal.dot(&outwards) > 0.0, "{}: {triangle:?}", run.name);
        }
        assert!(content.normals.iter().all(|normal| (normal.norm() - 1.0).abs() < 1e-6));
    }
}

#[test]
fn a_straight_tube_has_the_volume_of_its_prism_and_ends() {
    let run = straight(1);
    let content = export(&run);
    let origin = run.states[0].positions[0];
    let volume = |triangle: &[usize; 3]| {
        let [a, b, c] = triangle.map(|i| content.positions[i] - origin);
        a.dot(&b.cross(&c)) / 6.0
    };
    let found: f64 = content.triangles.iter().map(volume).sum();
    // Octagons: a prism, and for each end a frustum up to latitude 45 degrees and a pyramid on it.
    let (radius, length) = (0.1_f64, 2.0);
    let area = |r: f64| 8.0_f64.sqrt() * r * r;
    let half = 0.5_f64.sqrt() * radius;
    let frustum = half / 3.0 * (area(radius) + area(half) + (area(radius) * area(half)).sqrt());
    let pyramid = (radius - half) / 3.0 * area(half);
    let expected = area(radius) * length + 2.0 * (frustum + pyramid);
    assert!((found / expected - 1.0).abs() < 1e-5, "{found} {expected}");
}

/// One node, one mesh, one skin and one material a rod, which have its name; bones have it, too, with their number in the rod.
#[test]
fn everything_has_the_name_of_its_rod() {
    let mut run = runs().into_iter().find(|run| run.name == "tree").unwrap();
    let rods = ["trunk", "branch \u{2603}", "\"ring\""].map(str::to_owned);
    run.called = Names::new(&run.model, &rods, &[]);
    let directory = tempfile::tempdir().unwrap();
    let made = run.export(Format::Glb, directory.path());
    let Gltf { document, .. } = Gltf::from_slice(&fs::read(&made[0]).unwrap()).expect("a valid file");
    let names = ["trunk", "branch \u{2603}", "\"ring\"", "rod-3"];
    assert!(document.meshes().map(|mesh| mesh.name().unwrap().to_owned()).eq(names));
    assert!(document.skins().map(|skin| skin.name().unwrap().to_owned()).eq(names));
    assert!(document.materials().map(|material| material.name().unwrap().to_owned()).eq(names));
    let nodes: Vec<_> = document.nodes().map(|node| node.name().unwrap().to_owned()).collect();
    let bones = |name: &str, count: usize| (0..count).map(|k| format!("{name} segment {k}")).collect::<Vec<_>>();
    let expected = [
        vec!["root".to_owned()],
        names.map(str::to_owned).to_vec(),
        names.map(|name| format!("{name} bones")).to_vec(),
        names.into_iter().zip([3, 2, 3, 1]).flat_map(|(name, count)| bones(name, count)).collect(),
    ];
    assert_eq!(nodes, expected.concat());
}

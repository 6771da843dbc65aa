//! Rigid bodies are drawn as what they are.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use export::Format;
use nalgebra::Vector3;
use rod::{BodyShape, Obstacle, ObstacleShape, SolidMesh, Surface};
use serde_json::Value;
use vtkio::model::{Attribute, DataSet, Piece, PolyDataPiece, VertexNumbers, Vtk};

use super::runs::{Run, weighted};

/// Which of a run's bodies a place is on the surface of: 0 the ball, 1 the box.
fn on_surface(run: &Run, frame: usize, place: &Vector3<f64>) -> Option<usize> {
    let state = &run.states[frame];
    let ball = ((place - state.positions[0]).norm() - 0.25).abs() < 1e-12;
    let corner = (state.orientations[1].inverse() * (place - state.positions[1])).abs();
    let block = (corner - Vector3::new(0.1, 0.2, 0.3)).norm() < 1e-12;
    if ball { Some(0) } else { block.then_some(1) }
}

#[test]
fn an_obj_has_their_faces_as_objects() {
    let run = weighted(3);
    let directory = tempfile::tempdir().unwrap();
    let made = run.export(Format::Obj, directory.path());
    for frame in 0..3 {
        let text = fs::read_to_string(made[0].join(format!("frame_{frame:04}.obj"))).unwrap();
        let objects: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("o ")).collect();
        assert_eq!(objects, ["rod-3", "body-0", "body-1"]);
        let numbers = |line: &str| line.split(' ').skip(1).map(|word| word.parse::<f64>().unwrap()).collect::<Vec<_>>();
        let places: Vec<_> = text.lines().filter(|line| line.starts_with("v ")).map(numbers).collect();
        let mut of = None;
        let mut faces = [0, 0];
        for line in text.lines() {
            of = line.strip_prefix("o body-").map(|rod| rod.parse::<usize>().unwrap()).or(of);
            if line.starts_with("f ") {
                for vertex in numbers(line) {
                    let place = Vector3::from_row_slice(&places[vertex as usize - 1]);
                    assert_eq!(on_surface(&run, frame, &place), of, "frame {frame}, {line}");
                }
                faces[of.unwrap()] += 1;
            }
        }
        let mesh = |i: usize| run.model.segments[i].body.as_ref().unwrap().shape.mesh().triangles.len();
        assert_eq!(faces, [mesh(0), mesh(1)]);
        assert_eq!(faces[1], 12);
    }
}

/// All programs draw a mesh as they draw the shape that it is of.
#[test]
fn a_mesh_is_drawn_as_its_shape() {
    for format in [Format::Obj, Format::Glb, Format::Vtp] {
        let mut run = weighted(2);
        let [of_box, of_mesh] = [false, true].map(|as_mesh| {
            if as_mesh && let Some(body) = &mut run.model.segments[1].body {
                body.shape = BodyShape::Mesh(Arc::new(SolidMesh::full(body.shape.mesh()).unwrap()));
            }
            let directory = tempfile::tempdir().unwrap();
            let made = run.export(format, directory.path());
            let is_folder = made[0].is_dir();
            let mut files: Vec<_> = match is_folder {
                true => fs::read_dir(&made[0]).unwrap().map(|entry| entry.unwrap().path()).collect(),
                false => vec![made[0].clone()],
            };
            files.sort();
            files.iter().map(|file| fs::read(file).unwrap()).collect::<Vec<_>>()
        });
        assert!(of_box == of_mesh, "{format}");
    }
}

/// What a file of ParaView's holds.
pub(super) fn poly_data(path: &Path) -> PolyDataPiece {
    let DataSet::PolyData { mut pieces, .. } = Vtk::import(path).unwrap().data else { panic!("no poly data") };
    let (Some(Piece::Inline(piece)), []) = (pieces.pop(), pieces.as_slice()) else { panic!("not one piece") };
    *piece
}

fn numbers(attributes: &[Attribute], name: &str) -> Vec<f64> {
    let found = attributes.iter().find_map(|attribute| match attribute {
        Attribute::DataArray(array) if array.name == name => array.data.clone().cast_into(),
        _ => None,
    });
    found.unwrap()
}

#[test]
fn a_vtp_has_their_triangles_with_the_data_of_their_segments() {
    let run = weighted(2);
    let directory = tempfile::tempdir().unwrap();
    run.export(Format::Vtp, directory.path());
    for frame in 0..2 {
        let piece = poly_data(&directory.path().join(format!("vtp/frame_{frame:04}.vtp")));
        let Some(VertexNumbers::XML { connectivity, offsets }) = &piece.polys else { panic!("no triangles") };
        let points: Vec<f64> = piece.points.clone().into_vec().unwrap();
        let (segments, speeds) = (numbers(&piece.data.cell, "Segment"), numbers(&piece.data.cell, "Velocity"));
        let cells = run.model.segments.len();
        assert_eq!(segments.len(), cells + offsets.len());
        assert_eq!(numbers(&piece.data.point, "Radius").len(), points.len() / 3);
        for (triangle, corners) in connectivity.chunks(3).enumerate() {
            assert_eq!(offsets[triangle], 3 * (triangle as u64 + 1));
            let segment = segments[cells + triangle] as usize;
            for &corner in corners {
                let place = Vector3::from_row_slice(&points[3 * corner as usize..3 * corner as usize + 3]);
                assert_eq!(on_surface(&run, frame, &place), Some(segment));
            }
            let speed = &speeds[3 * (cells + triangle)..3 * (cells + triangle) + 3];
            assert_eq!(speed, run.states[frame].velocities[segment].as_slice());
        }
    }
}

/// The JSON part of a run's glTF file.
fn document(run: &Run, directory: &Path) -> Value {
    let made = run.export(Format::Glb, directory);
    let bytes = fs::read(&made[0]).unwrap();
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    serde_json::from_slice(&bytes[20..20 + length]).unwrap()
}

/// Names of the nodes of a glTF file that have a mesh, each with the mesh's name.
fn drawn(document: &Value) -> Vec<[&str; 2]> {
    let nodes = document["nodes"].as_array().unwrap().iter();
    nodes
        .filter_map(|node| {
            let mesh = &document["meshes"][node["mesh"].as_u64()? as usize];
            Some([node["name"].as_str()?, mesh["name"].as_str()?])
        })
        .collect()
}

#[test]
fn a_glb_has_a_mesh_for_each_on_the_node_of_its_segment() {
    let run = weighted(2);
    let directory = tempfile::tempdir().unwrap();
    let document = document(&run, directory.path());
    assert_eq!(drawn(&document), [["rod-3", "rod-3"], ["body-0", "body-0"], ["body-1", "body-1"]]);
    assert_eq!(document["skins"].as_array().unwrap().len(), 1, "the rod alone bends");
    for (mesh, segment) in [(1, 0), (2, 1)] {
        let accessor = document["meshes"][mesh]["primitives"][0]["attributes"]["POSITION"].as_u64().unwrap() as usize;
        let bound = |key: &str, axis: usize| document["accessors"][accessor][key][axis].as_f64().unwrap();
        let half = match run.model.segments[segment].body.as_ref().unwrap().shape {
            BodyShape::Box { sides } => sides * 0.5,
            _ => Vector3::repeat(0.25),
        };
        for axis in 0..3 {
            assert!((bound("max", axis) - half[axis]).abs() < 1e-6);
            assert!((bound("min", axis) + half[axis]).abs() < 1e-6);
        }
    }
}

#[test]
fn a_glb_of_hidden_bodies_alone_is_valid() {
    let mut run = weighted(2);
    let hidden = run.model.segments[2].body.clone();
    run.model.segments.iter_mut().for_each(|segment| segment.body.clone_from(&hidden));
    let directory = tempfile::tempdir().unwrap();
    let made = run.export(Format::Glb, directory.path());
    let read = gltf::Gltf::from_slice(&fs::read(&made[0]).unwrap()).expect("a valid file");
    assert_eq!((read.meshes().count(), read.skins().count()), (0, 0));
    assert!(!document(&run, directory.path()).as_object().unwrap().contains_key("meshes"), "no empty list");
}

#[test]
fn bodies_and_obstacles_are_told_apart() {
    let mut run = weighted(2);
    let (centre, radius) = (Vector3::new(0.0, 0.0, -3.0), 0.5);
    run.model.contacts.obstacles.push(Obstacle::new(ObstacleShape::Sphere { centre, radius }, Surface::default()));
    let directory = tempfile::tempdir().unwrap();
    let made = run.export(Format::Obj, directory.path());
    let text = fs::read_to_string(made[0].join("frame_0001.obj")).unwrap();
    let objects: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("o ")).collect();
    assert_eq!(objects, ["rod-3", "body-0", "body-1", "obstacle-0"]);

    let document = document(&run, directory.path());
    let expected = [["rod-3", "rod-3"], ["body-0", "body-0"], ["body-1", "body-1"], ["obstacle-0", "obstacle-0"]];
    assert_eq!(drawn(&document), expected);

    run.export(Format::Vtp, directory.path());
    let mut triangles = [0; 3];
    for (file, cells) in [("vtp/frame_0001.vtp", run.model.segments.len()), ("obstacles.vtp", 0)] {
        let piece = poly_data(&directory.path().join(file));
        let Some(VertexNumbers::XML { connectivity, .. }) = &piece.polys else { panic!("no triangles") };
        let points: Vec<f64> = piece.points.clone().into_vec().unwrap();
        let [segments, rods, obstacles] = ["Segment", "Rod", "Obstacle"].map(|name| numbers(&piece.data.cell, name));
        for (triangle, corners) in connectivity.chunks(3).enumerate() {
            let cell = cells + triangle;
            for &corner in corners {
                let place = Vector3::from_row_slice(&points[3 * corner as usize..3 * corner as usize + 3]);
                let of_body = on_surface(&run, 1, &place).map_or(-1.0, |i| i as f64);
                let of_obstacle = if ((place - centre).norm() - radius).abs() < 1e-12 { 0.0 } else { -1.0 };
                assert_eq!([segments[cell], obstacles[cell]], [of_body, of_obstacle]);
            }
            let rod = if segments[cell] < 0.0 { -1.0 } else { run.model.segments[segments[cell] as usize].rod as f64 };
            assert_eq!(rods[cell], rod);
            triangles[if segments[cell] < 0.0 { 2 } else { segments[cell] as usize }] += 1;
        }
        assert!(obstacles[..cells].iter().all(|&k| k == -1.0));
    }
    assert!(triangles.iter().all(|&count| count > 0), "{triangles:?}");
}

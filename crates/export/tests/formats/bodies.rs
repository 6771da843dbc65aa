//! Rigid bodies are drawn as what they are.

use std::fs;

use export::Format;
use nalgebra::Vector3;
use rod::BodyShape;
use vtkio::model::{Attribute, DataSet, Piece, VertexNumbers, Vtk};

use crate::runs::{Run, weighted};

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
        assert_eq!(objects, ["rod_3", "body_0", "body_1"]);
        let numbers = |line: &str| line.split(' ').skip(1).map(|word| word.parse::<f64>().unwrap()).collect::<Vec<_>>();
        let places: Vec<_> = text.lines().filter(|line| line.starts_with("v ")).map(numbers).collect();
        let mut of = None;
        let mut faces = [0, 0];
        for line in text.lines() {
            of = line.strip_prefix("o body_").map(|rod| rod.parse::<usize>().unwrap()).or(of);
            if line.starts_with("f ") {
                for vertex in numbers(line) {
                    let place = Vector3::from_row_slice(&places[vertex as usize - 1]);
                    assert_eq!(on_surface(&run, frame, &place), of, "frame {frame}, {line}");
                }
                faces[of.unwrap()] += 1;
            }
        }
        let mesh = |i: usize| run.model.segments[i].body.unwrap().shape.mesh().triangles.len();
        assert_eq!(faces, [mesh(0), mesh(1)]);
        assert_eq!(faces[1], 12);
    }
}

#[test]
fn a_vtp_has_their_triangles_with_the_data_of_their_segments() {
    let run = weighted(2);
    let directory = tempfile::tempdir().unwrap();
    run.export(Format::Vtp, directory.path());
    for frame in 0..2 {
        let path = directory.path().join(format!("vtp/frame_{frame:04}.vtp"));
        let DataSet::PolyData { pieces, .. } = Vtk::import(path).unwrap().data else { panic!("no poly data") };
        let [Piece::Inline(piece)] = pieces.as_slice() else { panic!("{} pieces", pieces.len()) };
        let Some(VertexNumbers::XML { connectivity, offsets }) = &piece.polys else { panic!("no triangles") };
        let points: Vec<f64> = piece.points.clone().into_vec().unwrap();
        let numbers = |attributes: &[Attribute], name: &str| -> Vec<f64> {
            let found = attributes.iter().find_map(|attribute| match attribute {
                Attribute::DataArray(array) if array.name == name => array.data.clone().cast_into(),
                _ => None,
            });
            found.unwrap()
        };
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

#[test]
fn a_glb_has_a_mesh_for_each_that_moves_with_its_segment() {
    let run = weighted(2);
    let directory = tempfile::tempdir().unwrap();
    let made = run.export(Format::Glb, directory.path());
    let bytes = fs::read(&made[0]).unwrap();
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let document: serde_json::Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
    let meshes = document["meshes"].as_array().unwrap();
    assert_eq!(meshes.len(), 3, "the rod, the ball and the box");
    let first_segment = 1 + meshes.len() as u64;
    for (mesh, segment) in [(1, 0), (2, 1)] {
        assert_eq!(document["skins"][mesh]["joints"], serde_json::json!([first_segment + segment]));
        let accessor = meshes[mesh]["primitives"][0]["attributes"]["POSITION"].as_u64().unwrap() as usize;
        let bound = |key: &str, axis: usize| document["accessors"][accessor][key][axis].as_f64().unwrap();
        let position = run.states[0].positions[segment as usize];
        let half = match run.model.segments[segment as usize].body.unwrap().shape {
            BodyShape::Box { sides } => sides * 0.5,
            _ => Vector3::repeat(0.25),
        };
        for axis in 0..3 {
            assert!((bound("max", axis) - position[axis] - half[axis]).abs() < 1e-6);
            assert!((bound("min", axis) - position[axis] + half[axis]).abs() < 1e-6);
        }
    }
}

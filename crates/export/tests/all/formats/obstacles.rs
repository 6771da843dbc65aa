//! Obstacles in every format: their surfaces are where their motions have them in each frame.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use export::Format;
use gltf::Gltf;
use gltf::animation::util::ReadOutputs;
use nalgebra::{Quaternion, Unit, UnitQuaternion, Vector3};
use rod::{Carried, Motion, Obstacle, ObstacleShape, Pose, Surface};
use vtkio::model::{Attribute, VertexNumbers};

use super::bodies::poly_data;
use super::runs::{Run, straight};

/// A rod among a plane, a sphere, a capsule and a box that move, and a sphere and a cylinder that do not.
pub(super) fn among_obstacles() -> Run {
    let mut run = straight(4);
    let shapes = [
        ObstacleShape::HalfSpace {
            point: Vector3::new(0.0, 0.0, -1.0),
            normal: Unit::new_normalize(Vector3::new(0.1, 0.2, 1.0)),
        },
        ObstacleShape::Sphere { centre: Vector3::new(1.0, 2.0, 0.5), radius: 0.4 },
        ObstacleShape::Capsule { start: Vector3::new(-1.0, 0.0, 0.0), end: Vector3::new(-1.0, 1.5, 0.3), radius: 0.2 },
        ObstacleShape::Box {
            pose: Pose {
                position: Vector3::new(2.0, -1.0, 0.2),
                orientation: UnitQuaternion::new(Vector3::new(0.3, -1.0, 0.5)),
            },
            sides: Vector3::new(0.2, 0.5, 0.3),
        },
        ObstacleShape::Sphere { centre: Vector3::new(-2.0, 2.0, 0.5), radius: 0.3 },
        ObstacleShape::Cylinder { start: Vector3::new(3.0, 0.0, 0.0), end: Vector3::new(3.0, 1.5, 0.3), radius: 0.2 },
    ];
    run.model.contacts.obstacles = shapes.map(|shape| Obstacle::new(shape, Surface::default())).into();
    for (k, obstacle) in run.model.contacts.obstacles.iter_mut().take(4).enumerate() {
        let (pose, k) = (obstacle.at(0.0).pose, k as f64);
        let (v, w) = (Vector3::new(1.0, k, -0.5), Vector3::new(2.0 * k, -1.0, 3.0));
        let way = Motion::at_velocities(&pose, &[(0.0, v, w)]).unwrap();
        obstacle.motion = Some(Carried::new(Arc::new(way)));
    }
    run
}

/// How far a place is from the surface of an obstacle at a time [m].
pub(super) fn off(obstacle: &Obstacle, time: f64, place: &Vector3<f64>) -> f64 {
    match obstacle.shape_at(time) {
        ObstacleShape::HalfSpace { point, normal } => normal.dot(&(place - point)).abs(),
        ObstacleShape::Box { pose, sides } => {
            let own = pose.orientation.inverse() * (place - pose.position);
            (own.abs() - sides * 0.5).max().abs()
        }
        ObstacleShape::Cylinder { start, end, radius } => {
            let (from, axis) = (place - 0.5 * (start + end), (end - start).normalize());
            let along = from.dot(&axis);
            (along.abs() - 0.5 * (end - start).norm()).max((from - axis * along).norm() - radius).abs()
        }
        shape => {
            let ([start, end], radius) = shape.capsule().unwrap();
            let axis = end - start;
            let along = ((place - start).dot(&axis) / axis.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            ((place - start - axis * along).norm() - radius).abs()
        }
    }
}

/// Checks the surfaces of all obstacles in a frame: triangles of places, one list an obstacle.
fn check(run: &Run, frame: usize, surfaces: &[Vec<[Vector3<f64>; 3]>], tolerance: f64) {
    assert_eq!(surfaces.len(), run.model.contacts.obstacles.len());
    for (k, (obstacle, triangles)) in run.model.contacts.obstacles.iter().zip(surfaces).enumerate() {
        assert!(!triangles.is_empty(), "obstacle {k}");
        for place in triangles.iter().flatten() {
            let off = off(obstacle, run.times[frame], place);
            assert!(off < tolerance, "frame {frame}, obstacle {k}: {off} m off");
        }
        if let ObstacleShape::HalfSpace { normal, .. } = obstacle.shape_at(run.times[frame]) {
            for [a, b, c] in triangles {
                assert!((b - a).cross(&(c - a)).dot(&normal) > 0.0, "it faces inwards");
            }
        }
    }
}

#[test]
fn lines_files_hold_their_meshes() {
    let run = among_obstacles();
    let directory = tempfile::tempdir().unwrap();
    run.export(Format::Obj, directory.path());
    for frame in 0..run.times.len() {
        let text = fs::read_to_string(directory.path().join(format!("obj/frame_{frame:04}.obj"))).unwrap();
        let (mut vertices, mut surfaces) = (Vec::new(), Vec::new());
        for line in text.lines() {
            let (element, rest) = line.split_once(' ').unwrap();
            match element {
                "v" => {
                    let words: Vec<f64> = rest.split(' ').map(|word| word.parse().unwrap()).collect();
                    vertices.push(Vector3::from_column_slice(&words));
                }
                "o" if rest.starts_with("obstacle-") => surfaces.push(Vec::new()),
                "f" => {
                    let corners: Vec<usize> = rest.split(' ').map(|word| word.parse::<usize>().unwrap() - 1).collect();
                    surfaces.last_mut().unwrap().push([0, 1, 2].map(|k| vertices[corners[k]]));
                }
                _ => {}
            }
        }
        check(&run, frame, &surfaces, 1e-12);
    }
}

/// Adds the triangles of a file of ParaView's to the surfaces of the obstacles that they are of.
fn add_triangles(path: &Path, segments: usize, surfaces: &mut [Vec<[Vector3<f64>; 3]>]) {
    let piece = poly_data(path);
    let Some(VertexNumbers::XML { connectivity, offsets }) = piece.polys.clone() else { panic!("no triangles") };
    let points: Vec<f64> = piece.points.clone().into_vec().unwrap();
    let place = |i: &u64| Vector3::from_column_slice(&points[3 * *i as usize..][..3]);
    let array = |name: &str| {
        let of = |attribute: &Attribute| match attribute {
            Attribute::DataArray(array) if array.name == name => array.data.clone().cast_into::<f64>(),
            _ => None,
        };
        piece.data.cell.iter().find_map(of).unwrap()
    };
    let (obstacle, rod) = (array("Obstacle"), array("Rod"));
    assert_eq!(obstacle.len(), segments + offsets.len());
    assert!(obstacle[..segments].iter().all(|&k| k == -1.0) && rod[segments..].iter().all(|&k| k == -1.0));
    for (k, corners) in connectivity.chunks(3).enumerate() {
        assert_eq!(offsets[k], 3 * (k as u64 + 1));
        let [a, b, c] = corners else { panic!("{corners:?}") };
        surfaces[obstacle[segments + k] as usize].push([a, b, c].map(place));
    }
}

#[test]
fn paraviews_files_hold_their_triangles() {
    let run = among_obstacles();
    let directory = tempfile::tempdir().unwrap();
    let made = run.export(Format::Vtp, directory.path());
    assert_eq!(made, ["vtp", "run.pvd", "obstacles.vtp"].map(|name| directory.path().join(name)));
    assert_eq!(Format::Vtp.outputs(&run.model), ["vtp/", "run.pvd", "obstacles.vtp"]);
    let segments = run.model.segments.len();
    let collection = fs::read_to_string(&made[1]).unwrap();
    for frame in 0..run.times.len() {
        let mut surfaces = vec![Vec::new(); run.model.contacts.obstacles.len()];
        add_triangles(&directory.path().join(format!("vtp/frame_{frame:04}.vtp")), segments, &mut surfaces);
        // What moves is in the frame, what does not in a file of its own that the collection has at each time.
        assert_eq!(surfaces.iter().map(Vec::is_empty).collect::<Vec<_>>(), [false, false, false, false, true, true]);
        add_triangles(&made[2], 0, &mut surfaces);
        check(&run, frame, &surfaces, 1e-12);
        let line = format!("<DataSet timestep=\"{:?}\" part=\"1\" file=\"obstacles.vtp\"/>", run.times[frame]);
        assert!(collection.lines().any(|own| own == line), "{collection}");
    }
}

/// A large surface that never moves is on the disk once, whatever the number of frames.
#[test]
fn still_obstacles_are_written_once() {
    let sphere = |k: usize| ObstacleShape::Sphere { centre: Vector3::x() * k as f64, radius: 0.4 };
    let size = |frames: usize, obstacles: usize| {
        let mut run = straight(frames);
        let obstacles = (0..obstacles).map(|k| Obstacle::new(sphere(k), Surface::default()));
        run.model.contacts.obstacles = obstacles.collect();
        let directory = tempfile::tempdir().unwrap();
        run.export(Format::Vtp, directory.path());
        let bytes = |path: &Path| fs::metadata(path).unwrap().len();
        let of_frames = fs::read_dir(directory.path().join("vtp")).unwrap().map(|entry| bytes(&entry.unwrap().path()));
        [of_frames.sum(), bytes(&directory.path().join("obstacles.vtp"))]
    };
    let ([few, once], [many, still_once]) = (size(2, 1), size(20, 1));
    assert_eq!((many, still_once), (10 * few, once));
    // A hundred of them make frames longer by their names alone.
    let [frames, large] = size(2, 100);
    assert!(large > 90 * once && frames < few + 2 * 100 * 60, "{frames} {few} {large} {once}");
}

#[test]
fn glb_animates_those_that_move() {
    let run = among_obstacles();
    let directory = tempfile::tempdir().unwrap();
    let made = run.export(Format::Glb, directory.path());
    let Gltf { document, blob } = Gltf::from_slice(&fs::read(&made[0]).unwrap()).expect("a valid file");
    let blob = blob.unwrap();
    let data = |_: gltf::Buffer<'_>| Some(blob.as_slice());
    let root = document.nodes().find(|node| node.name() == Some("root")).unwrap();
    let nodes: Vec<gltf::Node<'_>> = root.children().filter(|node| node.mesh().is_some()).collect();
    assert_eq!(nodes.len(), run.model.contacts.obstacles.len());
    let turn = |[x, y, z, w]: [f32; 4]| UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z).cast::<f64>());
    let animation = document.animations().next().unwrap();
    for frame in 0..run.times.len() {
        let mut surfaces = Vec::new();
        for (node, obstacle) in nodes.iter().zip(&run.model.contacts.obstacles) {
            let (mut place, mut turned, _) = node.transform().decomposed();
            let channels = animation.channels().filter(|channel| channel.target().node().index() == node.index());
            let mut animated = 0;
            for channel in channels {
                animated += 1;
                match channel.reader(data).read_outputs().unwrap() {
                    ReadOutputs::Translations(mut values) => place = values.nth(frame).unwrap(),
                    ReadOutputs::Rotations(values) => turned = values.into_f32().nth(frame).unwrap(),
                    _ => panic!("neither translations nor rotations"),
                }
            }
            assert_eq!(animated, if obstacle.motion.is_some() { 2 } else { 0 });
            let primitive = node.mesh().unwrap().primitives().next().unwrap();
            let reader = primitive.reader(data);
            let vector = |v: [f32; 3]| Vector3::from(v).cast::<f64>();
            let world = |v: [f32; 3]| vector(place) + turn(turned) * vector(v);
            let places: Vec<Vector3<f64>> = reader.read_positions().unwrap().map(world).collect();
            let corners: Vec<u32> = reader.read_indices().unwrap().into_u32().collect();
            surfaces.push(corners.chunks(3).map(|t| [0, 1, 2].map(|k| places[t[k] as usize])).collect());
            assert_eq!(reader.read_normals().unwrap().count(), places.len());
        }
        check(&run, frame, &surfaces, 1e-5);
    }
}

#[test]
fn a_table_holds_their_poses() {
    let run = among_obstacles();
    let directory = tempfile::tempdir().unwrap();
    let made = run.export(Format::Csv, directory.path());
    assert_eq!(made[3], directory.path().join("obstacles.csv"));
    let mut reader = csv::Reader::from_path(&made[3]).unwrap();
    let mut rows = reader.records();
    for (frame, &time) in run.times.iter().enumerate() {
        for (k, obstacle) in run.model.contacts.obstacles.iter().enumerate() {
            let at = obstacle.at(time);
            let mut expected = vec![frame as f64, time, k as f64];
            let q = at.pose.orientation;
            expected.extend(at.pose.position.iter().chain(&[q.w, q.i, q.j, q.k]));
            expected.extend(at.velocity.iter().chain(&at.angular_velocity));
            let row = rows.next().unwrap().unwrap();
            assert_eq!(row[3], format!("obstacle-{k}"));
            let numbers = row.iter().enumerate().filter(|(column, _)| *column != 3);
            assert_eq!(numbers.map(|(_, word)| word.parse().unwrap()).collect::<Vec<f64>>(), expected);
        }
    }
    assert!(rows.next().is_none());
}

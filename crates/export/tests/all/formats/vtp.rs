//! VTP by the crate vtkio, PVD by roxmltree.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use export::{Format, Names};
use nalgebra::Vector3;
use rod::{JointForce, curvature};
use vtkio::model::{Attribute, DataSet, Piece, VertexNumbers, Vtk};

use super::runs::{Run, runs};

/// What vtkio reads from a file.
struct Lines {
    points: Vec<f64>,
    connectivity: Vec<u64>,
    offsets: Vec<u64>,
    point_data: BTreeMap<String, (usize, Vec<f64>)>,
    cell_data: BTreeMap<String, (usize, Vec<f64>)>,
}

fn read(path: &Path) -> Lines {
    let DataSet::PolyData { pieces, .. } = Vtk::import(path).unwrap().data else { panic!("{}", path.display()) };
    let [Piece::Inline(piece)] = pieces.as_slice() else { panic!("{} pieces", pieces.len()) };
    let Some(VertexNumbers::XML { connectivity, offsets }) = piece.lines.clone() else { panic!("no lines") };
    let arrays = |attributes: &[Attribute]| {
        let array = |attribute: &Attribute| {
            let Attribute::DataArray(array) = attribute else { panic!("{attribute:?}") };
            let components = array.num_comp();
            (array.name.clone(), (components, array.data.clone().cast_into().unwrap()))
        };
        attributes.iter().map(array).collect()
    };
    Lines {
        points: piece.points.clone().into_vec().unwrap(),
        connectivity,
        offsets,
        point_data: arrays(&piece.data.point),
        cell_data: arrays(&piece.data.cell),
    }
}

fn flat(vectors: impl IntoIterator<Item = Vector3<f64>>) -> (usize, Vec<f64>) {
    (3, vectors.into_iter().flat_map(<[f64; 3]>::from).collect())
}

fn check_frame(run: &Run, frame: usize, lines: &Lines) {
    let Run { model, states, .. } = run;
    let state = &states[frame];
    let what = format!("{}, frame {frame}", run.name);
    let cells = model.segments.len();
    let ends: Vec<u64> = run.lines.iter().flat_map(|l| l.windows(2).flatten()).map(|&node| node as u64).collect();
    assert_eq!(lines.connectivity, ends, "{what}");
    assert_eq!(lines.offsets, (1..=cells as u64).map(|i| 2 * i).collect::<Vec<_>>(), "{what}");

    let nodes = run.joints.len();
    assert_eq!(lines.points.len(), 3 * nodes, "{what}");
    let radii = &lines.point_data["Radius"];
    for node in 0..nodes {
        let (place, radius) = run.node(state, node);
        let found = Vector3::from_column_slice(&lines.points[3 * node..3 * node + 3]);
        assert!((found - place).norm() < 1e-12, "{what}, node {node}: {found} {place}");
        assert!((radii.1[node] - radius).abs() < 1e-15, "{what}, node {node}");
    }

    let of_joints = |value: &dyn Fn(usize) -> f64| {
        (1, run.joints.iter().map(|joint| joint.map_or(0.0, value)).collect::<Vec<f64>>())
    };
    let mut expected = BTreeMap::from([
        ("Radius", radii.clone()),
        ("Curvature", of_joints(&|joint| curvature(model, state, &model.joints[joint]))),
    ]);
    if let Some(forces) = run.forces.get(frame).filter(|forces| !forces.is_empty()) {
        let tension = |joint: usize| forces[joint].tension(model, state, &model.joints[joint]);
        let vectors = |part: &dyn Fn(JointForce) -> Vector3<f64>| {
            flat(run.joints.iter().map(|joint| joint.map_or(Vector3::zeros(), |i| part(forces[i]))))
        };
        expected.insert("Tension", of_joints(&tension));
        expected.insert("Force", vectors(&|joint| joint.force));
        expected.insert("Moment", vectors(&|joint| joint.moment));
    }
    compare(&lines.point_data, &expected, &what);

    let director = |axis: Vector3<f64>| flat(state.orientations.iter().map(|q| q * axis));
    let of_segments = |value: &dyn Fn(usize) -> f64| (1, (0..cells).map(value).collect::<Vec<f64>>());
    let orientations = state.orientations.iter().flat_map(|q| [q.w, q.i, q.j, q.k]).collect();
    let expected = BTreeMap::from([
        ("Position", flat(state.positions.clone())),
        ("Orientation", (4, orientations)),
        ("Director1", director(Vector3::x())),
        ("Director2", director(Vector3::y())),
        ("Director3", director(Vector3::z())),
        ("Velocity", flat(state.velocities.clone())),
        ("AngularVelocity", flat(state.angular_velocities.clone())),
        ("Length", of_segments(&|i| model.segments[i].length)),
        ("Radius", of_segments(&|i| model.segments[i].radius)),
        ("Rod", of_segments(&|i| model.segments[i].rod as f64)),
        ("Segment", of_segments(&|i| i as f64)),
    ]);
    compare(&lines.cell_data, &expected, &what);
}

/// Every array, every number, exactly.
fn compare(found: &BTreeMap<String, (usize, Vec<f64>)>, expected: &BTreeMap<&str, (usize, Vec<f64>)>, what: &str) {
    assert!(found.keys().eq(expected.keys()), "{what}: {:?}", found.keys());
    for (name, values) in expected {
        assert_eq!(&found[*name], values, "{what}: {name}");
    }
}

#[test]
fn every_number_of_every_frame_is_read_back() {
    for run in runs() {
        let directory = tempfile::tempdir().unwrap();
        let made = run.export(Format::Vtp, directory.path());
        assert_eq!(made, ["vtp", "run.pvd"].map(|name| directory.path().join(name)));
        let collection = fs::read_to_string(&made[1]).unwrap();
        let document = roxmltree::Document::parse(&collection).unwrap();
        let root = document.root_element();
        assert_eq!((root.tag_name().name(), root.attribute("type")), ("VTKFile", Some("Collection")));
        let sets: Vec<_> = root.descendants().filter(|node| node.has_tag_name("DataSet")).collect();
        assert_eq!(sets.len(), run.times.len());
        for (frame, set) in sets.iter().enumerate() {
            let time: f64 = set.attribute("timestep").unwrap().parse().unwrap();
            assert_eq!(time, run.times[frame]);
            let file = set.attribute("file").unwrap();
            assert_eq!(file, format!("vtp/frame_{frame:04}.vtp"));
            check_frame(&run, frame, &read(&directory.path().join(file)));
        }
        assert_eq!(fs::read_dir(&made[0]).unwrap().count(), run.times.len());
    }
}

/// The texts of a list in the field data of a file.
fn texts(path: &Path, name: &str) -> Option<Vec<String>> {
    let file = fs::read_to_string(path).unwrap();
    let document = roxmltree::Document::parse(&file).unwrap();
    let field = document.descendants().find(|node| node.has_tag_name("FieldData")).unwrap();
    let array = field.children().find(|node| node.attribute("Name") == Some(name))?;
    assert_eq!((array.attribute("type"), array.attribute("format")), (Some("String"), Some("ascii")));
    let bytes: Vec<u8> = array.text().unwrap_or("").split_whitespace().map(|byte| byte.parse().unwrap()).collect();
    let texts: Vec<String> = bytes
        .split_inclusive(|&byte| byte == 0)
        .map(|text| str::from_utf8(&text[..text.len() - 1]).unwrap().into())
        .collect();
    assert_eq!(array.attribute("NumberOfTuples"), Some(texts.len().to_string().as_str()));
    Some(texts)
}

#[test]
fn every_file_has_the_names_and_says_how_quaternions_are_ordered() {
    let mut run = runs().into_iter().find(|run| run.name == "tree").unwrap();
    let names = ["trunk \u{2603}", "branch", "<ring>"].map(str::to_owned);
    run.called = Names::new(&run.model, &names, &[]);
    let directory = tempfile::tempdir().unwrap();
    run.export(Format::Vtp, directory.path());
    let path = directory.path().join("vtp/frame_0001.vtp");
    assert_eq!(texts(&path, "RodName").unwrap(), ["trunk \u{2603}", "branch", "<ring>", "rod-3"]);
    assert_eq!(texts(&path, "ObstacleName"), None);
    let file = fs::read_to_string(&path).unwrap();
    let document = roxmltree::Document::parse(&file).unwrap();
    let array = document.descendants().find(|node| node.attribute("Name") == Some("Orientation")).unwrap();
    let components = (0..4).map(|k| array.attribute(format!("ComponentName{k}").as_str()).unwrap());
    assert_eq!(components.collect::<Vec<_>>(), ["qw", "qx", "qy", "qz"]);
}

//! ParaView: one file of lines a frame, and a collection that lists them with their times.

use std::borrow::Cow;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use nalgebra::Vector3;
use rod::{JointForce, Model, curvature};

use super::Frame;
use super::centrelines::{Centrelines, Node};
use super::solids::Solid;
use crate::file::stage;
use crate::folder::Folder;
use crate::{ExportError, TrajectoryReader};

mod xml;

use xml::{Array, Piece};

const FOLDER: &str = "vtp";

/// Writes `vtp/frame_0000.vtp` and so on and `run.pvd`: points are the nodes of the rods, cells are lines, one a segment
/// in the order of the model, and triangles of rigid bodies, which have the data of their segment. All numbers of lines are the trajectory's, bit for bit.
pub(super) fn write(
    directory: &Path,
    trajectory: &mut TrajectoryReader,
    model: &Model,
) -> Result<Vec<PathBuf>, ExportError> {
    let (lines, solids) = (Centrelines::new(model), Solid::all(model));
    let times = trajectory.times()?;
    let folder = Folder::stage(&directory.join(FOLDER), times.len(), "vtp")?;
    let collection = stage(&directory.join("run.pvd"), |writer| {
        let names = (0..times.len()).map(|index| format!("{FOLDER}/{}", folder.name(index)));
        write_collection(writer, times.iter().zip(names))
    })?;
    let (mut frame, mut model) = (Frame::default(), Cow::Borrowed(model));
    for index in 0..times.len() {
        frame.read(trajectory, index)?;
        frame.set_time(&mut model);
        folder.write(index, |writer| piece(&frame, &model, &lines, &solids).write(writer))?;
    }
    Ok(vec![folder.publish()?, collection.publish()?])
}

/// Writes the list of files with their times [s].
fn write_collection<'a>(
    writer: &mut BufWriter<&std::fs::File>,
    files: impl Iterator<Item = (&'a f64, String)>,
) -> std::io::Result<()> {
    writeln!(writer, "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\">\n<Collection>")?;
    for (time, name) in files {
        writeln!(writer, "<DataSet timestep=\"{time:?}\" part=\"0\" file=\"{name}\"/>")?;
    }
    writeln!(writer, "</Collection>\n</VTKFile>")
}

fn piece(frame: &Frame, model: &Model, lines: &Centrelines, solids: &[Solid]) -> Piece {
    let nodes = lines.nodes.iter().map(|node| node.position(model, &frame.state));
    let corners = solids.iter().flat_map(|solid| solid.places(&frame.state));
    let cells = model.segments.len();
    let mut triangles = Vec::new();
    let mut first = lines.nodes.len();
    for solid in solids {
        triangles.extend(solid.mesh.triangles.as_flattened().iter().map(|&corner| first + corner as usize));
        first += solid.mesh.positions.len();
    }
    Piece {
        points: Array::floats("Points", 3, nodes.chain(corners).flat_map(vector)),
        connectivity: Array::integers("connectivity", lines.ends.iter().flatten().copied()),
        offsets: Array::integers("offsets", (1..=cells).map(|cell| 2 * cell)),
        triangles: (
            Array::integers("connectivity", triangles.iter().copied()),
            Array::integers("offsets", (1..=triangles.len() / 3).map(|cell| 3 * cell)),
        ),
        point_data: point_data(frame, model, &lines.nodes, first),
        cell_data: cell_data(frame, model, solids),
    }
}

/// Data of the nodes, and zeros up to so many `points`: those of rigid bodies.
fn point_data(frame: &Frame, model: &Model, nodes: &[Node], points: usize) -> Vec<Array> {
    let Frame { state, forces, .. } = frame;
    let joint = |node: &Node| node.joint.map(|index| &model.joints[index]);
    let numbers = |name, of: &dyn Fn(&Node) -> f64| {
        let none = std::iter::repeat_n(0.0, points - nodes.len());
        Array::floats(name, 1, nodes.iter().map(of).chain(none))
    };
    let bent = |node: &Node| joint(node).map_or(0.0, |joint| curvature(model, state, joint));
    let mut arrays = vec![numbers("Radius", &|node| node.radius(model)), numbers("Curvature", &bent)];
    if !forces.is_empty() {
        let transmitted = |node: &Node| node.joint.map_or(JointForce::default(), |index| forces[index]);
        let tension = |node: &Node| joint(node).map_or(0.0, |joint| transmitted(node).tension(model, state, joint));
        let vectors = |name, part: fn(JointForce) -> Vector3<f64>| {
            let none = std::iter::repeat_n(Vector3::zeros(), points - nodes.len());
            Array::floats(name, 3, nodes.iter().map(|node| part(transmitted(node))).chain(none).flat_map(vector))
        };
        arrays.push(numbers("Tension", &tension));
        arrays.push(vectors("Force", |joint| joint.force));
        arrays.push(vectors("Moment", |joint| joint.moment));
    }
    arrays
}

/// Data of the lines, one a segment, and of the triangles.
fn cell_data(frame: &Frame, model: &Model, solids: &[Solid]) -> Vec<Array> {
    let state = &frame.state;
    let triangles = |solid: &Solid| std::iter::repeat_n(solid.segment, solid.mesh.triangles.len());
    let cells: Vec<usize> = (0..model.segments.len()).chain(solids.iter().flat_map(triangles)).collect();
    let vectors = |name, of: &dyn Fn(usize) -> Vector3<f64>| {
        Array::floats(name, 3, cells.iter().flat_map(|&segment| vector(of(segment))))
    };
    let numbers = |name, of: &dyn Fn(usize) -> f64| Array::floats(name, 1, cells.iter().map(|&segment| of(segment)));
    let director = |name, axis: Vector3<f64>| vectors(name, &|i| state.orientations[i] * axis);
    let orientations = cells.iter().flat_map(|&i| <[f64; 4]>::from(state.orientations[i].coords));
    vec![
        vectors("Position", &|i| state.positions[i]),
        Array::floats("Orientation", 4, orientations),
        director("Director1", Vector3::x()),
        director("Director2", Vector3::y()),
        director("Director3", Vector3::z()),
        vectors("Velocity", &|i| state.velocities[i]),
        vectors("AngularVelocity", &|i| state.angular_velocities[i]),
        numbers("Length", &|i| model.segments[i].length),
        numbers("Radius", &|i| model.segments[i].radius),
        Array::integers("Rod", cells.iter().map(|&i| model.segments[i].rod)),
        Array::integers("Segment", cells.iter().copied()),
    ]
}

fn vector(v: Vector3<f64>) -> [f64; 3] {
    v.into()
}

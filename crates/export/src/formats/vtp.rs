//! ParaView: one file of lines a frame, and a collection that lists them with their times.

use std::borrow::Cow;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use nalgebra::Vector3;
use rod::{JointForce, Model, curvature};

use super::Frame;
use super::centrelines::{Centrelines, Node};
use crate::file::stage;
use crate::folder::Folder;
use crate::{ExportError, TrajectoryReader};

mod xml;

use xml::{Array, Piece};

const FOLDER: &str = "vtp";

/// Writes `vtp/frame_0000.vtp` and so on and `run.pvd`: points are the nodes of the rods, cells are lines, one a segment
/// in the order of the model. All numbers are the trajectory's, bit for bit.
pub(super) fn write(
    directory: &Path,
    trajectory: &mut TrajectoryReader,
    model: &Model,
) -> Result<Vec<PathBuf>, ExportError> {
    let lines = Centrelines::new(model);
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
        folder.write(index, |writer| piece(&frame, &model, &lines).write(writer))?;
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

fn piece(frame: &Frame, model: &Model, lines: &Centrelines) -> Piece {
    let nodes = || lines.nodes.iter();
    let cells = model.segments.len();
    Piece {
        points: Array::floats("Points", 3, nodes().flat_map(|node| vector(node.position(model, &frame.state)))),
        connectivity: Array::integers("connectivity", lines.ends.iter().flatten().copied()),
        offsets: Array::integers("offsets", (1..=cells).map(|cell| 2 * cell)),
        point_data: point_data(frame, model, &lines.nodes),
        cell_data: cell_data(frame, model),
    }
}

fn point_data(frame: &Frame, model: &Model, nodes: &[Node]) -> Vec<Array> {
    let Frame { state, forces, .. } = frame;
    let joint = |node: &Node| node.joint.map(|index| &model.joints[index]);
    let bent = nodes.iter().map(|node| joint(node).map_or(0.0, |joint| curvature(model, state, joint)));
    let mut arrays = vec![
        Array::floats("Radius", 1, nodes.iter().map(|node| node.radius(model))),
        Array::floats("Curvature", 1, bent),
    ];
    if !forces.is_empty() {
        let transmitted = |node: &Node| node.joint.map_or(JointForce::default(), |index| forces[index]);
        let tension = |node: &Node| joint(node).map_or(0.0, |joint| transmitted(node).tension(model, state, joint));
        let of_joints =
            |part: fn(JointForce) -> Vector3<f64>| nodes.iter().flat_map(move |node| vector(part(transmitted(node))));
        arrays.push(Array::floats("Tension", 1, nodes.iter().map(tension)));
        arrays.push(Array::floats("Force", 3, of_joints(|joint| joint.force)));
        arrays.push(Array::floats("Moment", 3, of_joints(|joint| joint.moment)));
    }
    arrays
}

fn cell_data(frame: &Frame, model: &Model) -> Vec<Array> {
    let state = &frame.state;
    let vectors = |name, values: &[Vector3<f64>]| Array::floats(name, 3, values.iter().copied().flat_map(vector));
    let director =
        |name, axis: Vector3<f64>| Array::floats(name, 3, state.orientations.iter().flat_map(|q| vector(q * axis)));
    let segments = || model.segments.iter();
    vec![
        vectors("Position", &state.positions),
        Array::floats("Orientation", 4, state.orientations.iter().flat_map(|q| <[f64; 4]>::from(q.coords))),
        director("Director1", Vector3::x()),
        director("Director2", Vector3::y()),
        director("Director3", Vector3::z()),
        vectors("Velocity", &state.velocities),
        vectors("AngularVelocity", &state.angular_velocities),
        Array::floats("Length", 1, segments().map(|segment| segment.length)),
        Array::floats("Radius", 1, segments().map(|segment| segment.radius)),
        Array::integers("Rod", segments().map(|segment| segment.rod)),
        Array::integers("Segment", 0..model.segments.len()),
    ]
}

fn vector(v: Vector3<f64>) -> [f64; 3] {
    v.into()
}

//! ParaView: one file a frame of lines and of the surfaces of rigid bodies and obstacles, and a collection that lists them
//! with their times.

use std::borrow::Cow;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::iter;
use std::path::{Path, PathBuf};

use nalgebra::Vector3;
use rod::{JointForce, Model, MovingPose, Segment, curvature};

use super::centrelines::{Centrelines, Node};
use super::csv::wxyz;
use super::format::STILL;
use super::frame::Frame;
use super::solids::{Owner, Solid};
use crate::file::stage;
use crate::folder::Folder;
use crate::{ExportError, Names, TrajectoryReader};

mod xml;

use xml::{Array, Piece};

const FOLDER: &str = "vtp";
/// What [`Array::integers`] writes as -1.
const NONE: usize = usize::MAX;

/// Writes `vtp/frame_0000.vtp` and so on and `run.pvd`: points are the nodes of the rods, cells are lines, one a segment
/// in the order of the model. The triangles of rigid bodies and of obstacles that move and the points of these follow; those
/// of bodies have the data of their segments. All numbers of lines are the trajectory's, bit for bit. Obstacles that never
/// move are in `obstacles.vtp`, which `run.pvd` lists beside each frame.
pub(super) fn write(
    directory: &Path,
    trajectory: &mut TrajectoryReader,
    model: &Model,
    names: &Names,
) -> Result<Vec<PathBuf>, ExportError> {
    let lines = Centrelines::new(model);
    let all = Solid::all(model, trajectory)?;
    let (still, solids): (Vec<Solid>, Vec<Solid>) = all.into_iter().partition(|solid| solid.is_still(model));
    let times = trajectory.times()?;
    let folder = Folder::stage(&directory.join(FOLDER), times.len(), "vtp")?;
    let collection = stage(&directory.join("run.pvd"), |writer| {
        let beside = (!still.is_empty()).then_some(STILL);
        let names = (0..times.len()).map(|index| format!("{FOLDER}/{}", folder.name(index)));
        write_collection(writer, times.iter().zip(names), beside)
    })?;
    let (mut frame, mut model) = (Frame::default(), Cow::Borrowed(model));
    let mut obstacles = None;
    for index in 0..times.len() {
        frame.read(trajectory, index)?;
        frame.set_time(&mut model);
        if index == 0 && !still.is_empty() {
            let none = Centrelines::default();
            let write = |writer: &mut BufWriter<&File>| piece(&frame, &model, names, &none, &still).write(writer);
            obstacles = Some(stage(&directory.join(STILL), write)?);
        }
        folder.write(index, |writer| piece(&frame, &model, names, &lines, &solids).write(writer))?;
    }
    let mut made = vec![folder.publish()?, collection.publish()?];
    if let Some(obstacles) = obstacles {
        made.push(obstacles.publish()?);
    }
    Ok(made)
}

/// Writes the list of files with their times [s]; with the file `beside`, if there is one, at each time.
fn write_collection<'a>(
    writer: &mut BufWriter<&File>,
    files: impl Iterator<Item = (&'a f64, String)>,
    beside: Option<&str>,
) -> std::io::Result<()> {
    writeln!(writer, "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\">\n<Collection>")?;
    for (time, name) in files {
        for (part, file) in [name.as_str()].into_iter().chain(beside).enumerate() {
            writeln!(writer, "<DataSet timestep=\"{time:?}\" part=\"{part}\" file=\"{file}\"/>")?;
        }
    }
    writeln!(writer, "</Collection>\n</VTKFile>")
}

fn piece(frame: &Frame, model: &Model, names: &Names, lines: &Centrelines, solids: &[Solid]) -> Piece {
    let nodes = lines.nodes.iter().map(|node| node.position(model, &frame.state));
    let corners = solids.iter().flat_map(|solid| solid.places(solid.of.at(model, frame).pose));
    let mut points = lines.nodes.len();
    let mut triangles = Vec::new();
    for Solid { mesh, .. } in solids {
        triangles.extend(mesh.triangles.as_flattened().iter().map(|&corner| points + corner as usize));
        points += mesh.positions.len();
    }
    let segments = lines.ends.len();
    let mut texts = vec![("RodName", names.by_number())];
    if !model.contacts.obstacles.is_empty() {
        texts.push(("ObstacleName", names.obstacles()));
    }
    let mut numbers = Vec::new();
    if let Some((mode, frequency)) = frame.mode {
        numbers = vec![("Mode", "Int64", mode.to_string()), ("FrequencyHz", "Float64", format!("{frequency:?}"))];
    }
    Piece {
        numbers,
        texts: texts.into_iter().map(|(name, list)| (name, list.into_iter().map(str::to_owned).collect())).collect(),
        points: Array::floats("Points", 3, nodes.chain(corners).flat_map(vector)),
        connectivity: Array::integers("connectivity", lines.ends.iter().flatten().copied()),
        offsets: Array::integers("offsets", (1..=segments).map(|cell| 2 * cell)),
        triangles: (!triangles.is_empty()).then(|| {
            let offsets = Array::integers("offsets", (1..=triangles.len() / 3).map(|cell| 3 * cell));
            [Array::integers("connectivity", triangles.iter().copied()), offsets]
        }),
        point_data: point_data(frame, model, &lines.nodes, points),
        cell_data: cell_data(frame, model, segments, solids),
    }
}

/// Data of the nodes, and zeros up to so many `points`: those of surfaces.
fn point_data(frame: &Frame, model: &Model, nodes: &[Node], points: usize) -> Vec<Array> {
    let Frame { state, forces, .. } = frame;
    let joint = |node: &Node| node.joint.map(|index| &model.joints[index]);
    let numbers = |name, of: &dyn Fn(&Node) -> f64| {
        let none = iter::repeat_n(0.0, points - nodes.len());
        Array::floats(name, 1, nodes.iter().map(of).chain(none))
    };
    let bent = |node: &Node| joint(node).map_or(0.0, |joint| curvature(model, state, joint));
    let mut arrays = vec![numbers("Radius", &|node| node.radius(model)), numbers("Curvature", &bent)];
    if !forces.is_empty() {
        let transmitted = |node: &Node| node.joint.map_or(JointForce::default(), |index| forces[index]);
        let tension = |node: &Node| joint(node).map_or(0.0, |joint| transmitted(node).tension(model, state, joint));
        let vectors = |name, part: fn(JointForce) -> Vector3<f64>| {
            let none = iter::repeat_n(Vector3::zeros(), points - nodes.len());
            Array::floats(name, 3, nodes.iter().map(|node| part(transmitted(node))).chain(none).flat_map(vector))
        };
        arrays.push(numbers("Tension", &tension));
        arrays.push(vectors("Force", |joint| joint.force));
        arrays.push(vectors("Moment", |joint| joint.moment));
    }
    arrays
}

/// Data of the lines, one a segment, and of the triangles.
fn cell_data(frame: &Frame, model: &Model, segments: usize, solids: &[Solid]) -> Vec<Array> {
    let lines = (0..segments).map(|i| (Owner::Segment(i), 1));
    let triangles = solids.iter().map(|solid| (solid.of, solid.mesh.triangles.len()));
    let cells: Vec<(Owner, MovingPose)> = lines
        .chain(triangles)
        .flat_map(|(owner, count)| iter::repeat_n((owner, owner.at(model, frame)), count))
        .collect();
    let vectors = |name, of: &dyn Fn(&MovingPose) -> Vector3<f64>| {
        Array::floats(name, 3, cells.iter().flat_map(|(_, moving)| vector(of(moving))))
    };
    let director = |name, axis: Vector3<f64>| vectors(name, &|moving| moving.pose.orientation * axis);
    let lengths = |name, of: fn(&Segment) -> f64| {
        Array::floats(name, 1, cells.iter().map(|(owner, _)| owner.segment().map_or(0.0, |i| of(&model.segments[i]))))
    };
    let numbers = |name, of: &dyn Fn(&Owner) -> Option<usize>| {
        Array::integers(name, cells.iter().map(|(owner, _)| of(owner).unwrap_or(NONE)))
    };
    let orientations = cells.iter().flat_map(|(_, moving)| wxyz(&moving.pose.orientation));
    let mut arrays = vec![
        vectors("Position", &|moving| moving.pose.position),
        Array::floats("Orientation", 4, orientations).with_components(&["qw", "qx", "qy", "qz"]),
        director("Director1", Vector3::x()),
        director("Director2", Vector3::y()),
        director("Director3", Vector3::z()),
        vectors("Velocity", &|moving| moving.velocity),
        vectors("AngularVelocity", &|moving| moving.angular_velocity),
        lengths("Length", |segment| segment.length),
        lengths("Radius", |segment| segment.radius),
        numbers("Rod", &|owner| owner.segment().map(|i| model.segments[i].rod)),
        numbers("Segment", &|owner| owner.segment()),
    ];
    if !model.contacts.obstacles.is_empty() {
        arrays.push(numbers("Obstacle", &|owner| owner.obstacle()));
    }
    arrays
}

fn vector(v: Vector3<f64>) -> [f64; 3] {
    v.into()
}

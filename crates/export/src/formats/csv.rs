//! Tables of segments, of joints, of what holds them and of obstacles, numbers with all their digits.

use std::borrow::Cow;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use nalgebra::UnitQuaternion;
use rod::{Joint, Model, MovingPose, Pose, Reaction, ReactionParts, State, curvature};

use super::format::OBSTACLES_FILE;
use super::frame::Frame;
use crate::file::{Staged, stage};
use crate::naming::{csv_field, number};
use crate::{ExportError, Names, TrajectoryReader};

const SEGMENTS: &str = "frame,time_s,rod,rod_name,segment,segment_of_rod,x_m,y_m,z_m,qw,qx,qy,qz,v_x_m_per_s,v_y_m_per_s,v_z_m_per_s,\
                        w_x_rad_per_s,w_y_rad_per_s,w_z_rad_per_s";
const REACTIONS: &str =
    "frame,time_s,body,body_name,force_x_n,force_y_n,force_z_n,moment_x_n_m,moment_y_n_m,moment_z_n_m";
const OBSTACLES: &str = "frame,time_s,obstacle,obstacle_name,x_m,y_m,z_m,qw,qx,qy,qz,v_x_m_per_s,v_y_m_per_s,v_z_m_per_s,\
                         w_x_rad_per_s,w_y_rad_per_s,w_z_rad_per_s";
const JOINTS: &str = "frame,time_s,joint,a,a_name,b,b_name,curvature_per_m";
/// Columns that only a trajectory with the forces of joints has.
const FORCES: &str = ",tension_n,force_x_n,force_y_n,force_z_n,moment_x_n_m,moment_y_n_m,moment_z_n_m";

/// Writes `segments.csv`, one row for each segment of each frame, `joints.csv`, one for each joint of each frame, and
/// `reactions.csv`, one for each fixed segment and anchor of each frame but the first; without the forces of joints it has
/// none. With obstacles, `obstacles.csv` has one for each of each frame. The bodies `a` and `b` of a joint are indices of
/// segments, or "anchor 0" and so on.
pub(super) fn write(
    directory: &Path,
    trajectory: &mut TrajectoryReader,
    model: &Model,
    names: &Names,
) -> Result<Vec<PathBuf>, ExportError> {
    let segments = stage(&directory.join("segments.csv"), |writer| {
        writeln!(writer, "{SEGMENTS}")?;
        let heads = names.rows(&model.segments);
        each_frame(trajectory, model, |index, frame, _| write_segments(writer, &heads, index, frame))
    })?;
    let joints = stage(&directory.join("joints.csv"), |writer| {
        writeln!(writer, "{JOINTS}{}", if trajectory.joints() > 0 { FORCES } else { "" })?;
        let side = |body| format!("{},{}", number(body), csv_field(&names.body(body)));
        let head = |(i, joint): (usize, &Joint)| format!("{i},{},{}", side(joint.a), side(joint.b));
        let heads: Vec<String> = model.joints.iter().enumerate().map(head).collect();
        each_frame(trajectory, model, |index, frame, model| write_joints(writer, model, &heads, index, frame))
    })?;
    let reactions = stage(&directory.join("reactions.csv"), |writer| {
        write!(writer, "{REACTIONS}")?;
        for part in ReactionParts::NAMES {
            for axis in ["x", "y", "z"] {
                write!(writer, ",{part}_force_{axis}_n")?;
            }
            for axis in ["x", "y", "z"] {
                write!(writer, ",{part}_moment_{axis}_n_m")?;
            }
        }
        writeln!(writer)?;
        let mut before: Option<(f64, State)> = None;
        each_frame(trajectory, model, |index, frame, model| {
            if let Some((time, state)) = before.replace((frame.time, frame.state.clone()))
                && !frame.forces.is_empty()
            {
                write_reactions(writer, model, names, (index, frame), (time, &state))?;
            }
            Ok(())
        })
    })?;
    let mut tables = vec![segments, joints, reactions];
    if !model.contacts.obstacles.is_empty() {
        tables.push(stage(&directory.join(OBSTACLES_FILE), |writer| {
            writeln!(writer, "{OBSTACLES}")?;
            each_frame(trajectory, model, |index, frame, model| {
                write_obstacles(writer, model, names, index, frame.time)
            })
        })?);
    }
    tables.into_iter().map(Staged::publish).collect()
}

/// Reads one frame after the other, with the model as it is then.
pub(super) fn each_frame(
    trajectory: &mut TrajectoryReader,
    model: &Model,
    mut write: impl FnMut(usize, &Frame, &Model) -> io::Result<()>,
) -> io::Result<()> {
    let (mut frame, mut model) = (Frame::default(), Cow::Borrowed(model));
    for index in 0..trajectory.frames() {
        frame.read(trajectory, index).map_err(io::Error::other)?;
        frame.set_time(&mut model);
        write(index, &frame, &model)?;
    }
    Ok(())
}

fn write_segments(writer: &mut impl Write, heads: &[String], index: usize, frame: &Frame) -> io::Result<()> {
    let Frame { time, state, .. } = frame;
    for (i, head) in heads.iter().enumerate() {
        write!(writer, "{index},{time:?},{head}")?;
        let (position, orientation) = (&state.positions[i], wxyz(&state.orientations[i]));
        let velocities = state.velocities[i].iter().chain(&state.angular_velocities[i]);
        write_values(writer, position.iter().chain(&orientation).chain(velocities))?;
    }
    Ok(())
}

fn write_obstacles(writer: &mut impl Write, model: &Model, names: &Names, index: usize, time: f64) -> io::Result<()> {
    for (i, obstacle) in model.contacts.obstacles.iter().enumerate() {
        let MovingPose { pose: Pose { position, orientation }, velocity, angular_velocity } = obstacle.at(time);
        write!(writer, "{index},{time:?},{i},{}", csv_field(&names.obstacle(i)))?;
        let orientation = wxyz(&orientation);
        let values = position.iter().chain(&orientation);
        write_values(writer, values.chain(&velocity).chain(&angular_velocity))?;
    }
    Ok(())
}

fn write_joints(
    writer: &mut impl Write,
    model: &Model,
    heads: &[String],
    index: usize,
    frame: &Frame,
) -> io::Result<()> {
    let Frame { time, state, forces, .. } = frame;
    for (i, (joint, head)) in model.joints.iter().zip(heads).enumerate() {
        write!(writer, "{index},{time:?},{head},{:?}", curvature(model, state, joint))?;
        match forces.get(i) {
            None => writeln!(writer)?,
            Some(transmitted) => {
                let tension = transmitted.tension(model, state, joint);
                let parts = transmitted.force.iter().chain(&transmitted.moment);
                write_values(writer, std::iter::once(&tension).chain(parts))?;
            }
        }
    }
    Ok(())
}

fn write_reactions(
    writer: &mut impl Write,
    model: &Model,
    names: &Names,
    (index, frame): (usize, &Frame),
    (before, state): (f64, &State),
) -> io::Result<()> {
    let Frame { time, state: after, forces, contacts, .. } = frame;
    for Reaction { body, force, moment, parts } in
        Reaction::all(model, [state, after], [before, *time], forces, contacts)
    {
        write!(writer, "{index},{time:?},{},{}", number(body), csv_field(&names.grip(body)))?;
        let parts = parts.all();
        let parts = parts.iter().flat_map(|part| part.force.iter().chain(&part.moment));
        write_values(writer, force.iter().chain(&moment).chain(parts))?;
    }
    Ok(())
}

/// A quaternion in the order of scene files and tables: w, x, y, z.
pub(super) fn wxyz(q: &UnitQuaternion<f64>) -> [f64; 4] {
    [q.w, q.i, q.j, q.k]
}

/// The rest of a row.
fn write_values<'a>(writer: &mut impl Write, values: impl Iterator<Item = &'a f64>) -> io::Result<()> {
    for value in values {
        write!(writer, ",{value:?}")?;
    }
    writeln!(writer)
}

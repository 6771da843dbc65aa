//! Tables of segments, of joints, of what holds them and of obstacles, numbers with all their digits.

use std::borrow::Cow;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use rod::{Body, Model, MovingPose, Pose, Reaction, ReactionParts, State, curvature};

use super::Frame;
use crate::file::{Staged, stage};
use crate::{ExportError, TrajectoryReader};

const SEGMENTS: &str = "frame,time_s,rod,segment,x_m,y_m,z_m,q_x,q_y,q_z,q_w,v_x_m_per_s,v_y_m_per_s,v_z_m_per_s,\
                        w_x_rad_per_s,w_y_rad_per_s,w_z_rad_per_s";
const REACTIONS: &str = "frame,time_s,body,force_x_n,force_y_n,force_z_n,moment_x_n_m,moment_y_n_m,moment_z_n_m";
const OBSTACLES: &str = "frame,time_s,obstacle,x_m,y_m,z_m,q_x,q_y,q_z,q_w,v_x_m_per_s,v_y_m_per_s,v_z_m_per_s,\
                         w_x_rad_per_s,w_y_rad_per_s,w_z_rad_per_s";
const JOINTS: &str = "frame,time_s,joint,a,b,curvature_per_m";
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
) -> Result<Vec<PathBuf>, ExportError> {
    let segments = stage(&directory.join("segments.csv"), |writer| {
        writeln!(writer, "{SEGMENTS}")?;
        each_frame(trajectory, model, |index, frame, model| write_segments(writer, model, index, frame))
    })?;
    let joints = stage(&directory.join("joints.csv"), |writer| {
        writeln!(writer, "{JOINTS}{}", if trajectory.joints() > 0 { FORCES } else { "" })?;
        each_frame(trajectory, model, |index, frame, model| write_joints(writer, model, index, frame))
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
                write_reactions(writer, model, (index, frame), (time, &state))?;
            }
            Ok(())
        })
    })?;
    let mut tables = vec![segments, joints, reactions];
    if !model.contacts.obstacles.is_empty() {
        tables.push(stage(&directory.join("obstacles.csv"), |writer| {
            writeln!(writer, "{OBSTACLES}")?;
            each_frame(trajectory, model, |index, frame, model| write_obstacles(writer, model, index, frame.time))
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

fn write_segments(writer: &mut impl Write, model: &Model, index: usize, frame: &Frame) -> io::Result<()> {
    let Frame { time, state, .. } = frame;
    for (i, segment) in model.segments.iter().enumerate() {
        write!(writer, "{index},{time:?},{},{i}", segment.rod)?;
        let values = state.positions[i].iter().chain(state.orientations[i].coords.iter());
        write_values(writer, values.chain(&state.velocities[i]).chain(&state.angular_velocities[i]))?;
    }
    Ok(())
}

fn write_obstacles(writer: &mut impl Write, model: &Model, index: usize, time: f64) -> io::Result<()> {
    for (i, obstacle) in model.contacts.obstacles.iter().enumerate() {
        let MovingPose { pose: Pose { position, orientation }, velocity, angular_velocity } = obstacle.at(time);
        write!(writer, "{index},{time:?},{i}")?;
        let values = position.iter().chain(orientation.coords.iter());
        write_values(writer, values.chain(&velocity).chain(&angular_velocity))?;
    }
    Ok(())
}

fn write_joints(writer: &mut impl Write, model: &Model, index: usize, frame: &Frame) -> io::Result<()> {
    let Frame { time, state, forces, .. } = frame;
    for (i, joint) in model.joints.iter().enumerate() {
        write!(
            writer,
            "{index},{time:?},{i},{},{},{:?}",
            name(joint.a),
            name(joint.b),
            curvature(model, state, joint)
        )?;
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
    (index, frame): (usize, &Frame),
    (before, state): (f64, &State),
) -> io::Result<()> {
    let Frame { time, state: after, forces, contacts } = frame;
    for Reaction { body, force, moment, parts } in
        Reaction::all(model, [state, after], [before, *time], forces, contacts)
    {
        write!(writer, "{index},{time:?},{}", name(body))?;
        let parts = parts.all();
        let parts = parts.iter().flat_map(|part| part.force.iter().chain(&part.moment));
        write_values(writer, force.iter().chain(&moment).chain(parts))?;
    }
    Ok(())
}

/// A body as the tables name it.
fn name(body: Body) -> String {
    match body {
        Body::Segment(i) => i.to_string(),
        anchor => anchor.to_string(),
    }
}

/// The rest of a row.
fn write_values<'a>(writer: &mut impl Write, values: impl Iterator<Item = &'a f64>) -> io::Result<()> {
    for value in values {
        write!(writer, ",{value:?}")?;
    }
    writeln!(writer)
}

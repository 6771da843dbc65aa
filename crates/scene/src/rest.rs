//! Rest shapes that change over time: muscles, wires with memory, growth by bending.

use std::sync::Arc;

use nalgebra::Vector3;
use rod::Track;
use toml::Spanned;

use crate::columns::{Table, text};
use crate::error::{Result, Source, short};
use crate::format;
use crate::motion::{ascending, interpolation, made, one_a_time};
use crate::refine::Refinement;

/// Columns of a file.
const TIME: [&str; 1] = ["time_s"];
const JOINT: [&str; 1] = ["joint"];
const DARBOUX: [&str; 3] = ["d1_per_m", "d2_per_m", "d3_per_m"];

/// Rest Darboux vectors [1/m] over time, of a rod of the file.
struct Course {
    times: Vec<f64>,
    /// One vector for all joints, or one a joint, a time each.
    values: Vec<Vec<Vector3<f64>>>,
    smooth: rod::Interpolation,
}

/// The rests over time of a rod of so many `segments` of the file, whose `longest` part [m] is that long: one for all its joints, or one each.
pub(crate) fn tracks(
    source: &Source,
    entry: &Spanned<format::RestOverTime>,
    longest: f64,
    (segments, closed): (usize, bool),
    refinement: Refinement,
) -> Result<Vec<Arc<Track>>> {
    let joints = segments - usize::from(!closed);
    if joints == 0 {
        return source.wrong(entry.span(), "a rod of one segment has no joints that bend");
    }
    let Course { times, values, smooth } = course(source, entry, joints, longest)?;
    let track = |values: Vec<Vector3<f64>>| {
        let values: Vec<_> = times.iter().copied().zip(values).collect();
        made(source, entry.span(), &values, smooth, entry.get_ref().repeats)
    };
    if values.iter().all(|values| values.len() == 1) {
        return Ok(vec![track(values.iter().map(|values| values[0]).collect())?]);
    }
    let of_joints = |values: &Vec<_>| refinement.of_joints(values, segments, closed);
    let all: Vec<Vec<Vector3<f64>>> = values.iter().map(of_joints).collect();
    (0..all[0].len()).map(|k| track(all.iter().map(|values| values[k]).collect())).collect()
}

fn course(source: &Source, entry: &Spanned<format::RestOverTime>, joints: usize, longest: f64) -> Result<Course> {
    let format::RestOverTime { times_s, darboux_per_m, darboux_of_joints_per_m, file, interpolation: between, .. } =
        entry.get_ref();
    let smooth = interpolation(between);
    let allowed = || format!("shorter than 2 / segment length = {} [1/m]", short(2.0 / longest));
    let vector = |value: &format::Vector| {
        let omega = source.vector(value, "1/m")?;
        if omega.norm() * longest >= 2.0 {
            return source.must_be(value.span(), &allowed());
        }
        Ok(omega)
    };
    match (times_s, darboux_per_m, darboux_of_joints_per_m, file) {
        (Some(times), Some(list), None, None) => {
            let times = ascending(source, times)?;
            one_a_time(source, list, times.len())?;
            let values = list.get_ref().iter().map(|value| Ok(vec![vector(value)?])).collect::<Result<_>>()?;
            Ok(Course { times, values, smooth })
        }
        (Some(times), None, Some(list), None) => {
            let times = ascending(source, times)?;
            one_a_time(source, list, times.len())?;
            let of_time = |own: &Spanned<Vec<format::Vector>>| match own.get_ref().len() {
                found if found == joints => own.get_ref().iter().map(vector).collect::<Result<Vec<_>>>(),
                found => {
                    source.wrong(own.span(), &format!("{found} vectors, but there must be one a joint ({joints})"))
                }
            };
            let values = list.get_ref().iter().map(of_time).collect::<Result<_>>()?;
            Ok(Course { times, values, smooth })
        }
        (None, None, None, Some(file)) => read(source, file, joints, smooth, longest),
        _ => source
            .wrong(entry.span(), "give `times_s` with `darboux_per_m` or `darboux_of_joints_per_m`, or a `file` alone"),
    }
}

/// Reads a table of rests: a row a time, or a row a joint of each time, in order.
fn read(
    source: &Source,
    file: &Spanned<String>,
    joints: usize,
    smooth: rod::Interpolation,
    longest: f64,
) -> Result<Course> {
    let (text, name) = text(source, file)?;
    let mut table = Table::new(&text, &name, &[&TIME, &JOINT, &DARBOUX])?;
    let (Some(time), Some(darboux)) = (table.columns(&TIME)?, table.columns(&DARBOUX)?) else {
        return table.wrong("there must be columns time_s, d1_per_m, d2_per_m and d3_per_m".to_owned());
    };
    let joint = table.columns(&JOINT)?;
    let mut course = Course { times: Vec::new(), values: Vec::<Vec<Vector3<f64>>>::new(), smooth };
    table.rows(|row| {
        let (now, value) = (row.number(time[0])?, row.vector(&darboux)?);
        if value.norm() * longest >= 2.0 {
            let most = short(2.0 / longest);
            return Err(format!("the Darboux vector must be shorter than 2 / segment length = {most} [1/m]"));
        }
        let index = joint.as_ref().map_or(Ok(0.0), |column| row.number(column[0]))?;
        let open = course.values.last().filter(|values| values.len() < if joint.is_some() { joints } else { 1 });
        let expected = open.map_or(0, Vec::len);
        if index != expected as f64 {
            return Err(format!(
                "joint = {index}, but the next one is {expected}: each time has joints 0 to {}",
                joints - 1
            ));
        }
        match (course.times.last(), expected) {
            (Some(&last), 0) if now <= last => return Err(format!("time_s = {now}, but it must be later than {last}")),
            (Some(&last), 1..) if now != last => {
                return Err(format!("time_s = {now}, but joint {expected} of {last} is missing"));
            }
            (None, _) if now < 0.0 => return Err(format!("time_s = {now}, but it must be >= 0")),
            _ => {}
        }
        match course.values.last_mut() {
            Some(values) if expected > 0 => values.push(value),
            _ => {
                course.times.push(now);
                course.values.push(vec![value]);
            }
        }
        Ok(())
    })?;
    let whole = |values: &Vec<Vector3<f64>>| joint.is_none() || values.len() == joints;
    match course.values.last() {
        None => table.wrong("there must be a row at least".to_owned()),
        Some(last) if !whole(last) => table.wrong(format!("the last time has {} joints of {joints}", last.len())),
        Some(_) => Ok(course),
    }
}

//! Recordings as CSV files: a header, a row a frame.

use nalgebra::Vector3;

use super::reading::{Frames, Reading};

/// Reads a table with the columns `t` or `time_s` (none: `reading` says how many frames a second) and `NAME_x`, `NAME_y`,
/// `NAME_z` for each marker, in the order along the cable; an ending `_m`, `_cm` or `_mm` says the unit. An empty cell, or NaN,
/// is a marker that was lost. No other columns are known.
pub(super) fn read(bytes: &[u8], reading: Reading) -> Result<Frames, String> {
    let mut table = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(bytes);
    let header = table.headers().map_err(|error| error.to_string())?.clone();
    let names: Vec<&str> = header.iter().collect();
    let time_column = names.iter().position(|name| ["t", "time", "time_s", "t_s"].contains(name));
    let columns = markers(&names, reading.unit)?;
    let is_read =
        |column: &usize| time_column == Some(*column) || columns.iter().any(|(axes, _)| axes.contains(column));
    if let Some(strange) = (0..names.len()).find(|column| !is_read(column)) {
        return Err(format!(
            "the column {:?} is neither a time (time_s, or t) nor a coordinate (NAME_x, NAME_y, NAME_z)",
            names[strange]
        ));
    }
    let (mut time, mut markers) = (Vec::new(), Vec::new());
    for (frame, row) in table.records().enumerate() {
        let row = row.map_err(|error| format!("frame {frame}: {error}"))?;
        let cell = |column: usize| -> Result<f64, String> {
            let text = row.get(column).unwrap_or_default();
            if text.is_empty() {
                return Ok(f64::NAN);
            }
            text.parse().map_err(|_| format!("frame {frame}, column {}: {text:?} is no number", names[column]))
        };
        time.push(match time_column {
            Some(column) => cell(column)?,
            None => frame as f64 / reading.rate,
        });
        let of = |(axes, unit): &([usize; 3], f64)| -> Result<Vector3<f64>, String> {
            Ok(Vector3::new(cell(axes[0])?, cell(axes[1])?, cell(axes[2])?) * *unit)
        };
        markers.push(columns.iter().map(of).collect::<Result<Vec<_>, _>>()?);
    }
    Ok((time, markers))
}

/// The columns of each marker's coordinates, and their unit [m]: `usual` of those that do not say it.
fn markers(names: &[&str], usual: f64) -> Result<Vec<([usize; 3], f64)>, String> {
    let split = |name: &str| -> Option<(String, f64)> {
        let units = [("_mm", 1e-3), ("_cm", 1e-2), ("_m", 1.0)];
        let (name, unit) =
            units.iter().find_map(|(end, unit)| Some((name.strip_suffix(end)?, *unit))).unwrap_or((name, usual));
        Some((name.strip_suffix("_x")?.to_owned(), unit))
    };
    let mut found = Vec::new();
    for (x, name) in names.iter().enumerate() {
        let Some((marker, unit)) = split(name) else { continue };
        let other = |axis: &str| {
            let wanted = name.replacen(&format!("{marker}_x"), &format!("{marker}_{axis}"), 1);
            let column = names.iter().position(|name| *name == wanted);
            column.ok_or_else(|| format!("there is a column {name}, but none {wanted}"))
        };
        found.push(([x, other("y")?, other("z")?], unit));
    }
    if found.is_empty() {
        return Err(
            "the header names no marker: there must be columns NAME_x, NAME_y and NAME_z, with an ending _m, _cm or \
                    _mm if they are not metres"
                .into(),
        );
    }
    Ok(found)
}

//! Motions as tables: CSV files with a column a quantity.

use nalgebra::Vector3;
use toml::Spanned;

use crate::columns::{self, Table};
use crate::error::{Result, Source};
use crate::given::{Given, Turning, Way, unit};

/// Columns that belong together, by their names in the header.
const COLUMNS: [&[&str]; 5] = [
    &["time_s"],
    &["shift_x_m", "shift_y_m", "shift_z_m"],
    &["x_m", "y_m", "z_m"],
    &["turn_x_deg", "turn_y_deg", "turn_z_deg"],
    &["qw", "qx", "qy", "qz"],
];

/// Reads the file that a scene names, from the scene's own folder on.
pub(crate) fn read(source: &Source, name: &Spanned<String>) -> Result<Given> {
    let read = columns::text(source, name).and_then(|(text, file)| given(&text, &file));
    source.of_file(name.span(), read)
}

/// The course in a table's text; `file` stands in errors.
fn given(text: &str, file: &str) -> Result<Given> {
    let mut table = Table::new(text, file, &COLUMNS)?;
    let mut places: [Option<Vec<usize>>; 5] = Default::default();
    for (place, columns) in places.iter_mut().zip(COLUMNS) {
        *place = table.columns(columns)?;
    }
    let [Some(time), shifts, positions, turns, orientations] = places else {
        return table.wrong("there must be a column `time_s`".to_owned());
    };
    if shifts.is_some() && positions.is_some() || turns.is_some() && orientations.is_some() {
        return table.wrong("give either shifts or positions, and either turns or quaternions".to_owned());
    }
    if shifts.is_none() && positions.is_none() && turns.is_none() && orientations.is_none() {
        return table.wrong("there must be columns of what moves beside `time_s`".to_owned());
    }
    let (mut times, mut way, mut vectors, mut quaternions) = (Vec::<f64>::new(), Vec::new(), Vec::new(), Vec::new());
    let way_columns = shifts.as_ref().or(positions.as_ref());
    table.rows(|row| {
        let now = row.number(time[0])?;
        if now < 0.0 {
            return Err(format!("time_s = {now}, but it must be >= 0"));
        }
        if times.last().is_some_and(|&before| now <= before) {
            return Err(format!("time_s = {now}, but it must be later than the time before it"));
        }
        let place = way_columns.map(|columns| row.vector(columns)).transpose()?;
        let turn = turns.as_ref().map(|columns| row.vector(columns)).transpose()?;
        if times.is_empty() {
            for (what, first) in [("shift", place.filter(|_| shifts.is_some())), ("turn", turn)] {
                if first.is_some_and(|first| first != Vector3::zeros()) {
                    return Err(format!("the first {what} must be zero: a motion begins where its body is"));
                }
            }
        }
        times.push(now);
        way.extend(place);
        vectors.extend(turn.map(|turn| turn.map(f64::to_radians)));
        if let Some(columns) = &orientations {
            let turn = unit(row.numbers(columns)?);
            quaternions.push(turn.ok_or_else(|| "qw, qx, qy, qz must be of norm 1 to within 1e-3".to_owned())?);
        }
        Ok(())
    })?;
    if times.is_empty() {
        return table.wrong("there must be at least one row of numbers".to_owned());
    }
    let way = match (shifts, positions) {
        (Some(_), _) => Way::Shifts(way),
        (_, Some(_)) => Way::Positions(way),
        _ => Way::None,
    };
    let turning = match (turns, orientations) {
        (Some(_), _) => Turning::Turns(vectors),
        (_, Some(_)) => Turning::Orientations(quaternions),
        _ => Turning::None,
    };
    Ok(Given { times, way, turning })
}

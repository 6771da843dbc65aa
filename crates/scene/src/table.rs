//! Motions as tables: CSV files with a header that names quantities and units.

use std::path::Path;

use nalgebra::Vector3;
use toml::Spanned;

use crate::SceneError;
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
    let path = Path::new(source.file).parent().unwrap_or_else(|| Path::new("")).join(name.get_ref());
    let file = path.display().to_string();
    if !path.is_file() {
        return source.must_be(name.span(), &format!("a CSV file, and there is none at {file}"));
    }
    let text =
        std::fs::read_to_string(&path).map_err(|error| SceneError::Read { file: file.clone(), source: error })?;
    given(&text, &file)
}

/// The course in a table's text; `file` stands in errors.
fn given(text: &str, file: &str) -> Result<Given> {
    let wrong = |line: usize, message: String| {
        Err(SceneError::Invalid { file: file.to_owned(), line, message: message.replace(char::is_control, " ") })
    };
    let head = 1 + text.lines().take_while(|line| line.trim().is_empty()).count();
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
    let header: Vec<String> = match reader.headers() {
        Ok(header) => header.iter().map(str::to_owned).collect(),
        Err(error) => return wrong(head, error.to_string()),
    };
    if let Some(unknown) = header.iter().find(|name| !COLUMNS.iter().any(|columns| columns.contains(&name.as_str()))) {
        return wrong(head, format!("column `{unknown:.40}` is not known; there are {}", COLUMNS.concat().join(", ")));
    }
    let mut places: [Option<Vec<usize>>; 5] = Default::default();
    for (place, columns) in places.iter_mut().zip(COLUMNS) {
        let found: Vec<usize> = columns.iter().filter_map(|name| header.iter().position(|own| own == name)).collect();
        let times = |name: &&str| header.iter().filter(|own| own == name).count();
        if let Some(name) = columns.iter().find(|name| times(name) > 1) {
            return wrong(head, format!("there are two columns `{name}`"));
        }
        if !found.is_empty() && found.len() < columns.len() {
            return wrong(head, format!("some of the columns {} are missing", columns.join(", ")));
        }
        *place = (!found.is_empty()).then_some(found);
    }
    let [Some(time), shifts, positions, turns, orientations] = places else {
        return wrong(head, "there must be a column `time_s`".to_owned());
    };
    if shifts.is_some() && positions.is_some() || turns.is_some() && orientations.is_some() {
        return wrong(head, "give either shifts or positions, and either turns or quaternions".to_owned());
    }
    if shifts.is_none() && positions.is_none() && turns.is_none() && orientations.is_none() {
        return wrong(head, "there must be columns of what moves beside `time_s`".to_owned());
    }
    let (mut times, mut way, mut vectors, mut quaternions) = (Vec::<f64>::new(), Vec::new(), Vec::new(), Vec::new());
    let way_columns = shifts.as_ref().or(positions.as_ref());
    let mut record = csv::StringRecord::new();
    loop {
        match reader.read_record(&mut record) {
            Ok(true) => {}
            Ok(false) => break,
            Err(error) => {
                let line = error.position().map_or(1, |place| place.line() as usize);
                return wrong(line, "this row has not as many values as the header has columns".to_owned());
            }
        }
        let line = record.position().map_or(1, |place| place.line() as usize);
        let number = |column: usize| match record[column].parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(format!("{} = {:.40}, but it must be a finite number", header[column], &record[column])),
        };
        let row = |columns: &[usize]| {
            columns.iter().map(|&column| number(column)).collect::<std::result::Result<Vec<_>, _>>()
        };
        let vector = |columns: &[usize]| row(columns).map(|v| Vector3::new(v[0], v[1], v[2]));
        let mut take = || {
            let now = number(time[0])?;
            if now < 0.0 {
                return Err(format!("time_s = {now}, but it must be >= 0"));
            }
            if times.last().is_some_and(|&before| now <= before) {
                return Err(format!("time_s = {now}, but it must be later than the time before it"));
            }
            let place = way_columns.map(|columns| vector(columns)).transpose()?;
            let turn = turns.as_ref().map(|columns| vector(columns)).transpose()?;
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
                let q = row(columns)?;
                let turn = unit([q[0], q[1], q[2], q[3]]);
                quaternions.push(turn.ok_or_else(|| "qw, qx, qy, qz must be of norm 1 to within 1e-3".to_owned())?);
            }
            Ok(())
        };
        if let Err(message) = take() {
            return wrong(line, message);
        }
    }
    if times.is_empty() {
        return wrong(head, "there must be at least one row of numbers".to_owned());
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

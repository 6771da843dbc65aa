//! From a curve in a file to its nodes.

use nalgebra::Vector3;
use rod::shape;
use toml::Spanned;

use crate::columns::{self, Table};
use crate::error::{Result, Source, mistaken};
use crate::format::{Between, Curve};
use crate::refine::Refinement;
use crate::{MAX_SEGMENTS, usd};

/// Columns of a table, by the unit of length that they are in, and that unit [m].
const COLUMNS: [(&[&str], f64); 3] =
    [(&["x_m", "y_m", "z_m"], 1.0), (&["x_cm", "y_cm", "z_cm"], 1e-2), (&["x_mm", "y_mm", "z_mm"], 1e-3)];

impl Curve {
    /// Number of segments, before refinement.
    pub(crate) fn count(&self, source: &Source) -> Result<usize> {
        let (points, least) = (self.points(source)?.len(), if self.closed { 3 } else { 1 });
        match &self.segments {
            Some(segments) => source.count(segments, least, MAX_SEGMENTS),
            None => Ok(points - usize::from(!self.closed)),
        }
    }

    /// Nodes [m] of `count` segments, the first of them `at` a place if it is given.
    pub(crate) fn nodes(
        &self,
        source: &Source,
        at: Option<Vector3<f64>>,
        refinement: Refinement,
        count: usize,
    ) -> Result<Vec<Vector3<f64>>> {
        let points = self.points(source)?;
        let between = self.interpolation.as_ref().map(|key| *key.get_ref());
        if let (Some(key), None) = (&self.interpolation, &self.segments) {
            return source.wrong(key.span(), "goes with `segments`; without it there is one segment between two rows");
        }
        let nodes = match &self.segments {
            Some(_) => shape::resample(points, self.closed, between.unwrap_or_default() == Between::Smooth, count),
            None => refinement.cut(points, self.closed),
        };
        let shift = at.map_or(Vector3::zeros(), |at| at - nodes[0]);
        Ok(nodes.into_iter().map(|node| node + shift).collect())
    }

    /// The file's points [m].
    fn points(&self, source: &Source) -> Result<&[Vector3<f64>]> {
        if let Some(points) = self.points.get() {
            return Ok(points);
        }
        let points = source.of_file(self.file.span(), self.read(source))?;
        Ok(self.points.get_or_init(|| points))
    }

    /// The same, from the file itself.
    fn read(&self, source: &Source) -> Result<Vec<Vector3<f64>>> {
        let (path, file) = columns::place(source, &self.file, "a CSV or USD file")?;
        let bytes = columns::bytes(&path, &file)?;
        if bytes.starts_with(usd::BINARY) {
            return Err(mistaken(&file, (1, usd::NO_BINARY.to_owned())));
        }
        let text = columns::utf_8(bytes, &file)?;
        if text.starts_with(usd::TEXT) {
            let curve = self.curve.as_ref().map(|curve| source.count(curve, 0, MAX_SEGMENTS)).transpose()?;
            let prim = self.prim.as_ref().map(|prim| prim.get_ref().as_str());
            return usd::read(&text, &file, usd::Wanted { prim, curve, closed: self.closed });
        }
        let of_usd = self.prim.as_ref().map(Spanned::span).or_else(|| self.curve.as_ref().map(Spanned::span));
        match of_usd {
            Some(span) => source.wrong(span, "goes with a USD file as text, whose first line is `#usda 1.0`"),
            None => read(&text, &file, self.closed),
        }
    }
}

/// The points [m] in a table's text; `file` stands in errors.
fn read(text: &str, file: &str, closed: bool) -> Result<Vec<Vector3<f64>>> {
    let mut table = Table::new(text, file, &COLUMNS.map(|(names, _)| names))?;
    let mut found = Vec::new();
    for (names, unit) in COLUMNS {
        found.extend(table.columns(names)?.map(|columns| (columns, unit)));
    }
    let [(columns, unit)] = &found[..] else {
        return table.wrong("give the columns x_m, y_m, z_m, or those in cm or mm".to_owned());
    };
    let mut points: Vec<Vector3<f64>> = Vec::new();
    table.rows(|row| {
        let point = row.vector(columns)? * *unit;
        if points.last() == Some(&point) {
            return Err("this row is where the row before it is".to_owned());
        }
        points.push(point);
        Ok(())
    })?;
    let least = if closed { 3 } else { 2 };
    if points.len() < least {
        return table.wrong(format!("{} rows, but there must be at least {least}", points.len()));
    }
    if closed && points.first() == points.last() {
        return table
            .wrong("the last row is where the first is; a closed curve closes itself, leave that row out".to_owned());
    }
    Ok(points)
}

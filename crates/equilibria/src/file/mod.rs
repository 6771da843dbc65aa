//! Queries from files, CSV or safetensors, and answers to files.
//!
//! A file that is no table of queries is refused as a whole. A row of which a value is not allowed has its own error, and the
//! others are answered. `table` has what a problem's tables are made of, `columns` what cables and grips have columns for, `writer` the answers.

mod columns;
mod table;
mod writer;

use std::path::Path;

use export::Tensor;
use safetensors::{Dtype, SafeTensors};
use thiserror::Error;

use crate::problem::Problem;

pub(crate) use columns::{CABLE, CableColumns, GRIP, GripColumns, MORE, cable_numbers, grip_numbers};
pub use table::{Header, Row, Tabled};
pub use writer::AnswerWriter;
pub(crate) use writer::wrench_names;

/// Why a file is refused.
#[derive(Debug, Error)]
#[error("{file}: {place}{message}")]
pub struct FileError {
    /// The file.
    pub file: String,
    /// Where in it, as "line 3: "; empty where all of it is meant.
    pub place: String,
    /// What is wrong with it.
    pub message: String,
}

/// A query of each row, or why it is none.
pub type Rows<P> = Vec<Result<<P as Problem>::Query, String>>;

/// The queries in a file: a CSV file, or a safetensors file where it is called so. See `docs/equilibria.md` for the columns.
///
/// # Errors
/// If it cannot be read, a column is missing, not known or there twice, a row has not as many values as the header, a tensor is
/// of another type or of another shape than the others, or there are no rows.
pub fn read<P: Tabled>(path: &Path) -> Result<Rows<P>, FileError> {
    let file = path.display().to_string();
    let wrong = |(place, message)| FileError { file: file.clone(), place, message };
    let cannot = |error: std::io::Error| wrong((String::new(), format!("cannot be read: {error}")));
    if is_tensors(path) {
        let bytes = std::fs::read(path).map_err(cannot)?;
        read_tensors::<P>(&bytes).map_err(|message| wrong((String::new(), message)))
    } else {
        let text = std::fs::read_to_string(path).map_err(cannot)?;
        read_text::<P>(&text).map_err(|(line, message)| wrong((format!("line {line}: "), message)))
    }
}

fn is_tensors(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "safetensors")
}

/// Those in the text of a CSV file; errors with their lines.
fn read_text<P: Tabled>(text: &str) -> Result<Rows<P>, (u64, String)> {
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
    let names = reader.headers().map_err(|error| (1, error.to_string()))?;
    let header = Header::new(names.iter().map(str::to_owned).collect(), &P::names()).map_err(|error| (1, error))?;
    let columns = P::columns(&header).map_err(|error| (1, error))?;
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| {
            let line = error.position().map_or(1, csv::Position::line);
            (line, "this row has not as many values as the header has columns".to_owned())
        })?;
        let value = |column: usize| match &record[column] {
            "" => Ok(None),
            text => text.parse::<f64>().map(Some).map_err(|_| format!("`{text:.40}`")),
        };
        rows.push(P::query(&columns, &Row { header: &header, value: &value }));
    }
    if rows.is_empty() {
        return Err((1, "there are no rows below the header".to_owned()));
    }
    Ok(rows)
}

/// Those in the bytes of a safetensors file: a tensor a column, named as in a CSV file, of f64 or f32 [rows]. The second grip of a
/// cable is none where all of its numbers are NaN.
fn read_tensors<P: Tabled>(bytes: &[u8]) -> Result<Rows<P>, String> {
    let tensors = SafeTensors::deserialize(bytes).map_err(|error| format!("is no safetensors file: {error}"))?;
    let mut names: Vec<String> = tensors.names().into_iter().map(str::to_owned).collect();
    names.sort();
    let as_tensor = |message: String| message.replace("column", "tensor");
    let header = Header::new(names, &P::names()).map_err(as_tensor)?;
    let columns = P::columns(&header).map_err(as_tensor)?;
    let mut values: Vec<Vec<f64>> = Vec::new();
    for name in &header.0 {
        let tensor = tensors.tensor(name).map_err(|error| format!("tensor `{name}`: {error}"))?;
        let own: Vec<f64> = match tensor.dtype() {
            Dtype::F64 => tensor.data().as_chunks().0.iter().map(|&x| f64::from_le_bytes(x)).collect(),
            Dtype::F32 => tensor.data().as_chunks().0.iter().map(|&x| f64::from(f32::from_le_bytes(x))).collect(),
            other => return Err(format!("tensor `{name}` is of {other:?}, but it must be of F64 or F32")),
        };
        let rows = values.first().map_or(own.len(), Vec::len);
        if tensor.shape() != [rows] || rows == 0 {
            let shape = tensor.shape();
            return Err(format!("tensor `{name}` has the shape {shape:?}, but it must be [rows], the same in all"));
        }
        values.push(own);
    }
    let may_be_none: Vec<bool> = header.0.iter().map(|name| name.starts_with(columns::END)).collect();
    let row = |row: usize| {
        let value = |column: usize| Ok(Some(values[column][row]).filter(|x| !(x.is_nan() && may_be_none[column])));
        P::query(&columns, &Row { header: &header, value: &value })
    };
    Ok((0..values.first().map_or(0, Vec::len)).map(row).collect())
}

/// The bytes of a file of this name with these queries: CSV, or safetensors where it is called so.
///
/// # Errors
/// If they are too many for the format.
pub fn bytes<P: Tabled>(queries: &[P::Query], path: &Path) -> std::io::Result<Vec<u8>> {
    let (names, rows) = (P::names(), queries.iter().map(P::query_numbers));
    if !is_tensors(path) {
        let mut text = names.join(",") + "\n";
        for row in rows {
            let cell = |x: f64| if x.is_nan() { String::new() } else { x.to_string() };
            text += &row.into_iter().map(cell).collect::<Vec<_>>().join(",");
            text.push('\n');
        }
        return Ok(text.into_bytes());
    }
    let rows: Vec<Vec<f64>> = rows.collect();
    let column = |k: usize| rows.iter().flat_map(|row| row[k].to_le_bytes()).collect();
    let tensor = |k: usize| Tensor { dtype: Dtype::F64, shape: vec![rows.len()], bytes: column(k) };
    let tensors: Vec<(&String, Tensor)> = names.iter().enumerate().map(|(k, name)| (name, tensor(k))).collect();
    safetensors::serialize(tensors.iter().map(|(name, tensor)| (name, tensor)), None).map_err(std::io::Error::other)
}

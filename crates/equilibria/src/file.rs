//! Queries from files, CSV or safetensors, and answers to files.
//!
//! A file that is no table of queries is refused as a whole. A row of which a value is not allowed has its own error, and the
//! others are answered.

use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;

use export::{ExportError, TableWriter, Tensor, write_atomically};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use safetensors::{Dtype, SafeTensors};
use thiserror::Error;

use crate::answer::{Answer, Equilibrium};
use crate::query::{Cable, Carried, Grip, Query};

/// Columns that each file has.
const CABLE: [&str; 4] = ["length_m", "ei_n_m2", "gj_n_m2", "weight_n_m"];
const START: [&str; 7] = ["start_x_m", "start_y_m", "start_z_m", "start_qw", "start_qx", "start_qy", "start_qz"];
/// Those of the second grip: all or none, and in a row with a free end all are empty.
const END: [&str; 7] = ["end_x_m", "end_y_m", "end_z_m", "end_qw", "end_qx", "end_qy", "end_qz"];
/// Columns that may be missing: a second bending stiffness, the rest shape, the compliance of a joint, and a weight at a place.
const MORE: [&str; 7] =
    ["ei2_n_m2", "curvature1_1_m", "curvature2_1_m", "twist_1_m", "stretch_m_n", "carried_n", "carried_at_m"];

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

/// A row: a query, or why it is none.
pub type Row = Result<Query, String>;

/// Where the columns are.
struct Columns {
    cable: [usize; 4],
    start: [usize; 7],
    end: Option<[usize; 7]>,
    more: [Option<usize>; 7],
}

/// The queries in the text of a CSV file; `file` stands in errors. See `docs/equilibria.md` for the columns.
///
/// # Errors
/// If a column is missing, not known or there twice, or a row has not as many values as the header.
pub fn read(text: &str, file: &str) -> Result<Vec<Row>, FileError> {
    let wrong = |line: u64, message| FileError { file: file.to_owned(), place: format!("line {line}: "), message };
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
    let header: Vec<String> = match reader.headers() {
        Ok(header) => header.iter().map(str::to_owned).collect(),
        Err(error) => return Err(wrong(1, error.to_string())),
    };
    let columns = Columns::new(&header).map_err(|message| wrong(1, message))?;
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| {
            let line = error.position().map_or(1, csv::Position::line);
            wrong(line, "this row has not as many values as the header has columns".to_owned())
        })?;
        let value = |column: usize| match &record[column] {
            "" => Ok(None),
            text => text.parse::<f64>().map(Some).map_err(|_| format!("`{text:.40}`")),
        };
        rows.push(columns.query(&header, &value));
    }
    if rows.is_empty() {
        return Err(wrong(1, "there are no rows below the header".to_owned()));
    }
    Ok(rows)
}

/// The queries in the bytes of a safetensors file: a tensor a column, named as in a CSV file, of f64 or f32 [rows]. An end is free
/// where all of its numbers are NaN.
///
/// # Errors
/// If it is no such file, a tensor is missing, not known, of another type or of another shape than the others.
pub fn read_tensors(bytes: &[u8], file: &str) -> Result<Vec<Row>, FileError> {
    let wrong = |message: String| FileError { file: file.to_owned(), place: String::new(), message };
    let tensors = SafeTensors::deserialize(bytes).map_err(|error| wrong(format!("is no safetensors file: {error}")))?;
    let mut header: Vec<String> = tensors.names().into_iter().map(str::to_owned).collect();
    header.sort();
    let columns = Columns::new(&header).map_err(|message| wrong(message.replace("column", "tensor")))?;
    let mut values: Vec<Vec<f64>> = Vec::new();
    for name in &header {
        let tensor = tensors.tensor(name).map_err(|error| wrong(format!("tensor `{name}`: {error}")))?;
        let own: Vec<f64> = match tensor.dtype() {
            Dtype::F64 => tensor.data().as_chunks().0.iter().map(|&x| f64::from_le_bytes(x)).collect(),
            Dtype::F32 => tensor.data().as_chunks().0.iter().map(|&x| f64::from(f32::from_le_bytes(x))).collect(),
            other => return Err(wrong(format!("tensor `{name}` is of {other:?}, but it must be of F64 or F32"))),
        };
        let rows = values.first().map_or(own.len(), Vec::len);
        if tensor.shape() != [rows] || rows == 0 {
            let shape = tensor.shape();
            return Err(wrong(format!(
                "tensor `{name}` has the shape {shape:?}, but it must be [rows], the same in all"
            )));
        }
        values.push(own);
    }
    let is_end: Vec<bool> = header.iter().map(|name| END.contains(&name.as_str())).collect();
    let row = |row: usize| {
        let value = |column: usize| Ok(Some(values[column][row]).filter(|x| !(x.is_nan() && is_end[column])));
        columns.query(&header, &value)
    };
    Ok((0..values.first().map_or(0, Vec::len)).map(row).collect())
}

impl Columns {
    fn new(header: &[String]) -> Result<Self, String> {
        let known = || CABLE.iter().chain(&START).chain(&END).chain(&MORE);
        if let Some(name) = header.iter().find(|name| !known().any(|own| own == name)) {
            let names: Vec<&str> = known().copied().collect();
            return Err(format!("column `{name:.40}` is not known; there are {}", names.join(", ")));
        }
        let mut names = known();
        if let Some(name) = names.find(|own| header.iter().filter(|name| name == *own).count() > 1) {
            return Err(format!("there are two columns `{name}`"));
        }
        let place = |name: &str| header.iter().position(|own| own == name);
        let needed = |name: &str| place(name).ok_or_else(|| format!("column `{name}` is missing"));
        let mut columns = Self { cable: [0; 4], start: [0; 7], end: None, more: MORE.map(place) };
        for (own, name) in columns.cable.iter_mut().zip(CABLE).chain(columns.start.iter_mut().zip(START)) {
            *own = needed(name)?;
        }
        if END.iter().any(|name| place(name).is_some()) {
            let mut end = [0; 7];
            for (own, name) in end.iter_mut().zip(END) {
                *own = needed(name)?;
            }
            columns.end = Some(end);
        }
        Ok(columns)
    }

    /// The query of a row, of which `value` is a column's number, nothing, or what stands there in the place of a number.
    fn query(&self, header: &[String], value: &dyn Fn(usize) -> Result<Option<f64>, String>) -> Row {
        let number = |column: usize| {
            let wrong = |found: &str| format!("{} = {found}, but it must be a number", header[column]);
            value(column).map_err(|found| wrong(&found))?.ok_or_else(|| wrong("``"))
        };
        let [length, bending, torsion, weight] = self.cable;
        let mut cable = Cable::new(number(length)?, number(bending)?, number(torsion)?, number(weight)?);
        let is_there = |column: &usize| !matches!(value(*column), Ok(None));
        let more = |k: usize| self.more[k].filter(is_there).map(number).transpose();
        if let Some(second) = more(0)? {
            cable.bending[1] = second;
        }
        cable.rest = Vector3::new(more(1)?.unwrap_or(0.0), more(2)?.unwrap_or(0.0), more(3)?.unwrap_or(0.0));
        if let Some(compliance) = more(4)? {
            cable.stretch_compliance = compliance;
        }
        cable.carried = Carried { weight: more(5)?.unwrap_or(0.0), place: more(6)?.unwrap_or(0.0) };
        let grip = |columns: [usize; 7]| -> Result<Grip, String> {
            let mut values = [0.0; 7];
            for (value, column) in values.iter_mut().zip(columns) {
                *value = number(column)?;
            }
            let [x, y, z, qw, qx, qy, qz] = values;
            let orientation = UnitQuaternion::new_unchecked(Quaternion::new(qw, qx, qy, qz));
            Ok(Grip { position: Vector3::new(x, y, z), orientation })
        };
        let held = self.end.filter(|end| end.iter().any(is_there));
        let query = Query { cable, start: grip(self.start)?, end: held.map(grip).transpose()? };
        query.validate().map_err(|error| error.to_string())?;
        Ok(query)
    }
}

/// The text of a CSV file with these queries.
pub fn text(queries: &[Query]) -> String {
    let names: Vec<&str> = CABLE.iter().chain(&MORE).chain(&START).chain(&END).copied().collect();
    let mut text = names.join(",") + "\n";
    let grip = |grip: &Grip| {
        let (x, q) = (grip.position, grip.orientation);
        format!("{},{},{},{},{},{},{}", x.x, x.y, x.z, q.w, q.i, q.j, q.k)
    };
    for Query { cable, start, end } in queries {
        let Cable { length, bending: [first, second], torsion, weight, rest, stretch_compliance, carried } = cable;
        let _ = writeln!(
            text,
            "{length},{first},{torsion},{weight},{second},{},{},{},{stretch_compliance},{},{},{},{}",
            rest.x,
            rest.y,
            rest.z,
            carried.weight,
            carried.place,
            grip(start),
            end.as_ref().map_or_else(|| ",".repeat(6), grip)
        );
    }
    text
}

/// Columns of the table of answers.
const ANSWERS: &str = "row,status,branch,energy_j,stable,residual,solves,coarse_solves,\
    start_fx_n,start_fy_n,start_fz_n,start_mx_n_m,start_my_n_m,start_mz_n_m,\
    end_fx_n,end_fy_n,end_fz_n,end_mx_n_m,end_my_n_m,end_mz_n_m";

/// Answers on their way to the disk: `answers.csv` with a line an equilibrium, or for a row without one, and `shapes.safetensors`
/// with `row` and `branch` [answers], `positions` [answers, segments, 3] (centres, m) and `orientations` [answers, segments, 4]
/// (x, y, z, w), f64 and i64.
pub struct AnswerWriter {
    table: TableWriter,
    shapes: std::path::PathBuf,
    segments: usize,
    rows: Vec<u8>,
    branches: Vec<u8>,
    positions: Vec<u8>,
    orientations: Vec<u8>,
}

impl AnswerWriter {
    /// Begins both files in a folder that exists; `suffix` ends their names.
    ///
    /// # Errors
    /// If the folder cannot be written to.
    pub fn create(folder: &Path, suffix: &str, segments: usize) -> Result<Self, ExportError> {
        let table = TableWriter::create(&folder.join(format!("answers{suffix}.csv")), ANSWERS)?;
        let shapes = folder.join(format!("shapes{suffix}.safetensors"));
        let none = Vec::new;
        Ok(Self { table, shapes, segments, rows: none(), branches: none(), positions: none(), orientations: none() })
    }

    /// Adds the answer to row `row`, counted from 0 below the header.
    ///
    /// # Errors
    /// If the disk does not take it.
    pub fn add(&mut self, row: usize, answer: &Result<Answer, String>) -> Result<(), ExportError> {
        match answer {
            Err(message) => {
                let message = message.replace('"', "'");
                self.table.add(|out| writeln!(out, "{row},\"{message}\"{}", ",".repeat(18)))
            }
            Ok(Answer { equilibria, solves, coarse_solves }) => {
                let solves = [*solves, *coarse_solves];
                equilibria.iter().enumerate().try_for_each(|(branch, own)| self.add_one(row, branch, own, solves))
            }
        }
    }

    fn add_one(&mut self, row: usize, branch: usize, own: &Equilibrium, solves: [u32; 2]) -> Result<(), ExportError> {
        let [start, end] = &own.grips;
        let numbers = [start.force, start.moment, end.force, end.moment];
        let numbers: Vec<String> = numbers.iter().flat_map(|v| v.iter().map(|x| x.to_string())).collect();
        let (energy, residual, [fine, coarse]) = (own.energy, own.residual, solves);
        let numbers = numbers.join(",");
        self.table
            .add(|out| writeln!(out, "{row},found,{branch},{energy},1,{residual:e},{fine},{coarse},{numbers}"))?;
        let index = |k: usize| i64::try_from(k).unwrap_or(i64::MAX).to_le_bytes();
        self.rows.extend(index(row));
        self.branches.extend(index(branch));
        for x in &own.positions {
            self.positions.extend(x.iter().flat_map(|x| x.to_le_bytes()));
        }
        for q in &own.orientations {
            self.orientations.extend([q.i, q.j, q.k, q.w].into_iter().flat_map(f64::to_le_bytes));
        }
        Ok(())
    }

    /// Gives both files their names, when all is on the disk.
    ///
    /// # Errors
    /// If the disk does not take it.
    pub fn finish(self) -> Result<(), ExportError> {
        let Self { table, shapes, segments, rows, branches, positions, orientations } = self;
        let count = rows.len() / 8;
        let tensor = |dtype, shape: &[usize], bytes| Tensor { dtype, shape: shape.to_vec(), bytes };
        let tensors = [
            ("branch", tensor(Dtype::I64, &[count], branches)),
            ("orientations", tensor(Dtype::F64, &[count, segments, 4], orientations)),
            ("positions", tensor(Dtype::F64, &[count, segments, 3], positions)),
            ("row", tensor(Dtype::I64, &[count], rows)),
        ];
        let bytes = safetensors::serialize(tensors.iter().map(|(name, tensor)| (*name, tensor)), None);
        write_atomically(&shapes, |out| out.write_all(&bytes.map_err(std::io::Error::other)?))?;
        table.finish()
    }
}

//! Branched queries from CSV files, and answers to files.
//!
//! A file that is no table of queries is refused as a whole. A row of which a value is not allowed has its own error, and the
//! others are answered.

use std::fmt::Write as _;
use std::io::Write;
use std::path::{Path, PathBuf};

use export::{ExportError, TableWriter, Tensor, write_atomically};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use safetensors::Dtype;

use super::answer::{BranchedAnswer, BranchedEquilibrium};
use super::query::{ARMS, BranchedQuery};
use crate::file::FileError;
use crate::query::{Cable, Grip};

/// What each arm has a column for, after `armK_`, and each grip, after `gripK_`; K from 1.
const ARM: [&str; 4] = ["length_m", "ei_n_m2", "gj_n_m2", "weight_n_m"];
const GRIP: [&str; 7] = ["x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"];
/// Columns of a wrench.
const WRENCH: [&str; 6] = ["fx_n", "fy_n", "fz_n", "mx_n_m", "my_n_m", "mz_n_m"];

/// A row: a branched query, or why it is none.
pub type Row = Result<BranchedQuery, String>;

/// Names of the columns, arm after arm.
fn names() -> Vec<String> {
    let of = |k: usize| {
        let arm = ARM.iter().map(move |name| format!("arm{k}_{name}"));
        arm.chain(GRIP.iter().map(move |name| format!("grip{k}_{name}")))
    };
    (1..=ARMS).flat_map(of).collect()
}

/// The branched queries in the text of a CSV file; `file` stands in errors. See `docs/equilibria.md` for the columns.
///
/// # Errors
/// If a column is missing, not known or there twice, a row has not as many values as the header, or there is none.
pub fn read(text: &str, file: &str) -> Result<Vec<Row>, FileError> {
    let wrong = |line: u64, message| FileError { file: file.to_owned(), place: format!("line {line}: "), message };
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
    let header: Vec<String> = match reader.headers() {
        Ok(header) => header.iter().map(str::to_owned).collect(),
        Err(error) => return Err(wrong(1, error.to_string())),
    };
    let names = names();
    if let Some(name) = header.iter().find(|name| !names.contains(name)) {
        return Err(wrong(1, format!("column `{name:.40}` is not known; there are {}", names.join(", "))));
    }
    let mut columns = Vec::with_capacity(names.len());
    for name in &names {
        let mut places = (0..header.len()).filter(|&k| header[k] == *name);
        match (places.next(), places.next()) {
            (Some(place), None) => columns.push(place),
            (None, _) => return Err(wrong(1, format!("column `{name}` is missing"))),
            _ => return Err(wrong(1, format!("there are two columns `{name}`"))),
        }
    }
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| {
            let line = error.position().map_or(1, csv::Position::line);
            wrong(line, "this row has not as many values as the header has columns".to_owned())
        })?;
        let value = |k: usize| {
            let text = &record[columns[k]];
            let number = text.parse::<f64>();
            number.map_err(|_| format!("{} = `{text:.40}`, but it must be a number", names[k]))
        };
        rows.push(query(&value));
    }
    if rows.is_empty() {
        return Err(wrong(1, "there are no rows below the header".to_owned()));
    }
    Ok(rows)
}

/// The query of a row, of which `value` is a column's number, in the order of [`names`].
fn query(value: &dyn Fn(usize) -> Result<f64, String>) -> Row {
    let mut arms = [Cable::new(1.0, 1.0, 1.0, 0.0); ARMS];
    let mut grips = [Grip { position: Vector3::zeros(), orientation: UnitQuaternion::identity() }; ARMS];
    for k in 0..ARMS {
        let mut own = [0.0; ARM.len() + GRIP.len()];
        for (c, x) in own.iter_mut().enumerate() {
            *x = value(k * (ARM.len() + GRIP.len()) + c)?;
        }
        let [length, bending, torsion, weight, x, y, z, qw, qx, qy, qz] = own;
        arms[k] = Cable::new(length, bending, torsion, weight);
        let orientation = UnitQuaternion::new_unchecked(Quaternion::new(qw, qx, qy, qz));
        grips[k] = Grip { position: Vector3::new(x, y, z), orientation };
    }
    let query = BranchedQuery { arms, grips };
    query.validate().map_err(|error| error.to_string())?;
    Ok(query)
}

/// The text of a CSV file with these queries.
pub fn text(queries: &[BranchedQuery]) -> String {
    let mut text = names().join(",") + "\n";
    for query in queries {
        for (k, (arm, grip)) in query.arms.iter().zip(&query.grips).enumerate() {
            let (x, q) = (grip.position, grip.orientation);
            let Cable { length, bending: [bending, _], torsion, weight, .. } = arm;
            let before = if k == 0 { "" } else { "," };
            let _ = write!(text, "{before}{length},{bending},{torsion},{weight}");
            let _ = write!(text, ",{},{},{},{},{},{},{}", x.x, x.y, x.z, q.w, q.i, q.j, q.k);
        }
        text.push('\n');
    }
    text
}

/// Answers on their way to the disk: `answers.csv` with a line an equilibrium, or for a row without one, and `shapes.safetensors`
/// with `row` and `branch` [answers], `positions` [answers, 3, segments, 3] (centres, m) and `orientations` [answers, 3,
/// segments, 4] (x, y, z, w), f64 and i64.
pub struct BranchedWriter {
    table: TableWriter,
    shapes: PathBuf,
    segments: usize,
    numbers: usize,
    rows: Vec<u8>,
    branches: Vec<u8>,
    positions: Vec<u8>,
    orientations: Vec<u8>,
}

impl BranchedWriter {
    /// Begins both files in a folder that exists; `suffix` ends their names.
    ///
    /// # Errors
    /// If the folder cannot be written to.
    pub fn create(folder: &Path, suffix: &str, segments: usize) -> Result<Self, ExportError> {
        let mut header = "row,status,branch,energy_j,stable,residual,solves,coarse_solves".to_owned();
        for name in GRIP {
            let _ = write!(header, ",junction_{name}");
        }
        for k in 1..=ARMS {
            for end in ["grip", "junction"] {
                for name in WRENCH {
                    let _ = write!(header, ",{end}{k}_{name}");
                }
            }
        }
        let numbers = header.matches(',').count() - 1;
        let table = TableWriter::create(&folder.join(format!("answers{suffix}.csv")), &header)?;
        let shapes = folder.join(format!("shapes{suffix}.safetensors"));
        let none = Vec::new;
        let [rows, branches, positions, orientations] = [none(), none(), none(), none()];
        Ok(Self { table, shapes, segments, numbers, rows, branches, positions, orientations })
    }

    /// Adds the answer to row `row`, counted from 0 below the header.
    ///
    /// # Errors
    /// If the disk does not take it.
    pub fn add(&mut self, row: usize, answer: &Result<BranchedAnswer, String>) -> Result<(), ExportError> {
        match answer {
            Err(message) => {
                let (message, rest) = (message.replace('"', "'"), ",".repeat(self.numbers));
                self.table.add(|out| writeln!(out, "{row},\"{message}\"{rest}"))
            }
            Ok(BranchedAnswer { equilibria, solves, coarse_solves }) => {
                let solves = [*solves, *coarse_solves];
                equilibria.iter().enumerate().try_for_each(|(branch, own)| self.add_one(row, branch, own, solves))
            }
        }
    }

    fn add_one(
        &mut self,
        row: usize,
        branch: usize,
        own: &BranchedEquilibrium,
        [fine, coarse]: [u32; 2],
    ) -> Result<(), ExportError> {
        let (x, q) = (own.junction.position, own.junction.orientation);
        let mut numbers = vec![x.x, x.y, x.z, q.w, q.i, q.j, q.k];
        let wrenches = own.arms.iter().flat_map(|arm| &arm.grips);
        numbers.extend(wrenches.flat_map(|own| own.force.iter().chain(own.moment.iter()).copied().collect::<Vec<_>>()));
        let numbers: Vec<String> = numbers.iter().map(f64::to_string).collect();
        let (energy, residual, numbers) = (own.energy, own.residual, numbers.join(","));
        self.table
            .add(|out| writeln!(out, "{row},found,{branch},{energy},1,{residual:e},{fine},{coarse},{numbers}"))?;
        let index = |k: usize| i64::try_from(k).unwrap_or(i64::MAX).to_le_bytes();
        self.rows.extend(index(row));
        self.branches.extend(index(branch));
        for arm in &own.arms {
            self.positions.extend(arm.positions.iter().flat_map(|x| [x.x, x.y, x.z]).flat_map(f64::to_le_bytes));
            let parts = arm.orientations.iter().flat_map(|q| [q.i, q.j, q.k, q.w]);
            self.orientations.extend(parts.flat_map(f64::to_le_bytes));
        }
        Ok(())
    }

    /// Gives both files their names, when all is on the disk.
    ///
    /// # Errors
    /// If the disk does not take it.
    pub fn finish(self) -> Result<(), ExportError> {
        let Self { table, shapes, segments, rows, branches, positions, orientations, .. } = self;
        let count = rows.len() / 8;
        let tensor = |dtype, shape: &[usize], bytes| Tensor { dtype, shape: shape.to_vec(), bytes };
        let tensors = [
            ("branch", tensor(Dtype::I64, &[count], branches)),
            ("orientations", tensor(Dtype::F64, &[count, ARMS, segments, 4], orientations)),
            ("positions", tensor(Dtype::F64, &[count, ARMS, segments, 3], positions)),
            ("row", tensor(Dtype::I64, &[count], rows)),
        ];
        let bytes = safetensors::serialize(tensors.iter().map(|(name, tensor)| (*name, tensor)), None);
        write_atomically(&shapes, |out| out.write_all(&bytes.map_err(std::io::Error::other)?))?;
        table.finish()
    }
}

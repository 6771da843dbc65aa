//! Answers on their way to the disk.

use std::io::Write;
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

use export::{ExportError, TableWriter, Tensor, write_atomically};
use safetensors::Dtype;

use super::table::Tabled;
use crate::answer::Answer;

/// Columns of each table of answers.
const FIRST: [&str; 8] = ["row", "status", "branch", "energy_j", "stable", "residual", "solves", "coarse_solves"];

/// Names of the columns of a force and a moment on something.
pub(crate) fn wrench_names(on: &str) -> [String; 6] {
    ["fx_n", "fy_n", "fz_n", "mx_n_m", "my_n_m", "mz_n_m"].map(|name| format!("{on}_{name}"))
}

/// Writes `answers.csv` with a line an equilibrium, or for a row without one, and `shapes.safetensors` with `row` and `branch`
/// [answers], `positions` [answers, segments, 3] (centres, m) and `orientations` [answers, segments, 4] (x, y, z, w), f64 and i64;
/// of cables with three arms [answers, 3, segments, ..].
pub struct AnswerWriter<P> {
    table: TableWriter,
    shapes: PathBuf,
    segments: usize,
    columns: usize,
    rows: Vec<u8>,
    branches: Vec<u8>,
    positions: Vec<u8>,
    orientations: Vec<u8>,
    of: PhantomData<P>,
}

impl<P: Tabled> AnswerWriter<P> {
    /// Begins both files in a folder that exists; `suffix` ends their names.
    ///
    /// # Errors
    /// If the folder cannot be written to.
    pub fn create(folder: &Path, suffix: &str, segments: usize) -> Result<Self, ExportError> {
        let names: Vec<String> = FIRST.into_iter().map(str::to_owned).chain(P::answer_names()).collect();
        let table = TableWriter::create(&folder.join(format!("answers{suffix}.csv")), &names.join(","))?;
        let shapes = folder.join(format!("shapes{suffix}.safetensors"));
        let none = Vec::new;
        let [rows, branches, positions, orientations] = [none(), none(), none(), none()];
        let columns = names.len();
        Ok(Self { table, shapes, segments, columns, rows, branches, positions, orientations, of: PhantomData })
    }

    /// Adds the answer to row `row`, counted from 0 below the header.
    ///
    /// # Errors
    /// If the disk does not take it.
    pub fn add(&mut self, row: usize, answer: &Result<Answer<P::Equilibrium>, String>) -> Result<(), ExportError> {
        match answer {
            Err(message) => {
                let (message, rest) = (message.replace('"', "'"), ",".repeat(self.columns - 2));
                self.table.add(|out| writeln!(out, "{row},\"{message}\"{rest}"))
            }
            Ok(Answer { equilibria, solves, coarse_solves, .. }) => {
                let solves = [*solves, *coarse_solves];
                equilibria.iter().enumerate().try_for_each(|(branch, own)| self.add_one(row, branch, own, solves))
            }
        }
    }

    fn add_one(
        &mut self,
        row: usize,
        branch: usize,
        own: &P::Equilibrium,
        [fine, coarse]: [u32; 2],
    ) -> Result<(), ExportError> {
        let numbers: Vec<String> = P::answer_numbers(own).iter().map(f64::to_string).collect();
        let (energy, residual, numbers) = (P::energy(own), P::residual(own), numbers.join(","));
        self.table
            .add(|out| writeln!(out, "{row},found,{branch},{energy},1,{residual:e},{fine},{coarse},{numbers}"))?;
        let index = |k: usize| i64::try_from(k).unwrap_or(i64::MAX).to_le_bytes();
        self.rows.extend(index(row));
        self.branches.extend(index(branch));
        for cable in P::cables(own) {
            self.positions.extend(cable.positions.iter().flat_map(|x| [x.x, x.y, x.z]).flat_map(f64::to_le_bytes));
            let parts = cable.orientations.iter().flat_map(|q| [q.i, q.j, q.k, q.w]);
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
        let of_segments = |size| [&[count], P::SHAPE, &[segments, size]].concat();
        let tensors = [
            ("branch", tensor(Dtype::I64, &[count], branches)),
            ("orientations", tensor(Dtype::F64, &of_segments(4), orientations)),
            ("positions", tensor(Dtype::F64, &of_segments(3), positions)),
            ("row", tensor(Dtype::I64, &[count], rows)),
        ];
        let bytes = safetensors::serialize(tensors.iter().map(|(name, tensor)| (*name, tensor)), None);
        write_atomically(&shapes, |out| out.write_all(&bytes.map_err(std::io::Error::other)?))?;
        table.finish()
    }
}

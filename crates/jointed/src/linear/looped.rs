//! The direct solver for graphs with loops (rings, nets): sparse Cholesky of the dual system, in world rows.

use crate::linear::dual::{joint_coupling, joint_diagonal};
use crate::linear::sparse::{SparseCholesky, SparseError};
use crate::system::System;
use crate::topology::Topology;
use kernels::Spatial;

type Block = [[f64; 6]; 6];

/// Sparse Cholesky over the joints of any graph.
pub struct Looped {
    cholesky: SparseCholesky,
    /// Pairs of joints and the body through which they are coupled; two joints may share two bodies.
    couplings: Vec<Coupling>,
    diagonal: Vec<Block>,
    off_diagonal: Vec<Block>,
    /// The blocks of which the factor is, and how factoring them ended; `None` before.
    factored: [Vec<Block>; 2],
    result: Option<Result<(), SparseError>>,
    rhs: Vec<[f64; 6]>,
}

struct Coupling {
    row: u32,
    column: u32,
    via: u32,
    /// Index of the off-diagonal block.
    block: usize,
}

impl Looped {
    /// Orders the joints and analyses the factor's pattern.
    ///
    /// # Errors
    /// If the factor would be too large.
    pub fn new(topology: &Topology) -> Result<Self, SparseError> {
        let pairs = topology.coupled_pairs();
        let shared = |&row: &u32, &column: &u32| {
            let other = topology.joints[column as usize];
            let free = move |body: &u32| other.contains(body) && !topology.fixed[*body as usize];
            topology.joints[row as usize].into_iter().filter(free)
        };
        let couplings = pairs
            .iter()
            .enumerate()
            .flat_map(|(block, (row, column))| {
                shared(row, column).map(move |via| Coupling { row: *row, column: *column, via, block })
            })
            .collect();
        let (joints, zero) = (topology.joints.len(), [[0.0; 6]; 6]);
        Ok(Self {
            cholesky: SparseCholesky::new(joints, &pairs)?,
            couplings,
            diagonal: vec![zero; joints],
            off_diagonal: vec![zero; pairs.len()],
            factored: [vec![zero; joints], vec![zero; pairs.len()]],
            result: None,
            rhs: vec![[0.0; 6]; joints],
        })
    }

    /// Factors a system's matrix, in world rows, unless it is that of the last time.
    pub(crate) fn factor(&mut self, system: &System<f64>) -> Result<(), SparseError> {
        self.assemble(system);
        let Self { cholesky, diagonal, off_diagonal, factored, result, .. } = self;
        match result {
            Some(result) if [&*diagonal, &*off_diagonal] == [&factored[0], &factored[1]] => result.clone(),
            _ => {
                factored[0].copy_from_slice(diagonal);
                factored[1].copy_from_slice(off_diagonal);
                result.insert(cholesky.factor(diagonal, off_diagonal)).clone()
            }
        }
    }

    /// Solves with the factor made last: `rhs(joint)` in world rows, `take(joint, x)` gets the multipliers of these.
    #[inline(always)]
    pub(crate) fn solve_factored(
        &mut self,
        rhs: impl Fn(usize) -> Spatial<f64>,
        mut take: impl FnMut(usize, Spatial<f64>),
    ) {
        for (joint, own) in self.rhs.iter_mut().enumerate() {
            *own = rhs(joint).to_array();
        }
        self.cholesky.solve(&mut self.rhs);
        for (joint, x) in self.rhs.iter().enumerate() {
            take(joint, Spatial::from_array(*x));
        }
    }

    /// The factor made last.
    pub(crate) fn cholesky(&self) -> &SparseCholesky {
        &self.cholesky
    }

    fn assemble(&mut self, system: &System<f64>) {
        for (joint, block) in self.diagonal.iter_mut().enumerate() {
            *block = joint_diagonal(system, joint as u32);
        }
        self.off_diagonal.fill([[0.0; 6]; 6]);
        for coupling in &self.couplings {
            let part = joint_coupling(system, coupling.row, coupling.column, coupling.via);
            let block = &mut self.off_diagonal[coupling.block];
            for (sum, x) in block.iter_mut().flatten().zip(part.iter().flatten()) {
                *sum += x;
            }
        }
    }
}

//! Sparse Cholesky factorisation `P A P^T = L L^T` of a symmetric positive definite matrix of 6x6 blocks.
//!
//! This is the direct solver for graphs of constraints with loops (rings, nets), where the elimination along a chain or
//! a tree does not apply. It knows matrices only, and nothing of rods: one block row is one joint (stretch-shear and
//! bend-twist), one off-diagonal block is a pair of joints that share a segment.
//!
//! The order of elimination comes from an approximate minimum degree (AMD) ordering of the *blocks*, expanded to their
//! rows, so that a block stays together in one supernode. Ordering and symbolic factorisation happen once, in
//! [`SparseCholesky::new`]; [`SparseCholesky::factor`] and [`SparseCholesky::solve`] run on one thread, allocate
//! nothing and give the same bits for the same input on one machine. One exception: faer's matrix product keeps a
//! workspace for each thread. `new` sees to the one of its own thread; the first `factor` on another thread makes that
//! thread's.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt::factor::LltError;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::amd;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{FaerError, SparseColMatRef, SymbolicSparseColMat};
use faer::{Conj, MatMut, Par, Side};

use super::{B, SparseError};

/// Where one 6x6 block lies among the values of the permuted matrix.
#[derive(Clone, Copy, Debug)]
struct Slot {
    /// Index of the block's first entry.
    start: usize,
    /// Entries of a column, the distance to the block's next column.
    stride: usize,
    /// The permutation moved the block above the diagonal: its transpose is stored.
    transposed: bool,
}

impl Slot {
    fn write(self, block: &[[f64; B]; B], values: &mut [f64]) {
        for c in 0..B {
            let column = &mut values[self.start + c * self.stride..][..B];
            for (r, value) in column.iter_mut().enumerate() {
                *value = if self.transposed { block[c][r] } else { block[r][c] };
            }
        }
    }
}

/// Sparse Cholesky factor of a matrix with a fixed pattern of 6x6 blocks, and all the memory that it needs.
pub struct SparseCholesky {
    /// `order[i]` is the block row that is eliminated as number i.
    pub(super) order: Vec<u32>,
    /// Places of the diagonal blocks [blocks].
    diag_slots: Vec<Slot>,
    /// Places of the off-diagonal blocks [pairs].
    off_slots: Vec<Slot>,
    /// Pattern of the permuted matrix's block lower triangle.
    pattern: SymbolicSparseColMat<u32>,
    /// Values of the permuted matrix.
    values: Vec<f64>,
    pub(super) symbolic: SymbolicCholesky<u32>,
    /// Values of L; NaN while there is no factor.
    pub(super) factor: Vec<f64>,
    /// Right-hand side and solution in the order of elimination [6 blocks].
    permuted: Vec<f64>,
    scratch: MemBuffer,
}

impl SparseCholesky {
    /// Orders and analyses a pattern of `blocks` block rows.
    ///
    /// `pairs` lists the (row, col) block indices, row > col, of the off-diagonal blocks, each once.
    ///
    /// # Errors
    /// [`SparseError::Pair`] for a wrong pair, [`SparseError::TooLarge`] if the factor does not fit.
    pub fn new(blocks: usize, pairs: &[(u32, u32)]) -> Result<Self, SparseError> {
        let too_large = |_: FaerError| SparseError::TooLarge { blocks };
        if blocks.saturating_add(pairs.len()).saturating_mul(B * B) > u32::MAX as usize {
            return Err(SparseError::TooLarge { blocks });
        }
        let (order, position) = block_order(blocks, pairs)?;

        // Block columns of the permuted lower triangle: (column, row, pair), the diagonal first in each column.
        let mut entries: Vec<(u32, u32, Option<usize>)> = (0..blocks as u32).map(|i| (i, i, None)).collect();
        entries.extend(pairs.iter().enumerate().map(|(k, &(row, col))| {
            let (i, j) = (position[row as usize], position[col as usize]);
            (i.min(j), i.max(j), Some(k))
        }));
        entries.sort_unstable();

        let unset = Slot { start: 0, stride: 0, transposed: false };
        let mut diag_slots = vec![unset; blocks];
        let mut off_slots = vec![unset; pairs.len()];
        let (mut col_ptr, mut rows) = (vec![0_u32], Vec::with_capacity(entries.len() * B * B));
        for column in entries.chunk_by(|a, b| a.0 == b.0) {
            let stride = column.len() * B;
            for (nth, &(j, _, pair)) in column.iter().enumerate() {
                let start = rows.len() + nth * B;
                match pair {
                    None => diag_slots[order[j as usize] as usize] = Slot { start, stride, transposed: false },
                    Some(k) => {
                        let transposed = position[pairs[k].1 as usize] != j;
                        off_slots[k] = Slot { start, stride, transposed };
                    }
                }
            }
            for _ in 0..B {
                rows.extend(column.iter().flat_map(|&(_, i, _)| (0..B as u32).map(move |r| i * B as u32 + r)));
                col_ptr.push(rows.len() as u32);
            }
        }
        let values = vec![0.0; rows.len()];
        let pattern = SymbolicSparseColMat::new_checked(blocks * B, blocks * B, col_ptr, None, rows);

        // Supernodal with faer's own relaxation, which is faster on rings and nets than the simplicial form.
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        // Without an ordering of its own the analysis reads the upper triangle, whatever side it is told.
        let upper = pattern.as_ref().transpose().to_col_major().map_err(too_large)?;
        let symbolic = factorize_symbolic_cholesky(upper.as_ref(), Side::Upper, SymmetricOrdering::Identity, params)
            .map_err(too_large)?;

        let scratch = MemBuffer::try_new(StackReq::or(
            symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default()),
            symbolic.solve_in_place_scratch::<f64>(1, Par::Seq),
        ))
        .map_err(|_| SparseError::TooLarge { blocks })?;
        let factor = vec![0.0; symbolic.len_val()];
        let permuted = vec![0.0; blocks * B];
        let mut cholesky = Self { order, diag_slots, off_slots, pattern, values, symbolic, factor, permuted, scratch };
        // Factoring the identity goes through every matrix product, and so makes this thread's workspace for them now.
        let identity = std::array::from_fn(|r| std::array::from_fn(|c| if r == c { 1.0 } else { 0.0 }));
        cholesky.factor(&vec![identity; blocks], &vec![[[0.0; B]; B]; pairs.len()])?;
        cholesky.factor.fill(f64::NAN);
        Ok(cholesky)
    }

    /// Factors the matrix with `diag[i]` on the diagonal, symmetric, of which the lower triangle is read, and `off[k]`
    /// at `pairs[k]`; blocks are row-major.
    ///
    /// # Errors
    /// [`SparseError::NotPositiveDefinite`] if a pivot is not a positive number, [`SparseError::BlockCount`] if the
    /// blocks are not those of the pattern. There is no factor then, and [`SparseCholesky::solve`] gives NaN.
    pub fn factor(&mut self, diag: &[[[f64; B]; B]], off: &[[[f64; B]; B]]) -> Result<(), SparseError> {
        let counts =
            [("diagonal", diag.len(), self.diag_slots.len()), ("off-diagonal", off.len(), self.off_slots.len())];
        for (what, found, expected) in counts {
            if found != expected {
                self.factor.fill(f64::NAN);
                return Err(SparseError::BlockCount { what, found, expected });
            }
        }
        for (slot, block) in self.diag_slots.iter().zip(diag) {
            slot.write(block, &mut self.values);
        }
        for (slot, block) in self.off_slots.iter().zip(off) {
            slot.write(block, &mut self.values);
        }
        let result = self.symbolic.factorize_numeric_llt(
            &mut self.factor,
            SparseColMatRef::new(self.pattern.as_ref(), &self.values),
            Side::Lower,
            Default::default(),
            Par::Seq,
            MemStack::new(&mut self.scratch),
            Default::default(),
        );
        match result {
            Ok(_) => Ok(()),
            Err(LltError::NonPositivePivot { index: pivot }) => {
                self.factor.fill(f64::NAN);
                Err(SparseError::NotPositiveDefinite { block: self.order[pivot / B] as usize })
            }
        }
    }

    /// Solves `A x = rhs` in place, `rhs` being [blocks, 6].
    ///
    /// The solution is NaN as long as no factorisation has succeeded, or if the last one has failed.
    ///
    /// # Panics
    /// If `rhs` does not have one entry for each block row.
    pub fn solve(&mut self, rhs: &mut [[f64; B]]) {
        assert_eq!(rhs.len(), self.order.len(), "a right-hand side needs one entry for each block row");
        for (x, &i) in self.permuted.chunks_exact_mut(B).zip(&self.order) {
            x.copy_from_slice(&rhs[i as usize]);
        }
        let size = self.permuted.len();
        LltRef::new(&self.symbolic, &self.factor).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(&mut self.permuted, size, 1),
            Par::Seq,
            MemStack::new(&mut self.scratch),
        );
        for (x, &i) in self.permuted.chunks_exact(B).zip(&self.order) {
            rhs[i as usize].copy_from_slice(x);
        }
    }
}

/// AMD order of the blocks and its inverse, both [blocks]; checks `pairs`.
fn block_order(blocks: usize, pairs: &[(u32, u32)]) -> Result<(Vec<u32>, Vec<u32>), SparseError> {
    let mut sorted: Vec<(u32, u32, usize)> = Vec::with_capacity(pairs.len());
    for (index, &(row, col)) in pairs.iter().enumerate() {
        if row <= col || row as usize >= blocks {
            return Err(SparseError::Pair { index, row, col, blocks });
        }
        sorted.push((col, row, index));
    }
    sorted.sort_unstable();
    if let Some(twice) = sorted.windows(2).find(|w| (w[0].0, w[0].1) == (w[1].0, w[1].1)) {
        let (col, row, index) = twice[1];
        return Err(SparseError::Pair { index, row, col, blocks });
    }
    let col_ptr = (0..=blocks).map(|j| sorted.partition_point(|e| (e.0 as usize) < j) as u32).collect();
    let rows = sorted.iter().map(|e| e.1).collect();
    let lower = SymbolicSparseColMat::new_checked(blocks, blocks, col_ptr, None, rows);

    let (mut order, mut position) = (vec![0_u32; blocks], vec![0_u32; blocks]);
    let too_large = SparseError::TooLarge { blocks };
    let mut scratch =
        MemBuffer::try_new(amd::order_scratch::<u32>(blocks, pairs.len())).map_err(|_| too_large.clone())?;
    amd::order(&mut order, &mut position, lower.as_ref(), Default::default(), MemStack::new(&mut scratch))
        .map_err(|_| too_large)?;
    Ok((order, position))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    pub(in super::super) type Block = [[f64; B]; B];

    /// Blocks of a random matrix G G^T + I, where G has a block row for each pair (of two blocks) and each block.
    pub(in super::super) fn random_spd(
        blocks: usize,
        pairs: &[(u32, u32)],
        rng: &mut ChaCha8Rng,
    ) -> (Vec<Block>, Vec<Block>) {
        let mut random = || DMatrix::from_fn(B, B, |_, _| rng.random_range(-1.0..1.0));
        let mut diag = vec![DMatrix::identity(B, B); blocks];
        let mut off = Vec::new();
        for &(i, j) in pairs {
            let (gi, gj) = (random(), random());
            diag[i as usize] += &gi * gi.transpose();
            diag[j as usize] += &gj * gj.transpose();
            off.push(&gi * gj.transpose());
        }
        let rows = |m: &DMatrix<f64>| std::array::from_fn(|r| std::array::from_fn(|c| m[(r, c)]));
        (diag.iter().map(rows).collect(), off.iter().map(rows).collect())
    }

    pub(in super::super) fn dense(pairs: &[(u32, u32)], diag: &[Block], off: &[Block]) -> DMatrix<f64> {
        let mut a = DMatrix::zeros(diag.len() * B, diag.len() * B);
        let blocks = diag.iter().enumerate().map(|(i, block)| (i, i, block));
        let off = pairs.iter().zip(off).map(|(&(i, j), block)| (i as usize, j as usize, block));
        for (i, j, block) in blocks.chain(off) {
            for (r, row) in block.iter().enumerate() {
                for (c, &value) in row.iter().enumerate() {
                    a[(i * B + r, j * B + c)] = value;
                    a[(j * B + c, i * B + r)] = value;
                }
            }
        }
        a
    }

    pub(in super::super) fn ring(n: u32) -> Vec<(u32, u32)> {
        (1..n).map(|i| (i, i - 1)).chain([(n - 1, 0)]).collect()
    }

    pub(in super::super) fn net(width: u32, height: u32) -> Vec<(u32, u32)> {
        let right = (0..width * height).filter(|i| i % width > 0).map(|i| (i, i - 1));
        let up = (width..width * height).map(|i| (i, i - width));
        right.chain(up).collect()
    }

    pub(in super::super) fn tree_with_chords(n: u32, rng: &mut ChaCha8Rng) -> Vec<(u32, u32)> {
        let mut pairs: Vec<_> = (1..n).map(|i| (i, rng.random_range(0..i))).collect();
        for _ in 0..n / 3 {
            let i = rng.random_range(1..n);
            pairs.push((i, rng.random_range(0..i)));
        }
        pairs.sort_unstable();
        pairs.dedup();
        pairs
    }

    #[test]
    fn agrees_with_a_dense_factorisation() {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let mut patterns = vec![(1, vec![]), (3, vec![]), (3, ring(3)), (40, ring(40)), (63, net(9, 7))];
        for n in [2, 10, 50] {
            patterns.push((n as usize, tree_with_chords(n, &mut rng)));
        }
        for (blocks, pairs) in patterns {
            let mut cholesky = SparseCholesky::new(blocks, &pairs).unwrap();
            for _ in 0..2 {
                let (diag, off) = random_spd(blocks, &pairs, &mut rng);
                let rhs = DVector::from_fn(blocks * B, |_, _| rng.random_range(-1.0..1.0));
                let expected = dense(&pairs, &diag, &off).cholesky().unwrap().solve(&rhs);
                let mut x: Vec<[f64; B]> = rhs.as_slice().as_chunks().0.to_vec();
                cholesky.factor(&diag, &off).unwrap();
                cholesky.solve(&mut x);
                let error = (DVector::from_column_slice(x.as_flattened()) - &expected).norm() / expected.norm();
                assert!(error < 1e-11, "{blocks} blocks: relative error {error:e}");
            }
        }
    }

    #[test]
    fn an_empty_matrix_is_solved() {
        let mut cholesky = SparseCholesky::new(0, &[]).unwrap();
        cholesky.factor(&[], &[]).unwrap();
        cholesky.solve(&mut []);
        assert!(cholesky.factor.is_empty());
    }

    #[test]
    fn an_indefinite_or_broken_matrix_is_an_error_and_leaves_no_factor() {
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        let pairs = ring(12);
        let mut cholesky = SparseCholesky::new(12, &pairs).unwrap();
        let (diag, off) = random_spd(12, &pairs, &mut rng);
        for (block, value) in [(0, -1.0), (5, 0.0), (7, f64::NAN), (11, f64::INFINITY)] {
            cholesky.factor(&diag, &off).unwrap();
            let mut broken = diag.clone();
            broken[block] = [[0.0; B]; B];
            broken[block][2][2] = value;
            let error = cholesky.factor(&broken, &off).unwrap_err();
            assert!(matches!(error, SparseError::NotPositiveDefinite { .. }), "{error}");
            let mut x = vec![[1.0; B]; 12];
            cholesky.solve(&mut x);
            assert!(x.iter().flatten().all(|v| v.is_nan()));
        }
        for value in [f64::NAN, f64::INFINITY, 1e200] {
            for k in 0..pairs.len() {
                let mut broken = off.clone();
                broken[k][1][4] = value;
                assert!(cholesky.factor(&diag, &broken).is_err());
            }
        }
        cholesky.factor(&diag, &off).unwrap();
    }

    #[test]
    fn a_lone_negative_block_is_named() {
        let mut diag = vec![std::array::from_fn(|r| std::array::from_fn(|c| f64::from(u8::from(r == c)))); 9];
        diag[4][3][3] = -1.0;
        let error = SparseCholesky::new(9, &[]).unwrap().factor(&diag, &[]).unwrap_err();
        assert_eq!(error, SparseError::NotPositiveDefinite { block: 4 });
    }

    #[test]
    fn wrong_pairs_and_counts_are_refused() {
        for pairs in [vec![(1, 1)], vec![(0, 1)], vec![(3, 0)], vec![(2, 1), (1, 0), (2, 1)]] {
            let index = pairs.len() - 1;
            let (row, col) = pairs[index];
            let expected = SparseError::Pair { index, row, col, blocks: 3 };
            assert_eq!(SparseCholesky::new(3, &pairs).err(), Some(expected));
        }
        let mut cholesky = SparseCholesky::new(3, &ring(3)).unwrap();
        let zero = [[0.0; B]; B];
        assert!(matches!(cholesky.factor(&[zero; 2], &[zero; 3]), Err(SparseError::BlockCount { found: 2, .. })));
        assert!(matches!(cholesky.factor(&[zero; 3], &[zero; 4]), Err(SparseError::BlockCount { found: 4, .. })));
    }
}

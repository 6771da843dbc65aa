use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::super::cholesky::tests::{dense, net, random_spd, ring, tree_with_chords};
use super::*;

#[test]
fn products_are_those_of_a_dense_factorisation() {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let patterns =
        [(1, vec![]), (5, vec![(1, 0), (4, 3)]), (40, ring(40)), (63, net(9, 7)), (50, tree_with_chords(50, &mut rng))];
    for (blocks, pairs) in patterns {
        let mut cholesky = SparseCholesky::new(blocks, &pairs).unwrap();
        let mut products = Products::new(&cholesky);
        // The second time there are fewer, and then none.
        for groups in [30, 7, 0] {
            let (diag, off) = random_spd(blocks, &pairs, &mut rng);
            cholesky.factor(&diag, &off).unwrap();
            let mut columns = DMatrix::zeros(blocks * B, groups * C);
            let mut entries = Vec::new();
            for group in 0..groups as u32 {
                // Some block rows come twice.
                for _ in 0..rng.random_range(0..5) {
                    let block = rng.random_range(0..blocks as u32);
                    let own = [0; C].map(|_| [0; B].map(|_| rng.random_range(-1.0..1.0)));
                    entries.push(Entries { group, block, columns: own });
                    for (c, r) in (0..C * B).map(|k| (k / B, k % B)) {
                        columns[(block as usize * B + r, group as usize * C + c)] += own[c][r];
                    }
                }
            }
            products.find(&cholesky, groups, &entries);
            let solved = dense(&pairs, &diag, &off).cholesky().unwrap().solve(&columns);
            let expected = columns.transpose() * solved;
            for (row, column) in (0..groups).flat_map(|row| (0..=row).map(move |column| (row, column))) {
                let block = products.block(row, column);
                for (r, c) in (0..C * C).map(|k| (k / C, k % C)) {
                    let expected = expected[(row * C + r, column * C + c)];
                    assert!((block[r][c] - expected).abs() < 1e-11, "{blocks}, {row} {column}: {block:?} {expected}");
                }
            }
        }
    }
}

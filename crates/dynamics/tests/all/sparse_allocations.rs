//! Factoring and solving with a sparse Cholesky factor must not touch the heap: it happens in every step.

use jointed::linear::sparse::SparseCholesky;

/// `value` on the diagonal.
fn diagonal(value: f64) -> [[f64; 6]; 6] {
    std::array::from_fn(|r| std::array::from_fn(|c| if r == c { value } else { 0.0 }))
}

/// Allocations of two rounds of factor and solve, and of a factorisation that fails.
fn allocations(blocks: usize, pairs: &[(u32, u32)]) -> u64 {
    let mut cholesky = SparseCholesky::new(blocks, pairs).unwrap();
    let off = vec![diagonal(-1.0); pairs.len()];
    let (diag, indefinite) = (vec![diagonal(5.0); blocks], vec![diagonal(1.0); blocks]);
    let mut x = vec![[1.0; 6]; blocks];
    let info = allocation_counter::measure(|| {
        for _ in 0..2 {
            cholesky.factor(&diag, &off).unwrap();
            cholesky.solve(&mut x);
        }
        assert!(cholesky.factor(&indefinite, &off).is_err());
    });
    assert!(x.iter().flatten().all(|v| v.is_finite()));
    info.count_total
}

#[test]
fn factor_and_solve_allocate_nothing() {
    let n = 1000;
    let ring: Vec<_> = (1..n).map(|i| (i, i - 1)).chain([(n - 1, 0)]).collect();
    assert_eq!(allocations(n as usize, &ring), 0);

    let m = 30;
    let right = (0..m * m).filter(|i| i % m > 0).map(|i| (i, i - 1));
    let net: Vec<_> = right.chain((m..m * m).map(|i| (i, i - m))).collect();
    assert_eq!(allocations((m * m) as usize, &net), 0);
}

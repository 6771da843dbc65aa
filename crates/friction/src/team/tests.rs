//! Every piece of every job is done once, whoever helps.

use std::sync::atomic::AtomicU64;

use super::*;

#[test]
fn all_pieces_of_all_jobs_are_done_before_the_next_begins() {
    const KINDS: u8 = 200;
    const PIECES: u16 = 17;
    for threads in [1, 2, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let sums: Vec<AtomicU64> = (0..PIECES).map(|_| AtomicU64::new(0)).collect();
        // Depends on the order of jobs, not on that of pieces.
        let next = |sum: u64, kind: u8, piece: usize| sum.wrapping_mul(31).wrapping_add(u64::from(kind) + piece as u64);
        let work = |kind: u8, piece: usize| {
            let sum = sums[piece].load(Ordering::Relaxed);

            sums[piece].store(next(sum, kind, piece), Ordering::Relaxed);
        };
        pool.install(|| lead(threads, &work, &mut |team| (0..KINDS).for_each(|kind| team.all(kind, PIECES))));
        for (piece, sum) in sums.iter().enumerate() {
            let expected = (0..KINDS).fold(0, |sum, kind| next(sum, kind, piece));
            assert_eq!(sum.load(Ordering::Relaxed), expected, "piece {piece}, {threads} threads");
        }
    }
}

#[test]
fn a_panic_of_the_lead_ends_the_team() {
    let result = std::panic::catch_unwind(|| {
        lead(2, &|_, _| (), &mut |team| {
            team.all(0, 10);
            panic!("the lead gives up");
        });
    });
    assert!(result.is_err());
}

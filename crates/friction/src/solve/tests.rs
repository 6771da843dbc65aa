//! Small random problems against the laws of contact, and the two methods against each other.

use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::super::cone::{Coulomb, length, natural_residual};
use super::super::delassus::{Block3, Part, Row};
use super::super::problem::Unknown;
use super::*;

/// A random problem of `count` contacts that all push one component: a symmetric, positive definite matrix.
fn random(count: usize, friction: Coulomb, seed: u64) -> Problem {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut number = || random.random_range(-1.0..1.0);
    let size = 3 * count;
    let factor: Vec<Vec<f64>> = (0..size).map(|_| (0..size).map(|_| number()).collect()).collect();
    let mut problem = Problem::default();
    for _ in 0..count {
        let free = [number() - 0.5, number(), number()];
        problem.push(Unknown { force: [0.0; 3], before: [0.0; 3], free, friction, scale: 1.0 });
    }
    fill(&mut problem, |row, column| {
        let entry = |r: usize, c: usize| {
            let (i, j) = (3 * row + r, 3 * column + c);
            let dot: f64 = factor[i].iter().zip(&factor[j]).map(|(a, b)| a * b).sum();
            dot / size as f64 + if i == j { 0.5 } else { 0.0 }
        };
        [0, 1, 2].map(|r| [0, 1, 2].map(|c| entry(r, c)))
    });
    problem
}

/// Couples all contacts of a problem, by the blocks of the lower triangle.
fn fill(problem: &mut Problem, block: impl Fn(usize, usize) -> Block3) {
    let count = problem.unknowns().len();
    let members: Vec<u32> = (0..count as u32).collect();
    problem.operator.reset(count, &[0, count], &members, &[0, 1]);
    let (mut part, _) = Part::new(count, false, problem.operator.values().0);
    for (row, column) in (0..count).flat_map(|row| (0..=row).map(move |column| (row, column))) {
        part.add((row, column), &block(row, column), false);
    }
    problem.close();
}

const TIGHT: f64 = 1e-13;

/// As many sweeps as it takes.
const PATIENT: SolverParams = SolverParams { max_sweeps: 100_000, ..SolverParams::DEFAULT };

/// Sweeps alone.
const SWEEPS_ALONE: SolverParams = SolverParams { max_newton_iterations: 0, ..PATIENT };

fn forces(problem: &Problem) -> Vec<Row> {
    problem.unknowns().iter().map(|unknown| unknown.force).collect()
}

/// A row of contacts whose responses are correlated by `correlation` from each to the next, as those of two rods that lie
/// along each other are. The first one bears all, and every other one slips by the first and the second of `slips`.
fn row(count: usize, correlation: f64, friction: Coulomb, slips: [f64; 2]) -> Problem {
    let mut problem = Problem::default();
    for k in 0..count {
        let slip = slips[k % 2];
        let (force, far) = (if k == 0 { [1.0, 0.0, 0.0] } else { [0.0; 3] }, 0.002 * k as f64);
        problem.push(Unknown { force, before: force, free: [-far, slip, 0.5 * slip - far], friction, scale: 1.0 });
    }
    fill(&mut problem, |row, column| {
        let entry = correlation.powi(row.abs_diff(column) as i32);
        [0, 1, 2].map(|r| [0, 1, 2].map(|c| if r == c { entry } else { 0.0 }))
    });
    problem
}

/// Sweeps forwards and backwards in turns, and nothing else, until one changes no impulse by more than `tolerance`.
fn plain_sweeps(problem: &mut Problem, tolerance: f64, most: usize) -> usize {
    (0..most).find(|k| problem.sweep(k % 2 == 1) <= tolerance).map_or(most, |last| last + 1)
}

/// Redundant pairs: sweeps move force between them slowly, moves from one to the other do it at once. Whether they stick or slide, or one
/// sticks and the next slides.
#[test]
fn redundant_pairs_share_their_force_in_few_sweeps() {
    const TOLERANCE: f64 = 1e-7;
    let slips = [[1e-3, 1e-3], [3.0, 3.0], [1e-3, 3.0], [3.0, 1e-3]];
    for (slips, correlation) in slips.into_iter().flat_map(|slips| [(slips, 0.998), (slips, 0.9996)]) {
        let new = || row(8, correlation, Coulomb(0.4), slips);
        let (mut one, mut two) = (new(), new());
        let plain = plain_sweeps(&mut two, TOLERANCE, 100_000);
        let sweeps = ContactSolver::default().solve(&mut one, TOLERANCE, &SWEEPS_ALONE);
        assert!(
            8 * sweeps < plain,
            "slips {slips:?}, correlation {correlation}: {sweeps} sweeps, without moves {plain}"
        );
        for k in 0..8 {
            let (w, Unknown { force, friction, .. }) = (one.gap_and_slip(k), one.unknowns()[k]);
            let [normal, across] = natural_residual(one.compliance(k), force, w, friction);
            assert!(normal.max(across) < 10.0 * TOLERANCE, "{force:?} {w:?}");
        }
    }
}

/// No impulse is outside of its friction cone, however a solve ends.
#[test]
fn impulses_are_in_their_cones() {
    for (seed, max_sweeps) in (0..200).flat_map(|seed| [1, 2, 7, 8, 1000].map(|most| (seed, most))) {
        let mut problem = random(1 + seed as usize % 7, Coulomb(0.3), seed);
        ContactSolver::default().solve(&mut problem, 1e-6, &SolverParams { max_sweeps, ..SolverParams::DEFAULT });
        for [normal, x, y] in forces(&problem) {
            assert!(normal >= 0.0 && length([x, y]) <= 0.3 * normal * (1.0 + 4.0 * f64::EPSILON), "{normal} {x} {y}");
        }
    }
}

/// The laws of contact and of friction hold at the problem's impulses.
fn check(problem: &mut Problem) -> Result<(), TestCaseError> {
    const ERROR: f64 = 1e-9;
    for k in 0..problem.unknowns().len() {
        let (w, Unknown { force, friction, .. }) = (problem.gap_and_slip(k), problem.unknowns()[k]);
        prop_assert!(force[0] >= 0.0, "it pulls: {force:?}");
        prop_assert!(w[0] > -ERROR, "it is entered: {w:?}");
        prop_assert!(force[0] * w[0] < ERROR, "it presses over a gap: {force:?} {w:?}");
        let (across, most) = (length([force[1], force[2]]), friction.most(force[0]));
        prop_assert!(across <= most + ERROR, "outside of the cone: {across} {most}");
        let slip = length([w[1], w[2]]);
        if friction.exists(force[0]) && force[0] > 1e-3 && slip > 1e-3 {
            prop_assert!(across > most - 1e-6, "slips inside of the cone: {across} {most}");
            let along = (force[1] * w[1] + force[2] * w[2]) / slip;
            prop_assert!(along < -across + 1e-6, "friction is not against the slip: {force:?} {w:?}");
        }
        let [normal, tangential] = natural_residual(problem.compliance(k), force, w, friction);
        prop_assert!(normal < ERROR && tangential < ERROR, "{normal} {tangential}");
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn solutions_keep_the_laws(count in 1_usize..7, friction in prop_oneof![Just(0.0), 0.05..0.6], seed: u64) {
        let mut problem = random(count, Coulomb(friction), seed);
        let sweeps = ContactSolver::default().solve(&mut problem, TIGHT, &PATIENT);
        prop_assert!(sweeps < PATIENT.max_sweeps);
        check(&mut problem)?;
    }

    #[test]
    fn sweeps_alone_keep_the_laws(count in 1_usize..7, friction in prop_oneof![Just(0.0), 0.05..0.6], seed: u64) {
        let mut problem = random(count, Coulomb(friction), seed);
        ContactSolver::default().solve(&mut problem, TIGHT, &SWEEPS_ALONE);
        check(&mut problem)?;
    }

    /// Without friction the solution is unique.
    #[test]
    fn newton_and_sweeps_agree(count in 1_usize..7, seed: u64) {
        let (mut one, mut two) = (random(count, Coulomb(0.0), seed), random(count, Coulomb(0.0), seed));
        let newton = SolverParams { sweeps_before_newton: 1, ..PATIENT };
        ContactSolver::default().solve(&mut one, TIGHT, &newton);
        ContactSolver::default().solve(&mut two, TIGHT, &SWEEPS_ALONE);
        for (a, b) in forces(&one).iter().zip(&forces(&two)) {
            prop_assert!((a[0] - b[0]).abs() < 1e-9, "{a:?} {b:?}");
        }
    }
}

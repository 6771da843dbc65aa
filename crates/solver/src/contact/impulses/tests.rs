//! Small random problems against the laws of contact, and the two methods against each other.

use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rod::Friction;

use super::super::problem::{Bound, Pattern, Row, Unknown, length, natural_residual};
use super::*;

/// A random problem of `count` contacts that all push one component: a symmetric, positive definite matrix.
fn random(count: usize, friction: Bound, seed: u64) -> Problem {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut number = || random.random_range(-1.0..1.0);
    let size = 3 * count;
    let factor: Vec<Vec<f64>> = (0..size).map(|_| (0..size).map(|_| number()).collect()).collect();
    let mut problem = Problem::default();
    for _ in 0..count {
        let free = [number() - 0.5, number(), number()];
        problem.push(Unknown { force: [0.0; 3], before: [0.0; 3], free, friction, scale: 1.0 });
    }
    let members: Vec<u32> = (0..count as u32).collect();
    problem.reset(&Pattern { start: &[0, count], members: &members }, &vec![[0, u32::MAX]; count]);
    for (row, column) in (0..count).flat_map(|row| (0..count).map(move |column| (row, column))) {
        for direction in 0..3 {
            let entry = |r: usize| {
                let (i, j) = (3 * row + r, 3 * column + direction);
                let dot: f64 = factor[i].iter().zip(&factor[j]).map(|(a, b)| a * b).sum();
                dot / size as f64 + if i == j { 0.5 } else { 0.0 }
            };
            problem.add(row as u32, column as u32, direction, [entry(0), entry(1), entry(2)]);
        }
    }
    problem.close();
    problem
}

fn coulomb(friction: f64) -> Bound {
    Bound::Coulomb(Friction::new(friction))
}

const TIGHT: f64 = 1e-13;

/// As many sweeps as it takes.
const PATIENT: ContactParams = ContactParams { most_sweeps: 100_000, ..ContactParams::DEFAULT };

/// Sweeps alone.
const SWEEPS_ALONE: ContactParams = ContactParams { newton_iterations: 0, ..PATIENT };

fn forces(problem: &Problem) -> Vec<Row> {
    problem.unknowns().iter().map(|unknown| unknown.force).collect()
}

/// The laws of contact and of friction hold at the problem's impulses.
fn check(problem: &mut Problem) -> Result<(), TestCaseError> {
    const ERROR: f64 = 1e-9;
    for k in 0..problem.unknowns().len() {
        let (w, Unknown { force, friction, .. }) = (problem.gap_and_slip(k), problem.unknowns()[k]);
        prop_assert!(force[0] >= 0.0, "it pulls: {force:?}");
        prop_assert!(w[0] > -ERROR, "it is entered: {w:?}");
        prop_assert!(force[0] * w[0] < ERROR, "it presses over a gap: {force:?} {w:?}");
        let (across, most) = (length([force[1], force[2]]), friction.at_rest(force[0]));
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
        let mut problem = random(count, coulomb(friction), seed);
        let sweeps = solve(&mut problem, &mut Newton::default(), TIGHT, &PATIENT);
        prop_assert!(sweeps < PATIENT.most_sweeps);
        check(&mut problem)?;
    }

    #[test]
    fn sweeps_alone_keep_the_laws(count in 1_usize..7, friction in prop_oneof![Just(0.0), 0.05..0.6], seed: u64) {
        let mut problem = random(count, coulomb(friction), seed);
        solve(&mut problem, &mut Newton::default(), TIGHT, &SWEEPS_ALONE);
        check(&mut problem)?;
    }

    /// Without friction the solution is unique.
    #[test]
    fn newton_and_sweeps_agree(count in 1_usize..7, seed: u64) {
        let (mut one, mut two) = (random(count, coulomb(0.0), seed), random(count, coulomb(0.0), seed));
        let newton = ContactParams { sweeps_before_newton: 1, ..PATIENT };
        solve(&mut one, &mut Newton::default(), TIGHT, &newton);
        solve(&mut two, &mut Newton::default(), TIGHT, &SWEEPS_ALONE);
        for (a, b) in forces(&one).iter().zip(&forces(&two)) {
            prop_assert!((a[0] - b[0]).abs() < 1e-9, "{a:?} {b:?}");
        }
    }

    /// Where friction's bounds stay, the solution is a minimum, and the only one.
    #[test]
    fn with_bounds_that_stay_newton_and_sweeps_agree(count in 1_usize..7, most in 0.0..0.5, seed: u64) {
        let bound = Bound::Lagged([most; 2]);
        let (mut one, mut two) = (random(count, bound, seed), random(count, bound, seed));
        let newton = ContactParams { sweeps_before_newton: 1, ..PATIENT };
        let sweeps = solve(&mut one, &mut Newton::default(), TIGHT, &newton);
        prop_assert!(sweeps < PATIENT.most_sweeps);
        solve(&mut two, &mut Newton::default(), TIGHT, &SWEEPS_ALONE);
        for (a, b) in forces(&one).iter().zip(&forces(&two)) {
            prop_assert!((0..3).all(|k| (a[k] - b[k]).abs() < 1e-9), "{a:?} {b:?}");
            prop_assert!(length([a[1], a[2]]) <= most + 1e-12, "{a:?}");
        }
    }
}

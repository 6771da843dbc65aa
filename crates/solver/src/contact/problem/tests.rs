//! One contact against closed forms, and small random problems against their laws and against each other's methods.

use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;

/// Compliances 2 along the normal, 4 and 4 across.
const DIAGONAL: Block3 = [[2.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 4.0]];

/// Equal but for rounding.
#[track_caller]
fn assert_near<const N: usize>(found: [f64; N], expected: [f64; N], what: &str) {
    let near = found.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-14);
    assert!(near, "{what}: {found:?}, not {expected:?}");
}

#[test]
fn one_contact_presses_sticks_and_slides_as_coulomb_says() {
    let (smooth, rough) = (Friction::default(), Friction::new(1.0));
    let two = Friction { at_rest: 0.8, sliding: 0.2 };
    for (w, friction, expected, what) in [
        ([1.0, 5.0, 0.0], rough, [0.0; 3], "open"),
        ([-1.0, 5.0, 0.0], smooth, [0.5, 0.0, 0.0], "without friction"),
        ([-1.0, 0.1, 0.0], rough, [0.5, -0.025, 0.0], "sticks: it takes 0.1 / 4 to undo the slip"),
        ([-1.0, 3.0, 4.0], Friction::new(0.5), [0.5, -0.15, -0.2], "slides against (3, 4) with 0.5 * 0.5"),
        ([-1.0, 1.2, 0.0], two, [0.5, -0.3, 0.0], "sticks up to 0.8 * 0.5"),
        ([-1.0, 2.0, 0.0], two, [0.5, -0.1, 0.0], "slides with 0.2 * 0.5"),
    ] {
        assert_near(local(&DIAGONAL, [0.0; 3], w, friction), expected, what);
    }
    // From an earlier impulse only the rest is added; one that would pull is dropped.
    assert_near(local(&DIAGONAL, [0.5, 0.0, 0.0], [0.0; 3], smooth), [0.5, 0.0, 0.0], "stays");
    assert_near(local(&DIAGONAL, [0.5, 0.0, 0.0], [2.0, 0.0, 0.0], smooth), [0.0; 3], "parts");
}

#[test]
fn the_residual_is_the_length_by_which_a_contact_is_wrong() {
    for (force, w, expected, what) in [
        ([0.0; 3], [1.0, 3.0, 0.0], [0.0, 0.0], "open and without force"),
        ([0.0; 3], [-1.0, 0.0, 0.0], [1.0, 0.0], "1 m deep and without force"),
        ([0.5, 0.0, 0.0], [0.0; 3], [0.0, 0.0], "touches and presses"),
        ([1.0, 0.0, 0.0], [0.2, 0.0, 0.0], [0.2, 0.0], "presses over a gap of 0.2 m"),
        ([0.1, 0.0, 0.0], [9.0, 0.0, 0.0], [0.2, 0.0], "letting go moves it by 2 * 0.1"),
        ([1.0, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.1], "slips where it should stick"),
        ([1.0, -0.3, -0.4], [0.0, 3.0, 4.0], [0.0, 0.0], "slides against (3, 4)"),
        ([1.0, 0.3, 0.4], [0.0, 3.0, 4.0], [0.0, 4.0], "is pulled along by twice 0.5 * 4"),
    ] {
        assert_near(natural_residual([2.0, 4.0], force, w, Friction::new(0.5)), expected, what);
    }
    let unmoved = natural_residual([0.0, 4.0], [1.0; 3], [-1.0; 3], Friction::new(0.5));
    assert_near(unmoved, [0.0, 0.0], "nothing moves");
}

/// A random problem of `count` contacts that all push one component: a symmetric, positive definite matrix.
fn random(count: usize, friction: f64, seed: u64) -> Problem {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut number = || random.random_range(-1.0..1.0);
    let size = 3 * count;
    let factor: Vec<Vec<f64>> = (0..size).map(|_| (0..size).map(|_| number()).collect()).collect();
    let mut problem = Problem::default();
    for _ in 0..count {
        let free = [number() - 0.5, number(), number()];
        let friction = Friction::new(friction);
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
        let (across, most) = (length([force[1], force[2]]), friction.at_rest * force[0]);
        prop_assert!(across <= most + ERROR, "outside of the cone: {across} {most}");
        let slip = length([w[1], w[2]]);
        if friction.at_rest > 0.0 && force[0] > 1e-3 && slip > 1e-3 {
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
        let mut problem = random(count, friction, seed);
        let sweeps = problem.solve(TIGHT, &PATIENT);
        prop_assert!(sweeps < PATIENT.most_sweeps);
        check(&mut problem)?;
    }

    #[test]
    fn sweeps_alone_keep_the_laws(count in 1_usize..7, friction in prop_oneof![Just(0.0), 0.05..0.6], seed: u64) {
        let mut problem = random(count, friction, seed);
        problem.solve(TIGHT, &SWEEPS_ALONE);
        check(&mut problem)?;
    }

    /// Without friction the solution is unique.
    #[test]
    fn newton_and_sweeps_agree(count in 1_usize..7, seed: u64) {
        let (mut one, mut two) = (random(count, 0.0, seed), random(count, 0.0, seed));
        let newton = ContactParams { sweeps_before_newton: 1, ..PATIENT };
        one.solve(TIGHT, &newton);
        two.solve(TIGHT, &SWEEPS_ALONE);
        for (a, b) in forces(&one).iter().zip(&forces(&two)) {
            prop_assert!((a[0] - b[0]).abs() < 1e-9, "{a:?} {b:?}");
        }
    }
}

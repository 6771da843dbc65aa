//! One contact against closed forms.

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
    let (smooth, rough) = (Coulomb(0.0), Coulomb(1.0));
    let own = Own::new(&DIAGONAL);
    for (w, friction, expected, what) in [
        ([1.0, 5.0, 0.0], rough, [0.0; 3], "open"),
        ([-1.0, 5.0, 0.0], smooth, [0.5, 0.0, 0.0], "without friction"),
        ([-1.0, 0.1, 0.0], rough, [0.5, -0.025, 0.0], "sticks: it takes 0.1 / 4 to undo the slip"),
        ([-1.0, 3.0, 4.0], Coulomb(0.5), [0.5, -0.15, -0.2], "slides against (3, 4) with 0.5 * 0.5"),
        ([-1.0, 1.2, 0.0], Coulomb(0.8), [0.5, -0.3, 0.0], "sticks up to 0.8 * 0.5"),
        ([-1.0, 2.0, 0.0], Coulomb(0.2), [0.5, -0.1, 0.0], "slides with 0.2 * 0.5"),
    ] {
        assert_near(own.answer([0.0; 3], w, friction), expected, what);
    }
    // From an earlier impulse only the rest is added; one that would pull is dropped.
    assert_near(own.answer([0.5, 0.0, 0.0], [0.0; 3], smooth), [0.5, 0.0, 0.0], "stays");
    assert_near(own.answer([0.5, 0.0, 0.0], [2.0, 0.0, 0.0], smooth), [0.0; 3], "parts");
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
        assert_near(natural_residual([2.0, 4.0], force, w, Coulomb(0.5)), expected, what);
    }
    let unmoved = natural_residual([0.0, 4.0], [1.0; 3], [-1.0; 3], Coulomb(0.5));
    assert_near(unmoved, [0.0, 0.0], "nothing moves");
}

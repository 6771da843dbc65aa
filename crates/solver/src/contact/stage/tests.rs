//! What contacts keep from one step to the next.

use super::super::testing::Rods;
use super::*;

/// A segment just above another one, across it, and their stage.
fn pair() -> (Rods, Stage) {
    let rods = Rods::new(&[
        ([0.0, 0.0, 0.021], [1.0, 0.0, 0.0], 1, 0.01, [0.0; 3]),
        ([0.0; 3], [0.0, 1.0, 0.0], 1, 0.01, [0.0; 3]),
    ]);
    let filter = PairFilter::new(&rods.model);
    let stage = Stage::new(&rods.model, rods.shapes.clone(), filter, &rods.sets, &StepParams::DEFAULT);
    (rods, stage.expect("a stage"))
}

fn begin((rods, stage): &mut (Rods, Stage), dt: f64, presses: bool) {
    rods.predict(dt);
    stage.begin(&rods.sets, Interval { time: 0.0, dt }, presses, &mut Counters::default());
}

#[test]
fn a_contact_goes_on_with_the_force_of_the_step_before() {
    for (dt, presses) in [(0.01, true), (0.005, true), (0.01, false)] {
        let mut pair = pair();
        begin(&mut pair, 0.01, true);
        let contacts = &mut pair.1.contacts;
        assert_eq!((contacts.len(), contacts[0].guess), (1, [0.0; 3]));
        contacts[0].impulse = contacts[0].world([2.0, 0.3, -0.1]);
        begin(&mut pair, dt, presses);
        // Impulses times dt: the same force over half of the time is a quarter.
        let share = (dt / 0.01_f64).powi(2);
        let contact = &pair.1.contacts[0];
        for (guess, before) in contact.guess.iter().zip([2.0, 0.3, -0.1]) {
            assert!((guess - before * share).abs() < 1e-14, "{guess} {before} {dt}");
        }
        let expected = if presses { contact.world(contact.guess) } else { Vec3::zero() };
        assert_eq!(contact.impulse, expected, "{dt} {presses}");
    }
}

#[test]
fn a_contact_is_an_impact_in_its_first_two_steps_and_forgotten_once_it_has_parted() {
    let mut pair = pair();
    let mut impacts = Vec::new();
    for _ in 0..4 {
        begin(&mut pair, 0.01, true);
        pair.1.contacts[0].impulse = Vec3([0.0, 0.0, 1.0]);
        impacts.push(pair.1.end_step());
    }
    assert_eq!(impacts, [true, true, false, false]);
    // Far from each other nothing is found, and later nothing is known of what was.
    let away = |pair: &mut (Rods, Stage), z: f64| pair.0.sets[0].component.poses[0].x = Vec3([0.0, 0.0, z]);
    away(&mut pair, 1.0);
    begin(&mut pair, 0.01, true);
    assert!(pair.1.contacts.is_empty() && !pair.1.end_step());
    away(&mut pair, 0.021);
    begin(&mut pair, 0.01, true);
    assert_eq!((pair.1.contacts.len(), pair.1.contacts[0].guess, pair.1.contacts[0].pressed), (1, [0.0; 3], 0));
}

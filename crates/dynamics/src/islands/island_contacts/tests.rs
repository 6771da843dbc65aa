//! What contacts keep from one step to the next.

use contact::exclusion::PairFilter;

use super::super::testing::Rods;
use super::*;
use crate::step::StepParams;

/// A segment just above another one, across it, and their stage.
struct Pair {
    rods: Rods,
    shared: Shared,
    stage: IslandContacts,
}

impl Pair {
    fn new() -> Self {
        let rods = Rods::new(&[
            ([0.0, 0.0, 0.021], [1.0, 0.0, 0.0], 1, 0.01, [0.0; 3]),
            ([0.0; 3], [0.0, 1.0, 0.0], 1, 0.01, [0.0; 3]),
        ]);
        let filter = PairFilter::new(&rods.model);
        let shared = Shared::new(&rods.model, rods.shapes.clone(), filter, &StepParams::DEFAULT);
        Self { rods, shared, stage: IslandContacts::default() }
    }

    fn begin(&mut self, dt: f64, presses: bool) {
        let Self { rods, shared, stage } = self;
        rods.predict(dt);
        let mut counters = Counters::default();
        shared.find(Interval { time: 0.0, dt }, &rods.all(), &mut counters);
        stage.start(shared, 0..2);
        stage.take_search(shared);
        shared.found.drain(..).for_each(|contact| stage.take(contact));
        stage.begin(shared, &rods.all(), (presses, Formulation::Newton), &mut counters);
    }

    /// Whether there was an impact.
    fn end(&mut self) -> bool {
        let impact = self.stage.end_step(&self.shared);
        self.shared.keep(self.stage.contacts().iter());
        impact
    }
}

#[test]
fn a_contact_goes_on_with_the_force_of_the_step_before() {
    for (dt, presses) in [(0.01, true), (0.005, true), (0.01, false)] {
        let mut pair = Pair::new();
        pair.begin(0.01, true);
        let contacts = &mut pair.stage.contacts;
        assert_eq!((contacts.len(), contacts[0].guess), (1, [0.0; 3]));
        contacts[0].impulse = contacts[0].world([2.0, 0.3, -0.1]);
        pair.end();
        pair.begin(dt, presses);
        // Impulses times dt: the same force over half of the time is a quarter.
        let share = (dt / 0.01_f64).powi(2);
        let contact = &pair.stage.contacts[0];
        for (guess, before) in contact.guess.iter().zip([2.0, 0.3, -0.1]) {
            assert!((guess - before * share).abs() < 1e-14, "{guess} {before} {dt}");
        }
        let expected = if presses { contact.world(contact.guess) } else { Vec3::zero() };
        assert_eq!(contact.impulse, expected, "{dt} {presses}");
    }
}

#[test]
fn a_contact_is_an_impact_in_its_first_two_steps_and_forgotten_once_it_has_parted() {
    let mut pair = Pair::new();
    let mut impacts = Vec::new();
    for _ in 0..4 {
        pair.begin(0.01, true);
        pair.stage.contacts[0].impulse = Vec3([0.0, 0.0, 1.0]);
        impacts.push(pair.end());
    }
    assert_eq!(impacts, [true, true, false, false]);
    // Far from each other nothing is found, and later nothing is known of what was.
    let away = |pair: &mut Pair, z: f64| pair.rods.sets[0].component.poses[0].x = Vec3([0.0, 0.0, z]);
    away(&mut pair, 1.0);
    pair.begin(0.01, true);
    assert!(pair.stage.contacts.is_empty() && !pair.end());
    away(&mut pair, 0.021);
    pair.begin(0.01, true);
    assert_eq!(
        (pair.stage.contacts.len(), pair.stage.contacts[0].guess, pair.stage.contacts[0].pressed),
        (1, [0.0; 3], 0)
    );
}

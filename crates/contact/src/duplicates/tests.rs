//! Which contacts are doubled where rods cross at and beside their joints.

use rod::Friction;

use super::super::shape::Poses;
use super::super::testing::Rods;
use super::*;

/// Contacts of a rod of `segments` along x, whose middle is at `x`, over one along y, in the order of their keys.
fn crossing(x: f64, segments: [usize; 2]) -> Vec<Contact> {
    let mut rods = Rods::new(&[
        ([x, 0.0, 0.0205], [0.2, 0.0, 0.0], segments[0], 0.01, [0.0; 3]),
        ([0.0; 3], [0.0, 0.2, 0.0], segments[1], 0.01, [0.0; 3]),
    ]);
    rods.predict(0.01);
    let (detector, search, mut contacts) = rods.find();
    let world = detector.world(&search);
    contacts.iter_mut().for_each(|contact| contact.evaluate(&world, &rods.sets, Poses::Now));
    double(&rods.shapes, &mut contacts, &mut Holders::default());
    contacts
}

fn holding(contacts: &[Contact]) -> Vec<(u32, Partner)> {
    contacts.iter().filter(|contact| !contact.is_duplicate).map(|contact| (contact.key.0, contact.key.1)).collect()
}

#[test]
fn one_contact_holds_where_both_rods_have_a_joint() {
    for (segments, pairs) in [([2, 1], 2), ([1, 2], 2), ([2, 2], 4), ([4, 4], 4)] {
        let contacts = crossing(0.0, segments);
        let [first, _] = segments.map(|count| count as u32 / 2);
        let expected = match segments {
            [2, 2] => vec![(0, Partner::Segment(2))],
            [4, 4] => vec![(1, Partner::Segment(5))],
            [_, 1] => vec![(0, Partner::Segment(2))],
            _ => vec![(first, Partner::Segment(1))],
        };
        let near = contacts.iter().filter(|contact| contact.gap < contact.radius).count();
        assert_eq!((near, holding(&contacts[..])), (pairs, expected), "{segments:?}");
    }
}

#[test]
fn the_segment_that_is_nearer_holds_for_the_one_across_the_joint() {
    // 4 mm beside the joint, to either side.
    assert_eq!(holding(&crossing(-0.004, [2, 1])), [(1, Partner::Segment(2))]);
    assert_eq!(holding(&crossing(0.004, [2, 1])), [(0, Partner::Segment(2))]);
    // A rod of one segment has no end to share.
    assert_eq!(holding(&crossing(0.1, [1, 1])), [(0, Partner::Segment(1))]);
}

/// Segments 0 and 2, whose ends 1 and 0 meet, and segment 1 that both are near to.
fn interleaved() -> (Vec<Shape>, [Contact; 2]) {
    let shape = |beyond| Shape { beyond, ..Shape::new(0, 0, 0.1, 0.01) };
    let shapes = vec![shape([None, Some(2)]), shape([None; 2]), shape([Some(0), None])];
    let contact = |a, b, ends, gap, normal| {
        let mut contact = Contact::new((a, Partner::Segment(b), Feature::Nearest), Friction::default(), 0.01);
        (contact.ends, contact.gap, contact.normal) = (ends, gap, normal);
        contact.frame = super::super::shape::frame(normal);
        contact
    };
    let up = Vec3([0.0, 0.0, 1.0]);
    (shapes, [contact(0, 1, [Some(1), None], 1e-4, up), contact(1, 2, [None; 2], 0.0, -up)])
}

#[test]
fn what_pressed_before_goes_to_the_one_that_holds() {
    let (shapes, mut contacts) = interleaved();
    contacts[0].guess = contacts[0].local(Vec3([0.3, -0.2, 2.0]));
    double(&shapes, &mut contacts, &mut Holders::default());
    assert_eq!(contacts.map(|contact| contact.is_duplicate), [true, false]);
    assert_eq!(contacts[0].guess, [0.0; 3]);
    // Segment 1 is the first of that contact: what pushes it is the reaction.
    assert_eq!(contacts[1].world(contacts[1].guess), Vec3([-0.3, 0.2, -2.0]));
}

#[test]
fn a_contact_stays_where_the_other_is_farther_off_or_may_be_deeper() {
    // The joint gapes.
    let (shapes, mut contacts) = interleaved();
    contacts[1].gap = contacts[0].gap + 2.0 * SAME * contacts[0].radius;
    double(&shapes, &mut contacts, &mut Holders::default());
    assert_eq!(contacts.map(|contact| contact.is_duplicate), [false; 2]);
    // An overlap that is let out.
    let (shapes, mut contacts) = interleaved();
    contacts[1].target = -1e-4;
    double(&shapes, &mut contacts, &mut Holders::default());
    assert_eq!(contacts.map(|contact| contact.is_duplicate), [false; 2]);
}

#[test]
fn what_is_known_of_a_search_is_used_again_and_forgotten_with_it() {
    let (shapes, mut contacts) = interleaved();
    let mut memory = Holders::default();
    let is_duplicate = |contacts: &mut [Contact], memory: &mut Holders| {
        contacts.iter_mut().for_each(|contact| contact.is_duplicate = false);
        double(&shapes, contacts, memory);
        contacts.iter().map(|contact| contact.is_duplicate).collect::<Vec<_>>()
    };
    assert_eq!(is_duplicate(&mut contacts, &mut memory), [true, false]);
    // The other one is farther off, and then nearer again.
    contacts[1].gap += 1e-3;
    assert_eq!(is_duplicate(&mut contacts, &mut memory), [false; 2]);
    contacts[1].gap -= 1e-3;
    assert_eq!(is_duplicate(&mut contacts, &mut memory), [true, false]);
    memory.forget();
    assert_eq!(is_duplicate(&mut contacts[..1], &mut memory), [false]);
    memory.forget();
    assert_eq!(is_duplicate(&mut contacts, &mut memory), [true, false]);
}

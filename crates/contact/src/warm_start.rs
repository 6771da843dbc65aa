//! What contacts that press leave to those between the same places later, within a step and from step to step.

use kernels::math::Vec3;

use super::broad_phase::BroadPhase;
use super::geometry::Contact;
use super::key::Partner;
use super::mesh_contacts::ALIKE;
use super::narrow_phase::NarrowPhase;
use super::shape::Components;

/// A contact with a mesh that has pressed, for those that take its place where the segment slides on to other triangles.
#[derive(Clone, Copy)]
pub struct Pressed {
    segment: u32,
    whole: Partner,
    normal: Vec3<f64>,
    steps: u32,
}

/// Finds the contacts of a search; of `contacts`, those that press leave their impulses to those between the same places, and all their targets.
pub fn find(
    detector: &NarrowPhase,
    search: &mut BroadPhase,
    again: bool,
    components: &impl Components,
    contacts: &mut Vec<Contact>,
    remembered: &mut Vec<Contact>,
) {
    remembered.clear();
    let keep = |contact: &Contact| {
        let mut kept = *contact;
        kept.guess = contact.local(contact.impulse);
        kept
    };
    // What holds a place in an obstacle lets it be there, whether it presses yet or not.
    remembered.extend(contacts.iter().filter(|c| c.impulse != Vec3::zero() || c.target < 0.0).map(keep));
    detector.detect(search, again, components, contacts);
    let mut old = remembered.iter().peekable();
    for contact in contacts.iter_mut() {
        while old.next_if(|old| old.key < contact.key).is_some() {}
        if let Some(old) = old.next_if(|old| old.key == contact.key) {
            (contact.guess, contact.impulse, contact.target) = (old.guess, old.impulse, old.target);
            contact.applied = old.applied;
            (contact.pressed, contact.effective_dt) = (old.pressed, old.effective_dt);
            (contact.last_slip, contact.slid) = (old.last_slip, old.slid);
            if again {
                // Within a step its law is the same, and what it answers.
                (contact.compliance, contact.coefficient) = (old.compliance, old.coefficient);
                contact.has_coefficient = old.has_coefficient;
            }
        }
    }
}

/// Notes in `out` what of `contacts` pressed on meshes in the step that has ended.
pub fn note_pressed<'a>(contacts: impl Iterator<Item = &'a Contact>, out: &mut Vec<Pressed>) {
    out.clear();
    let pressed = contacts.filter(|contact| contact.pressed > 0 && contact.is_of_mesh());
    out.extend(pressed.map(|contact| {
        let (segment, partner, _) = contact.key;
        Pressed { segment, whole: partner.whole(), normal: contact.normal, steps: contact.pressed }
    }));
}

/// For how many steps a contact with a mesh has pressed as one between the same two in nearly the same direction.
pub fn before(pressed: &[Pressed], contact: &Contact) -> u32 {
    let (segment, partner, _) = contact.key;
    if !contact.is_of_mesh() {
        return 0;
    }
    let first = pressed.partition_point(|other| other.segment < segment);
    let own = pressed[first..].iter().take_while(|other| other.segment == segment);
    let same = own.filter(|other| other.whole == partner.whole() && other.normal.dot(contact.normal) > ALIKE);
    same.map(|other| other.steps).max().unwrap_or(0)
}

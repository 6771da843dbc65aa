//! Ends that two segments share, and which contacts hold there for both.
//!
//! Where a rod is nearest to another body at a joint, both segments that meet there are as near, at the same place. Where it is
//! nearest beside the joint, the place nearest on the segment across is the joint itself, and no nearer: what keeps the one off
//! keeps both off, whatever the poses. Contacts that others hold in this way are doubled. Left among those that press, force would
//! go to and fro between them, for what they do to the rod is the same but for rounding errors.

use std::cmp::Reverse;

use component::Members;
use kernels::math::Vec3;
use kernels::parallel;
use rod::{Body, Freedom, Joint, Model};

use super::contacts_grain;
use super::geometry::Contact;
use super::key::{Feature, Key, Partner};
use super::shape::Shape;

/// Difference of gaps that is none \[radii\].
const SAME: f64 = 1e-6;

/// The shapes of a model's segments, which these connected sets have, in order; segments of no set touch nothing. Ends that segments
/// share touch once.
pub fn shapes<'a>(model: &Model, sets: impl Iterator<Item = &'a Members>) -> Vec<Shape> {
    let mut shapes = vec![Shape { free: false, ..Shape::new(0, 0, 0.0, 0.0) }; model.segments.len()];
    for (component, set) in sets.enumerate() {
        for (body, &index) in set.segments.iter().enumerate() {
            let segment = &model.segments[index];
            let capsule = segment.capsule();
            // What touches nothing has no ends, and a filter keeps it from all others. A sphere has one.
            let (half, mut radius) = capsule.unwrap_or((0.0, segment.radius));
            if let Some(mesh) = segment.surface() {
                // The ball around it.
                radius = mesh.positions.iter().map(|place| place.norm()).fold(0.0, f64::max);
            }
            let shape = Shape::new(component as u32, body as u32, half, radius);
            shapes[index] = Shape { free: !segment.fixed, ends: [capsule.is_some(), half > 0.0], ..shape };
        }
    }
    share_ends(model, &mut shapes);
    shapes
}

/// Says of each end where segments meet which of them stands for it, and which two are as thick and alone there.
fn share_ends(model: &Model, shapes: &mut [Shape]) {
    let mut met = vec![[0; 2]; shapes.len()];
    // Where a joint has broken, or may, each of its two ends touches for itself.
    let may_part = |index: usize| {
        model.joints[index].freedom == Freedom::Broken
            || model.breakable.binary_search_by_key(&index, |own| own.joint).is_ok()
    };
    for (index, joint) in model.joints.iter().enumerate() {
        let is_rigid = joint.stretch_compliance.max(joint.shear_compliance) <= Joint::RIGID;
        for (body, other, offset) in [(joint.a, joint.b, joint.offset_a), (joint.b, joint.a, joint.offset_b)] {
            if let (Body::Segment(i), Body::Anchor(_)) = (body, other)
                && is_rigid
                && joint.mount.is_none()
                && let Some(end) = shapes[i].end_at(offset)
            {
                shapes[i].anchored[end] = true;
            }
        }
        if let (Body::Segment(a), Body::Segment(b)) = (joint.a, joint.b)
            && joint.mount.is_none()
            && !may_part(index)
            && let (Some(end_a), Some(end_b)) = (shapes[a].end_at(joint.offset_a), shapes[b].end_at(joint.offset_b))
        {
            // The thicker of two ends that meet stands for both, unless the joint lets them part.
            if is_rigid {
                let first = (shapes[a].radius, Reverse(a)) > (shapes[b].radius, Reverse(b));
                let ((standing, end), (other, end_of_other)) =
                    if first { ((a, end_a), (b, end_b)) } else { ((b, end_b), (a, end_a)) };
                shapes[other].ends[end_of_other] = false;
                shapes[other].joined[end_of_other] = Some(standing as u32);
                shapes[standing].joined[end].get_or_insert(other as u32);
            }
            for (own, end, across) in [(a, end_a, b), (b, end_b, a)] {
                met[own][end] += 1;
                let is_alone = met[own][end] == 1 && shapes[across].radius >= shapes[own].radius;
                shapes[own].beyond[end] = is_alone.then_some(across as u32);
            }
        }
    }
}

/// Which contact holds what another one does, by its place, and whether it sees the two bodies the other way round.
pub(super) type Holder = Option<(usize, bool)>;

/// The contact of the segment across a joint, if there is one: its place, and which of its two segments is the one across.
type Across = Option<(u32, u8)>;
/// Those across the two ends of a segment; `None` where it has not been looked for.
type Known = [Option<Across>; 2];

/// What is known at one segment of a contact: the contacts across its ends, and which one holds.
#[derive(Clone, Copy, Default)]
struct Beside {
    across: Known,
    holder: Holder,
}

/// Memory for which contacts others hold.
#[derive(Default)]
pub struct Holders {
    /// Of each contact, at its first and at its second segment.
    sides: Vec<[Beside; 2]>,
    found: Vec<Holder>,
}

impl Holders {
    /// Forgets what it knows of contacts, as there are others.
    pub fn forget(&mut self) {
        self.sides.clear();
    }
}

/// Marks contacts, in the order of their keys and evaluated, that others hold. Those leave what they press with from the step
/// before to the others.
pub fn double(shapes: &[Shape], contacts: &mut [Contact], memory: &mut Holders) {
    let Holders { sides, found } = memory;
    sides.resize(contacts.len(), Default::default());
    parallel::each(sides, contacts_grain(contacts.len()), |index, sides| {
        let Contact { key: (_, partner, feature), gap, target, radius, .. } = contacts[index];
        let is_near = gap < target + radius;
        // Edges of meshes have rules of their own.
        let may_be_held = is_near && partner.whole() == partner && feature == Feature::Nearest;
        for (side, Beside { across, holder }) in sides.iter_mut().enumerate() {
            *holder = if may_be_held { find_holder(shapes, contacts, (index, side), across) } else { None };
        }
    });
    found.clear();
    found.resize(contacts.len(), None);
    for (index, sides) in sides.iter().enumerate() {
        // What holds may be held itself, but not by this one.
        let last = |holder: Holder| {
            let (mut place, mut swaps) = holder?;
            while let Some((next, swaps_again)) = found[place] {
                (place, swaps) = (next, swaps != swaps_again);
            }
            (place != index).then_some((place, swaps))
        };
        let Some((place, swaps)) = sides.iter().find_map(|beside| last(beside.holder)) else { continue };
        contacts[index].is_duplicate = true;
        found[index] = Some((place, swaps));
        let contact = contacts[index];
        if contact.guess != [0.0; 3] && contact.impulse == Vec3::zero() {
            contacts[index].guess = [0.0; 3];
            let other = &mut contacts[place];
            if other.guess == [0.0; 3] {
                let guess = contact.world(contact.guess);
                other.guess = other.local(if swaps { -guess } else { guess });
            }
        }
    }
}

/// The place of a contact that holds what another one does at the end of its first or second segment, if one does, and whether it
/// sees the two bodies the other way round. `known` are the contacts across that segment's ends.
fn find_holder(
    shapes: &[Shape],
    contacts: &[Contact],
    (index, side): (usize, usize),
    known: &mut [Option<Across>; 2],
) -> Holder {
    let contact = &contacts[index];
    let (first, partner, _) = contact.key;
    let own = [Some(first), partner.segment()][side]?;
    let beyond = |segment: u32, end: u8| shapes[segment as usize].beyond[end as usize];
    let end = contact.ends[side]?;
    let across = beyond(own, end)?;
    let (place, seat) = (*known[end as usize].get_or_insert_with(|| find_across(contacts, contact, side, across)))?;
    let (place, seat) = (place as usize, seat as usize);
    let other = &contacts[place];
    let is_at_joint = other.ends[seat].is_some_and(|end| beyond(across, end) == Some(own));
    let nearer = (contact.gap - other.gap) / contact.radius;
    let holds =
        nearer >= -SAME && other.target >= contact.target && (!is_at_joint || nearer > SAME || other.key < contact.key);
    holds.then_some((place, seat != side))
}

/// The contact of segment `across` with the partner of a contact's first or second segment.
fn find_across(contacts: &[Contact], contact: &Contact, side: usize, across: u32) -> Across {
    let (first, partner, _) = contact.key;
    let other = if side == 0 { partner.segment() } else { Some(first) };
    let (key, seat): (Key, u8) = match other {
        None => ((across, partner, Feature::Nearest), 0),
        Some(other) if across < other => ((across, Partner::Segment(other), Feature::Nearest), 0),
        Some(other) => ((other, Partner::Segment(across), Feature::Nearest), 1),
    };
    let place = contacts.binary_search_by_key(&key, |contact| contact.key).ok()?;
    Some((place as u32, seat))
}

#[cfg(test)]
mod tests;

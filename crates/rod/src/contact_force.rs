//! What presses on what, as one reads it off between steps.

use nalgebra::Vector3;

use crate::{State, Wrench};

/// What a segment touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Touched {
    /// Index into [`crate::Model::segments`], higher than that of the segment that touches it but for the wall of a sheath: that presses on two
    /// segments where the centreline is between their centres, with an entry for each.
    Segment(usize),
    /// Index into [`crate::Contacts::obstacles`].
    Obstacle(usize),
}

/// The force of a contact that presses, at the end of the last step (of its last part where that was done in halves).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactForce {
    /// Index of the segment.
    pub segment: usize,
    /// What it touches.
    pub other: Touched,
    /// Place of the contact [m].
    pub place: Vector3<f64>,
    /// Unit vector from what is touched to the segment.
    pub normal: Vector3<f64>,
    /// Force on the segment, friction included [N]; the other body feels the opposite.
    pub force: Vector3<f64>,
    /// How far the surfaces have slipped past each other in the step, across the normal [m].
    pub slip: Vector3<f64>,
}

/// What contacts give to each segment in `state`, about its position: one entry a segment, in place of what was in `wrenches`.
pub fn contact_wrenches(forces: &[ContactForce], state: &State, wrenches: &mut Vec<Wrench>) {
    wrenches.clear();
    wrenches.resize(state.len(), Wrench::default());
    let none = Vector3::zeros();
    for contact in forces {
        let mut add = |i: usize, force: Vector3<f64>| {
            wrenches[i].add(&force, &(contact.place - state.positions[i]), &none);
        };
        add(contact.segment, contact.force);
        if let Touched::Segment(other) = contact.other {
            add(other, -contact.force);
        }
    }
}

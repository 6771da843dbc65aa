//! Joints of a component that can break ([`rod::Strength`]).
//!
//! A joint that has broken transmits nothing and has no constraint, as one that holds on to an open grip ([`super::released`]); its two bodies go on
//! by themselves. Which one breaks is decided at the end of a step that is solved: the one of which most is asked for what it bears. The step is then
//! done again without it, until no joint bears too much, so that a break relieves its neighbours before they are judged. Nothing acts on the bodies as
//! a joint breaks, so that momentum stays; the energy that it stored is lost. Sets with such joints are never in lanes.

mod step;

use rod::{Break, Freedom, Joint, Model, Strength};

use super::Members;

/// A joint that can break.
#[derive(Clone, Debug)]
pub(super) struct Breakable {
    /// Index of the joint in the component.
    joint: usize,
    /// As the model has it.
    constants: Joint,
    /// Index of the joint in the model.
    index: usize,
    strength: Strength,
    /// When and how it broke.
    broke: Option<Break>,
}

impl Breakable {
    /// Those of a set.
    pub(super) fn all(model: &Model, members: &Members) -> Vec<Self> {
        let own = model.breakable.iter().filter(|own| model.joints[own.joint].freedom != Freedom::Broken);
        let of = own.filter_map(|own| {
            let joint = members.joints.binary_search(&own.joint).ok()?;
            let constants = model.joints[own.joint];
            Some(Self { joint, constants, index: own.joint, strength: own.strength, broke: None })
        });
        of.collect()
    }
}

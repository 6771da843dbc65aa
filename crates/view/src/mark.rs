//! What is drawn beside rods: grips, loads, forces of contacts.

use std::collections::HashSet;

use nalgebra::Vector3;
use rod::{Body, Model, State};
use serde::{Deserialize, Serialize};

use crate::deflate::deflated;
use crate::{DecodeError, coarse, track};

/// Contacts of a frame that are kept: those that press most.
const MOST_CONTACTS: usize = 200;
/// Tracks of a contact and the bytes of each: its segment, its place, its force.
const SEGMENT: usize = 3;
const VECTORS: (usize, usize) = (6, 2);

/// A place where a segment is held.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Grip {
    pub(crate) segment: usize,
    /// Place from the segment's centre, in its own axes [m].
    pub(crate) at: [f32; 3],
    /// Frames in which it is held, from each first one to before each second one; empty: all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) held: Vec<[usize; 2]>,
    #[serde(skip)]
    of: Option<Body>,
}

/// A load on a segment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Load {
    pub(crate) segment: usize,
    /// Place along the axis, from the segment's centre [m].
    pub(crate) offset: f32,
    /// Force [N]: one, or one a frame where it changes.
    pub(crate) force: Vec<[f32; 3]>,
}

/// The contacts of all frames that press most.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Contacts {
    /// How many each frame has.
    counts: Vec<usize>,
    /// Whether a frame had more.
    more: bool,
    /// Base64 of a zlib stream of tracks with one integer a contact, each as the change from the contact before it, in
    /// planes of bytes: the segment (3 bytes), the place from the segment's centre in world axes [m] and the force on the
    /// segment [N], by coordinate, as the upper halves of 32-bit floats (2 bytes each).
    data: String,
    #[serde(skip)]
    segments: Vec<u32>,
    #[serde(skip)]
    vectors: [Vec<u16>; 6],
}

/// A contact that presses on a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pressing {
    /// Index of the segment.
    pub segment: usize,
    /// Place of the contact [m].
    pub place: Vector3<f64>,
    /// Force on the segment [N].
    pub force: Vector3<f64>,
}

/// Where segments of `model` are held: fixed ones at their centres, others where joints hold on to anchors.
pub(crate) fn grips(model: &Model) -> Vec<Grip> {
    let new = |segment: usize, at: Vector3<f64>, of: Body| Grip {
        segment,
        at: at.map(|x| x as f32).into(),
        held: Vec::new(),
        of: Some(of),
    };
    let driven: HashSet<Body> = model.motions.iter().map(|driven| driven.body).collect();
    let is_held = |&i: &usize| model.segments[i].fixed || driven.contains(&Body::Segment(i));
    let fixed = (0..model.segments.len()).filter(is_held);
    let fixed = fixed.map(|i| new(i, Vector3::zeros(), Body::Segment(i)));
    let holding = model.joints.iter().filter(|joint| !joint.is_foundation());
    let anchored = holding.filter_map(|joint| {
        let own = nalgebra::UnitQuaternion::identity();
        match (joint.a, joint.b) {
            (Body::Segment(i), of @ Body::Anchor(_)) => Some(new(i, joint.arm_a(&own), of)),
            (of @ Body::Anchor(_), Body::Segment(i)) => Some(new(i, joint.arm_b(&own), of)),
            _ => None,
        }
    });
    fixed.chain(anchored).collect()
}

/// Adds a frame of a model as it is then.
pub(crate) fn hold(grips: &mut [Grip], model: &Model, frame: usize) {
    for grip in grips {
        let is_held = match grip.of {
            Some(Body::Segment(i)) => model.segments[i].fixed,
            Some(Body::Anchor(i)) => !model.open.contains(&i),
            None => true,
        };
        match grip.held.last_mut() {
            Some([_, until]) if is_held && *until == frame => *until += 1,
            _ if is_held => grip.held.push([frame, frame + 1]),
            _ => {}
        }
    }
}

/// Leaves out when grips are held where they always are, and those that never are.
pub(crate) fn always(mut grips: Vec<Grip>, frames: usize) -> Vec<Grip> {
    grips.retain(|grip| !grip.held.is_empty());
    for grip in &mut grips {
        grip.of = None;
        if grip.held == [[0, frames]] {
            grip.held.clear();
        }
    }
    grips
}

/// The loads of `model`; what lifts its segments would be an arrow each.
pub(crate) fn loads(model: &Model) -> Vec<Load> {
    let new = |load: &rod::Load| Load { segment: load.segment, offset: load.offset as f32, force: Vec::new() };
    acting(model).map(new).collect()
}

/// Loads but for those that stand for buoyancy.
fn acting(model: &Model) -> impl Iterator<Item = &rod::Load> {
    let mut lifts = model.lifts.iter().peekable();
    let mut is_lift = move |k: usize| lifts.next_if(|lift| lift.load == k).is_some();
    model.loads.iter().enumerate().filter(move |(k, _)| !is_lift(*k)).map(|(_, load)| load)
}

/// Adds a frame of a model as it is then, in world axes.
pub(crate) fn load(loads: &mut [Load], model: &Model, state: &State) {
    for (own, load) in loads.iter_mut().zip(acting(model)) {
        let [force, _] = load.in_world(&state.orientations[load.segment]);
        own.force.push(force.map(|x| x as f32).into());
    }
}

/// Leaves constant forces once, and no loads without force.
pub(crate) fn constant(mut loads: Vec<Load>) -> Vec<Load> {
    loads.retain(|load| load.force.iter().flatten().any(|x| *x != 0.0));
    for load in &mut loads {
        if load.force.windows(2).all(|pair| pair[0] == pair[1]) {
            load.force.truncate(1);
        }
    }
    loads
}

impl Contacts {
    /// Adds a frame's contacts, in a state of the model.
    pub(crate) fn push(&mut self, state: &State, contacts: impl Iterator<Item = Pressing>) {
        let size = |contact: &Pressing| contact.force.norm_squared();
        let is_sound = |contact: &Pressing| contact.segment < state.positions.len() && size(contact).is_finite();
        let mut all: Vec<Pressing> = contacts.filter(is_sound).collect();
        if all.len() > MOST_CONTACTS {
            self.more = true;
            all.sort_by(|a, b| size(b).total_cmp(&size(a)));
            all.truncate(MOST_CONTACTS);
            all.sort_by_key(|contact| contact.segment);
        }
        self.counts.push(all.len());
        for Pressing { segment, place, force } in all {
            self.segments.push(segment as u32);
            let away = place - state.positions[segment];
            for (track, value) in self.vectors.iter_mut().zip(away.iter().chain(&force)) {
                track.push(coarse::pack(*value));
            }
        }
    }

    /// With as many frames as there are now, those that nothing was said of empty.
    pub(crate) fn reach(&mut self, frames: usize) {
        self.counts.resize(frames, 0);
    }

    /// Those of all frames, packed; `None` where there are none.
    pub(crate) fn packed(mut self) -> Option<Self> {
        if self.segments.is_empty() {
            return None;
        }
        let mut data = Vec::new();
        track::write(&mut data, &self.segments, 1, SEGMENT);
        for track in &self.vectors {
            let wide: Vec<u32> = track.iter().map(|&code| code.into()).collect();
            track::write(&mut data, &wide, 1, VECTORS.1);
        }
        self.data = deflated(&data);
        (self.segments, self.vectors) = Default::default();
        Some(self)
    }

    pub(crate) fn validate(
        &self,
        frames: usize,
        segments: usize,
        inflate: impl Fn(&str, usize) -> Result<Vec<u8>, DecodeError>,
    ) -> Result<(), DecodeError> {
        if self.counts.len() != frames || self.counts.iter().any(|&count| count > MOST_CONTACTS) {
            let must = format!("there must be {frames} counts, none above {MOST_CONTACTS}");
            return Err(DecodeError::new("contacts.counts", must));
        }
        let count: usize = self.counts.iter().sum();
        let data = inflate(&self.data, count * (SEGMENT + VECTORS.0 * VECTORS.1))?;
        let inside = |&segment: &u32| (segment as usize) < segments;
        if track::read(&data[..count * SEGMENT], 1, SEGMENT).iter().all(inside) {
            return Ok(());
        }
        Err(DecodeError::new("contacts.data", "all must be contacts of segments"))
    }
}

/// Checks grips and loads of a run of so many `frames` and `segments`.
pub(crate) fn validate(grips: &[Grip], loads: &[Load], frames: usize, segments: usize) -> Result<(), DecodeError> {
    let holds = |grip: &Grip| {
        let fits = |&[from, until]: &[usize; 2]| from < until && until <= frames;
        grip.segment < segments && grip.at.iter().all(|x| x.is_finite()) && grip.held.iter().all(fits)
    };
    if !grips.iter().all(holds) {
        return Err(DecodeError::new("grips", "each must be a place of a segment, held in frames that there are"));
    }
    let pulls = |load: &Load| {
        let fits = load.force.len() == 1 || load.force.len() == frames;
        load.segment < segments && load.offset.is_finite() && fits && load.force.iter().flatten().all(|x| x.is_finite())
    };
    if !loads.iter().all(pulls) {
        return Err(DecodeError::new("loads", "each must be on a segment, with one finite force or one a frame"));
    }
    Ok(())
}

//! Joints that turn so far that they answer too softly: the strain of a joint is twice the sine of half its angle.

use std::fmt::{self, Display, Formatter};

use cosserat::scene::Scene;
use cosserat::state::{Body, Freedom, Joint, Model, State};
use serde::Serialize;

use crate::held::place;
use crate::numbers::{number, share};

/// Angle of a joint from which on a run says so [degrees]: there a joint is 2 % too soft.
const SHARP: f64 = 20.0;

/// The largest angle of a joint so far.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sharpest {
    joint: usize,
    /// [rad]
    angle: f64,
}

impl Sharpest {
    /// Looks at the joints of a state, but for those that turn freely.
    pub(crate) fn observe(&mut self, model: &Model, state: &State) {
        let holds = |joint: &Joint| joint.freedom == Freedom::None && !model.is_open(joint);
        for (k, joint) in model.joints.iter().enumerate().filter(|(_, joint)| holds(joint)) {
            let [a, b] = joint.frames(model, state);
            let angle = 2.0 * a.coords.dot(&b.coords).abs().min(1.0).acos();
            if angle > self.angle {
                *self = Self { joint: k, angle };
            }
        }
    }
}

/// A joint that turned far in a run.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct SharpJoint {
    /// The bodies that it joins, in words.
    between: [String; 2],
    /// Its largest angle in the frames that were measured [degrees].
    angle_deg: f64,
    /// Share of its moment that is missing: it answers as the sine of the angle.
    moment_missing: f64,
    /// Segments of the rod with which no joint would turn further than a run lets pass.
    segments_needed: usize,
}

impl SharpJoint {
    /// The sharpest joint of a scene, if it is one.
    pub(crate) fn of(scene: &Scene, sharpest: &Sharpest) -> Option<Self> {
        let angle_deg = sharpest.angle.to_degrees();
        let joint = scene.model.joints.get(sharpest.joint).filter(|_| angle_deg > SHARP)?;
        let segment = [joint.a, joint.b].into_iter().find_map(|body| match body {
            Body::Segment(i) if scene.model.segments[i].body.is_none() => Some(i),
            _ => None,
        })?;
        let rod = scene.model.segments[segment].rod;
        let segments = scene.model.segments.iter().filter(|own| own.rod == rod).count();
        Some(Self {
            between: [joint.a, joint.b].map(|body| place(scene, body)),
            angle_deg,
            moment_missing: 1.0 - sharpest.angle.sin() / sharpest.angle,
            segments_needed: (segments as f64 * angle_deg / SHARP).ceil() as usize,
        })
    }
}

impl Display for SharpJoint {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self { between: [a, b], angle_deg, moment_missing, segments_needed } = self;
        write!(
            f,
            "warning: the joint between {a} and {b} turned by {} degrees; its moment goes with the sine of that and is {} % too \
             small; with {segments_needed} segments joints turn by less than {SHARP} degrees",
            number(*angle_deg),
            share(100.0 * moment_missing)
        )
    }
}

//! Joints that turn so far that they answer too softly or too stiffly, or may lose a turn, by how a scene measures them ([`StrainMeasure`]).

use std::fmt::{self, Display, Formatter};

use cosserat::nalgebra::UnitQuaternion;
use cosserat::scene::Scene;
use cosserat::state::{Body, Freedom, Joint, Model, State, StrainMeasure};
use serde::Serialize;

use crate::held::place;
use crate::numbers::{number, share};

/// Angle of a joint from which on a run says so [degrees], where its moment goes with the sine: there it is 2 % too soft.
const SHARP: f64 = 20.0;
/// The same where its moment goes with the angle: at 180 degrees a turn is lost.
const NEARLY_HALF_A_TURN: f64 = 120.0;

/// The largest angle of a joint so far.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sharpest {
    joint: usize,
    /// Between the frames of its measure [rad].
    angle: f64,
    /// From its rest [rad].
    turned: f64,
}

impl Sharpest {
    /// Looks at the joints of a state, but for those that turn freely.
    pub(crate) fn observe(&mut self, model: &Model, state: &State) {
        let holds = |joint: &Joint| joint.freedom == Freedom::None && !model.is_open(joint);
        for (k, joint) in model.joints.iter().enumerate().filter(|(_, joint)| holds(joint)) {
            let [a, b] = joint.frames(model, state);
            let angle = angle_between(&a, &b);
            if angle > self.angle {
                *self = Self { joint: k, angle, turned: angle_between(&(a * rest(joint)), &b) };
            }
        }
    }
}

/// Rotation at rest between the frames of a joint's measure.
fn rest(joint: &Joint) -> UnitQuaternion<f64> {
    let [of_a, of_b] = joint.rest_frames;
    of_a.inverse() * joint.rest_rotation() * of_b
}

fn angle_between(a: &UnitQuaternion<f64>, b: &UnitQuaternion<f64>) -> f64 {
    2.0 * a.coords.dot(&b.coords).abs().min(1.0).acos()
}

/// A joint that turned far in a run, or is bent far at rest.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct SharpJoint {
    /// The bodies that it joins, in words.
    between: [String; 2],
    /// Its largest angle in the frames that were measured [degrees].
    angle_deg: f64,
    /// What of that it has at rest [degrees].
    rest_deg: f64,
    /// Share of its moment that is missing where it turns further about the axis of its rest, zero where its moment goes with the
    /// angle.
    moment_missing: f64,
    #[serde(skip)]
    measure: StrainMeasure,
    /// Segments of the rod with which no joint would turn further than a run lets pass; `None` where the rest is most of the angle.
    #[serde(skip_serializing_if = "Option::is_none")]
    segments_needed: Option<usize>,
}

impl SharpJoint {
    /// The sharpest joint of a scene, if it is one.
    pub(crate) fn of(scene: &Scene, sharpest: &Sharpest) -> Option<Self> {
        let angle_deg = sharpest.angle.to_degrees();
        let measure = scene.model.strain_measure;
        let joint = scene.model.joints.get(sharpest.joint)?;
        let (at_rest, turned) = (rest(joint).angle(), sharpest.turned);
        let limit = if measure == StrainMeasure::Sine { SHARP } else { NEARLY_HALF_A_TURN };
        if angle_deg <= limit {
            return None;
        }
        let segment = [joint.a, joint.b].into_iter().find_map(|body| match body {
            Body::Segment(i) if scene.model.segments[i].body.is_none() => Some(i),
            _ => None,
        })?;
        let rod = scene.model.segments[segment].rod;
        let segments = scene.model.segments.iter().filter(|own| own.rod == rod).count();
        let needed = (segments as f64 * angle_deg / limit).ceil() as usize;
        let (missing, is_of_rest) = match measure {
            StrainMeasure::Sine => (missing(at_rest, turned), turned <= at_rest),
            StrainMeasure::Angle => (0.0, false),
        };
        Some(Self {
            between: [joint.a, joint.b].map(|body| place(scene, body)),
            angle_deg,
            rest_deg: at_rest.to_degrees(),
            moment_missing: missing,
            measure,
            segments_needed: (!is_of_rest).then_some(needed),
        })
    }
}

/// Share of the moment that is missing of a joint that is bent at rest and has turned further about the same axis \[rad\]: it has the energy
/// of a spring whose length is twice the sine of half the angle.
fn missing(at_rest: f64, turned: f64) -> f64 {
    let half = 0.5 * (at_rest + turned);
    if turned < 1e-6 {
        return half.sin().powi(2);
    }
    1.0 - 2.0 * (half.sin() - (0.5 * at_rest).sin()) * half.cos() / turned
}

impl Display for SharpJoint {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self { between: [a, b], angle_deg, rest_deg, moment_missing, measure, segments_needed } = self;
        let missing = share(100.0 * moment_missing);
        match segments_needed {
            Some(needed) if *measure == StrainMeasure::Angle => write!(
                f,
                "warning: the joint between {a} and {b} turned by {} degrees, and loses a turn at 180; with {needed} segments joints \
                 turn by less than {NEARLY_HALF_A_TURN} degrees",
                number(*angle_deg)
            ),
            Some(needed) => write!(
                f,
                "warning: the joint between {a} and {b} turned by {} degrees; its moment goes with the sine of that and is \
                 {missing} % too small; with {needed} segments joints turn by less than {SHARP} degrees",
                number(*angle_deg)
            ),
            None => write!(
                f,
                "warning: the joint between {a} and {b} is bent by {} degrees at rest; measured as in the paper it is {missing} % \
                 too soft; bending = \"rest-rotation\" gives it the stiffness of its material",
                number(*rest_deg)
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::missing;

    #[test]
    fn the_missing_share_is_that_of_the_energy_of_sines() {
        for (at_rest, turned) in [(0.0_f64, 0.6_f64), (0.4, 0.3), (1.5, 0.1), (std::f64::consts::FRAC_PI_2, 1e-7)] {
            let energy = |angle: f64| 2.0 * ((0.5 * angle).sin() - (0.5 * at_rest).sin()).powi(2);
            let angle = at_rest + turned;
            let moment = (energy(angle + 1e-4) - energy(angle - 1e-4)) / 2e-4;
            let found = missing(at_rest, turned);
            assert!((1.0 - moment / turned - found).abs() < 1e-4 || turned < 1e-6, "{at_rest}, {turned}: {found}");
        }
        assert!((missing(0.0, 0.6) - (1.0 - 0.6_f64.sin() / 0.6)).abs() < 1e-12, "straight at rest: the sine");
        assert!((missing(std::f64::consts::FRAC_PI_2, 0.0) - 0.5).abs() < 1e-12, "half as stiff at a right angle");
    }
}

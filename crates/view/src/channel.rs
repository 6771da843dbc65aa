//! What colours show: one number of 8 bits a segment and frame, with the scale that it is read on.

use rod::{Body, JointForce, Model, State, curvature};
use serde::{Deserialize, Serialize};

use crate::DecodeError;
use crate::coarse;

/// Code of a value that nobody knows.
pub(crate) const UNKNOWN: u8 = 255;
/// Code of a range's upper end. Even, so that zero is in the middle of a range about zero.
const TOP: f64 = 254.0;
/// A quantity spans decades where its largest value is so many times its median.
const DECADES: f64 = 50.0;
/// A logarithmic scale reaches down to this share of its upper end at most.
const LOG_REACH: f64 = 1e-6;
/// An asinh scale is linear up to this share of its upper end.
const LINEAR_SHARE: f64 = 1e-3;

/// A quantity that colours show. A segment has the largest of its joints' values; the tension of greatest magnitude.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// Curvature at the joints [1/m].
    Curvature,
    /// Tension of the joints [N], negative where they are pressed.
    Tension,
    /// Residual of the joints, in lengths of the joint or in radians.
    Residual,
    /// Speed of the centre [m/s].
    Speed,
}

impl Channel {
    /// All, in the order in which they are stored.
    pub const ALL: [Channel; 4] = [Channel::Curvature, Channel::Tension, Channel::Residual, Channel::Speed];
}

/// Visits what the channels show of a state: each value with its segment. `forces` are what joints transmit; empty where that is not
/// known.
pub(crate) fn visit(model: &Model, state: &State, forces: &[JointForce], mut visit: impl FnMut(Channel, usize, f64)) {
    for (i, v) in state.velocities.iter().enumerate().take(model.segments.len()) {
        visit(Channel::Speed, i, v.norm());
    }
    for (k, joint) in model.joints.iter().enumerate() {
        let bent = curvature(model, state, joint);
        let force = forces.get(k);
        for body in [joint.a, joint.b] {
            let Body::Segment(i) = body else { continue };
            visit(Channel::Curvature, i, bent);
            if let Some(force) = force {
                visit(Channel::Tension, i, force.tension(model, state, joint));
                visit(Channel::Residual, i, force.residual(model, state, joint));
            }
        }
    }
}

/// Of each segment its values on the channels, in the order of [`Channel::ALL`]: of several joints the largest, as [`Channel`] says;
/// `None` where it has none, or it is not finite. `forces` are what joints transmit; empty where that is not known.
pub fn channel_values(model: &Model, state: &State, forces: &[JointForce]) -> Vec<[Option<f64>; 4]> {
    let mut values = vec![[None; 4]; model.segments.len()];
    visit(model, state, forces, |channel, segment, value| {
        let own: &mut Option<f64> = &mut values[segment][channel as usize];
        if value.is_finite() && own.is_none_or(|own| value.abs() > own.abs()) {
            *own = Some(value);
        }
    });
    values
}

/// How codes lie between a range's ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Scale {
    /// Evenly.
    Linear,
    /// Evenly in logarithms; all that is below the range is its lower end.
    Log,
    /// Logarithms to both sides of zero: evenly in `asinh(1000 value / high)`.
    Asinh,
}

/// The values that a channel takes in a run, and how they are spread over its codes 0 to 254.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Range {
    /// Value of code 0, in the unit of the channel.
    pub low: f64,
    /// Value of code 254.
    pub high: f64,
    /// What lies between.
    pub scale: Scale,
}

impl Range {
    /// The range of coarse values: from 0, or about 0 where there are negative ones, and in logarithms where the
    /// largest is far from the usual.
    pub(crate) fn of(values: &[u16]) -> Self {
        let mut counts = vec![0_usize; usize::from(coarse::MAGNITUDE) + 1];
        let mut negative = false;
        for &code in values.iter().filter(|&&code| coarse::is_known(code) && code & coarse::MAGNITUDE != 0) {
            counts[usize::from(code & coarse::MAGNITUDE)] += 1;
            negative |= code > coarse::MAGNITUDE;
        }
        let total: usize = counts.iter().sum();
        let quantile = |share: f64| {
            let wanted = (share * total as f64).ceil().max(1.0) as usize;
            let mut seen = 0;
            let place = counts.iter().position(|&count| {
                seen += count;
                seen >= wanted
            });
            place.and_then(|code| coarse::unpack(code as u16)).unwrap_or(0.0)
        };
        if total == 0 {
            return Self { low: 0.0, high: 0.0, scale: Scale::Linear };
        }
        let high = quantile(1.0);
        let spans_decades = high > DECADES * quantile(0.5);
        match (negative, spans_decades) {
            (false, false) => Self { low: 0.0, high, scale: Scale::Linear },
            (false, true) => Self { low: quantile(0.01).max(LOG_REACH * high), high, scale: Scale::Log },
            (true, false) => Self { low: -high, high, scale: Scale::Linear },
            (true, true) => Self { low: -high, high, scale: Scale::Asinh },
        }
    }

    /// The code of a value; [`UNKNOWN`] for none.
    pub(crate) fn code(&self, value: Option<f64>) -> u8 {
        let Some(value) = value else { return UNKNOWN };
        let (low, high) = (self.spread(self.low), self.spread(self.high));
        if high <= low {
            return 0;
        }
        (TOP * (self.spread(value.clamp(self.low, self.high)) - low) / (high - low)).round() as u8
    }

    /// The value of a code, `None` where nothing is known.
    pub(crate) fn value(&self, code: u8) -> Option<f64> {
        let (low, high) = (self.spread(self.low), self.spread(self.high));
        let spread = low + f64::from(code) / TOP * (high - low);
        (code != UNKNOWN).then_some(match self.scale {
            Scale::Linear => spread,
            Scale::Log => spread.exp(),
            Scale::Asinh => spread.sinh() * LINEAR_SHARE * self.high,
        })
    }

    /// Where codes lie evenly.
    fn spread(&self, value: f64) -> f64 {
        match self.scale {
            Scale::Linear => value,
            Scale::Log => value.ln(),
            Scale::Asinh => (value / (LINEAR_SHARE * self.high)).asinh(),
        }
    }

    pub(crate) fn validate(&self) -> Result<(), DecodeError> {
        let ends = self.low.is_finite() && self.high.is_finite() && self.low <= self.high;
        let scale = match self.scale {
            Scale::Linear => true,
            Scale::Log => self.low > 0.0,
            Scale::Asinh => self.low == -self.high && self.high > 0.0,
        };
        if ends && scale {
            return Ok(());
        }
        let Self { low, high, scale } = self;
        let reason = format!(
            "{low} to {high} is no range of the scale {scale:?}: it must be finite and ascending, above 0 for Log, about 0 for Asinh"
        );
        Err(DecodeError::new("ranges", reason))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn range(values: &[f64]) -> Range {
        Range::of(&values.iter().map(|&v| coarse::pack(v)).collect::<Vec<_>>())
    }

    #[test]
    fn the_scale_follows_the_values() {
        assert_eq!(range(&[0.0, 0.0, f64::NAN]), Range { low: 0.0, high: 0.0, scale: Scale::Linear });
        assert_eq!(range(&[0.5, 1.0, 2.0]), Range { low: 0.0, high: 2.0, scale: Scale::Linear });
        assert_eq!(range(&[0.5, -2.0, 1.0]), Range { low: -2.0, high: 2.0, scale: Scale::Linear });
        assert_eq!(range(&[0.125, 0.25, 1024.0]).scale, Scale::Log);
        assert_eq!(range(&[0.125, -0.25, 1024.0]).scale, Scale::Asinh);
        assert_eq!(range(&[1e-20, 1.0, 1024.0]).low, 1024.0 * 1e-6);
    }

    #[test]
    fn codes_come_back_within_half_a_step_and_zero_stays_zero() {
        for values in [&[0.5, 1.0, 2.0][..], &[1e-4, 1e-3, 0.5, 100.0], &[-3.0, 1.0, 0.02], &[-1e-3, 2e-3, 500.0]] {
            let range = range(values);
            range.validate().unwrap();
            for &value in values.iter().filter(|&&v| v >= range.low) {
                let back = range.value(range.code(Some(value))).unwrap();
                let step = (range.spread(range.high) - range.spread(range.low)) / TOP;
                let off = (range.spread(back) - range.spread(value.clamp(range.low, range.high))).abs();
                assert!(off <= 0.501 * step, "{range:?}: {value} comes back as {back}");
            }
            if range.low <= 0.0 {
                assert!(range.value(range.code(Some(0.0))).unwrap().abs() < 1e-12 * range.high);
            }
            assert_eq!(range.value(range.code(None)), None);
        }
    }
}

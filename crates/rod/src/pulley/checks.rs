//! The checks of pulleys.

use super::{Pulley, Wheel};
use crate::{Model, ModelError};

impl Pulley {
    /// Checks it.
    pub(crate) fn validate(&self, model: &Model, index: usize) -> Result<(), ModelError> {
        let what = "pulley";
        let value = |quantity, value, allowed| Err(ModelError::Value { what, index, quantity, value, allowed });
        model.check_threaded(what, index, &self.segments, self.holder)?;
        if let Some(&x) = self.centre.iter().chain(self.axis.iter()).find(|x| !x.is_finite()) {
            return value("centre or axis", x, "finite");
        }
        if !(self.radius.is_finite() && self.radius > 0.0) {
            return value("radius", self.radius, "finite and > 0");
        }
        let longest = model.segments[self.segments.clone()].iter().map(|segment| segment.length).fold(0.0, f64::max);
        if longest > self.radius {
            return value("length of a segment of its rod", longest, "at most the radius");
        }
        let friction = self.wheel.friction();
        if !(friction.is_finite() && friction >= 0.0) {
            return value("friction", friction, "finite and >= 0");
        }
        let Wheel::Driven { rates, max_torque, .. } = &self.wheel else { return Ok(()) };
        if max_torque.is_nan() || *max_torque < 0.0 {
            return value("largest torque", *max_torque, ">= 0");
        }
        if let Some([time, rate]) = rates.iter().find(|pair| !(pair[0].is_finite() && pair[1].is_finite())) {
            return value("rate, or its time,", if time.is_finite() { *rate } else { *time }, "finite");
        }
        if let Some(pair) = rates.windows(2).find(|pair| pair[0][0] >= pair[1][0]) {
            return value("time of a rate", pair[1][0], "later than the one before");
        }
        Ok(())
    }
}

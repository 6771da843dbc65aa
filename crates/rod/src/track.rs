//! Vectors that change over time: loads, gravity and rest shapes.

use std::sync::Arc;

use nalgebra::{UnitQuaternion, Vector3};

use crate::motion::{finite, hermite, parabola_velocity};
use crate::{Interpolation, KeyframeError};

/// A vector over time, given at some times. Before the first it is the first, after the last the last.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    interpolation: Interpolation,
    knots: Vec<Knot>,
    repeats: bool,
}

/// A vector at a time, and its rate of change where the track is smooth.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Knot {
    time: f64,
    value: Vector3<f64>,
    rate: Vector3<f64>,
}

impl Track {
    /// The track through these `values` at their times [s]; smooth as in [`Interpolation::Smooth`].
    ///
    /// # Errors
    /// If there are none, numbers are not finite, or times do not increase.
    pub fn new(values: &[(f64, Vector3<f64>)], interpolation: Interpolation) -> Result<Self, KeyframeError> {
        if values.is_empty() {
            return Err(KeyframeError::Empty);
        }
        let mut knots: Vec<Knot> = Vec::with_capacity(values.len());
        for (index, &(time, value)) in values.iter().enumerate() {
            if !time.is_finite() || !finite(&value) {
                return Err(KeyframeError::NotFinite {
                    index,
                    quantity: if time.is_finite() { "value" } else { "time" },
                });
            }
            if let Some(last) = knots.last() {
                if time <= last.time {
                    return Err(KeyframeError::Order { index, time, before: last.time });
                }
                if !finite(&((value - last.value) / (time - last.time))) {
                    return Err(KeyframeError::NotFinite { index, quantity: "rate of change" });
                }
            }
            knots.push(Knot { time, value, rate: Vector3::zeros() });
        }
        if interpolation == Interpolation::Smooth {
            for k in 1..knots.len() - 1 {
                let [before, here, after] = [knots[k - 1], knots[k], knots[k + 1]];
                let spans = [here.time - before.time, after.time - here.time];
                knots[k].rate = parabola_velocity(spans, here.value - before.value, after.value - here.value);
            }
        }
        Ok(Self { interpolation, knots, repeats: false })
    }

    /// The same track, which begins again at its last time, over and over; smooth there, too, where it is smooth.
    ///
    /// # Errors
    /// If it ends with another value than it begins with, or has one value alone.
    pub fn repeated(mut self) -> Result<Self, KeyframeError> {
        let [first, .., last] = self.knots[..] else { return Err(KeyframeError::Repeat) };
        if first.value != last.value {
            return Err(KeyframeError::Repeat);
        }
        let count = self.knots.len();
        if self.interpolation == Interpolation::Smooth && count > 2 {
            let (second, before) = (self.knots[1], self.knots[count - 2]);
            let spans = [last.time - before.time, second.time - first.time];
            let rate = parabola_velocity(spans, last.value - before.value, second.value - first.value);
            (self.knots[0].rate, self.knots[count - 1].rate) = (rate, rate);
        }
        self.repeats = true;
        Ok(self)
    }

    /// The same track with all its vectors turned.
    pub fn turned(&self, by: &UnitQuaternion<f64>) -> Self {
        let turned = |knot: &Knot| Knot { time: knot.time, value: by * knot.value, rate: by * knot.rate };
        Self { knots: self.knots.iter().map(turned).collect(), ..self.clone() }
    }

    /// Times at which it is given [s], ascending.
    pub fn times(&self) -> impl Iterator<Item = f64> {
        self.knots.iter().map(|knot| knot.time)
    }

    /// Times until a last one at which it need not be smooth [s], ascending: those of all repetitions.
    pub fn times_until(&self, until: f64) -> Vec<f64> {
        let mut times: Vec<f64> = self.times().collect();
        let period = times[times.len() - 1] - times[0];
        if self.repeats && period > 0.0 {
            let own = times.clone();
            let more = (1..).map(|k| f64::from(k) * period).take_while(|shift| own[0] + shift < until);
            times.extend(more.flat_map(|shift| own[1..].iter().map(move |time| time + shift).collect::<Vec<_>>()));
        }
        times.retain(|time| *time <= until);
        times
    }

    /// The vector at `time` [s].
    pub fn at(&self, time: f64) -> Vector3<f64> {
        let (first, last) = (self.knots[0].time, self.knots[self.knots.len() - 1].time);
        let is_again = self.repeats && time > last;
        // As far as rounding of the time itself may go.
        let near = 1e-14 * time.abs();
        let mut time = if is_again { first + (time - first).rem_euclid(last - first) } else { time };
        if is_again && time + near >= last {
            time = first;
        }
        let next = self.knots.partition_point(|knot| knot.time <= time + near);
        let Some(here) = next.checked_sub(1).map(|k| &self.knots[k]) else { return self.knots[0].value };
        let Some(next) = self.knots.get(next) else { return here.value };
        let length = next.time - here.time;
        let (share, way) = ((time - here.time) / length, next.value - here.value);
        match self.interpolation {
            Interpolation::Held => here.value,
            Interpolation::Linear => here.value + way * share,
            Interpolation::Smooth => here.value + hermite(share, length, &way, &here.rate, &next.rate)[0],
        }
    }
}

/// What of a model changes over time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Changing {
    /// [`crate::Model::gravity`] [m/s^2].
    Gravity,
    /// The force of [`crate::Model::loads`]' entry [N].
    Force(usize),
    /// The torque of [`crate::Model::loads`]' entry [N m].
    Torque(usize),
    /// The rest Darboux vector of [`crate::Model::joints`]' entry [1/m].
    Rest(usize),
}

/// Something of a model that changes over time, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// What.
    pub of: Changing,
    /// Its values, in the unit of what it is of.
    pub track: Arc<Track>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_track_repeats_without_a_kink() {
        let way = |time: f64| Vector3::new((std::f64::consts::TAU * time).sin(), 0.0, 0.0);
        let values: Vec<_> = (0..=16).map(|k| (0.5 + f64::from(k) / 16.0, way(f64::from(k % 16) / 16.0))).collect();
        let track = Track::new(&values, Interpolation::Smooth).unwrap().repeated().unwrap();
        for k in 0..400 {
            let time = 0.5 + 0.01 * f64::from(k);
            assert!((track.at(time) - way(time - 0.5)).norm() < 5e-3, "{time}");
        }
        assert_eq!(track.at(0.0), Vector3::zeros());
        let held: Vec<_> = (0..=10).map(|k| (0.01 * f64::from(k), Vector3::x() * f64::from(k % 10))).collect();
        let held = Track::new(&held, Interpolation::Held).unwrap().repeated().unwrap();
        // Each value from its time on, in the thousandth repetition, too.
        for step in 0..10_000 {
            assert_eq!(held.at(0.01 * f64::from(step)).x, f64::from(step % 10), "step {step}");
        }
        assert_eq!(held.times_until(0.25).len(), 26);
        let open = Track::new(&values[..5], Interpolation::Linear).unwrap();
        assert_eq!(open.repeated(), Err(KeyframeError::Repeat));
    }

    #[test]
    fn a_track_goes_through_its_values() {
        let values = [(0.5, Vector3::zeros()), (1.0, Vector3::x()), (2.0, Vector3::x()), (4.0, Vector3::y() * 3.0)];
        for interpolation in [Interpolation::Held, Interpolation::Linear, Interpolation::Smooth] {
            let track = Track::new(&values, interpolation).unwrap();
            for (time, value) in values {
                assert_eq!(track.at(time), value);
            }
            assert_eq!((track.at(-1.0), track.at(9.0)), (Vector3::zeros(), Vector3::y() * 3.0));
            // It rests where it stays.
            assert_eq!(track.at(1.3), Vector3::x());
            let halfway = if interpolation == Interpolation::Held { 0.0 } else { 0.5 };
            assert!((track.at(0.75) - Vector3::x() * halfway).norm() < 1e-15);
        }
        assert_eq!(Track::new(&[], Interpolation::Held), Err(KeyframeError::Empty));
        let back = [(1.0, Vector3::zeros()), (0.0, Vector3::zeros())];
        assert!(matches!(Track::new(&back, Interpolation::Held), Err(KeyframeError::Order { index: 1, .. })));
    }
}

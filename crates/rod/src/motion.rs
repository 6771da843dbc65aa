//! Motions: where something that is held is at any time, and how fast it moves there.

use nalgebra::{UnitQuaternion, Vector3};
use thiserror::Error;

use crate::Pose;

/// How a motion goes from one keyframe to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// It stays, and jumps when the next keyframe's time comes.
    Held,
    /// At constant velocity and constant rate of turn.
    #[default]
    Linear,
    /// Along cubics whose velocities go through each keyframe without a jump (Hermite). It begins and ends at rest, and
    /// rests where it stays from one keyframe to the next.
    Smooth,
}

/// A place on the way of a motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Keyframe {
    /// When it is there [s].
    pub time: f64,
    /// Position [m].
    pub position: Vector3<f64>,
    /// By what it has turned since the keyframe before: a rotation vector in world axes [rad], of any length, so that it
    /// can be several turns. Of the first keyframe: since the orientation from which the motion begins.
    pub turn: Vector3<f64>,
}

/// Why keyframes are no motion.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum KeyframeError {
    /// There are none.
    #[error("there must be at least one keyframe")]
    Empty,
    /// A course that is to repeat, but ends elsewhere than it begins.
    #[error("what repeats must end with the value with which it begins")]
    Repeat,
    /// Times do not increase.
    #[error("keyframe {index}: time {time} s, but it must be later than that of the keyframe before, {before} s")]
    Order {
        /// Index of the later keyframe.
        index: usize,
        /// Its time [s].
        time: f64,
        /// The time of the one before [s].
        before: f64,
    },
    /// A jump by more than half a turn, which leads to the same pose as a smaller one.
    #[error("keyframe {index}: it jumps by {angle} rad, but a jump can be no more than half a turn")]
    Jump {
        /// Index of the keyframe.
        index: usize,
        /// The angle [rad].
        angle: f64,
    },
    /// A number is not finite.
    #[error("keyframe {index}: {quantity} must be finite")]
    NotFinite {
        /// Index of the keyframe.
        index: usize,
        /// "time", "position", "turn", "velocity", "value" or "rate of change".
        quantity: &'static str,
    },
}

/// A way through keyframes. Before the first it rests there; after the last it goes on at the velocities it is told to,
/// which are zero unless set.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    interpolation: Interpolation,
    knots: Vec<Knot>,
    /// v [m/s] and w [rad/s] after the last keyframe.
    after: [Vector3<f64>; 2],
}

/// A keyframe with its orientation, and the velocities with which a smooth motion goes through it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Knot {
    time: f64,
    position: Vector3<f64>,
    orientation: UnitQuaternion<f64>,
    /// Turn to the next keyframe [rad].
    turn: Vector3<f64>,
    velocity: Vector3<f64>,
    rate: Vector3<f64>,
}

/// A pose with its velocities.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MovingPose {
    /// Where it is.
    pub pose: Pose,
    /// Velocity v [m/s].
    pub velocity: Vector3<f64>,
    /// Angular velocity w in world axes [rad/s].
    pub angular_velocity: Vector3<f64>,
}

impl Motion {
    /// The motion through `keyframes`, their turns beginning from `orientation`.
    ///
    /// # Errors
    /// If there are none, numbers are not finite, or times do not increase.
    pub fn new(
        orientation: UnitQuaternion<f64>,
        keyframes: &[Keyframe],
        interpolation: Interpolation,
    ) -> Result<Self, KeyframeError> {
        if keyframes.is_empty() {
            return Err(KeyframeError::Empty);
        }
        let mut knots: Vec<Knot> = Vec::with_capacity(keyframes.len());
        let mut q = orientation;
        for (index, &Keyframe { time, position, turn }) in keyframes.iter().enumerate() {
            let checks = [("time", time.is_finite()), ("position", finite(&position)), ("turn", finite(&turn))];
            if let Some((quantity, _)) = checks.into_iter().find(|(_, ok)| !ok) {
                return Err(KeyframeError::NotFinite { index, quantity });
            }
            if let Some(last) = knots.last_mut() {
                let elapsed = time - last.time;
                if elapsed <= 0.0 {
                    return Err(KeyframeError::Order { index, time, before: last.time });
                }
                if !finite(&((position - last.position) / elapsed)) || !finite(&(turn / elapsed)) {
                    return Err(KeyframeError::NotFinite { index, quantity: "velocity" });
                }
                if interpolation == Interpolation::Held && turn.norm() > std::f64::consts::PI {
                    return Err(KeyframeError::Jump { index, angle: turn.norm() });
                }
                last.turn = turn;
            }
            q = UnitQuaternion::from_scaled_axis(turn) * q;
            let zero = Vector3::zeros();
            knots.push(Knot { time, position, orientation: q, turn: zero, velocity: zero, rate: zero });
        }
        if interpolation == Interpolation::Smooth {
            set_velocities(&mut knots);
            if let Some(index) = knots.iter().position(|knot| !finite(&knot.velocity) || !finite(&knot.rate)) {
                return Err(KeyframeError::NotFinite { index, quantity: "velocity" });
            }
        }
        Ok(Self { interpolation, knots, after: [Vector3::zeros(); 2] })
    }

    /// The motion through `poses` at these times [s], turning the shorter way from each to the next.
    ///
    /// # Errors
    /// As [`Motion::new`].
    pub fn through(poses: &[(f64, Pose)], interpolation: Interpolation) -> Result<Self, KeyframeError> {
        let first = poses.first().map_or_else(UnitQuaternion::identity, |(_, pose)| pose.orientation);
        let mut before = first;
        let keyframe = |&(time, Pose { position, orientation }): &(f64, Pose)| {
            let turn = before.rotation_to(&orientation).scaled_axis();
            before = orientation;
            Keyframe { time, position, turn }
        };
        Self::new(first, &poses.iter().map(keyframe).collect::<Vec<_>>(), interpolation)
    }

    /// A motion from `pose` at `times` [s] on, each time with the velocities v [m/s] and w [rad/s] until the next; the last
    /// ones go on for ever. It rests before the first.
    ///
    /// # Errors
    /// As [`Motion::new`].
    pub fn at_velocities(pose: &Pose, velocities: &[(f64, Vector3<f64>, Vector3<f64>)]) -> Result<Self, KeyframeError> {
        let mut keyframes: Vec<Keyframe> = Vec::with_capacity(velocities.len());
        let mut going: Option<(f64, Vector3<f64>, Vector3<f64>)> = None;
        for (index, &(time, v, w)) in velocities.iter().enumerate() {
            let (since, velocity, rate) = going.unwrap_or((time, Vector3::zeros(), Vector3::zeros()));
            let elapsed = time - since;
            let position = keyframes.last().map_or(pose.position, |last| last.position) + velocity * elapsed;
            keyframes.push(Keyframe { time, position, turn: rate * elapsed });
            if !finite(&v) || !finite(&w) {
                return Err(KeyframeError::NotFinite { index, quantity: "velocity" });
            }
            going = Some((time, v, w));
        }
        let mut motion = Self::new(pose.orientation, &keyframes, Interpolation::Linear)?;
        if let Some((_, v, w)) = going {
            motion.after = [v, w];
        }
        Ok(motion)
    }

    /// The same motion elsewhere: a point x of its way becomes `orientation * x + position`, all directions turn along.
    pub fn moved(&self, by: &Pose) -> Self {
        let turn = by.orientation;
        let moved = |knot: &Knot| Knot {
            time: knot.time,
            position: turn * knot.position + by.position,
            orientation: turn * knot.orientation,
            turn: turn * knot.turn,
            velocity: turn * knot.velocity,
            rate: turn * knot.rate,
        };
        let knots = self.knots.iter().map(moved).collect();
        Self { interpolation: self.interpolation, knots, after: self.after.map(|velocity| turn * velocity) }
    }

    /// One that stays at `pose`.
    pub fn resting(pose: &Pose) -> Self {
        let zero = Vector3::zeros();
        let Pose { position, orientation } = *pose;
        let knot = Knot { time: 0.0, position, orientation, turn: zero, velocity: zero, rate: zero };
        Self { interpolation: Interpolation::Held, knots: vec![knot], after: [zero; 2] }
    }

    /// The same motion at places that lie `away` [m] from its own.
    pub fn shifted(&self, away: &Vector3<f64>) -> Self {
        let mut shifted = self.clone();
        shifted.knots.iter_mut().for_each(|knot| knot.position += away);
        shifted
    }

    /// Times of the keyframes [s], ascending.
    pub fn times(&self) -> impl Iterator<Item = f64> {
        self.knots.iter().map(|knot| knot.time)
    }

    /// By how much it turns on its way from one time to a later one [s], there and back counted alike [rad]: what poses
    /// alone do not tell. Between two keyframes the turn is taken as evenly spread.
    pub fn turned(&self, from: f64, to: f64) -> f64 {
        let [first, last] = [&self.knots[0], &self.knots[self.knots.len() - 1]];
        let after = (to - from.max(last.time)).max(0.0) * self.after[1].norm();
        if to <= first.time || from >= last.time {
            return after;
        }
        let begin = self.knots.partition_point(|knot| knot.time <= from).saturating_sub(1);
        let under_way = self.knots[begin..].windows(2).take_while(|pair| pair[0].time < to);
        let within = under_way.map(|pair| {
            let share = match self.interpolation {
                Interpolation::Held => f64::from(u8::from(from < pair[1].time && pair[1].time <= to)),
                _ => (to.min(pair[1].time) - from.max(pair[0].time)).max(0.0) / (pair[1].time - pair[0].time),
            };
            share * pair[0].turn.norm()
        });
        after + within.sum::<f64>()
    }

    /// Where a body at `pose` is in the frame of the motion's pose at `time` [s].
    pub fn grip(&self, pose: &Pose, time: f64) -> Pose {
        let Pose { position, orientation } = self.at(time).pose;
        let back = orientation.inverse();
        Pose { position: back * (pose.position - position), orientation: back * pose.orientation }
    }

    /// Where a body is at `time` [s] that goes with the motion as one rigid body, at `grip` in the frame of its pose, and
    /// how fast it goes on from there.
    pub fn carry(&self, grip: &Pose, time: f64) -> MovingPose {
        let MovingPose { pose, velocity, angular_velocity } = self.at(time);
        let arm = pose.orientation * grip.position;
        let orientation = pose.orientation * grip.orientation;
        MovingPose {
            pose: Pose { position: pose.position + arm, orientation },
            velocity: velocity + angular_velocity.cross(&arm),
            angular_velocity,
        }
    }

    /// Where it is at `time` [s], and how fast it goes on from there: at a keyframe, as in what comes after it.
    pub fn at(&self, time: f64) -> MovingPose {
        // A sum of time steps that ends at a keyframe may be a rounding error short of it.
        let rounded_up = time + 1e-14 * time.abs();
        let next = self.knots.partition_point(|knot| knot.time <= rounded_up);
        let Some(knot) = next.checked_sub(1).map(|k| &self.knots[k]) else {
            return self.knots[0].resting();
        };
        let elapsed = time - knot.time;
        let Some(next) = self.knots.get(next) else {
            let [velocity, rate] = self.after;
            return knot.moved(velocity * elapsed, rate * elapsed, velocity, rate);
        };
        let length = next.time - knot.time;
        let way = next.position - knot.position;
        match self.interpolation {
            Interpolation::Held => knot.resting(),
            Interpolation::Linear => {
                let share = elapsed / length;
                knot.moved(way * share, knot.turn * share, way / length, knot.turn / length)
            }
            Interpolation::Smooth => {
                let s = elapsed / length;
                let [shift, velocity] = hermite(s, length, &way, &knot.velocity, &next.velocity);
                let end = inverse_of_turning(&knot.turn, &next.rate);
                let [turn, change] = hermite(s, length, &knot.turn, &knot.rate, &end);
                knot.moved(shift, turn, velocity, turning(&turn, &change))
            }
        }
    }
}

impl Knot {
    fn resting(&self) -> MovingPose {
        self.moved(Vector3::zeros(), Vector3::zeros(), Vector3::zeros(), Vector3::zeros())
    }

    fn moved(
        &self,
        shift: Vector3<f64>,
        turn: Vector3<f64>,
        velocity: Vector3<f64>,
        angular_velocity: Vector3<f64>,
    ) -> MovingPose {
        let orientation = UnitQuaternion::from_scaled_axis(turn) * self.orientation;
        MovingPose { pose: Pose { position: self.position + shift, orientation }, velocity, angular_velocity }
    }
}

pub(crate) fn finite(x: &Vector3<f64>) -> bool {
    x.iter().all(|x| x.is_finite())
}

/// Velocities with which a smooth motion goes through its keyframes: those of the parabola through each and its two
/// neighbours; zero at both ends, and where it rests on either side.
fn set_velocities(knots: &mut [Knot]) {
    for k in 1..knots.len().saturating_sub(1) {
        let [before, here, after] = [knots[k - 1], knots[k], knots[k + 1]];
        let spans = [here.time - before.time, after.time - here.time];
        knots[k].velocity = parabola_velocity(spans, here.position - before.position, after.position - here.position);
        // Beyond half a turn the rate at the end of a turn about another axis is no rate of that turn's vector.
        let is_one_axis = before.turn.cross(&here.turn).norm() <= 1e-12 * before.turn.norm() * here.turn.norm();
        let is_short = before.turn.norm().max(here.turn.norm()) < std::f64::consts::PI;
        if is_one_axis || is_short {
            knots[k].rate = parabola_velocity(spans, before.turn, here.turn);
        }
    }
}

/// Velocity halfway through two ways that take so long each [s]: that of the parabola through the three places; zero where
/// one of the ways leads nowhere.
pub(crate) fn parabola_velocity([h0, h1]: [f64; 2], d0: Vector3<f64>, d1: Vector3<f64>) -> Vector3<f64> {
    match d0 == Vector3::zeros() || d1 == Vector3::zeros() {
        true => Vector3::zeros(),
        false => (d0 * (h1 / h0) + d1 * (h0 / h1)) / (h0 + h1),
    }
}

/// The cubic from zero to `way`, which begins with the velocity `first` and ends with `last`, at a share `s` of its
/// `length` [s]: its value and its velocity.
pub(crate) fn hermite(
    s: f64,
    length: f64,
    way: &Vector3<f64>,
    first: &Vector3<f64>,
    last: &Vector3<f64>,
) -> [Vector3<f64>; 2] {
    let rest = 1.0 - s;
    let value = way * (s * s * (3.0 - 2.0 * s)) + (first * (s * rest * rest) - last * (s * s * rest)) * length;
    let velocity = way * (6.0 * s * rest / length) + first * (rest * (1.0 - 3.0 * s)) + last * (s * (3.0 * s - 2.0));
    [value, velocity]
}

/// Angular velocity in world axes of `exp(turn)`, whose vector changes by `change` a second.
fn turning(turn: &Vector3<f64>, change: &Vector3<f64>) -> Vector3<f64> {
    let angle = turn.norm();
    let (a, b) = if angle < 1e-4 {
        (0.5 - angle * angle / 24.0, 1.0 / 6.0 - angle * angle / 120.0)
    } else {
        ((1.0 - angle.cos()) / angle.powi(2), (angle - angle.sin()) / angle.powi(3))
    };
    let across = turn.cross(change);
    change + across * a + turn.cross(&across) * b
}

/// The change of a turn's vector a second that makes the angular velocity `rate`: the inverse of [`turning`], for less
/// than a whole turn, or for rates about the turn's own axis.
fn inverse_of_turning(turn: &Vector3<f64>, rate: &Vector3<f64>) -> Vector3<f64> {
    let angle = turn.norm();
    let across = turn.cross(rate);
    if across.norm() <= 1e-12 * angle * rate.norm() {
        return *rate;
    }
    let c = if angle < 1e-3 {
        1.0 / 12.0 + angle * angle / 720.0
    } else {
        1.0 / angle.powi(2) - (1.0 + angle.cos()) / (2.0 * angle * angle.sin())
    };
    rate - across * 0.5 + turn.cross(&across) * c
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};
    use std::sync::Arc;

    use super::*;
    use crate::{Body, Driven};

    fn pose(x: [f64; 3], turn: [f64; 3]) -> Pose {
        Pose { position: x.into(), orientation: UnitQuaternion::from_scaled_axis(turn.into()) }
    }

    fn apart(a: &Pose, b: &Pose) -> f64 {
        (a.position - b.position).norm().max(a.orientation.angle_to(&b.orientation))
    }

    /// Keyframes of all sorts: uneven times, a rest, a way back, turns about several axes.
    fn poses() -> Vec<(f64, Pose)> {
        vec![
            (0.5, pose([0.0, 0.0, 1.0], [0.1, 0.0, 0.0])),
            (1.0, pose([0.2, 0.0, 1.0], [0.5, 0.4, -0.2])),
            (1.3, pose([0.3, -0.5, 1.5], [0.2, 0.9, 1.2])),
            (2.0, pose([0.3, -0.5, 1.5], [0.2, 0.9, 1.2])),
            (2.2, pose([0.2, 0.0, 1.0], [-0.8, 2.0, 1.5])),
            (4.0, pose([0.7, 0.1, 1.0], [0.0, 0.0, 0.0])),
        ]
    }

    #[test]
    fn every_way_goes_through_its_keyframes() {
        for interpolation in [Interpolation::Held, Interpolation::Linear, Interpolation::Smooth] {
            let motion = Motion::through(&poses(), interpolation).unwrap();
            for (time, pose) in poses() {
                assert!(apart(&motion.at(time).pose, &pose) < 1e-12, "{interpolation:?} at {time}");
            }
            // It rests before the first and after the last.
            for (time, pose) in [(-1.0, poses()[0].1), (0.4, poses()[0].1), (9.0, poses()[5].1)] {
                let there = motion.at(time);
                assert!(apart(&there.pose, &pose) < 1e-12);
                assert_eq!((there.velocity.norm(), there.angular_velocity.norm()), (0.0, 0.0));
            }
        }
    }

    #[test]
    fn velocities_are_those_of_the_poses() {
        for interpolation in [Interpolation::Held, Interpolation::Linear, Interpolation::Smooth] {
            let motion = Motion::through(&poses(), interpolation).unwrap();
            for k in 0..40 {
                let (time, h) = (0.53 + 0.1 * k as f64, 1e-6);
                let [before, here, after] = [time - h, time, time + h].map(|time| motion.at(time));
                let v = (after.pose.position - before.pose.position) / (2.0 * h);
                let w = (after.pose.orientation * before.pose.orientation.inverse()).scaled_axis() / (2.0 * h);
                assert!((v - here.velocity).norm() < 1e-7, "{interpolation:?} at {time}: {v} {}", here.velocity);
                assert!((w - here.angular_velocity).norm() < 1e-7, "{interpolation:?} at {time}");
            }
        }
    }

    #[test]
    fn a_smooth_motion_has_no_jumps_of_velocity_and_rests_where_it_stays() {
        let motion = Motion::through(&poses(), Interpolation::Smooth).unwrap();
        for (time, _) in poses() {
            let [before, after] = [time - 1e-9, time + 1e-9].map(|time| motion.at(time));
            assert!((before.velocity - after.velocity).norm() < 1e-6, "{time}");
            assert!((before.angular_velocity - after.angular_velocity).norm() < 1e-6, "{time}");
        }
        for time in [1.3, 1.31, 1.7, 1.99] {
            let there = motion.at(time);
            assert!(there.velocity.norm() < 1e-12 && there.angular_velocity.norm() < 1e-12, "{time}");
            assert!(apart(&there.pose, &poses()[2].1) < 1e-12);
        }
    }

    #[test]
    fn poses_turn_the_shorter_way_and_turns_as_far_as_they_say() {
        let quarter = |time, angle: f64| (time, pose([0.0; 3], [0.0, 0.0, angle]));
        let shortest = Motion::through(&[quarter(0.0, 0.0), quarter(1.0, 1.5 * PI)], Interpolation::Linear).unwrap();
        assert!((shortest.at(0.5).angular_velocity - Vector3::z() * (-0.5 * PI)).norm() < 1e-12);
        let frame = |time, turns: f64| Keyframe { time, position: Vector3::zeros(), turn: Vector3::z() * TAU * turns };
        let frames = [frame(0.0, 0.0), frame(1.0, 3.25), frame(2.0, -1.0)];
        for interpolation in [Interpolation::Linear, Interpolation::Smooth] {
            let motion = Motion::new(UnitQuaternion::identity(), &frames, interpolation).unwrap();
            // What is turned in all is the integral of the rate.
            let turned: f64 =
                (0..1000).map(|k| motion.at((f64::from(k) + 0.5) / 1000.0).angular_velocity.z / 1000.0).sum();
            assert!((turned - 3.25 * TAU).abs() < 1e-4, "{interpolation:?}: {turned}");
            let there = motion.at(1.0).pose.orientation;
            assert!(there.angle_to(&UnitQuaternion::from_scaled_axis(Vector3::z() * 0.25 * TAU)) < 1e-12);
        }
    }

    #[test]
    fn what_is_turned_is_counted_there_and_back() {
        let frame = |time, turn: f64| Keyframe { time, position: Vector3::zeros(), turn: Vector3::y() * turn };
        let frames = [frame(1.0, 0.0), frame(2.0, 3.0), frame(4.0, -2.0)];
        let made = |interpolation| Motion::new(UnitQuaternion::identity(), &frames, interpolation).unwrap();
        let linear = made(Interpolation::Linear);
        for (from, to, turned) in [(0.0, 1.0, 0.0), (0.0, 1.5, 1.5), (1.5, 3.0, 2.5), (0.0, 9.0, 5.0), (4.0, 9.0, 0.0)]
        {
            assert!((linear.turned(from, to) - turned).abs() < 1e-14, "{from} to {to}: {}", linear.turned(from, to));
        }
        let held = made(Interpolation::Held);
        assert_eq!([(1.9, 2.0), (2.0, 3.9), (0.0, 9.0)].map(|(from, to)| held.turned(from, to)), [3.0, 0.0, 5.0]);
        let steady = Motion::at_velocities(&pose([0.0; 3], [0.0; 3]), &[(1.0, Vector3::zeros(), Vector3::z() * 4.0)]);
        assert!((steady.unwrap().turned(0.5, 2.5) - 6.0).abs() < 1e-14);
        let jump = Motion::new(UnitQuaternion::identity(), &[frame(0.0, 0.0), frame(1.0, 4.0)], Interpolation::Held);
        assert_eq!(jump, Err(KeyframeError::Jump { index: 1, angle: 4.0 }));
    }

    #[test]
    fn velocities_are_held_until_the_next_and_go_on_for_ever() {
        let start = pose([1.0, 2.0, 3.0], [0.3, -0.2, 0.9]);
        let (x, z) = (Vector3::x(), Vector3::z());
        let motion = Motion::at_velocities(
            &start,
            &[(1.0, x, Vector3::zeros()), (2.0, Vector3::zeros(), z), (3.0, -x * 0.5, z * 2.0)],
        )
        .unwrap();
        assert_eq!(motion.at(0.5).pose, start);
        assert!((motion.at(1.5).pose.position - start.position - x * 0.5).norm() < 1e-15);
        let end = motion.at(103.0);
        assert!((end.pose.position - start.position - x * (1.0 - 50.0)).norm() < 1e-12);
        let expected = UnitQuaternion::from_scaled_axis(z * 201.0) * start.orientation;
        assert!(end.pose.orientation.angle_to(&expected) < 1e-12);
        assert_eq!((end.velocity, end.angular_velocity), (-x * 0.5, z * 2.0));
    }

    #[test]
    fn a_grip_goes_with_its_motion_as_one_rigid_body() {
        let motion = Arc::new(Motion::through(&poses(), Interpolation::Smooth).unwrap());
        let here = pose([1.0, -0.3, 0.2], [0.4, 0.1, -2.0]);
        let driven = Driven::gripped(Body::Segment(0), motion.clone(), &here, 1.2);
        assert!(apart(&driven.at(1.2).pose, &here) < 1e-14);
        let distance = |time: f64| (driven.at(time).pose.position - motion.at(time).pose.position).norm();
        assert!((distance(3.1) - distance(1.2)).abs() < 1e-14);
        let (time, h) = (3.1, 1e-6);
        let [before, after] = [time - h, time + h].map(|time| driven.at(time).pose.position);
        assert!(((after - before) / (2.0 * h) - driven.at(time).velocity).norm() < 1e-8);
        let same = Driven::new(Body::Segment(0), motion.clone());
        assert_eq!(same.at(3.1), motion.at(3.1));
    }

    #[test]
    fn what_is_no_motion_is_refused_with_its_place() {
        let frame = |time| Keyframe { time, position: Vector3::zeros(), turn: Vector3::zeros() };
        let made = |frames: &[Keyframe]| Motion::new(UnitQuaternion::identity(), frames, Interpolation::Linear);
        assert_eq!(made(&[]), Err(KeyframeError::Empty));
        let error = made(&[frame(0.0), frame(1.0), frame(1.0)]).unwrap_err();
        assert_eq!(error, KeyframeError::Order { index: 2, time: 1.0, before: 1.0 });
        let mut wrong = frame(2.0);
        wrong.turn.y = f64::NAN;
        assert_eq!(made(&[frame(0.0), wrong]), Err(KeyframeError::NotFinite { index: 1, quantity: "turn" }));
    }
}

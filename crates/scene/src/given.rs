//! What is given of a motion, in the scene or in a table, and the motion that it makes.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rod::{Interpolation, Keyframe, KeyframeError, Motion, Pose};

/// What is given of a motion, one entry a time.
pub(crate) struct Given {
    pub(crate) times: Vec<f64>,
    pub(crate) way: Way,
    pub(crate) turning: Turning,
}

/// Where a motion leads.
pub(crate) enum Way {
    /// Nowhere: it stays.
    None,
    /// Away from where it begins [m].
    Shifts(Vec<Vector3<f64>>),
    /// In the world [m].
    Positions(Vec<Vector3<f64>>),
    /// At velocities that are held until the next time [m/s].
    Velocities(Vec<Vector3<f64>>),
}

/// How it turns.
pub(crate) enum Turning {
    /// Not at all.
    None,
    /// By rotation vectors since the time before [rad].
    Turns(Vec<Vector3<f64>>),
    /// The shorter way from one orientation to the next.
    Orientations(Vec<UnitQuaternion<f64>>),
    /// At angular velocities that are held until the next time [rad/s].
    Rates(Vec<Vector3<f64>>),
}

/// A quaternion [w, x, y, z] that is almost of norm 1, made so.
pub(crate) fn unit([w, x, y, z]: [f64; 4]) -> Option<UnitQuaternion<f64>> {
    let quaternion = Quaternion::new(w, x, y, z);
    let is_unit = (quaternion.norm() - 1.0).abs() <= 1e-3;
    is_unit.then(|| UnitQuaternion::from_quaternion(quaternion))
}

impl Given {
    /// Whether it is given by velocities.
    pub(crate) fn goes_by_velocity(&self) -> bool {
        matches!(self.way, Way::Velocities(_)) || matches!(self.turning, Turning::Rates(_))
    }

    /// Whether one half is given by velocities, the other by poses.
    pub(crate) fn is_mixed(&self) -> bool {
        let by_pose = matches!(self.way, Way::Shifts(_) | Way::Positions(_))
            || matches!(self.turning, Turning::Turns(_) | Turning::Orientations(_));
        by_pose && self.goes_by_velocity()
    }

    /// The motion of what begins at `pose`.
    pub(crate) fn motion(&self, pose: &Pose, interpolation: Interpolation) -> Result<Motion, KeyframeError> {
        let zero = Vector3::zeros();
        let at = |list: &[Vector3<f64>], k: usize| list.get(k).copied().unwrap_or(zero);
        let times = self.times.iter().copied().enumerate();
        if self.goes_by_velocity() {
            let velocity = |k| if let Way::Velocities(list) = &self.way { at(list, k) } else { zero };
            let rate = |k| if let Turning::Rates(list) = &self.turning { at(list, k) } else { zero };
            return Motion::at_velocities(
                pose,
                &times.map(|(k, time)| (time, velocity(k), rate(k))).collect::<Vec<_>>(),
            );
        }
        let position = |k| match &self.way {
            Way::Shifts(list) => pose.position + at(list, k),
            Way::Positions(list) => at(list, k),
            Way::None | Way::Velocities(_) => pose.position,
        };
        if let Turning::Orientations(list) = &self.turning {
            let pose = |(k, time)| (time, Pose { position: position(k), orientation: list[k] });
            return Motion::through(&times.map(pose).collect::<Vec<_>>(), interpolation);
        }
        let turn = |k| if let Turning::Turns(list) = &self.turning { at(list, k) } else { zero };
        let keyframe = |(k, time)| Keyframe { time, position: position(k), turn: turn(k) };
        Motion::new(pose.orientation, &times.map(keyframe).collect::<Vec<_>>(), interpolation)
    }
}

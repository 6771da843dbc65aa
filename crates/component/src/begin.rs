//! What a step begins with, kept to go back there, and derivatives of a number with respect to it.

use std::sync::Arc;

use kernels::Spatial;
use kernels::lane::Real;
use kernels::math::Vec3;

use super::before::{Group, scatter};
use super::multistep::StepsBefore;
use super::parts::{copy_pose, copy_spatial, pick, pick_pose, pick_spatial, put};
use super::{BodyPose, Component};

/// What a step begins with.
#[derive(Clone, Debug)]
pub struct Begin {
    /// Those that the step before ended with, as a rule, and then kept once.
    pub poses: Arc<Vec<BodyPose<f64>>>,
    velocities: Vec<Spatial<f64>>,
    /// Empty where nothing was given.
    given: Vec<f64>,
    has_given: bool,
    last_dt: f64,
    last_effective: f64,
    steps: Option<StepsBefore>,
}

/// Derivatives of a number with respect to what a body's state consists of.
#[derive(Clone, Copy, Debug)]
pub struct BodyBar<T = f64> {
    /// The pose: shift and turn.
    pub pose: Spatial<T>,
    /// Velocities over the last step.
    pub velocity: Spatial<T>,
    /// Velocity and angular momentum at the end of the last step.
    pub now: Spatial<T>,
    /// The same one step earlier.
    pub(crate) earlier: Spatial<T>,
    /// The discrete momentum over the last step.
    pub(crate) over: Vec3<T>,
    /// What velocity and angular momentum gained in the step before the last one.
    pub(crate) gained: Spatial<T>,
}

impl<T: Real> Default for BodyBar<T> {
    #[inline(always)]
    fn default() -> Self {
        let zero = Spatial::zero();
        Self { pose: zero, velocity: zero, now: zero, earlier: zero, over: Vec3::zero(), gained: zero }
    }
}

impl<T: Real> BodyBar<T> {
    /// Those of one lane.
    pub fn pick(&self, lane: usize) -> BodyBar {
        BodyBar {
            pose: pick_spatial(&self.pose, lane),
            velocity: pick_spatial(&self.velocity, lane),
            now: pick_spatial(&self.now, lane),
            earlier: pick_spatial(&self.earlier, lane),
            over: pick(self.over, lane),
            gained: pick_spatial(&self.gained, lane),
        }
    }

    /// Puts those of one lane back.
    pub fn put(&mut self, lane: usize, from: &BodyBar) {
        copy_spatial(&mut self.pose, lane, &from.pose, 0);
        copy_spatial(&mut self.velocity, lane, &from.velocity, 0);
        copy_spatial(&mut self.now, lane, &from.now, 0);
        copy_spatial(&mut self.earlier, lane, &from.earlier, 0);
        put(&mut self.over, lane, from.over.0);
        copy_spatial(&mut self.gained, lane, &from.gained, 0);
    }
}

impl BodyBar {
    /// The list that a group of numbers belongs to.
    pub fn add(&mut self, group: Group, by: Spatial<f64>) {
        let own = match group {
            Group::Pose => &mut self.pose,
            Group::Velocity => &mut self.velocity,
            Group::Now => &mut self.now,
            Group::Earlier => &mut self.earlier,
            Group::Over => return self.over += by.linear,
        };
        *own = own.plus(by, 1.0);
    }
}

impl<T: Real> Component<T> {
    /// What the step under way, which has not ended yet, began with in one lane.
    pub fn begin(&self, lane: usize) -> Begin {
        let given = self.given.iter().map(|given| given.lane(lane));
        Begin {
            poses: Arc::new(self.start.iter().map(|pose| pick_pose(pose, lane)).collect()),
            velocities: self.velocities.iter().map(|velocity| pick_spatial(velocity, lane)).collect(),
            given: if self.has_given { given.collect() } else { Vec::new() },
            has_given: self.has_given,
            last_dt: self.last_dt.lane(lane),
            last_effective: self.last_effective.lane(lane),
            steps: self.multistep.as_ref().map(|steps| steps.before(lane)),
        }
    }
}

impl Begin {
    /// What sets began the same step with, each with the places of its bodies among all of them: so many, of which so many
    /// segments come first.
    pub fn together(parts: &[(Self, Vec<usize>)], [bodies, segments]: [usize; 2]) -> Option<Self> {
        let (first, _) = parts.first()?;
        let has_given = parts.iter().any(|(part, _)| part.has_given);
        let mut poses = vec![*first.poses.first()?; bodies];
        let mut velocities = vec![Spatial::zero(); bodies];
        let mut given = vec![-1.0; if has_given { bodies } else { 0 }];
        for (part, places) in parts {
            scatter(&mut poses, &part.poses, places);
            scatter(&mut velocities, &part.velocities, places);
            scatter(&mut given, &part.given, places);
        }
        Some(Self {
            poses: Arc::new(poses),
            velocities,
            given,
            has_given,
            last_dt: first.last_dt,
            last_effective: first.last_effective,
            steps: StepsBefore::together(
                parts.iter().filter_map(|(part, places)| Some((part.steps.as_ref()?, places.as_slice()))),
                segments,
            ),
        })
    }
}

impl<T: Real> Component<T> {
    /// Goes back to where a step began, as constants.
    pub fn begin_at(&mut self, begin: &Begin) {
        for (own, pose) in self.poses.iter_mut().zip(begin.poses.iter()) {
            *own = BodyPose::splat(pose);
        }
        for (own, from) in self.velocities.iter_mut().zip(&begin.velocities) {
            *own = Spatial::splat(*from);
        }
        for (i, own) in self.given.iter_mut().enumerate() {
            *own = T::splat(begin.given.get(i).copied().unwrap_or(-1.0));
        }
        self.has_given = begin.has_given;
        self.last_dt = T::splat(begin.last_dt);
        self.last_effective = T::splat(begin.last_effective);
        if let (Some(own), Some(from)) = (&mut self.multistep, &begin.steps) {
            own.go_back(from);
        }
    }

    /// Goes on from the steps before as a step did that began so: by Euler's rule where that restarted.
    pub fn go_on_like(&mut self, begin: &Begin) {
        if let (Some(own), Some(from)) = (&mut self.multistep, &begin.steps) {
            own.go_on_like(from);
        }
    }

    /// Goes back to where a step began in one lane.
    pub fn begin_lane_at(&mut self, lane: usize, begin: &Begin) {
        for (own, pose) in self.poses.iter_mut().zip(begin.poses.iter()) {
            copy_pose(own, lane, pose, 0);
        }
        for (own, from) in self.velocities.iter_mut().zip(&begin.velocities) {
            copy_spatial(own, lane, from, 0);
        }
        if lane == 0 {
            self.has_given = false;
        }
        self.has_given |= begin.has_given;
        for (i, own) in self.given.iter_mut().enumerate() {
            own.set_lane(lane, begin.given.get(i).copied().unwrap_or(-1.0));
        }
        self.last_dt.set_lane(lane, begin.last_dt);
        self.last_effective.set_lane(lane, begin.last_effective);
        if let (Some(own), Some(from)) = (&mut self.multistep, &begin.steps) {
            own.go_back_in(lane, from);
        }
    }

    /// Puts poses and multipliers of one lane to where a step was solved.
    pub fn place_lane(&mut self, lane: usize, poses: &[BodyPose<f64>], lambda: &[Spatial<f64>]) {
        self.poses.iter_mut().zip(poses).for_each(|(own, pose)| copy_pose(own, lane, pose, 0));
        self.lambda.iter_mut().zip(lambda).for_each(|(own, lambda)| copy_spatial(own, lane, lambda, 0));
        self.pulls_hold = false;
    }

    /// Whether steps know of those before.
    pub fn has_steps(&self) -> bool {
        self.multistep.is_some()
    }
}

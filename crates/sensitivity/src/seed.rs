//! Which directions a component in dual numbers is moved along.

use component::{Component, Members};
use kernels::dual::Dual;
use nalgebra::Vector3;
use rod::{Body, Model};

use super::{ObstacleVariation, Variation};

/// How one held body moves along one direction.
#[derive(Clone, Debug)]
pub(super) struct HeldSeed {
    pub(super) body: usize,
    pub(super) direction: usize,
    /// Of a fixed segment that nothing moves: its change at the start.
    base: [Vector3<f64>; 2],
    /// At the ends of steps.
    poses: Vec<[Vector3<f64>; 2]>,
}

impl HeldSeed {
    /// Its change when so much of a step, counted from 0, is over.
    pub(super) fn at(&self, step: usize, share: f64) -> [Vector3<f64>; 2] {
        let end = |step: Option<usize>| match (step, self.poses.last()) {
            (Some(step), Some(last)) => *self.poses.get(step).unwrap_or(last),
            _ => [Vector3::zeros(); 2],
        };
        let (before, after) = (end(step.checked_sub(1)), end(Some(step)));
        [0, 1].map(|k| self.base[k] + before[k] * (1.0 - share) + after[k] * share)
    }
}

/// How one obstacle moves along one direction.
#[derive(Clone, Debug)]
pub(super) struct ObstacleSeed {
    pub(super) obstacle: usize,
    pub(super) direction: usize,
    /// At the start and at the ends of steps.
    poses: Vec<[Vector3<f64>; 2]>,
}

impl ObstacleSeed {
    /// Those of `variations`, one a direction.
    pub(super) fn all(variations: &[Variation]) -> Vec<Self> {
        let of = |(direction, variation): (usize, &Variation)| {
            let seed = move |ObstacleVariation { obstacle, poses }: &ObstacleVariation| {
                (!poses.is_empty()).then(|| Self { obstacle: *obstacle, direction, poses: poses.clone() })
            };
            variation.obstacles.iter().filter_map(seed).collect::<Vec<_>>()
        };
        variations.iter().enumerate().flat_map(of).collect()
    }

    /// Its change when so much of a step, counted from 0, is over.
    pub(super) fn at(&self, step: usize, share: f64) -> [Vector3<f64>; 2] {
        let end = |frame: usize| self.poses[frame.min(self.poses.len() - 1)];
        let (before, after) = (end(step), end(step + 1));
        [0, 1].map(|k| before[k] * (1.0 - share) + after[k] * share)
    }
}

/// Seeds a component along `variations`, one a direction, at its start; returns how its held bodies move.
pub(super) fn seed<const D: usize>(
    component: &mut Component<Dual<D>>,
    members: &Members,
    model: &Model,
    variations: &[Variation],
) -> Vec<HeldSeed> {
    let mut held = Vec::new();
    for (direction, variation) in variations.iter().enumerate() {
        component.seed_constants(members, model, direction, variation);
        let start = &variation.start;
        for (body, &i) in members.segments.iter().enumerate() {
            let pose = [start.positions[i], start.turns[i]];
            match component.is_still(body) {
                false => {
                    component.seed_start(body, direction, pose, [start.velocities[i], start.angular_velocities[i]])
                }
                true if component.is_moved(body, 0) || pose == [Vector3::zeros(); 2] => {}
                true => held.push(HeldSeed { body, direction, base: pose, poses: Vec::new() }),
            }
        }
        for own in &variation.held {
            let Some(body) = members.body(own.body).filter(|&body| component.is_still(body)) else { continue };
            let zero = [Vector3::zeros(); 2];
            let listed = held.iter_mut().find(|held| (held.body, held.direction) == (body, direction));
            match listed {
                Some(seed) => seed.poses.clone_from(&own.poses),
                None => held.push(HeldSeed { body, direction, base: zero, poses: own.poses.clone() }),
            }
        }
    }
    for seed in &held {
        component.seed_pose(seed.body, seed.direction, seed.base);
    }
    held
}

/// Whether a body of the model is held from the start.
pub(super) fn is_held(model: &Model, body: Body) -> bool {
    match body {
        Body::Segment(i) => model.segments.get(i).is_some_and(|segment| segment.fixed),
        Body::Anchor(i) => i < model.anchors.len(),
    }
}

//! Obstacles over the step under way: where they are at its start and at its end.

use std::sync::Arc;

use collision::{Aabb, TriangleMesh};
use component::Interval;
use component::snapshot::StateVisitor;
use component::{BodyPose, LARGEST_TURN, in_kernel};
use kernels::Spatial;
use kernels::math::{Quat, Vec3};
use nalgebra::{Quaternion, Unit, Vector3};
use rod::{Carried, Motion, Obstacle, ObstacleShape, Pose, Surface};

use super::convert::{to_kernel, to_nalgebra};
use super::shape::Carrier;
use super::shape::{Poses, Side};

/// An obstacle at the start and at the end of a step.
#[derive(Clone, Debug)]
pub struct Placed {
    obstacle: Obstacle,
    shapes: [ObstacleShape; 2],
    /// Its surface, if that is made of triangles.
    solid: Option<Solid>,
    /// Its poses.
    poses: [BodyPose<f64>; 2],
    /// Its velocities (v, w) at the start, if it moves.
    velocity: Spatial<f64>,
}

/// A surface of triangles about the pivot of an obstacle.
#[derive(Clone, Debug)]
struct Solid {
    mesh: Arc<TriangleMesh>,
    /// From its axes to those of the obstacle's pose.
    turn: Quat<f64>,
}

impl Placed {
    /// An obstacle before the first step.
    pub(crate) fn new(obstacle: &Obstacle) -> Self {
        let (pose, velocity) = in_kernel(&obstacle.at(0.0));
        let shape = || obstacle.shape.clone();
        let parts = |mesh: &rod::Mesh| {
            let parts = TriangleMesh::new(&mesh.positions, &mesh.triangles);
            match &obstacle.shape {
                ObstacleShape::Cylinder { start, end, radius } => parts.with_round_side(*radius, (end - start).norm()),
                _ => parts,
            }
        };
        let solid = obstacle.shape.surface().map(|(mesh, turn)| Solid {
            mesh: Arc::new(parts(&mesh)),
            turn: Quat { v: to_kernel(&turn.imag()), w: turn.w },
        });
        Self { obstacle: obstacle.clone(), shapes: [shape(), shape()], solid, poses: [pose; 2], velocity }
    }

    /// Whether nothing moves it.
    pub(crate) fn stands(&self) -> bool {
        self.obstacle.motion.is_none()
    }

    /// Lets a motion drive it from the next step on.
    pub(crate) fn drive(&mut self, motion: &Carried) {
        self.obstacle.motion = Some(motion.clone());
    }

    /// Shows a visitor what moves it.
    pub(crate) fn visit_state(&mut self, visitor: &mut StateVisitor<'_>) {
        visitor.obstacle_motion(&mut self.obstacle.motion);
        if self.obstacle.motion.is_none() {
            self.shapes = [self.obstacle.shape.clone(), self.obstacle.shape.clone()];
            self.poses = [in_kernel(&self.obstacle.at(0.0)).0; 2];
        }
    }

    /// Puts it where its motion has it over a step. Returns whether it turns too far in it.
    pub(crate) fn place(&mut self, Interval { time, dt }: Interval) -> bool {
        let Some(motion) = &self.obstacle.motion else { return false };
        let ways = [time, time + dt].map(|time| motion.at(time));
        self.shapes = ways.map(|way| self.obstacle.shape.placed(&way.pose));
        let [(start, velocity), (end, _)] = ways.each_ref().map(in_kernel);
        (self.poses, self.velocity) = ([start, end], velocity);
        motion.motion.turned(time, time + dt) > LARGEST_TURN
    }

    /// Its pose at the start (0) or at the end (1) of the step.
    pub fn pose(&self, when: usize) -> BodyPose<f64> {
        self.poses[when]
    }

    /// Lets contacts see it as something that moves, if only by [`Placed::displace`].
    pub fn let_move(&mut self) {
        let pose = self.obstacle.at(0.0).pose;
        self.obstacle.motion.get_or_insert_with(|| Carried::new(Arc::new(Motion::resting(&pose))));
    }

    /// Puts it elsewhere at the start (0) or at the end (1) of the step.
    pub fn displace(&mut self, when: usize, pose: BodyPose<f64>) {
        let [x, y, z] = pose.q.v.0;
        let orientation = Unit::new_normalize(Quaternion::new(pose.q.w, x, y, z));
        self.shapes[when] = self.obstacle.shape.placed(&Pose { position: to_nalgebra(pose.x), orientation });
        self.poses[when] = pose;
    }

    /// Its shape.
    pub(crate) fn shape(&self, poses: Poses) -> &ObstacleShape {
        &self.shapes[usize::from(poses != Poses::Start)]
    }

    /// How contacts with it answer.
    pub(crate) fn surface(&self) -> Surface {
        self.obstacle.surface
    }

    /// Whether it is round, with an end.
    pub(crate) fn is_bounded(&self) -> bool {
        self.obstacle.shape.capsule().is_some()
    }

    /// Its surface, if that is made of triangles.
    pub(crate) fn mesh(&self) -> Option<&TriangleMesh> {
        self.solid.as_ref().map(|solid| &*solid.mesh)
    }

    /// Its mesh, if it has one, at the start of the step and in `poses`.
    pub(super) fn carrier(&self, poses: Poses) -> Option<Carrier<'_>> {
        let solid = self.solid.as_ref()?;
        let body = [self.poses[0], self.poses[usize::from(poses != Poses::Start)]];
        let frames = body.map(|BodyPose { x, q }| BodyPose { x, q: q * solid.turn });
        Some(Carrier { mesh: &solid.mesh, frames, body: self.obstacle.motion.as_ref().map(|_| body) })
    }

    /// Ends of its axis at the start and at the end of the step [m], and its radius [m]; `None` for what has no end.
    pub(crate) fn way(&self) -> Option<([[Vector3<f64>; 2]; 2], f64)> {
        let [(start, radius), (end, _)] = [self.shapes[0].capsule()?, self.shapes[1].capsule()?];
        Some(([start, end], radius))
    }

    /// Whether a box lies outside of a half-space, at both ends of the step.
    pub(crate) fn is_out_of_reach(&self, room: &Aabb) -> bool {
        let is_outside = |shape: &ObstacleShape| {
            let ObstacleShape::HalfSpace { point, normal } = shape else { return false };
            // The room's corner that lies deepest.
            let corner = Vector3::from_fn(|k, _| if normal[k] > 0.0 { room.min[k] } else { room.max[k] });
            normal.dot(&(corner - point)) > 0.0
        };
        is_outside(&self.shapes[1]) && (self.obstacle.motion.is_none() || is_outside(&self.shapes[0]))
    }

    /// It as a body that a contact sees; a half-space that stands still is none.
    pub(super) fn side(&self, poses: Poses) -> Option<Side> {
        let now = usize::from(poses != Poses::Start);
        let ends_of = |k: usize| match self.shapes[k].capsule() {
            Some((ends, radius)) => (ends.map(|end| to_kernel(&end)), radius),
            None => ([self.poses[k].x; 2], 0.0),
        };
        let (ends, radius) = ends_of(now);
        match &self.obstacle.motion {
            Some(_) => {
                let (ends_before, _) = ends_of(0);
                Some(Side { start: self.poses[0], now: self.poses[now], ends, ends_before, radius })
            }
            None => self.is_bounded().then(|| Side::fixed(ends, radius)),
        }
    }

    /// The velocity [m/s] of the place of its surface at `arm` from its pose, at the start of the step; `None` where it
    /// stands still.
    pub fn velocity_at(&self, arm: Vec3<f64>) -> Option<Vec3<f64>> {
        self.obstacle.motion.as_ref().map(|_| self.velocity.linear + self.velocity.angular.cross(arm))
    }

    /// How far that place goes in the step [m].
    pub fn way_of(&self, arm: Vec3<f64>) -> Vec3<f64> {
        let [start, end] = &self.poses;
        end.x + end.q.rotate(start.q.rotate_back(arm)) - start.x - arm
    }
}

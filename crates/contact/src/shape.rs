//! Bodies as contacts see them: their shapes, and where they are at the start of the step and now.

use collision::{MovingCapsule, TriangleMesh};
use component::{BodyPose, Component};
use kernels::math::Vec3;
use nalgebra::Vector3;

use super::convert::{to_kernel, to_nalgebra};

/// The components whose bodies may touch, by their numbers in the model.
pub trait Components {
    /// A component by its number.
    fn component(&self, number: u32) -> &Component<f64>;
}

/// A segment that can touch something: where it is found, and its size.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    /// Index of the component.
    pub component: u32,
    /// Body of the component.
    pub body: u32,
    /// Half the length [m].
    pub half: f64,
    /// Radius [m].
    pub radius: f64,
    /// Whether it moves freely.
    pub free: bool,
    /// Ends that touch for themselves: where two segments meet end to end, one stands for both.
    pub(crate) ends: [bool; 2],
    /// The segment that a rigid joint holds each end to; of several the one that stands for it.
    pub(crate) joined: [Option<u32>; 2],
    /// Ends that a rigid joint holds to an anchor.
    pub(crate) anchored: [bool; 2],
    /// The segment that shares each end and is as thick, if just one does.
    pub(crate) beyond: [Option<u32>; 2],
}

impl Shape {
    /// A segment that moves freely and is joined to nothing: half its length and its radius [m].
    pub(crate) fn new(component: u32, body: u32, half: f64, radius: f64) -> Self {
        let (ends, joined, beyond) = ([true; 2], [None; 2], [None; 2]);
        Self { component, body, half, radius, free: true, ends, joined, anchored: [false; 2], beyond }
    }

    /// Whether it touches anything: a body that does not has no ends.
    pub(crate) fn touches(&self) -> bool {
        self.half > 0.0 || self.ends[0]
    }

    /// The end that lies at a place along the axis [m], if one does.
    pub(crate) fn end_at(&self, offset: f64) -> Option<usize> {
        let is_end = (offset.abs() - self.half).abs() < 1e-6 * self.half;
        is_end.then_some(usize::from(offset > 0.0))
    }

    /// Ends of the axis [m].
    pub(crate) fn place(&self, pose: &BodyPose<f64>) -> [Vec3<f64>; 2] {
        let arm = pose.q.axis() * self.half;
        [pose.x - arm, pose.x + arm]
    }
}

/// At which poses contacts are evaluated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Poses {
    /// Those at the start of the step.
    Start,
    /// The current ones.
    Now,
    /// The current ones, with normals between those of the evaluation before and the new ones: nearest places that jump to
    /// and fro as the bodies move settle so. It errs to the safe side, for along any other normal two bodies are nearer.
    Settling,
}

/// A body as a contact sees it, at its start and now.
pub(super) struct Side {
    pub(super) start: BodyPose<f64>,
    pub(super) now: BodyPose<f64>,
    pub(super) ends: [Vec3<f64>; 2],
    pub(super) ends_before: [Vec3<f64>; 2],
    pub(super) radius: f64,
}

impl Side {
    pub(super) fn of(shape: &Shape, component: &Component<f64>, poses: Poses) -> Self {
        let start = component.start[shape.body as usize];
        let now = if poses == Poses::Start { start } else { component.poses[shape.body as usize] };
        Self { start, now, ends: shape.place(&now), ends_before: shape.place(&start), radius: shape.radius }
    }

    /// What stands still.
    pub(super) fn fixed(ends: [Vec3<f64>; 2], radius: f64) -> Self {
        let pose = BodyPose { x: ends[0], q: kernels::math::Quat::identity() };
        Self { start: pose, now: pose, ends, ends_before: ends, radius }
    }

    /// Its way through the step.
    pub(super) fn way(&self) -> MovingCapsule {
        MovingCapsule { from: self.ends_before.map(to_nalgebra), to: self.ends.map(to_nalgebra), radius: self.radius }
    }

    pub(super) fn at(&self, s: f64) -> Vec3<f64> {
        self.ends[0] + (self.ends[1] - self.ends[0]) * s
    }

    /// How far the material point at `arm` from the centre has moved since the start of the step.
    pub(super) fn moved(&self, arm: Vec3<f64>) -> Vec3<f64> {
        let before = self.start.q.rotate(self.now.q.rotate_back(arm));
        self.now.x + arm - self.start.x - before
    }
}

/// A mesh over a step.
pub(super) struct Carrier<'a> {
    pub(super) mesh: &'a TriangleMesh,
    /// Where its axes are at the start of the step, and now.
    pub(super) frames: [BodyPose<f64>; 2],
    /// Poses of the body that it belongs to, then and now; `None` where it stands still.
    pub(super) body: Option<[BodyPose<f64>; 2]>,
}

impl Carrier<'_> {
    /// A place of the world in the axes of the mesh [m], at the start of the step (0) or now (1).
    pub(super) fn to_mesh(&self, when: usize, place: Vec3<f64>) -> Vector3<f64> {
        let BodyPose { x, q } = self.frames[when];
        to_nalgebra(q.rotate_back(place - x))
    }

    /// Of [`Carrier::to_mesh`] the inverse.
    pub(super) fn to_world(&self, when: usize, place: &Vector3<f64>) -> Vec3<f64> {
        let BodyPose { x, q } = self.frames[when];
        x + q.rotate(to_kernel(place))
    }

    /// A direction of the mesh in the world now.
    pub(super) fn turned(&self, direction: &Vector3<f64>) -> Vec3<f64> {
        self.frames[1].q.rotate(to_kernel(direction))
    }

    /// Where a corner is now [m].
    pub(super) fn corner(&self, corner: u32) -> Vec3<f64> {
        self.mesh.corners().get(corner as usize).map_or(self.frames[1].x, |place| self.to_world(1, place))
    }

    /// Where a corner is now [m], or, of the number [`Carrier::rim`], the place of a cylinder's rim that is farthest against a `normal`. `None`
    /// where it does not count: a cylinder rolls on its rims, and stands on its corners.
    pub(super) fn farthest(&self, corner: u32, normal: Vec3<f64>) -> Option<Vec3<f64>> {
        let Some(round) = self.mesh.round_side() else { return Some(self.corner(corner)) };
        let Vec3([x, y, _]) = self.frames[1].q.rotate_back(-normal);
        let across = x.hypot(y);
        let end = [0, 1].into_iter().find(|&end| corner == Carrier::rim(end));
        match end {
            // Tilted by three degrees or less it stands.
            None => (across <= 0.05).then(|| self.corner(corner)),
            Some(end) => (across > 0.05).then(|| {
                let out = Vector3::new(x, y, 0.0) * (round.radius / across);
                self.to_world(1, &(round.ends[end as usize] + out))
            }),
        }
    }

    /// The number of a cylinder's rim, 0 or 1, among its corners.
    pub(super) fn rim(end: u32) -> u32 {
        u32::MAX - end
    }

    /// It, with an edge, as a body that a contact sees.
    pub(super) fn side(&self, ends: &[Vector3<f64>; 2]) -> Side {
        let [before, ends] = [0, 1].map(|when| ends.each_ref().map(|end| self.to_world(when, end)));
        match self.body {
            Some([start, now]) => Side { start, now, ends, ends_before: before, radius: 0.0 },
            None => Side::fixed(ends, 0.0),
        }
    }
}

/// The normal and two tangents; nearly continuous in the normal.
pub(super) fn frame(n: Vec3<f64>) -> [Vec3<f64>; 3] {
    let [x, y, z] = n.0.map(f64::abs);
    let helper = if x <= y && x <= z {
        Vec3([1.0, 0.0, 0.0])
    } else if y <= z {
        Vec3([0.0, 1.0, 0.0])
    } else {
        Vec3([0.0, 0.0, 1.0])
    };
    let across = n.cross(helper);
    let t = across * (1.0 / across.norm_squared().sqrt());
    [n, t, n.cross(t)]
}

/// Whether the squared sine of the angle between two axes is below `most`.
pub(super) fn are_parallel(a: [Vec3<f64>; 2], b: [Vec3<f64>; 2], most: f64) -> bool {
    let (a, b) = (a[1] - a[0], b[1] - b[0]);
    let size = a.norm_squared() * b.norm_squared();
    size > 0.0 && a.cross(b).norm_squared() < most * size
}

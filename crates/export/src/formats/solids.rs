//! Rigid bodies and obstacles as surfaces, which other programs draw.

use std::borrow::Cow;

use nalgebra::{UnitQuaternion, Vector3};
use rod::{BodyShape, Mesh, Model, MovingPose, Obstacle, ObstacleShape, Pose, State};

use super::frame::Frame;
use crate::{ExportError, Names, TrajectoryReader};

/// Colours of rods and rigid bodies, and of obstacles, where a format has colours: red, green, blue.
pub(super) const ROD: [f64; 3] = [0.8, 0.45, 0.25];
pub(super) const OBSTACLE: [f64; 3] = [0.55, 0.56, 0.58];

/// What something drawn is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Owner {
    /// A segment, by its index; a rigid body is one.
    Segment(usize),
    /// An obstacle, by its index.
    Obstacle(usize),
}

impl Owner {
    /// The segment, if it is one.
    pub(super) fn segment(self) -> Option<usize> {
        if let Owner::Segment(i) = self { Some(i) } else { None }
    }

    /// The obstacle, if it is one.
    pub(super) fn obstacle(self) -> Option<usize> {
        if let Owner::Obstacle(k) = self { Some(k) } else { None }
    }

    /// Its pose and velocities in a frame.
    pub(super) fn at(self, model: &Model, Frame { time, state, .. }: &Frame) -> MovingPose {
        match self {
            Owner::Segment(i) => MovingPose {
                pose: Pose { position: state.positions[i], orientation: state.orientations[i] },
                velocity: state.velocities[i],
                angular_velocity: state.angular_velocities[i],
            },
            Owner::Obstacle(k) => model.contacts.obstacles[k].at(*time),
        }
    }
}

/// The surface of a rigid body or of an obstacle.
pub(super) struct Solid {
    pub(super) of: Owner,
    /// In the frame that the poses of `of` are of.
    pub(super) mesh: Mesh,
}

impl Solid {
    /// Those of a model: rigid bodies that are not hidden, then all obstacles. Planes are squares as large as the scene.
    ///
    /// # Errors
    /// [`ExportError::Io`] if the trajectory, which the scene's size is of, cannot be read.
    pub(super) fn all(model: &Model, trajectory: &mut TrajectoryReader) -> Result<Vec<Self>, ExportError> {
        let body = |(i, segment): (usize, &rod::Segment)| {
            let mesh = segment.body.as_ref()?.shape.mesh();
            (!mesh.triangles.is_empty()).then_some(Self { of: Owner::Segment(i), mesh })
        };
        let mut solids: Vec<Self> = model.segments.iter().enumerate().filter_map(body).collect();
        let obstacles = &model.contacts.obstacles;
        if !obstacles.is_empty() {
            let bounds = bounds(model, trajectory)?;
            let obstacle = |(k, shape)| Self { of: Owner::Obstacle(k), mesh: surface(shape, bounds) };
            solids.extend(obstacles.iter().map(|obstacle| &obstacle.shape).enumerate().map(obstacle));
        }
        Ok(solids)
    }

    /// What files call it: as the rigid body or the obstacle that it is of.
    pub(super) fn name<'a>(&self, model: &Model, names: &'a Names) -> Cow<'a, str> {
        match self.of {
            Owner::Segment(i) => names.rod(model.segments[i].rod),
            Owner::Obstacle(k) => names.obstacle(k),
        }
    }

    /// The obstacle that it is of, if that moves.
    pub(super) fn moving<'a>(&self, model: &'a Model) -> Option<&'a Obstacle> {
        self.of.obstacle().map(|k| &model.contacts.obstacles[k]).filter(|obstacle| obstacle.motion.is_some())
    }

    /// Whether it is an obstacle that never moves.
    pub(super) fn is_still(&self, model: &Model) -> bool {
        self.of.obstacle().is_some_and(|k| model.contacts.obstacles[k].motion.is_none())
    }

    /// Places of the vertices in the world [m], when `of` is at `pose`.
    pub(super) fn places(&self, pose: Pose) -> impl Iterator<Item = Vector3<f64>> {
        self.mesh.positions.iter().map(move |place| pose.position + pose.orientation * place)
    }
}

/// The surface of an obstacle in a scene between two corners [m], about its pivot and in the axes of the world at time 0.
fn surface(shape: &ObstacleShape, [low, high]: [Vector3<f64>; 2]) -> Mesh {
    match *shape {
        ObstacleShape::HalfSpace { point, normal } => {
            let middle = 0.5 * (low + high) - point;
            square(middle - *normal * normal.dot(&middle), *normal, (high - low).norm())
        }
        ObstacleShape::Sphere { radius, .. } => BodyShape::Sphere { radius }.mesh(),
        ObstacleShape::Capsule { start, end, radius } => {
            let length = (end - start).norm();
            let axis = (end - start).try_normalize(0.0).unwrap_or_else(Vector3::z);
            let turn = UnitQuaternion::face_towards(&axis, &Vector3::ith(axis.iamin(), 1.0));
            BodyShape::Capsule { radius, length }.mesh().turned(&turn)
        }
        ObstacleShape::Box { .. } | ObstacleShape::Cylinder { .. } | ObstacleShape::Mesh { .. } => {
            shape.surface().map_or_else(Mesh::default, |(mesh, turn)| Mesh::clone(&mesh).turned(&turn))
        }
    }
}

/// A square about `middle`, half as wide as `reach`, which faces along `normal`.
fn square(middle: Vector3<f64>, normal: Vector3<f64>, reach: f64) -> Mesh {
    let u = normal.cross(&Vector3::ith(normal.iamin(), 1.0)).normalize();
    let v = normal.cross(&u);
    let corner = |(x, y): (f64, f64)| middle + (u * x + v * y) * reach;
    Mesh {
        positions: [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(corner).into(),
        normals: vec![normal; 4],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

/// Corners of a box about the segments and the obstacles that are no planes of the first and the last frame [m].
fn bounds(model: &Model, trajectory: &mut TrajectoryReader) -> Result<[Vector3<f64>; 2], ExportError> {
    let infinite = Vector3::repeat(f64::INFINITY);
    let [mut low, mut high] = [infinite, -infinite];
    let mut widen = |place: &Vector3<f64>, by: f64| {
        low = low.inf(&place.add_scalar(-by));
        high = high.sup(&place.add_scalar(by));
    };
    let (mut state, frames) = (State::default(), trajectory.frames());
    for frame in [0, frames.saturating_sub(1)].into_iter().take(frames) {
        let time = trajectory.read_frame(frame, &mut state)?;
        for (place, segment) in state.positions.iter().zip(&model.segments) {
            widen(place, 0.5 * segment.length + segment.radius);
        }
        for obstacle in &model.contacts.obstacles {
            let shape = obstacle.shape_at(time);
            if let Some((ends, radius)) = shape.capsule() {
                ends.iter().for_each(|end| widen(end, radius));
            }
            if let Some((mesh, turn)) = shape.surface() {
                mesh.positions.iter().for_each(|place| widen(&(shape.pivot() + turn * place), 0.0));
            }
        }
    }
    // A model of planes alone.
    if low.x > high.x { Ok([Vector3::zeros(), Vector3::repeat(1.0)]) } else { Ok([low, high]) }
}

#[cfg(test)]
mod tests {
    use nalgebra::Unit;

    use super::*;

    #[test]
    fn a_plane_is_a_square_as_large_as_the_scene_that_faces_out_of_it() {
        let bounds = [Vector3::new(-1.0, 0.0, 2.0), Vector3::new(3.0, 4.0, 9.0)];
        let reach = 9.0;
        for normal in [Vector3::z(), -Vector3::y(), Vector3::new(0.3, -0.5, 0.2)] {
            let (point, normal) = (Vector3::new(5.0, -2.0, 1.0), Unit::new_normalize(normal));
            let mesh = surface(&ObstacleShape::HalfSpace { point, normal }, bounds);
            assert!(mesh.positions.iter().all(|place| normal.dot(place).abs() < 1e-12), "off the plane");
            let middle: Vector3<f64> = mesh.positions.iter().sum::<Vector3<f64>>() / 4.0 + point;
            assert!(
                (Vector3::new(1.0, 2.0, 5.5) - middle).cross(&normal).norm() < 1e-12,
                "not below the scene's middle"
            );
            for triangle in &mesh.triangles {
                let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
                assert!(((b - a).cross(&(c - a)) - *normal * (4.0 * reach * reach)).norm() < 1e-10);
            }
            assert!(mesh.normals.iter().all(|own| *own == *normal));
        }
    }

    #[test]
    fn capsules_lie_along_their_axes() {
        let start = Vector3::new(0.4, -1.0, 2.0);
        for axis in [Vector3::z() * 2.0, Vector3::z() * -2.0, Vector3::new(0.3, -0.4, 0.2), Vector3::zeros()] {
            let mesh = surface(&ObstacleShape::Capsule { start, end: start + axis, radius: 0.5 }, Default::default());
            let length = axis.norm_squared().max(f64::MIN_POSITIVE);
            for (place, normal) in mesh.positions.iter().zip(&mesh.normals) {
                let nearest = axis * (place.dot(&axis) / length).clamp(-0.5, 0.5);
                assert!((place - nearest - normal * 0.5).norm() < 1e-12, "{axis}");
            }
        }
    }
}

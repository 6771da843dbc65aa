//! What contacts that press at the end of a solved step change by with the poses of their bodies: for derivatives of runs.
//!
//! With z the impulse of a contact in its frame, its bodies feel the push P(p') z, and its three equations are
//!
//! ```text
//! gap(p') - target = 0,   slip(p', p) = 0              where it sticks
//!                         z_t + mu z_n slip / |slip| = 0    where it slides
//! ```
//!
//! How gap, slip and frame change with poses depends on what touches what. Central differences of the evaluation itself say it
//! for all kinds alike.

use component::BodyPose;
use contact::geometry::{Contact, World};
use contact::obstacles::Placed;
use contact::shape::{Poses, Shape};
use contact::to_nalgebra;
use kernels::math::{Quat, Vec3};
use nalgebra::{Matrix2, Matrix3, SMatrix, SVector, Vector2, Vector3};

use super::IslandContacts;
use crate::islands::sets::Sets;
use crate::islands::shared::Shared;
use crate::substep::Touching;

/// Step of the central differences, in radii and in radians.
const STEP: f64 = 1e-5;
/// A contact slides where it slips by more than so many times what is good enough.
const SLIDES: f64 = 10.0;

/// Gap and slip, and the push at an impulse.
struct Seen {
    gap_and_slip: Vector3<f64>,
    push: SVector<f64, 12>,
}

fn seen(contact: &Contact, force: [f64; 3]) -> Seen {
    let [_, first, second] = contact.local(contact.slip);
    Seen { gap_and_slip: Vector3::new(contact.gap - contact.target, first, second), push: push(contact, force) }
}

/// What an impulse gives both bodies.
fn push(contact: &Contact, force: [f64; 3]) -> SVector<f64, 12> {
    let world = contact.world(force);
    let mut out = SVector::<f64, 12>::zeros();
    for (side, force) in [world, -world].into_iter().enumerate() {
        out.fixed_rows_mut::<3>(6 * side).copy_from(&to_nalgebra(force));
        out.fixed_rows_mut::<3>(6 * side + 3).copy_from(&to_nalgebra(contact.arms[side].cross(force)));
    }
    out
}

/// A pose that is shifted along a world axis, 0 to 2, or turned about one, 3 to 5.
fn moved(pose: BodyPose<f64>, axis: usize, by: f64) -> BodyPose<f64> {
    let along = |by: f64| Vec3([0, 1, 2].map(|k| if k == axis % 3 { by } else { 0.0 }));
    if axis < 3 {
        return BodyPose { x: pose.x + along(by), ..pose };
    }
    let (sine, cosine) = (0.5 * by).sin_cos();
    BodyPose { q: Quat { v: along(sine), w: cosine } * pose.q, ..pose }
}

/// Where a segment is: at the end of the step (0), or at its start (1).
fn pose_of<'a>(components: &'a mut Sets<'_>, shape: &Shape, when: usize) -> &'a mut BodyPose<f64> {
    let component = &mut components[shape.component as usize].component;
    let poses = if when == 0 { &mut component.poses } else { &mut component.start };
    &mut poses[shape.body as usize]
}

impl IslandContacts {
    /// The contacts that press, at the poses evaluated last, in a step whose contacts are solved to `tolerance`.
    pub(crate) fn slopes(&self, shared: &Shared, components: &mut Sets<'_>, tolerance: f64) -> Vec<Touching> {
        let world = shared.detector.world(&self.search);
        let pressing = self.contacts.iter().filter(|contact| contact.impulse != Vec3::zero());
        let mut obstacles = world.obstacles.to_vec();
        pressing.map(|contact| slopes_of(contact, &world, components, &mut obstacles, tolerance)).collect()
    }
}

fn slopes_of(
    contact: &Contact,
    world: &World<'_>,
    components: &mut Sets<'_>,
    obstacles: &mut [Placed],
    tolerance: f64,
) -> Touching {
    let segments = (contact.key.0, contact.key.1.segment());
    let obstacle = contact.key.1.obstacle().map(|index| index as usize);
    let force = contact.local(contact.impulse);
    let see = |components: &Sets<'_>, obstacles: &[Placed]| {
        let mut other = *contact;
        other.evaluate(&World { obstacles, ..*world }, components, Poses::Now);
        seen(&other, force)
    };
    let mut push_by_pose = SMatrix::<f64, 12, 12>::zeros();
    let mut slopes = [SMatrix::<f64, 3, 12>::zeros(); 2];
    // `at` sees the contact with a body that is moved at one end of the step.
    let mut differ = |side: usize, at: &mut dyn FnMut(usize, usize, f64) -> Seen| {
        for axis in 0..6 {
            let step = if axis < 3 { STEP * contact.radius } else { STEP };
            for (when, slopes) in slopes.iter_mut().enumerate() {
                let [above, below] = [step, -step].map(|by| at(when, axis, by));
                let (per, column) = (0.5 / step, 6 * side + axis);
                slopes.set_column(column, &((above.gap_and_slip - below.gap_and_slip) * per));
                if when == 0 {
                    push_by_pose.set_column(column, &((above.push - below.push) * per));
                }
            }
        }
    };
    let sides = [Some(segments.0), segments.1];
    for (side, segment) in sides.into_iter().enumerate().filter_map(|(side, segment)| Some((side, segment?))) {
        let shape = world.shapes[segment as usize];
        differ(side, &mut |when, axis, by| {
            let before = *pose_of(components, &shape, when);
            *pose_of(components, &shape, when) = moved(before, axis, by);
            let seen = see(components, obstacles);
            *pose_of(components, &shape, when) = before;
            seen
        });
    }
    if let Some(index) = obstacle {
        let before = obstacles[index].clone();
        obstacles[index].let_move();
        differ(1, &mut |when, axis, by| {
            // Poses of obstacles begin with the start.
            let own = before.pose(1 - when);
            obstacles[index].displace(1 - when, moved(own, axis, by));
            let seen = see(components, obstacles);
            obstacles[index].displace(1 - when, own);
            seen
        });
        obstacles[index] = before;
    }
    let unit = |k: usize| [0, 1, 2].map(|j| if j == k { 1.0 } else { 0.0 });
    let columns = [0, 1, 2].map(|k| push(contact, unit(k)));
    let [by_pose, by_start] = slopes;
    let mut out = Touching {
        segments: (segments.0 as usize, segments.1.map(|other| other as usize)),
        obstacle,
        push_by_pose,
        push_by_impulse: SMatrix::from_columns(&columns),
        by_pose,
        by_start,
        by_impulse: Matrix3::zeros(),
        by_friction: Vector3::zeros(),
    };
    out.let_slide(contact, force, tolerance);
    out
}

impl Touching {
    /// Its sides, 0 and 1, with their segments.
    pub fn sides(&self) -> impl Iterator<Item = (usize, usize)> {
        let sides = [Some(self.segments.0), self.segments.1];
        sides.into_iter().enumerate().filter_map(|(side, segment)| Some((side, segment?)))
    }

    /// Puts the equations of sliding in the place of those of sticking, where the contact slides.
    fn let_slide(&mut self, contact: &Contact, [normal, ..]: [f64; 3], tolerance: f64) {
        let [_, x, y] = contact.local(contact.slip);
        let (slip, mu) = (Vector2::new(x, y), contact.coefficient);
        let size = slip.norm();
        if mu > 0.0 && size <= SLIDES * tolerance * contact.radius {
            return;
        }
        // In metres, as the others.
        let scale = contact.compliance[1].max(f64::MIN_POSITIVE);
        let direction = if mu > 0.0 { slip / size } else { Vector2::zeros() };
        let turning = if mu > 0.0 {
            (Matrix2::identity() - direction * direction.transpose()) * (mu * normal * scale / size)
        } else {
            Matrix2::zeros()
        };
        for rows in [&mut self.by_pose, &mut self.by_start] {
            let turned = turning * rows.fixed_rows::<2>(1);
            rows.fixed_rows_mut::<2>(1).copy_from(&turned);
        }
        self.by_impulse.fixed_view_mut::<2, 2>(1, 1).copy_from(&(Matrix2::identity() * scale));
        self.by_impulse.fixed_view_mut::<2, 1>(1, 0).copy_from(&(direction * (mu * scale)));
        self.by_friction.fixed_rows_mut::<2>(1).copy_from(&(direction * (mu * normal * scale)));
    }
}

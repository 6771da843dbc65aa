//! Contacts of rigid bodies that have meshes (boxes, cylinders, files of triangles) with obstacles that are no planes.
//!
//! With a sphere or a capsule: its axis against the body's faces and edges, as a segment touches a mesh, with sides swapped.
//! With a mesh: corners of each against faces of the other, and edges against edges. There a body has no radius that keeps
//! its corners off the faces: a corner touches a face from the side to which it does not point, and an edge another one
//! from the side to which both face, along the normal of both. What lies deeper than [`DEEP`] at the start of a step belongs
//! to another face.

use collision::mesh::Face;
use collision::sweep::MovingCapsule;
use collision::{Aabb, closest};
use kernels::math::Vec3;
use rod::Friction;

use super::convert::{to_kernel, to_nalgebra};
use super::geometry::Contact;
use super::key::{Feature, Partner};
use super::mesh_contacts::{ASKEW, BESIDE, SweptCapsule};
use super::obstacles::Placed;
use super::shape::Carrier;
use super::shape::{Poses, Side, frame};

/// How far around a body its search looks for what it may touch, in radii of the ball about it.
pub(super) const ROOM: f64 = 0.1;
/// How deep a corner or an edge may be at the start of a step and still be held off, in the same radii.
const DEEP: f64 = 5e-3;
/// Sine of the angle below which two edges are parallel: corners and faces hold them apart.
const PARALLEL: f64 = 1e-3;

/// A contact of a corner with a face: normal out of the face towards the corner, gap, place, and whether it is none.
struct CornerOnFace {
    normal: Vec3<f64>,
    gap: f64,
    place: Vec3<f64>,
    is_duplicate: bool,
}

impl Contact {
    /// Whether it is one of a body's mesh with an obstacle that is no plane.
    pub fn is_of_solid(&self) -> bool {
        matches!(
            (self.key.1, self.key.2),
            (Partner::Obstacle(_), Feature::Edge(_))
                | (Partner::Corner(..), _)
                | (Partner::Face(..) | Partner::Edge(..), Feature::Corner(_) | Feature::Edge(_))
        )
    }

    /// Evaluates it.
    pub(super) fn of_solid(&mut self, body: &Carrier<'_>, obstacle: &Placed, poses: Poses) {
        let own = body.side(&[Default::default(); 2]);
        let other = obstacle.carrier(poses);
        let moving = |carrier: &Carrier<'_>| carrier.body.is_some().then(|| carrier.side(&[Default::default(); 2]));
        match (self.key.1, self.key.2, &other) {
            (Partner::Corner(_, end), Feature::Face(k), None) => {
                if let (Some(round), Some(face)) = (obstacle.side(poses), body.mesh.faces().get(k as usize)) {
                    self.with_face(&round, body, face, end as usize & 1);
                    self.swap();
                }
            }
            (Partner::Obstacle(_), Feature::Edge(k), None) => {
                if let (Some(round), Some(edge)) = (obstacle.side(poses), body.mesh.edges().get(k as usize)) {
                    self.normal = -self.normal;
                    self.with_edge(&round, body, edge, Feature::Nearest, poses);
                    self.swap();
                }
            }
            (Partner::Corner(_, corner), Feature::Face(k), Some(mesh)) => {
                let Some(face) = body.mesh.faces().get(k as usize) else { return };
                let CornerOnFace { normal, gap, place, is_duplicate } =
                    corner_on_face((mesh, corner), (body, face), self.radius);
                self.is_duplicate = is_duplicate;
                self.set(&own, moving(mesh).as_ref(), -normal, gap, place);
            }
            (Partner::Face(_, k), Feature::Corner(corner), Some(mesh)) => {
                let Some(face) = mesh.mesh.faces().get(k as usize) else { return };
                let CornerOnFace { normal, gap, place, is_duplicate } =
                    corner_on_face((body, corner), (mesh, face), self.radius);
                self.is_duplicate = is_duplicate;
                self.set(&own, moving(mesh).as_ref(), normal, gap, place);
            }
            (Partner::Edge(_, k), Feature::Edge(j), Some(mesh)) => {
                self.between_edges((body, j), (mesh, k), &own, moving(mesh).as_ref());
            }
            _ => {}
        }
    }

    /// Takes what was evaluated from the side of the partner as the segment's.
    fn swap(&mut self) {
        self.normal = -self.normal;
        self.frame = frame(self.normal);
        self.slip = -self.slip;
        self.arms.swap(0, 1);
    }

    /// Evaluates the contact of edge `j` of the body with edge `k` of the obstacle.
    fn between_edges(
        &mut self,
        (body, j): (&Carrier<'_>, u32),
        (mesh, k): (&Carrier<'_>, u32),
        own: &Side,
        other: Option<&Side>,
    ) {
        let (Some(a), Some(b)) = (body.mesh.edges().get(j as usize), mesh.mesh.edges().get(k as usize)) else { return };
        let ends = |when: usize| {
            let place = |carrier: &Carrier<'_>, ends: &[_; 2]| ends.each_ref().map(|end| carrier.to_world(when, end));
            [place(body, &a.ends), place(mesh, &b.ends)]
        };
        let [on_a, on_b] = ends(1);
        let (along_a, along_b) = (on_a[1] - on_a[0], on_b[1] - on_b[0]);
        let found = closest::segments(&on_a.map(to_nalgebra), &on_b.map(to_nalgebra));
        let at = |[start, end]: [Vec3<f64>; 2], s: f64| start + (end - start) * s;
        let (p, q) = (at(on_a, found.s), at(on_b, found.t));
        let across = along_a.cross(along_b);
        let size = across.norm_squared().sqrt();
        let least = PARALLEL * (along_a.norm_squared() * along_b.norm_squared()).sqrt();
        let is_parallel = size <= least || size == 0.0;
        let mut normal = if is_parallel { Vec3([0.0, 0.0, 1.0]) } else { across * (1.0 / size) };
        let out_of = |carrier: &Carrier<'_>, outward: &[_; 2]| outward.each_ref().map(|out| carrier.turned(out));
        let (out_a, out_b) = (out_of(body, &a.outward), out_of(mesh, &b.outward));
        if normal.dot(out_b[0] + out_b[1] - out_a[0] - out_a[1]) < 0.0 {
            normal = -normal;
        }
        let faces =
            out_a.iter().all(|out| out.dot(normal) <= ASKEW) && out_b.iter().all(|out| out.dot(normal) >= -ASKEW);
        let is_inside = |s: f64| s > 0.0 && s < 1.0;
        let [before_a, before_b] = ends(0);
        let before = normal.dot(at(before_a, found.s) - at(before_b, found.t));
        self.is_duplicate =
            is_parallel || !faces || !is_inside(found.s) || !is_inside(found.t) || before < -DEEP * self.radius;
        let gap = if self.is_duplicate { found.distance } else { normal.dot(p - q) };
        self.set(own, other, normal, gap, (p + q) * 0.5);
    }
}

/// Where a corner of one mesh is above a face of another; `radius` is that of the body.
fn corner_on_face(
    (owner, corner): (&Carrier<'_>, u32),
    (mesh, face): (&Carrier<'_>, &Face),
    radius: f64,
) -> CornerOnFace {
    let corner = corner as usize;
    let place = owner.mesh.corners().get(corner).copied().unwrap_or_default();
    let points = owner.mesh.tips().get(corner).map_or(Vec3::zero(), |tip| owner.turned(tip));
    let now = owner.to_world(1, &place);
    let (from, to) = (mesh.to_mesh(0, owner.to_world(0, &place)), mesh.to_mesh(1, now));
    let out = mesh.turned(&face.normal);
    let side = if out.dot(points) > 0.0 { -1.0 } else { 1.0 };
    let [before, height] = [&from, &to].map(|place| side * face.height(place));
    // Where it has come through, it counts where.
    let passes = if height < 0.0 && before > 0.0 { from + (to - from) * (before / (before - height)) } else { to };
    let is_duplicate = before < -DEEP * radius || !face.holds(&passes, BESIDE * radius);
    let gap = if is_duplicate { (to - face.nearest(&to)).norm() } else { height };
    let normal = out * side;
    CornerOnFace { normal, gap, place: now - normal * (0.5 * height), is_duplicate }
}

/// The box in the axes of `own` around all that `other` is, over the step, with `room` about it [m].
fn seen_from(own: &Carrier<'_>, other: &Carrier<'_>, room: f64) -> Option<Aabb> {
    let bounds = other.mesh.face_tree().bounds()?;
    let (middle, half) = ((bounds.min + bounds.max) * 0.5, (bounds.max - bounds.min).norm() * 0.5 + room);
    let [a, b] = [0, 1].map(|when| own.to_mesh(when, other.to_world(when, &middle)));
    Some(Aabb { min: a.inf(&b).add_scalar(-half), max: a.sup(&b).add_scalar(half) })
}

/// Appends the possible contacts of body `index`, in a ball of `radius` [m] about its centre, with obstacle `which`. Returns
/// whether the obstacle may be near.
pub(super) fn detect(
    (index, radius, body): (u32, f64, &Carrier<'_>),
    (which, obstacle): (u32, &Placed),
    friction: Friction,
    out: &mut Vec<Contact>,
) -> bool {
    let slack = ROOM * radius;
    let contact = |partner, feature| Contact::new((index, partner, feature), friction, radius);
    if let Some((ends, own)) = obstacle.way() {
        let [from, to] = [0, 1].map(|when| ends[when].map(|end| body.to_mesh(when, to_kernel(&end))));
        let way = SweptCapsule::new(MovingCapsule { from, to, radius: own + slack }, slack);
        let count = if from[0] == from[1] { 1 } else { 2 };
        for end in 0..count {
            body.mesh.face_tree().overlaps(&way.room(&[from[end], to[end]]), |k| {
                if way.end_meets(end, &body.mesh.faces()[k as usize]) {
                    out.push(contact(Partner::Corner(which, end as u32), Feature::Face(k)));
                }
            });
        }
        let mut is_near = false;
        let room = way.room(&way.ends());
        body.mesh.edge_tree().overlaps(&room, |k| {
            if way.meets(&body.mesh.edges()[k as usize]) {
                out.push(contact(Partner::Obstacle(which), Feature::Edge(k)));
            }
        });
        body.mesh.face_tree().overlaps(&room, |_| is_near = true);
        return is_near;
    }
    let Some(mesh) = obstacle.carrier(Poses::Now) else { return false };
    let (Some(in_body), Some(in_mesh)) = (seen_from(body, &mesh, slack), seen_from(&mesh, body, slack)) else {
        return false;
    };
    let mut is_near = false;
    mesh.mesh.face_tree().overlaps(&in_mesh, |_| is_near = true);
    if !is_near {
        return false;
    }
    let way_of = |of: &Carrier<'_>, to: &Carrier<'_>, ends: [_; 2]| {
        let at = |when: usize| ends.each_ref().map(|end| to.to_mesh(when, of.to_world(when, end)));
        SweptCapsule::new(MovingCapsule { from: at(0), to: at(1), radius: slack }, slack)
    };
    let mut corners =
        |of: &Carrier<'_>, room: &Aabb, on: &Carrier<'_>, key: &dyn Fn(u32, u32) -> (Partner, Feature)| {
            of.mesh.corner_tree().overlaps(room, |corner| {
                let way = way_of(of, on, [of.mesh.corners()[corner as usize]; 2]);
                on.mesh.face_tree().overlaps(&way.room(&way.ends()), |k| {
                    if way.end_meets(0, &on.mesh.faces()[k as usize]) {
                        let (partner, feature) = key(corner, k);
                        out.push(contact(partner, feature));
                    }
                });
            });
        };
    corners(body, &in_body, &mesh, &|corner, k| (Partner::Face(which, k), Feature::Corner(corner)));
    corners(&mesh, &in_mesh, body, &|corner, k| (Partner::Corner(which, corner), Feature::Face(k)));
    body.mesh.edge_tree().overlaps(&in_body, |j| {
        let way = way_of(body, &mesh, body.mesh.edges()[j as usize].ends);
        mesh.mesh.edge_tree().overlaps(&way.room(&way.ends()), |k| {
            if way.meets(&mesh.mesh.edges()[k as usize]) {
                out.push(contact(Partner::Edge(which, k), Feature::Edge(j)));
            }
        });
    });
    true
}

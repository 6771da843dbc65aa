//! Contacts of segments in sheaths with the walls.

use kernels::math::Vec3;

use super::geometry::Contact;
use super::key::Partner;
use super::shape::{Components, Poses, Shape, Side, frame};
use super::sheath::{Point, Tube, Wall};

impl Contact {
    /// Evaluates the contact of a segment with the wall of a sheath.
    pub(super) fn in_sheath(
        &mut self,
        own: &Side,
        tube: &Tube,
        (shapes, components, poses): (&[Shape], &impl Components, Poses),
    ) {
        let side = |i: u32| {
            let shape = &shapes[i as usize];
            Side::of(shape, components.component(shape.component), poses)
        };
        let now = |i: u32| {
            let shape = &shapes[i as usize];
            let component = components.component(shape.component);
            if poses == Poses::Start {
                component.start[shape.body as usize]
            } else {
                component.poses[shape.body as usize]
            }
        };
        let x = own.now.x;
        self.place = tube.nearest(x, self.place, &now);
        let shares = tube.line.at(self.place);
        let Point { place: centre, tangent, .. } = tube.point(&shares, &now);
        let along = tangent * (1.0 / tangent.norm_squared().sqrt());
        let off = x - centre;
        let off = off - along * along.dot(off);
        let distance = off.norm_squared().sqrt();
        let outwards = if distance > 0.0 { off * (1.0 / distance) } else { self.across(along) };
        // Behind a mouth the wall leans.
        let [further, slope] = tube.widening(self.place);
        let lean = if self.place > 0.0 { slope } else { -slope };
        let size = (1.0 + slope * slope).sqrt();
        let (mut normal, room) =
            ((along * lean - outwards) * (1.0 / size), (tube.bore - own.radius + further - distance) / size);
        let mut gap = room;
        if poses == Poses::Settling {
            let between = normal + self.normal;
            let size = between.norm_squared().sqrt();
            if size > 0.1 {
                // Along another normal the wall is further away than it is.
                let settled = between * (1.0 / size);
                gap += distance * (1.0 - settled.dot(normal));
                normal = settled;
            }
        }
        self.closer_by = gap - room;
        let place = x - normal * (own.radius + 0.5 * gap);
        self.set(own, None, normal, gap, place);
        self.distance = room;
        let mut wall = Wall::NONE;
        let mut has_free = shapes[self.key.0 as usize].free;
        for (k, share) in shares.iter().enumerate() {
            let index = tube.outer.start + share.segment as u32;
            let weight = share.position[0];
            wall.segments[k] = index;
            if weight > 0.0 {
                let outer = side(index);
                let arm = outer.now.q.axis() * (share.axis[0] / weight) + (place - centre);
                (wall.arms[k], wall.shares[k]) = (arm, weight);
                self.slip -= outer.moved(arm) * weight;
                has_free |= shapes[index as usize].free;
            }
        }
        self.slip -= normal * normal.dot(self.slip);
        self.wall = wall;
        // What nothing moves needs no force.
        self.is_duplicate = !has_free;
        if !has_free {
            (self.impulse, self.guess) = (Vec3::zero(), [0.0; 3]);
        }
    }

    /// A direction across an axis: against the normal as it was, if there was one.
    fn across(&self, axis: Vec3<f64>) -> Vec3<f64> {
        let before = -self.normal - axis * axis.dot(-self.normal);
        let size = before.norm_squared().sqrt();
        if size > 0.1 { before * (1.0 / size) } else { frame(axis)[1] }
    }

    /// Whether it is one with the wall of a sheath.
    pub fn is_of_sheath(&self) -> bool {
        matches!(self.key.1, Partner::Sheath(_))
    }

    /// The segments that it pushes beside its own, each with the arm from its centre and its share of the force.
    #[inline]
    pub fn others(&self) -> impl Iterator<Item = (u32, Vec3<f64>, f64)> + use<> {
        let Wall { segments, arms, shares } = self.wall;
        let pair = match self.key.1 {
            Partner::Sheath(_) => [0, 1].map(|k| (shares[k] > 0.0).then_some((segments[k], arms[k], shares[k]))),
            partner => [partner.segment().map(|other| (other, self.arms[1], 1.0)), None],
        };
        pair.into_iter().flatten()
    }
}

#[cfg(test)]
mod tests;

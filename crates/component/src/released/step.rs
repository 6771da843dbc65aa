//! The free rows of a component, and its open grips.

use jointed::rotation::RotationRows;
use kernels::Spatial;
use kernels::lane::Real;
use kernels::math::{Quat, Vec3};
use rod::{Freedom, Joint, Model};

use super::{Released, Turns};
use crate::parts::{copy_pose, pick, pick_pose, put};
use crate::{BodyPose, Component, Members};

/// Compliance of free rows in units of what the bodies answer, where all three are free: nothing cancels.
const FREE: f64 = 1e12;
/// The same of one of three rows, whose elimination costs the other two as many digits.
const FREE_OF_THREE: f64 = 1e8;
/// Compliance where neither body answers [1/(kg m^4)].
const LEAST: f64 = 1e-30;

impl<T: Real> Component<T> {
    /// Notes which joints of a lane leave something free.
    pub(crate) fn add_loose(&mut self, model: &Model, members: &Members, lane: usize) {
        for (k, &index) in members.joints.iter().enumerate() {
            let joint = &model.joints[index];
            let (turns, broken) = (turns(joint), joint.freedom == Freedom::Broken);
            let open = !broken && model.is_open(joint);
            if turns != Turns::None || open {
                self.released.push(Released { lane, joint: k, turns, open, broken: false });
            }
            if broken {
                self.set_broken(lane, k, true);
            }
        }
        self.note_order();
    }

    /// Notes whether they are in the order of their joints, so that a joint's are found at once: rods on springs have many.
    fn note_order(&mut self) {
        self.is_released_in_order = self.released.is_sorted_by_key(|one| one.joint);
    }

    /// Whether a joint of a lane leaves something free.
    pub(crate) fn is_loose(&self, joint: usize, lane: usize) -> bool {
        self.released.iter().any(|one| (one.lane, one.joint) == (lane, joint))
    }

    /// Whether an anchor of a lane is open.
    pub(crate) fn is_open(&self, anchor: usize, lane: usize) -> bool {
        let holds_on = |joint: usize| self.system.topology.joints[joint].contains(&(anchor as u32));
        self.released.iter().any(|one| one.open && one.lane == lane && holds_on(one.joint))
    }

    /// Opens or closes the joints of a lane that hold on to an anchor, where it is then.
    pub(crate) fn set_open(&mut self, lane: usize, anchor: usize, open: bool) {
        let ends = self.system.topology.joints.iter().enumerate();
        for (joint, _) in ends.filter(|(_, ends)| ends.contains(&(anchor as u32))) {
            match self.released.iter_mut().find(|one| (one.lane, one.joint) == (lane, joint)) {
                Some(one) => one.open = open,
                None => self.released.push(Released { lane, joint, turns: Turns::None, open, broken: false }),
            }
        }
        self.released.retain(|one| one.is_apart() || one.turns != Turns::None);
        self.note_order();
    }

    /// Makes a joint of a lane one that has broken, or one that has not.
    pub(crate) fn set_broken(&mut self, lane: usize, joint: usize, broken: bool) {
        match self.released.iter_mut().find(|one| (one.lane, one.joint) == (lane, joint)) {
            Some(one) => one.broken = broken,
            None => self.released.push(Released { lane, joint, turns: Turns::None, open: false, broken }),
        }
        self.released.retain(|one| one.is_apart() || one.turns != Turns::None);
        self.note_order();
        self.broken.resize(self.system.topology.joints.len(), false);
        self.broken[joint] = broken;
        if self.broken.iter().all(|broken| !broken) {
            self.broken.clear();
        }
    }

    /// Opens the joints of a segment that goes into a store.
    pub(crate) fn open_stored(&mut self, lane: usize, body: usize) {
        for (joint, _) in
            self.system.topology.joints.iter().enumerate().filter(|(_, ends)| ends.contains(&(body as u32)))
        {
            if !self.is_loose(joint, lane) {
                self.released.push(Released { lane, joint, turns: Turns::None, open: true, broken: false });
            }
        }
        self.note_order();
    }

    /// Closes the joints of a segment that comes out of a store, but for those to what is stored still.
    pub(crate) fn close_stored(&mut self, lane: usize, body: usize) {
        let Self { released, system, segments, bodies, .. } = self;
        released.retain(|one| {
            let ends = system.topology.joints[one.joint].map(|body| body as usize);
            let is_own = one.open && one.lane == lane && ends.contains(&body);
            let is_inner = ends.iter().all(|end| end < segments);
            !(is_own && is_inner && ends.iter().all(|&end| bodies[end].free.lane(lane) != 0.0))
        });
    }

    /// Places open grips at the faces that they may hold, and what is stored in line behind what is outside: last what is farthest in.
    #[cold]
    #[inline(never)]
    pub(crate) fn follow_faces(&mut self) {
        for k in (0..self.released.len()).rev() {
            let Released { lane, joint, open, broken, .. } = self.released[k];
            if !open || broken {
                continue;
            }
            let [a, b] = self.system.topology.joints[joint].map(|body| body as usize);
            let offsets = self.system.joints[joint].offsets.map(|z| z.lane(lane));
            let rest = self.rest_rotation(joint, lane);
            let is_a = a >= self.segments || b < self.segments;
            let (anchor, body, at_anchor, at_body) =
                if is_a { (a, b, offsets[0], offsets[1]) } else { (b, a, offsets[1], offsets[0]) };
            let pose = pick_pose(&self.poses[body], lane);
            let q = pose.q * if is_a { rest.conj() } else { rest };
            let x = pose.x + pose.q.axis() * at_body - q.axis() * at_anchor;
            copy_pose(&mut self.poses[anchor], lane, &BodyPose { x, q: q.normalized() }, 0);
        }
    }

    /// `conj(q_a) q_b` of a joint at rest.
    fn rest_rotation(&self, joint: usize, lane: usize) -> Quat<f64> {
        let length = self.system.joints[joint].length.lane(lane);
        let rest = self.strain_measure.darboux_of(&pick(self.joints[joint].rest, lane).0.into(), length);
        let v = Vec3(rest.into()) * (0.5 * length);
        let squared = v.norm_squared();
        let rest = match squared >= 1.0 {
            true => Quat { v: v * (1.0 / squared.sqrt()), w: 0.0 },
            false => Quat { v, w: (1.0 - squared).sqrt() },
        };
        match self.extras.rests.get(joint).map(|rests| rests.map(|q| Quat { v: pick(q.v, lane), w: q.w.lane(lane) })) {
            None => rest,
            Some([of_a, of_b]) => of_a * rest * of_b.conj(),
        }
    }

    /// Makes the free rows of the evaluation under way, whose bodies' terms are there, free: what the joint has turned by is
    /// what it is at rest, and the compliance is large.
    #[cold]
    #[inline(never)]
    pub(crate) fn free_rows(&mut self) {
        for k in 0..self.released.len() {
            let Released { lane, joint, turns, open, broken } = self.released[k];
            let open = open || broken;
            let [a, b] = self.system.topology.joints[joint].map(|body| body as usize);
            let (mut first, mut second) = (self.poses[a].q, self.poses[b].q);
            if let Some(rests) = self.extras.rests.get(joint) {
                (first, second) = (first * rests[0], second * rests[1]);
            }
            let terms = &mut self.system.joints[joint];
            // As the evaluation of joints computes it, to the last bit.
            let bent = (first.conj() * second).upper();
            let (rows, measured) = RotationRows::new(self.strain_measure, bent);
            let now = pick(measured * (T::splat(1.0) / terms.length), lane);
            let length = terms.length.lane(lane);
            let [on_a, on_b] = [a, b].map(|body| {
                let inertia = self.system.bodies[body].inverse_inertia.0;
                let mass = self.system.bodies[body].inverse_mass.lane(lane);
                (mass, (0..3).map(|k| inertia[k].lane(lane)).fold(0.0, f64::max))
            });
            let answer = (on_a.1 + on_b.1) / (length * length);
            let all = (FREE * answer).max(LEAST);
            // What inner damping has made of it in this step, if there is any.
            let rests = &mut self.joints[joint].rest;
            let rest = self.extras.damped.get_mut(joint).map_or(rests, |damped| &mut damped.rest);
            let bend = match turns {
                // The anchor goes with the face, with nothing between them but the hinge's angle.
                Turns::One if open => Some(all),
                Turns::One => {
                    rest.0[2].set_lane(lane, now.0[2]);
                    // |N d| of the axis: towards half a turn the rows are scaled by its square.
                    let axis = Vec3([0.0, 0.0, 1.0].map(T::splat));
                    let scale = rows.inverse(bent.v, axis).norm_squared().lane(lane);
                    terms.twist_extra.set_lane(lane, (FREE_OF_THREE * answer / scale).max(LEAST));
                    None
                }
                Turns::All => {
                    put(rest, lane, now.0);
                    Some(all)
                }
                Turns::None => open.then_some(all),
            };
            if let Some(bend) = bend {
                terms.bend.set_lane(lane, bend);
                terms.twist_extra.set_lane(lane, 0.0);
            }
            if open {
                let reach = |offset: f64, (mass, turn): (f64, f64)| mass + offset * offset * turn;
                let [at_a, at_b] = terms.offsets.map(|z| z.lane(lane));
                terms.shear.set_lane(lane, (FREE * (reach(at_a, on_a) + reach(at_b, on_b))).max(LEAST));
                terms.stretch_extra.set_lane(lane, 0.0);
                for list in [&mut self.system.shear_extra, &mut self.system.bend_extra] {
                    if let Some(extra) = list.get_mut(joint) {
                        extra.set_lane(lane, 0.0);
                    }
                }
            }
        }
    }

    /// Drops what free rows answered in a linear solve.
    #[inline]
    pub fn drop_free(&mut self) {
        for one in &self.released {
            let own = &mut self.dlambda[one.joint];
            *own = masked(*own, one);
        }
    }

    /// Rows of a joint, zero where it is free.
    pub(crate) fn without_free_rows(&self, joint: usize, x: Spatial<T>) -> Spatial<T> {
        if self.is_released_in_order {
            let first = self.released.partition_point(|one| one.joint < joint);
            return self.released[first..].iter().take_while(|one| one.joint == joint).fold(x, masked);
        }
        self.released.iter().filter(|one| one.joint == joint).fold(x, masked)
    }

    /// Drops what a guess says of multipliers of free rows.
    pub(crate) fn drop_free_multipliers(&mut self) {
        for one in &self.released {
            let own = &mut self.lambda[one.joint];
            *own = masked(*own, one);
        }
    }
}

impl Component<f64> {
    /// Joints that turn freely about one axis.
    pub fn hinges(&self) -> impl Iterator<Item = usize> {
        self.released.iter().filter(|one| one.turns == Turns::One && !one.is_apart()).map(|one| one.joint)
    }

    /// Holds the free rows of hinges of the last evaluation by what the joints bend by.
    pub fn hold_hinges(&mut self) {
        for one in self.released.iter().filter(|one| one.turns == Turns::One && !one.is_apart()) {
            self.system.joints[one.joint].twist_extra = 0.0;
        }
    }

    /// The free row of a hinge as a direction of its world rows.
    pub fn free_row(&self, joint: usize) -> Spatial<f64> {
        let row = Spatial { linear: Vec3::zero(), angular: Vec3([0.0, 0.0, 1.0]) };
        self.system.joints[joint].to_world(row, self.system.frame(joint))
    }
}

fn turns(joint: &Joint) -> Turns {
    match joint.freedom {
        Freedom::None | Freedom::Broken => Turns::None,
        Freedom::Ball => Turns::All,
        Freedom::Hinge => Turns::One,
    }
}

/// Multipliers of a joint without those of its free rows.
fn masked<T: Real>(x: Spatial<T>, one: &Released) -> Spatial<T> {
    let Released { lane, turns, .. } = *one;
    let (mut out, open) = (x, one.is_apart());
    if open {
        put(&mut out.linear, lane, [0.0; 3]);
    }
    match turns {
        Turns::One if !open => out.angular.0[2].set_lane(lane, 0.0),
        Turns::None if !open => {}
        _ => put(&mut out.angular, lane, [0.0; 3]),
    }
    out
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nalgebra::Vector3;
    use rod::{Assembly, InnerDamping, Material, RodSpec, shape};

    use super::*;
    use crate::{Formulation, split};

    /// An attempt that came to nothing may leave an open grip anywhere, and one who asks for its pose puts it back.
    #[test]
    fn where_an_open_grip_was_left_does_not_matter() {
        let material = Material { youngs_modulus: 1e6, torsion_modulus: 1e6, density: 1e3 };
        let mut assembly = Assembly::new(Vector3::z() * -10.0);
        let inner_damping = InnerDamping { bending: 0.1, twist: 0.1, stretch: 0.1 };
        let nodes = shape::straight(Vector3::zeros(), Vector3::x(), 1.0, 2);
        let rod = assembly.rod(&RodSpec { inner_damping, ..RodSpec::new(nodes, 0.01, material) });
        assembly.clamp_end(&rod);
        let (mut model, state) = assembly.finish();
        model.open.push(0);
        let residuals = |lost: bool| {
            let (members, topology) = split(&model).remove(0);
            let mut component = Component::<f64>::new(&model, &state, Arc::new(topology), &[&members]);
            if lost {
                component.poses[2].x = Vec3([f64::NAN; 3]);
            }
            component.predict(0.0, 0.01, Formulation::Newton);
            component.evaluate(Formulation::Newton)
        };
        assert!(residuals(false).check.is_finite());
        assert_eq!(residuals(true), residuals(false));
    }
}

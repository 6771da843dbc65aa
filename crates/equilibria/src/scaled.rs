//! A query in units of its cable's length L and larger bending stiffness B: lengths in L, moments in B / L, forces in B / L^2.

use cosserat::internals::kernels::lane::Real;
use cosserat::internals::kernels::math::{Quat, Vec3};
use nalgebra::{UnitQuaternion, Vector3};

use crate::query::Query;
use crate::sweep::Chain;

/// A query without units. The start's grip is the origin.
#[derive(Clone, Copy, Debug)]
pub struct Scaled {
    /// Stiffness against curvature about d1 and d2 and against twist.
    pub stiffness: [f64; 3],
    /// Curvatures and twist at rest.
    pub rest: [f64; 3],
    /// Weight of the cable.
    pub weight: f64,
    /// Compliance of a joint of the cable's own cut.
    pub compliance: f64,
    /// A weight that it carries, and its place, from 0 to 1.
    pub carried: [f64; 2],
    /// From grip to grip.
    pub chord: Vector3<f64>,
    /// Orientations of the grips.
    pub ends: [UnitQuaternion<f64>; 2],
    /// Whether the end is held.
    pub held: bool,
}

impl Scaled {
    /// Takes the units off.
    pub fn new(query: &Query) -> Self {
        let Query { cable, start, end } = query;
        let (length, bending) = (cable.length, cable.bending[0].max(cable.bending[1]));
        let stiffness = [cable.bending[0], cable.bending[1], cable.torsion].map(|k| k / bending);
        let other = end.unwrap_or(*start);
        Self {
            stiffness,
            rest: [0, 1, 2].map(|k| cable.rest[k] * length),
            weight: cable.weight * length.powi(3) / bending,
            compliance: cable.stretch_compliance * bending / length.powi(3),
            carried: [cable.carried.weight * length.powi(2) / bending, cable.carried.place / length],
            chord: (other.position - start.position) / length,
            ends: [start.orientation, other.orientation],
            held: end.is_some(),
        }
    }
}

/// How a cable is cut: a first and a last segment of one length, others between them of another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cut {
    /// Number of segments.
    pub segments: usize,
    /// Lengths of the end segments and of those between them.
    pub lengths: [f64; 2],
}

impl Cut {
    /// Equal segments.
    pub(crate) fn even(segments: usize) -> Self {
        Self { segments, lengths: [1.0 / segments as f64; 2] }
    }

    /// Segments between ends as long as those of another cut.
    pub(crate) fn between(segments: usize, ends: f64) -> Self {
        Self { segments, lengths: [ends, (1.0 - 2.0 * ends) / (segments as f64 - 2.0)] }
    }

    /// Place of the centre of a segment, from 0 to 1.
    pub fn place(&self, segment: usize) -> f64 {
        let [end, inner] = self.lengths;
        if segment == 0 {
            0.5 * end
        } else if segment + 1 == self.segments {
            1.0 - 0.5 * end
        } else {
            end + inner * (segment as f64 - 0.5)
        }
    }

    /// Joints of the cable's own cut, of which this is one, or a coarser one with ends of the same length.
    fn own_joints(&self) -> f64 {
        (1.0 / self.lengths[0]).round() + 1.0
    }

    /// Length of a segment.
    pub(crate) fn length(&self, segment: usize) -> f64 {
        self.lengths[usize::from(segment != 0 && segment + 1 != self.segments)]
    }

    /// Share of a segment that is further along the cable than a place.
    pub(crate) fn share_after(&self, segment: usize, place: f64) -> f64 {
        ((self.place(segment) - place) / self.length(segment) + 0.5).clamp(0.0, 1.0)
    }

    /// Lengths of the kinds of joints, see [`crate::sweep::KINDS`].
    pub(crate) fn joints(&self) -> [f64; 3] {
        let [end, inner] = self.lengths;
        [0.5 * end, 0.5 * (end + inner), inner]
    }
}

impl<T: Real> Chain<T> {
    /// Memory for chains of this cut.
    pub(crate) fn new(cut: &Cut) -> Self {
        let zero = T::zero();
        Self {
            lengths: cut.lengths.map(T::splat),
            stiffness: [[T::splat(1.0); 3]; 3],
            rest: [[zero; 3]; 3],
            held: zero,
            weights: vec![zero; cut.segments],
            compliance: zero,
            sag: zero,
            chord: Vec3::zero(),
            ends: [Quat::identity(); 2],
            turns: vec![Quat::identity(); cut.segments],
            force: Vec3::zero(),
        }
    }

    /// Puts a query into a lane, without its start.
    pub(crate) fn load(&mut self, lane: usize, cut: &Cut, query: &Scaled) {
        self.load_long(lane, cut, query, 1.0);
    }

    /// The same of a cable that is `length` units long.
    pub(crate) fn load_long(&mut self, lane: usize, cut: &Cut, query: &Scaled, length: f64) {
        for (own, share) in self.lengths.iter_mut().zip(cut.lengths) {
            own.set_lane(lane, share * length);
        }
        for (kind, share) in cut.joints().into_iter().enumerate() {
            let length = share * length;
            for k in 0..3 {
                self.stiffness[kind][k].set_lane(lane, 4.0 * query.stiffness[k] / length);
                self.rest[kind][k].set_lane(lane, 0.5 * length * query.rest[k]);
            }
        }
        self.held.set_lane(lane, if query.held { 1.0 } else { 0.0 });
        let [carried, place] = query.carried;
        let (mut before, mut loaded) = (0.0, 0.0);
        for (i, weight) in self.weights.iter_mut().enumerate() {
            let own = query.weight * cut.length(i);
            let share = cut.share_after(i, place);
            weight.set_lane(lane, before + 0.5 * own + carried * share);
            before += own;
            loaded += f64::from(u8::from(share > 0.0));
        }
        // A coarser cut yields as much as the cable's own.
        let compliance = query.compliance * cut.own_joints();
        self.compliance.set_lane(lane, compliance);
        // The mean of the weights before all joints is half the cable's: they are symmetric. Those after the segment that carries
        // something bear that, too.
        let borne = 0.5 * query.weight + carried * loaded / (cut.segments as f64 + 1.0);
        self.sag.set_lane(lane, compliance * borne);
        for k in 0..3 {
            self.chord.0[k].set_lane(lane, query.chord[k]);
        }
        for (own, end) in self.ends.iter_mut().zip(&query.ends) {
            set(own, lane, end);
        }
    }
}

pub(crate) fn set<T: Real>(own: &mut Quat<T>, lane: usize, q: &UnitQuaternion<f64>) {
    let [x, y, z] = &mut own.v.0;
    x.set_lane(lane, q.i);
    y.set_lane(lane, q.j);
    z.set_lane(lane, q.k);
    own.w.set_lane(lane, q.w);
}

pub(crate) fn get<T: Real>(own: &Quat<T>, lane: usize) -> UnitQuaternion<f64> {
    let [x, y, z] = own.v.0.map(|x| x.lane(lane));
    UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(own.w.lane(lane), x, y, z))
}

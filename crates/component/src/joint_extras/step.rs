//! What the step under way has of what joints have beyond those of the paper.

use jointed::rotation::RotationRows;
use kernels::lane::Real;
use kernels::math::Vec3;

use crate::Component;
use crate::constants::JointConstants;

impl<T: Real> Component<T> {
    /// Sets what the step from `start` has of its own: the strains that it starts with and its compliances, which
    /// `set_compliances` has set without damping.
    pub(crate) fn begin_beyond(&mut self) {
        let k = T::splat(1.0) / (self.effective * self.effective);
        for (own, &extra) in self.system.bend_extra.iter_mut().zip(&self.extras.bend_extra) {
            *own = extra * k;
        }
        for (own, &extra) in self.system.shear_extra.iter_mut().zip(&self.extras.shear_extra) {
            *own = extra * k;
        }
        let (one, rate) = (T::splat(1.0), T::splat(1.0 / self.dt));
        for j in 0..self.extras.damped.len() {
            let [a, b] = self.system.topology.joints[j].map(|body| self.start[body as usize]);
            let terms = &mut self.system.joints[j];
            let damped = &mut self.extras.damped[j];
            let [bending, twist, stretch] = damped.times.map(|time| time * rate);
            let kept = |ratio: T| one / (one + ratio);
            let JointConstants { rest, stretch: along, shear, bend, twist: about, .. } = self.joints[j];

            let (bend, about) = (bend * kept(bending), about * kept(twist));
            let (along, shear) = (along * kept(stretch), shear * kept(stretch));
            terms.shear = shear * k;
            terms.stretch_extra = (along - shear) * k;
            terms.bend = bend * k;
            terms.twist_extra = (about - bend) * k;
            if let Some(extra) = self.system.bend_extra.get_mut(j) {
                *extra = *extra * kept(bending);
            }
            if let Some(extra) = self.system.shear_extra.get_mut(j) {
                *extra = *extra * kept(stretch);
            }

            let [of_a, of_b] = self.extras.rests.get(j).map_or([a.q, b.q], |rests| [a.q * rests[0], b.q * rests[1]]);
            let relative = (of_a.conj() * of_b).upper();
            let measured = RotationRows::new(self.strain_measure, relative).1;
            let [x, y, z] = (measured * (T::splat(1.0) / terms.length) - rest).0;
            let share = |ratio: T| ratio * kept(ratio);
            let (bending, twist) = (share(bending), share(twist));
            damped.rest = rest + Vec3([x * bending, y * bending, z * twist]);
            let mut gap = a.x - b.x + a.q.axis() * terms.offsets[0] - b.q.axis() * terms.offsets[1];
            if let Some(across) = self.extras.across.get(j) {
                gap = gap + a.q.rotate(across[0]) - b.q.rotate(across[1]);
            }
            damped.gap = a.q.rotate_back(gap) * share(stretch);
        }
    }

    /// Turns the places across the axes with the current poses.
    pub(crate) fn turn_places(&mut self) {
        for (k, across) in self.extras.across.iter().enumerate() {
            let ends = self.system.topology.joints[k];
            for ((arm, &place), body) in self.system.across[k].iter_mut().zip(across).zip(ends) {
                *arm = self.poses[body as usize].q.rotate(place);
            }
        }
    }

    /// Joints lose nothing any more.
    pub fn stop_inner_damping(&mut self) {
        self.extras.damped.clear();
    }
}

//! Eyelets that drive rods through them, out of a store and into it.
//!
//! With speed v the place of the eyelet is s_0 - v dt, and the force along the rod what that takes, up to the largest of the drive. A rod that is
//! stored before the eyelet takes part from the segment on whose centre is the last one before it. The joint after that segment yields
//! only as far as its material is beyond the eyelet: with the eyelet at its first segment's centre it is as compliant as any, at its second one's
//! rigid. Then the first segment, in line with the second, goes into the store, and nothing jumps.

use kernels::lane::Real;

use super::Eyelet;
use super::feed::Drive;
use crate::Component;

/// The least share of a joint's compliance that is left as its material goes into the store: beyond it joints are rigid for all that counts,
/// and no system is singular.
const LEAST_SHARE: f64 = 1e-3;

impl Eyelet {
    /// Where it goes in a step from `time` if nothing slips.
    pub(super) fn carried(&self, time: f64, dt: f64) -> f64 {
        let way = self.drive.as_ref().map_or(0.0, |drive| drive.speed(time + 0.5 * dt) * dt);
        (self.place - way).clamp(self.range[0], self.range[1])
    }

    /// The first segment that takes part in a step from `time`: one more than needed where the step pays out past a centre.
    fn first_outside(&self, time: f64, dt: f64) -> usize {
        let slips = self.place + self.rate * dt;
        let least = self.carried(time, dt).min(slips).min(self.place);
        self.line.segment_before(least)
    }

    /// The drive that takes the rod out of a store.
    fn stored_by(&self) -> Option<&Drive> {
        self.drive.as_ref().filter(|drive| drive.feed.is_stored)
    }

    /// Whether anything but an end of its range can hold it.
    pub(super) fn grips(&self) -> bool {
        self.friction > 0.0 || self.drive.is_some()
    }
}

impl<T: Real> Component<T> {
    /// How many segments, from the start of its rod on, each store holds in the step to come: by the index of the sliding joint in the model.
    pub fn each_store(&self, time: f64, dt: f64, mut see: impl FnMut(usize, usize)) {
        for eyelet in self.eyelets.all.iter().filter(|eyelet| eyelet.stored_by().is_some()) {
            see(eyelet.index, eyelet.first_outside(time, dt));
        }
    }

    /// Sets the speed of a feed of the model from the next step on [m/s]; returns whether it is one of these.
    pub fn set_feed(&mut self, index: usize, speed: f64) -> bool {
        let own = self.eyelets.all.iter_mut().find(|eyelet| eyelet.index == index);
        let drive = own.and_then(|eyelet| eyelet.drive.as_mut());
        drive.map(|drive| drive.set = Some(speed)).is_some()
    }

    /// The speed that was set for an eyelet's feed on the way.
    pub(super) fn set_speed(eyelet: &mut Eyelet) -> Option<&mut Option<f64>> {
        eyelet.drive.as_mut().map(|drive| &mut drive.set)
    }

    /// Lets the store carry what is in it of the segments that take part: takes gravity's motion over the step under way off their
    /// prediction, which acts for so long on their velocities [s].
    pub(crate) fn carry_stored(&mut self, pushed: T) {
        let h = T::splat(self.dt);
        for eyelet in self.eyelets.all.iter().filter(|eyelet| eyelet.stored_by().is_some()) {
            let place = eyelet.carried(self.time, self.dt);
            for k in self.first_free(eyelet)..(eyelet.line.segment_before(place) + 2).min(eyelet.line.segments()) {
                let body = &self.bodies[eyelet.first + k];
                let inside = 0.5 + (place - eyelet.line.centre(k)) / body.length.lane(0);
                let mut share = T::splat(inside.clamp(0.0, 1.0));
                // In air the prediction has its weight beside the mass that drag adds.
                if let Some(drag) = &self.drag {
                    share = share * T::splat(drag.inertia(eyelet.first + k, 0)[0]) * body.inverse_mass;
                }
                self.predicted[eyelet.first + k].x -= self.gravity * (pushed * h * share * body.free);
            }
        }
    }

    /// The first segment of an eyelet's rod that takes part in the step under way, which may be a part of the one for which the others were stored.
    fn first_free(&self, eyelet: &Eyelet) -> usize {
        let is_free = |&k: &usize| self.bodies[eyelet.first + k].free.lane(0) != 0.0;
        (0..eyelet.line.segments()).find(is_free).unwrap_or(eyelet.line.segments())
    }

    /// Lets joints yield as far as their material is beyond the eyelets where the step under way ends.
    pub(crate) fn stiffen_stored(&mut self) {
        let (time, dt) = (self.time, self.dt);
        for eyelet in &self.eyelets.all {
            let Some(drive) = eyelet.stored_by() else { continue };
            let place = eyelet.carried(time, dt);
            let last = eyelet.line.segment_before(place);
            for k in self.first_free(eyelet)..(last + 1).min(drive.joints.len()) {
                let [from, to] = [k, k + 1].map(|segment| eyelet.line.centre(segment));
                let share = T::splat(((to - place) / (to - from)).clamp(LEAST_SHARE, 1.0));
                let joint = drive.joints[k];
                let terms = &mut self.system.joints[joint];
                for of in [&mut terms.shear, &mut terms.stretch_extra, &mut terms.bend, &mut terms.twist_extra] {
                    *of = *of * share;
                }
                for list in [&mut self.system.bend_extra, &mut self.system.shear_extra] {
                    if let Some(of) = list.get_mut(joint) {
                        *of = *of * share;
                    }
                }
            }
        }
    }
}

impl Component<f64> {
    /// The joint after each of so many bodies of a rod but the last, from this body on.
    pub(super) fn chain(&self, first: usize, count: usize) -> Vec<usize> {
        let mut joints = vec![0; count.saturating_sub(1)];
        for (joint, &[a, b]) in self.system.topology.joints.iter().enumerate() {
            let (low, high) = (a.min(b) as usize, a.max(b) as usize);
            if high == low + 1 && (first..first + joints.len()).contains(&low) {
                joints[low - first] = joint;
            }
        }
        joints
    }
}

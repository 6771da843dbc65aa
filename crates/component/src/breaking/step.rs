//! Joints of a component that break.

use kernels::lane::Real;
use rod::{Break, Freedom, JointForce, Strength};

use super::Breakable;
use crate::Component;
use crate::parts::{get, get_quat};
use crate::snapshot::StateVisitor;

impl<T: Real> Component<T> {
    /// What a joint of a lane transmits with its multipliers, over so much of their `share`: see [`JointForce::of_multipliers`].
    pub(crate) fn joint_force(&self, joint: usize, lane: usize, share: f64) -> JointForce {
        let [lambda_s, lambda_b] =
            [self.lambda[joint].linear, self.lambda[joint].angular].map(|x| get(x, lane) * share);
        let [a, b] = self.system.topology.joints[joint].map(|body| get_quat(self.poses[body as usize].q, lane));
        let (length, measure) = (self.system.joints[joint].length.lane(lane), self.strain_measure);
        match self.extras.rests.get(joint).map(|rests| rests.map(|q| get_quat(q, lane))) {
            None => JointForce::of_multipliers(measure, lambda_s, lambda_b, [&a, &b], length),
            Some([of_a, of_b]) => {
                let between = [&(a * of_a), &(b * of_b)];
                let own = JointForce::of_multipliers(measure, lambda_s, lambda_b, between, length);
                JointForce { moment: of_a * own.moment, ..own }
            }
        }
    }

    /// Breaks the joint that bears too much at the end of the step under way, which is solved: the one of which most is asked for its strength.
    /// Returns whether there is one; the step is then to be done again.
    pub fn break_joint(&mut self) -> bool {
        let worst = self.breakable.iter().enumerate().filter(|(_, own)| own.broke.is_none()).map(|(k, own)| {
            let load = self.load_of(own);
            (k, load, own.strength.share(&load).0)
        });
        let (k, load, share) =
            worst.fold((0, Strength::UNLIMITED, 1.0), |most, one| if one.2 > most.2 { one } else { most });
        if share <= 1.0 {
            return false;
        }
        let Breakable { joint, index, .. } = self.breakable[k];
        self.breakable[k].broke = Some(Break { joint: index, time: self.time, load });
        self.set_broken(0, joint, true);
        true
    }

    /// Makes the joints whole again that have broken since a time [s], where what has been done since is to be done again.
    pub fn mend(&mut self, since: f64) {
        for k in 0..self.breakable.len() {
            let Breakable { joint, broke, .. } = self.breakable[k];
            if broke.is_some_and(|broke| broke.time >= since) {
                self.breakable[k].broke = None;
                self.set_broken(0, joint, false);
            }
        }
    }

    /// What the end of the step under way asks of a joint.
    fn load_of(&self, own: &Breakable) -> Strength {
        let effective = self.effective.lane(0);
        let transmitted = self.joint_force(own.joint, 0, 1.0 / (effective * effective));
        let ends = self.system.topology.joints[own.joint].map(|body| self.poses[body as usize].q);
        let axes = ends.map(|q| get(q.axis(), 0));
        Strength {
            tension: transmitted.tension_between(&own.constants, axes),
            moment: transmitted.moment.xy().norm(),
            curvature: match own.constants.freedom {
                Freedom::Ball => 0.0,
                _ => self.strain_of(own.joint, ends).xy().norm(),
            },
        }
    }

    /// Joints of the model that have broken, and how.
    pub fn breaks(&self) -> impl Iterator<Item = &Break> {
        self.breakable.iter().filter_map(|own| own.broke.as_ref())
    }

    /// Joints of the model that can break, what they leave free now, and the time up to which those held that have broken [s].
    pub fn breakable_joints(&self) -> impl Iterator<Item = (usize, Freedom, Option<f64>)> {
        self.breakable.iter().map(|own| {
            let broke = own.broke.map(|broke| broke.time);
            (own.index, if broke.is_some() { Freedom::Broken } else { own.constants.freedom }, broke)
        })
    }

    /// Shows a visitor which joints have broken, and how.
    pub(crate) fn visit_breaks(&mut self, visitor: &mut StateVisitor<'_>) {
        for k in 0..self.breakable.len() {
            let Breakable { joint, index, .. } = self.breakable[k];
            let before = self.breakable[k].broke;
            let mut is_broken = before.is_some();
            visitor.flag(&mut is_broken);
            let mut broke = before.unwrap_or(Break { joint: index, time: 0.0, load: Strength::UNLIMITED });
            let Strength { tension, moment, curvature } = &mut broke.load;
            [&mut broke.time, tension, moment, curvature].into_iter().for_each(|x| visitor.number(x));
            if visitor.is_reading() {
                self.breakable[k].broke = is_broken.then_some(broke);
                if is_broken != before.is_some() {
                    self.set_broken(0, joint, is_broken);
                }
            }
        }
    }
}

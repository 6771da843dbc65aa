//! The way back over a step, joint by joint: what a joint's equations depend on, and inner damping, which remembers the strains
//! at the start.

use super::adjoint::of_ends;
use super::{BodyBar, Component};
use crate::derivative::JointVariation;
use crate::kernel::Spatial;
use crate::kernel::math::Vec3;

impl Component<f64> {
    /// Derivatives with respect to a joint's numbers, from the solution of the transposed equations in its rows.
    pub(crate) fn joint_back(&self, j: usize, field: Spatial<f64>) -> [f64; 12] {
        let (system, terms, constants, lambda) =
            (&self.system, &self.system.joints[j], &self.joints[j], self.lambda[j]);
        let rows = self.without_free_rows(j, terms.multipliers_from_world(field, system.frame(j)));
        let body = &system.bodies[system.topology.joints[j][0] as usize];
        let [bending, twist, stretch] = self.kept(j);
        let k = 1.0 / (self.effective * self.effective);

        let (force, answer) = (lambda.linear, field.linear);
        let second = body.orientation.second_axis();
        let along = body.axis.dot(force) * body.axis.dot(answer);
        let across = force.dot(answer) - along;
        let further = second.dot(force) * second.dot(answer);
        let [x, y, z] = [0, 1, 2].map(|r| lambda.angular.0[r] * rows.angular.0[r]);

        // What a rate of damping does, over the square of what it leaves of compliances.
        let (strain, gap) = self.strain_at_start(j);
        let remembered = [0, 1, 2].map(|r| strain.0[r] * rows.angular.0[r]);
        let [bend_extra, shear_extra] =
            [&self.beyond.bend_extra, &self.beyond.shear_extra].map(|list| list.get(j).copied().unwrap_or(0.0));
        let bent = constants.bend * (x + y) + bend_extra * y;
        let stretched = constants.stretch * along + constants.shear * across + shear_extra * further;
        let stretch_remembered = body.orientation.rotate(gap).dot(answer);
        let per = 1.0 / self.dt;
        let [rest_x, rest_y, rest_z] = rows.angular.0;
        [
            rest_x * bending,
            rest_y * bending,
            rest_z * twist,
            -k * stretch * along,
            -k * stretch * across,
            -k * stretch * further,
            -k * bending * (x + y),
            -k * bending * y,
            -k * twist * z,
            per * bending * bending * (remembered[0] + remembered[1] + k * bent),
            per * twist * twist * (remembered[2] + k * constants.twist * z),
            per * stretch * stretch * (stretch_remembered + k * stretched),
        ]
    }

    /// Adds what a joint remembers of the start of the step to derivatives with respect to the poses of its bodies there.
    pub(crate) fn memory_back(&self, j: usize, field: Spatial<f64>, bars: &mut [BodyBar]) {
        if self.beyond.damped.is_empty() {
            return;
        }
        let (system, terms) = (&self.system, &self.system.joints[j]);
        let [a, b] = system.topology.joints[j].map(|body| body as usize);
        let rows = self.without_free_rows(j, terms.multipliers_from_world(field, system.frame(j)));
        let [bending, twist, stretch] = self.kept(j).map(|kept| 1.0 - kept);
        let [x, y, z] = rows.angular.0;
        let of_strain = Vec3([x * bending, y * bending, z * twist]) * (1.0 / terms.length);
        let [of_a, of_b] = self.frames_at_start(j);
        let relative = (of_a.conj() * of_b).upper();
        let turn = of_a.rotate(of_ends((relative.w, relative.v * 2.0), of_strain)[1]);
        let shift = self.start[a].q.rotate(self.poses[a].q.rotate_back(field.linear)) * stretch;
        let (gap, arms) = self.gap_at_start(j);
        bars[a].pose = bars[a].pose.plus(Spatial { linear: shift, angular: (arms[0] - gap).cross(shift) - turn }, 1.0);
        bars[b].pose = bars[b].pose.plus(Spatial { linear: -shift, angular: turn - arms[1].cross(shift) }, 1.0);
    }

    /// What inner damping leaves of the compliances of a step: of bending, twist and stretch.
    fn kept(&self, j: usize) -> [f64; 3] {
        self.beyond.damped.get(j).map_or([1.0; 3], |damped| damped.times.map(|time| 1.0 / (1.0 + time / self.dt)))
    }

    fn frames_at_start(&self, j: usize) -> [crate::kernel::math::Quat<f64>; 2] {
        let [a, b] = self.system.topology.joints[j].map(|body| self.start[body as usize].q);
        self.beyond.rests.get(j).map_or([a, b], |rests| [a * rests[0], b * rests[1]])
    }

    /// The gap of a joint at the start of the step, and its arms, in world axes.
    fn gap_at_start(&self, j: usize) -> (Vec3<f64>, [Vec3<f64>; 2]) {
        let [a, b] = self.system.topology.joints[j].map(|body| &self.start[body as usize]);
        let offsets = self.system.joints[j].offsets;
        let mut arms = [a.q.axis() * offsets[0], b.q.axis() * offsets[1]];
        if let Some(across) = self.beyond.across.get(j) {
            arms = [arms[0] + a.q.rotate(across[0]), arms[1] + b.q.rotate(across[1])];
        }
        (a.x - b.x + arms[0] - arms[1], arms)
    }

    /// Strains of a joint at the start of the step: of bend-twist beyond rest, and the gap in the frame of body a.
    fn strain_at_start(&self, j: usize) -> (Vec3<f64>, Vec3<f64>) {
        let [of_a, of_b] = self.frames_at_start(j);
        let a = self.system.topology.joints[j][0] as usize;
        let relative = (of_a.conj() * of_b).upper();
        let strain = relative.v * (2.0 / self.system.joints[j].length) - self.joints[j].rest_darboux;
        (strain, self.start[a].q.rotate_back(self.gap_at_start(j).0))
    }
}

/// Numbers of a joint from [`Component::joint_back`], added.
pub(crate) fn add_numbers(own: &mut JointVariation, by: &[f64; 12]) {
    let mut numbers = own.numbers();
    numbers.iter_mut().zip(by).for_each(|(own, by)| *own += by);
    *own = JointVariation::of_numbers(&numbers);
}

//! The way back over a step, joint by joint: what a joint's equations depend on, and inner damping, which remembers the strains
//! at the start.

use jointed::rotation::RotationRows;
use kernels::Spatial;
use kernels::lane::Real;
use kernels::math::{Quat, Sym3, Vec3};

use super::adjoint::zip;
use super::parts::pick;
use super::{BodyBar, Component};
use crate::variation::JointVariation;

impl<T: Real> Component<T> {
    /// Derivatives with respect to a joint's numbers, from the solution of the transposed equations in its rows.
    #[inline(always)]
    pub fn joint_back(&self, j: usize, field: Spatial<T>) -> [T; 12] {
        let (system, terms, constants, lambda) =
            (&self.system, &self.system.joints[j], &self.joints[j], self.lambda[j]);
        let rows = self.without_free_rows(j, terms.multipliers_from_world(field, system.frame(j)));
        let body = &system.bodies[system.topology.joints[j][0] as usize];
        let [bending, twist, stretch] = self.kept(j);
        let k = T::splat(1.0) / (self.effective * self.effective);

        let (force, answer) = (lambda.linear, field.linear);
        let second = body.orientation.second_axis();
        let along = body.axis.dot(force) * body.axis.dot(answer);
        let across = force.dot(answer) - along;
        let further = second.dot(force) * second.dot(answer);
        let Vec3([x, y, z]) = zip(lambda.angular, rows.angular);

        // What a rate of damping does, over the square of what it leaves of compliances.
        let (strain, gap) = self.strain_at_start(j);
        let remembered = zip(strain, rows.angular).0;
        let extra = |list: &[T]| list.get(j).copied().unwrap_or(T::zero());
        let (bend_extra, shear_extra) = (extra(&self.extras.bend_extra), extra(&self.extras.shear_extra));
        let bent = constants.bend * (x + y) + bend_extra * y;
        let stretched = constants.stretch * along + constants.shear * across + shear_extra * further;
        let stretch_remembered = body.orientation.rotate(gap).dot(answer);
        let per = T::splat(1.0 / self.dt);
        let [rest_x, rest_y, rest_z] = rows.angular.0;
        let of_rest = self.rest_slope(j).apply(Vec3([rest_x * bending, rest_y * bending, rest_z * twist])).0;
        [
            of_rest[0],
            of_rest[1],
            of_rest[2],
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
    #[inline(always)]
    pub fn memory_back(&self, j: usize, field: Spatial<T>, bars: &mut [BodyBar<T>]) {
        if self.extras.damped.is_empty() {
            return;
        }
        let one = T::splat(1.0);
        let (system, terms) = (&self.system, &self.system.joints[j]);
        let [a, b] = system.topology.joints[j].map(|body| body as usize);
        let rows = self.without_free_rows(j, terms.multipliers_from_world(field, system.frame(j)));
        let [bending, twist, stretch] = self.kept(j);
        let (bending, twist, stretch) = (one - bending, one - twist, one - stretch);
        let [x, y, z] = rows.angular.0;
        let of_strain = Vec3([x * bending, y * bending, z * twist]) * (one / terms.length);
        let [of_a, of_b] = self.frames_at_start(j);
        let relative = (of_a.conj() * of_b).upper();
        let (rows, _) = RotationRows::new(self.strain_measure, relative);
        let turn = of_a.rotate(rows.forward_transposed(relative.v, of_strain));
        let shift = self.start[a].q.rotate(self.poses[a].q.rotate_back(field.linear)) * stretch;
        let (gap, arms) = self.gap_at_start(j);
        bars[a].pose = bars[a].pose.plus(Spatial { linear: shift, angular: (arms[0] - gap).cross(shift) - turn }, one);
        bars[b].pose = bars[b].pose.plus(Spatial { linear: -shift, angular: turn - arms[1].cross(shift) }, one);
    }

    /// What the strain at rest changes by with the Darboux vector there.
    fn rest_slope(&self, j: usize) -> Sym3<T> {
        let mut out = Sym3::<T>::zero();
        for lane in 0..T::LANES {
            let length = self.system.joints[j].length.lane(lane);
            let rest = pick(self.joints[j].darboux, lane).0.into();
            let slope = self.strain_measure.slope_at_rest(&rest, length);
            for (own, (r, c)) in out.0.iter_mut().zip([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]) {
                own.set_lane(lane, slope[(r, c)]);
            }
        }
        out
    }

    /// What inner damping leaves of the compliances of a step: of bending, twist and stretch.
    #[inline(always)]
    fn kept(&self, j: usize) -> [T; 3] {
        let one = T::splat(1.0);
        let Some(damped) = self.extras.damped.get(j) else { return [one; 3] };
        let kept = |time: T| one / (one + time / T::splat(self.dt));
        let [bending, twist, stretch] = damped.times;
        [kept(bending), kept(twist), kept(stretch)]
    }

    #[inline(always)]
    fn frames_at_start(&self, j: usize) -> [Quat<T>; 2] {
        let [a, b] = self.system.topology.joints[j];
        let (a, b) = (self.start[a as usize].q, self.start[b as usize].q);
        match self.extras.rests.get(j) {
            Some(rests) => [a * rests[0], b * rests[1]],
            None => [a, b],
        }
    }

    /// The gap of a joint at the start of the step, and its arms, in world axes.
    #[inline(always)]
    fn gap_at_start(&self, j: usize) -> (Vec3<T>, [Vec3<T>; 2]) {
        let [a, b] = self.system.topology.joints[j];
        let (a, b) = (&self.start[a as usize], &self.start[b as usize]);
        let offsets = self.system.joints[j].offsets;
        let mut arms = [a.q.axis() * offsets[0], b.q.axis() * offsets[1]];
        if let Some(across) = self.extras.across.get(j) {
            arms = [arms[0] + a.q.rotate(across[0]), arms[1] + b.q.rotate(across[1])];
        }
        (a.x - b.x + arms[0] - arms[1], arms)
    }

    /// Strains of a joint at the start of the step: of bend-twist beyond rest, and the gap in the frame of body a.
    #[inline(always)]
    fn strain_at_start(&self, j: usize) -> (Vec3<T>, Vec3<T>) {
        let [of_a, of_b] = self.frames_at_start(j);
        let a = self.system.topology.joints[j][0] as usize;
        let relative = (of_a.conj() * of_b).upper();
        let (_, measured) = RotationRows::new(self.strain_measure, relative);
        let strain = measured * (T::splat(1.0) / self.system.joints[j].length) - self.joints[j].rest;
        (strain, self.start[a].q.rotate_back(self.gap_at_start(j).0))
    }
}

/// Numbers of a joint from [`Component::joint_back`], added.
pub fn add_numbers(own: &mut JointVariation, by: &[f64; 12]) {
    let mut numbers = own.numbers();
    numbers.iter_mut().zip(by).for_each(|(own, by)| *own += by);
    *own = JointVariation::of_numbers(&numbers);
}

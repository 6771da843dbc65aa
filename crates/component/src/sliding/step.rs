//! What eyelets do in a step of a component.

use jointed::tangent::{Equations, curvature};
use kernels::Spatial;
use kernels::lane::Real;
use kernels::math::Vec3;
use rod::{Model, Share, Sliding, SlidingJoint};

use super::{Border, Eyelet, Eyelets, Slip, UNKNOWNS, feed};
use crate::parts::{pick_pose, vec3};
use crate::snapshot::StateVisitor;
use crate::{BodyPose, Component, Members};

/// A body on which the force of an eyelet acts: so many times, with such an arm [m].
struct Lever {
    body: usize,
    weight: f64,
    arm: Vec3<f64>,
}

impl Eyelets {
    /// The largest of their forces and of those of pulleys, times dt^2; 0 where there are none.
    pub(crate) fn largest_force(&self) -> f64 {
        let of_pulleys = self.pulleys.iter().map(|(pulley, _)| pulley.press[0].abs());
        let of_eyelets = self.all.iter().map(|eyelet| eyelet.force.norm_squared().sqrt());
        of_eyelets.chain(of_pulleys).fold(0.0, f64::max)
    }

    /// Adds what eyelets do to bodies to their impulses.
    #[inline(always)]
    pub(crate) fn push<T: Real>(&self, impulses: &mut [Spatial<T>]) {
        for (impulse, &own) in impulses.iter_mut().zip(&self.impulses) {
            *impulse = impulse.plus(Spatial::splat(own), T::splat(1.0));
        }
    }
}

impl<T: Real> Component<T> {
    /// Whether any rod slides, through eyelets or over pulleys.
    pub fn slides(&self) -> bool {
        !(self.eyelets.all.is_empty() && self.eyelets.pulleys.is_empty())
    }

    /// Whether an eyelet that slid has come to a stop in the step under way, by friction or at an end of its rod: an impact.
    pub fn eyelet_hits(&self) -> bool {
        let stops = |now: Slip, at_start: Slip| now == Slip::Sticks && at_start != Slip::Sticks;
        self.eyelets.all.iter().any(|eyelet| stops(eyelet.slip, eyelet.slip_at_start))
            || self.eyelets.pulleys.iter().any(|(_, slip)| stops(slip.now, slip.at_start))
    }

    /// Takes eyelets back to the start of the step.
    pub(crate) fn roll_back_eyelets(&mut self) {
        for eyelet in &mut self.eyelets.all {
            (eyelet.place, eyelet.slip) = (eyelet.start, eyelet.slip_at_start);
        }
        self.roll_back_pulleys();
    }

    /// Leaves eyelets where they are at the start of a step that has no solution, with the forces of the one before.
    pub(crate) fn rest_eyelets(&mut self) {
        let effective = self.effective.lane(0);
        for eyelet in &mut self.eyelets.all {
            (eyelet.target, eyelet.force) = (eyelet.start, eyelet.last_force * (effective * effective));
        }
    }

    /// Ends a step that is accepted.
    pub(crate) fn end_eyelets(&mut self) {
        let (per_dt, effective) = (1.0 / self.dt, self.effective.lane(0));
        for eyelet in &mut self.eyelets.all {
            if eyelet.slip == Slip::Sticks {
                // Rounding must not take it off an end of its rod.
                eyelet.place = eyelet.target;
            }
            eyelet.rate = (eyelet.place - eyelet.start) * per_dt;
            eyelet.last_force = eyelet.force * (1.0 / (effective * effective));
        }
        self.end_pulleys();
    }

    /// Shows a visitor what the next step begins with.
    pub(crate) fn visit_eyelets(&mut self, visitor: &mut StateVisitor<'_>) {
        visitor.list(&mut self.eyelets.all, |visitor, eyelet| {
            visitor.number(&mut eyelet.place);
            visitor.number(&mut eyelet.rate);
            visitor.vector(&mut eyelet.last_force);
            let mut sign = match eyelet.slip {
                Slip::Sticks => 0.0,
                Slip::Slides(sign) => sign,
            };
            visitor.number(&mut sign);
            if let Some(set) = Self::set_speed(eyelet) {
                let mut speed = set.unwrap_or(f64::NAN);
                visitor.number(&mut speed);
                *set = Some(speed).filter(|speed| !speed.is_nan());
            }
            eyelet.slip = if sign == 0.0 { Slip::Sticks } else { Slip::Slides(sign) };
        });
        self.visit_pulleys(visitor);
    }

    /// Where the eyelets of the model are that these bodies slide in, and what they do.
    pub fn each_sliding(&self, mut see: impl FnMut(usize, Sliding)) {
        for eyelet in &self.eyelets.all {
            let force = eyelet.last_force.0.into();
            see(eyelet.index, Sliding { place: eyelet.place, rate: eyelet.rate, force });
        }
    }
}

impl<T: Real> Component<T> {
    /// The pose of a body. Rods that slide are not in lanes.
    #[inline(always)]
    fn pose_of(&self, body: usize) -> BodyPose<f64> {
        pick_pose(&self.poses[body], 0)
    }

    /// Where an eyelet is.
    fn eyelet_at(&self, k: usize) -> Vec3<f64> {
        let eyelet = &self.eyelets.all[k];
        let pose = self.pose_of(eyelet.holder);
        pose.x + pose.q.rotate(eyelet.at)
    }

    /// The point of an eyelet's rod at this distance, or its first or second derivative.
    fn point(&self, k: usize, place: f64, order: usize) -> Vec3<f64> {
        let eyelet = &self.eyelets.all[k];
        let share = |Share { segment, position, axis }: Share| {
            let pose = self.pose_of(eyelet.first + segment);
            pose.x * position[order] + pose.q.axis() * axis[order]
        };
        let [a, b] = eyelet.line.at(place).map(share);
        a + b
    }

    /// How the force of an eyelet acts on the bodies of its rod and on its holder, and how that changes with its place (`order` 1).
    fn levers(&self, k: usize, order: usize) -> [Lever; 3] {
        let eyelet = &self.eyelets.all[k];
        let [a, b] = eyelet.line.at(eyelet.place).map(|Share { segment, position, axis }| {
            let body = eyelet.first + segment;
            Lever { body, weight: position[order], arm: self.pose_of(body).q.axis() * axis[order] }
        });
        let (weight, arm) = match order {
            0 => (-1.0, -self.pose_of(eyelet.holder).q.rotate(eyelet.at)),
            _ => (0.0, Vec3::zero()),
        };
        [a, b, Lever { body: eyelet.holder, weight, arm }]
    }

    /// Begins an attempt at a step whose prediction is made: forces are those of the step before. `is_guessed`: so are multipliers, and eyelets go
    /// on along their rods.
    ///
    /// The angle theta by which the rod turns from a segment before the eyelet to one behind it says how much of the normal force is friction
    /// at most: as a rod of tensions `T exp(mu theta)` and T on a round edge presses and pulls it, `mu tanh(mu theta / 2) / (mu tan(theta / 2))`.
    pub fn begin_sliding(&mut self, is_guessed: bool) {
        let effective = self.effective.lane(0);
        let time = self.time;
        for k in 0..self.eyelets.all.len() {
            let (length, segment) = (self.eyelets.all[k].line.length(), self.segment_length(k));
            let place = self.eyelets.all[k].place;
            let ends = [place - segment, place + segment].map(|place| place.clamp(0.0, length));
            let [a, b] = ends.map(|place| self.point(k, place, 1));
            let cosine = a.dot(b) / (a.norm_squared() * b.norm_squared()).sqrt();
            let (dt, eyelet) = (self.dt, &mut self.eyelets.all[k]);
            let turn = cosine.clamp(-1.0, 1.0).acos();
            let mu = eyelet.friction;
            let slope = if turn > 1e-4 { (0.5 * mu * turn).tanh() / (0.5 * turn).tan() } else { mu };
            eyelet.share = slope / (1.0 + slope * slope).sqrt();
            eyelet.carried = eyelet.carried(time, dt);
            (eyelet.start, eyelet.slip_at_start, eyelet.target) = (place, eyelet.slip, eyelet.carried);
            eyelet.force = eyelet.last_force * (effective * effective);
            eyelet.place = match eyelet.slip {
                Slip::Slides(_) if is_guessed => (place + eyelet.rate * dt).clamp(eyelet.range[0], eyelet.range[1]),
                Slip::Slides(_) => place,
                Slip::Sticks => eyelet.carried,
            };
        }
        self.begin_pulleys();
        self.gather_eyelets();
    }

    /// The length of the segment at an eyelet [m].
    fn segment_length(&self, k: usize) -> f64 {
        let eyelet = &self.eyelets.all[k];
        self.bodies[eyelet.first + eyelet.line.at(eyelet.place)[0].segment].length.lane(0)
    }

    /// Sums up what eyelets do to bodies, where poses, forces and places are now.
    pub fn gather_eyelets(&mut self) {
        self.eyelets.impulses.fill(Spatial::zero());
        for k in 0..self.eyelets.all.len() {
            let force = self.eyelets.all[k].force;
            for Lever { body, weight, arm } in self.levers(k, 0) {
                let own = Spatial { linear: force * weight, angular: arm.cross(force) };
                self.eyelets.impulses[body] = self.eyelets.impulses[body].plus(own, 1.0);
            }
        }
        self.gather_pulleys();
    }

    /// How far eyelets are from their rods at most, in lengths of the segments there.
    pub fn eyelet_gap(&self) -> f64 {
        let gap = |k: usize| {
            let missed = self.eyelet_at(k) - self.point(k, self.eyelets.all[k].place, 0);
            missed.norm_squared().sqrt() / self.segment_length(k)
        };
        (0..self.eyelets.all.len()).map(gap).fold(self.pulley_gap(), f64::max)
    }
}

impl Component<f64> {
    /// Adds the model's sliding joints of these members, each where it is nearest to its eyelet.
    pub fn add_eyelets_of(&mut self, model: &Model, members: &Members) {
        for (index, joint) in model.sliding_joints.iter().enumerate() {
            let body = members.body(rod::Body::Segment(joint.segments.start));
            let (Some(first), Some(holder)) = (body, members.body(joint.holder)) else { continue };
            let SlidingJoint { place, start, friction, .. } = joint;
            let drive = joint.feed.as_ref().map(|feed| feed::Drive::new(feed, self.chain(first, joint.segments.len())));
            let mut eyelet = Eyelet {
                index,
                first,
                line: joint.centreline(model),
                holder,
                at: Vec3(vec3(place)),
                friction: *friction,
                drive,
                range: joint.range(model),
                share: 0.0,
                place: *start,
                start: *start,
                rate: 0.0,
                slip: Slip::Sticks,
                slip_at_start: Slip::Sticks,
                force: Vec3::zero(),
                last_force: Vec3::zero(),
                target: *start,
                carried: *start,
                change: (Vec3::zero(), 0.0),
            };
            if !eyelet.grips() {
                eyelet.slip = Slip::Slides(1.0);
            }
            self.eyelets.all.push(eyelet);
        }
        self.add_pulleys_of(model, members);
        self.eyelets.impulses.resize(if self.slides() { self.poses.len() } else { 0 }, Spatial::zero());
        self.find_places();
    }

    /// Puts eyelets to where along their rods these are nearest to them, if not where they began: a run may go on from poses alone.
    fn find_places(&mut self) {
        for k in 0..self.eyelets.all.len() {
            let (eyelet, at) = (&self.eyelets.all[k], self.eyelet_at(k));
            let miss = |place: f64| (self.point(k, place, 0) - at).norm_squared();
            let (length, steps) = (eyelet.line.length(), 64);
            let mut best = eyelet.place;
            for step in 0..=steps {
                let place = length * f64::from(step) / f64::from(steps);
                best = if miss(place) < miss(best) { place } else { best };
            }
            // Halving about the best of a grid: as exact as numbers are.
            let mut reach = length / f64::from(steps);
            while reach > 1e-15 * length {
                let next = [best - reach, best + reach].map(|place| place.clamp(0.0, length));
                match next.into_iter().find(|&place| miss(place) < miss(best)) {
                    Some(place) => best = place,
                    None => reach *= 0.5,
                }
            }
            self.eyelets.all[k].place = best;
        }
    }

    /// Adds to the equations how forces of eyelets change as bodies turn.
    pub fn add_eyelets_curvature(&self, equations: &mut Equations<f64>) {
        let bodies = &mut equations.bodies;
        for k in 0..self.eyelets.all.len() {
            for Lever { body, arm, .. } in self.levers(k, 0) {
                bodies[body].turning += curvature::of_force(self.eyelets.all[k].force, arm);
            }
        }
        self.add_pulleys_curvature(equations);
    }

    /// The border of an eyelet, or of a pulley: these come after the eyelets.
    pub fn border(&self, k: usize, out: &mut Border) {
        match k.checked_sub(self.eyelets.all.len()) {
            None => self.eyelet_border(k, out),
            Some(pulley) => self.pulley_border(pulley, out),
        }
    }

    fn eyelet_border(&self, k: usize, out: &mut Border) {
        let eyelet = &self.eyelets.all[k];
        let (force, place) = (eyelet.force, eyelet.place);
        let [point, tangent, second] = [0, 1, 2].map(|order| self.point(k, place, order));
        let missed = self.eyelet_at(k) - point;
        let (size, speed) = (force.norm_squared().sqrt(), tangent.norm_squared().sqrt());
        let unit = if size > 0.0 { force * (1.0 / size) } else { Vec3::zero() };
        let sign = if let Slip::Slides(sign) = eyelet.slip { sign } else { 0.0 };
        let sticks = eyelet.slip == Slip::Sticks;
        // c'.F - |c'| (friction |F| + drive), by what it changes with F and with c'.
        let friction = sign * eyelet.share;
        let driven = if sticks { 0.0 } else { sign * self.most_of_drive(eyelet) };
        let by_force = tangent - unit * (friction * speed);
        let by_tangent = force - tangent * ((friction * size + driven) / speed);
        out.begin(UNKNOWNS);
        let levers = self.levers(k, 0).into_iter().zip(self.levers(k, 1));
        let [mut columns, mut rows] = [[[Spatial::zero(); 3]; UNKNOWNS]; 2];
        for (lever, changes) in levers.filter(|(lever, _)| self.bodies[lever.body].free.lane(0) != 0.0) {
            let act = |Lever { weight, arm, .. }: &Lever, f: Vec3<f64>| Spatial {
                linear: f * *weight,
                angular: arm.cross(f),
            };
            let at = out.bodies.len();
            for c in 0..3 {
                let mut along = Vec3::zero();
                along.0[c] = 1.0;
                columns[c][at] = act(&lever, along);
                rows[c][at] = columns[c][at];
            }
            columns[3][at] = act(&changes, force);
            rows[3][at] = if sticks { Spatial::zero() } else { act(&changes, by_tangent) };
            out.bodies.push(lever.body);
        }
        let count = out.bodies.len();
        columns.iter().for_each(|column| out.columns.extend_from_slice(&column[..count]));
        rows.iter().for_each(|row| out.rows.extend_from_slice(&row[..count]));
        for c in 0..3 {
            out.own[UNKNOWNS * c + 3] = tangent.0[c];
            out.own[UNKNOWNS * 3 + c] = if sticks { 0.0 } else { by_force.0[c] };
            (out.seen[UNKNOWNS * c + 3], out.seen[UNKNOWNS * 3 + c]) = (tangent.0[c], tangent.0[c]);
            out.missed[c] = missed.0[c];
        }
        out.seen[UNKNOWNS * 3 + 3] = force.dot(second);
        out.own[UNKNOWNS * 3 + 3] = if sticks { 1.0 } else { by_tangent.dot(second) };
        let along = (friction * size + driven) * speed - tangent.dot(force);
        out.missed[3] = if sticks { eyelet.target - place } else { along };
    }

    /// The largest force of an eyelet's drive along the rod, times dt^2; 0 without a drive.
    fn most_of_drive(&self, eyelet: &Eyelet) -> f64 {
        eyelet.drive.as_ref().map_or(0.0, |drive| drive.feed.max_force * self.effective * self.effective)
    }

    /// How many eyelets and pulleys there are.
    pub fn border_count(&self) -> usize {
        self.eyelets.all.len() + self.eyelets.pulleys.len()
    }

    /// Takes the solution of the border: changes of the force and the place of each eyelet, and of the forces of pulleys.
    pub fn take_eyelets_solution(&mut self, solution: &[f64]) {
        for (eyelet, new) in self.eyelets.all.iter_mut().zip(solution.chunks_exact(UNKNOWNS)) {
            eyelet.change = (Vec3([new[0], new[1], new[2]]), new[3]);
        }
        self.take_pulleys_solution(&solution[UNKNOWNS * self.eyelets.all.len()..]);
    }

    /// Takes the forces of the last solution, and leaves places where they are.
    pub fn take_eyelets_forces(&mut self) {
        for eyelet in &mut self.eyelets.all {
            let (force, _) = eyelet.change;
            eyelet.force += force;
        }
        self.move_pulleys(1.0);
        self.gather_eyelets();
    }

    /// Adds a share of the last solution; places stay on their rods.
    pub fn move_eyelets(&mut self, share: f64) {
        for eyelet in &mut self.eyelets.all {
            let (force, place) = eyelet.change;
            eyelet.force += force * share;
            eyelet.place += place * share;
        }
        self.move_pulleys(share);
        self.gather_eyelets();
    }

    /// How far the last solution moves eyelets along their rods at most, in lengths of the segments there.
    pub fn eyelet_correction(&self) -> f64 {
        let moved = |k: usize| self.eyelets.all[k].change.1.abs() / self.segment_length(k);
        (0..self.eyelets.all.len()).map(moved).fold(0.0, f64::max)
    }

    /// Lets eyelets stick or slide by their forces and by where they went; returns whether any changes. What would leave its rod sticks to
    /// the end of it; what slides the other way than its friction says sticks to where it was.
    pub fn choose_slip(&mut self) -> bool {
        let mut changes = self.choose_on_pulleys();
        for k in 0..self.eyelets.all.len() {
            let tangent = self.point(k, self.eyelets.all[k].place, 1);
            let driven = self.most_of_drive(&self.eyelets.all[k]);
            let eyelet = &mut self.eyelets.all[k];
            let [low, high] = eyelet.range;
            let along = tangent.dot(eyelet.force) / tangent.norm_squared().sqrt();
            let most = eyelet.share * eyelet.force.norm_squared().sqrt() + driven;
            let before = (eyelet.slip, eyelet.target);
            match eyelet.slip {
                Slip::Slides(sign) => {
                    let rounding = 1e-12 * eyelet.line.length();
                    if eyelet.place < low || eyelet.place > high {
                        (eyelet.slip, eyelet.target) = (Slip::Sticks, eyelet.place.clamp(low, high));
                    } else if eyelet.grips() && sign * (eyelet.place - eyelet.carried) < -rounding {
                        (eyelet.slip, eyelet.target) = (Slip::Sticks, eyelet.carried);
                    }
                }
                Slip::Sticks => {
                    let [is_first, is_last] = [eyelet.target <= low, eyelet.target >= high];
                    let excess = along.abs() - most * (1.0 + 1e-9);
                    let is_pushed_in = !(is_first && along < 0.0 || is_last && along > 0.0);
                    if excess > 0.0 && is_pushed_in {
                        eyelet.slip = Slip::Slides(along.signum());
                    }
                }
            }
            changes |= before != (eyelet.slip, eyelet.target);
        }
        changes
    }
}

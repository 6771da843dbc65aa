//! What pulleys do in a step of a component.

use jointed::tangent::{BodyRow, Equations, curvature};
use kernels::Spatial;
use kernels::lane::Real;
use kernels::math::Vec3;
use rod::{Model, OnPulley, Wheel};

use super::pulley::{Groove, OnWheel, Pulley, Seat, SeatEnd, Shares, Track, eased, modes_of, spread};
use super::{Border, Slip, SlipOfPulley};
use crate::parts::{pick_pose, vec3};
use crate::snapshot::StateVisitor;
use crate::{BodyPose, Component, Members};

impl Pulley {
    /// Whether its wheel passes force along the rod.
    fn grips(&self) -> bool {
        self.wheel != Wheel::Free
    }

    /// Whether no segment is on the wheel: the rod's end has left it.
    fn is_empty(&self) -> bool {
        self.seats.iter().all(|seat| seat.weights[0] == 0.0)
    }

    /// Number of its unknowns.
    fn unknowns(&self) -> usize {
        self.modes + usize::from(self.grips())
    }

    /// The force on the segment of a seat away from the axle, the sum of the unknown shares.
    fn load(&self, seat: &Seat) -> f64 {
        self.press.iter().zip(&seat.weights).take(self.modes).map(|(press, weight)| press * weight).sum()
    }

    /// The sum of the tensions that the force away from the axle says, over the wrapped angle: what friction is a share of.
    fn tensions(&self) -> f64 {
        self.seats.iter().map(|seat| self.load(seat) * self.rod[seat.segment].tension).sum()
    }

    /// What a unit of a share of the force does to the segment of a seat.
    fn push(seat: &Seat, mode: usize) -> Vec3<f64> {
        seat.normal * seat.weights[mode] + seat.tangent * (seat.gap / seat.arm * seat.slopes[mode])
    }

    /// What a unit of the force along the rod does to it.
    fn pull(&self, seat: &Seat) -> Vec3<f64> {
        seat.tangent * (seat.grip * self.radius / seat.arm)
    }

    /// The average of the gaps with the weights of a mode.
    fn gap(&self, mode: usize) -> f64 {
        self.seats.iter().map(|seat| seat.weights[mode] * seat.gap).sum()
    }
}

impl<T: Real> Component<T> {
    fn body_at(&self, poses: &[BodyPose<T>], body: usize) -> BodyPose<f64> {
        pick_pose(&poses[body], 0)
    }

    /// The groove of a pulley with its holder in a pose.
    fn groove(pulley: &Pulley, holder: BodyPose<f64>) -> Groove {
        let (middle, axis) = (holder.x + holder.q.rotate(pulley.at), holder.q.rotate(pulley.axis));
        Groove::new(middle, axis, pulley.track.reference, pulley.sense)
    }

    /// By how much a pulley's holder has turned about the axle in the step under way, in the rod's sense [rad], and the axle.
    fn spin(&self, pulley: &Pulley) -> (f64, Vec3<f64>) {
        let [start, now] = [&self.start, &self.poses].map(|poses| self.body_at(poses, pulley.holder).q);
        let axis = now.rotate(pulley.axis) * pulley.sense;
        let turn = (now * start.conj()).upper();
        (2.0 * turn.v.dot(axis).atan2(turn.w), axis)
    }

    /// Finds the segments on a pulley at such poses.
    fn find_seats(&self, pulley: &Pulley, poses: &[BodyPose<T>], seats: &mut Vec<Seat>) {
        let groove = Self::groove(pulley, self.body_at(poses, pulley.holder));
        let pose = |segment: usize| self.body_at(poses, pulley.first + segment);
        pulley.seat(&groove, pulley.arc, |segment| pose(segment).x, seats);
        let place = |segment: usize| {
            let BodyPose { x, q } = pose(segment);
            (x, q.axis())
        };
        pulley.seat_ends(&groove, pulley.arc, place, seats);
    }

    /// Finds the segments on a pulley now.
    fn seat(&self, pulley: &mut Pulley) {
        let mut seats = std::mem::take(&mut pulley.seats);
        self.find_seats(pulley, &self.poses, &mut seats);
        for seat in &mut seats {
            let old = pulley.start.iter().find(|old| old.segment == seat.segment);
            (seat.grip, seat.end.rise) = old.map_or((0.0, 0.0), |old| (old.grip, seat.end.gap - old.end.gap));
        }
        pulley.seats = seats;
    }

    /// By how much the rod has gone along the rim in the step under way, in the weights of the step [m].
    fn passed(&self, pulley: &Pulley) -> f64 {
        let moved = |seat: &Seat| {
            let old = pulley.start.iter().find(|old| old.segment == seat.segment);
            old.map_or(0.0, |old| seat.grip * (seat.angle - old.angle))
        };
        pulley.radius * pulley.seats.iter().map(moved).sum::<f64>()
    }

    /// What the wheel would have the rod go along its rim in the step under way [m]: with the holder and the drive.
    fn carried(&self, pulley: &Pulley) -> f64 {
        let (spin, _) = self.spin(pulley);
        let driven = pulley.wheel.rate(self.time + 0.5 * self.dt).map_or(0.0, |rate| rate * self.dt);
        pulley.radius * (spin + driven)
    }

    /// The largest force along the rod that friction bears and that the drive gives, times dt^2.
    fn largest(&self, pulley: &Pulley) -> [f64; 2] {
        let effective = self.effective.lane(0);
        let drive = match &pulley.wheel {
            Wheel::Driven { max_torque, .. } => max_torque / pulley.radius * effective * effective,
            _ => f64::INFINITY,
        };
        [pulley.wheel.friction() * pulley.tensions().max(0.0), drive]
    }

    /// Begins an attempt at a step of pulleys.
    pub(crate) fn begin_pulleys(&mut self) {
        let per_newton = self.effective.lane(0) * self.effective.lane(0);
        let mut pulleys = std::mem::take(&mut self.eyelets.pulleys);
        for (pulley, slip) in &mut pulleys {
            slip.at_start = slip.now;
            let track = pulley.track;
            pulley.arc = spread(track.arc);
            pulley.modes = track.modes;
            pulley.held = eased(track.held, self.dt);
            pulley.press = track.press.map(|press| press * per_newton);
            pulley.along = track.along * per_newton;
            let mut start = std::mem::take(&mut pulley.start);
            self.find_seats(pulley, &self.start, &mut start);
            let sum: f64 = start.iter().map(|seat| seat.weights[0]).sum();
            start.iter_mut().for_each(|seat| seat.grip = if sum > 0.0 { seat.weights[0] / sum } else { 0.0 });
            pulley.start = start;
        }
        self.eyelets.pulleys = pulleys;
    }

    /// Adds what pulleys do to bodies to the impulses, where poses and forces are now.
    pub(super) fn gather_pulleys(&mut self) {
        let per_newton = self.effective.lane(0) * self.effective.lane(0);
        let mut pulleys = std::mem::take(&mut self.eyelets.pulleys);
        for (pulley, _) in &mut pulleys {
            self.seat(pulley);
            pulley.force = Vec3::zero();
            let holder = self.body_at(&self.poses, pulley.holder);
            let groove = Self::groove(pulley, holder);
            let arm = groove.middle - holder.x;
            let mut reaction = Spatial::zero();
            for seat in &pulley.seats {
                let mut force = Vec3::zero();
                for (mode, &press) in pulley.press.iter().enumerate().take(pulley.modes) {
                    force += Pulley::push(seat, mode) * press;
                }
                force += pulley.pull(seat) * pulley.along;
                let damping = seat.end.normal * (-seat.end.rise * self.end_damping(pulley, seat) * per_newton);
                let across = groove.axis * (-seat.across * Self::across_stiffness(pulley, seat) * per_newton);
                let body = pulley.first + seat.segment;
                self.eyelets.impulses[body].linear += force + across + damping;
                self.eyelets.impulses[body].angular += seat.end.arm.cross(damping);
                force += damping;
                reaction.linear -= force + across;
                // Across the groove it acts at the rim, all else at the axle.
                reaction.angular -= (seat.normal * seat.arm).cross(across);
                pulley.force += force + across;
            }
            reaction.angular += arm.cross(reaction.linear);
            if pulley.grips() {
                reaction.angular -= groove.axis * (pulley.sense * pulley.radius * pulley.along);
            }
            let own = &mut self.eyelets.impulses[pulley.holder];
            *own = own.plus(reaction, 1.0);
        }
        self.eyelets.pulleys = pulleys;
    }

    /// The stiffness of the groove across it, of a seat [N/m].
    fn across_stiffness(pulley: &Pulley, seat: &Seat) -> f64 {
        seat.share * pulley.rod[seat.segment].across
    }

    /// The damping of the groove at the end of a seat's segment, towards the axle and away from it, over the length of the step under way [N/m]: 1e-4 s of
    /// the stiffness of the rod's material to stretch. A joint that runs on along the groove is not damped, but a rod that goes slack keeps its
    /// shape: without it a light rope whose weights jerk flutters on the wheel. At twice this a block and tackle is 1 % off its acceleration, at this 0.7 %.
    fn end_damping(&self, pulley: &Pulley, seat: &Seat) -> f64 {
        seat.end.share * pulley.rod[seat.segment].across * 1e-4 / self.dt
    }

    /// Ends a step that is accepted.
    pub(super) fn end_pulleys(&mut self) {
        let per_dt = 1.0 / self.dt;
        let per_newton = 1.0 / (self.effective.lane(0) * self.effective.lane(0));
        let mut pulleys = std::mem::take(&mut self.eyelets.pulleys);
        for (pulley, _) in &mut pulleys {
            let passed = self.passed(pulley) / pulley.radius;
            let tensions = pulley.tensions();
            let groove = Self::groove(pulley, self.body_at(&self.poses, pulley.holder));
            let (arc, (middle, angle)) = self.find_arc(pulley, &groove, (pulley.arc, f64::INFINITY));
            let old = pulley.track;
            let friction = pulley.wheel.friction();
            let lean = if tensions > 0.0 { (pulley.along / tensions).clamp(-friction, friction) } else { 0.0 };
            let modes = modes_of(arc[1] - arc[0], pulley.modes).min(pulley.modes + 1);
            let mut held = pulley.held;
            if modes > pulley.modes {
                (held[0][pulley.modes], held[1][pulley.modes]) = (pulley.gap(pulley.modes), 0.0);
            }
            pulley.track = Track {
                reference: groove.first(),
                is_off: pulley.is_empty(),
                middle,
                angle,
                arc,
                modes,
                turned: old.turned + passed,
                rate: passed * per_dt,
                lean,
                press: pulley.press.map(|press| press * per_newton),
                along: pulley.along * per_newton,
                held,
                force: pulley.force * per_newton,
            };
        }
        self.eyelets.pulleys = pulleys;
    }

    /// Where the rod runs on and off a pulley now.
    fn find_arc(&self, pulley: &Pulley, groove: &Groove, arc: ([f64; 2], f64)) -> ([f64; 2], (usize, f64)) {
        let pose = |segment: usize| self.body_at(&self.poses, pulley.first + segment);
        let (ends, middle) = pulley.find_ends(groove, arc, |segment| pose(segment).x);
        (Pulley::arc_of(groove, &ends, |segment| pose(segment).q.axis(), arc.0), middle)
    }

    /// Takes pulleys back to the start of the step.
    pub(super) fn roll_back_pulleys(&mut self) {
        self.eyelets.pulleys.iter_mut().for_each(|(_, slip)| slip.now = slip.at_start);
    }

    /// Shows a visitor what the next step of pulleys begins with.
    pub(super) fn visit_pulleys(&mut self, visitor: &mut StateVisitor<'_>) {
        visitor.list(&mut self.eyelets.pulleys, |visitor, (pulley, slip)| {
            let Track { is_off, reference, middle, angle, arc, modes, turned, rate, lean, press, along, held, force } =
                &mut pulley.track;
            let mut off = f64::from(u8::from(*is_off));
            visitor.number(&mut off);
            *is_off = off != 0.0;
            visitor.vector(reference);
            visitor.count(middle);
            visitor.count(modes);
            visitor.vector(force);
            let numbers = [angle, turned, rate, lean, along];
            numbers
                .into_iter()
                .chain(arc)
                .chain(press)
                .chain(held.iter_mut().flatten())
                .for_each(|number| visitor.number(number));
            visitor.number(&mut pulley.sense);
            let mut sign = if let Slip::Slides(sign) = slip.now { sign } else { 0.0 };
            visitor.number(&mut sign);
            slip.now = if sign == 0.0 { Slip::Sticks } else { Slip::Slides(sign) };
        });
    }

    /// Where rods are on the pulleys of the model, and what these do.
    pub fn each_pulley(&self, mut see: impl FnMut(usize, OnPulley)) {
        for (pulley, _) in &self.eyelets.pulleys {
            let Track { is_off, arc, turned, rate, along, force, .. } = pulley.track;
            let wrap = if is_off { 0.0 } else { (arc[1] - arc[0]).max(0.0) };
            let torque = along * pulley.radius;
            see(pulley.index, OnPulley { wrap, turned, rate, force: force.0.into(), torque });
        }
    }

    /// How far rods are from their pulleys at most, in lengths of segments.
    pub(super) fn pulley_gap(&self) -> f64 {
        let gap = |(pulley, _): &(Pulley, _)| {
            let sum: f64 = pulley.seats.iter().map(|seat| seat.weights[0]).sum();
            let length = pulley.longest * pulley.radius;
            if sum <= 0.0 { 0.0 } else { (pulley.gap(0) - pulley.held[0][0]).abs() / (sum * length) }
        };
        self.eyelets.pulleys.iter().map(gap).fold(0.0, f64::max)
    }
}

impl Component<f64> {
    /// Adds the model's pulleys of these members, each where the rod is nearest to its wheel.
    pub(super) fn add_pulleys_of(&mut self, model: &Model, members: &Members) {
        for (index, own) in model.pulleys.iter().enumerate() {
            let body = members.body(rod::Body::Segment(own.segments.start));
            let (Some(first), Some(holder)) = (body, members.body(own.holder)) else { continue };
            // The groove is as stiff across as the rod's material along it.
            let is_own = |body: rod::Body| matches!(body, rod::Body::Segment(i) if own.segments.contains(&i));
            let joints = model.joints.iter().filter(|joint| is_own(joint.a) && is_own(joint.b));
            let stiffness = |joint: &rod::Joint| {
                let rod::Body::Segment(i) = joint.a else { return 0.0 };
                let area = std::f64::consts::PI * model.segments[i].radius.powi(2);
                (joint.youngs_modulus * area / model.segments[i].length).min(1.0 / joint.stretch_compliance)
            };
            let across = joints.map(stiffness).fold(0.0, f64::max);
            let lengths = || model.segments[own.segments.clone()].iter().map(|segment| segment.length);
            let mut pulley = Pulley {
                index,
                first,
                rod: lengths().map(|length| OnWheel::new(length, own.radius, across)).collect(),
                longest: lengths().fold(0.0, f64::max) / own.radius,
                holder,
                at: Vec3(vec3(&own.centre)),
                axis: Vec3(vec3(&own.axis)),
                radius: own.radius,
                wheel: own.wheel.clone(),
                sense: 1.0,
                track: Track {
                    is_off: false,
                    reference: Vec3::zero(),
                    middle: 0,
                    angle: 0.0,
                    arc: [0.0; 2],
                    modes: 1,
                    turned: 0.0,
                    rate: 0.0,
                    lean: 0.0,
                    press: Shares::default(),
                    along: 0.0,
                    held: Default::default(),
                    force: Vec3::zero(),
                },
                arc: [0.0; 2],
                modes: 1,
                press: Shares::default(),
                along: 0.0,
                change: Default::default(),
                held: Default::default(),
                force: Vec3::zero(),
                start: Vec::with_capacity(own.segments.len()),
                seats: Vec::with_capacity(own.segments.len()),
            };
            self.find_wrap(&mut pulley);
            let slip = SlipOfPulley { now: Slip::Sticks, at_start: Slip::Sticks };
            self.eyelets.pulleys.push((pulley, slip));
        }
    }

    /// Finds where a rod is on its wheel from poses alone.
    fn find_wrap(&self, pulley: &mut Pulley) {
        let holder = self.body_at(&self.poses, pulley.holder);
        let (middle, axis) = (holder.x + holder.q.rotate(pulley.at), holder.q.rotate(pulley.axis));
        let offset = |segment: usize| {
            let offset = self.body_at(&self.poses, pulley.first + segment).x - middle;
            offset - axis * axis.dot(offset)
        };
        let aside = |segment: usize| axis.dot(self.body_at(&self.poses, pulley.first + segment).x - middle);
        let off =
            |segment: usize| (offset(segment).norm_squared().sqrt() - pulley.rod[segment].rim).hypot(aside(segment));
        let nearest = (0..pulley.rod.len()).min_by(|&a, &b| off(a).total_cmp(&off(b))).unwrap_or(0);
        // The middle of all that is as near as drawn corners of segments are.
        pulley.track.is_off = off(nearest) > pulley.longest * pulley.radius;
        let is_near = |&segment: &usize| off(segment) < 0.5 * pulley.longest * pulley.radius;
        let last = (nearest..pulley.rod.len()).take_while(is_near).last().unwrap_or(nearest);
        let first = (0..=nearest).rev().take_while(is_near).last().unwrap_or(nearest);
        let on = (first + last) / 2;
        let along = self.body_at(&self.poses, pulley.first + on).q.axis();
        pulley.sense = if axis.cross(offset(on)).dot(along) < 0.0 { -1.0 } else { 1.0 };
        pulley.track.reference = offset(on);
        (pulley.track.middle, pulley.track.angle) = (on, 0.0);
        let groove = Self::groove(pulley, holder);
        let mut arc = spread([0.0; 2]);
        // From a point on, in small steps around the wheel, and then as from step to step.
        for most in [0.5, f64::INFINITY] {
            for _ in 0..1000 {
                let (found, _) = self.find_arc(pulley, &groove, (arc, most));
                let change = (found[0] - arc[0]).abs().max((found[1] - arc[1]).abs());
                arc = spread(found);
                if change < 1e-12 {
                    break;
                }
            }
        }
        let (_, (middle, angle)) = self.find_arc(pulley, &groove, (arc, f64::INFINITY));
        let track = &mut pulley.track;
        (track.arc, track.middle, track.angle) = (arc, middle, angle);
        track.reference = groove.first();
        track.modes = modes_of(arc[1] - arc[0], 0);
        (pulley.arc, pulley.modes) = (spread(arc), track.modes);
        self.seat(pulley);
        (0..pulley.modes).for_each(|mode| pulley.track.held[0][mode] = pulley.gap(mode));
    }

    /// Adds to the equations how forces of pulleys change as bodies move.
    pub(super) fn add_pulleys_curvature(&self, Equations { bodies, rows, .. }: &mut Equations<f64>) {
        let per_newton = self.effective * self.effective;
        for (pulley, _) in &self.eyelets.pulleys {
            let holder = self.body_at(&self.poses, pulley.holder);
            let groove = Self::groove(pulley, holder);
            bodies[pulley.holder].turning += curvature::of_force(pulley.force, holder.x - groove.middle);
            for seat in &pulley.seats {
                let body = (pulley.first + seat.segment) as u32;
                let mut add = |[x, y, z]: [f64; 3], [u, v, w]: [f64; 3], stiffness: f64| {
                    rows.push(BodyRow { body, row: [x, y, z, u, v, w], stiffness: stiffness * per_newton });
                };
                add(groove.axis.0, [0.0; 3], Self::across_stiffness(pulley, seat));
                let SeatEnd { normal, arm, .. } = seat.end;
                add(normal.0, arm.cross(normal).0, self.end_damping(pulley, seat));
            }
        }
        rows.sort_unstable_by_key(|row| row.body);
    }

    /// The border of a pulley.
    pub(super) fn pulley_border(&self, k: usize, out: &mut Border) {
        let (pulley, slip) = &self.eyelets.pulleys[k];
        let (modes, unknowns) = (pulley.modes, pulley.unknowns());
        out.begin(unknowns);
        let is_free = |body: usize| self.bodies[body].free != 0.0;
        let seats = || pulley.seats.iter().filter(|seat| is_free(pulley.first + seat.segment));
        out.bodies.extend(seats().map(|seat| pulley.first + seat.segment));
        let holder = self.body_at(&self.poses, pulley.holder);
        let groove = Self::groove(pulley, holder);
        if is_free(pulley.holder) {
            out.bodies.push(pulley.holder);
        }
        let arm = groove.middle - holder.x;
        for unknown in 0..unknowns {
            let force = |seat: &Seat| if unknown < modes { Pulley::push(seat, unknown) } else { pulley.pull(seat) };
            out.columns.extend(seats().map(|seat| Spatial { linear: force(seat), angular: Vec3::zero() }));
            if is_free(pulley.holder) {
                let mut sum = Vec3::zero();
                pulley.seats.iter().for_each(|seat| sum += force(seat));
                let mut angular = -arm.cross(sum);
                if unknown == modes {
                    angular -= groove.axis * (pulley.sense * pulley.radius);
                }
                out.columns.push(Spatial { linear: -sum, angular });
            }
        }
        out.rows.extend_from_slice(&out.columns);
        let count = out.bodies.len();
        let clear = |out: &mut Border, row: usize| out.rows[row * count..][..count].fill(Spatial::zero());
        if pulley.is_empty() {
            out.unseen = unknowns;
            for row in 0..unknowns {
                clear(out, row);
                out.own[row * unknowns + row] = 1.0;
                out.missed[row] = -if row < modes { pulley.press[row] } else { pulley.along };
            }
            return;
        }
        for mode in 0..modes {
            out.missed[mode] = pulley.held[0][mode] - pulley.gap(mode);
        }
        if unknowns == modes {
            return;
        }
        out.unseen = 1;
        match slip.now {
            Slip::Sticks => out.missed[modes] = self.carried(pulley) - self.passed(pulley),
            Slip::Slides(sign) => {
                clear(out, modes);
                let [friction, drive] = self.largest(pulley);
                out.own[modes * unknowns + modes] = 1.0;
                out.missed[modes] = sign * friction.min(drive) - pulley.along;
                for mode in (0..modes).filter(|_| friction < drive) {
                    let by = |seat: &Seat| seat.weights[mode] * pulley.rod[seat.segment].tension;
                    let by: f64 = pulley.seats.iter().map(by).sum();
                    out.own[modes * unknowns + mode] = -sign * pulley.wheel.friction() * by;
                }
            }
        }
    }

    /// Takes the solution of the border: changes of the forces.
    pub(super) fn take_pulleys_solution(&mut self, mut solution: &[f64]) {
        for (pulley, _) in &mut self.eyelets.pulleys {
            let (own, rest) = solution.split_at(pulley.unknowns());
            let (press, along) = own.split_at(pulley.modes);
            pulley.change = Default::default();
            pulley.change.0[..press.len()].copy_from_slice(press);
            pulley.change.1 = along.first().copied().unwrap_or(0.0);
            solution = rest;
        }
    }

    /// Adds a share of the last solution.
    pub(super) fn move_pulleys(&mut self, share: f64) {
        for (pulley, _) in &mut self.eyelets.pulleys {
            let modes = pulley.modes;
            for (press, change) in pulley.press.iter_mut().zip(pulley.change.0).take(modes) {
                *press += change * share;
            }
            pulley.along += pulley.change.1 * share;
        }
    }

    /// Lets rods stick to wheels and slip, by forces and ways; returns whether any changes.
    pub(super) fn choose_on_pulleys(&mut self) -> bool {
        let mut changes = false;
        let mut pulleys = std::mem::take(&mut self.eyelets.pulleys);
        for (pulley, slip) in &mut pulleys {
            let before = slip.now;
            let rounding = 1e-12 * pulley.radius;
            let [friction, drive] = self.largest(pulley);
            let most = friction.min(drive);
            slip.now = match slip.now {
                Slip::Sticks if pulley.along.abs() > most * (1.0 + 1e-9) => Slip::Slides(pulley.along.signum()),
                // Friction is against the rod's motion over the wheel.
                Slip::Slides(sign) if sign * (self.passed(pulley) - self.carried(pulley)) > rounding => Slip::Sticks,
                same => same,
            };
            if !pulley.grips() || pulley.is_empty() {
                slip.now = Slip::Sticks;
            }
            changes |= before != slip.now;
        }
        self.eyelets.pulleys = pulleys;
        changes
    }
}

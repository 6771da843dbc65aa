//! A pulley in motion: which segments are on its wheel, and by how much.
//!
//! The wheel presses on the centres of segments. Its force is spread over the wrapped angle as a taut rope presses, evenly (or as `exp(-mu xi)` where
//! it slips), times polynomials of low order; each share of the force holds the average of the distances from the groove that has the same
//! weights: `G = sum of h(xi) gap = 0`. xi is the angle about the axle, continued by the way along the tangents on which the rod runs on and
//! off, where the gap is that from the tangent. h falls to zero there over three segments, as the cubic spline whose sum over evenly spaced places is
//! the same wherever they are, so that nothing jumps as segments pass on.
//!
//! Where the rod runs on and off is where the wheel's tangents have the directions of its spans at the start of a step.

use kernels::math::Vec3;
use rod::Wheel;

/// A number for each unknown share of the force: polynomials of an order below eight, for up to 1.75 turns.
pub(super) type Shares = [f64; 8];

/// A segment of the rod, as the wheel sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct OnWheel {
    /// Its length over the radius [rad].
    angle: f64,
    /// Distance from the axle of the centres of such segments whose joints are around the wheel so that the rod's length there is the
    /// radius times the angle [m]: `l / 2 / tan(angle / 2)`.
    pub(super) rim: f64,
    /// Its derivative with respect to the radius: the tension of a rod that presses with 1 N per rad.
    pub(super) tension: f64,
    /// Stiffness across the groove [N/m]: that of the rod's joints to stretch.
    pub(super) across: f64,
}

impl OnWheel {
    /// A segment so long [m] on a wheel of this radius [m].
    pub(super) fn new(length: f64, radius: f64, across: f64) -> Self {
        let half = 0.5 * length / radius;
        let tension = (half / half.sin()).powi(2);
        Self { angle: 2.0 * half, rim: 0.5 * length / half.tan(), tension, across }
    }
}

/// Where the rod is on the wheel: what one step leaves to the next.
#[derive(Clone, Copy, Debug)]
pub(super) struct Track {
    /// Whether the rod has left the wheel, for good: the wheel does nothing to it.
    pub(super) is_off: bool,
    /// A direction across the axle from which angles count.
    pub(super) reference: Vec3<f64>,
    /// A segment of the rod on the wheel, and its angle, which grows along the rod [rad].
    pub(super) middle: usize,
    pub(super) angle: f64,
    /// Where the rod runs on and off [rad].
    pub(super) arc: [f64; 2],
    /// How many shares of the force are unknown.
    pub(super) modes: usize,
    /// By how much the rod has turned, and its rate over the last step.
    pub(super) turned: f64,
    pub(super) rate: f64,
    /// The exponent by which the tension falls along the wheel [1/rad].
    pub(super) lean: f64,
    /// Shares of the force [N], and the force along the rod [N].
    pub(super) press: Shares,
    pub(super) along: f64,
    /// Averages of the gaps that the shares of the force hold, and their rates [m, m/s].
    pub(super) held: [Shares; 2],
    /// Force on the rod [N].
    pub(super) force: Vec3<f64>,
}

/// A segment on the wheel, or beside it, in some state of the rod.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seat {
    /// Which of the rod's.
    pub(super) segment: usize,
    /// xi, the angle [rad].
    pub(super) angle: f64,
    /// Directions away from the axle and along the groove.
    pub(super) normal: Vec3<f64>,
    pub(super) tangent: Vec3<f64>,
    /// Distance over which xi changes by one [m].
    pub(super) arm: f64,
    /// Distance from the groove, outwards and along the axle [m].
    pub(super) gap: f64,
    pub(super) across: f64,
    /// The share of the segment on the wheel.
    pub(super) share: f64,
    /// h of each mode, and its derivative with respect to xi.
    pub(super) weights: Shares,
    pub(super) slopes: Shares,
    /// Of the force along the rod: fixed in a step.
    pub(super) grip: f64,
    /// The joint at its end.
    pub(super) end: SeatEnd,
}

/// The joint at the end of a segment, where the groove damps it.
#[derive(Clone, Copy, Debug)]
pub(super) struct SeatEnd {
    /// Direction away from the axle.
    pub(super) normal: Vec3<f64>,
    /// Distance from the groove [m], and by how much it grew in the step under way.
    pub(super) gap: f64,
    pub(super) rise: f64,
    /// The share of the segment on the wheel.
    pub(super) share: f64,
    /// From the segment's centre [m].
    pub(super) arm: Vec3<f64>,
}

impl Default for SeatEnd {
    fn default() -> Self {
        Self { normal: Vec3::zero(), gap: 0.0, rise: 0.0, share: 0.0, arm: Vec3::zero() }
    }
}

/// The groove in space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Groove {
    pub(super) middle: Vec3<f64>,
    pub(super) axis: Vec3<f64>,
    /// Where angles count from, and a right angle further along the rod.
    across: [Vec3<f64>; 2],
}

impl Groove {
    /// That with this middle and axle, on which angles count from near a `reference` in the direction of `sense` about the axle.
    pub(super) fn new(middle: Vec3<f64>, axis: Vec3<f64>, reference: Vec3<f64>, sense: f64) -> Self {
        let level = reference - axis * axis.dot(reference);
        let first = level * (1.0 / level.norm_squared().sqrt());
        Self { middle, axis, across: [first, axis.cross(first) * sense] }
    }

    pub(super) fn first(&self) -> Vec3<f64> {
        self.across[0]
    }

    /// The directions away from the axle and along the groove at an angle.
    fn at(&self, angle: f64) -> [Vec3<f64>; 2] {
        let ((sine, cosine), [x, y]) = (angle.sin_cos(), self.across);
        [x * cosine + y * sine, y * cosine - x * sine]
    }

    /// The angle of a direction, nearest to another angle.
    fn angle(&self, direction: Vec3<f64>, near: f64) -> f64 {
        let [x, y] = self.across.map(|axis| axis.dot(direction));
        nearest(y.atan2(x), near)
    }
}

/// An angle plus the turns that bring it nearest to another one.
fn nearest(angle: f64, to: f64) -> f64 {
    angle + std::f64::consts::TAU * ((to - angle) / std::f64::consts::TAU).round()
}

/// The integral of the quadratic spline, a rise from 0 to 1, and its derivative.
fn rise(at: f64) -> [f64; 2] {
    let beyond = (1.5 - at.abs()).max(0.0);
    let (below, slope) = if beyond < 1.0 {
        (beyond.powi(3) / 6.0, 0.5 * beyond * beyond)
    } else {
        let z = -at.abs();
        (0.5 + 0.75 * z - z.powi(3) / 3.0, 0.75 - z * z)
    };
    [if at > 0.0 { 1.0 - below } else { below }, slope]
}

/// Where the direction of a span is read: between two segments, this share of the way.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct End {
    pub(super) segments: [usize; 2],
    pub(super) share: f64,
}

impl End {
    /// The shares of its segments.
    pub(super) fn shares(&self) -> [(usize, f64); 2] {
        [(self.segments[0], 1.0 - self.share), (self.segments[1], self.share)]
    }
}

/// A pulley in motion.
#[derive(Clone, Debug)]
pub(super) struct Pulley {
    /// Which one of the model.
    pub(super) index: usize,
    /// The rod's first body.
    pub(super) first: usize,
    pub(super) rod: Vec<OnWheel>,
    /// The longest angle of them [rad].
    pub(super) longest: f64,
    pub(super) holder: usize,
    /// Middle and axle in the holder's frame.
    pub(super) at: Vec3<f64>,
    pub(super) axis: Vec3<f64>,
    pub(super) radius: f64,
    pub(super) wheel: Wheel,
    /// Sense about the axle in which the rod runs from its start to its end.
    pub(super) sense: f64,
    pub(super) track: Track,
    /// Of the step under way: where it runs on and off, how many modes.
    pub(super) arc: [f64; 2],
    pub(super) modes: usize,
    /// Shares of the force and the force along the rod, times dt^2, and their last change.
    pub(super) press: Shares,
    pub(super) along: f64,
    pub(super) change: (Shares, f64),
    /// Averages of the gaps that the shares of the force hold, and their rates [m, m/s].
    pub(super) held: [Shares; 2],
    /// Force on the rod times dt^2.
    pub(super) force: Vec3<f64>,
    /// Where segments are, at the start of the step and now.
    pub(super) start: Vec<Seat>,
    pub(super) seats: Vec<Seat>,
}

impl Pulley {
    /// How far beyond the wrapped angle the wheel presses: half of the width of the cubic spline [rad].
    fn reach(&self) -> f64 {
        1.5 * self.longest
    }

    /// Where segments are in a groove, by the places of their centres, when the rod runs on and off at an `arc`.
    pub(super) fn seat(&self, groove: &Groove, arc: [f64; 2], at: impl Fn(usize) -> Vec3<f64>, out: &mut Vec<Seat>) {
        out.clear();
        let middle = self.track.middle;
        let place = |segment: usize, near: f64| {
            let offset = at(segment) - groove.middle;
            let round = groove.angle(offset, near);
            (round, self.seat_of(segment, groove, arc, (offset, round)))
        };
        let (centre, seat) = place(middle, self.track.angle);
        let reach = self.reach();
        let mut last = centre;
        for segment in (0..middle).rev() {
            let (round, seat) = place(segment, last);
            last = round;
            if seat.angle < arc[0] - reach {
                break;
            }
            out.push(seat);
        }
        out.reverse();
        out.push(seat);
        last = centre;
        for segment in middle + 1..self.rod.len() {
            let (round, seat) = place(segment, last);
            last = round;
            if seat.angle > arc[1] + reach {
                break;
            }
            out.push(seat);
        }
    }

    /// One of them, from its offset from the middle and its angle about the axle.
    fn seat_of(
        &self,
        segment: usize,
        groove: &Groove,
        [from, to]: [f64; 2],
        (offset, round): (Vec3<f64>, f64),
    ) -> Seat {
        let OnWheel { angle: own, rim, .. } = self.rod[segment];
        let across = groove.axis.dot(offset);
        let is_round = (from..=to).contains(&round);
        let (angle, [normal, tangent], arm, gap);
        if is_round {
            [normal, tangent] = groove.at(round);
            arm = normal.dot(offset);
            (angle, gap) = (round, arm - rim);
        } else {
            let edge = if round < from { from } else { to };
            [normal, tangent] = groove.at(edge);
            (arm, gap) = (rim, normal.dot(offset) - rim);
            angle = edge + tangent.dot(offset) / rim;
        }
        let ([up, up_slope], [down, down_slope]) = (rise((angle - from) / own), rise((angle - to) / own));
        let on = if self.track.is_off { 0.0 } else { 1.0 };
        let mut seat = Seat {
            segment,
            angle,
            normal,
            tangent,
            arm,
            gap,
            across,
            share: on * (up - down),
            weights: Shares::default(),
            slopes: Shares::default(),
            grip: 0.0,
            end: SeatEnd::default(),
        };
        // The share per rad, and its fall along the wheel.
        let (half, wrap) = (0.5 * (to - from), to - from);
        let reach = half + self.reach();
        let x = (angle - from - half) / reach;
        let lean = self.track.lean;
        let fall = (-lean * (angle - from - half)).exp() * own / wrap;
        let (share, slope) = (seat.share * fall, on * (up_slope - down_slope) / own * fall - lean * seat.share * fall);
        // Legendre's polynomials.
        let (mut now, mut before) = ([1.0, 0.0], [0.0, 0.0]);
        for mode in 0..seat.weights.len().min(self.modes + 1) {
            seat.weights[mode] = share * now[0];
            seat.slopes[mode] = slope * now[0] + share * now[1] / reach;
            let n = mode as f64;
            let next = [
                ((2.0 * n + 1.0) * x * now[0] - n * before[0]) / (n + 1.0),
                ((2.0 * n + 1.0) * (now[0] + x * now[1]) - n * before[1]) / (n + 1.0),
            ];
            (before, now) = (now, next);
        }
        seat
    }

    /// Finds the ends of the segments that are on the wheel, which have such axes.
    pub(super) fn seat_ends(
        &self,
        groove: &Groove,
        arc: [f64; 2],
        at: impl Fn(usize) -> (Vec3<f64>, Vec3<f64>),
        seats: &mut [Seat],
    ) {
        for seat in seats {
            let (place, axis) = at(seat.segment);
            let arm = axis * (0.5 * self.rod[seat.segment].angle * self.radius);
            let offset = place + arm - groove.middle;
            let Seat { normal, gap, share, .. } =
                self.seat_of(seat.segment, groove, arc, (offset, groove.angle(offset, seat.angle)));
            seat.end = SeatEnd { normal, gap, rise: 0.0, share, arm };
        }
    }

    /// Where the directions of the spans are read when the rod runs on and off at an `arc`: beyond what the wheel presses on, but at most so
    /// far from there [rad]; and the segment in the middle of that, with its angle.
    pub(super) fn find_ends(
        &self,
        groove: &Groove,
        (arc, most): ([f64; 2], f64),
        at: impl Fn(usize) -> Vec3<f64>,
    ) -> ([End; 2], (usize, f64)) {
        let goal = 0.5 * (arc[0] + arc[1]);
        let mut best = (self.track.middle, self.track.angle);
        let mut nearer = f64::INFINITY;
        let mut find = |is_end: bool| {
            let [from, to] = arc;
            let mut before: Option<(f64, usize)> = None;
            let mut last = self.track.angle;
            let mut segment = self.track.middle;
            loop {
                let offset = at(segment) - groove.middle;
                last = groove.angle(offset, last);
                let seat = self.seat_of(segment, groove, arc, (offset, last));
                if (seat.angle - goal).abs() < nearer {
                    (nearer, best) = ((seat.angle - goal).abs(), (segment, last));
                }
                // On the first segments on which the wheel does not press.
                let beyond = (2.0 * self.rod[segment].angle).min(most);
                let past = if is_end { seat.angle - to - beyond } else { from - beyond - seat.angle };
                let is_last = if is_end { segment + 1 == self.rod.len() } else { segment == 0 };
                if past > 0.0 || is_last {
                    return match before {
                        Some((old, other)) if past > 0.0 => {
                            End { segments: [other, segment], share: old / (old - past) }
                        }
                        _ => End { segments: [segment; 2], share: 1.0 },
                    };
                }
                before = Some((past, segment));
                segment = if is_end { segment + 1 } else { segment - 1 };
            }
        };
        ([find(false), find(true)], best)
    }

    /// Where the rod runs on and off, by the directions of its spans, near such angles.
    pub(super) fn arc_of(
        groove: &Groove,
        ends: &[End; 2],
        axis: impl Fn(usize) -> Vec3<f64>,
        near: [f64; 2],
    ) -> [f64; 2] {
        let edge = |k: usize| {
            let [(a, of_a), (b, of_b)] = ends[k].shares();
            let direction = axis(a) * of_a + axis(b) * of_b;
            // The tangent at an angle is a right angle further.
            groove.angle(direction, near[k] + std::f64::consts::FRAC_PI_2) - std::f64::consts::FRAC_PI_2
        };
        [edge(0), edge(1)]
    }
}

/// Both ends of a wrapped angle, a least one apart.
pub(super) fn spread([from, to]: [f64; 2]) -> [f64; 2] {
    // A rod that is straight presses at a point.
    let lacking = (1e-3 - (to - from)).max(0.0);
    [from - 0.5 * lacking, to + 0.5 * lacking]
}

/// How many shares of the force such a wrap has: one and another each quarter of a turn, so that a taut rod is stable between what they hold (a ring
/// of the tension T and radius R that is pressed evenly yields to a wave of k periods a turn by `(k^2 - 1) T / R`). What there is
/// stays as long as it is nearly right.
pub(super) fn modes_of(wrap: f64, before: usize) -> usize {
    let exact = 1.0 + wrap / std::f64::consts::FRAC_PI_2;
    if (exact - before as f64).abs() < 0.75 {
        before
    } else {
        (exact.round() as usize).clamp(1, Shares::default().len())
    }
}

/// Gaps that shares of the force hold, and their rates, a time later [m, m/s, s]. What a rod is off the groove where a share begins to hold it, as it is drawn and where
/// the wrapped angle grows, goes to zero as a damped spring without a jump of its rate, in some 0.1 s: a rope that is brought there at once jerks, and
/// goes slack.
pub(super) fn eased([gaps, rates]: [Shares; 2], time: f64) -> [Shares; 2] {
    let per_s = 1.0 / 0.03;
    let left = (-per_s * time).exp();
    let (mut gap, mut rate) = (gaps, rates);
    for mode in 0..gaps.len() {
        let pace = rates[mode] + per_s * gaps[mode];
        gap[mode] = (gaps[mode] + pace * time) * left;
        rate[mode] = (rates[mode] - per_s * pace * time) * left;
    }
    [gap, rate]
}

//! Derivatives of an equilibrium's shape with respect to the grips and the cable.
//!
//! At an equilibrium r(z, p) = 0 with the unknowns z and a parameter p, so dz/dp = -K^-1 dr/dp with Newton's matrix K. One
//! elimination serves eight parameters, one a lane, as right-hand sides.

use std::ops::Range;

use cosserat::internals::kernels::dispatch::vectorized;
use cosserat::internals::kernels::lane::{Lanes, Real};
use cosserat::internals::kernels::math::{Quat, Vec3};
use nalgebra::Vector3;

use crate::answer::Equilibrium;
use crate::joint::{Bend, on_both_sides};
use crate::query::Query;
use crate::scaled::{Cut, Scaled, set};
use crate::sweep::{Chain, Row};

/// Number of parameters.
pub const PARAMETERS: usize = 22;
/// Position of the start's grip [m], and its turn, a world rotation vector [rad].
pub const START: [Range<usize>; 2] = [0..3, 3..6];
/// Position and turn of the end's grip.
pub const END: [Range<usize>; 2] = [6..9, 9..12];
/// Length [m].
pub const LENGTH: usize = 12;
/// Bending stiffness about d1 and d2, and torsional stiffness [N m^2].
pub const STIFFNESS: Range<usize> = 13..16;
/// Weight a metre [N/m].
pub const WEIGHT: usize = 16;
/// Curvatures about d1 and d2 and twist at rest [1/m].
pub const REST: Range<usize> = 17..20;
/// Weight that is carried [N].
pub const CARRIED: usize = 20;
/// Its place [m].
pub const CARRIED_AT: usize = 21;

/// How an equilibrium changes with a parameter, per unit of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Derivative {
    /// Of the segments' centres [m].
    pub positions: Vec<Vector3<f64>>,
    /// Of the segments' turns: world rotation vectors [rad].
    pub turns: Vec<Vector3<f64>>,
}

/// Parameters of a query without units.
const SCALED: usize = 19;
const CHORD: usize = 0;
const TURNS: [usize; 2] = [3, 6];
const BENDING: usize = 9;
const OWN_WEIGHT: usize = 12;
const OWN_REST: usize = 13;
const COMPLIANCE: usize = 16;
const OWN_CARRIED: usize = 17;
const OWN_PLACE: usize = 18;

const WIDTH: usize = 8;
type Wide = Lanes<WIDTH>;

/// The derivatives of a stable equilibrium of a query with respect to its [`PARAMETERS`], of which [`START`] to [`CARRIED_AT`] say
/// which is which; those of the end's grip are zero where the end is free.
pub fn derivatives(query: &Query, found: &Equilibrium) -> Vec<Derivative> {
    let cut = Cut::even(found.orientations.len());
    let scaled = Scaled::new(query);
    let mut at = At { cut, scaled, query, found, chain: Chain::new(&cut), bends: Vec::new() };
    let of_scaled = at.solve();
    (0..PARAMETERS).map(|parameter| at.composed(parameter, &of_scaled)).collect()
}

/// An equilibrium, and what is needed of it.
struct At<'a> {
    cut: Cut,
    scaled: Scaled,
    query: &'a Query,
    found: &'a Equilibrium,
    chain: Chain<f64>,
    bends: Vec<Bend<f64>>,
}

/// Turns in body frames and the force's change along a parameter without units.
struct Change {
    turns: Vec<Vector3<f64>>,
    force: Vector3<f64>,
}

impl At<'_> {
    fn solve(&mut self) -> Vec<Change> {
        let count = self.cut.segments;
        let mut wide = Chain::<Wide>::new(&self.cut);
        self.chain.load(0, &self.cut, &self.scaled);
        for (own, q) in self.chain.turns.iter_mut().zip(&self.found.orientations) {
            set(own, 0, q);
        }
        let cable = &self.query.cable;
        let unit = cable.length.powi(2) / cable.bending[0].max(cable.bending[1]);
        let force = self.found.grips[0].force * -unit;
        self.chain.force = Vec3([force.x, force.y, force.z]);
        for lane in 0..WIDTH {
            wide.load(lane, &self.cut, &self.scaled);
        }
        wide.force = Vec3::splat(self.chain.force);
        for (own, q) in wide.turns.iter_mut().zip(&self.chain.turns) {
            *own = Quat::splat(*q);
        }
        let Chain { turns, ends, stiffness, rest, .. } = &self.chain;
        let at = |joint: usize| {
            if joint == 0 {
                ends[0]
            } else if joint > count {
                ends[1]
            } else {
                turns[joint - 1]
            }
        };
        self.bends = (0..=count)
            .map(|joint| {
                let kind = Chain::<f64>::kind(joint, count);
                Bend::new(at(joint), at(joint + 1), stiffness[kind], rest[kind])
            })
            .collect();
        let mut rows = vec![Row::<Wide>::zero(); count];
        let mut changes = Vec::new();
        for first in (0..SCALED).step_by(WIDTH) {
            let mut moments = vec![Vec3::<Wide>::zero(); count];
            let mut gap = Vec3::<Wide>::zero();
            for lane in 0..WIDTH.min(SCALED - first) {
                let miss = self.right_hand_side(first + lane, |segment, moment| {
                    for k in 0..3 {
                        let own = &mut moments[segment].0[k];
                        own.set_lane(lane, own.lane(lane) + moment.0[k]);
                    }
                });
                (0..3).for_each(|k| gap.0[k].set_lane(lane, miss.0[k]));
            }
            let found = vectorized(
                #[inline(always)]
                || wide.solve_for(&mut rows, Wide::zero(), |i, _| moments[i], |_| gap),
            );
            let vector = |v: &Vec3<Wide>, lane: usize| Vector3::from_fn(|k, _| v.0[k].lane(lane));
            for lane in 0..WIDTH.min(SCALED - first) {
                let turns = rows.iter().map(|row| vector(&row.theta, lane)).collect();
                changes.push(Change { turns, force: vector(&found.force, lane) });
            }
        }
        changes
    }

    /// How the moments on the segments, given to `add`, and the gap change with a parameter while nothing moves.
    fn right_hand_side(&self, parameter: usize, mut add: impl FnMut(usize, Vec3<f64>)) -> Vec3<f64> {
        let Self { cut, scaled, chain, bends, .. } = self;
        let count = cut.segments;
        let unit = |k: usize| Vec3([0, 1, 2].map(|i| f64::from(u8::from(i == k))));
        let joints = if scaled.held { count + 1 } else { count };
        let all_compliances = count as f64 + 1.0;
        // Moments on the relative rotations of all joints, by their kinds and imaginary parts.
        let mut bend = |moment: &dyn Fn(usize, Vec3<f64>) -> Vec3<f64>| {
            for (joint, own) in bends.iter().enumerate().take(joints) {
                let Quat { v, w } = own.relative;
                let [a, b] = on_both_sides(w, v, moment(Chain::<f64>::kind(joint, count), v));
                if joint > 0 {
                    add(joint - 1, a);
                }
                if joint < count {
                    add(joint, b);
                }
            }
        };
        match parameter {
            CHORD..3 => return unit(parameter - CHORD),
            3..6 => {
                let turn = chain.ends[0].rotate_back(unit(parameter - TURNS[0])).0;
                let across = &bends[0].across;
                add(0, Vec3([0, 1, 2].map(|c| (0..3).map(|r| across[r][c] * turn[r]).sum())));
            }
            6..9 if scaled.held => {
                let turn = chain.ends[1].rotate_back(unit(parameter - TURNS[1])).0;
                let across = &bends[count].across;
                add(count - 1, Vec3([0, 1, 2].map(|r| (0..3).map(|c| across[r][c] * turn[c]).sum())));
            }
            6..9 => {}
            BENDING..12 => {
                let k = parameter - BENDING;
                bend(&|kind, u| unit(k) * ((u.0[k] - chain.rest[kind][k]) * 4.0 / cut.joints()[kind]));
            }
            OWN_WEIGHT | OWN_CARRIED | OWN_PLACE => {
                let [carried, place] = scaled.carried;
                let after = |i: usize| cut.share_after(i, place);
                // The force before a free end changes with the weight: it bears all of it.
                let all = if scaled.held { 0.0 } else { 1.0 };
                for (i, q) in chain.turns.iter().enumerate() {
                    let before = match parameter {
                        OWN_WEIGHT => cut.place(i) - all,
                        OWN_CARRIED => after(i) - all,
                        _ if after(i) > 0.0 && after(i) < 1.0 => -carried / cut.length(i),
                        _ => 0.0,
                    };
                    let t = q.rotate_back(unit(2)) * (before * cut.length(i));
                    add(i, Vec3([t.0[1], -t.0[0], 0.0]));
                }
                let borne = match parameter {
                    OWN_WEIGHT => all_compliances * 0.5,
                    OWN_CARRIED => loaded(cut, place),
                    _ => 0.0,
                };
                return unit(2) * (-scaled.compliance * borne);
            }
            OWN_REST..=15 => {
                let k = parameter - OWN_REST;
                bend(&|kind, _| unit(k) * (-chain.stiffness[kind][k] * 0.5 * cut.joints()[kind]));
            }
            _ => {
                let [carried, place] = scaled.carried;
                let all = chain.force + unit(2) * (0.5 * scaled.weight);
                return -(all * all_compliances + unit(2) * (carried * loaded(cut, place)));
            }
        }
        Vec3::zero()
    }

    /// The derivative by a parameter of the query: those without units, by the chain rule, and what it does to the scale.
    fn composed(&self, parameter: usize, of: &[Change]) -> Derivative {
        let (scaled, cable) = (&self.scaled, &self.query.cable);
        let (length, bending) = (cable.length, cable.bending[0].max(cable.bending[1]));
        let mut weights = [0.0; SCALED];
        let mut shift = Vector3::zeros();
        match parameter {
            0..3 => {
                weights[CHORD + parameter] = -1.0 / length;
                shift[parameter] = 1.0;
            }
            3..6 => weights[TURNS[0] + parameter - 3] = 1.0,
            6..9 => weights[CHORD + parameter - 6] = 1.0 / length,
            9..12 => weights[TURNS[1] + parameter - 9] = 1.0,
            LENGTH => {
                for k in 0..3 {
                    weights[CHORD + k] = -scaled.chord[k] / length;
                    weights[OWN_REST + k] = scaled.rest[k] / length;
                }
                weights[OWN_WEIGHT] = 3.0 * scaled.weight / length;
                weights[COMPLIANCE] = -3.0 * scaled.compliance / length;
                weights[OWN_CARRIED] = 2.0 * scaled.carried[0] / length;
                weights[OWN_PLACE] = -scaled.carried[1] / length;
            }
            13..16 => weights[BENDING + parameter - STIFFNESS.start] = 1.0 / bending,
            WEIGHT => weights[OWN_WEIGHT] = length.powi(3) / bending,
            17..20 => weights[OWN_REST + parameter - REST.start] = length,
            CARRIED => weights[OWN_CARRIED] = length.powi(2) / bending,
            _ => weights[OWN_PLACE] = 1.0 / length,
        }
        if !scaled.held {
            weights[CHORD..CHORD + 3].fill(0.0);
        }
        let used: Vec<usize> = (0..SCALED).filter(|&k| weights[k] != 0.0).collect();
        let weighted = |value: &dyn Fn(&Change) -> Vector3<f64>| -> Vector3<f64> {
            used.iter().map(|&k| value(&of[k]) * weights[k]).sum()
        };
        let z = Vector3::z();
        let mut pull = weighted(&|change| change.force) * scaled.compliance;
        let mut force = Vector3::from(self.chain.force.0) * weights[COMPLIANCE];
        if !scaled.held {
            pull -= z * ((weights[OWN_WEIGHT] + weights[OWN_CARRIED]) * scaled.compliance);
        }
        let mut derivative = Derivative::default();
        let mut place = Vector3::zeros();
        let mut was_borne = false;
        for (i, q) in self.found.orientations.iter().enumerate() {
            let size = self.cut.length(i);
            let turn = weighted(&|change| change.turns[i]);
            let axis = (q * turn.cross(&z)) * (0.5 * size);
            place += pull + force + axis;
            let scale = if parameter == LENGTH {
                (self.found.positions[i] - self.query.start.position) / length
            } else {
                Vector3::zeros()
            };
            derivative.positions.push(place * length + scale + shift);
            derivative.turns.push(q * turn);
            place += axis;
            pull += z * (weights[OWN_WEIGHT] * size * scaled.compliance);
            force += z * (scaled.weight * size * weights[COMPLIANCE]);
            let is_borne = self.cut.share_after(i, scaled.carried[1]) > 0.0;
            if is_borne != was_borne {
                pull += z * (weights[OWN_CARRIED] * scaled.compliance);
                force += z * (scaled.carried[0] * weights[COMPLIANCE]);
            }
            was_borne = is_borne;
        }
        derivative
    }
}

/// How many joints bear what is carried at a place.
fn loaded(cut: &Cut, place: f64) -> f64 {
    (0..cut.segments).filter(|&i| cut.share_after(i, place) > 0.0).count() as f64
}

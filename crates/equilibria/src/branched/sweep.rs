//! One linear solve of Newton's method for a cable with three arms.
//!
//! Each arm is a chain of [`crate::sweep`] from its grip to the junction, whose end turns with the junction and whose chord ends
//! at its place x. The sum of their L has the weight's part `W_k z.(x - x_k)` of each arm beside, which is constant where both
//! ends are held. So the junction's rows are balances: of moments, and of the forces `lambda_k + W_k z` on the arms' ends.
//! An arm's elimination goes on to the turn of its end and its force,
//!
//! ```text
//! [ D    B  ] [theta]     [g]
//! [ B^T  S  ] [  f  ] = - [m]    with dx added to the second row,
//! ```
//!
//! and eliminating f leaves what the arm is at its end as a spring: `D - B S^-1 B^T` against turns, `-S^-1` against the place.
//! Turned into the junction's frame, these add up to a 6 x 6 matrix. An equilibrium is a stable minimum where there are nine
//! negative pivots, three an arm (Haynsworth 1968).

// Rows and columns are numbered as in the formulas.
#![allow(clippy::needless_range_loop)]

use cosserat::internals::kernels::lane::Real;
use cosserat::internals::kernels::math::{Quat, Vec3};
use nalgebra::UnitQuaternion;

use super::query::{ARMS, directions};
use super::star::{Junction, Star};
use crate::joint::{Factor, column};
use crate::scaled::{Cut, get, set};
use crate::sweep::{Chain, Found, Row, Steps};

/// Upper triangle of a symmetric matrix: 11, 22, 33, 12, 13, 23.
const ENTRIES: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

/// Three chains and the junction, or several side by side.
#[derive(Clone, Debug)]
pub(crate) struct Tree<T> {
    pub(crate) arms: [Chain<T>; ARMS],
    /// Whole weights of the arms.
    weights: [T; ARMS],
    /// Places of the grips.
    places: [Vec3<T>; ARMS],
    /// Frames of the arms' ends in the junction's.
    directions: [Quat<T>; ARMS],
    pub(crate) position: Vec3<T>,
    pub(crate) orientation: Quat<T>,
}

/// The junction's part of a step, and the change of each arm's force.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Change<T> {
    turn: Vec3<T>,
    place: Vec3<T>,
    forces: [Vec3<T>; ARMS],
}

impl<T: Real> Change<T> {
    pub(crate) fn zero() -> Self {
        Self { turn: Vec3::zero(), place: Vec3::zero(), forces: [Vec3::zero(); ARMS] }
    }
}

/// What an arm's elimination leaves to the junction.
#[derive(Clone, Copy)]
struct End<T> {
    /// S^-1 B^T by its columns, S^-1 by its columns, and S^-1 m.
    coupled: [[T; 3]; 3],
    inverse: [[T; 3]; 3],
    loose: Vec3<T>,
    /// The force's gradient.
    gap: Vec3<T>,
}

impl<T: Real> Tree<T> {
    /// Memory for arms of this cut.
    pub(crate) fn new(cut: &Cut) -> Self {
        let chain = || Chain::new(cut);
        let directions = directions().map(|q| {
            let mut own = Quat::identity();
            for lane in 0..T::LANES {
                set(&mut own, lane, &q);
            }
            own
        });
        Self {
            arms: [chain(), chain(), chain()],
            weights: [T::zero(); ARMS],
            places: [Vec3::zero(); ARMS],
            directions,
            position: Vec3::zero(),
            orientation: Quat::identity(),
        }
    }

    /// Puts a query into a lane, without its start.
    pub(crate) fn load(&mut self, lane: usize, cut: &Cut, star: &Star) {
        for k in 0..ARMS {
            self.arms[k].load_long(lane, cut, &star.arms[k], star.lengths[k]);
            self.weights[k].set_lane(lane, star.arms[k].weight + star.arms[k].carried[0]);
            for c in 0..3 {
                self.places[k].0[c].set_lane(lane, star.places[k][c]);
            }
        }
    }

    /// Puts a junction into a lane.
    pub(crate) fn set_junction(&mut self, lane: usize, own: &Junction) {
        for c in 0..3 {
            self.position.0[c].set_lane(lane, own.position[c]);
        }
        set(&mut self.orientation, lane, &own.orientation);
    }

    /// That of a lane.
    pub(crate) fn junction(&self, lane: usize) -> Junction {
        let orientation: UnitQuaternion<f64> = get(&self.orientation, lane);
        Junction { position: self.position.0.map(|x| x.lane(lane)).into(), orientation }
    }

    /// Takes the arms' ends to the junction.
    #[inline(always)]
    pub(crate) fn join(&mut self) {
        for k in 0..ARMS {
            self.arms[k].chord = self.position - self.places[k];
            self.arms[k].ends[1] = self.orientation * self.directions[k];
        }
    }

    /// Solves for the step from here with turns made stiffer by `shift` times the segments' lengths; the rows hold it. Arms must
    /// end at the junction ([`Self::join`]).
    #[inline(always)]
    pub(crate) fn solve(&self, rows: &mut [Vec<Row<T>>; ARMS], shift: T) -> (Found<T>, Change<T>) {
        let (zero, one, half) = (T::zero(), T::splat(1.0), T::splat(0.5));
        let (mut energy, mut wrong) = (zero, zero);
        // Stiffness of the junction's turn, of both, of its place; and their gradients, as they are and after the elimination.
        let (mut turning, mut both, mut placing) = ([zero; 6], [[zero; 3]; 3], [zero; 6]);
        let mut slopes = [Vec3::<T>::zero(); 2];
        let mut rest = [Vec3::<T>::zero(); 2];
        let nothing = End { coupled: [[zero; 3]; 3], inverse: [[zero; 3]; 3], loose: Vec3::zero(), gap: Vec3::zero() };
        let mut ends = [nothing; ARMS];
        for k in 0..ARMS {
            let chain = &self.arms[k];
            let front = chain.eliminate(&mut rows[k], shift, |_, own| own);
            let gap = chain.gap(front.reached);
            let mut schur = front.schur;
            for entry in &mut schur[..3] {
                *entry -= chain.compliance;
            }
            let factor = Factor::new(schur);
            wrong += front.wrong + factor.negative - T::splat(3.0);
            energy += front.energy + chain.force.dot(chain.chord) + self.weights[k] * chain.chord.0[2];
            let coupled = front.border.map(|row| factor.solve(row));
            let inverse = [[one, zero, zero], [zero, one, zero], [zero, zero, one]].map(|unit| factor.solve(unit));
            let loose = Vec3(factor.solve((gap + front.rest).0));
            ends[k] = End { coupled, inverse, loose, gap };
            // In the arm's end frame.
            let mut own = [[zero; 3]; 3];
            for (entry, (r, c)) in ENTRIES.into_iter().enumerate() {
                let stiff = front.last.own[1][entry] + front.block[entry];
                own[r][c] = stiff - Vec3(front.border[r]).dot(Vec3(coupled[c]));
                own[c][r] = own[r][c];
            }
            for r in 0..3 {
                own[r][r] += shift * chain.lengths[0];
            }
            let direction = self.directions[k];
            let turned = rotated(direction, &transposed(&rotated(direction, &own)));
            let across = rotated(direction, &coupled);
            for (entry, (r, c)) in ENTRIES.into_iter().enumerate() {
                turning[entry] += turned[r][c];
                placing[entry] -= inverse[c][r];
            }
            for r in 0..3 {
                for c in 0..3 {
                    both[r][c] -= across[r][c];
                }
            }
            let gradient = front.last.gradient[1];
            let mut eliminated = gradient + front.right;
            for r in 0..3 {
                eliminated.0[r] -= Vec3(front.border[r]).dot(loose);
            }
            slopes[0] += direction.rotate(gradient);
            rest[0] += direction.rotate(eliminated);
            let mut pull = chain.force;
            pull.0[2] += self.weights[k];
            slopes[1] += pull;
            rest[1] += pull - loose;
        }
        let place_factor = Factor::new(placing);
        wrong += place_factor.negative;
        let solved = both.map(|row| place_factor.solve(row));
        let mut left = turning;
        for (entry, (r, c)) in ENTRIES.into_iter().enumerate() {
            left[entry] -= Vec3(both[r]).dot(Vec3(solved[c]));
        }
        let turn_factor = Factor::new(left);
        wrong += turn_factor.negative;
        let mut right = rest[0];
        for r in 0..3 {
            right.0[r] -= Vec3(solved[r]).dot(rest[1]);
        }
        let turn = -Vec3(turn_factor.solve(right.0));
        let onto = |c: usize| Vec3(column(&both, c)).dot(turn);
        let place = -Vec3(place_factor.solve((rest[1] + Vec3([onto(0), onto(1), onto(2)])).0));
        let (mut most, mut bend) = (turn.norm_squared().max(place.norm_squared()), zero);
        let mut slope = turn.dot(slopes[0]) + place.dot(slopes[1]);
        let mut forces = [Vec3::zero(); ARMS];
        for k in 0..ARMS {
            let chain = &self.arms[k];
            let end = self.directions[k].rotate_back(turn);
            let End { coupled, inverse, loose, gap } = ends[k];
            let mut force = loose;
            for r in 0..3 {
                force += Vec3(coupled[r]) * end.0[r] + Vec3(inverse[r]) * place.0[r];
            }
            let force = -force;
            let steps: Steps<T> = chain.substitute(&mut rows[k], force, end, gap.dot(force));
            (most, bend) = (most.max(steps.turn), bend.max(steps.bend));
            slope += steps.slope;
            forces[k] = force;
        }
        energy += half * slope;
        let found = Found { energy, wrong, force: place, turn: most.sqrt(), bend: bend.sqrt() };
        (found, Change { turn, place, forces })
    }

    /// Goes on: turns and the place by `share` of the step, and the forces by `forces` of their changes.
    #[inline(always)]
    pub(crate) fn step(&mut self, rows: &[Vec<Row<T>>; ARMS], share: T, change: &Change<T>, forces: T) {
        for k in 0..ARMS {
            self.arms[k].step(&rows[k], share, change.forces[k], forces);
        }
        let by = Quat { v: change.turn * (share * T::splat(0.5)), w: T::splat(1.0) };
        self.orientation = (self.orientation * by).normalized();
        self.position += change.place * share;
    }
}

/// The columns of a matrix turned.
#[inline(always)]
fn rotated<T: Real>(by: Quat<T>, m: &[[T; 3]; 3]) -> [[T; 3]; 3] {
    transposed(&[0, 1, 2].map(|c| by.rotate(Vec3(column(m, c))).0))
}

#[inline(always)]
fn transposed<T: Copy>(m: &[[T; 3]; 3]) -> [[T; 3]; 3] {
    [0, 1, 2].map(|c| column(m, c))
}

//! Several equilibria of what is held in one way: branches of the twist, mirror images, snapped and unsnapped shapes.
//!
//! Starts are the state as it is, bent to either side, and with a turn of twist more and less. From each Newton's method goes down to an
//! equilibrium; then Newton's method on the equations times `1 / distance^2 + 1` to all that are known does not come to these
//! again (deflation; Farrell, Birkisson and Funke 2015), which only scales its steps. What it finds is often unstable, and is
//! left to either side for the stable ones beside it.

use std::f64::consts::TAU;

use component::{BodyPose, Component, Members, split};
use jointed::tangent::elimination::Elimination;
use jointed::topology::Topology;
use kernels::Spatial;
use kernels::math::{Quat, Vec3};
use rod::{Model, State, measure};

use super::balance::{Balance, Direction, Place};
use super::contact::Contacts;
use super::{StaticParams, StaticParamsError, is_windy, newton};
use crate::error::{StaticError, only_elastic, unbreakable, without_contacts, without_eyelets};

/// How equilibria are looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BranchParams {
    /// When an equilibrium counts as found. Its steps are the most linear solves of all searches together.
    pub rest: StaticParams,
    /// Most equilibria.
    pub most: usize,
}

impl Default for BranchParams {
    fn default() -> Self {
        Self { rest: StaticParams::default(), most: 16 }
    }
}

/// One of several equilibria.
#[derive(Clone, Debug, PartialEq)]
pub struct Branch {
    /// Where the segments are; velocities are zero.
    pub state: State,
    /// Energy, as [`measure::energy`] has it [J].
    pub energy: f64,
    /// Directions in which it is unstable.
    pub unstable: usize,
    /// Whether it is one of many of the same energy, which a motion without resistance leads to; only one of them is told.
    pub neutral: bool,
}

/// Equilibria, the lowest energy first.
#[derive(Clone, Debug, PartialEq)]
pub struct Branches {
    /// What was found.
    pub branches: Vec<Branch>,
    /// Linear solves in all.
    pub solves: usize,
}

/// Most iterations of a deflated search.
const ITERATIONS: usize = 80;
/// Largest shift [lengths of the rods] and turn [rad] of an iteration.
const LARGEST: f64 = 0.4;
/// Distance within which two equilibria are one.
const SAME: f64 = 1e-5;
/// Share of the energies within which two neutral equilibria are one.
const SAME_ENERGY: f64 = 1e-8;
/// Deflated searches from a start.
const SEARCHES: usize = 6;
/// Turn by which an unstable equilibrium is left [rad].
const ASIDE: f64 = 0.1;
/// Turn by which the start is bent for more of them [rad].
const BENT: f64 = 0.5;
/// What is unstable in more directions than this is not told: rods that are crushed along their axes.
const MOST_UNSTABLE: usize = 8;
/// By how many nudges the tangent must be stiffer, or softer, for a motion without resistance to be seen.
const NEUTRAL: f64 = 30.0;

/// Looks for the equilibria of a model whose rods are one set, from `state` as it is at time 0. Not all of them are found.
///
/// # Errors
/// If the model, the state or a parameter is not valid, and [`StaticError::Branches`] for several sets of rods that are
/// not joined, wind, and torques as loads; [`StaticError::Loops`] for several loops.
pub fn branches(model: &Model, state: &State, params: &BranchParams) -> Result<Branches, StaticError> {
    model.validate(state)?;
    params.rest.validate()?;
    if params.most == 0 {
        return Err(StaticParamsError { name: "most", value: 0.0, allowed: "> 0" }.into());
    }
    only_elastic(model, "the search for several equilibria")?;
    without_eyelets(model, "the search for several equilibria")?;
    unbreakable(model, "the search for several equilibria")?;
    without_contacts(model, "the search for several equilibria")?;
    if is_windy(model) {
        return Err(StaticError::Branches("a scene without wind, whose drag has no energy"));
    }
    let mut state = state.clone();
    state.velocities.fill(nalgebra::Vector3::zeros());
    state.angular_velocities.fill(nalgebra::Vector3::zeros());
    let mut sets = split(model);
    let (Some((members, topology)), None) = (sets.pop(), sets.pop()) else {
        return Err(StaticError::Branches("rods that are joined to one another; take sets that are not one by one"));
    };
    let topology = std::sync::Arc::new(topology);
    let mut component = Component::new(model, &state, topology.clone(), &[&members]);
    component.hold_still();
    component.stop_inner_damping();
    if component.has_torques() {
        return Err(StaticError::Branches(
            "loads that are forces fixed in space: torques, and loads that follow their segments, have no energy",
        ));
    }
    let elimination = Elimination::new(&topology).ok_or(StaticError::Loops("the search for several equilibria"))?;
    let balance = Balance::new(component, elimination, 1.0);
    let mut search = Search { model, members, topology, balance, state, params: *params, known: Vec::new(), solves: 0 };
    search.run();
    let mut branches: Vec<Branch> = search.known.into_iter().filter_map(|known| known.branch).collect();
    branches.sort_by(|a, b| a.energy.total_cmp(&b.energy));
    Ok(Branches { branches, solves: search.solves })
}

/// A search under way.
struct Search<'a> {
    model: &'a Model,
    members: Members,
    topology: std::sync::Arc<Topology>,
    balance: Balance,
    state: State,
    params: BranchParams,
    known: Vec<Known>,
    solves: usize,
}

/// An equilibrium that was found.
struct Known {
    place: Place,
    unstable: usize,
    /// `None` where it is not told: one with another by a motion without resistance, or unstable in too many directions.
    branch: Option<Branch>,
}

impl Search<'_> {
    fn run(&mut self) {
        let start = self.balance.place(0.0);
        // Nothing leads away from a start at rest: bent to either side it is none.
        let mut starts = vec![start.clone(), self.bent(&start, BENT), self.bent(&start, -BENT)];
        if self.topology.fixed.iter().filter(|&&fixed| fixed).count() > 1 {
            starts.extend([1.0, -1.0].map(|turns| self.twisted(&start, turns)));
        }
        for start in &starts {
            if !self.is_over() {
                self.descend(start);
            }
        }
        for start in &starts {
            for _ in 0..SEARCHES {
                if self.is_over() || !self.deflate(start) {
                    break;
                }
            }
        }
        // Unstable ones are left to both sides, those that come up on the way too.
        let mut next = 0;
        while next < self.known.len() && !self.is_over() {
            if self.known[next].unstable > 0 {
                let place = self.known[next].place.clone();
                for side in [ASIDE, -ASIDE] {
                    let start = self.bent(&place, side);
                    self.descend(&start);
                }
            }
            next += 1;
        }
    }

    fn is_over(&self) -> bool {
        let found = self.known.iter().filter(|known| known.branch.is_some()).count();
        found >= self.params.most || self.solves >= self.params.rest.max_steps
    }

    /// A place with so many turns of twist more, spread along the segments.
    fn twisted(&self, place: &Place, turns: f64) -> Place {
        let count = self.members.segments.len() as f64;
        self.turned(place, |k, pose| pose.q.axis() * (TAU * turns * (k as f64 + 0.5) / count))
    }

    /// A place whose segments are turned a little, in long waves.
    fn bent(&self, place: &Place, angle: f64) -> Place {
        let count = self.members.segments.len() as f64;
        self.turned(place, |k, _| {
            let place = (k as f64 + 0.5) / count;
            Vec3([(1.3 * place).sin(), (2.3 * place).sin(), (4.1 * place).sin()]) * angle
        })
    }

    /// A place whose free segments are turned by rotation vectors; forces are forgotten.
    fn turned(&self, place: &Place, by: impl Fn(usize, &BodyPose<f64>) -> Vec3<f64>) -> Place {
        let mut place = place.clone();
        for (k, pose) in place.poses.iter_mut().enumerate().take(self.members.segments.len()) {
            if self.topology.fixed[k] {
                continue;
            }
            let turn = by(k, pose);
            let angle = turn.norm_squared().sqrt();
            let share = if angle > 0.0 { (0.5 * angle).sin() / angle } else { 0.5 };
            pose.q = (Quat { v: turn * share, w: (0.5 * angle).cos() } * pose.q).normalized();
        }
        place.lambda.fill(Spatial::zero());
        place
    }

    /// Goes down to a stable equilibrium, and adds it.
    fn descend(&mut self, start: &Place) {
        self.balance.stand(start, 0.0);
        let Some(memory) = newton::fits(&self.balance.component, &self.topology) else { return };
        let max_steps = self.params.rest.max_steps.saturating_sub(self.solves);
        let params = StaticParams { leave_unstable: true, max_steps, ..self.params.rest };
        let report = newton::descend(&mut self.balance.component, memory, &mut Contacts::default(), &params);
        self.solves += report.steps;
        if report.converged {
            let place = self.balance.place(0.0);
            self.add(place);
        }
    }

    /// Newton's method away from all that is known; whether that came to something new.
    fn deflate(&mut self, start: &Place) -> bool {
        let mut place = start.clone();
        for _ in 0..ITERATIONS {
            self.solves += 1;
            let Some((own, _)) = self.balance.step(&place, 1.0) else { return false };
            let size = self.balance.size(&own);
            if !size.is_finite() {
                return false;
            }
            let stretched = 1.0 / (1.0 - self.slope(&place, &own));
            let share = stretched.signum() * stretched.abs().min(LARGEST / size);
            if size <= self.params.rest.tolerance {
                return self.add(place);
            }
            let mut step = own;
            step.dp.iter_mut().for_each(|dp| *dp = Spatial::zero().plus(*dp, share));
            // Forces follow from the balance whatever the share of the step; moments are those of the bending.
            step.dlambda.iter_mut().for_each(|change| change.angular = change.angular * share.clamp(-1.0, 1.0));
            place = place.moved(&step, 1.0);
        }
        false
    }

    /// By how much the logarithm of the deflation grows along a step.
    fn slope(&self, place: &Place, step: &Direction) -> f64 {
        let of = |known: &Known| {
            let way = known.place.to(place);
            let squared = self.balance.dot(&way, &way).max(f64::MIN_POSITIVE);
            -2.0 * self.balance.dot(&way, step) / (squared * (1.0 + squared))
        };
        self.known.iter().map(of).sum()
    }

    /// Adds an equilibrium, unless it is known; whether it was not.
    fn add(&mut self, place: Place) -> bool {
        // Once more, for forces that fit the poses to the last digits.
        let Some((own, _)) = self.balance.step(&place, 1.0) else { return false };
        let place = place.moved(&own, 1.0);
        let counts =
            [1.0, NEUTRAL, -NEUTRAL].map(|nudge| self.balance.step(&place, nudge).map(|(_, unstable)| unstable));
        self.solves += 4;
        let [Some(unstable), Some(stiffer), Some(softer)] = counts else { return false };
        if self.known.iter().any(|known| self.balance.distance(&known.place, &place) < SAME) {
            return false;
        }
        let neutral = stiffer != softer;
        self.balance.stand(&place, 0.0);
        let mut state = self.state.clone();
        self.balance.component.store_state(&mut state, &self.members, 0);
        let energy = measure::energy(self.model, &state).total();
        let is_one = |branch: &Branch| {
            let scale = energy.abs().max(branch.energy.abs());
            branch.neutral
                && neutral
                && branch.unstable == unstable
                && (branch.energy - energy).abs() <= SAME_ENERGY * scale
        };
        let is_told = self.known.iter().filter_map(|known| known.branch.as_ref()).any(is_one);
        let tells = !is_told && unstable <= MOST_UNSTABLE;
        let branch = tells.then_some(Branch { state, energy, unstable, neutral });
        self.known.push(Known { place, unstable, branch });
        true
    }
}

//! Sliding joints of a component: the eyelet's place along the rod as an unknown of the step.
//!
//! With c(s) the point of the rod's smooth centreline at the distance s from its start ([`rod::Centreline`]), r the eyelet and F the force on
//! the rod (times dt^2, as all impulses are here), a step solves
//!
//! ```text
//! r - c(s) = 0                      the eyelet is on the centreline
//! c'(s).F = sigma k |c'(s)| |F|     it slides: friction along the rod, k = sin(atan(mu))
//! s = s_0                           or it sticks, where |c'(s_0).F| <= k |c'| |F|
//! ```
//!
//! A feed drives the rod through its eyelet: it sticks at `s_0 - v dt` as long as the drive's largest force allows (`store.rs`).
//!
//! beside the balance of momentum, to which F adds. Newton's method takes all of it together: what the rod answers comes from the factor of
//! its own equations, and a small border has the forces and places (`dynamics/src/attempt/exact/sliding.rs`). It is the work-conjugate
//! pair of constraint and force of a Lagrange multiplier with a moving material point, as in Eulerian-on-Lagrangian cables (Sueda et al. 2011),
//! on a centreline with a continuous tangent.

mod feed;
mod pulley;
mod step;
mod store;
mod turn;

use kernels::Spatial;
use kernels::math::Vec3;
use rod::Centreline;

/// Unknowns of a sliding joint: its force and its place.
const UNKNOWNS: usize = 4;

/// Whether an eyelet stays at its place on the rod.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Slip {
    /// It stays where it was at the start of the step, or at an end of the rod.
    Sticks,
    /// It moves along the rod with this sign.
    Slides(f64),
}

/// Whether a rod sticks to the wheel of a pulley, now and at the start of the step.
#[derive(Clone, Copy, Debug)]
struct SlipOfPulley {
    now: Slip,
    at_start: Slip,
}

/// A sliding joint in motion.
#[derive(Clone, Debug)]
struct Eyelet {
    /// Which one of the model.
    index: usize,
    /// The rod's first body.
    first: usize,
    line: Centreline,
    holder: usize,
    /// In the holder's frame [m].
    at: Vec3<f64>,
    friction: f64,
    /// What drives the rod through it.
    drive: Option<feed::Drive>,
    /// Places between which it stays [m].
    range: [f64; 2],
    /// sin(atan(mu)) of this step: see [`crate::Component::begin_sliding`].
    share: f64,
    /// Distance along the rod [m], now and at the start of the step.
    place: f64,
    start: f64,
    /// Its rate over the last step [m/s].
    rate: f64,
    slip: Slip,
    slip_at_start: Slip,
    /// Force on the rod times dt^2 [N s^2].
    force: Vec3<f64>,
    /// Force at the end of the last step [N].
    last_force: Vec3<f64>,
    /// The place to which it sticks.
    target: f64,
    /// Where it goes in the step under way if it does not slip: where it was, or where it is driven.
    carried: f64,
    /// The last step's change of force and place.
    change: (Vec3<f64>, f64),
}

/// The eyelets and pulleys through which and over which rods of a component run.
#[derive(Clone, Debug, Default)]
pub(super) struct Eyelets {
    all: Vec<Eyelet>,
    pulleys: Vec<(pulley::Pulley, SlipOfPulley)>,
    /// Per body: what they do to it; empty where there are none.
    impulses: Vec<Spatial<f64>>,
}

/// What the unknowns of an eyelet or of a pulley do to bodies, and bodies to its equations: its share of the border.
#[derive(Clone, Debug, Default)]
pub struct Border {
    /// Bodies that move.
    pub bodies: Vec<usize>,
    /// What a unit of each unknown adds to force and torque on each body: unknown by unknown, body by body.
    pub columns: Vec<Spatial<f64>>,
    /// How each equation changes as each body moves, in the same order.
    pub rows: Vec<Spatial<f64>>,
    /// How its equations change with its own unknowns, row by row.
    pub own: Vec<f64>,
    /// What they miss.
    pub missed: Vec<f64>,
    /// The same as `own` for what contacts see: without friction and drives, so that it is symmetric.
    pub seen: Vec<f64>,
    /// How many unknowns, the last ones, contacts do not see.
    pub unseen: usize,
}

impl Border {
    /// Number of its unknowns.
    pub fn unknowns(&self) -> usize {
        self.missed.len()
    }

    /// Begins one with so many unknowns.
    fn begin(&mut self, unknowns: usize) {
        self.bodies.clear();
        self.columns.clear();
        self.rows.clear();
        self.unseen = 0;
        self.missed.clear();
        self.missed.resize(unknowns, 0.0);
        for own in [&mut self.own, &mut self.seen] {
            own.clear();
            own.resize(unknowns * unknowns, 0.0);
        }
    }
}

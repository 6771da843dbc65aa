//! How much the integrator brakes what goes round, driven or free.
//!
//! A step of Euler's rule takes `2 psi^2` of the kinetic energy of what turns the direction of its velocity by psi, one of backward
//! differences of second order `psi^4`: that of an oscillation in two directions, whose other half is what holds it.

use std::f64::consts::TAU;
use std::fmt::{self, Display, Formatter};

use cosserat::scene::Scene;
use cosserat::simulation::Integrator;
use cosserat::state::Body;
use serde::Serialize;

use crate::braking::Braking;
use crate::coarse::{Loss, at_stake};
use crate::held::place;
use crate::measured::Measured;

/// Part of the energy at stake that is kinetic in the mean where something moves to speak of.
const MOVES: f64 = 0.02;
/// What goes round is two oscillations, whose losses its kinetic energy alone bears.
const AS_AN_OSCILLATION: f64 = 2.0;

/// A motion that the integrator brakes much.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Braked {
    /// What turns fastest, in words.
    what: String,
    /// Mean angle by which velocities turn in a step, weighted by their kinetic energy [rad].
    turn_a_step_rad: f64,
    /// Part of the kinetic energy that the integrator takes in a whole turn.
    lost_a_turn: f64,
    #[serde(flatten)]
    loss: Loss,
}

impl Braked {
    /// That of a run of `steps` steps; `None` where little is lost, where velocities turn by less than a whole turn, and where next to
    /// nothing moves.
    pub(crate) fn of(scene: &Scene, integrator: Integrator, steps: usize, measured: &Measured) -> Option<Self> {
        let Braking { steps: seen, energy, turn, squared, most: (fastest, _), .. } = measured.braking;
        let moves = energy > 0.0 && energy >= MOVES * at_stake(&scene.model, measured) * seen;
        if !moves || turn / energy * (steps as f64) < TAU {
            return None;
        }
        let psi = squared / turn;
        let loss = Loss::of(integrator, psi, AS_AN_OSCILLATION, scene.run.dt)?;
        let what = place(scene, Body::Segment(fastest));
        Some(Self { what, turn_a_step_rad: psi, lost_a_turn: loss.part, loss })
    }
}

impl Display for Braked {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self { what, loss, .. } = self;
        loss.tell(f, format_args!("the kinetic energy of what goes round ({what}) in each turn"))
    }
}

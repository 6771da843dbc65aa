//! Where the guesses stand: the iterations and the time of each relative to a zero start, over many simulations, apart
//! for the first steps, later ones, and those after an impulse.
//!
//! A ratio is the sum over a simulation's solves, the guess's divided by the zero start's on the same systems; over the
//! simulations its median, quartiles and mean are told. Times of a guess include all that it does: its start and what
//! it learns.

use nalgebra::Vector3;
use rod::{Model, State};
use serde::{Deserialize, Serialize};
use solver::linear::precondition::PreconditionerKind;
use solver::simulation::{Settings, Simulation, SimulationError};

use crate::starts::{self, Measured, Plan, Tally};

/// Steps that are told apart, counted from 1; the last are those after the impulse.
pub const BUCKETS: [&str; 6] = ["step 1", "step 2", "step 3", "steps 4 to 10", "later steps", "after the impulse"];
/// The step after which the rod is struck.
pub const IMPULSE_AFTER: usize = 60;
/// Steps that feel it most.
pub const IMPULSE_STEPS: usize = 5;
/// Speed that it gives to the tip [m/s].
pub const IMPULSE_SPEED: f64 = 2.0;
/// Of the later steps every fifth is measured.
pub const EVERY: usize = 5;

/// The bucket of each of `steps` steps.
pub fn buckets(steps: usize) -> Vec<Option<usize>> {
    let bucket = |step: usize| match step {
        1..=3 => Some(step - 1),
        4..=10 => Some(3),
        _ if (1..=IMPULSE_STEPS).contains(&step.saturating_sub(IMPULSE_AFTER)) => Some(5),
        _ => step.is_multiple_of(EVERY).then_some(4),
    };
    (1..=steps).map(bucket).collect()
}

/// Measures one scene over `plan.buckets.len()` steps, with the impulse; after each step `progress()` says whether to
/// go on.
///
/// # Errors
/// If the scene or the settings are not valid.
pub fn measure(
    model: &Model,
    state: &State,
    dt: f64,
    settings: &Settings,
    plan: &Plan<'_>,
    mut progress: impl FnMut() -> bool,
) -> Result<Measured, SimulationError> {
    let mut now = state.clone();
    let after = |step: usize, simulation: &mut Simulation| {
        if step == IMPULSE_AFTER {
            simulation.store(&mut now);
            strike(model, &mut now);
            simulation.set_velocities(&now);
        }
        progress()
    };
    starts::run(model, state, (dt, plan.buckets.len()), settings, plan, after)
}

/// Adds the velocities of a turn of the whole model about its first segment, with [`IMPULSE_SPEED`] at the last one,
/// about the horizontal axis across the line between the two: in the plane of a planar rod that hangs in one.
pub fn strike(model: &Model, state: &mut State) {
    let (Some(&first), Some(&last)) = (state.positions.first(), state.positions.last()) else { return };
    let up = if model.gravity.norm() > 0.0 { -model.gravity } else { Vector3::z() };
    let arm = last - first;
    let Some(axis) = [up.cross(&arm), Vector3::x().cross(&arm)].into_iter().find_map(|w| w.try_normalize(1e-9)) else {
        return;
    };
    let turn = axis * (IMPULSE_SPEED / arm.norm());
    for (i, segment) in model.segments.iter().enumerate() {
        if !segment.fixed {
            state.velocities[i] += turn.cross(&(state.positions[i] - first));
            state.angular_velocities[i] += turn;
        }
    }
}

/// How a number is spread over simulations.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Mean.
    pub mean: f64,
    /// Lower quartile.
    pub lower: f64,
    /// Median.
    pub median: f64,
    /// Upper quartile.
    pub upper: f64,
}

impl Spread {
    /// Of these values, those that are not finite left out; `None` where nothing is left.
    pub fn of(values: impl Iterator<Item = f64>) -> Option<Self> {
        let mut values: Vec<f64> = values.filter(|x| x.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        let last = values.len().checked_sub(1)?;
        let at = |fraction: f64| {
            let place = fraction * last as f64;
            let (low, high) = (values[place.floor() as usize], values[place.ceil() as usize]);
            low + (high - low) * place.fract()
        };
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        Some(Self { mean, lower: at(0.25), median: at(0.5), upper: at(0.75) })
    }
}

/// A guess, or the direct solver, beside the zero start: on the same systems, with one preconditioner and tolerance of
/// conjugate gradients, in the steps of one bucket.
#[derive(Clone, Debug)]
pub struct BesideZero {
    /// Guess; [`DIRECT`] for the direct solver.
    pub guess: String,
    /// Preconditioner.
    pub preconditioner: PreconditionerKind,
    /// Tolerance, relative to the right-hand side.
    pub tolerance: f64,
    /// Of each simulation the sums of the zero start and its own.
    pub sums: Vec<[Tally; 2]>,
}

impl BesideZero {
    /// A count, over all simulations.
    pub fn count(&self, of: fn(&Tally) -> u64) -> u64 {
        self.sums.iter().map(|[_, own]| of(own)).sum()
    }

    /// A number of each simulation, from the sums of the zero start and its own.
    pub fn spread(&self, value: impl Fn(&Tally, &Tally) -> f64) -> Option<Spread> {
        Spread::of(self.sums.iter().map(|[zero, own]| value(zero, own)))
    }

    /// Iterations relative to the zero start's; `None` for the direct solver, which has none.
    pub fn iteration_ratio(&self) -> Option<Spread> {
        self.spread(|zero, own| own.iterations as f64 / zero.iterations as f64).filter(|_| self.guess != DIRECT)
    }

    /// Time relative to the zero start's, the guess's own included.
    pub fn time_ratio(&self) -> Option<Spread> {
        self.spread(|zero, own| (own.guess_s + own.solve_s) / zero.solve_s)
    }
}

/// Name of the direct solver among the guesses.
pub const DIRECT: &str = "direct solve";

/// Each guess of a plan (the first must be the zero start, the direct solver comes last) in each column, in one bucket of
/// the plan.
pub fn beside_zero(plan: &Plan<'_>, simulations: &[Measured], bucket: usize) -> Vec<BesideZero> {
    let guesses = plan.guesses.iter().map(|(name, _)| name.as_str()).chain([DIRECT]).enumerate();
    let of = |(g, guess): (usize, &str)| {
        let guess = guess.to_owned();
        plan.columns().enumerate().map(move |(column, (preconditioner, tolerance))| {
            let own = |measured: &Measured| match plan.guesses.get(g) {
                Some(_) => measured.tally(bucket, g, column),
                None => measured.direct(bucket),
            };
            let sums = simulations.iter().map(|measured| [measured.tally(bucket, 0, column), own(measured)]);
            BesideZero { guess: guess.clone(), preconditioner, tolerance, sums: sums.collect() }
        })
    };
    guesses.flat_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_told_apart() {
        let all = buckets(100);
        assert_eq!(all[..4], [Some(0), Some(1), Some(2), Some(3)]);
        assert_eq!((all[9], all[10], all[14]), (Some(3), None, Some(4)));
        assert_eq!(all[59..66], [Some(4), Some(5), Some(5), Some(5), Some(5), Some(5), None]);
        assert_eq!(all.iter().filter(|&&bucket| bucket == Some(4)).count(), 17);
        assert_eq!(buckets(2).len(), 2);
    }

    #[test]
    fn a_spread_has_its_quartiles_and_leaves_out_what_is_not_finite() {
        let spread = Spread::of([4.0, 1.0, f64::NAN, 3.0, 2.0, 10.0].into_iter());
        assert_eq!(spread, Some(Spread { mean: 4.0, lower: 2.0, median: 3.0, upper: 4.0 }));
        assert_eq!(Spread::of([f64::NAN].into_iter()), None);
    }

    #[test]
    fn ratios_are_of_sums_within_a_simulation() {
        let tally = |iterations, solve_s, guess_s| Tally { solves: 2, dropped: 1, iterations, solve_s, guess_s };
        let sums = [10, 20, 60].map(|own| [tally(100, 4.0, 0.0), tally(own, 1.0, 1.0)]).to_vec();
        let of = |guess: &str| BesideZero {
            guess: guess.to_owned(),
            preconditioner: PreconditionerKind::Raw,
            tolerance: 1e-4,
            sums: sums.clone(),
        };
        let (net, median) = (of("net"), |spread: Option<Spread>| spread.map(|spread| spread.median));
        assert_eq!((median(net.iteration_ratio()), median(net.time_ratio())), (Some(0.2), Some(0.5)));
        assert_eq!((net.count(|own| own.dropped), of(DIRECT).iteration_ratio()), (3, None));
    }

    #[test]
    fn the_impulse_turns_the_rod_about_its_clamp_within_its_plane() {
        let mut assembly = rod::Assembly::new(Vector3::new(0.0, 0.0, -9.81));
        let nodes = rod::shape::straight(Vector3::zeros(), Vector3::new(1.0, 0.0, -0.5), 3.0, 10);
        let material = rod::Material { youngs_modulus: 1e5, torsion_modulus: 1e5, density: 100.0 };
        let rod = assembly.rod(&rod::RodSpec::new(nodes, 0.05, material));
        assembly.fix(rod.start);
        let (model, mut state) = assembly.finish();
        strike(&model, &mut state);
        assert!((state.velocities[9].norm() - IMPULSE_SPEED).abs() < 1e-12);
        assert_eq!((state.velocities[0].norm(), state.angular_velocities[0].norm()), (0.0, 0.0));
        for i in 1..10 {
            let (v, axis) = (state.velocities[i], state.axis(i));
            assert!(v.y.abs() < 1e-12 && v.dot(&axis).abs() < 1e-12 && v.norm() > 0.1);
            assert!((state.angular_velocities[i] - state.angular_velocities[9]).norm() < 1e-12);
        }
    }
}

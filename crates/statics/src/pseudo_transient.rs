//! The flow `M (p' - p) = dt^2 (f_ext(p') + J^T f)` without velocities: it goes down in energy.
//!
//! Its implicit steps are those of formulation `newton` with the velocities left out. `dt` grows while little moves and
//! shrinks where much does, until steps as long as one likes move nothing any more.

use component::Component;
use component::Formulation;
use jointed::linear::{LinearSolver, LinearStatus};
use kernels::Spatial;

use super::newton::ROUNDING;
use super::params::StaticParams;
use super::report::StaticReport;

/// A larger turn of a segment in one step [rad] takes the step back.
const LARGEST_TURN: f64 = 1.0;
/// Turn that a step aims at [rad].
const GOOD_TURN: f64 = 0.3;
/// Quiet steps in a row that count as equilibrium; each is four times as long as the one before where swinging allows.
const QUIET_STEPS: usize = 5;
/// Share of its yield moment by which a joint with a law may miss its moment where a step counts as swinging: a joint that begins to yield
/// brings segments back, too, however short the step. Loops by Masing's rule end unsolved without it.
const OF_MOMENT: f64 = 1e-3;
/// Pseudo time steps longer than this many first ones bring nothing but rounding errors.
const LONGEST: f64 = 1e6;

/// Follows the flow to its end.
pub(super) fn relax(
    component: &mut Component<f64>,
    solver: &mut dyn LinearSolver,
    params: &StaticParams,
) -> StaticReport {
    let mut report = StaticReport::default();
    let mut dt = params.first_dt;
    let mut longest = params.first_dt * LONGEST;
    let mut quiet = 0;
    let mut last = vec![Spatial::zero(); component.segments()];
    // Multipliers over dt^2: forces and moments, the same whatever dt.
    let mut forces = component.lambda.clone();
    let mut before = component.poses.clone();
    while report.steps < params.max_steps {
        report.steps += 1;
        before.copy_from_slice(&component.poses);
        component.evaluate_drag(0.0, dt);
        component.predict(0.0, dt, Formulation::Xpbd);
        component.poses.copy_from_slice(&before);
        for (lambda, force) in component.lambda.iter_mut().zip(&forces) {
            *lambda = lambda.plus(*force, dt * dt);
        }
        component.evaluate(Formulation::Newton);
        let info = solver.solve(&component.system, false, &mut component.dlambda);
        component.drop_free();
        if info.status != LinearStatus::Solved {
            // With loops and a long step the compliances are too small a share of the matrix to make it definite.
            component.roll_back();
            dt *= 0.25;
            longest = dt;
            quiet = 0;
            continue;
        }
        component.update(Formulation::Newton, 1.0);
        let step = movement(component, &mut last);
        report.movement = step.shift.max(step.turn);
        // Turns alone make the equations nonlinear; and what is not a number is taken back, too.
        if !(step.turn <= LARGEST_TURN && step.shift.is_finite()) {
            component.roll_back();
            last.fill(Spatial::zero());
            dt *= 0.25;
            quiet = 0;
            continue;
        }
        for (force, lambda) in forces.iter_mut().zip(&component.lambda) {
            *force = Spatial::zero().plus(*lambda, 1.0 / (dt * dt));
        }
        quiet = if report.movement <= params.tolerance { quiet + 1 } else { 0 };
        if quiet == QUIET_STEPS {
            // Little moves in short steps in any case.
            report.converged = dt >= params.first_dt;
            break;
        }
        if step.swings && component.missed_by_laws() <= OF_MOMENT {
            longest = 0.25 * dt;
        }
        dt = (dt * (GOOD_TURN / step.turn.max(1e-300)).clamp(0.5, 4.0)).min(longest);
    }
    component.transmit(&forces);
    report
}

/// How a step moved the segments.
struct Movement {
    /// Largest shift [segment lengths].
    shift: f64,
    /// Largest turn [rad].
    turn: f64,
    /// Whether the segments swing back by more than half of the step before. The flow does not: the step is too long for
    /// a mass matrix that leaves out how torques change as joints turn.
    swings: bool,
}

/// Compares the step with the `last` one and puts it in its place.
fn movement(component: &Component<f64>, last: &mut [Spatial<f64>]) -> Movement {
    let (mut shift, mut turn, mut back, mut size) = (0.0_f64, 0.0_f64, 0.0, 0.0);
    for (body, last) in last.iter_mut().enumerate() {
        let now = component.movement(body);
        // What is not a number stays.
        let larger = |x: f64, y: f64| if x.is_nan() || x >= y { x } else { y };
        shift = larger(shift, now.linear.norm_squared());
        turn = larger(turn, now.angular.norm_squared());
        back -= now.angular.dot(last.angular);
        size += last.angular.norm_squared();
        *last = now;
    }
    let turn = turn.sqrt();
    // A model may begin at rest: rounding errors are no swinging.
    Movement { shift: shift.sqrt(), turn, swings: back > 0.5 * size && turn > ROUNDING }
}

//! Natural modes: the small free vibrations about an equilibrium.
//!
//! About an equilibrium bodies swing as `K phi = omega^2 M phi`: K is the tangent of [`jointed::tangent`], the forces that the
//! joints transmit at rest included, with their compliances as rows of their own. A step of the length h has the matrix
//! `M + h^2 K`, which is eliminated in O(N). Its inverse times M has the same shapes, with the eigenvalues
//! `theta = 1 / (1 + h^2 omega^2)`: the lowest frequencies are the largest (shift and invert; Ericsson and Ruhe 1980).

mod damping;
mod krylov;

use component::Formulation;
use component::{BodyPose, Component, split};
use jointed::linear::LinearSolver;
use jointed::linear::solvers::SolverKind;
use jointed::tangent::Equations;
use jointed::tangent::elimination::Elimination;
use kernels::Spatial;
use kernels::math::Sym3;
use nalgebra::{UnitQuaternion, Vector3, Vector6};
use rod::{Model, State};

use self::krylov::{Field, Masses, Pair};
use crate::error::{StaticError, without_contacts, without_eyelets};
use crate::{StaticParams, StaticReport, equilibrium};

/// A natural mode.
#[derive(Clone, Debug, PartialEq)]
pub struct Mode {
    /// omega^2 [rad^2/s^2]: below zero where the equilibrium is unstable, zero of what moves freely, or so slowly beside the
    /// others that rounding hides it.
    pub squared: f64,
    /// Damping ratio, the share of critical damping, to first order in what damps: the surroundings ([`rod::Damping`]) and the
    /// joints ([`rod::InnerDamping`]); air is left out. Zero where nothing swings.
    pub damping: f64,
    /// Shifts of the segments' centres, one entry a segment of the model [m]. With the turns they have the modal mass 1 kg.
    pub shifts: Vec<Vector3<f64>>,
    /// Rotation vectors of the segments in world axes [rad].
    pub turns: Vec<Vector3<f64>>,
    /// By how much it is no mode: the norm of what shape and frequency leave of the eigenvalue problem, over the eigenvalue.
    /// The frequency is off by about the square of it.
    pub residual: f64,
}

impl Mode {
    /// Natural frequency [Hz]; zero where there is none.
    pub fn frequency(&self) -> f64 {
        self.squared.max(0.0).sqrt() / std::f64::consts::TAU
    }

    /// The state at `rest`, displaced by the shape times `amplitude`.
    pub fn displaced(&self, rest: &State, amplitude: f64) -> State {
        let mut state = rest.clone();
        for (i, (shift, turn)) in self.shifts.iter().zip(&self.turns).enumerate() {
            state.positions[i] += shift * amplitude;
            state.orientations[i] = UnitQuaternion::from_scaled_axis(turn * amplitude) * rest.orientations[i];
        }
        state
    }

    /// The largest shift [m] and the largest turn [rad] of the shape.
    pub fn largest(&self) -> [f64; 2] {
        [&self.shifts, &self.turns].map(|of| of.iter().map(|x| x.norm()).fold(0.0, f64::max))
    }
}

/// The lowest modes about an equilibrium.
#[derive(Clone, Debug)]
pub struct Modes {
    /// The lowest first.
    pub modes: Vec<Mode>,
    /// How the equilibrium was found.
    pub equilibrium: StaticReport,
}

/// Most lengths of the step that are tried.
const SHIFTS: usize = 40;
/// Swings by less than this in a step [rad] are free movements, or too slow for the step to tell.
const FREE: f64 = 1e-3;
/// Steps beyond this [s] find nothing more.
const LONGEST: f64 = 1e6;
/// Times that a solution for a ring is refined.
const REFINEMENTS: usize = 2;
/// Iterations in which the joints' forces follow from the poses at rest.
const ITERATIONS: usize = 3;

/// The `count` lowest natural modes about the equilibrium to which [`equilibrium`] brings `state`. Drag is left out, and damping
/// changes no frequency; a wind's force stays as it is at rest. Joints with laws answer as [`rod::JointLaw::sudden`] says: small vibrations
/// neither yield nor slip, and are too fast for joints to relax.
///
/// # Errors
/// As [`equilibrium`], and [`StaticError::Loops`] where rods form more than one loop, [`StaticError::Torques`] where
/// torques are loads.
pub fn modes(model: &Model, state: &mut State, count: usize, params: &StaticParams) -> Result<Modes, StaticError> {
    modes_telling(model, state, count, params, &mut |_| true)
}

/// [`modes`], which tells how many of a connected set's modes are found so far, again and again, and is told whether to go on:
/// where not, it leaves out what is not found.
///
/// # Errors
/// As [`modes`].
pub fn modes_telling(
    model: &Model,
    state: &mut State,
    count: usize,
    params: &StaticParams,
    tell: &mut dyn FnMut(usize) -> bool,
) -> Result<Modes, StaticError> {
    without_eyelets(model, "modal analysis")?;
    without_contacts(model, "modal analysis")?;
    let equilibrium = equilibrium(model, state, params)?;
    let mut modes = Vec::new();
    for (members, topology) in split(model) {
        let topology = std::sync::Arc::new(topology);
        let mut component = Component::new(model, state, topology.clone(), &[&members]);
        component.hold_still();
        component.stop_inner_damping();
        component.change_laws_suddenly();
        let solver = SolverKind::Direct.build(model, &members, &topology)?;
        if component.has_torques() {
            return Err(StaticError::Torques);
        }
        let elimination = Elimination::new(&topology).ok_or(StaticError::Loops("modal analysis"))?;
        let rest = component.poses.clone();
        let masses: Vec<_> = (0..rest.len()).map(|i| component.mass_and_inertia(i)).collect();
        let mut problem = Problem { component, solver, elimination, equations: Equations::default(), rest };
        for (squared, pair) in problem.lowest(&masses, count, tell) {
            let mut mode = Mode {
                squared,
                damping: problem.damping_ratio(model, &members, &masses, squared, &pair),
                shifts: vec![Vector3::zeros(); state.len()],
                turns: vec![Vector3::zeros(); state.len()],
                residual: pair.residual,
            };
            for (&index, x) in members.segments.iter().zip(&pair.vector) {
                (mode.shifts[index], mode.turns[index]) = (x.fixed_rows::<3>(0).into(), x.fixed_rows::<3>(3).into());
            }
            modes.push(mode);
        }
    }
    modes.sort_by(|a, b| a.squared.total_cmp(&b.squared));
    modes.truncate(count);
    Ok(Modes { modes, equilibrium })
}

/// The eigenvalue problem of a connected set.
struct Problem {
    component: Component<f64>,
    solver: Box<dyn LinearSolver<f64>>,
    elimination: Elimination,
    equations: Equations,
    /// Poses at rest.
    rest: Vec<BodyPose<f64>>,
}

impl Problem {
    /// The lowest modes, as omega^2 and the shape. `masses` are mass and inertia of the bodies, without what air adds to them;
    /// `None` where one is held.
    fn lowest(&mut self, masses: &Masses, count: usize, tell: &mut dyn FnMut(usize) -> bool) -> Vec<(f64, Pair)> {
        let mut goes_on = true;
        let mut step = 1.0;
        let mut found = Vec::new();
        for _ in 0..SHIFTS {
            if !self.set_up(step, masses) {
                // It falls over faster than that.
                step *= 0.25;
                continue;
            }
            let count = count.min(6 * masses.iter().flatten().count());
            if count == 0 {
                break;
            }
            let known = if masses.iter().all(Option::is_some) { self.free_movements() } else { Vec::new() };
            let mut tell = |found: usize| {
                goes_on = tell(found);
                goes_on
            };
            found = krylov::largest(&mut |x| self.solved(x).0, masses, count, known, &mut tell)
                .into_iter()
                .map(|pair| ((1.0 / pair.value - 1.0) / (step * step), pair))
                .collect();
            let swings = found.iter().map(|(squared, _)| squared.abs().sqrt());
            let slowest = swings.filter(|omega| omega * step > FREE).fold(f64::INFINITY, f64::min);
            let better = if slowest.is_finite() { 1.0 / slowest } else { 100.0 * step };
            let is_unstable = found.first().is_some_and(|(squared, _)| squared * step * step < -FREE * FREE);
            if (0.3..3.0).contains(&(better / step)) || is_unstable || better > LONGEST || !goes_on {
                break;
            }
            step = better;
        }
        for (squared, _) in found.iter_mut().filter(|(squared, _)| squared.abs().sqrt() * step < FREE) {
            *squared = 0.0;
        }
        found
    }

    /// Sets up the equations of a step of the length `step` [s] at rest. Returns whether their matrix is positive.
    fn set_up(&mut self, step: f64, masses: &Masses) -> bool {
        let Self { component, solver, elimination, equations, rest } = self;
        component.poses.copy_from_slice(rest);
        component.evaluate_drag(0.0, step);
        component.predict(0.0, step, Formulation::Xpbd);
        component.poses.copy_from_slice(rest);
        component.lambda.fill(Spatial::zero());
        for _ in 0..ITERATIONS {
            component.evaluate(Formulation::Newton);
            solver.solve(&component.system, false, &mut component.dlambda);
            component.drop_free();
            component.update(Formulation::Newton, 1.0);
        }
        component.evaluate(Formulation::Newton);
        // The air's share of the inertia is its drag, which is left out.
        component.gather(equations, 0.0);
        component.turn_stretch_frames(equations);
        for (body, mass) in equations.bodies.iter_mut().zip(masses) {
            if let Some((mass, inertia)) = mass {
                body.mass += *mass;
                let m = inertia;
                body.turning += Sym3([m.m11, m.m22, m.m33, m.m12, m.m13, m.m23]);
            }
        }
        elimination.solve(equations) && elimination.mended == 0.0
    }

    /// Shifts along the axes and turns about them of all bodies as one.
    fn free_movements(&self) -> Vec<Field> {
        let of = |k: usize| {
            let axis = Vector3::ith(k % 3, 1.0);
            let of = |pose: &BodyPose<f64>| {
                let place = Vector3::from(pose.x.0);
                let (shift, turn) = if k < 3 { (axis, Vector3::zeros()) } else { (axis.cross(&place), axis) };
                Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
            };
            self.rest.iter().map(of).collect()
        };
        (0..6).map(of).collect()
    }

    /// `(M + h^2 K)^-1 x`, and what the joints transmit then, in world rows.
    fn solved(&mut self, x: &Field) -> (Field, Field) {
        let Self { component, elimination, equations, .. } = self;
        let topology = &component.system.topology;
        for (body, x) in equations.bodies.iter_mut().zip(x) {
            body.defect = Spatial::from_array((*x).into());
        }
        for joint in &mut equations.joints {
            joint.rhs = Spatial::zero();
        }
        elimination.solve(equations);
        let mut found =
            [&elimination.corrections, &elimination.multipliers].map(|list| in_vectors(list).collect::<Field>());
        // The elimination of a ring leaves one body to the end, and loses digits in what is left of it.
        for _ in 0..if topology.elimination.is_none() { REFINEMENTS } else { 0 } {
            equations.subtract(&topology.joints, &elimination.corrections, &elimination.multipliers);
            elimination.solve(equations);
            for (found, more) in found.iter_mut().zip([&elimination.corrections, &elimination.multipliers]) {
                found.iter_mut().zip(in_vectors(more)).for_each(|(x, more)| *x += more);
            }
        }
        found.into()
    }
}

/// Shifts and turns as vectors.
fn in_vectors(list: &[Spatial<f64>]) -> impl Iterator<Item = Vector6<f64>> {
    list.iter().map(|x| x.to_array().into())
}

//! A run that keeps its steps, to go back through them.

use nalgebra::Vector3;
use rod::{Body, Model, State};

use super::adjoint::Adjoint;
use super::replay::Replay;
use super::run::{Passed, Run};
use super::{DerivativeError, HeldVariation, StateVariation, Variation};
use crate::component::Members;
use crate::simulation::{Settings, Simulation, StepReport};

/// A shift and a turn.
pub(super) type Pair = [Vector3<f64>; 2];

/// What a gradient is asked for beyond the first state and held bodies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wanted {
    /// Joints: compliances, rest shapes, inner damping.
    pub joints: bool,
    /// Segments: masses and inertias.
    pub segments: bool,
    /// Loads.
    pub loads: bool,
    /// Gravity, damping and the air.
    pub surroundings: bool,
}

impl Wanted {
    /// All of it.
    pub const ALL: Self = Self { joints: true, segments: true, loads: true, surroundings: true };
}

/// A simulation in formulation `newton` that keeps all its steps, to go back through them.
///
/// Steps are solved as those of [`super::Forward`]. A step of a segment takes about 500 bytes.
pub struct Recording {
    model: Model,
    run: Run,
    sets: Vec<Set>,
}

struct Set {
    adjoint: Adjoint,
    kept: Vec<Passed>,
}

impl Recording {
    /// A simulation of `model` from `state`.
    ///
    /// # Errors
    /// If the formulation is not `newton`, the simulation cannot start, or the model has what is not differentiated.
    pub fn new(model: &Model, state: &State, settings: &Settings) -> Result<Self, DerivativeError> {
        let (run, sets) = Run::new(model, state, settings)?;
        let set = |(members, replay): (Members, Replay)| {
            let adjoint = Adjoint::new(members, replay, (model, state, settings.step.integrator));
            Set { adjoint, kept: Vec::new() }
        };
        Ok(Self { model: model.clone(), run, sets: sets.into_iter().map(set).collect() })
    }

    /// Advances by `dt` [s].
    ///
    /// # Errors
    /// If `dt` is not finite and positive, or the step does not converge, or one before has not: there is no gradient then.
    pub fn step(&mut self, dt: f64) -> Result<StepReport, DerivativeError> {
        let Self { run, sets, .. } = self;
        run.step(dt, &mut |members, passed| {
            if let Some(set) = sets.iter_mut().find(|set| set.adjoint.members == *members) {
                set.kept.extend(passed);
            }
            Some(())
        })
    }

    /// Number of steps so far.
    pub fn steps(&self) -> usize {
        self.run.steps
    }

    /// The simulation itself, for what one reads off it.
    pub fn simulation(&self) -> &Simulation {
        &self.run.simulation
    }

    /// Copies poses and velocities to `state`, which must be of the model's size.
    pub fn store(&self, state: &mut State) {
        self.run.simulation.store(state);
    }

    /// The gradient of a number whose derivatives with respect to states are given: after so many steps (0: the first state),
    /// in any order. Of what is not wanted the gradient is zero. It lists all bodies that are held.
    ///
    /// # Errors
    /// If a list has another size than the model, or names a step that has not been taken; if a step did not converge, or its
    /// equations are singular.
    pub fn backward(
        &mut self,
        objective: &[(usize, StateVariation)],
        wanted: Wanted,
    ) -> Result<Variation, DerivativeError> {
        self.run.check()?;
        for (step, of) in objective {
            of.check(self.model.segments.len())?;
            if *step > self.run.steps {
                return Err(DerivativeError::Size { what: "steps", found: *step, expected: self.run.steps });
            }
        }
        let mut out = Variation::zero(&self.model);
        for set in &mut self.sets {
            set.backward(&self.model, objective, wanted, self.run.steps, &mut out)?;
        }
        Ok(out)
    }
}

impl Set {
    fn backward(
        &mut self,
        model: &Model,
        objective: &[(usize, StateVariation)],
        wanted: Wanted,
        steps: usize,
        out: &mut Variation,
    ) -> Result<(), DerivativeError> {
        let Self { adjoint, kept } = self;
        let held = adjoint.held();
        let mut held_poses = vec![vec![[Vector3::zeros(); 2]; steps]; held.len()];
        adjoint.begin();
        let mut step = steps;
        adjoint.add_objective(objective, step);
        for kept in kept.iter().rev() {
            while step > kept.step + 1 {
                step -= 1;
                adjoint.add_objective(objective, step);
            }
            let singular = DerivativeError::Singular { step: kept.step + 1 };
            adjoint.step_back(model, &kept.substep, wanted, out).ok_or(singular)?;
            for (&body, poses) in held.iter().zip(&mut held_poses) {
                let pose = adjoint.of_held(body);
                let mut add = |step: usize, share: f64| (0..2).for_each(|k| poses[step][k] += pose[k] * share);
                add(kept.step, kept.share);
                if kept.step > 0 {
                    add(kept.step - 1, 1.0 - kept.share);
                }
                adjoint.add_base(body, pose, out);
            }
        }
        while step > 0 {
            step -= 1;
            adjoint.add_objective(objective, step);
        }
        adjoint.end(out);
        let members = &adjoint.members;
        for (body, poses) in held.into_iter().zip(held_poses) {
            let body = match body.checked_sub(members.segments.len()) {
                None => Body::Segment(members.segments[body]),
                Some(anchor) => Body::Anchor(members.anchors[anchor]),
            };
            out.held.push(HeldVariation { body, poses });
        }
        Ok(())
    }
}

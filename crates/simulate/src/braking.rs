//! How far velocities turn in a step.

use cosserat::state::{Model, State};

/// A larger turn in a step is that of an impact, or of what shakes [rad].
const SMOOTH: f64 = 0.5;

/// Sums over the steps that are looked at, weighted by kinetic energy.
#[derive(Clone, Debug, Default)]
pub(crate) struct Braking {
    /// Velocities a step before the frame that is measured next [m/s]; empty where they are not known.
    before: State,
    pub(crate) steps: f64,
    pub(crate) energy: f64,
    pub(crate) turn: f64,
    pub(crate) squared: f64,
    /// The segment with the largest share in `squared`, and that share.
    pub(crate) most: (usize, f64),
}

impl Braking {
    /// Takes the state a step before the one that is observed next.
    pub(crate) fn note(&mut self, state: &State) {
        self.before.velocities.clone_from(&state.velocities);
    }

    /// Looks at the step that led from the state noted to this one.
    pub(crate) fn observe(&mut self, model: &Model, state: &State) {
        if self.before.velocities.is_empty() {
            return;
        }
        self.steps += 1.0;
        for (i, (now, before)) in state.velocities.iter().zip(&self.before.velocities).enumerate() {
            let segment = &model.segments[i];
            let (Some(a), Some(b)) = (now.try_normalize(0.0), before.try_normalize(0.0)) else { continue };
            let psi = (a - b).norm();
            let energy = if segment.fixed { 0.0 } else { 0.5 * segment.mass() * now.norm_squared() };
            if psi > SMOOTH || !energy.is_finite() {
                continue;
            }
            self.energy += energy;
            self.turn += energy * psi;
            let squared = energy * psi * psi;
            self.squared += squared;
            if squared > self.most.1 {
                self.most = (i, squared);
            }
        }
        self.before.velocities.clear();
    }
}

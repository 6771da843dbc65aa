//! How a motion goes on from step to step: the rules, by name. What they compute is the solver's.

use names::names;

/// The rule that integrates the motion in time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Integrator {
    /// Euler's rule: symplectic for the prediction and implicit for what holds the rods together. Of first order; damps fast
    /// and slow oscillations alike by the time step. The COPINGNet paper's.
    Euler,
    /// The backward differences of second order, with steps of Euler's rule after a start, an impact or a change from
    /// outside: slow oscillations keep their energy, fast ones are damped.
    #[default]
    Bdf2,
}

names!(Integrator { Euler = "euler", Bdf2 = "bdf2" });

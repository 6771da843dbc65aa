//! Free vibrations: the shapes of a beam's modes, and what implicit Euler makes of one mode.

use cosserat::simulation::{Simulation, Status};
use cosserat::state::{Model, State};

use crate::{by_euler, tight};

/// Shape, slope (times L) of a clamped-free beam's mode at s = x L.
pub fn bending_mode(beta: f64, x: f64) -> (f64, f64) {
    let sigma = (beta.cosh() + beta.cos()) / (beta.sinh() + beta.sin());
    let (c, s, ch, sh) = ((beta * x).cos(), (beta * x).sin(), (beta * x).cosh(), (beta * x).sinh());
    (ch - c - sigma * (sh - s), beta * (sh + s - sigma * (ch - c)))
}

/// The damped oscillator `x'' + omega^2 (x + tau x') = 0` that implicit Euler turns into the steps that were seen.
#[derive(Clone, Copy, Debug)]
pub struct Mode {
    /// omega [rad/s].
    pub frequency: f64,
    /// tau [s].
    pub relaxation: f64,
    /// Rate at which the steps' amplitude decays [1/s], the time step's own share included.
    pub decay: f64,
}

impl Mode {
    /// Of a `coordinate` that follows one mode alone, over `steps` steps of `dt` [s].
    ///
    /// With h = omega dt and c = h^2 tau / dt implicit Euler does `(1 + h^2 + c) x'' = (2 + c) x' - x` from step to step; the
    /// two factors are found by least squares.
    pub fn seen(model: &Model, state: &State, dt: f64, steps: usize, coordinate: impl Fn(&State) -> f64) -> Self {
        let mut simulation = Simulation::new(model, state, &by_euler(tight()), None).expect("a valid model");
        let mut state = state.clone();
        let mut x = vec![coordinate(&state)];
        for step in 0..steps {
            assert_eq!(simulation.step(dt).expect("a valid step").status, Status::Converged, "step {step}");
            simulation.store(&mut state);
            x.push(coordinate(&state));
        }
        // The first step starts from velocities that are not those of a step.
        let (mut a, mut b, mut c, mut d, mut e) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for w in x[1..].windows(3) {
            a += w[1] * w[1];
            b += w[1] * w[0];
            c += w[0] * w[0];
            d += w[1] * w[2];
            e += w[0] * w[2];
        }
        let determinant = a * c - b * b;
        let (first, second) = ((d * c - e * b) / determinant, (e * a - d * b) / determinant);
        let all = -1.0 / second;
        let viscous = first * all - 2.0;
        let elastic = all - 1.0 - viscous;
        Self { frequency: elastic.sqrt() / dt, relaxation: viscous / elastic * dt, decay: all.ln() / (2.0 * dt) }
    }
}

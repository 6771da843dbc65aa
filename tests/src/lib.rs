//! Helpers that the acceptance tests share: beams, static and dynamic runs, observed orders.

pub mod reference;
pub mod vibration;

use std::ops::Range;

use cosserat::assembly::{Assembly, Load, Material, RodSpec, Section, Stiffness, shape};
use cosserat::simulation::{Integrator, Settings, Simulation, Status};
use cosserat::state::{Model, State};
use cosserat::statics::{StaticParams, equilibrium};
use nalgebra::Vector3;

/// A straight, uniform rod, cut into equal segments.
#[derive(Clone, Copy, Debug)]
pub struct Beam {
    /// Length L [m].
    pub length: f64,
    /// Radius r [m].
    pub radius: f64,
    /// Material.
    pub material: Material,
    /// Number of segments N.
    pub segments: usize,
}

impl Beam {
    /// One metre long, a centimetre in radius, of soft rubber.
    pub fn rubber(segments: usize) -> Self {
        let material = Material { youngs_modulus: 1e7, torsion_modulus: 4e6, density: 1000.0 };
        Self { length: 1.0, radius: 0.01, material, segments }
    }

    fn section(&self) -> Section {
        Section::Circle { radius: self.radius }
    }

    fn stiffness(&self) -> Stiffness {
        self.section().stiffness(&self.material)
    }

    /// Bending stiffness B [N m^2].
    pub fn bending(&self) -> f64 {
        self.stiffness().bending[0]
    }

    /// Torsional stiffness C [N m^2].
    pub fn torsion(&self) -> f64 {
        self.stiffness().torsion
    }

    /// Mass per length rho A [kg/m].
    pub fn line_density(&self) -> f64 {
        self.material.density * self.section().area()
    }

    /// Length l of a segment [m].
    pub fn segment_length(&self) -> f64 {
        self.length / self.segments as f64
    }

    /// Gravity [m/s^2] at which `rho g A L^3 / B` is `ratio`.
    pub fn gravity_for(&self, ratio: f64) -> f64 {
        ratio * self.bending() / (self.line_density() * self.length.powi(3))
    }

    /// The beam from `start` [m] along `direction`.
    pub fn spec(&self, start: Vector3<f64>, direction: Vector3<f64>) -> RodSpec {
        let nodes = shape::straight(start, direction, self.length, self.segments);
        RodSpec::new(nodes, self.radius, self.material)
    }

    /// The beam from the origin along x, clamped at its start face, under `gravity` [m/s^2].
    pub fn cantilever(&self, gravity: Vector3<f64>) -> (Assembly, Range<usize>) {
        let mut assembly = Assembly::new(gravity);
        let rod = assembly.rod(&self.spec(Vector3::zeros(), Vector3::x()));
        assembly.clamp_start(&rod);
        (assembly, rod)
    }

    /// A load at the end face.
    pub fn end_load(&self, rod: &Range<usize>, force: Vector3<f64>, torque: Vector3<f64>) -> Load {
        Load { segment: rod.end - 1, offset: 0.5 * self.segment_length(), force, torque, follows: false }
    }
}

/// Place [m] of a segment's end face.
pub fn end_of(model: &Model, state: &State, segment: usize) -> Vector3<f64> {
    state.positions[segment] + state.axis(segment) * (0.5 * model.segments[segment].length)
}

/// The stable equilibrium that a model relaxes to; panics where it is not found.
pub fn relaxed(assembly: Assembly) -> (Model, State) {
    let (model, mut state) = assembly.finish();
    let params = StaticParams { max_steps: 40_000, ..StaticParams::default() };
    let report = equilibrium(&model, &mut state, &params).expect("a valid model");
    assert!(report.converged, "no equilibrium: {report:?}");
    (model, state)
}

/// A simulation that has taken `steps` steps of `dt` [s], each of them converged at full length.
pub fn run(model: &Model, state: &State, settings: &Settings, dt: f64, steps: usize) -> (Simulation, State) {
    let mut simulation = Simulation::new(model, state, settings, None).expect("a valid model");
    for step in 0..steps {
        let report = simulation.step(dt).expect("a valid time step");
        assert_eq!(report.status, Status::Converged, "step {step}");
    }
    let mut end = state.clone();
    simulation.store(&mut end);
    (simulation, end)
}

/// Settings with tolerances near rounding, so that only the discretisation is left to see.
pub fn tight() -> Settings {
    let mut settings = Settings::default();
    (settings.step.relative_tolerance, settings.step.motion_tolerance) = (1e-9, 1e-9);
    settings.step.absolute_tolerance = 1e-13;
    settings
}

/// Settings with Euler's rule in place of their integrator, for what theory says of that rule.
pub fn by_euler(mut settings: Settings) -> Settings {
    settings.step.integrator = Integrator::Euler;
    settings
}

/// Observed order of convergence of errors from a discretisation to one twice as fine.
pub fn order(coarse: f64, fine: f64) -> f64 {
    (coarse.abs() / fine.abs()).log2()
}

/// Asserts that errors, each from half the step of the one before, fall at `expected` order (0.15 is granted), and
/// prints them.
pub fn assert_order(case: &str, errors: &[f64], expected: f64) {
    let orders: Vec<f64> = errors.windows(2).map(|pair| order(pair[0], pair[1])).collect();
    let listed: Vec<String> = errors.iter().map(|error| format!("{error:.2e}")).collect();
    println!("{case}: errors {}, orders {orders:.2?}", listed.join(" "));
    for observed in &orders {
        assert!(*observed > expected - 0.15, "{case}: errors {errors:?}, orders {orders:?}, expected {expected}");
    }
}

//! Fourteen experiments with rods whose right result is known: from a closed form, a conserved quantity, an equilibrium that
//! another method finds, or a refined run. Their subjects are those that cosseratbench names (catenary, cantilever, pendulum, whip,
//! plectoneme, capstan, pulley, obstacle course, two ropes, knot, coiling, pile, packing, extremes); scenes and references are our own.
//!
//! An experiment runs builtin scenes and gives a few quantities, each with its right value, where that comes from, and the error
//! that is allowed. It knows nothing of how results are shown.

mod bending;
mod dynamics;
mod friction;
mod packed;
mod quantity;
mod runs;
mod theory;
mod twist;

use cosserat::simulation::Settings;
pub(crate) use friction::Atwood;
use quantity::Measured;
use runs::Runs;

pub use quantity::{BenchmarkError, Outcome, Quantity};

/// An experiment.
pub struct Experiment {
    /// Name of its subject.
    pub name: &'static str,
    /// The builtin scene that it runs.
    pub scene: &'static str,
    /// Steps of all its runs together.
    pub steps: usize,
    measure: fn(&mut Runs<'_>) -> Measured,
}

impl Experiment {
    /// Runs it. After each step `go_on` says whether to go on.
    ///
    /// # Errors
    /// If a scene cannot be simulated with these settings, or `go_on` says no.
    pub fn run(&self, settings: &Settings, go_on: &mut dyn FnMut() -> bool) -> Result<Outcome, BenchmarkError> {
        let mut runs = Runs::new(settings, go_on);
        let quantities = (self.measure)(&mut runs)?;
        Ok(runs.outcome(quantities))
    }
}

/// All experiments, in the order of cosseratbench's list.
pub fn experiments() -> Vec<Experiment> {
    let experiment = |name, scene, steps, measure| Experiment { name, scene, steps, measure };
    vec![
        experiment("catenary", "hung-cable", 200, bending::catenary as fn(&mut Runs<'_>) -> Measured),
        experiment("cantilever", "heavy-cantilever", 600, bending::cantilever),
        experiment("pendulum", "pendulum", 1000, dynamics::pendulum),
        experiment("whip", "folded-rope", 1320, dynamics::whip),
        experiment("plectoneme", "plectoneme", 2400, twist::plectoneme),
        experiment("capstan", "capstan", 200, friction::capstan),
        experiment("pulley", "atwood", 240, friction::pulley),
        experiment("obstacle-course", "slalom", 200, friction::obstacle_course),
        experiment("two-ropes", "collision", 200, dynamics::two_ropes),
        experiment("knot", "knot", 480, twist::knotted),
        experiment("coiling", "coiling", 3200, packed::coiling),
        experiment("pile", "heap-5", 400, packed::pile),
        experiment("packing", "packing", 300, packed::packing),
        experiment("extremes", "bending-rod", 1420, bending::extremes),
    ]
}

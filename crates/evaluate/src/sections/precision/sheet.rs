//! What was measured of one scene.

use evaluation::guesses::Spread;
use evaluation::precision::pareto::Line;
use evaluation::precision::{Against, Curve};
use report::Conditions;

use super::key::{PrecisionKey, Value};
use crate::context::Context;
use crate::show::ALL_STAGES;

/// Errors that rounding alone makes.
const FREE_FALL: f64 = 1e-12;

/// A scene's curves.
pub(super) struct Sheet<'a> {
    pub(super) scene: &'a str,
    pub(super) curves: Vec<&'a Curve>,
    pub(super) floor: Option<f64>,
    /// How many samples count: those before contacts, where these say anything: what falls freely errs in nothing.
    pub(super) samples: usize,
    /// Median of the yardstick's time over all cells [s/s].
    pub(super) yardstick: f64,
    pub(super) conditions: Conditions,
}

impl<'a> Sheet<'a> {
    /// Of the cells of one scene.
    pub(super) fn new(context: &Context, cells: &[(&'a PrecisionKey, &'a Value)]) -> Self {
        let (PrecisionKey { scene, steps, .. }, first) = cells[0];
        let curves: Vec<&Curve> = cells.iter().map(|(_, value)| &value.curve).collect();
        let medians = curves.iter().filter_map(|curve| Some(curve.yardstick?.median));
        let yardstick = Spread::of(medians).map_or(f64::NAN, |spread| spread.median);
        let (all, before) = (first.curve.samples.len(), first.curve.samples_before_contact);
        let places = curves.iter().flat_map(|curve| curve.line(Against::Exact, before).places);
        let errs = places.map(|place| place.error).fold(0.0, f64::max) > FREE_FALL;
        let samples = if errs { before } else { all };
        let time = format!(
            "{ALL_STAGES}; setting up left out; ratios to the default settings run beside, \
             times the median of those"
        );
        let course = format!("{scene}, {steps} steps of {} s", first.curve.dt);
        let conditions = context.conditions(&time).with("scene", course);
        Self { scene, curves, floor: first.floor, samples, yardstick, conditions }
    }

    pub(super) fn lines(&self, against: Against) -> Vec<Line> {
        self.curves.iter().map(|curve| curve.line(against, self.samples)).collect()
    }
}

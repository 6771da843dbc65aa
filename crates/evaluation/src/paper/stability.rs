//! Length of a rod over a long time (paper, section 4, figure on long-term stability): with end-to-end predictions in the
//! projection's place, with a guess inside the solver, and with the direct solver.

use rod::measure;
use scene::sampling::{Parameters, Rod};
use serde::{Deserialize, Serialize};
use solver::simulation::SimulationError;

use super::Motion;
use super::ways::{self, NamedMethod};
use crate::precision::metrics::length_ratio;

/// Steps of a full run: forty times the training data.
pub const STEPS: usize = 2000;
/// About so many points of a curve are kept.
pub const POINTS: usize = 200;
/// Relative change of length that counts as a failure.
pub const LIMIT: f64 = 0.01;

/// The figure's rod with this Young's modulus [Pa].
pub fn rod(youngs_modulus: f64) -> Parameters {
    Parameters::Rod(Rod { youngs_modulus, ..Rod::default() })
}

/// The length over time in one way.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// Name of the way.
    pub name: String,
    /// Steps of the points.
    pub steps: Vec<usize>,
    /// Length of all rods along their centrelines relative to the first, l / l0, at these steps.
    pub ratios: Vec<f64>,
    /// Largest relative change of the length in any step.
    pub largest_change: f64,
    /// Largest gap in any joint in any step, in segment lengths: gaps across the rod do not change its length.
    pub largest_gap: f64,
    /// The first step in which the length had changed by more than [`LIMIT`].
    pub left_limit: Option<usize>,
    /// The step in which numbers were no longer finite; the curve ends before it.
    pub stopped: Option<usize>,
}

/// Moves the scene in all ways, a curve each, and keeps every `motion.steps / POINTS`-th step; after each step of all `progress()` says
/// whether to go on. `None` where it said stop.
///
/// # Errors
/// If the scene or a way is not valid.
pub fn measure(
    motion: &Motion<'_>,
    ways: &[NamedMethod<'_>],
    progress: impl FnMut() -> bool,
) -> Result<Option<Vec<Curve>>, SimulationError> {
    let every = motion.steps.div_ceil(POINTS).max(1);
    let curve = |way: &NamedMethod<'_>| Curve {
        name: way.name.clone(),
        steps: vec![0],
        ratios: vec![1.0],
        largest_change: 0.0,
        largest_gap: 0.0,
        left_limit: None,
        stopped: None,
    };
    let mut curves: Vec<Curve> = ways.iter().map(curve).collect();
    let frame = |step: usize, way: usize, state: &_| {
        let ratio = length_ratio(motion.model, state, motion.state);
        let gap = measure::worst_gap(motion.model, state);
        if !(ratio.is_finite() && gap.is_finite()) {
            return false;
        }
        let (curve, change) = (&mut curves[way], (ratio - 1.0).abs());
        if step.is_multiple_of(every) || step == motion.steps {
            curve.steps.push(step);
            curve.ratios.push(ratio);
        }
        curve.largest_change = curve.largest_change.max(change);
        curve.largest_gap = curve.largest_gap.max(gap);
        if change > LIMIT {
            curve.left_limit.get_or_insert(step);
        }
        true
    };
    let Some(stopped) = ways::run(motion, ways, frame, progress)? else { return Ok(None) };
    for (curve, stopped) in curves.iter_mut().zip(stopped) {
        curve.stopped = stopped;
    }
    Ok(Some(curves))
}

/// A way over all scenes of the figure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Worst {
    /// Name of the way.
    pub name: String,
    /// Largest relative change of the length.
    pub largest_change: f64,
    /// Largest gap, in segment lengths.
    pub largest_gap: f64,
    /// Scenes in which the length changed by more than [`LIMIT`].
    pub failed: usize,
    /// The earliest step in which it did.
    pub left_limit: Option<usize>,
    /// The earliest step in which numbers were not finite.
    pub stopped: Option<usize>,
}

/// The worst of all scenes, which have the same ways.
pub fn worst(cells: &[Vec<Curve>]) -> Vec<Worst> {
    let ways = cells.first().map_or(0, Vec::len);
    let of_way = |way: usize| {
        let curves = || cells.iter().filter_map(|cell| cell.get(way));
        Worst {
            name: curves().next().map_or_else(String::new, |curve| curve.name.clone()),
            largest_change: curves().map(|curve| curve.largest_change).fold(0.0, f64::max),
            largest_gap: curves().map(|curve| curve.largest_gap).fold(0.0, f64::max),
            failed: curves().filter(|curve| curve.left_limit.or(curve.stopped).is_some()).count(),
            left_limit: curves().filter_map(|curve| curve.left_limit).min(),
            stopped: curves().filter_map(|curve| curve.stopped).min(),
        }
    };
    (0..ways).map(of_way).collect()
}

#[cfg(test)]
mod tests {
    use rod::Model;
    use solver::component::{Component, Members};
    use solver::kernel::Spatial;
    use solver::projection::Projection;
    use solver::step::StepParams;
    use solver::topology::Topology;

    use super::super::Method;
    use super::super::example::{CG, bending, motion, quadratic, stored};
    use super::*;

    /// Predicts that nothing has to be corrected until a step, then flights so far that soon no number holds them.
    struct Falls(usize);

    impl Projection for Falls {
        fn project(&mut self, _: &Component<f64>, _: usize, dp: &mut [Spatial<f64>], _: &mut [Spatial<f64>]) {
            if self.0 == 0 {
                dp.iter_mut().for_each(|dp| dp.linear.0[0] = 1e153);
            }
            self.0 = self.0.saturating_sub(1);
        }
    }

    fn falls(_: &Model, _: &Members, _: &Topology) -> Box<dyn Projection> {
        Box::new(Falls(20))
    }

    #[test]
    fn a_solver_keeps_the_length_and_predictions_stop_where_they_are_not_finite() {
        let scene = bending(6);
        let once = StepParams { max_iterations: 1, ..StepParams::DEFAULT };
        let way = |name: &str, method| NamedMethod { name: name.to_owned(), method };
        let ways = [
            way("end-to-end", Method::EndToEnd(once, &falls)),
            way("guess", Method::Solve(CG.settings(), Some(&quadratic))),
            way("direct", Method::Solve(CG.direct(), None)),
        ];
        let cell = measure(&motion(&scene, 250), &ways, || true).unwrap().unwrap();
        assert_eq!(stored(&cell), cell);
        let [end_to_end, guess, direct] = &cell[..] else { panic!("three ways") };
        assert_eq!((guess.steps.len(), guess.steps[1], *guess.steps.last().unwrap()), (126, 2, 250));
        for curve in [guess, direct] {
            assert!(curve.largest_change < 1e-4 && curve.stopped.is_none() && curve.left_limit.is_none());
        }
        // A free fall across the rod opens the clamped end and leaves its length; the flight along it does not.
        let stopped = end_to_end.stopped.unwrap();
        assert_eq!(end_to_end.left_limit, Some(21));
        assert!((22..40).contains(&stopped) && *end_to_end.steps.last().unwrap() < stopped);
        assert!(end_to_end.largest_gap > 1.0 && end_to_end.ratios.iter().all(|ratio| ratio.is_finite()));
        let worst = worst(&[cell.clone(), cell]);
        assert_eq!((worst[0].failed, worst[0].stopped, worst[1].failed), (2, Some(stopped), 0));
    }
}

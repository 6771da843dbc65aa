//! Motions in several ways, to be drawn and to be held against the first of them: the supplement's dynamic results (a) to
//! (g), where a guess must not change the motion, its knot, its comparisons, and the error over time (NRMSE) against
//! vanilla position-based dynamics.
//!
//! The paper does not say what its NRMSE is normalised by. Here, the root mean square distance of the segments' centres is
//! divided by the rods' mean length ([`position_error`]).

use nalgebra::Vector3;
use rod::{Model, State};
use serde::{Deserialize, Serialize};
use solver::simulation::SimulationError;

use super::Motion;
use super::ways::{self, NamedMethod};
use crate::guesses::Spread;
use crate::precision::metrics::{mean_length, position_error};

/// A motion in one way. The first way is what the others are compared to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trace {
    /// Name of the way.
    pub name: String,
    /// Centrelines at the frames that were asked for.
    pub snapshots: Vec<Snapshot>,
    /// NRMSE of the positions against the first way, by step; as long as both are finite.
    pub nrmse: Vec<f64>,
    /// Largest distance of any segment's centre from where it is in the first way, in any step, relative to the rods' mean
    /// length.
    pub distance: f64,
    /// The step in which numbers were no longer finite; all lists end before it.
    pub stopped: Option<usize>,
}

/// The centrelines of all rods in one frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Snapshot {
    /// Steps done.
    pub step: usize,
    /// Of each rod, the start of its first segment, the middles between segments, and the end of its last [m].
    pub rods: Vec<Vec<[f64; 3]>>,
}

/// Moves the scene in all ways, a trace each, with snapshots after so many steps each of `frames`; after each step of all `progress()`
/// says whether to go on. `None` where it said stop.
///
/// # Errors
/// If the scene or a way is not valid.
pub fn measure(
    motion: &Motion<'_>,
    frames: &[usize],
    ways: &[NamedMethod<'_>],
    progress: impl FnMut() -> bool,
) -> Result<Option<Vec<Trace>>, SimulationError> {
    let length = mean_length(motion.model);
    let record = |trace: &mut Trace, step: usize, state: &State| {
        if frames.contains(&step) {
            trace.snapshots.push(Snapshot { step, rods: centrelines(motion.model, state) });
        }
    };
    let trace = |way: &NamedMethod<'_>| {
        let name = way.name.clone();
        let mut trace = Trace { name, snapshots: vec![], nrmse: vec![], distance: 0.0, stopped: None };
        record(&mut trace, 0, motion.state);
        trace
    };
    let mut traces: Vec<Trace> = ways.iter().map(trace).collect();
    let mut expected = (0, motion.state.clone());
    let frame = |step: usize, way: usize, state: &State| {
        if way == 0 {
            expected = (step, state.clone());
        }
        let nrmse = position_error(motion.model, &state.positions, &expected.1.positions);
        // Squares of numbers that large would not be finite.
        if !nrmse.is_finite() {
            return false;
        }
        let trace = &mut traces[way];
        record(trace, step, state);
        // Where the first way has stopped, there is nothing left to compare to.
        if expected.0 == step {
            trace.nrmse.push(nrmse);
            trace.distance = trace.distance.max(largest_distance(state, &expected.1) / length);
        }
        true
    };
    let Some(stopped) = ways::run(motion, ways, frame, progress)? else { return Ok(None) };
    for (trace, stopped) in traces.iter_mut().zip(stopped) {
        trace.stopped = stopped;
    }
    Ok(Some(traces))
}

/// Half of a segment along its axis [m].
fn half(model: &Model, state: &State, segment: usize) -> Vector3<f64> {
    state.axis(segment) * (0.5 * model.segments[segment].length)
}

fn centrelines(model: &Model, state: &State) -> Vec<Vec<[f64; 3]>> {
    let mut rods: Vec<Vec<[f64; 3]>> = Vec::new();
    for (i, segment) in model.segments.iter().enumerate() {
        let (start, end) = (state.positions[i] - half(model, state, i), state.positions[i] + half(model, state, i));
        rods.resize_with(rods.len().max(segment.rod + 1), Vec::new);
        let rod = &mut rods[segment.rod];
        match rod.last_mut() {
            // The end of the segment before: where the joint is open, the point lies in the middle of the gap.
            Some(last) => *last = ((Vector3::from(*last) + start) / 2.0).into(),
            None => rod.push(start.into()),
        }
        rod.push(end.into());
    }
    rods
}

fn largest_distance(a: &State, b: &State) -> f64 {
    a.positions.iter().zip(&b.positions).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

/// A way over several scenes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Deviation {
    /// Name of the way.
    pub name: String,
    /// Scenes.
    pub scenes: usize,
    /// NRMSE after the last step that was compared.
    pub last_nrmse: Option<Spread>,
    /// Largest distance of any segment from where it is in the first way, relative to the rods' mean length.
    pub distance: f64,
    /// Scenes in which numbers were no longer finite.
    pub stopped: usize,
}

/// Merges scenes that have the same ways.
pub fn deviations(cells: &[Vec<Trace>]) -> Vec<Deviation> {
    let ways = cells.first().map_or(0, Vec::len);
    let of_way = |way: usize| {
        let traces = || cells.iter().filter_map(|cell| cell.get(way));
        Deviation {
            name: traces().next().map_or_else(String::new, |trace| trace.name.clone()),
            scenes: traces().count(),
            last_nrmse: Spread::of(traces().filter_map(|trace| trace.nrmse.last().copied())),
            distance: traces().map(|trace| trace.distance).fold(0.0, f64::max),
            stopped: traces().filter(|trace| trace.stopped.is_some()).count(),
        }
    };
    (0..ways).map(of_way).collect()
}

#[cfg(test)]
mod tests {
    use solver::component::{Component, Members};
    use solver::kernel::Spatial;
    use solver::projection::Projection;
    use solver::step::StepParams;
    use solver::topology::Topology;

    use super::super::Method;
    use super::super::example::{CG, bending, motion, quadratic, stored};
    use super::*;

    /// Predicts that nothing has to be corrected.
    struct Nothing;

    impl Projection for Nothing {
        fn project(&mut self, _: &Component<f64>, _: usize, _: &mut [Spatial<f64>], _: &mut [Spatial<f64>]) {}
    }

    fn nothing(_: &Model, _: &Members, _: &Topology) -> Box<dyn Projection> {
        Box::new(Nothing)
    }

    #[test]
    fn a_guess_does_not_change_the_motion_and_free_fall_is_far_off() {
        let scene = bending(6);
        let once = StepParams { max_iterations: 1, ..StepParams::DEFAULT };
        let way = |name: &str, method| NamedMethod { name: name.to_owned(), method };
        let ways = [
            way("direct", Method::Solve(CG.direct(), None)),
            way("guess", Method::Solve(CG.settings(), Some(&quadratic))),
            way("end-to-end", Method::EndToEnd(once, &nothing)),
        ];
        let cell = measure(&motion(&scene, 30), &[0, 10, 30], &ways, || true).unwrap().unwrap();
        assert_eq!(stored(&cell), cell);
        for trace in &cell {
            assert_eq!((trace.nrmse.len(), trace.stopped), (30, None));
            let frames: Vec<usize> = trace.snapshots.iter().map(|snapshot| snapshot.step).collect();
            assert_eq!(frames, [0, 10, 30]);
        }
        assert_eq!((cell[0].distance, cell[0].nrmse[29]), (0.0, 0.0));
        assert!(cell[1].distance < 1e-3 && cell[1].distance > 0.0 && cell[1].nrmse[29] <= cell[1].distance);
        // Without corrections all segments but the clamped one fall: by g t^2 / 2 = 1.8 m in 0.6 s.
        assert!(cell[2].nrmse[29] > 0.1);
        let merged = deviations(&[cell.clone(), cell]);
        assert_eq!((merged[2].scenes, merged[2].stopped, merged[2].name.as_str()), (2, 0, "end-to-end"));
        assert!(merged[1].distance < merged[2].distance);
    }

    #[test]
    fn centrelines_run_from_end_to_end() {
        let scene = bending(4);
        let rods = centrelines(&scene.model, &scene.state);
        assert_eq!((rods.len(), rods[0].len()), (1, 5));
        for (k, point) in rods[0].iter().enumerate() {
            let along = Vector3::from(*point) - Vector3::from(rods[0][0]);
            assert!((along.norm() - 0.5 * k as f64).abs() < 1e-12);
        }
        // A gap is closed in its middle.
        let mut open = scene.state.clone();
        open.positions[2].z += 0.2;
        let moved = centrelines(&scene.model, &open);
        assert!((moved[0][2][2] - rods[0][2][2] - 0.1).abs() < 1e-12 && moved[0].len() == 5);
    }
}

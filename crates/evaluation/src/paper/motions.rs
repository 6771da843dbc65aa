//! Motions in several ways, to be drawn and to be held against the first of them: the supplement's dynamic results (a) to
//! (g), where a guess must not change the motion, its knot, its comparisons, the error over time (NRMSE) against vanilla
//! position-based dynamics; and the length of a rod over a long time (paper, section 4, figure on long-term stability).
//!
//! The paper does not say what its NRMSE is normalised by. Here, the root mean square distance of the segments' centres is
//! divided by the rods' mean length ([`position_error`]).

use cosserat::scene::Scene;
use cosserat::simulation::{Simulation, SimulationError, Status};
use cosserat::state::measure::worst_gap;
use cosserat::state::{Model, State};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::guesses::Spread;
use crate::precision::metrics::{length_ratio, mean_length, position_error};

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
    /// Length of all rods along their centrelines relative to the first, l / l0, at the start and after each step.
    pub lengths: Vec<f64>,
    /// Largest gap in any joint in any step, in segment lengths: gaps across the rod do not change its length.
    pub largest_gap: f64,
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

/// Moves the scene `steps` steps by each way, a simulation by name: a trace each, with snapshots after so many steps each of
/// `frames`. Before each step `progress()` says whether to go on; `None` where it said stop.
///
/// # Errors
/// If the time step is not valid.
pub fn measure(
    Scene { model, state: first, run, .. }: &Scene,
    steps: usize,
    frames: &[usize],
    ways: Vec<(String, Simulation)>,
    mut progress: impl FnMut() -> bool,
) -> Result<Option<Vec<Trace>>, SimulationError> {
    let snapshot =
        |step: usize, state: &State| frames.contains(&step).then(|| Snapshot { step, rods: centrelines(model, state) });
    let (mut traces, mut state) = (Vec::new(), first.clone());
    // The positions in the first way, by step, as far as they are finite.
    let mut expected: Vec<Vec<Vector3<f64>>> = Vec::new();
    for (name, mut simulation) in ways {
        let (snapshots, lengths) = (snapshot(0, first).into_iter().collect(), vec![1.0]);
        let mut trace =
            Trace { name, snapshots, nrmse: Vec::new(), distance: 0.0, lengths, largest_gap: 0.0, stopped: None };
        for step in 1..=steps {
            if !progress() {
                return Ok(None);
            }
            let status = simulation.step(run.dt)?.status;
            simulation.store(&mut state);
            let (length, gap) = (length_ratio(model, &state, first), worst_gap(model, &state));
            let positions = &state.positions;
            let nrmse = expected.get(step - 1).map_or(0.0, |expected| position_error(model, positions, expected));
            // Squares of large numbers are not finite.
            if status == Status::NonFinite || [nrmse, length, gap].iter().any(|number| !number.is_finite()) {
                trace.stopped = Some(step);
                break;
            }
            trace.snapshots.extend(snapshot(step, &state));
            trace.lengths.push(length);
            trace.largest_gap = trace.largest_gap.max(gap);
            if traces.is_empty() {
                expected.push(positions.clone());
            }
            // Where the first way has stopped, there is nothing left to compare to.
            if let Some(expected) = expected.get(step - 1) {
                let distances = positions.iter().zip(expected).map(|(own, expected)| (own - expected).norm());
                trace.distance = trace.distance.max(distances.fold(0.0, f64::max) / mean_length(model));
                trace.nrmse.push(nrmse);
            }
        }
        traces.push(trace);
    }
    Ok(Some(traces))
}

fn centrelines(model: &Model, state: &State) -> Vec<Vec<[f64; 3]>> {
    let mut rods: Vec<Vec<[f64; 3]>> = Vec::new();
    for (i, segment) in model.segments.iter().enumerate() {
        let half = state.axis(i) * (0.5 * segment.length);
        let (start, end) = (state.positions[i] - half, state.positions[i] + half);
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

/// Relative change of length that counts as a failure.
pub const LIMIT: f64 = 0.01;

impl Trace {
    /// Relative changes of the length, |l / l0 - 1|, at the start and after each step.
    pub fn length_changes(&self) -> impl Iterator<Item = f64> {
        self.lengths.iter().map(|ratio| (ratio - 1.0).abs())
    }

    /// The step in which the length first changed by more than [`LIMIT`].
    pub fn left_limit(&self) -> Option<usize> {
        self.length_changes().position(|change| change > LIMIT)
    }
}

/// The traces of each way, over scenes that have the same ways.
pub fn by_way<'a>(cells: &[&'a Vec<Trace>]) -> Vec<Vec<&'a Trace>> {
    let ways = cells.first().map_or(0, |cell| cell.len());
    (0..ways).map(|way| cells.iter().filter_map(|cell| cell.get(way)).collect()).collect()
}

/// The largest number of some traces.
pub fn largest(traces: &[&Trace], of: impl Fn(&Trace) -> f64) -> f64 {
    traces.iter().map(|trace| of(trace)).fold(0.0, f64::max)
}

/// The errors (NRMSE) after the last steps that were compared.
pub fn last_nrmse(traces: &[&Trace]) -> Option<Spread> {
    Spread::of(traces.iter().filter_map(|trace| trace.nrmse.last().copied()))
}

#[cfg(test)]
mod tests {
    use cosserat::guess::{Members, Topology};
    use cosserat::internals::component::Component;
    use cosserat::internals::dynamics::projection::Projection;
    use cosserat::internals::kernels::Spatial;
    use cosserat::simulation::StepParams;

    use super::super::example::{CG, bending, quadratic, stored};
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
        Box::new(Falls(30))
    }

    /// Solved, from a guess, and by predictions alone.
    fn measured(scene: &Scene, steps: usize, frames: &[usize]) -> Vec<Trace> {
        let once = StepParams { max_iterations: 1, ..CG.step };
        let (model, state) = (&scene.model, &scene.state);
        let ways = [
            ("direct", Simulation::new(model, state, &CG.direct(), None)),
            ("guess", Simulation::new(model, state, &CG.settings(), Some(&quadratic))),
            ("end-to-end", Simulation::end_to_end(model, state, &once, &falls)),
        ];
        let ways = ways.map(|(name, simulation)| (name.to_owned(), simulation.unwrap()));
        measure(scene, steps, frames, ways.into(), || true).unwrap().unwrap()
    }

    #[test]
    fn a_guess_does_not_change_the_motion_and_free_fall_is_far_off() {
        let cell = measured(&bending(6), 30, &[0, 10, 30]);
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
        let merged = by_way(&[&cell, &cell]);
        assert_eq!(merged.len(), 3);
        assert!(merged[2].len() == 2 && merged[2].iter().all(|trace| trace.name == "end-to-end"));
        let [guess, falls] = [1, 2].map(|way| largest(&merged[way], |trace| trace.distance));
        assert!(guess == cell[1].distance && guess < falls);
        assert_eq!(last_nrmse(&merged[1]).unwrap().median, cell[1].nrmse[29]);
    }

    #[test]
    fn a_solver_keeps_the_length_and_predictions_stop_where_they_are_not_finite() {
        let cell = measured(&bending(6), 60, &[]);
        for trace in &cell[..2] {
            assert_eq!((trace.lengths.len(), trace.lengths[0]), (61, 1.0));
            assert!(trace.length_changes().all(|change| change < 1e-4));
            assert_eq!((trace.stopped, trace.left_limit()), (None, None));
        }
        // A free fall across the rod opens the clamped end and leaves its length; the flight along it does not.
        let end_to_end = &cell[2];
        assert_eq!(end_to_end.left_limit(), Some(31));
        assert!((32..50).contains(&end_to_end.stopped.unwrap()));
        assert_eq!(Some(end_to_end.lengths.len()), end_to_end.stopped);
        assert!(end_to_end.largest_gap > 1.0 && end_to_end.lengths.iter().all(|ratio| ratio.is_finite()));
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

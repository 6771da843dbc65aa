//! The course of what changes over time, in stretches within which it is smooth.

use rod::{Body, Model};

/// The times between which motions and loads are smooth.
pub(super) struct Course {
    /// Ascending, from 0 on [s].
    times: Vec<f64>,
}

impl Course {
    /// That of a model until a time [s].
    pub(super) fn new(model: &Model, until: f64) -> Self {
        let is_held = |body: Body| match body {
            Body::Segment(i) => model.segments[i].fixed,
            Body::Anchor(_) => true,
        };
        let motions = model.motions.iter().filter(|driven| is_held(driven.body));
        let of_motions = motions.flat_map(|driven| driven.carried.motion.times());
        let of_loads = model.changes.iter().flat_map(|change| change.track.times_until(until));
        let within = of_motions.chain(of_loads).filter(|&time| time > 0.0 && time < until);
        let mut times: Vec<f64> = within.chain([0.0, until]).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        Self { times }
    }

    /// Where a stretch begins and ends [s].
    pub(super) fn stretch(&self, index: usize) -> [f64; 2] {
        [self.times[index], self.times[index + 1]]
    }

    /// The stretch after this one, or before it; `None` where there is none.
    pub(super) fn beyond(&self, index: usize, forward: bool) -> Option<usize> {
        let next = if forward { index + 1 } else { index.checked_sub(1)? };
        (next + 1 < self.times.len()).then_some(next)
    }
}

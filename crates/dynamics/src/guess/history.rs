//! What was solved before, in body frames, so that a rod that turns as a whole leaves it as it is.
//!
//! Multipliers scale with dt^2 (they are forces times dt^2). A history made with another time step, as substeps do, is
//! therefore worth one value, the newest times the square of the steps' ratio; whoever needs evenly spaced values asks
//! for a run of them, and it ends where the time step changed.

use component::Component;
use component::snapshot::StateVisitor;
use kernels::Spatial;

use super::to_body_frame;

/// How many outer iterations of a step have a history of their own; later ones have none.
pub(crate) const TRACKED_ITERATIONS: usize = 8;

/// One remembered solution.
#[derive(Clone, Debug)]
pub(crate) struct Entry {
    /// Which attempt at a step it is from.
    pub(crate) attempt: u64,
    /// Time step [s].
    pub(crate) dt: f64,
    /// The solution in body frames.
    pub(crate) values: Vec<Spatial<f64>>,
}

/// The last few solutions, the oldest overwritten by the newest.
#[derive(Clone, Debug)]
pub(crate) struct Ring {
    entries: Vec<Entry>,
    newest: usize,
    len: usize,
}

impl Ring {
    pub(crate) fn new(size: usize, depth: usize) -> Self {
        let entry = Entry { attempt: 0, dt: 0.0, values: vec![Spatial::zero(); size] };
        Self { entries: vec![entry; depth.max(1)], newest: 0, len: 0 }
    }

    /// The entry `age` places before the newest.
    pub(crate) fn get(&self, age: usize) -> Option<&Entry> {
        let depth = self.entries.len();
        (age < self.len).then(|| &self.entries[(self.newest + depth - age) % depth])
    }

    /// Adds an entry whose values `fill` writes; left out where they are not finite.
    pub(crate) fn push(&mut self, attempt: u64, dt: f64, fill: impl FnOnce(&mut [Spatial<f64>])) {
        let depth = self.entries.len();
        let place = (self.newest + 1) % depth;
        let entry = &mut self.entries[place];
        fill(&mut entry.values);
        if entry.values.iter().all(|x| x.dot(*x).is_finite()) {
            (entry.attempt, entry.dt) = (attempt, dt);
            self.newest = place;
            self.len = (self.len + 1).min(depth);
        } else {
            // The oldest entry was in that place.
            self.len = self.len.min(depth - 1);
        }
    }

    /// Shows a visitor the entries that count.
    pub(crate) fn visit_state(&mut self, visitor: &mut StateVisitor<'_>) {
        let depth = self.entries.len();
        visitor.size(depth);
        visitor.size(self.entries[0].values.len());
        visitor.count(&mut self.newest);
        visitor.count(&mut self.len);
        for age in 0..self.len {
            let Entry { attempt, dt, values } = &mut self.entries[(self.newest + depth - age) % depth];
            visitor.word(attempt);
            visitor.number(dt);
            values.iter_mut().for_each(|value| visitor.spatial(value));
        }
    }

    /// Forgets everything.
    pub(crate) fn clear(&mut self) {
        self.len = 0;
    }

    /// Takes the newest entry back if it is from `attempt`.
    pub(crate) fn forget(&mut self, attempt: u64) {
        if self.get(0).is_some_and(|entry| entry.attempt == attempt) {
            self.newest = (self.newest + self.entries.len() - 1) % self.entries.len();
            self.len -= 1;
        }
    }

    /// Weights of the newest entries, one each, that extrapolate to attempt `attempt` of time step `dt` by a polynomial
    /// of at most `order`, and how many there are; the order is as low as the run of even steps is short.
    pub(crate) fn extrapolation(&self, attempt: u64, dt: f64, order: usize) -> ([f64; 3], usize) {
        let Some(newest) = self.get(0) else { return ([0.0; 3], 0) };
        if newest.dt != dt || newest.attempt + 1 != attempt {
            return ([(dt / newest.dt).powi(2), 0.0, 0.0], 1);
        }
        let in_run = |age: usize| {
            self.get(age).is_some_and(|entry| entry.dt == dt && entry.attempt + age as u64 == newest.attempt)
        };
        match (1..=order.min(2)).take_while(|&age| in_run(age)).count() {
            0 => ([1.0, 0.0, 0.0], 1),
            1 => ([2.0, -1.0, 0.0], 2),
            _ => ([3.0, -3.0, 1.0], 3),
        }
    }
}

/// The solutions of linear systems, one ring for each of the first [`TRACKED_ITERATIONS`] outer iterations of a step.
#[derive(Clone, Debug)]
pub(crate) struct SolveHistory {
    rings: Vec<Ring>,
    /// Number of the attempt under way; attempts that were taken back give theirs to the next.
    attempt: u64,
    dt: f64,
    /// Whether `begin` was called for the attempt under way, before its first solution.
    is_open: bool,
    /// Whether a whole step was accepted since the last attempt began.
    is_accepted: bool,
}

impl SolveHistory {
    pub(crate) fn new(joints: usize, depth: usize) -> Self {
        let rings = vec![Ring::new(joints, depth); TRACKED_ITERATIONS];
        Self { rings, attempt: 0, dt: 0.0, is_open: false, is_accepted: true }
    }

    /// The ring of an outer iteration.
    pub(crate) fn ring(&self, iteration: usize) -> Option<&Ring> {
        self.rings.get(iteration)
    }

    /// Number of the attempt under way.
    pub(crate) fn attempt(&self) -> u64 {
        self.attempt
    }

    /// A linear solve is about to start. A shorter time step without an accepted step before it means that the last
    /// attempt was taken back, and its solutions with it.
    pub(crate) fn begin(&mut self, dt: f64, iteration: usize) {
        if iteration > 0 || self.is_open {
            return;
        }
        if !self.is_accepted && dt < self.dt {
            let attempt = self.attempt;
            self.rings.iter_mut().for_each(|ring| ring.forget(attempt));
        } else {
            self.attempt += 1;
        }
        (self.dt, self.is_open, self.is_accepted) = (dt, true, false);
    }

    /// Keeps the solution of outer iteration `iteration`.
    pub(crate) fn observe(&mut self, component: &Component<f64>, iteration: usize) {
        self.begin(component.effective_dt(), iteration);
        self.is_open = false;
        let Some(ring) = self.rings.get_mut(iteration) else { return };
        ring.push(self.attempt, component.effective_dt(), |values| {
            for (joint, value) in values.iter_mut().enumerate() {
                *value = to_body_frame(&component.system, joint, component.dlambda[joint]);
            }
        });
    }

    /// Shows all of it to a visitor.
    pub(crate) fn visit_state(&mut self, visitor: &mut StateVisitor<'_>) {
        let Self { rings, attempt, dt, is_open, is_accepted } = self;
        rings.iter_mut().for_each(|ring| ring.visit_state(visitor));
        visitor.word(attempt);
        visitor.number(dt);
        visitor.flag(is_open);
        visitor.flag(is_accepted);
    }

    /// A whole step was accepted.
    pub(crate) fn accept(&mut self) {
        self.is_accepted = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn push(ring: &mut Ring, attempt: u64, dt: f64, value: f64) {
        ring.push(attempt, dt, |values| values[0].linear.0[0] = value);
    }

    fn extrapolated(ring: &Ring, attempt: u64, dt: f64, order: usize) -> f64 {
        let (weights, count) = ring.extrapolation(attempt, dt, order);
        (0..count).map(|age| weights[age] * ring.get(age).unwrap().values[0].linear.0[0]).sum()
    }

    #[test]
    fn polynomials_of_their_order_are_extrapolated_exactly() {
        for order in 0..=2 {
            let f = |t: f64| [3.0, 3.0 - 2.0 * t, 3.0 - 2.0 * t + 0.5 * t * t][order];
            let mut ring = Ring::new(1, order + 1);
            for t in 0..7 {
                push(&mut ring, t, 0.1, f(t as f64));
            }
            assert!((extrapolated(&ring, 7, 0.1, order) - f(7.0)).abs() < 1e-12, "{order}");
        }
    }

    #[test]
    fn another_time_step_leaves_the_newest_value_and_its_scale() {
        let mut ring = Ring::new(1, 3);
        push(&mut ring, 1, 0.1, 1.0);
        push(&mut ring, 2, 0.1, 2.0);
        assert_eq!(extrapolated(&ring, 3, 0.05, 2), 2.0 * (0.05_f64 / 0.1).powi(2));
        push(&mut ring, 3, 0.05, 0.7);
        assert_eq!(extrapolated(&ring, 4, 0.05, 2), 0.7);
    }

    #[test]
    fn gaps_lower_the_order_and_attempts_can_be_taken_back() {
        let mut ring = Ring::new(1, 3);
        push(&mut ring, 1, 0.1, 1.0);
        push(&mut ring, 2, 0.1, 3.0);
        assert_eq!(extrapolated(&ring, 3, 0.1, 1), 5.0);
        assert_eq!(extrapolated(&ring, 4, 0.1, 1), 3.0);
        push(&mut ring, 3, 0.1, 1e9);
        ring.forget(3);
        assert_eq!(extrapolated(&ring, 3, 0.1, 1), 5.0);
        push(&mut ring, 3, 0.1, f64::NAN);
        assert_eq!(extrapolated(&ring, 3, 0.1, 1), 5.0);
    }
}

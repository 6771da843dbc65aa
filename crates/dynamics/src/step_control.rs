//! What becomes of a step: an attempt from a guess, one from the prediction, halves; taken back or accepted.

use crate::counters::Counters;
use crate::step::{Interval, Status, StepParams};

/// Sets of segments that are stepped together: one, or all those that can touch.
pub(crate) trait Steps {
    /// Attempts a step over `interval`, without velocities; `guessing` lets guesses say where it begins. `is_last`: it is not
    /// halved, whatever comes of it.
    fn attempt(&mut self, interval: Interval, params: &StepParams, guessing: bool, is_last: bool) -> Status;

    /// Whether the last attempt began at a guess.
    fn is_guessed(&self) -> bool;

    /// Whether the last attempt began where joints were apart already, so that shorter steps would not help.
    fn is_hopeless(&self) -> bool {
        false
    }

    /// Takes the last attempt back.
    fn roll_back(&mut self);

    /// Whether there is an impact in the last attempt, which is solved by a rule of second order: that goes on with velocities from before it, so
    /// that forces of 9/4 of the impulse would be reported. The step is then to be done again by Euler's rule.
    fn has_impact(&self) -> bool {
        false
    }

    /// Breaks the joints that bear too much at the end of the last attempt, which is solved: one of each set. Whether there are any; the step is
    /// then to be done again.
    fn break_joints(&mut self) -> bool {
        false
    }

    /// Lets the next step be one of Euler's rule, which stands more than one of higher order.
    fn restart(&mut self);

    /// Ends the step with the last attempt: velocities, or back where it began if there is nothing to go on from. Returns how
    /// the step ended: as the attempt did, or with joints apart.
    fn accept(&mut self, status: Status, params: &StepParams) -> Status;

    /// The counters for retries and for what becomes of guesses.
    fn counters_mut(&mut self) -> &mut Counters;

    /// Counts the guesses that the last attempt began at as dropped.
    fn count_dropped(&mut self);
}

/// Steps over `interval`; where that does not converge, from the prediction if it was begun at a guess, else in two halves,
/// `halvings` deep so far.
pub(crate) fn advance(sets: &mut impl Steps, interval: Interval, halvings: u32, params: &StepParams) -> Status {
    match advance_whole(sets, interval, halvings, params) {
        Some(status) => sets.accept(status, params),
        None => advance_parts(sets, interval, halvings, params),
    }
}

/// Steps over `interval` as a whole, from a guess and then from the prediction; what it came to is still to be accepted. `None`
/// where it is taken back, to be done in halves.
pub(crate) fn advance_whole(
    sets: &mut impl Steps,
    interval: Interval,
    halvings: u32,
    params: &StepParams,
) -> Option<Status> {
    let is_last = halvings >= params.max_halvings;
    let mut status = sets.attempt(interval, params, true, is_last);
    if sets.is_guessed() && status != Status::Converged {
        sets.count_dropped();
        sets.roll_back();
        status = sets.attempt(interval, params, false, is_last);
    }
    if status == Status::Converged && sets.has_impact() {
        sets.roll_back();
        sets.restart();
        status = sets.attempt(interval, params, false, is_last);
    }
    while status == Status::Converged && sets.break_joints() {
        sets.roll_back();
        sets.restart();
        status = sets.attempt(interval, params, false, is_last);
    }
    if status.may_be_halved() && !is_last && !sets.is_hopeless() {
        sets.roll_back();
        sets.counters_mut().retries += 1;
        return None;
    }
    Some(status)
}

/// [`advance`] over one half of `interval` after the other, the first one by Euler's rule.
pub(crate) fn advance_parts(sets: &mut impl Steps, interval: Interval, halvings: u32, params: &StepParams) -> Status {
    sets.restart();
    let mut worst = Status::ConvergedInSubsteps;
    for half in interval.halves() {
        worst = worst.max(advance(sets, half, halvings + 1, params));
        if worst.is_stuck() {
            break;
        }
    }
    worst
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Converges where a step is at most so long; says so otherwise.
    struct Fake {
        longest: f64,
        otherwise: Status,
        /// Whether attempts begin at guesses, which never converge.
        guesses: bool,
        is_guessed: bool,
        counters: Counters,
        accepted: Vec<(f64, f64, Status)>,
        last: Interval,
        rolled_back: u32,
    }

    impl Fake {
        fn new(longest: f64, otherwise: Status, guesses: bool) -> Self {
            let (counters, last) = (Counters::default(), Interval { time: 0.0, dt: 0.0 });
            Self {
                longest,
                otherwise,
                guesses,
                is_guessed: false,
                counters,
                accepted: Vec::new(),
                last,
                rolled_back: 0,
            }
        }

        fn advance(&mut self, max_halvings: u32) -> Status {
            let params = StepParams { max_halvings, ..StepParams::DEFAULT };
            advance(self, Interval { time: 1.0, dt: 1.0 }, 0, &params)
        }
    }

    impl Steps for Fake {
        fn attempt(&mut self, interval: Interval, _: &StepParams, guessing: bool, _: bool) -> Status {
            (self.last, self.is_guessed) = (interval, guessing && self.guesses);
            let converges = interval.dt <= self.longest && !self.is_guessed;
            if converges { Status::Converged } else { self.otherwise }
        }

        fn is_guessed(&self) -> bool {
            self.is_guessed
        }

        fn roll_back(&mut self) {
            self.rolled_back += 1;
        }

        fn restart(&mut self) {}

        fn accept(&mut self, status: Status, _: &StepParams) -> Status {
            self.accepted.push((self.last.time, self.last.dt, status));
            status
        }

        fn counters_mut(&mut self) -> &mut Counters {
            &mut self.counters
        }

        fn count_dropped(&mut self) {
            self.counters.guesses_dropped += 1;
        }
    }

    #[test]
    fn a_step_is_halved_until_it_converges() {
        let mut fake = Fake::new(0.25, Status::OutOfIterations, false);
        assert_eq!(fake.advance(6), Status::ConvergedInSubsteps);
        let quarters = [1.0, 1.25, 1.5, 1.75].map(|time| (time, 0.25, Status::Converged));
        assert_eq!(fake.accepted, quarters);
        assert_eq!((fake.counters.retries, fake.rolled_back), (3, 3));
    }

    #[test]
    fn at_the_last_halving_it_is_accepted_as_it_is() {
        let mut fake = Fake::new(0.0, Status::OutOfIterations, false);
        assert_eq!(fake.advance(1), Status::OutOfIterations);
        assert_eq!(fake.accepted, [1.0, 1.5].map(|time| (time, 0.5, Status::OutOfIterations)));
    }

    #[test]
    fn more_contacts_than_memory_are_not_halved() {
        let mut fake = Fake::new(0.0, Status::TooManyContacts, false);
        assert_eq!(fake.advance(6), Status::TooManyContacts);
        assert_eq!(fake.accepted, [(1.0, 1.0, Status::TooManyContacts)]);
        assert_eq!(fake.counters.retries, 0);
    }

    #[test]
    fn where_numbers_are_not_finite_the_rest_of_the_step_is_left() {
        let mut fake = Fake::new(0.0, Status::NonFinite, false);
        assert_eq!(fake.advance(2), Status::NonFinite);
        assert_eq!(fake.accepted, [(1.0, 0.25, Status::NonFinite)]);
    }

    #[test]
    fn a_guess_that_does_not_converge_gives_way_to_the_prediction() {
        let mut fake = Fake::new(1.0, Status::OutOfIterations, true);
        assert_eq!(fake.advance(6), Status::Converged);
        assert_eq!(fake.accepted, [(1.0, 1.0, Status::Converged)]);
        assert_eq!((fake.counters.guesses_dropped, fake.counters.retries, fake.rolled_back), (1, 0, 1));
    }
}

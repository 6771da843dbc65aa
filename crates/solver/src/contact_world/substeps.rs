//! In how many parts sets in contact begin a step, from how those before it went.

use crate::snapshot::StateVisitor;

/// Most steps in a row that begin in parts for one attempt that was taken back.
const MOST: u32 = 8;

/// How often the next step of sets in contact is halved before it is tried.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct SubstepController {
    pub(super) halvings: u32,
    /// For how many more steps it is halved at least as often, and for how many after an attempt was last taken back. A step that is
    /// tried as a whole too soon costs its iterations in vain; one in parts too many costs few more than the whole one.
    holds: u32,
    held: u32,
}

impl SubstepController {
    /// That of two sets that go together from now on.
    pub(super) fn and(self, other: Self) -> Self {
        Self {
            halvings: self.halvings.max(other.halvings),
            holds: self.holds.max(other.holds),
            held: self.held.max(other.held),
        }
    }

    /// After a step that was done in so many parts. `is_refused`: an attempt at it was taken back; `is_easy`: its parts took few
    /// iterations.
    pub(super) fn after_parts(self, parts: usize, is_refused: bool, is_easy: bool) -> Self {
        let halvings = parts.max(1).ilog2();
        if is_refused {
            let held = (2 * self.held).clamp(1, MOST);
            return Self { halvings, holds: held - 1, held };
        }
        let goes_on = is_easy && self.holds == 0;
        Self { halvings: halvings.saturating_sub(u32::from(goes_on)), holds: self.holds.saturating_sub(1), ..self }
    }

    /// After a step that was done as a whole.
    pub(super) fn after_whole(self) -> Self {
        Self { halvings: 0, holds: 0, held: self.held / 2 }
    }

    /// Shows it to a visitor.
    pub(crate) fn visit_state(&mut self, visitor: &mut StateVisitor<'_>) {
        for number in [&mut self.halvings, &mut self.holds, &mut self.held] {
            let mut count = *number as usize;
            visitor.count(&mut count);
            *number = count as u32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_steps_are_tried_later_after_each_that_was_taken_back() {
        let mut pace = SubstepController::default();
        let mut waits = Vec::new();
        for _ in 0..6 {
            pace = pace.after_parts(2, true, true);
            let mut steps = 0;
            while pace.halvings > 0 {
                pace = pace.after_parts(2, false, true);
                steps += 1;
            }
            waits.push(steps);
        }
        assert_eq!(waits, [1, 2, 4, 8, 8, 8]);
        pace = pace.after_whole().after_whole();
        assert_eq!(pace.after_parts(2, true, true), SubstepController { halvings: 1, holds: 3, held: 4 });
    }

    #[test]
    fn parts_that_take_many_iterations_stay() {
        let pace = SubstepController::default().after_parts(4, true, false);
        assert_eq!((pace.halvings, pace.after_parts(4, false, false).halvings), (2, 2));
        assert_eq!(pace.after_parts(4, false, true).halvings, 1);
        assert_eq!(pace.and(SubstepController::default()), pace);
    }
}

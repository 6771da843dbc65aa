//! Which matrix a connected set iterates with: the exact tangent or the positive one, whichever takes less work.
//!
//! What the exact tangent saves depends on the motion: four iterations of five of a tree that swings, none of a rod that hangs
//! nearly straight. So the work of steps with either is averaged, and the cheaper one is taken. The other one is tried now and
//! then, less and less often as long as it stays the dearer one. A trial that has taken more work than the usual way
//! goes on with that, so that it costs less than one step more. Iterations are counted, and sweeps over contacts; no time is
//! measured: the same motion takes the same way on every machine.

use component::snapshot::StateVisitor;
use jointed::topology::Topology;

/// Work of an iteration with the exact tangent, where one with the positive matrix is 1.
const EXACT: f64 = 1.35;
/// The same where the positive matrix goes round a ring, and so takes a sparse factor.
const EXACT_OF_RINGS: f64 = 1.0;
/// Work of a sweep over as many contacts as there are segments.
const SWEEP: f64 = 0.2;
/// Weight of a step in the average of the way that is taken.
const WEIGHT: f64 = 0.25;
/// Weight of a trial in the average of the other one.
const WEIGHT_OF_TRIAL: f64 = 0.75;
/// Steps from one trial to the next, at first and at most.
const GAPS: [u64; 2] = [4, 64];

/// What the steps of both ways have taken so far.
#[derive(Clone, Debug)]
pub(crate) struct TangentChoice {
    /// Mean work of a step with the positive matrix and with the exact tangent; negative before the first.
    means: [f64; 2],
    /// The way that is taken: 1 is the exact tangent.
    usual: usize,
    /// Steps to the next trial, and from that one to the one after it.
    wait: u64,
    gap: u64,
    /// Work of the step under way.
    work: f64,
    /// Work of an iteration with the exact tangent.
    exact: f64,
}

impl TangentChoice {
    /// Nothing is known yet of sets of this connectivity.
    pub(crate) fn new(topology: &Topology) -> Self {
        let exact = if topology.elimination.is_some() { EXACT } else { EXACT_OF_RINGS };
        Self { means: [-1.0; 2], usual: 1, wait: GAPS[0], gap: GAPS[0], work: 0.0, exact }
    }

    /// Whether the next iteration is to take the exact tangent.
    pub(crate) fn is_exact(&self) -> bool {
        let is_trial = self.wait == 0 && self.work <= self.means[self.usual];
        (self.usual == 1) != is_trial
    }

    /// Counts an iteration.
    pub(crate) fn count(&mut self, is_exact: bool) {
        self.work += if is_exact { self.exact } else { 1.0 };
    }

    /// Counts sweeps over contacts, so many in all, in an island of `segments`.
    pub(crate) fn count_sweeps(&mut self, contacts: u64, segments: usize) {
        self.work += SWEEP * contacts as f64 / segments as f64;
    }

    /// Ends a step, with all attempts at it.
    pub(crate) fn end_step(&mut self) {
        let work = std::mem::take(&mut self.work);
        let is_trial = self.wait == 0;
        let way = if is_trial { 1 - self.usual } else { self.usual };
        let weight = match is_trial {
            _ if self.means[way] < 0.0 => 1.0,
            true => WEIGHT_OF_TRIAL,
            false => WEIGHT,
        };
        self.means[way] += weight * (work - self.means[way]);
        if !is_trial {
            self.wait -= 1;
        } else {
            let pays = self.means[way] < self.means[self.usual];
            self.gap = if pays { GAPS[0] } else { (2 * self.gap).min(GAPS[1]) };
            self.usual = if pays { way } else { self.usual };
            self.wait = self.gap;
        }
    }

    /// Shows a visitor all of it.
    pub(crate) fn visit_state(&mut self, visitor: &mut StateVisitor<'_>) {
        let Self { means, usual, wait, gap, work: _, exact: _ } = self;
        means.iter_mut().for_each(|mean| visitor.number(mean));
        let mut way = *usual as u64;
        [&mut way, wait, gap].into_iter().for_each(|word| visitor.word(word));
        *usual = (way == 1).into();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn choice() -> TangentChoice {
        TangentChoice::new(&Topology::new(vec![[0, 1]], vec![false; 2]))
    }

    /// Work a step by the choice where steps with the positive matrix and with the exact tangent take so many.
    fn mean_work(needs: [usize; 2], choice: &mut TangentChoice) -> f64 {
        let steps = 500;
        let mut sum = 0.0;
        for _ in 0..steps {
            // What is left of the step, of which an iteration takes its share.
            let mut left = 1.0;
            while left > 1e-9 {
                let is_exact = choice.is_exact();
                choice.count(is_exact);
                left -= 1.0 / needs[usize::from(is_exact)] as f64;
                sum += if is_exact { EXACT } else { 1.0 };
            }
            choice.end_step();
        }
        sum / f64::from(steps)
    }

    #[test]
    fn the_cheaper_way_is_taken() {
        for (needs, is_exact) in [([16, 2], true), ([7, 3], true), ([2, 1], true), ([1, 1], false), ([2, 2], false)] {
            let mut choice = choice();
            let work = mean_work(needs, &mut choice);
            let best = if is_exact { EXACT * needs[1] as f64 } else { needs[0] as f64 };
            assert_eq!(choice.usual == 1, is_exact, "{needs:?}");
            assert!(work < 1.05 * best, "{needs:?}: {work}, at best {best}");
        }
    }

    #[test]
    fn a_change_of_the_motion_is_found_out() {
        let mut choice = choice();
        mean_work([10, 2], &mut choice);
        assert_eq!(choice.usual, 1);
        mean_work([1, 1], &mut choice);
        assert_eq!(choice.usual, 0);
        mean_work([10, 2], &mut choice);
        assert_eq!(choice.usual, 1);
    }
}

//! Many random scenes on several threads.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::iter::{IntoParallelIterator, ParallelIterator};

use crate::case::Case;
use crate::check::{Checked, check};
use crate::draw::draw;
use crate::law::Violation;
use crate::shrink::shrink;

/// A law that a scene breaks.
#[derive(Clone, Debug)]
pub struct Failure {
    /// The scene's number.
    pub index: u64,
    /// How it breaks the law as it was drawn.
    pub drawn: Violation,
    /// The minimal case.
    pub case: Case,
    /// How that one breaks the law.
    pub minimal: Violation,
}

/// What a campaign found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Found {
    /// Laws that were broken, each counted once a scene.
    pub failures: u64,
    /// Scenes that were run.
    pub scenes: u64,
    /// Those with a step that was not solved.
    pub unsolved_scenes: u64,
    /// Steps of all scenes.
    pub steps: u64,
    /// Those not solved.
    pub unsolved_steps: u64,
    /// Contact forces that were checked.
    pub contacts: u64,
}

impl Found {
    /// What both found together.
    pub fn and(self, other: Self) -> Self {
        Self {
            failures: self.failures + other.failures,
            scenes: self.scenes + other.scenes,
            unsolved_scenes: self.unsolved_scenes + other.unsolved_scenes,
            steps: self.steps + other.steps,
            unsolved_steps: self.unsolved_steps + other.unsolved_steps,
            contacts: self.contacts + other.contacts,
        }
    }
}

/// Checks these scenes of a seed on rayon's threads. `tell` is called after each scene with what it breaks, from any thread;
/// where it says false, no further scenes are begun.
pub fn campaign(seed: u64, scenes: Range<u64>, tell: &(dyn Fn(&[Failure]) -> bool + Sync)) -> Found {
    let goes_on = AtomicBool::new(true);
    let one = |index: u64| {
        let case = draw(seed, index);
        // What is drawn was accepted.
        let Checked::Ran(report) = check(&case) else { return Found::default() };
        let failure = |drawn: &Violation| {
            let (case, minimal) = shrink(&case, drawn);
            Failure { index, drawn: drawn.clone(), case, minimal }
        };
        let failures: Vec<_> = report.violations.iter().map(failure).collect();
        if !tell(&failures) {
            goes_on.store(false, Ordering::Relaxed);
        }
        Found {
            failures: failures.len() as u64,
            scenes: 1,
            unsolved_scenes: u64::from(report.unsolved > 0),
            steps: report.steps as u64,
            unsolved_steps: report.unsolved as u64,
            contacts: report.contacts as u64,
        }
    };
    let scenes = scenes.into_par_iter().take_any_while(|_| goes_on.load(Ordering::Relaxed));
    scenes.map(one).reduce(Found::default, Found::and)
}

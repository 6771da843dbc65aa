//! Many random scenes on several threads.

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use crate::case::Case;
use crate::check::{Checked, Pools, Report, check_in};
use crate::draw::draw;
use crate::features::features;
use crate::laws::{Broken, Law};
use crate::shrink::shrink_in;

/// Which scenes to look at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Campaign {
    /// Seed of them.
    pub seed: u64,
    /// The first scene.
    pub first: u64,
    /// How many there are.
    pub count: u64,
    /// Whether cases that break a law are made small.
    pub shrinks: bool,
}

/// A law that a scene breaks.
#[derive(Clone, Debug)]
pub struct Failure {
    /// The scene's number.
    pub index: u64,
    /// How it breaks the law as it was drawn.
    pub broken: Broken,
    /// The small case, or as it was drawn where nothing was made small.
    pub case: Case,
    /// How the small one does.
    pub small: Broken,
}

/// How many scenes of a kind there were, and what became of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Share {
    /// Scenes.
    pub scenes: u64,
    /// Those with a step that was not solved.
    pub unsolved: u64,
    /// Those with a step that was solved in parts.
    pub in_parts: u64,
    /// Those that break a law.
    pub broken: u64,
}

/// A row of the table: a feature of scenes and their share.
pub type Feature = (String, Share);

/// What a campaign found.
#[derive(Clone, Debug, Default)]
pub struct Found {
    /// Laws that were broken, by scene.
    pub failures: Vec<Failure>,
    /// All scenes.
    pub all: Share,
    /// Steps of all scenes, and those not solved.
    pub steps: [u64; 2],
    /// Contact forces that were looked at.
    pub contacts: u64,
    /// Scenes by what they have, by name.
    pub features: BTreeMap<String, Share>,
}

impl Share {
    fn add(&mut self, report: &Report) {
        self.scenes += 1;
        self.unsolved += u64::from(report.unsolved > 0);
        self.in_parts += u64::from(report.in_parts > 0);
        self.broken += u64::from(!report.broken.is_empty());
    }
}

/// Looks at these scenes on as many threads as rayon's current pool has. `tell` is called after each scene with what it
/// breaks, from any thread; where it says false, no further scenes are begun. What is found is in the order of scenes.
///
/// # Errors
/// If the system gives no threads.
pub fn campaign(
    campaign: &Campaign,
    tell: &(dyn Fn(&[Failure]) -> bool + Sync),
) -> Result<Found, rayon::ThreadPoolBuildError> {
    let threads = rayon::current_num_threads();
    let pools = (0..threads).map(|_| Pools::new()).collect::<Result<Vec<_>, _>>()?;
    let (next, stopped) = (AtomicU64::new(campaign.first), AtomicBool::new(false));
    let end = campaign.first.saturating_add(campaign.count);
    let found = Mutex::new(Found::default());
    std::thread::scope(|scope| {
        for pools in &pools {
            scope.spawn(|| {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    if index >= end || stopped.load(Ordering::Relaxed) {
                        return;
                    }
                    let case = draw(campaign.seed, index);
                    let Checked::Ran(report) = check_in(&case, pools) else { continue };
                    let is_over = || stopped.load(Ordering::Relaxed);
                    let failures = failures(campaign, index, &case, &report, pools, &is_over);
                    if !tell(&failures) {
                        stopped.store(true, Ordering::Relaxed);
                    }
                    let mut found = match found.lock() {
                        Ok(found) => found,
                        Err(poisoned) => poisoned.into_inner(),
                    };
                    found.take(&case, &report, failures);
                }
            });
        }
    });
    let mut found = found.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    found.failures.sort_by_key(|failure| (failure.index, failure.broken.law));
    Ok(found)
}

fn failures(
    campaign: &Campaign,
    index: u64,
    case: &Case,
    report: &Report,
    pools: &Pools,
    stop: &dyn Fn() -> bool,
) -> Vec<Failure> {
    let of = |broken: &Broken| {
        let (small, how) = match campaign.shrinks {
            true => shrink_in(case, broken.law, pools, stop),
            false => (case.clone(), None),
        };
        Failure { index, broken: broken.clone(), case: small, small: how.unwrap_or_else(|| broken.clone()) }
    };
    report.broken.iter().map(of).collect()
}

impl Found {
    fn take(&mut self, case: &Case, report: &Report, failures: Vec<Failure>) {
        self.all.add(report);
        self.steps[0] += report.steps as u64;
        self.steps[1] += report.unsolved as u64;
        self.contacts += report.contacts as u64;
        for feature in features(case) {
            self.features.entry(feature).or_default().add(report);
        }
        self.failures.extend(failures);
    }

    /// How many scenes break each law, in the order of laws.
    pub fn by_law(&self) -> Vec<(Law, usize)> {
        let count = |law: Law| self.failures.iter().filter(|failure| failure.broken.law == law).count();
        Law::ALL.into_iter().map(|law| (law, count(law))).collect()
    }
}

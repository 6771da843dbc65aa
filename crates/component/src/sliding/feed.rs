//! A drive at an eyelet.

use rod::Feed;

/// A drive in motion.
#[derive(Clone, Debug)]
pub(super) struct Drive {
    pub(super) feed: Feed,
    /// A speed that was set on the way [m/s].
    pub(super) set: Option<f64>,
    /// The joint after each segment of the rod but the last.
    pub(super) joints: Vec<usize>,
}

impl Drive {
    /// That of a feed, with the joints of its rod.
    pub(super) fn new(feed: &Feed, joints: Vec<usize>) -> Self {
        Self { feed: feed.clone(), set: None, joints }
    }

    /// Speed at a time [m/s].
    pub(super) fn speed(&self, time: f64) -> f64 {
        self.set.unwrap_or_else(|| self.feed.speed(time))
    }
}

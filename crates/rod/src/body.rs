//! What joints hold on to.

use std::fmt;

/// What a joint holds on to: a segment or an anchor in the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Body {
    /// Index into [`crate::Model::segments`].
    Segment(usize),
    /// Index into [`crate::Model::anchors`].
    Anchor(usize),
}

impl fmt::Display for Body {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Body::Segment(i) => write!(f, "segment {i}"),
            Body::Anchor(i) => write!(f, "anchor {i}"),
        }
    }
}

//! Which segments, joints and anchors of a model form a connected set.

use rod::Body;

/// Which segments and joints of a model form a component, by their indices there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Members {
    /// Segments, ascending.
    pub segments: Vec<usize>,
    /// Joints, ascending.
    pub joints: Vec<usize>,
    /// Anchors, ascending.
    pub anchors: Vec<usize>,
}

impl Members {
    /// The body of the component that is a body of the model; `None` where it belongs to another component.
    pub fn body(&self, body: Body) -> Option<usize> {
        match body {
            Body::Segment(i) => self.segments.binary_search(&i).ok(),
            Body::Anchor(i) => self.anchors.binary_search(&i).ok().map(|k| self.segments.len() + k),
        }
    }
}

//! What identifies a contact from step to step: a segment, what it touches, and which of their places are held apart.

/// What a segment touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Partner {
    /// A segment of the model with a higher index.
    Segment(u32),
    /// An obstacle that is round, or a half-space.
    Obstacle(u32),
    /// An obstacle, and a triangle of its mesh.
    Face(u32, u32),
    /// An obstacle, and an edge of its mesh.
    Edge(u32, u32),
    /// An obstacle, and a corner of its mesh or an end of its axis.
    Corner(u32, u32),
    /// A segment that is a rigid body, and a triangle of its mesh.
    BodyFace(u32, u32),
    /// A segment that is a rigid body, and an edge of its mesh.
    BodyEdge(u32, u32),
    /// The wall of a sheath of the model, in which the segment is.
    Sheath(u32),
}

impl Partner {
    /// The segment or obstacle that it is, or is a part of.
    pub fn whole(self) -> Self {
        match self {
            Partner::Segment(i) | Partner::BodyFace(i, _) | Partner::BodyEdge(i, _) => Partner::Segment(i),
            Partner::Obstacle(i) | Partner::Face(i, _) | Partner::Edge(i, _) | Partner::Corner(i, _) => {
                Partner::Obstacle(i)
            }
            Partner::Sheath(_) => self,
        }
    }

    /// The obstacle, if it is one or a part of one.
    pub fn obstacle(self) -> Option<u32> {
        if let Partner::Obstacle(i) = self.whole() { Some(i) } else { None }
    }

    /// The segment, if it is one or a part of one.
    pub fn segment(self) -> Option<u32> {
        if let Partner::Segment(i) = self.whole() { Some(i) } else { None }
    }
}

/// Which points of the two axes a contact holds apart.
///
/// Two axes that cross have one nearest place; two that are almost parallel touch along a line, whose ends are ends of
/// the axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Feature {
    /// The nearest points of both.
    Nearest,
    /// An end of the segment's own axis, 0 or 1, and what of the partner is nearest to it.
    Own(u8),
    /// An end of the partner's axis and what of the segment's is nearest to it.
    Partners(u8),
    /// A corner of the mesh that the segment has as a rigid body.
    Corner(u32),
    /// A triangle of that mesh.
    Face(u32),
    /// An edge of that mesh.
    Edge(u32),
}

impl Feature {
    /// All that hold two almost parallel axes apart.
    pub(crate) const PARALLEL: [Feature; 5] =
        [Feature::Nearest, Feature::Own(0), Feature::Own(1), Feature::Partners(0), Feature::Partners(1)];
}

/// Identifies a contact from step to step.
pub type Key = (u32, Partner, Feature);

/// A [`Key`] as words. The first one holds the segment and, from bit 32 on, which corner, face or edge of it the feature is.
/// The last one holds, from its lowest bit on: what the feature is (2 bits), its end, whether the partner is a face (1), an
/// edge (2) or a corner (3) of a mesh, or the wall of a sheath (3, where an obstacle's bit is not set) (2 bits), whether the feature is a face (1) or an edge (2) where it is a part of a mesh
/// (2 bits), and, from bit 32 on, which part of the partner.
pub(super) fn words((segment, partner, feature): Key) -> [u64; 3] {
    let (kind, part) = match partner {
        Partner::Segment(_) | Partner::Obstacle(_) => (0, 0),
        Partner::Face(_, part) | Partner::BodyFace(_, part) => (1, part),
        Partner::Edge(_, part) | Partner::BodyEdge(_, part) => (2, part),
        Partner::Corner(_, part) => (3, part),
        Partner::Sheath(_) => (3, 0),
    };
    let partner = match partner.whole() {
        Partner::Segment(i) | Partner::Sheath(i) => u64::from(i) << 1,
        other => u64::from(other.obstacle().unwrap_or_default()) << 1 | 1,
    };
    let (feature, own) = match feature {
        Feature::Nearest => (0, 0),
        Feature::Own(end) => (1 | u64::from(end) << 2, 0),
        Feature::Partners(end) => (2 | u64::from(end) << 2, 0),
        Feature::Corner(corner) => (3, corner),
        Feature::Face(face) => (3 | 1 << 5, face),
        Feature::Edge(edge) => (3 | 2 << 5, edge),
    };
    [u64::from(segment) | u64::from(own) << 32, partner, feature | kind << 3 | u64::from(part) << 32]
}

/// The inverse of [`words`].
pub(super) fn key([segment, partner, feature]: [u64; 3]) -> Key {
    let (index, part, own) = ((partner >> 1) as u32, (feature >> 32) as u32, (segment >> 32) as u32);
    let partner = match (partner & 1, feature >> 3 & 3) {
        (0, 1) => Partner::BodyFace(index, part),
        (0, 2) => Partner::BodyEdge(index, part),
        (0, 3) => Partner::Sheath(index),
        (0, _) => Partner::Segment(index),
        (_, 1) => Partner::Face(index, part),
        (_, 2) => Partner::Edge(index, part),
        (_, 3) => Partner::Corner(index, part),
        _ => Partner::Obstacle(index),
    };
    let end = (feature >> 2 & 1) as u8;
    let feature = match (feature & 3, feature >> 5 & 3) {
        (0, _) => Feature::Nearest,
        (1, _) => Feature::Own(end),
        (2, _) => Feature::Partners(end),
        (_, 1) => Feature::Face(own),
        (_, 2) => Feature::Edge(own),
        _ => Feature::Corner(own),
    };
    (segment as u32, partner, feature)
}

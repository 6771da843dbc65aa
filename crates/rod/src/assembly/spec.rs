//! What a rod is to be built of.

use std::sync::Arc;

use nalgebra::{UnitQuaternion, Vector3};

use crate::{InnerDamping, JointLaw, Material, ModelError, Section, Strength, Stretch, Track};

/// The shape in which a rod has no bend-twist energy.
#[derive(Clone, Debug, PartialEq)]
pub enum RestShape {
    /// The shape it is built in.
    Initial,
    /// Straight and without twist.
    Straight,
    /// The same Darboux vector [1/m] at every joint.
    Uniform(Vector3<f64>),
    /// One Darboux vector [1/m] a joint, in order (a closed rod's last joint comes last).
    PerJoint(Vec<Vector3<f64>>),
}

/// A rod to be built.
#[derive(Clone, Debug, PartialEq)]
pub struct RodSpec {
    /// Centreline [m]: at least two nodes, and one segment between each two consecutive ones, which must not coincide.
    pub nodes: Vec<Vector3<f64>>,
    /// Whether a further segment joins the last node to the first, and the last segment to the first.
    pub closed: bool,
    /// Radius [m] of every segment, or one value a segment: with it a segment touches and feels the air.
    pub radii: Vec<f64>,
    /// Section of every segment, or one a segment; none: full circles of these radii.
    pub sections: Vec<Section>,
    /// Material.
    pub material: Material,
    /// Resistance to stretch and shear.
    pub stretch: Stretch,
    /// Inner damping of the joints.
    pub inner_damping: InnerDamping,
    /// Law of the joints of every segment, or one a segment; none: elastic. It holds where the rod is clamped, too.
    pub laws: Vec<JointLaw>,
    /// What the joints of every segment bear, or one a segment; none: they never break. It holds where the rod is clamped, too.
    pub strengths: Vec<Strength>,
    /// Direction of d1 of the first segment, of any length; its part across the axis counts. `None`: the smallest rotation
    /// that takes world z to the axis takes world x to it. From there frames go on without twist, but for `twist`.
    pub d1: Option<Vector3<f64>>,
    /// Turn of the material frame about the centreline from the first to the last segment [rad].
    pub twist: f64,
    /// Shape without bend-twist energy.
    pub rest: RestShape,
    /// The rest Darboux vectors of its joints over time [1/m], as of [`RestShape`]: none, one for all, or one a joint. They are instead of `rest`.
    pub rests: Vec<Arc<Track>>,
    /// Strain of every segment as it is drawn, or one value a segment: its own length is that between its nodes over
    /// 1 + strain, and it lies in the middle of it, so that joints start with gaps. 0.1 is a rod drawn a tenth too long.
    /// Mass and stiffness are those of its own length. Needs a [`Stretch`] that gives way.
    pub strains: Vec<f64>,
}

impl RodSpec {
    /// An open rod of one `radius` [m] along `nodes` [m], stiff against stretch, at rest as it is built.
    pub fn new(nodes: Vec<Vector3<f64>>, radius: f64, material: Material) -> Self {
        Self {
            nodes,
            closed: false,
            radii: vec![radius],
            sections: Vec::new(),
            material,
            stretch: Stretch::ZERO_STRETCH,
            inner_damping: InnerDamping::NONE,
            laws: Vec::new(),
            strengths: Vec::new(),
            d1: None,
            twist: 0.0,
            rest: RestShape::Initial,
            rests: Vec::new(),
            strains: vec![0.0],
        }
    }

    /// Number of segments and of joints between them.
    pub(super) fn counts(&self) -> (usize, usize) {
        let open = self.nodes.len().saturating_sub(1);
        match self.closed {
            true if open > 1 => (open + 1, open + 1),
            true => (open + 1, open),
            false => (open, open.saturating_sub(1)),
        }
    }

    /// Checks that there are as many nodes, radii and rest vectors as there must be; `rod` is the rod's index.
    pub(super) fn validate(&self, rod: usize) -> Result<(), ModelError> {
        let (segments, joints) = self.counts();
        let check = |quantity, found: usize, ok: bool, allowed: String| {
            if ok { Ok(()) } else { Err(ModelError::Count { what: "rod", index: rod, quantity, found, allowed }) }
        };
        let nodes = self.nodes.len();
        check("nodes", nodes, nodes >= 2, "2 or more".to_owned())?;
        let radii = self.radii.len();
        check("radii", radii, radii == 1 || radii == segments, format!("1, or one a segment ({segments})"))?;
        let strains = self.strains.len();
        check("strains", strains, strains == 1 || strains == segments, format!("1, or one a segment ({segments})"))?;
        let sections = self.sections.len();
        check(
            "sections",
            sections,
            sections <= 1 || sections == segments,
            format!("0, 1, or one a segment ({segments})"),
        )?;
        let laws = self.laws.len();
        check("laws", laws, laws <= 1 || laws == segments, format!("0, 1, or one a segment ({segments})"))?;
        let strengths = self.strengths.len();
        check(
            "strengths",
            strengths,
            strengths <= 1 || strengths == segments,
            format!("0, 1, or one a segment ({segments})"),
        )?;
        let rests = self.rests.len();
        check("rests over time", rests, rests <= 1 || rests == joints, format!("0, 1, or one a joint ({joints})"))?;
        if let RestShape::PerJoint(omegas) = &self.rest {
            let found = omegas.len();
            check("rest Darboux vectors", found, found == joints, format!("one a joint ({joints})"))?;
        }
        Ok(())
    }

    /// Radius [m] and section of segment `i`, of which there must be one.
    pub fn section(&self, i: usize) -> (f64, Section) {
        let radius = if self.radii.len() == 1 { self.radii[0] } else { self.radii[i] };
        let own = if self.sections.len() == 1 { self.sections.first() } else { self.sections.get(i) };
        (radius, own.copied().unwrap_or(Section::Circle { radius }))
    }

    /// Turn of all frames about the rod's axis that brings d1 where it was asked for; `rod` is the rod's index.
    pub(super) fn roll(&self, first: &UnitQuaternion<f64>, rod: usize) -> Result<UnitQuaternion<f64>, ModelError> {
        let Some(d1) = self.d1 else { return Ok(UnitQuaternion::identity()) };
        let across = (first.inverse() * d1).xy();
        let share = across.norm() / d1.norm();
        if share.is_nan() || share < 1e-6 {
            let quantity = "part of d1 across the axis, over its length";
            return Err(ModelError::Value { what: "rod", index: rod, quantity, value: share, allowed: "1e-6 or more" });
        }
        Ok(UnitQuaternion::from_axis_angle(&Vector3::z_axis(), across.y.atan2(across.x)))
    }
}

//! Parameters by name, each as the variation that it makes.

use nalgebra::Vector3;
use rod::{Body, InnerDamping, Joint, Model};

use super::{JointVariation, SegmentVariation, Variation};

/// Of which rods a parameter is; a joint belongs to the rod of its body a, or b where a is an anchor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rods {
    /// Of all.
    All,
    /// Of the one with this index.
    One(usize),
}

impl Rods {
    fn has(self, rod: usize) -> bool {
        match self {
            Rods::All => true,
            Rods::One(index) => index == rod,
        }
    }

    fn has_joint(self, model: &Model, joint: &Joint) -> bool {
        let rods = [joint.a, joint.b].into_iter().filter_map(|body| match body {
            Body::Segment(i) => model.segments.get(i).map(|segment| segment.rod),
            Body::Anchor(_) => None,
        });
        rods.take(1).any(|rod| self.has(rod))
    }
}

/// A number that a run depends on. Stiffnesses and densities are factors: their derivative is that with respect to the
/// natural logarithm, `x d/dx`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Parameter {
    /// Stiffness against stretch, EA.
    Stretch(Rods),
    /// Stiffness against shear, kGA.
    Shear(Rods),
    /// Stiffness against bending about both axes of the section, EI.
    Bending(Rods),
    /// That about one axis of the section alone: 0 for d1, 1 for d2.
    BendingAbout(usize, Rods),
    /// Stiffness against twist, GJ.
    Torsion(Rods),
    /// Density; mass and inertia of rigid bodies are not of rods.
    Density(Rods),
    /// Relaxation time of inner damping in bending [s].
    InnerBending(Rods),
    /// That in twist [s].
    InnerTwist(Rods),
    /// That in stretch and shear [s].
    InnerStretch(Rods),
    /// Rate of linear damping [1/s].
    LinearDamping,
    /// Rate of angular damping [1/s].
    AngularDamping,
    /// Gravity along a world axis, 0 to 2 [m/s^2].
    Gravity(usize),
    /// Density of the air, as a factor.
    AirDensity,
    /// Drag coefficient across the axes.
    NormalDrag,
    /// Drag coefficient along the axes.
    TangentialDrag,
    /// Velocity of the air along a world axis, 0 to 2 [m/s].
    Wind(usize),
    /// All coefficients of friction, as a factor.
    Friction,
}

impl Parameter {
    /// What changes by a unit of it.
    pub fn variation(self, model: &Model) -> Variation {
        let mut out = Variation::zero(model);
        let unit = |axis: usize| Vector3::from_fn(|k, _| if k == axis { 1.0 } else { 0.0 });
        let mut joints = |rods: Rods, of: &dyn Fn(&Joint) -> JointVariation| {
            for (own, joint) in out.joints.iter_mut().zip(&model.joints).filter(|(_, j)| rods.has_joint(model, j)) {
                *own = of(joint);
            }
        };
        let none = JointVariation::default();
        let damping = |bending, twist, stretch| {
            move |_: &Joint| JointVariation { inner_damping: InnerDamping { bending, twist, stretch }, ..none }
        };
        match self {
            Self::Stretch(rods) => {
                joints(rods, &|joint| JointVariation { stretch_compliance: -joint.stretch_compliance, ..none });
            }
            Self::Shear(rods) => joints(rods, &|joint| JointVariation {
                shear_compliance: -joint.shear_compliance,
                shear_extra: -joint.shear_extra,
                ..none
            }),
            Self::Bending(rods) => joints(rods, &|joint| JointVariation {
                bend_compliance: -joint.bend_compliance,
                bend_extra: -joint.bend_extra,
                ..none
            }),
            Self::BendingAbout(0, rods) => joints(rods, &|joint| JointVariation {
                bend_compliance: -joint.bend_compliance,
                bend_extra: joint.bend_compliance,
                ..none
            }),
            Self::BendingAbout(_, rods) => joints(rods, &|joint| JointVariation {
                bend_extra: -(joint.bend_compliance + joint.bend_extra),
                ..none
            }),
            Self::Torsion(rods) => {
                joints(rods, &|joint| JointVariation { twist_compliance: -joint.twist_compliance, ..none });
            }
            Self::InnerBending(rods) => joints(rods, &damping(1.0, 0.0, 0.0)),
            Self::InnerTwist(rods) => joints(rods, &damping(0.0, 1.0, 0.0)),
            Self::InnerStretch(rods) => joints(rods, &damping(0.0, 0.0, 1.0)),
            Self::Density(rods) => {
                let own = model.segments.iter().enumerate();
                for (i, segment) in own.filter(|(_, own)| own.body.is_none() && rods.has(own.rod)) {
                    let (across, along) = (segment.transverse_inertia(), segment.axial_inertia());
                    let inertia = Vector3::new(across, across, along);
                    out.segments[i] = SegmentVariation { mass: segment.own_mass(), inertia };
                }
            }
            Self::LinearDamping => out.damping[0] = 1.0,
            Self::AngularDamping => out.damping[1] = 1.0,
            Self::Gravity(axis) => out.gravity = unit(axis),
            Self::AirDensity => out.air.density = model.air.as_ref().map_or(0.0, |air| air.density),
            Self::NormalDrag => out.air.normal_drag = 1.0,
            Self::TangentialDrag => out.air.tangential_drag = 1.0,
            Self::Wind(axis) => out.air.wind = unit(axis),
            Self::Friction => out.friction = 1.0,
        }
        out
    }
}

//! Joints whose moments are no function of their curvature alone: plasticity, friction between strands,
//! viscoelasticity, tables of moment over curvature.
//!
//! A law takes the strain of a joint, C_b in its rows ([`crate::measure::bend_strain`]), to its moments about d1 and d2 and its torque
//! about d3, from internal variables at the start of a step. That is an implicit return mapping with its algorithmic tangent (Simo and Hughes,
//! Computational Inelasticity, 1998, chapters 1 to 3 and 10): a step knows strain, moment and dM/dC_b at its end alone. Stretch and shear
//! stay elastic. For rods with such laws in the resultants see Smriti, Kumar, Grossmann and Steinmann, "A thermoelastoplastic theory for
//! special Cosserat rods" (2019), and Smriti, Kumar and Steinmann, "A finite element formulation for a direct approach to elastoplasticity in
//! special Cosserat rods" (2021).

mod checks;
mod maxwell;
mod moment_table;
mod plasticity;
mod strand_friction;
mod variables;

use std::sync::Arc;

use nalgebra::Vector3;

pub use maxwell::MaxwellBranch;
pub use moment_table::{MomentTable, Unloading};
pub use plasticity::Plasticity;
pub use strand_friction::StrandFriction;
pub use variables::{Answer, InternalVariables};

/// How the moments of a joint follow from the history of its curvatures and its twist. The elastic stiffnesses are those of the joint.
#[derive(Clone, Debug, PartialEq)]
pub enum JointLaw {
    /// It yields, and keeps a set.
    Plastic(Plasticity),
    /// Strands slip as it bends: hysteresis without a set that stays.
    Friction(StrandFriction),
    /// Branches of springs and dashpots in series beside a spring: the generalised Maxwell model. With one branch it is the standard linear
    /// solid.
    Viscoelastic(Vec<MaxwellBranch>),
    /// It bends by a table of moment over curvature.
    Tabulated(MomentTable),
}

/// A joint of a model that has a law.
#[derive(Clone, Debug, PartialEq)]
pub struct InelasticJoint {
    /// Index of the joint.
    pub joint: usize,
    /// Its law; joints of a rod share one.
    pub law: Arc<JointLaw>,
}

impl JointLaw {
    /// Internal variables before the first step: without a strain, relaxed.
    pub fn rest(&self) -> InternalVariables {
        InternalVariables { parts: vec![Vector3::zeros(); self.parts()], ..InternalVariables::default() }
    }

    /// How many vectors it remembers.
    fn parts(&self) -> usize {
        match self {
            Self::Plastic(_) | Self::Friction(_) => 1,
            Self::Viscoelastic(branches) => branches.len(),
            Self::Tabulated(own) => own.parts(),
        }
    }

    /// What a joint of these elastic stiffnesses [N m^2] answers a `strain` [1/m] with, at the end of a step of `dt` [s] that began with `at`.
    /// After an infinite one all that relaxes has done so.
    pub fn answer(&self, stiffness: &Vector3<f64>, strain: &Vector3<f64>, at: &InternalVariables, dt: f64) -> Answer {
        match self {
            Self::Plastic(own) => own.answer(stiffness, strain, at),
            Self::Friction(own) => own.answer(stiffness, strain, at),
            Self::Viscoelastic(branches) => maxwell::answer(branches, stiffness, strain, at, dt),
            Self::Tabulated(own) => own.answer(stiffness, strain, at),
        }
    }

    /// What a joint answers a `strain` [1/m] with to which it goes from `at` without a flow, a slip or a relaxation: by the stiffness of unloading,
    /// of strands that stick, and of all branches at once. A table goes on along its curve; by Masing's rule it turns there.
    pub fn sudden(&self, stiffness: &Vector3<f64>, strain: &Vector3<f64>, at: &InternalVariables) -> Answer {
        match self {
            Self::Plastic(own) => own.sudden(stiffness, strain, at),
            Self::Friction(own) => own.sudden(stiffness, strain, at),
            Self::Viscoelastic(branches) => maxwell::answer(branches, stiffness, strain, at, 0.0),
            Self::Tabulated(own) => own.sudden(stiffness, strain, at),
        }
    }

    /// The time of inner damping [s] that takes as much as what relaxes does, per cycle of a small vibration with the angular frequency `omega` [rad/s]:
    /// `sum g_j t_j / (1 + (omega t_j)^2)`.
    pub fn relaxing(&self, omega: f64) -> f64 {
        match self {
            Self::Viscoelastic(branches) => maxwell::relaxing(branches, omega),
            Self::Plastic(_) | Self::Friction(_) | Self::Tabulated(_) => 0.0,
        }
    }

    /// The strain [1/m] at which an iteration is to ask [`JointLaw::answer`], where it has come to this strain [1/m] and this moment [N m], which
    /// need not go together yet. Where they do it is the strain.
    pub fn resolve(
        &self,
        stiffness: &Vector3<f64>,
        [strain, moment]: [&Vector3<f64>; 2],
        at: &InternalVariables,
    ) -> Vector3<f64> {
        match self {
            Self::Plastic(own) => own.resolve(stiffness, [strain, moment], at),
            Self::Tabulated(own) => own.resolve(stiffness, [strain, moment], at),
            Self::Friction(_) | Self::Viscoelastic(_) => *strain,
        }
    }

    /// Ends a step of `dt` [s] at a `strain` [1/m].
    pub fn advance(&self, stiffness: &Vector3<f64>, strain: &Vector3<f64>, at: &mut InternalVariables, dt: f64) {
        match self {
            Self::Plastic(own) => own.advance(stiffness, strain, at),
            Self::Friction(own) => own.advance(strain, at),
            Self::Viscoelastic(branches) => maxwell::advance(branches, stiffness, strain, at, dt),
            Self::Tabulated(own) => own.advance(strain, at),
        }
        at.strain = *strain;
    }

    /// Energy per length that can be had back [J/m] at a strain [1/m] to which the joint goes without a loss from where its last step ended.
    pub fn stored(&self, stiffness: &Vector3<f64>, strain: &Vector3<f64>, at: &InternalVariables) -> f64 {
        match self {
            Self::Plastic(own) => own.stored(stiffness, strain, at),
            Self::Friction(own) => own.stored(stiffness, strain, at),
            Self::Viscoelastic(branches) => maxwell::stored(branches, stiffness, strain, at),
            Self::Tabulated(own) => own.stored(stiffness, strain, at),
        }
    }

    /// Plastic curvatures and twist [1/m]: the strain that stays when nothing bends the joint any more; zero of other laws.
    pub fn set(&self, at: &InternalVariables) -> Vector3<f64> {
        match self {
            Self::Plastic(_) => at.parts.first().copied().unwrap_or_default(),
            Self::Tabulated(own) => own.set(at),
            Self::Friction(_) | Self::Viscoelastic(_) => Vector3::zeros(),
        }
    }

    /// Bending stiffness of its joints [N m^2], where it is not that of their sections.
    pub(crate) fn bending_stiffness(&self) -> Option<f64> {
        match self {
            Self::Tabulated(own) => Some(own.stiffness()),
            Self::Plastic(_) | Self::Friction(_) | Self::Viscoelastic(_) => None,
        }
    }

    /// By how much a moment that is transmitted differs from the law's own, over the moments at which it yields or its strands slip, or over the law's
    /// where that is more. Nothing of a law that is linear: there a step that has converged is as exact as with elastic joints.
    pub fn missed(&self, own: &Vector3<f64>, transmitted: &Vector3<f64>) -> f64 {
        let scale = match self {
            Self::Plastic(law) => law.moments,
            Self::Friction(law) => Vector3::repeat(law.moment),
            Self::Tabulated(law) => Vector3::repeat(law.first_moment()),
            Self::Viscoelastic(_) => return 0.0,
        };
        (own - transmitted).component_div(&scale).norm() / own.component_div(&scale).norm().max(1.0)
    }

    /// The law of a joint between segments of two laws: the lower yield moments of both, else the first.
    pub(crate) fn between(first: &Arc<Self>, second: &Arc<Self>) -> Arc<Self> {
        match (first.as_ref(), second.as_ref()) {
            (Self::Plastic(a), Self::Plastic(b)) if a != b => {
                let moments = a.moments.inf(&b.moments);
                Arc::new(Self::Plastic(Plasticity { moments, ..*a }))
            }
            _ => first.clone(),
        }
    }

    fn mistake(&self) -> Option<(&'static str, f64, &'static str)> {
        match self {
            Self::Plastic(own) => own.mistake(),
            Self::Friction(own) => own.mistake(),
            Self::Viscoelastic(branches) => maxwell::mistake(branches),
            Self::Tabulated(own) => own.mistake(),
        }
    }
}

#[cfg(test)]
mod tests;

//! Joints whose moments are no function of their curvature alone: plasticity, friction between strands, viscoelasticity.
//!
//! A law takes the strain of a joint, C_b in its rows ([`crate::measure::bend_strain`]), to its moments about d1 and d2 and its torque
//! about d3, from internal variables at the start of a step. That is an implicit return mapping with its algorithmic tangent (Simo and Hughes,
//! Computational Inelasticity, 1998, chapters 1 to 3 and 10): a step knows strain, moment and dM/dC_b at its end alone. Stretch and shear
//! stay elastic. For rods with such laws in the resultants see Smriti, Kumar, Grossmann and Steinmann, "A thermoelastoplastic theory for
//! special Cosserat rods" (2019), and Smriti, Kumar and Steinmann, "A finite element formulation for a direct approach to elastoplasticity in
//! special Cosserat rods" (2021).

mod maxwell;
mod plasticity;
mod strand_friction;

use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};

use crate::{Freedom, Joint, Model, ModelError, State};

pub use maxwell::MaxwellBranch;
pub use plasticity::Plasticity;
pub use strand_friction::StrandFriction;

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
}

/// A joint of a model that has a law.
#[derive(Clone, Debug, PartialEq)]
pub struct InelasticJoint {
    /// Index of the joint.
    pub joint: usize,
    /// Its law; joints of a rod share one.
    pub law: Arc<JointLaw>,
}

/// What a law remembers from step to step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InternalVariables {
    /// Strain at the end of the last step [1/m].
    pub strain: Vector3<f64>,
    /// Plastic curvatures and twist [1/m]; or the moment of friction [N m]; or the moments of the branches [N m]. Empty before the first step.
    pub parts: Vec<Vector3<f64>>,
    /// By how much of the first yield moments the yield surface has grown.
    pub hardening: f64,
    /// Work that has been lost so far, per length [J/m].
    pub dissipated: f64,
}

/// What a joint answers a strain with at the end of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// Moments about d1 and d2 and torque about d3 [N m].
    pub moment: Vector3<f64>,
    /// Algorithmic tangent, symmetric and positive definite [N m^2].
    pub tangent: Matrix3<f64>,
}

impl InternalVariables {
    /// Makes them those of a joint at rest; what was lost stays lost.
    pub fn forget(&mut self) {
        (self.strain, self.hardening) = (Vector3::zeros(), 0.0);
        self.parts.fill(Vector3::zeros());
    }
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
        }
    }

    /// What a joint of these elastic stiffnesses [N m^2] answers a `strain` [1/m] with, at the end of a step of `dt` [s] that began with `at`.
    pub fn answer(&self, stiffness: &Vector3<f64>, strain: &Vector3<f64>, at: &InternalVariables, dt: f64) -> Answer {
        match self {
            Self::Plastic(own) => own.answer(stiffness, strain, at),
            Self::Friction(own) => own.answer(stiffness, strain, at),
            Self::Viscoelastic(branches) => maxwell::answer(branches, stiffness, strain, at, dt),
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
            Self::Friction(_) | Self::Viscoelastic(_) => *strain,
        }
    }

    /// Ends a step of `dt` [s] at a `strain` [1/m].
    pub fn advance(&self, stiffness: &Vector3<f64>, strain: &Vector3<f64>, at: &mut InternalVariables, dt: f64) {
        match self {
            Self::Plastic(own) => own.advance(stiffness, strain, at),
            Self::Friction(own) => own.advance(strain, at),
            Self::Viscoelastic(branches) => maxwell::advance(branches, stiffness, strain, at, dt),
        }
        at.strain = *strain;
    }

    /// Energy per length that can be had back [J/m] at a strain [1/m] to which the joint goes without a loss from where its last step ended.
    pub fn stored(&self, stiffness: &Vector3<f64>, strain: &Vector3<f64>, at: &InternalVariables) -> f64 {
        match self {
            Self::Plastic(own) => own.stored(stiffness, strain, at),
            Self::Friction(own) => own.stored(stiffness, strain, at),
            Self::Viscoelastic(branches) => maxwell::stored(branches, stiffness, strain, at),
        }
    }

    /// Plastic curvatures and twist [1/m]: the strain that stays when nothing bends the joint any more; zero of other laws.
    pub fn set(&self, at: &InternalVariables) -> Vector3<f64> {
        match self {
            Self::Plastic(_) => at.parts.first().copied().unwrap_or_default(),
            Self::Friction(_) | Self::Viscoelastic(_) => Vector3::zeros(),
        }
    }

    /// By how much a moment that is transmitted differs from the law's own, over the moments at which it yields or its strands slip, or over the law's
    /// where that is more. Nothing of a law that is linear: there a step that has converged is as exact as with elastic joints.
    pub fn missed(&self, own: &Vector3<f64>, transmitted: &Vector3<f64>) -> f64 {
        let scale = match self {
            Self::Plastic(law) => law.moments,
            Self::Friction(law) => Vector3::repeat(law.moment),
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
        }
    }
}

impl Joint {
    /// Stiffnesses of bending about d1 and d2 and of twist [N m^2]: 1 / (l compliance).
    pub fn bend_twist_stiffness(&self) -> Vector3<f64> {
        self.bend_twist_compliance().map(|compliance| 1.0 / (self.length * compliance))
    }
}

impl Model {
    /// Checks the joints with laws.
    pub(crate) fn validate_laws(&self) -> Result<(), ModelError> {
        let what = "joint with a law";
        for (index, own) in self.laws.iter().enumerate() {
            let Some(joint) = self.joints.get(own.joint) else {
                let count = self.joints.len();
                return Err(ModelError::Index { what, index, target: "joint", to: own.joint, count });
            };
            let value = |quantity, value, allowed| Err(ModelError::Value { what, index, quantity, value, allowed });
            if let Some(&least) = joint.bend_twist_compliance().iter().find(|&&compliance| compliance <= 0.0) {
                return value("compliance of bending or twist", least, "> 0");
            }
            if joint.freedom != Freedom::None {
                return value("joint that turns freely", own.joint as f64, "a joint that leaves nothing free");
            }
            if index > 0 && self.laws[index - 1].joint >= own.joint {
                return value("joint", own.joint as f64, "more than that of the law before");
            }
            if let Some((quantity, found, allowed)) = own.law.mistake() {
                return value(quantity, found, allowed);
            }
        }
        Ok(())
    }
}

impl Model {
    /// Checks what a state says that joints with laws remember: nothing, or for each as many numbers as its law has, all finite.
    pub(crate) fn validate_internals(&self, state: &State) -> Result<(), ModelError> {
        let what = "joint with a law";
        let (found, count) = (state.internals.len(), self.laws.len());
        if found > count {
            return Err(ModelError::Index { what: "internal variables", index: count, target: what, to: count, count });
        }
        for (index, (own, at)) in self.laws.iter().zip(&state.internals).enumerate() {
            let (parts, expected) = (at.parts.len(), own.law.parts());
            if parts != 0 && parts != expected {
                let quantity = "parts of its internal variables";
                let allowed = format!("none, or as many as its law has ({expected})");
                return Err(ModelError::Count { what, index, quantity, found: parts, allowed });
            }
            let numbers = at.parts.iter().flatten().chain(&at.strain).chain([&at.hardening, &at.dissipated]);
            if let Some(&value) = numbers.into_iter().find(|x| !x.is_finite()) {
                return Err(ModelError::Value { what, index, quantity: "internal variable", value, allowed: "finite" });
            }
        }
        Ok(())
    }
}

impl State {
    /// Internal variables of law `k` of a model; `None` before the first step.
    pub fn internal(&self, k: usize) -> Option<&InternalVariables> {
        self.internals.get(k).filter(|own| !own.parts.is_empty())
    }
}

#[cfg(test)]
mod tests;

//! Joints with laws in a model and a state: stiffnesses, checks.

use nalgebra::Vector3;

use crate::{Freedom, InternalVariables, Joint, Model, ModelError, State};

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
            if !matches!(joint.freedom, Freedom::None | Freedom::Broken) {
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

//! Which equations an outer iteration linearises.

use std::borrow::Cow;

use names::names;
use rod::{Model, StrainMeasure};

/// The formulation of the projection.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Formulation {
    /// The paper's extended position-based dynamics: `dp = M^-1 J^T dlambda`, the momentum residual is dropped.
    Xpbd,
    /// The integrator's equations in full, with momentum residual and geometric stiffness.
    #[default]
    Newton,
}

names!(Formulation { Xpbd = "xpbd", Newton = "newton" });

impl Formulation {
    /// Whether the momentum residual is part of the equations, and the geometric stiffness of the matrix, so that any start of a step is corrected.
    #[inline(always)]
    pub fn momentum(self) -> bool {
        self == Formulation::Newton
    }

    /// A model whose joints measure what they are bent by as this formulation has it: `xpbd` as the paper, `newton` as the model says.
    pub fn measured(self, model: &Model) -> Cow<'_, Model> {
        match (self, model.strain_measure) {
            (Self::Xpbd, StrainMeasure::Angle) => {
                let mut own = model.clone();
                own.measure_as_in_paper();
                Cow::Owned(own)
            }
            _ => Cow::Borrowed(model),
        }
    }
}

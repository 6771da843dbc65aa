//! What is identified, as a prediction sees it: what cables, cables with branches and noodles share.

use std::ops::{Index, IndexMut};

use cosserat::simulation::SimulationError;
use cosserat::state::{Model, State};
use cosserat::statics::StaticError;
use nalgebra::Vector3;
use thiserror::Error;

use crate::quantity::Quantity;
use crate::recording::Recording;

/// Why a specimen cannot be predicted.
#[derive(Debug, Error)]
pub enum SpecimenError {
    /// It cannot be simulated.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// It has no equilibrium to begin with.
    #[error(transparent)]
    Static(#[from] StaticError),
}

/// A value for each quantity of what is identified.
pub trait Numbers:
    Clone + Send + Sync + Index<Self::Quantity, Output = f64> + IndexMut<Self::Quantity, Output = f64>
{
    /// What there are values of.
    type Quantity: Quantity;

    /// All quantities, in the order in which they are told.
    fn quantities(&self) -> Vec<Self::Quantity>;

    /// Where a search from these values may begin, of which the best is taken: stiff and slack cables move differently, and no
    /// derivative leads from one to the other.
    fn beginnings(&self) -> Vec<Self>;

    /// Quantities that are searched for together, with the name that all of them have.
    fn groups(&self) -> Vec<(&'static str, Vec<Self::Quantity>)> {
        Vec::new()
    }

    /// Checks that what belongs together is there together.
    ///
    /// # Errors
    /// If it is not.
    fn check(&self) -> Result<(), String> {
        Ok(())
    }

    /// Sets a quantity by its name, and returns it.
    ///
    /// # Errors
    /// If there is none of this name, or the value is not within its bounds. What may be left out may be 0.
    fn set(&mut self, name: &str, value: f64) -> Result<Self::Quantity, String> {
        let quantity = self.named(name)?;
        let [least, most] = quantity.bounds();
        if !((least..=most).contains(&value) || value == 0.0 && quantity.may_be_left_out()) {
            return Err(format!("{name} = {value}, but it must be {least} to {most} {}", quantity.unit()));
        }
        self[quantity] = value;
        Ok(quantity)
    }

    /// The quantity of this name.
    ///
    /// # Errors
    /// If there is none; it tells all that there are.
    fn named(&self, name: &str) -> Result<Self::Quantity, String> {
        let all = self.quantities();
        all.iter().copied().find(|quantity| quantity.to_string() == name).ok_or_else(|| {
            let groups = self.groups();
            let is_alone = |quantity: &&Self::Quantity| groups.iter().all(|(_, own)| !own.contains(quantity));
            let mut names: Vec<String> = all.iter().filter(is_alone).map(ToString::to_string).collect();
            names.extend(groups.iter().map(|(name, _)| (*name).to_owned()));
            format!("{name:?}: it must be one of {}", names.join(", "))
        })
    }
}

/// What a prediction may know of a recording, and the model that it makes of it.
pub trait Specimen: Clone + Send + Sync {
    /// What is identified of it.
    type Numbers: Numbers;

    /// Times of the frames [s].
    fn time(&self) -> &[f64];

    /// The markers of the recording that are predicted, in the order in which predictions have them.
    fn free(&self) -> Vec<usize>;

    /// The model with these numbers, and its state in the first frame.
    ///
    /// # Errors
    /// If there is no state to begin with.
    fn model(&self, numbers: &Self::Numbers) -> Result<(Model, State), SpecimenError>;

    /// The numbers with those changed that are not searched for but follow from runs of recordings with these, if there are such. `dispersion`: that
    /// of the loss [m^2], for what is expected of them ([`Quantity::prior`]).
    ///
    /// # Errors
    /// If a model is not valid.
    fn averaged(
        _specimens: &[Self],
        _recordings: &[&Recording],
        _numbers: &Self::Numbers,
        _steps: usize,
        _dispersion: f64,
    ) -> Result<Option<Self::Numbers>, SpecimenError> {
        Ok(None)
    }

    /// The free markers in a state [m].
    fn markers(&self, numbers: &Self::Numbers, model: &Model, state: &State) -> Vec<Vector3<f64>>;
}

//! Cables with branches as what is identified.

use cosserat::state::{Model, State};
use nalgebra::Vector3;

use super::beside::averaged;
use super::model::off;
use super::{BranchedCable, Numbers};
use crate::recording::Recording;
use crate::specimen::{Specimen, SpecimenError};

impl Specimen for BranchedCable {
    type Numbers = Numbers;

    fn time(&self) -> &[f64] {
        &self.shape.parent.time
    }

    fn free(&self) -> Vec<usize> {
        self.free.clone()
    }

    fn model(&self, numbers: &Numbers) -> Result<(Model, State), SpecimenError> {
        let (mut model, state) = self.shape(numbers).assembled(numbers);
        // As its scene does.
        model.measure_bent_from_rest(&[]);
        Ok((model, state))
    }

    fn markers(&self, numbers: &Numbers, model: &Model, state: &State) -> Vec<Vector3<f64>> {
        let places = self.places.iter().zip(&self.beside);
        places.map(|(place, beside)| place.at(model, state) + off(*beside, numbers, state)).collect()
    }

    fn averaged(
        specimens: &[Self],
        recordings: &[&Recording],
        numbers: &Numbers,
        steps: usize,
        dispersion: f64,
    ) -> Result<Option<Numbers>, SpecimenError> {
        averaged(specimens, recordings, numbers, steps, dispersion).map(Some)
    }
}

//! Where markers lie beside the rods.

use cosserat::state::{Model, State};
use nalgebra::Vector3;
use rayon::prelude::*;

use super::{BranchedCable, Number, Numbers};
use crate::predict::{groups, simulated};
use crate::quantity::Quantity;
use crate::recording::{Recording, median};
use crate::specimen::{Specimen, SpecimenError};

/// The numbers with markers where recordings have them in the mean over their frames, in the frames of the segments as they are
/// predicted, and in the middle one of all recordings.
///
/// A marker sits on the cable's surface, and a cable that is bent sharply between two markers has a smooth rod's shape but for one of them.
/// Both look alike. That minimises squares over what is linear for given runs, as one step of a search in turns.
pub(super) fn averaged(
    specimens: &[BranchedCable],
    recordings: &[&Recording],
    numbers: &Numbers,
    steps: usize,
    dispersion: f64,
) -> Result<Numbers, SpecimenError> {
    let pairs: Vec<(&BranchedCable, &Recording)> = specimens.iter().zip(recordings.iter().copied()).collect();
    let groups = groups(&pairs, |(specimen, _)| specimen.time());
    let means: Result<Vec<Vec<Vec<Vector3<f64>>>>, _> =
        groups.into_par_iter().map(|group| of_group(group, numbers, steps)).collect();
    let means: Vec<Vec<Vector3<f64>>> = means?.into_iter().flatten().collect();
    let mut numbers = numbers.clone();
    let frames: usize = recordings.iter().map(|recording| recording.frames()).sum();
    for (k, marker) in specimens.first().map_or(0..0, |specimen| specimen.tree().between()).enumerate() {
        for axis in 0..3 {
            let number = Number::Beside { axis, marker };
            let middle = median(means.iter().map(|own| own[k][axis]).collect());
            // What is expected, beside a square of each frame.
            let expected = number.prior().map_or(0.0, |spread| dispersion / (spread * spread));
            let nearer = middle * frames as f64 / (frames as f64 + expected);
            numbers[number] = if nearer.is_finite() { number.value(number.coordinate(nearer)) } else { 0.0 };
        }
    }
    Ok(numbers)
}

/// Means over frames of where the markers of a few recordings lie, which move side by side.
fn of_group(
    group: &[(&BranchedCable, &Recording)],
    numbers: &Numbers,
    steps: usize,
) -> Result<Vec<Vec<Vector3<f64>>>, SpecimenError> {
    let models: Vec<(Model, State)> =
        group.iter().map(|(specimen, _)| specimen.model(numbers)).collect::<Result<_, _>>()?;
    let times: Vec<&[f64]> = group.iter().map(|(specimen, _)| specimen.time()).collect();
    let mut sums: Vec<Vec<(Vector3<f64>, f64)>> =
        group.iter().map(|(specimen, _)| vec![(Vector3::zeros(), 0.0); specimen.tree().between().len()]).collect();
    let mut frames = vec![0; group.len()];
    let mut watch = |copy: usize, model: &Model, state: &State| {
        let (specimen, recording) = group[copy];
        let off = specimen.off(&recording.markers[frames[copy]], model, state);
        for (sum, off) in sums[copy].iter_mut().zip(off).filter(|(_, off)| off.iter().all(|x| x.is_finite())) {
            *sum = (sum.0 + off, sum.1 + 1.0);
        }
        frames[copy] += 1;
    };
    simulated(&models, &times, steps, &mut watch)?;
    Ok(sums.into_iter().map(|own| own.into_iter().map(|(sum, count)| sum / count).collect()).collect())
}

//! A recorded noodle as a scene that `simulate` runs.

use std::path::{Path, PathBuf};

use export::ExportError;
use nalgebra::Vector3;

use super::{Noodle, Number, Numbers};
use crate::cable::DENSITY;
use crate::scene::{Clock, MadeOf, head, list, rest, rod, written};
use crate::specimen::Specimen;

/// Writes `folder/noodle.toml` and the table of its clamp, and returns the scene's path. Run with `--formulation newton
/// --integrator bdf2` it moves as the prediction with so many `steps` a frame does, if the frames come at even times.
///
/// # Errors
/// If the system refuses.
pub fn write(
    folder: &Path,
    noodle: &Noodle,
    name: &str,
    numbers: &Numbers,
    steps: usize,
) -> Result<PathBuf, ExportError> {
    const CLAMP: &str = "clamp.csv";
    let clock = Clock::new(noodle.time(), steps);
    let clamp = noodle.grip(numbers);
    let pose = clamp.at(0.0).pose;
    let (model, _) = noodle.straight(numbers);
    let material = Noodle::material(numbers);
    let made_of = MadeOf {
        moduli: [material.youngs_modulus, material.torsion_modulus],
        factors: [1.0; 2],
        density: DENSITY,
        tau: numbers[Number::InnerDamping],
    };
    let d1 = list(&(pose.orientation * Vector3::x()));
    let keys = format!("frame = {{ d1 = {d1} }}\n{}", rest(&model, 0..noodle.segments - 1));
    let what = format!("The noodle of the recording {name}, driven by its clamp");
    let text = format!(
        "{}{}
[rods.shape.straight]
start_m = {}
direction = {}
length_m = {:?}
segments = {}

[[rods.motions]]
at = \"start-face\"
file = \"{CLAMP}\"
",
        head(&what, &model, clock, "begin = \"equilibrium\"\n"),
        rod("noodle", &made_of, &keys),
        list(&pose.position),
        list(&(pose.orientation * Vector3::z())),
        numbers[Number::Length],
        noodle.segments,
    );
    written(&folder.join("noodle.toml"), &text, &[(CLAMP, clamp)], clock)
}

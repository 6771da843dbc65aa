//! Recordings of a simulated cable whose numbers are known, with noise, for `identify` to find them again.
//!
//! `cargo run -p identify --example simulated_cable -- out/known/recordings` writes them, and
//! `cargo run -p identify -- out/known/recordings --out out/known` finds the numbers, with intervals that should hold them. With
//! `planar` after the folder all happens in a plane, as one camera sees it.

use std::error::Error;
use std::path::PathBuf;

use identify::cable::Resolution;
use identify::parameter::{Parameter, Parameters};
use identify::quantity::Quantity;
use identify::simulated::{Plan, recordings, write};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "out/known/recordings".to_owned()));
    let is_planar = std::env::args().nth(2).is_some_and(|kind| kind == "planar");
    let mut truth = Parameters::default();
    for (parameter, value) in [
        (Parameter::Bending, 0.035),
        (Parameter::Twist, 0.8),
        (Parameter::InnerDamping, 0.05),
        (Parameter::OuterDamping, 0.6),
        (if is_planar { Parameter::Curvature2 } else { Parameter::Curvature1 }, 0.8),
    ] {
        truth[parameter] = value;
    }
    let resolution = Resolution::PREDICTION;
    let plan = Plan { recordings: 24, frames: 100, noise: 1e-3, seed: 1, is_planar, resolution };
    write(&folder, &recordings(&truth, &plan)?)?;
    println!("{} recordings, off by 1 mm, are in {}. The cable's numbers:", plan.recordings, folder.display());
    for parameter in Parameter::DEFAULT {
        println!("{:<14} {:>7} {}", parameter.to_string(), truth[parameter], parameter.unit());
    }
    Ok(())
}

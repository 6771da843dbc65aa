//! Recordings of a simulated cable whose numbers are known, with noise, for `identify` to find them again.
//!
//! `cargo run -p identify --example simulated_cable -- out/known/recordings` writes them, and
//! `cargo run -p identify -- out/known/recordings --out out/known` finds the numbers, with intervals that should hold them. With
//! `planar` after the folder all happens in a plane; with `pixels` it is what a camera sees of that, for `identify video`.

use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

use identify::cable::Resolution;
use identify::parameter::{Parameter, Parameters};
use identify::quantity::Quantity;
use identify::recording::Recording;
use identify::simulated::{Plan, recordings, write};
use nalgebra::{Rotation3, Vector2, Vector3};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "out/known/recordings".to_owned()));
    let kind = std::env::args().nth(2).unwrap_or_default();
    let (has_pixels, is_planar) = (kind == "pixels", kind == "planar" || kind == "pixels");
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
    let (frames, markers, pace, noise) = if has_pixels { (240, 31, 3.0, 0.0) } else { (100, 9, 1.0, 1e-3) };
    let plan = Plan { recordings: 24, frames, markers, pace, noise, seed: 1, is_planar, resolution };
    let recordings = recordings(&truth, &plan)?;
    if has_pixels {
        shoot(&folder, &recordings)?;
    } else {
        write(&folder, &recordings)?;
        println!("{} recordings, off by 1 mm, are in {}. The cable's numbers:", plan.recordings, folder.display());
    }
    for parameter in Parameter::DEFAULT {
        println!("{:<14} {:>7} {}", parameter.to_string(), truth[parameter], parameter.unit());
    }
    Ok(())
}

/// Writes what a camera that looks at the plane at a slant sees of the markers, to a tenth of a pixel, once the cable has come to move as its
/// grips do; tells what `identify video` must know.
fn shoot(folder: &PathBuf, recordings: &[Recording]) -> Result<(), Box<dyn Error>> {
    fs::create_dir_all(folder)?;
    let (at, focal) = (Vector3::new(0.4, -1.3, 0.2), 1500.0);
    let forward = (Vector3::z() * -0.1 - at).normalize();
    let right = forward.cross(&Vector3::z()).normalize();
    let turn = Rotation3::from_basis_unchecked(&[right, forward.cross(&right), forward]);
    let (mut length, mut grip) = (0.0, 0.0);
    for recording in recordings {
        let mut text = "frame,s,u,v\n".to_owned();
        for (frame, markers) in recording.markers.iter().enumerate().skip(40) {
            let mut way = vec![0.0];
            markers.windows(2).for_each(|pair| way.push(way[way.len() - 1] + (pair[1] - pair[0]).norm()));
            (length, grip) = (way[way.len() - 1], way[1]);
            for (marker, way) in markers.iter().zip(&way) {
                let seen = turn.inverse() * (marker - at);
                let pixel = Vector2::new(960.0, 540.0) + seen.xy() * (focal / seen.z);
                writeln!(text, "{frame},{:.4},{:.1},{:.1}", way / length, pixel.x, pixel.y)?;
            }
        }
        fs::write(folder.join(format!("{}.csv", recording.name())), text)?;
    }
    println!("{} clips are in {}, to be read with", recordings.len(), folder.display());
    println!("identify video {} --length-m {length:.3} --grip-m {grip:.3} --image-px 1920x1080", folder.display());
    println!("The cable's numbers:");
    Ok(())
}

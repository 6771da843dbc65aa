//! Markers along a cable from its centreline in the pictures of one or two cameras: motion capture from a phone.
//!
//! A [`Centreline`] has points of known distance along the cable [px] in each frame. It is smoothed along the cable and over time. One camera
//! sees a motion in a vertical plane: the plane and the focal length are those in which the cable keeps its length. Two cameras see any motion:
//! their focal lengths, and how they stand to each other, are those in which rays through the same place meet and the cable keeps its length
//! (bundle adjustment, Triggs et al. 2000, with inextensibility as the scale). Cameras are pinholes whose axis goes through the middle of the
//! picture.
//!
//! This knows nothing of rods: what it makes is a [`Recording`] like any other.

mod camera;
mod centreline;

use nalgebra::{Vector2, Vector3};
use thiserror::Error;

use crate::recording::{GRIPPED, Recording, RecordingError};
pub use camera::Video;
use camera::{Cameras, Views};
pub use centreline::{Centreline, read};

/// Points along the cable at which its length is measured.
const POINTS: usize = 41;
/// Frames of all clips by which cameras are found.
const FRAMES: usize = 60;

/// Recordings, and how well the cameras explain what was seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Reconstruction {
    /// A recording a clip.
    pub recordings: Vec<Recording>,
    /// Focal length of each camera [px].
    pub focal: Vec<f64>,
    /// Angle between the axes of two cameras, or between that of one and the normal of the plane of motion [rad].
    pub angle: f64,
    /// How far rays of the same place miss each other in the pictures, root mean square [px]; 0 of one camera.
    pub missed: f64,
    /// By how much lengths of parts of the cable change, root mean square [1].
    pub stretch: f64,
}

/// What keeps markers from being found.
#[derive(Debug, Error)]
pub enum VideoError {
    /// A clip is of no use.
    #[error(transparent)]
    Clip(#[from] RecordingError),
    /// No cameras explain what was seen.
    #[error("{0}")]
    Cameras(String),
}

/// Markers of clips: of each what the first camera saw and, if there is one, what the second one saw of it.
///
/// # Errors
/// If a clip has too few points, or no cameras explain what was seen: the cable changes its length by more than a tenth.
pub fn markers(clips: &[(Centreline, Option<Centreline>)], video: &Video) -> Result<Reconstruction, VideoError> {
    let count = video.markers.max(2 * GRIPPED + 1);
    let grip = video.grip / video.length;
    if !(1e-3..0.3).contains(&grip) {
        let message = format!(
            "grips of {} m on a cable of {} m, but each must hold 0.1 % to 30 % of it",
            video.grip, video.length
        );
        return Err(VideoError::Cameras(message));
    }
    let inner = (1.0 - 2.0 * grip) / (count - 1 - GRIPPED) as f64;
    let mut places = vec![0.0];
    places.extend((0..count - GRIPPED).map(|k| grip + inner * k as f64));
    places.push(1.0);
    let along: Vec<f64> = (0..POINTS).map(|k| k as f64 / (POINTS - 1) as f64).collect();
    let smooth = |clip: &Centreline| clip.smoothed(video.window);
    let mut all = Vec::new();
    for (first, second) in clips {
        let second = second.as_ref().map(|own| first.alike(own).map(|()| own)).transpose()?;
        all.push((smooth(first)?, second.map(smooth).transpose()?));
    }
    let frames: usize = clips.iter().map(|(own, _)| own.time.len()).sum();
    let stride = frames.div_ceil(FRAMES).max(1);
    let mut seen: Vec<Views> = Vec::new();
    for (first, second) in &all {
        for frame in first.kept().step_by(stride) {
            let at =
                |own: &centreline::Smooth| -> Vec<Vector2<f64>> { along.iter().map(|&s| own.at(frame, s)).collect() };
            seen.push((at(first), second.as_ref().map(at)));
        }
    }
    let cameras = Cameras::find(&seen, video).map_err(VideoError::Cameras)?;
    let recordings = all.iter().zip(clips).map(|((first, second), (clip, _))| {
        let place =
            |frame: usize, s: f64| cameras.place(first.at(frame, s), second.as_ref().map(|own| own.at(frame, s)));
        let markers: Vec<Vec<Vector3<f64>>> =
            first.kept().map(|frame| places.iter().map(|&s| place(frame, s)).collect()).collect();
        let start = clip.time[first.kept().start];
        let time = clip.time[first.kept()].iter().map(|time| time - start).collect();
        Recording { path: clip.path.clone(), time, markers }
    });
    Ok(Reconstruction {
        recordings: recordings.collect(),
        focal: cameras.focal(),
        angle: cameras.angle(),
        missed: cameras.missed,
        stretch: cameras.stretch,
    })
}

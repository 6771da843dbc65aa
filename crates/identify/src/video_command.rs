//! `identify video`: recordings from a cable's centreline in the pictures of one or two cameras.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use identify::recording::files;
use identify::simulated::write;
use identify::video::{self, Centreline, markers, read};
use report::significant;
use terminal::{positive, say, warn};

/// Makes recordings of markers from centrelines in pictures: of one camera that sees a motion in a vertical plane, or of two cameras.
/// Nothing must be known of the cameras; they stand still, on the same places for all clips.
#[derive(Args)]
pub(crate) struct Video {
    /// Clips of one cable: CSV files, or folders of them, with the columns frame, s (0 to 1 along the cable, from end to end), u and v (pixels to
    /// the right and down).
    #[arg(required = true)]
    clips: Vec<PathBuf>,
    /// The same clips in the same order, as a second camera saw them at the same time: the same numbers of frames.
    #[arg(long, num_args = 1.., value_name = "CLIPS")]
    second: Vec<PathBuf>,
    /// Length of the cable, the parts in the grips included [m].
    #[arg(long, value_name = "L", value_parser = positive)]
    length_m: f64,
    /// Length at each end that a grip holds straight [m].
    #[arg(long, value_name = "G", default_value = "0.02", value_parser = positive)]
    grip_m: f64,
    /// Width and height of the pictures [px], as 1920x1080. The camera looks at the middle.
    #[arg(long, value_name = "WxH", value_parser = size)]
    image_px: [f64; 2],
    /// Focal length of the cameras [px]; else it is found.
    #[arg(long, value_name = "F", value_parser = positive)]
    focal_px: Option<f64>,
    /// By how much the first of two cameras looks down [deg]; one camera tells it by itself.
    #[arg(long, value_name = "P", default_value = "0", allow_hyphen_values = true)]
    pitch_deg: f64,
    /// Pictures a second.
    #[arg(long, default_value = "100", value_parser = positive)]
    rate: f64,
    /// Time over which positions are smoothed by parabolas [s].
    #[arg(long, default_value = "0.1", value_parser = positive)]
    window_s: f64,
    /// Markers to make of each clip, two in each grip included.
    #[arg(long, default_value = "13", value_parser = clap::value_parser!(u16).range(5..=100))]
    markers: u16,
    /// The folder to write the recordings to.
    #[arg(long, default_value = "out/video")]
    out: PathBuf,
}

/// A size such as 1920x1080.
fn size(text: &str) -> Result<[f64; 2], String> {
    let parts: Vec<Option<u32>> = text.split('x').map(|part| part.parse().ok()).collect();
    match parts[..] {
        [Some(width @ 1..), Some(height @ 1..)] => Ok([f64::from(width), f64::from(height)]),
        _ => Err("expected width and height, as 1920x1080".into()),
    }
}

impl Video {
    /// Refuses to write over clips, and two recordings to one file.
    fn check_names(&self, clips: &[Centreline]) -> Result<()> {
        let mut seen = HashSet::new();
        for Centreline { path, .. } in clips {
            if !seen.insert(path.file_stem()) {
                bail!("{}: another clip has this name, and recordings are named as their clips are", path.display());
            }
            let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
            if let (Ok(folder), Ok(out)) = (folder.canonicalize(), self.out.canonicalize())
                && folder == out
            {
                bail!("--out {}: clips are there, which the recordings would overwrite", self.out.display());
            }
        }
        Ok(())
    }

    /// Writes recordings and prints how well cameras explain them.
    ///
    /// # Errors
    /// If a clip is of no use, or no cameras explain them.
    pub(crate) fn run(&self) -> Result<()> {
        let read_all = |places: &[PathBuf]| -> Result<Vec<Centreline>> {
            let paths = files(places)?;
            Ok(paths.iter().map(|path| read(path, self.rate)).collect::<Result<Vec<_>, _>>()?)
        };
        let (first, second) = (read_all(&self.clips)?, read_all(&self.second)?);
        if !second.is_empty() && second.len() != first.len() {
            bail!("--second: {} clips, but the first camera has {}", second.len(), first.len());
        }
        if !(-90.0..=90.0).contains(&self.pitch_deg) {
            bail!("--pitch-deg {}: must be from -90 to 90", self.pitch_deg);
        }
        self.check_names(&first)?;
        let mut second = second.into_iter();
        let clips: Vec<_> = first.into_iter().map(|own| (own, second.next())).collect();
        let known = video::Video {
            length: self.length_m,
            grip: self.grip_m,
            image: self.image_px,
            focal: self.focal_px,
            pitch: self.pitch_deg.to_radians(),
            window: self.window_s,
            markers: usize::from(self.markers),
        };
        let found = markers(&clips, &known)?;
        let focal: Vec<String> = found.focal.iter().map(|focal| significant(*focal, 3)).collect();
        let (angle, stretch) = (significant(found.angle.to_degrees(), 3), significant(100.0 * found.stretch, 2));
        if self.second.is_empty() {
            say!("focal length {} px; the camera looks at the plane of motion {angle} deg from its normal", focal[0])?;
        } else {
            let missed = significant(found.missed, 2);
            say!(
                "focal lengths {} px; {angle} deg between the cameras; rays miss each other by {missed} px",
                focal.join(" and ")
            )?;
        }
        say!("parts of the cable change their length by {stretch} %")?;
        if found.stretch > 0.03 {
            warn(format_args!("lengths change by more than 3 %: the recordings may be wrong by as much"));
        }
        if found.missed > 5.0 {
            warn(format_args!(
                "rays miss each other by more than 5 px: do both cameras have the same frame at the same time?"
            ));
        }
        let named = |path: &Path| path.display().to_string();
        write(&self.out, &found.recordings).with_context(|| format!("--out: cannot write to {}", named(&self.out)))?;
        say!("{} recordings written to {}", found.recordings.len(), named(&self.out))
    }
}

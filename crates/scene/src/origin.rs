//! Where a run begins, if not as its scene says.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use toml::Spanned;

use crate::error::{Result, Source};

/// A frame of another run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Origin {
    /// The run's folder.
    pub folder: PathBuf,
    /// Number of the frame, from 0; the last one if there is none.
    pub frame: Option<usize>,
}

impl FromStr for Origin {
    type Err = String;

    /// `FOLDER` or `FOLDER@FRAME`.
    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let (folder, frame) = match text.rsplit_once('@') {
            Some((folder, frame)) if !frame.contains(['/', '\\']) => {
                let number =
                    frame.parse().map_err(|_| format!("the frame {frame} must be a whole number from 0 on"))?;
                (folder, Some(number))
            }
            _ => (text, None),
        };
        Ok(Self { folder: PathBuf::from(folder), frame })
    }
}

/// The frame that a scene names; its folder is seen from the scene's own.
pub(crate) fn origin(source: &Source, text: &Spanned<String>) -> Result<Origin> {
    let Ok(Origin { folder, frame }) = text.get_ref().parse() else {
        return source.must_be(text.span(), "FOLDER or FOLDER@FRAME, the frame a whole number from 0 on");
    };
    if folder.as_os_str().is_empty() {
        return source.must_be(text.span(), "the folder of a run, or FOLDER@FRAME");
    }
    let own = Path::new(source.file).parent().unwrap_or_else(|| Path::new(""));
    let folder = own.join(folder);
    source.notes.folder(text.span(), &folder, frame);
    Ok(Origin { folder, frame })
}

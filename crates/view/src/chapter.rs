//! Chapters of a run: frames that belong together and have a label.

use serde::{Deserialize, Serialize};

use crate::DecodeError;

/// Frames from one on, up to the next chapter's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Chapter {
    /// Its first frame.
    pub(crate) frame: usize,
    /// What the page says instead of time and frame.
    pub(crate) label: String,
}

/// Checks that chapters cut so many `frames` in parts.
pub(crate) fn validate(chapters: &[Chapter], frames: usize) -> Result<(), DecodeError> {
    let ascend = chapters.windows(2).all(|pair| pair[0].frame < pair[1].frame);
    let begins = chapters.first().is_none_or(|first| first.frame == 0);
    if ascend && begins && chapters.last().is_none_or(|last| last.frame < frames) {
        return Ok(());
    }
    Err(DecodeError::new("chapters", format!("they must begin at frames that ascend from 0 and are below {frames}")))
}

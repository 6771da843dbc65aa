//! A scene from its text.

use std::num::NonZeroUsize;

use crate::checked::Scene;
use crate::error::SceneError;
use crate::refine::Refinement;
use crate::{assemble, error, format, text};

/// Reads a scene from the `text` of a file; `file_name` gives the scene its name and stands in errors.
///
/// # Errors
/// The first mistake found, with its line, key and value, and what is allowed.
pub fn parse(text: &str, file_name: &str) -> Result<Scene, SceneError> {
    parse_refined(text, file_name, NonZeroUsize::MIN)
}

/// The scene of [`parse`] with every segment cut into `factor` equal parts: segment i becomes the segments
/// `factor * i .. factor * (i + 1)`.
///
/// Everything keeps its place in the material: a fixed segment stays fixed over its whole length, branches, joints and loads
/// stay where they are, and the parts of a segment share its mass and begin to move as one rigid body. New nodes of curved
/// shapes lie on the curve. So with growing `factor` the scene converges to smooth rods, which are rigid where the file's
/// segments are fixed and where rods are joined. The error is of order 1 / `factor`, because a joint beside a fixed segment
/// bends over half of that segment, too; it is of order 1 / `factor`^2 where faces are clamped and nothing branches. A
/// `stretch` compliance is that of a whole segment. The time steps stay the file's.
///
/// # Errors
/// As [`parse`]; too many segments among them.
pub fn parse_refined(text: &str, file_name: &str, factor: NonZeroUsize) -> Result<Scene, SceneError> {
    let source = error::Source { file: file_name, text, notes: text::Notes::default() };
    let file: format::File = toml::from_str(text).map_err(|e| source.reader_error(&e))?;
    let scene = assemble::scene(&source, &file, Refinement(factor.get()))?;
    let text = (factor == NonZeroUsize::MIN).then(|| source.notes.text(text));
    Ok(Scene { text, ..scene })
}

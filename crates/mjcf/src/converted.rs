//! What a conversion gives: the scene file, its warnings, and where its lines come from.

/// A scene file that was written from an MJCF file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Converted {
    /// The scene file. Its first comments are the `warnings`.
    pub toml: String,
    /// What was left out or approximated, a sentence each with file, line and element.
    pub warnings: Vec<String>,
    /// What each line of `toml` comes from, `FILE:LINE: <ELEMENT>`; empty for lines that come from no element.
    pub(crate) origins: Vec<String>,
}

impl Converted {
    /// The element that a line of the scene file comes from (lines are counted from 1), as `FILE:LINE: <ELEMENT>`.
    pub fn origin(&self, line: usize) -> Option<&str> {
        let own = self.origins.get(line.checked_sub(1)?)?;
        (!own.is_empty()).then_some(own)
    }
}

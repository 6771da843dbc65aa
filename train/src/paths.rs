//! Names of files.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// A path with more after its last name.
pub(crate) fn with_ending(path: &Path, ending: &str) -> PathBuf {
    let mut name: OsString = path.into();
    name.push(ending);
    name.into()
}

//! Where a program's source comes from.

use std::process::Command;

/// The repository that this crate was built in.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// The revision of the source in the folder where this program was built, wherever it runs; a program that is older than that
/// folder's state gives the newer one. `None` where the folder is no repository any more.
pub fn git_revision() -> Option<String> {
    let output =
        Command::new("git").current_dir(ROOT).args(["describe", "--always", "--dirty", "--abbrev=40"]).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?.trim().to_owned();
    (output.status.success() && !text.is_empty()).then_some(text)
}

//! The page: runs and the program that shows them, as one HTML file.

use std::io::{self, Write};
use std::path::Path;

use export::{ExportError, write_atomically};

use crate::Run;

const HTML: &str = include_str!("page/page.html");
const STYLE: &str = include_str!("page/page.css");

/// The program, in the order in which its parts use each other.
const SCRIPT: [&str; 19] = [
    include_str!("page/text.js"),
    include_str!("page/vectors.js"),
    include_str!("page/picking.js"),
    include_str!("page/motion.js"),
    include_str!("page/colours.js"),
    include_str!("page/shaders.js"),
    include_str!("page/meshes.js"),
    include_str!("page/bodies.js"),
    include_str!("page/tubes.js"),
    include_str!("page/scenery.js"),
    include_str!("page/camera.js"),
    include_str!("page/marks.js"),
    include_str!("page/renderer.js"),
    include_str!("page/chart.js"),
    include_str!("page/player.js"),
    include_str!("page/card.js"),
    include_str!("page/save.js"),
    include_str!("page/controls.js"),
    include_str!("page/main.js"),
];

/// Writes a page that plays `runs`, overlaid or side by side: one HTML file that needs no network. Whole or not at all.
///
/// # Errors
/// [`ExportError::Io`] with `path`, if the system refuses, if there is no run, or if a run has no frame or no segment.
pub fn write_page(path: &Path, runs: &[Run]) -> Result<(), ExportError> {
    write_atomically(path, |writer| {
        if runs.is_empty() {
            return Err(io::Error::other("there is no run to show"));
        }
        if let Some(run) = runs.iter().find(|run| run.frames() == 0 || run.segments() == 0) {
            return Err(io::Error::other(format!("the run \"{}\" has no frame or no segment", run.name)));
        }
        // In JSON, `<` stands in strings only. Escaped, no name can end the script that the runs stand in.
        let json = serde_json::to_string(runs)?.replace('<', "\\u003c");
        let names: Vec<&str> = runs.iter().map(Run::name).collect();
        let title = escaped(&names.join(" · "));
        let parts = [
            ("{{title}}", title),
            ("{{style}}", STYLE.to_owned()),
            ("{{runs}}", json),
            (
                "{{script}}",
                SCRIPT.iter().flat_map(|part| part.lines()).filter(is_code).flat_map(|line| [line, "\n"]).collect(),
            ),
        ];
        let mut rest = HTML;
        for (mark, text) in &parts {
            let (before, after) =
                rest.split_once(mark).ok_or_else(|| io::Error::other(format!("no {mark} in the page")))?;
            writer.write_all(before.as_bytes())?;
            writer.write_all(text.as_bytes())?;
            rest = after;
        }
        writer.write_all(rest.as_bytes())
    })
}

/// Whether a line of the program is more than a comment.
fn is_code(line: &&str) -> bool {
    !["//", "/**", "*"].iter().any(|begin| line.trim_start().starts_with(begin))
}

/// Text for an element of HTML.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

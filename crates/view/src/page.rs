//! The page: runs and the program that shows them, as one HTML file.

use std::io::{self, Write};
use std::path::Path;

use export::{ExportError, write_atomically};

use crate::Run;

const HTML: &str = include_str!("page/page.html");
const STYLE: &str = include_str!("page/page.css");

/// The program, in the order in which its parts use each other; what begins it comes last.
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

/// What begins it with recorded runs.
const RECORDED: &str = include_str!("page/recorded.js");
/// What begins it with a simulation that runs.
const LIVE: [&str; 4] = [
    include_str!("page/live-motion.js"),
    include_str!("page/live-player.js"),
    include_str!("page/live-hands.js"),
    include_str!("page/live.js"),
];
/// Controls of a simulation that runs.
const LIVE_CONTROLS: &str = include_str!("page/live.html");

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
        write_html(writer, runs, "", "", &[RECORDED])
    })
}

/// The page of a simulation that runs: it shows frames that come over a WebSocket from the server on this `port` that the page is
/// from, at the page's own path and `socket`. `first` is a run of one frame, which says what there is to draw.
///
/// # Errors
/// If the run has no frame or no segment.
pub fn live_page(first: &Run, port: u16) -> io::Result<String> {
    if first.frames() != 1 || first.segments() == 0 {
        return Err(io::Error::other(format!("\"{}\" is no run of one frame with segments", first.name)));
    }
    let mut page = Vec::new();
    let connect = format!("; connect-src ws://127.0.0.1:{port} ws://localhost:{port}");
    write_html(&mut page, std::slice::from_ref(first), &connect, LIVE_CONTROLS, &LIVE)?;
    String::from_utf8(page).map_err(io::Error::other)
}

/// Writes the page: `connect` is what its policy adds, `controls` come beside those of all pages, `begin` ends the program.
fn write_html(writer: &mut dyn Write, runs: &[Run], connect: &str, controls: &str, begin: &[&str]) -> io::Result<()> {
    // In JSON, `<` stands in strings only. Escaped, no name can end the script that the runs stand in.
    let json = serde_json::to_string(runs)?.replace('<', "\\u003c");
    let names: Vec<&str> = runs.iter().map(Run::name).collect();
    let title = escaped(&names.join(" · "));
    let program = SCRIPT.iter().chain(begin).flat_map(|part| part.lines()).filter(is_code);
    let parts = [
        ("{{connect}}", connect.to_owned()),
        ("{{title}}", title),
        ("{{style}}", STYLE.to_owned()),
        ("{{controls}}", controls.to_owned()),
        ("{{runs}}", json),
        ("{{script}}", program.flat_map(|line| [line, "\n"]).collect()),
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
}

/// Whether a line of the program is more than a comment.
fn is_code(line: &&str) -> bool {
    !["//", "/**", "*"].iter().any(|begin| line.trim_start().starts_with(begin))
}

/// Text for an element of HTML.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

//! Reading a page back.

use std::collections::BTreeSet;
use std::path::Path;

use export::ExportError;
use roxmltree::{Document, Node, ParsingOptions};

use crate::ReportError;

/// Reads the page in `directory` back, as [`crate::Page::write`] wrote it, and returns every problem it has, in words;
/// none if it is whole. Problems are: a page that is not well-formed; links that lead nowhere, out of the page's directory
/// or to the network; styles that load anything; ids used twice; charts without a description; figures and tables without
/// conditions or without their CSV file; CSV files without rows, with rows of different lengths, or that the page does not
/// mention.
///
/// # Errors
/// [`ReportError::File`] if `index.html` or a file in `csv` cannot be read.
pub fn check(directory: &Path) -> Result<Vec<String>, ReportError> {
    let path = directory.join("index.html");
    let text = std::fs::read_to_string(&path).map_err(ExportError::io("read", &path))?;
    let document = match Document::parse_with_options(&text, ParsingOptions { allow_dtd: true, ..Default::default() }) {
        Ok(document) => document,
        Err(error) => return Ok(vec![format!("index.html is not well-formed: {error}")]),
    };
    let (mut problems, mut ids, mut links) = (Vec::new(), BTreeSet::new(), BTreeSet::new());
    for node in document.descendants() {
        if let Some(id) = node.attribute("id")
            && !ids.insert(id)
        {
            problems.push(format!("the id {id:?} is used twice"));
        }
        links.extend(["href", "src"].iter().filter_map(|name| node.attribute(*name)));
        let style = if node.has_tag_name("style") { node.text() } else { node.attribute("style") };
        if style.is_some_and(|style| style.contains("url(") || style.contains("@import")) {
            problems.push("a style loads something from elsewhere".into());
        }
        if node.attribute("role") == Some("img") && node.attribute("aria-label").is_none_or(str::is_empty) {
            problems.push("a chart has no description (aria-label)".into());
        }
        let is_evidence = node.has_tag_name("table") || node.attribute("role") == Some("img");
        if node.has_tag_name("figure") {
            problems.extend(figure(node));
        } else if is_evidence && !node.ancestors().any(|node| node.has_tag_name("figure")) {
            problems.push(format!("a {} is in no figure", node.tag_name().name()));
        }
    }
    for link in &links {
        let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
        if file.contains(':') || file.starts_with('/') || file.split('/').any(|part| part == "..") {
            problems.push(format!("{link:?} leads out of the page's directory"));
        } else if file.is_empty() && !ids.contains(anchor) {
            problems.push(format!("{link:?} leads nowhere: no such id"));
        } else if !file.is_empty() && !directory.join(file).is_file() {
            problems.push(format!("{link:?} leads nowhere: no such file"));
        }
    }
    let folder = directory.join("csv");
    let entries = std::fs::read_dir(&folder).and_then(|entries| entries.map(|entry| Ok(entry?.path())).collect());
    let mut paths: Vec<_> = entries.map_err(ExportError::io("read the directory", &folder))?;
    paths.sort();
    for path in paths {
        let name = format!("csv/{}", path.file_name().unwrap_or_default().to_string_lossy());
        if !links.contains(name.as_str()) {
            problems.push(format!("{name}: the page does not mention it"));
        }
        let bytes = std::fs::read(&path).map_err(ExportError::io("read", &path))?;
        // The reader itself refuses rows of different lengths.
        match csv::Reader::from_reader(bytes.as_slice()).records().collect::<Result<Vec<_>, _>>() {
            Ok(rows) if rows.is_empty() => problems.push(format!("{name}: no rows")),
            Ok(_) => {}
            Err(error) => problems.push(format!("{name}: {error}")),
        }
    }
    Ok(problems)
}

/// What is wrong with a figure or a table.
fn figure(node: Node<'_, '_>) -> Vec<String> {
    let Some(id) = node.attribute("id") else { return vec!["a figure has no id".into()] };
    let mut problems = Vec::new();
    let words = || node.descendants().filter(|node| node.has_tag_name("dt") || node.has_tag_name("dd"));
    let is_empty = |node: Node<'_, '_>| node.text().unwrap_or_default().trim().is_empty();
    if !words().any(|node| node.has_tag_name("dd")) || words().any(is_empty) {
        problems.push(format!("{id:?} has no conditions, or empty ones"));
    }
    let file = format!("csv/{id}.csv");
    if !node.descendants().any(|node| node.attribute("href") == Some(&file)) {
        problems.push(format!("{id:?} has no link to its CSV file {file:?}"));
    }
    problems
}

//! Reading a page back.

use std::collections::BTreeSet;
use std::path::Path;

use roxmltree::{Document, Node, ParsingOptions};

use crate::ReportError;
use crate::page::io_error;

/// Attributes that name a file, an address or an anchor.
const ADDRESSES: [&str; 10] =
    ["href", "src", "srcset", "poster", "data", "action", "formaction", "cite", "background", "ping"];

/// Reads the page in `directory` back, as [`crate::Page::write`] wrote it, and returns every problem it has, in words; none if
/// it is whole. Problems are: a page that is not well-formed; links that lead nowhere or out of the page's directory,
/// whatever would come from the network; ids used twice; charts without a description; figures and tables without
/// conditions or without their CSV file; CSV files without rows, with rows of different lengths, or that the page does
/// not mention.
///
/// # Errors
/// [`ReportError::File`] if `index.html` or a file in `csv` cannot be read.
pub fn check(directory: &Path) -> Result<Vec<String>, ReportError> {
    let path = directory.join("index.html");
    let text = std::fs::read_to_string(&path).map_err(io_error("read", &path))?;
    let document = match Document::parse_with_options(&text, ParsingOptions { allow_dtd: true, ..Default::default() }) {
        Ok(document) => document,
        Err(error) => return Ok(vec![format!("index.html is not well-formed: {error}")]),
    };
    let mut problems = Vec::new();
    let ids = ids(&document, &mut problems);
    for node in document.descendants().filter(Node::is_element) {
        addresses(node, &ids, directory, &mut problems);
        styles(node, &mut problems);
        match node.tag_name().name() {
            "figure" => figure(node, &mut problems),
            "table" if !within_figure(node) => problems.push("a table is in no figure".into()),
            "svg" if node.attribute("role") == Some("img") => chart(node, &mut problems),
            _ => {}
        }
    }
    files(directory, &document, &mut problems)?;
    Ok(problems)
}

/// All ids of the page.
fn ids<'a>(document: &'a Document<'_>, problems: &mut Vec<String>) -> BTreeSet<&'a str> {
    let mut ids = BTreeSet::new();
    for id in document.descendants().filter_map(|node| node.attribute("id")) {
        if !ids.insert(id) {
            problems.push(format!("the id {id:?} is used twice"));
        }
    }
    ids
}

/// Whether an address leads to another machine.
fn is_network(address: &str) -> bool {
    let address = address.trim().to_ascii_lowercase();
    ["http:", "https:", "ftp:", "ws:", "wss:", "//"].iter().any(|start| address.starts_with(start))
}

fn addresses(node: Node<'_, '_>, ids: &BTreeSet<&str>, directory: &Path, problems: &mut Vec<String>) {
    for attribute in node.attributes().filter(|attribute| ADDRESSES.contains(&attribute.name())) {
        let (name, address) = (attribute.name(), attribute.value());
        let (file, anchor) = address.split_once('#').unwrap_or((address, ""));
        if is_network(address) {
            problems.push(format!("{name}={address:?} leads to the network"));
        } else if address.starts_with("data:") {
        } else if file.contains(':') || file.starts_with('/') || file.split('/').any(|part| part == "..") {
            problems.push(format!("{name}={address:?} leads out of the page's directory"));
        } else if file.is_empty() && !ids.contains(anchor) {
            problems.push(format!("{name}={address:?} leads nowhere: no such id"));
        } else if !file.is_empty() && !directory.join(file).is_file() {
            problems.push(format!("{name}={address:?} leads nowhere: no such file"));
        }
    }
}

/// Looks for what a style sheet or a presentation attribute would load.
fn styles(node: Node<'_, '_>, problems: &mut Vec<String>) {
    let sheet = (node.tag_name().name() == "style").then(|| node.text()).flatten();
    for text in node.attributes().map(|attribute| attribute.value()).chain(sheet) {
        let lower = text.to_ascii_lowercase();
        if lower.contains("@import") {
            problems.push("a style sheet imports another one".into());
        }
        for address in lower.split("url(").skip(1) {
            let address = address.trim_start_matches(|c: char| c.is_whitespace() || "\"'".contains(c));
            if is_network(address) {
                let end = address.find([')', '"', '\'']).unwrap_or(address.len());
                problems.push(format!("a style sheet loads {:?} from the network", &address[..end]));
            }
        }
    }
}

fn within_figure(node: Node<'_, '_>) -> bool {
    node.ancestors().any(|node| node.has_tag_name("figure"))
}

fn chart(node: Node<'_, '_>, problems: &mut Vec<String>) {
    if !within_figure(node) {
        problems.push("a chart is in no figure".into());
    }
    if node.attribute("aria-label").is_none_or(|label| label.trim().is_empty()) {
        problems.push("a chart has no description (aria-label)".into());
    }
}

/// Checks that a figure or a table has conditions and its CSV file.
fn figure(node: Node<'_, '_>, problems: &mut Vec<String>) {
    let Some(id) = node.attribute("id") else {
        problems.push("a figure has no id".into());
        return;
    };
    let filled = |node: Node<'_, '_>| node.text().is_some_and(|text| !text.trim().is_empty());
    let list = node.descendants().find(|node| node.attribute("class") == Some("conditions"));
    let parts = |tag| list.into_iter().flat_map(|list| list.descendants()).filter(move |node| node.has_tag_name(tag));
    if parts("dd").next().is_none() || !parts("dt").chain(parts("dd")).all(filled) {
        problems.push(format!("{id:?} has no conditions, or empty ones"));
    }
    let file = format!("csv/{id}.csv");
    if !node.descendants().any(|node| node.attribute("href") == Some(&file)) {
        problems.push(format!("{id:?} has no link to its CSV file {file:?}"));
    }
}

/// Checks the files in `csv`.
fn files(directory: &Path, document: &Document<'_>, problems: &mut Vec<String>) -> Result<(), ReportError> {
    let folder = directory.join("csv");
    // A page without figures and tables need not have the directory; links to missing files are found elsewhere.
    if !folder.exists() {
        return Ok(());
    }
    let entries = std::fs::read_dir(&folder).and_then(|entries| entries.map(|e| Ok(e?.path())).collect());
    let mut paths: Vec<_> = entries.map_err(io_error("read the directory", &folder))?;
    paths.sort();
    for path in paths {
        let name = format!("csv/{}", path.file_name().unwrap_or_default().to_string_lossy());
        if !document.descendants().any(|node| node.attribute("href") == Some(&name)) {
            problems.push(format!("{name}: the page does not mention it"));
        }
        let bytes = std::fs::read(&path).map_err(io_error("read", &path))?;
        problems.extend(csv_problem(&bytes).map(|problem| format!("{name}: {problem}")));
    }
    Ok(())
}

fn csv_problem(bytes: &[u8]) -> Option<String> {
    let mut rows = 0;
    // The reader itself refuses rows of different lengths.
    for record in csv::Reader::from_reader(bytes).records() {
        match record {
            Ok(_) => rows += 1,
            Err(error) => return Some(error.to_string()),
        }
    }
    (rows == 0).then(|| "no rows".into())
}

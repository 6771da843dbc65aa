//! Sealed text: TOML with a first line of its own, `checksum = "..."`, the BLAKE3 hash of all that follows.

use std::io;
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;
use thiserror::Error;

/// What is wrong with a sealed text.
#[derive(Debug, Error)]
pub enum SealedError {
    /// It cannot be read.
    #[error("{}:{line}: {message}", file.display())]
    Text {
        /// The file it is from.
        file: PathBuf,
        /// Line of the mistake, from 1.
        line: usize,
        /// The line, and what is wrong with it.
        message: String,
    },
    /// A value in it is not allowed: it is of another version, for instance, or was changed after it was written.
    #[error("{}: {key} = {value}, but it must be {allowed}", file.display())]
    Value {
        /// The file it is from.
        file: PathBuf,
        /// The key, such as `schema_version` or `checksum`, or the name of a tensor.
        key: String,
        /// Its value.
        value: String,
        /// What is allowed.
        allowed: String,
    },
}

/// `value` as TOML with its checksum in front. It must have an integer `schema_version` for [`unseal`] to read it.
///
/// # Errors
/// If `value` has no form in TOML.
pub fn seal(value: &impl Serialize) -> io::Result<String> {
    let body = toml::to_string(value).map_err(io::Error::other)?;
    Ok(format!("{}\n{body}", checksum_line(&body)))
}

fn checksum_line(body: &str) -> String {
    format!("checksum = \"{}\"", blake3::hash(body.as_bytes()).to_hex())
}

/// Reads what [`seal`] has made of a value with this `schema_version`. `file` is named in errors only.
///
/// # Errors
/// If `bytes` are no such text, of another version, or changed. What is wrong with a key is said before what is wrong
/// with the checksum.
pub fn unseal<T: DeserializeOwned>(file: &Path, bytes: &[u8], schema_version: u32) -> Result<T, SealedError> {
    let text = str::from_utf8(bytes).map_err(|error| {
        let line = line_number(&bytes[..error.valid_up_to()]);
        SealedError::Text { file: file.to_owned(), line, message: "not UTF-8 text".to_owned() }
    })?;
    let wrong = |offset: usize, message: &str| text_error(file, text, offset, message);
    let table: toml::Table =
        toml::from_str(text).map_err(|error| wrong(error.span().map_or(0, |span| span.start), error.message()))?;
    let shown = |key: &str| table.get(key).map_or("missing".to_owned(), |value| one_line(&value.to_string()));
    let value_error =
        |key: &str, allowed| SealedError::Value { file: file.to_owned(), key: key.into(), value: shown(key), allowed };
    let version = table.get("schema_version").and_then(toml::Value::as_integer);
    if version != Some(i64::from(schema_version)) {
        let newer = version.is_some_and(|version| version > i64::from(schema_version));
        let hint = if newer { " (a newer program has written it)" } else { "" };
        return Err(value_error("schema_version", format!("{schema_version}{hint}")));
    }
    let (line, body) = text.split_once('\n').unwrap_or((text, ""));
    let start = text.len() - body.len();
    let value = toml::from_str(body)
        .map_err(|error| wrong(start + error.span().map_or(0, |span| span.start), error.message()))?;
    if line != checksum_line(body) {
        let hash = blake3::hash(body.as_bytes()).to_hex();
        let allowed = format!("\"{hash}\" by the text below it: it was changed after it was written");
        return Err(value_error("checksum", allowed));
    }
    Ok(value)
}

/// Number, from 1, of the line that follows `before`.
fn line_number(before: &[u8]) -> usize {
    1 + before.iter().filter(|&&byte| byte == b'\n').count()
}

fn text_error(file: &Path, text: &str, offset: usize, message: &str) -> SealedError {
    let number = line_number(&text.as_bytes()[..offset.min(text.len())]);
    let line: String = text.lines().nth(number - 1).unwrap_or_default().chars().take(80).collect();
    let message = format!("`{}`: {}", printable(&line), one_line(message));
    SealedError::Text { file: file.to_owned(), line: number, message }
}

/// Text on one line.
fn one_line(text: &str) -> String {
    printable(&text.split_whitespace().collect::<Vec<_>>().join(" "))
}

/// Text that no damaged byte makes a terminal obey.
pub(crate) fn printable(text: &str) -> String {
    text.replace(char::is_control, "\u{fffd}")
}

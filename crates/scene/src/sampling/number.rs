//! Numbers in the text of a scene file.

/// A number of a scene file, in full.
pub(super) fn number(value: f64) -> String {
    toml::Value::Float(value).to_string()
}

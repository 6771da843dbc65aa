//! Text in TOML, line by line, with the element that each line comes from.

use nalgebra::{UnitQuaternion, Vector3};

use crate::xml::Element;

/// A text that grows.
#[derive(Default)]
pub(crate) struct Writer {
    text: String,
    origins: Vec<String>,
    origin: String,
}

impl Writer {
    /// From here on, lines come from this element.
    pub(crate) fn of(&mut self, element: &Element) -> &mut Self {
        self.origin = element.label();
        self
    }

    pub(crate) fn line(&mut self, line: &str) -> &mut Self {
        self.text.push_str(line);
        self.text.push('\n');
        self.origins.push(self.origin.clone());
        self
    }

    /// `key = value`.
    pub(crate) fn key(&mut self, key: &str, value: impl AsRef<str>) -> &mut Self {
        self.line(&format!("{key} = {}", value.as_ref()))
    }

    pub(crate) fn finish(self) -> (String, Vec<String>) {
        (self.text, self.origins)
    }
}

/// A number, to twelve digits; rounding errors of sums that should be zero are zero.
pub(crate) fn number(value: f64) -> String {
    let value = if value.abs() < 1e-15 { 0.0 } else { format!("{value:.11e}").parse().unwrap_or(value) };
    if value.is_infinite() { "inf".to_owned() } else { format!("{value:?}") }
}

pub(crate) fn numbers(values: &[f64]) -> String {
    format!("[{}]", values.iter().map(|value| number(*value)).collect::<Vec<_>>().join(", "))
}

pub(crate) fn vector(vector: &Vector3<f64>) -> String {
    numbers(vector.as_slice())
}

/// `[w, x, y, z]`.
pub(crate) fn quaternion(turn: &UnitQuaternion<f64>) -> String {
    numbers(&[turn.w, turn.i, turn.j, turn.k])
}

/// A basic string.
pub(crate) fn quoted(text: &str) -> String {
    let mut quoted = String::from('"');
    for letter in text.chars() {
        match letter {
            '"' | '\\' => quoted.extend(['\\', letter]),
            letter if letter.is_control() => quoted.push_str(&format!("\\u{:04X}", letter as u32)),
            letter => quoted.push(letter),
        }
    }
    quoted.push('"');
    quoted
}

//! What can be wrong with a scene, and where in its file.

use std::ops::Range;

use nalgebra::{UnitQuaternion, Vector3};
use thiserror::Error;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::format::Vector;
use crate::text::Notes;

/// Why there is no scene.
#[derive(Debug, Error)]
pub enum SceneError {
    /// The file cannot be read.
    #[error("{file}: {source}")]
    Read {
        /// The file.
        file: String,
        /// The reason.
        source: std::io::Error,
    },
    /// The file's text is not a scene.
    #[error("{file}:{line}: {message}")]
    Invalid {
        /// The file.
        file: String,
        /// Line of the mistake, from 1.
        line: usize,
        /// The key, its value and what is allowed.
        message: String,
    },
    /// A setting ([`crate::parse_set`]) is no key and value of the file, or its value is not allowed.
    #[error("{setting}: {message}")]
    Setting {
        /// The setting.
        setting: String,
        /// What is wrong, and what is allowed.
        message: String,
    },
    /// A builtin scene has no such size.
    #[error("there is no builtin scene `{name}`: the size of a {kind} must be {least} to {largest}")]
    BuiltinSize {
        /// The name.
        name: String,
        /// What it would be.
        kind: &'static str,
        /// The smallest size.
        least: usize,
        /// The largest.
        largest: usize,
    },
    /// There is no builtin scene of that name.
    #[error("there is no builtin scene `{name}`{meant} (there are {known})")]
    UnknownBuiltin {
        /// The name.
        name: String,
        /// Which name may have been meant, in words; empty where none is like it.
        meant: String,
        /// The names that exist.
        known: String,
    },
}

/// The largest number that a key or a table may give: squares and cubes of it are numbers still.
pub(crate) const LARGEST: f64 = 1e30;
/// [`LARGEST`] in words.
pub(crate) const AT_MOST: &str = "1e30 in size at most";

/// Similarity, of 0 to 1, from which a key is taken for a slip of the pen.
const ALIKE: f64 = 0.75;

/// Of the `known` names that one which may have been meant: the most alike, if it is more so than `least` (of 0 to 1).
pub fn nearest<'a>(name: &str, known: impl Iterator<Item = &'a str>, least: f64) -> Option<&'a str> {
    let likeness = |known: &&str| strsim::jaro_winkler(name, known);
    known.filter(|known| likeness(known) > least).max_by(|a, b| likeness(a).total_cmp(&likeness(b)))
}

/// What is wrong with the key at the end of a path, given the known ones, each in backticks.
fn unknown_key(path: &str, known: &str) -> String {
    let name = path.rsplit('.').next().unwrap_or(path);
    let meant = nearest(name, known.split('`').skip(1).step_by(2), ALIKE);
    let meant = meant.map(|known| format!(" (did you mean `{known}`?)")).unwrap_or_default();
    format!("{path} is not a known key{meant}; expected {known}")
}

pub(crate) type Result<T> = std::result::Result<T, SceneError>;

/// A mistake in a file that the scene names: its line, and what is wrong there.
pub(crate) type Mistake = (usize, String);

/// The error of a mistake in `file`, in one line whatever stands in that file.
pub(crate) fn mistaken(file: &str, (line, message): Mistake) -> SceneError {
    SceneError::Invalid { file: file.to_owned(), line, message: message.replace(char::is_control, " ") }
}

/// A scene file's text and name: turns places in the text into errors, and checks values.
pub(crate) struct Source<'a> {
    pub(crate) file: &'a str,
    pub(crate) text: &'a str,
    /// The other files that the text names.
    pub(crate) notes: Notes,
}

impl Source<'_> {
    /// `key = value, but it must be ALLOWED`, for the value at `span`.
    pub(crate) fn must_be<T>(&self, span: Range<usize>, allowed: &str) -> Result<T> {
        let message = format!("{} = {}, but it must be {allowed}", self.path(&span), self.value(&span));
        Err(self.invalid(span.start, message))
    }

    /// `key: MESSAGE`, for the table or the value at `span`.
    pub(crate) fn wrong<T>(&self, span: Range<usize>, message: &str) -> Result<T> {
        Err(self.invalid(span.start, format!("{}: {message}", self.path(&span))))
    }

    /// The error of the TOML reader, in the words of all others. That error says what is wrong in its message alone (its kind
    /// is private, and [`Spanned`] values need the crate's own deserializer), so its words are read; `tests/all/errors.rs` has
    /// a mistake for each case below, and fails where a new version of the crate uses other words.
    pub(crate) fn reader_error(&self, error: &toml::de::Error) -> SceneError {
        let span = error.span().unwrap_or(0..0);
        let message = error.message();
        if let Err(syntax) = DeTable::parse(self.text) {
            let at = syntax.span().unwrap_or(0..0).start;
            return self.invalid(at, format!("not valid TOML: {}", one_line(syntax.message())));
        }
        let (path, value) = (self.path(&span), self.value(&span));
        let at = |message: String| if path.is_empty() { message } else { format!("{path}: {message}") };
        let (kind, quoted) = message.split_once('`').unwrap_or((message, ""));
        let expected = message.split_once(", expected ").map(|(_, expected)| expected);
        let is_key = !value.starts_with(['"', '\'']);
        let message = match (kind, expected) {
            ("unknown field ", Some(known)) => unknown_key(&path, known),
            ("unknown variant ", Some(known)) if is_key => unknown_key(&path, known),
            ("missing field ", _) => at(format!("missing key `{quoted}")),
            ("invalid type: map, expected a sequence", _) => {
                format!("{path} is a table, but it must be a list: [...], or one [[...]] for each table in it")
            }
            ("wanted string or table", _) => format!("{path} = {value}, but it must be a string or a table"),
            _ if kind.starts_with("wanted exactly 1 element") => at("it must hold exactly one key".to_owned()),
            (_, Some(expected)) => format!("{path} = {value}, but it must be {}", plain_words(expected)),
            (_, None) => at(one_line(message)),
        };
        self.invalid(span.start, message)
    }

    /// What was read of the file that the value at `span` names: a mistake in it says where it is named, too.
    pub(crate) fn of_file<T>(&self, span: Range<usize>, read: Result<T>) -> Result<T> {
        read.map_err(|mistake| match (mistake, self.invalid(span.start, String::new())) {
            (SceneError::Invalid { file, line, message }, SceneError::Invalid { line: here, .. })
                if file != self.file =>
            {
                let message = format!("{message} (the file that {}:{here} names)", self.file);
                SceneError::Invalid { file, line, message }
            }
            (mistake, _) => mistake,
        })
    }

    pub(crate) fn finite(&self, value: &Spanned<f64>, unit: &str) -> Result<f64> {
        let value = self.small_enough(value, unit)?;
        self.number(value, f64::is_finite, &format!("finite{}", in_brackets(unit)))
    }

    pub(crate) fn positive(&self, value: &Spanned<f64>, unit: &str) -> Result<f64> {
        let value = self.small_enough(value, unit)?;
        self.number(value, |v| v.is_finite() && v > 0.0, &format!("finite and > 0{}", in_brackets(unit)))
    }

    pub(crate) fn not_negative(&self, value: &Spanned<f64>, unit: &str) -> Result<f64> {
        let value = self.small_enough(value, unit)?;
        self.number(value, |v| v.is_finite() && v >= 0.0, &format!("finite and >= 0{}", in_brackets(unit)))
    }

    /// A number that is no larger than [`LARGEST`], or not finite, which others say.
    fn small_enough<'a>(&self, value: &'a Spanned<f64>, unit: &str) -> Result<&'a Spanned<f64>> {
        match value.get_ref() {
            v if v.is_finite() && v.abs() > LARGEST => {
                self.must_be(value.span(), &format!("{AT_MOST}{}", in_brackets(unit)))
            }
            _ => Ok(value),
        }
    }

    pub(crate) fn number(&self, value: &Spanned<f64>, ok: fn(f64) -> bool, allowed: &str) -> Result<f64> {
        match *value.get_ref() {
            v if ok(v) => Ok(v),
            _ => self.must_be(value.span(), allowed),
        }
    }

    pub(crate) fn vector(&self, value: &Vector, unit: &str) -> Result<Vector3<f64>> {
        match self.any_vector(value, unit)? {
            v if v.amax() > LARGEST => {
                self.must_be(value.span(), &format!("three numbers, each {AT_MOST}{}", in_brackets(unit)))
            }
            v => Ok(v),
        }
    }

    /// A rotation by less than half a turn, from its vector in degrees.
    pub(crate) fn turn(&self, value: &Vector) -> Result<UnitQuaternion<f64>> {
        let degrees = self.vector(value, "degrees")?;
        match degrees.norm() < 180.0 {
            true => Ok(UnitQuaternion::from_scaled_axis(degrees.map(f64::to_radians))),
            false => self.must_be(value.span(), "shorter than 180 [degrees]"),
        }
    }

    /// A vector of any finite length.
    fn any_vector(&self, value: &Vector, unit: &str) -> Result<Vector3<f64>> {
        let v = Vector3::from(value.get_ref().0);
        match v.iter().all(|x| x.is_finite()) {
            true => Ok(v),
            false => self.must_be(value.span(), &format!("three finite numbers{}", in_brackets(unit))),
        }
    }

    /// The unit vector along `value`.
    pub(crate) fn direction(&self, value: &Vector) -> Result<Vector3<f64>> {
        let v = self.any_vector(value, "")?;
        let largest = v.amax();
        match largest > 0.0 {
            true => Ok((v / largest).normalize()),
            false => self.must_be(value.span(), "a vector other than zero"),
        }
    }

    pub(crate) fn count(&self, value: &Spanned<i64>, least: usize, most: usize) -> Result<usize> {
        match usize::try_from(*value.get_ref()) {
            Ok(n) if (least..=most).contains(&n) => Ok(n),
            _ => self.must_be(value.span(), &format!("a whole number from {least} to {most}")),
        }
    }

    /// An index below `count`; -1 is the last one.
    pub(crate) fn index(&self, value: &Spanned<i64>, count: usize) -> Result<usize> {
        let (index, n) = (*value.get_ref(), count as i64);
        match index {
            0.. if index < n => Ok(index as usize),
            ..0 if index >= -n => Ok((index + n) as usize),
            _ => self.must_be(value.span(), &format!("a segment's index: 0 to {}, or -{n} to -1 from the end", n - 1)),
        }
    }

    pub(crate) fn invalid(&self, offset: usize, message: String) -> SceneError {
        // Names quoted from the file may hold line breaks and other control characters.
        let message = message.replace(char::is_control, " ");
        let before = &self.text.as_bytes()[..offset.min(self.text.len())];
        let line = 1 + before.iter().filter(|&&byte| byte == b'\n').count();
        SceneError::Invalid { file: self.file.to_owned(), line, message }
    }

    fn value(&self, span: &Range<usize>) -> String {
        one_line(self.text.get(span.clone()).unwrap_or_default())
    }

    /// Dotted path of the innermost key whose name or value holds `span`, such as `rods[0].radius_m`.
    fn path(&self, span: &Range<usize>) -> String {
        let mut path = String::new();
        if let Ok(table) = DeTable::parse(self.text) {
            descend(table.get_ref(), span, &mut path);
        }
        path
    }
}

fn descend(table: &DeTable, span: &Range<usize>, path: &mut String) {
    let holds = |place: Range<usize>| place.start <= span.start && span.end <= place.end;
    for (key, value) in table {
        if holds(key.span()) || inside(value, &holds) {
            let dot = if path.is_empty() { "" } else { "." };
            path.push_str(&format!("{dot}{}", key.get_ref()));
            if !holds(key.span()) {
                descend_value(value, span, path);
            }
            return;
        }
    }
}

fn descend_value(value: &Spanned<DeValue>, span: &Range<usize>, path: &mut String) {
    let holds = |place: Range<usize>| place.start <= span.start && span.end <= place.end;
    match value.get_ref() {
        DeValue::Table(table) if value.span() != *span => descend(table, span, path),
        DeValue::Array(items) => {
            if let Some(i) = items.iter().position(|item| inside(item, &holds)) {
                path.push_str(&format!("[{i}]"));
                descend_value(&items[i], span, path);
            }
        }
        _ => {}
    }
}

/// Whether a value or anything in it holds the place: a table's span is that of its header alone.
fn inside(value: &Spanned<DeValue>, holds: &dyn Fn(Range<usize>) -> bool) -> bool {
    holds(value.span())
        || match value.get_ref() {
            DeValue::Table(table) => table.iter().any(|(k, v)| holds(k.span()) || inside(v, holds)),
            DeValue::Array(items) => items.iter().any(|item| inside(item, holds)),
            _ => false,
        }
}

/// `value` to six digits, for messages.
pub(crate) fn short(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

fn in_brackets(unit: &str) -> String {
    if unit.is_empty() { String::new() } else { format!(" [{unit}]") }
}

/// `text` without line breaks, and not too long.
fn one_line(text: &str) -> String {
    const LONGEST: usize = 80;
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text,
    }
}

/// What serde calls types, in a user's words.
fn plain_words(expected: &str) -> String {
    match expected {
        "a boolean" => "true or false".to_owned(),
        "f64" => "a number".to_owned(),
        "i64" => "a whole number".to_owned(),
        "u64" => "a whole number >= 0".to_owned(),
        "an array of length 2" => "two values: [x, y]".to_owned(),
        "an array of length 3" => "three numbers: [x, y, z]".to_owned(),
        "a sequence" => "a list: [...]".to_owned(),
        _ if expected.starts_with("struct ") => "a table".to_owned(),
        _ => one_line(expected),
    }
}

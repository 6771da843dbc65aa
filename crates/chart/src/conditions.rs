//! Under which conditions something was measured.

/// Under which conditions something was measured, as an ordered list of keys and values: revision, machine, seeds,
/// tolerance, what a time includes. There is no empty list: a result without conditions is not evidence.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Conditions(Vec<(String, String)>);

impl Conditions {
    /// Conditions with a first key and its value.
    pub fn new(key: impl Into<String>, value: impl Into<String>) -> Self {
        Self(vec![(key.into(), value.into())])
    }

    /// These conditions with one more, or with another value where the key is there already.
    pub fn with(mut self, key: impl Into<String>, value: impl Into<String>) -> Self {
        let (key, value) = (key.into(), value.into());
        match self.0.iter_mut().find(|(known, _)| *known == key) {
            Some((_, old)) => *old = value,
            None => self.0.push((key, value)),
        }
        self
    }

    /// Keys and values, in the order of their first mention.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &str)> {
        self.0.iter().map(|(key, value)| (key.as_str(), value.as_str()))
    }
}

//! Which colour and which marker a series has.

use std::collections::BTreeMap;

/// Colours there are. See [`crate::theme`].
pub(crate) const COLOURS: usize = 10;

/// Colours and markers of all series of a page, given in turn to each key at its first appearance.
#[derive(Default)]
pub struct Palette<'a> {
    colours: BTreeMap<&'a str, usize>,
    markers: BTreeMap<&'a str, usize>,
}

impl<'a> Palette<'a> {
    /// Enters the key of a colour.
    pub(crate) fn enter_colour(&mut self, key: &'a str) {
        enter(&mut self.colours, key);
    }

    /// Enters the key of a marker.
    pub(crate) fn enter_marker(&mut self, key: &'a str) {
        enter(&mut self.markers, key);
    }

    /// Class of the colour of `key`.
    pub(crate) fn colour(&self, key: &str) -> String {
        format!("s{}", self.colours.get(key).map_or(0, |i| i % COLOURS))
    }

    /// Number of the marker of `key`.
    pub(crate) fn marker(&self, key: &str) -> usize {
        self.markers.get(key).copied().unwrap_or(0)
    }
}

fn enter<'a>(indices: &mut BTreeMap<&'a str, usize>, key: &'a str) {
    let next = indices.len();
    indices.entry(key).or_insert(next);
}

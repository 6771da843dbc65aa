//! Which colour and which marker a series has.

use std::collections::BTreeMap;

use crate::{Charts, Figure};

/// Colours there are. See [`crate::theme`].
pub(crate) const COLOURS: usize = 10;
/// Shapes of markers there are. With no factor in common with [`COLOURS`], 70 series in a row differ in one or both.
pub(crate) const MARKERS: usize = 7;

/// Colours and markers of all series of a page, given in turn to each key at its first appearance.
#[derive(Default)]
pub struct Palette<'a> {
    colours: BTreeMap<&'a str, usize>,
    markers: BTreeMap<&'a str, usize>,
}

impl<'a> Palette<'a> {
    /// The palette of `figures`, in their order.
    pub fn new(figures: impl IntoIterator<Item = &'a Figure>) -> Self {
        let mut palette = Self::default();
        for figure in figures {
            match &figure.charts {
                Charts::Lines(charts) => charts.iter().flat_map(|chart| &chart.series).for_each(|series| {
                    enter(&mut palette.colours, series.colour_key());
                    enter(&mut palette.markers, &series.name);
                }),
                Charts::Heat(_) => {}
                Charts::Bars(charts) => {
                    charts.iter().flat_map(|chart| &chart.parts).for_each(|part| enter(&mut palette.colours, part));
                }
            }
        }
        palette
    }

    /// Class of the colour of `key`.
    pub(crate) fn colour(&self, key: &str) -> String {
        format!("s{}", self.colours.get(key).map_or(0, |i| i % COLOURS))
    }

    /// Index of the marker of `key`.
    pub(crate) fn marker(&self, key: &str) -> usize {
        self.markers.get(key).map_or(0, |i| i % MARKERS)
    }
}

fn enter<'a>(indices: &mut BTreeMap<&'a str, usize>, key: &'a str) {
    let next = indices.len();
    indices.entry(key).or_insert(next);
}

//! A drawn chart as an element.

use crate::xml::{Attribute, Px, Xml};

/// A drawn chart.
pub(crate) struct Drawing {
    /// Width and height \[px\].
    pub(crate) size: [f64; 2],
    /// Size of its text \[px\].
    pub(crate) font: f64,
    /// What it shows, for those who do not see it.
    pub(crate) label: String,
    /// Its elements, from (0, 0) on.
    pub(crate) body: Xml,
}

impl Drawing {
    /// The drawing as an element with more attributes.
    pub(crate) fn svg(&self, attributes: &[Attribute<'_>]) -> Xml {
        let [width, height] = self.size.map(Px);
        let view = format!("0 0 {width} {height}");
        let own: [Attribute<'_>; 7] = [
            ("class", &"chart"),
            ("role", &"img"),
            ("aria-label", &self.label),
            ("width", &width),
            ("height", &height),
            ("viewBox", &view),
            ("font-size", &self.font),
        ];
        Xml::nest("svg", &[&own, attributes].concat(), [self.body.clone()])
    }
}

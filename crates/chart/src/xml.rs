//! Elements and escaped text: HTML and SVG that are well-formed XML by construction.

use std::fmt::{self, Display, Write};

/// An attribute: its name and its value, which is escaped when it is written. One without a value is left out.
pub type Attribute<'a> = (&'a str, &'a dyn Display);

/// A piece of a document: text and elements, none, one or many.
#[derive(Clone, Debug, Default)]
pub struct Xml(String);

impl Xml {
    /// What is XML already.
    pub fn raw(xml: impl Into<String>) -> Self {
        Self(xml.into())
    }

    /// Text, escaped; what XML cannot hold is replaced.
    pub fn text(text: &str) -> Self {
        let mut xml = String::new();
        for c in text.chars() {
            match c {
                '<' => xml.push_str("&lt;"),
                '>' => xml.push_str("&gt;"),
                '&' => xml.push_str("&amp;"),
                '"' => xml.push_str("&quot;"),
                '\n' | '\t' => xml.push(c),
                c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => xml.push(char::REPLACEMENT_CHARACTER),
                c => xml.push(c),
            }
        }
        Self(xml)
    }

    /// An element with text in it.
    pub fn element(tag: &str, attributes: &[Attribute<'_>], text: &str) -> Self {
        Self::nest(tag, attributes, [Self::text(text)])
    }

    /// An element with pieces in it. Rows, blocks and groups end their line, for those who read the source.
    pub fn nest(tag: &str, attributes: &[Attribute<'_>], pieces: impl IntoIterator<Item = Self>) -> Self {
        let mut xml = format!("<{tag}");
        for (name, value) in attributes {
            let value = Self::text(&value.to_string()).0;
            if !value.is_empty() {
                xml.extend([" ", name, "=\"", &value, "\""]);
            }
        }
        let start = xml.len() + 1;
        xml.push('>');
        xml.extend(pieces.into_iter().map(|piece| piece.0));
        // HTML knows no short form for its own elements.
        if xml.len() == start && ["path", "rect"].contains(&tag) {
            xml.insert(start - 1, '/');
        } else {
            xml.extend(["</", tag, ">"]);
        }
        if ["div", "g", "h2", "head", "li", "p", "section", "thead", "tr"].contains(&tag) {
            xml.push('\n');
        }
        Self(xml)
    }

    /// Appends a piece.
    pub fn push(&mut self, piece: Self) {
        self.0.push_str(&piece.0);
    }

    /// Appends SVG: text whose foot is at `[x, y]` \[px\], its "start", "middle" or "end".
    pub fn label(&mut self, [x, y]: [f64; 2], anchor: &str, class: &str, text: &str) {
        let place: [Attribute<'_>; 4] = [("x", &Px(x)), ("y", &Px(y)), ("text-anchor", &anchor), ("class", &class)];
        self.push(Self::element("text", &place, text));
    }

    /// Appends SVG: a rectangle from `[left, top, width, height]` \[px\] with what is read under the mouse, if anything.
    pub fn rect(&mut self, [x, y, width, height]: [f64; 4], class: &str, opacity: &str, title: &str) {
        let sides: [Attribute<'_>; 4] = [("x", &Px(x)), ("y", &Px(y)), ("width", &Px(width)), ("height", &Px(height))];
        let look: [Attribute<'_>; 2] = [("class", &class), ("fill-opacity", &opacity)];
        self.shape("rect", &[&sides[..], &look].concat(), title);
    }

    /// Appends SVG: a path with what is read under the mouse, if anything.
    pub fn path(&mut self, class: &str, path: &str, title: &str) {
        self.shape("path", &[("class", &class), ("d", &path)], title);
    }

    /// Appends SVG: a shape with what is read under the mouse, if anything.
    pub(crate) fn shape(&mut self, tag: &str, attributes: &[Attribute<'_>], title: &str) {
        let title = (!title.is_empty()).then(|| Self::element("title", &[], title));
        self.push(Self::nest(tag, attributes, title));
    }
}

impl FromIterator<Xml> for Xml {
    fn from_iter<I: IntoIterator<Item = Self>>(pieces: I) -> Self {
        Self(pieces.into_iter().map(|piece| piece.0).collect())
    }
}

impl Display for Xml {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// A length in pixels, printed to a tenth.
#[derive(Clone, Copy, Debug)]
pub struct Px(pub f64);

impl Display for Px {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Adding zero takes the sign off a negative zero.
        write!(f, "{}", (self.0 * 10.0).round() / 10.0 + 0.0)
    }
}

/// SVG: the path through `points` \[px\].
pub fn polyline(points: impl IntoIterator<Item = [f64; 2]>) -> String {
    let mut path = String::new();
    for (i, [x, y]) in points.into_iter().enumerate() {
        // Writing to a string cannot fail.
        let _ = write!(path, "{}{} {}", if i == 0 { 'M' } else { 'L' }, Px(x), Px(y));
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_short() {
        assert_eq!(format!("{} {} {}", Px(1.26), Px(-0.01), Px(12.0)), "1.3 0 12");
        assert_eq!(polyline([[0.0, 1.0], [2.26, 3.0]]), "M0 1L2.3 3");
    }
}

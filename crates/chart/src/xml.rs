//! Elements and escaped text: HTML and SVG that are well-formed XML by construction.

use std::fmt::{self, Display, Write};

/// An attribute: its name and its value, which is escaped when it is written. One without a value is left out.
pub type Attribute<'a> = (&'a str, &'a dyn Display);

/// A document in the making. An element that was opened is closed under its own name.
#[derive(Default)]
pub struct Xml {
    text: String,
    open: Vec<&'static str>,
}

impl Xml {
    /// Begins an element.
    pub fn open(&mut self, tag: &'static str, attributes: &[Attribute<'_>]) {
        self.begin(tag, attributes);
        self.text.push('>');
        self.open.push(tag);
    }

    /// Ends the element that was begun last.
    pub fn close(&mut self) {
        if let Some(tag) = self.open.pop() {
            self.text.extend(["</", tag, ">"]);
        }
    }

    /// An element without content. In HTML, only for those that never have any.
    pub fn leaf(&mut self, tag: &'static str, attributes: &[Attribute<'_>]) {
        self.begin(tag, attributes);
        self.text.push_str("/>");
    }

    /// An element with nothing but text in it.
    pub fn element(&mut self, tag: &'static str, attributes: &[Attribute<'_>], text: &str) {
        self.open(tag, attributes);
        self.text(text);
        self.close();
    }

    /// SVG: text whose foot is at `[x, y]` \[px\], its "start", "middle" or "end".
    pub fn label(&mut self, [x, y]: [f64; 2], anchor: &str, class: &str, text: &str) {
        self.element("text", &[("x", &Px(x)), ("y", &Px(y)), ("text-anchor", &anchor), ("class", &class)], text);
    }

    /// SVG: a rectangle from `[left, top, width, height]` \[px\] with what is read under the mouse, if anything.
    pub fn rect(&mut self, [x, y, width, height]: [f64; 4], class: &str, opacity: &str, title: &str) {
        let sides: [Attribute<'_>; 4] = [("x", &Px(x)), ("y", &Px(y)), ("width", &Px(width)), ("height", &Px(height))];
        self.shape("rect", &[&sides[..], &[("class", &class), ("fill-opacity", &opacity)]].concat(), title);
    }

    /// SVG: a path with what is read under the mouse, if anything.
    pub fn path(&mut self, class: &str, path: &str, title: &str) {
        self.shape("path", &[("class", &class), ("d", &path)], title);
    }

    fn shape(&mut self, tag: &'static str, attributes: &[Attribute<'_>], title: &str) {
        if title.is_empty() {
            return self.leaf(tag, attributes);
        }
        self.open(tag, attributes);
        self.element("title", &[], title);
        self.close();
    }

    /// Text, escaped.
    pub fn text(&mut self, text: &str) {
        escape(&mut self.text, text);
    }

    /// What is XML already.
    pub fn raw(&mut self, xml: &str) {
        self.text.push_str(xml);
    }

    /// A new line, for those who read the source.
    pub fn line(&mut self) {
        self.text.push('\n');
    }

    /// The document, all elements closed.
    pub fn finish(mut self) -> String {
        while !self.open.is_empty() {
            self.close();
        }
        self.text
    }

    fn begin(&mut self, tag: &str, attributes: &[Attribute<'_>]) {
        self.text.extend(["<", tag]);
        let mut value = String::new();
        for (name, attribute) in attributes {
            value.clear();
            // Writing to a string cannot fail.
            let _ = write!(value, "{attribute}");
            if !value.is_empty() {
                self.text.extend([" ", name, "=\""]);
                escape(&mut self.text, &value);
                self.text.push('"');
            }
        }
    }
}

/// Appends `text` with what has a meaning in XML escaped, and what XML cannot hold replaced.
fn escape(to: &mut String, text: &str) {
    for c in text.chars() {
        match c {
            '<' => to.push_str("&lt;"),
            '>' => to.push_str("&gt;"),
            '&' => to.push_str("&amp;"),
            '"' => to.push_str("&quot;"),
            '\n' | '\t' => to.push(c),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => to.push(char::REPLACEMENT_CHARACTER),
            c => to.push(c),
        }
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

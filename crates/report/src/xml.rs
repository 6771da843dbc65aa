//! Elements and escaped text: HTML and SVG that are well-formed XML by construction.

use std::fmt::{self, Display, Write};

/// An attribute: its name and its value, which is escaped when it is written.
pub(crate) type Attribute<'a> = (&'a str, &'a dyn Display);

/// A document in the making. An element that was opened is closed under its own name.
#[derive(Default)]
pub(crate) struct Xml {
    text: String,
    open: Vec<&'static str>,
}

impl Xml {
    /// Begins an element.
    pub(crate) fn open(&mut self, tag: &'static str, attributes: &[Attribute<'_>]) {
        self.begin(tag, attributes);
        self.text.push('>');
        self.open.push(tag);
    }

    /// Ends the element that was begun last.
    pub(crate) fn close(&mut self) {
        if let Some(tag) = self.open.pop() {
            self.text.extend(["</", tag, ">"]);
        }
    }

    /// An element without content. In HTML, only for those that never have any.
    pub(crate) fn leaf(&mut self, tag: &'static str, attributes: &[Attribute<'_>]) {
        self.begin(tag, attributes);
        self.text.push_str("/>");
    }

    /// An element with nothing but text in it.
    pub(crate) fn element(&mut self, tag: &'static str, attributes: &[Attribute<'_>], text: &str) {
        self.open(tag, attributes);
        self.text(text);
        self.close();
    }

    /// Text, escaped.
    pub(crate) fn text(&mut self, text: &str) {
        escape(&mut self.text, text);
    }

    /// What is XML already.
    pub(crate) fn raw(&mut self, xml: &str) {
        self.text.push_str(xml);
    }

    /// A new line, for those who read the source.
    pub(crate) fn line(&mut self) {
        self.text.push('\n');
    }

    /// The document, all elements closed.
    pub(crate) fn finish(mut self) -> String {
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
            self.text.extend([" ", name, "=\""]);
            escape(&mut self.text, &value);
            self.text.push('"');
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
#[derive(Clone, Copy)]
pub(crate) struct Px(pub(crate) f64);

impl Display for Px {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Adding zero takes the sign off a negative zero.
        write!(f, "{}", (self.0 * 10.0).round() / 10.0 + 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_back() {
        let odd = "a<b> & \"c\" 'd' \u{1}\u{ffff}";
        let mut xml = Xml::default();
        xml.open("p", &[("title", &odd)]);
        xml.text(odd);
        let text = xml.finish();
        let document = roxmltree::Document::parse(&text).unwrap();
        let expected = "a<b> & \"c\" 'd' \u{fffd}\u{fffd}";
        assert_eq!(document.root_element().attribute("title"), Some(expected));
        assert_eq!(document.root_element().text(), Some(expected));
    }

    #[test]
    fn lengths_are_short() {
        assert_eq!(format!("{} {} {}", Px(1.26), Px(-0.01), Px(12.0)), "1.3 0 12");
    }
}

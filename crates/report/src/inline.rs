//! Inline marks in paragraphs.

use std::collections::BTreeMap;

use chart::Xml;

/// What a figure or a table is called, such as "Figure 3", by its id.
pub(crate) type Labels<'a> = BTreeMap<&'a str, String>;

/// A text with its marks as elements.
pub(crate) fn inline(text: &str, labels: &Labels<'_>) -> Xml {
    let (mut xml, mut rest) = (Xml::default(), text);
    while let Some(start) = rest.find(['`', '*', '[']) {
        xml.push(Xml::text(&rest[..start]));
        rest = &rest[start..];
        if let Some((code, after)) = enclosed(rest, "`", "`") {
            xml.push(Xml::element("code", &[], code));
            rest = after;
        } else if let Some((bold, after)) = enclosed(rest, "**", "**") {
            xml.push(Xml::element("strong", &[], bold));
            rest = after;
        } else if let Some((text, target, after)) = link(rest) {
            let name = target.strip_prefix('#').and_then(|id| labels.get(id)).filter(|_| text.is_empty());
            xml.push(Xml::element("a", &[("href", &target)], name.map_or(text, |name| name)));
            rest = after;
        } else {
            // All marks begin with one ASCII character.
            xml.push(Xml::text(&rest[..1]));
            rest = &rest[1..];
        }
    }
    xml.push(Xml::text(rest));
    xml
}

/// What stands between `open`, with which `text` begins, and the next `close`; and what follows.
fn enclosed<'a>(text: &'a str, open: &str, close: &str) -> Option<(&'a str, &'a str)> {
    text.strip_prefix(open)?.split_once(close).filter(|(inner, _)| !inner.is_empty())
}

/// Text and target of a link within the page or to a file beside it, and what follows.
fn link(text: &str) -> Option<(&str, &str, &str)> {
    let (label, after) = text.strip_prefix('[')?.split_once("](")?;
    let (target, after) = after.split_once(')')?;
    let inside = !label.contains('[') && !target.is_empty() && !target.contains(':') && !target.starts_with('/');
    inside.then_some((label, target, after))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn html(text: &str) -> String {
        inline(text, &Labels::from([("a", "Figure 1".to_owned())])).to_string()
    }

    #[test]
    fn marks_become_elements() {
        assert_eq!(html("see `a<b` and **x & y**"), "see <code>a&lt;b</code> and <strong>x &amp; y</strong>");
        assert_eq!(html("[](#a), [text](#a)"), "<a href=\"#a\">Figure 1</a>, <a href=\"#a\">text</a>");
    }

    #[test]
    fn what_is_not_closed_stands_for_itself() {
        for text in ["2 * 3 ** 4", "a ` b", "[1, 2] (x)", "[x](https://example.org)", "[x](//y)", "****", "é*"] {
            assert_eq!(html(text), text);
        }
    }
}

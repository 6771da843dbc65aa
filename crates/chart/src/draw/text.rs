//! Text, and how much room it takes. A page does not know the reader's font, so this is an estimate on the wide side.

use crate::Xml;

/// Distance of lines, in sizes of the text.
pub(crate) const LINE: f64 = 1.3;

/// Width of `text` \[px\] in letters of `font` \[px\]. What stands behind a '^' is raised and smaller.
pub(crate) fn width(text: &str, font: f64) -> f64 {
    let (base, power) = text.split_once('^').unwrap_or((text, ""));
    font * (plain(base) + 0.75 * plain(power))
}

fn plain(text: &str) -> f64 {
    let letter = |c| match c {
        'i' | 'j' | 'l' | '.' | ',' | ':' | ';' | '\'' | '|' | '!' | 'I' => 0.3,
        ' ' | 't' | 'f' | 'r' | '(' | ')' | '[' | ']' | '/' | '-' => 0.38,
        'm' | 'w' | 'M' | 'W' | '@' | '%' => 0.92,
        c if c.is_ascii_uppercase() => 0.7,
        c if c.is_ascii() => 0.59,
        _ => 0.75,
    };
    text.chars().map(letter).sum()
}

/// The width of the widest of `texts` \[px\].
pub(super) fn widest<T: AsRef<str>>(texts: impl IntoIterator<Item = T>, font: f64) -> f64 {
    texts.into_iter().map(|text| width(text.as_ref(), font)).fold(0.0, f64::max)
}

/// The words of `text` in lines of at most `room` \[px\], or of one word where that is longer.
pub(super) fn wrap(text: &str, font: f64, room: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if width(line, font) + width(" ", font) + width(word, font) <= room => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.into()),
        }
    }
    lines
}

/// Writes lines below one another, the first with its top at `y`; returns the bottom of the last.
pub(super) fn lines(
    svg: &mut Xml,
    lines: &[String],
    [x, mut y]: [f64; 2],
    font: f64,
    anchor: &str,
    class: &str,
) -> f64 {
    for line in lines {
        svg.label([x, y + font], anchor, class, line);
        y += LINE * font;
    }
    y
}

/// Writes `text` in lines of at most `width` \[px\], the first with its top at `y`; returns the bottom of the last.
pub(crate) fn paragraph(svg: &mut Xml, text: &str, at: [f64; 2], width: f64, font: f64, class: &str) -> f64 {
    lines(svg, &wrap(text, font, width), at, font, "", class)
}

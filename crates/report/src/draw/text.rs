//! How much room text takes. A page does not know the reader's font, so this is an estimate on the wide side.

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

/// The words of `text` in lines of at most `room` \[px\], or of one word where that is longer.
pub(crate) fn wrap(text: &str, font: f64, room: f64) -> Vec<String> {
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

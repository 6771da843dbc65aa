//! Numbers as text, and how much room text takes. A page does not know the reader's font, so this is an estimate on the
//! wide side.

use crate::Xml;

/// Distance of lines, in sizes of the text.
pub(crate) const LINE: f64 = 1.3;
/// Width of a letter, in sizes of the text.
const LETTER: f64 = 0.6;

/// The width of the widest of `texts` in letters of `font` \[px\].
pub(crate) fn widest<T: AsRef<str>>(texts: impl IntoIterator<Item = T>, font: f64) -> f64 {
    texts.into_iter().map(|text| text.as_ref().chars().count()).max().unwrap_or(0) as f64 * LETTER * font
}

/// Writes `text` in lines of at most `room` \[px\], but for longer words, the first with its top at `y`; returns the
/// bottom of the last.
pub(crate) fn paragraph(svg: &mut Xml, text: &str, [x, mut y]: [f64; 2], room: f64, font: f64, class: &str) -> f64 {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if widest([[line, word].join(" ")], font) <= room => line.extend([" ", word]),
            _ => lines.push(word.into()),
        }
    }
    for line in lines {
        svg.label([x, y + font], "", class, &line);
        y += LINE * font;
    }
    y
}

/// `value` with so many significant digits, with an exponent below 0.001 and from a million on; "NaN", "inf" or "-inf" if
/// it is not finite.
pub fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".into();
    }
    // Rounded first: 9.996 with three digits is 10.0, one decade up.
    let scientific = format!("{value:.*e}", digits.max(1) - 1);
    let exponent = scientific.rsplit('e').next().and_then(|e| e.parse::<i32>().ok()).unwrap_or(0);
    if !(-3..6).contains(&exponent) {
        return scientific;
    }
    let decimals = usize::try_from(digits as i32 - 1 - exponent).unwrap_or(0);
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::significant;

    #[test]
    fn numbers_have_the_digits_asked_for() {
        let cases =
            [(0.0, "0"), (9.996, "10.0"), (-0.012345, "-0.0123"), (0.00012345, "1.23e-4"), (123456.0, "123456")];
        for (value, text) in cases {
            assert_eq!(significant(value, 3), text);
        }
        assert_eq!(significant(2.5e7, 3), "2.50e7");
        assert_eq!([f64::NAN, f64::NEG_INFINITY].map(|value| significant(value, 3)), ["NaN", "-inf"]);
    }
}

//! Colours, light and dark, and style sheets.

/// The colours as variables, light and dark. Series have ten that all readers can tell apart, also those who confuse red
/// and green: they were sought by hill climbing for the largest distances between the nearest pairs, seen normally and as
/// in protanopia and deuteranopia (matrices of Machado, Oliveira and Fernandes, "A physiologically-based model for
/// simulation of color vision deficiency", 2009). The nearest pair is 31 apart (CIE 1976 Lab) seen normally, 19 otherwise.
const COLOURS: &str = include_str!("colours.css");
/// The style of drawings in these variables.
const CHART: &str = include_str!("chart.css");

/// The style sheet of a page of its own rules, in the same variables: it follows the reader's choice of light or dark.
pub fn style(page: &str) -> String {
    [COLOURS, page, CHART].concat()
}

/// The style sheet of an SVG file: light colours in place of variables, which not every program knows.
pub(crate) fn file_style() -> String {
    let light = COLOURS.lines().take_while(|line| !line.starts_with("@media"));
    light
        .filter_map(variable)
        .fold(CHART.to_owned(), |style, (name, colour)| style.replace(&format!("var({name})"), colour))
}

/// Name and value of the variable that a line of a style sheet sets.
fn variable(line: &str) -> Option<(&str, &str)> {
    line.trim().strip_suffix(';')?.split_once(':').filter(|(name, _)| name.starts_with("--"))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    /// Relative luminance of "#rrggbb" (WCAG 2.2).
    fn luminance(colour: &str) -> f64 {
        let channel = |i: usize| {
            let c = f64::from(u8::from_str_radix(&colour[i..i + 2], 16).unwrap()) / 255.0;
            if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        };
        0.2126 * channel(1) + 0.7152 * channel(3) + 0.0722 * channel(5)
    }

    fn contrast(a: &str, b: &str) -> f64 {
        let (a, b) = (luminance(a) + 0.05, luminance(b) + 0.05);
        (a / b).max(b / a)
    }

    /// WCAG 2.2: 4.5 for text (1.4.3), 3 for what a drawing needs to be understood (1.4.11).
    #[test]
    fn contrasts_suffice() {
        let themes: Vec<BTreeMap<_, _>> =
            COLOURS.split("@media").map(|theme| theme.lines().filter_map(variable).collect()).collect();
        assert_eq!(themes.len(), 2);
        for (theme, colours) in themes.iter().enumerate() {
            let of = |name: &str| colours[format!("--{name}").as_str()];
            for text in ["ink", "muted", "link"] {
                for ground in ["surface", "page", "faint"] {
                    let c = contrast(of(text), of(ground));
                    assert!(c >= 4.5, "{text} on {ground}, theme {theme}: {c:.2}");
                }
            }
            for ground in ["heat", "low", "high"] {
                let c = contrast(of("ink"), of(ground));
                assert!(c >= 4.5, "ink on {ground}, theme {theme}: {c:.2}");
            }
            let lines = (0..crate::palette::COLOURS).map(|i| format!("s{i}")).chain(["axis".into()]);
            for line in lines {
                let c = contrast(of(&line), of("surface"));
                assert!(c >= 3.0, "{line} on surface, theme {theme}: {c:.2}");
            }
        }
    }
}

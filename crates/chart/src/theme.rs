//! Colours, light and dark, and style sheets.
//!
//! Series: ten colours that all readers can tell apart, also those who confuse red and green. They were sought
//! by hill climbing for the largest distances between the nearest pairs, seen normally and as in protanopia and
//! deuteranopia (matrices of Machado, Oliveira and Fernandes, "A physiologically-based model for simulation of color vision
//! deficiency", 2009). The nearest pair is 31 apart (CIE 1976 Lab) seen normally, 19 otherwise.

/// Name, light and dark value of each colour. A style sheet says `var(--name)`.
const COLOURS: [(&str, &str, &str); 21] = [
    ("page", "#f7f8f9", "#121417"),
    ("surface", "#ffffff", "#1b1e23"),
    ("ink", "#1c2026", "#e8eaed"),
    ("muted", "#59616c", "#a7aeb8"),
    ("axis", "#8a929c", "#7b838e"),
    ("grid", "#dfe3e8", "#363b43"),
    ("faint", "#f0f2f4", "#262a30"),
    ("link", "#0b5cad", "#7db8f0"),
    ("heat", "#5aa3dc", "#2a69a5"),
    ("low", "#5aa3dc", "#2a69a5"),
    ("high", "#e8953f", "#9c5410"),
    ("s0", "#004491", "#0c74bb"),
    ("s1", "#9d2f00", "#d4724b"),
    ("s2", "#4fa270", "#66e1a3"),
    ("s3", "#995380", "#c380a5"),
    ("s4", "#bd8a00", "#ffd066"),
    ("s5", "#1d9bd9", "#8cddff"),
    ("s6", "#162a46", "#faf3f2"),
    ("s7", "#831c32", "#be3762"),
    ("s8", "#8e9648", "#9ba30f"),
    ("s9", "#484dcd", "#938bff"),
];

/// The style of drawings, for a page and for SVG files alike. A page's own style sheet has the variables, too.
const CHART: &str = include_str!("chart.css");
/// The style sheet of a page of its own rules, in the same variables: it follows the reader's choice of light or dark.
pub fn style(page: &str) -> String {
    let variables = |pick: fn(&(&str, &str, &str)) -> String| COLOURS.iter().map(pick).collect::<String>();
    let light = variables(|(name, light, _)| format!("--{name}:{light};"));
    let dark = variables(|(name, _, dark)| format!("--{name}:{dark};"));
    format!(
        ":root{{color-scheme:light dark;{light}}}\n@media (prefers-color-scheme:dark){{:root{{{dark}}}}}\n{page}{CHART}"
    )
}

/// The style sheet of an SVG file: light colours in place of variables, which not every program knows.
pub(crate) fn file_style() -> String {
    let style = COLOURS
        .iter()
        .fold(CHART.to_owned(), |style, (name, light, _)| style.replace(&format!("var(--{name})"), light));
    format!(
        "text{{font-family:system-ui,-apple-system,\"Segoe UI\",Roboto,\"Helvetica Neue\",Arial,sans-serif}}\n{style}"
    )
}

#[cfg(test)]
mod tests {
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
        let find = |name: &str| COLOURS.iter().find(|c| c.0 == name).map(|c| [c.1, c.2]).unwrap();
        for theme in 0..2 {
            let of = |name: &str| find(name)[theme];
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

//! Where an axis has ticks.

use super::text::widest;
use crate::axis::Layout;
use crate::{Px, Scale, Xml, significant};

/// The ticks of an axis.
pub(super) struct Ticks {
    /// Values with their labels; what stands behind a '^' is an exponent.
    pub(super) major: Vec<(f64, String)>,
    /// Values without labels.
    pub(super) minor: Vec<f64>,
}

impl Ticks {
    /// About `count` labelled ticks for an axis between two places.
    pub(super) fn new(scale: Scale, places: [f64; 2], count: usize) -> Self {
        let [low, high] = places;
        match scale {
            Scale::Log if high - low >= 0.5 => logarithmic(low, high, count),
            // Less than half a decade: a decade's ticks are too few.
            _ => linear(scale.value(low), scale.value(high), count),
        }
    }

    /// The longest label \[px\].
    pub(super) fn width(&self, font: f64) -> f64 {
        widest(self.major.iter().map(|(_, label)| label), font)
    }

    /// Lines at the ticks: from `from` to `to` across the axis, which is level or upright.
    pub(super) fn grid(&self, svg: &mut Xml, layout: &Layout, [from, to]: [f64; 2], level: bool) {
        let major = self.major.iter().map(|(value, _)| *value);
        for (values, class) in [(self.minor.clone(), "minor"), (major.collect(), "grid")] {
            let places = values.into_iter().filter_map(|value| layout.at(value));
            let path: String = places
                .map(|at| match level {
                    true => format!("M{} {}V{}", Px(at), Px(from), Px(to)),
                    false => format!("M{} {}H{}", Px(from), Px(at), Px(to)),
                })
                .collect();
            svg.path(class, &path, "");
        }
    }
}

fn linear(low: f64, high: f64, count: usize) -> Ticks {
    let rough = (high - low) / count.max(1) as f64;
    let decade = 10f64.powf(rough.log10().floor());
    // Slack for rounding in the division.
    let mantissa = [1.0, 2.0, 5.0].into_iter().find(|m| rough / decade <= m + 1e-9).unwrap_or(10.0);
    let (step, slack) = (mantissa * decade, 1e-9 * (high - low));
    let multiples = ((low - slack) / step).ceil() as i64..=((high + slack) / step).floor() as i64;
    let decimals = (-(step * (1.0 + 1e-9)).log10().floor()).max(0.0) as usize;
    let plain = decimals <= 4 && low.abs().max(high.abs()) < 1e6;
    let label = |value: f64| match plain {
        true => minus(&format!("{value:.decimals$}")),
        false if value == 0.0 => "0".into(),
        false => {
            let digits = (value.abs() / step).log10().floor().max(0.0) as usize + 2;
            minus(&significant(value, digits)).replace('e', "·10^")
        }
    };
    Ticks {
        major: multiples.map(|i| i as f64 * step + 0.0).map(|value| (value, label(value))).collect(),
        minor: Vec::new(),
    }
}

/// Ticks between two places, which are logarithms to base 10.
fn logarithmic(low: f64, high: f64, count: usize) -> Ticks {
    let slack = 1e-9 * (high - low);
    let (first, last) = ((low - slack).ceil() as i32, (high + slack).floor() as i32);
    let stride = ((high - low) / count.max(1) as f64).ceil().max(1.0) as i32;
    let plain = low >= -3.5 && high <= 4.5;
    let power = |e: i32| match plain {
        true => format!("{}", 10f64.powi(e)),
        false => minus(&format!("10^{e}")),
    };
    let decades = (first..=last).filter(|e| e.rem_euclid(stride) == 0);
    let mut major: Vec<_> = decades.map(|e| (10f64.powi(e), power(e))).collect();
    let within = |value: &f64| (low..=high).contains(&value.log10());
    let between = |digits: &'static [i32]| {
        (first - 1..=last).flat_map(move |e| digits.iter().map(move |d| f64::from(*d) * 10f64.powi(e)))
    };
    // Few decades: their halves and fifths have labels too.
    if high - low < 1.6 && plain {
        let labelled = between(&[2, 5]).filter(within);
        major.extend(labelled.map(|value| (value, significant(value, 1))));
    }
    let minor = match high - low {
        width if width <= 6.0 => between(&[2, 3, 4, 5, 6, 7, 8, 9]).filter(within).collect(),
        _ => (first..=last).map(|e| 10f64.powi(e)).collect(),
    };
    Ticks { major, minor }
}

fn minus(number: &str) -> String {
    number.replace('-', "\u{2212}")
}

/// A tick's label, its exponent raised.
pub(super) fn label(svg: &mut Xml, text: &str, [x, y]: [f64; 2], anchor: &str, font: f64) {
    let (base, power) = text.split_once('^').unwrap_or((text, ""));
    svg.open("text", &[("x", &Px(x)), ("y", &Px(y)), ("text-anchor", &anchor)]);
    svg.text(base);
    if !power.is_empty() {
        svg.element("tspan", &[("dy", &Px(-0.4 * font)), ("font-size", &Px(0.75 * font))], power);
    }
    svg.close();
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(scale: Scale, places: [f64; 2]) -> Vec<String> {
        Ticks::new(scale, places, 5).major.into_iter().map(|(_, label)| label).collect()
    }

    #[test]
    fn linear_ticks_are_round() {
        assert_eq!(labels(Scale::Linear, [-0.03, 0.42]), ["0.0", "0.1", "0.2", "0.3", "0.4"]);
        assert_eq!(labels(Scale::Linear, [-3.0, 3.0]), ["−2", "0", "2"]);
        assert_eq!(labels(Scale::Linear, [0.0, 2e7]), ["0", "5.0·10^6", "1.0·10^7", "1.5·10^7", "2.0·10^7"]);
    }

    #[test]
    fn logarithmic_ticks_are_powers_of_ten() {
        assert_eq!(labels(Scale::Log, [-2.0, 2.2]), ["0.01", "0.1", "1", "10", "100"]);
        assert_eq!(labels(Scale::Log, [-12.3, -0.5]), ["10^−12", "10^−9", "10^−6", "10^−3"]);
        assert_eq!(labels(Scale::Log, [-0.2, 1.1]), ["1", "10", "2", "5"]);
        assert_eq!(labels(Scale::Log, [2f64.log10(), 4f64.log10()]), ["2.0", "2.5", "3.0", "3.5", "4.0"]);
    }
}

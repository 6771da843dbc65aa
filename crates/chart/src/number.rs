//! Numbers as text.

/// How a number is printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NumberFormat {
    /// With so many digits after the decimal point.
    Fixed(usize),
    /// With so many significant digits; with an exponent below 0.001 and from a million on.
    Significant(usize),
}

impl Default for NumberFormat {
    fn default() -> Self {
        Self::Significant(3)
    }
}

impl NumberFormat {
    /// `value` as text; "NaN", "inf" or "-inf" if it is not finite.
    pub fn format(self, value: f64) -> String {
        match self {
            _ if !value.is_finite() => value.to_string(),
            Self::Fixed(decimals) => format!("{value:.decimals$}"),
            Self::Significant(_) if value == 0.0 => "0".into(),
            Self::Significant(digits) => significant(value, digits.max(1)),
        }
    }
}

fn significant(value: f64, digits: usize) -> String {
    // Rounded first: 9.996 with three digits is 10.0, one decade up.
    let scientific = format!("{value:.*e}", digits - 1);
    let exponent = scientific.rsplit('e').next().and_then(|e| e.parse::<i32>().ok()).unwrap_or(0);
    if !(-3..6).contains(&exponent) {
        return scientific;
    }
    let decimals = usize::try_from(digits as i32 - 1 - exponent).unwrap_or(0);
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::NumberFormat::{Fixed, Significant};

    #[test]
    fn numbers_have_the_digits_asked_for() {
        assert_eq!(Fixed(2).format(1.005e1), "10.05");
        let cases =
            [(0.0, "0"), (9.996, "10.0"), (-0.012345, "-0.0123"), (0.00012345, "1.23e-4"), (123456.0, "123456")];
        for (value, text) in cases {
            assert_eq!(Significant(3).format(value), text);
        }
        assert_eq!(Significant(3).format(2.5e7), "2.50e7");
        assert_eq!(Significant(3).format(f64::NAN), "NaN");
        assert_eq!(Fixed(1).format(f64::NEG_INFINITY), "-inf");
    }
}

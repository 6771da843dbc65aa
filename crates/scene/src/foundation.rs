//! Springs to the ground along rods.

use std::ops::Range;

use rod::Foundation;
use toml::Spanned;

use crate::builder::Builder;
use crate::error::{Result, Source};
use crate::format;

/// Lays a part of a rod on springs.
pub(crate) fn add(
    builder: &mut Builder,
    source: &Source,
    entry: &Spanned<format::Foundation>,
    segments: &Range<usize>,
) -> Result<()> {
    let format::Foundation { from, until, across_n_m2, along_n_m2, damping_s } = entry.get_ref();
    if across_n_m2.is_none() && along_n_m2.is_none() {
        return source.wrong(entry.span(), "give `across_n_m2` or `along_n_m2` or both");
    }
    let not_negative = |value: &Option<format::Number>, unit: &str| {
        value.as_ref().map_or(Ok(0.0), |value| source.not_negative(value, unit))
    };
    let springs = Foundation {
        across: not_negative(across_n_m2, "N/m^2")?,
        along: not_negative(along_n_m2, "N/m^2")?,
        damping: not_negative(damping_s, "s")?,
    };
    let fraction = |value: &Option<format::Number>, default: f64| {
        let within = |value| source.number(value, |v| (0.0..=1.0).contains(&v), "0 to 1");
        value.as_ref().map_or(Ok(default), within)
    };
    let (from, until) = (fraction(from, 0.0)?, fraction(until, 1.0)?);
    if until <= from {
        return source.wrong(entry.span(), "`until` must be greater than `from`");
    }
    let lengths: Vec<f64> = segments.clone().map(|i| builder.segment(i).length).collect();
    let whole: f64 = lengths.iter().sum();
    let mut begin = 0.0;
    let mut found = Vec::new();
    for (segment, length) in segments.clone().zip(lengths) {
        let centre = (begin + 0.5 * length) / whole;
        // What lies on the limit of two parts is the second one's.
        if from <= centre && centre < until {
            found.push(segment);
        }
        begin += length;
    }
    match found[..] {
        [first, .., last] => builder.assembly.foundation(first..last + 1, &springs),
        [only] => builder.assembly.foundation(only..only + 1, &springs),
        [] => return source.wrong(entry.span(), "there is no segment's centre between `from` and `until`"),
    };
    Ok(())
}

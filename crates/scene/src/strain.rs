//! From a rod's strain, rest length or tension to the strains with which it is drawn.

use std::ops::RangeInclusive;

use rod::{RodSpec, Stretch};

use crate::error::{Result, Source, short};
use crate::format::{self, Shape};
use crate::hung::ROUNDING;

/// Least and largest strain with which a rod may be drawn.
const STRAINS: RangeInclusive<f64> = -0.5..=1.0;

/// Strain of all segments of a rod as it is drawn, or one each; `spec` has all else.
pub(crate) fn strains(source: &Source, rod: &format::Rod, spec: &RodSpec) -> Result<Vec<f64>> {
    let closing = if spec.closed { (spec.nodes[0] - spec.nodes[spec.nodes.len() - 1]).norm() } else { 0.0 };
    let drawn = spec.nodes.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum::<f64>() + closing;
    let too_short = match rod.shape.get_ref() {
        Shape::Hung(hung) => Some(&hung.length_m).filter(|length| *length.get_ref() < drawn * (1.0 - ROUNDING)),
        _ => None,
    };
    let does_stretch = match spec.stretch {
        Stretch::Physical => true,
        Stretch::Compliance(compliance) => compliance > 0.0 && !matches!(rod.stretch, format::Stretch::Zero),
    };
    const GIVE: &str = "`stretch = \"physical\"` or a compliance";
    if let (Some(length), false) = (too_short, does_stretch) {
        let allowed =
            format!("at least the distance of its ends, {} [m]; a cable that is to stretch needs {GIVE}", short(drawn));
        return source.must_be(length.span(), &allowed);
    }
    let mut given =
        [too_short, rod.rest_length_m.as_ref(), rod.strain.as_ref(), rod.tension_n.as_ref()].into_iter().flatten();
    let Some(key) = given.next() else { return Ok(vec![0.0]) };
    if let Some(second) = given.next() {
        return source.wrong(second.span(), "says a second time how far the rod is stretched; leave one of them out");
    }
    if !does_stretch {
        return source.wrong(key.span(), &format!("the rod does not stretch; give {GIVE}"));
    }
    let strains = if let Some(tension) = &rod.tension_n {
        if spec.stretch != Stretch::Physical {
            return source
                .wrong(tension.span(), "goes with `stretch = \"physical\"`; give `strain` or `rest_length_m`");
        }
        let force = source.finite(tension, "N")?;
        let strain = |i: usize| force / spec.section(i).1.stiffness(&spec.material).stretch;
        (0..spec.radii.len().max(spec.sections.len())).map(strain).collect()
    } else if let Some(strain) = &rod.strain {
        vec![source.finite(strain, "")?]
    } else {
        vec![drawn / source.positive(key, "m")? - 1.0]
    };
    match strains.iter().find(|strain| !STRAINS.contains(strain)) {
        None => Ok(strains),
        Some(&strain) => {
            let (least, most) = (STRAINS.start(), STRAINS.end());
            let allowed = format!("such that its strain is {least} to {most}, and this gives {}", short(strain));
            source.must_be(key.span(), &allowed)
        }
    }
}

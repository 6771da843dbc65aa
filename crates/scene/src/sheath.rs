//! Sheaths: rods that run inside other rods.

use std::ops::Range;

use rod::Sheath;
use toml::Spanned;

use crate::builder::Builder;
use crate::contact::friction;
use crate::error::{Result, Source};
use crate::format;
use crate::probe::add_named;

/// Adds the scene's sheaths to the model; returns their names.
pub(crate) fn sheaths(
    builder: &mut Builder,
    source: &Source,
    entries: &[Spanned<format::Sheath>],
) -> Result<Vec<String>> {
    add_named(source, "sheath", entries, |own| own.name.as_ref(), |entry, _| add(builder, source, entry))
}

fn add(builder: &mut Builder, source: &Source, entry: &Spanned<format::Sheath>) -> Result<()> {
    let format::Sheath { name: _, rod, inside, clearance_m, friction: of_wall } = entry.get_ref();
    let inner = rod_of(builder, source, rod)?;
    let outer = rod_of(builder, source, inside)?;
    let apart = |sheath: &[Range<usize>; 2]| sheath[0].end <= sheath[1].start || sheath[1].end <= sheath[0].start;
    if !apart(&[inner.clone(), outer.clone()]) {
        return source.wrong(inside.span(), "is the rod itself");
    }
    let clearance = source.positive(clearance_m, "m")?;
    let friction = friction(source, of_wall)?;
    let sheath = Sheath { inner, outer, clearance, friction };
    let radius = |i: usize, builder: &mut Builder| builder.segment(i).radius;
    let thin = sheath.outer.clone().map(|i| radius(i, builder)).fold(f64::INFINITY, f64::min);
    let thick = sheath.inner.clone().map(|i| radius(i, builder)).fold(0.0, f64::max);
    if thick >= thin {
        let message =
            format!("has the radius {thick} m, and `{}` around it {thin} m: it must be thinner", inside.get_ref());
        return source.wrong(rod.span(), &message);
    }
    if thick + clearance >= thin {
        let most = ((thin - thick) * 1e9).round() / 1e9;
        let message = format!("less than {most} m, the outer rod's radius less the inner one's");
        return source.must_be(clearance_m.span(), &message);
    }
    let sheaths = &mut builder.assembly.model_mut().contacts.sheaths;
    sheaths.push(sheath);
    let is_inside_itself = builder.assembly.model_mut().contacts.sheathed().iter().any(|pair| !apart(pair));
    if is_inside_itself {
        return source.wrong(inside.span(), "is inside of the rod that is to be inside of it");
    }
    Ok(())
}

/// The segments of a rod that may be in a sheath, or be one.
fn rod_of(builder: &mut Builder, source: &Source, name: &Spanned<String>) -> Result<Range<usize>> {
    let rod = builder.rod(source, name)?;
    if rod.closed {
        return source.wrong(name.span(), "is closed, but rods in sheaths, and sheaths, have ends");
    }
    let segments = rod.segments.clone();
    if builder.assembly.model_mut().can_break(&segments) {
        return source.wrong(name.span(), "must be a rod that does not break, without `strength`");
    }
    Ok(segments)
}

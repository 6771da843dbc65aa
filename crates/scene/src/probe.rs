//! Probes: places of rods where quantities are read.

use std::ops::Range;

use rod::{Probe, Quantity};
use toml::Spanned;

use crate::builder::{Builder, check_fraction};
use crate::error::{Result, Source};
use crate::format::{self, Clamp};
use crate::shape::number_or;

/// The scene's probes.
pub(crate) fn probes(builder: &mut Builder, source: &Source, entries: &[Spanned<format::Probe>]) -> Result<Vec<Probe>> {
    let mut probes: Vec<Probe> = Vec::with_capacity(entries.len());
    for (k, entry) in entries.iter().enumerate() {
        let probe = probe(builder, source, k, entry)?;
        if probes.iter().any(|other| other.name == probe.name) {
            let span = entry.get_ref().name.as_ref().map_or(entry.span(), Spanned::span);
            return source.must_be(span, "a name that no other probe has");
        }
        probes.push(probe);
    }
    Ok(probes)
}

fn probe(builder: &mut Builder, source: &Source, k: usize, entry: &Spanned<format::Probe>) -> Result<Probe> {
    let format::Probe { name, rod, at, segment, fraction, quantities } = entry.get_ref();
    let name = match name {
        None => format!("probe-{k}"),
        Some(name) if is_plain(name.get_ref()) => name.get_ref().clone(),
        Some(name) => return source.must_be(name.span(), "a name without commas, quotes and line breaks"),
    };
    if builder.is_body(rod.get_ref()) {
        let why = "is a rigid body, but a probe reads a place of a rod: name a rod that is joined to it";
        return source.wrong(rod.span(), &format!("`{}` {why}", rod.get_ref()));
    }
    let rod = builder.rod(source, rod)?;
    let (segments, closed) = (rod.segments.clone(), rod.closed);
    let count = builder.refinement.count(&segments);
    let (index, along) = match (at, segment) {
        (Some(at), None) if closed => return source.wrong(at.span(), "a closed rod has no ends; give `segment`"),
        (Some(at), None) => {
            if let Some(fraction) = fraction {
                return source.wrong(fraction.span(), "goes with `segment`, not with `at`");
            }
            match at.get_ref() {
                Clamp::StartFace => (0, 0.0),
                Clamp::StartSegment => (0, 0.5),
                Clamp::EndSegment => (count - 1, 0.5),
                Clamp::EndFace => (count - 1, 1.0),
            }
        }
        (None, Some(segment)) => {
            (source.index(segment, count)?, number_or(fraction, 0.5, |v| check_fraction(source, v))?)
        }
        _ => return source.wrong(entry.span(), "give either `at` or `segment`"),
    };
    let (segment, along) = builder.refinement.place(&segments, index, along);
    let offset = (along - 0.5) * builder.segment(segment).length;
    let probe = Probe { name, segment, offset, quantities: Vec::new() };
    let (joint, held) = (probe.joint(builder.assembly.model_mut()), probe.held(builder.assembly.model_mut()));
    let mut found = Vec::new();
    for name in quantities.get_ref() {
        let Ok(quantity) = name.get_ref().parse::<Quantity>() else {
            return source.must_be(name.span(), &format!("one of {}", Quantity::ALL.map(Quantity::name).join(", ")));
        };
        if found.contains(&quantity) {
            return source.wrong(name.span(), "it is read once already");
        }
        if quantity.is_of_joint() && joint.is_none() {
            return source.wrong(name.span(), "the segment is joined to nothing");
        }
        if quantity == Quantity::Reaction && held.is_none() {
            return source.wrong(name.span(), "nothing holds the rod there");
        }
        found.push(quantity);
    }
    if found.is_empty() {
        return source.must_be(quantities.span(), "a list of at least one quantity");
    }
    Ok(Probe { quantities: found, ..probe })
}

/// Adds entries of a kind, one after the other, each with its name, or `kind-k`; returns the names.
///
/// # Errors
/// If a name is not plain, or another entry has it, and those of `add`.
pub(crate) fn add_named<E>(
    source: &Source,
    kind: &str,
    entries: &[Spanned<E>],
    name_of: impl Fn(&E) -> Option<&Spanned<String>>,
    mut add: impl FnMut(&Spanned<E>, &str) -> Result<()>,
) -> Result<Vec<String>> {
    let mut names: Vec<String> = Vec::with_capacity(entries.len());
    for entry in entries {
        let name = unique_name(source, (name_of(entry.get_ref()), entry.span()), (kind, &names))?;
        add(entry, &name)?;
        names.push(name);
    }
    Ok(names)
}

/// An entry's name, or `kind-k`; `names` are those of the entries before.
///
/// # Errors
/// If it is not plain, or another has it.
fn unique_name(
    source: &Source,
    (name, entry): (Option<&Spanned<String>>, Range<usize>),
    (kind, names): (&str, &[String]),
) -> Result<String> {
    let own = match name {
        None => format!("{kind}-{}", names.len()),
        Some(name) if is_plain(name.get_ref()) => name.get_ref().clone(),
        Some(name) => return source.must_be(name.span(), "a name without commas, quotes and line breaks"),
    };
    if names.contains(&own) {
        return source.must_be(name.map_or(entry, Spanned::span), &format!("a name that no other {kind} has"));
    }
    Ok(own)
}

/// Whether a name can stand in a table's header.
fn is_plain(name: &str) -> bool {
    !name.is_empty() && !name.contains([',', '"', '\'']) && !name.contains(char::is_control)
}

//! From an entry of `[[copies]]` to copies of rods with all that belongs to them.

use std::ops::Range;

use nalgebra::{UnitQuaternion, Vector3};
use rod::{Body, Pose};
use toml::Spanned;

use crate::builder::{Builder, known_names};
use crate::error::{Result, Source};
use crate::{MAX_SEGMENTS, RodInfo, format};

/// Adds the copies of an entry.
pub(crate) fn add(builder: &mut Builder, source: &Source, entry: &Spanned<format::Copies>) -> Result<()> {
    let own = entry.get_ref();
    let originals = originals(builder, source, own)?;
    let ranges: Vec<_> = originals.iter().map(|&rod| builder.rods[rod].segments.clone()).collect();
    let is_copied = |segment: usize| ranges.iter().any(|range| range.contains(&segment));
    if builder.motors.iter().any(|&[a, b]| is_copied(a) != is_copied(b)) {
        return source
            .wrong(own.rods.span(), "a motor turns one of these rods against another one; name that rod, too");
    }
    let (each, before): (usize, _) = (ranges.iter().map(|segments| segments.len()).sum(), builder.segments());
    let places = places(source, entry, &|copies| {
        let total = each.saturating_mul(copies).saturating_add(before);
        if total > MAX_SEGMENTS {
            let message = format!("with these copies the scene has {total} segments, but {MAX_SEGMENTS} are the most");
            return source.wrong(entry.span(), &message);
        }
        Ok(())
    })?;
    let joints = builder.assembly.model_mut().joints.len();
    let copied = builder.assembly.copies(&ranges, &places);
    copy_own_rests(builder, joints, &ranges, &copied);
    // Motors of copies turn two rods against each other, too.
    for motor in builder.motors.clone().into_iter().filter(|[a, _]| is_copied(*a)) {
        let place = |segment: usize| ranges.iter().position(|range| range.contains(&segment)).unwrap_or_default();
        for copy in copied.chunks(ranges.len()) {
            builder.motors.push(motor.map(|i| copy[place(i)].start + i - ranges[place(i)].start));
        }
    }
    let mut segments = copied.into_iter();
    for copy in 1..=places.len() {
        let first = builder.rods.len();
        for (&original, segments) in originals.iter().zip(&mut segments) {
            let RodInfo { name, closed, .. } = &builder.rods[original];
            let own_name = match name.split_once('/') {
                Some((head, tail)) => format!("{head}-{copy}/{tail}"),
                None => format!("{name}-{copy}"),
            };
            if builder.has(&own_name) {
                let message = format!("copy {copy} of `{name}` is called `{own_name}`, as another rod is");
                return source.wrong(own.rods.span(), &message);
            }
            let rod = RodInfo { name: own_name, segments, closed: *closed };
            let parent = builder.parents[original].and_then(|parent| originals.binary_search(&parent).ok());
            builder.register(rod, parent.map(|k| first + k));
        }
    }
    Ok(())
}

/// Joints that are copied from ones with a rest of their own have one, too. Those of copies begin at index `first`.
fn copy_own_rests(builder: &mut Builder, first: usize, ranges: &[Range<usize>], copied: &[Range<usize>]) {
    let joints = &builder.assembly.model_mut().joints;
    for own in builder.own_rests.clone() {
        let [a, b] = [joints[own].a, joints[own].b];
        for copy in copied.chunks(ranges.len()) {
            let moved = |body: Body| match body {
                Body::Segment(i) => {
                    let k = ranges.iter().position(|range| range.contains(&i))?;
                    Some(Body::Segment(copy[k].start + i - ranges[k].start))
                }
                Body::Anchor(_) => None,
            };
            let (Some(a), Some(b)) = (moved(a), moved(b)) else { continue };
            builder.own_rests.extend((first..joints.len()).filter(|&k| (joints[k].a, joints[k].b) == (a, b)));
        }
    }
}

/// Indices of the rods that the entry names, with what grows on them, in their order: a rod, or the trunk of a tree, the
/// strands of a rod or the ropes of a net by the name of the whole.
fn originals(builder: &Builder, source: &Source, own: &format::Copies) -> Result<Vec<usize>> {
    let mut is_copied = vec![false; builder.rods.len()];
    for name in own.rods.get_ref() {
        let inside = format!("{}/", name.get_ref());
        let mut found = false;
        for (rod, is_copied) in builder.rods.iter().zip(&mut is_copied) {
            if rod.name == *name.get_ref() || rod.name.starts_with(&inside) {
                (found, *is_copied) = (true, true);
            }
        }
        if !found {
            return source
                .must_be(name.span(), &known_names("the name of a rod, a net or a body", builder.rods.iter()));
        }
    }
    // A branch comes after what it grows on.
    for rod in 0..is_copied.len() {
        is_copied[rod] |= builder.parents[rod].is_some_and(|parent| is_copied[parent]);
    }
    let originals: Vec<usize> = (0..is_copied.len()).filter(|&rod| is_copied[rod]).collect();
    for &rod in &originals {
        if let Some(parent) = builder.parents[rod].filter(|&parent| !is_copied[parent]) {
            let [branch, parent] = [rod, parent].map(|rod| &builder.rods[rod].name);
            return source.wrong(own.rods.span(), &format!("`{branch}` grows on `{parent}`; name that rod, too"));
        }
    }
    match originals.is_empty() {
        true => source.must_be(own.rods.span(), "at least one name of a rod"),
        false => Ok(originals),
    }
}

/// Where the copies are, relative to their originals; `has_room` says whether there may be so many.
fn places(
    source: &Source,
    entry: &Spanned<format::Copies>,
    has_room: &dyn Fn(usize) -> Result<()>,
) -> Result<Vec<Pose>> {
    let format::Copies { shifts_m, turns_deg, about_m, count, spacing_m, .. } = entry.get_ref();
    let lists = [shifts_m, turns_deg].into_iter().flatten().map(|list| (list.span(), list.get_ref().len()));
    let lists: Vec<_> = lists.collect();
    if let (Some(about), None) = (about_m, turns_deg) {
        return source.wrong(about.span(), "goes with `turns_deg`");
    }
    match (count, spacing_m) {
        (Some(_), Some(_)) if !lists.is_empty() => {
            return source.wrong(lists[0].0.clone(), "does not go with `count`; leave one of them out");
        }
        (Some(count), Some(spacing)) => return grid(source, count, spacing, has_room),
        (Some(count), None) => return source.wrong(count.span(), "goes with `spacing_m`"),
        (None, Some(spacing)) => return source.wrong(spacing.span(), "goes with `count`"),
        (None, None) => {}
    }
    let Some(&(_, copies)) = lists.first() else {
        return source.wrong(entry.span(), "give `shifts_m`, `turns_deg` or both, or `count` and `spacing_m`");
    };
    if let Some((span, found)) = lists.into_iter().find(|&(_, found)| found != copies) {
        return source.wrong(span, &format!("has {found} entries, but `shifts_m` has {copies}"));
    }
    has_room(copies)?;
    let about = about_m.as_ref().map_or(Ok(Vector3::zeros()), |key| source.vector(key, "m"))?;
    let vector = |list: &Option<Spanned<Vec<format::Vector>>>, k: usize, unit| match list {
        Some(list) => source.vector(&list.get_ref()[k], unit),
        None => Ok(Vector3::zeros()),
    };
    let place = |k: usize| {
        let shift = vector(shifts_m, k, "m")?;
        let turn = vector(turns_deg, k, "degrees")?.map(f64::to_radians);
        let orientation = UnitQuaternion::from_scaled_axis(turn);
        Ok(Pose { position: about - orientation * about + shift, orientation })
    };
    (0..copies).map(place).collect()
}

/// The places of a grid but the first, where the originals are; x runs fastest.
fn grid(
    source: &Source,
    count: &Spanned<format::List<format::Count, 3>>,
    spacing: &format::Vector,
    has_room: &dyn Fn(usize) -> Result<()>,
) -> Result<Vec<Pose>> {
    let mut counts = [0; 3];
    for (own, key) in counts.iter_mut().zip(&count.get_ref().0) {
        *own = source.count(key, 1, MAX_SEGMENTS)?;
    }
    let [x, y, z] = counts;
    let all = x.saturating_mul(y).saturating_mul(z);
    has_room(all - 1)?;
    let spacing = source.vector(spacing, "m")?;
    let place = |k: usize| {
        let cell = [k % x, k / x % y, k / x / y].map(|k| k as f64);
        Pose { position: Vector3::from(cell).component_mul(&spacing), orientation: UnitQuaternion::identity() }
    };
    Ok((1..all).map(place).collect())
}

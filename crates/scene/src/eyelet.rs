//! Eyelets: places where a rod runs through something.

use nalgebra::{UnitQuaternion, Vector3};
use rod::{Body, Driven, Feed, Pose, SlidingJoint};
use toml::Spanned;

use crate::builder::{Builder, Spot};
use crate::error::{Result, Source};
use crate::format;
use crate::motion::{Prepared, ascending, one_a_time};
use crate::probe::add_named;
use crate::shape::number_or;

/// Adds the scene's eyelets to the model; returns their names.
pub(crate) fn eyelets(
    builder: &mut Builder,
    source: &Source,
    entries: &[Spanned<format::Eyelet>],
) -> Result<Vec<String>> {
    add_named(source, "eyelet", entries, |own| own.name.as_ref(), |entry, _| add(builder, source, entry))
}

/// An eyelet is where its rod is at the start.
fn add(builder: &mut Builder, source: &Source, entry: &Spanned<format::Eyelet>) -> Result<()> {
    let format::Eyelet { name: _, at, on, motion, friction, feed: _ } = entry.get_ref();
    let Spot::Rod(segment, fraction) = builder.spot(source, at)? else {
        return source.wrong(at.span(), "must name a `rod` that runs through the eyelet, not a `body`");
    };
    let rod = builder.segment(segment).rod;
    let rod = &builder.rods[rod];
    if rod.closed {
        return source.wrong(at.span(), &format!("`{}` is closed, but rods in eyelets have ends", rod.name));
    }
    let segments = rod.segments.clone();
    if builder.assembly.model_mut().can_break(&segments) {
        return source.wrong(at.span(), "must be on a rod that does not break, without `strength`");
    }
    let friction = number_or(friction, 0.0, |v| source.not_negative(v, ""))?;
    let lengths: Vec<f64> = segments.clone().map(|i| builder.segment(i).length).collect();
    let before: f64 = lengths.iter().take(segment - segments.start).sum();
    let start = before + fraction * lengths[segment - segments.start];
    let mut joint =
        SlidingJoint { segments, holder: Body::Segment(segment), place: Vector3::zeros(), start, friction, feed: None };
    let state = builder.assembly.state_mut().clone();
    let point = joint.point(builder.assembly.model_mut(), &state, start);
    match on {
        None => {
            let pose = Pose { position: point, orientation: UnitQuaternion::identity() };
            let model = builder.assembly.model_mut();
            joint.holder = Body::Anchor(model.anchors.len());
            model.anchors.push(pose);
            if let Some(entry) = motion {
                let span = entry.get_ref().at.as_ref().map(Spanned::span);
                let span = span.or(entry.get_ref().segment.as_ref().map(Spanned::span)).or(entry.get_ref().of_grips());
                if let Some(span) = span {
                    return source.wrong(span, "goes with grips of rods, not with an eyelet");
                }
                let motion = Prepared::new(source, entry)?.motion(source, entry, &pose)?;
                builder.assembly.model_mut().motions.push(Driven::new(joint.holder, motion));
            }
        }
        Some(on) => {
            if let Some(motion) = motion {
                return source.wrong(motion.span(), "does not go with `on`; leave one of them out");
            }
            let holder = match builder.spot(source, on)? {
                Spot::Body(body, None) | Spot::Rod(body, _) => body,
                Spot::Body(..) => return source.wrong(on.span(), "the eyelet is where the rod is; leave `at_m` out"),
            };
            if joint.segments.contains(&holder) {
                return source.wrong(on.span(), "is the rod that runs through the eyelet");
            }
            joint.holder = Body::Segment(holder);
            joint.place = state.orientations[holder].inverse() * (point - state.positions[holder]);
        }
    }
    builder.assembly.model_mut().sliding_joints.push(joint);
    Ok(())
}

/// Lets eyelets drive their rods; once everything is joined.
pub(crate) fn feeds(builder: &mut Builder, source: &Source, entries: &[Spanned<format::Eyelet>]) -> Result<()> {
    for (k, entry) in entries.iter().enumerate() {
        let format::Eyelet { at, friction, feed, .. } = entry.get_ref();
        let Some(entry) = feed else { continue };
        if let Some(friction) = friction {
            return source
                .wrong(friction.span(), "does not go with `feed`; the feed's `max_force_n` says how much it grips");
        }
        let feed = drive(source, entry)?;
        let model = builder.assembly.model_mut();
        let [least, most] = feed.lengths;
        model.sliding_joints[k].feed = Some(feed);
        let joint = &model.sliding_joints[k];
        let [from, to] = joint.range(model);
        let length = joint.centreline(model).length();
        if !(least..=most).contains(&(length - joint.start)) {
            let outside = rounded(length - joint.start);
            let outside =
                format!("leaves {outside} m of the rod beyond the eyelet, but `feed` allows {least} to {most} m");
            return source.wrong(at.span(), &outside);
        }
        if !(from..=to).contains(&joint.start) {
            let to = rounded(to);
            let reach = format!(
                "must be at most {to} m along the rod: what is joined to others stays out of the store, and the last segment"
            );
            return source.wrong(at.span(), &reach);
        }
        if !joint.has_store() {
            continue;
        }
        if joint.has_held_segments(model) {
            return source.wrong(
                entry.span(),
                "goes with a rod that has no held segments; hold its faces, or set `store = false`",
            );
        }
        if joint.has_laws(model) {
            let which = "goes with an elastic rod, without `yield`, `strand_friction`, `relaxation` and `moment_table`; or set `store = false`";
            return source.wrong(entry.span(), which);
        }
        if joint.is_behind_another(model) {
            return source.wrong(at.span(), "must be before all other eyelets of a rod that is stored");
        }
    }
    Ok(())
}

/// A length without what rounding has made of its last digits [m].
fn rounded(length: f64) -> f64 {
    (length * 1e9).round() / 1e9
}

/// The feed of an entry.
fn drive(source: &Source, entry: &Spanned<format::Feed>) -> Result<Feed> {
    let format::Feed { speed_m_s, times_s, speeds_m_s, max_force_n, store, min_length_m, max_length_m } =
        entry.get_ref();
    let speeds = match (speed_m_s, times_s, speeds_m_s) {
        (Some(speed), None, None) => vec![[0.0, source.finite(speed, "m/s")?]],
        (None, Some(times), Some(speeds)) => {
            let seconds = ascending(source, times)?;
            one_a_time(source, speeds, seconds.len())?;
            let speed = |(time, value): (f64, &format::Number)| Ok([time, source.finite(value, "m/s")?]);
            seconds.into_iter().zip(speeds.get_ref()).map(speed).collect::<Result<Vec<_>>>()?
        }
        _ => return source.wrong(entry.span(), "must have `speed_m_s`, or `times_s` and `speeds_m_s`"),
    };
    let least = number_or(min_length_m, 0.0, |v| source.not_negative(v, "m"))?;
    let most = number_or(max_length_m, f64::INFINITY, |v| source.not_negative(v, "m"))?;
    if most < least {
        return source.wrong(entry.span(), "has a `min_length_m` above its `max_length_m`");
    }
    let max_force = number_or(max_force_n, f64::INFINITY, |v| source.not_negative(v, "N"))?;
    Ok(Feed { speeds, max_force, is_stored: store.unwrap_or(true), lengths: [least, most] })
}

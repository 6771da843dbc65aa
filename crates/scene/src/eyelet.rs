//! Eyelets: places where a rod runs through something.

use nalgebra::UnitQuaternion;
use rod::{Body, Driven, Pose, SlidingJoint};
use toml::Spanned;

use crate::builder::{Builder, Spot};
use crate::error::{Result, Source};
use crate::format;
use crate::motion::Prepared;
use crate::probe::is_plain;
use crate::shape::number_or;

/// Adds the scene's eyelets to the model; returns their names.
pub(crate) fn eyelets(
    builder: &mut Builder,
    source: &Source,
    entries: &[Spanned<format::Eyelet>],
) -> Result<Vec<String>> {
    let mut names: Vec<String> = Vec::with_capacity(entries.len());
    for (k, entry) in entries.iter().enumerate() {
        let name = match &entry.get_ref().name {
            None => format!("eyelet-{k}"),
            Some(name) if is_plain(name.get_ref()) => name.get_ref().clone(),
            Some(name) => return source.must_be(name.span(), "a name without commas, quotes and line breaks"),
        };
        if names.contains(&name) {
            let span = entry.get_ref().name.as_ref().map_or(entry.span(), Spanned::span);
            return source.must_be(span, "a name that no other eyelet has");
        }
        add(builder, source, entry)?;
        names.push(name);
    }
    Ok(names)
}

/// An eyelet is where its rod is at the start.
fn add(builder: &mut Builder, source: &Source, entry: &Spanned<format::Eyelet>) -> Result<()> {
    let format::Eyelet { name: _, at, on, motion, friction } = entry.get_ref();
    let Spot::Rod(segment, fraction) = builder.spot(source, at)? else {
        return source.wrong(at.span(), "must name a `rod` that runs through the eyelet, not a `body`");
    };
    let rod = builder.segment(segment).rod;
    let rod = &builder.rods[rod];
    if rod.closed {
        return source.wrong(at.span(), &format!("`{}` is closed, but rods in eyelets have ends", rod.name));
    }
    let segments = rod.segments.clone();
    let friction = number_or(friction, 0.0, |v| source.not_negative(v, ""))?;
    let lengths: Vec<f64> = segments.clone().map(|i| builder.segment(i).length).collect();
    let before: f64 = lengths.iter().take(segment - segments.start).sum();
    let start = before + fraction * lengths[segment - segments.start];
    let mut joint =
        SlidingJoint { segments, holder: Body::Segment(segment), place: nalgebra::Vector3::zeros(), start, friction };
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

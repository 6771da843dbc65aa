//! What holds a rod: clamps, fixed segments, grips, and the motions that drive them.

mod reach;

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{UnitQuaternion, Vector3};
use rod::{Body, Driven, Pose, Springs};
use toml::Spanned;

use crate::builder::Builder;
use crate::error::{Result, Source};
use crate::format::{self, Clamp, Hold};
use crate::motion::Prepared;

/// From when until when [s] something is held that has no times.
const ALWAYS: (f64, f64) = (0.0, f64::INFINITY);

/// What holds one rod.
pub(crate) struct Grips {
    segments: Range<usize>,
    /// End faces that have an anchor.
    faces: Vec<Face>,
    /// What `clamp` and `fixed_segments` hold, for the whole run.
    clamped: Vec<Body>,
    /// Motions of the model, and grips with times.
    owners: Vec<Owner>,
}

/// An end face that something can hold.
struct Face {
    clamp: Clamp,
    anchor: usize,
    joint: usize,
    /// Whether an entry without times holds it, and whether one has said how.
    is_held: bool,
    is_shaped: bool,
    /// Whether springs hold it in all directions.
    yields: bool,
}

/// What an entry holds and for how long.
struct Owner {
    body: Body,
    /// Index of its motion in the model.
    motion: usize,
    from: f64,
    until: f64,
    /// The entry's place in the text.
    entry: Range<usize>,
}

impl Owner {
    fn is_timed(&self) -> bool {
        self.from > 0.0 || self.until < f64::INFINITY
    }
}

impl Grips {
    /// Of a rod that nothing holds yet.
    pub(crate) fn new(segments: &Range<usize>) -> Self {
        Self { segments: segments.clone(), faces: Vec::new(), clamped: Vec::new(), owners: Vec::new() }
    }

    /// Holds an end for the whole run.
    pub(crate) fn clamp(&mut self, builder: &mut Builder, clamp: Clamp) {
        let bodies = self.end(builder, clamp);
        self.close(builder, &bodies);
        self.clamped.extend(bodies);
    }

    /// Fixes a segment of the file for the whole run.
    pub(crate) fn fix(&mut self, builder: &mut Builder, index: usize) {
        let bodies = self.parts(builder, index);
        self.close(builder, &bodies);
        self.clamped.extend(bodies);
    }

    /// What can be held of an end: the parts of a segment, or an anchor with a joint to the face.
    fn end(&mut self, builder: &mut Builder, clamp: Clamp) -> Vec<Body> {
        match clamp {
            Clamp::StartSegment => self.parts(builder, 0),
            Clamp::EndSegment => self.parts(builder, builder.refinement.count(&self.segments) - 1),
            Clamp::StartFace | Clamp::EndFace => vec![Body::Anchor(self.face(builder, clamp).anchor)],
        }
    }

    /// An end face, with an anchor that holds it.
    fn face(&mut self, builder: &mut Builder, clamp: Clamp) -> &mut Face {
        let known = self.faces.iter().position(|face| face.clamp == clamp);
        let place = known.unwrap_or_else(|| {
            match clamp {
                Clamp::StartFace => builder.assembly.clamp_start(&self.segments),
                _ => builder.assembly.clamp_end(&self.segments),
            };
            let model = builder.assembly.model_mut();
            let (anchor, joint) = (model.anchors.len() - 1, model.joints.len() - 1);
            self.faces.push(Face { clamp, anchor, joint, is_held: false, is_shaped: false, yields: false });
            self.faces.len() - 1
        });
        &mut self.faces[place]
    }

    /// Parts of a segment of the file.
    fn parts(&self, builder: &Builder, index: usize) -> Vec<Body> {
        builder.refinement.parts(&self.segments, index).map(Body::Segment).collect()
    }

    /// What an entry names: an end, or a segment.
    fn named(
        &mut self,
        builder: &mut Builder,
        source: &Source,
        entry: Range<usize>,
        (at, segment): (&Option<Spanned<Clamp>>, &Option<format::Count>),
        closed: bool,
    ) -> Result<Vec<Body>> {
        match (at, segment) {
            (Some(at), None) if closed => source.wrong(at.span(), "a closed rod has no ends; give `segment`"),
            (Some(at), None) => Ok(self.end(builder, *at.get_ref())),
            (None, Some(segment)) => {
                let index = source.index(segment, builder.refinement.count(&self.segments))?;
                Ok(self.parts(builder, index))
            }
            _ => source.wrong(entry, "give either `at` or `segment`"),
        }
    }

    /// Holds a place as an entry of `[[rods.grips]]` says: without times for the whole run, or as long as its motion does.
    pub(crate) fn hold(
        &mut self,
        builder: &mut Builder,
        source: &Source,
        entry: &Spanned<format::Grip>,
        closed: bool,
    ) -> Result<()> {
        let own = entry.get_ref();
        let bodies = self.named(builder, source, entry.span(), (&own.at, &own.segment), closed)?;
        self.shape(builder, source, entry)?;
        let times = times(source, &own.from_s, &own.until_s)?;
        let always = "another entry, `clamp` or `fixed_segments` holds this place already";
        let is_held = |face: &Face| face.is_held && bodies.contains(&Body::Anchor(face.anchor));
        if times != ALWAYS {
            if self.faces.iter().any(is_held) {
                return source.wrong(entry.span(), always);
            }
            for body in bodies {
                let motion = Arc::new(rod::Motion::resting(&pose(builder, body)));
                let driven = Driven { moves_along: true, ..Driven::new(body, motion) };
                self.own(builder, source, entry.span(), driven.between(times.0, times.1))?;
            }
            return Ok(());
        }
        let is_same = |face: &&mut Face| bodies.contains(&Body::Anchor(face.anchor));
        let was_held = self.faces.iter_mut().find(is_same).map(|face| std::mem::replace(&mut face.is_held, true));
        let is_known = |body: &Body| self.clamped.contains(body) || self.owners.iter().any(|other| other.body == *body);
        if was_held == Some(true) || bodies.iter().any(is_known) {
            return source.wrong(entry.span(), always);
        }
        self.close(builder, &bodies);
        self.clamped.extend(bodies.into_iter().filter(|body| matches!(body, Body::Segment(_))));
        Ok(())
    }

    /// Makes the joint of an end face what an entry says: a ball joint, a hinge, springs.
    fn shape(&mut self, builder: &mut Builder, source: &Source, entry: &Spanned<format::Grip>) -> Result<()> {
        let format::Grip { at, joint, axis, stiffness_n_m, stiffness_n_m_rad, turn_deg, .. } = entry.get_ref();
        let hold = joint.as_ref().map_or(Hold::Rigid, |joint| *joint.get_ref());
        let turn = turn_deg.as_ref().map(|turn| turn_of(source, turn, entry.get_ref(), hold)).transpose()?;
        if let (Some(axis), true) = (axis, hold != Hold::Hinge) {
            return source.wrong(axis.span(), "goes with `joint = \"hinge\"`");
        }
        let spans = [stiffness_n_m, stiffness_n_m_rad].into_iter().flatten().map(Spanned::span);
        let Some(span) = joint.iter().map(Spanned::span).chain(spans).next() else { return Ok(()) };
        let face = match at.as_ref().map(|at| *at.get_ref()) {
            Some(clamp @ (Clamp::StartFace | Clamp::EndFace)) => self.face(builder, clamp),
            _ => return source.wrong(span, "goes with end faces: a segment that is fixed does not yield"),
        };
        if std::mem::replace(&mut face.is_shaped, true) {
            return source.wrong(entry.span(), "another entry says how this place is held");
        }
        let mut springs = Springs {
            force: stiffness(source, stiffness_n_m, hold, ["[across, along]", "[along d1, along d2, along d3]"])?,
            moment: stiffness(source, stiffness_n_m_rad, hold, ["[bend, twist]", "[about d1, about d2, twist]"])?,
        };
        if let (Some(list), Hold::Ball) = (stiffness_n_m_rad, hold) {
            return source.wrong(list.span(), "a ball joint turns freely; leave it out");
        }
        face.yields = springs.force.iter().all(|stiffness| stiffness.is_finite());
        let (joint, anchor) = (face.joint, face.anchor);
        let is_stiff = |(turn, stiffness): (&f64, &f64)| *turn != 0.0 && stiffness.is_infinite();
        if let Some(turn) = turn_deg.as_ref().filter(|turn| turn.get_ref().0.iter().zip(&springs.moment).any(is_stiff))
        {
            return source
                .wrong(turn.span(), "goes with a finite `stiffness_n_m_rad` about its axes: else the face would jump");
        }
        let axis = axis.as_ref().map(|axis| source.direction(axis)).transpose()?;
        let model = builder.assembly.model_mut();
        match hold {
            Hold::Rigid => {}
            Hold::Ball => model.pin(joint),
            Hold::Hinge => {
                let own = model.anchors[anchor].orientation * Vector3::z();
                let axis = axis.unwrap_or(own);
                model.hinge(joint, &axis);
                let [across, _, along] = springs.force;
                let sine = axis.cross(&own).norm() / axis.norm();
                if across != along && sine > 1.0 - 1e-9 {
                    // The anchor's d3 is the hinge's axis; its d1 becomes that of the rod.
                    model.turn_hinge(joint, &own);
                    springs.force = [along, across, across];
                } else if let (Some(list), true) = (stiffness_n_m, across != along && sine > 1e-6) {
                    let message = "behind a hinge at an angle to the rod springs across and along it must be the same";
                    return source.wrong(list.span(), message);
                }
            }
        }
        model.soften(joint, &springs);
        if let Some(turn) = turn {
            model.anchors[anchor].orientation *= turn;
        }
        Ok(())
    }

    /// Lets an entry's motion drive what it names, which it holds, too.
    pub(crate) fn drive(
        &mut self,
        builder: &mut Builder,
        source: &Source,
        (entry, prepared): (&Spanned<format::Motion>, &Prepared),
        closed: bool,
    ) -> Result<()> {
        let own = entry.get_ref();
        let bodies = self.named(builder, source, entry.span(), (&own.at, &own.segment), closed)?;
        let times = times(source, &own.from_s, &own.until_s)?;
        let poses: Vec<Pose> = bodies.iter().map(|body| pose(builder, *body)).collect();
        let centre: Vector3<f64> = poses.iter().map(|pose| pose.position).sum::<Vector3<f64>>() / poses.len() as f64;
        let whole = Pose { position: centre, orientation: poses[0].orientation };
        let motion = prepared.motion(source, entry, &whole)?;
        let (snaps, moves_along) = (self.snaps(source, own, &bodies, times)?, prepared.moves_along());
        for (body, pose) in bodies.into_iter().zip(&poses) {
            let driven = Driven { moves_along, snaps, ..Driven::gripped(body, motion.clone(), pose, 0.0) };
            self.own(builder, source, entry.span(), driven.between(times.0, times.1))?;
        }
        Ok(())
    }

    /// Whether what a motion takes hold of goes to the gripper's own place: where springs pull it there.
    fn snaps(&self, source: &Source, own: &format::Motion, bodies: &[Body], (from, _): (f64, f64)) -> Result<bool> {
        let Some(snap) = own.snap.as_ref().filter(|snap| *snap.get_ref()) else { return Ok(false) };
        let yields = |body: &Body| self.faces.iter().any(|face| *body == Body::Anchor(face.anchor) && face.yields);
        if own.positions_m.is_none() || from <= 0.0 {
            return source.wrong(snap.span(), "goes with `positions_m` and a `from_s` > 0");
        }
        if !bodies.iter().all(yields) {
            let message = "what is held without springs would jump; say in `[[rods.grips]]` how an end face yields, with \
                           finite values of `stiffness_n_m`";
            return source.wrong(snap.span(), message);
        }
        Ok(true)
    }

    /// Adds a motion to the model, and holds what it drives from the start where it does so.
    fn own(&mut self, builder: &mut Builder, source: &Source, entry: Range<usize>, driven: Driven) -> Result<()> {
        let Driven { body, from, until, .. } = driven;
        if driven.is_timed() && self.clamped.contains(&body) {
            let message = "this place is held for the whole run (`clamp`, `fixed_segments` or `grips` without times); leave \
                           that out, or `from_s` and `until_s` here";
            return source.wrong(entry, message);
        }
        let mut others = self.owners.iter().filter(|other| other.body == body);
        if let Some(other) = others.find(|other| other.from < until && from < other.until) {
            if !driven.is_timed() && !other.is_timed() {
                return source.wrong(entry, "another motion drives the same place");
            }
            let until = |time: f64| if time.is_finite() { format!("until {time} s") } else { "for ever".to_owned() };
            let message = format!(
                "it holds this place from {from} s {}, but another entry holds it from {} s {}",
                until(driven.until),
                other.from,
                until(other.until)
            );
            return source.wrong(entry, &message);
        }
        let is_held = self.owners.iter().any(|other| other.body == body && other.from <= 0.0);
        if from <= 0.0 {
            self.close(builder, &[body]);
            if let Body::Segment(i) = body {
                let (state, begin) = (builder.assembly.state_mut(), driven.at(0.0));
                (state.velocities[i], state.angular_velocities[i]) = (begin.velocity, begin.angular_velocity);
            }
        } else if let (Body::Anchor(anchor), false) = (body, is_held) {
            let open = &mut builder.assembly.model_mut().open;
            open.retain(|other| *other != anchor);
            open.push(anchor);
        }
        let motions = &mut builder.assembly.model_mut().motions;
        self.owners.push(Owner { body, motion: motions.len(), from, until, entry });
        motions.push(driven);
        Ok(())
    }

    /// Holds bodies from the start.
    fn close(&self, builder: &mut Builder, bodies: &[Body]) {
        for body in bodies {
            match *body {
                Body::Segment(i) => {
                    builder.assembly.fix(i);
                }
                Body::Anchor(anchor) => builder.assembly.model_mut().open.retain(|other| *other != anchor),
            }
        }
    }

    /// Whether a motion drives a body from the start.
    pub(crate) fn drives(&self, body: Body) -> bool {
        self.owners.iter().any(|owner| owner.body == body && owner.from <= 0.0)
    }
}

/// Stiffnesses along or about d1, d2 and d3, of a list of two (d1 and d2 alike) or three that has these `forms`; rigid where
/// there is none.
fn stiffness(
    source: &Source,
    list: &Option<Spanned<Vec<format::Number>>>,
    hold: Hold,
    [two, three]: [&str; 2],
) -> Result<[f64; 3]> {
    let Some(list) = list else { return Ok([f64::INFINITY; 3]) };
    let positive = |value: &format::Number| {
        source.number(value, |v| v > 1e-9, "> 1e-9, or inf")?;
        source.number(value, |v| v <= 1e30 || v.is_infinite(), "at most 1e30, or inf")
    };
    match list.get_ref().as_slice() {
        [across, along] => Ok([positive(across)?, positive(across)?, positive(along)?]),
        [_, _, _] if hold == Hold::Hinge => {
            source.wrong(list.span(), &format!("has three values; with a hinge it is {two}"))
        }
        [first, second, third] => Ok([positive(first)?, positive(second)?, positive(third)?]),
        _ => source.wrong(list.span(), &format!("must be {two} or {three}")),
    }
}

/// By what a grip holds its face turned, in the axes of the face.
fn turn_of(source: &Source, turn: &format::Vector, own: &format::Grip, hold: Hold) -> Result<UnitQuaternion<f64>> {
    if own.from_s.is_some() || own.until_s.is_some() {
        return source.wrong(turn.span(), "goes without `from_s` and `until_s`: a grip takes a face as it is then");
    }
    if hold != Hold::Rigid || own.stiffness_n_m_rad.is_none() {
        return source.wrong(turn.span(), "goes with `stiffness_n_m_rad` of a rigid joint");
    }
    source.turn(turn)
}

/// From when until when [s] an entry holds what it names.
fn times(source: &Source, from: &Option<format::Number>, until: &Option<format::Number>) -> Result<(f64, f64)> {
    let begin = from.as_ref().map_or(Ok(ALWAYS.0), |from| source.not_negative(from, "s"))?;
    match until {
        None => Ok((begin, ALWAYS.1)),
        Some(until) if until.get_ref().is_finite() && *until.get_ref() > begin => Ok((begin, *until.get_ref())),
        Some(until) => source.must_be(until.span(), &format!("finite and later than {begin} [s], when it takes hold")),
    }
}

fn pose(builder: &mut Builder, body: Body) -> Pose {
    match body {
        Body::Segment(i) => {
            let state = builder.assembly.state_mut();
            Pose { position: state.positions[i], orientation: state.orientations[i] }
        }
        Body::Anchor(i) => builder.assembly.model_mut().anchors[i],
    }
}

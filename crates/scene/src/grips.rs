//! What holds a rod: clamps, fixed segments, and the motions that drive them.

use std::ops::Range;

use nalgebra::Vector3;
use rod::{Body, Driven, Pose};
use toml::Spanned;

use crate::builder::Builder;
use crate::error::{Result, Source, short};
use crate::format::{self, Clamp};
use crate::motion::Prepared;

/// By how much of its length a rod may be stretched between two places that are held.
const STRETCH: f64 = 0.1;

/// What holds one rod.
pub(crate) struct Grips {
    segments: Range<usize>,
    /// Anchors of the faces that are clamped.
    faces: Vec<(Clamp, usize)>,
    /// Bodies that are driven, each with the index of its motion in the model and its entry's place in the text.
    driven: Vec<(Body, usize, Range<usize>)>,
}

impl Grips {
    /// Of a rod that nothing holds yet.
    pub(crate) fn new(segments: &Range<usize>) -> Self {
        Self { segments: segments.clone(), faces: Vec::new(), driven: Vec::new() }
    }

    /// Holds an end, if it is not held already. Returns what is held there: the parts of a segment, or an anchor.
    pub(crate) fn clamp(&mut self, builder: &mut Builder, clamp: Clamp) -> Vec<Body> {
        let count = builder.refinement.count(&self.segments);
        match clamp {
            Clamp::StartSegment => self.fix(builder, 0),
            Clamp::EndSegment => self.fix(builder, count - 1),
            Clamp::StartFace | Clamp::EndFace => {
                if let Some((_, anchor)) = self.faces.iter().find(|(face, _)| *face == clamp) {
                    return vec![Body::Anchor(*anchor)];
                }
                match clamp {
                    Clamp::StartFace => builder.assembly.clamp_start(&self.segments),
                    _ => builder.assembly.clamp_end(&self.segments),
                };
                let anchor = builder.assembly.model_mut().anchors.len() - 1;
                self.faces.push((clamp, anchor));
                vec![Body::Anchor(anchor)]
            }
        }
    }

    /// Fixes a segment of the file; returns its parts.
    fn fix(&self, builder: &mut Builder, index: usize) -> Vec<Body> {
        builder.fix(&self.segments, index);
        builder.refinement.parts(&self.segments, index).map(Body::Segment).collect()
    }

    /// Lets an entry's motion drive what it names, which it holds, too.
    pub(crate) fn drive(
        &mut self,
        builder: &mut Builder,
        source: &Source,
        (entry, prepared): (&Spanned<format::Motion>, &Prepared),
        closed: bool,
    ) -> Result<()> {
        let format::Motion { at, segment, .. } = entry.get_ref();
        let bodies = match (at, segment) {
            (Some(at), None) if closed => return source.wrong(at.span(), "a closed rod has no ends; give `segment`"),
            (Some(at), None) => self.clamp(builder, *at.get_ref()),
            (None, Some(segment)) => {
                let index = source.index(segment, builder.refinement.count(&self.segments))?;
                self.fix(builder, index)
            }
            _ => return source.wrong(entry.span(), "give either `at` or `segment`"),
        };
        let poses: Vec<Pose> = bodies.iter().map(|body| pose(builder, *body)).collect();
        let centre: Vector3<f64> = poses.iter().map(|pose| pose.position).sum::<Vector3<f64>>() / poses.len() as f64;
        let whole = Pose { position: centre, orientation: poses[0].orientation };
        let motion = prepared.motion(source, entry, &whole)?;
        for (body, pose) in bodies.into_iter().zip(&poses) {
            if self.drives(body) {
                return source.wrong(entry.span(), "another motion drives the same place");
            }
            self.driven.push((body, builder.assembly.model_mut().motions.len(), entry.span()));
            let driven = Driven::gripped(body, motion.clone(), pose, 0.0);
            if let Body::Segment(i) = body {
                let (state, begin) = (builder.assembly.state_mut(), driven.at(0.0));
                (state.velocities[i], state.angular_velocities[i]) = (begin.velocity, begin.angular_velocity);
            }
            builder.assembly.model_mut().motions.push(driven);
        }
        Ok(())
    }

    /// Whether a motion drives a body.
    pub(crate) fn drives(&self, body: Body) -> bool {
        self.driven.iter().any(|(other, ..)| *other == body)
    }

    /// Checks that no two places of the rod are held further apart than the rod between them is long, at the times of all
    /// keyframes and at the end of the run.
    pub(crate) fn check_reach(&self, builder: &mut Builder, source: &Source, closed: bool) -> Result<()> {
        if self.driven.is_empty() {
            return Ok(());
        }
        let (places, end) = (self.places(builder), builder.end);
        let whole: f64 = self.segments.clone().map(|i| builder.assembly.drawn_length(i)).sum();
        let motions = &builder.assembly.model_mut().motions;
        let own = |place: &Place| self.driven.iter().find(|(body, ..)| *body == place.body);
        let pairs = places.windows(2).map(|pair| (&pair[0], &pair[1], pair[1].along - pair[0].along));
        let around = places.first().zip(places.last()).filter(|_| closed && places.len() > 1);
        let pairs = pairs.chain(around.map(|(first, last)| (last, first, whole - last.along + first.along)));
        for (first, second, length) in pairs {
            let drivers = [first, second].map(own);
            let Some((.., entry)) = drivers.into_iter().flatten().last() else { continue };
            let driven = drivers.map(|driver| driver.map(|(_, index, _)| &motions[*index]));
            let at = |place: &Place, driven: Option<&Driven>, time: f64| match driven {
                Some(driven) => driven.at(time).pose.position,
                None => place.position + place.velocity * time,
            };
            for time in driven.iter().flatten().flat_map(|driven| driven.motion.times()).chain([end]) {
                let distance = (at(first, driven[0], time) - at(second, driven[1], time)).norm();
                if distance > (1.0 + STRETCH) * length {
                    let message = format!(
                        "at {time} s two places that are held are {} m apart, but there are only {} m of the rod between \
                         them",
                        short(distance),
                        short(length)
                    );
                    return source.wrong(entry.clone(), &message);
                }
            }
        }
        Ok(())
    }

    /// All places of the rod that are held, in their order along it.
    fn places(&self, builder: &mut Builder) -> Vec<Place> {
        let mut places = Vec::new();
        let mut along = 0.0;
        for i in self.segments.clone() {
            let length = builder.assembly.drawn_length(i);
            if builder.segment(i).fixed {
                let position = pose(builder, Body::Segment(i)).position;
                let velocity = builder.assembly.state_mut().velocities[i];
                places.push(Place { body: Body::Segment(i), along: along + 0.5 * length, position, velocity });
            }
            along += length;
        }
        for &(face, anchor) in &self.faces {
            let position = pose(builder, Body::Anchor(anchor)).position;
            let along = if face == Clamp::StartFace { 0.0 } else { along };
            places.push(Place { body: Body::Anchor(anchor), along, position, velocity: Vector3::zeros() });
        }
        places.sort_by(|a, b| a.along.total_cmp(&b.along));
        places
    }
}

/// A place of a rod that is held.
struct Place {
    body: Body,
    /// Length of the rod before it [m].
    along: f64,
    /// Where it is at the start [m].
    position: Vector3<f64>,
    /// With which it goes on where nothing drives it [m/s].
    velocity: Vector3<f64>,
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

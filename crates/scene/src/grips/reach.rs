//! Whether a rod reaches from one place that is held to the next.

use nalgebra::Vector3;
use rod::{Body, Driven};

use super::{Face, Grips, Owner, pose};
use crate::builder::Builder;
use crate::error::{Result, Source, short};
use crate::format::Clamp;

/// By how much of its length a rod may be stretched between two places that are held.
const STRETCH: f64 = 0.1;

impl Grips {
    /// Checks that no two places of the rod are held further apart than the rod between them is long, at the times of all
    /// keyframes and at the end of the run. Where grips with times are depends on how the rod moves; they are left out.
    pub(crate) fn check_reach(&self, builder: &mut Builder, source: &Source, closed: bool) -> Result<()> {
        if self.owners.is_empty() {
            return Ok(());
        }
        let (places, end) = (self.places(builder), builder.end);
        let whole: f64 = self.segments.clone().map(|i| builder.assembly.drawn_length(i)).sum();
        let motions = &builder.assembly.model_mut().motions;
        let own = |place: &Place| self.owners.iter().find(|owner| owner.body == place.body);
        let pairs = places.windows(2).map(|pair| (&pair[0], &pair[1], pair[1].along - pair[0].along));
        let around = places.first().zip(places.last()).filter(|_| closed && places.len() > 1);
        let pairs = pairs.chain(around.map(|(first, last)| (last, first, whole - last.along + first.along)));
        for (first, second, length) in pairs {
            let drivers = [first, second].map(own);
            let Some(Owner { entry, .. }) = drivers.into_iter().flatten().last() else { continue };
            if drivers.into_iter().flatten().any(Owner::is_timed) {
                continue;
            }
            let driven = drivers.map(|driver| driver.map(|owner| &motions[owner.motion]));
            let at = |place: &Place, driven: Option<&Driven>, time: f64| match driven {
                Some(driven) => driven.at(time).pose.position,
                None => place.position + place.velocity * time,
            };
            for time in driven.iter().flatten().flat_map(|driven| driven.carried.motion.times()).chain([end]) {
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
        for &Face { clamp, anchor, .. } in &self.faces {
            let position = pose(builder, Body::Anchor(anchor)).position;
            let along = if clamp == Clamp::StartFace { 0.0 } else { along };
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

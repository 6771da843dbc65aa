//! What is held where a run begins with the end of another one: the courses of grips are to lead on from there.

use anyhow::{Result, bail};
use cosserat::motion::Driven;
use cosserat::scene::Scene;
use cosserat::simulation::{Simulation, Taken, TimedGrip};
use cosserat::state::measure::stretch_gap;
use cosserat::state::{Body, Joint, Model, Pose, State};
use nalgebra::{Quaternion, UnitQuaternion};
use serde::{Deserialize, Serialize};

use crate::numbers::number;

/// Distance in segment lengths, and angle [rad], up to which two places are the same.
const SAME: f64 = 0.01;
/// Gap in lengths of a joint from which on an end face is elsewhere than what holds it, beyond twice the widest gap within rods.
const APART: f64 = 0.1;

/// A body that is held otherwise than the scene says: where a run that goes on took hold of it, or a grip did on the way.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Hold {
    /// Whether it is a segment or an anchor, and which one.
    body: Kind,
    index: usize,
    /// The motion of the model, of a grip with times.
    #[serde(skip_serializing_if = "Option::is_none")]
    motion: Option<usize>,
    /// When it was taken hold of [s], where there and how turned (x, y, z, w).
    time_s: f64,
    position_m: [f64; 3],
    orientation: [f64; 4],
    /// Where a motion that begins there was moved to [m].
    centre_m: [f64; 3],
    /// When it was let go [s].
    #[serde(skip_serializing_if = "Option::is_none")]
    until_s: Option<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Kind {
    Segment,
    Anchor,
}

impl Hold {
    fn new(body: Body, here: &Pose, time_s: f64) -> Self {
        let (body, index) = match body {
            Body::Segment(i) => (Kind::Segment, i),
            Body::Anchor(i) => (Kind::Anchor, i),
        };
        let (position_m, orientation) = (here.position.into(), here.orientation.coords.into());
        Self { body, index, motion: None, time_s, position_m, orientation, centre_m: position_m, until_s: None }
    }

    /// What a grip with times has taken hold of, if it has.
    pub(crate) fn of_grip(model: &Model, grip: &TimedGrip) -> Option<Self> {
        let Taken { pose, centre, time } = grip.taken?;
        let hold = Self::new(model.motions[grip.motion].body, &pose, time);
        let until_s = Some(grip.until).filter(|until| until.is_finite());
        Some(Self { motion: Some(grip.motion), centre_m: centre.into(), until_s, ..hold })
    }

    fn here(&self) -> Pose {
        let orientation = UnitQuaternion::new_unchecked(Quaternion::from(self.orientation));
        Pose { position: self.position_m.into(), orientation }
    }
}

/// Holds what is held as these say. `what` names their file in errors.
///
/// # Errors
/// If they are of another scene.
pub(crate) fn hold_as(scene: &mut Scene, holds: &[Hold], what: &str) -> Result<()> {
    for hold in holds {
        let (count, body) = match hold.body {
            Kind::Segment => (scene.model.segments.len(), Body::Segment(hold.index)),
            Kind::Anchor => (scene.model.anchors.len(), Body::Anchor(hold.index)),
        };
        let here = hold.here();
        let motion = hold.motion.map(|k| scene.model.motions.get(k).filter(|driven| driven.body == body).map(|_| k));
        match motion {
            _ if hold.index >= count => bail!("{what}: it is of another scene than {}", scene.name),
            Some(None) => bail!("{what}: it is of another scene than {}", scene.name),
            Some(Some(k)) => {
                let taken = Taken { pose: here, centre: hold.centre_m.into(), time: hold.time_s };
                let until = hold.until_s.unwrap_or(f64::INFINITY);
                let driven = &mut scene.model.motions[k];
                *driven = TimedGrip { motion: k, taken: Some(taken), until }.of(driven);
            }
            None => {
                let at = regrip(scene, body, &here, hold.time_s).or_else(|there| refuse(scene, what, there))?;
                // A motion must begin where its body is.
                let driven = scene.model.motions.iter().find(|driven| driven.body == body && driven.from <= 0.0);
                let at = driven.map_or(at, |driven| driven.at(0.0).pose);
                match body {
                    Body::Anchor(i) => scene.model.anchors[i] = at,
                    Body::Segment(i) => {
                        (scene.state.positions[i], scene.state.orientations[i]) = (at.position, at.orientation);
                    }
                }
            }
        }
    }
    Ok(())
}

/// Takes hold where a frame of another run has the rods, with time 0: end faces that are elsewhere than what is to hold them, and
/// segments that are driven. A clamp holds its face where it is; so does a motion given by shifts or velocities, which begins
/// there. A motion given by positions must begin there itself.
///
/// `what` names the frame in errors.
///
/// # Errors
/// If a motion begins elsewhere.
pub(crate) fn hold_frame(scene: &mut Scene, what: &str) -> Result<Vec<Hold>> {
    let mut holds = Vec::new();
    let usual = widest_within(&scene.model, &scene.state);
    for k in 0..scene.model.joints.len() {
        let joint = scene.model.joints[k];
        let Some((anchor, segment)) = of_anchor(&joint) else { continue };
        let apart = stretch_gap(&scene.model, &scene.state, &joint).norm() / joint.length;
        if scene.model.is_open(&joint) || is_springy(&scene.model, &joint) || apart <= APART + 2.0 * usual {
            continue;
        }
        let face = face(&scene.model, &scene.state, &joint, segment);
        let at = regrip(scene, Body::Anchor(anchor), &face, 0.0).or_else(|there| refuse(scene, what, there))?;
        scene.model.anchors[anchor] = at;
        holds.push(Hold::new(Body::Anchor(anchor), &face, 0.0));
    }
    for k in 0..scene.model.motions.len() {
        let Driven { body: body @ Body::Segment(_), from: ..=0.0, .. } = scene.model.motions[k] else { continue };
        let (here, there) = (scene.model.pose(body, &scene.state), scene.model.motions[k].at(0.0).pose);
        // Rounding is the model's to judge.
        if distance(&here, &there) > 1e-9 || here.orientation.angle_to(&there.orientation) > 1e-9 {
            regrip(scene, body, &here, 0.0).or_else(|there| refuse(scene, what, there))?;
            holds.push(Hold::new(body, &here, 0.0));
        }
    }
    Ok(holds)
}

/// Checks that what drives bodies leads on from where a snapshot has them, and lets it take hold anew where it does so by itself:
/// a motion given by shifts or velocities that begins then, or one by positions that has nothing before. `what` names the
/// snapshot in errors.
///
/// # Errors
/// If a motion is elsewhere at the time of the snapshot.
pub(crate) fn hold_snapshot(scene: &mut Scene, simulation: &mut Simulation, what: &str) -> Result<Vec<Hold>> {
    let mut holds = Vec::new();
    let time = simulation.time();
    let grips = simulation.timed_grips();
    for k in 0..scene.model.motions.len() {
        let given = &scene.model.motions[k];
        let timed = grips.iter().find(|grip| grip.motion == k);
        let driven = timed.map_or_else(|| given.clone(), |grip| grip.of(given));
        let has_hold = timed.is_none_or(|grip| grip.taken.is_some() || given.from <= 0.0) && !driven.ends_by(time);
        let Some(here) = simulation.pose(driven.body).filter(|_| has_hold && time > 0.0) else { continue };
        let there = driven.at(time).pose;
        let size = length(&scene.model, driven.body);
        if distance(&here, &there) <= SAME * size && here.orientation.angle_to(&there.orientation) <= SAME {
            continue;
        }
        let begins = driven.carried.motion.times().next().is_some_and(|first| first >= time * (1.0 - 1e-12));
        if timed.is_some() || !begins {
            let there = Elsewhere { body: driven.body, time, distance: distance(&here, &there) };
            return refuse(scene, what, there);
        }
        let body = driven.body;
        regrip(scene, body, &here, time).or_else(|there| refuse(scene, what, there))?;
        simulation.drive(&scene.model.motions[k])?;
        holds.push(Hold::new(body, &here, time));
    }
    Ok(holds)
}

/// A motion that is elsewhere than its body.
struct Elsewhere {
    body: Body,
    time: f64,
    distance: f64,
}

/// Lets the motion that drives a body from the start take hold of it at `here`, at `time` [s]: see [`hold_frame`]. Returns where
/// the body is held.
fn regrip(scene: &mut Scene, body: Body, here: &Pose, time: f64) -> Result<Pose, Elsewhere> {
    let size = length(&scene.model, body);
    let is_it = |driven: &&mut Driven| driven.body == body && driven.from <= 0.0;
    let Some(driven) = scene.model.motions.iter_mut().find(is_it) else { return Ok(*here) };
    let (from, until) = (driven.from, driven.until);
    let place = driven.carried.motion.at(time).pose;
    let taken = if driven.moves_along {
        driven.taken(here, &here.position, time)
    } else if distance(&place, here) <= SAME * size {
        // A frame does not tell how a face was bent against what held it.
        let is_face = matches!(body, Body::Anchor(_)) && time <= 0.0;
        let at = if is_face { Pose { position: place.position, ..*here } } else { *here };
        driven.taken(&at, &at.position, time)
    } else {
        return Err(Elsewhere { body, time, distance: distance(&place, here) });
    };
    *driven = taken.between(from, until);
    Ok(driven.at(time).pose)
}

fn refuse<T>(scene: &Scene, what: &str, Elsewhere { body, time, distance }: Elsewhere) -> Result<T> {
    let times = if time > 0.0 {
        "a run that goes on keeps its time, and so do its motions: their times are those of the whole run"
    } else {
        "with a frame, time is 0 again; a run goes on with its time from the folder of one with --snapshot"
    };
    bail!(
        "{what}: at {} s the motion of {} is {} m away from where that run left it; {times}",
        number(time),
        place(scene, body),
        number(distance)
    )
}

/// A body of a scene in words.
pub(crate) fn place(scene: &Scene, body: Body) -> String {
    match body {
        Body::Segment(i) => {
            let segment = &scene.model.segments[i];
            match scene.rods.get(segment.rod) {
                Some(rod) if segment.body.is_some() => rod.name.clone(),
                Some(rod) => format!("segment {} of {}", i - rod.segments.start, rod.name),
                None => format!("segment {i}"),
            }
        }
        Body::Anchor(i) => {
            let of = scene.model.joints.iter().filter_map(of_anchor).find(|&(anchor, _)| anchor == i);
            let rod = of.and_then(|(_, k)| scene.rods.get(scene.model.segments[k].rod).map(|rod| (rod, k)));
            match rod {
                Some((rod, k)) if k == rod.segments.start => format!("the start face of {}", rod.name),
                Some((rod, k)) if k + 1 == rod.segments.end => format!("the end face of {}", rod.name),
                Some((rod, _)) => format!("a face of {}", rod.name),
                None => format!("anchor {i}"),
            }
        }
    }
}

/// The anchor and the segment of a joint between two such.
fn of_anchor(joint: &Joint) -> Option<(usize, usize)> {
    match (joint.a, joint.b) {
        (Body::Anchor(anchor), Body::Segment(segment)) | (Body::Segment(segment), Body::Anchor(anchor)) => {
            Some((anchor, segment))
        }
        _ => None,
    }
}

/// Where an anchor holds a segment's face as it lies, unbent.
fn face(model: &Model, state: &State, joint: &Joint, segment: usize) -> Pose {
    let own = model.pose(Body::Segment(segment), state);
    let rest = joint.rest_rotation();
    let is_a = matches!(joint.a, Body::Anchor(_));
    let orientation = if is_a { own.orientation * rest.inverse() } else { own.orientation * rest };
    let [to_face, to_own] = match is_a {
        true => [joint.arm_b(&own.orientation), joint.arm_a(&orientation)],
        false => [joint.arm_a(&own.orientation), joint.arm_b(&orientation)],
    };
    Pose { position: own.position + to_face - to_own, orientation }
}

/// Whether what holds a face yields more than the rod itself.
fn is_springy(model: &Model, joint: &Joint) -> bool {
    let yields = |joint: &Joint| joint.stretch_compliance.max(joint.shear_compliance);
    let Some((_, segment)) = of_anchor(joint) else { return false };
    let is_beside = |other: &&Joint| of_anchor(other).is_none() && [other.a, other.b].contains(&Body::Segment(segment));
    let beside = model.joints.iter().filter(is_beside).map(yields).fold(Joint::RIGID, f64::max);
    yields(joint) > 10.0 * beside
}

/// The widest gap within and between rods, in lengths of joints.
fn widest_within(model: &Model, state: &State) -> f64 {
    let within = model.joints.iter().filter(|joint| of_anchor(joint).is_none() && !model.is_open(joint));
    within.map(|joint| stretch_gap(model, state, joint).norm() / joint.length).fold(0.0, f64::max)
}

/// Length of the segment that a body is or holds [m].
fn length(model: &Model, body: Body) -> f64 {
    let segment = match body {
        Body::Segment(i) => Some(i),
        Body::Anchor(i) => {
            model.joints.iter().filter_map(of_anchor).find(|&(anchor, _)| anchor == i).map(|(_, segment)| segment)
        }
    };
    segment.map_or(0.0, |i| model.segments[i].length)
}

fn distance(a: &Pose, b: &Pose) -> f64 {
    (a.position - b.position).norm()
}

//! What the player shows over time beside energy: what probes read, and what grips bear.

use std::collections::HashSet;

use cosserat::motion::{Reaction, Wrench};
use cosserat::scene::Scene;
use cosserat::state::{Body, Joint, JointForce, Model, Part, Probe, Quantity, Reading, State};
use view::{Curve, Line, Recorder};

/// Above so many places that are held, their reactions are left out: nobody would choose among them.
const MOST_HELD: usize = 24;
const AXES: [&str; 3] = ["x", "y", "z"];
/// Names of a quaternion's numbers.
const QUATERNION: [&str; 4] = ["w", "x", "y", "z"];

/// Takes what probes read and grips bear, frame by frame.
pub(crate) struct Curves {
    probes: Vec<Probe>,
    held: Vec<(Body, String)>,
    /// The numbers of each probe, then force and moment of each held body, one list of all frames each.
    columns: Vec<Vec<f64>>,
    /// Time [s] and state of the frame that was kept last; nothing where no reactions are read.
    before: Option<(f64, State)>,
}

impl Curves {
    /// For a scene whose model is `model`, of which `part` is shown, where that is not all; without a frame.
    pub(crate) fn new(scene: &Scene, model: &Model, part: Option<&Part>) -> Self {
        let held = held(scene, model, part);
        let probes = scene.probes.clone();
        let numbers = |probe: &Probe| -> usize { probe.quantities.iter().map(|one| one.columns().len()).sum() };
        let columns = probes.iter().map(numbers).sum::<usize>() + 6 * held.len();
        Self { probes, held, columns: vec![Vec::new(); columns], before: None }
    }

    /// Whether there is nothing to take.
    pub(crate) fn is_empty(&self) -> bool {
        self.columns.is_empty()
    }

    /// Whether it asks for reactions.
    pub(crate) fn reads_reactions(&self) -> bool {
        let reads = |probe: &Probe| probe.quantities.contains(&Quantity::Reaction);
        !self.held.is_empty() || self.probes.iter().any(reads)
    }

    /// Adds a frame at a time [s]; `forces` of joints, and what contacts give to segments, are empty where nothing is known of them.
    pub(crate) fn push(
        &mut self,
        model: &Model,
        state: &State,
        (forces, contacts): (&[JointForce], &[Wrench]),
        time: f64,
    ) {
        let reactions = match &self.before {
            Some((then, before)) => Reaction::all(model, [before, state], [*then, time], forces, contacts),
            None => Vec::new(),
        };
        let now = Reading { model, time, state, forces, reactions: &reactions };
        let (mut values, mut at) = (Vec::new(), 0);
        let mut add = |values: &[f64]| {
            for &value in values {
                self.columns[at].push(value);
                at += 1;
            }
        };
        for probe in &self.probes {
            probe.read(&now, &mut values);
            add(&values);
        }
        for (body, _) in &self.held {
            let found = reactions.iter().find(|reaction| reaction.body == *body);
            values.clear();
            values.extend(found.iter().flat_map(|own| own.force.iter().chain(&own.moment)));
            values.resize(6, f64::NAN);
            add(&values);
        }
    }

    /// Keeps a frame from which reactions in the next one take the accelerations.
    pub(crate) fn keep(&mut self, state: &State, time: f64) {
        if self.reads_reactions() {
            self.before = Some((time, state.clone()));
        }
    }

    /// Gives the recorder its curves: quantities of one number with a line a probe, others with a line an axis.
    pub(crate) fn finish(self, recorder: &mut Recorder) {
        let Self { probes, held, columns, .. } = self;
        let mut rest = columns.as_slice();
        let mut next = |count: usize| {
            let (own, after) = rest.split_at(count);
            rest = after;
            own
        };
        let mut curves: Vec<Curve> = Vec::new();
        for probe in &probes {
            for &quantity in &probe.quantities {
                for (what, unit, count) in parts(quantity) {
                    let own = next(count);
                    if count > 1 {
                        curves.push(vector("Probes", &format!("{}: {what}", probe.name), unit, own));
                        continue;
                    }
                    let line = Line::new(&probe.name, &own[0]);
                    match curves.iter_mut().find(|curve| curve.label == what) {
                        Some(curve) => curve.lines.push(line),
                        None => curves.push(Curve {
                            group: "Probes".to_owned(),
                            label: what.to_owned(),
                            unit: unit.to_owned(),
                            lines: vec![line],
                        }),
                    }
                }
            }
        }
        for (_, name) in &held {
            for (what, unit) in [("force", "N"), ("moment", "N m")] {
                curves.push(vector("Reactions", &format!("{name}: {what}"), unit, next(3)));
            }
        }
        curves.into_iter().for_each(|curve| recorder.add_curve(curve));
    }
}

fn vector(group: &str, label: &str, unit: &str, columns: &[Vec<f64>]) -> Curve {
    let names: &[&str] = if columns.len() == 4 { &QUATERNION } else { &AXES };
    let lines = names.iter().zip(columns).map(|(axis, values)| Line::new(axis, values)).collect();
    Curve { group: group.to_owned(), label: label.to_owned(), unit: unit.to_owned(), lines }
}

/// What a quantity's numbers are, their unit, and how many there are.
fn parts(quantity: Quantity) -> Vec<(&'static str, &'static str, usize)> {
    match quantity {
        Quantity::Position => vec![("position", "m", 3)],
        Quantity::Orientation => vec![("orientation", "", 4)],
        Quantity::Velocity => vec![("velocity", "m/s", 3)],
        Quantity::AngularVelocity => vec![("angular velocity", "rad/s", 3)],
        Quantity::Tension => vec![("tension", "N", 1)],
        Quantity::Force => vec![("force", "N", 3)],
        Quantity::Moment => vec![("moment", "N m", 3)],
        Quantity::Curvature => vec![("curvature", "1/m", 1)],
        Quantity::Reaction => vec![("reaction force", "N", 3), ("reaction moment", "N m", 3)],
        Quantity::Wind => vec![("wind", "m/s", 3)],
        Quantity::Drag => vec![("drag", "N", 3)],
    }
}

/// Whether a held body is one of what is shown.
fn shows(part: &Part, model: &Model, body: Body) -> bool {
    match body {
        Body::Segment(i) => part.segments.contains(&i),
        Body::Anchor(_) => anchored(model, body).is_some_and(|(i, _)| part.segments.contains(&i)),
    }
}

/// The segment that a joint holds to an anchor, and the place along its axis, from its centre [m].
fn anchored(model: &Model, anchor: Body) -> Option<(usize, f64)> {
    model.joints.iter().find_map(|&Joint { a, b, offset_a, offset_b, .. }| match (a, b) {
        (Body::Segment(i), other) if other == anchor => Some((i, offset_a)),
        (other, Body::Segment(i)) if other == anchor => Some((i, offset_b)),
        _ => None,
    })
}

/// What is held of `part`, for some of the time at least, with names; nothing where that is more than [`MOST_HELD`].
fn held(scene: &Scene, model: &Model, part: Option<&Part>) -> Vec<(Body, String)> {
    let fixed = (0..model.segments.len()).filter(|&i| model.segments[i].fixed).map(Body::Segment);
    let driven = model.motions.iter().map(|driven| driven.body).filter(|body| matches!(body, Body::Segment(_)));
    let anchors = (0..model.anchors.len()).map(Body::Anchor);
    let mut seen = HashSet::new();
    let all = fixed.chain(driven).chain(anchors).filter(|&body| seen.insert(body));
    let shown = all.filter(|&body| part.is_none_or(|part| shows(part, model, body)));
    let held: Vec<_> = shown.filter_map(|body| Some((body, name(scene, model, body)?))).take(MOST_HELD + 1).collect();
    if held.len() > MOST_HELD { Vec::new() } else { held }
}

/// What is held, as one says it: the rod's name and the place; `None` of an anchor that holds nothing.
fn name(scene: &Scene, model: &Model, body: Body) -> Option<String> {
    let (segment, offset) = match body {
        Body::Segment(i) => (i, None),
        Body::Anchor(_) => anchored(model, body).map(|(i, offset)| (i, Some(offset)))?,
    };
    let number = model.segments[segment].rod;
    let rod = scene.rods.get(number).map_or_else(|| format!("rod {number}"), |rod| rod.name.clone());
    let range = scene.rods.get(number).map_or(segment..segment + 1, |rod| rod.segments.clone());
    if range.len() == 1 && model.segments[segment].body.is_some() {
        return Some(rod);
    }
    let place = match offset {
        Some(offset) if segment == range.start && offset < 0.0 => "start".to_owned(),
        Some(offset) if segment + 1 == range.end && offset > 0.0 => "end".to_owned(),
        _ => format!("segment {}", segment - range.start),
    };
    Some(format!("{rod}, {place}"))
}

/// A player's run of a scene, or of the part of its model that is `drawn`, with its names; `dt` is the time between frames [s].
pub(crate) fn recorder(title: &str, dt: f64, scene: &Scene, drawn: &Model) -> Recorder {
    let mut player = Recorder::new(title, dt, drawn);
    let (rods, obstacles) = names(scene);
    player.name(rods, obstacles);
    player
}

/// Names of what the player shows: rods and bodies by their numbers, obstacles in their order.
pub(crate) fn names(scene: &Scene) -> (Vec<String>, Vec<String>) {
    (scene.rods.iter().map(|rod| rod.name.clone()).collect(), scene.obstacles.clone())
}

//! Rods, their names, and the joints between them: what entries of the file are built with.

use std::collections::{HashMap, HashSet};
use std::ops::Range;

use nalgebra::{UnitQuaternion, Vector3};
use rod::{Assembly, Pose, RigidBody, RodSpec, Segment};
use toml::Spanned;

use crate::error::{Result, Source, short};
use crate::refine::Refinement;
use crate::shape::number_or;
use crate::{RodInfo, format};

/// How far apart two joined places may lie, in units of the shorter segment.
const JOIN_TOLERANCE: f64 = 0.01;

/// A place that joints hold on to.
#[derive(Clone, Copy)]
pub(crate) enum Spot {
    /// At a fraction of the length of a segment of a rod.
    Rod(usize, f64),
    /// At a place in the frame of a rigid body, by its segment [m]; `None` where none is given.
    Body(usize, Option<Vector3<f64>>),
}

impl format::Place {
    /// Place in the text of the name that it gives; nowhere if it gives none.
    pub(crate) fn named(&self) -> Range<usize> {
        self.rod.as_ref().or(self.body.as_ref()).map_or(0..0, Spanned::span)
    }
}

/// The rods built so far.
pub(crate) struct Builder {
    pub(crate) refinement: Refinement,
    pub(crate) assembly: Assembly,
    pub(crate) rods: Vec<RodInfo>,
    /// Of each rod the one that it grows on.
    pub(crate) parents: Vec<Option<usize>>,
    /// How long the scene is run [s].
    pub(crate) end: f64,
    /// The two segments that each motor turns.
    pub(crate) motors: Vec<[usize; 2]>,
    /// Joints that the scene says the rest rotation of.
    pub(crate) own_rests: Vec<usize>,
    by_name: HashMap<String, usize>,
    /// Names of entries, also of those whose rods have names made from it.
    entries: HashSet<String>,
}

impl Builder {
    /// A builder without rods, whose segments will be cut into parts.
    pub(crate) fn new(refinement: Refinement, assembly: Assembly, end: f64) -> Self {
        Self {
            refinement,
            assembly,
            rods: Vec::new(),
            parents: Vec::new(),
            own_rests: Vec::new(),
            end,
            motors: Vec::new(),
            by_name: HashMap::new(),
            entries: HashSet::new(),
        }
    }

    pub(crate) fn segment(&mut self, i: usize) -> Segment {
        self.assembly.model_mut().segments[i].clone()
    }

    pub(crate) fn orientation(&mut self, i: usize) -> UnitQuaternion<f64> {
        self.assembly.state_mut().orientations[i]
    }

    /// Place [m] at a fraction of a segment's length, as it is drawn.
    pub(crate) fn point(&mut self, i: usize, fraction: f64) -> Vector3<f64> {
        let length = self.assembly.drawn_length(i);
        let state = self.assembly.state_mut();
        state.positions[i] + state.axis(i) * ((fraction - 0.5) * length)
    }

    /// Place [m] of a spot; on a body that gives none, its centre of mass.
    pub(crate) fn place_of(&mut self, spot: Spot) -> Vector3<f64> {
        match spot {
            Spot::Rod(segment, fraction) => self.point(segment, fraction),
            Spot::Body(body, at) => {
                let state = self.assembly.state_mut();
                state.positions[body] + state.orientations[body] * at.unwrap_or_default()
            }
        }
    }

    /// `given` or `default`, if no rod has that name yet; `span` is the entry's place in the text.
    pub(crate) fn new_name(
        &mut self,
        source: &Source,
        given: &Option<Spanned<String>>,
        default: String,
        span: Range<usize>,
    ) -> Result<String> {
        let name = given.as_ref().map_or(default, |name| name.get_ref().clone());
        match self.has(&name) || !self.entries.insert(name.clone()) {
            true => source.must_be(given.as_ref().map_or(span, Spanned::span), "a name that no other rod has"),
            false => Ok(name),
        }
    }

    /// Adds a rod, grown on a segment at a fraction of its length if it is a branch, and returns its segments.
    pub(crate) fn add_rod(&mut self, name: String, spec: &RodSpec, branch_of: Option<(usize, f64)>) -> Range<usize> {
        let segments = self.assembly.rod(spec);
        if let Some((segment, fraction)) = branch_of {
            self.assembly.branch(segment, fraction, &segments);
        }
        let parent = branch_of.map(|(segment, _)| self.segment(segment).rod);
        self.register(RodInfo { name, segments: segments.clone(), closed: spec.closed }, parent);
        segments
    }

    /// Puts down a rod that the assembly has, by its name.
    pub(crate) fn register(&mut self, rod: RodInfo, parent: Option<usize>) {
        self.by_name.insert(rod.name.clone(), self.rods.len());
        self.rods.push(rod);
        self.parents.push(parent);
    }

    /// Whether there is a rod of that name.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.by_name.contains_key(name)
    }

    /// Whether a name is that of a rigid body.
    pub(crate) fn is_body(&mut self, name: &str) -> bool {
        let segments = &self.assembly.model_mut().segments;
        let first = self.by_name.get(name).map(|&index| self.rods[index].segments.start);
        first.and_then(|first| segments.get(first)).is_some_and(|segment| segment.body.is_some())
    }

    /// Number of segments so far.
    pub(crate) fn segments(&self) -> usize {
        self.rods.last().map_or(0, |rod| rod.segments.end)
    }

    /// Adds a rigid body and returns its segment.
    pub(crate) fn add_body(&mut self, name: String, body: RigidBody, pose: Pose) -> usize {
        let segment = self.assembly.body(body, pose);
        self.register(RodInfo { name, segments: segment..segment + 1, closed: false }, None);
        segment
    }

    pub(crate) fn join(&mut self, source: &Source, join: &Spanned<format::Join>) -> Result<()> {
        let format::Join { a, b, joint, motor } = join.get_ref();
        if let (Some(motor), true) = (motor, *joint != format::Hold::Hinge) {
            return source.wrong(motor.span(), "goes with `joint = \"hinge\"` between two rods");
        }
        let spots = [self.spot(source, a)?, self.spot(source, b)?];
        let ((a, fraction_a), (b, fraction_b)) = match spots {
            [Spot::Rod(a, fraction_a), Spot::Rod(b, fraction_b)] => ((a, fraction_a), (b, fraction_b)),
            [Spot::Rod(segment, fraction), Spot::Body(body, at)]
            | [Spot::Body(body, at), Spot::Rod(segment, fraction)] => {
                if *joint != format::Hold::Rigid {
                    return source.wrong(join.span(), "a joint with a body is rigid; leave `joint` out");
                }
                return self.join_body(source, join, (segment, fraction), (body, at));
            }
            _ => return source.wrong(join.span(), "one of `a` and `b` must be a `rod`"),
        };
        if a == b {
            return source.wrong(join.span(), "`a` and `b` are the same segment");
        }
        let gap = (self.point(a, fraction_a) - self.point(b, fraction_b)).norm();
        let whole = self.refinement.0 as f64;
        let most = JOIN_TOLERANCE * whole * self.segment(a).length.min(self.segment(b).length);
        if gap > most {
            let (gap, most) = (short(gap), short(most));
            let message = format!("`a` and `b` are {gap} m apart, but places to be joined must meet within {most} m");
            return source.wrong(join.span(), &message);
        }
        self.join_at((a, fraction_a), (b, fraction_b));
        self.free_last_joint(*joint);
        Ok(())
    }

    /// Joins a segment to a rigid body: where it is, or at a place that is given.
    fn join_body(
        &mut self,
        source: &Source,
        join: &Spanned<format::Join>,
        (segment, fraction): (usize, f64),
        (body, at): (usize, Option<Vector3<f64>>),
    ) -> Result<()> {
        let point = self.point(segment, fraction);
        let state = self.assembly.state_mut();
        let here = state.orientations[body].inverse() * (point - state.positions[body]);
        let gap = at.map_or(0.0, |at| (here - at).norm());
        let most = JOIN_TOLERANCE * self.refinement.0 as f64 * self.segment(segment).length;
        if gap > most {
            let (gap, most) = (short(gap), short(most));
            let message = format!(
                "`a` and `b` are {gap} m apart, but places to be joined must meet within {most} m; without `at_m` the body is \
                 held where the rod is"
            );
            return source.wrong(join.span(), &message);
        }
        self.assembly.join_body(segment, fraction, body, &at.unwrap_or(here));
        Ok(())
    }

    /// Lets the joint made last turn freely where `hold` says so: as a ball, or about the axis of its first segment.
    pub(crate) fn free_last_joint(&mut self, hold: format::Hold) {
        let model = self.assembly.model_mut();
        let last = model.joints.len().saturating_sub(1);
        match hold {
            format::Hold::Rigid => {}
            format::Hold::Ball => model.pin(last),
            format::Hold::Hinge => model.hinge(last, &Vector3::z()),
        }
    }

    /// Joins two segments at fractions of their lengths, as [`Assembly::join`].
    pub(crate) fn join_at(&mut self, a: (usize, f64), b: (usize, f64)) {
        self.assembly.join(a.0, a.1, b.0, b.1);
    }

    /// The rod of a name.
    pub(crate) fn rod(&mut self, source: &Source, name: &Spanned<String>) -> Result<&RodInfo> {
        let index = self.named(source, name, false)?;
        Ok(&self.rods[index])
    }

    /// What a place in the file says.
    pub(crate) fn spot(&mut self, source: &Source, place: &Spanned<format::Place>) -> Result<Spot> {
        let format::Place { rod, segment, fraction, body, at_m } = place.get_ref();
        let along = [segment.as_ref().map(Spanned::span), fraction.as_ref().map(Spanned::span)];
        match (rod, body) {
            (Some(_), None) if at_m.is_some() => {
                source.wrong(at_m.as_ref().map_or(0..0, Spanned::span), "goes with `body`, not with `rod`")
            }
            (Some(rod), None) => {
                self.on_rod(source, rod, segment, fraction).map(|(i, fraction)| Spot::Rod(i, fraction))
            }
            (None, Some(body)) => match along.into_iter().flatten().next() {
                Some(span) => source.wrong(span, "goes with `rod`, not with `body`"),
                None => {
                    let index = self.named(source, body, true)?;
                    let segment = self.rods[index].segments.start;
                    let at = at_m.as_ref().map(|at| source.vector(at, "m")).transpose()?;
                    let own = &self.assembly.model_mut().segments[segment];
                    let at = at.map(|at| own.body.as_ref().map_or(at, |body| body.shape.place(&at)));
                    Ok(Spot::Body(segment, at))
                }
            },
            (None, None) => source.wrong(place.span(), "missing key `rod` (or `body`)"),
            (Some(_), Some(body)) => source.wrong(body.span(), "give either `rod` or `body`, not both"),
        }
    }

    /// Index of the rod, or of the rigid body, of a name.
    fn named(&mut self, source: &Source, name: &Spanned<String>, body: bool) -> Result<usize> {
        let segments = &self.assembly.model_mut().segments;
        let is_it = |rod: &RodInfo| segments.get(rod.segments.start).is_some_and(|own| own.body.is_some()) == body;
        match self.by_name.get(name.get_ref()) {
            Some(&index) if is_it(&self.rods[index]) => Ok(index),
            other => {
                let what = if body { "the name of a body" } else { "the name of a rod that comes before it" };
                let mut allowed = known_names(what, self.rods.iter().filter(|rod| is_it(rod)));
                if other.is_some() {
                    let kind = if body { "a rod" } else { "a rigid body" };
                    allowed = format!("{allowed}; `{}` is {kind}", name.get_ref());
                }
                source.must_be(name.span(), &allowed)
            }
        }
    }

    /// Segment of the model and fraction of its length.
    fn on_rod(
        &mut self,
        source: &Source,
        rod: &Spanned<String>,
        segment: &Option<format::Count>,
        fraction: &Option<format::Number>,
    ) -> Result<(usize, f64)> {
        let rod = self.named(source, rod, false)?;
        let segments = &self.rods[rod].segments;
        let count = self.refinement.count(segments);
        let index = segment.as_ref().map_or(Ok(count - 1), |segment| source.index(segment, count))?;
        let fraction = number_or(fraction, 1.0, |v| check_fraction(source, v))?;
        Ok(self.refinement.place(segments, index, fraction))
    }
}

/// What is asked for, and some of the names that there are.
pub(crate) fn known_names<'a>(asked: &str, rods: impl Iterator<Item = &'a RodInfo>) -> String {
    const SHOWN: usize = 8;
    let mut known: Vec<_> = rods.take(SHOWN + 1).map(|rod| format!("`{}`", rod.name)).collect();
    if known.len() > SHOWN {
        known[SHOWN] = "...".to_owned();
    }
    match known.is_empty() {
        true => format!("{asked}, and there is none"),
        false => format!("{asked}: {}", known.join(", ")),
    }
}

/// A fraction of a segment's length.
pub(crate) fn check_fraction(source: &Source, value: &format::Number) -> Result<f64> {
    source.number(value, |v| (0.0..=1.0).contains(&v), "0 (the segment's start) to 1 (its end)")
}

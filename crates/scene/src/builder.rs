//! Rods, their names, and the joints between them: what entries of the file are built with.

use std::collections::HashMap;
use std::ops::Range;

use nalgebra::{UnitQuaternion, Vector3};
use rod::{Assembly, RodSpec, Segment};
use toml::Spanned;

use crate::error::{Result, Source, short};
use crate::refine::Refinement;
use crate::shape::number_or;
use crate::{RodInfo, format};

/// How far apart two joined places may lie, in units of the shorter segment.
const JOIN_TOLERANCE: f64 = 0.01;

/// The rods built so far.
pub(crate) struct Builder {
    pub(crate) refinement: Refinement,
    pub(crate) assembly: Assembly,
    pub(crate) rods: Vec<RodInfo>,
    /// How long the scene is run [s].
    pub(crate) end: f64,
    by_name: HashMap<String, usize>,
}

impl Builder {
    /// A builder without rods, whose segments will be cut into parts.
    pub(crate) fn new(refinement: Refinement, assembly: Assembly, end: f64) -> Self {
        Self { refinement, assembly, rods: Vec::new(), end, by_name: HashMap::new() }
    }

    pub(crate) fn segment(&mut self, i: usize) -> Segment {
        self.assembly.model_mut().segments[i]
    }

    pub(crate) fn orientation(&mut self, i: usize) -> UnitQuaternion<f64> {
        self.assembly.state_mut().orientations[i]
    }

    /// Place [m] at a fraction of a segment's length.
    pub(crate) fn point(&mut self, i: usize, fraction: f64) -> Vector3<f64> {
        let length = self.segment(i).length;
        let state = self.assembly.state_mut();
        state.positions[i] + state.axis(i) * ((fraction - 0.5) * length)
    }

    /// `given` or `default`, if no rod has that name yet; `span` is the entry's place in the text.
    pub(crate) fn new_name(
        &self,
        source: &Source,
        given: &Option<Spanned<String>>,
        default: String,
        span: Range<usize>,
    ) -> Result<String> {
        let name = given.as_ref().map_or(default, |name| name.get_ref().clone());
        match self.by_name.contains_key(&name) {
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
        self.by_name.insert(name.clone(), self.rods.len());
        self.rods.push(RodInfo { name, segments: segments.clone(), closed: spec.closed });
        segments
    }

    pub(crate) fn join(&mut self, source: &Source, join: &Spanned<format::Join>) -> Result<()> {
        let format::Join { a, b, joint } = join.get_ref();
        let ((a, fraction_a), (b, fraction_b)) = (self.place(source, a)?, self.place(source, b)?);
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

    /// Segment of the model and fraction of its length.
    pub(crate) fn place(&self, source: &Source, place: &format::Place) -> Result<(usize, f64)> {
        let Some(&rod) = self.by_name.get(place.rod.get_ref()) else {
            const SHOWN: usize = 8;
            let mut known: Vec<_> = self.rods.iter().take(SHOWN).map(|rod| format!("`{}`", rod.name)).collect();
            if self.rods.len() > SHOWN {
                known.push("...".to_owned());
            }
            let allowed = match known.is_empty() {
                true => "the name of a rod that comes before it, and there is none".to_owned(),
                false => format!("the name of a rod that comes before it: {}", known.join(", ")),
            };
            return source.must_be(place.rod.span(), &allowed);
        };
        let segments = &self.rods[rod].segments;
        let count = self.refinement.count(segments);
        let index = place.segment.as_ref().map_or(Ok(count - 1), |segment| source.index(segment, count))?;
        let fraction = number_or(&place.fraction, 1.0, |v| check_fraction(source, v))?;
        Ok(self.refinement.place(segments, index, fraction))
    }
}

/// A fraction of a segment's length.
pub(crate) fn check_fraction(source: &Source, value: &format::Number) -> Result<f64> {
    source.number(value, |v| (0.0..=1.0).contains(&v), "0 (the segment's start) to 1 (its end)")
}

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
    /// Of each rod the one that it grows on.
    pub(crate) parents: Vec<Option<usize>>,
    /// How long the scene is run [s].
    pub(crate) end: f64,
    by_name: HashMap<String, usize>,
}

impl Builder {
    /// A builder without rods, whose segments will be cut into parts.
    pub(crate) fn new(refinement: Refinement, assembly: Assembly, end: f64) -> Self {
        Self { refinement, assembly, rods: Vec::new(), parents: Vec::new(), end, by_name: HashMap::new() }
    }

    pub(crate) fn segment(&mut self, i: usize) -> Segment {
        self.assembly.model_mut().segments[i]
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

    /// `given` or `default`, if no rod has that name yet; `span` is the entry's place in the text.
    pub(crate) fn new_name(
        &self,
        source: &Source,
        given: &Option<Spanned<String>>,
        default: String,
        span: Range<usize>,
    ) -> Result<String> {
        let name = given.as_ref().map_or(default, |name| name.get_ref().clone());
        match self.has(&name) {
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

    /// Number of segments so far.
    pub(crate) fn segments(&self) -> usize {
        self.rods.last().map_or(0, |rod| rod.segments.end)
    }

    /// Fixes all parts of the file's segment `index` of a rod.
    pub(crate) fn fix(&mut self, rod: &Range<usize>, index: usize) {
        for part in self.refinement.parts(rod, index) {
            self.assembly.fix(part);
        }
    }

    pub(crate) fn join(&mut self, source: &Source, join: &Spanned<format::Join>) -> Result<()> {
        let format::Join { a, b } = join.get_ref();
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
        Ok(())
    }

    /// Joins two segments at fractions of their lengths, as [`Assembly::join`].
    pub(crate) fn join_at(&mut self, a: (usize, f64), b: (usize, f64)) {
        self.assembly.join(a.0, a.1, b.0, b.1);
    }

    /// The rod of a name.
    pub(crate) fn rod(&self, source: &Source, name: &Spanned<String>) -> Result<&RodInfo> {
        let Some(&rod) = self.by_name.get(name.get_ref()) else {
            return source.must_be(name.span(), &self.known_rods("the name of a rod that comes before it"));
        };
        Ok(&self.rods[rod])
    }

    /// Segment of the model and fraction of its length.
    pub(crate) fn place(&self, source: &Source, place: &format::Place) -> Result<(usize, f64)> {
        let segments = &self.rod(source, &place.rod)?.segments;
        let count = self.refinement.count(segments);
        let index = place.segment.as_ref().map_or(Ok(count - 1), |segment| source.index(segment, count))?;
        let fraction = number_or(&place.fraction, 1.0, |v| check_fraction(source, v))?;
        Ok(self.refinement.place(segments, index, fraction))
    }

    /// What is asked for, and some of the names that there are.
    pub(crate) fn known_rods(&self, asked: &str) -> String {
        const SHOWN: usize = 8;
        let mut known: Vec<_> = self.rods.iter().take(SHOWN).map(|rod| format!("`{}`", rod.name)).collect();
        if self.rods.len() > SHOWN {
            known.push("...".to_owned());
        }
        match known.is_empty() {
            true => format!("{asked}, and there is none"),
            false => format!("{asked}: {}", known.join(", ")),
        }
    }
}

/// A fraction of a segment's length.
pub(crate) fn check_fraction(source: &Source, value: &format::Number) -> Result<f64> {
    source.number(value, |v| (0.0..=1.0).contains(&v), "0 (the segment's start) to 1 (its end)")
}

//! The checks of a model: numbers, indices, motions, changes.

use std::collections::HashMap;
use std::ops::Range;

use crate::driven::begins_at;
use crate::error::unit;
use crate::{Body, Changing, DriveError, Driven, Freedom, InnerDamping, Joint, Model, ModelError, Mount, State};

impl Model {
    /// Checks every number and index, and that `state` fits: what all functions that take a model and a state expect.
    ///
    /// # Errors
    /// The first thing found wrong, with the place and what is allowed.
    pub fn validate(&self, state: &State) -> Result<(), ModelError> {
        const POSITIVE: &str = "finite and > 0";
        const NOT_NEGATIVE: &str = "finite and >= 0";
        const FINITE: &str = "finite";
        let positive = |what, index, quantity, value: f64| {
            if value.is_finite() && value > 0.0 {
                return Ok(());
            }
            Err(ModelError::Value { what, index, quantity, value, allowed: POSITIVE })
        };
        let not_negative = |what, index, quantity, value: f64| {
            if value.is_finite() && value >= 0.0 {
                return Ok(());
            }
            Err(ModelError::Value { what, index, quantity, value, allowed: NOT_NEGATIVE })
        };
        let finite = |what, index, quantity, values: &[f64]| match values.iter().find(|v| !v.is_finite()) {
            None => Ok(()),
            Some(&value) => Err(ModelError::Value { what, index, quantity, value, allowed: FINITE }),
        };
        if let Some(mistake) = &self.mistake {
            return Err(mistake.clone());
        }
        for (i, s) in self.segments.iter().enumerate() {
            let count = self.segments.len();
            if s.rod >= count {
                return Err(ModelError::Index { what: "segment", index: i, target: "rod", to: s.rod, count });
            }
            positive("segment", i, "length", s.length)?;
            positive("segment", i, "radius", s.radius)?;
            positive("segment", i, "density", s.density)?;
            positive("segment", i, "axial inertia", s.axial_inertia())?;
            positive("segment", i, "mass", s.own_mass())?;
            not_negative("segment", i, "added mass", s.added_mass)?;
            if let Some(body) = &s.body {
                positive("segment", i, "mass", body.mass)?;
                body.shape.sizes().into_iter().try_for_each(|(name, size)| positive("segment", i, name, size))?;
                body.inertia.iter().try_for_each(|&moment| positive("segment", i, "moment of inertia", moment))?;
                not_negative("segment", i, "drag area", body.drag_area)?;
                let (most, sum) = (body.inertia.max(), body.inertia.sum());
                if most > (sum - most) * (1.0 + 1e-9) {
                    let (quantity, allowed) = ("largest moment of inertia", "no more than the sum of the other two");
                    return Err(ModelError::Value { what: "segment", index: i, quantity, value: most, allowed });
                }
            }
        }
        for (i, j) in self.joints.iter().enumerate() {
            self.validate_joint(i, j)?;
            positive("joint", i, "length", j.length)?;
            finite("joint", i, "offset", &[j.offset_a, j.offset_b])?;
            finite("joint", i, "rest Darboux vector", j.rest_darboux.as_slice())?;
            not_negative("joint", i, "stretch compliance", j.stretch_compliance)?;
            not_negative("joint", i, "shear compliance", j.shear_compliance)?;
            not_negative("joint", i, "shear compliance along d2", j.shear_compliance + j.shear_extra)?;
            not_negative("joint", i, "bend compliance", j.bend_compliance)?;
            not_negative("joint", i, "bend compliance about d2", j.bend_twist_compliance().y)?;
            not_negative("joint", i, "twist compliance", j.twist_compliance)?;
            // Beside the free axis a root of zero would leave moments to rounding.
            if j.freedom == Freedom::Hinge {
                positive("joint", i, "bend compliance of a hinge", j.bend_compliance)?;
            }
            if let Some(Mount { across: [a, b] }) = &j.mount {
                finite("joint", i, "place", &[a.x, a.y, b.x, b.y])?;
            }
            for frame in &j.rest_frames {
                unit("joint", i, "norm of a rest frame", frame.as_vector().norm())?;
            }
            let InnerDamping { bending, twist, stretch } = j.inner_damping;
            not_negative("joint", i, "relaxation time of bending", bending)?;
            not_negative("joint", i, "relaxation time of twist", twist)?;
            not_negative("joint", i, "relaxation time of stretch", stretch)?;
        }
        for (i, a) in self.anchors.iter().enumerate() {
            finite("anchor", i, "position", a.position.as_slice())?;
            finite("anchor", i, "orientation", a.orientation.as_vector().as_slice())?;
            unit("anchor", i, "norm of the orientation", a.orientation.as_vector().norm())?;
        }
        for &to in &self.open {
            self.check_body("open", to, Body::Anchor(to))?;
        }
        for (i, l) in self.loads.iter().enumerate() {
            if l.segment >= self.segments.len() {
                let count = self.segments.len();
                return Err(ModelError::Index { what: "load", index: i, target: "segment", to: l.segment, count });
            }
            finite("load", i, "offset", &[l.offset])?;
            finite("load", i, "force", l.force.as_slice())?;
            finite("load", i, "torque", l.torque.as_slice())?;
        }
        self.validate_sliding_joints()?;
        self.pulleys.iter().enumerate().try_for_each(|(index, pulley)| pulley.validate(self, index))?;
        self.validate_laws()?;
        self.validate_strengths()?;
        finite("model", 0, "gravity", self.gravity.as_slice())?;
        not_negative("model", 0, "linear damping", self.damping.linear)?;
        not_negative("model", 0, "angular damping", self.damping.angular)?;
        self.contacts.validate()?;
        crate::sheath::validate(self)?;
        if let Some(air) = &self.air {
            air.validate()?;
        }
        self.validate_state(state)?;
        validate_changes(self)?;
        validate_motions(self, state)
    }

    /// Checks the sliding joints.
    fn validate_sliding_joints(&self) -> Result<(), ModelError> {
        let what = "sliding joint";
        for (index, joint) in self.sliding_joints.iter().enumerate() {
            let value = |quantity, value, allowed| Err(ModelError::Value { what, index, quantity, value, allowed });
            self.check_threaded(what, index, &joint.segments, joint.holder)?;
            if let Some(&x) = joint.place.iter().find(|x| !x.is_finite()) {
                return value("place", x, "finite");
            }
            if !(joint.friction.is_finite() && joint.friction >= 0.0) {
                return value("friction", joint.friction, "finite and >= 0");
            }
            if !(joint.start >= 0.0 && joint.start <= joint.centreline(self).length()) {
                return value("start", joint.start, "between 0 and the rod's length");
            }
            joint.validate_feed(self, index)?;
        }
        Ok(())
    }

    /// Checks the segments of a rod that runs through something, and the body that this is part of.
    pub(crate) fn check_threaded(
        &self,
        what: &'static str,
        index: usize,
        segments: &Range<usize>,
        holder: Body,
    ) -> Result<(), ModelError> {
        let value = |quantity, value, allowed| Err(ModelError::Value { what, index, quantity, value, allowed });
        let Range { start, end } = *segments;
        let last = if end > start { end - 1 } else { start };
        self.check_body(what, index, Body::Segment(last))?;
        self.check_body(what, index, holder)?;
        if end <= start {
            return value("number of segments", 0.0, "at least 1");
        }
        let rod = self.segments[start].rod;
        if self.segments[segments.clone()].iter().any(|segment| segment.rod != rod) {
            return value("last segment", last as f64, "of the same rod as the first");
        }
        if let Body::Segment(holder) = holder
            && segments.contains(&holder)
        {
            return value("its holder, segment", holder as f64, "no segment of the rod that runs through it");
        }
        Ok(())
    }

    /// Checks that there is the body that something of the model points to.
    pub(crate) fn check_body(&self, what: &'static str, index: usize, body: Body) -> Result<(), ModelError> {
        let (target, to, count) = match body {
            Body::Segment(to) => ("segment", to, self.segments.len()),
            Body::Anchor(to) => ("anchor", to, self.anchors.len()),
        };
        if to >= count { Err(ModelError::Index { what, index, target, to, count }) } else { Ok(()) }
    }

    fn validate_joint(&self, index: usize, joint: &Joint) -> Result<(), ModelError> {
        for body in [joint.a, joint.b] {
            self.check_body("joint", index, body)?;
        }
        if joint.a == joint.b || matches!((joint.a, joint.b), (Body::Anchor(_), Body::Anchor(_))) {
            return Err(ModelError::Degenerate { index });
        }
        Ok(())
    }

    fn validate_state(&self, state: &State) -> Result<(), ModelError> {
        let expected = self.segments.len();
        let sizes =
            [state.positions.len(), state.orientations.len(), state.velocities.len(), state.angular_velocities.len()];
        if let Some(&found) = sizes.iter().find(|&&n| n != expected) {
            return Err(ModelError::StateSize { found, expected });
        }
        self.validate_internals(state)?;
        for index in 0..expected {
            let vectors = [
                ("position", state.positions[index].as_slice()),
                ("orientation", state.orientations[index].as_vector().as_slice()),
                ("velocity", state.velocities[index].as_slice()),
                ("angular velocity", state.angular_velocities[index].as_slice()),
            ];
            for (quantity, values) in vectors {
                if let Some(&value) = values.iter().find(|v| !v.is_finite()) {
                    return Err(ModelError::Value { what: "segment", index, quantity, value, allowed: "finite" });
                }
            }
            unit("segment", index, "norm of the orientation", state.orientations[index].as_vector().norm())?;
        }
        Ok(())
    }
}

/// Checks the motions of a model whose bodies and state are valid otherwise.
fn validate_motions(model: &Model, state: &State) -> Result<(), ModelError> {
    let mut drivers = std::collections::HashMap::<Body, Vec<usize>>::new();
    for (index, driven) in model.motions.iter().enumerate() {
        let body = driven.body;
        model.check_body("motion", index, body)?;
        let wrong = |mistake| Err(ModelError::Motion { index, mistake });
        let Driven { from, until, .. } = *driven;
        if !(from.is_finite() && until > from.max(0.0)) {
            return wrong(DriveError::Times { from, until });
        }
        let others = drivers.entry(body).or_default();
        let meets = |other: &&usize| model.motions[**other].from < until && from < model.motions[**other].until;
        if let Some(other) = others.iter().find(meets) {
            return wrong(DriveError::Twice(*other));
        }
        others.push(index);
        if from > 0.0 {
            continue;
        }
        match body {
            Body::Segment(i) if !model.segments[i].fixed => return wrong(DriveError::Free(i)),
            Body::Anchor(i) if model.open.contains(&i) => return wrong(DriveError::Open(i)),
            _ => {}
        }
        if let Err(mistake) = begins_at(&model.pose(body, state), &driven.at(0.0).pose) {
            return wrong(mistake);
        }
    }
    for (index, driven) in model.motions.iter().enumerate().filter(|(_, driven)| driven.from > 0.0) {
        let is_held = match driven.body {
            Body::Segment(i) => model.segments[i].fixed,
            Body::Anchor(i) => !model.open.contains(&i),
        };
        if is_held && !drivers[&driven.body].iter().any(|&other| model.motions[other].from <= 0.0) {
            return Err(ModelError::Motion { index, mistake: DriveError::Held(driven.body) });
        }
    }
    Ok(())
}

/// Checks that what changes and what is lifted is there, and that nothing changes in two ways.
fn validate_changes(model: &Model) -> Result<(), ModelError> {
    for (index, lift) in model.lifts.iter().enumerate() {
        let (to, count) = (lift.load, model.loads.len());
        if to >= count {
            return Err(ModelError::Index { what: "lift", index, target: "load", to, count });
        }
    }
    let mut first = HashMap::new();
    for (index, change) in model.changes.iter().enumerate() {
        let refers = match change.of {
            Changing::Gravity => None,
            Changing::Force(to) | Changing::Torque(to) => Some(("load", to, model.loads.len())),
            Changing::Rest(to) => Some(("joint", to, model.joints.len())),
        };
        if let Some((target, to, count)) = refers.filter(|(_, to, count)| to >= count) {
            return Err(ModelError::Index { what: "change", index, target, to, count });
        }
        if let Some(other) = first.insert(change.of, index) {
            return Err(ModelError::Twice { index, other });
        }
    }
    Ok(())
}

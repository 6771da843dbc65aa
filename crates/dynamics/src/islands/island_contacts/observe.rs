//! How far contacts are from their laws at new poses.

use contact::geometry::Contact;
use contact::shape::{Poses, Shape};
use friction::cone::{Coulomb, natural_residual};
use kernels::Spatial;
use kernels::math::{Sym3, Vec3};

use super::super::culling;
use super::super::sets::Sets;
use super::super::shared::Shared;
use super::{IslandContacts, push};
use crate::counters::Counters;

impl IslandContacts {
    /// Evaluates the contacts at the new poses; returns the largest error, where one of `tolerance` is good enough: relative to
    /// the radius, or to less where `tolerance` times that is more than gravity moves in a step.
    pub(crate) fn observe(
        &mut self,
        shared: &Shared,
        components: &mut Sets<'_>,
        tolerance: f64,
        iteration: usize,
        counters: &mut Counters,
    ) -> f64 {
        if !shared.detector.covers(&self.search, components) {
            self.find(shared, components, counters);
            if shared.detector.allows_overlap() {
                self.evaluate(shared, components, (Poses::Start, false), counters);
                self.let_overlaps_out(shared);
            }
        }
        let fall = 0.5 * shared.slow * self.dt.powi(2);
        self.unit = if fall > 0.0 { fall / tolerance } else { f64::INFINITY };
        self.hysteresis = shared.params.place_hysteresis * tolerance;
        if !self.contacts.is_empty() {
            culling::note_moves(&self.search.segments, shared.detector.shapes(), components);
        }
        // In the first iteration bodies are far from where they will be.
        let turns = iteration > 0;
        let error = |stage: &mut Self, components: &mut Sets<'_>, poses: Poses, counters: &mut Counters| {
            stage.evaluate(shared, components, (poses, turns), counters);
            stage.aim_bounces(shared, components);
            stage.error(shared, components, tolerance)
        };
        if iteration < shared.params.settle_after {
            self.normals.clear();
            if iteration == 0 {
                self.normals.extend(self.contacts.iter().map(|contact| contact.normal));
            }
            let worst = error(self, components, Poses::Now, counters);
            // What ends with the first iteration ends with forces along its normals.
            if worst <= tolerance && iteration == 0 {
                self.contacts.iter_mut().zip(&self.normals).for_each(|(contact, &before)| contact.turn_impulse(before));
                self.press(shared, components);
            }
            return worst;
        }
        error(self, components, Poses::Settling, counters)
    }

    /// The largest error of the contacts as they are evaluated.
    fn error(&mut self, shared: &Shared, components: &mut Sets<'_>, tolerance: f64) -> f64 {
        let (mut worst, mut is_finite) = (0.0_f64, true);
        for contact in &mut self.contacts {
            contact.residual = 0.0;
            if contact.is_left_out || (contact.is_duplicate && contact.impulse == Vec3::zero()) {
                continue;
            }
            let short = contact.gap - contact.target;
            contact.residual = if contact.compliance[0] > 0.0 {
                let [_, first, second] = contact.local(contact.slip);
                let (force, w) = (contact.local(contact.impulse), [short, first, second]);
                let friction = Coulomb(contact.coefficient);
                let [normal, across] = natural_residual(contact.compliance, force, w, friction);
                // Where surfaces slide far, the direction of friction need not be nearer than this.
                let slip = contact.slip.norm_squared().sqrt() * (shared.params.slip_direction_tolerance / tolerance);
                // Where other places are nearer, bodies are deeper in each other there.
                normal.max(across / (slip / contact.radius).max(1.0)).max(contact.closer_by - short)
            } else {
                (-short).max(0.0)
            } / contact.radius.min(self.unit);
            is_finite &= short.is_finite() && contact.slip.norm_squared().is_finite();
            worst = worst.max(contact.residual);
        }
        self.press(shared, components);
        if worst <= tolerance {
            // Once a contact and step, so that this ends.
            let turns =
                self.contacts.iter_mut().filter(|contact| contact.has_coefficient).map(Contact::stick_as_it_turns);
            if turns.fold(false, |any, turns| any | turns) {
                worst = 2.0 * tolerance;
            }
        }
        if is_finite { worst } else { f64::NAN }
    }

    /// Sums the impulses of the step in the components' `pushed`, with the current arms, and the stiffness of contacts.
    fn press(&self, shared: &Shared, components: &mut Sets<'_>) {
        for component in components.iter_mut() {
            component.component.pushed.fill(Spatial::zero());
            component.component.contact_stiffness.fill(Sym3::zero());
        }
        let shapes = shared.detector.shapes();
        for contact in self.contacts.iter().filter(|contact| contact.impulse != Vec3::zero()) {
            stiffen(contact, shapes, components);
            push(contact, shapes, components, contact.impulse, |component| &mut component.pushed);
        }
    }
}

/// Adds the geometric stiffness of a contact to that of its bodies: see `stiffness.rs`.
fn stiffen(contact: &Contact, shapes: &[Shape], components: &mut Sets<'_>) {
    let force = contact.impulse.dot(contact.normal).max(0.0);
    let sides = [Some(contact.key.0), contact.key.1.segment()];
    for (index, arm) in sides.into_iter().zip(contact.tilt_arms).filter(|(_, arm)| *arm > 0.0) {
        let Some(Shape { component, body, .. }) = index.map(|index| &shapes[index as usize]) else { continue };
        let component = &mut components[*component as usize].component;
        let tilt = component.poses[*body as usize].q.axis().cross(contact.normal);
        component.contact_stiffness[*body as usize] += Sym3::outer(tilt, force * arm);
    }
}

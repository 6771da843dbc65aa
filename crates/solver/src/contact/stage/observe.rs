//! How far contacts are from their laws at new poses.

use super::super::cone::{Bound, natural_residual};
use super::super::geometry::{Contact, Poses};
use super::super::reach;
use super::super::rest::Rest;
use super::super::sets::Sets;
use super::super::shared::Shared;
use super::{GOOD, Stage, push};
use crate::counters::Counters;
use crate::formulation::Formulation;
use crate::kernel::Spatial;
use crate::kernel::math::Vec3;

impl Stage {
    /// Evaluates the contacts at the new poses; returns the largest error, where one of `tolerance` is good enough: relative to
    /// the radius, or to less where `tolerance` times that is more than gravity moves in a step.
    pub(crate) fn observe(
        &mut self,
        shared: &Shared,
        components: &mut Sets<'_>,
        formulation: Formulation,
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
        self.steady = if formulation.momentum() { shared.params.steady * tolerance } else { 0.0 };
        if !self.contacts.is_empty() {
            reach::note_moves(&self.search.segments, shared.detector.shapes(), components);
        }
        // A momentum residual would see the turn and take it back; in the first iteration bodies are far from where they will be.
        let turns = iteration > 0 && !formulation.momentum();
        let error = |stage: &mut Self, components: &mut Sets<'_>, poses: Poses, counters: &mut Counters| {
            stage.evaluate(shared, components, (poses, turns), counters);
            stage.error(shared, components, formulation, tolerance, iteration)
        };
        if iteration < shared.params.settle_after {
            self.normals.clear();
            if iteration == 0 && !formulation.momentum() {
                self.normals.extend(self.contacts.iter().map(|contact| contact.normal));
            }
            let worst = error(self, components, Poses::Now, counters);
            // What ends with the first iteration ends with forces along its normals.
            if worst <= tolerance {
                self.contacts.iter_mut().zip(&self.normals).for_each(|(contact, &before)| contact.turn_impulse(before));
            }
            return worst;
        }
        if !formulation.momentum() {
            let worst = error(self, components, Poses::Held, counters);
            if worst > tolerance {
                return worst;
            }
        }
        // What counts is the nearest places.
        error(self, components, Poses::Settling, counters)
    }

    /// The largest error of the contacts as they are evaluated.
    fn error(
        &mut self,
        shared: &Shared,
        components: &mut Sets<'_>,
        formulation: Formulation,
        tolerance: f64,
        iteration: usize,
    ) -> f64 {
        // The momentum residual sees each change of an impulse.
        let after = |iterations: usize| formulation.momentum() && iteration >= iterations;
        let (settles, rests) = (after(shared.params.settle_after), after(2 * shared.params.settle_after));
        if formulation.momentum() {
            self.rests.resize(self.contacts.len(), Rest::default());
        }
        let mut worst = 0.0_f64;
        for (index, contact) in self.contacts.iter_mut().enumerate() {
            contact.residual = 0.0;
            if contact.is_left_out {
                continue;
            }
            let mut rest = self.rests.get_mut(index);
            if let Some(rest) = &mut rest {
                rest.left = [0.0; 3];
                if settles && (!rests || rest.bound.is_none()) {
                    rest.keep_bound(contact);
                }
            }
            if contact.doubled && contact.impulse == Vec3::zero() {
                continue;
            }
            let short = contact.gap - contact.target;
            let gap_and_slip = |contact: &Contact| {
                let [_, first, second] = contact.local(contact.slip);
                [short, first, second]
            };
            contact.residual = if contact.compliance[0] > 0.0 {
                let (force, w) = (contact.local(contact.impulse), gap_and_slip(contact));
                let lawful = natural_residual(contact.compliance, force, w, Bound::Coulomb(contact.coefficient));
                let [normal, across] = match &mut rest {
                    // A bound that stays may no longer be that of the normal impulse that there is.
                    Some(rest) if rests && lawful[1] > tolerance * contact.radius.min(self.unit) => {
                        rest.keep_bound(contact);
                        lawful
                    }
                    Some(rest) => natural_residual(contact.compliance, force, w, rest.bound(contact)),
                    None => lawful,
                };
                // Where surfaces slide far, the direction of friction need not be nearer than this.
                let slip = contact.slip.norm_squared().sqrt() * (shared.params.sliding / tolerance);
                // Where other places are nearer, bodies are deeper in each other there.
                normal.max(across / (slip / contact.radius).max(1.0)).max(contact.nearer - short)
            } else {
                (-short).max(0.0)
            } / contact.radius.min(self.unit);
            if let Some(rest) = rest
                && rests
                && contact.residual <= GOOD * tolerance
            {
                rest.left = rest.unanswered(contact, gap_and_slip(contact));
            }
            worst = if contact.residual.is_nan() { f64::NAN } else { worst.max(contact.residual) };
        }
        if formulation.momentum() {
            self.press(shared, components);
        }
        worst
    }

    /// Sums the impulses of the step in the components' `pushed`, with the current arms.
    fn press(&self, shared: &Shared, components: &mut Sets<'_>) {
        for component in components.iter_mut() {
            component.component.pushed.fill(Spatial::zero());
        }
        let shapes = shared.detector.shapes();
        for contact in self.contacts.iter().filter(|contact| contact.impulse != Vec3::zero()) {
            push(contact, shapes, components, contact.impulse, |component| &mut component.pushed);
        }
    }
}

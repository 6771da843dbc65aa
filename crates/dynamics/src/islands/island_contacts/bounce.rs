//! Bounces: contacts whose bodies meet fast in a step part in it, with Newton's restitution.
//!
//! As if they had turned round as the step begins: their places part by `e v dt` along the normal, `v` how fast they met. Places and
//! velocities are those of the arms on which the impulse acts, so that it does the work `J (v+ - v-) / 2 <= 0`. Over the step the places go
//! by another way than their velocities times dt, as bodies turn: a corner that turns by psi about a height h comes lower by `h psi^2 / 2`. That is
//! counted at each new pose, with the spins at the start of the step: those over a step are of its middle. It must not know how contacts are solved.

use component::Component;
use contact::geometry::{Contact, World};
use contact::key::Key;
use kernels::Spatial;
use kernels::math::Vec3;
use rod::Surface;

use super::super::sets::Sets;
use super::super::shared::Shared;
use super::{IslandContacts, correction};

/// A contact whose bodies meet fast in a step, and are to part again.
pub(super) struct Bounce {
    key: Key,
    /// The gap to keep without it [m], and the gap at the start of the step [m].
    from: f64,
    gap: f64,
    restitution: f64,
    /// By how much slower they meet than at the start of the step, as their rods hold them up; below 0 where forces press them on [m/s].
    held_up: f64,
}

/// Sight of two bodies at a contact.
struct Side<'a> {
    world: &'a World<'a>,
    components: &'a Sets<'a>,
    dt: f64,
}

impl Side<'_> {
    fn of(&self, i: u32) -> (&Component<f64>, usize) {
        let shape = &self.world.shapes[i as usize];
        (&self.components[shape.component as usize].component, shape.body as usize)
    }

    /// Velocity and spin at the start of the step [m/s, rad/s].
    fn before(&self, i: u32) -> Spatial<f64> {
        let (component, body) = self.of(i);
        let spin = component.velocities[body].angular;
        let angular = component.spin_after(body, spin, component.start[body].q, 0.5 * self.dt);
        Spatial { linear: component.velocity(body, 0), angular }
    }

    /// By how much a place of the body goes farther over the step than its velocity after the bounce times dt says [m].
    fn farther(&self, i: u32, arm: Vec3<f64>) -> Vec3<f64> {
        let (component, body) = self.of(i);
        let (start, now) = (component.start[body].q, component.poses[body].q);
        let spin = (now * start.conj()).upper().v * (2.0 / self.dt);
        let spin = component.spin_after(body, spin, now, -0.5 * self.dt);
        arm - start.rotate(now.rotate_back(arm)) - spin.cross(arm) * self.dt
    }

    /// How fast the bodies met along the normal, before the step [m/s].
    fn speed(&self, contact: &Contact) -> f64 {
        let own = contact.relative(|i| self.before(i));
        // An obstacle whose velocity changes meets with that over the step, which is the one that its work is done at.
        let obstacle = contact.key.1.obstacle().map(|i| &self.world.obstacles[i as usize]);
        let way = obstacle.map_or(Vec3::zero(), |obstacle| obstacle.way_of(contact.arms[1]));
        (way * (1.0 / self.dt) - own).dot(contact.normal)
    }

    /// [`Self::farther`] of the two along the normal. Of what is round, its axis.
    fn bend(&self, contact: &Contact) -> f64 {
        let radius = |i: u32| if self.world.is_mesh(i) { 0.0 } else { self.world.shapes[i as usize].radius };
        let axis = |i: u32, arm: Vec3<f64>, side: f64| self.farther(i, arm + contact.normal * (side * radius(i)));
        let own = axis(contact.key.0, contact.arms[0], 1.0);
        let between = contact.others().fold(own, |sum, (i, arm, share)| sum - axis(i, arm, -1.0) * share);
        between.dot(contact.normal)
    }
}

impl IslandContacts {
    /// Notes the contacts that meet fast, and raises the gap that they keep, so that they part again.
    pub(super) fn find_bounces(&mut self, shared: &Shared, components: &Sets<'_>) {
        let world = shared.detector.world(&self.search);
        let side = Side { world: &world, components, dt: self.dt };
        for contact in &mut self.contacts {
            let Surface { restitution, .. } = shared.detector.surface(contact.key.1);
            if restitution == 0.0 {
                continue;
            }
            let speed = side.speed(contact);
            if speed > shared.slow * self.dt && contact.gap < speed * self.dt {
                // An overlap that is let out must not leave at once.
                let from = if contact.target < 0.0 { contact.target } else { contact.gap.max(0.0) };
                contact.target = from + restitution * speed * self.dt;
                self.bounces.push(Bounce { key: contact.key, from, gap: contact.gap, restitution, held_up: 0.0 });
            }
        }
    }

    /// Lets bodies part no faster than is possible without a gain of energy, from the rods' own solution of the step: forces that press bodies on
    /// while they meet act on what leaves, and of bodies that their rods slow down on the way as much is given back as they arrive with.
    pub(crate) fn limit_bounces(&mut self, shared: &Shared, components: &Sets<'_>) {
        let world = shared.detector.world(&self.search);
        let side = Side { world: &world, components, dt: self.dt };
        for bounce in &mut self.bounces {
            let Some(contact) = self.contacts.iter().find(|contact| contact.key == bounce.key) else { continue };
            let way = contact.relative(|i| correction(components, &world.shapes[i as usize])).dot(contact.normal);
            let arrives = (bounce.gap - contact.gap - way + side.bend(contact)) / self.dt;
            bounce.held_up = side.speed(contact) - arrives;
        }
        self.aim_bounces(shared, components);
    }

    /// Sets the gaps of bounces for the poses as they are.
    pub(super) fn aim_bounces(&mut self, shared: &Shared, components: &Sets<'_>) {
        let world = shared.detector.world(&self.search);
        let side = Side { world: &world, components, dt: self.dt };
        for &Bounce { key, from, restitution, held_up, .. } in &self.bounces {
            let found = self.contacts.iter_mut().find(|contact| contact.key == key && !contact.is_left_out);
            let Some(contact) = found else { continue };
            let speed = side.speed(contact);
            let leaves = restitution * speed.min(speed - held_up) + held_up.min(0.0);
            contact.target = from + leaves.max(0.0) * self.dt + side.bend(contact);
        }
    }
}

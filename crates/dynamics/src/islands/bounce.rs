//! Bounces: contacts whose bodies meet fast in a step part in it, with Newton's restitution.
//!
//! As if they had turned round as the step begins: their places part by `e v dt` along the normal, `v` how fast they met. Places and
//! velocities are those of the arms on which the impulse acts, so that it does the work `J (v+ - v-) / 2 <= 0`. Over the step the places go
//! by another way than their velocities times dt, as bodies turn: a corner that turns by psi about a height h comes lower by `h psi^2 / 2`. That is
//! counted at each new pose, with the spins at the start of the step: those over a step are of its middle. Where friction gives energy, as it may in impacts
//! by this law (Kane and Levinson, "Dynamics", 1985), bodies part that much slower. It must not know how contacts are solved.

use component::Component;
use contact::geometry::{Contact, World};
use contact::key::Key;
use kernels::Spatial;
use kernels::math::Vec3;

use super::sets::Sets;

/// A contact whose bodies meet fast in a step, and are to part again.
pub(super) struct Bounce {
    pub(super) key: Key,
    /// The gap to keep without it [m], and the gap at the start of the step [m].
    pub(super) from: f64,
    pub(super) gap: f64,
    pub(super) restitution: f64,
    /// By how much slower they meet than at the start of the step, as their rods hold them up; below 0 where forces press them on [m/s].
    pub(super) held_up: f64,
}

/// Sight of two bodies at a contact.
pub(super) struct Impact<'a> {
    pub(super) world: &'a World<'a>,
    pub(super) components: &'a Sets<'a>,
    pub(super) dt: f64,
}

impl Impact<'_> {
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

    /// The same after the bounce, at the poses as they are.
    fn after(&self, i: u32) -> Spatial<f64> {
        let (component, body) = self.of(i);
        let (start, now) = (component.start[body], component.poses[body]);
        let spin = (now.q * start.q.conj()).upper().v * (2.0 / self.dt);
        let angular = component.spin_after(body, spin, now.q, -0.5 * self.dt);
        Spatial { linear: (now.x - start.x) * (1.0 / self.dt), angular }
    }

    /// By how much a place of the body goes farther over the step than its velocity after the bounce times dt says [m].
    fn farther(&self, i: u32, arm: Vec3<f64>) -> Vec3<f64> {
        let (component, body) = self.of(i);
        let (start, now) = (component.start[body].q, component.poses[body].q);
        arm - start.rotate(now.rotate_back(arm)) - self.after(i).angular.cross(arm) * self.dt
    }

    /// Velocity of an obstacle at the contact over the step [m/s]: that of one that changes at which its work is done.
    fn obstacle(&self, contact: &Contact) -> Vec3<f64> {
        let obstacle = contact.key.1.obstacle().map(|i| &self.world.obstacles[i as usize]);
        obstacle.map_or(Vec3::zero(), |obstacle| obstacle.way_of(contact.arms[1])) * (1.0 / self.dt)
    }

    /// How fast the bodies met along the normal, before the step [m/s].
    pub(super) fn speed(&self, contact: &Contact) -> f64 {
        let own = contact.relative(|i| self.before(i));
        (self.obstacle(contact) - own).dot(contact.normal)
    }

    /// What friction gives to the bodies, over half of the impulse along the normal [m/s]: it may drive what slid the other way before.
    pub(super) fn gain(&self, contact: &Contact) -> f64 {
        let press = contact.impulse.dot(contact.normal);
        if press <= 0.0 {
            return 0.0;
        }
        let both = contact.relative(|i| self.before(i).plus(self.after(i), 1.0)) - self.obstacle(contact) * 2.0;
        let across = both - contact.normal * contact.normal.dot(both);
        (contact.impulse.dot(across) / press).max(0.0)
    }

    /// [`Self::farther`] of the two along the normal. Of what is round, its axis.
    pub(super) fn bend(&self, contact: &Contact) -> f64 {
        let radius = |i: u32| if self.world.is_mesh(i) { 0.0 } else { self.world.shapes[i as usize].radius };
        let axis = |i: u32, arm: Vec3<f64>, side: f64| self.farther(i, arm + contact.normal * (side * radius(i)));
        let own = axis(contact.key.0, contact.arms[0], 1.0);
        let between = contact.others().fold(own, |sum, (i, arm, share)| sum - axis(i, arm, -1.0) * share);
        between.dot(contact.normal)
    }
}

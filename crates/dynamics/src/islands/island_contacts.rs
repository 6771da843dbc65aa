//! The contacts' stage of an outer iteration of one island: line 11 of Algorithm 1 (paper, section 3) and its collision
//! constraints.

mod observe;
mod slopes;

use component::Component;
use contact::broad_phase::BroadPhase;
use contact::contacts_grain;
use contact::duplicates::{self, Holders};
use contact::geometry::{Contact, World};
use contact::key::Key;
use contact::mesh_contacts::{Deepest, let_wait};
use contact::motion_bound::MotionBounds;
use contact::shape::{Poses, Shape};
use contact::warm_start::{self, Pressed};
use friction::cone::Coulomb;
use friction::problem::{Problem, Unknown};
use friction::solve::ContactSolver;
use kernels::Spatial;
use kernels::math::Vec3;
use kernels::parallel;
use rod::Surface;

use super::TooManyContacts;
use super::assemble::{Assembly, components_of};
use super::bounce::{Bounce, Impact};
use super::culling;
use super::sets::Sets;
use super::shared::Shared;
use crate::connected_set::{ConnectedSet, Touch};
use crate::counters::Counters;
use crate::formulation::Formulation;
use crate::step::Interval;

/// Steps in a row in which a contact that presses is an impact: bodies may stop in the first a little above each other, and
/// touch in the second.
const IMPACT: u32 = 2;

/// All contacts of an island, and the memory to solve them.
#[derive(Default)]
pub(crate) struct IslandContacts {
    pub(super) search: BroadPhase,
    contacts: Vec<Contact>,
    /// Those that pressed before a search, with their impulses as guesses.
    remembered: Vec<Contact>,
    /// Memory for normals before an evaluation.
    normals: Vec<Vec3<f64>>,
    /// What pressed on meshes in the last step, in the order of keys.
    pressed: Vec<Pressed>,
    /// Memory for which contacts others hold.
    holders: Holders,
    /// Contacts that may press, in the order of the problem's unknowns.
    active: Vec<u32>,
    /// Contacts of a segment with meshes for which others wait.
    deepest: Vec<Deepest>,
    problem: Problem,
    solver: ContactSolver,
    assembly: Assembly,
    /// What errors are at most relative to [m], beside the radius: a contact may be off by no more than gravity takes a body
    /// that rests in a step. What is pushed out of another body in one step keeps that velocity, which must be none beside
    /// gravity's.
    unit: f64,
    /// Difference of gaps that is none where places on axes that are nearly parallel would jump \[radii, or units\]; 0 where all count.
    hysteresis: f64,
    /// Whether a momentum residual brings bodies after impulses that turn.
    corrects: bool,
    /// Contacts whose bodies meet fast in the step under way, and are to part again.
    bounces: Vec<Bounce>,
    /// Time step [s]; 0 before the first.
    dt: f64,
    /// The time by whose square impulses are forces [s]: see [`Component::effective_dt`].
    effective_dt: f64,
}

impl IslandContacts {
    /// Forgets all that it knows of other steps, for the island of these segments, ascending.
    pub(crate) fn start(&mut self, shared: &Shared, segments: impl Iterator<Item = u32>) {
        self.search.of(segments);
        self.contacts.clear();
        self.holders.forget();
        self.active.clear();
        self.pressed.clone_from(&shared.pressed);
        self.solver.begin();
        (self.unit, self.hysteresis) = (f64::INFINITY, 0.0);
        (self.dt, self.effective_dt) = (0.0, 0.0);
    }

    /// Takes over where its segments have been looked for among all; contacts come by [`IslandContacts::take`], in order.
    pub(crate) fn take_search(&mut self, shared: &Shared) {
        self.search.take_from(&shared.search);
    }

    /// Notes where its segments are at the end of a part of the step, after such a share of it.
    pub(crate) fn note_strays(&mut self, shared: &Shared, components: &Sets<'_>, share: f64) {
        let pose = |i: u32| {
            let Shape { component, body, .. } = shared.detector.shapes()[i as usize];
            components[component as usize].component.poses[body as usize]
        };
        self.search.note_strays(&shared.search, share, pose);
    }

    /// Takes over a contact.
    pub(crate) fn take(&mut self, contact: Contact) {
        self.contacts.push(contact);
    }

    /// Its contacts.
    pub(crate) fn contacts(&self) -> &[Contact] {
        &self.contacts
    }

    /// Whether an obstacle turns too far in the step under way for it to be solved.
    pub(crate) fn turns_too_far(&self, shared: &Shared) -> bool {
        shared.detector.turns_too_far(&self.search)
    }

    /// Looks for the contacts of a part of a step over `interval` whose prediction is made.
    pub(crate) fn find_part(
        &mut self,
        shared: &Shared,
        interval: Interval,
        components: &Sets<'_>,
        counters: &mut Counters,
    ) {
        shared.detector.place_part(&mut self.search, interval);
        self.find(shared, components, counters);
    }

    /// Begins a step whose prediction is made and whose contacts are found. `presses`: whether those of the step before press
    /// from the start, as they do where the momentum residual corrects it.
    pub(crate) fn begin(
        &mut self,
        shared: &Shared,
        components: &Sets<'_>,
        (presses, formulation): (bool, Formulation),
        counters: &mut Counters,
    ) {
        self.corrects = formulation.momentum();
        let first = components.iter().next().map(|set| &set.component);
        self.effective_dt = first.map_or(0.0, Component::effective_dt);
        self.dt = first.map_or(0.0, Component::dt);
        self.evaluate(shared, components, (Poses::Start, false), counters);
        for contact in &mut self.contacts {
            let scale =
                if contact.effective_dt > 0.0 { (self.effective_dt / contact.effective_dt).powi(2) } else { 0.0 };
            contact.guess = contact.guess.map(|x| x * scale);
            contact.impulse = if presses { contact.world(contact.guess) } else { Vec3::zero() };
            contact.applied = contact.impulse;
            // What holds a place in an obstacle, within the tolerance, would bear a force that grows with the stiffness of joints alone.
            let is_held = contact.gap < 0.0 && shared.detector.is_held(contact);
            contact.target = if is_held { contact.gap.max(-shared.tolerance * contact.radius) } else { 0.0 };
            contact.effective_dt = self.effective_dt;
            contact.has_coefficient = contact.friction.sliding == contact.friction.at_rest;
        }
        if shared.detector.allows_overlap() {
            self.let_overlaps_out(shared);
        }
        self.bounces.clear();
        if shared.detector.bounces() {
            self.find_bounces(shared, components);
        }
    }

    /// Whether bodies meet fast in the step that has begun, and are to part again.
    pub(crate) fn bounces(&self) -> bool {
        !self.bounces.is_empty()
    }

    /// Chooses the coefficients of friction of a step for contacts that have none yet. Two bodies have given way to each other where all of their contacts that
    /// press are at their limit: of several some may be while others hold.
    fn choose_coefficients(&mut self, shared: &Shared, components: &Sets<'_>) {
        let is_open = |contact: &Contact| !contact.has_coefficient && !contact.is_left_out;
        if !self.contacts.iter().any(is_open) {
            return;
        }
        let world = shared.detector.world(&self.search);
        let fall = 0.5 * shared.slow * self.dt.powi(2);
        let pair = |contact: &Contact| (contact.key.0, contact.key.1.whole());
        for contacts in self.contacts.chunk_by_mut(|a, b| pair(a) == pair(b)) {
            let gave_way = contacts.iter().filter(|contact| contact.pressed > 0).all(Contact::gave_way);
            for contact in contacts.iter_mut().filter(|contact| is_open(contact)) {
                let slip = shared.tolerance * contact.radius;
                let slip = if fall > 0.0 { slip.min(fall) } else { slip };
                contact.choose_coefficient(gave_way, |contact| meeting(contact, &world, components), (slip, self.dt));
            }
        }
    }

    /// Allows what overlaps at the start of the step, evaluated there, to overlap at its end, less what goes out at a bounded
    /// speed.
    fn let_overlaps_out(&mut self, shared: &Shared) {
        let way = shared.params.release_speed * self.dt;
        for contact in self.contacts.iter_mut().filter(|contact| contact.target <= 0.0) {
            contact.target = (contact.gap + way * contact.radius).min(0.0);
        }
    }

    /// Whether the rods' own solution takes a segment that may touch so far from the prediction that contacts found there
    /// mean nothing.
    pub(crate) fn is_far(&self, shared: &Shared, components: &Sets<'_>) -> bool {
        let shapes = shared.detector.shapes();
        let far = |contact: &Contact, i: u32| {
            let shape = &shapes[i as usize];
            let dp = correction(components, shape);
            dp.linear.norm_squared() > (shared.params.far_correction * contact.radius).powi(2)
        };
        self.contacts
            .iter()
            .any(|contact| far(contact, contact.key.0) || contact.others().any(|(other, ..)| far(contact, other)))
    }

    /// Writes the impulses with which contacts begin the step to the components' `pushes`.
    pub(crate) fn press_as_before(&mut self, shared: &Shared, components: &mut Sets<'_>) {
        let shapes = shared.detector.shapes();
        self.active.clear();
        for component in components.iter_mut() {
            component.component.pushes.fill(Spatial::zero());
        }
        for (k, contact) in self.contacts.iter_mut().enumerate() {
            contact.impulse = contact.world(contact.guess);
            contact.applied = contact.impulse;
            if contact.impulse != Vec3::zero() {
                self.active.push(k as u32);
                push(contact, shapes, components, contact.impulse, |component| &mut component.pushes);
            }
        }
    }

    /// Keeps the corrections of the rods' own solution in `dlambda`, for [`IslandContacts::is_far`] and [`IslandContacts::solve`].
    pub(crate) fn keep_corrections(&mut self, shared: &Shared, components: &mut Sets<'_>, formulation: Formulation) {
        if self.contacts.is_empty() {
            return;
        }
        for ConnectedSet { component, touch, exact, .. } in components.iter_mut() {
            let Some(touch) = touch else { continue };
            if let Some(exact) = exact.as_ref().filter(|exact| exact.is_taken()) {
                touch.corrections.clear();
                touch.corrections.extend_from_slice(exact.corrections());
            } else {
                component.corrections(formulation, &mut touch.corrections);
            }
        }
        culling::note_corrections(&self.search.segments, shared.detector.shapes(), components);
    }

    /// Finds the contacts anew; those that were found before keep their impulses.
    fn find(&mut self, shared: &Shared, components: &Sets<'_>, counters: &mut Counters) {
        let Self { search, contacts, remembered, .. } = self;
        warm_start::find(&shared.detector, search, true, components, contacts, remembered);
        counters.count_search(contacts.len());
        self.holders.forget();
        if self.effective_dt > 0.0 {
            self.contacts.iter_mut().for_each(|contact| contact.effective_dt = self.effective_dt);
        }
    }

    /// Evaluates all contacts at such poses; `turns`: impulses turn as normals do.
    fn evaluate(
        &mut self,
        shared: &Shared,
        components: &Sets<'_>,
        (poses, turns): (Poses, bool),
        counters: &mut Counters,
    ) {
        let world = shared.detector.world(&self.search);
        let (steady, unit) = (self.hysteresis, self.unit);
        // What bounces and what is let out of others asks for more.
        let skips = !(shared.detector.bounces() || shared.detector.allows_overlap());
        let evaluate = |_, contact: &mut Contact| {
            let room = 2.0 * shared.params.active_gap * contact.radius;
            contact.is_left_out = match poses {
                Poses::Start => skips && culling::is_far_at_start(contact),
                _ => culling::is_out_of_reach(contact, world.shapes, components, |ways| ways.moved, room),
            };
            if contact.is_left_out {
                contact.normal = Vec3::zero();
                (contact.gap, contact.distance) = (contact.gap_at_start, contact.gap_at_start);
                return 1;
            }
            contact.hysteresis = steady * contact.radius.min(unit);
            let before = contact.normal;
            contact.evaluate(&world, components, poses);
            if turns {
                contact.turn_impulse(before);
            }
            if poses == Poses::Start {
                contact.gap_at_start = contact.gap;
            }
            0
        };
        let grain = contacts_grain(self.contacts.len());
        let left_out = parallel::reduce(&mut self.contacts, grain, evaluate, |one, other| one + other).unwrap_or(0);
        duplicates::double(world.shapes, &mut self.contacts, &mut self.holders);
        counters.contact_evaluations += self.contacts.len() as u64 - left_out;
        counters.contacts_left_out += left_out;
    }

    /// Notes the contacts that meet fast, and raises the gap that they keep, so that they part again.
    fn find_bounces(&mut self, shared: &Shared, components: &Sets<'_>) {
        let world = shared.detector.world(&self.search);
        let impact = Impact { world: &world, components, dt: self.dt };
        for contact in &mut self.contacts {
            let Surface { restitution, .. } = shared.detector.surface(contact.key.1);
            if restitution == 0.0 {
                continue;
            }
            let speed = impact.speed(contact);
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
        let impact = Impact { world: &world, components, dt: self.dt };
        for bounce in &mut self.bounces {
            let Some(contact) = place(&self.contacts, bounce.key).map(|k| &self.contacts[k]) else { continue };
            let way = contact.relative(|i| correction(components, &world.shapes[i as usize])).dot(contact.normal);
            let arrives = (bounce.gap - contact.gap - way + impact.bend(contact)) / self.dt;
            bounce.held_up = impact.speed(contact) - arrives;
        }
        self.aim_bounces(shared, components);
    }

    /// Sets the gaps of bounces for the poses as they are.
    pub(super) fn aim_bounces(&mut self, shared: &Shared, components: &Sets<'_>) {
        let world = shared.detector.world(&self.search);
        let impact = Impact { world: &world, components, dt: self.dt };
        for &Bounce { key, from, restitution, held_up, .. } in &self.bounces {
            let found = place(&self.contacts, key).map(|k| &mut self.contacts[k]);
            let Some(contact) = found.filter(|contact| !contact.is_left_out) else { continue };
            let speed = impact.speed(contact);
            let leaves = restitution * speed.min(speed - held_up) + held_up.min(0.0);
            let leaves = leaves.min(speed - impact.gain(contact));
            // No deeper than without it.
            contact.target = (from + leaves.max(0.0) * self.dt + impact.bend(contact)).max(from.min(0.0));
        }
    }

    /// Finds the impulses that the contacts add in this iteration, beside the rods' own solution, and writes them to the
    /// components' `pushes`. `worst` is the largest error now, `tolerance` the one that is good enough. Returns how many contacts
    /// were swept, all sweeps together.
    ///
    /// # Errors
    /// If so many contacts press that their matrix would have more blocks than [`ContactParams::max_blocks`].
    pub(crate) fn solve(
        &mut self,
        shared: &Shared,
        components: &mut Sets<'_>,
        (worst, tolerance): (f64, f64),
        counters: &mut Counters,
    ) -> Result<u64, TooManyContacts> {
        for component in components.iter_mut() {
            component.component.pushes.fill(Spatial::zero());
        }
        self.active.clear();
        if self.contacts.is_empty() {
            return Ok(0);
        }
        self.choose(shared, components);
        if self.active.is_empty() {
            return Ok(0);
        }
        let shapes = shared.detector.shapes();
        let contacts = (&*self.contacts, &mut self.active);
        let problem = &mut self.problem;
        self.assembly.assemble(contacts, shapes, components, problem, shared.params.max_blocks)?;
        let params = &shared.params;
        let tolerance = (tolerance * params.sweep_tolerance).max(worst * params.sweep_reduction);
        let sweeps = self.solver.solve(problem, tolerance, &params.solver) as u64;
        let contacts = self.active.len() as u64;
        counters.contact_sweeps += sweeps;
        counters.contact_solves += contacts;
        for (k, &index) in self.active.iter().enumerate() {
            let contact = &mut self.contacts[index as usize];
            let force = self.problem.unknowns()[k].force;
            let impulse = contact.world(force);
            let change = impulse - if self.corrects { contact.impulse } else { contact.applied };
            (contact.impulse, contact.applied) = (impulse, impulse);
            contact.guess = force;
            contact.compliance = self.problem.compliance(k);
            push(contact, shapes, components, change, |component| &mut component.pushes);
        }
        Ok(sweeps * contacts)
    }

    /// Chooses the contacts that may press and sets up their unknowns.
    fn choose(&mut self, shared: &Shared, components: &Sets<'_>) {
        self.problem.clear();
        let world = shared.detector.world(&self.search);
        let shapes = world.shapes;
        for contact in self.contacts.iter_mut().filter(|contact| contact.is_left_out) {
            let room = shared.params.active_gap * contact.radius;
            if !culling::is_out_of_reach(contact, shapes, components, MotionBounds::corrected, room) {
                contact.evaluate(&world, components, Poses::Now);
                contact.is_left_out = false;
            }
        }
        self.choose_coefficients(shared, components);
        let world = shared.detector.world(&self.search);
        let shapes = world.shapes;
        let free = |contact: &Contact| {
            let correction = |i: u32| correction(components, &shapes[i as usize]);
            let mut free = contact.local(contact.relative(correction) + contact.slip);
            free[0] += contact.gap - contact.target;
            free
        };
        if shared.detector.has_meshes() {
            let sector = |contact: &Contact| shared.detector.sector(contact, components);
            let_wait(&mut self.contacts, |contact| free(contact)[0], sector, &mut self.deepest);
        }
        for (index, contact) in self.contacts.iter().enumerate().filter(|(_, contact)| !contact.is_left_out) {
            let free = free(contact);
            let is_out =
                free[0] > shared.params.active_gap * contact.radius || contact.is_duplicate || contact.is_deferred;
            if is_out && contact.impulse == Vec3::zero() {
                continue;
            }
            let pressing = contact.local(contact.impulse);
            let force = if contact.impulse == Vec3::zero() { contact.guess } else { pressing };
            let before = if self.corrects { pressing } else { contact.local(contact.applied) };
            self.active.push(index as u32);
            let friction = Coulomb(contact.coefficient);
            let scale = contact.radius.min(self.unit);
            self.problem.push(Unknown { force, before, free, friction, scale });
        }
    }

    /// Components that any contact pushes now.
    pub(crate) fn pushed<'a>(&'a self, shared: &'a Shared) -> impl Iterator<Item = u32> + 'a {
        let shapes = shared.detector.shapes();
        self.active.iter().flat_map(move |&k| components_of(&self.contacts[k as usize], shapes)).flatten()
    }

    /// Whether there is an impact in the step as it is.
    pub(crate) fn has_impact(&self) -> bool {
        let hits = |contact: &Contact| presses(contact) && pressed_before(contact, &self.pressed) < IMPACT;
        self.contacts.iter().any(hits)
    }

    /// Ends a step that is accepted; returns whether there was an impact in it.
    pub(crate) fn end_step(&mut self, shared: &Shared) -> bool {
        let impact = self.has_impact();
        for contact in &mut self.contacts {
            let before = pressed_before(contact, &self.pressed);
            contact.pressed = if presses(contact) { before.saturating_add(1) } else { 0 };
            contact.keep_slip();
        }
        self.search.keep();
        self.pressed.clear();
        if shared.detector.has_meshes() {
            warm_start::note_pressed(self.contacts.iter(), &mut self.pressed);
        }
        impact
    }

    /// The deepest penetration of any contact at the poses evaluated last, relative to the smaller radius.
    pub(crate) fn deepest(&self) -> f64 {
        let true_gaps = self.contacts.iter().filter(|contact| !contact.is_duplicate);
        true_gaps.map(|contact| -contact.distance / contact.radius).fold(0.0, f64::max)
    }

    /// The largest error of any contact at the poses evaluated last, relative to the smaller radius.
    pub(crate) fn worst(&self) -> f64 {
        let in_radii = |contact: &Contact| contact.residual * (contact.radius.min(self.unit) / contact.radius);
        self.contacts.iter().map(in_radii).fold(0.0, f64::max)
    }

    /// Forgets all impulses, as far as a step taken back is concerned.
    pub(crate) fn roll_back(&mut self) {
        self.search.take_back();
        for contact in &mut self.contacts {
            (contact.impulse, contact.applied) = (Vec3::zero(), Vec3::zero());
        }
    }
}

/// Where a contact is among those of an island, which are in the order of their keys.
fn place(contacts: &[Contact], key: Key) -> Option<usize> {
    contacts.binary_search_by_key(&key, |contact| contact.key).ok()
}

/// Whether a contact bears anything.
fn presses(contact: &Contact) -> bool {
    contact.impulse != Vec3::zero()
}

/// Steps in a row before this one in which a contact has pressed, or another one with the same mesh did in its place.
fn pressed_before(contact: &Contact, pressed: &[Pressed]) -> u32 {
    match contact.pressed < IMPACT && !pressed.is_empty() {
        true => contact.pressed.max(warm_start::before(pressed, contact)),
        false => contact.pressed,
    }
}

/// Velocity of the segment's surface relative to the partner's at the start of the step [m/s].
fn meeting(contact: &Contact, world: &World<'_>, components: &Sets<'_>) -> Vec3<f64> {
    let velocity = |i: u32| {
        let shape = &world.shapes[i as usize];
        components[shape.component as usize].component.velocities[shape.body as usize]
    };
    let own = contact.relative(velocity);
    let obstacle = contact.key.1.obstacle().map(|i| &world.obstacles[i as usize]);
    obstacle.and_then(|obstacle| obstacle.velocity_at(contact.arms[1])).map_or(own, |surface| own - surface)
}

/// What the rods' own solution does to a segment.
fn correction(components: &Sets<'_>, shape: &Shape) -> Spatial<f64> {
    let of = |touch: &Touch| touch.corrections[shape.body as usize];
    components[shape.component as usize].touch.as_deref().map_or(Spatial::zero(), of)
}

/// Adds an impulse of a contact to both its bodies.
fn push(
    contact: &Contact,
    shapes: &[Shape],
    components: &mut Sets<'_>,
    f: Vec3<f64>,
    target: fn(&mut Component<f64>) -> &mut Vec<Spatial<f64>>,
) {
    let mut add = |i: u32, f: Vec3<f64>, arm: Vec3<f64>| {
        let shape = &shapes[i as usize];
        let impulse = &mut target(&mut components[shape.component as usize].component)[shape.body as usize];
        *impulse = impulse.plus(Spatial { linear: f, angular: arm.cross(f) }, 1.0);
    };
    add(contact.key.0, f, contact.arms[0]);
    for (other, arm, share) in contact.others() {
        add(other, -f * share, arm);
    }
}

#[cfg(test)]
mod tests;

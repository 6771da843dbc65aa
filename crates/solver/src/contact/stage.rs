//! The contacts' stage of an outer iteration: line 11 of Algorithm 1 (paper, section 3) and its collision constraints.

mod slopes;

use nalgebra::Vector3;
use rod::{Carried, Model, Surface};

use super::TooManyContacts;
use super::cone::{Bound, natural_residual};
use super::convert::to_nalgebra;
use super::coupling::{Coupling, components_of};
use super::detect::Detector;
use super::exclusion::PairFilter;
use super::force::{ContactForce, Touched};
use super::geometry::{Contact, Key, Partner, Poses, Shape};
use super::impulses::Impulses;
use super::parts::{ALIKE, Deepest, let_wait};
use super::problem::{Problem, Unknown};
use super::rest::Rest;
use crate::component::Component;
use crate::connected_set::ConnectedSet;
use crate::contact_params::ContactParams;
use crate::counters::Counters;
use crate::formulation::{ContactProjection, Formulation};
use crate::kernel::Spatial;
use crate::kernel::dispatch::vectorized;
use crate::kernel::math::Vec3;
use crate::linear::response::Response;
use crate::linear::sparse::SparseError;
use crate::snapshot::Tape;
use crate::step::{Interval, StepParams};

pub(crate) use slopes::Touching;

/// Steps in a row in which a contact that presses is an impact: bodies may stop in the first a little above each other, and
/// touch in the second.
const IMPACT: u32 = 2;

/// Share of the contacts' tolerance below which errors stay as they are, from twice [`ContactParams::settle_after`] on where
/// the momentum residual is solved for: to answer them takes large impulses where contacts hold each other, and would move
/// the bodies for ever.
const GOOD: f64 = 0.5;

/// What a contact that presses leaves to the one between the same places later.
struct Remembered {
    key: Key,
    guess: [f64; 3],
    impulse: Vec3<f64>,
    target: f64,
    pressed: u32,
}

/// A contact with a mesh that has pressed, for those that take its place where the segment slides on to other triangles.
#[derive(Clone, Copy)]
struct Pressed {
    segment: u32,
    whole: Partner,
    normal: Vec3<f64>,
    steps: u32,
}

/// All contacts of a simulation.
pub(crate) struct Stage {
    detector: Detector,
    contacts: Vec<Contact>,
    /// How they come to rest, one entry a contact; empty without a momentum residual.
    rests: Vec<Rest>,
    /// Earlier contacts that pressed, in the order of their keys: their impulses are a start for the sweeps.
    remembered: Vec<Remembered>,
    /// What pressed on meshes in the last step, in the order of keys.
    pressed: Vec<Pressed>,
    /// Contacts that may press, ascending.
    active: Vec<u32>,
    /// Contacts of a segment with meshes for which others wait.
    deepest: Vec<Deepest>,
    problem: Problem,
    impulses: Impulses,
    coupling: Coupling,
    responses: Vec<Response>,
    /// Whether joints answer.
    with_joints: bool,
    /// Corrections of the rods' own solve, by component.
    corrections: Vec<Vec<Spatial<f64>>>,
    /// What errors are at most relative to [m], beside the radius: a contact may be off by no more than gravity takes a body
    /// that rests in a step. What is pushed out of another body in one step keeps that velocity, which must be none beside
    /// gravity's.
    unit: f64,
    /// Time step [s]; 0 before the first.
    dt: f64,
    /// The time by whose square impulses are forces [s]: see [`Component::effective_dt`].
    effective_dt: f64,
    /// Twice the gravitational acceleration [m/s^2]: meetings slower than what it gives in a step do not bounce.
    slow: f64,
    params: ContactParams,
}

impl Stage {
    /// The stage for a model whose segments are found at `shapes`, of those pairs that pass the `filter`.
    ///
    /// # Errors
    /// If a component's factor would be too large.
    pub(crate) fn new(
        model: &Model,
        shapes: Vec<Shape>,
        filter: PairFilter,
        components: &[ConnectedSet],
        params: &StepParams,
    ) -> Result<Self, SparseError> {
        let with_joints = params.contact_projection == ContactProjection::Coupled;
        let response = |unit: &ConnectedSet| Response::new(&unit.component.system, with_joints);
        let responses = components.iter().map(response).collect::<Result<_, _>>()?;
        Ok(Self {
            detector: Detector::new(model, shapes, filter, params.contact),
            contacts: Vec::new(),
            rests: Vec::new(),
            remembered: Vec::new(),
            pressed: Vec::new(),
            active: Vec::new(),
            deepest: Vec::new(),
            problem: Problem::default(),
            impulses: Impulses::default(),
            coupling: Coupling::default(),
            responses,
            with_joints,
            corrections: vec![Vec::new(); components.len()],
            unit: f64::INFINITY,
            dt: 0.0,
            effective_dt: 0.0,
            slow: slow(&model.gravity),
            params: params.contact,
        })
    }

    /// Lets a motion drive an obstacle from the next step on; returns whether there is such an obstacle.
    pub(crate) fn drive_obstacle(&mut self, index: usize, motion: &Carried) -> bool {
        self.detector.drive(index, motion)
    }

    /// Whether an obstacle turns too far in the step under way for it to be solved.
    pub(crate) fn turns_too_far(&self) -> bool {
        self.detector.turns_too_far()
    }

    /// Changes gravity [m/s^2].
    pub(crate) fn set_gravity(&mut self, gravity: &Vector3<f64>) {
        self.slow = slow(gravity);
    }

    /// Shows a tape what the next step takes over: of contacts, those that press.
    pub(crate) fn tape(&mut self, tape: &mut Tape<'_>) {
        let presses = |contact: &Contact| contact.impulse != Vec3::zero();
        tape.size(self.responses.len());
        tape.number(&mut self.dt);
        tape.number(&mut self.effective_dt);
        tape.number(&mut self.slow);
        self.impulses.tape(tape);
        self.detector.tape(tape);
        let mut count = self.contacts.iter().filter(|contact| presses(contact)).count();
        tape.count(&mut count);
        if tape.is_reading() {
            self.contacts.clear();
            self.rests.clear();
            self.contacts.resize_with(count, Contact::blank);
            self.contacts.iter_mut().for_each(|contact| contact.tape(tape));
            self.remember_pressed();
        } else {
            self.contacts.iter_mut().filter(|contact| presses(contact)).for_each(|contact| contact.tape(tape));
        }
    }

    /// What the contacts that press give the segments, in the order of their keys.
    pub(crate) fn forces(&self, components: &[ConnectedSet]) -> impl Iterator<Item = ContactForce> {
        let shapes = self.detector.world().shapes;
        let per_dt2 = if self.effective_dt > 0.0 { self.effective_dt.powi(-2) } else { 0.0 };
        self.contacts.iter().filter(|contact| contact.impulse != Vec3::zero()).map(move |contact| {
            let (segment, partner, _) = contact.key;
            let shape = &shapes[segment as usize];
            let centre = components[shape.component as usize].component.poses[shape.body as usize].x;
            ContactForce {
                segment: segment as usize,
                other: match partner.segment() {
                    Some(i) => Touched::Segment(i as usize),
                    None => Touched::Obstacle(partner.obstacle().unwrap_or_default() as usize),
                },
                place: to_nalgebra(centre + contact.arms[0]),
                normal: to_nalgebra(contact.normal),
                force: to_nalgebra(contact.impulse) * per_dt2,
                slip: to_nalgebra(contact.slip),
            }
        })
    }

    /// Notes whether a segment moves freely from now on.
    pub(crate) fn set_free(&mut self, segment: usize, free: bool) {
        self.detector.set_free(segment, free);
    }

    /// Takes over the connectivity of a component whose joints are coupled otherwise than before.
    ///
    /// # Errors
    /// If its factor would be too large.
    pub(crate) fn renew_response(&mut self, component: usize, set: &ConnectedSet) -> Result<(), SparseError> {
        let own = &mut self.responses[component];
        if !own.is_of(&set.component.system.topology) {
            *own = Response::new(&set.component.system, self.with_joints)?;
        }
        Ok(())
    }

    /// Looks for the contacts of a step over `interval` whose prediction is made. `presses`: whether those of the step
    /// before press from the start, as they do where the momentum residual corrects it.
    pub(crate) fn begin(
        &mut self,
        components: &[ConnectedSet],
        interval: Interval,
        presses: bool,
        counters: &mut Counters,
    ) {
        self.detector.place_obstacles(interval);
        self.detect(components, counters);
        let first = components.first().map(|unit| &unit.component);
        let effective_dt = first.map_or(0.0, Component::effective_dt);
        let scale = if self.effective_dt > 0.0 { (effective_dt / self.effective_dt).powi(2) } else { 0.0 };
        self.effective_dt = effective_dt;
        self.dt = first.map_or(0.0, Component::dt);
        self.evaluate(components, Poses::Start, counters);
        for contact in &mut self.contacts {
            contact.guess = contact.guess.map(|x| x * scale);
            contact.impulse = if presses { contact.world(contact.guess) } else { Vec3::zero() };
            contact.target = 0.0;
        }
        if self.detector.allows_overlap() {
            self.let_overlaps_out();
        }
        if self.detector.bounces() {
            self.bounce(components);
        }
    }

    /// Allows what overlaps at the start of the step, evaluated there, to overlap at its end, less what goes out at a bounded
    /// speed.
    fn let_overlaps_out(&mut self) {
        let way = self.params.release_speed * self.dt;
        for contact in self.contacts.iter_mut().filter(|contact| contact.target <= 0.0) {
            contact.target = (contact.gap + way * contact.radius).min(0.0);
        }
    }

    /// Whether the rods' own solution takes a segment that may touch so far from the prediction that contacts found there
    /// mean nothing.
    pub(crate) fn is_far(&self) -> bool {
        let shapes = self.detector.world().shapes;
        let far = |contact: &Contact, i: u32| {
            let shape = &shapes[i as usize];
            let dp = self.corrections[shape.component as usize][shape.body as usize];
            dp.linear.norm_squared() > (self.params.far * contact.radius).powi(2)
        };
        self.contacts.iter().any(|contact| {
            far(contact, contact.key.0) || contact.key.1.segment().is_some_and(|other| far(contact, other))
        })
    }

    /// Keeps the corrections of the rods' own solution in `dlambda`, for [`Stage::is_far`] and [`Stage::solve`].
    pub(crate) fn keep_corrections(&mut self, components: &[ConnectedSet], formulation: Formulation) {
        if self.contacts.is_empty() {
            return;
        }
        for (unit, out) in components.iter().zip(&mut self.corrections) {
            vectorized(
                #[inline(always)]
                || unit.component.corrections(formulation, out),
            );
        }
    }

    /// Writes the impulses with which contacts begin the step to the components' `pushes`.
    pub(crate) fn press_as_before(&mut self, components: &mut [ConnectedSet]) {
        let shapes = self.detector.world().shapes;
        self.active.clear();
        for component in components.iter_mut() {
            component.component.pushes.fill(Spatial::zero());
        }
        for (k, contact) in self.contacts.iter_mut().enumerate() {
            contact.impulse = contact.world(contact.guess);
            if contact.impulse != Vec3::zero() {
                self.active.push(k as u32);
                push(contact, shapes, components, contact.impulse, |component| &mut component.pushes);
            }
        }
    }

    /// Finds the contacts; those that were found before keep their impulses.
    fn detect(&mut self, components: &[ConnectedSet], counters: &mut Counters) {
        self.remembered.clear();
        let keep = |c: &Contact| Remembered {
            key: c.key,
            guess: c.local(c.impulse),
            impulse: c.impulse,
            target: c.target,
            pressed: c.pressed,
        };
        self.remembered.extend(self.contacts.iter().filter(|c| c.impulse != Vec3::zero()).map(keep));
        self.detector.detect(components, &mut self.contacts);
        self.rests.clear();
        let mut old = self.remembered.iter().peekable();
        for contact in &mut self.contacts {
            while old.next_if(|old| old.key < contact.key).is_some() {}
            if let Some(old) = old.next_if(|old| old.key == contact.key) {
                (contact.guess, contact.impulse, contact.target) = (old.guess, old.impulse, old.target);
                contact.pressed = old.pressed;
            }
        }
        counters.contact_searches += 1;
        counters.contact_candidates += self.contacts.len() as u64;
    }

    fn evaluate(&mut self, components: &[ConnectedSet], poses: Poses, counters: &mut Counters) {
        let world = self.detector.world();
        for contact in &mut self.contacts {
            contact.evaluate(&world, components, poses);
        }
        counters.contact_evaluations += self.contacts.len() as u64;
    }

    /// Raises the gap to keep of contacts that meet fast, so that they part again.
    fn bounce(&mut self, components: &[ConnectedSet]) {
        let world = self.detector.world();
        for contact in &mut self.contacts {
            let Surface { restitution, .. } = self.detector.surface(contact.key.1);
            if restitution == 0.0 {
                continue;
            }
            let velocity = |i: u32| {
                let shape = &world.shapes[i as usize];
                components[shape.component as usize].component.velocities[shape.body as usize]
            };
            let mut meeting = contact.relative(velocity);
            if let Some(i) = contact.key.1.obstacle()
                && let Some(surface) = world.obstacles[i as usize].velocity_at(contact.arms[1])
            {
                meeting -= surface;
            }
            let speed = -meeting.dot(contact.normal);
            if speed > self.slow * self.dt && contact.gap < speed * self.dt {
                // An overlap that is let out must not leave at once.
                let from = if contact.target < 0.0 { contact.target } else { contact.gap.max(0.0) };
                contact.target = from + restitution * speed * self.dt;
            }
        }
    }

    /// Finds the impulses that the contacts add in this iteration, beside the rods' own solution, and writes them to the
    /// components' `pushes`. `worst` is the largest error now, `tolerance` the one that is good enough.
    ///
    /// # Errors
    /// If so many contacts press that their matrix would have more blocks than [`ContactParams::most_blocks`].
    pub(crate) fn solve(
        &mut self,
        components: &mut [ConnectedSet],
        formulation: Formulation,
        (worst, tolerance): (f64, f64),
        counters: &mut Counters,
    ) -> Result<(), TooManyContacts> {
        for component in components.iter_mut() {
            component.component.pushes.fill(Spatial::zero());
        }
        self.active.clear();
        if self.contacts.is_empty() {
            return Ok(());
        }
        self.choose(components);
        if self.active.is_empty() {
            return Ok(());
        }
        let shapes = self.detector.world().shapes;
        let contacts = (&*self.contacts, &*self.active);
        let (params, problem) = (&self.params, &mut self.problem);
        self.coupling.assemble(contacts, shapes, components, &mut self.responses, problem, params.most_blocks)?;
        let (sharper, share) = match formulation.momentum() {
            true => (params.momentum_sharper, params.momentum_sharper),
            false => (params.sharper, params.share_left),
        };
        let tolerance = (tolerance * sharper).max(worst * share);
        counters.contact_sweeps += self.impulses.solve(problem, tolerance, params) as u64;
        counters.contact_solves += self.active.len() as u64;
        for (k, &index) in self.active.iter().enumerate() {
            let contact = &mut self.contacts[index as usize];
            let force = self.problem.unknowns()[k].force;
            let impulse = contact.world(force);
            let change = impulse - contact.impulse;
            contact.impulse = impulse;
            contact.guess = force;
            contact.compliance = self.problem.compliance(k);
            push(contact, shapes, components, change, |component| &mut component.pushes);
        }
        Ok(())
    }

    /// Chooses the contacts that may press and sets up their unknowns.
    fn choose(&mut self, components: &[ConnectedSet]) {
        self.problem.clear();
        let shapes = self.detector.world().shapes;
        let (corrections, rests) = (&self.corrections, &self.rests);
        let free = |index: usize, contact: &Contact| {
            let correction = |i: u32| {
                let shape = &shapes[i as usize];
                corrections[shape.component as usize][shape.body as usize]
            };
            let mut free = contact.local(contact.relative(correction) + contact.slip);
            free[0] += contact.gap - contact.target;
            rests.get(index).map_or(free, |rest| [0, 1, 2].map(|k| free[k] - rest.left[k]))
        };
        if self.detector.has_meshes() {
            let sector = |contact: &Contact| self.detector.sector(contact, components);
            let_wait(&mut self.contacts, |index, contact| free(index, contact)[0], sector, &mut self.deepest);
        }
        for (index, contact) in self.contacts.iter().enumerate() {
            let free = free(index, contact);
            let is_out = free[0] > self.params.near * contact.radius || contact.doubled || contact.waits;
            if is_out && contact.impulse == Vec3::zero() {
                continue;
            }
            let before = contact.local(contact.impulse);
            let force = if contact.impulse == Vec3::zero() { contact.guess } else { before };
            self.active.push(index as u32);
            let friction = rests.get(index).map_or(Bound::Coulomb(contact.friction), |rest| rest.bound(contact));
            let scale = contact.radius.min(self.unit);
            self.problem.push(Unknown { force, before, free, friction, scale });
        }
    }

    /// Evaluates the contacts at the new poses; returns the largest error, where one of `tolerance` is good enough: relative to
    /// the radius, or to less where `tolerance` times that is more than gravity moves in a step.
    pub(crate) fn observe(
        &mut self,
        components: &mut [ConnectedSet],
        formulation: Formulation,
        tolerance: f64,
        iteration: usize,
        counters: &mut Counters,
    ) -> f64 {
        if !self.detector.covers(components) {
            self.detect(components, counters);
            if self.detector.allows_overlap() {
                self.evaluate(components, Poses::Start, counters);
                self.let_overlaps_out();
            }
        }
        let poses = if iteration < self.params.settle_after { Poses::Now } else { Poses::Settling };
        self.evaluate(components, poses, counters);
        let fall = 0.5 * self.slow * self.dt.powi(2);
        self.unit = if fall > 0.0 { fall / tolerance } else { f64::INFINITY };
        // The momentum residual sees each change of an impulse.
        let after = |iterations: usize| formulation.momentum() && iteration >= iterations;
        let (settles, rests) = (after(self.params.settle_after), after(2 * self.params.settle_after));
        if formulation.momentum() {
            self.rests.resize(self.contacts.len(), Rest::default());
        }
        let mut worst = 0.0_f64;
        for (index, contact) in self.contacts.iter_mut().enumerate() {
            contact.residual = 0.0;
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
                let bound = rest.as_ref().map_or(Bound::Coulomb(contact.friction), |rest| rest.bound(contact));
                let [normal, across] = natural_residual(contact.compliance, force, w, bound);
                // Where surfaces slide far, the direction of friction need not be nearer than this.
                let slip = contact.slip.norm_squared().sqrt() * (self.params.sliding / tolerance);
                normal.max(across / (slip / contact.radius).max(1.0))
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
            self.press(components);
        }
        worst
    }

    /// Sums the impulses of the step in the components' `pushed`, with the current arms.
    fn press(&self, components: &mut [ConnectedSet]) {
        for component in components.iter_mut() {
            component.component.pushed.fill(Spatial::zero());
        }
        let shapes = self.detector.world().shapes;
        for contact in self.contacts.iter().filter(|contact| contact.impulse != Vec3::zero()) {
            push(contact, shapes, components, contact.impulse, |component| &mut component.pushed);
        }
    }

    /// Components that any contact pushes now.
    pub(crate) fn pushed(&self) -> impl Iterator<Item = u32> {
        let shapes = self.detector.world().shapes;
        self.active.iter().flat_map(move |&k| components_of(&self.contacts[k as usize], shapes)).flatten()
    }

    /// Ends a step that is accepted; returns whether there was an impact in it.
    pub(crate) fn end_step(&mut self) -> bool {
        let mut impact = false;
        for contact in &mut self.contacts {
            let presses = contact.impulse != Vec3::zero();
            if presses && contact.pressed < IMPACT && !self.pressed.is_empty() {
                contact.pressed = contact.pressed.max(before(&self.pressed, contact));
            }
            impact |= presses && contact.pressed < IMPACT;
            contact.pressed = if presses { contact.pressed.saturating_add(1) } else { 0 };
        }
        self.remember_pressed();
        impact
    }

    /// Notes what pressed on meshes in the step that has ended.
    fn remember_pressed(&mut self) {
        self.pressed.clear();
        if self.detector.has_meshes() {
            let pressed = self.contacts.iter().filter(|contact| contact.pressed > 0 && contact.is_of_mesh());
            self.pressed.extend(pressed.map(|contact| {
                let (segment, partner, _) = contact.key;
                Pressed { segment, whole: partner.whole(), normal: contact.normal, steps: contact.pressed }
            }));
        }
    }

    /// The deepest penetration of any contact at the poses evaluated last, relative to the smaller radius.
    pub(crate) fn deepest(&self) -> f64 {
        let true_gaps = self.contacts.iter().filter(|contact| !contact.doubled);
        true_gaps.map(|contact| -contact.gap / contact.radius).fold(0.0, f64::max)
    }

    /// The largest error of any contact at the poses evaluated last, relative to the smaller radius.
    pub(crate) fn worst(&self) -> f64 {
        self.contacts.iter().map(|contact| contact.residual).fold(0.0, f64::max)
    }

    /// Forgets all impulses, as far as a step taken back is concerned.
    pub(crate) fn roll_back(&mut self) {
        for contact in &mut self.contacts {
            contact.impulse = Vec3::zero();
        }
    }
}

/// For how many steps a contact with a mesh has pressed as one between the same two in nearly the same direction.
fn before(pressed: &[Pressed], contact: &Contact) -> u32 {
    let (segment, partner, _) = contact.key;
    if !contact.is_of_mesh() {
        return 0;
    }
    let first = pressed.partition_point(|other| other.segment < segment);
    let own = pressed[first..].iter().take_while(|other| other.segment == segment);
    let same = own.filter(|other| other.whole == partner.whole() && other.normal.dot(contact.normal) > ALIKE);
    same.map(|other| other.steps).max().unwrap_or(0)
}

/// Twice a gravitational acceleration [m/s^2]: see [`Stage::slow`].
fn slow(gravity: &Vector3<f64>) -> f64 {
    2.0 * gravity.norm()
}

/// Adds an impulse of a contact to both its bodies.
fn push(
    contact: &Contact,
    shapes: &[Shape],
    components: &mut [ConnectedSet],
    f: Vec3<f64>,
    target: fn(&mut Component<f64>) -> &mut Vec<Spatial<f64>>,
) {
    let mut add = |i: u32, f: Vec3<f64>, arm: Vec3<f64>| {
        let shape = &shapes[i as usize];
        let impulse = &mut target(&mut components[shape.component as usize].component)[shape.body as usize];
        *impulse = impulse.plus(Spatial { linear: f, angular: arm.cross(f) }, 1.0);
    };
    add(contact.key.0, f, contact.arms[0]);
    if let Some(other) = contact.key.1.segment() {
        add(other, -f, contact.arms[1]);
    }
}

#[cfg(test)]
mod tests;

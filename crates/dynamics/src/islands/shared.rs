//! What all islands of a model with contacts share: what can touch, and what pressed at the end of the last step.

use component::Change;
use component::snapshot::StateVisitor;
use contact::broad_phase::BroadPhase;
use contact::exclusion::PairFilter;
use contact::geometry::Contact;
use contact::narrow_phase::NarrowPhase;
use contact::shape::Shape;
use contact::to_nalgebra;
use contact::warm_start::{self, Pressed};
use jointed::linear::compliance::Compliance;
use jointed::linear::sparse::SparseError;
use kernels::math::Vec3;
use nalgebra::Vector3;
use rod::{Carried, Model};
use rod::{ContactForce, Touched};

use super::sets::Sets;
use crate::connected_set::ConnectedSet;
use crate::contact_params::ContactParams;
use crate::counters::Counters;
use crate::formulation::ContactProjection;
use crate::step::{Interval, StepParams};

/// What all islands share. It stays as it is while they are worked on.
pub(crate) struct Shared {
    pub(crate) detector: NarrowPhase,
    /// The search at the start of a step, among all segments.
    pub(super) search: BroadPhase,
    /// Contacts that pressed at the end of the last step, in the order of their keys.
    pub(crate) pressing: Vec<Contact>,
    /// What of them pressed on meshes.
    pub(super) pressed: Vec<Pressed>,
    /// Possible contacts of the step under way, until islands take them.
    pub(super) found: Vec<Contact>,
    remembered: Vec<Contact>,
    /// Whether joints answer.
    pub(super) with_joints: bool,
    /// Twice the gravitational acceleration [m/s^2]: meetings slower than what it gives in a step do not bounce.
    pub(super) slow: f64,
    /// What a contact may be off by, in its radius: see [`StepParams::contact_tolerance`].
    pub(super) tolerance: f64,
    pub(super) params: ContactParams,
}

impl Shared {
    /// For a model whose segments are found at `shapes`, of those pairs that pass the `filter`.
    pub(crate) fn new(model: &Model, shapes: Vec<Shape>, filter: PairFilter, params: &StepParams) -> Self {
        let mut search = BroadPhase::default();
        search.of(0..shapes.len() as u32);
        Self {
            detector: NarrowPhase::new(model, shapes, filter, params.contact.narrow_phase),
            search,
            pressing: Vec::new(),
            pressed: Vec::new(),
            found: Vec::new(),
            remembered: Vec::new(),
            with_joints: params.contact_projection == ContactProjection::Coupled,
            slow: slow(&model.gravity),
            tolerance: params.contact_tolerance,
            params: params.contact,
        }
    }

    /// How the bodies of a connected set answer impulses.
    ///
    /// # Errors
    /// If its factor would be too large.
    pub(crate) fn response(&self, set: &ConnectedSet) -> Result<Compliance, SparseError> {
        Compliance::new(&set.component.system, self.with_joints)
    }

    /// Lets a motion drive an obstacle from the next step on; returns whether there is such an obstacle.
    pub(crate) fn drive_obstacle(&mut self, index: usize, motion: &Carried) -> bool {
        self.detector.drive(index, motion)
    }

    /// Notes what has become of a segment.
    pub(crate) fn change(&mut self, segment: usize, change: Change<'_>) {
        self.detector.set_free(segment, matches!(change, Change::LetGo));
        self.detector.set_stored(segment, matches!(change, Change::Store));
    }

    /// Shows a visitor what the next step takes over: of contacts, those that press.
    pub(crate) fn visit_state(&mut self, visitor: &mut StateVisitor<'_>) {
        self.detector.visit_state(visitor);
        let mut count = self.pressing.len();
        visitor.count(&mut count);
        if visitor.is_reading() {
            self.pressing.clear();
            self.pressing.resize_with(count, Contact::blank);
        }
        self.pressing.iter_mut().for_each(|contact| contact.visit_state(visitor));
        if visitor.is_reading() {
            warm_start::note_pressed(self.pressing.iter(), &mut self.pressed);
        }
    }

    /// What the contacts that press give the segments, in the order of their keys, at the end of the last step.
    pub(crate) fn forces(&self, sets: &[Box<ConnectedSet>]) -> impl Iterator<Item = ContactForce> {
        let shapes = self.detector.shapes();
        let centre = move |i: u32| {
            let shape = &shapes[i as usize];
            sets[shape.component as usize].component.poses[shape.body as usize].x
        };
        self.pressing.iter().flat_map(move |contact| {
            let (segment, partner, _) = contact.key;
            let per_dt2 = if contact.effective_dt > 0.0 { contact.effective_dt.powi(-2) } else { 0.0 };
            let whole = ContactForce {
                segment: segment as usize,
                other: match partner.segment() {
                    Some(i) => Touched::Segment(i as usize),
                    None => Touched::Obstacle(partner.obstacle().unwrap_or_default() as usize),
                },
                place: to_nalgebra(centre(segment) + contact.arms[0]),
                normal: to_nalgebra(contact.normal),
                force: to_nalgebra(contact.impulse) * per_dt2,
                slip: to_nalgebra(contact.slip),
            };
            // Each segment of a sheath's wall has its share where it takes it.
            let shares = contact.others().filter(|_| contact.is_of_sheath());
            let shares = shares.map(move |(other, arm, share)| ContactForce {
                other: Touched::Segment(other as usize),
                place: to_nalgebra(centre(other) + arm),
                force: whole.force * share,
                ..whole
            });
            (!contact.is_of_sheath()).then_some(whole).into_iter().chain(shares)
        })
    }

    /// Finds the possible contacts of a step over `interval` of all sets, whose predictions are made.
    pub(crate) fn find(&mut self, interval: Interval, components: &Sets<'_>, counters: &mut Counters) {
        // All sets feel the same gravity, which may change over time.
        self.slow = components.iter().next().map_or(0.0, |set| slow(&set.component.gravity()));
        self.detector.place_obstacles(interval);
        self.detector.follow_sheaths(components);
        self.found.clone_from(&self.pressing);
        let Self { detector, search, found, remembered, .. } = self;
        warm_start::find(detector, search, false, components, found, remembered);
        counters.count_search(found.len());
    }

    /// Takes over what presses at the end of a step, from the contacts of all islands.
    pub(crate) fn keep<'a>(&mut self, contacts: impl Iterator<Item = &'a Contact>) {
        self.pressing.clear();
        self.pressing.extend(contacts.filter(|contact| contact.impulse != Vec3::zero()));
        self.pressing.sort_unstable_by_key(|contact| contact.key);
        self.pressed.clear();
        if self.detector.has_meshes() {
            warm_start::note_pressed(self.pressing.iter(), &mut self.pressed);
        }
    }
}

/// Twice a gravitational acceleration [m/s^2]: see [`Shared::slow`].
fn slow(gravity: &Vector3<f64>) -> f64 {
    2.0 * gravity.norm()
}

//! A simulation that is handled: hands, pins, drives and quantities that change, recorded, with a way back.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use dynamics::simulation::{Simulation, SimulationError};
use dynamics::snapshot::Snapshot;
use nalgebra::Vector3;
use rod::{Body, Driven, Model, Motion, State};

use crate::LiveError;
use crate::hand::{Hand, Pulls, first_load};
use crate::input::{Input, Recording, Version};
use crate::knobs::{Knob, Knobs};

/// How far the way back goes [s].
pub(crate) const BACK: f64 = 30.0;
/// Time between two moments on the way back, at least [s].
const BETWEEN: f64 = 0.25;
/// Memory for the way back, at most [bytes].
const MEMORY: usize = 256 << 20;
/// Hands that there are.
pub(crate) const HANDS: u8 = 10;
/// Time in which a hand brings what it leads to where it is, at least [s].
const LEAD: f64 = 0.05;
/// Coordinates and velocities may be so large [m, m/s, rad/s].
const FAR: f64 = 1e6;

/// Makes a simulation of a model that differs from the first one in quantities alone: stiffness, damping, friction, wind.
pub type Rebuild<'a> = Box<dyn Fn(&Model) -> Result<Simulation, String> + 'a>;

/// What a hand does to what it has hold of.
#[derive(Clone, Debug)]
enum Held {
    /// It pulls at what is free.
    Pulls(Hand),
    /// It leads what is held.
    Leads { body: Body, offset: Vector3<f64>, target: Vector3<f64> },
}

/// What changes on the way, beside the simulation itself.
#[derive(Clone, Debug)]
struct Course {
    steps: u64,
    hands: BTreeMap<u8, Held>,
    drives: BTreeMap<usize, [Vector3<f64>; 2]>,
    /// Segments that a viewer has pinned.
    pins: Vec<usize>,
    /// Segments whose loads are not zero.
    loaded: Vec<usize>,
    /// Segments that the first model fixes, and that were let go.
    freed: Vec<usize>,
    knobs: Knobs,
    /// Inputs so far.
    inputs: usize,
}

/// A moment to go back to.
struct Moment {
    time: f64,
    snapshot: Snapshot,
    course: Course,
}

/// A simulation in the hands of viewers. It borrows the simulation for each call, so that it may be another one's, too.
pub struct Session<'a> {
    /// The first model, with loads for hands.
    first: Model,
    /// The model as it is now.
    model: Model,
    dt: f64,
    rebuild: Option<Rebuild<'a>>,
    hands_begin: Option<usize>,
    course: Course,
    inputs: Vec<(u64, Input)>,
    start: Moment,
    /// Ascending in time.
    past: VecDeque<Moment>,
    /// Whether it went back, and has not gone on since.
    went: bool,
    /// Whether there is no going on from the last step.
    is_stuck: bool,
    /// Whether it keeps moments to go back to.
    remembers: bool,
    state: State,
}

impl<'a> Session<'a> {
    /// Of a `simulation` of `model` with steps of `dt` [s]. Hands pull if the model is one [`crate::with_hands`]; `rebuild` is
    /// needed for stiffness, damping, friction and wind.
    pub fn new(model: &Model, simulation: &mut Simulation, dt: f64, rebuild: Option<Rebuild<'a>>) -> Self {
        let knobs = Knobs::of(model);
        let course = Course {
            steps: 0,
            hands: BTreeMap::new(),
            drives: BTreeMap::new(),
            pins: Vec::new(),
            loaded: Vec::new(),
            freed: Vec::new(),
            knobs,
            inputs: 0,
        };
        let mut state = State {
            positions: vec![Vector3::zeros(); model.segments.len()],
            orientations: vec![Default::default(); model.segments.len()],
            velocities: vec![Vector3::zeros(); model.segments.len()],
            angular_velocities: vec![Vector3::zeros(); model.segments.len()],
            internals: Vec::new(),
        };
        simulation.store(&mut state);
        let start = Moment { time: simulation.time(), snapshot: simulation.snapshot(), course: course.clone() };
        let first = model.clone();
        let mut session = Self {
            hands_begin: first_load(model),
            model: first.clone(),
            first,
            dt,
            rebuild,
            course,
            inputs: Vec::new(),
            start,
            past: VecDeque::new(),
            went: false,
            is_stuck: false,
            remembers: true,
            state,
        };
        session.keep_moment(simulation);
        session
    }

    /// Time step [s].
    pub fn dt(&self) -> f64 {
        self.dt
    }

    /// Steps since the start, on the way that led here.
    pub fn steps(&self) -> u64 {
        self.course.steps
    }

    /// The model as viewers have set it; what moves over time is as at the last [`Session::store`].
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// The quantities as they are set.
    pub fn knobs(&self) -> Knobs {
        self.course.knobs
    }

    /// Whether a rebuild is to be had: for stiffness, damping, friction and wind.
    pub(crate) fn rebuilds(&self) -> bool {
        self.rebuild.is_some()
    }

    /// Segments that are pinned.
    pub fn pins(&self) -> &[usize] {
        &self.course.pins
    }

    /// The state after the last step, and the model as it is then.
    pub fn store(&mut self, simulation: &mut Simulation) -> (&Model, &State) {
        simulation.store(&mut self.state);
        simulation.store_model(&mut self.model);
        (&self.model, &self.state)
    }

    /// Hands that hold something.
    pub(crate) fn holding(&self) -> Vec<u8> {
        self.course.hands.keys().copied().collect()
    }

    /// The state of the last [`Session::store`].
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Places of the hands: on what they hold, and where they are [m]; in the state of the last [`Session::store`].
    pub(crate) fn hands(&self) -> impl Iterator<Item = [Vector3<f64>; 2]> {
        let place = |held: &Held| match held {
            Held::Pulls(hand) => [hand.grip(&self.state), hand.target],
            Held::Leads { target, .. } => [*target; 2],
        };
        self.course.hands.values().map(place)
    }

    /// All that led here.
    pub fn recording(&self) -> Recording {
        Recording {
            format: Version::Live1,
            segments: self.first.segments.len(),
            dt: self.dt,
            steps: self.course.steps,
            inputs: self.inputs[..self.course.inputs].to_vec(),
        }
    }

    /// Does an input before the next step, and records it. Where it is refused, nothing has changed.
    ///
    /// # Errors
    /// If it does not fit the model or the moment.
    pub fn apply(&mut self, simulation: &mut Simulation, input: Input) -> Result<(), LiveError> {
        self.cut();
        self.act(simulation, &input)?;
        // Of what a hand does between two steps the last counts.
        if let (Input::Move { hand, .. }, Some((step, Input::Move { hand: last, to }))) =
            (&input, self.inputs.last_mut())
            && (*step, &*last) == (self.course.steps, hand)
            && let Input::Move { to: new, .. } = input
        {
            *to = new;
            return Ok(());
        }
        self.inputs.push((self.course.steps, input));
        self.course.inputs = self.inputs.len();
        Ok(())
    }

    fn act(&mut self, simulation: &mut Simulation, input: &Input) -> Result<(), LiveError> {
        match *input {
            Input::Grab { hand, segment, at } => self.grab(simulation, hand, segment, place(at)?),
            Input::Move { hand, to } => {
                let to = place(to)?;
                match self.course.hands.get_mut(&hand) {
                    Some(Held::Pulls(Hand { target, .. }) | Held::Leads { target, .. }) => *target = to,
                    None => return Err(LiveError::refused(format!("hand {hand} holds nothing"))),
                }
                Ok(())
            }
            Input::Drop { hand } => {
                self.course.hands.remove(&hand);
                Ok(())
            }
            Input::Pin { segment } => {
                self.check(segment)?;
                if self.holder(simulation, segment).is_some() {
                    return Err(LiveError::refused(format!("segment {segment} is held already")));
                }
                simulation.attach(Body::Segment(segment), None)?;
                self.course.pins.push(segment);
                Ok(())
            }
            Input::Unpin { segment } => {
                self.check(segment)?;
                let Some(body) = self.holder(simulation, segment) else {
                    return Err(LiveError::refused(format!("nothing holds segment {segment}")));
                };
                simulation.release(body)?;
                if body == Body::Segment(segment)
                    && self.first.segments[segment].fixed
                    && !self.course.freed.contains(&segment)
                {
                    self.course.freed.push(segment);
                }
                self.course.pins.retain(|&pin| pin != segment);
                self.course.drives.remove(&segment);
                self.course.hands.retain(|_, held| !matches!(held, Held::Leads { body: led, .. } if *led == body));
                Ok(())
            }
            Input::Drive { segment, velocity, turn } => {
                self.check(segment)?;
                let (velocity, turn) = (place(velocity)?, place(turn)?);
                if self.holder(simulation, segment).is_none() {
                    return Err(LiveError::refused(format!("nothing holds segment {segment}: pin it first")));
                }
                self.course.drives.insert(segment, [velocity, turn]);
                Ok(())
            }
            Input::Set(knob) => self.turn_knob(simulation, knob),
        }
    }

    fn check(&self, segment: usize) -> Result<(), LiveError> {
        let count = self.first.segments.len();
        if segment < count {
            return Ok(());
        }
        Err(LiveError::refused(format!("segment {segment} does not exist (there are {count})")))
    }

    /// What holds a segment: itself where it is fixed, or an anchor.
    fn holder(&self, simulation: &Simulation, segment: usize) -> Option<Body> {
        if simulation.is_held(Body::Segment(segment)) == Some(true) {
            return Some(Body::Segment(segment));
        }
        let own = Body::Segment(segment);
        let holding = self.first.joints.iter().filter(|joint| !joint.is_foundation());
        let anchors = holding.filter_map(|joint| match (joint.a, joint.b) {
            (b, anchor @ Body::Anchor(_)) | (anchor @ Body::Anchor(_), b) if b == own => Some(anchor),
            _ => None,
        });
        anchors.filter(|&anchor| simulation.is_held(anchor) == Some(true)).min_by_key(|body| format!("{body}"))
    }

    fn grab(
        &mut self,
        simulation: &mut Simulation,
        hand: u8,
        segment: usize,
        at: Vector3<f64>,
    ) -> Result<(), LiveError> {
        self.check(segment)?;
        if hand >= HANDS {
            return Err(LiveError::refused(format!("there are the hands 0 to {}", HANDS - 1)));
        }
        simulation.store(&mut self.state);
        let held = if simulation.is_held(Body::Segment(segment)) == Some(true) {
            Held::Leads { body: Body::Segment(segment), offset: self.state.positions[segment] - at, target: at }
        } else if self.hands_begin.is_some() {
            Held::Pulls(Hand::new(&self.model, &self.state, segment, at))
        } else {
            return Err(LiveError::refused("this simulation has no loads for hands"));
        };
        self.course.hands.insert(hand, held);
        Ok(())
    }

    fn turn_knob(&mut self, simulation: &mut Simulation, knob: Knob) -> Result<(), LiveError> {
        let mut knobs = self.course.knobs;
        knobs.set(knob)?;
        self.take_knobs(simulation, knobs)
    }

    /// Makes a simulation one with these quantities, in the state that it is in.
    fn take_knobs(&mut self, simulation: &mut Simulation, knobs: Knobs) -> Result<(), LiveError> {
        let before = self.course.knobs;
        if before == knobs {
            return Ok(());
        }
        let mut model = knobs.applied_to(&self.first)?;
        if !before.differ_in_gravity_alone(&knobs) {
            let new = self.rebuilt(&model, &self.course)?;
            let Some(mut new) = new else {
                return Err(LiveError::refused("this simulation cannot be built anew, and gravity alone can change"));
            };
            // All but the quantities is as it was: poses, velocities, time, what is held, contacts that press.
            new.restore(&simulation.snapshot())?;
            if before.gravity != knobs.gravity {
                new.set_gravity(knobs.gravity.into())?;
            }
            *simulation = new;
        } else {
            simulation.set_gravity(knobs.gravity.into())?;
        }
        simulation.store_model(&mut model);
        (self.model, self.course.knobs) = (model, knobs);
        Ok(())
    }

    /// A simulation of a model at its start that snapshots of a course fit; `None` where it cannot be built anew.
    fn rebuilt(&self, model: &Model, course: &Course) -> Result<Option<Simulation>, LiveError> {
        let Some(rebuild) = &self.rebuild else { return Ok(None) };
        let mut new = rebuild(model).map_err(LiveError::refused)?;
        for &segment in &course.freed {
            new.release(Body::Segment(segment))?;
        }
        Ok(Some(new))
    }

    /// Puts what hands and drives do into the next step.
    ///
    /// # Errors
    /// If the simulation refuses.
    pub fn prepare(&mut self, simulation: &mut Simulation) -> Result<(), LiveError> {
        self.cut();
        let time = simulation.time();
        let mut pulls = Pulls::new();
        if !self.course.hands.is_empty() {
            simulation.store(&mut self.state);
        }
        // A grip whose time is over lets go of what a hand leads, too.
        self.course.hands.retain(|_, held| match held {
            Held::Pulls(_) => true,
            Held::Leads { body, .. } => simulation.is_held(*body) == Some(true),
        });
        for held in self.course.hands.values() {
            match held {
                Held::Pulls(hand) => hand.pull(&self.state, self.dt, &mut pulls),
                Held::Leads { body, offset, target } => {
                    if let Some(pose) = simulation.pose(*body) {
                        let velocity = (target + offset - pose.position) / LEAD.max(self.dt);
                        lead(simulation, *body, [velocity, Vector3::zeros()], time, self.dt)?;
                    }
                }
            }
        }
        for (&segment, &velocities) in &self.course.drives {
            if let Some(body) = self.holder(simulation, segment) {
                lead(simulation, body, velocities, time, self.dt)?;
            }
        }
        // What is still has been told so.
        self.course.drives.retain(|_, velocities| velocities.iter().any(|v| *v != Vector3::zeros()));
        if let Some(first) = self.hands_begin {
            let zero = Vector3::zeros();
            // A hand that takes hold or lets go is a force that jumps.
            if self.course.loaded.len() != pulls.len() || !self.course.loaded.iter().all(|s| pulls.contains_key(s)) {
                simulation.restart();
            }
            for &segment in self.course.loaded.iter().filter(|segment| !pulls.contains_key(segment)) {
                simulation.set_load(first + segment, zero, zero)?;
            }
            self.course.loaded.clear();
            for (&segment, &[force, torque]) in &pulls {
                simulation.set_load(first + segment, force, torque)?;
                self.course.loaded.push(segment);
            }
        }
        Ok(())
    }

    /// Takes down that there is no going on from a step: one cannot come back to it.
    pub(crate) fn stuck(&mut self) {
        self.is_stuck = true;
    }

    /// Takes down that a step was done.
    pub fn stepped(&mut self, simulation: &mut Simulation) {
        self.course.steps += 1;
        let last = self.past.back().map_or(f64::NEG_INFINITY, |moment| moment.time);
        if self.remembers && simulation.time() - last >= BETWEEN * (1.0 - 1e-9) {
            self.keep_moment(simulation);
        }
    }

    fn keep_moment(&mut self, simulation: &mut Simulation) {
        let time = simulation.time();
        let bytes = |moment: &Moment| 8 * moment.snapshot.words().len();
        let most = (MEMORY / self.past.back().map_or(1, bytes).max(1)).max(2);
        let is_old = |moment: &Moment| moment.time < time - BACK - BETWEEN;
        let mut snapshot = Snapshot::default();
        while self.past.front().is_some_and(is_old) || self.past.len() >= most {
            snapshot = self.past.pop_front().map_or(snapshot, |moment| moment.snapshot);
        }
        simulation.snapshot_into(&mut snapshot);
        self.past.push_back(Moment { time, snapshot, course: self.course.clone() });
    }

    /// First and last time that one can go to [s]: the last one after [`Session::go_to`] is the end of what was there.
    pub fn times(&self, simulation: &Simulation) -> [f64; 2] {
        let end = self.past.back().map_or(0.0, |moment| moment.time);
        [self.past.front().map_or(0.0, |moment| moment.time), end.max(simulation.time())]
    }

    /// Goes to the last moment not after a time [s], of those that are kept. What came after it stays until the next step or
    /// input.
    ///
    /// # Errors
    /// If the simulation cannot go there: a segment has been held or let go since, and it cannot be built anew.
    pub fn go_to(&mut self, simulation: &mut Simulation, time: f64) -> Result<(), LiveError> {
        if !self.went && !self.is_stuck {
            // One can come back to where one was.
            self.keep_moment(simulation);
        }
        let after = self.past.partition_point(|moment| moment.time <= time * (1.0 + 1e-12));
        let Some(moment) = self.past.get(after.saturating_sub(1)) else { return Ok(()) };
        let (snapshot, course) = (moment.snapshot.clone(), moment.course.clone());
        self.restore(simulation, &snapshot, course)
    }

    /// Goes back to the start. Nothing is left of what came after.
    ///
    /// # Errors
    /// As [`Session::go_to`].
    pub fn reset(&mut self, simulation: &mut Simulation) -> Result<(), LiveError> {
        let (snapshot, course) = (self.start.snapshot.clone(), self.start.course.clone());
        self.restore(simulation, &snapshot, course)?;
        self.past.clear();
        self.inputs.clear();
        self.keep_moment(simulation);
        Ok(())
    }

    fn restore(&mut self, simulation: &mut Simulation, to: &Snapshot, course: Course) -> Result<(), LiveError> {
        let mut model = course.knobs.applied_to(&self.first)?;
        if !self.restored(simulation, to, &course.knobs)? {
            // What has come apart since is together again in a new one.
            let Some(mut new) = self.rebuilt(&model, &course)? else {
                return Err(LiveError::refused("there is no way back to before a segment was held or let go"));
            };
            new.restore(to)?;
            *simulation = new;
        }
        simulation.store_model(&mut model);
        (self.model, self.course, self.went, self.is_stuck) = (model, course, true, false);
        Ok(())
    }

    /// Whether a simulation could be put where a snapshot says, with these quantities; else it is as it was.
    fn restored(&self, simulation: &mut Simulation, to: &Snapshot, knobs: &Knobs) -> Result<bool, LiveError> {
        let own = self.course.knobs;
        if own != *knobs && !own.differ_in_gravity_alone(knobs) {
            return Ok(false);
        }
        let before = simulation.snapshot();
        simulation.set_gravity(knobs.gravity.into())?;
        match simulation.restore(to) {
            Err(SimulationError::Snapshot) => {
                simulation.set_gravity(own.gravity.into())?;
                simulation.restore(&before)?;
                Ok(false)
            }
            other => Ok(other.map(|()| true)?),
        }
    }

    /// After a way back: what came after the moment is gone, and hands that held then have let go.
    fn cut(&mut self) {
        if !std::mem::take(&mut self.went) {
            return;
        }
        let steps = self.course.steps;
        self.inputs.truncate(self.course.inputs);
        self.past.retain(|moment| moment.course.steps <= steps);
        let held = std::mem::take(&mut self.course.hands);
        self.inputs.extend(held.into_keys().map(|hand| (steps, Input::Drop { hand })));
        self.course.inputs = self.inputs.len();
    }
}

/// Lets a motion lead what is held for a step of `dt` [s], and stop then.
fn lead(
    simulation: &mut Simulation,
    body: Body,
    [velocity, turn]: [Vector3<f64>; 2],
    time: f64,
    dt: f64,
) -> Result<(), LiveError> {
    let Some(pose) = simulation.pose(body) else { return Ok(()) };
    let zero = Vector3::zeros();
    let motion = Motion::at_velocities(&pose, &[(time, velocity, turn), (time + dt, zero, zero)]);
    let motion = motion.map_err(|error| LiveError::refused(error.to_string()))?;
    Ok(simulation.drive(&Driven::new(body, Arc::new(motion)))?)
}

fn place(numbers: [f64; 3]) -> Result<Vector3<f64>, LiveError> {
    if numbers.iter().all(|x| x.abs() <= FAR) {
        return Ok(numbers.into());
    }
    Err(LiveError::refused("a place or a velocity is not finite or too large"))
}

/// A recording that is done once more.
pub struct Replay<'a> {
    session: Session<'a>,
    steps: u64,
    inputs: std::vec::IntoIter<(u64, Input)>,
    next: Option<(u64, Input)>,
}

impl<'a> Replay<'a> {
    /// Of a `recording`, on a `simulation` at its start; the other arguments as for the session that was recorded.
    ///
    /// # Errors
    /// If it is of another model or time step, or its inputs do not ascend.
    pub fn new(
        recording: Recording,
        model: &Model,
        simulation: &mut Simulation,
        dt: f64,
        rebuild: Option<Rebuild<'a>>,
    ) -> Result<Self, LiveError> {
        let Recording { format: Version::Live1, segments, dt: then, steps, inputs } = recording;
        if segments != model.segments.len() {
            return Err(LiveError::Recording("model"));
        }
        if then != dt {
            return Err(LiveError::Recording("time step"));
        }
        if !inputs.is_sorted_by_key(|(step, _)| *step) || inputs.last().is_some_and(|(step, _)| *step > steps) {
            return Err(LiveError::Recording("order"));
        }
        let mut session = Session::new(model, simulation, dt, rebuild);
        session.remembers = false;
        let mut inputs = inputs.into_iter();
        let next = inputs.next();
        Ok(Self { session, steps, inputs, next })
    }

    /// Steps in all.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// The model as it is set now, with loads for hands, if that is another one than at first.
    pub fn changed(&self) -> Option<&Model> {
        (self.session.course.knobs != Knobs::of(&self.session.first)).then_some(&self.session.model)
    }

    /// Does what was done before the next step.
    ///
    /// # Errors
    /// If an input does not fit.
    pub fn before_step(&mut self, simulation: &mut Simulation) -> Result<(), LiveError> {
        while let Some((_, input)) = self.next.take_if(|(step, _)| *step <= self.session.steps()) {
            self.session.apply(simulation, input)?;
            self.next = self.inputs.next();
        }
        self.session.prepare(simulation)
    }

    /// Takes down that a step was done.
    pub fn stepped(&mut self, simulation: &mut Simulation) {
        self.session.stepped(simulation);
    }
}

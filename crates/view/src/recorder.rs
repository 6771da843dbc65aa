//! Recording a run, frame by frame.

use nalgebra::Vector3;
use rod::{JointForce, Model, State, successors};

use crate::body::Bodies;
use crate::channel::{self, Range};
use crate::chapter::Chapter;
use crate::curve::Curve;
use crate::deflate::deflated;
use crate::mark::{self, Contacts, Grip, Load, Pressing};
use crate::obstacle::{Moved, Obstacle};
use crate::run::{Format, Lattice, ORIENTATION, Run, Segments};
use crate::{coarse, quaternion, track};

/// Positions take three bytes where the error of two is more than this share of the thinnest segment's radius.
const SHARE_OF_RADIUS: f64 = 1.0 / 16.0;

/// What is known of one time.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// Time [s], not before the last frame's.
    pub time: f64,
    /// State of the model's segments.
    pub state: &'a State,
    /// What each of the model's joints transmits; empty where that is not known.
    pub forces: &'a [JointForce],
    /// Energy [J].
    pub energy: f64,
    /// Length of the rods over that at rest.
    pub length_ratio: f64,
    /// Iterations of the step that led here, per connected set.
    pub iterations: f64,
}

/// A run in the making: 26 bytes a segment and frame.
///
/// Until the box about all of the motion is known, positions are kept in single precision from the first segment's first
/// one. What is not finite is replaced by what was before it, so that a run that diverged can be looked at.
#[derive(Clone, Debug)]
pub struct Recorder {
    name: String,
    dt: f64,
    model: Model,
    time: Vec<f64>,
    energy: Vec<Option<f64>>,
    length_ratio: Vec<Option<f64>>,
    iterations: Vec<Option<f64>>,
    origin: Vector3<f64>,
    /// By frame and segment.
    positions: Vec<[f32; 3]>,
    orientations: Vec<[u16; 3]>,
    /// By channel.
    values: [Vec<u16>; 4],
    /// Of the obstacles that move.
    moved: Vec<Moved>,
    rods: Vec<String>,
    obstacles: Vec<String>,
    chapters: Vec<Chapter>,
    curves: Vec<Curve>,
    grips: Vec<Grip>,
    loads: Vec<Load>,
    contacts: Contacts,
}

impl Recorder {
    /// No frame yet. `name` is the label of the run, "helix, newton"; `dt` the time step of the simulation [s].
    pub fn new(name: &str, dt: f64, model: &Model) -> Self {
        let obstacles = model.contacts.obstacles.iter().enumerate();
        let moving = obstacles.filter(|(_, obstacle)| obstacle.motion.is_some());
        Self {
            moved: moving.map(|(obstacle, _)| Moved { obstacle, poses: Vec::new() }).collect(),
            name: name.to_owned(),
            dt,
            model: model.clone(),
            time: Vec::new(),
            energy: Vec::new(),
            length_ratio: Vec::new(),
            iterations: Vec::new(),
            origin: Vector3::zeros(),
            positions: Vec::new(),
            orientations: Vec::new(),
            values: Default::default(),
            rods: Vec::new(),
            obstacles: Vec::new(),
            chapters: Vec::new(),
            curves: Vec::new(),
            grips: mark::grips(model),
            loads: mark::loads(model),
            contacts: Contacts::default(),
        }
    }

    /// Names what is shown: the rods and rigid bodies by [`rod::Segment::rod`], and the obstacles in their order. What has no
    /// name is shown by its number.
    pub fn name(&mut self, rods: Vec<String>, obstacles: Vec<String>) {
        (self.rods, self.obstacles) = (rods, obstacles);
    }

    /// Begins a chapter with the next frame; the first one begins before the first frame. The page plays chapters one by
    /// one, and shows their labels instead of times and frames.
    pub fn begin_chapter(&mut self, label: &str) {
        self.chapters.push(Chapter { frame: self.time.len(), label: label.to_owned() });
    }

    /// Adds the contacts that press in the frame that was pushed last, in its state.
    pub fn push_contacts(&mut self, state: &State, contacts: impl Iterator<Item = Pressing>) {
        self.contacts.reach(self.time.len().saturating_sub(1));
        self.contacts.push(state, contacts);
    }

    /// Adds a curve over all frames, of which each line has a value.
    pub fn add_curve(&mut self, curve: Curve) {
        self.curves.push(curve);
    }

    /// Takes over from the run's `model` where its grips have taken hold and what has broken, before the frames after that.
    pub fn take_events(&mut self, model: &Model) {
        self.model.motions.clone_from(&model.motions);
        self.model.breakable.clone_from(&model.breakable);
    }

    /// Adds a frame; the first is the start. Its state must have the model's segments. A time that is not finite or goes
    /// back is taken as that of the frame before.
    ///
    /// # Panics
    /// If the state has fewer segments than the model.
    pub fn push(&mut self, frame: &Frame<'_>) {
        let finite = |value: f64| value.is_finite().then_some(value);
        let before = self.time.last().copied().unwrap_or(f64::MIN);
        let time = if frame.time >= before { finite(frame.time) } else { None };
        self.time.push(time.or(self.time.last().copied()).unwrap_or(0.0));
        self.energy.push(finite(frame.energy));
        self.length_ratio.push(finite(frame.length_ratio));
        self.iterations.push(finite(frame.iterations));
        if self.model.varies() {
            self.model.set_time(frame.time);
        }
        mark::hold(&mut self.grips, &self.model, self.time.len() - 1);
        mark::load(&mut self.loads, &self.model, frame.state);
        let time = self.time.last().copied().unwrap_or(0.0);
        for moved in &mut self.moved {
            moved.push(&self.model.contacts.obstacles[moved.obstacle].at(time).pose);
        }
        self.push_poses(frame.state);
        self.push_values(frame);
    }

    fn push_poses(&mut self, state: &State) {
        let segments = self.model.segments.len();
        if self.positions.is_empty() {
            let first = state.positions.iter().find(|x| x.iter().all(|v| v.is_finite()));
            self.origin = first.copied().unwrap_or_default();
        }
        for i in 0..segments {
            let before = self.positions.len().checked_sub(segments);
            let offset: [f32; 3] = (state.positions[i] - self.origin).map(|x| x as f32).into();
            let position = if offset.iter().all(|x| x.is_finite()) {
                offset
            } else {
                before.map_or([0.0; 3], |at| self.positions[at])
            };
            let orientation = quaternion::pack(&state.orientations[i])
                .or_else(|| before.map(|at| self.orientations[at]))
                .or_else(|| quaternion::pack(&Default::default()));
            self.positions.push(position);
            self.orientations.push(orientation.unwrap_or_default());
        }
    }

    /// What colours show.
    fn push_values(&mut self, frame: &Frame<'_>) {
        let Self { model, values, .. } = self;
        let start = values[0].len();
        for track in values.iter_mut() {
            track.resize(start + model.segments.len(), coarse::UNKNOWN);
        }
        channel::visit(model, frame.state, frame.forces, |channel, segment, value| {
            let code = &mut values[channel as usize][start + segment];
            let new = coarse::pack(value);
            // Codes of magnitudes are ordered as their numbers are.
            let larger = new & coarse::MAGNITUDE > *code & coarse::MAGNITUDE;
            if coarse::is_known(new) && (larger || !coarse::is_known(*code)) {
                *code = new;
            }
        });
    }

    /// The run, packed.
    pub fn finish(mut self) -> Run {
        self.contacts.reach(self.time.len());
        let segments = self.model.segments.len();
        let (low, lattice) = self.lattice();
        let ranges = self.values.each_ref().map(|values| Range::of(values));

        let count = self.positions.len();
        let mut data = Vec::with_capacity(count * (3 * lattice.bytes + ORIENTATION.0 * ORIENTATION.1 + ranges.len()));
        let mut values = Vec::with_capacity(count);
        let per_step = if lattice.step > 0.0 { lattice.step.recip() } else { 0.0 };
        for axis in 0..3 {
            values.clear();
            values.extend(self.positions.iter().map(|x| ((f64::from(x[axis]) - low[axis]) * per_step).round() as u32));
            track::write(&mut data, &values, segments, lattice.bytes);
        }
        for component in 0..ORIENTATION.0 {
            values.clear();
            values.extend(self.orientations.iter().map(|q| u32::from(q[component])));
            track::write(&mut data, &values, segments, ORIENTATION.1);
        }
        for (range, coarse) in ranges.iter().zip(&self.values) {
            values.clear();
            values.extend(coarse.iter().map(|&code| u32::from(range.code(coarse::unpack(code)))));
            track::write(&mut data, &values, segments, 1);
        }
        Run {
            format: Format::Rods1,
            name: self.name,
            dt: self.dt,
            segments: drawn(&self.model),
            bodies: Bodies::new(&self.model),
            obstacles: self.model.contacts.obstacles.iter().map(|o| Obstacle::from(&o.shape)).collect(),
            obstacle_motions: self.moved,
            rods: self.rods,
            obstacle_names: self.obstacles,
            chapters: self.chapters,
            curves: self.curves,
            grips: mark::always(self.grips, self.time.len()),
            loads: mark::constant(self.loads),
            contacts: self.contacts.packed(),
            time: self.time,
            energy: self.energy,
            length_ratio: self.length_ratio,
            iterations: self.iterations,
            lattice,
            ranges,
            data: deflated(&data),
        }
    }

    /// Lowest coordinates recorded, and the lattice that begins there.
    fn lattice(&self) -> (Vector3<f64>, Lattice) {
        let points = || self.positions.iter().map(|x| Vector3::from(x.map(f64::from)));
        let low = points().reduce(|a, b| a.inf(&b)).unwrap_or_default();
        let high = points().reduce(|a, b| a.sup(&b)).unwrap_or_default();
        let extent = (high - low).max();
        let thinnest = self.model.segments.iter().map(|s| s.radius).fold(f64::INFINITY, f64::min);
        let step = |bytes: usize| extent / (256_f64.powi(bytes as i32) - 1.0);
        let bytes = if 0.5 * step(2) <= SHARE_OF_RADIUS * thinnest { 2 } else { 3 };
        let origin = self.origin + low;
        // Single precision, of coordinates that are an extent at most, and double precision of the sums that give places.
        let largest = extent + origin.amax();
        let rounding = 0.5 * f64::from(f32::EPSILON) * extent + 4.0 * f64::EPSILON * largest;
        let precision = 0.5 * step(bytes) + rounding;
        (low, Lattice { origin: origin.into(), step: step(bytes), bytes, precision })
    }
}

/// Sizes and rods of the segments, and which goes on in which: joined end to start, of one rod.
fn drawn(model: &Model) -> Segments {
    let next = successors(model).into_iter().map(|next| next.map(|next| next.segment)).collect();
    let (length, radius) = model.segments.iter().map(|s| (s.length, s.radius)).unzip();
    Segments { length, radius, next, rod: model.segments.iter().map(|s| s.rod).collect() }
}

//! A simulation with its scene, in the terms of the C header: bodies, joints, grips and loads by their numbers.

use std::collections::HashSet;
use std::path::Path;
use std::sync::Arc;

use cosserat::assembly::Load;
use cosserat::guess::choose;
use cosserat::motion::{Driven, Interpolation, Keyframe, Motion, Reaction, Wrench};
use cosserat::scene::{self, Scene};
use cosserat::simulation::{self, ContactForce, Settings, Simulation, Status, StepParams, contact_wrenches};
use cosserat::state::{Body, JointForce, Model, Pose, State};
use cosserat::statics::{StaticParams, equilibrium};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// How a call ended that did not do what it was asked for: the codes of the header, which are the programs' exit codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(i32)]
pub enum Code {
    /// A step did not meet its tolerance. What was asked for is done.
    NotConverged = 1,
    /// An argument is not valid, or a file is not; nothing is changed.
    BadInput = 2,
    /// A fault of this library.
    Internal = 3,
}

/// An error as C gets it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// Its kind.
    pub code: Code,
    /// What happened, in a line.
    pub message: String,
}

impl Failure {
    /// Bad input, in words.
    pub fn input(message: impl ToString) -> Self {
        Self { code: Code::BadInput, message: message.to_string() }
    }
}

/// What a reaction asks for of the time before the last step.
#[derive(Clone, Debug)]
struct Before {
    /// Of use where there is a time.
    state: State,
    /// Time [s]; none before the first step.
    time: Option<f64>,
}

/// What may be set between two steps.
#[derive(Clone, Debug)]
struct Acting {
    /// [m/s^2].
    gravity: Vector3<f64>,
    loads: Vec<Load>,
}

impl Acting {
    fn of(model: &Model) -> Self {
        Self { gravity: model.gravity, loads: model.loads.clone() }
    }

    fn put_into(&self, model: &mut Model) {
        model.gravity = self.gravity;
        model.loads.clone_from(&self.loads);
    }
}

/// What C has a pointer to.
pub struct Handle {
    scene: Scene,
    simulation: Simulation,
    state: State,
    before: Before,
    /// What acts in the next step; the scene's model has what acted in the last one.
    next: Acting,
    joint_forces: Vec<JointForce>,
    contacts: Vec<ContactForce>,
    wrenches: Vec<Wrench>,
    /// What the scene holds: fixed segments in their order, then anchors.
    grips: Vec<Body>,
    /// Where grips go in the next step.
    targets: Vec<(Body, Pose)>,
}

/// A snapshot, with what reactions of its last step ask for.
#[derive(Clone, Debug)]
pub struct Snapshot {
    snapshot: simulation::Snapshot,
    before: Before,
    /// What acted in the last step and acts in the next one.
    acting: [Acting; 2],
}

impl Handle {
    /// From a scene file. `method` has names of formulation and integrator; those of the scene, else the defaults, unless given.
    ///
    /// # Errors
    /// If the file is no scene, the scene goes on from another run, or no equilibrium is found for a scene that begins in one.
    pub fn open(path: &str, method: [Option<&str>; 2]) -> Result<Self, Failure> {
        Self::of(scene::load(Path::new(path)).map_err(Failure::input)?, method)
    }

    /// From a scene that comes with the library, by its name.
    ///
    /// # Errors
    /// If there is none of that name.
    pub fn builtin(name: &str, method: [Option<&str>; 2]) -> Result<Self, Failure> {
        Self::of(scene::builtin(name).map_err(Failure::input)?, method)
    }

    fn of(mut scene: Scene, method: [Option<&str>; 2]) -> Result<Self, Failure> {
        let step = params(method, &scene)?;
        if scene.from.is_some() {
            return Err(Failure::input(format!("{}: run.from is not known here; use a scene without it", scene.name)));
        }
        if scene.begins_at_rest {
            let found =
                equilibrium(&scene.model, &mut scene.state, &StaticParams::default()).map_err(Failure::input)?;
            if !found.converged {
                return Err(Failure::input(format!("{}: run.begin = \"equilibrium\": none was found", scene.name)));
            }
        }
        let choice = choose(&scene.model, &step, None);
        let settings = Settings { step, solver: choice.solver };
        let start = |model: &_, members: &_, topology: &_| choice.build_guess(model, members, topology);
        let simulation =
            Simulation::new(&scene.model, &scene.state, &settings, Some(&start)).map_err(Failure::input)?;
        let fixed = (0..scene.model.segments.len()).filter(|&i| scene.model.segments[i].fixed).map(Body::Segment);
        // Springs along a rod hold on to anchors, too.
        let springs: HashSet<Body> =
            scene.model.joints.iter().filter(|joint| joint.is_foundation()).map(|joint| joint.a).collect();
        let anchors = (0..scene.model.anchors.len()).map(Body::Anchor).filter(|body| !springs.contains(body));
        let grips = fixed.chain(anchors).collect();
        let joint_forces = vec![JointForce::default(); scene.model.joints.len()];
        let state = scene.state.clone();
        let before = Before { state: state.clone(), time: None };
        let next = Acting::of(&scene.model);
        Ok(Self {
            scene,
            simulation,
            state,
            before,
            next,
            joint_forces,
            contacts: Vec::new(),
            wrenches: Vec::new(),
            grips,
            targets: Vec::new(),
        })
    }

    /// One step of `dt` [s]; 0 for the scene's own. Grips go where they were sent, at constant velocity.
    ///
    /// # Errors
    /// If `dt` is not valid, or the step does not meet its tolerance.
    pub fn step(&mut self, dt: f64) -> Result<(), Failure> {
        let dt = if dt == 0.0 { self.scene.run.dt } else { dt };
        if !(dt.is_finite() && dt > 0.0) {
            return Err(Failure::input(format!(
                "the time step is {dt} s; it must be positive, or 0 for the scene's own"
            )));
        }
        let time = self.simulation.time();
        if time + dt <= time {
            return Err(Failure::input(format!("the time step, {dt} s, is too short for a time of {time} s")));
        }
        let mut driven = Vec::with_capacity(self.targets.len());
        for &(body, target) in &self.targets {
            let now = self.pose(body);
            let turn = (target.orientation * now.orientation.inverse()).scaled_axis();
            let keyframes = [
                Keyframe { time, position: now.position, turn: Vector3::zeros() },
                Keyframe { time: time + dt, position: target.position, turn },
            ];
            let motion = Motion::new(now.orientation, &keyframes, Interpolation::Linear).map_err(Failure::input)?;
            driven.push(Driven::new(body, Arc::new(motion)));
        }
        driven.iter().try_for_each(|driven| self.simulation.drive(driven)).map_err(Failure::input)?;
        self.targets.clear();
        let report = self.simulation.step(dt).map_err(Failure::input)?;
        std::mem::swap(&mut self.before.state, &mut self.state);
        self.before.time = Some(time);
        self.next.put_into(&mut self.scene.model);
        self.read();
        match report.status {
            Status::Converged | Status::ConvergedInSubsteps => Ok(()),
            status => {
                let message =
                    format!("the step that ended at {} s did not converge: {status:?}", self.simulation.time());
                Err(Failure { code: Code::NotConverged, message })
            }
        }
    }

    /// Brings what is read up to date: all of the state, and what of the model changes over time.
    fn read(&mut self) {
        let Self { scene, simulation, state, joint_forces, contacts, wrenches, .. } = self;
        simulation.store(state);
        simulation.store_joint_forces(joint_forces);
        simulation.store_contact_forces(contacts);
        contact_wrenches(contacts, state, wrenches);
        simulation.store_model(&mut scene.model);
    }

    fn pose(&self, body: Body) -> Pose {
        self.scene.model.pose(body, &self.state)
    }

    /// Time [s].
    pub fn time(&self) -> f64 {
        self.simulation.time()
    }

    /// The scene's own time step [s].
    pub fn own_step(&self) -> f64 {
        self.scene.run.dt
    }

    /// Number of segments, rigid bodies included.
    pub fn segments(&self) -> usize {
        self.state.positions.len()
    }

    /// Number of joints.
    pub fn joints(&self) -> usize {
        self.joint_forces.len()
    }

    /// Number of grips: fixed segments in their order, then anchors of faces.
    pub fn grips(&self) -> usize {
        self.grips.len()
    }

    /// Number of the scene's loads.
    pub fn loads(&self) -> usize {
        self.scene.model.loads.len()
    }

    /// The first segment of a rod or body and how many it has.
    ///
    /// # Errors
    /// If there is none of that name.
    pub fn find(&self, name: &str) -> Result<[usize; 2], Failure> {
        let found = self.scene.rods.iter().find(|rod| rod.name == name);
        found.map(|rod| [rod.segments.start, rod.segments.len()]).ok_or_else(|| {
            let known: Vec<&str> = self.scene.rods.iter().take(8).map(|rod| rod.name.as_str()).collect();
            Failure::input(format!("no rod or body is called {name:?}; there are {}", known.join(", ")))
        })
    }

    /// Poses of segments: position [m] and quaternion (w, x, y, z), seven numbers each.
    pub fn poses(&self, mut write: impl FnMut(usize, [f64; 7])) {
        for i in 0..self.segments() {
            write(i, numbers(&self.pose(Body::Segment(i))));
        }
    }

    /// Velocities of segments [m/s] and angular velocities in world axes [rad/s], six numbers each.
    pub fn velocities(&self, mut write: impl FnMut(usize, [f64; 6])) {
        let all = self.state.velocities.iter().zip(&self.state.angular_velocities);
        all.enumerate().for_each(|(i, (v, w))| write(i, six(v, w)));
    }

    /// What joints transmit: force [N] in world axes and moment [N m] in the axes of their first body, six numbers each; zeros
    /// before the first step.
    pub fn joint_forces(&self, mut write: impl FnMut(usize, [f64; 6])) {
        self.joint_forces.iter().enumerate().for_each(|(i, own)| write(i, six(&own.force, &own.moment)));
    }

    /// What grips bear: force on what they hold [N] and moment about its position [N m], six numbers each; zeros before the first
    /// step, and where a grip is open.
    pub fn grip_forces(&self, mut write: impl FnMut(usize, [f64; 6])) {
        (0..self.grips()).for_each(|i| write(i, [0.0; 6]));
        let Some(from) = self.before.time else { return };
        let (model, states) = (&self.scene.model, [&self.before.state, &self.state]);
        for own in Reaction::all(model, states, [from, self.time()], &self.joint_forces, &self.wrenches) {
            if let Some(i) = self.grips.iter().position(|&body| body == own.body) {
                write(i, six(&own.force, &own.moment));
            }
        }
    }

    /// The pose of a grip.
    ///
    /// # Errors
    /// If there is no such grip.
    pub fn grip(&self, index: usize) -> Result<[f64; 7], Failure> {
        Ok(numbers(&self.pose(self.grip_body(index)?)))
    }

    fn grip_body(&self, index: usize) -> Result<Body, Failure> {
        let message = || Failure::input(format!("grip {index}: there are {} grips", self.grips()));
        self.grips.get(index).copied().ok_or_else(message)
    }

    /// Sends a grip to a pose, at which it is at the end of the next step.
    ///
    /// # Errors
    /// If there is no such grip, it is open, or the pose is not valid.
    pub fn send_grip(&mut self, index: usize, [x, y, z, w, i, j, k]: [f64; 7]) -> Result<(), Failure> {
        let body = self.grip_body(index)?;
        if self.simulation.is_held(body) != Some(true) {
            return Err(Failure::input(format!("grip {index} is open")));
        }
        let (position, turn) = (Vector3::new(x, y, z), Quaternion::new(w, i, j, k));
        // Engines compute in single precision.
        let is_unit = (turn.norm() - 1.0).abs() <= f64::from(f32::EPSILON).sqrt();
        if !(is_unit && position.iter().all(|x| x.is_finite())) {
            let what = "positions must be finite and quaternions (w, x, y, z) of length 1";
            return Err(Failure::input(format!("grip {index}: {what}")));
        }
        self.targets.retain(|(own, _)| *own != body);
        self.targets.push((body, Pose { position, orientation: UnitQuaternion::from_quaternion(turn) }));
        Ok(())
    }

    /// Sets one of the scene's loads from the next step on: force [N] and torque [N m] in world axes, or in the segment's, of a
    /// load that follows it.
    ///
    /// # Errors
    /// If there is no such load, or a number is not finite.
    pub fn set_load(&mut self, index: usize, [x, y, z, a, b, c]: [f64; 6]) -> Result<(), Failure> {
        let (force, torque) = (Vector3::new(x, y, z), Vector3::new(a, b, c));
        self.simulation.set_load(index, force, torque).map_err(Failure::input)?;
        let load = &mut self.next.loads[index];
        (load.force, load.torque) = (force, torque);
        Ok(())
    }

    /// Sets gravity from the next step on [m/s^2].
    ///
    /// # Errors
    /// If a number is not finite.
    pub fn set_gravity(&mut self, [x, y, z]: [f64; 3]) -> Result<(), Failure> {
        let gravity = Vector3::new(x, y, z);
        self.simulation.set_gravity(gravity).map_err(Failure::input)?;
        self.next.gravity = gravity;
        Ok(())
    }

    /// All that the steps to come depend on.
    pub fn snapshot(&mut self) -> Snapshot {
        let acting = [Acting::of(&self.scene.model), self.next.clone()];
        Snapshot { snapshot: self.simulation.snapshot(), before: self.before.clone(), acting }
    }

    /// Goes back to a snapshot of the same simulation; poses that grips were sent to are forgotten.
    ///
    /// # Errors
    /// If the snapshot is another simulation's.
    pub fn restore(&mut self, other: &Snapshot) -> Result<(), Failure> {
        self.simulation.restore(&other.snapshot).map_err(Failure::input)?;
        self.before.clone_from(&other.before);
        other.acting[0].put_into(&mut self.scene.model);
        self.next.clone_from(&other.acting[1]);
        self.targets.clear();
        self.read();
        Ok(())
    }
}

/// How to step a scene, with the names that are given.
fn params([formulation, integrator]: [Option<&str>; 2], scene: &Scene) -> Result<StepParams, Failure> {
    let integrator_of_scene = scene.run.integrator.unwrap_or_default();
    let own = StepParams { integrator: integrator_of_scene, ..StepParams::default() };
    let wrong = |name: &str, expected: String| Failure::input(format!("{name:?}: {expected}"));
    let formulation = formulation.map_or(Ok(own.formulation), |name| name.parse().map_err(|e| wrong(name, e)))?;
    let integrator = integrator.map_or(Ok(own.integrator), |name| name.parse().map_err(|e| wrong(name, e)))?;
    Ok(StepParams { formulation, integrator, ..own })
}

fn numbers(pose: &Pose) -> [f64; 7] {
    let (p, q) = (pose.position, pose.orientation);
    [p.x, p.y, p.z, q.w, q.i, q.j, q.k]
}

fn six(a: &Vector3<f64>, b: &Vector3<f64>) -> [f64; 6] {
    [a.x, a.y, a.z, b.x, b.y, b.z]
}

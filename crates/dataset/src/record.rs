//! One trajectory, recorded while it is simulated with exact linear solves.
//!
//! The loop is the solver's own. What it solves is seen through its seam for guesses, by one that never proposes
//! anything. Solutions of an attempt that was taken back, because it did not converge in a step of that length, are
//! dropped: an attempt that follows is shorter then, and only then. With contacts, what is seen is the rods' own linear
//! system, before contacts push.

use std::sync::{Arc, Mutex, PoisonError};

use cosserat::guess::{InitialGuess, Members, Topology};
use cosserat::internals::component::{Component, split};
use cosserat::internals::kernels::Spatial;
use cosserat::scene::Scene;
use cosserat::simulation::{Formulation, Settings, Simulation, SolverKind};
use cosserat::state::{Body, Joint, Model, State};
use graph::{Normal, Norms, corrections, planar_normal};

use crate::{Config, DatasetError};

/// Numbers of the samples of a trajectory, one after the other: see the crate's description.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Samples {
    /// Step and outer iteration, each from 0.
    pub(crate) places: Vec<[u32; 2]>,
    pub(crate) dt: Vec<f64>,
    pub(crate) poses: Vec<[f64; 7]>,
    pub(crate) lambda: Vec<[f64; 6]>,
    pub(crate) rhs: Vec<[f32; 6]>,
    pub(crate) dlambda: Vec<[f32; 6]>,
    pub(crate) dp: Vec<[f32; 6]>,
    /// Inverse mass and transverse inertia of the step; none where there is no air.
    pub(crate) inertia: Vec<[f64; 2]>,
}

/// A recorded trajectory.
#[derive(Clone, Debug)]
pub(crate) struct Record {
    pub(crate) index: u64,
    /// The model of the one connected set, its bodies and joints in the solver's order.
    pub(crate) model: Model,
    pub(crate) planar: Option<Normal>,
    pub(crate) samples: Samples,
    pub(crate) norms: Norms,
    /// Steps that ended at the cap on iterations.
    pub(crate) unconverged: usize,
}

/// Sees every solution and proposes nothing.
struct Recorder {
    samples: Arc<Mutex<Samples>>,
    segments: usize,
    step: u32,
    /// Of how many steps one is kept.
    every: u32,
    dp: Vec<Spatial<f64>>,
    /// Number of samples when the attempt under way began, and its time step [s].
    attempt: (usize, f64),
}

fn single(x: Spatial<f64>) -> [f32; 6] {
    x.to_array().map(|x| x as f32)
}

impl InitialGuess for Recorder {
    fn helps_solves(&self) -> bool {
        true
    }

    fn observe_solve(&mut self, component: &Component<f64>, iteration: usize) {
        if !self.step.is_multiple_of(self.every) {
            return;
        }
        let mut samples = self.samples.lock().unwrap_or_else(PoisonError::into_inner);
        if iteration == 0 {
            let (first, last_dt) = self.attempt;
            if component.dt() < last_dt {
                samples.truncate(first, self.segments, component.dlambda.len());
            }
            self.attempt = (samples.dt.len(), component.dt());
        }
        corrections(component, &component.dlambda, &mut self.dp);
        samples.places.push([self.step, iteration as u32]);
        samples.dt.push(component.dt());
        for (pose, dp) in component.poses.iter().zip(&self.dp).take(self.segments) {
            let ([x, y, z], [i, j, k]) = (pose.x.0, pose.q.v.0);
            samples.poses.push([x, y, z, i, j, k, pose.q.w]);
            samples.dp.push(single(*dp));
        }
        if component.has_air() {
            samples.inertia.extend((0..self.segments).map(|segment| component.inertia(segment)));
        }
        samples.lambda.extend(component.lambda.iter().map(|x| x.to_array()));
        samples.rhs.extend(component.system.joints.iter().map(|joint| single(joint.rhs)));
        samples.dlambda.extend(component.dlambda.iter().map(|x| single(*x)));
    }

    fn observe_step(&mut self, _: &Component<f64>) {
        self.step += 1;
        // The next step begins anew, however short the last part of this one was.
        self.attempt.1 = 0.0;
    }
}

impl Samples {
    fn truncate(&mut self, samples: usize, segments: usize, joints: usize) {
        let Self { places, dt, poses, lambda, rhs, dlambda, dp, inertia } = self;
        places.truncate(samples);
        dt.truncate(samples);
        poses.truncate(samples * segments);
        dp.truncate(samples * segments);
        inertia.truncate(samples * segments);
        lambda.truncate(samples * joints);
        rhs.truncate(samples * joints);
        dlambda.truncate(samples * joints);
    }
}

/// Simulates a scene as the configuration says and records every accepted linear solve of the steps that it keeps.
pub(crate) fn record(scene: &Scene, index: u64, config: &Config) -> Result<Record, DatasetError> {
    let wrong = |message: String| DatasetError::Trajectory { index, message };
    // What networks learn from is the paper's.
    let (model, state) = (&*Formulation::Xpbd.measured(&scene.model), &scene.state);
    let mut sets = split(model);
    let Some((members, topology)) = sets.pop().filter(|_| sets.is_empty()) else {
        return Err(wrong(format!("{} connected sets of segments, but it must be one", sets.len() + 1)));
    };
    if model.loads.iter().any(|load| load.torque.norm() > 0.0 || load.offset != 0.0 || load.follows) {
        return Err(wrong(
            "a load with a torque, or one that turns with its segment, which a stored linear system would not hold"
                .to_owned(),
        ));
    }
    if !model.motions.is_empty() || !model.changes.is_empty() {
        return Err(wrong("a motion or a load over time, which a stored model would not hold".to_owned()));
    }
    if model.segments.iter().any(|segment| segment.body.is_some()) {
        return Err(wrong("a rigid body, which a stored model would not hold".to_owned()));
    }
    let samples = Arc::new(Mutex::new(Samples::default()));
    let build = |_: &Model, members: &Members, topology: &Topology| -> Option<Box<dyn InitialGuess>> {
        Some(Box::new(Recorder {
            samples: samples.clone(),
            segments: members.segments.len(),
            step: 0,
            every: config.record_every as u32,
            dp: vec![Spatial::zero(); topology.bodies()],
            attempt: (0, 0.0),
        }))
    };
    let settings = Settings { step: config.step(), solver: SolverKind::Direct };
    let mut simulation =
        Simulation::new(model, state, &settings, Some(&build)).map_err(|error| wrong(error.to_string()))?;
    let mut unconverged = 0;
    for step in 0..config.steps {
        let status = simulation.step(config.dt_s).map_err(|error| wrong(error.to_string()))?.status;
        if status.is_stuck() {
            return Err(wrong(format!("step {step}: {}", status.name())));
        }
        unconverged += usize::from(!status.is_converged());
    }
    drop(simulation);
    let samples = std::mem::take(&mut *samples.lock().unwrap_or_else(PoisonError::into_inner));
    let spatial = |x: &[f32; 6]| Spatial::from_array(x.map(f64::from));
    let mut norms = Norms::default();
    for (dp, dlambda) in [(&samples.dp, &Vec::new()), (&Vec::new(), &samples.dlambda)] {
        let (dp, dlambda): (Vec<_>, Vec<_>) = (dp.iter().map(spatial).collect(), dlambda.iter().map(spatial).collect());
        norms.include(&dp, &dlambda);
    }
    let (planar, model) = (planar_normal(model, state), own_model(model, &members, &topology));
    Ok(Record { index, model, planar, samples, norms, unconverged })
}

/// The model of the set alone: its segments, joints and anchors in the solver's order, and what else acts on all.
fn own_model(model: &Model, members: &Members, topology: &Topology) -> Model {
    let segments = members.segments.len();
    let body = |i: u32| match (i as usize).checked_sub(segments) {
        Some(anchor) => Body::Anchor(anchor),
        None => Body::Segment(i as usize),
    };
    let joint = |(&k, &[a, b]): (&usize, &[u32; 2])| Joint { a: body(a), b: body(b), ..model.joints[k] };
    Model {
        segments: members.segments.iter().map(|&i| model.segments[i].clone()).collect(),
        joints: members.joints.iter().zip(&topology.joints).map(joint).collect(),
        anchors: members.anchors.iter().map(|&i| model.anchors[i]).collect(),
        gravity: model.gravity,
        strain_measure: model.strain_measure,
        ..Model::default()
    }
}

/// The state of a stored sample's poses, at rest.
pub(crate) fn state_of(poses: impl Iterator<Item = [f64; 7]>) -> State {
    let mut state = State::default();
    for [x, y, z, i, j, k, w] in poses {
        state.positions.push(nalgebra::Vector3::new(x, y, z));
        let q = nalgebra::Quaternion::new(w, i, j, k);
        state.orientations.push(nalgebra::UnitQuaternion::new_unchecked(q));
        state.velocities.push(nalgebra::Vector3::zeros());
        state.angular_velocities.push(nalgebra::Vector3::zeros());
    }
    state
}

//! Runs a case and holds every step against the laws.

use std::panic::{AssertUnwindSafe, catch_unwind};

use cosserat::motion::Changing;
use cosserat::scene::{self, Scene};
use cosserat::simulation::{Simulation, Snapshot, Status};
use cosserat::state::{Body, JointForce, Model, Sliding, State};
use tempfile::TempDir;

use crate::case::Case;
use crate::exclusion::Excluded;
use crate::law::{Law, Violation};
use crate::laws::energy::EnergyBalance;
use crate::laws::laws;
use crate::step::Step;

/// What became of a case.
#[derive(Clone, Debug)]
pub enum Checked {
    /// It is not run: the reader or the solver refuses it, with this message.
    Refused(String),
    /// It was run.
    Ran(Report),
}

/// What a run showed.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Laws that are broken: of each the first time, in the order of steps.
    pub violations: Vec<Violation>,
    /// Steps that were run.
    pub steps: usize,
    /// Steps that were not solved.
    pub unsolved: usize,
    /// Contact forces that were looked at.
    pub contacts: usize,
}

impl Report {
    fn panicked(mut self, message: String) -> Checked {
        self.violations.push(Violation { law: Law::Panic, step: self.steps + 1, ratio: f64::INFINITY, message });
        Checked::Ran(self)
    }
}

impl Checked {
    /// How a law is broken, if it is.
    pub fn breaks(&self, law: Law) -> Option<&Violation> {
        let Self::Ran(report) = self else { return None };
        report.violations.iter().find(|violation| violation.law == law)
    }
}

/// Does this; a panic is an error with its message.
fn caught<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|panic| match (panic.downcast_ref::<String>(), panic.downcast_ref()) {
        (Some(message), _) => message.clone(),
        (_, Some::<&&str>(message)) => (*message).to_owned(),
        _ => "a panic without a message".to_owned(),
    })
}

/// The scene of a case. Its files are in a folder while it is read.
fn scene(case: &Case) -> Result<Scene, String> {
    let folder = TempDir::new().map_err(|error| error.to_string())?;
    for (name, text) in &case.files {
        std::fs::write(folder.path().join(name), text).map_err(|error| error.to_string())?;
    }
    let file = folder.path().join("scene.toml").display().to_string();
    let mut scene = scene::parse(&case.text, &file).map_err(|error| error.to_string())?;
    scene.model = case.method.formulation.measured(&scene.model).into_owned();
    Ok(scene)
}

fn simulation(scene: &Scene, case: &Case) -> Result<Simulation, String> {
    Simulation::new(&scene.model, &scene.state, &case.method.settings(), None).map_err(|error| error.to_string())
}

/// Why the reader or the solver refuses a case. One at which they panic is taken: [`check`] tells of it.
pub(crate) fn refusal(case: &Case) -> Option<String> {
    caught(|| scene(case).and_then(|scene| simulation(&scene, case))).ok()?.err()
}

/// Runs a case, and from its middle on once more from a snapshot.
pub fn check(case: &Case) -> Checked {
    let mut report = Report::default();
    let read = match caught(|| scene(case)) {
        Ok(Ok(scene)) => scene,
        Ok(Err(message)) => return Checked::Refused(message),
        Err(message) => return report.panicked(message),
    };
    let middle = match caught(|| run(&read, case, &mut report)) {
        Ok(Ok(middle)) => middle,
        Ok(Err(message)) => return Checked::Refused(message),
        Err(message) => return report.panicked(message),
    };
    if let Some(middle) = middle {
        match caught(|| goes_on(&read, case, &middle)) {
            Ok(Ok(())) => {}
            Ok(Err(message)) | Err(message) => {
                let step = report.steps;
                report.violations.push(Violation { law: Law::Snapshot, step, ratio: f64::INFINITY, message });
            }
        }
    }
    Checked::Ran(report)
}

/// The middle of a run, how many steps follow, and where they end.
struct Middle {
    snapshot: Snapshot,
    steps: usize,
    end: State,
}

/// The model as the step began that ends at `model`'s time, with what is held at its end held.
fn begun(model: &Model, time: f64) -> Model {
    let mut begun = model.clone();
    for driven in &model.motions {
        if let Body::Anchor(i) = driven.body
            && !model.open.contains(&i)
            && driven.begins_by(time)
            && !driven.ends_by(time)
        {
            begun.anchors[i] = driven.at(time).pose;
        }
    }
    begun.set_changing(time);
    // What a rest that changes stores is work from inside, done before the step.
    for change in &model.changes {
        if let Changing::Rest(joint) = change.of {
            begun.joints[joint].rest_darboux = model.joints[joint].rest_darboux;
        }
    }
    begun
}

fn run(scene: &Scene, case: &Case, report: &mut Report) -> Result<Option<Middle>, String> {
    let mut simulation = simulation(scene, case)?;
    let (steps, dt) = (scene.run.steps, scene.run.dt);
    let mut model = scene.model.clone();
    let excluded = Excluded::new(&model);
    let mut states = [0; 3].map(|_| scene.state.clone());
    let mut forces = [0; 2].map(|_| vec![JointForce::default(); model.joints.len()]);
    let mut contacts = Vec::new();
    let mut sliding = vec![Sliding::default(); model.sliding_joints.len()];
    let mut balance = EnergyBalance::default();
    let (mut snapshot, mut was_whole, mut held) = (simulation.snapshot(), false, holds(&model));
    for number in 1..=steps {
        if number == steps / 2 + 1 {
            snapshot = simulation.snapshot();
        }
        let time = simulation.time();
        let status = simulation.step(dt).map_err(|error| error.to_string())?.status;
        states.rotate_left(1);
        forces.swap(0, 1);
        simulation.store(&mut states[2]);
        simulation.store_joint_forces(&mut forces[1]);
        simulation.store_contact_forces(&mut contacts);
        simulation.store_sliding(&mut sliding);
        simulation.store_model(&mut model);
        let is_same = std::mem::replace(&mut held, holds(&model)) == held;
        let is_whole = status == Status::Converged;
        let is_second = std::mem::replace(&mut was_whole, is_whole) && is_whole && is_same && number > 1;
        let before = begun(&model, time);
        let [earlier, old, new] = &states;
        let step = Step {
            number,
            model: &model,
            model_before: &before,
            states: [old, new],
            earlier: is_second.then_some(earlier),
            forces: [&forces[0], &forces[1]],
            contacts: &contacts,
            sliding: &sliding,
            time: simulation.time(),
            dt,
            status,
            method: &case.method,
            excluded: &excluded,
        };
        report.steps = number;
        report.contacts += contacts.len();
        report.unsolved += usize::from(!step.is_solved());
        let mut violations = Vec::new();
        let is_finite = laws(&step, &mut balance, &mut violations);
        for one in violations {
            if report.violations.iter().all(|known| known.law != one.law) {
                report.violations.push(one);
            }
        }
        if !is_finite {
            return Ok(None);
        }
    }
    let [_, _, end] = states;
    Ok(Some(Middle { snapshot, steps: steps - steps / 2, end }))
}

/// Which segments are fixed and which anchors open.
fn holds(model: &Model) -> (Vec<bool>, Vec<usize>) {
    let mut open = model.open.clone();
    open.sort_unstable();
    (model.segments.iter().map(|segment| segment.fixed).collect(), open)
}

/// Bits of all numbers of a state.
fn bits(state: &State) -> impl Iterator<Item = u64> {
    let vectors = [&state.positions, &state.velocities, &state.angular_velocities].into_iter().flatten().flatten();
    let remembered = state.internals.iter().flat_map(|own| own.strain.iter().chain(own.parts.iter().flatten()));
    vectors.chain(state.orientations.iter().flat_map(|q| &q.coords)).chain(remembered).map(|x| x.to_bits())
}

/// Goes on from the middle of a run: an error where it ends elsewhere.
fn goes_on(scene: &Scene, case: &Case, middle: &Middle) -> Result<(), String> {
    let mut simulation = simulation(scene, case)?;
    simulation.restore(&middle.snapshot).map_err(|error| error.to_string())?;
    for _ in 0..middle.steps {
        simulation.step(scene.run.dt).map_err(|error| error.to_string())?;
    }
    let mut state = scene.state.clone();
    simulation.store(&mut state);
    match bits(&state).zip(bits(&middle.end)).filter(|(a, b)| a != b).count() {
        0 => Ok(()),
        differ => Err(format!("{differ} numbers differ at the end")),
    }
}

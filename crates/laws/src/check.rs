//! Runs a case and holds every step against the laws.

use std::any::Any;
use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Once;

use rayon::ThreadPool;
use rod::{Body, Changing, JointForce, Model, Reaction, Reading, State};
use scene::Scene;
use solver::simulation::{ContactForce, Simulation};
use solver::step::Status;
use tempfile::TempDir;

use crate::case::Case;
use crate::laws::{Broken, Excluded, Law, Ledger, Step};

/// What became of a case.
#[derive(Clone, Debug)]
pub enum Checked {
    /// It is not run: the reader or the solver refuses it, with these words.
    Refused(String),
    /// It was run.
    Ran(Report),
}

/// What a run showed.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Laws that are broken: of each the first time, in the order of steps.
    pub broken: Vec<Broken>,
    /// Steps that were run.
    pub steps: usize,
    /// Steps that were not solved.
    pub unsolved: usize,
    /// Steps that were solved in parts.
    pub in_parts: usize,
    /// Contact forces that were looked at.
    pub contacts: usize,
}

impl Checked {
    /// How a law is broken, if it is.
    pub fn breaks(&self, law: Law) -> Option<&Broken> {
        let Self::Ran(report) = self else { return None };
        report.broken.iter().find(|broken| broken.law == law)
    }
}

thread_local! {
    /// Whether a panic of this thread is caught and told elsewhere.
    static IS_QUIET: Cell<bool> = const { Cell::new(false) };
}

/// Does this; a panic is an error with its words, and prints nothing.
fn caught<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let old = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            if !IS_QUIET.get() {
                old(info);
            }
        }));
    });
    let before = IS_QUIET.replace(true);
    let result = catch_unwind(AssertUnwindSafe(work));
    IS_QUIET.set(before);
    let words = |panic: Box<dyn Any + Send>| match (panic.downcast_ref::<String>(), panic.downcast_ref::<&str>()) {
        (Some(words), _) => words.clone(),
        (_, Some(words)) => (*words).to_owned(),
        _ => "a panic without words".to_owned(),
    };
    result.map_err(words)
}

/// The scene of a case, and the folder of its files while it is read.
fn scene(case: &Case) -> Result<Scene, String> {
    if case.files.is_empty() {
        return scene::parse(&case.text, "scene.toml").map_err(|error| error.to_string());
    }
    let folder = TempDir::new().map_err(|error| error.to_string())?;
    for (name, text) in &case.files {
        std::fs::write(folder.path().join(name), text).map_err(|error| error.to_string())?;
    }
    let file = folder.path().join("scene.toml").display().to_string();
    scene::parse(&case.text, &file).map_err(|error| error.to_string())
}

/// Whether the reader and the solver take a case. One at which they panic is taken: [`check`] tells of it.
pub(crate) fn is_accepted(case: &Case) -> bool {
    refusal(case).is_none()
}

/// Why a case is refused.
pub(crate) fn refusal(case: &Case) -> Option<String> {
    let built = caught(|| {
        let scene = scene(case)?;
        Simulation::new(&scene.model, &scene.state, &case.way.settings(), None).map_err(|error| error.to_string())?;
        Ok(())
    });
    match built {
        Ok(Err(words)) => Some(words),
        _ => None,
    }
}

fn panicked(step: usize, words: String) -> Broken {
    Broken { law: Law::Panic, step, size: f64::INFINITY, words }
}

/// Pools of one thread and of two, in which cases are run.
pub(crate) struct Pools([ThreadPool; 2]);

impl Pools {
    /// Both of them.
    ///
    /// # Errors
    /// If the system gives no threads.
    pub(crate) fn new() -> Result<Self, rayon::ThreadPoolBuildError> {
        let pool = |count| rayon::ThreadPoolBuilder::new().num_threads(count).build();
        Ok(Self([pool(1)?, pool(2)?]))
    }
}

/// Runs a case on one thread, from the middle on once more from a snapshot, and on two threads.
///
/// # Errors
/// If the system gives no threads.
pub fn check(case: &Case) -> Result<Checked, rayon::ThreadPoolBuildError> {
    Ok(check_in(case, &Pools::new()?))
}

/// The same in pools that are there.
pub(crate) fn check_in(case: &Case, pools: &Pools) -> Checked {
    let [one, two] = &pools.0;
    let read = match one.install(|| caught(|| scene(case))) {
        Ok(Ok(scene)) => scene,
        Ok(Err(words)) => return Checked::Refused(words),
        Err(words) => {
            return Checked::Ran(Report {
                broken: vec![panicked(0, format!("reading the scene: {words}"))],
                ..Report::default()
            });
        }
    };
    let mut report = Report::default();
    let first = one.install(|| caught(|| run(&read, case, &mut report)));
    let last = match first {
        Ok(Ok(last)) => last,
        Ok(Err(words)) => return Checked::Refused(words),
        Err(words) => {
            let step = report.steps + 1;
            report.broken.push(panicked(step, words));
            return Checked::Ran(report);
        }
    };
    if last.state.is_empty() {
        return Checked::Ran(report);
    }
    again(&read, case, &last, [one, two], &mut report);
    Checked::Ran(report)
}

/// The end of a run, and its middle.
struct Last {
    state: State,
    middle: Option<(usize, solver::snapshot::Snapshot)>,
    steps: usize,
}

fn simulation(scene: &Scene, case: &Case) -> Result<Simulation, String> {
    Simulation::new(&scene.model, &scene.state, &case.way.settings(), None).map_err(|error| error.to_string())
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
    for change in &model.changes {
        let value = change.track.at(time);
        match change.of {
            Changing::Gravity => begun.gravity = value,
            Changing::Force(load) => begun.loads[load].force = value,
            Changing::Torque(load) => begun.loads[load].torque = value,
        }
    }
    begun
}

fn run(scene: &Scene, case: &Case, report: &mut Report) -> Result<Last, String> {
    let mut simulation = simulation(scene, case)?;
    let (count, steps, dt) = (scene.model.segments.len(), scene.run.steps, scene.run.dt);
    let mut model = scene.model.clone();
    let excluded = Excluded::new(&scene.model);
    let mut states = [scene.state.clone(), scene.state.clone(), scene.state.clone()];
    let none = vec![JointForce::default(); model.joints.len()];
    let mut forces = [none.clone(), none];
    let mut contacts: Vec<ContactForce> = Vec::new();
    let mut ledger = Ledger::default();
    let (mut middle, mut was_whole) = (None, false);
    let mut held = holds(&model);
    for number in 1..=steps {
        if number == steps / 2 + 1 {
            middle = Some((number - 1, simulation.snapshot()));
        }
        let time = simulation.time();
        let status = simulation.step(dt).map_err(|error| error.to_string())?.status;
        states.rotate_left(1);
        forces.swap(0, 1);
        simulation.store(&mut states[2]);
        simulation.store_joint_forces(&mut forces[1]);
        simulation.store_contact_forces(&mut contacts);
        simulation.store_model(&mut model);
        report.steps = number;
        report.contacts += contacts.len();
        report.unsolved += usize::from(!matches!(status, Status::Converged | Status::ConvergedInSubsteps));
        report.in_parts += usize::from(status == Status::ConvergedInSubsteps);
        let now = holds(&model);
        let is_same = now == held;
        held = now;
        let before = begun(&model, time);
        let [earlier, old, new] = &states;
        let earlier = (number > 1 && was_whole && status == Status::Converged && is_same).then_some(earlier);
        let (way, [was, is]) = (&case.way, &forces);
        let step = Step {
            number,
            model: &model,
            model_before: &before,
            states: [old, new],
            earlier,
            forces: [was, is],
            contacts: &contacts,
            time: simulation.time(),
            dt,
            status,
            way,
            excluded: &excluded,
        };
        let mut broken = Vec::new();
        step.laws(&mut broken);
        let is_finite = broken.iter().all(|one| one.law != Law::Finite);
        if is_finite {
            ledger.step(&step, &mut broken);
            probes(scene, &step, &mut broken);
        }
        for one in broken {
            if report.broken.iter().all(|known| known.law != one.law) {
                report.broken.push(one);
            }
        }
        was_whole = status == Status::Converged;
        if !is_finite || count == 0 {
            break;
        }
    }
    let [_, _, state] = states;
    Ok(Last { state, middle, steps: report.steps })
}

/// Which segments are fixed and which anchors open.
fn holds(model: &Model) -> (Vec<bool>, Vec<usize>) {
    let mut open = model.open.clone();
    open.sort_unstable();
    (model.segments.iter().map(|segment| segment.fixed).collect(), open)
}

/// Places that have what a probe reads give numbers.
fn probes(scene: &Scene, step: &Step<'_>, broken: &mut Vec<Broken>) {
    if scene.probes.is_empty() {
        return;
    }
    let reactions = Reaction::all(step.model, step.states, [step.time - step.dt, step.time], step.forces[1], &[]);
    let reading = Reading {
        model: step.model,
        time: step.time,
        state: step.states[1],
        forces: step.forces[1],
        reactions: &reactions,
    };
    let mut values = Vec::new();
    for probe in &scene.probes {
        probe.read(&reading, &mut values);
        let is_finite = values.iter().all(|x| x.is_finite());
        step.hold(broken, Law::Finite, f64::from(u8::from(!is_finite)), 0.0, || {
            format!("probe {} reads {values:?}", probe.name)
        });
    }
}

/// Bits of all numbers of a state.
fn bits(state: &State) -> Vec<u64> {
    let vectors = [&state.positions, &state.velocities, &state.angular_velocities].into_iter().flatten().flatten();
    vectors.chain(state.orientations.iter().flat_map(|q| &q.coords)).map(|x| x.to_bits()).collect()
}

/// Runs from the middle on from a snapshot, and all of it on two threads.
fn again(scene: &Scene, case: &Case, last: &Last, [one, two]: [&ThreadPool; 2], report: &mut Report) {
    let dt = scene.run.dt;
    let go = |from: Option<(usize, &solver::snapshot::Snapshot)>| {
        let mut simulation = simulation(scene, case)?;
        let mut done = 0;
        if let Some((step, snapshot)) = from {
            simulation.restore(snapshot).map_err(|error| error.to_string())?;
            done = step;
        }
        for _ in done..last.steps {
            simulation.step(dt).map_err(|error| error.to_string())?;
        }
        let mut state = scene.state.clone();
        simulation.store(&mut state);
        Ok((state, simulation.threads()))
    };
    let mut compare = |law: Law, found: Result<Result<(State, usize), String>, String>| {
        let words = match found {
            Err(words) => format!("a panic: {words}"),
            Ok(Err(words)) => words,
            Ok(Ok((state, _))) => {
                let (a, b) = (bits(&state), bits(&last.state));
                let differ = a.iter().zip(&b).filter(|(a, b)| a != b).count();
                if differ == 0 {
                    return;
                }
                format!("{differ} of {} numbers differ after step {}", a.len(), last.steps)
            }
        };
        report.broken.push(Broken { law, step: last.steps, size: f64::INFINITY, words });
    };
    if let Some((step, snapshot)) = &last.middle {
        compare(Law::Snapshot, one.install(|| caught(|| go(Some((*step, snapshot))))));
    }
    // Small ones have nothing to share.
    let shares = two.install(|| caught(|| simulation(scene, case).map(|own| own.threads())));
    if shares.is_ok_and(|shares| shares.is_ok_and(|count| count > 1)) {
        compare(Law::Threads, two.install(|| caught(|| go(None))));
    }
}

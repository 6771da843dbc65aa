//! The loop: what viewers ask for, steps when they are due, frames for viewers.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

use dynamics::simulation::Simulation;
use dynamics::step::Status;
use rod::{JointForce, Model, measure};
use serde_json::json;

use crate::LiveError;
use crate::command::Command;
use crate::frame::{self, Facts};
use crate::hub::{Hub, Id};
use crate::input::{Input, Recording};
use crate::pacer::Pacer;
use crate::server::Server;
use crate::session::{Rebuild, Session};

/// Frames a second that viewers are shown, at most.
const FRAMES: f64 = 60.0;
/// Longest wait for commands, after which it is seen whether to end.
const PATIENCE: Duration = Duration::from_millis(100);

/// Saves a recording, and says where. It is called in a thread of its own.
pub type Save = Arc<dyn Fn(Recording) -> Result<String, String> + Send + Sync>;

/// How a simulation is shown.
#[derive(Clone)]
pub struct Options {
    /// What the page is called: the scene's name.
    pub name: String,
    /// Names of rods and rigid bodies, by [`rod::Segment::rod`], and of obstacles; may be empty.
    pub names: [Vec<String>; 2],
    /// Port; 0 for any that is free.
    pub port: u16,
    /// How long the view goes on after the last page was closed.
    pub alone: Duration,
    /// What saves recordings, if anything does.
    pub save: Option<Save>,
}

impl Options {
    /// A page of this name, on any port; it ends a minute after it was closed.
    pub fn new(name: &str) -> Self {
        Self { name: name.to_owned(), names: Default::default(), port: 0, alone: Duration::from_secs(60), save: None }
    }
}

/// A live view of a simulation.
pub struct Live<'a> {
    session: Session<'a>,
    options: Options,
    hub: Arc<Hub>,
    server: Server,
    pacer: Pacer,
    plays: bool,
    /// Steps that are to be done though time stands.
    singles: u32,
    /// Of the last step.
    status: Status,
    step_s: f64,
    shown: Option<Instant>,
    /// Whether there is something to show that has not been shown.
    is_stale: bool,
    forces: Vec<JointForce>,
    iterations: f64,
    /// Where saved recordings report.
    saving: Option<(Id, Receiver<Result<String, String>>)>,
    leader: Option<Id>,
}

impl<'a> Live<'a> {
    /// Starts the server of a `simulation` of `model` with steps of `dt` [s]; time stands until [`Live::turn`]. For hands to pull,
    /// the model must be one [`crate::with_hands`]; for stiffness, damping, friction and wind, it needs `rebuild`.
    ///
    /// # Errors
    /// If the port is taken.
    pub fn open(
        model: &Model,
        simulation: &mut Simulation,
        dt: f64,
        rebuild: Option<Rebuild<'a>>,
        options: Options,
    ) -> Result<Self, LiveError> {
        let hub = Arc::new(Hub::default());
        let mut session = Session::new(model, simulation, dt, rebuild);
        let (now, state) = session.store(simulation);
        let mut recorder = view::Recorder::new(&options.name, dt, now);
        let [rods, obstacles] = options.names.clone();
        recorder.name(rods, obstacles);
        recorder.push(&view::Frame {
            time: simulation.time(),
            state,
            forces: &[],
            energy: measure::energy(now, state).total(),
            length_ratio: 1.0,
            iterations: 0.0,
        });
        let first = recorder.finish();
        let server = Server::open(options.port, hub.clone(), |port| view::live_page(&first, port))?;
        Ok(Self {
            session,
            options,
            hub,
            server,
            pacer: Pacer::new(),
            plays: true,
            singles: 0,
            status: Status::Converged,
            step_s: 0.0,
            shown: None,
            is_stale: true,
            forces: vec![JointForce::default(); model.joints.len()],
            iterations: 0.0,
            saving: None,
            leader: None,
        })
    }

    /// What to open in a browser of this machine. Whoever knows it can watch and handle the simulation.
    pub fn address(&self) -> String {
        self.server.address()
    }

    /// What was done up to now.
    pub fn recording(&self) -> Recording {
        self.session.recording()
    }

    /// Does what viewers have asked for, the next step if it is due, and shows what came of it; else waits a little. Returns whether
    /// the view goes on: not after the last page has been closed for [`Options::alone`].
    ///
    /// # Errors
    /// If the simulation refuses a step.
    pub fn turn(&mut self, simulation: &mut Simulation) -> Result<bool, LiveError> {
        if self.hub.alone().is_some_and(|alone| alone > self.options.alone) {
            return Ok(false);
        }
        let now = Instant::now();
        let dt = self.session.dt();
        let wait = match (self.singles, self.plays) {
            (1.., _) => Duration::ZERO,
            (0, true) => self.pacer.wait(now, simulation.time(), dt),
            (0, false) => PATIENCE,
        };
        let until_shown = self.until_shown(now);
        self.follow_leader(simulation)?;
        let patience = if self.is_stale { wait.min(until_shown) } else { wait.min(PATIENCE) };
        for (id, command) in self.hub.commands(patience) {
            if let Err(error) = self.obey(simulation, id, command) {
                self.hub.tell(id, json!({ "refused": error.to_string() }).to_string());
            }
        }
        if wait <= now.elapsed() && (self.plays || self.singles > 0) {
            self.step(simulation)?;
        }
        self.report_saved();
        if self.is_stale && self.until_shown(Instant::now()).is_zero() {
            self.show(simulation);
        }
        self.tell();
        Ok(true)
    }

    /// Lets go what a leader held that has gone.
    fn follow_leader(&mut self, simulation: &mut Simulation) -> Result<(), LiveError> {
        let (leader, _) = self.hub.viewers();
        let before = std::mem::replace(&mut self.leader, leader);
        if before.is_some() && before != leader {
            for hand in self.session.holding() {
                self.session.apply(simulation, Input::Drop { hand })?;
            }
        }
        Ok(())
    }

    /// Ends the view; waits for a recording that is being saved, and says what came of it.
    pub fn finish(self) -> Option<Result<String, String>> {
        self.hub.end();
        let (_, receiver) = self.saving?;
        receiver.recv().ok()
    }

    fn until_shown(&self, now: Instant) -> Duration {
        let since = self.shown.map_or(Duration::MAX, |shown| now.duration_since(shown));
        Duration::from_secs_f64(1.0 / FRAMES).saturating_sub(since)
    }

    fn step(&mut self, simulation: &mut Simulation) -> Result<(), LiveError> {
        self.singles = self.singles.saturating_sub(1);
        let begin = Instant::now();
        self.hub.stepping(Some(begin));
        let before = simulation.counters().iterations;
        let done = self.session.prepare(simulation).and_then(|()| Ok(simulation.step(self.session.dt())?));
        self.hub.stepping(None);
        self.status = done?.status;
        self.step_s = begin.elapsed().as_secs_f64();
        self.iterations = (simulation.counters().iterations - before) as f64 / simulation.components().max(1) as f64;
        self.is_stale = true;
        if self.status.is_stuck() {
            // Nothing good comes after it; one can still go back.
            self.session.stuck();
            (self.plays, self.singles) = (false, 0);
            self.pacer.stop();
        } else {
            self.session.stepped(simulation);
            self.pacer.came(Instant::now(), simulation.time());
        }
        Ok(())
    }

    fn obey(&mut self, simulation: &mut Simulation, id: Id, command: Command) -> Result<(), LiveError> {
        match command {
            Command::Do(input) => self.session.apply(simulation, input)?,
            Command::Play | Command::Step if self.status.is_stuck() => {
                return Err(LiveError::refused("there is no going on from here: go back, or reset"));
            }
            Command::Play => self.plays = true,
            Command::Pause => {
                self.plays = false;
                self.pacer.stop();
            }
            Command::Step => {
                (self.plays, self.singles) = (false, self.singles.saturating_add(1).min(100));
                self.pacer.stop();
            }
            Command::Pace(pace) => self.pacer.set_pace(pace),
            Command::Back(time) => {
                self.plays = false;
                self.session.go_to(simulation, time)?;
                self.stand();
            }
            Command::Reset => {
                self.session.reset(simulation)?;
                self.stand();
            }
            Command::Save => self.save(id)?,
        }
        self.is_stale = true;
        Ok(())
    }

    /// Time is another one.
    fn stand(&mut self) {
        (self.status, self.singles) = (Status::Converged, 0);
        self.pacer.stop();
    }

    fn save(&mut self, id: Id) -> Result<(), LiveError> {
        let Some(save) = self.options.save.clone() else { return Err(LiveError::refused("nothing saves here")) };
        if self.saving.is_some() {
            return Err(LiveError::refused("it is being saved already"));
        }
        let recording = self.session.recording();
        let (sender, receiver) = channel();
        let work = move || {
            let _ = sender.send(save(recording));
        };
        let spawned = thread::Builder::new().name("live save".to_owned()).spawn(work);
        spawned.map_err(|error| LiveError::refused(error.to_string()))?;
        self.saving = Some((id, receiver));
        Ok(())
    }

    fn report_saved(&mut self) {
        let Some((id, receiver)) = &self.saving else { return };
        let message = match receiver.try_recv() {
            Ok(Ok(place)) => json!({ "saved": place }),
            Ok(Err(why)) => json!({ "refused": why }),
            Err(std::sync::mpsc::TryRecvError::Empty) => return,
            Err(std::sync::mpsc::TryRecvError::Disconnected) => json!({ "refused": "it was not saved" }),
        };
        self.hub.tell(*id, message.to_string());
        self.saving = None;
    }

    fn show(&mut self, simulation: &mut Simulation) {
        simulation.store_joint_forces(&mut self.forces);
        let times = self.session.times(simulation);
        let steps = self.session.steps();
        let (model, state) = self.session.store(simulation);
        let facts = Facts {
            time: simulation.time(),
            speed: self.pacer.speed(),
            energy: measure::energy(model, state).total(),
            iterations: self.iterations,
            times,
            step_s: self.step_s,
            steps,
        };
        let hands: Vec<_> = self.session.hands().collect();
        let bytes = frame::bytes(self.session.model(), self.session.state(), &self.forces, hands.into_iter(), &facts);
        self.hub.show(bytes);
        (self.shown, self.is_stale) = (Some(Instant::now()), false);
    }

    /// Tells viewers how things are.
    fn tell(&self) {
        let (leader, viewers) = self.hub.viewers();
        let status = json!({
            "plays": self.plays,
            "pace": self.pacer.pace(),
            "dt": self.session.dt(),
            "status": self.status.name(),
            "solved": self.status.is_converged(),
            "stuck": self.status.is_stuck(),
            "knobs": self.session.knobs(),
            "rebuilds": self.session.rebuilds(),
            "pins": self.session.pins(),
            "saves": self.options.save.is_some(),
            "saving": self.saving.is_some(),
            "leader": leader,
            "viewers": viewers,
        });
        self.hub.tell_all(json!({ "status": status }).to_string());
    }
}

/// Shows a simulation until `goes_on` says no, or the last page has been closed for a minute; `told` is told the address once.
/// See [`Live::open`] for the other arguments.
///
/// # Errors
/// If the port is taken, or the simulation refuses a step.
pub fn serve(
    model: &Model,
    simulation: &mut Simulation,
    dt: f64,
    options: Options,
    told: impl FnOnce(&str),
    goes_on: impl Fn() -> bool,
) -> Result<Recording, LiveError> {
    let mut live = Live::open(model, simulation, dt, None, options)?;
    told(&live.address());
    while goes_on() && live.turn(simulation)? {}
    Ok(live.recording())
}

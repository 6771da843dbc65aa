//! What the simulation and the connections share: the newest frame, messages, commands.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::command::Command;

/// Commands that may wait; more are refused.
const WAITING: usize = 256;
/// Messages that may wait for a viewer; older ones give way.
const MESSAGES: usize = 64;

/// A step that takes longer is told of [s].
const LONG: Duration = Duration::from_millis(400);

/// Names a viewer; the lowest one leads.
pub(crate) type Id = u64;

/// What a connection sends next.
#[derive(Clone, Debug)]
pub(crate) enum News {
    Text(String),
    /// The answer to a ping.
    Pong(Vec<u8>),
    Frame(Arc<Vec<u8>>),
    /// Nothing is left to send.
    End,
}

#[derive(Debug, Default)]
struct Shared {
    frame: Arc<Vec<u8>>,
    frames: u64,
    status: String,
    statuses: u64,
    commands: VecDeque<(Id, Command)>,
    viewers: BTreeMap<Id, VecDeque<News>>,
    viewers_ever: Id,
    /// When the last viewer has left.
    left: Option<Instant>,
    stepping: Option<Instant>,
    is_over: bool,
}

/// Shared by all threads.
#[derive(Debug, Default)]
pub(crate) struct Hub {
    shared: Mutex<Shared>,
    /// For connections.
    news: Condvar,
    /// For the simulation.
    asked: Condvar,
}

/// What a connection has sent.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Seen {
    frames: u64,
    statuses: u64,
}

impl Hub {
    fn lock(&self) -> MutexGuard<'_, Shared> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A viewer comes.
    pub(crate) fn enter(&self) -> Id {
        let mut shared = self.lock();
        let id = shared.viewers_ever;
        shared.viewers_ever += 1;
        let own = serde_json::json!({ "you": id }).to_string();
        shared.viewers.insert(id, VecDeque::from([News::Text(own)]));
        shared.left = None;
        self.asked.notify_all();
        id
    }

    /// A viewer goes.
    pub(crate) fn leave(&self, id: Id) {
        let mut shared = self.lock();
        shared.viewers.remove(&id);
        // What it still asked for would be done after its hands have let go.
        shared.commands.retain(|(own, _)| *own != id);
        if shared.viewers.is_empty() {
            shared.left = Some(Instant::now());
        }
        self.asked.notify_all();
        self.news.notify_all();
    }

    /// The viewer that leads, and how many there are.
    pub(crate) fn viewers(&self) -> (Option<Id>, usize) {
        let shared = self.lock();
        (shared.viewers.keys().next().copied(), shared.viewers.len())
    }

    /// How long no viewer has been there, since one was.
    pub(crate) fn alone(&self) -> Option<Duration> {
        self.lock().left.map(|left| left.elapsed())
    }

    /// A viewer asks for something.
    ///
    /// # Errors
    /// If it does not lead, or there is too much to do.
    pub(crate) fn ask(&self, id: Id, command: Command) -> Result<(), &'static str> {
        let mut shared = self.lock();
        if shared.viewers.keys().next() != Some(&id) {
            return Err("another page leads; this one watches until that is closed");
        }
        if shared.commands.len() >= WAITING {
            return Err("too many commands wait");
        }
        shared.commands.push_back((id, command));
        self.asked.notify_all();
        Ok(())
    }

    /// All commands that wait; if there are none, waits for one so long.
    pub(crate) fn commands(&self, patience: Duration) -> VecDeque<(Id, Command)> {
        let mut shared = self.lock();
        if shared.commands.is_empty() && !patience.is_zero() {
            shared = self.asked.wait_timeout(shared, patience).unwrap_or_else(PoisonError::into_inner).0;
        }
        std::mem::take(&mut shared.commands)
    }

    /// Shows all viewers a frame in the place of the last one.
    pub(crate) fn show(&self, frame: Vec<u8>) {
        let mut shared = self.lock();
        shared.frame = Arc::new(frame);
        shared.frames += 1;
        self.news.notify_all();
    }

    /// Tells all viewers how things are, if that is news.
    pub(crate) fn tell_all(&self, status: String) {
        let mut shared = self.lock();
        if shared.status != status {
            shared.status = status;
            shared.statuses += 1;
            self.news.notify_all();
        }
    }

    /// Tells one viewer something.
    pub(crate) fn tell(&self, id: Id, message: String) {
        self.send(id, News::Text(message));
    }

    /// Answers a viewer's ping.
    pub(crate) fn pong(&self, id: Id, ping: Vec<u8>) {
        self.send(id, News::Pong(ping));
    }

    fn send(&self, id: Id, message: News) {
        if let Some(messages) = self.lock().viewers.get_mut(&id) {
            if messages.len() >= MESSAGES {
                messages.pop_front();
            }
            messages.push_back(message);
        }
        self.news.notify_all();
    }

    /// A step begins, or has ended.
    pub(crate) fn stepping(&self, since: Option<Instant>) {
        self.lock().stepping = since;
    }

    /// The view ends.
    pub(crate) fn end(&self) {
        self.lock().is_over = true;
        self.news.notify_all();
    }

    pub(crate) fn is_over(&self) -> bool {
        self.lock().is_over
    }

    /// What a viewer has not been sent yet; waits for it. Where a step takes long, that is said again and again.
    pub(crate) fn news(&self, id: Id, seen: &mut Seen) -> News {
        let mut shared = self.lock();
        loop {
            if shared.is_over {
                return News::End;
            }
            let Some(messages) = shared.viewers.get_mut(&id) else { return News::End };
            if let Some(message) = messages.pop_front() {
                return message;
            }
            if seen.statuses != shared.statuses {
                seen.statuses = shared.statuses;
                return News::Text(shared.status.clone());
            }
            if seen.frames != shared.frames {
                seen.frames = shared.frames;
                return News::Frame(shared.frame.clone());
            }
            let (next, waited) = self.news.wait_timeout(shared, LONG).unwrap_or_else(PoisonError::into_inner);
            shared = next;
            let busy = shared.stepping.map(|since| since.elapsed()).filter(|busy| waited.timed_out() && *busy > LONG);
            if let Some(busy) = busy {
                return News::Text(serde_json::json!({ "busy": busy.as_secs_f64() }).to_string());
            }
        }
    }
}

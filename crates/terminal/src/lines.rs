//! Progress in a log: a line every few seconds where standard error is not a terminal.

use std::io::{self, Write};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

/// Time from one line to the next.
const RHYTHM: Duration = Duration::from_secs(10);

/// What is shared with the thread that prints.
struct Shared {
    length: usize,
    unit: String,
    begin: Instant,
    done: AtomicUsize,
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    /// What goes on beside the counted things, and since when.
    beside: Option<(String, Instant)>,
    ended: bool,
}

/// Prints lines until it is dropped.
pub(crate) struct Lines {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Lines {
    /// Lines about `length` things called `unit`, to standard error.
    pub(crate) fn new(length: usize, unit: &str) -> Self {
        // Where standard error is closed, nobody reads them.
        Self::with(length, unit, RHYTHM, |line| drop(writeln!(io::stderr(), "{line}")))
    }

    fn with(length: usize, unit: &str, rhythm: Duration, mut print: impl FnMut(String) + Send + 'static) -> Self {
        let shared = Arc::new(Shared {
            length,
            unit: unit.to_owned(),
            begin: Instant::now(),
            done: AtomicUsize::new(0),
            state: Mutex::default(),
            changed: Condvar::new(),
        });
        let own = shared.clone();
        let tell = move || {
            let mut next = own.begin + rhythm;
            let mut state = own.state.lock().unwrap_or_else(PoisonError::into_inner);
            while !state.ended {
                let now = Instant::now();
                if now >= next {
                    next = now + rhythm;
                    print(own.line(&state, now));
                }
                state = own.changed.wait_timeout(state, next - now).unwrap_or_else(PoisonError::into_inner).0;
            }
        };
        // Without a thread there are no lines, and the work goes on.
        Self { shared, thread: Builder::new().name("progress".to_owned()).spawn(tell).ok() }
    }

    pub(crate) fn advance_by(&self, count: usize) {
        self.shared.done.fetch_add(count, Ordering::Relaxed);
    }

    pub(crate) fn beside(&self, what: &str) {
        self.change(|state| state.beside = Some((what.to_owned(), Instant::now())));
    }

    fn change(&self, change: impl FnOnce(&mut State)) {
        change(&mut self.shared.state.lock().unwrap_or_else(PoisonError::into_inner));
        self.shared.changed.notify_all();
    }
}

impl Shared {
    fn line(&self, state: &State, now: Instant) -> String {
        let seconds = |since: Instant| now.duration_since(since).as_secs();
        if let Some((what, since)) = &state.beside {
            return format!("{what}: {} s", seconds(*since));
        }
        let (done, gone) = (self.done.load(Ordering::Relaxed), seconds(self.begin));
        let left = match done {
            0 => String::new(),
            _ => format!(
                ", about {} s left",
                (gone as f64 * self.length.saturating_sub(done) as f64 / done as f64).ceil()
            ),
        };
        format!("{done}/{} {}, {gone} s gone{left}", self.length, self.unit)
    }
}

impl Drop for Lines {
    fn drop(&mut self) {
        self.change(|state| state.ended = true);
        // It has nothing left to say.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use super::*;

    #[test]
    fn lines_come_until_the_end_and_say_what_is_done() {
        let (sender, lines) = mpsc::channel();
        let own = Lines::with(40, "steps", Duration::from_millis(1), move |line| drop(sender.send(line)));
        assert_eq!(lines.recv().unwrap(), "0/40 steps, 0 s gone");
        own.advance_by(10);
        let said = |expected: &str| lines.iter().find(|line| line == expected).is_some();
        assert!(said("10/40 steps, 0 s gone, about 0 s left"));
        own.beside("writing a.csv");
        assert!(said("writing a.csv: 0 s"));
        drop(own);
        while lines.recv().is_ok() {}
    }

    #[test]
    fn the_time_left_is_that_of_what_is_left() {
        let (begin, state) = (Instant::now(), State::default());
        let shared = Shared {
            length: 1000,
            unit: "steps".to_owned(),
            begin,
            done: AtomicUsize::new(120),
            state: Mutex::default(),
            changed: Condvar::new(),
        };
        let line = shared.line(&state, begin + Duration::from_secs(30));
        assert_eq!(line, "120/1000 steps, 30 s gone, about 220 s left");
    }
}

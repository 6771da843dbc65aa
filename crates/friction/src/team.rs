//! A team of threads for many short pieces of work in a row, between which they stay awake.
//!
//! rayon's threads fall asleep where there is nothing to do, and take some 50 us to wake; sweeps over contacts come in pieces
//! of that length. So a thread that leads asks for helpers once, and those wait in a loop for the pieces of one job after the
//! other, until the lead is done. Whoever is not there (as it works on something else) is not waited for: the lead takes
//! pieces itself. Which thread does a piece must not matter.

pub mod pieces;

use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

use kernels::parallel;

/// Spins of a thread that waits before it lets others have the processor.
const SPINS: usize = 2000;

/// What is on the board: which job, what kind of work, how many pieces, and the next one. All of it is one number, so that who
/// takes a piece knows of which job it is.
#[derive(Clone, Copy, PartialEq)]
struct Ticket {
    job: u32,
    kind: u8,
    count: u16,
    piece: u16,
}

/// Job after the last one; others are below 2^24.
const END: u32 = (1 << 24) - 1;

impl Ticket {
    fn of(number: u64) -> Self {
        Self {
            job: (number >> 40) as u32,
            kind: (number >> 32) as u8,
            count: (number >> 16) as u16,
            piece: number as u16,
        }
    }

    fn number(self) -> u64 {
        u64::from(self.job) << 40 | u64::from(self.kind) << 32 | u64::from(self.count) << 16 | u64::from(self.piece)
    }
}

/// What the threads of a team know of the job under way.
struct Board {
    ticket: AtomicU64,
    /// Pieces of it that are done.
    done: AtomicUsize,
}

/// The lead's end of a team: work is `work(kind, piece)`.
pub(crate) struct Team<'a> {
    board: &'a Board,
    work: &'a (dyn Fn(u8, usize) + Sync),
    jobs: u32,
    /// Whether anybody may help.
    has_helpers: bool,
}

impl Team<'_> {
    /// Does pieces `0..count` of a kind of work, with those who help; returns when all are done.
    pub(crate) fn all(&mut self, kind: u8, count: u16) {
        if !self.has_helpers || count == 1 {
            (0..count).for_each(|piece| (self.work)(kind, usize::from(piece)));
            return;
        }
        self.board.done.store(0, Ordering::Relaxed);
        self.jobs = (self.jobs + 1) % END;
        let ticket = Ticket { job: self.jobs, kind, count, piece: 0 };
        // All that was written before is seen by who takes a piece.
        self.board.ticket.store(ticket.number(), Ordering::Release);
        take_pieces(self.board, self.work);
        let mut spins = 0;
        while self.board.done.load(Ordering::Acquire) < usize::from(count) {
            wait(&mut spins);
        }
    }
}

/// Takes pieces of the job under way until none is left; returns the job.
fn take_pieces(board: &Board, work: &(dyn Fn(u8, usize) + Sync)) -> u32 {
    loop {
        let number = board.ticket.load(Ordering::Acquire);
        let Ticket { job, kind, count, piece } = Ticket::of(number);
        if piece >= count {
            return job;
        }
        if board.ticket.compare_exchange(number, number + 1, Ordering::AcqRel, Ordering::Relaxed).is_ok() {
            let _done = Done(board);
            work(kind, usize::from(piece));
        }
    }
}

/// Counts a piece as done, also where it panics: nobody must wait for it.
struct Done<'a>(&'a Board);

impl Drop for Done<'_> {
    fn drop(&mut self) {
        self.0.done.fetch_add(1, Ordering::Release);
    }
}

fn wait(spins: &mut usize) {
    *spins += 1;
    if *spins < SPINS {
        std::hint::spin_loop();
    } else {
        std::thread::yield_now();
    }
}

fn help(board: &Board, work: &(dyn Fn(u8, usize) + Sync)) {
    let (mut last, mut spins) = (0, 0);
    loop {
        let job = take_pieces(board, work);
        if job == END {
            return;
        }
        if job != last {
            (last, spins) = (job, 0);
        }
        wait(&mut spins);
    }
}

/// Ends the jobs, also where the lead panics: helpers must not wait for ever.
struct Ends<'a>(&'a Board);

impl Drop for Ends<'_> {
    fn drop(&mut self) {
        let end = Ticket { job: END, kind: 0, count: 0, piece: 0 };
        self.0.ticket.store(end.number(), Ordering::Release);
    }
}

/// Runs `lead`, whom up to `helpers` threads of the pool help with `work`.
pub(crate) fn lead(helpers: usize, work: &(dyn Fn(u8, usize) + Sync), lead: &mut (dyn FnMut(&mut Team<'_>) + Send)) {
    let board = Board { ticket: AtomicU64::new(0), done: AtomicUsize::new(0) };
    with_helpers(helpers, &board, work, &mut || {
        let _ends = Ends(&board);
        lead(&mut Team { board: &board, work, jobs: 0, has_helpers: helpers > 0 });
    });
}

fn with_helpers(helpers: usize, board: &Board, work: &(dyn Fn(u8, usize) + Sync), lead: &mut (dyn FnMut() + Send)) {
    match helpers {
        0 => lead(),
        _ => {
            parallel::join(|| with_helpers(helpers - 1, board, work, lead), || help(board, work));
        }
    }
}

#[cfg(test)]
mod tests;

//! How a command ended.

/// How a command ended: the program's exit code.
#[repr(u8)]
pub(crate) enum Outcome {
    Done = 0,
    /// A report has faults, runs differ, or numbers are not finite.
    Faulty = 1,
    /// Wrong flags, places that cannot be written to, damaged results.
    BadInput = 2,
    Interrupted = terminal::INTERRUPTED,
}

impl Outcome {
    /// Says of what the numbers are not finite.
    pub(crate) fn not_finite(scene: &str, way: &str) -> Self {
        terminal::complain(format_args!("numbers are not finite: {scene}, {way}"));
        Self::Faulty
    }
}

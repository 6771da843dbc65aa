//! How a program ended.

/// How a program ended.
pub(crate) enum Outcome {
    Done,
    Interrupted,
}

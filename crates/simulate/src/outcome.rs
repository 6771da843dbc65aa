//! How a command ended.

/// How a command ended.
pub(crate) enum Outcome {
    Done,
    Interrupted,
    /// The run went wrong, or could not go on: where and why.
    Stuck(String),
    /// The run came to its end with steps that were not solved to their tolerance: how many.
    Inaccurate(String),
    /// No equilibrium was found.
    NotConverged,
}

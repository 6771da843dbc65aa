//! What a linear solve did, and how it ended.

/// How a linear solve ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LinearStatus {
    /// To the tolerance, or exactly.
    #[default]
    Solved,
    /// The cap on iterations came first; the result is the best so far.
    OutOfIterations,
    /// The matrix was not positive definite in floating point.
    NotPositiveDefinite,
}

/// What a linear solve did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LinearInfo {
    /// How it ended.
    pub status: LinearStatus,
    /// Iterations; 0 for a direct solve.
    pub iterations: u64,
    /// Whether there was a start that is not finite, or so large that its rounding errors would show in the solution, and the
    /// solver began from zero instead.
    pub start_dropped: bool,
    /// Residual relative to the right-hand side, in the solver's own norm; 0 for a direct solve.
    pub residual: f64,
    /// Relative residual of the stretch-shear rows alone, diagonally scaled; 0 for a direct solve.
    pub stretch_residual: f64,
    /// Relative residual of the bend-twist rows alone, diagonally scaled; 0 for a direct solve.
    pub bend_residual: f64,
}

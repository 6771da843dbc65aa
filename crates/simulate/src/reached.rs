//! How far a run came.

use std::time::Duration;

use anyhow::Error;
use cosserat::simulation::Status;

use crate::apart::Apart;

/// What was done of a run when it ended.
pub(crate) struct Reached {
    /// Steps done.
    pub(crate) steps: usize,
    /// The worst status of any of them.
    pub(crate) status: Status,
    /// Its steps with joints apart, if there were any.
    pub(crate) apart: Option<Apart>,
    /// Steps with the status [`Status::PastHalfTurn`].
    pub(crate) past_half_turn: usize,
    /// Whether Ctrl-C stopped it.
    pub(crate) interrupted: bool,
    /// Why the disk took no more, where that stopped it.
    pub(crate) refused: Option<Error>,
    /// Wall time of the steps alone, without measuring and writing.
    pub(crate) wall: Duration,
}

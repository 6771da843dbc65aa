//! Where a run begins.

use std::sync::Arc;

use rod::Integrator;
use rod::State;

/// Where a run begins, and how it is integrated.
#[derive(Clone)]
pub(super) struct Origin {
    pub(super) state: Arc<State>,
    pub(super) integrator: Integrator,
}

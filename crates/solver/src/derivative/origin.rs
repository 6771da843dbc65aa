//! Where a run begins.

use std::sync::Arc;

use rod::State;

use crate::integrator::Integrator;

/// Where a run begins, and how it is integrated.
#[derive(Clone)]
pub(super) struct Origin {
    pub(super) state: Arc<State>,
    pub(super) integrator: Integrator,
}

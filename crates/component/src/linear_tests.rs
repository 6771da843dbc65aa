//! The linear solvers of [`jointed`] on the systems of real components.

mod direct;
mod precondition;
mod response;

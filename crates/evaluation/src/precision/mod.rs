//! Error against run time: work-precision diagrams.
//!
//! A [`Problem`] is a scene with its references. A [`Way`] to simulate it, run at several [`Level`]s of accuracy, gives a
//! [`Curve`] ([`run_way`]): a [`Point`] a level, with what it cost and how far off it was. [`pareto`] compares curves at
//! equal error.
//!
//! **Errors** are of positions ([`metrics::position_error`]), at about ten steps of the run. There are two kinds
//! ([`Against`]): against the same formulation and time step solved to rounding errors, which is what a solver is
//! answerable for, and against a reference that is converged in time step and segment length, which is what the user
//! gets. Below the second reference's own error ([`Reference::error`]) nothing can be told apart. Contacts take the
//! smallest differences apart, so that errors before the first contact are told separately ([`Curve::samples_before_contact`]).
//!
//! **Times** are the stages' wall times, those of guesses included, those of setting up excluded, per simulated second,
//! on a rayon pool of one thread without the time in which the thread did not run. (In a larger pool they are wall times
//! summed over the threads.) A time is the sum of the medians of its turns of some steps over the repetitions. Every
//! cell (a way on a problem) takes its turns beside a yardstick, the default settings, and its times are told relative to
//! it, too. To compare cells that were run at different times take [`Point::ratio`] and, for seconds, multiply it with
//! the median of [`Curve::yardstick`] over all cells of the problem: then all share the same conditions.
//!
//! At the exact reference's time step the second kind of error is mostly that of implicit Euler, the same for all ways.
//! [`Level::substeps`] make it a choice: a way's curve against the converged reference then says what accuracy costs.

mod clock;
pub mod curve;
pub mod level;
pub mod metrics;
pub mod pareto;
pub mod reference;
pub mod run;

pub use curve::{Against, Curve, GivenUp, Point};
pub use level::{Level, Outer};
pub use reference::{Problem, Reference};
pub use run::{Budget, Start, Way, run_way};

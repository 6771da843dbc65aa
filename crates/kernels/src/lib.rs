//! Arithmetic on one rod or on several side by side: numbers, vectors, symmetric matrices, quaternions, dual numbers.
//!
//! - [`lane`]: the trait [`Real`](lane::Real), which `f64`, [`Lanes`](lane::Lanes), [`Both`](lane::Both) and
//!   [`Dual`](dual::Dual) implement. All widths compute the same bits: no fused multiply-add.
//! - [`math`]: vectors, symmetric 3 x 3 matrices, quaternions. [`Spatial`]: a linear and an angular vector.
//! - [`dual`]: forward-mode automatic differentiation.
//! - [`dispatch`]: a kernel compiled for several instruction sets.
//! - [`parallel`]: threads that share work.
//! - [`mod@flat`]: lanes in memory as plain numbers; the only unsafe code.
//!
//! It knows nothing of rods, joints or steps. It is internal: programs use `cosserat`.

pub mod dispatch;
pub mod dual;
pub mod flat;
pub mod lane;
pub mod math;
pub mod parallel;
mod spatial;

pub use spatial::Spatial;

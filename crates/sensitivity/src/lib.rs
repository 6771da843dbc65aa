//! Derivatives of a whole run in formulation `newton`, and of an equilibrium ([`Equilibrium`]).
//!
//! A step solves F(p', lambda'; p, v, theta) = 0. What it changes by with what it began with, and with parameters theta, is what
//! the kernels themselves say when they are run on dual numbers ([`kernels::dual`]); how poses and multipliers answer
//! takes the factor of the step's whole Jacobian ([`jointed::tangent::jacobian`]). [`Forward`] carries derivatives along a few
//! directions with the motion; [`Recording`] goes back through all steps, with the transposed factor, for the derivative of one
//! number with respect to everything.
//!
//! It knows how steps are solved only by their results: the equations, the Jacobian and the contacts that press. It is internal:
//! programs use `cosserat`.

mod adjoint;
mod back;
mod check;
mod duals;
mod equilibrium;
mod error;
mod forward;
mod hinges;
mod origin;
mod parameter;
mod parameter_gradient;
mod recording;
mod replay;
mod run;
mod seed;
mod touching;
mod wanted;

pub use component::variation::{
    AirVariation, HeldVariation, JointVariation, ObstacleVariation, SegmentVariation, StateVariation, Variation,
};
pub use equilibrium::Equilibrium;
pub use error::DerivativeError;
pub use forward::Forward;
pub use parameter::{Parameter, Rods};
pub use recording::Recording;
pub use wanted::Wanted;

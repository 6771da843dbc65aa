//! Contact problems with Coulomb friction: the impulses at which no gap is negative, no impulse leaves its friction cone, and
//! friction opposes slip.
//!
//! - [`problem`]: the complementarity problem, and projected block Gauss-Seidel on it (Daviet, Bertails-Descoubes and Boissieux
//!   2011). [`delassus`]: its matrix, the Delassus operator. [`cone`]: friction cones and the natural residual.
//! - [`solve`]: the solver: sweeps with Anderson acceleration, and Newton's method where they are slow.
//! - [`partition`]: which contacts are solved side by side. [`team`]: threads that solve them. [`buckets`]: a counting sort.
//!
//! It knows matrices and friction bounds only: no rod, no geometry, no step. It is internal: programs use `cosserat`.

mod anderson;
pub mod buckets;
pub mod cone;
pub mod delassus;
mod gauss_seidel;
mod lu;
mod newton;
mod params;
pub mod partition;
pub mod problem;
mod redundant_pairs;
pub mod solve;
pub mod team;

pub use params::{ParamsError, SolverParams};

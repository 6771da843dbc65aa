//! Linear algebra of jointed bodies: the matrices of an outer iteration, and what solves with them.
//!
//! - [`topology`]: who is joined to whom, and the order of elimination. [`members`]: which parts of a model a set has.
//! - [`rotation`]: how rows of bend-twist measure a rotation, with derivatives.
//! - [`system`]: `A dlambda = b` with `A = J M^-1 J^T + alpha~`, in parts (Kugelstadt et al. 2018).
//! - [`linear`]: its solvers: block elimination along chains and trees, a sparse factor for graphs with loops, conjugate
//!   gradients with preconditioners; and the compliance of what they factor, which contacts need.
//! - [`tangent`]: Newton's matrix in full, bodies and joints eliminated together.
//! - `block`, [`mod@transfer`]: 6 x 6 kernels of both.
//!
//! It knows matrices and connectivity only: no state, no step, no contact. It is internal: programs use `cosserat`.

mod block;
pub mod linear;
pub mod members;
pub mod rotation;
pub mod system;
pub mod tangent;
pub mod topology;
pub mod transfer;

//! Geometry of collisions: who may touch whom, how near, and when first. Rods and solvers are unknown here.
//!
//! - [`hash`]: all pairs of overlapping boxes, in time that grows linearly with their number.
//! - [`closest`]: closest points of line segments, which are the centre lines of capsules.
//! - [`sweep`]: the first touch of capsules whose ends move during a step.
//! - [`mesh`]: faces and edges of triangle meshes, found by a [`bvh`].
//!
//! Lengths are in any one unit, here called m. This crate is internal: programs use `cosserat`.

pub mod bvh;
pub mod closest;
pub mod hash;
pub mod mesh;
pub mod shape;
pub mod sweep;

pub use hash::SpatialHash;
pub use mesh::TriangleMesh;
pub use shape::{Aabb, Capsule};
pub use sweep::MovingCapsule;

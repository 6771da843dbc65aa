//! Training data for learned guesses: trajectories by exact linear solves, one sample an outer iteration.
//!
//! ```no_run
//! use dataset::{Config, Dataset, PaperBatch, Scenario, Split, generate, shuffled};
//!
//! let directory = std::path::Path::new("data/rod");
//! generate(directory, &Config::table_1(Scenario::Rod), None, &|_| ())?;
//! let dataset = Dataset::open(directory)?;
//! let mut batch = PaperBatch::default();
//! for index in shuffled(dataset.sample_count(Split::Train), 0, 0).into_iter().take(32) {
//!     if let Some(sample) = dataset.sample(Split::Train, index) {
//!         batch.push(&sample, &dataset.norms());
//!     }
//! }
//! # Ok::<(), dataset::DatasetError>(())
//! ```
//!
//! # What is stored
//!
//! The paper's scenarios ([`Scenario`]) are simulated with formulation `xpbd` and direct solves. Of every outer iteration
//! (line 9 of Algorithm 1) is kept, in double precision, what everything else follows from: the poses p^j, the
//! multipliers lambda^j and the time step. With the trajectory's constants they give the linear system A dlambda = b to
//! the last bit ([`Sample::restore`]), and so both kinds of features, products with A for a loss, and the iterations
//! that conjugate gradients take. What follows but is wanted by every reader, b, dlambda and dp, is kept in single
//! precision beside it. The paper leaves open how many outer iterations a step has, and so a sample's share of them: all
//! up to the tolerance are samples here.
//!
//! # Files
//!
//! A data set is a directory. `manifest.toml` ([`Manifest`]) says what it is: versions, seed, ranges, tolerances, norms,
//! numbers, and the BLAKE3 hash of every shard. Shards `train-0000.safetensors`, `validation-0000.safetensors`, ... hold
//! whole trajectories, each split's in the order of their indices; training trajectories come first in that count, and
//! trajectory i is made from stream i of the seed. A `.done.toml` beside each shard says that it is finished; only generation reads it. Tensors, one
//! row each unless said otherwise, little endian:
//!
//! | tensor | type | holds |
//! |---|---|---|
//! | `trajectory.index` | u64 \[T, 1\] | index in the set |
//! | `trajectory.sizes` | u64 \[T, 4\] | segments, anchors, joints, samples |
//! | `trajectory.planar` | u32 \[T, 1\] | 1 or 2 where d1 or d2 is normal to the plane it stays in, else 0 |
//! | `trajectory.gravity` | f64 \[T, 3\] | gravity [m/s^2] |
//! | `segment.constants` | f64 \[S, 4\] | length, radius [m], density [kg/m^3], added mass [kg] |
//! | `segment.flags` | u32 \[S, 2\] | 1 where fixed, the rod's number |
//! | `anchor.poses` | f64 \[A, 7\] | x, y, z [m], quaternion x, y, z, w |
//! | `joint.constants` | f64 \[J, 12\] | both offsets, length [m], rest Darboux vector [1/m], compliances of stretch, shear [m/N], bend, twist [1/(N m^3)], Young's and torsion modulus [Pa] |
//! | `joint.bodies` | u32 \[J, 2\] | bodies a and b: segments, then anchors, counted within the trajectory |
//! | `sample.place` | u32 \[P, 2\] | step, outer iteration |
//! | `sample.dt` | f64 \[P, 1\] | time step of the linear system [s] |
//! | `sample.poses` | f64 \[sum of S, 7\] | of every sample's segments: x, y, z [m], quaternion x, y, z, w |
//! | `sample.lambda` | f64 \[sum of J, 6\] | of every sample's joints: multipliers before it [N s^2], [N m^2 s^2] |
//! | `sample.rhs` | f32 \[sum of J, 6\] | right-hand side b [m], [1/m] |
//! | `sample.dlambda` | f32 \[sum of J, 6\] | the exact solution [N s^2], [N m^2 s^2] |
//! | `sample.dp` | f32 \[sum of S, 6\] | its corrections dx [m], dphi [rad] |
//! | `sample.inertia` | f64 \[sum of S, 2\] | in air alone, where drag adds to them: inverse mass [1/kg], transverse moment of inertia [kg m^2] of the step |
//!
//! T, S, A, J and P run over the shard's trajectories, segments, anchors, joints and samples. Stretch-shear rows are in
//! world axes, bend-twist rows in the frame of body a.
//!
//! Files are complete or not there. Their bits depend on the configuration alone (and on the program's version), not on
//! threads or on parts of a job array. Whatever is done to them, opening gives one error that names the file, the key, its
//! value and what is allowed.

mod batch;
mod config;
mod error;
mod generate;
mod layout;
mod manifest;
mod map;
mod reader;
mod record;
mod shard;
mod write;

pub use batch::{PaperBatch, shuffled};
pub use config::{Config, Scenario, Split};
pub use error::DatasetError;
pub use generate::{Generated, Progress, generate, open_as};
pub use manifest::{MANIFEST, Manifest, Numbers, ShardInfo};
pub use reader::{Dataset, Sample, Trajectory};

/// Version of the format.
pub const SCHEMA_VERSION: u32 = 1;

//! Writing what a run made: the trajectory, tables and JSON files.
//!
//! Every file is complete or not there: it is written under a temporary name in its own directory and renamed when all
//! of it is on the disk ([`write_atomically`]). A trajectory may be larger than memory: [`TrajectoryWriter`] spools its
//! frames to the disk while the simulation runs, and [`TrajectoryReader`] reads one frame at a time.
//!
//! A run has its folder to itself ([`RunFolder`]): what an earlier run left there stays until the next
//! is complete, what is not a run's is never touched.
//!
//! Text that must not change unseen is sealed: TOML with its checksum in front ([`seal`], [`unseal`]). Results that took
//! long are sealed in files named by what they depend on ([`Results`]).
//!
//! [`write_format`] turns a trajectory into files for other programs: ParaView, Blender, spreadsheets.
//!
//! This crate sees states and segments of the crate `rod`. It knows no solver and no scene file.

mod error;
mod file;
mod folder;
mod formats;
mod layout;
mod machine;
mod naming;
mod reader;
mod results;
mod revision;
mod run_folder;
mod sealed;
mod silhouette;
mod snapshots;
mod table;
mod tensor;
mod words;
mod writer;

pub use error::ExportError;
pub use file::{write_atomically, write_json};
pub use formats::{Envelope, Format, write_format, write_probes};
pub use layout::TrajectoryInfo;
pub use machine::machine;
pub use naming::{Names, csv_field};
pub use reader::{Trajectory, TrajectoryReader, read_trajectory};
pub use results::{Found, Results, ResultsError, Stored};
pub use revision::git_revision;
pub use run_folder::RunFolder;
pub use sealed::{SealedError, seal, unseal};
pub use snapshots::write_snapshots;
pub use table::TableWriter;
pub use tensor::Tensor;
pub use words::{read_words, write_words};
pub use writer::TrajectoryWriter;

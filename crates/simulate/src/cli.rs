//! Flags and subcommands.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use catalogue::{GuessName, Sources};
use clap::{Args, Parser, Subcommand};
use dataset::Scenario;
use export::Format;
use solver::formulation::{ContactProjection, Formulation};
use solver::linear::precondition::PreconditionerKind;

use crate::files::Wanted;
use crate::solver_name::SolverName;
use terminal::{positive, threads};

/// Folder of a run's files where none is named.
const OUT: &str = "out";

/// Simulates elastic rods: ropes, cables, springs, trees.
///
/// Without arguments it runs the bending rod of the COPINGNet paper and says what it did. Where networks are built in
/// (cargo feature gn), it starts from COPINGNet's guess then, and says what that is worth beside other starts.
#[derive(Debug, Parser)]
#[command(version, args_conflicts_with_subcommands = true)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Option<Command>,
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    #[command(flatten)]
    pub(crate) run: RunArgs,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// List the builtin scenes.
    List,
    /// Put several runs into one page, side by side or overlaid.
    View(ViewArgs),
    /// Find the equilibrium that a scene without contacts relaxes to, in the wind of time 0.
    Static(StaticArgs),
}

/// Which scene, and for how long.
#[derive(Args, Debug)]
pub(crate) struct SceneArgs {
    /// A scene file, the name of a builtin scene (see `simulate list`), or random-rod, random-helix, random-knot,
    /// random-tree: the paper's random scenes, drawn by --seed and --index.
    #[arg(default_value = "bending-rod", value_name = "SCENE.toml | NAME")]
    pub(crate) scene: String,
    /// Seed of a random scene [default: 0].
    #[arg(long, value_parser = whole::<u64>, allow_hyphen_values = true)]
    pub(crate) seed: Option<u64>,
    /// Index of a random scene: each seed has as many as you like [default: 0].
    #[arg(long, value_parser = whole::<u64>, allow_hyphen_values = true)]
    pub(crate) index: Option<u64>,
    /// Number of steps [default: the scene's]. 0 checks the scene and shows how it starts.
    #[arg(long, value_parser = whole::<usize>, allow_hyphen_values = true)]
    pub(crate) steps: Option<usize>,
    /// Time step [s] [default: the scene's].
    #[arg(long, value_parser = positive, allow_hyphen_values = true)]
    pub(crate) dt: Option<f64>,
    /// Equations of the projection: xpbd (the paper's), xpbd-geometric (also stable for slack rods under tension),
    /// newton (implicit Euler, solved to the end).
    #[arg(long, default_value_t = Formulation::default())]
    pub(crate) formulation: Formulation,
    /// Residual at which a step is done, relative to that of its prediction.
    #[arg(long, default_value = "1e-6", value_parser = positive, allow_hyphen_values = true)]
    pub(crate) tolerance: f64,
    /// Error of a contact that is good enough: penetration, or slip where it should stick, relative to the smaller
    /// radius.
    #[arg(long, default_value = "1e-3", value_parser = positive, allow_hyphen_values = true)]
    pub(crate) contact_tolerance: f64,
    /// How contacts are projected: coupled (together with the rods), alternating (after the rods, as in the paper: slow to
    /// converge where rods are taut).
    #[arg(long, default_value_t = ContactProjection::default())]
    pub(crate) contacts: ContactProjection,
    /// Threads for scenes of several rods, 1 to 1024 [default: one per core]. The motion is the same on any number.
    #[arg(long, value_parser = threads, allow_hyphen_values = true)]
    pub(crate) threads: Option<usize>,
    /// Print one JSON object instead of text.
    #[arg(long)]
    pub(crate) json: bool,
    /// Print nothing but errors (and JSON, if asked for).
    #[arg(long)]
    pub(crate) quiet: bool,
}

#[derive(Args, Debug)]
pub(crate) struct RunArgs {
    /// Linear solver: direct (block elimination along the rods; sparse where they form loops), sparse (Cholesky), cg
    /// (conjugate gradients), auto (chosen for the scene; the summary says why). With auto, flags that cg alone can use
    /// ask for cg.
    #[arg(long, default_value_t = SolverName::Auto)]
    pub(crate) solver: SolverName,
    /// Preconditioner of cg: raw (none), jacobi, block-jacobi, frozen (the factor of the rest shape) [default:
    /// block-jacobi].
    #[arg(long)]
    pub(crate) preconditioner: Option<PreconditionerKind>,
    /// Residual at which cg stops, relative to the right-hand side, in the preconditioner's norm [default: 1e-6].
    #[arg(long, value_parser = positive, allow_hyphen_values = true)]
    pub(crate) linear_tolerance: Option<f64>,
    /// Where solves or steps begin. Of a linear solve (with cg): zero, previous, linear, quadratic, fischer (fischer-N: of N solutions, 1 to 64), frozen. Of
    /// a whole step (with newton): step-previous, step-linear, step-quadratic, step-adaptive (that where it saves
    /// iterations). Learned, of a linear solve: knn
    /// (nearest neighbours in the data set), gn (COPINGNet, trained by the paper's recipe), gn-best (trained by our
    /// own); of a whole step: gn-step. The networks need the cargo feature gn. [default: chosen for the scene]
    #[arg(long)]
    pub(crate) guess: Option<GuessName>,
    /// Let a learned guess replace the solves altogether, with so many predictions a step: the paper's comparison, which
    /// drifts away. Contacts follow each prediction, as with --contacts alternating.
    #[arg(long, value_name = "PREDICTIONS", num_args = 0..=1, require_equals = true, default_missing_value = "1",
        value_parser = predictions)]
    pub(crate) end_to_end: Option<usize>,
    /// Restrict a learned guess to the plane that the scene stays in. gn-best and gn-step always are, where there is one.
    #[arg(long)]
    pub(crate) planar: bool,
    #[command(flatten)]
    pub(crate) learned: Sources,
    /// What a learned guess learned from: rod, helix, knot, tree [default: tree where rods branch, knot where a rod that can
    /// touch itself is held at both ends, helix where joints are bent or twisted at rest, else rod].
    #[arg(long)]
    pub(crate) scenario: Option<Scenario>,
    /// Write a page to look at the motion: view.html, one file that needs no network. `simulate view` puts several runs
    /// into one page. Of a run with more than 1,000 steps it shows that many.
    #[arg(long)]
    pub(crate) view: bool,
    /// Write plots of energy, length, outer iterations and time by stage (SVG).
    #[arg(long)]
    pub(crate) plot: bool,
    /// Write files for other programs: vtp (ParaView), glb (glTF, for Blender), csv, obj.
    #[arg(long, value_delimiter = ',', value_name = "FORMATS")]
    pub(crate) export: Vec<Format>,
    /// Write trajectory.safetensors, centreline.csv, snapshots.svg and summary.json to this folder, and what --view,
    /// --plot and --export ask for [default where one of these is given: out].
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
}

impl RunArgs {
    /// The files that are asked for.
    pub(crate) fn wanted(&self) -> Option<Wanted<'_>> {
        let Self { view, plot, .. } = *self;
        let is_asked = view || plot || !self.export.is_empty();
        let directory = self.out.as_deref().or(is_asked.then_some(Path::new(OUT)))?;
        Some(Wanted { directory, view, plot, formats: &self.export })
    }
}

#[derive(Args, Debug)]
pub(crate) struct ViewArgs {
    /// Folders that `simulate --view` wrote to.
    #[arg(required = true, value_name = "RUNS")]
    pub(crate) runs: Vec<PathBuf>,
    /// Write the page to this file.
    #[arg(long, value_name = "FILE", default_value = "view.html")]
    pub(crate) out: PathBuf,
}

#[derive(Args, Debug)]
pub(crate) struct StaticArgs {
    /// A scene file, the name of a builtin scene (see `simulate list`), or random-rod, -helix, -knot or -tree.
    #[arg(default_value = "heavy-cantilever", value_name = "SCENE.toml | NAME")]
    pub(crate) scene: String,
    /// Seed of a random scene [default: 0].
    #[arg(long)]
    pub(crate) seed: Option<u64>,
    /// Index of a random scene [default: 0].
    #[arg(long)]
    pub(crate) index: Option<u64>,
    /// Largest movement of a segment in the last steps: in segment lengths, and in radians.
    #[arg(long, default_value_t = 1e-9, value_parser = positive, allow_negative_numbers = true)]
    pub(crate) tolerance: f64,
    /// Write trajectory.safetensors (the start and the equilibrium), centreline.csv, snapshots.svg and summary.json to
    /// this folder.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Print JSON instead of text.
    #[arg(long)]
    pub(crate) json: bool,
}

fn whole<T: FromStr>(text: &str) -> Result<T, String> {
    text.parse().map_err(|_| format!("it must be a whole number from 0 to {}", u64::MAX))
}

fn predictions(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(count @ 1..=1000) => Ok(count),
        _ => Err("it must be a whole number from 1 to 1000".to_owned()),
    }
}

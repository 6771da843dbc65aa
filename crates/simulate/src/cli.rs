//! Flags and subcommands.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use solver::formulation::Formulation;
use solver::guess::GuessKind;
use solver::precondition::PreconditionerKind;
use solver::solvers::SolverKind;

/// Simulates elastic rods: ropes, cables, springs, trees.
///
/// Without arguments it runs the bending rod of the COPINGNet paper and says what it did.
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
    /// Run a scene with several solvers and guesses: iterations, time per stage, error against a tight reference.
    Compare(CompareArgs),
    /// Find the equilibrium that a scene relaxes to.
    Static(StaticArgs),
    /// Run the stability table: stiff, slack, tiny, huge and degenerate rods, each with its status.
    Stress(StressArgs),
}

/// Which scene, and for how long.
#[derive(Args, Debug)]
pub(crate) struct SceneArgs {
    /// A scene file, the name of a builtin scene (see `simulate list`), or random-rod or random-helix: the paper's
    /// Table 1, drawn by --seed and --index.
    #[arg(default_value = "bending-rod", value_name = "SCENE.toml | NAME")]
    pub(crate) scene: String,
    /// Seed of a random scene.
    #[arg(long, default_value_t = 0)]
    pub(crate) seed: u64,
    /// Index of a random scene: each seed has as many as you like.
    #[arg(long, default_value_t = 0)]
    pub(crate) index: u64,
    /// Number of steps [default: the scene's].
    #[arg(long)]
    pub(crate) steps: Option<usize>,
    /// Time step [s] [default: the scene's].
    #[arg(long, value_parser = positive)]
    pub(crate) dt: Option<f64>,
    /// Equations of the projection: xpbd (the paper's), xpbd-geometric, newton.
    #[arg(long, default_value_t = Formulation::default())]
    pub(crate) formulation: Formulation,
    /// Residual at which a step is done, relative to that of its prediction.
    #[arg(long, default_value_t = 1e-6, value_parser = positive)]
    pub(crate) tolerance: f64,
    /// Threads for scenes of several rods [default: one per core].
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) threads: Option<u16>,
    /// Print one JSON object instead of text.
    #[arg(long)]
    pub(crate) json: bool,
    /// Print nothing but errors (and JSON, if asked for).
    #[arg(long)]
    pub(crate) quiet: bool,
}

#[derive(Args, Debug)]
pub(crate) struct RunArgs {
    /// Linear solver: direct, sparse, cg.
    #[arg(long, default_value_t = SolverKind::Direct)]
    pub(crate) solver: SolverKind,
    /// Preconditioner of cg: raw, jacobi, block-jacobi, frozen.
    #[arg(long)]
    pub(crate) preconditioner: Option<PreconditionerKind>,
    /// Residual at which cg stops, relative to the right-hand side, in the preconditioner's norm [default: 1e-6].
    #[arg(long, value_parser = positive)]
    pub(crate) linear_tolerance: Option<f64>,
    /// Initial guess: zero, previous, linear, quadratic, fischer, frozen (for cg); step-lambda, step-previous,
    /// step-linear, step-quadratic (for newton).
    #[arg(long, default_value_t = GuessKind::Zero)]
    pub(crate) guess: GuessKind,
    /// Write trajectory.safetensors, centreline.csv, snapshots.svg and summary.json to this folder.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
}

#[derive(Args, Debug)]
pub(crate) struct CompareArgs {
    #[command(flatten)]
    pub(crate) scene: SceneArgs,
    /// Steps to leave out of the table of starts, where a history is not full yet.
    #[arg(long, default_value_t = 10)]
    pub(crate) skip: usize,
}

#[derive(Args, Debug)]
pub(crate) struct StaticArgs {
    /// A scene file or the name of a builtin scene (see `simulate list`).
    #[arg(default_value = "heavy-cantilever", value_name = "SCENE.toml | NAME")]
    pub(crate) scene: String,
    /// Largest movement of a segment in the last steps: in segment lengths, and in radians.
    #[arg(long, default_value_t = 1e-9, value_parser = positive)]
    pub(crate) tolerance: f64,
    /// Write trajectory.safetensors (the start and the equilibrium), centreline.csv, snapshots.svg and summary.json to
    /// this folder.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Print JSON instead of text.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Args, Debug)]
pub(crate) struct StressArgs {
    /// Formulations to run [default: all].
    #[arg(long, value_delimiter = ',')]
    pub(crate) formulation: Vec<Formulation>,
    /// Run only the cases whose name holds this text.
    #[arg(long, default_value = "")]
    pub(crate) only: String,
    /// Print JSON instead of text.
    #[arg(long)]
    pub(crate) json: bool,
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err("it must be a finite number > 0".to_owned()),
    }
}

//! Flags and subcommands.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use catalogue::{GuessName, Sources};
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Args, CommandFactory, Parser, Subcommand};
use cosserat::live::Recording;
use cosserat::scene::{Origin, Scene};
use cosserat::simulation::{ContactProjection, Formulation, Integrator, PreconditionerKind, Tangent};
use cosserat::statics::StaticMethod;
use dataset::Scenario;
use export::Format;
use terminal::{positive, threads};

use crate::files::{MODES, Wanted};
use crate::learned_start::Begin;
use crate::plots;
use crate::solver_name::SolverName;

/// Folder of the runs' folders where none is named.
pub(crate) const OUT: &str = "out";

/// Simulates elastic rods: ropes, cables, sutures, springs, hair, trees.
///
/// `simulate helix --view` simulates a spring that falls and writes a page to watch it. Without arguments the program
/// simulates a rod that bends under its weight and says what it did; where networks are built in (cargo feature gn), it
/// starts from COPINGNet's guess and says what that is worth beside other starts.
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
    /// List the scenes that come with the program.
    List,
    /// Write a file of MuJoCo's (MJCF) with cables as a scene file, and say what is left out.
    Convert(ConvertArgs),
    /// Put several runs into one page, to watch them side by side or overlaid.
    View(ViewArgs),
    /// Write files for other programs of a run that is on the disk.
    Export(ExportArgs),
    /// Find the shape in which a scene comes to rest, and the forces in it: on planes, spheres and capsules, too, without friction.
    Static(StaticArgs),
    /// Find the natural frequencies and shapes in which a scene without contacts vibrates about its equilibrium.
    Modes(ModesArgs),
}

/// Which scene, and for how long.
#[derive(Args, Clone, Debug)]
pub(crate) struct SceneArgs {
    /// What to simulate: the name of a scene that comes with the program (see `simulate list`), a file of your own that ends in
    /// .toml (see docs/scenes.md), or one of MuJoCo's that ends in .xml (see docs/mjcf.md). random-rod, random-helix, random-knot
    /// and random-tree are drawn at random, as in the COPINGNet paper [default: the scene of the run that --from names, else bending-rod].
    #[arg(value_name = "SCENE.toml | NAME")]
    pub(crate) scene: Option<String>,
    #[command(flatten)]
    pub(crate) of: OfScene,
    #[command(flatten)]
    pub(crate) begin: BeginArgs,
    /// Number of time steps [default: the scene's]. With 0 the scene is checked, and nothing moves.
    #[arg(long, value_parser = whole::<usize>, allow_hyphen_values = true)]
    pub(crate) steps: Option<usize>,
    /// Length of a time step in seconds [default: the scene's]. Shorter steps are more accurate and lose less energy.
    #[arg(long, value_parser = positive, allow_hyphen_values = true)]
    pub(crate) dt: Option<f64>,
    /// Which equations a step solves: newton (the integrator's equations in full) or xpbd (the COPINGNet paper's), which
    /// drops the momentum residual: stiff rods pressed on contacts skid, and forces are wrong [default: newton; xpbd with a learned
    /// guess of linear solves, which has learned from it].
    #[arg(long)]
    pub(crate) formulation: Option<Formulation>,
    /// Which matrix newton iterates with: auto (of the other two the one that takes a rod less work, found out step by step),
    /// positive, exact (fewer iterations, where joints are bent far from rest; for chains, trees and rings without contacts).
    /// The motion is the same to the tolerance.
    #[arg(long, default_value_t = Tangent::default())]
    pub(crate) tangent: Tangent,
    /// How the motion goes on from step to step: bdf2 (of second order: slow motions keep their energy, fast waves are
    /// damped), euler (of first order: long steps damp swings and waves) [default: the scene's `run.integrator`; euler with a
    /// learned guess, which has learned from its steps; else bdf2].
    #[arg(long)]
    pub(crate) integrator: Option<Integrator>,
    /// How exactly a step is solved: with newton, where nothing can touch, no surface may be off by more than this share of a segment's length;
    /// with xpbd the residual must fall to this share of what it was at the start of the step [default: 1e-3; with
    /// xpbd 1e-6].
    #[arg(long, value_parser = positive, allow_hyphen_values = true)]
    pub(crate) tolerance: Option<f64>,
    /// How exactly contacts are solved: how deep two rods may overlap, or slip where they should stick, as a share of the
    /// smaller radius.
    #[arg(long, default_value = "1e-3", value_parser = positive, allow_hyphen_values = true)]
    pub(crate) contact_tolerance: f64,
    /// How contacts are solved: coupled (together with the rods) or alternating (rods and contacts in turn, as in the paper;
    /// slow where rods are taut).
    #[arg(long, default_value_t = ContactProjection::default())]
    pub(crate) contacts: ContactProjection,
    /// Threads, 1 to 1024, for scenes of several rods [default: one per core]. The motion is the same on any number.
    #[arg(long, value_parser = threads, allow_hyphen_values = true)]
    pub(crate) threads: Option<usize>,
    /// Print one JSON object instead of text.
    #[arg(long)]
    pub(crate) json: bool,
    /// Print nothing but errors (and JSON, if asked for).
    #[arg(long)]
    pub(crate) quiet: bool,
}

/// Which of the scenes of a name, and what is changed in it.
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct OfScene {
    /// Seed of a random scene: another number draws another one [default: 0].
    #[arg(long, value_parser = whole::<u64>, allow_hyphen_values = true)]
    pub(crate) seed: Option<u64>,
    /// Which of the scenes of a seed [default: 0].
    #[arg(long, value_parser = whole::<u64>, allow_hyphen_values = true)]
    pub(crate) index: Option<u64>,
    /// Change a key of the scene's file: rods.cable.youngs_modulus_pa=2e7, rods[0].radius_m=0.01, gravity_m_s2=[0,0,-1.62]. A
    /// rod, body, obstacle or probe is named or counted from 0, the value is TOML. Give the flag once for each key.
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
}

/// Where a scene begins, if not as it says itself.
#[derive(Args, Clone, Debug)]
pub(crate) struct BeginArgs {
    /// Begin where another run of the scene, or `simulate static`, has left off. After a run with --snapshot or
    /// --snapshot-every the run goes on from FOLDER with the same bits as if that one had not ended, and time goes on, too. Else,
    /// and with FOLDER@K, it begins with the positions and velocities of the last frame, or of frame K, counted from 0, in that
    /// folder's trajectory.safetensors, and time is 0 again [default: the scene's].
    #[arg(long, value_name = "FOLDER[@K]")]
    pub(crate) from: Option<Origin>,
}

#[derive(Args, Clone, Debug)]
pub(crate) struct RunArgs {
    /// How the linear equations of a step are solved: auto (chosen for the scene; the summary says why), direct
    /// (elimination along the rods), sparse (sparse Cholesky), cg (conjugate gradients). With auto, a flag that is of use to
    /// cg alone chooses cg.
    #[arg(long, default_value_t = SolverName::Auto)]
    pub(crate) solver: SolverName,
    /// Preconditioner of cg: raw (none), jacobi, block-jacobi, frozen (the factors of the rods at rest) [default:
    /// block-jacobi].
    #[arg(long)]
    pub(crate) preconditioner: Option<PreconditionerKind>,
    /// How exactly cg solves: its residual must fall to this share of the right-hand side, in the preconditioner's norm
    /// [default: 1e-6].
    #[arg(long, value_parser = positive, allow_hyphen_values = true)]
    pub(crate) linear_tolerance: Option<f64>,
    /// A first guess of the solution, which saves iterations where it is good [default: chosen for the scene].
    /// For the linear equations (with cg): zero (none), previous, linear, quadratic (continue the last solutions), fischer
    /// (the best mix of the last 8; fischer-N: of N, 1 to 64), frozen (solved with the factors of the rods at rest), and
    /// learned ones: knn (nearest neighbours), gn (COPINGNet, trained as in the paper), gn-best (trained by our own recipe).
    /// For a whole step (with newton): step-previous, step-linear, step-quadratic (continue the last motions), step-adaptive
    /// (does so where it saves iterations), and the learned gn-step. Networks (gn, gn-best, gn-step) need the cargo feature
    /// gn.
    #[arg(long)]
    pub(crate) guess: Option<GuessName>,
    /// Take a learned guess for the solution and solve nothing, with so many guesses a step: an experiment of the paper. The
    /// motion drifts away from the true one. Contacts follow each guess, as with --contacts alternating.
    #[arg(long, value_name = "PREDICTIONS", num_args = 0..=1, require_equals = true, default_missing_value = "1",
        value_parser = predictions)]
    pub(crate) end_to_end: Option<usize>,
    /// Keep a learned guess in the plane in which the scene stays. gn-best and gn-step always are, where there is one.
    #[arg(long)]
    pub(crate) planar: bool,
    #[command(flatten)]
    pub(crate) learned: Sources,
    /// Which scenes a learned guess has learned from: rod, helix, knot, tree [default: tree where rods branch, knot where a
    /// rod that can touch itself is held at both ends, helix where joints are bent or twisted at rest, else rod].
    #[arg(long)]
    pub(crate) scenario: Option<Scenario>,
    /// Show the simulation while it runs, in a browser on this machine, at the address that is printed: pause, drag rods and bodies,
    /// pin them, go back in time, change gravity and wind, save what happened (docs/live.md). It ends with Ctrl-C, or when the page
    /// has been closed for a minute.
    #[arg(long, conflicts_with_all = ["end_to_end", "json", "steps", "replay"])]
    pub(crate) live: bool,
    /// Port of --live on this machine [default: one that is free].
    #[arg(long, requires = "live", value_name = "PORT")]
    pub(crate) port: Option<u16>,
    /// Do again what was done in a live view: the file live-input.json of a run that was saved there. The motion has the same bits,
    /// with the same scene and flags.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["end_to_end", "steps", "dt", "fps"])]
    pub(crate) replay: Option<PathBuf>,
    /// What is done again, where it is no file yet.
    #[arg(skip)]
    pub(crate) recording: Option<Recording>,
    /// Write view.html, a page that plays the motion in a browser, one file that needs no network. Of a run with more than
    /// 1,000 steps it shows that many. `simulate view` puts several runs into one page.
    #[arg(long)]
    pub(crate) view: bool,
    /// Write plots over time (SVG): energy, length, iterations, time by stage.
    #[arg(long)]
    pub(crate) plot: bool,
    /// Print the time of each stage of a step, too.
    #[arg(long)]
    pub(crate) times: bool,
    /// Keep every N-th step's frame, and the last one, in all files [default: the scene's, else every one].
    #[arg(long, value_name = "N", value_parser = at_least_one, conflicts_with = "fps")]
    pub(crate) every: Option<usize>,
    /// Keep so many frames a second in all files, at exactly these times: the time step is shortened to a whole part of the time
    /// between two frames, and the run ends with a frame.
    #[arg(long, value_parser = positive, allow_hyphen_values = true)]
    pub(crate) fps: Option<f64>,
    /// Go on where joints come apart. Without it a run ends there, with its files.
    #[arg(long)]
    pub(crate) keep_going: bool,
    /// Draw and tabulate these rods and bodies of the scene alone: what --view, --plot and --export write. NAME stands for NAME/0 and so on, too. The trajectory keeps all of them, so that --from can go on.
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    pub(crate) rods: Vec<String>,
    /// Write contacts.csv: what presses on what, where, and how hard, in every frame that is kept.
    #[arg(long)]
    pub(crate) contact_forces: bool,
    /// Write envelope.csv: the least and the largest tension, bending moment, torsion and curvature of each segment over all
    /// steps of the run, those between frames that are kept, too.
    #[arg(long)]
    pub(crate) envelope: bool,
    /// Write trajectory.safetensors: positions, orientations and velocities, exactly. --from FOLDER@K and `simulate export` need
    /// it.
    #[arg(long)]
    pub(crate) trajectory: bool,
    /// Write snapshot.safetensors at the end of the run, after Ctrl-C too: all that is needed to go on (see --from).
    #[arg(long)]
    pub(crate) snapshot: bool,
    /// Write it on the way, too, every so many simulated seconds: after the first step that ends then or later. If the run is
    /// killed, --from FOLDER goes on from the last one.
    #[arg(long, value_name = "SECONDS", value_parser = positive, allow_hyphen_values = true)]
    pub(crate) snapshot_every: Option<f64>,
    /// Write files for other programs: vtp (ParaView), glb (glTF, for Blender), csv (spreadsheets), obj, usda (OpenUSD).
    #[arg(long, value_delimiter = ',', value_name = "FORMATS")]
    pub(crate) export: Vec<Format>,
    /// Write the files to this folder: those that --trajectory, --view, --plot, --export, --contact-forces, --envelope and
    /// --snapshot ask for, without any of these the trajectory; probes.csv if the scene has probes; summary.json; the scene itself.
    /// The run has the folder to itself: an earlier run's files there are replaced when all are written, other files stay [default
    /// where one of the seven is given: out/SCENE, or out/SCENE-2 where the run begins with the one in out/SCENE].
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
}

/// The command line; the program ends with an error where it is none.
pub(crate) fn parse() -> Cli {
    Cli::try_parse().unwrap_or_else(|mut error| {
        // A flag that is misspelt is hardly the name of a scene.
        let tip = error.get(ContextKind::SuggestedArg).is_none();
        if error.kind() == ErrorKind::UnknownArgument && tip {
            error.remove(ContextKind::Suggested);
            if let Some(ContextValue::String(flag)) = error.get(ContextKind::InvalidArg).cloned()
                && let Some(tip) = commands_with(&flag)
            {
                error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip.into()]));
            }
        }
        error.exit()
    })
}

/// Which commands have a flag, in words, if any has.
fn commands_with(flag: &str) -> Option<String> {
    let cli = Cli::command();
    let name = flag.trim_start_matches('-').split('=').next()?;
    let has = |command: &clap::Command| command.get_arguments().any(|argument| argument.get_long() == Some(name));
    let own = has(&cli).then(|| "`simulate SCENE`".to_owned());
    let others = cli.get_subcommands().filter(|command| has(command));
    let known: Vec<String> = own.into_iter().chain(others.map(|c| format!("`simulate {}`", c.get_name()))).collect();
    (!known.is_empty()).then(|| format!("--{name} is a flag of {}", known.join(", ")))
}

impl Cli {
    /// With each format that is asked for once.
    pub(crate) fn without_repeats(mut self) -> Self {
        let formats = match &mut self.command {
            Some(Command::Export(args)) => &mut args.export,
            Some(Command::Static(args)) => &mut args.export,
            _ => &mut self.run.export,
        };
        let mut known = Vec::new();
        formats.retain(|&format| {
            !known.contains(&format) && {
                known.push(format);
                true
            }
        });
        self
    }
}

impl RunArgs {
    /// Whether any file is asked for.
    pub(crate) fn writes(&self) -> bool {
        self.out.is_some() || self.trajectory || self.asks_for_more()
    }

    /// Whether anything but the trajectory is asked for by its kind.
    fn asks_for_more(&self) -> bool {
        let Self { view, plot, contact_forces, envelope, .. } = *self;
        let more = self.wants_snapshot() || self.replay.is_some() || !self.export.is_empty();
        view || plot || contact_forces || envelope || more
    }

    /// Whether a snapshot of the end is wanted.
    pub(crate) fn wants_snapshot(&self) -> bool {
        self.snapshot || self.snapshot_every.is_some()
    }

    /// The files that are asked for, of a run of this scene, with these rods in those that do not have all of them.
    pub(crate) fn wanted<'a>(
        &'a self,
        scene: &'a Scene,
        from: Option<&Path>,
        rods: Option<Vec<usize>>,
    ) -> Option<Wanted<'a>> {
        let Self { view, plot, contact_forces, envelope, .. } = *self;
        let directory = || self.out.clone().unwrap_or_else(|| default_folder(&scene.name, from));
        self.writes().then(|| Wanted {
            directory: directory(),
            trajectory: self.trajectory || !self.asks_for_more(),
            view,
            plots: if plot { &plots::FILES } else { &[] },
            contact_forces,
            eyelets: &scene.eyelets,
            pulleys: &scene.pulleys,
            breaks: !scene.model.breakable.is_empty(),
            envelope,
            snapshot: self.wants_snapshot(),
            formats: &self.export,
            probes: &scene.probes,
            table: None,
            rods,
            input: self.recording.as_ref(),
        })
    }
}

#[derive(Args, Debug)]
pub(crate) struct ConvertArgs {
    /// A file of MuJoCo's with cables (see docs/mjcf.md).
    #[arg(value_name = "FILE.xml")]
    pub(crate) file: String,
    /// Write the scene to this file, which must not exist [default: it is printed].
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) out: Option<PathBuf>,
}

#[derive(Args, Debug)]
pub(crate) struct ViewArgs {
    /// Folders of runs with --view, such as out/helix.
    #[arg(required = true, value_name = "RUNS")]
    pub(crate) runs: Vec<PathBuf>,
    /// Write the page to this file. An older page of runs is replaced, any other file is an error.
    #[arg(long, value_name = "FILE", default_value = "view.html")]
    pub(crate) out: PathBuf,
}

#[derive(Args, Debug)]
pub(crate) struct ExportArgs {
    /// Folder of a run, such as out/helix; the files are written there.
    #[arg(value_name = "FOLDER")]
    pub(crate) folder: PathBuf,
    /// Which files: vtp (ParaView), glb (glTF, for Blender), csv (spreadsheets), obj, usda (OpenUSD). Forces of joints are in them if the run
    /// has kept them, as one with --export does.
    #[arg(long, value_delimiter = ',', value_name = "FORMATS", required = true)]
    pub(crate) export: Vec<Format>,
    /// The scene of the run: rods, joints, obstacles [default: the one that the run has kept in its folder, else the scene of
    /// that name that comes with the program].
    #[arg(long, value_name = "SCENE.toml | NAME")]
    pub(crate) scene: Option<String>,
    #[command(flatten)]
    pub(crate) of: OfScene,
    /// These rods and bodies of the scene alone, as with a run.
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    pub(crate) rods: Vec<String>,
    /// One of N frames in the folder, and the last one [default: all].
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    pub(crate) every: Option<usize>,
    /// Print nothing but errors.
    #[arg(long)]
    pub(crate) quiet: bool,
}

/// Which equilibrium is looked for.
#[derive(Args, Debug)]
pub(crate) struct RestArgs {
    /// The name of a scene that comes with the program (see `simulate list`), or a file of your own that ends in .toml
    /// [default: the scene of the run that --from names, else heavy-cantilever].
    #[arg(value_name = "SCENE.toml | NAME")]
    pub(crate) scene: Option<String>,
    #[command(flatten)]
    pub(crate) of: OfScene,
    #[command(flatten)]
    pub(crate) begin: BeginArgs,
    /// Stay at an unstable equilibrium that is met, such as a straight column under too large a load, instead of leaving it.
    #[arg(long)]
    pub(crate) keep_unstable: bool,
    /// Print JSON instead of text.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Args, Debug)]
pub(crate) struct StaticArgs {
    #[command(flatten)]
    pub(crate) rest: RestArgs,
    /// How it is found: newton (for chains, trees and rings; where that does not come to rest, the flow), flow (down in energy,
    /// in many more solves).
    #[arg(long, default_value_t = StaticMethod::default())]
    pub(crate) method: StaticMethod,
    /// Follow the equilibrium along what the scene drives, its changing loads and changing gravity, over the time of its run:
    /// where it becomes unstable, and where it folds back, so that a rod driven further would snap. For chains, trees and rings
    /// that are joined to one another, without wind and torques as loads. Ctrl-C ends it, and keeps what was found.
    #[arg(long, conflicts_with_all = ["branches", "method"])]
    pub(crate) along: bool,
    /// Look for several equilibria of what is held: both branches of a twist, mirror images, unstable ones between them; the
    /// lowest energy first. Not all of them are found. For one set of joined rods, without wind and torques as loads.
    #[arg(long, conflicts_with_all = ["method", "keep_unstable"])]
    pub(crate) branches: bool,
    /// Where the search begins: drawn (as the scene is drawn), learned (with the cargo feature gn, and then the default: a single
    /// cable between two grips that stand still, under its weight alone, near the lowest equilibrium, which a network proposes, if
    /// it can come there without a jump; all else, and with --from and --keep-unstable, as drawn).
    #[arg(long, default_value_t = Begin::default(), conflicts_with_all = ["along", "branches"])]
    pub(crate) start: Begin,
    /// When it is at rest: no segment moves further than this in an iteration, in segment lengths and in radians.
    #[arg(long, default_value = "1e-9", value_parser = positive, allow_negative_numbers = true)]
    pub(crate) tolerance: f64,
    /// Write view.html, a page that shows the start and the equilibrium, or all equilibria.
    #[arg(long)]
    pub(crate) view: bool,
    /// Write pictures (SVG): the shapes, energy, length.
    #[arg(long)]
    pub(crate) plot: bool,
    /// Write files for other programs: vtp (ParaView), glb (glTF, for Blender), csv (spreadsheets; reactions.csv among them), obj, usda (OpenUSD).
    #[arg(long, value_delimiter = ',', value_name = "FORMATS")]
    pub(crate) export: Vec<Format>,
    /// Write the files to this folder: what --view, --plot and --export ask for, trajectory.safetensors (the start at time 0 and
    /// the equilibrium at time 1; with --along all equilibria of the way at their times; with --branches each at the times 1, 2
    /// and so on), probes.csv if the scene has probes, with --along path.csv, summary.json, and the scene itself. An earlier run's files there are
    /// replaced when all are written, other files stay [default where one of the three is given: out/SCENE-static].
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
}

#[derive(Args, Debug)]
pub(crate) struct ModesArgs {
    #[command(flatten)]
    pub(crate) rest: RestArgs,
    /// How many, the lowest first.
    #[arg(long, default_value = "10", value_parser = at_least_one)]
    pub(crate) count: usize,
    /// Write to this folder: trajectory.safetensors (the equilibrium, then each shape as it swings once in 24 frames), modes.csv,
    /// summary.json, the scene itself, and what --view asks for; `simulate export DIR --export glb` makes a motion for other
    /// programs of it. An earlier run's files there are replaced when all are written, other files stay [default with --view: out/SCENE-modes, without the trajectory].
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Write view.html, too, a page that plays the shapes one after the other, a second each.
    #[arg(long)]
    pub(crate) view: bool,
}

impl ModesArgs {
    /// The files that are asked for, of the scene of this name.
    pub(crate) fn wanted(&self, scene: &str) -> Option<Wanted<'static>> {
        let by_default = || self.view.then(|| Path::new(OUT).join(format!("{scene}-modes")));
        let directory = self.out.clone().or_else(by_default)?;
        Some(Wanted {
            view: self.view,
            trajectory: self.out.is_some(),
            table: Some(MODES),
            ..Wanted::plain(&directory)
        })
    }
}

/// The folder of a run for which none is named: out/SCENE; of one that goes on `from` there out/SCENE-2, from there out/SCENE-3,
/// and so on, so that a run does not replace the one that it begins with.
fn default_folder(scene: &str, from: Option<&Path>) -> PathBuf {
    let number = || {
        let from = from?.canonicalize().ok()?;
        if from.parent()? != Path::new(OUT).canonicalize().ok()? {
            return None;
        }
        let rest = from.file_name()?.to_str()?.strip_prefix(scene)?;
        if rest.is_empty() { Some(1) } else { rest.strip_prefix('-')?.parse::<u32>().ok() }
    };
    match number() {
        None => Path::new(OUT).join(scene),
        Some(number) => Path::new(OUT).join(format!("{scene}-{}", number.saturating_add(1))),
    }
}

fn whole<T: FromStr>(text: &str) -> Result<T, String> {
    text.parse().map_err(|_| format!("it must be a whole number from 0 to {}", u64::MAX))
}

fn at_least_one(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|&count| count > 0).ok_or_else(|| "it must be a whole number from 1 on".to_owned())
}

fn predictions(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(count @ 1..=1000) => Ok(count),
        _ => Err("it must be a whole number from 1 to 1000".to_owned()),
    }
}

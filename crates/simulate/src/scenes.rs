//! From the command line to a scene and settings.

use std::path::Path;

use anyhow::{Context as _, Error, Result, anyhow, bail};
use clap::CommandFactory;
use export::TrajectoryReader;
use scene::sampling::{Family, Parameters};
use scene::{Origin, Scene, SceneError};
use solver::simulation::{Overlap, Overlapped, Settings};
use solver::snapshot::Snapshot;
use solver::statics::{StaticParams, equilibrium};

use crate::cli::{BeginArgs, Cli, SceneArgs};
use crate::files::TRAJECTORY;
use crate::going_on::{hash_of_segments, read_snapshot};
use crate::kept_scene::chosen;

/// The scene that runs where none is named.
const FIRST: &str = "bending-rod";

/// Where a run begins.
pub(crate) enum Begin {
    /// With the scene's state, which may be another run's frame.
    Anew,
    /// Where another run has ended.
    Snapshot {
        snapshot: Snapshot,
        /// The folder that it is from, for errors.
        what: String,
    },
}

/// The scene that the arguments name, with their beginning, time step and number of steps put in.
pub(crate) fn scene(args: &SceneArgs) -> Result<(Scene, Begin)> {
    let mut scene = chosen(args.scene.as_deref(), &args.begin, FIRST, [args.seed, args.index])?;
    scene.run.dt = args.dt.unwrap_or(scene.run.dt);
    scene.run.steps = args.steps.unwrap_or(scene.run.steps);
    if let Some((what, Origin { folder, frame: None })) = origin(&scene, &args.begin)
        && let Some(snapshot) = read_snapshot(folder, &scene, &what)?
    {
        return Ok((scene, Begin::Snapshot { snapshot, what }));
    }
    begin_with_frame(&mut scene, &args.begin)?;
    if scene.begins_at_rest && !begins_with_frame(&scene, &args.begin) {
        come_to_rest(&mut scene)?;
    }
    Ok((scene, Begin::Anew))
}

/// Puts in the equilibrium with which the scene is to begin.
fn come_to_rest(scene: &mut Scene) -> Result<()> {
    let what = || format!("{}: run.begin = \"equilibrium\"", scene.name);
    let found = equilibrium(&scene.model, &mut scene.state, &StaticParams::default()).with_context(what)?;
    if !found.converged {
        bail!("{}: none was found from the shape as it is drawn; `simulate static` tells more", what());
    }
    Ok(())
}

/// The run from which the scene is to begin, if there is one: the flag's, else the scene's; with who asks for it, in words.
pub(crate) fn origin<'a>(scene: &'a Scene, BeginArgs { from }: &'a BeginArgs) -> Option<(String, &'a Origin)> {
    let (key, origin) = match (from, &scene.from) {
        (Some(origin), _) => ("--from".to_owned(), origin),
        (None, Some(origin)) => (format!("{}: run.from", scene.name), origin),
        (None, None) => return None,
    };
    Some((format!("{key} {}", origin.folder.display()), origin))
}

/// Whether a scene begins with a frame of another run.
pub(crate) fn begins_with_frame(scene: &Scene, begin: &BeginArgs) -> bool {
    origin(scene, begin).is_some()
}

/// Puts in the frame of another run from which the scene is to begin, if there is one.
pub(crate) fn begin_with_frame(scene: &mut Scene, begin: &BeginArgs) -> Result<()> {
    let Some((what, Origin { folder, frame })) = origin(scene, begin) else { return Ok(()) };
    let (path, frame) = (folder.join(TRAJECTORY), *frame);
    if !path.is_file() {
        bail!("{what}: it is no folder of a run; there is no {TRAJECTORY} in it");
    }
    let mut trajectory = TrajectoryReader::open(&path).with_context(|| what.clone())?;
    let (frames, segments) = (trajectory.frames(), trajectory.segments());
    if segments != scene.state.len() {
        bail!("{what}: the run has {segments} segments, but the scene {} has {}", scene.name, scene.state.len());
    }
    let info = trajectory.info();
    if info.segments_hash.as_ref().is_some_and(|hash| *hash != hash_of_segments(&scene.model)) {
        bail!(
            "{what}: the run, of the scene {}, has segments of other lengths or radii than the scene {}",
            info.scene,
            scene.name
        );
    }
    let frame = frame.unwrap_or(frames.saturating_sub(1));
    if frame >= frames {
        bail!("{what}: frame {frame}, but the run has the frames 0 to {}", frames.saturating_sub(1));
    }
    trajectory.read_frame(frame, &mut scene.state).with_context(|| what.clone())?;
    scene.model.validate(&scene.state).with_context(|| what.clone())
}

/// Names of random scenes.
const RANDOM: [(&str, Family); 4] = [
    ("random-rod", Family::Rod),
    ("random-helix", Family::Helix),
    ("random-knot", Family::Knot),
    ("random-tree", Family::Tree),
];

/// The names of random scenes, in words.
pub(crate) fn random_names() -> String {
    RANDOM.map(|(name, _)| name).join(", ")
}

/// Whether a scene that comes with the program, or is drawn at random, has this name.
pub(crate) fn is_known(name: &str) -> bool {
    RANDOM.iter().any(|&(random, _)| random == name) || scene::builtins().iter().any(|builtin| builtin.name == name)
}

/// The scene file, builtin or random scene of this name.
pub(crate) fn named(name: &str, seed: Option<u64>, index: Option<u64>) -> Result<Scene> {
    if let Some((_, family)) = RANDOM.into_iter().find(|&(random, _)| random == name) {
        let scene = Parameters::sample(family, seed.unwrap_or(0), index.unwrap_or(0)).scene()?;
        return Ok(Scene { name: name.to_owned(), ..scene });
    }
    for (flag, given) in [("--seed", seed.is_some()), ("--index", index.is_some())] {
        if given {
            bail!("{flag} needs a random scene ({}), but the scene is {name}", random_names());
        }
    }
    let is_file = name.ends_with(".toml") || name.contains(['/', '\\']);
    let found = if is_file { scene::load(name) } else { scene::builtin(name) };
    found.map_err(|error| match error {
        SceneError::Read { file, source } if file == name => {
            let is_missing = source.kind() == std::io::ErrorKind::NotFound;
            let hint = if is_missing { " (`simulate list` shows the scenes that come with the program)" } else { "" };
            anyhow!("cannot read the scene {file}: {source}{hint}")
        }
        SceneError::Read { file, source } => anyhow!("cannot read {file}: {source}"),
        SceneError::UnknownBuiltin { name, .. } => unknown(&name),
        invalid @ SceneError::Invalid { .. } => invalid.into(),
    })
}

/// Similarity, of 0 to 1, from which a name is taken for a slip of the pen.
pub(crate) const ALIKE: f64 = 0.7;

/// What overlaps at the start, as the scene names it.
pub(crate) fn overlapping(scene: &Scene, overlap: &Overlap) -> String {
    let name = |rod: usize| scene.rods.get(rod).map_or_else(|| format!("rod {rod}"), |rod| rod.name.clone());
    let other = match overlap.other {
        Overlapped::Segment { rod, .. } => name(rod),
        Overlapped::Obstacle { index, .. } => {
            scene.obstacles.get(index).cloned().unwrap_or_else(|| format!("obstacle {index}"))
        }
    };
    format!("{} and {other}", name(overlap.rod))
}

/// The error of a scene that does not exist: what may have been meant, and where to look.
fn unknown(name: &str) -> Error {
    if Path::new(name).is_file() {
        return anyhow!("{name} is a file, but the name of a scene's file ends in .toml");
    }
    let cli = Cli::command();
    let commands = cli.get_subcommands().map(|command| (command.get_name(), "the command "));
    let scenes = scene::builtins().into_iter().map(|builtin| (builtin.name, ""));
    let random = RANDOM.map(|(name, _)| (name, ""));
    let likeness = |known: &str| strsim::jaro_winkler(name, known);
    let known = scenes.chain(random).chain(commands).filter(|(known, _)| likeness(known) > ALIKE);
    let nearest = known.max_by(|(a, _), (b, _)| likeness(a).total_cmp(&likeness(b)));
    let meant = nearest.map(|(known, what)| format!("; did you mean {what}`{known}`?")).unwrap_or_default();
    anyhow!("there is no scene `{name}`{meant} (`simulate list` shows all; the name of a file ends in .toml)")
}

/// Settings with the formulation and the tolerances of the arguments; the absolute one goes down with the relative one.
pub(crate) fn settings(args: &SceneArgs) -> Settings {
    let mut settings = Settings::default();
    settings.step.formulation = args.formulation;
    settings.step.tangent = args.tangent;
    settings.step.integrator = args.integrator;
    settings.step.relative_tolerance = args.tolerance;
    settings.step.absolute_tolerance = settings.step.absolute_tolerance.min(1e-3 * args.tolerance);
    settings.step.contact_tolerance = args.contact_tolerance;
    settings.step.contact_projection = args.contacts;
    settings
}

/// Sets the number of threads for the whole program.
pub(crate) fn use_threads(args: &SceneArgs) -> Result<()> {
    if let Some(threads) = args.threads {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build_global()?;
    }
    Ok(())
}

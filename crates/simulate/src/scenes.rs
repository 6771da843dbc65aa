//! From the command line to a scene and settings.

use std::path::Path;

use anyhow::{Context as _, Error, Result, anyhow, bail};
use clap::CommandFactory;
use export::TrajectoryReader;
use scene::sampling::{Family, Parameters};
use scene::{Scene, SceneError};
use solver::simulation::Settings;

use crate::cli::{BeginArgs, Cli, Origin, SceneArgs};
use crate::files::TRAJECTORY;

/// The scene that the arguments name, with their beginning, time step and number of steps put in.
pub(crate) fn scene(args: &SceneArgs) -> Result<Scene> {
    let mut scene = named(&args.scene, args.seed, args.index)?;
    begin(&mut scene, &args.begin)?;
    scene.run.dt = args.dt.unwrap_or(scene.run.dt);
    scene.run.steps = args.steps.unwrap_or(scene.run.steps);
    Ok(scene)
}

/// Puts in the frame of another run from which the scene is to begin, if there is one.
pub(crate) fn begin(scene: &mut Scene, BeginArgs { from }: &BeginArgs) -> Result<()> {
    let Some(Origin { folder, frame }) = from else { return Ok(()) };
    let path = folder.join(TRAJECTORY);
    if !path.is_file() {
        bail!("--from {}: it is no folder of a run; there is no {TRAJECTORY} in it", folder.display());
    }
    let mut trajectory = TrajectoryReader::open(&path).context("--from")?;
    let (frames, segments) = (trajectory.frames(), trajectory.segments());
    if segments != scene.state.len() {
        bail!(
            "--from {}: the run has {segments} segments, but the scene {} has {}",
            folder.display(),
            scene.name,
            scene.state.len()
        );
    }
    let frame = frame.unwrap_or(frames.saturating_sub(1));
    if frame >= frames {
        bail!(
            "--from {}: frame {frame}, but the run has the frames 0 to {}",
            folder.display(),
            frames.saturating_sub(1)
        );
    }
    trajectory.read_frame(frame, &mut scene.state).context("--from")?;
    scene.model.validate(&scene.state).with_context(|| format!("--from {}", folder.display()))
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
        SceneError::Read { file, source } => anyhow!("cannot read the scene {file}: {source}"),
        SceneError::UnknownBuiltin { name, .. } => unknown(&name),
        invalid @ SceneError::Invalid { .. } => invalid.into(),
    })
}

/// Similarity, of 0 to 1, from which a name is taken for a slip of the pen.
const ALIKE: f64 = 0.7;

/// The error of a scene that does not exist: what may have been meant, and where to look.
fn unknown(name: &str) -> Error {
    if Path::new(name).is_file() {
        return anyhow!("{name} is a file, but the name of a scene's file ends in .toml");
    }
    let cli = Cli::command();
    let commands = cli.get_subcommands().map(|command| command.get_name().to_owned());
    let scenes = scene::builtins().into_iter().map(|builtin| builtin.name.to_owned());
    let random = RANDOM.map(|(name, _)| name.to_owned());
    let likeness = |known: &String| strsim::jaro_winkler(name, known);
    let known = scenes.chain(random).chain(commands).filter(|known| likeness(known) > ALIKE);
    let nearest = known.max_by(|a, b| likeness(a).total_cmp(&likeness(b)));
    let meant = nearest.map(|known| format!("; did you mean `{known}`?")).unwrap_or_default();
    anyhow!("there is no scene `{name}`{meant} (`simulate list` shows all; the name of a file ends in .toml)")
}

/// Settings with the formulation and the tolerances of the arguments; the absolute one goes down with the relative one.
pub(crate) fn settings(args: &SceneArgs) -> Settings {
    let mut settings = Settings::default();
    settings.step.formulation = args.formulation;
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

//! From the command line to a scene and settings.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, Error, Result, anyhow, bail};
use clap::CommandFactory;
use export::TrajectoryReader;
use rod::{Body, Model, Pose};
use scene::sampling::{Family, Parameters};
use scene::{Origin, Scene, SceneError, SceneText};
use solver::simulation::{Overlap, Overlapped, Settings};
use solver::snapshot::Snapshot;
use solver::statics::{StaticParams, equilibrium};

use crate::cli::{BeginArgs, Cli, OfScene, SceneArgs};
use crate::converted::{is_mjcf, load};
use crate::files::TRAJECTORY;
use crate::going_on::{Found, Label, hash, hash_of_segments, place_of_snapshot, read_snapshot};
use crate::held::{self, Hold, hold_as, hold_frame};
use crate::kept_scene::{self, chosen};
use crate::numbers::number;

/// The scene that runs where none is named.
const FIRST: &str = "bending-rod";

/// A scene, and where it begins.
pub(crate) struct Begun {
    pub(crate) scene: Scene,
    /// Where another run has ended, if it goes on from there; else it begins with the scene's state, which may be a frame of
    /// another run.
    pub(crate) snapshot: Option<From>,
    /// What is held otherwise than the scene says.
    pub(crate) holds: Vec<Hold>,
    /// Where the scene itself has its anchors.
    anchors: Vec<Pose>,
}

/// A snapshot of another run.
pub(crate) struct From {
    pub(crate) snapshot: Snapshot,
    /// The folder that it is from, for errors.
    pub(crate) what: String,
    /// Whether that run did not come to its end.
    pub(crate) is_unfinished: bool,
}

impl Begun {
    /// What its snapshots say, if there are any: the hash of a large model takes a while.
    pub(crate) fn label(&self, has_snapshots: bool) -> Label {
        let Scene { name, model, .. } = &self.scene;
        let drawn = || Model { anchors: self.anchors.clone(), ..model.clone() };
        let model = if has_snapshots { hash(&drawn()) } else { String::new() };
        Label { scene: name.clone(), model, holds: self.holds.clone() }
    }
}

/// The scene that the arguments name, with their beginning, time step and number of steps put in.
pub(crate) fn scene(args: &SceneArgs) -> Result<Begun> {
    let mut scene = chosen(args.scene.as_deref(), folder_of_run(&args.begin), FIRST, &args.of)?;
    scene.run.dt = args.dt.unwrap_or(scene.run.dt);
    scene.run.steps = args.steps.unwrap_or(scene.run.steps);
    let anchors = scene.model.anchors.clone();
    if let Some((what, Origin { folder, frame: None })) = origin(&scene, &args.begin)
        && let Some(Found { snapshot, holds, is_unfinished }) = read_snapshot(folder, &scene, &what)?
    {
        hold_as(&mut scene, &holds, &what)?;
        return Ok(Begun { scene, snapshot: Some(From { snapshot, what, is_unfinished }), holds, anchors });
    }
    let holds = begin_with_frame(&mut scene, &args.begin)?;
    if scene.begins_at_rest && !begins_with_frame(&scene, &args.begin) {
        come_to_rest(&mut scene)?;
    }
    Ok(Begun { scene, snapshot: None, holds, anchors })
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

/// The folder with the scene of the run with which arguments say to begin, if they do.
fn folder_of_run(BeginArgs { from }: &BeginArgs) -> Option<PathBuf> {
    let Origin { folder, frame } = from.as_ref()?;
    Some(if frame.is_none() { place_of_snapshot(folder) } else { folder.clone() })
}

/// Whether a scene begins with a frame of another run.
pub(crate) fn begins_with_frame(scene: &Scene, begin: &BeginArgs) -> bool {
    origin(scene, begin).is_some()
}

/// Puts in the frame of another run from which the scene is to begin, if there is one.
pub(crate) fn begin_with_frame(scene: &mut Scene, begin: &BeginArgs) -> Result<Vec<Hold>> {
    let Some((what, Origin { folder, frame })) = origin(scene, begin) else { return Ok(Vec::new()) };
    let (path, frame) = (folder.join(TRAJECTORY), *frame);
    if !path.is_file() {
        bail!(
            "{what}: there is no {TRAJECTORY} in it, and no snapshot; a run with --snapshot leaves one, with --trajectory the other"
        );
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
    let holds = hold_frame(scene, &what)?;
    scene.model.validate(&scene.state).with_context(|| what.clone())?;
    Ok(holds)
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
pub(crate) fn named(name: &str, of: &OfScene) -> Result<Scene> {
    let OfScene { seed, index, set } = of;
    let (seed, index) = (*seed, *index);
    if let Some((_, family)) = RANDOM.into_iter().find(|&(random, _)| random == name) {
        if let Some(setting) = set.first() {
            bail!("--set {setting}: {name} is drawn at random, without a file whose keys could be changed");
        }
        let scene = Parameters::sample(family, seed.unwrap_or(0), index.unwrap_or(0)).scene()?;
        return Ok(Scene { name: name.to_owned(), ..scene });
    }
    for (flag, given) in [("--seed", seed.is_some()), ("--index", index.is_some())] {
        if given {
            bail!("{flag} needs a random scene ({}), but the scene is {name}", random_names());
        }
    }
    if is_mjcf(name) {
        return load(name, set);
    }
    let is_file = name.ends_with(".toml") || name.contains(['/', '\\']);
    let found = if is_file { scene::load_set(name, set) } else { scene::builtin_set(name, set) };
    found.map_err(|error| match error {
        SceneError::Read { file, source } if file == name => {
            let is_missing = source.kind() == std::io::ErrorKind::NotFound;
            let hint = if is_missing { " (`simulate list` shows the scenes that come with the program)" } else { "" };
            anyhow!("cannot read the scene {file}: {source}{hint}")
        }
        SceneError::Read { file, source } => anyhow!("cannot read {file}: {source}"),
        SceneError::UnknownBuiltin { name, .. } => unknown(&name),
        setting @ SceneError::Setting { .. } => anyhow!("--set {setting}"),
        invalid @ SceneError::Invalid { .. } => invalid.into(),
    })
}

/// Similarity, of 0 to 1, from which a name is taken for a slip of the pen.
pub(crate) const ALIKE: f64 = 0.7;

/// What overlaps at the start, in the words of the scene, and where it stands in its file.
pub(crate) fn overlapping(scene: &Scene, args: &SceneArgs, overlap: &Overlap) -> Error {
    let Overlap { segment, rod, other, depth, pairs } = *overlap;
    let place = |segment| held::place(scene, Body::Segment(segment));
    let (first, depth) = (place(segment), number(depth));
    let what = match other {
        Overlapped::Segment { index, .. } => format!("{first} and {} overlap by {depth} m", place(index)),
        Overlapped::Obstacle { index, kind } => {
            let name = scene.obstacles.get(index).cloned().unwrap_or_else(|| format!("obstacle {index}"));
            format!("{first} overlaps {name} (a {kind}) by {depth} m")
        }
    };
    let more = match pairs {
        0 | 1 => String::new(),
        2 => ", and another pair too".to_owned(),
        pairs => format!(", and {} other pairs too", pairs - 1),
    };
    let kept = || folder_of_run(&args.begin).map(|folder| folder.join(kept_scene::SCENE).display().to_string());
    let file = args.scene.clone().or_else(kept).unwrap_or_else(|| FIRST.to_owned());
    let line = scene.rods.get(rod).zip(std::fs::read_to_string(&file).ok());
    let line = line.and_then(|(rod, text)| scene::line_of(&text, &rod.name)).map(|line| format!(":{line}"));
    let line = line.unwrap_or_default();
    anyhow!("{file}{line}: {what} at the start{more}; move them apart, or allow it (`contact.allow_overlap`)")
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
    let known: Vec<_> = scenes.chain(random).chain(commands).collect();
    let nearest = scene::nearest(name, known.iter().map(|(known, _)| *known), ALIKE);
    let meant = nearest.and_then(|nearest| known.iter().find(|(known, _)| *known == nearest));
    let meant = meant.map(|(known, what)| format!("; did you mean {what}`{known}`?")).unwrap_or_default();
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

/// What the rods of a scene's file do not say of their material, and what it is then; nothing of a scene that comes with the
/// program.
pub(crate) fn left_out(scene: &Scene, args: &SceneArgs) -> Vec<String> {
    let is_own = !is_known(args.scene.as_deref().unwrap_or(&scene.name));
    scene.text.as_ref().filter(|_| is_own).map_or_else(Vec::new, SceneText::left_out)
}

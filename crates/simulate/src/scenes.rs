//! From the command line to a scene and settings.

use std::path::PathBuf;

use anyhow::{Context as _, Error, Result, anyhow, bail};
use catalogue::GuessName;
use cosserat::scene::{self, Origin, RunDefaults, Scene, SceneText};
use cosserat::simulation::{Overlap, Overlapped, Settings, Snapshot};
use cosserat::state::{Body, Model, Pose};
use cosserat::statics::{StaticParams, equilibrium};
use export::TrajectoryReader;

use crate::choice::{formulation, integrator};
use crate::chosen::chosen;
use crate::cli::{BeginArgs, SceneArgs};
use crate::files::TRAJECTORY;
use crate::going_on::{Found, Label, hash, hash_of_segments, place_of_snapshot, read_snapshot};
use crate::held::{self, Hold, hold_as, hold_frame};
use crate::kept_scene;
use crate::named::is_known;
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
    if !(scene.model.laws.is_empty() && scene.model.breakable.is_empty()) {
        bail!(
            "{what}: a frame does not say what the joints with `yield`, `strand_friction`, `relaxation` or `moment_table` remember, and which with \
             `strength` have broken; a run of this scene goes on from a snapshot alone, which a run with --snapshot leaves"
        );
    }
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
        Overlapped::Sheath { index } => {
            let name = scene.sheaths.get(index).cloned().unwrap_or_else(|| format!("sheath {index}"));
            format!("{first} overlaps the wall of {name} by {depth} m")
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

/// Settings with the formulation, the integrator and the tolerances of the arguments, for such a start and the `run` of a scene; the absolute tolerance
/// goes down with the relative one.
pub(crate) fn settings(args: &SceneArgs, guess: Option<GuessName>, run: &RunDefaults) -> Settings {
    let mut settings = Settings::default();
    settings.step.formulation = formulation(args.formulation, guess);
    settings.step.integrator = integrator(args.integrator.or(run.integrator), guess);
    if let Some(tolerance) = args.tolerance {
        (settings.step.relative_tolerance, settings.step.motion_tolerance) = (tolerance, tolerance);
        settings.step.absolute_tolerance = settings.step.absolute_tolerance.min(1e-3 * tolerance);
    }
    settings.step.tangent = args.tangent;
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

//! `simulate SCENE --live`: the simulation in a browser while it runs; and what was done there, done again.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result, anyhow, bail};
use cosserat::live::{Live, LiveError, Options, Rebuild, Recording, Replay, Save, with_hands};
use cosserat::scene::Scene;
use cosserat::simulation::Simulation;
use cosserat::state::Model;
use terminal::{Progress, say};

use crate::cli::{OUT, RunArgs, SceneArgs};
use crate::curves;
use crate::outcome::Outcome;

/// How the program runs a scene.
pub(crate) type Run = fn(&SceneArgs, &RunArgs) -> Result<Outcome>;

/// The recording in a file.
///
/// # Errors
/// If it cannot be read, or is none.
pub(crate) fn read_recording(path: &Path) -> Result<Recording> {
    let what = || format!("--replay {}", path.display());
    let text = fs::read(path).with_context(what)?;
    serde_json::from_slice(&text).map_err(|error| anyhow!("{}: no recording of a live view: {error}", what()))
}

/// A recording to be done again, on a simulation at its start.
///
/// # Errors
/// If it is of another scene.
pub(crate) fn replay<'a>(
    recording: &Recording,
    model: &Model,
    simulation: &mut Simulation,
    dt: f64,
    rebuild: Rebuild<'a>,
) -> Result<Replay<'a>> {
    Replay::new(recording.clone(), model, simulation, dt, Some(rebuild)).context("--replay")
}

/// Shows a simulation of a scene, whose model is `model` with loads for hands, until Ctrl-C, or until its page has been closed for
/// a minute. Recordings are saved by `run`.
///
/// # Errors
/// If the port is taken, or a step is refused.
pub(crate) fn show(
    scene: &Scene,
    model: &Model,
    simulation: &mut Simulation,
    rebuild: Rebuild<'_>,
    (scene_args, args): (&SceneArgs, &RunArgs),
    run: Run,
) -> Result<Outcome> {
    // Listens to Ctrl-C.
    let progress = Progress::new(0, "steps", true)?;
    let (rods, obstacles) = curves::names(scene);
    let options = Options {
        names: [rods, obstacles],
        port: args.port.unwrap_or(0),
        save: Some(saver(&scene.name, scene_args, args, run)),
        ..Options::new(&scene.name)
    };
    let mut live =
        Live::open(model, simulation, scene.run.dt, Some(rebuild), options).map_err(|error| match error {
            LiveError::Port { .. } => anyhow!("--port: {error}"),
            error => error.into(),
        })?;
    say!("{}", live.address())?;
    if !scene_args.quiet {
        say!(
            "Open this address in a browser on this machine. Ctrl-C ends it, and so does the page, a minute after it is closed."
        )?;
    }
    while !progress.stopped() && live.turn(simulation)? {}
    progress.finish();
    match live.finish() {
        Some(Ok(saved)) => say!("{saved}")?,
        Some(Err(why)) => bail!("{why}"),
        None => {}
    }
    Ok(Outcome::Done)
}

/// Saves recordings as runs: each is done again from the start, in a thread of its own, with the run's flags.
fn saver(name: &str, scene_args: &SceneArgs, args: &RunArgs, run: Run) -> Save {
    let scene_args = SceneArgs { quiet: true, threads: None, ..scene_args.clone() };
    let args = RunArgs { live: false, port: None, view: true, trajectory: true, keep_going: true, ..args.clone() };
    let name = name.to_owned();
    Arc::new(move |recording| {
        let out = args.out.clone().unwrap_or_else(|| free_folder(&name));
        let place = out.display().to_string();
        let every = args.every.or_else(|| every(recording.steps, recording.segments));
        let args = RunArgs { recording: Some(recording), every, out: Some(out), ..args.clone() };
        match run(&scene_args, &args) {
            Ok(Outcome::Interrupted) => Err("the run was not saved: it was interrupted".to_owned()),
            Ok(Outcome::Stuck(note) | Outcome::Inaccurate(note)) => Ok(format!("Saved in {place}; {note}")),
            Ok(Outcome::Done | Outcome::NotConverged) => Ok(format!("Saved in {place}")),
            Err(error) => Err(format!("{error:#}")),
        }
    })
}

/// A folder for a run of this scene that is not there yet.
fn free_folder(name: &str) -> PathBuf {
    let numbered = |k: usize| if k == 1 { format!("{name}-live") } else { format!("{name}-live-{k}") };
    let mut all = (1..).map(|k| Path::new(OUT).join(numbered(k)));
    all.find(|place| !place.exists()).unwrap_or_default()
}

/// Of a long motion one step in so many is kept, 200 million segments and frames in all; `None`: as the scene says.
fn every(steps: u64, segments: usize) -> Option<usize> {
    let every = steps.saturating_mul(segments as u64).div_ceil(200_000_000);
    usize::try_from(every).ok().filter(|&every| every > 1)
}

/// The scene's model with loads for hands, where viewers, or what they did, need them.
pub(crate) fn handled(scene: &Scene, args: &RunArgs) -> Option<Model> {
    (args.live || args.recording.is_some()).then(|| with_hands(&scene.model))
}

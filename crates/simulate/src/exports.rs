//! `simulate export`: files for other programs, of a run on the disk.

use anyhow::{Context, Result, bail};
use cosserat::scene::Scene;
use cosserat::simulation::Formulation;
use export::{RunFolder, TrajectoryReader, write_format};
use serde::Deserialize;
use terminal::say;

use crate::chosen::kept_scene;
use crate::cli::ExportArgs;
use crate::files::{SUMMARY, TRAJECTORY, Wanted, names};
use crate::held::{Hold, hold_as};
use crate::kept_scene::SCENE;
use crate::named::{is_known, named};
use crate::outcome::Outcome;
use crate::rods;
use crate::sought::still;

/// Writes the files that are asked for into the folder of a run.
pub(crate) fn export(args: &ExportArgs) -> Result<Outcome> {
    let file = args.folder.join(TRAJECTORY);
    if !file.is_file() {
        bail!("{} has no {TRAJECTORY}, which a run with --trajectory writes", args.folder.display());
    }
    let mut trajectory = TrajectoryReader::open(&file)?;
    let scene = scene(args, &trajectory)?;
    let rods = rods::numbers(&scene, &args.rods, &args.export)?;
    let part = Wanted { rods, ..Wanted::plain(&args.folder) }.part(&scene.model);
    let outputs: Vec<&str> = args.export.iter().flat_map(|format| format.outputs(&scene.model)).collect();

    let folder = RunFolder::add(&args.folder, &outputs)?;
    let has_forces = trajectory.joints() > 0 || scene.model.joints.is_empty();
    trajectory.every(args.every.unwrap_or(1));
    if let Some(part) = &part {
        trajectory.only(&part.segments, &part.joints);
    }
    let model = part.as_ref().map_or(&scene.model, |part| &part.model);
    let names = names(&scene, model);
    for &format in &args.export {
        write_format(format, folder.path(), &mut trajectory, model, &names).context("--export")?;
    }
    if !args.quiet {
        say!("wrote {} to {}", outputs.join(", "), args.folder.display())?;
        if !has_forces {
            say!("without forces of joints: the run has kept none, as one with --export does")?;
        }
    }
    Ok(Outcome::Done)
}

/// The scene of the run.
fn scene(args: &ExportArgs, trajectory: &TrajectoryReader) -> Result<Scene> {
    let (folder, own) = (args.folder.display(), &trajectory.info().scene);
    let is_drawn = args.of.seed.or(args.of.index).is_some();
    let kept = if args.scene.is_none() && !is_drawn { kept_scene(&args.folder, &args.of.set)? } else { None };
    let mut scene = match (kept, &args.scene) {
        (Some(kept), _) => kept,
        (None, None) if !is_known(own) => bail!(
            "{folder} has a run of the scene `{own}`, which does not come with the program, without its {SCENE}: say \
             --scene FILE.toml"
        ),
        (None, name) => named(name.as_ref().unwrap_or(own), &args.of).context("--scene")?,
    };
    let (model, name) = (&scene.model, &scene.name);
    let joints = if trajectory.joints() > 0 { trajectory.joints() } else { model.joints.len() };
    for (what, found, needed) in
        [("segments", model.segments.len(), trajectory.segments()), ("joints", model.joints.len(), joints)]
    {
        if found != needed {
            bail!("--scene: the scene {name} has {found} {what}, but the run in {folder} has {needed}");
        }
    }
    let path = args.folder.join(SUMMARY);
    let text = std::fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
    let Summary { held, stands_at_s, formulation, breaks } =
        serde_json::from_slice(&text).with_context(|| format!("{} is damaged", path.display()))?;
    if let Some(formulation) = formulation.and_then(|name| name.parse::<Formulation>().ok()) {
        scene.model = formulation.measured(&scene.model).into_owned();
    }
    for Broken { joint, time_s } in breaks.into_iter().flatten() {
        if let Some(own) = scene.model.breakable.iter_mut().find(|own| own.joint == joint) {
            own.broke = Some(time_s);
        }
    }
    hold_as(&mut scene, &held, &path.display().to_string())?;
    Ok(if stands_at_s.is_some() { still(scene) } else { scene })
}

/// What the summary says of how things are held in the frames.
#[derive(Deserialize)]
struct Summary {
    /// What was held otherwise than the scene says.
    #[serde(default)]
    held: Vec<Hold>,
    /// Present where what is driven stands still, at time 0.
    stands_at_s: Option<f64>,
    /// Of a run.
    formulation: Option<String>,
    /// What broke in a run.
    breaks: Option<Vec<Broken>>,
}

/// A joint that broke, and the time up to which it held [s].
#[derive(Deserialize)]
struct Broken {
    joint: usize,
    time_s: f64,
}

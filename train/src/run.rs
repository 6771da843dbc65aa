//! One training from its data to its checkpoint, as the command line says.

use std::fmt::Arguments;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context, Result, bail};
use copingnet::{Checkpoint, Leg, Weights};

use crate::course::Course;
use crate::curves;
use crate::lesson::Taught;
use crate::outcome::Outcome;
use crate::paths::with_ending;
use crate::plan::{Plan, TrainArgs};

/// A flag that Ctrl-C and the request to end (SIGTERM) set.
pub(crate) fn listen() -> Result<Arc<AtomicBool>> {
    let stopped = Arc::new(AtomicBool::new(false));
    let flag = stopped.clone();
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed)).context("cannot listen to Ctrl-C")?;
    Ok(stopped)
}

/// Trains as the command line says.
pub(crate) fn run(cli: &TrainArgs) -> Result<Outcome> {
    let plan = cli.plan()?;
    let say = |text: Arguments<'_>| if cli.quiet { Ok(()) } else { terminal::print(text) };
    say(format_args!(
        "{} {}: {} parameters, {} epochs, seed {}, {} on {} threads",
        plan.scenario,
        plan.recipe.name(),
        Weights::zeros(plan.network).values().len(),
        plan.epochs,
        plan.seed,
        plan.backend,
        plan.threads
    ))?;
    if !cli.resume {
        check_place(&plan, cli.force)?;
    }
    rayon::ThreadPoolBuilder::new().num_threads(plan.threads).build_global()?;
    // Until it trains, Ctrl-C ends it at once; trajectories that are written stay.
    let taught = Taught::prepare(&plan, &cli.set, cli.quiet)?;
    let stopped = listen()?;
    let mut course = Course::new(&plan, &taught);
    if let Some(path) = &cli.from {
        let (weights, legs) = weights_from(path, &plan, &taught).context("--from")?;
        course.begin_with(weights, legs);
    }
    if cli.resume {
        course.resume().context("--resume")?;
        say(format_args!("resumed after {} epochs", course.epoch))?;
    }
    let (samples, about) = (taught.samples.len(), course.columns.about);
    say(format_args!("{samples} samples; on {} validation scenes, {about}", plan.scenes))?;
    say(format_args!("{} score  loss     nodes/s  left", curves::header(&course.columns)))?;
    let outcome = course.train(&stopped, |course, nodes_per_second| {
        let Some(row) = course.rows.last() else { return Ok(()) };
        let (text, left) = (row.text(), course.left().as_secs());
        let (score, loss, minutes) = (row.measured.score, row.loss, left / 60);
        say(format_args!("{text} {score:.3}  {loss:.6} {nodes_per_second:8.0} {minutes}:{:02}", left % 60))
    })?;
    let state = course.state_file();
    if matches!(outcome, Outcome::Interrupted) {
        say(format_args!("stopped; go on with --resume ({})", state.display()))?;
        return Ok(outcome);
    }
    std::fs::remove_file(state).context("--out")?;
    if course.left_out() > 0 {
        say(format_args!("{} times a sample was left out: its loss was not finite", course.left_out()))?;
    }
    say(format_args!("wrote {}.toml, .safetensors, .csv and .svg", plan.out.display()))?;
    Ok(outcome)
}

/// The weights of a checkpoint to go on from, and the trainings that they are of.
fn weights_from(path: &Path, plan: &Plan, taught: &Taught) -> Result<(Weights, Vec<Leg>)> {
    let Taught { encoding, data_blake3, .. } = taught;
    let [text, bytes] = Checkpoint::contents(path)?;
    let Checkpoint { card, encoding: own, weights } = Checkpoint::from_bytes(path, &text, &bytes)?;
    if *weights.config() != plan.network || (own.features, own.head) != (encoding.features, encoding.head) {
        bail!("{}: the network has other features, head or sizes than this training", path.display());
    }
    if own != **encoding || card.data_blake3.as_ref() != Some(data_blake3) {
        bail!("{}: data_blake3 = {:?}, but it must be \"{data_blake3}\"", path.display(), card.data_blake3);
    }
    Ok((weights, card.into_legs(blake3::hash(&bytes).to_hex().to_string())))
}

/// Makes the folder of the checkpoint, and sees that nothing of worth is there.
fn check_place(plan: &Plan, may_replace: bool) -> Result<()> {
    let folder = plan.out.parent().unwrap_or(Path::new(""));
    std::fs::create_dir_all(folder).with_context(|| format!("--out: cannot make the folder {}", folder.display()))?;
    let [state, card] = [".state", ".toml"].map(|ending| with_ending(&plan.out, ending));
    if state.exists() {
        bail!("{} is the state of a training that was cut off: go on by --resume, or delete it", state.display());
    }
    if card.exists() && !may_replace {
        bail!("--out {}: {} is there already; give another place, or --force", plan.out.display(), card.display());
    }
    Ok(())
}

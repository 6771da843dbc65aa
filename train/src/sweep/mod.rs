//! `train sweep`: the paper's ablation (supplement, section "Architecture" and Fig. 11), cell by cell.

pub(crate) mod args;
mod cell;
mod design;
mod folder;
mod merge;

use std::fmt::Arguments;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, anyhow};
use dataset::Scenario;
use evaluation::ablation::{Key, Outcome as Measured, Row};

use self::args::{SweepArgs, SweepCli, SweepCommand};
use self::folder::Folder;
use crate::cli::threads_or_cores;
use crate::lesson::Taught;
use crate::run::{Outcome, listen};

/// Preconditioner and tolerance of the paper's cell.
const RAW: &str = "raw";
/// See [`RAW`].
const TOLERANCE: f64 = 1e-4;

/// Runs `train sweep` or `train sweep merge`.
pub(crate) fn run(cli: &SweepCli) -> Result<Outcome> {
    match &cli.command {
        None => sweep(&cli.sweep),
        Some(SweepCommand::Merge(args)) => merge::merge(args).map(|()| Outcome::Done),
    }
}

fn sweep(args: &SweepArgs) -> Result<Outcome> {
    args.check()?;
    let say = |text: Arguments<'_>| if args.quiet { Ok(()) } else { terminal::print(text) };
    let (part, parts) = args.shard;
    let (recipe, threads) = (args.recipe.name(), threads_or_cores(args.threads));
    let folder = Folder::new(&args.out);
    say(format_args!(
        "sweep, recipe {recipe}, shard {part} of {parts}, {} on {threads} threads, {}",
        args.backend,
        args.out.display()
    ))?;
    rayon::ThreadPoolBuilder::new().num_threads(threads).build_global()?;
    let sweep = args.sweep()?;
    folder.check(&sweep)?;
    let keys: Vec<Key> = sweep.keys().into_iter().skip(part).step_by(parts).collect();
    for source in &sweep.sources {
        let (epochs, nodes) = (sweep.budget.epochs, source.nodes as f64 * sweep.budget.epochs as f64);
        let (scenario, samples) = (&source.scenario, source.samples);
        say(format_args!("each cell of {scenario}: {epochs} epochs of {samples} samples, {nodes:.3e} node visits"))?;
    }
    let (mut waiting, all) = (Vec::new(), keys.len());
    for key in keys {
        let is_done = folder.cells.get(&key).context("delete the file, and its cell is measured again")?.is_some();
        if args.dry_run {
            let state = if is_done { "done" } else { "to do" };
            say(format_args!("{} {state:5} {key}", folder.cells.file(&key)?.display()))?;
        }
        if !is_done {
            waiting.push(key);
        }
    }
    if args.dry_run {
        return Ok(Outcome::Done);
    }
    folder.prepare(&sweep)?;
    say(format_args!("{} of {all} cells to do", waiting.len()))?;
    work(args, &folder, &waiting, say)
}

/// Does these cells.
fn work(args: &SweepArgs, folder: &Folder, keys: &[Key], say: impl Fn(Arguments<'_>) -> Result<()>) -> Result<Outcome> {
    let stopped = listen()?;
    let (begin, all, mut done) = (Instant::now(), keys.iter().map(Key::cost).sum::<f64>(), 0.0);
    let mut last: Option<(Scenario, Taught)> = None;
    for (k, key) in keys.iter().enumerate() {
        let scenario: Scenario = key.source.scenario.parse().map_err(|expected| anyhow!("--scenario: {expected}"))?;
        let plan = args.plan(scenario, key, folder)?;
        say(format_args!("{} of {}: {key}", k + 1, keys.len()))?;
        // Samples are the same for all cells of a kind of scenes.
        let (_, taught) = match last.take().filter(|(of, _)| *of == scenario) {
            Some(same) => last.insert(same),
            None => last.insert((scenario, Taught::prepare(&plan, &args.set, args.quiet)?)),
        };
        let measured = cell::run(&plan, taught, key, &stopped, |course, nodes_per_second| {
            let Some(row) = course.rows.last() else { return Ok(()) };
            let (epoch, epochs, loss, score) = (row.epoch, plan.epochs, row.loss, row.measured.score);
            let rest = left(begin, (done + epoch as f64 / epochs as f64 * key.cost()) / all);
            say(format_args!(
                "  epoch {epoch} of {epochs}, loss {loss:.6}, score {score:.3}, {nodes_per_second:.0} nodes/s, {rest} left"
            ))
        })?;
        let Some(measured) = measured else {
            say(format_args!("stopped; the same command goes on"))?;
            return Ok(Outcome::Interrupted);
        };
        folder.cells.put(key, &measured)?;
        done += key.cost();
        say(format_args!("  {}, {} left", short(&measured), left(begin, done / all)))?;
    }
    say(format_args!(
        "all cells of this shard are done; `train sweep merge {}` puts them together",
        args.out.display()
    ))?;
    Ok(Outcome::Done)
}

/// An outcome in a few words.
fn short(outcome: &Measured) -> String {
    let is_paper = |row: &&Row| row.tolerance == TOLERANCE && row.preconditioner == RAW;
    let words = |row: &Row| {
        let [ratio, speed_up] = [row.iteration_ratio, row.speed_up].map(|spread| spread.map_or(f64::NAN, |s| s.median));
        format!("{} {ratio:.2} of the iterations, speed-up {speed_up:.2}", row.guess)
    };
    let parts: Vec<String> = outcome.rows.iter().filter(is_paper).map(words).collect();
    format!("raw 1e-4: {}; {:.0} s", parts.join("; "), outcome.training_s + outcome.measuring_s)
}

/// An estimate of the time left after a share of the work, in hours, minutes and seconds.
fn left(begin: Instant, share: f64) -> String {
    let rest = begin.elapsed().as_secs_f64() * (1.0 / share.max(f64::MIN_POSITIVE) - 1.0).max(0.0);
    let seconds = Duration::try_from_secs_f64(rest).unwrap_or(Duration::MAX).as_secs();
    format!("{}:{:02}:{:02}", seconds / 3600, seconds / 60 % 60, seconds % 60)
}

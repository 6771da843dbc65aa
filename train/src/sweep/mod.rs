//! `train sweep`: the paper's ablation (supplement, section "Architecture" and Fig. 11), cell by cell.

pub(crate) mod args;
mod cell;
mod folder;
mod merge;

use std::fmt::Arguments;
use std::time::Instant;

use anyhow::{Context, Result, anyhow};
use dataset::Scenario;
use evaluation::ablation::{CellKey, GuessSavings, NetworkOutcome};

use self::args::{SweepArgs, SweepCommand};
use self::folder::Folder;
use crate::lesson::Taught;
use crate::outcome::Outcome;
use crate::plan::threads_or_cores;
use crate::run::listen;

/// Runs `train sweep` or `train sweep merge`.
pub(crate) fn run(args: &SweepArgs) -> Result<Outcome> {
    if let Some(SweepCommand::Merge(args)) = &args.command {
        return merge::merge(args).map(|()| Outcome::Done);
    }
    args.check()?;
    let say = |text: Arguments<'_>| if args.quiet { Ok(()) } else { terminal::print(text) };
    let SweepArgs { backend, shard: (part, parts), .. } = *args;
    let (recipe, threads, out) = (args.recipe.name(), threads_or_cores(args.threads), args.out.display());
    let folder = Folder::new(&args.out);
    say(format_args!("sweep, recipe {recipe}, shard {part} of {parts}, {backend} on {threads} threads, {out}"))?;
    rayon::ThreadPoolBuilder::new().num_threads(threads).build_global()?;
    let sweep = args.sweep()?;
    folder.check(&sweep).context("--out")?;
    for source in &sweep.sources {
        let (epochs, nodes) = (sweep.budget.epochs, (source.nodes * sweep.budget.epochs) as f64);
        let (scenario, samples) = (&source.scenario, source.samples);
        say(format_args!("each cell of {scenario}: {epochs} epochs of {samples} samples, {nodes:.3e} node visits"))?;
    }
    let (mut waiting, mut all) = (Vec::new(), 0);
    for key in sweep.keys().into_iter().skip(part).step_by(parts) {
        let is_done = folder.cells.get(&key).context("delete the file, and its cell is measured again")?.is_some();
        if args.dry_run {
            let state = if is_done { "done" } else { "to do" };
            say(format_args!("{} {state:5} {key}", folder.cells.file(&key)?.display()))?;
        }
        all += 1;
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
fn work(
    args: &SweepArgs,
    folder: &Folder,
    keys: &[CellKey],
    say: impl Fn(Arguments<'_>) -> Result<()>,
) -> Result<Outcome> {
    let stopped = listen()?;
    let (begin, all, mut done) = (Instant::now(), keys.iter().map(CellKey::cost).sum::<f64>(), 0.0);
    let left = |done: f64| {
        let minutes = begin.elapsed().as_secs_f64() / 60.0 * (all / done - 1.0).max(0.0);
        format!("{minutes:.1} minutes left")
    };
    let mut last: Option<(Scenario, Taught)> = None;
    for (k, key) in keys.iter().enumerate() {
        let scenario: Scenario = key.source.scenario.parse().map_err(|expected| anyhow!("--scenario: {expected}"))?;
        let plan = args.plan(scenario, key)?;
        say(format_args!("{} of {}: {key}", k + 1, keys.len()))?;
        // Samples are the same for all cells of a kind of scenes.
        let (_, taught) = match last.take().filter(|(of, _)| *of == scenario) {
            Some(same) => last.insert(same),
            None => last.insert((scenario, Taught::prepare(&plan, &args.set, args.quiet)?)),
        };
        let outcome = cell::run(&plan, taught, &key.test, &stopped, |course, nodes_per_second| {
            let Some(row) = course.rows.last() else { return Ok(()) };
            let (epoch, epochs, loss, score) = (row.epoch, plan.epochs, row.loss, row.measured.score);
            let left = left(done + epoch as f64 / epochs as f64 * key.cost());
            say(format_args!(
                "  epoch {epoch} of {epochs}, loss {loss:.6}, score {score:.3}, {nodes_per_second:.0} nodes/s, {left}"
            ))
        })?;
        let Some(outcome) = outcome else {
            say(format_args!("stopped; the same command goes on"))?;
            return Ok(Outcome::Interrupted);
        };
        folder.cells.put(key, &outcome)?;
        done += key.cost();
        say(format_args!("  {}, {}", in_words(&outcome), left(done)))?;
    }
    let out = args.out.display();
    say(format_args!("all cells of this shard are done; `train sweep merge {out}` puts them together"))?;
    Ok(Outcome::Done)
}

/// What a cell's guesses save with the paper's preconditioner and tolerance, and its time.
fn in_words(outcome: &NetworkOutcome) -> String {
    let words = |own: &GuessSavings| {
        let [ratio, speed_up] = [own.iteration_ratio, own.speed_up].map(|spread| spread.map_or(f64::NAN, |s| s.median));
        format!("{} {ratio:.2} of the iterations, speed-up {speed_up:.2}", own.guess)
    };
    let of_paper = outcome.rows.iter().filter(|own| own.preconditioner == "raw" && own.tolerance == 1e-4);
    let words: Vec<String> = of_paper.map(words).collect();
    format!("raw 1e-4: {}; {:.0} s", words.join("; "), outcome.training_s + outcome.measuring_s)
}

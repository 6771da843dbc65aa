//! The commands.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::Path;

use anyhow::{Context as _, Result};
use clap::ValueEnum;
use report::{Conditions, Page};
use terminal::{Progress, say};

use crate::Outcome;
use crate::cells::{Job, Others, Provenance, ticks};
use crate::cli::ReportArgs;
use crate::context::{Context, Size};
use crate::library::Library;
use crate::sections::{self, Name};

/// Differences of a section that are shown.
const SHOWN: usize = 10;

/// Measures what is missing, and writes the page.
pub(crate) fn report(args: &ReportArgs) -> Result<Outcome> {
    let context = Context {
        size: if args.quick { Size::Quick } else { Size::Full },
        cells: args.cells.clone(),
        sweep: args.sweep.clone(),
        library: Library::new(&args.data),
        machine: export::machine(),
        revision: export::git_revision(),
    };
    if !args.quiet {
        say!("looking for what is measured already in {}", args.cells.display())?;
    }
    // Times are told of one thread.
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global()?;
    let mut jobs = sections::jobs(&args.only);
    let mut seconds = Vec::new();
    for job in &mut jobs {
        seconds.push(job.prepare(&context).context("--cells")?);
    }
    let total: f64 = seconds.iter().sum();
    if !args.quiet {
        say!("{} sections; about {:.0} minutes of measuring on one core are left", jobs.len(), (total / 60.0).ceil())?;
    }
    let progress = Progress::new(ticks(total), "ms", args.quiet)?;
    for others in [Others::Skip, Others::Wait] {
        for job in &mut jobs {
            if !job.run(&context, &progress, others)? {
                progress.finish();
                if !args.quiet {
                    say!("stopped; the same command goes on from here")?;
                }
                return Ok(Outcome::Interrupted);
            }
        }
    }
    progress.finish();
    let page = page(&context, &jobs)?;
    for part in ["csv", "svg"] {
        clear(&args.out.join(part), part).context("--out")?;
    }
    let file = page.write(&args.out).context("--out")?;
    pictures(&page, &args.out.join("svg")).context("--out")?;
    if !args.quiet {
        say!("wrote {}", file.display())?;
    }
    check(&args.out)
}

/// Says what is wrong with a report.
pub(crate) fn check(directory: &Path) -> Result<Outcome> {
    let faults = report::check(directory)?;
    for fault in &faults {
        terminal::complain(format_args!("{fault}"));
    }
    Ok(if faults.is_empty() { Outcome::Done } else { Outcome::Faulty })
}

/// Says whether two runs agree, section by section.
pub(crate) fn compare(folders: [&Path; 2]) -> Result<Outcome> {
    for folder in folders {
        std::fs::read_dir(folder).with_context(|| format!("cannot read {}", folder.display()))?;
    }
    let mut outcome = Outcome::Done;
    for (name, job) in Name::value_variants().iter().zip(sections::jobs(&[])) {
        let Some(agreement) = job.compare(folders)? else { continue };
        say!("{}: {agreement}", name.name())?;
        for difference in agreement.differences().iter().take(SHOWN) {
            terminal::complain(format_args!("{difference}"));
        }
        if !agreement.differences().is_empty() {
            outcome = Outcome::Faulty;
        }
    }
    Ok(outcome)
}

fn page(context: &Context, jobs: &[Box<dyn Job>]) -> Result<Page> {
    let mut provenance = Provenance::default();
    let mut sections = Vec::with_capacity(jobs.len() + 1);
    let mut measured = BTreeMap::new();
    for job in jobs {
        job.add_to(&mut provenance);
        sections.push(job.show(context)?);
        measured.extend(job.claims(context)?);
    }
    sections.insert(0, sections::claims::section(context, measured)?);
    if provenance.revisions.is_empty() {
        // Nothing was measured: what the page says is of this program.
        provenance.add(&context.machine, context.revision.as_deref(), 0.0);
    }
    let minutes = provenance.seconds / 60.0;
    let mut conditions = Conditions::new("program", format!("evaluate {}", env!("CARGO_PKG_VERSION")))
        .with("revision", provenance.revisions.join(", "))
        .with("machine", provenance.machines.join("; "))
        .with("size", context.size.pick("quick (--quick)", "full"))
        .with("measuring took", format!("{minutes:.0} minutes on one core"));
    for (name, origin) in context.library.origins()? {
        conditions = conditions.with(name, format!("{}, weights BLAKE3 {}", origin.network, origin.weights_blake3));
    }
    let lead = LEAD.map(str::to_owned).to_vec();
    Ok(Page { title: "Elastic rods: what a learned guess is worth".to_owned(), lead, conditions, sections })
}

const LEAD: [&str; 2] = [
    "Position-based dynamics of stiff Cosserat rods solves a linear system in every outer iteration. COPINGNet predicts \
     where conjugate gradients should begin. This page holds that guess, and every other way to simulate the same scenes, \
     against error and run time.",
    "All numbers come from one command, `cargo run -p evaluate -- report`. Times of a guess include its features, its \
     inference and its guards. Comparisons are at equal error, and the strongest rivals, the direct solver and Fischer's \
     projection, always stand beside. Every figure and table has a CSV file.",
];

/// Removes what an earlier report left, the files with this ending.
fn clear(directory: &Path, ending: &str) -> Result<()> {
    let entries = match std::fs::read_dir(directory) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(()),
        entries => entries.with_context(|| format!("cannot read {}", directory.display()))?,
    };
    for entry in entries {
        let file = entry?.path();
        if file.extension().is_some_and(|own| own == ending) {
            std::fs::remove_file(&file).with_context(|| format!("cannot remove {}", file.display()))?;
        }
    }
    Ok(())
}

/// Every figure as a file of its own.
fn pictures(page: &Page, directory: &Path) -> Result<()> {
    std::fs::create_dir_all(directory)?;
    for figure in page.figures() {
        let svg = figure.svg();
        export::write_atomically(&directory.join(format!("{}.svg", figure.id)), |out| out.write_all(svg.as_bytes()))?;
    }
    Ok(())
}

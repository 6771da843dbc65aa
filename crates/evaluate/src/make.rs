//! The report: measured, written, and looked through for faults.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, ensure};
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser};
use report::{Block, Conditions, Page};
use terminal::{Progress, say};

use crate::cells::{Job, ticks};
use crate::context::{Context, Size};
use crate::front;
use crate::library::Library;
use crate::numbers::PAGE;
use crate::outcome::Outcome;
use crate::sections::{self, Place, SECTIONS};
use crate::sources::{IS_DIRTY, REVISION, ROOT};

/// Where a report goes that says nothing else.
const REPORT: &str = "report";

/// Names of the sections, for `--only`.
fn names() -> PossibleValuesParser {
    SECTIONS.iter().map(|section| PossibleValue::new(section.name).help(section.about)).into()
}

#[derive(Args, Debug)]
pub(crate) struct ReportArgs {
    /// Fewer scenes, simulations and steps: done in minutes, where the full report takes three to four hours of one core.
    #[arg(long)]
    pub(crate) quick: bool,
    /// Folder of the report [default: report; where a section has the command, out/SECTION].
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Only these sections.
    #[arg(long, value_delimiter = ',', value_name = "SECTIONS", value_parser = names())]
    pub(crate) only: Vec<String>,
    /// Only the first page, from what the other pages say; measures nothing.
    #[arg(long, conflicts_with = "only")]
    pub(crate) first_page: bool,
    /// Part i of n of what is measured, from 0/n to (n - 1)/n, of about the same time: for processes that share the folder of
    /// cells. Cells with the same references stay together. Whichever process finds all cells there makes the report.
    #[arg(long, value_name = "I/N", value_parser = terminal::shard, default_value = "0/1")]
    pub(crate) shard: (usize, usize),
    /// Folder of what was measured so far, a file a cell; what other sources measured is measured anew.
    #[arg(long, default_value = "data/report", value_name = "DIR")]
    pub(crate) cells: PathBuf,
    /// Folder of the data sets that nearest neighbours look into; generated on first use.
    #[arg(long, default_value = "data", value_name = "DIR")]
    pub(crate) data: PathBuf,
    /// Summary of the ablation sweep: the summary.toml that `train sweep merge` writes, copied here.
    #[arg(long, default_value = "data/sweep.toml", value_name = "FILE")]
    pub(crate) sweep: PathBuf,
    /// Folder with a folder of recordings for each real cable, `train` and `eval` in it: what the section real-cables measures.
    #[arg(long, value_name = "DIR")]
    pub(crate) recordings: Option<PathBuf>,
    /// Print nothing but errors.
    #[arg(long)]
    pub(crate) quiet: bool,
}

/// Measures what is missing, and writes the page.
pub(crate) fn report(args: &ReportArgs) -> Result<Outcome> {
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from(REPORT));
    refuse_dirty(&out, &Path::new(ROOT).join(REPORT), IS_DIRTY).context("--out")?;
    if args.first_page {
        write(&front::page(&out, &sections::folders())?, &out).context("--out")?;
        return check(&out);
    }
    let context = Context {
        size: if args.quick { Size::Quick } else { Size::Full },
        shard: args.shard,
        cells: args.cells.clone(),
        sweep: args.sweep.clone(),
        recordings: args.recordings.clone(),
        library: Library::new(&args.data),
        machine: export::machine(),
    };
    let tell = |text: String| if args.quiet { Ok(()) } else { say!("{text}") };
    tell(format!("looking for what is measured already in {}", args.cells.display()))?;
    // Times are told of one thread.
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global()?;
    let mut pages = sections::pages(&args.only, args.recordings.is_some());
    let total = jobs(&mut pages).map(|job| job.prepare(&context)).sum::<Result<f64>>().context("--cells")?;
    let (minutes, sections) = ((total / 60.0).ceil(), jobs(&mut pages).count());
    tell(format!("{sections} sections; about {minutes:.0} minutes of measuring on one core are left"))?;
    let progress = Progress::new(ticks(total), "ms", args.quiet)?;
    for job in jobs(&mut pages) {
        if !job.run(&context, &progress)? {
            progress.finish();
            tell("stopped; the same command goes on from here".to_owned())?;
            return Ok(Outcome::Interrupted);
        }
    }
    progress.finish();
    let missing = jobs(&mut pages).map(|job| job.missing(&context)).sum::<Result<usize>>().context("--cells")?;
    if missing > 0 {
        tell(format!("this shard is measured, {missing} cells of others are not; the report is made when all are"))?;
        return Ok(Outcome::Done);
    }
    let mut measured = BTreeMap::new();
    for job in pages.iter().flat_map(|(_, jobs)| jobs) {
        measured.extend(job.claims(&context)?);
    }
    let has_first_page = args.only.is_empty() || out.join(PAGE).exists();
    let put = |page: &Page, folder: &Path| -> Result<()> {
        let file = write(page, folder).context("--out")?;
        tell(format!("wrote {}", file.display()))?;
        Ok(())
    };
    for (place, jobs) in &pages {
        put(&page(&context, place, jobs, &measured)?, &out.join(place.folder))?;
    }
    if has_first_page {
        put(&front::page(&out, &sections::folders())?, &out)?;
    }
    check(&out)
}

/// The sections of all pages.
fn jobs<'a>(pages: &'a mut [(&'static Place, Vec<Box<dyn Job>>)]) -> impl Iterator<Item = &'a mut Box<dyn Job>> {
    pages.iter_mut().flat_map(|(_, jobs)| jobs)
}

/// Refuses to put what was made of sources that no revision has into the place that is committed.
fn refuse_dirty(out: &Path, committed: &Path, is_dirty: bool) -> Result<()> {
    let place = out.canonicalize().or_else(|_| std::path::absolute(out))?;
    ensure!(
        !is_dirty || place != committed,
        "{} is committed, but this program is built of sources that are not: commit them and build it again, or give \
         another place",
        committed.display()
    );
    Ok(())
}

/// Says what is wrong with a page, or with a report: its first page and those in the folders below.
pub(crate) fn check(directory: &Path) -> Result<Outcome> {
    let mut folders = vec![directory.to_owned()];
    let below = sections::folders().into_iter().map(|(folder, _)| directory.join(folder));
    folders.extend(below.filter(|folder| folder.join(PAGE).exists()));
    if folders.len() > 1 && !directory.join(PAGE).exists() {
        folders.remove(0);
    }
    let mut outcome = Outcome::Done;
    for folder in folders {
        for fault in report::check(&folder)? {
            terminal::complain(format_args!("{}: {fault}", folder.display()));
            outcome = Outcome::Faulty;
        }
    }
    Ok(outcome)
}

/// A page of some sections, with the numbers that all sections have `measured` where the paper has one.
fn page(context: &Context, place: &Place, jobs: &[Box<dyn Job>], measured: &BTreeMap<String, String>) -> Result<Page> {
    let (mut seconds, mut sections) = (0.0, Vec::new());
    for job in jobs {
        let (provenance, mut section) = (job.provenance(), job.show(context)?);
        seconds += provenance.seconds;
        section.blocks.extend(provenance.words().map(Block::Paragraph));
        sections.push(section);
    }
    if place.has_networks {
        sections.insert(0, sections::claims::section(context, measured)?);
    }
    let conditions = Conditions::new("program", format!("evaluate {}", env!("CARGO_PKG_VERSION")))
        .with("revision", REVISION)
        .with("revisions of what was measured", "at the end of each section, with machine and date")
        .with("size", context.size.pick("quick (--quick)", "full"))
        .with("measuring took", format!("{:.0} minutes on one core", seconds / 60.0));
    let origins = if place.has_networks { context.library.origins()? } else { Vec::new() };
    let conditions = origins.into_iter().fold(conditions, |conditions, [name, origin]| conditions.with(name, origin));
    let lead = place.lead.iter().map(|&words| words.to_owned()).collect();
    Ok(Page { title: place.title.to_owned(), lead, conditions, sections })
}

/// Writes the page and every figure as a file of its own; what an earlier report wrote and this one does not goes.
pub(crate) fn write(page: &Page, out: &Path) -> Result<PathBuf> {
    let figures: Vec<_> = page.figures().map(|figure| (format!("svg/{}.svg", figure.id), figure)).collect();
    let numbers = page.ids().map(|id| format!("csv/{id}.csv"));
    replace(&numbers.chain(figures.iter().map(|(name, _)| name.clone())).collect(), out)?;
    let file = page.write(out)?;
    std::fs::create_dir_all(out.join("svg"))?;
    for (name, figure) in figures {
        export::write_atomically(&out.join(name), |out| out.write_all(figure.svg().as_bytes()))?;
    }
    Ok(file)
}

/// Name of the list of the files that a report wrote.
const LIST: &str = "files.txt";

/// Removes what an earlier report wrote, by its list, and this one, of these names, does not; lists this one's files.
fn replace(names: &BTreeSet<String>, folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let list = folder.join(LIST);
    let read = |list: &Path| std::fs::read_to_string(list).with_context(|| format!("cannot read {}", list.display()));
    let old = if list.exists() { read(&list)? } else { String::new() };
    for name in old.lines().filter(|name| !names.contains(*name) && is_own(name)) {
        let file = folder.join(name);
        if file.exists() {
            std::fs::remove_file(&file).with_context(|| format!("cannot remove {}", file.display()))?;
        }
    }
    let lines: String = names.iter().flat_map(|name| [name.as_str(), "\n"]).collect();
    Ok(export::write_atomically(&list, |out| out.write_all(lines.as_bytes()))?)
}

/// Whether a line of the list is a name that a report writes, whoever wrote the list.
fn is_own(name: &str) -> bool {
    let parts: Vec<&str> = name.split('/').collect();
    matches!(parts[..], [folder @ ("csv" | "svg"), file] if file.ends_with(&format!(".{folder}")) && !file.contains('\\'))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn what_no_revision_has_is_refused_in_the_committed_place_alone() {
        let folder = tempfile::tempdir().unwrap();
        let [committed, other] = ["report", "other"].map(|name| folder.path().canonicalize().unwrap().join(name));
        std::fs::create_dir(&committed).unwrap();
        let error = refuse_dirty(&committed, &committed, true).unwrap_err().to_string();
        assert!(error.contains("report is committed") && !error.contains('\n'), "{error}");
        // By another name of the same place, too.
        assert!(refuse_dirty(&other.join("../report"), &committed, true).is_ok(), "nothing is there yet");
        std::fs::create_dir(&other).unwrap();
        assert!(refuse_dirty(&other.join("../report"), &committed, true).is_err());
        assert!(refuse_dirty(&other, &committed, true).is_ok() && refuse_dirty(&committed, &committed, false).is_ok());
    }

    #[test]
    fn what_the_program_did_not_write_stays() {
        let folder = tempfile::tempdir().unwrap();
        let there = |name: &str| folder.path().join(name).exists();
        let written = |names: &[&str]| {
            replace(&names.iter().map(|&name| name.to_owned()).collect(), folder.path()).unwrap();
            for name in names {
                fs::write(folder.path().join(name), "").unwrap();
            }
        };
        for part in ["csv", "svg"] {
            fs::create_dir(folder.path().join(part)).unwrap();
        }
        for mine in ["csv/mine.csv", "svg/mine.svg", "csv/a.txt", "note.csv"] {
            fs::write(folder.path().join(mine), "mine").unwrap();
        }
        written(&["csv/a.csv", "svg/a.svg", "csv/b.csv"]);
        written(&["csv/b.csv", "csv/c.csv"]);
        assert!(!there("csv/a.csv") && !there("svg/a.svg") && there("csv/b.csv") && there("csv/c.csv"));
        for mine in ["csv/mine.csv", "svg/mine.svg", "csv/a.txt", "note.csv"] {
            assert!(there(mine), "{mine}");
        }
        // A list that names what no report writes removes nothing.
        fs::write(folder.path().join(LIST), "note.csv\n../csv/mine.csv\ncsv/../note.csv\ncsv/a.txt\n/csv/mine.csv\n")
            .unwrap();
        written(&["csv/c.csv"]);
        assert!(there("note.csv") && there("csv/a.txt") && there("csv/mine.csv"));
    }
}

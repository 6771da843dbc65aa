//! Which files of a folder the program wrote: a list of them lies beside them, and no other file is ever removed.

use std::collections::BTreeSet;
use std::io::Write as _;
use std::path::Path;

use anyhow::{Context as _, Result};

/// Name of the list.
const LIST: &str = "files.txt";

/// Names of files in a folder, as `csv/name.csv` and `svg/name.svg`.
pub(crate) struct Written(BTreeSet<String>);

impl Written {
    pub(crate) fn new(names: impl Iterator<Item = String>) -> Self {
        Self(names.collect())
    }

    /// Removes what the list in a folder has and these files have not, and makes these files the list.
    pub(crate) fn replace(&self, folder: &Path) -> Result<()> {
        std::fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
        let list = folder.join(LIST);
        let old = match std::fs::read_to_string(&list) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
            text => text.with_context(|| format!("cannot read {}", list.display()))?,
        };
        for name in old.lines().filter(|name| !self.0.contains(*name) && is_own(name)) {
            let file = folder.join(name);
            match std::fs::remove_file(&file) {
                Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                    return Err(error).with_context(|| format!("cannot remove {}", file.display()));
                }
                _ => {}
            }
        }
        let lines: String = self.0.iter().flat_map(|name| [name.as_str(), "\n"]).collect();
        Ok(export::write_atomically(&list, |out| out.write_all(lines.as_bytes()))?)
    }
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
    fn what_the_program_did_not_write_stays() {
        let folder = tempfile::tempdir().unwrap();
        let there = |name: &str| folder.path().join(name).exists();
        let written = |names: &[&str]| {
            Written::new(names.iter().map(|&name| name.to_owned())).replace(folder.path()).unwrap();
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

//! Tables that are written row by row while a run goes on.

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::ExportError;
use crate::file::{CHUNK, temporary};

/// A table in the making, in a temporary file beside its own; removed when dropped.
#[derive(Debug)]
pub struct TableWriter {
    path: PathBuf,
    writer: BufWriter<NamedTempFile>,
}

impl TableWriter {
    /// Begins a table at `path`, whose directory must exist, with the names of its columns.
    ///
    /// # Errors
    /// [`ExportError::Io`] if the directory cannot be written to.
    pub fn create(path: &Path, header: &str) -> Result<Self, ExportError> {
        let begin = || {
            let name = path.file_name().ok_or(io::ErrorKind::InvalidFilename)?;
            let directory = path.parent().filter(|d| !d.as_os_str().is_empty()).unwrap_or(Path::new("."));
            let mut writer = BufWriter::with_capacity(CHUNK, temporary(directory, &name.to_string_lossy())?);
            writeln!(writer, "{header}")?;
            Ok(writer)
        };
        let writer = begin().map_err(ExportError::io("write", path))?;
        Ok(Self { path: path.to_owned(), writer })
    }

    /// Adds what `write` writes: whole rows.
    ///
    /// # Errors
    /// [`ExportError::Io`] if the disk does not take it.
    pub fn add(&mut self, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), ExportError> {
        write(&mut self.writer).map_err(ExportError::io("write", &self.path))
    }

    /// Gives the table its own name, when all of it is on the disk.
    ///
    /// # Errors
    /// [`ExportError::Io`] if the disk does not take it.
    pub fn finish(self) -> Result<(), ExportError> {
        let Self { path, writer } = self;
        let finish = || {
            let file = writer.into_inner().map_err(io::IntoInnerError::into_error)?;
            file.as_file().sync_all()?;
            file.persist(&path).map_err(|error| error.error)
        };
        finish().map(drop).map_err(ExportError::io("write", &path))
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_table_is_whole_or_not_there() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("t.csv");
        for finishes in [false, true] {
            let mut table = TableWriter::create(&path, "a,b").unwrap();
            table.add(|writer| writeln!(writer, "1,2")).unwrap();
            assert!(!path.exists());
            if finishes {
                table.finish().unwrap();
            } else {
                drop(table);
                assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 0);
            }
        }
        assert_eq!(fs::read_to_string(&path).unwrap(), "a,b\n1,2\n");
        let error = TableWriter::create(&directory.path().join("none/t.csv"), "a").unwrap_err();
        assert!(error.to_string().contains("t.csv"), "{error}");
    }
}

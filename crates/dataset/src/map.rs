//! Files as memory: the one place in the workspace's data code that needs `unsafe`.
#![allow(unsafe_code)]

use std::fs::File;
use std::path::Path;

use memmap2::Mmap;

use crate::DatasetError;

/// A file mapped for reading.
#[derive(Debug)]
pub(crate) struct Map(Option<Mmap>);

impl Map {
    /// Maps the file at `path`.
    pub(crate) fn open(path: &Path) -> Result<Self, DatasetError> {
        let file = File::open(path).map_err(DatasetError::io("read", path))?;
        let length = file.metadata().map_err(DatasetError::io("read", path))?.len();
        if length == 0 {
            // A mapping of no bytes is an error on some systems.
            return Ok(Self(None));
        }
        // SAFETY: a mapping is undefined behaviour where another process changes or shortens the file under it. Shards
        // are written under another name and renamed when they are complete, so that this crate never changes a file
        // that can be opened; a new shard takes the name, not the mapped file. No other program has business with it,
        // and no reference derived from the map is to anything but bytes, for which every value is valid.
        let map = unsafe { Mmap::map(&file) }.map_err(DatasetError::io("map", path))?;
        Ok(Self(Some(map)))
    }

    /// The file's bytes.
    pub(crate) fn bytes(&self) -> &[u8] {
        self.0.as_deref().unwrap_or(&[])
    }
}

//! Results that are expensive to come by, each in a file of its own that is named by all that it depends on.

use std::fs;
use std::io;
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::{ExportError, SealedError, seal, unseal, write_atomically};

/// Why a result was not stored or not read.
#[derive(Debug, Error)]
pub enum ResultsError {
    /// The system refused, or the key or the value has no form that reads back the same.
    #[error(transparent)]
    File(#[from] ExportError),
    /// The file is damaged, of another version, or no result at all.
    #[error(transparent)]
    Sealed(#[from] SealedError),
    /// The file is whole, but it holds the result of another key: somebody renamed it.
    #[error(
        "{}: it holds the result of another key, whose file is {expected}; the key starts {key}",
        file.display()
    )]
    Key {
        /// The file.
        file: PathBuf,
        /// The name that the file must have for the key in it.
        expected: String,
        /// The beginning of the key in it, as TOML.
        key: String,
    },
}

/// One result as it was stored.
#[derive(Clone, Debug, PartialEq)]
pub struct Stored<K, V> {
    /// The file that it is in.
    pub file: PathBuf,
    /// All that it depends on.
    pub key: K,
    /// The result.
    pub value: V,
}

/// What a file holds, or what is wrong with it.
pub type Found<K, V> = Result<Stored<K, V>, ResultsError>;

/// A folder of results, one file each, for programs that are cut off and go on, and for several that share a folder.
///
/// A file's name is the BLAKE3 hash of its key (as TOML, with the version of the format), so that one looks for a result
/// by what it depends on, and a result of other settings is not there instead of wrong. The file holds key and value
/// with a checksum in front ([`seal`]). It is complete or not there ([`write_atomically`]): any number of processes may
/// store in one folder, and of two that store the same key the last one stays.
///
/// Keys and values are whatever serde writes as TOML and reads back the same: infinities and NaN do, and `None` in a
/// field of a struct. What does not (`None` in a list or a map, integers above `i64::MAX`) is refused by [`Self::put`].
#[derive(Clone, Debug)]
pub struct Results<K, V> {
    directory: PathBuf,
    schema_version: u32,
    of: PhantomData<fn(K) -> V>,
}

/// What stands in a file, below the checksum.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Record<K, V> {
    schema_version: u32,
    key: K,
    value: V,
}

/// What a name is the hash of.
#[derive(Serialize)]
struct Named<'a, K> {
    schema_version: u32,
    key: &'a K,
}

/// End of the files' names.
const ENDING: &str = "toml";

/// Characters of a key that an error shows.
const SHOWN: usize = 120;

impl<K, V> Results<K, V>
where
    K: Serialize + DeserializeOwned,
    V: Serialize + DeserializeOwned,
{
    /// The results in `directory`, which the first [`Self::put`] makes. `schema_version` is the version of `K` and `V`:
    /// raise it when their meaning changes, and no older result is found any more.
    pub fn new(directory: impl Into<PathBuf>, schema_version: u32) -> Self {
        Self { directory: directory.into(), schema_version, of: PhantomData }
    }

    /// The folder.
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// Where the result of `key` is, or would be.
    ///
    /// # Errors
    /// If `key` has no form in TOML.
    pub fn file(&self, key: &K) -> Result<PathBuf, ResultsError> {
        let text = toml::to_string(&Named { schema_version: self.schema_version, key }).map_err(|error| {
            let cause = io::Error::other(format!("the key has no form in TOML: {error}"));
            ExportError::io("write into", &self.directory)(cause)
        })?;
        Ok(self.directory.join(format!("{}.{ENDING}", blake3::hash(text.as_bytes()).to_hex())))
    }

    /// The result of `key`; `None` where there is no file.
    ///
    /// # Errors
    /// If the file cannot be read, is damaged, or holds the result of another key. All name the file.
    pub fn get(&self, key: &K) -> Result<Option<V>, ResultsError> {
        let file = self.file(key)?;
        match fs::read(&file) {
            Ok(bytes) => Ok(Some(self.open(&file, &bytes)?.value)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(ExportError::io("read", &file)(error).into()),
        }
    }

    /// Stores the result of `key`; one that is there already is replaced. Returns the file.
    ///
    /// # Errors
    /// If the system refuses, or if `key` or `value` would not be read back the same.
    pub fn put(&self, key: &K, value: &V) -> Result<PathBuf, ResultsError> {
        let file = self.file(key)?;
        let refused = |cause: io::Error| ExportError::io("write", &file)(cause);
        let text = seal(&Record { schema_version: self.schema_version, key, value }).map_err(refused)?;
        let again = self.open(&file, text.as_bytes())?;
        if !(is_same(key, &again.key) && is_same(value, &again.value)) {
            return Err(refused(io::Error::other("it would not be read back the same")).into());
        }
        fs::create_dir_all(&self.directory).map_err(ExportError::io("create the directory", &self.directory))?;
        write_atomically(&file, |out| io::Write::write_all(out, text.as_bytes()))?;
        Ok(file)
    }

    /// All results in the folder, by their files' names, each or what is wrong with its file. A folder that is not there
    /// has none; files with other endings are none.
    ///
    /// # Errors
    /// If the folder cannot be read.
    pub fn all(&self) -> Result<Vec<Found<K, V>>, ResultsError> {
        let refused = || ExportError::io("read", &self.directory);
        let entries = match fs::read_dir(&self.directory) {
            Ok(entries) => entries,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
            Err(error) => return Err(refused()(error).into()),
        };
        let paths = entries.map(|entry| entry.map(|entry| entry.path()).map_err(refused()));
        let mut files = paths.collect::<Result<Vec<_>, _>>()?;
        files.retain(|file| file.extension().is_some_and(|ending| ending == ENDING));
        files.sort();
        let read = |file: PathBuf| {
            let bytes = fs::read(&file).map_err(ExportError::io("read", &file))?;
            let Record { key, value, .. } = self.open(&file, &bytes)?;
            Ok(Stored { file, key, value })
        };
        Ok(files.into_iter().map(read).collect())
    }

    /// Opens a file's text.
    fn open(&self, file: &Path, bytes: &[u8]) -> Result<Record<K, V>, ResultsError> {
        let record: Record<K, V> = unseal(file, bytes, self.schema_version)?;
        let expected = self.file(&record.key)?;
        if expected.file_name() != file.file_name() {
            let text = toml::to_string(&record.key).unwrap_or_default();
            let key = text.split_whitespace().collect::<Vec<_>>().join(" ").chars().take(SHOWN).collect();
            let expected = expected.file_name().unwrap_or_default().to_string_lossy().into_owned();
            return Err(ResultsError::Key { file: file.to_owned(), expected, key });
        }
        Ok(record)
    }
}

/// Whether two values are the same to serde. JSON keeps each `None`, which TOML may leave out; TOML keeps what is not
/// finite, which JSON does not, and has been read back by now.
fn is_same<T: Serialize>(a: &T, b: &T) -> bool {
    matches!((serde_json::to_value(a), serde_json::to_value(b)), (Ok(a), Ok(b)) if a == b)
}

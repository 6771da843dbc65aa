//! What training needs to go on where it was cut off.

use std::collections::BTreeMap;
use std::path::Path;

use export::ExportError as CheckpointError;
use safetensors::Dtype;
use serde::{Deserialize, Serialize};

use super::card::Leg;
use super::tensors::{self, Tensor, Tensors};

/// Version of the file.
const SCHEMA_VERSION: u32 = 1;
/// Where the sealed text is in the file's metadata.
const KEY: &str = "state";

/// All that training must know to go on as if it had never been cut off.
///
/// One safetensors file: `tensor.NAME` F32, `counter.NAME` U64 `[1]`, `row.K` F64 for K from 0, and in its metadata one
/// sealed text ([`export::seal`]) with the fingerprint and the BLAKE3 hash of the file's tensors: of the safetensors
/// file that they make up without metadata.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TrainingState {
    /// Settings that must be the same for training to go on; see [`TrainingState::check_fingerprint`].
    pub fingerprint: BTreeMap<String, String>,
    /// The trainings before this one, for its card.
    pub before: Vec<Leg>,
    /// Steps, epochs and other counts.
    pub counters: BTreeMap<String, u64>,
    /// Parameters, the optimiser's means and squares, and the like, flat. Any values, NaN included.
    pub tensors: BTreeMap<String, Vec<f32>>,
    /// Measurements so far, oldest first. Any values, NaN included.
    pub rows: Vec<Vec<f64>>,
}

/// The sealed text.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Stored {
    schema_version: u32,
    tensors_blake3: String,
    fingerprint: BTreeMap<String, String>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    before: Vec<Leg>,
}

impl TrainingState {
    /// Reads and checks a file.
    ///
    /// # Errors
    /// If it cannot be read, is damaged, foreign, or of another version.
    pub fn load(file: &Path) -> Result<Self, CheckpointError> {
        let bytes = std::fs::read(file).map_err(CheckpointError::io("read", file))?;
        let tensors = Tensors::open(file, &bytes)?;
        let text = tensors.metadata.get(KEY).filter(|_| tensors.metadata.len() == 1);
        let Some(text) = text else {
            let found = tensors.metadata.keys().collect::<std::collections::BTreeSet<_>>();
            return Err(tensors.wrong("keys of metadata", format!("{found:?}"), &format!("{{{KEY:?}}}")));
        };
        let stored: Stored = export::unseal(file, text.as_bytes(), SCHEMA_VERSION)?;
        let found = tensors.hash()?;
        if found != stored.tensors_blake3 {
            let allowed = format!("{}, as when it was written: the file is damaged", stored.tensors_blake3);
            return Err(tensors.wrong("tensors_blake3", found, &allowed));
        }
        let mut state = Self { fingerprint: stored.fingerprint, before: stored.before, ..Self::default() };
        let mut rows = 0;
        for name in tensors.names() {
            match name.split_once('.') {
                Some(("tensor", own)) => {
                    state.tensors.insert(own.to_owned(), tensors.values(name, Dtype::F32, f32::from_le_bytes)?);
                }
                Some(("counter", own)) => match tensors.values(name, Dtype::U64, u64::from_le_bytes)?[..] {
                    [value] => drop(state.counters.insert(own.to_owned(), value)),
                    ref values => return Err(tensors.wrong(name, format!("{} values", values.len()), "one value")),
                },
                Some(("row", _)) => rows += 1,
                _ => return Err(tensors.unknown(name)),
            }
        }
        for k in 0..rows {
            state.rows.push(tensors.values(&row(k), Dtype::F64, f64::from_le_bytes)?);
        }
        Ok(state)
    }

    /// Writes the file: all of it, or none.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn save(&self, file: &Path) -> Result<(), CheckpointError> {
        let bytes = self.to_bytes().map_err(CheckpointError::io("write", file))?;
        export::write_atomically(file, |out| std::io::Write::write_all(out, &bytes))
    }

    fn to_bytes(&self) -> std::io::Result<Vec<u8>> {
        let mut all = Vec::new();
        for (name, values) in &self.tensors {
            all.push(Tensor::f32s(&format!("tensor.{name}"), vec![values.len()], values));
        }
        for (name, &value) in &self.counters {
            all.push(Tensor::u64(&format!("counter.{name}"), value));
        }
        for (k, values) in self.rows.iter().enumerate() {
            all.push(Tensor::f64s(&row(k), values));
        }
        let stored = Stored {
            schema_version: SCHEMA_VERSION,
            tensors_blake3: blake3::hash(&tensors::to_bytes(&all)?).to_hex().to_string(),
            fingerprint: self.fingerprint.clone(),
            before: self.before.clone(),
        };
        tensors::with_text(&all, Some((KEY, export::seal(&stored)?)))
    }

    /// Checks that the state, loaded from `file`, was made with these settings.
    ///
    /// # Errors
    /// [`CheckpointError::Sealed`] with the first setting that differs, in the order of the alphabet.
    pub fn check_fingerprint(&self, file: &Path, wanted: &BTreeMap<String, String>) -> Result<(), CheckpointError> {
        let shown = |value: Option<&String>| value.map_or("missing".to_owned(), |value| format!("{value:?}"));
        let mut keys: Vec<&String> = self.fingerprint.keys().chain(wanted.keys()).collect();
        keys.sort();
        match keys.into_iter().find(|&key| self.fingerprint.get(key) != wanted.get(key)) {
            None => Ok(()),
            Some(key) => {
                let (found, wanted) = (shown(self.fingerprint.get(key)), shown(wanted.get(key)));
                let allowed = format!("{wanted} as now set: training goes on with the settings that it began with");
                Err(CheckpointError::value(file, format!("fingerprint.{key}"), found, allowed))
            }
        }
    }
}

fn row(k: usize) -> String {
    format!("row.{k}")
}

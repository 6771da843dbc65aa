//! Tensors to bytes and back, by name, with everything checked.

use std::collections::{BTreeSet, HashMap};
use std::io;
use std::path::Path;

use export::ExportError as CheckpointError;
use safetensors::tensor::{Dtype, SafeTensors};

use crate::TensorSpec;

/// A tensor to be written.
pub(super) struct Tensor {
    name: String,
    data: export::Tensor,
}

impl Tensor {
    pub(super) fn f32s(name: &str, shape: Vec<usize>, values: &[f32]) -> Self {
        Self::new(name, Dtype::F32, shape, values.iter().copied().flat_map(f32::to_le_bytes).collect())
    }

    pub(super) fn f64s(name: &str, values: &[f64]) -> Self {
        let bytes = values.iter().copied().flat_map(f64::to_le_bytes).collect();
        Self::new(name, Dtype::F64, vec![values.len()], bytes)
    }

    pub(super) fn u64(name: &str, value: u64) -> Self {
        Self::new(name, Dtype::U64, vec![1], value.to_le_bytes().into())
    }

    fn new(name: &str, dtype: Dtype, shape: Vec<usize>, bytes: Vec<u8>) -> Self {
        Self { name: name.to_owned(), data: export::Tensor { dtype, shape, bytes } }
    }
}

/// A safetensors file.
pub(super) fn to_bytes(tensors: &[Tensor]) -> io::Result<Vec<u8>> {
    with_text(tensors, None)
}

/// A safetensors file, with one text in its metadata (of more, the order would be random).
pub(super) fn with_text(tensors: &[Tensor], text: Option<(&str, String)>) -> io::Result<Vec<u8>> {
    let metadata = text.map(|(key, text)| HashMap::from([(key.to_owned(), text)]));
    safetensors::serialize(tensors.iter().map(|tensor| (&tensor.name, &tensor.data)), metadata)
        .map_err(io::Error::other)
}

/// The tensors of a file.
pub(super) struct Tensors<'a> {
    file: &'a Path,
    views: SafeTensors<'a>,
    /// Metadata of the file.
    pub(super) metadata: HashMap<String, String>,
}

impl<'a> Tensors<'a> {
    /// Reads the header; the sizes in it are those of the file.
    pub(super) fn open(file: &'a Path, bytes: &'a [u8]) -> Result<Self, CheckpointError> {
        let open = || Ok((SafeTensors::read_metadata(bytes)?.1, SafeTensors::deserialize(bytes)?));
        let (header, views) = open().map_err(|error: safetensors::SafeTensorError| {
            CheckpointError::value(file, "header", error, "that of a safetensors file")
        })?;
        Ok(Self { file, views, metadata: header.metadata().clone().unwrap_or_default() })
    }

    /// Names, in the order of the alphabet.
    pub(super) fn names(&self) -> BTreeSet<&str> {
        self.views.names().into_iter().collect()
    }

    /// BLAKE3 hash of all names, types, shapes and values.
    pub(super) fn hash(&self) -> Result<String, CheckpointError> {
        let bytes = safetensors::serialize(self.views.iter(), None)
            .map_err(|error| CheckpointError::io("read", self.file)(io::Error::other(error)))?;
        Ok(blake3::hash(&bytes).to_hex().to_string())
    }

    /// Checks that the file holds these tensors, all F32, and no other.
    pub(super) fn check(&self, specs: &[TensorSpec]) -> Result<(), CheckpointError> {
        for TensorSpec { name, shape } in specs {
            let allowed = format!("F32 {shape:?}");
            let found = match self.views.tensor(name) {
                Ok(view) => format!("{:?} {:?}", view.dtype(), view.shape()),
                Err(_) => "missing".to_owned(),
            };
            if found != allowed {
                return Err(self.wrong(name, found, &allowed));
            }
        }
        let known: BTreeSet<&str> = specs.iter().map(|spec| spec.name.as_str()).collect();
        match self.names().difference(&known).next() {
            None => Ok(()),
            Some(name) => Err(self.unknown(name)),
        }
    }

    /// All values of a tensor of this type.
    pub(super) fn values<T, const BYTES: usize>(
        &self,
        name: &str,
        dtype: Dtype,
        read: fn([u8; BYTES]) -> T,
    ) -> Result<Vec<T>, CheckpointError> {
        match self.views.tensor(name) {
            Ok(view) if view.dtype() == dtype => {
                Ok(view.data().as_chunks::<BYTES>().0.iter().map(|&bytes| read(bytes)).collect())
            }
            Ok(view) => Err(self.wrong(name, format!("{:?}", view.dtype()), &format!("{dtype:?}"))),
            Err(_) => Err(self.wrong(name, "missing", &format!("a tensor of {dtype:?}"))),
        }
    }

    /// The error that a tensor has no business there.
    pub(super) fn unknown(&self, name: &str) -> CheckpointError {
        self.wrong(name, "there", "a known tensor: there is no use for this one")
    }

    /// The error that something in the file is not allowed.
    pub(super) fn wrong(&self, key: &str, value: impl ToString, allowed: &str) -> CheckpointError {
        CheckpointError::value(self.file, key, value, allowed)
    }
}

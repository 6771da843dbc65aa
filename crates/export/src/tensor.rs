//! A tensor to be written to a safetensors file.

use std::borrow::Cow;

use safetensors::tensor::{Dtype, View};

/// The bytes of a tensor, which [`safetensors::serialize`] takes by reference.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tensor {
    /// Type of the values.
    pub dtype: Dtype,
    /// Sizes, the slowest first.
    pub shape: Vec<usize>,
    /// The values, little endian.
    pub bytes: Vec<u8>,
}

impl View for &Tensor {
    fn dtype(&self) -> Dtype {
        self.dtype
    }
    fn shape(&self) -> &[usize] {
        &self.shape
    }
    fn data(&self) -> Cow<'_, [u8]> {
        Cow::Borrowed(&self.bytes)
    }
    fn data_len(&self) -> usize {
        self.bytes.len()
    }
}

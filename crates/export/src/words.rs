//! Words that must come back as they are, with what they are of.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use safetensors::{Dtype, SafeTensors};

use crate::file::write_atomically;
use crate::{ExportError, Tensor};

/// Name of the tensor.
const WORDS: &str = "words";
/// What the header says the file is.
const FORMAT: &str = "rods-words-1";

/// Writes `words` `[words]` (U64) to a safetensors file whose header has the texts of `of`, and a checksum of all.
///
/// # Errors
/// [`ExportError::Io`] if the file cannot be written.
pub fn write_words(path: &Path, of: &BTreeMap<String, String>, words: &[u64]) -> Result<(), ExportError> {
    let bytes = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    let tensor = Tensor { dtype: Dtype::U64, shape: vec![words.len()], bytes };
    let mut header: HashMap<String, String> = of.clone().into_iter().collect();
    header.insert("format".to_owned(), FORMAT.to_owned());
    header.insert("checksum".to_owned(), checksum(of, &tensor.bytes));
    let file = safetensors::serialize([(WORDS, &tensor)], Some(header));
    let file = file.map_err(|error| ExportError::io("write", path)(std::io::Error::other(error)))?;
    write_atomically(path, |writer| std::io::Write::write_all(writer, &file))
}

/// Reads what [`write_words`] wrote.
///
/// # Errors
/// [`ExportError::Io`] if the file cannot be read, [`ExportError::Damaged`] if it is not what was written.
pub fn read_words(path: &Path) -> Result<(BTreeMap<String, String>, Vec<u64>), ExportError> {
    let file = std::fs::read(path).map_err(ExportError::io("read", path))?;
    let damaged = |reason: String| ExportError::damaged(path, reason);
    let (_, metadata) = SafeTensors::read_metadata(&file).map_err(|error| damaged(error.to_string()))?;
    let mut of: BTreeMap<String, String> = metadata.metadata().clone().unwrap_or_default().into_iter().collect();
    let (format, expected) = (of.remove("format"), of.remove("checksum"));
    if format.as_deref() != Some(FORMAT) {
        return Err(damaged(format!("its header must say format {FORMAT}")));
    }
    let tensors = SafeTensors::deserialize(&file).map_err(|error| damaged(error.to_string()))?;
    let tensor = tensors.tensor(WORDS).map_err(|error| damaged(error.to_string()))?;
    if tensor.dtype() != Dtype::U64 || expected.as_deref() != Some(checksum(&of, tensor.data()).as_str()) {
        return Err(damaged("its checksum does not fit its content".to_owned()));
    }
    let words = tensor.data().as_chunks().0.iter().map(|&bytes| u64::from_le_bytes(bytes)).collect();
    Ok((of, words))
}

/// BLAKE3 of the texts and the words.
fn checksum(of: &BTreeMap<String, String>, bytes: &[u8]) -> String {
    let mut hasher = blake3::Hasher::new();
    for text in of.iter().flat_map(|(key, value)| [key, value]) {
        hasher.update(&(text.len() as u64).to_le_bytes());
        hasher.update(text.as_bytes());
    }
    hasher.update(bytes);
    hasher.finalize().to_hex().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_come_back_and_a_changed_file_is_damaged() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("words.safetensors");
        let of = BTreeMap::from([("scene".to_owned(), "a \"b\"".to_owned())]);
        let words = [0, 1, u64::MAX, f64::NAN.to_bits(), 1 << 63];
        write_words(&path, &of, &words).unwrap();
        assert_eq!(read_words(&path).unwrap(), (of, words.to_vec()));
        let whole = std::fs::read(&path).unwrap();
        for (cut, flipped) in [(0, Some(whole.len() - 3)), (8, None), (whole.len(), None), (0, Some(20))] {
            let mut bytes = whole[..whole.len() - cut].to_vec();
            if let Some(at) = flipped {
                bytes[at] ^= 1;
            }
            std::fs::write(&path, bytes).unwrap();
            let error = read_words(&path).unwrap_err();
            assert!(matches!(error, ExportError::Damaged { .. }), "{error}");
        }
        assert!(matches!(read_words(&directory.path().join("none")), Err(ExportError::Io { .. })));
    }
}

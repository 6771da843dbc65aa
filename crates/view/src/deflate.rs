//! Numbers packed as text.

use std::io::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;

/// A zlib stream of `data`, in base64.
pub(crate) fn deflated(data: &[u8]) -> String {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
    // Writing into memory cannot fail; a stream that did would be seen as damaged by `Run::decode`.
    let _ = encoder.write_all(data);
    STANDARD.encode(encoder.finish().unwrap_or_default())
}

//! Tracks: one integer a segment and frame, as changes from frame to frame, in planes of bytes.
//!
//! Changes are small where motions are smooth. They are stored as 2 c for c >= 0 and as -2 c - 1 otherwise, so that the
//! upper bytes of small ones are zero, and each byte of all of a track stands together: deflate likes that.

/// Appends a track to `out`: `values` by frame and segment, each below 256^`bytes` (at most 4).
pub(crate) fn write(out: &mut Vec<u8>, values: &[u32], segments: usize, bytes: usize) {
    let shift = 32 - 8 * bytes as u32;
    let start = out.len();
    out.resize(start + bytes * values.len(), 0);
    for (i, &value) in values.iter().enumerate() {
        let before = if i < segments { 0 } else { values[i - segments] };
        let change = (value.wrapping_sub(before) << shift) as i32 >> shift;
        let code = (change << 1 ^ change >> 31) as u32;
        for byte in 0..bytes {
            out[start + byte * values.len() + i] = (code >> (8 * byte)) as u8;
        }
    }
}

/// The values of the track that the planes `data` hold, `bytes` of them.
pub(crate) fn read(data: &[u8], segments: usize, bytes: usize) -> Vec<u32> {
    let count = data.len() / bytes;
    let mask = u32::MAX >> (32 - 8 * bytes as u32);
    let mut values = Vec::<u32>::with_capacity(count);
    for i in 0..count {
        let code = (0..bytes).fold(0, |code, byte| code | u32::from(data[byte * count + i]) << (8 * byte));
        let change = (code >> 1) ^ (code & 1).wrapping_neg();
        let before = if i < segments { 0 } else { values[i - segments] };
        values.push(before.wrapping_add(change) & mask);
    }
    values
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn tracks_come_back(values in prop::collection::vec(any::<u32>(), 0..40), segments in 1..7_usize, bytes in 1..4_usize) {
            let values: Vec<u32> = values.into_iter().map(|v| v & (u32::MAX >> (32 - 8 * bytes))).collect();
            let mut data = vec![7];
            write(&mut data, &values, segments, bytes);
            prop_assert_eq!(data.len(), 1 + bytes * values.len());
            prop_assert_eq!(read(&data[1..], segments, bytes), values);
        }
    }

    #[test]
    fn small_changes_have_empty_upper_bytes() {
        let mut data = Vec::new();
        write(&mut data, &[500, 470, 600], 1, 2);
        assert_eq!(data, [232, 59, 4, 3, 0, 1]);
    }
}

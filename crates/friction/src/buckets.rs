//! A counting sort: contacts and redundant pairs by what they belong to.

/// Puts items, each with the number of its bucket, into `out`, bucket by bucket and in their order within each. `starts` gets where
/// each of `buckets` begins, and the end.
pub fn sort<T: Copy>(
    items: impl Iterator<Item = (usize, T)> + Clone,
    buckets: usize,
    starts: &mut Vec<usize>,
    out: &mut Vec<T>,
) {
    starts.clear();
    starts.resize(buckets + 1, 0);
    out.clear();
    out.extend(items.clone().map(|(bucket, item)| {
        starts[bucket + 1] += 1;
        item
    }));
    for k in 1..starts.len() {
        starts[k] += starts[k - 1];
    }
    for (bucket, item) in items {
        out[starts[bucket]] = item;
        starts[bucket] += 1;
    }
    // Each start has moved to the next one's.
    starts.rotate_right(1);
    starts[0] = 0;
}

//! Whatever is done to a data set's files, it opens, or gives one error that names a file; nothing panics.

use std::path::Path;
use std::sync::LazyLock;

use crate::common::{generated, small};
use dataset::{Config, Dataset, MANIFEST, PaperBatch, Scenario, Split};
use proptest::prelude::*;

const SHARD: &str = "train-0000.safetensors";

/// Manifest and shards of a small set.
static FILES: LazyLock<Vec<(&str, Vec<u8>)>> = LazyLock::new(|| {
    let directory = tempfile::tempdir().unwrap();
    let config = Config { train_trajectories: 2, validation_trajectories: 0, steps: 1, ..small(Scenario::Rod) };
    generated(directory.path(), &config);
    [MANIFEST, SHARD].map(|name| (name, std::fs::read(directory.path().join(name)).unwrap())).into()
});

fn write(directory: &Path, files: &[(&str, Vec<u8>)]) {
    for (name, bytes) in files {
        std::fs::write(directory.join(name), bytes).unwrap();
    }
}

/// Opens the set and reads everything in it.
fn read(directory: &Path) -> Result<(), String> {
    let dataset = Dataset::open(directory).map_err(|error| error.to_string())?;
    for split in Split::ALL {
        for trajectory in dataset.trajectories(split) {
            let (mut component, mut batch) = (trajectory.component(), PaperBatch::default());
            for sample in trajectory.samples() {
                batch.push(&sample, &dataset.norms());
                sample.restore(&mut component);
            }
        }
    }
    Ok(())
}

fn check(directory: &Path) {
    if let Err(message) = read(directory) {
        assert!(message.contains(directory.to_str().unwrap()) && !message.contains('\n'), "{message}");
    }
}

/// The manifest with the hash of a changed shard, and its own checksum made good.
fn resealed(manifest: &[u8], shard: &[u8]) -> Vec<u8> {
    let text = std::str::from_utf8(manifest).unwrap();
    let (old, new) = (blake3::hash(&FILES[1].1).to_hex(), blake3::hash(shard).to_hex());
    let body = text.split_once('\n').unwrap().1.replace(old.as_str(), new.as_str());
    let body = body.replace(&format!("bytes = {}", FILES[1].1.len()), &format!("bytes = {}", shard.len()));
    format!("checksum = \"{}\"\n{body}", blake3::hash(body.as_bytes()).to_hex()).into_bytes()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    #[test]
    fn flipped_bytes_are_found(which in 0..2_usize, place in 0.0..1.0_f64, mask in 1..=255_u8) {
        let directory = tempfile::tempdir().unwrap();
        let mut files = FILES.clone();
        let bytes = &mut files[which].1;
        let place = (place * bytes.len() as f64) as usize;
        bytes[place] ^= mask;
        write(directory.path(), &files);
        let message = read(directory.path()).unwrap_err();
        prop_assert!(message.contains(files[which].0) && !message.contains('\n'), "{}", message);
    }

    #[test]
    fn cut_files_are_found(which in 0..2_usize, place in 0.0..1.0_f64) {
        let directory = tempfile::tempdir().unwrap();
        let mut files = FILES.clone();
        let place = (place * files[which].1.len() as f64) as usize;
        files[which].1.truncate(place);
        write(directory.path(), &files);
        let message = read(directory.path()).unwrap_err();
        prop_assert!(message.contains(files[which].0) && !message.contains('\n'), "{}", message);
    }

    /// As a foreign program might write it: the hashes fit, the contents do not. The header and the constants, which
    /// decide how the rest is read, come first in the file or are short; bytes there are hit often.
    #[test]
    fn shards_with_good_hashes_and_bad_contents_do_not_panic(
        flips in prop::collection::vec((0.0..1.0_f64, any::<u8>()), 1..4),
        in_header in any::<bool>(),
        cut in prop::option::of(0.0..1.0_f64),
    ) {
        let directory = tempfile::tempdir().unwrap();
        let mut files = FILES.clone();
        let shard = &mut files[1].1;
        let length = if in_header { 2000 } else { shard.len() };
        for (place, value) in flips {
            shard[(place * length as f64) as usize] = value;
        }
        if let Some(cut) = cut {
            shard.truncate((cut * shard.len() as f64) as usize);
        }
        files[0].1 = resealed(&files[0].1, &files[1].1);
        write(directory.path(), &files);
        check(directory.path());
    }

    #[test]
    fn manifests_with_other_numbers_do_not_panic(pick in any::<prop::sample::Index>(), number in -1_i64..1_000_000) {
        let text = String::from_utf8(FILES[0].1.clone()).unwrap();
        let lines: Vec<&str> = text.lines().filter(|line| line.contains(" = ")).collect();
        let line = lines[1 + pick.index(lines.len() - 1)];
        let key = line.split_once(" = ").unwrap().0;
        let text = text.replacen(line, &format!("{key} = {number}"), 1);
        let directory = tempfile::tempdir().unwrap();
        let mut files = FILES.clone();
        files[0].1 = resealed(text.as_bytes(), &files[1].1);
        write(directory.path(), &files);
        check(directory.path());
    }
}

#[test]
fn names_with_line_breaks_give_an_error_of_one_line() {
    let directory = tempfile::tempdir().unwrap();
    let mut files = FILES.clone();
    let shard = &mut files[1].1;
    let name = b"trajectory.index";
    let place = shard.windows(name.len()).position(|bytes| bytes == name).unwrap();
    shard[place..place + name.len()].copy_from_slice(br"trajectory.\ndex");
    files[0].1 = resealed(&files[0].1, &files[1].1);
    write(directory.path(), &files);
    let message = read(directory.path()).unwrap_err();
    assert!(message.ends_with("trajectory.index = missing, but it must be a tensor"), "{message}");
}

#[test]
fn constants_with_good_hashes_and_bad_values_do_not_panic() {
    // Every eighth byte of the constants' tensors, wherever they lie, set to what makes counts and indices large.
    let (header, data) = FILES[1].1.split_at(8);
    let start = 8 + u64::from_le_bytes(header.try_into().unwrap()) as usize;
    assert!(data.len() > start);
    let views = safetensors::SafeTensors::deserialize(&FILES[1].1).unwrap();
    for (name, view) in views.tensors() {
        if name.starts_with("sample") {
            continue;
        }
        let from = view.data().as_ptr() as usize - FILES[1].1.as_ptr() as usize;
        for place in (from..from + view.data().len()).step_by(4).take(60) {
            let directory = tempfile::tempdir().unwrap();
            let mut files = FILES.clone();
            files[1].1[place..place + 4].fill(0xff);
            files[0].1 = resealed(&files[0].1, &files[1].1);
            write(directory.path(), &files);
            check(directory.path());
        }
    }
}

#[test]
fn errors_name_file_key_value_and_what_is_allowed() {
    let text = String::from_utf8(FILES[0].1.clone()).unwrap();
    let cases = [
        (
            "schema_version = 1",
            "schema_version = 2",
            "schema_version = 2, but it must be 1 (a newer program has written it)",
        ),
        ("schema_version = 1", "version = 1", "schema_version = missing, but it must be 1"),
        (
            "scenario = \"rod\"",
            "scenario = \"rope\"",
            ":8: `scenario = \"rope\"`: unknown variant `rope`, expected one of `rod`, `helix`, `knot`, `tree`",
        ),
        ("steps = 1", "steps = 0", "config.steps = 0, but it must be 1 to 1000000"),
        ("steps = 1", "steps = -3", "`steps = -3`: invalid value: integer `-3`, expected usize"),
        ("seed = 5", "sead = 5", "`sead = 5`: unknown field `sead`"),
        ("formulation = \"xpbd\"", "formulation = \"newton\"", "formulation = \"newton\", but it must be \"xpbd\""),
        ("dx_m = ", "dx_m = -", "norms.dx_m = -"),
        (
            "train-0000.safetensors",
            "../train.safetensors",
            "shards[0].file = \"../train.safetensors\", but it must be \"train-0000.safetensors\"",
        ),
        ("train_trajectories = 2", "train_trajectories = 9", "number of shards = 1, but it must be 5, by config"),
        ("seed = 5", "seed = ", ": `seed = `: "),
    ];
    for (old, new, expected) in cases {
        assert!(text.contains(old), "{old}");
        let directory = tempfile::tempdir().unwrap();
        let mut files = FILES.clone();
        files[0].1 = resealed(text.replacen(old, new, 1).as_bytes(), &files[1].1);
        write(directory.path(), &files);
        let message = read(directory.path()).unwrap_err();
        assert!(message.contains(MANIFEST) && message.contains(expected), "{message}");
    }
    // Not resealed: a value that is allowed but was not written.
    let directory = tempfile::tempdir().unwrap();
    let mut files = FILES.clone();
    files[0].1 = text.replacen("seed = 5", "seed = 6", 1).into_bytes();
    write(directory.path(), &files);
    let message = read(directory.path()).unwrap_err();
    assert!(message.contains("manifest.toml: checksum = "), "{message}");

    let directory = tempfile::tempdir().unwrap();
    let message = read(directory.path()).unwrap_err();
    assert!(message.starts_with("cannot read ") && message.contains(MANIFEST), "{message}");
    write(directory.path(), &FILES[..1]);
    let message = read(directory.path()).unwrap_err();
    assert!(message.starts_with("cannot read ") && message.contains(SHARD), "{message}");
}

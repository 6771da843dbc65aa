//! Training states come back to the bit, and whatever is done to their files gives one error that names the file.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;
use std::sync::LazyLock;

use crate::files::{leg, resealed};
use copingnet::TrainingState;
use proptest::prelude::*;
use safetensors::tensor::{Dtype, SafeTensors, TensorView};

fn named<T: Clone>(entries: &[(&str, T)]) -> BTreeMap<String, T> {
    entries.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect()
}

fn small() -> TrainingState {
    TrainingState {
        fingerprint: named(&[("seed", "7".to_owned()), ("loss", "energy".to_owned())]),
        before: vec![leg(1.0)],
        counters: named(&[("epoch", 3), ("step", u64::MAX)]),
        tensors: named(&[("parameters", vec![1.0, -0.0, f32::NAN]), ("adam.mean", vec![0.5; 3]), ("none", vec![])]),
        rows: vec![vec![0.1, f64::INFINITY], vec![], vec![-0.0]],
    }
}

static FILE: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let directory = tempfile::tempdir().unwrap();
    small().save(&directory.path().join("state")).unwrap();
    std::fs::read(directory.path().join("state")).unwrap()
});

/// Loads these bytes. The error must be one line that names the file.
fn load(bytes: &[u8]) -> Result<TrainingState, String> {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("state");
    std::fs::write(&file, bytes).unwrap();
    TrainingState::load(&file).map_err(|error| {
        let message = error.to_string();
        assert!(message.contains(file.to_str().unwrap()) && !message.contains(char::is_control), "{message}");
        message
    })
}

/// With numbers as bits, so that NaN is NaN and -0 is not 0.
fn bits(state: &TrainingState) -> impl PartialEq + std::fmt::Debug + use<> {
    let singles = |values: &Vec<f32>| values.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    let doubles = |values: &Vec<f64>| values.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    (
        state.fingerprint.clone(),
        state.counters.clone(),
        state.tensors.iter().map(|(name, values)| (name.clone(), singles(values))).collect::<Vec<_>>(),
        state.rows.iter().map(doubles).collect::<Vec<_>>(),
    )
}

fn states() -> impl Strategy<Value = TrainingState> {
    let texts = prop::collection::btree_map(any::<String>(), any::<String>(), 0..4);
    let counters = prop::collection::btree_map(any::<String>(), any::<u64>(), 0..4);
    let singles = prop::collection::vec(any::<u32>().prop_map(f32::from_bits), 0..20);
    let tensors = prop::collection::btree_map(any::<String>(), singles, 0..5);
    let doubles = prop::collection::vec(any::<u64>().prop_map(f64::from_bits), 0..5);
    let rows = prop::collection::vec(doubles, 0..15);
    (texts, counters, tensors, rows).prop_map(|(fingerprint, counters, tensors, rows)| TrainingState {
        fingerprint,
        before: vec![leg(2.0)],
        counters,
        tensors,
        rows,
    })
}

/// The file's tensors, changed, under a text with their hash.
fn rewritten(change: impl FnOnce(&mut Vec<(String, TensorView<'static>)>)) -> Vec<u8> {
    let mut views = SafeTensors::deserialize(&FILE).unwrap().tensors();
    let hash = |views: &[(String, TensorView)]| {
        let bytes = safetensors::serialize(views.iter().map(|(name, view)| (name, view)), None).unwrap();
        blake3::hash(&bytes).to_hex()
    };
    let text = SafeTensors::read_metadata(&FILE).unwrap().1.metadata().as_ref().unwrap()["state"].clone();
    let old = hash(&views);
    change(&mut views);
    let text = String::from_utf8(resealed(&text.replace(old.as_str(), hash(&views).as_str()))).unwrap();
    safetensors::serialize(views, Some(HashMap::from([("state".to_owned(), text)]))).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    #[test]
    fn all_comes_back_to_the_bit(state in states()) {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("state.safetensors");
        state.save(&file).unwrap();
        prop_assert_eq!(bits(&TrainingState::load(&file).unwrap()), bits(&state));
    }

    /// A flip may leave the meaning of the header as it is: then the same state comes back.
    #[test]
    fn flipped_bytes_are_found(place in 0.0..1.0_f64, mask in 1..=255_u8) {
        let mut bytes = FILE.clone();
        let place = (place * bytes.len() as f64) as usize;
        bytes[place] ^= mask;
        if let Ok(state) = load(&bytes) {
            prop_assert_eq!(bits(&state), bits(&small()));
        }
    }

    #[test]
    fn cut_files_are_found(place in 0.0..1.0_f64) {
        let length = (place * FILE.len() as f64) as usize;
        prop_assert!(load(&FILE[..length]).is_err());
    }
}

#[test]
fn mistakes_are_named() {
    let mut bytes = FILE.clone();
    *bytes.last_mut().unwrap() ^= 1;
    let message = load(&bytes).unwrap_err();
    assert!(message.contains("tensors_blake3 = ") && message.contains("the file is damaged"), "{message}");

    assert_eq!(bits(&load(&rewritten(|_| ())).unwrap()), bits(&small()));
    let eight = || TensorView::new(Dtype::F64, vec![1], &[0; 8]).unwrap();
    let cases: [(&str, &str, &str); 4] = [
        ("tensor.parameters", "tensor.parameters", "tensor.parameters = F64, but it must be F32"),
        ("counter.step", "counter.step", "counter.step = F64, but it must be U64"),
        ("row.0", "row.7", "row.0 = missing, but it must be a tensor of F64"),
        ("row.0", "other", "other = there, but it must be a known tensor"),
    ];
    for (old, new, expected) in cases {
        let bytes = rewritten(|views| {
            views.retain(|(name, _)| name != old);
            views.push((new.to_owned(), eight()));
        });
        let message = load(&bytes).unwrap_err();
        assert!(message.contains(expected), "{message}");
    }
    let newer = String::from_utf8_lossy(&FILE).replace("schema_version = 1", "schema_version = 2");
    assert_ne!(newer.as_bytes(), &FILE[..]);
    let place = FILE.windows(18).position(|window| window == b"schema_version = 1").unwrap();
    let mut bytes = FILE.clone();
    bytes[place + 17] = b'2';
    let message = load(&bytes).unwrap_err();
    assert!(message.contains("schema_version = 2, but it must be 1 (a newer program has written it)"), "{message}");

    let without = safetensors::serialize(SafeTensors::deserialize(&FILE).unwrap().tensors(), None).unwrap();
    let message = load(&without).unwrap_err();
    assert!(message.contains("keys of metadata = {}, but it must be {\"state\"}"), "{message}");
}

#[test]
fn the_first_setting_that_differs_is_named() {
    let (state, file) = (small(), Path::new("run.state"));
    let refused =
        |settings: &[(&str, String)]| state.check_fingerprint(file, &named(settings)).unwrap_err().to_string();
    state.check_fingerprint(file, &state.fingerprint).unwrap();
    assert_eq!(
        refused(&[("loss", "energy".to_owned()), ("seed", "8".to_owned())]),
        "run.state: fingerprint.seed = \"7\", but it must be \"8\" as now set: training goes on with the settings that it \
         began with"
    );
    assert!(refused(&[("seed", "8".to_owned())]).contains("fingerprint.loss = \"energy\", but it must be missing"));
    let message = refused(&[("batch", "3".to_owned()), ("seed", "8".to_owned())]);
    assert!(message.contains("fingerprint.batch = missing, but it must be \"3\""), "{message}");
}

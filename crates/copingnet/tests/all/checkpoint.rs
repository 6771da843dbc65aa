//! Checkpoints come back to the bit, and whatever is done to their files gives one error that names a file.

use std::sync::LazyLock;

use crate::files::{leg, resealed, small};
use copingnet::{Checkpoint, Features, Head, Weights};
use proptest::prelude::*;
use safetensors::tensor::{Dtype, SafeTensors, TensorView};

const CARD: &str = "small.toml";
const WEIGHTS: &str = "small.safetensors";

/// Card and weights of a small checkpoint.
static FILES: LazyLock<[Vec<u8>; 2]> = LazyLock::new(|| saved(&small(Features::BodyFrame)));

fn saved(checkpoint: &Checkpoint) -> [Vec<u8>; 2] {
    let directory = tempfile::tempdir().unwrap();
    checkpoint.save(&directory.path().join("small")).unwrap();
    [CARD, WEIGHTS].map(|name| std::fs::read(directory.path().join(name)).unwrap())
}

fn load([card, weights]: &[Vec<u8>; 2]) -> Result<Checkpoint, String> {
    Checkpoint::from_bytes("small", card, weights).map_err(|error| error.to_string())
}

/// The error is one line that begins with the name of a file.
fn is_clear(message: &str) -> bool {
    (message.starts_with(CARD) || message.starts_with(WEIGHTS)) && !message.contains(char::is_control)
}

/// The card with the hash of these weights, and its own checksum made good.
fn card_of(weights: &[u8]) -> Vec<u8> {
    let (old, new) = (blake3::hash(&FILES[1]).to_hex(), blake3::hash(weights).to_hex());
    resealed(&String::from_utf8(FILES[0].clone()).unwrap().replace(old.as_str(), new.as_str()))
}

/// Bits of all numbers that are not whole.
fn bits(checkpoint: &Checkpoint) -> (Vec<u32>, Vec<u64>) {
    let whitening = checkpoint.encoding.whitening.all().into_iter().flat_map(|w| w.shift.iter().chain(&w.scale));
    let singles = checkpoint.weights.values().iter().chain(whitening).map(|x| x.to_bits()).collect();
    let (norms, training) = (checkpoint.encoding.norms, &checkpoint.card.training);
    let mut doubles = vec![norms.dx, norms.dphi, norms.dlambda_stretch, norms.dlambda_bend];
    doubles.extend([training.learning_rate, training.seconds]);
    doubles.extend(checkpoint.card.measured.iter().flat_map(|m| [m.tolerance, m.ratio]));
    (singles, doubles.iter().map(|x| x.to_bits()).collect())
}

/// Any finite number, not only those of ordinary size.
fn single() -> impl Strategy<Value = f32> {
    any::<u32>().prop_map(f32::from_bits).prop_filter("finite", |x| x.is_finite())
}

/// Any finite number above 0.
fn positive() -> impl Strategy<Value = f64> {
    (1..f64::INFINITY.to_bits()).prop_map(f64::from_bits)
}

fn checkpoints() -> impl Strategy<Value = Checkpoint> {
    let sizes = (0..3_usize, 1..4_usize, 1..6_usize, 0..3_usize);
    let numbers = prop::collection::vec(positive(), 8);
    let kinds = prop::sample::select(vec![
        (Features::Paper, Head::Full),
        (Features::BodyFrame, Head::Full),
        (Features::BodyFrame, Head::Semi),
        (Features::History, Head::Turns),
    ]);
    let texts = prop::collection::vec(any::<String>(), 4);
    let values = prop::collection::vec(single(), 50);
    (sizes, kinds, numbers, texts, values, 0..i64::MAX as u64).prop_map(
        |(sizes, (features, head), numbers, texts, values, seed)| {
            let mut checkpoint = small(features);
            let mut config = *checkpoint.weights.config();
            (config.gn_blocks, config.mlp_layers, config.width, config.scans) = sizes;
            checkpoint.encoding.head = head;
            checkpoint.weights = Weights::zeros(features.configure(head, config));
            let mut values = values.into_iter().cycle();
            checkpoint.weights.values_mut().fill_with(|| values.next().unwrap());
            checkpoint.encoding.whitening.edges.shift.fill_with(|| values.next().unwrap());
            let (norms, card) = (&mut checkpoint.encoding.norms, &mut checkpoint.card);
            [norms.dx, norms.dphi, norms.dlambda_stretch, norms.dlambda_bend] = numbers[..4].try_into().unwrap();
            [card.training.learning_rate, card.training.seconds] = numbers[4..6].try_into().unwrap();
            [card.measured[0].tolerance, card.measured[0].ratio] = numbers[6..].try_into().unwrap();
            let [scenario, recipe, command, revision] = <[String; 4]>::try_from(texts).unwrap();
            (card.scenario, card.recipe, card.training.command) = (scenario, recipe, command);
            (card.git_revision, card.training.seed) = (Some(revision), seed);
            checkpoint
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    #[test]
    fn all_comes_back_to_the_bit(checkpoint in checkpoints()) {
        let directory = tempfile::tempdir().unwrap();
        checkpoint.save(&directory.path().join("any-1.5")).unwrap();
        for path in ["any-1.5", "any-1.5.toml", "any-1.5.safetensors"] {
            let loaded = Checkpoint::load(&directory.path().join(path)).unwrap();
            prop_assert_eq!(bits(&loaded), bits(&checkpoint));
            prop_assert_eq!(&loaded, &checkpoint);
        }
        // The same checkpoint makes the same files.
        let files = ["toml", "safetensors"].map(|end| std::fs::read(directory.path().join(format!("any-1.5.{end}"))));
        prop_assert!(files.map(Result::unwrap) == saved(&checkpoint));
    }

    #[test]
    fn flipped_bytes_are_found(which in 0..2_usize, place in 0.0..1.0_f64, mask in 1..=255_u8) {
        let mut files = FILES.clone();
        let bytes = &mut files[which];
        let place = (place * bytes.len() as f64) as usize;
        bytes[place] ^= mask;
        let message = load(&files).unwrap_err();
        prop_assert!(is_clear(&message) && message.starts_with([CARD, WEIGHTS][which]), "{}", message);
    }

    #[test]
    fn cut_files_are_found(which in 0..2_usize, place in 0.0..1.0_f64) {
        let mut files = FILES.clone();
        let length = (place * files[which].len() as f64) as usize;
        files[which].truncate(length);
        let message = load(&files).unwrap_err();
        prop_assert!(is_clear(&message) && message.starts_with([CARD, WEIGHTS][which]), "{}", message);
    }

    /// As a foreign program might write it: the hashes fit, the contents need not.
    #[test]
    fn weights_with_good_hashes_and_bad_contents_do_not_panic(
        flips in prop::collection::vec((0.0..1.0_f64, any::<u8>()), 1..4),
        in_header in any::<bool>(),
        cut in prop::option::of(0.0..1.0_f64),
    ) {
        let mut weights = FILES[1].clone();
        let length = if in_header { 2000.min(weights.len()) } else { weights.len() };
        for (place, value) in flips {
            weights[(place * length as f64) as usize] = value;
        }
        if let Some(cut) = cut {
            weights.truncate((cut * weights.len() as f64) as usize);
        }
        match load(&[card_of(&weights), weights]) {
            Ok(loaded) => prop_assert!(loaded.weights.values().iter().all(|x| x.is_finite())),
            Err(message) => prop_assert!(is_clear(&message), "{}", message),
        }
    }

    #[test]
    fn cards_with_other_numbers_do_not_panic(pick in any::<prop::sample::Index>(), number in any::<i64>()) {
        let text = String::from_utf8(FILES[0].clone()).unwrap();
        let lines: Vec<&str> = text.lines().filter(|line| line.contains(" = ")).collect();
        let line = lines[1 + pick.index(lines.len() - 1)];
        let key = line.split_once(" = ").unwrap().0;
        let card = resealed(&text.replacen(line, &format!("{key} = {number}"), 1));
        if let Err(message) = load(&[card, FILES[1].clone()]) {
            prop_assert!(is_clear(&message), "{}", message);
        }
    }
}

#[test]
fn mistakes_in_the_card_are_named() {
    let text = String::from_utf8(FILES[0].clone()).unwrap();
    let cases = [
        ("schema_version = 1", "schema_version = 2", "schema_version = 2, but it must be 1 (a newer program has"),
        ("schema_version = 1", "version = 1", "schema_version = missing, but it must be 1"),
        ("seed = 7", "sead = 7", "`sead = 7`: unknown field `sead`"),
        ("seed = 7", "seed = ", ": `seed = `: "),
        ("recipe = \"best\"\n", "", "missing field `recipe`"),
        ("\"body-frame\"", "\"body\"", "unknown variant `body`, expected one of `paper`, `body-frame`, `history`"),
        ("\"body-frame\"", "\"paper\"", "head = \"semi\", but it must be \"full\" with features \"paper\""),
        ("head = \"semi\"", "head = \"full\"", "network.node_outputs = 3, but it must be 6, by features and head"),
        ("edge_inputs = 27", "edge_inputs = 26", "network.edge_inputs = 26, but it must be 27, by features and head"),
        ("width = 4", "width = 4000000000", "network.width = 4000000000, but it must be 1 to 4096"),
        ("width = 4", "width = 4096", "encoder.node.0.weight = F32 [16, 4], but it must be F32 [16, 4096]"),
        ("gn_blocks = 1", "gn_blocks = 65", "network.gn_blocks = 65, but it must be 0 to 64"),
        ("gn_blocks = 1", "gn_blocks = 64", "block.1.edge.0.weight = missing, but it must be F32 [12, 4]"),
        ("gn_blocks = 1", "gn_blocks = 0", "block.0.edge.0.bias = there, but it must be a known tensor"),
        ("mlp_layers = 2", "mlp_layers = 0", "network.mlp_layers = 0, but it must be 1 to 64"),
        ("scans = 1", "scans = 5000", "network.scans = 5000, but it must be 0 to 4096"),
        ("dx_m = ", "dx_m = -", "norms.dx_m = -0.1, but it must be finite and >= 0"),
        ("dphi_rad = 0.2", "dphi_rad = nan", "norms.dphi_rad = NaN, but it must be finite and >= 0"),
        ("learning_rate = 0.001", "learning_rate = 0.0", "training.learning_rate = 0, but it must be finite and > 0"),
        ("seconds = 100.0", "seconds = -1.0", "before[0].training.seconds = -1, but it must be finite and >= 0"),
        ("ratio = 0.5", "ratio = inf", "measured[0].ratio = inf, but it must be finite and >= 0"),
        (
            "bending = \"paper\"",
            "bending = \"rest-rotation\"",
            "simulated.bending = \"rest-rotation\", but it must be \"paper\": no",
        ),
        ("\"euler\"", "\"bdf2\"", "simulated.integrator = \"bdf2\", but it must be \"euler\": no guess knows another"),
        ("dt_s = [0.02, ", "dt_s = [0.2, ", "simulated.dt_s = [0.2, 0.1], but it must be the shortest and the longest"),
        ("dt_s = [0.02, ", "dt_s = [0.0, ", "simulated.dt_s = [0.0, 0.1], but it must be the shortest and the longest"),
        ("data_blake3 = \"", "data_blake3 = \"x", ", but it must be 64 hexadecimal digits"),
    ];
    for (old, new, expected) in cases {
        assert!(text.contains(old), "{old} in {text}");
        let message = load(&[resealed(&text.replacen(old, new, 1)), FILES[1].clone()]).unwrap_err();
        assert!(is_clear(&message) && message.contains(expected), "{message}");
    }
    // An older card does not say it.
    let simulated = "[simulated]\nbending = \"paper\"\nintegrator = \"euler\"\ndt_s = [0.02, 0.1]\n\n";
    let older = load(&[resealed(&text.replace(simulated, "")), FILES[1].clone()]).unwrap();
    assert!(text.contains(simulated) && older.card.simulated.is_none(), "{text}");
    // Not resealed: a value that is allowed but was not written.
    let message = load(&[text.replacen("seed = 7", "seed = 8", 1).into_bytes(), FILES[1].clone()]).unwrap_err();
    assert!(message.starts_with("small.toml: checksum = "), "{message}");
}

#[test]
fn mistakes_in_the_weights_are_named() {
    let views: Vec<(String, TensorView)> = SafeTensors::deserialize(&FILES[1]).unwrap().tensors();
    let with = |name: &str, view: Option<TensorView>| {
        let kept = views.iter().filter(|(own, _)| own != name).map(|(own, view)| (own.as_str(), view.clone()));
        let weights = safetensors::serialize(kept.chain(view.map(|view| (name, view))), None).unwrap();
        load(&[card_of(&weights), weights]).unwrap_err()
    };
    let zeros = [0; 16];
    let nan: Vec<u8> = [0.0, f32::NAN, 0.0].iter().flat_map(|x: &f32| x.to_le_bytes()).collect();
    let view = |dtype, shape: &[usize], bytes| Some(TensorView::new(dtype, shape.to_vec(), bytes).unwrap());
    // Of the semi-implicit head: 3 outputs.
    let bias = "decoder.edge.1.bias";
    let cases = [
        (bias, None, "decoder.edge.1.bias = missing, but it must be F32 [3]"),
        (bias, view(Dtype::F32, &[4], &zeros), "decoder.edge.1.bias = F32 [4], but it must be F32 [3]"),
        (bias, view(Dtype::F32, &[1, 3], &nan), "decoder.edge.1.bias = F32 [1, 3], but it must be F32 [3]"),
        (bias, view(Dtype::F16, &[3], &zeros[..6]), "decoder.edge.1.bias = F16 [3], but it must be F32 [3]"),
        (bias, view(Dtype::F32, &[3], &nan), "decoder.edge.1.bias[1] = NaN, but it must be finite"),
        ("whitening.edges.shift", None, "whitening.edges.shift = missing, but it must be F32 [18]"),
        ("another", view(Dtype::F32, &[4], &zeros), "another = there, but it must be a known tensor"),
    ];
    for (name, view, expected) in cases {
        let message = with(name, view);
        assert!(message.starts_with(WEIGHTS) && is_clear(&message) && message.contains(expected), "{message}");
    }
    // A header of sizes that no memory has.
    let header = br#"{"a":{"dtype":"F32","shape":[4294967296,4294967296],"data_offsets":[0,16]}}"#;
    let weights = [&(header.len() as u64).to_le_bytes()[..], header, &zeros].concat();
    let message = load(&[card_of(&weights), weights]).unwrap_err();
    assert!(message.starts_with("small.safetensors: header = "), "{message}");
}

#[test]
fn trainings_one_after_the_other_are_summed() {
    let mut card = small(Features::Paper).card;
    assert_eq!((card.trainings().count(), card.seconds()), (2, 112.5));
    card.before.push(leg(1.0));
    let legs = card.clone().into_legs("abc".to_owned());
    let seconds: Vec<f64> = legs.iter().map(|leg| leg.training.seconds).collect();
    assert_eq!(seconds, [100.0, 1.0, 12.5]);
    assert_eq!((legs[2].weights_blake3.as_str(), &legs[2].data_blake3), ("abc", &card.data_blake3));
}

#[test]
fn what_would_not_load_is_not_written() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("small");
    let mut infinite = small(Features::Paper);
    infinite.weights.values_mut()[0] = f32::INFINITY;
    let mut short = small(Features::Paper);
    short.encoding.whitening.nodes.shift.pop();
    let mut normless = small(Features::Paper);
    normless.encoding.norms.dlambda_bend = 0.0;
    let mut seeded = small(Features::Paper);
    seeded.card.training.seed = u64::MAX;
    let cases = [
        (infinite, "small.safetensors: encoder.node.0.weight[0] = inf, but it must be finite"),
        (short, "small.safetensors: whitening.nodes.shift = F32 [6], but it must be F32 [7]"),
        (normless, "small.toml: norms.dlambda_bend_n_m2_s2 = 0, but it must be finite and > 0"),
        (seeded, "small.toml: training.seed = 18446744073709551615, but it must be at most 9223372036854775807"),
    ];
    for (checkpoint, expected) in cases {
        let message = checkpoint.save(&path).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    }
    assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 0);
}

#[test]
fn files_must_be_there_and_belong_together() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("small");
    let message = || Checkpoint::load(&path).unwrap_err().to_string();
    assert!(message().starts_with("cannot read ") && message().contains(CARD), "{}", message());
    std::fs::write(directory.path().join(CARD), &FILES[0]).unwrap();
    assert!(message().starts_with("cannot read ") && message().contains(WEIGHTS), "{}", message());
    // Cut off after the weights of another network.
    let mut other = small(Features::BodyFrame);
    other.weights.values_mut()[3] += 1.0;
    std::fs::write(directory.path().join(WEIGHTS), &saved(&other)[1]).unwrap();
    assert!(message().contains("small.safetensors: blake3 = "), "{}", message());
    assert!(message().contains("small.toml: it is damaged or another one"), "{}", message());
    other.save(&path).unwrap();
    assert_eq!(Checkpoint::load(&path).unwrap(), other);

    let message = other.save(&directory.path().join("nowhere/small")).unwrap_err().to_string();
    assert!(message.starts_with("cannot write ") && message.contains("nowhere/small.safetensors"), "{message}");
}

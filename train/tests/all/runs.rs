//! The program as a user runs it: kept states, the same bits, one clear error for every mistake.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;

use copingnet::Checkpoint;
use tempfile::TempDir;

/// The paper's data set of rods, made once for all tests.
fn data() -> &'static Path {
    static DATA: OnceLock<TempDir> = OnceLock::new();
    let directory = DATA.get_or_init(|| {
        let directory = tempfile::tempdir().unwrap();
        let status = train(&["data", "--data", directory.path().to_str().unwrap()]).status;
        assert!(status.success());
        directory
    });
    directory.path()
}

fn train(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_train")).args(arguments).output().unwrap()
}

/// A small training of three epochs on `data`.
fn small(out: &Path) -> Vec<String> {
    let arguments = ["--width", "4", "--gn-blocks", "1", "--epochs", "3", "--measure-every", "1", "--data"];
    let mut arguments: Vec<String> = arguments.map(str::to_owned).into();
    arguments.extend([data().to_str().unwrap().to_owned(), "--out".to_owned(), out.to_str().unwrap().to_owned()]);
    arguments
}

fn run(out: &Path, more: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_train")).args(small(out)).args(more).output().unwrap()
}

fn weights(out: &Path) -> Vec<u8> {
    std::fs::read(ending(out, "safetensors")).unwrap()
}

fn ending(out: &Path, ending: &str) -> PathBuf {
    PathBuf::from(format!("{}.{ending}", out.display()))
}

fn complaint(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    String::from_utf8(output.stderr.clone()).unwrap()
}

#[test]
fn a_training_that_was_killed_goes_on_to_the_same_bits() {
    let directory = tempfile::tempdir().unwrap();
    let (whole, killed) = (directory.path().join("whole"), directory.path().join("killed"));
    assert!(run(&whole, &[]).status.success());
    let checkpoint = Checkpoint::load(&whole).unwrap();
    assert_eq!((checkpoint.card.scenario.as_str(), checkpoint.card.recipe.as_str()), ("rod", "paper"));
    assert!(ending(&whole, "csv").exists() && ending(&whole, "svg").exists() && !ending(&whole, "state").exists());

    let mut child = Command::new(env!("CARGO_BIN_EXE_train"));
    let mut child = child.args(small(&killed)).stdout(Stdio::piped()).spawn().unwrap();
    let lines = BufReader::new(child.stdout.take().unwrap()).lines();
    // The first row of ratios is printed after its state is kept.
    for line in lines {
        if line.unwrap().trim_start().starts_with("1 ") {
            break;
        }
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let state = ending(&killed, "state");
    assert!(state.exists());

    let again = complaint(&run(&killed, &[]));
    assert!(again.contains("--resume") && again.contains("killed.state"), "{again}");
    let other = complaint(&run(&killed, &["--resume", "--seed", "1"]));
    assert!(other.contains("killed.state") && other.contains("seed"), "{other}");
    let output = run(&killed, &["--resume", "--threads", "1"]);
    assert!(output.status.success(), "{output:?}");
    assert_eq!(weights(&killed), weights(&whole));
    assert!(!state.exists());
}

#[test]
fn a_training_begins_with_the_weights_of_another() {
    let directory = tempfile::tempdir().unwrap();
    let [first, second] = ["first", "second"].map(|name| directory.path().join(name));
    assert!(run(&first, &[]).status.success());
    let from = first.to_str().unwrap();
    // Steps so small that nothing changes but the last bits.
    assert!(run(&second, &["--from", from, "--learning-rate", "1e-12"]).status.success());
    let [old, new] = [&first, &second].map(|out| Checkpoint::load(out).unwrap());
    assert!(old.weights.values().iter().zip(new.weights.values()).all(|(a, b)| (a - b).abs() < 1e-6));
    // The card tells of both trainings.
    assert!(old.card.before.is_empty() && old.card.training.steps.is_some());
    assert_eq!(new.card.trainings().next(), Some(&old.card.training));
    assert_eq!(new.card.seconds(), old.card.training.seconds + new.card.training.seconds);
    let message = complaint(&run(&directory.path().join("third"), &["--from", from, "--mlp-layers", "3"]));
    assert!(message.contains("--from") && message.contains("sizes"), "{message}");
}

#[test]
fn starts_of_whole_steps_are_learned_to_the_same_bits_on_any_number_of_threads() {
    let directory = tempfile::tempdir().unwrap();
    let trained = |name: &str, threads: &str| {
        let out = directory.path().join(name);
        let size = ["--recipe", "step", "--width", "4", "--trajectories", "6", "--steps", "8"];
        let length = ["--epochs", "2", "--measure-every", "2", "--threads", threads, "--out", out.to_str().unwrap()];
        let output = train(&[&size[..], &length].concat());
        assert!(output.status.success(), "{output:?}");
        (Checkpoint::load(&out).unwrap(), weights(&out))
    };
    let ((one, bits), (other, same)) = (trained("one", "1"), trained("other", "2"));
    assert_eq!((one.card.recipe.as_str(), one.card.measured.len()), ("step", 6));
    assert_eq!((bits, one.card.data_blake3), (same, other.card.data_blake3));
}

#[test]
fn a_training_that_was_interrupted_loses_no_measurement() {
    let directory = tempfile::tempdir().unwrap();
    let (whole, stopped) = (directory.path().join("whole"), directory.path().join("stopped.toml"));
    // An epoch is one batch: it is complete when the signal is seen.
    let batch = ["--batch", "65536"];
    assert!(run(&whole, &batch).status.success());
    let mut child = Command::new(env!("CARGO_BIN_EXE_train"));
    let mut child = child.args(small(&stopped)).args(batch).stdout(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    while !lines.next().unwrap().unwrap().starts_with("epoch") {}
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    assert!(lines.last().unwrap().unwrap().contains("--resume"));
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(run(&stopped, &[batch[0], batch[1], "--resume"]).status.success());
    let stopped = stopped.with_extension("");
    assert_eq!(weights(&stopped), weights(&whole));
    let rows = |out: &Path| std::fs::read_to_string(ending(out, "csv")).unwrap().lines().count();
    assert_eq!((rows(&stopped), rows(&whole)), (4, 4));

    let message = complaint(&run(&whole, &batch));
    assert!(message.contains("--force") && message.contains("whole.toml"), "{message}");
    assert!(run(&whole, &[batch[0], batch[1], "--force"]).status.success());
    let message = complaint(&run(&directory.path().join("missing"), &["--resume"]));
    assert!(message.contains("--resume") && message.contains("missing.state"), "{message}");
}

#[test]
fn mistakes_get_one_error_that_says_what_is_allowed() {
    for (arguments, words) in [
        (&["--width", "0"][..], &["--width", "1..=1024"][..]),
        (&["--epochs", "many"], &["--epochs", "many"]),
        (&["--learning-rate", "-1"], &["--learning-rate", "> 0"]),
        (&["--scenario", "bush"], &["--scenario", "rod, helix, knot, tree"]),
        (&["--scenario", "knot", "--recipe", "step"], &["--recipe step needs", "not knot"]),
        (&["--scenario", "tree", "--recipe", "step"], &["--recipe step needs", "not tree"]),
        (&["--backend", "torch"], &["--backend", "ndarray"]),
        (&["data", "--shard", "3/3"], &["--shard", "n - 1"]),
        (&["--features", "paper", "--head", "semi"], &["--head semi", "body-frame"]),
        (&["--scenario", "knot", "--recipe", "best", "--head", "semi"], &["--head semi", "held at both ends"]),
        (&["--recipe", "step", "--features", "paper"], &["--features and --head", "recipe is step"]),
        (&["--recipe", "step", "--data", "d"], &["--data d", "recipe step has no data set"]),
        (&["--recipe", "step", "--loss", "cg"], &["--loss cg", "use log or mse"]),
        (&["--quick", "--epochs", "3"], &["--quick", "--epochs"]),
        (&["--out", "trained/"], &["--out", "trained/rod"]),
    ] {
        let message = complaint(&train(arguments));
        assert!(words.iter().all(|word| message.contains(word)), "{arguments:?}: {message}");
    }
}

#[test]
fn a_damaged_state_or_data_set_is_found() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("net");
    std::fs::write(ending(&out, "state"), b"not a state").unwrap();
    let message = complaint(&run(&out, &["--resume"]));
    assert!(message.contains("net.state"), "{message}");

    let data = directory.path().join("data/rod");
    std::fs::create_dir_all(&data).unwrap();
    std::fs::write(data.join("manifest.toml"), "schema_version = 1\n").unwrap();
    let message = complaint(&train(&["--data", directory.path().join("data").to_str().unwrap()]));
    assert!(message.contains("--data") && message.contains("manifest.toml"), "{message}");
}

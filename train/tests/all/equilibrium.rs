//! `train equilibrium` as a user runs it: the same bits, kept states, one clear error for every mistake.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use equilibria::branched;
use equilibria::canonical::INPUTS;
use equilibria::learned::OUTPUTS;
use equilibria::network::Perceptron;

/// A small training of three epochs.
fn small(out: &Path, more: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_train"));
    command.args(["equilibrium", "--queries", "400", "--epochs", "3", "--width", "8", "--batch", "100"]);
    command.args(["--out", out.to_str().unwrap()]).args(more);
    command
}

/// Branched cables take the same way.
#[test]
fn branched_cables_are_learned_alike_on_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let [one, two] = ["one", "two"].map(|name| folder.path().join(name));
    let weights = [(&one, "1"), (&two, "2")].map(|(out, threads)| {
        let output = small(out, &["--cables", "branched", "--threads", threads]).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        std::fs::read(out).unwrap()
    });
    assert!(weights[0] == weights[1]);
    // Times are no part of the weights: they stand beside them.
    let card = std::fs::read_to_string(format!("{}.toml", one.display())).unwrap();
    let seconds = card.lines().find_map(|line| line.strip_prefix("core_seconds = ")).unwrap();
    assert!(seconds.parse::<f64>().unwrap() > 0.0, "{card}");
    assert!(Perceptron::from_bytes(&weights[0], branched::canonical::INPUTS, branched::learned::OUTPUTS).is_ok());
}

fn trained(out: &Path, more: &[&str]) -> Perceptron {
    let output = small(out, more).output().unwrap();
    assert!(output.status.success(), "{output:?}");
    network(out)
}

fn network(out: &Path) -> Perceptron {
    Perceptron::from_bytes(&std::fs::read(out).unwrap(), INPUTS, OUTPUTS).unwrap()
}

fn state(out: &Path) -> PathBuf {
    PathBuf::from(format!("{}.state", out.display()))
}

fn complaint(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    String::from_utf8(output.stderr.clone()).unwrap()
}

#[test]
fn a_seed_has_the_same_bits_on_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let [one, two, other] = ["one", "two", "other"].map(|name| folder.path().join(name));
    let first = trained(&one, &["--threads", "1"]);
    assert_eq!(first, trained(&two, &["--threads", "2"]));
    assert_ne!(first, trained(&other, &["--seed", "7"]));
    assert!(!state(&one).exists());
    let again = complaint(&small(&one, &[]).output().unwrap());
    assert!(again.contains("--force"), "{again}");
}

#[test]
fn a_training_that_was_killed_goes_on_to_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let [whole, killed] = ["whole", "killed"].map(|name| folder.path().join(name));
    let expected = trained(&whole, &[]);
    let mut child = small(&killed, &[]).stdout(Stdio::piped()).spawn().unwrap();
    // An epoch's row is printed after its state is kept.
    for line in BufReader::new(child.stdout.take().unwrap()).lines() {
        if line.unwrap().trim_start().starts_with("1 ") {
            break;
        }
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(state(&killed).exists() && !killed.exists());
    let again = complaint(&small(&killed, &[]).output().unwrap());
    assert!(again.contains("--resume"), "{again}");
    let other = complaint(&small(&killed, &["--resume", "--seed", "2"]).output().unwrap());
    assert!(other.contains("seed"), "{other}");
    assert_eq!(expected, trained(&killed, &["--resume"]));
    assert!(!state(&killed).exists());
}

//! The sweep as a user runs it: shards, cells that were cut off, tables, the files for clusters.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use tempfile::TempDir;

/// A folder with a small data set in it, and sweeps of five small networks on it.
struct Small {
    directory: TempDir,
}

/// Of all sweeps here.
const SMALL: [&str; 11] = [
    "sweep",
    "--quick",
    "--scenario=rod",
    "--seed=0",
    "--simulations=1",
    "--trajectories=4",
    "--steps=12",
    "--threads=1",
    "--batch=16",
    "--data",
    "data",
];

impl Small {
    fn new() -> Self {
        let small = Self { directory: tempfile::tempdir().unwrap() };
        let output = small.train(&["data", "--trajectories=4", "--steps=12", "--data=data"]);
        assert!(output.status.success(), "{output:?}");
        small
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_train"));
        command.current_dir(self.directory.path()).args(arguments);
        command
    }

    fn train(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().unwrap()
    }

    fn sweep(&self, more: &[&str]) -> Output {
        self.train(&[&SMALL[..], more].concat())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    /// Names of the files in a folder, with an ending.
    fn files(&self, folder: &str, ending: &str) -> Vec<String> {
        let Ok(entries) = std::fs::read_dir(self.path(folder)) else { return Vec::new() };
        let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
        let mut names: Vec<String> = names.filter(|name| name.ends_with(ending)).collect();
        names.sort();
        names
    }
}

fn stdout(output: &Output) -> String {
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn complaint(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    String::from_utf8(output.stderr.clone()).unwrap()
}

#[test]
fn shards_make_one_table_and_lost_cells_are_found() {
    let small = Small::new();
    let listed = stdout(&small.sweep(&["--epochs=1", "--out=a", "--dry-run"]));
    assert_eq!(listed.matches("to do").count(), 5, "{listed}");
    assert!(!small.path("a").exists());
    for shard in ["0/2", "1/2"] {
        let out = if shard == "0/2" { "--out=a" } else { "--out=b" };
        let text = stdout(&small.sweep(&["--epochs=1", out, "--shard", shard]));
        assert!(text.contains("left") && text.contains("node visits"), "{text}");
    }
    assert_eq!([small.files("a/cells", ".toml").len(), small.files("b/cells", ".toml").len()], [3, 2]);
    assert!(small.files("a/cells", ".toml").iter().all(|file| listed.contains(file.as_str())), "{listed}");

    let message = complaint(&small.train(&["sweep", "merge", "a"]));
    assert!(message.contains("2 of 5 cells are lost") && message.contains("--partial"), "{message}");
    stdout(&small.train(&["sweep", "merge", "a", "b", "--out=c"]));
    let summary = std::fs::read_to_string(small.path("c/summary.toml")).unwrap();
    // Free and planar, two preconditioners, two tolerances.
    assert_eq!(summary.matches("[[cells.outcome.rows]]").count(), 5 * 8, "{summary}");

    // What is done is not done again; what was lost is measured again, but not trained.
    let lost = small.path("a/cells").join(&small.files("a/cells", ".toml")[0]);
    let kept = small.path("kept.toml");
    std::fs::rename(&lost, &kept).unwrap();
    let text = stdout(&small.sweep(&["--epochs=1", "--out=a", "--shard=0/2"]));
    assert!(text.contains("1 of 3 cells to do") && !text.contains("epoch 1 of 1"), "{text}");
    let weights = |file: &Path| {
        let text = std::fs::read_to_string(file).unwrap();
        text.lines().find(|line| line.starts_with("weights_blake3")).unwrap().to_owned()
    };
    assert_eq!(weights(&lost), weights(&kept));
    assert!(complaint(&small.sweep(&["--epochs=2", "--out=a"])).contains("epochs = 1, not epochs = 2"));
}

#[test]
fn a_cell_that_was_cut_off_goes_on_to_the_same_weights() {
    let small = Small::new();
    let long = ["--epochs=600", "--shard=0/5"];
    stdout(&small.sweep(&[&long[..], &["--out=whole"]].concat()));
    let mut child = small.command(&[&SMALL[..], &long, &["--out=cut"]].concat());
    let mut child = child.stdout(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    while !lines.next().unwrap().unwrap().starts_with("  epoch 200 of 600") {}
    assert!(Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap().success());
    assert!(lines.last().unwrap().unwrap().contains("the same command goes on"));
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert_eq!((small.files("cut/training", ".state").len(), small.files("cut/cells", "").len()), (1, 0));
    let text = stdout(&small.sweep(&[&long[..], &["--out=cut"]].concat()));
    assert!(!text.contains("epoch 200 of 600") && text.contains("epoch 600 of 600"), "{text}");
    let weights = |out: &str| {
        let names = small.files(&format!("{out}/training"), ".safetensors");
        assert_eq!(names.len(), 1);
        std::fs::read(small.path(&format!("{out}/training/{}", names[0]))).unwrap()
    };
    assert!(weights("cut") == weights("whole"));
    assert_eq!(small.files("cut/cells", ""), small.files("whole/cells", ""));
}

#[test]
fn mistakes_get_one_error_that_names_the_flag() {
    let directory = tempfile::tempdir().unwrap();
    let small = Small { directory };
    for (arguments, words) in [
        (&["--shard", "2/2"][..], &["--shard", "n - 1"][..]),
        (&["--shard", "1"], &["--shard", "i/n"]),
        (&["--scenario", "rods"], &["--scenario", "rod"]),
        (&["--scenario", "rod,rod"], &["--scenario", "rod is given twice"]),
        (&["--seed", "0,0"], &["--seed", "0 is given twice"]),
        (&["--seed", "-1"], &["--seed"]),
        (&["--recipe", "step"], &["--recipe step", "paper or best"]),
        (&["--epochs", "0"], &["--epochs"]),
        (&["--simulations", "0"], &["--simulations"]),
        (&["--backend", "torch"], &["--backend", "ndarray"]),
        (&["--dry-run", "--data", "nowhere"], &["--data", "nowhere/rod"]),
        (&["merge"], &["<DIR>"]),
        (&["merge", "nowhere"], &["nowhere/sweep.toml"]),
    ] {
        let message = complaint(&small.train(&[&["sweep"][..], arguments].concat()));
        assert!(words.iter().all(|word| message.contains(word)), "{arguments:?}: {message}");
    }
    assert_eq!(std::fs::read_dir(small.directory.path()).unwrap().count(), 0);
}

/// A file of the folder `examples/cluster`.
fn example(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/cluster").join(name);
    std::fs::read_to_string(path).unwrap()
}

#[test]
#[cfg(unix)]
fn the_files_for_clusters_give_flags_that_the_program_takes() {
    let small = Small::new();
    let folder = Path::new(env!("CARGO_BIN_EXE_train")).parent().unwrap();
    let path = format!("{}:{}", folder.display(), std::env::var("PATH").unwrap());
    // The rods' small data set, on whatever this program can compute.
    let more = "--quick --scenario=rod --trajectories=4 --steps=12 --dry-run";

    let script = small.path("sweep.slurm");
    std::fs::write(&script, example("sweep.slurm")).unwrap();
    let slurm = |task: &str| {
        let mut command = Command::new("bash");
        command.current_dir(small.directory.path()).arg(&script).args(more.split(' ')).env("PATH", &path);
        command.envs([("SLURM_ARRAY_TASK_ID", task), ("SLURM_ARRAY_TASK_COUNT", "4"), ("SLURM_CPUS_PER_TASK", "1")]);
        command.envs([("DATA", "data"), ("OUT", "out"), ("BACKEND", "ndarray")]);
        command.output().unwrap()
    };
    assert_eq!(
        ["0", "1", "2", "3"].map(|task| stdout(&slurm(task)).matches("to do").count()).iter().sum::<usize>(),
        10
    );
    assert!(complaint(&slurm("4")).contains("--shard"));

    let yaml = example("sweep.yaml");
    let value = |key: &str| {
        let line = yaml.lines().find_map(|line| line.trim().strip_prefix(key)).unwrap();
        line.trim().trim_matches('"').to_owned()
    };
    let shards = value("completions:");
    assert_eq!((value("parallelism:"), value("value:")), (shards.clone(), shards.clone()));
    assert_eq!((value("completionMode:"), value("image:")), ("Indexed".to_owned(), "IMAGE".to_owned()));
    // The block below `- |`, as the shell gets it.
    let block = yaml.split_once("- |\n").unwrap().1.lines().take_while(|line| line.starts_with("              "));
    let block: Vec<&str> = block.map(str::trim).collect();
    let command = block.join("\n").replace("/share/", "").replace("flex", "ndarray");
    let pod = |index: &str| {
        let mut shell = Command::new("/bin/sh");
        shell.current_dir(small.directory.path()).args(["-euc", &format!("{command} {more}")]).env("PATH", &path);
        shell.envs([("JOB_COMPLETION_INDEX", index), ("SHARDS", shards.as_str())]).output().unwrap()
    };
    assert!(stdout(&pod("0")).contains("to do"));
    assert!(complaint(&pod("8")).contains("--shard"));
}

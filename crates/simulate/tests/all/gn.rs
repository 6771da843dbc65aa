//! COPINGNet's guesses on the command line: networks built in and from files, right, wrong and damaged ones.

use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Output, Stdio};

#[cfg(unix)]
use crate::common::interrupt;
use crate::common::{builtin_names, json, learned_from, nulls, run, simulate, texts};
use copingnet::{Card, Checkpoint, Encoding, Features, Head, NetworkConfig, Training, Weights};
use graph::Norms;
use serde_json::Value;

const NAMES: [&str; 2] = ["gn", "gn-best"];
/// Tolerances at which the motion hardly depends on the linear solver.
const EXACT: [&str; 4] = ["--linear-tolerance", "1e-10", "--tolerance", "1e-9"];

/// A checkpoint with random weights, which are then all multiplied by `scale`.
fn untrained(scenario: &str, guess: &str, scale: f32) -> Checkpoint {
    let (recipe, features, head, scans) = match guess {
        "gn" => ("paper", Features::Paper, Head::Full, 0),
        _ => ("best", Features::BodyFrame, Head::Semi, 2),
    };
    let sizes = features.configure(head, NetworkConfig { gn_blocks: 1, width: 8, scans, ..NetworkConfig::default() });
    let mut weights = Weights::random(sizes, 3);
    // Of all parameters: the last layers of linear outputs begin at zero, and a zero start is no wrong one.
    for (k, value) in weights.values_mut().iter_mut().enumerate() {
        *value = scale * (*value + 0.1 * (k as f32).sin());
    }
    Checkpoint {
        card: Card {
            program_version: "0.1.0".to_owned(),
            git_revision: None,
            scenario: scenario.to_owned(),
            recipe: recipe.to_owned(),
            data_blake3: None,
            simulated: None,
            training: Training {
                seed: 3,
                trajectories: None,
                steps: None,
                epochs: 0,
                batch: 1,
                loss: "none".to_owned(),
                learning_rate: 1e-3,
                schedule: "none".to_owned(),
                backend: "none".to_owned(),
                threads: 1,
                seconds: 0.0,
                command: "none".to_owned(),
            },
            before: vec![],
            measured: vec![],
        },
        encoding: Encoding {
            features,
            head,
            norms: Norms { dx: 0.1, dphi: 0.1, dlambda_stretch: 1e-3, dlambda_bend: 1e-3 },
            whitening: features.unwhitened(),
        },
        weights,
    }
}

fn count(summary: &Value, key: &str) -> u64 {
    summary["work"][key].as_u64().unwrap_or_else(|| panic!("{key}"))
}

/// Positions of the last frame.
fn positions(out: &Path) -> Vec<[f64; 3]> {
    let trajectory = export::read_trajectory(&out.join("trajectory.safetensors")).expect("a trajectory");
    trajectory.states.last().expect("frames").positions.iter().map(|x| [x.x, x.y, x.z]).collect()
}

fn farthest(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().flatten().zip(b.iter().flatten()).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
}

#[test]
fn without_arguments_it_starts_from_a_network_and_says_what_that_is_worth() {
    // In a folder without checkpoints.
    let folder = tempfile::tempdir().expect("a folder");
    let output = simulate(&[]).current_dir(&folder).output().expect("the program starts");
    let (code, out, err) = texts(&output);
    assert_eq!((code, err), (Some(0), ""));
    let lines: Vec<&str> = out.lines().collect();
    assert_eq!(lines[0], "simulate --formulation xpbd --solver cg --guess gn-best");
    assert!(lines[1].starts_with("gn-best: recipe best, scenario rod, ") && lines[1].ends_with(", built in"), "{out}");
    assert_eq!(lines[2], "bending-rod: 30 segments, 29 joints, 100 steps of 0.02 s");
    assert_eq!(lines[3], "formulation xpbd, integrator euler, solver cg-block-jacobi, guess gn-best in the plane");
    assert!(lines[4].starts_with("converged: 100 steps, 2 s of motion, in "), "{out}");
    // The blank: the network's guess as it is has a row beside the one that is kept in the plane.
    let networks = ["cg from COPINGNet (gn) ", "cg from COPINGNet (gn), planar ", "cg from COPINGNet (gn-best) "];
    for row in ["direct", "cg from zero", "cg from Fischer's"].into_iter().chain(networks) {
        assert!(lines.iter().any(|line| line.trim().starts_with(row) && line.trim().ends_with("converged")), "{out}");
    }
    assert!(out.contains("Fastest here: ") && !out.contains("NaN") && !out.contains("inf"), "{out}");
    assert!(lines[lines.len() - 2].starts_with("Next: `simulate --view` "), "{out}");
    // Warnings are one line each, however long.
    let fits = |line: &&str| line.starts_with("warning: ") || line.trim_end().chars().count() <= 120;
    assert!(lines.iter().all(fits), "{out}");
    assert_eq!(fs::read_dir(&folder).expect("a folder").count(), 0);
}

/// Ctrl-C while the other ways run: the table of the steps so far, said to be that.
#[test]
#[cfg(unix)]
fn an_interrupted_demonstration_says_how_far_it_came() {
    // Fast as it is, it may have ended before the signal arrives.
    for _ in 0..50 {
        let mut child = simulate(&[]).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts");
        let mut stdout = BufReader::new(child.stdout.take().expect("a pipe"));
        let mut out = String::new();
        // The last line of the first run.
        while !out.contains("energy: ") {
            assert!(stdout.read_line(&mut out).expect("a line") > 0, "{out}");
        }
        interrupt(child.id());
        stdout.read_to_string(&mut out).expect("the rest");
        let output = child.wait_with_output().expect("it ends");
        assert_eq!(texts(&output).2, "", "{out}");
        assert!(out.contains("Fastest here: ") && !out.contains("NaN"), "{out}");
        if out.contains("\nStopped after ") {
            assert!(output.status.code() == Some(130) && out.contains(" of 100 steps: what follows"), "{out}");
            return;
        }
    }
    panic!("never interrupted");
}

/// Whether an entry of a report names the built-in network of a scenario, with the hash that stands in its card.
fn names_its_network(entry: &Value, scenario: &str) -> bool {
    let network = entry["network"].as_str().expect("a network");
    let recipe = if entry["guess"].as_str().expect("a guess").starts_with("gn-best") { "best" } else { "paper" };
    let card = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../checkpoints/{scenario}-{recipe}.toml"));
    let hash = entry["weights_blake3"].as_str().expect("a hash");
    network.starts_with(&format!("recipe {recipe}, scenario {scenario}, "))
        && network.ends_with(", built in")
        && fs::read_to_string(card).expect("a card").contains(&format!("weights_blake3 = \"{hash}\""))
}

#[test]
fn networks_that_are_built_in_start_the_first_solve_of_every_step() {
    for name in NAMES {
        for (scene, scenario) in [("bending-rod", "rod"), ("helix", "helix")] {
            let summary = json(&[scene, "--guess", name, "--solver", "cg", "--steps", "5"]);
            assert_eq!(nulls(&summary, ""), [""; 0]);
            assert_eq!((&summary["guess"], &summary["status"]), (&name.into(), &"converged".into()));
            assert_eq!(summary["planar"], name == "gn-best" && scene == "bending-rod");
            assert!(names_its_network(&summary, scenario), "{summary}");
            assert_eq!((count(&summary, "guesses_used"), count(&summary, "guesses_dropped")), (5, 0));
            let output = run(&[scene, "--guess", name, "--solver", "cg", "--steps", "1"]);
            let (_, out, _) = texts(&output);
            assert!(out.starts_with(&format!("{name}: recipe ")) && out.contains(&format!("scenario {scenario}, ")));
        }
    }
    let planar = json(&["--guess", "gn", "--planar", "--solver", "cg", "--steps", "2"]);
    assert_eq!(planar["planar"], true);
    let output = run(&["helix", "--guess", "gn", "--scenario", "rod", "--solver", "cg", "--steps", "2"]);
    let (_, out, _) = texts(&output);
    let foreign =
        "gn learned from random scenes (rod), where nothing is like this scene: segments = 60.0, not 10.0 to 55.0";
    assert!(out.contains(foreign), "{out}");
}

#[test]
fn time_steps_that_no_network_has_seen_are_said_in_one_line() {
    let said = |dt: &str, more: &[&str]| {
        let flags = [&["--guess", "gn", "--solver", "cg", "--steps", "1", "--dt", dt][..], more].concat();
        let output = run(&flags);
        let (code, out, err) = texts(&output);
        assert_eq!((code, err), (Some(0), ""));
        let lines: Vec<&str> = out.lines().filter(|line| line.contains("time steps of")).collect();
        lines.join("\n")
    };
    let expected = |dt: &str| {
        format!(
            "gn learned from time steps of 0.02 s, but these are of {dt} s: its starts may cost more iterations than they save"
        )
    };
    assert_eq!([said("0.05", &[]), said("0.01", &[])], [expected("0.05"), expected("0.01")]);
    assert_eq!([said("0.02", &[]), said("0.05", &["--quiet"])], [""; 2]);
    // A card that does not say it is one of an older program.
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("untrained");
    untrained("rod", "gn", 0.0).save(&path).expect("a checkpoint");
    assert_eq!(said("0.05", &["--checkpoint", path.to_str().expect("UTF-8")]), "");
}

#[test]
fn what_no_network_has_seen_is_refused_with_what_its_card_says() {
    let output = run(&["strip", "--guess", "gn"]);
    let (code, out, err) = texts(&output);
    let expected = "error: --guess gn learned from the paper's rods (bending \"paper\", integrator euler, time steps of \
                    0.02 s), but strip has inner damping; take another guess\n";
    assert_eq!((code, out, err), (Some(2), "", expected));
}

#[test]
fn networks_that_are_built_in_are_trained_and_save_iterations() {
    let cell =
        ["--preconditioner", "block-jacobi", "--linear-tolerance", "1e-2", "--tolerance", "0.5", "--steps", "20"];
    for (scene, name, most) in
        [("bending-rod", "gn-best", 0.3), ("bending-rod", "gn", 0.6), ("helix", "gn-best", 0.9), ("helix", "gn", 0.95)]
    {
        let flags = [&[scene, "--formulation", "xpbd", "--solver", "cg"][..], &cell].concat();
        let iterations = |guess: &str| {
            let summary = json(&[&flags[..], &["--guess", guess]].concat());
            // One outer iteration a step: the one that the network starts.
            assert_eq!(count(&summary, "outer_iterations"), 20);
            count(&summary, "linear_iterations") as f64
        };
        let ratio = iterations(name) / iterations("zero");
        assert!(ratio < most, "{scene}, {name}: {ratio}");
        let output = run(&[scene, "--guess", name, "--solver", "cg", "--steps", "1"]);
        let (_, out, _) = texts(&output);
        assert!(!out.contains("untrained"), "{out}");
    }
}

#[test]
fn networks_take_every_scene() {
    // The two largest take conjugate gradients minutes.
    let is_taken = |name: &&str| !["tree", "long-chain"].contains(name) && learned_from(name);
    for scene in builtin_names().into_iter().filter(is_taken) {
        for name in NAMES {
            let flags = [scene, "--guess", name, "--solver", "cg", "--preconditioner", "jacobi", "--steps", "2"];
            let summary = json(&flags);
            assert_eq!(summary["status"], json(&[&flags[..1], &flags[3..]].concat())["status"], "{scene}, {name}");
        }
    }
}

#[test]
fn a_wrong_network_costs_time_and_no_accuracy() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    // To the default tolerances, and so exactly that a start cannot show in the motion.
    for (name, exactness) in [("plain", &[][..]), ("exact", &EXACT[..])] {
        let common = [&["--solver", "cg", "--steps", "20", "--formulation", "xpbd"][..], exactness].concat();
        let zero_out = path(name);
        let zero = json(&[&common[..], &["--guess", "zero", "--out", &zero_out]].concat());
        let right = positions(Path::new(&zero_out));
        for guess in NAMES {
            let mut worst = 0.0_f64;
            for scale in [0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 1000.0, 1e30] {
                let file = path(&format!("{name}-{guess}-{scale:e}"));
                let out = format!("{file}-out");
                untrained("rod", guess, scale).save(Path::new(&file)).expect("a checkpoint");
                let summary = json(&[&common[..], &["--guess", guess, "--checkpoint", &file, "--out", &out]].concat());
                assert_eq!(summary["status"], "converged", "{file}");
                let (used, dropped) = (count(&summary, "guesses_used"), count(&summary, "guesses_dropped"));
                assert_eq!(used + dropped, 20, "{file}");
                assert!(scale < 1e30 || dropped == 20, "{file}: {used} used");
                // What is dropped is a zero start, to the bit.
                assert!(dropped < 20 || summary["final_state_hash"] == zero["final_state_hash"], "{file}");
                let off = farthest(&positions(Path::new(&out)), &right);
                assert!(off < 1e-7, "{file}: {off:e} m off, {used} used");
                let ratio = count(&summary, "linear_iterations") as f64 / count(&zero, "linear_iterations") as f64;
                worst = worst.max(ratio);
            }
            assert!(worst > 1.0, "{guess}: {worst}");
        }
    }
}

#[test]
fn end_to_end_nothing_is_solved_and_the_summary_says_how_far_it_drifts() {
    for name in NAMES {
        let summary = json(&["--guess", name, "--end-to-end=2", "--formulation", "xpbd", "--steps", "3"]);
        assert_eq!((&summary["solver"], &summary["end_to_end"]), (&"none".into(), &2.into()), "{name}");
        assert!(count(&summary, "linear_iterations") == 0 && count(&summary, "guesses_used") >= 3, "{name}");
        assert!(summary["length_drift"].as_f64().is_some_and(|drift| drift > 0.0), "{name}");
    }
}

#[test]
fn checkpoints_of_ones_own() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let error = |arguments: &[&str]| {
        let output: Output = run(arguments);
        let (code, out, err) = texts(&output);
        assert_eq!((code, out, err.lines().count()), (Some(2), "", 1), "{arguments:?}: {err}");
        err.trim_end().to_owned()
    };
    let with = |file: &str, more: &[&str]| {
        let all = [&["--solver", "cg", "--steps", "2", "--checkpoint", file], more].concat();
        error(&all)
    };
    let own = path("own");
    untrained("rod", "gn-best", 1.0).save(Path::new(&own)).expect("a checkpoint");
    let first =
        [&["--solver", "cg", "--steps", "2", "--guess", "gn-best", "--checkpoint"], &[own.as_str()][..]].concat();
    let output = run(&first);
    let (code, out, _) = texts(&output);
    assert!(code == Some(0) && out.starts_with("gn-best: recipe best, scenario rod, untrained, "), "{out}");

    // What does not fit.
    assert_eq!(
        with(&own, &["--guess", "gn"]),
        format!(
            "error: --checkpoint {own}: recipe = \"best\", but it must be paper (gn takes paper, gn-best best, gn-step step)"
        )
    );
    assert_eq!(
        with(&own, &["helix", "--guess", "gn-best"]),
        format!("error: --checkpoint {own}: scenario = \"rod\", but it must be helix unless --scenario says otherwise")
    );
    let forced = [&first[..], &["helix", "--scenario", "rod"]].concat();
    assert_eq!(run(&forced).status.code(), Some(0));
    assert_eq!(
        with(&own, &["--guess", "fischer"]),
        "error: --checkpoint needs the guess gn, gn-best or gn-step, but asked for: fischer"
    );

    // What is no checkpoint.
    let missing = path("missing");
    assert_eq!(
        with(&missing, &["--guess", "gn"]),
        format!("error: --checkpoint: cannot read {missing}.toml: No such file or directory (os error 2)")
    );
    let weights = format!("{own}.safetensors");
    let mut bytes = fs::read(&weights).expect("a file");
    let last = bytes.len() - 1;
    bytes[last] ^= 1;
    fs::write(&weights, &bytes).expect("a file");
    let found = with(&own, &["--guess", "gn-best"]);
    assert!(found.starts_with(&format!("error: --checkpoint: {weights}: blake3 = ")), "{found}");
    assert!(found.ends_with("it is damaged or another one"), "{found}");
    let card = format!("{own}.toml");
    let text = fs::read_to_string(&card).expect("a file");
    fs::write(&card, text.replace("epochs = 0", "epochs = 300")).expect("a file");
    let found = with(&own, &["--guess", "gn-best"]);
    assert!(found.starts_with(&format!("error: --checkpoint: {card}: checksum = ")), "{found}");
}

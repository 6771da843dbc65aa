//! Runs that go well: what they print, count and repeat.

use std::fs;

use crate::common::{builtin_names, json, many_rods, nulls, run, simulate, texts};
use cosserat::scene;
use serde_json::Value;

const FORMULATIONS: [&str; 2] = ["xpbd", "newton"];

// With networks it does more: see tests/all/gn.rs.
#[cfg(not(feature = "gn"))]
#[test]
fn without_arguments_it_runs_the_bending_rod() {
    let output = run(&[]);
    let (code, out, err) = texts(&output);
    assert_eq!((code, err), (Some(0), ""));
    let lines: Vec<&str> = out.lines().collect();
    assert_eq!(lines[0], "bending-rod: 30 segments, 29 joints, 100 steps of 0.02 s");
    assert_eq!(lines[1], "formulation newton, integrator euler, solver direct, guess step-adaptive");
    assert!(lines[2].starts_with("chosen: solver direct: ") && lines[2].contains("; guess step-adaptive: "), "{out}");
    assert!(lines[3].starts_with("converged: 100 steps, 2 s of motion, in "), "{out}");
    assert!(lines[lines.len() - 2].starts_with("Next: `simulate --view` "), "{out}");
    assert!(!out.contains("NaN") && !out.contains("inf"), "{out}");
}

#[test]
fn quiet_prints_nothing_and_json_may_still_be_asked_for() {
    assert_eq!(texts(&run(&["--quiet"])), (Some(0), "", ""));
    assert_eq!(json(&["--quiet"])["status"], "converged");
}

#[test]
fn list_names_every_scene_with_its_description() {
    let output = run(&["list"]);
    let (code, out, err) = texts(&output);
    assert_eq!((code, err), (Some(0), ""));
    for builtin in scene::builtins() {
        let line = out.lines().find(|line| line.split_whitespace().next() == Some(builtin.name)).expect(builtin.name);
        assert!(!builtin.description.is_empty() && line.ends_with(&builtin.description), "{line}");
    }
    assert!(out.contains("random-rod, random-helix, random-knot, random-tree"));
}

#[test]
fn help_explains_every_flag() {
    let output = run(&["--help"]);
    let (code, out, _) = texts(&output);
    assert_eq!(code, Some(0));
    for flag in [
        "steps",
        "dt",
        "formulation",
        "tangent",
        "integrator",
        "solver",
        "preconditioner",
        "guess",
        "end-to-end",
        "planar",
        "data",
        "scenario",
        "tolerance",
        "contact-tolerance",
        "threads",
        "out",
        "json",
    ] {
        let at = out.find(&format!("      --{flag}")).expect(flag);
        assert!(out[at..].lines().nth(1).is_some_and(|line| line.trim().len() > 10), "--{flag} has no text");
    }
    assert_eq!(run(&["list", "--help"]).status.code(), Some(0));
}

#[test]
fn every_builtin_scene_runs_in_every_formulation() {
    for name in builtin_names() {
        // Eyelets and joints that are not elastic are for one formulation alone.
        let is_newton = [
            "zip-line",
            "winch",
            "bowden-cable",
            "block-and-tackle",
            "elevator",
            "tendon-robot",
            "bent-wire",
            "spaghetti",
        ]
        .contains(&name);
        for formulation in FORMULATIONS.into_iter().filter(|name| *name == "newton" || !is_newton) {
            let summary = json(&[name, "--steps", "3", "--formulation", formulation]);
            let status = summary["status"].as_str().expect("a status");
            assert!(["converged", "converged in substeps"].contains(&status), "{name}, {formulation}: {status}");
            assert_eq!(nulls(&summary, ""), [".linear_tolerance"], "{name}, {formulation}");
            assert_eq!((&summary["scene"], &summary["formulation"]), (&name.into(), &formulation.into()));
            assert_eq!((&summary["steps"], &summary["frames_measured"]), (&3.into(), &4.into()));
        }
    }
}

#[test]
fn every_builtin_scene_runs_with_bdf2_which_the_summary_names() {
    for name in builtin_names() {
        let summary = json(&[name, "--steps", "4", "--integrator", "bdf2"]);
        let status = summary["status"].as_str().expect("a status");
        assert!(["converged", "converged in substeps"].contains(&status), "{name}: {status}");
        assert_eq!(summary["integrator"], "bdf2", "{name}");
    }
    let output = run(&["--steps", "1", "--integrator", "bdf2", "--formulation", "newton"]);
    let (code, out, _) = texts(&output);
    assert_eq!(code, Some(0));
    assert!(out.contains("formulation newton, integrator bdf2, solver direct, guess step-adaptive"), "{out}");
}

#[test]
fn the_exact_tangent_is_named_by_the_summary() {
    let flags = ["helix", "--steps", "2", "--formulation", "newton", "--tangent"];
    let with = |tangent| [&flags[..], &[tangent]].concat();
    let named = ["exact", "positive"]
        .map(|tangent| (tangent, format!("formulation newton, tangent {tangent}, integrator euler, solver")));
    for (tangent, named) in named.into_iter().chain([("auto", "newton, integrator euler, solver".to_owned())]) {
        assert_eq!(json(&with(tangent))["tangent"], tangent);
        let output = run(&with(tangent));
        let (_, out, _) = texts(&output);
        assert!(out.contains(&named), "{out}");
    }
}

#[test]
fn random_scenes_are_drawn_by_seed_and_index() {
    let hash =
        |arguments: &[&str]| json(&[&["random-helix", "--steps", "2"], arguments].concat())["final_state_hash"].clone();
    assert_eq!(hash(&[]), hash(&["--seed", "0", "--index", "0"]));
    assert_ne!(hash(&[]), hash(&["--seed", "1"]));
    assert_ne!(hash(&[]), hash(&["--index", "1"]));
}

/// The JSON's keys are an interface: a key that goes is a change to announce.
#[test]
fn json_has_all_keys() {
    let summary = json(&["helix", "--steps", "5", "--solver", "cg", "--guess", "linear"]);
    let keys = |value: &Value| value.as_object().expect("an object").keys().cloned().collect::<Vec<_>>().join(" ");
    assert_eq!(
        keys(&summary),
        "connected_sets contact_tolerance dt_s end_to_end energy_end_j energy_highest_j energy_start_j final_state_hash formulation frames_measured \
         guess integrator interrupted joints length_drift linear_tolerance planar scene segments solver stages_s status steps steps_asked \
         tangent threads times_real_time tolerance wall_s work worst_residuals"
    );
    assert_eq!(keys(&summary["stages_s"]), "assemble contact drag guess predict solve update");
    assert_eq!(
        keys(&summary["worst_residuals"]),
        "bend_rad contact_per_radius momentum penetration_per_radius stretch_per_length"
    );
    assert_eq!(
        keys(&summary["work"]),
        "branch_eliminations contact_candidates contact_evaluations contact_searches contact_solves contact_sweeps \
         contacts_left_out damping_evaluations drag_evaluations guesses_dropped guesses_used linear_failures \
         linear_iterations load_evaluations momentum_evaluations non_finite not_converged outer_iterations retries \
         segment_iterations steps"
    );
    assert_eq!(nulls(&summary, ""), [""; 0]);
    let hash = summary["final_state_hash"].as_str().expect("a hash");
    assert!(hash.len() == 64 && hash.bytes().all(|byte| byte.is_ascii_hexdigit()));
    assert_eq!((&summary["guess"], &summary["solver"]), (&"linear".into(), &"cg-block-jacobi".into()));
}

#[test]
fn threads_do_not_change_a_bit() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("many.toml");
    fs::write(&path, many_rods()).expect("a scene");
    let path = path.to_str().expect("UTF-8");
    for formulation in FORMULATIONS {
        let run = |threads: &str| json(&[path, "--formulation", formulation, "--threads", threads]);
        let (one, two) = (run("1"), run("2"));
        assert_eq!((&one["threads"], &two["threads"]), (&1.into(), &2.into()));
        assert_eq!((&one["connected_sets"], &one["segments"]), (&40.into(), &420.into()));
        assert_eq!(one["final_state_hash"], two["final_state_hash"], "{formulation}");
        assert_eq!(one["work"], two["work"], "{formulation}");
    }
}

#[test]
fn the_default_guess_is_chosen_for_the_formulation_and_leaves_lanes_alone() {
    let guess = |arguments: &[&str]| json(&[arguments, &["--steps", "4"]].concat())["guess"].clone();
    assert_eq!(guess(&[]), "step-adaptive");
    assert_eq!(guess(&["--formulation", "xpbd"]), "zero");
    assert_eq!(guess(&["--guess", "zero"]), "zero");
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("many.toml");
    fs::write(&path, many_rods()).expect("a scene");
    let path = path.to_str().expect("UTF-8");
    assert_eq!(guess(&[path]), "zero");
    assert_eq!(guess(&[path, "--guess", "step-linear"]), "step-linear");
}

/// What the arguments leave open is chosen and explained; what they say stays.
#[test]
fn the_solver_is_chosen_and_the_summary_says_why() {
    let run = |arguments: &[&str]| {
        let summary = json(&[arguments, &["--steps", "3"]].concat());
        let text = |key: &str| summary[key].as_str().unwrap_or_default().to_owned();
        [text("solver"), text("guess"), text("chosen")]
    };
    let [solver, guess, chosen] = run(&[]);
    assert_eq!((solver.as_str(), guess.as_str()), ("direct", "step-adaptive"));
    assert_eq!(run(&["--solver", "auto"]), [solver, guess, chosen.clone()]);
    assert!(
        chosen.starts_with("solver direct: the rods form 1 chain, eliminated without iterating; guess step-adaptive: "),
        "{chosen}"
    );
    assert!(run(&["tree-10"])[2].contains("1 tree"));
    assert!(run(&["net"])[2].contains("1 set with loops, solved by sparse Cholesky"));
    let [solver, guess, chosen] = run(&["--solver", "sparse"]);
    assert_eq!((solver.as_str(), guess.as_str()), ("sparse", "step-adaptive"));
    assert!(chosen.starts_with("guess step-adaptive: "), "{chosen}");
    assert_eq!(run(&["--solver", "sparse", "--guess", "zero"])[2], "");
    assert!(run(&["--guess", "zero"])[2].ends_with("1 chain, eliminated without iterating"));
    for (flag, value, solver) in [
        ("--guess", "fischer", "cg-block-jacobi"),
        ("--preconditioner", "jacobi", "cg-jacobi"),
        ("--linear-tolerance", "1e-3", "cg-block-jacobi"),
    ] {
        let [found, guess, chosen] = run(&[flag, value]);
        assert_eq!(found, solver);
        assert_eq!(guess, if flag == "--guess" { value } else { "step-adaptive" });
        let name = if flag == "--guess" { "--guess fischer" } else { flag };
        assert!(chosen.starts_with(&format!("solver {solver}: no other has a use for {name}")), "{chosen}");
    }
}

/// What a scene lacks is not counted and takes no time; what it has is.
#[test]
fn counters_tell_what_the_scene_has() {
    let work = |summary: &Value, key: &str| summary["work"][key].as_u64().expect("a count");
    let plain = json(&["bending-rod", "--steps", "10", "--formulation", "xpbd"]);
    for key in [
        "load_evaluations",
        "damping_evaluations",
        "drag_evaluations",
        "contact_searches",
        "contact_candidates",
        "contact_evaluations",
        "contacts_left_out",
        "contact_solves",
        "contact_sweeps",
        "branch_eliminations",
        "guesses_used",
        "guesses_dropped",
        "linear_iterations",
        "linear_failures",
        "momentum_evaluations",
        "retries",
        "not_converged",
        "non_finite",
    ] {
        assert_eq!(work(&plain, key), 0, "{key}");
    }
    assert_eq!(plain["stages_s"]["guess"], 0.0);
    assert_eq!(plain["stages_s"]["drag"], 0.0);
    assert_eq!(plain["stages_s"]["contact"], 0.0);
    for key in ["contact_per_radius", "penetration_per_radius"] {
        assert_eq!(plain["worst_residuals"][key], 0.0, "{key}");
    }
    assert_eq!(work(&plain, "steps"), 10);
    assert_eq!(work(&plain, "segment_iterations"), 30 * work(&plain, "outer_iterations"));
    assert!(work(&json(&["--steps", "10"]), "momentum_evaluations") > 0);

    assert_eq!(work(&json(&["elastica", "--steps", "10", "--guess", "zero"]), "load_evaluations"), 10);
    let windy = json(&["tree-10", "--steps", "10"]);
    assert_eq!(work(&windy, "drag_evaluations"), 206 * (work(&windy, "steps") + work(&windy, "retries")));
    assert!(windy["stages_s"]["drag"].as_f64().is_some_and(|seconds| seconds > 0.0));
    assert_eq!((&windy["stages_s"]["contact"], work(&windy, "contact_searches")), (&0.0.into(), 0));
    let touching = json(&["helix-on-plane", "--steps", "15"]);
    for key in ["contact_searches", "contact_candidates", "contact_evaluations", "contact_solves", "contact_sweeps"] {
        assert!(work(&touching, key) > 0, "{key}");
    }
    assert!(touching["stages_s"]["contact"].as_f64().is_some_and(|seconds| seconds > 0.0));
    assert!(touching["worst_residuals"]["contact_per_radius"].as_f64().is_some_and(|e| e > 0.0 && e <= 1e-3));
    assert_eq!((&touching["stages_s"]["drag"], work(&touching, "drag_evaluations")), (&0.0.into(), 0));
    let branch = json(&["branch", "--steps", "10"]);
    assert_eq!(work(&branch, "branch_eliminations"), work(&branch, "outer_iterations"));
    let newton = json(&["--steps", "10", "--formulation", "newton"]);
    assert!(work(&newton, "momentum_evaluations") > 0 && work(&newton, "guesses_used") > 0);
    assert!(newton["stages_s"]["guess"].as_f64().is_some_and(|seconds| seconds > 0.0));
    let cg = json(&["--steps", "10", "--solver", "cg", "--guess", "previous"]);
    assert!(work(&cg, "linear_iterations") > 0 && work(&cg, "guesses_used") > 0);

    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("damped.toml");
    let text = "damping = { linear_per_s = 1 }\n[[rods]]\nshape.straight = { length_m = 1, segments = 5 }\n";
    fs::write(&path, text).expect("a scene");
    let damped = json(&[path.to_str().expect("UTF-8"), "--steps", "10"]);
    assert_eq!(work(&damped, "damping_evaluations"), 50);
}

#[test]
fn no_steps_show_how_the_scene_starts() {
    let summary = json(&["--steps", "0"]);
    assert_eq!(
        (&summary["steps"], &summary["frames_measured"], &summary["wall_s"]),
        (&0.into(), &1.into(), &0.0.into())
    );
    assert_eq!(summary["energy_start_j"], summary["energy_end_j"]);
    assert_eq!(nulls(&summary, ""), [".linear_tolerance"]);
    assert_eq!(run(&["--steps", "0"]).status.code(), Some(0));
}

#[test]
fn static_says_which_wind_it_takes() {
    for (scene, wind) in [("heavy-cantilever", "none"), ("tree-10", "steady"), ("tree-20", "frozen")] {
        assert_eq!(json(&["static", scene])["wind"], wind, "{scene}");
    }
}

/// `simulate ... | head -1`: the reader goes away after a line, or before.
#[test]
fn a_closed_pipe_is_no_panic() {
    for arguments in [&[][..], &["list"], &["--json"], &["--help"]] {
        let mut child = simulate(arguments)
            .stdout(std::process::Stdio::piped())
            .stderr(std::process::Stdio::piped())
            .spawn()
            .expect("the program starts");
        drop(child.stdout.take());
        let output = child.wait_with_output().expect("it ends");
        assert_eq!((output.status.code(), texts(&output).2), (Some(0), ""), "{arguments:?}");
    }
}

#[test]
#[cfg(target_os = "linux")]
fn an_output_that_is_full_is_an_error() {
    let full = fs::File::options().write(true).open("/dev/full").expect("a full device");
    let output = simulate(&[]).stdout(full).stderr(std::process::Stdio::piped()).output().expect("it starts");
    let (code, _, err) = texts(&output);
    assert_eq!(code, Some(2));
    assert!(err.starts_with("error: cannot write to standard output: "), "{err}");
}

/// A rod whose first end is led down, past the ground or not.
fn led(depth: f64) -> String {
    format!(
        "run = {{ dt_s = 0.01, steps = 60 }}\ngravity_m_s2 = [0, 0, 0]\n[[obstacles]]\nshape.plane.point_m = [0, 0, -0.06]\n\
         [[rods]]\nname = \"cable\"\nradius_m = 0.01\nyoungs_modulus_pa = 1e7\ndensity_kg_m3 = 1000\n\
         shape.straight = {{ length_m = 1, segments = 10 }}\n[[rods.motions]]\nat = \"start-face\"\n\
         times_s = [0, 0.5]\nshifts_m = [[0, 0, 0], [0, 0, -{depth}]]\n"
    )
}

#[test]
fn a_run_whose_joints_come_apart_says_so_and_fails() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("led.toml");
    let file = path.to_str().expect("UTF-8");
    fs::write(&path, led(0.049)).expect("a file");
    assert_eq!(json(&[file])["status"], "converged");
    // It goes 2 mm a step, and is at the ground in step 25. The joint is half a segment long: 0.05 m.
    fs::write(&path, led(0.1)).expect("a file");
    let output = run(&[file, "--json", "--keep-going"]);
    let (code, out, error) = texts(&output);
    assert_eq!(code, Some(1), "{error}");
    let summary: Value = serde_json::from_str(out).expect("JSON");
    assert_eq!((summary["status"].as_str(), summary["steps"].as_u64()), (Some("joints apart"), Some(60)));
    let going = summary["joints_apart"]["first_step"].as_u64().expect("a number");
    let apart = &summary["joints_apart"];
    let number = |key: &str| apart[key].as_f64().expect(key);
    assert!((27.0..=28.0).contains(&number("first_step")), "{apart}");
    assert!(
        (number("widest_gap_m") - 0.05).abs() < 2e-3 && (number("widest_gap_per_length") - 1.0).abs() < 0.04,
        "{apart}"
    );
    assert!(error.starts_with("error: led: joints came apart, first in step 2"), "{error}");
    assert!(
        error.contains("between what holds it and segment 0 of cable; look whether what is held is led into something"),
        "{error}"
    );
    let output = run(&[file, "--keep-going"]);
    let (code, out, _) = texts(&output);
    assert!(code == Some(1) && out.contains("joints apart: 60 steps"), "{out}");

    // Unless it is told to go on, it ends there, with its files.
    let out = folder.path().join("out");
    let output = run(&[file, "--view", "--trajectory", "--out", out.to_str().expect("UTF-8")]);
    let (code, printed, error) = texts(&output);
    assert!(code == Some(1) && printed.contains(&format!("joints apart: {going} steps of 60")), "{printed}");
    assert!(error.starts_with(&format!("error: led: stopped after step {going} of 60: joints came apart")), "{error}");
    assert!(error.ends_with("; --keep-going goes on\n"), "{error}");
    let kept = export::read_trajectory(&out.join("trajectory.safetensors")).expect("a trajectory");
    assert_eq!(kept.states.len() as u64, going + 1);
    assert!(out.join("view.html").exists());
    let summary: Value = serde_json::from_slice(&fs::read(out.join("summary.json")).expect("a file")).expect("JSON");
    assert_eq!((&summary["status"], summary["steps"].as_u64()), (&"joints apart".into(), Some(going)));
}

/// A joint that is bent at rest and twisted past half a turn, where its energy jumps.
#[test]
fn a_run_with_a_joint_past_half_a_turn_ends_with_a_warning_and_exit_code_1() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("turned.toml");
    let text = "gravity_m_s2 = [0, 0, 0]\nrun = { dt_s = 0.01, steps = 60, integrator = \"euler\" }\n[[rods]]\nradius_m = 0.01\n\
                youngs_modulus_pa = 1e7\nfixed_segments = [0]\nrest = { darboux_per_m = [0, 0, 3] }\n\
                shape.straight = { direction = [1, 0, 0], length_m = 0.2, segments = 2 }\n[[rods.motions]]\nat = \"end-segment\"\n\
                times_s = [0, 0.6]\nturns_deg = [[0, 0, 0], [310, 0, 0]]\n";
    fs::write(&file, text).unwrap();
    let output = run(&[file.to_str().unwrap()]);
    let (code, printed, warned) = texts(&output);
    assert_eq!(code, Some(1));
    assert!(printed.contains("joints past half a turn: 60 steps"), "{printed}");
    let warning = "warning: turned: in 1 step a joint turned past half a turn, where it loses a turn of its twist";
    assert!(warned.lines().any(|line| line.starts_with(warning)), "{warned}");
}

/// What is not solved to its tolerance says so to whoever reads the exit code alone, and writes its files all the same.
#[test]
fn a_run_with_steps_that_are_not_solved_ends_with_a_warning_and_exit_code_1() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let output = run(&["helix", "--steps", "2", "--tolerance", "1e-17", "--out", out.to_str().unwrap()]);
    let (code, printed, warned) = texts(&output);
    assert_eq!(code, Some(1));
    assert!(printed.contains("out of iterations: 2 steps"), "{printed}");
    assert!(warned.starts_with("warning: helix: 128 steps or substeps were not solved to the tolerance"), "{warned}");
    assert!(out.join("summary.json").exists() && out.join("trajectory.safetensors").exists());
}

//! What is printed for a person: no noise, no blanks at the ends of lines, no numbers that cannot be meant.

use crate::common::{run, texts};

/// Standard output of a run that goes well, after a check that no line ends in a blank.
fn printed(arguments: &[&str]) -> String {
    let output = run(arguments);
    let (code, out, err) = texts(&output);
    assert_eq!((code, err), (Some(0), ""), "{arguments:?}");
    for line in out.lines() {
        assert_eq!(line, line.trim_end(), "{arguments:?}");
    }
    out.to_owned()
}

#[test]
fn energies_that_are_rounding_errors_are_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("rest.toml");
    // At rest and free: what is not 0 is rounding errors of turning and placing the rod.
    let scene = "gravity_m_s2 = [0, 0, 0]\n[[rods]]\nshape.straight = { length_m = 4, segments = 30, direction = [1, 2, 3], \
                 start_m = [0.1, 0.7, 0.3] }\n";
    std::fs::write(&path, scene).expect("a scene");
    let path = path.to_str().expect("UTF-8");
    let exact = crate::common::json(&[path, "--steps", "50"])["energy_highest_j"].as_f64().expect("a number");
    assert!(exact > 0.0 && exact < 1e-15, "{exact}: this scene is to have noise");
    let out = printed(&[path, "--steps", "50"]);
    assert!(out.contains("energy: 0 J at the start, 0 J at the end, 0 J at its highest"), "{out}");
    let out = printed(&["static", path]);
    assert!(out.contains("energy: 0 J at the start, 0 J at rest"), "{out}");
    // What is small and meant stays.
    std::fs::write(path, scene.replace("[0, 0, 0]", "[0, 0, -1e-4]")).expect("a scene");
    let out = printed(&[path, "--steps", "50"]);
    assert!(!out.contains("J at the start, 0 J at the end"), "{out}");
}

#[test]
fn times_of_stages_are_told_where_they_are_asked_for() {
    let stages = ["drag", "predict", "guess", "assemble", "linear solve", "update"];
    let is_row = |out: &str, stage: &str| out.lines().any(|line| line.trim_start().starts_with(stage));
    let plain = printed(&["helix", "--steps", "5"]);
    assert!(!plain.contains("us a step"), "{plain}");
    let timed = printed(&["helix", "--steps", "5", "--times"]);
    assert!(timed.contains("us a step"), "{timed}");
    for stage in stages {
        assert!(is_row(&timed, stage) && !is_row(&plain, stage), "{stage}: {timed}");
    }
}

/// Of places that are near enough to touch, no more than all of them press; where there are none, nothing is counted.
#[test]
fn contacts_that_press_are_among_those_that_are_near() {
    let contacts = |out: &str| -> Vec<String> {
        let lines = out.lines().skip_while(|line| !line.starts_with("contacts: "));
        lines.take_while(|line| line.contains("contacts")).map(str::to_owned).collect()
    };
    for (scene, presses) in [("helix-on-plane", true), ("hair", false), ("two-rods", true)] {
        let out = printed(&[scene, "--steps", "25"]);
        let lines = contacts(&out);
        let [line, errors] = &lines[..] else { panic!("{out}") };
        let (near, pressing) = line["contacts: ".len()..].split_once(" places near enough to touch, ").expect("places");
        assert!(near.parse::<f64>().is_ok_and(|near| near > 0.0), "{line}");
        assert!(pressing.ends_with(" of them press (means over all iterations)"), "{line}");
        if presses {
            let percent = pressing.split_once(" % ").and_then(|(percent, _)| percent.parse::<f64>().ok());
            assert!(percent.is_some_and(|percent| percent > 0.0 && percent <= 100.0), "{line}");
        } else {
            assert!(pressing.starts_with("none of them press"), "{line}");
        }
        assert!(errors.contains(" of the smaller radius at most; deepest overlap: "), "{errors}");
    }
    let out = printed(&["two-arms", "--steps", "5"]);
    assert_eq!(contacts(&out), ["contacts: nothing came near enough to touch"]);
}

/// Small numbers are written as people write them.
#[test]
fn numbers_in_help_and_reports_are_short() {
    let help = run(&["static", "--help"]);
    let (code, text, _) = texts(&help);
    assert!(code == Some(0) && text.contains("[default: 1e-9]"), "{text}");
    let out = printed(&["static"]);
    let moved = "in the last one no segment moved by more than ";
    assert!(out.lines().nth(1).is_some_and(|line| line.starts_with(moved) && line.ends_with(" rad")), "{out}");
}

/// Whoever runs a scene for the first time hears how to watch it; who has asked for files, or for nothing, does not.
#[test]
fn a_run_without_files_says_how_to_watch_it() {
    let hint = "add --view to this command for a page to watch it";
    let out = printed(&["helix", "--steps", "2"]);
    assert_eq!(out.lines().last(), Some(hint));
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().to_str().expect("UTF-8");
    for arguments in [&["--quiet"][..], &["--json"], &["--out", path], &["--plot", "--out", path]] {
        let out = printed(&[&["helix", "--steps", "2"], arguments].concat());
        assert!(!out.contains(hint), "{arguments:?}: {out}");
    }
}

#[test]
fn a_random_scene_goes_by_the_name_that_it_was_asked_for() {
    for scene in ["random-rod", "random-helix", "random-knot", "random-tree"] {
        let out = printed(&[scene, "--steps", "1"]);
        assert!(out.starts_with(&format!("{scene}: ")) && !out.contains("sampled"), "{out}");
    }
}

#[test]
fn no_table_is_padded() {
    for arguments in [&["list"][..], &["static", "tree-10"], &["hair", "--steps", "2", "--times"]] {
        printed(arguments);
    }
}

/// A pendulum of a metre at a time step that is too long loses in two periods what the run says, and is advised one that keeps
/// it. What is still, damped by itself, or integrated in second order has nothing to hear.
#[test]
fn a_run_says_where_its_time_step_is_too_long() {
    let pendulum = ["pendulum", "--dt", "0.02", "--steps", "164", "--integrator", "euler"];
    let summary = crate::common::json(&pendulum);
    let [start, end] = ["energy_start_j", "energy_end_j"].map(|key| summary[key].as_f64().expect("a number"));
    let swing = &summary["too_coarse"];
    let [lost, dt, hertz] =
        ["lost_a_period", "advised_dt_s", "frequency_hz"].map(|key| swing[key].as_f64().expect("a number"));
    // m g L / 2 below the pin.
    let rest = -0.5 * 9.81 * 1000.0 * std::f64::consts::PI * 1e-4;
    let kept = ((end - rest) / (start - rest)).sqrt();
    assert!((kept - (1.0 - lost)).abs() < 0.02, "{kept} of {lost}");
    assert!((hertz - (1.5_f64 * 9.81).sqrt() / std::f64::consts::TAU).abs() < 1e-3, "{hertz}");
    assert_eq!((&swing["rod"], &swing["mode"]), (&"rod".into(), &"gravity".into()));
    let out = printed(&pendulum);
    assert!(
        out.contains(
            "\ntime step: euler at 0.02 s takes about 38 % of its energy from the first swing of rod (gravity"
        ),
        "{out}"
    );
    assert!(out.contains("; --dt 0.0021 takes 5 %, --integrator bdf2 0.14 %\n"), "{out}");
    let (dt, steps) = (dt.to_string(), (3.3 / dt).round().to_string());
    for silent in [
        &["pendulum", "--dt", &dt, "--steps", &steps, "--integrator", "euler"][..],
        &["pendulum", "--dt", "0.02", "--steps", "164", "--integrator", "bdf2"],
        &["pendulum", "--dt", "0.02", "--steps", "60", "--integrator", "euler"],
        &["hung-cable"],
        &["two-arms"],
    ] {
        let out = printed(silent);
        assert!(!out.contains("time step:"), "{silent:?}: {out}");
    }
}

/// A stiff rod that goes round its pin with 2.5 rad/s: Euler's rule takes `4 pi omega dt` of its energy in a turn.
#[test]
fn a_run_says_where_its_integrator_brakes_what_goes_round() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("orbit.toml");
    let velocity = |k: usize| {
        let speed = 2.5 * 0.1 * (k as f64 + 0.5);
        format!("{{ segment = {k}, velocity_m_s = [0, {speed}, 0], angular_velocity_rad_s = [0, 0, 2.5] }}")
    };
    let velocities: Vec<String> = (0..20).map(velocity).collect();
    let scene = format!(
        "gravity_m_s2 = [0, 0, 0]\nrun = {{ dt_s = 0.02, steps = 400, integrator = \"euler\" }}\n[[rods]]\nname = \"rope\"\nradius_m = 0.01\n\
         youngs_modulus_pa = 1e6\ndensity_kg_m3 = 300\nshape.straight = {{ direction = [1, 0, 0], length_m = 2, segments = 20 \
         }}\nmasses = [{{ segment = -1, mass_kg = 1 }}]\nvelocities = [{}]\ngrips = [{{ at = \"start-face\", joint = \"ball\" \
         }}]\n",
        velocities.join(", ")
    );
    std::fs::write(&path, scene).expect("a scene");
    let path = path.to_str().expect("UTF-8");
    let summary = crate::common::json(&[path]);
    let braked = &summary["braked"];
    let [lost, dt] = ["lost_a_turn", "advised_dt_s"].map(|key| braked[key].as_f64().expect("a number"));
    // The speed falls on the way, and with it what is lost: from 0.47 at 2.5 rad/s.
    assert!((0.25..0.47).contains(&lost) && (0.0015..0.004).contains(&dt), "{braked}");
    assert_eq!(braked["what"], "segment 19 of rope");
    let [start, end] = ["energy_start_j", "energy_end_j"].map(|key| summary[key].as_f64().expect("a number"));
    // d(energy)/dt = -2 omega^2 dt energy, and omega^2 goes with the energy.
    let expected = 1.0 / (1.0 + 2.0 * 2.5 * 2.5 * 0.02 * 8.0);
    assert!((end / start / expected - 1.0).abs() < 0.02, "{} of {expected}", end / start);
    let out = printed(&[path]);
    assert!(out.contains("\ntime step: euler at 0.02 s takes about "), "{out}");
    assert!(out.contains("of what goes round (segment 19 of rope) in each turn; --dt 0.00"), "{out}");
    let silent = printed(&[path, "--integrator", "bdf2"]);
    assert!(!silent.contains("time step:"), "{silent}");
}

/// Four turns of twist in 40 segments are 36 degrees a joint. Where its moment goes with the sine of that a run says so, from 20 degrees on; where it goes
/// with the angle, from 120 degrees on.
#[test]
fn a_run_says_where_joints_turn_too_far() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("twist.toml");
    let scene = |bending: &str, turns: f64, seconds: f64| {
        format!(
            "bending = \"{bending}\"\ngravity_m_s2 = [0, 0, 0]\nrun = {{ dt_s = 0.01, steps = {} }}\ndamping = {{ linear_per_s = 5, angular_per_s = 5 \
             }}\n[[rods]]\nname = \"c\"\nradius_m = 0.005\nshape.straight = {{ length_m = 1, segments = 40 }}\nclamp = \
             [\"start-face\"]\nsection.stiffness = {{ bending_n_m2 = [5, 5], torsion_n_m2 = 0.04, mass_kg_m = 0.0785, \
             polar_inertia_kg_m = 1e-5 }}\n[[rods.motions]]\nat = \"end-face\"\ntimes_s = [0, {seconds}]\nturns_deg = [[0, 0, \
             0], [{}, 0, 0]]\n",
            (seconds * 110.0) as usize,
            turns * 360.0
        )
    };
    let summary = |bending: &str, turns: f64| {
        std::fs::write(&path, scene(bending, turns, 2.0)).expect("a scene");
        crate::common::json(&[path.to_str().expect("UTF-8")])
    };
    let far = summary("paper", 4.0);
    let joint = &far["sharp_joint"];
    let [angle, missing, needed] =
        ["angle_deg", "moment_missing", "segments_needed"].map(|key| joint[key].as_f64().expect("a number"));
    // 36 degrees a joint.
    assert!((angle - 36.0).abs() < 2.0 && (missing - 0.065).abs() < 0.01, "{joint}");
    assert!((70.0..78.0).contains(&needed), "{joint}");
    assert!(summary("paper", 1.8)["sharp_joint"].is_null());
    assert!(summary("angle", 4.0)["sharp_joint"].is_null());
    let nearly = &summary("angle", 14.0)["sharp_joint"];
    assert!((nearly["angle_deg"].as_f64().expect("a number") - 126.0).abs() < 2.0, "{nearly}");
    let needed = nearly["segments_needed"].as_u64().expect("a number");
    assert!((42..44).contains(&needed), "{nearly}");
    // A net's ropes cross at right angles at rest: more segments would not help.
    let net = "gravity_m_s2 = [0, 0, 0]\nrun.steps = 2\n[[nets]]\nsize_m = [1, 1]\nmeshes = [1, 1]\nsegments = 2\n";
    let of = |bending: &str| {
        std::fs::write(&path, format!("{bending}{net}")).expect("a scene");
        crate::common::json(&[path.to_str().expect("UTF-8")])["sharp_joint"].clone()
    };
    let crossing = of("bending = \"paper\"\n");
    let [at_rest, missing] = ["rest_deg", "moment_missing"].map(|key| crossing[key].as_f64().expect("a number"));
    assert!((at_rest - 90.0).abs() < 1e-6 && (missing - 0.5).abs() < 1e-6, "{crossing}");
    assert!(crossing["segments_needed"].is_null(), "{crossing}");
    for bending in ["", "bending = \"rest-rotation\"\n"] {
        assert!(of(bending).is_null());
    }
}

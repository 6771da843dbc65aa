//! What `simulate static` writes beside its report: forces, reactions, probes, the page, pictures.

use std::fs;
use std::path::Path;

use crate::common::{json, run, simulate, texts};
use serde_json::Value;

/// A cable that hangs between two clamps over a ground that it does not touch, and one load that changes later.
const CABLE: &str = r#"
[[rods]]
name = "cable"
radius_m = 0.01
youngs_modulus_pa = 1e8
density_kg_m3 = 1200
shape.hung = { to_m = [4, 0, 0], length_m = 4.2, segments = 40 }
[[rods.motions]]
at = "start-face"
times_s = [0, 1]
shifts_m = [[0, 0, 0], [0, 0, 1]]
[[rods.grips]]
at = "end-face"
[[probes]]
name = "left"
rod = "cable"
at = "start-face"
quantities = ["reaction", "tension"]
[[probes]]
name = "middle"
rod = "cable"
segment = 20
fraction = 0.0
quantities = ["tension"]
"#;

/// A table's header and rows.
fn table(folder: &Path, name: &str) -> (Vec<String>, Vec<Vec<String>>) {
    let mut reader = csv::Reader::from_path(folder.join(name)).expect(name);
    let strings = |record: &csv::StringRecord| record.iter().map(str::to_owned).collect();
    let header = strings(reader.headers().expect("a header"));
    (header, reader.records().map(|record| strings(&record.expect("a row"))).collect())
}

#[test]
fn an_equilibrium_has_its_forces() {
    let place = tempfile::tempdir().expect("a folder");
    let [file, out] = ["cable.toml", "out"].map(|name| place.path().join(name));
    fs::write(&file, CABLE).expect("a scene");
    let [file, to] = [&file, &out].map(|path| path.to_str().expect("UTF-8"));
    let output = run(&["static", file, "--view", "--plot", "--export", "csv,glb", "--out", to]);
    let (code, said, err) = texts(&output);
    assert_eq!((code, err), (Some(0), ""));
    assert_eq!(said.lines().last(), Some(format!("open {}", out.join("view.html").display()).as_str()));

    // Two clamps bear the weight, by halves; the pull along the cable is the same at both.
    let weight = 9.81 * 1200.0 * std::f64::consts::PI * 1e-4 * 4.2;
    let number = |text: &str| text.parse::<f64>().expect(text);
    let (header, rows) = table(&out, "reactions.csv");
    let column = |name: &str| header.iter().position(|own| own == name).expect(name);
    let [x, z] = ["force_x_n", "force_z_n"].map(column);
    let borne: Vec<_> = rows.iter().map(|row| [number(&row[x]), number(&row[z])]).collect();
    assert_eq!(borne.len(), 2, "of the equilibrium alone");
    for [_, up] in &borne {
        assert!((up / weight - 0.5).abs() < 1e-6, "{up} N of {weight} N");
    }
    let pull = borne[0][0].abs();
    assert!((borne[0][0] + borne[1][0]).abs() < 1e-6 * weight && pull > weight / 4.0, "{borne:?}");
    let (header, rows) = table(&out, "probes.csv");
    let value = |name: &str| number(&rows[1][header.iter().position(|own| own == name).expect(name)]);
    assert!((value("left.reaction_force_z_n") - borne[0][1]).abs() < 1e-9 * weight);
    assert!((value("left.reaction_force_x_n") + pull).abs() < 1e-9 * weight);
    assert!((value("middle.tension_n") - pull).abs() < 0.01 * weight, "level in the middle");
    assert!(value("left.tension_n") > value("middle.tension_n"));
    for name in
        ["view.json", "run.glb", "energy.svg", "length.svg", "snapshots.svg", "trajectory.safetensors", "summary.json"]
    {
        assert!(out.join(name).exists(), "{name}");
    }
    assert!(!out.join("iterations.svg").exists());

    // The same later; what drives the face stays where it is at time 0.
    let read = || ["reactions.csv", "joints.csv", "run.glb"].map(|name| fs::read(out.join(name)).expect(name));
    let own = read();
    for scene in [&[][..], &["--scene", file]] {
        let output = run(&[&["export", to, "--export", "csv,glb", "--quiet"], scene].concat());
        assert_eq!(texts(&output), (Some(0), "", ""));
        assert!(read() == own, "{scene:?}");
    }
}

/// The flow knows its forces, too, and each of several equilibria.
#[test]
fn the_flow_and_branches_have_theirs() {
    let place = tempfile::tempdir().expect("a folder");
    let [file, newton, flow, branches] =
        ["cable.toml", "newton", "flow", "branches"].map(|name| place.path().join(name));
    fs::write(&file, CABLE).expect("a scene");
    let reactions = |out: &Path, more: &[&str]| {
        let [file, to] = [file.as_path(), out].map(|path| path.to_str().expect("UTF-8"));
        let output = run(&[&["static", file, "--export", "csv", "--out", to], more].concat());
        assert_eq!(output.status.code(), Some(0), "{more:?}");
        let (header, rows) = table(out, "reactions.csv");
        let z = header.iter().position(|name| name == "force_z_n").expect("a column");
        rows.iter().map(|row| row[z].parse::<f64>().expect("a number")).collect::<Vec<_>>()
    };
    let own = reactions(&newton, &[]);
    let of_flow = reactions(&flow, &["--method", "flow", "--tolerance", "1e-6"]);
    assert!(own.iter().zip(&of_flow).all(|(a, b)| (a - b).abs() < 1e-3 * a.abs()), "{own:?} {of_flow:?}");
    let of_branches = reactions(&branches, &["--branches"]);
    assert!(of_branches.iter().all(|up| (up / own[0] - 1.0).abs() < 1e-6), "{own:?} {of_branches:?}");
}

/// Reactions at rest are weights, whatever is driven, and of the first equilibrium of a path too, which shares its time with the start.
#[test]
fn reactions_at_rest_know_no_inertia() {
    let place = tempfile::tempdir().expect("a folder");
    let file = place.path().join("driven.toml");
    let scene = r#"
[run]
dt_s = 0.1
steps = 2
[[rods]]
name = "cable"
radius_m = 0.01
youngs_modulus_pa = 1e8
density_kg_m3 = 1200
shape.straight = { length_m = 1, segments = 10 }
clamp = ["start-face"]
[[rods.motions]]
segment = 9
times_s = [0, 1]
shifts_m = [[0, 0, 0], [0.01, 0, 0.01]]
"#;
    fs::write(&file, scene).expect("a scene");
    let file = file.to_str().expect("UTF-8");
    for (k, more) in [&[][..], &["--along"]].into_iter().enumerate() {
        let out = place.path().join(format!("{k}"));
        let to = out.to_str().expect("UTF-8");
        let output = run(&[&["static", file, "--export", "csv", "--out", to][..], more].concat());
        let (code, _, err) = texts(&output);
        assert_eq!((code, err), (Some(0), ""));
        let (header, rows) = table(&out, "reactions.csv");
        let column = |name: &str| header.iter().position(|own| own == name).expect(name);
        let weight = 9.81 * 1200.0 * std::f64::consts::PI * 1e-5;
        for row in rows.iter().filter(|row| row[column("body")] == "9") {
            let [x, z] = ["inertia_force_x_n", "inertia_force_z_n"]
                .map(|name| row[column(name)].parse::<f64>().expect("a number"));
            assert!(x.abs() < 1e-12 && (z.abs() - weight).abs() < 1e-9, "{more:?}: {row:?}");
            for axis in ["x", "y", "z"] {
                let moment: f64 = row[column(&format!("inertia_moment_{axis}_n_m"))].parse().expect("a number");
                assert!(moment == 0.0, "{more:?}: {row:?}");
            }
        }
    }
}

#[test]
fn without_out_it_has_a_folder_of_its_own() {
    let place = tempfile::tempdir().expect("a folder");
    for (arguments, out) in [
        (&["static", "heavy-cantilever", "--view"][..], "out/heavy-cantilever-static"),
        (&["modes", "heavy-cantilever", "--count", "1", "--view"], "out/heavy-cantilever-modes"),
    ] {
        let output = simulate(arguments).current_dir(&place).output().expect("it starts");
        assert_eq!(output.status.code(), Some(0), "{arguments:?}");
        assert!(place.path().join(out).join("view.html").exists(), "{out}");
    }
    assert!(!place.path().join("out/heavy-cantilever-modes/trajectory.safetensors").exists());
}

#[test]
fn a_setting_changes_an_equilibrium() {
    let tip = |modulus: &str| {
        let report = json(&["static", "heavy-cantilever", "--set", &format!("rods[0].youngs_modulus_pa={modulus}")]);
        report["tips_m"][0][2].as_f64().expect("a number")
    };
    assert!(tip("1e6") < tip("1e12"));
    let report: Value = json(&["heavy-cantilever", "--steps", "1", "--set", "rods[0].youngs_modulus_pa=1e9"]);
    assert_eq!(report["set"], serde_json::json!(["rods[0].youngs_modulus_pa=1e9"]));
}

/// A wire that a load bends beyond its yield moment and lets go.
const WIRE: &str = r#"
gravity_m_s2 = [0, 0, 0]

[run]
dt_s = 0.01
steps = 200

[[rods]]
radius_m = 0.001
youngs_modulus_pa = 2e11
torsion_modulus_pa = 8e10
density_kg_m3 = 7850
shape.straight = { direction = [1, 0, 0], length_m = 0.3, segments = 30 }
clamp = ["start-face"]
yield = { moment_n_m = 0.5, torque_n_m = 0.4, hardening_kinematic = 0.1 }

[[rods.loads]]
at = "end-face"
times_s = [0, 1, 2]
forces_n = [[0, 0, 0], [0, 0, -2], [0, 0, 0]]
"#;

#[test]
fn joints_that_are_not_elastic_come_to_rest_and_swing() {
    let place = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        let file = place.path().join(name);
        fs::write(&file, text).expect("a scene");
        file.to_str().expect("UTF-8").to_owned()
    };
    let file = write("wire.toml", WIRE);
    let report = json(&["static", &file, "--along"]);
    assert_eq!(report["end"], "until");
    let set = |report: &Value| report["inelastic"]["plastic"]["curvature_per_m"].as_f64().expect("a set");
    let on_the_way = set(&report);
    // At once, under the load that stays: at the clamp its moment is that of the force at the tip.
    let changes = "times_s = [0, 1, 2]\nforces_n = [[0, 0, 0], [0, 0, -2], [0, 0, 0]]";
    let held = write("held.toml", &WIRE.replace(changes, "force_n = [0, 0, -2]"));
    let report = json(&["static", &held]);
    assert_eq!((&report["converged"], &report["stable"]), (&Value::Bool(true), &Value::Bool(true)));
    assert!(report["inelastic"]["dissipated_j"].as_f64().expect("a loss") > 0.0);
    let stiffness = 2e11 * std::f64::consts::PI * 1e-12 / 4.0;
    let moment = 2.0 * report["tips_m"][0][0].as_f64().expect("a place");
    let (at_once, expected) = (set(&report), (moment - 0.5) / (0.1 * stiffness));
    assert!((at_once / expected - 1.0).abs() < 0.01, "{at_once} of {expected} 1/m");
    // It stays when the load is gone.
    assert!((on_the_way / at_once - 1.0).abs() < 0.01, "{on_the_way} of {at_once} 1/m");
    // Small vibrations are elastic.
    let frequencies = |text: &str| -> Vec<f64> {
        let report = json(&["modes", &write("modes.toml", text), "--count", "4"]);
        let modes = report["modes"].as_array().expect("modes");
        modes.iter().map(|mode| mode["frequency_hz"].as_f64().expect("a number")).collect()
    };
    let straight = WIRE.split("[[rods.loads]]").next().expect("a rod");
    let elastic: String =
        straight.lines().filter(|line| !line.starts_with("yield")).map(|line| format!("{line}\n")).collect();
    for (own, other) in frequencies(straight).into_iter().zip(frequencies(&elastic)) {
        assert!((own / other - 1.0).abs() < 1e-9, "{own} of {other} Hz");
    }
    // A run begins at rest, yielded.
    let begins = fs::read_to_string(&held).expect("a scene").replace("[run]", "[run]\nbegin = \"equilibrium\"");
    let report = json(&[&write("begins.toml", &begins), "--steps", "10"]);
    assert_eq!(report["status"], "converged");
    assert!((set(&report) / at_once - 1.0).abs() < 1e-6, "{} of {at_once} 1/m", set(&report));
    // Several equilibria depend on the way to them.
    let output = run(&["static", &held, "--branches"]);
    let (code, _, err) = texts(&output);
    assert_eq!(code, Some(2));
    assert!(err.contains("knows elastic joints alone"), "{err}");
}

//! Runs the built program.
// Each test file uses some of it.
#![allow(dead_code)]

use std::process::{Command, Output, Stdio};

use cosserat::scene;
use serde_json::Value;

/// A scene of a cable between two grips, which the learned start knows.
pub(crate) const CABLE_BETWEEN_GRIPS: &str = r#"
[[rods]]
name = "cable"
radius_m = 0.004
youngs_modulus_pa = 2e7
torsion_modulus_pa = 8e6
density_kg_m3 = 1500
clamp = ["start-face", "end-face"]
shape.hung = { to_m = [0.5, 0.1, 0.1], length_m = 0.8, segments = 60, start_direction = [1, 0, 0.5], end_direction = [1, 0.3, 0] }
"#;

/// The names of `simulate list`.
pub(crate) fn builtin_names() -> Vec<&'static str> {
    scene::builtins().iter().map(|builtin| builtin.name).collect()
}

/// The program with these arguments, ready to run.
pub(crate) fn simulate(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_simulate"));
    command.args(arguments).stdin(Stdio::null());
    command
}

/// Runs to the end.
pub(crate) fn run(arguments: &[&str]) -> Output {
    simulate(arguments).output().expect("the program starts")
}

/// Sends what Ctrl-C sends.
#[cfg(unix)]
pub(crate) fn interrupt(id: u32) {
    let status = Command::new("kill").args(["-INT", &id.to_string()]).status().expect("kill starts");
    assert!(status.success());
}

/// Exit code, standard output, standard error.
pub(crate) fn texts(output: &Output) -> (Option<i32>, &str, &str) {
    let text = |bytes| std::str::from_utf8(bytes).expect("UTF-8");
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

/// Runs that end well and say nothing.
pub(crate) fn runs(arguments: &[&str]) {
    assert_eq!(texts(&run(&[arguments, &["--quiet"]].concat())), (Some(0), "", ""), "{arguments:?}");
}

/// The error of a run that bad input ends.
pub(crate) fn refused(arguments: &[&str]) -> String {
    let output = run(arguments);
    let (code, _, err) = texts(&output);
    assert_eq!(code, Some(2), "{arguments:?}: {err}");
    err.to_owned()
}

/// The one JSON object that a run with `--json` prints, after a check that all went well.
pub(crate) fn json(arguments: &[&str]) -> Value {
    let output = run(&[arguments, &["--json"]].concat());
    let (code, out, err) = texts(&output);
    assert_eq!((code, err), (Some(0), ""), "{arguments:?}");
    let value: Value = serde_json::from_str(out).unwrap_or_else(|error| panic!("{arguments:?}: {error}\n{out}"));
    assert!(value.is_object(), "{arguments:?}");
    value
}

/// Every number in a JSON value, with its path; `null` is what a number that is not finite becomes.
pub(crate) fn nulls(value: &Value, path: &str) -> Vec<String> {
    match value {
        Value::Null => vec![path.to_owned()],
        Value::Object(entries) => entries.iter().flat_map(|(k, v)| nulls(v, &format!("{path}.{k}"))).collect(),
        Value::Array(items) => items.iter().flat_map(|v| nulls(v, &format!("{path}[]"))).collect(),
        _ => Vec::new(),
    }
}

/// A scene of 40 rods of two kinds side by side: 20 of 12 segments, 20 of 9.
pub(crate) fn many_rods() -> String {
    let mut text = "[run]\ndt_s = 0.02\nsteps = 25\n".to_owned();
    for k in 0..40 {
        let (segments, stiffness) = if k % 2 == 0 { (12, "1e5") } else { (9, "3e6") };
        text += &format!(
            "\n[[rods]]\nclamp = [\"start-segment\"]\nyoungs_modulus_pa = {stiffness}\nradius_m = {}\n\
             shape.straight = {{ start_m = [0, {k}, 0], direction = [1, 0.02, {}], length_m = 2, segments = {segments} }}\n",
            0.03 + 0.001 * k as f64,
            0.05 * k as f64 - 1.0,
        );
    }
    text
}

/// Whether a scene has nothing but what the rods have that networks learned from.
pub(crate) fn learned_from(name: &str) -> bool {
    scene::builtin(name).expect("a scene").model.beyond_the_paper().is_none()
}

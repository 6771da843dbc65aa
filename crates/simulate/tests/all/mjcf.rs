//! Files of MuJoCo's: what they make is the right shape, also as a scene's file, and a mistake names its line and element.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::common::{json, refused, run, runs, texts};

/// A boom of polyurethane that is clamped at its start and sags, in segments; nothing touches it.
const BOOM: &str = r#"<mujoco>
  <option timestep="0.005"/>
  <worldbody>
    <body name="wall" pos="0 0 1" euler="0 0 90">
      <composite type="cable" curve="s" count="SEGMENTS 1 1" size="1" initial="none">
        <plugin plugin="mujoco.elasticity.cable">
          <config key="twist" value="1e7"/>
          <config key="bend" value="3e7"/>
        </plugin>
        <joint kind="main" damping="0.05"/>
        <geom type="cylinder" size="0.01" density="1100" contype="0" conaffinity="0"/>
      </composite>
    </body>
  </worldbody>
</mujoco>
"#;

fn boom(folder: &Path, segments: usize) -> String {
    let path = folder.join(format!("boom-{segments}.xml"));
    fs::write(&path, BOOM.replace("SEGMENTS", &(segments + 1).to_string())).expect("a file");
    path.to_str().expect("UTF-8").to_owned()
}

/// Where the end of a rod comes to rest [m].
fn tip(scene: &str) -> [f64; 3] {
    let found = json(&["static", scene]);
    assert_eq!(found["converged"], true);
    let numbers: Vec<f64> = found["tips_m"][0].as_array().expect("a tip").iter().filter_map(Value::as_f64).collect();
    numbers.try_into().expect("three numbers")
}

/// How far out, and how far down, the end of a level cantilever of this length [m] sags under its weight: the elastica
/// `EI theta'' = w (L - s) cos theta`, clamped at s = 0 and free at s = L, by Runge and Kutta's method and bisection.
fn elastica(length: f64) -> [f64; 2] {
    // Of the boom: rho A g over E I [1/m^3].
    let load = 4.0 * 1100.0 * 9.81 / (3e7 * 0.01_f64.powi(2));
    let steps = 2000;
    let h = length / f64::from(steps);
    let slope = |s: f64, [theta, curvature, ..]: [f64; 4]| {
        [curvature, load * (length - s) * theta.cos(), theta.cos(), theta.sin()]
    };
    let add = |a: [f64; 4], b: [f64; 4], factor: f64| std::array::from_fn(|k| a[k] + factor * b[k]);
    let end = |curvature: f64| {
        let mut state = [0.0, curvature, 0.0, 0.0];
        for step in 0..steps {
            let s = f64::from(step) * h;
            let first = slope(s, state);
            let second = slope(s + 0.5 * h, add(state, first, 0.5 * h));
            let third = slope(s + 0.5 * h, add(state, second, 0.5 * h));
            let fourth = slope(s + h, add(state, third, h));
            state =
                std::array::from_fn(|k| state[k] + h / 6.0 * (first[k] + 2.0 * second[k] + 2.0 * third[k] + fourth[k]));
        }
        state
    };
    let (mut low, mut high) = (-0.5 * load * length.powi(2), 0.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if end(middle)[1] > 0.0 { high = middle } else { low = middle }
    }
    let [.., out, up] = end(0.5 * (low + high));
    [out, up]
}

/// The shape is that of the elastica. As in MuJoCo, the first segment is held as a whole, and so the boom is clamped at its middle:
/// seen from there, the error falls with the square of the segments' length, and with 160 segments the end is nearer to where a
/// boom that is clamped at its start has it than 1 % of the length.
#[test]
fn a_boom_sags_to_the_elastica() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut errors = Vec::new();
    for segments in [20, 40, 160] {
        let [x, y, z] = tip(&boom(folder.path(), segments));
        assert!(x.abs() < 1e-9, "{x}: out of the plane in which it hangs");
        let held = 0.5 / segments as f64;
        let [out, up] = elastica(1.0 - held);
        errors.push((y - held - out).hypot(z - 1.0 - up));
        let [out, up] = elastica(1.0);
        let off = (y - out).hypot(z - 1.0 - up);
        assert!(off < if segments == 160 { 0.01 } else { 1.5 / segments as f64 }, "{segments}: {off}");
    }
    assert!(errors[1] < 1e-3, "{errors:?}");
    assert!(errors[1] < 0.3 * errors[0] && errors[2] < 0.1 * errors[1], "{errors:?}");
}

/// A run comes to rest in that shape, and the scene's file that is written is the same scene.
#[test]
fn a_run_and_the_file_that_is_written_agree() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = boom(folder.path(), 20);
    let scene = folder.path().join("scenes");
    fs::create_dir(&scene).expect("a folder");
    let scene = scene.join("boom-20.toml");
    let scene = scene.to_str().expect("UTF-8");
    let output = run(&["convert", &file, "--out", scene]);
    assert_eq!(texts(&output), (Some(0), "", ""));
    let printed = run(&["convert", &file]);
    let (code, text, err) = texts(&printed);
    assert_eq!((code, text, err), (Some(0), fs::read_to_string(scene).expect("a scene").as_str(), ""));
    assert_eq!(tip(&file), tip(scene));
    // It is never written over.
    let error = refused(&["convert", &file, "--out", scene]);
    assert!(error.starts_with("error: --out ") && error.contains("it exists already"), "{error}");

    let out = folder.path().join("out");
    let out = out.to_str().expect("UTF-8");
    runs(&[&file, "--steps", "2000", "--set", "damping.linear_per_s=2", "--trajectory", "--out", out]);
    let kept = fs::read_to_string(Path::new(out).join("run-scene.toml")).expect("the scene");
    assert!(kept.contains("youngs_modulus_pa"), "{kept}");
    let moved = json(&["static", &file, "--from", out]);
    let start = moved["energy_start_j"].as_f64().expect("an energy");
    let rest = moved["energy_end_j"].as_f64().expect("an energy");
    assert!(start - rest < 1e-6 * rest.abs(), "{start} J at the end of the run, {rest} J at rest");
}

/// One line with file, line, element, attribute, value and what is allowed; also where the scene's reader finds the mistake.
#[test]
fn a_mistake_names_its_element() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("boom.xml");
    let name = path.to_str().expect("UTF-8");
    let error = |from: &str, to: &str| {
        assert!(BOOM.contains(from));
        fs::write(&path, BOOM.replace("SEGMENTS", "11").replace(from, to)).expect("a file");
        let error = refused(&[name]);
        assert_eq!(error.lines().count(), 1, "{error}");
        assert_eq!(refused(&["convert", name]), error);
        error.trim_end().to_owned()
    };
    assert_eq!(
        error("size=\"0.01\"", "size=\"-0.01\""),
        format!("error: {name}:11: <geom> size = \"-0.01\", but it must be > 0 [m]")
    );
    assert_eq!(
        error("</worldbody>", "</worldbody><tendon><spatial/></tendon>"),
        format!("error: {name}:14: <spatial>: tendons are not read")
    );
    let found = error("size=\"0.01\"", "size=\"1e-60\"");
    assert!(
        found.starts_with(&format!("error: {name}:5: <composite>: the scene that it makes is wrong: rods[0]")),
        "{found}"
    );
    let missing = folder.path().join("none.xml");
    let error = refused(&[missing.to_str().expect("UTF-8")]);
    assert!(error.starts_with("error: cannot read the scene ") && error.contains("none.xml: No such file"), "{error}");
}

//! A program in C, compiled, linked and run, does what the same calls from Rust do.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use cosserat_c::handle::Handle;

const ROPE: &str = include_str!("../../examples/rope.toml");

/// The folder in which the library lies, beside the tests.
fn folder() -> PathBuf {
    let tests = std::env::current_exe().expect("a path");
    let folder = tests.parent().expect("a folder").to_owned();
    let library = folder.join(format!("{DLL_PREFIX}cosserat_c{DLL_SUFFIX}"));
    assert!(library.is_file(), "{} is missing", library.display());
    folder
}

fn succeeded(mut command: Command) -> String {
    let Output { status, stdout, stderr } = command.output().unwrap_or_else(|e| panic!("{command:?}: {e}"));
    assert!(status.success(), "{command:?}: {status}\n{}", String::from_utf8_lossy(&stderr));
    String::from_utf8(stdout).expect("text")
}

#[test]
fn a_program_in_c_pulls_a_rope_twice_from_the_same_moment() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let own = tempfile::tempdir().expect("a folder");
    let [scene, program] = ["rope.toml", "pull"].map(|name| own.path().join(name));
    std::fs::write(&scene, ROPE).expect("a file");

    let library = folder();
    let mut compile = Command::new("cc");
    compile.args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-I"]).arg(here.join("include"));
    compile.arg(here.join("examples/pull.c")).arg("-L").arg(&library).arg("-lcosserat_c");
    compile.arg(format!("-Wl,-rpath,{}", library.display())).arg("-o").arg(&program);
    succeeded(compile);
    let mut run = Command::new(&program);
    run.arg(&scene);
    let said = succeeded(run);

    let lines: Vec<Vec<f64>> =
        said.lines().map(|line| line.split(' ').map(|word| word.parse().expect("a number")).collect()).collect();
    assert_eq!(lines.len(), 3);
    assert_eq!(lines[0], lines[1], "going back gives the same bits");
    assert_eq!(lines[2], [0.0, 0.0], "the grip is back");

    let mut rope = Handle::open(scene.to_str().expect("text"), [None; 2]).expect("a scene");
    for _ in 0..50 {
        let mut pose = rope.grip(0).expect("a grip");
        pose[0] += 0.002;
        rope.send_grip(0, pose).expect("a pose");
        rope.step(0.01).expect("a step");
    }
    let [mut end, mut force] = [f64::NAN; 2];
    rope.poses(|i, pose| end = if i == 19 { pose[0] } else { end });
    rope.grip_forces(|_, own| force = own[0]);
    assert_eq!(lines[0], [0.5, lines[0][1], end, force]);
    // The grip has gone .1 m in .5 s; the rope hangs from it and follows.
    assert!((lines[0][1] - 0.1).abs() < 1e-12, "the last pose that it was sent to");
    assert!(end > 0.0 && end < 0.1, "{end}");
}

#[test]
fn a_grip_at_rest_bears_the_ropes_weight() {
    let own = tempfile::tempdir().expect("a folder");
    let scene = own.path().join("rope.toml");
    std::fs::write(&scene, ROPE).expect("a file");
    let mut rope = Handle::open(scene.to_str().expect("text"), [Some("newton"), Some("bdf2")]).expect("a scene");
    (0..10).for_each(|_| rope.step(0.0).expect("a step"));
    let weight = 1100.0 * std::f64::consts::PI * 0.005_f64.powi(2) * 9.81;
    let mut force = f64::NAN;
    rope.grip_forces(|_, own| force = own[2]);
    // It hangs straight from the start and stretches by 2e-3 of its length, which swings a little.
    assert!((force / weight - 1.0).abs() < 0.2, "{force} N for {weight} N");
    rope.set_gravity([0.0; 3]).expect("numbers");
    assert_eq!(rope.time(), 0.1);
}

/// The grip of a fixed segment bears its weight, too, whatever gravity and loads are set to on the way.
#[test]
fn grips_bear_what_is_set_from_the_next_step_on() {
    let own = tempfile::tempdir().expect("a folder");
    let scene = own.path().join("rope.toml");
    // The segment that is held has most of the mass.
    let text = "[[rods]]\nradius_m = 0.05\nyoungs_modulus_pa = 1e9\ntorsion_modulus_pa = 4e8\ndensity_kg_m3 = 1000\n\
                clamp = [\"start-segment\"]\nshape.straight = { direction = [0, 0, -1], length_m = 0.4, segments = 2 }\n\
                [[rods.loads]]\nsegment = 0\nforce_n = [0, 0, 0]\n";
    std::fs::write(&scene, text).expect("a file");
    let mut rod = Handle::open(scene.to_str().expect("text"), [Some("newton"), Some("bdf2")]).expect("a scene");
    let borne = |rod: &Handle| {
        let mut force = [f64::NAN; 3];
        rod.grip_forces(|_, own| force = [own[0], own[1], own[2]]);
        force
    };
    let settle = |rod: &mut Handle| (0..400).for_each(|_| rod.step(0.01).expect("a step"));
    let mass = 1000.0 * std::f64::consts::PI * 0.05_f64.powi(2) * 0.4;
    let near = |found: [f64; 3], wanted: [f64; 3]| {
        (0..3).for_each(|k| assert!((found[k] - wanted[k]).abs() < 1e-3 * mass, "{found:?} N, wanted {wanted:?} N"));
    };
    settle(&mut rod);
    near(borne(&rod), [0.0, 0.0, 9.81 * mass]);
    let before = rod.snapshot();
    rod.set_gravity([0.0, 0.0, -2.0]).expect("numbers");
    rod.set_load(0, [0.0, 7.0, 0.0, 0.0, 0.0, 0.0]).expect("a load");
    near(borne(&rod), [0.0, 0.0, 9.81 * mass]);
    settle(&mut rod);
    near(borne(&rod), [0.0, -7.0, 2.0 * mass]);
    rod.restore(&before).expect("its own");
    near(borne(&rod), [0.0, 0.0, 9.81 * mass]);
    settle(&mut rod);
    near(borne(&rod), [0.0, 0.0, 9.81 * mass]);
}

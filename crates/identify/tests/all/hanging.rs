//! Hanging wires: what photographs of them tell.

use std::path::{Path, PathBuf};
use std::process::Command;

use cosserat::statics::{StaticParams, equilibrium};
use identify::hanging::{Bent, Photograph, Wire, bending, critical_twist, read, twist_ratio};
use nalgebra::{Vector2, Vector3};

/// A wire of the recordings in `data/hanging-wires`.
struct Published {
    name: &'static str,
    /// Mass per length [kg/m].
    line_density: f64,
    /// EI [N m^2] and GJ / EI.
    stiffness: [f64; 2],
    /// Mean of the turns at which it snapped [deg].
    twist: f64,
}

const PUBLISHED: [Published; 3] = [
    Published { name: "white", line_density: 0.087 / 5.0, stiffness: [1.2166e-4, 0.823], twist: 975.0 },
    Published { name: "black", line_density: 0.081 / 2.98, stiffness: [1.1965e-3, 1.462], twist: 482.0 },
    Published { name: "red", line_density: 0.043 / 2.0, stiffness: [9.297e-4, 1.638], twist: 450.0 },
];

const LENGTH: f64 = 1.5;

/// The published wire has 50 segments between its grips, and at each grip a joint as between two of them, which yields half a
/// segment more than a rigid grip.
const GRIP: f64 = LENGTH / 50.0 / 2.0;

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/hanging-wires").join(name)
}

impl Published {
    fn wire(&self, grip: f64) -> Wire {
        Wire { line_density: self.line_density, length: LENGTH, grip, segments: 200 }
    }

    fn photographs(&self) -> Vec<Photograph> {
        (0..5).map(|k| read(&file(&format!("{}-{k}.csv", self.name))).unwrap()).collect()
    }

    fn bent(&self, grip: f64) -> Vec<Bent> {
        self.photographs().iter().map(|photograph| bending(&self.wire(grip), photograph).unwrap()).collect()
    }
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    values.sum::<f64>() / count
}

fn mean_bending(bent: &[Bent]) -> f64 {
    mean(bent.iter().map(|bent| bent.bending))
}

#[test]
fn photographs_tell_the_published_stiffness_of_bending() {
    for published in PUBLISHED {
        let bent = published.bent(GRIP);
        let ratio = mean_bending(&bent) / published.stiffness[0];
        let off = bent.iter().map(|bent| bent.mean_distance() / LENGTH).fold(0.0, f64::max);
        println!("{}: EI {ratio:.3} of the published, points off by at most {off:.4} of the length", published.name);
        assert!((ratio - 1.0).abs() < 0.1, "{}: {ratio}", published.name);
        assert!(off < 0.02, "{}: {off}", published.name);
    }
}

/// Photographs do not tell how much the grips yield: rigid ones fit as well, with less stiffness.
#[test]
fn rigid_grips_fit_as_well() {
    for published in PUBLISHED {
        let [soft, rigid] = [GRIP, 0.0].map(|grip| published.bent(grip));
        let ratio = mean_bending(&rigid) / mean_bending(&soft);
        let [soft, rigid] = [soft, rigid].map(|bent| mean(bent.iter().map(|bent| bent.mean_distance() / LENGTH)));
        println!("{}: EI {ratio:.3}, points off by {rigid:.4} and {soft:.4} of the length", published.name);
        assert!((0.5..0.9).contains(&ratio), "{}: {ratio}", published.name);
        assert!((soft - rigid).abs() < 0.003, "{}: {soft} and {rigid}", published.name);
    }
}

#[test]
fn the_twist_at_which_a_wire_snaps_tells_the_published_stiffness_of_twist() {
    for published in PUBLISHED {
        let (wire, photographs) = (published.wire(GRIP), published.photographs());
        let own = mean_bending(&published.bent(GRIP));
        let ratio = twist_ratio(&wire, &photographs[0], own, published.twist.to_radians()).unwrap();
        println!("{}: GJ / EI {ratio:.3}", published.name);
        assert!((ratio / published.stiffness[1] - 1.0).abs() < 0.1, "{}: {ratio}", published.name);
        let twist = critical_twist(&wire, &photographs[0], own, ratio, 30.0).unwrap().unwrap();
        assert!((twist.to_degrees() / published.twist - 1.0).abs() < 2e-3, "{}: {twist}", published.name);
    }
}

/// A wire that hangs by a known stiffness is found again.
#[test]
fn a_known_stiffness_is_found_again() {
    let wire = PUBLISHED[1].wire(0.0);
    let like = &PUBLISHED[1].photographs()[0];
    let (model, mut state) = wire.model(like, 7e-4, 1.0).unwrap();
    assert!(equilibrium(&model, &mut state, &StaticParams::default()).unwrap().converged);
    let end = |i: usize, side: f64| state.positions[i] + state.axis(i) * (side * model.segments[i].length);
    let nodes: Vec<Vector3<f64>> = [end(0, -0.5)].into_iter().chain((0..state.len()).map(|i| end(i, 0.5))).collect();
    assert!(nodes.iter().all(|node| node.y.abs() < 1e-9));
    let points = nodes.iter().map(|node| Vector2::new(node.x, node.z)).collect();
    let bent = bending(&wire, &Photograph { path: "known".into(), points }).unwrap();
    assert!((bent.bending / 7e-4 - 1.0).abs() < 1e-6, "{bent:?}");
    assert!(bent.mean_distance() < 1e-7 * LENGTH);
}

fn hanging(arguments: &[&str]) -> (Option<i32>, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_identify")).arg("hanging").args(arguments).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout) + &text(&output.stderr))
}

#[test]
fn the_program_prints_what_it_finds() {
    let shape = file("white-0.csv").display().to_string();
    let (code, text) = hanging(&[&shape, "--mass-kg-m", "0.0174", "--length-m", "1.5", "--twist-deg", "975"]);
    assert_eq!(code, Some(0), "{text}");
    assert!(text.contains("EI ") && text.contains("GJ / EI "), "{text}");
}

#[test]
fn bad_input_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let cases = [
        ("x,y\n0,0\n", "columns must be x_m and z_m"),
        ("x_m,z_m\n0,0\n1,a\n", "point 1: \"a\" must be a finite number"),
        ("x_m,z_m\n0,0\n1,0\n", "2 points, but there must be 5 or more"),
        ("x_m,z_m\n0,0\n1,0\n1,0\n2,0\n3,0\n", "points 1 and 2 are the same"),
        ("x_m,z_m\n0,0\n300,0\n400,0\n500,0\n600,0\n", "a wire 600 m long"),
    ];
    for (text, message) in cases {
        let path = folder.path().join("shape.csv");
        std::fs::write(&path, text).unwrap();
        let path = path.display().to_string();
        let (code, told) = hanging(&[&path, "--mass-kg-m", "0.02"]);
        assert!(code == Some(2) && told.contains(message) && told.contains(&path), "{told}");
    }
    let shape = file("white-0.csv").display().to_string();
    let (code, told) = hanging(&[&shape, "--mass-kg-m", "0.02", "--length-m", "0.1"]);
    assert!(code == Some(2) && told.contains("white-0.csv: a wire 0.1 m long does not reach"), "{told}");
    let (code, told) = hanging(&[&shape, "--mass-kg-m", "0"]);
    assert!(code == Some(2) && told.contains("--mass-kg-m"), "{told}");
}

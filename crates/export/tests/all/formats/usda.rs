//! USD by the crate `openusd`.

use std::f64::consts::PI;
use std::path::Path;

use export::{Format, Names};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use openusd::gf::{Quatf, Vec3f};
use openusd::sdf::Value;
use openusd::tf::Token;
use openusd::usd::{Prim, Stage, TimeCode};
use rod::{Assembly, Material, RodSpec, shape};

use super::obstacles::{among_obstacles, off};
use super::runs::{Run, runs, straight, weighted};

/// Single precision, of a scene of some metres.
const ROUNDING: f64 = 2e-6;

fn open(run: &Run, directory: &Path) -> Stage {
    let made = run.export(Format::Usda, directory);
    assert_eq!(made, [directory.join("run.usda")]);
    let stage = Stage::open(made[0].to_str().unwrap()).unwrap();
    assert!(stage.composition_errors().is_empty());
    assert_eq!(stage.default_prim().unwrap().as_str(), "Run");
    assert_eq!((stage.start_time_code(), stage.end_time_code()), (0.0, run.times.len() as f64 - 1.0));
    stage
}

fn vectors(prim: &Prim, name: &str, code: Option<usize>) -> Vec<Vector3<f64>> {
    let attribute = prim.attribute(name);
    let values: Vec<Vec3f> = match code {
        Some(code) => attribute.get_at(TimeCode::new(code as f64)).unwrap().unwrap(),
        None => attribute.get().unwrap().unwrap(),
    };
    values.iter().map(|v| Vector3::new(v.x, v.y, v.z).map(f64::from)).collect()
}

/// Nodes of each curve.
fn counts(curves: &Prim) -> Vec<i32> {
    match curves.attribute("curveVertexCounts").get::<Value>().unwrap() {
        Some(Value::IntVec(counts)) => counts,
        other => panic!("{other:?}"),
    }
}

fn float(prim: &Prim, name: &str) -> Option<f64> {
    prim.attribute(name).get::<f32>().unwrap().map(f64::from)
}

fn token(prim: &Prim, name: &str) -> String {
    prim.attribute(name).get::<Token>().unwrap().unwrap().as_str().to_owned()
}

fn is_near(found: f64, expected: f64) -> bool {
    (found - expected).abs() <= 1e-6 * expected.abs()
}

#[test]
fn curves_are_the_rods_in_each_frame() {
    for run in runs() {
        let place = tempfile::tempdir().unwrap();
        let stage = open(&run, place.path());
        if run.times.len() > 1 {
            assert_eq!((stage.time_codes_per_second(), stage.frames_per_second()), (10.0, 10.0), "{}", run.name);
        }
        for (rod, line) in run.lines.iter().enumerate() {
            let curves = stage.prim(format!("/Run/rod_{rod}/rod_{rod}").as_str());
            let is_closed = line[0] == line[line.len() - 1];
            let nodes = &line[..line.len() - usize::from(is_closed)];
            assert_eq!(curves.type_name().unwrap().unwrap().as_str(), "BasisCurves");
            assert_eq!(token(&curves, "wrap"), if is_closed { "periodic" } else { "nonperiodic" });
            assert_eq!(counts(&curves), [nodes.len() as i32]);
            let widths: Vec<f32> = curves.attribute("widths").get().unwrap().unwrap();
            assert_eq!(widths.len(), nodes.len());
            for (frame, state) in run.states.iter().enumerate() {
                let places = vectors(&curves, "points", Some(frame));
                assert_eq!(places.len(), nodes.len());
                for ((place, width), &node) in places.iter().zip(&widths).zip(nodes) {
                    let (expected, radius) = run.node(state, node);
                    assert!((place - expected).norm() < ROUNDING, "{}, frame {frame}, node {node}", run.name);
                    assert!(is_near(f64::from(*width), 2.0 * radius));
                }
            }
            // All these rods are at rest as they are drawn.
            let rest = vectors(&curves, "physics:restShapePoints", None);
            for (place, &node) in rest.iter().zip(nodes) {
                assert!((place - run.node(&run.states[0], node).0).norm() < ROUNDING, "{}, node {node}", run.name);
            }
        }
    }
}

#[test]
fn materials_are_what_the_section_gives() {
    let (place, run) = (tempfile::tempdir().unwrap(), straight(2));
    let stage = open(&run, place.path());
    let rod = stage.prim("/Run/rod_0");
    assert!(rod.has_api_schema("PhysicsDeformableBodyAPI").unwrap());
    assert!(stage.prim("/Run/rod_0/rod_0").has_api_schema("PhysicsCurvesDeformableSimAPI").unwrap());
    let material = stage.prim("/Run/rod_0_material");
    assert!(material.has_api_schema("PhysicsCurvesDeformableMaterialAPI").unwrap());
    // A radius of 0.1 m, a length of 2 m, 1e6 Pa, 5e5 Pa, 1e3 kg/m^3.
    let expected = [
        (&rod, "physics:mass", 1e3 * 2.0 * PI * 0.01),
        (&material, "physics:curvesThickness", 0.2),
        (&material, "physics:curvesBendStiffness", 1e6 * PI * 1e-4 / 4.0),
        (&material, "physics:curvesTwistStiffness", 5e5 * PI * 1e-4 / 2.0),
    ];
    for (prim, name, expected) in expected {
        let found = float(prim, name).unwrap();
        assert!(is_near(found, expected), "{name}: {found} {expected}");
    }
}

/// What varies along a rod has no single number.
#[test]
fn a_taper_has_no_single_stiffness() {
    let run = runs().into_iter().find(|run| run.name == "clamped").unwrap();
    let place = tempfile::tempdir().unwrap();
    let material = open(&run, place.path()).prim("/Run/rod_0_material");
    for name in ["Thickness", "BendStiffness", "TwistStiffness"] {
        assert_eq!(float(&material, &format!("physics:curves{name}")), None, "{name}");
    }
}

/// An entry of the scene with many rods is one prim, and names that are no identifiers become some.
#[test]
fn strands_are_curves_of_one_prim() {
    let mut assembly = Assembly::new(Vector3::zeros());
    let material = Material { youngs_modulus: 1e6, torsion_modulus: 5e5, density: 1e3 };
    for k in 0..4 {
        let nodes = shape::straight(Vector3::new(k as f64, 0.0, 0.0), Vector3::z(), 1.0, 2 + k / 2);
        assembly.rod(&RodSpec::new(nodes, 0.01, material));
    }
    let mut run = straight(2);
    let (model, state) = assembly.finish();
    let names = ["hair/0", "hair/1", "2 \"loose\" ends", "hair"].map(str::to_owned);
    run.called = Names::new(&model, &names, &[]);
    run.states = vec![state.clone(), state];
    run.model = model;
    let place = tempfile::tempdir().unwrap();
    let stage = open(&run, place.path());
    let count = |path: &str| counts(&stage.prim(path));
    assert_eq!(count("/Run/hair/hair"), [3, 3]);
    assert_eq!(count("/Run/_2__loose__ends/_2__loose__ends"), [4]);
    assert_eq!(count("/Run/hair_2/hair_2"), [4]);
    let places = vectors(&stage.prim("/Run/hair/hair"), "points", Some(1));
    assert_eq!(places[3..], [0.0, 0.5, 1.0].map(|z| Vector3::new(1.0, 0.0, z)));
    // The mass is that of both.
    let mass = float(&stage.prim("/Run/hair"), "physics:mass").unwrap();
    assert!(is_near(mass, 2e3 * PI * 1e-4), "{mass}");
    // A rod that is called as another's material has a prim of its own.
    let names = ["rope", "rope_material", "a", "b"].map(str::to_owned);
    run.called = Names::new(&run.model, &names, &[]);
    let stage = open(&run, place.path());
    assert_eq!(stage.prim("/Run/rope_material").type_name().unwrap().unwrap().as_str(), "Material");
    assert_eq!(counts(&stage.prim("/Run/rope_material_2/rope_material_2")), [3]);
}

/// Where a mesh's vertices are in a frame [m].
fn vertices(mesh: &Prim, frame: usize) -> Vec<Vector3<f64>> {
    assert_eq!(mesh.type_name().unwrap().unwrap().as_str(), "Mesh");
    let at = TimeCode::new(frame as f64);
    let place: Vec3f = mesh.attribute("xformOp:translate").get_at(at).unwrap().unwrap();
    let turn: Quatf = mesh.attribute("xformOp:orient").get_at(at).unwrap().unwrap();
    let turn = UnitQuaternion::new_normalize(Quaternion::new(turn.w, turn.x, turn.y, turn.z).cast::<f64>());
    let place = Vector3::new(place.x, place.y, place.z).map(f64::from);
    vectors(mesh, "points", None).iter().map(|own| place + turn * own).collect()
}

#[test]
fn rigid_bodies_are_meshes_that_move() {
    let (place, run) = (tempfile::tempdir().unwrap(), weighted(3));
    let stage = open(&run, place.path());
    for (frame, state) in run.states.iter().enumerate() {
        let ball = vertices(&stage.prim("/Run/body_0"), frame);
        assert!(!ball.is_empty() && ball.iter().all(|x| ((x - state.positions[0]).norm() - 0.25).abs() < ROUNDING));
        for corner in vertices(&stage.prim("/Run/body_1"), frame) {
            let own = (state.orientations[1].inverse() * (corner - state.positions[1])).abs();
            assert!((own - Vector3::new(0.1, 0.2, 0.3)).norm() < ROUNDING, "frame {frame}");
        }
    }
    assert!(!stage.prim("/Run/body_2").is_valid().unwrap(), "a hidden body is not drawn");
}

#[test]
fn obstacles_are_meshes_where_their_motions_have_them() {
    let (place, run) = (tempfile::tempdir().unwrap(), among_obstacles());
    let stage = open(&run, place.path());
    for (k, obstacle) in run.model.contacts.obstacles.iter().enumerate() {
        let mesh = stage.prim(format!("/Run/obstacle_{k}").as_str());
        let moves = mesh.attribute("xformOp:translate").num_time_samples().unwrap();
        assert_eq!(moves, if obstacle.motion.is_some() { run.times.len() } else { 0 });
        for (frame, &time) in run.times.iter().enumerate() {
            for place in vertices(&mesh, frame) {
                assert!(off(obstacle, time, &place) < 1e-5, "obstacle {k}, frame {frame}");
            }
        }
    }
}

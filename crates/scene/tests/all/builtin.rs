//! The scenes that come with the program are all there, pass validation, and are what their descriptions say.

use std::collections::BTreeSet;

use nalgebra::Vector3;
use rod::measure;

fn scenes_folder() -> std::path::PathBuf {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes")
}

#[test]
fn every_file_is_builtin_and_every_builtin_is_valid() {
    let files: BTreeSet<String> = std::fs::read_dir(scenes_folder())
        .unwrap()
        .map(|entry| entry.unwrap().path().file_stem().unwrap().to_str().unwrap().to_owned())
        .collect();
    let builtins = scene::builtins();
    let names: BTreeSet<String> = builtins.iter().map(|builtin| builtin.name.to_owned()).collect();
    assert!(files.is_subset(&names), "{:?}", files.difference(&names));
    // Heaps of other sizes than the file's.
    assert_eq!(names.difference(&files).collect::<Vec<_>>(), ["heap-320", "heap-5", "heap-80"]);
    for builtin in builtins {
        let scene = scene::builtin(builtin.name).unwrap();
        scene.model.validate(&scene.state).unwrap();
        assert_eq!((scene.name.as_str(), &scene.description), (builtin.name, &builtin.description));
        assert!(!scene.description.is_empty(), "{}", scene.name);
        // A taut string's joints are its strain apart.
        let strain = if scene.name == "plucked-string" {
            73.0 / (2e11 * std::f64::consts::PI * 0.000127f64.powi(2))
        } else {
            0.0
        };
        assert!((measure::worst_gap(&scene.model, &scene.state) - strain).abs() < 1e-6, "{}", scene.name);
        let last = scene.rods.last().unwrap().segments.end;
        assert_eq!(last, scene.model.segments.len());
        for (i, rod) in scene.rods.iter().enumerate() {
            assert!(scene.model.segments[rod.segments.clone()].iter().all(|s| s.rod == i));
        }
    }
}

#[test]
fn a_file_gives_the_same_scene_as_the_builtin() {
    let path = scenes_folder().join("helix.toml");
    assert_eq!(scene::load(path).unwrap(), scene::builtin("helix").unwrap());
}

#[test]
fn an_unknown_builtin_lists_the_known_ones() {
    let error = scene::builtin("helx").unwrap_err().to_string();
    assert!(
        error.starts_with(
            "there is no builtin scene `helx`; did you mean `helix`? (there are bending-rod, helix, helix-on-plane, "
        ),
        "{error}"
    );
}

#[test]
fn a_missing_file_is_named() {
    let error = scene::load("no/such/file.toml").unwrap_err().to_string();
    assert!(error.starts_with("no/such/file.toml: "), "{error}");
}

#[test]
fn validation_scenes_have_the_numbers_of_their_references() {
    let stiffness = |scene: &scene::Scene| {
        let segment = &scene.model.segments[0];
        let section = rod::Section::Circle { radius: segment.radius };
        let joint = scene.model.joints[0];
        (joint.youngs_modulus * section.second_moments()[0], joint.torsion_modulus * section.torsion_constant())
    };
    let close = |value: f64, expected: f64| assert!((value / expected - 1.0).abs() < 1e-6, "{value} != {expected}");
    let force = |scene: &scene::Scene| scene.model.loads[0].force.norm();

    let scene = scene::builtin("small-cantilever").unwrap();
    close(force(&scene) / (3.0 * stiffness(&scene).0), 1e-3);
    let scene = scene::builtin("elastica").unwrap();
    close(force(&scene) / stiffness(&scene).0, 1.0);
    let scene = scene::builtin("roll-up").unwrap();
    close(scene.model.loads[0].torque.norm() / stiffness(&scene).0, std::f64::consts::TAU);
    let scene = scene::builtin("torsion-bar").unwrap();
    close(scene.model.loads[0].torque.norm() / stiffness(&scene).1, 1.0);
    let scene = scene::builtin("euler-buckling").unwrap();
    close(-scene.model.loads[0].force.z / stiffness(&scene).0, 1.1 * std::f64::consts::PI.powi(2) / 4.0);
    let scene = scene::builtin("heavy-cantilever").unwrap();
    let weight: f64 = scene.model.segments.iter().map(|s| s.mass()).sum::<f64>() * 9.81;
    close(weight / stiffness(&scene).0, 10.0);
    let scene = scene::builtin("bend-45").unwrap();
    close(stiffness(&scene).0, 1e7 / 12.0);
    close(stiffness(&scene).1, 5e6 / 6.0);
    let last = scene.model.segments.len() - 1;
    let tip = scene.state.positions[last] + scene.state.axis(last) * (0.5 * scene.model.segments[last].length);
    close(tip.x, 100.0 * (1.0 - 0.5f64.sqrt()));
    close(tip.y, 100.0 * 0.5f64.sqrt());
    let scene = scene::builtin("michell-ring").unwrap();
    let (bending, torsion) = stiffness(&scene);
    let twist = scene.model.joints[0].rest_darboux.norm();
    close(twist, 1.05 * 3f64.sqrt() * bending / torsion);
    let balance: rod::Load = scene.model.loads.iter().skip(1).fold(scene.model.loads[0], |mut sum, load| {
        sum.force += load.force;
        sum
    });
    assert_eq!(balance.force.norm(), 0.0);
    let scene = scene::builtin("tip-mass").unwrap();
    close(scene.model.segments[29].added_mass / scene.model.segments[29].own_mass(), 1e4);
}

#[test]
fn trees_in_wind_have_the_papers_numbers() {
    let winds = [(10, 204), (20, 355), (40, 654), (70, 1061)].map(|(rods, segments)| {
        let scene = scene::builtin(&format!("tree-{rods}")).unwrap();
        assert_eq!((scene.rods.len(), scene.run.dt, scene.run.steps), (rods, 0.02, 300));
        let found = scene.model.segments.len();
        assert!((found as f64 / f64::from(segments) - 1.0).abs() < 0.02, "{found} segments for {segments}");
        // Every segment hangs on another, the first on the ground.
        assert_eq!((scene.model.joints.len(), scene.model.anchors.len()), (found, 1));
        scene.model.air.unwrap().wind
    });
    let at = |wind: &rod::Wind, t: f64| [Vector3::zeros(), Vector3::x() * 3.0].map(|x| wind.velocity(&x, t));
    let [steady, gusty, turning, _] = winds;
    assert_eq!(at(&steady, 0.0), at(&steady, 2.0));
    let [here, there] = at(&gusty, 0.0);
    assert!((here - there).norm() > 0.1 && here.dot(&at(&gusty, 3.0)[0]) > 0.0);
    assert!(at(&turning, 0.0)[0].dot(&at(&turning, 3.0)[0]) < 0.0);
}

#[test]
fn the_tree_is_one_connected_tree_of_a_thousand_rods() {
    let scene = scene::builtin("tree").unwrap();
    assert_eq!((scene.rods.len(), scene.model.segments.len()), (1000, 20 + 999 * 8));
    assert_eq!(scene.model.joints.len(), scene.model.segments.len() - 1);
    assert_eq!(scene.rods[999].name, "trunk/998");
    // Every segment but the first hangs on one that comes before it.
    let mut hangs = vec![false; scene.model.segments.len()];
    for joint in &scene.model.joints {
        let (rod::Body::Segment(a), rod::Body::Segment(b)) = (joint.a, joint.b) else { panic!("an anchor") };
        assert!(a < b && !std::mem::replace(&mut hangs[b], true));
    }
    assert!(hangs[1..].iter().all(|&h| h));
    assert_eq!(scene, scene::builtin("tree").unwrap());
}

#[test]
fn the_knot_is_pulled_about_tight_and_not_beyond() {
    let scene = scene::builtin("knot").unwrap();
    assert_eq!(scene.model.segments.len(), 110);
    assert!((measure::rod_lengths(&scene.model, &scene.state)[0] - 11.0).abs() < 1e-9);
    let between_ends = |positions: &[nalgebra::Vector3<f64>]| (positions[109] - positions[0]).norm();
    let duration = scene.run.dt * scene.run.steps as f64;
    let last: Vec<_> =
        scene.state.positions.iter().zip(&scene.state.velocities).map(|(x, v)| x + v * duration).collect();
    // Between the centres of its fixed segments the rope is 10.9 m long.
    let (slack, left) = (10.9 - between_ends(&scene.state.positions), 10.9 - between_ends(&last));
    assert!((slack - 4.35).abs() < 0.01 && (left - 0.51).abs() < 0.01, "{slack} m, then {left} m");
}

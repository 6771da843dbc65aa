//! Mistakes in assembling a model: none panics, and validation names the first.

use nalgebra::Vector3;
use rod::{Assembly, Material, ModelError, RestShape, RodSpec, shape};

const SOFT: Material = Material { youngs_modulus: 1e5, torsion_modulus: 1e5, density: 100.0 };

/// A straight rod of four segments.
fn four() -> RodSpec {
    RodSpec::new(shape::straight(Vector3::zeros(), Vector3::x(), 1.0, 4), 0.05, SOFT)
}

/// What validation says of an assembly with one good rod of four segments, to which `step` was done.
fn mistake(step: impl FnOnce(&mut Assembly)) -> String {
    let mut assembly = Assembly::new(Vector3::zeros());
    assembly.rod(&four());
    step(&mut assembly);
    let (model, state) = assembly.finish();
    model.validate(&state).expect_err("a mistake").to_string()
}

#[test]
fn radii_are_one_or_one_a_segment() {
    for (count, ok) in [(0, false), (1, true), (2, false), (3, false), (4, true), (5, false)] {
        let mut assembly = Assembly::new(Vector3::zeros());
        let rod = assembly.rod(&RodSpec { radii: vec![0.01; count], ..four() });
        assert_eq!(rod.len(), if ok { 4 } else { 0 });
        let (model, state) = assembly.finish();
        assert_eq!(model.validate(&state).is_ok(), ok, "{count}");
    }
    let none = mistake(|assembly| _ = assembly.rod(&RodSpec { radii: Vec::new(), ..four() }));
    assert_eq!(none, "rod 1: 0 radii, but there must be 1, or one a segment (4)");
}

#[test]
fn rest_vectors_are_one_a_joint() {
    let rest = |count| RestShape::PerJoint(vec![Vector3::x(); count]);
    let short = mistake(|assembly| _ = assembly.rod(&RodSpec { rest: rest(2), ..four() }));
    assert_eq!(short, "rod 1: 2 rest Darboux vectors, but there must be one a joint (3)");
    let closed = RodSpec { closed: true, rest: rest(4), ..four() };
    let closed = mistake(|assembly| _ = assembly.rod(&closed));
    assert_eq!(closed, "rod 1: 4 rest Darboux vectors, but there must be one a joint (5)");
    let mut assembly = Assembly::new(Vector3::zeros());
    assembly.rod(&RodSpec { rest: rest(3), ..four() });
    let (model, state) = assembly.finish();
    model.validate(&state).unwrap();
    assert!(model.joints.iter().all(|joint| joint.rest_darboux == Vector3::x()));
}

#[test]
fn a_rod_has_two_nodes_or_more() {
    for nodes in [vec![], vec![Vector3::zeros()]] {
        for closed in [false, true] {
            let spec = RodSpec { nodes: nodes.clone(), closed, ..four() };
            let found = format!("rod 1: {} nodes, but there must be 2 or more", nodes.len());
            assert_eq!(mistake(|assembly| _ = assembly.rod(&spec)), found);
        }
    }
}

#[test]
fn clamps_and_branches_need_a_rod() {
    let empty = "clamp 3: 0 segments, but there must be 1 or more";
    let missing = "clamp 3: segment 4 does not exist (there are 4)";
    for none in [0..0, 4..4, 9..9] {
        assert_eq!(mistake(|assembly| _ = assembly.clamp_start(&none)), empty);
        assert_eq!(mistake(|assembly| _ = assembly.clamp_end(&none)), empty);
        assert_eq!(mistake(|assembly| _ = assembly.branch(0, 1.0, &none)), empty.replace("clamp", "branch"));
    }
    assert_eq!(mistake(|assembly| _ = assembly.clamp_end(&(0..5))), missing);
    assert_eq!(mistake(|assembly| _ = assembly.clamp_start(&(4..5))), missing);
    assert_eq!(mistake(|assembly| _ = assembly.branch(4, 1.0, &(0..4))), missing.replace("clamp", "branch"));
}

#[test]
fn no_step_takes_a_segment_that_does_not_exist() {
    let joint = "joint 3: segment 4 does not exist (there are 4)";
    assert_eq!(mistake(|assembly| _ = assembly.join(4, 1.0, 0, 0.0)), joint);
    assert_eq!(mistake(|assembly| _ = assembly.join(0, 1.0, 4, 0.0)), joint);
    assert_eq!(mistake(|assembly| _ = assembly.fix(4)), joint.replace("joint", "fixed segment"));
    assert_eq!(mistake(|assembly| _ = assembly.add_mass(4, 1.0)), joint.replace("joint", "added mass"));
}

#[test]
fn the_first_mistake_counts_and_the_rest_is_built() {
    let mut assembly = Assembly::new(Vector3::zeros());
    let rod = assembly.rod(&four());
    assembly.fix(7).fix(8).fix(0).clamp_end(&rod);
    let (model, state) = assembly.finish();
    assert!(model.segments[0].fixed && model.anchors.len() == 1);
    let first = ModelError::Index { what: "fixed segment", index: 3, target: "segment", to: 7, count: 4 };
    assert_eq!(model.validate(&state), Err(first));
}

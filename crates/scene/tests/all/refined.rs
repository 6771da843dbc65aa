//! A scene whose segments are cut into parts is the same scene.

use std::num::NonZeroUsize;

use nalgebra::Vector3;
use rod::{Body, Model, State, measure};
use scene::{Scene, builtin, builtin_refined, parse_refined};

fn factor(k: usize) -> NonZeroUsize {
    NonZeroUsize::new(k).unwrap()
}

/// Place [m] at an offset along a segment.
fn place(state: &State, segment: usize, offset: f64) -> Vector3<f64> {
    state.positions[segment] + state.axis(segment) * offset
}

/// Where joints hold that are not between neighbours of a rod [m], in the order of the model.
fn joined(scene: &Scene) -> Vec<Vector3<f64>> {
    let Scene { model, state, .. } = scene;
    let connects = |joint: &&rod::Joint| match (joint.a, joint.b) {
        (Body::Segment(a), Body::Segment(b)) => model.segments[a].rod != model.segments[b].rod,
        _ => true,
    };
    let at = |joint: &rod::Joint| match (joint.a, joint.b) {
        (Body::Anchor(k), _) | (_, Body::Anchor(k)) => model.anchors[k].position,
        (_, Body::Segment(b)) => place(state, b, joint.offset_b),
    };
    model.joints.iter().filter(connects).map(at).collect()
}

fn assert_near(found: &Vector3<f64>, expected: &Vector3<f64>, within: f64, what: &str) {
    assert!((found - expected).norm() <= within, "{what}: {found} instead of {expected}");
}

/// Sums that parts share: mass [kg], first moment of mass [kg m], momentum [kg m/s], load [N], torque [N m] about the origin.
fn sums(Scene { model, state, .. }: &Scene) -> (f64, [Vector3<f64>; 4]) {
    let each = |of: &dyn Fn(usize) -> Vector3<f64>| -> Vector3<f64> {
        (0..state.len()).map(|i| of(i) * model.segments[i].mass()).sum()
    };
    let torque = |load: &rod::Load| place(state, load.segment, load.offset).cross(&load.force) + load.torque;
    let vectors = [
        each(&|i| state.positions[i]),
        each(&|i| state.velocities[i]),
        model.loads.iter().map(|load| load.force).sum(),
        model.loads.iter().map(torque).sum(),
    ];
    (model.segments.iter().map(rod::Segment::mass).sum(), vectors)
}

fn assert_same(scene: &Scene, fine: &Scene, k: usize) {
    let name = &scene.name;
    let (model, state): (&Model, &State) = (&scene.model, &scene.state);
    fine.model.validate(&fine.state).unwrap();
    // Rigid bodies come first, and are not cut.
    let bodies = model.segments.iter().filter(|segment| segment.body.is_some()).count();
    let first = |i: usize| i.min(bodies) + k * i.saturating_sub(bodies);
    assert_eq!(fine.model.segments.len(), first(model.segments.len()), "{name}");
    assert_eq!((&fine.name, fine.run, &fine.obstacles), (&scene.name, scene.run, &scene.obstacles));
    let mut contacts = model.contacts.clone();
    for sheath in &mut contacts.sheaths {
        for rod in [&mut sheath.inner, &mut sheath.outer] {
            *rod = first(rod.start)..first(rod.end);
        }
    }
    assert_eq!((&fine.model.contacts, &fine.model.air), (&contacts, &model.air), "{name}");
    for (rod, cut) in scene.rods.iter().zip(&fine.rods) {
        assert_eq!((&rod.name, rod.closed), (&cut.name, cut.closed));
        assert_eq!(first(rod.segments.start)..first(rod.segments.end), cut.segments, "{name}");
    }
    let gaps = [scene, fine].map(|scene| measure::worst_gap(&scene.model, &scene.state));
    assert!((gaps[0] - gaps[1]).abs() < 1e-6, "{name}: {gaps:?}");
    // A knot and a chain are laid with segments of one length, so that their nodes are not those of longer segments. A
    // strained rod's segments do not fill the way between its nodes.
    let nodes_stay = !["knot", "hung-cable", "plucked-string"].contains(&name.as_str());
    for (i, segment) in model.segments.iter().enumerate() {
        let parts = &fine.model.segments[first(i)..first(i + 1)];
        assert!(parts.iter().all(|part| part.fixed == segment.fixed && part.rod == segment.rod), "{name}");
        let radius = parts.iter().map(|part| part.radius).sum::<f64>() / parts.len() as f64;
        assert!((radius / segment.radius - 1.0).abs() < 1e-12, "{name}: radius of segment {i}");
        let added: f64 = parts.iter().map(|part| part.added_mass).sum();
        assert!((added - segment.added_mass).abs() <= 1e-12 * segment.added_mass, "{name}: mass on segment {i}");
        if nodes_stay {
            let half = |part: usize, side: f64| place(&fine.state, part, side * fine.model.segments[part].length);
            let half_coarse = |side: f64| place(state, i, side * segment.length);
            let within = 1e-9 * segment.length.max(state.positions[i].norm());
            assert_near(&half(first(i), -0.5), &half_coarse(-0.5), within, name);
            assert_near(&half(first(i + 1) - 1, 0.5), &half_coarse(0.5), within, name);
        }
    }
    let (places, cut_places) = (joined(scene), joined(fine));
    assert_eq!(places.len(), cut_places.len(), "{name}");
    for (place, cut) in places.iter().zip(&cut_places) {
        assert_near(cut, place, 1e-9 * place.norm().max(1.0), name);
    }
    let ((mass, vectors), (cut_mass, cut_vectors)) = (sums(scene), sums(fine));
    // A curve is longer than its chords.
    let longer = 0.02;
    assert!((-1e-12..longer).contains(&(cut_mass / mass - 1.0)), "{name}: {cut_mass} kg instead of {mass} kg");
    let is_polygon = (cut_mass / mass - 1.0).abs() < 1e-12;
    for (vector, cut) in vectors.iter().zip(&cut_vectors) {
        let within = if is_polygon && nodes_stay { 1e-9 } else { longer };
        assert_near(cut, vector, within * vector.norm().max(mass), name);
    }
}

#[test]
fn all_builtin_scenes_keep_their_meaning() {
    for known in scene::builtins() {
        let scene = builtin(known.name).unwrap();
        for k in [2, 3] {
            assert_same(&scene, &builtin_refined(known.name, factor(k)).unwrap(), k);
        }
    }
}

#[test]
fn places_within_segments_stay_where_they_are() {
    let text = r#"
        [[rods]]
        name = "trunk"
        radius_m = 0.05
        fixed_segments = [0, 2]
        stretch = { compliance_m_per_n = 6e-6 }
        shape.polyline = { nodes_m = [[0, 0, 0], [0, 0, 1], [0.5, 0, 2], [1, 0, 4]] }
        masses = [{ segment = 1, mass_kg = 3 }]
        loads = [
            { segment = 1, fraction = 0.3, force_n = [1, 2, 3] },
            { segment = -1, fraction = 1, force_n = [0, 1, 0], torque_n_m = [1, 0, 0] },
            { segment = 0, force_n = [0, 0, 1] },
        ]
        velocity_m_s = [1, 0, 0]
        angular_velocity_rad_s = [0, 0, 2]
        velocities = [
            { segment = 1, angular_velocity_rad_s = [0, 3, 0] },
            { segment = -1, velocity_m_s = [0, 0, 7], angular_velocity_rad_s = [1, 0, 0] },
        ]

        [[rods]]
        name = "twig"
        radius_m = 0.02
        branch_of = { rod = "trunk", segment = 1, fraction = 0.7 }
        shape.straight = { length_m = 1, segments = 3 }

        [[rods]]
        name = "other"
        branch_of = { rod = "twig" }
        shape.straight = { length_m = 2, segments = 4 }
    "#;
    let scene = scene::parse(text, "places.toml").unwrap();
    for k in [2, 4, 5] {
        let fine = parse_refined(text, "places.toml", factor(k)).unwrap();
        assert_same(&scene, &fine, k);
        assert!((fine.model.joints[0].stretch_compliance * k as f64 / 6e-6 - 1.0).abs() < 1e-12);
        // The parts of a segment move as one rigid body.
        for (i, parts) in (0..fine.state.len()).collect::<Vec<_>>().chunks(k).enumerate() {
            for &part in parts {
                let arm = fine.state.positions[part] - scene.state.positions[i];
                let expected = scene.state.velocities[i] + scene.state.angular_velocities[i].cross(&arm);
                assert_near(&fine.state.velocities[part], &expected, 1e-12, "velocity");
                assert_eq!(fine.state.angular_velocities[part], scene.state.angular_velocities[i]);
            }
        }
    }
}

#[test]
fn a_twist_is_the_same_everywhere() {
    let text = "[[rods]]\ntwist_deg = 90\nshape.straight = { length_m = 4, segments = 10 }";
    let scene = scene::parse(text, "twist.toml").unwrap();
    let fine = parse_refined(text, "twist.toml", factor(3)).unwrap();
    for joint in scene.model.joints.iter().chain(&fine.model.joints) {
        let turn = 2.0 * (0.5 * joint.rest_darboux.z * joint.length).asin() / joint.length;
        assert!((turn / (90f64.to_radians() / 3.6) - 1.0).abs() < 1e-9);
    }
}

#[test]
fn too_many_parts_are_refused() {
    let error = builtin_refined("long-chain", factor(1000)).unwrap_err().to_string();
    assert!(error.contains("100000000 segments, but 10000000 are the most"), "{error}");
}

#[test]
fn lists_of_joints_and_pieces_stay_where_they_are() {
    let text = r#"
        [[rods]]
        shape.straight = { length_m = 4, segments = 4 }
        pieces = [
            { until = 0.25, section.circle.radius_m = 0.01 },
            { until = 0.75, section.rectangle = { width_m = 0.2, height_m = 0.04 } },
            { section.circle.radius_m = 0.03 },
        ]
        rest = { darboux_of_joints_per_m = [[0.1, 0, 0], [0.2, 0, 0], [0.3, 0, 0]] }

        [[rods]]
        shape.ring = { radius_m = 1, segments = 3 }
        rest = { darboux_of_joints_per_m = [[0.1, 0, 0], [0.2, 0, 0], [0.3, 0, 0]] }
    "#;
    let fine = parse_refined(text, "lists.toml", factor(3)).unwrap();
    let radii: Vec<f64> = fine.model.segments[..12].iter().map(|segment| segment.radius).collect();
    assert_eq!(radii, [[0.01; 3], [0.02; 3], [0.02; 3], [0.03; 3]].concat());
    let rests: Vec<f64> = fine.model.joints.iter().map(|joint| joint.rest_darboux.x).collect();
    // The joints of the file are at 1, 2, 3 of 4 segments; a ring's last one is where it begins.
    let line = [0.1, 0.1, 0.1, 0.1, 0.2, 0.2, 0.2, 0.3, 0.3, 0.3, 0.3];
    let ring = [0.3, 0.1, 0.1, 0.1, 0.2, 0.2, 0.2, 0.3, 0.3];
    assert_eq!(rests, [&line[..], &ring[..]].concat());
}

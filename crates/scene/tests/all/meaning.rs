//! What the keys mean: a file that uses each of them once.

use std::f64::consts::PI;

use nalgebra::{UnitQuaternion, Vector3};
use rod::{Friction, Obstacle, ObstacleShape, StrainMeasure, Surface};

fn everything() -> scene::Scene {
    scene::parse(include_str!("../everything.toml"), "folder/everything.toml").unwrap()
}

#[test]
fn names_and_ranges() {
    let scene = everything();
    assert_eq!((scene.name.as_str(), scene.description.as_str()), ("everything", "Every key once."));
    assert_eq!(
        scene.run,
        scene::RunDefaults { dt: 0.02, steps: 10, every: 5, integrator: Some(rod::Integrator::Bdf2) }
    );
    let names: Vec<_> = scene.rods.iter().map(|rod| rod.name.as_str()).collect();
    let grown = ["trunk/0", "trunk/1", "trunk/2", "trunk/3", "trunk/4", "trunk/5", "trunk/6"];
    let sapling = ["sapling", "sapling/0", "sapling/1", "sapling/2"];
    let strands = ["hair/0", "hair/1", "hair/2", "hair/3"];
    let ropes = ["net/x-0", "net/x-1", "net/x-2", "net/x-3", "net/y-0", "net/y-1", "net/y-2"];
    let copies = ["arc-1", "ring-1", "arc-2", "ring-2"];
    let net = ropes.map(|rope| rope.replace("net", "net-1"));
    let net: Vec<_> = net.iter().map(String::as_str).collect();
    let curved = ["helix", "arc", "ring"];
    let own = ["knot", "cable", "strip", "mast", "stack/0", "stack/1"];
    let inelastic = ["wire", "thin-wire", "stranded", "polymer", "glass", "hose"];
    let parts = [&["trunk"], &grown[..], &["rod-1", "twig"], &sapling, &curved, &strands, &own, &inelastic];
    let parts = [&parts[..], &[&ropes, &copies, &net]].concat();
    assert_eq!(names, parts.concat());
    assert_eq!(scene.obstacles, ["obstacle-0", "ball", "obstacle-2", "obstacle-3", "obstacle-4", "obstacle-5"]);
    assert_eq!(scene.rods[8].segments, 31..36);
    assert!(scene.rods[16].closed && !scene.rods[15].closed);
    // 1.2 m, give or take 20 %, cut as near to 0.3 m as goes.
    assert!(scene.rods[11..14].iter().all(|rod| (3..=5).contains(&rod.segments.len())));
}

#[test]
fn bodies() {
    let scene = everything();
    let (model, state) = (&scene.model, &scene.state);
    assert_eq!(model.gravity, Vector3::new(0.0, 0.0, -9.81));
    assert_eq!(model.damping, rod::Damping { linear: 0.5, angular: 0.25 });
    let first_copy = scene.rods.iter().find(|rod| rod.name == "arc-1").unwrap().segments.start;
    let fixed: Vec<usize> = (0..first_copy).filter(|&i| model.segments[i].fixed).collect();
    let roots: Vec<usize> = scene.rods[17..21].iter().map(|rod| rod.segments.start).collect();
    let arc = scene.rods.iter().find(|rod| rod.name == "arc").unwrap().segments.clone();
    assert_eq!(fixed, [&[3, 8, 9, arc.start + 5, arc.end - 1][..], &roots].concat());
    assert!((model.segments[0].radius - 0.049).abs() < 1e-12 && (model.segments[9].radius - 0.031).abs() < 1e-12);
    assert_eq!((model.segments[0].density, model.segments[4].added_mass), (200.0, 2.5));
    // One of the trunk, one of the arc and each of its copies.
    assert_eq!((model.anchors.len(), model.anchors[0].position), (5, Vector3::new(0.0, 0.0, 1.0)));
    assert_eq!((model.loads.len(), model.changes.len()), (3, 2));
    assert_eq!((model.loads[2].force, model.loads[2].torque), (Vector3::zeros(), Vector3::x()));
    assert_eq!(model.changes[0].track.at(1.5), Vector3::z());
    assert_eq!((model.loads[0].segment, model.loads[0].force), (9, Vector3::new(1.0, 2.0, 3.0)));
    assert!((model.loads[0].offset - 0.05).abs() < 1e-12 && (model.loads[1].offset + 0.025).abs() < 1e-12);
    // The spin's axis is the trunk's own: no velocity but the common one, none where fixed, its own where given.
    assert!((state.velocities[0] - Vector3::x()).norm() < 1e-12);
    assert_eq!((state.angular_velocities[0], state.velocities[9]), (Vector3::new(0.0, 0.0, 2.0), Vector3::zeros()));
    assert_eq!((state.velocities[3], state.angular_velocities[3]), (Vector3::y(), Vector3::new(3.0, 0.0, 0.0)));
}

#[test]
fn air() {
    let air = everything().model.air.unwrap();
    assert_eq!((air.density, air.normal_drag, air.tangential_drag), (1.1, 1.2, 0.02));
    let gusts = rod::Gusts { strength: 0.2, length: 5.0, time: 2.0, seed: 3 };
    assert_eq!(air.wind, rod::Wind::new(Vector3::new(3.0, 4.0, 0.0), Some(gusts), Some(60.0)));
    let still = scene::parse("[air]\n[[rods]]\nshape.straight = { length_m = 4, segments = 30 }", "x.toml").unwrap();
    assert_eq!(still.model.air.unwrap().wind.velocity(&Vector3::x(), 1.0), Vector3::zeros());
}

#[test]
fn joints() {
    let scene = everything();
    let model = &scene.model;
    let first = model.joints[0];
    assert_eq!((first.youngs_modulus, first.torsion_modulus, first.rest_darboux), (1e6, 5e5, Vector3::zeros()));
    assert!(first.stretch_compliance > 1e-8 && first.shear_compliance > first.stretch_compliance);
    let of_rod = |i: usize| scene.rods[i].segments.clone();
    let between = |a: usize, b: usize| {
        let bodies = (rod::Body::Segment(a), rod::Body::Segment(b));
        *model.joints.iter().find(|j| (j.a, j.b) == bodies).unwrap()
    };
    let second = of_rod(8).start;
    let joint = between(second, second + 1);
    assert_eq!(joint.stretch_compliance, 1e-8);
    // The curvature is about the rod's own second axis, in the world, though a branch's frames turn to its parent's.
    let own = rod::shape::frames(&[Vector3::zeros(), scene.state.axis(second)], 0.0)[0].orientation;
    let rest = scene.state.orientations[second] * joint.rest_darboux;
    assert!((rest - own * Vector3::y()).norm() < 1e-12, "{rest}");
    assert_eq!((joint.youngs_modulus, joint.torsion_modulus), (1e5, 1e5));
    // The branch starts at the centre of its parent, the twig at the branch's tip.
    assert_eq!(between(4, second).offset_a, 0.0);
    assert!((between(of_rod(8).end - 1, of_rod(9).start).offset_a - 0.1).abs() < 1e-12);
    between(of_rod(15).start, of_rod(16).start);
    // The cable is strained.
    assert!((rod::measure::worst_gap(model, &scene.state) - 0.01).abs() < 1e-9);
}

#[test]
fn a_branch_is_as_stiff_and_at_rest_as_it_says() {
    let scene = everything();
    let twig = scene.rods.iter().find(|rod| rod.name == "twig").unwrap().segments.clone();
    let is_root = |joint: &&rod::Joint| joint.b == rod::Body::Segment(twig.start) && joint.a != joint.b;
    let root = scene.model.joints.iter().find(is_root).unwrap();
    // At the angle at rest, of 30 degrees about d2, nothing resists; a moment about d1 meets 20 N m/rad.
    let mut state = scene.state.clone();
    state.orientations[twig.start] *= UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 30_f64.to_radians());
    let moment = |state: &rod::State| {
        let [a, b] = root.frames(&scene.model, state);
        let strain = rod::darboux::darboux(&a, &b, root.length) - root.rest_darboux;
        strain.component_div(&root.bend_twist_compliance()) / root.length
    };
    // The first turns come after the joint.
    assert!(moment(&state).norm() < 1e-9, "{}", moment(&state));
    state.orientations[twig.start] *= UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 1e-4);
    let found = moment(&state);
    assert!((found.x / (20.0 * 1e-4) - 1.0).abs() < 0.05, "{found}");
    let drawn = scene::parse(&include_str!("../everything.toml").replace("first_turns_deg", "# "), "x.toml").unwrap();
    let [turned, drawn] = [&scene, &drawn].map(|scene| scene.state.orientations[twig.start + 1]);
    let expected = drawn * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 15_f64.to_radians());
    assert!(turned.angle_to(&expected) < 1e-9);
}

#[test]
fn sections() {
    let scene = everything();
    let own = |name: &str| {
        let rod = scene.rods.iter().find(|rod| rod.name == name).unwrap();
        let joints: Vec<_> = scene.model.joints_of(&rod.segments).into_iter().map(|k| scene.model.joints[k]).collect();
        (rod.segments.clone(), joints)
    };
    let (segments, joints) = own("strip");
    // Half of the smaller side; d1 as given, across the axis.
    assert_eq!(scene.model.segments[segments.start].radius, 0.001);
    let q = scene.state.orientations[segments.start];
    assert!((q * Vector3::x() - Vector3::z()).norm() < 1e-12 && (q * Vector3::z() - Vector3::x()).norm() < 1e-12);
    let mass = scene.model.segments[segments.start].mass();
    assert!((mass / (100.0 * 0.25 * 0.03 * 0.002) - 1.0).abs() < 1e-12, "{mass}");
    let rests: Vec<_> = joints.iter().map(|joint| joint.rest_darboux).collect();
    assert_eq!(rests, [Vector3::zeros(), Vector3::new(0.1, 0.0, 0.2), Vector3::new(0.0, 0.3, 0.0)]);
    let damping = rod::InnerDamping { bending: 1e-3, twist: 2e-3, stretch: 1e-4 };
    assert!(joints.iter().all(|joint| joint.inner_damping == damping));
    // The width lies along d1: bending about d2 is stiffer by its square.
    let softer = joints[0].bend_compliance / joints[0].bend_twist_compliance().y;
    assert!((softer / 225.0 - 1.0).abs() < 1e-9, "{softer}");

    let (segments, joints) = own("mast");
    let density = |i: usize| scene.model.segments[segments.start + i].mass() / 0.1;
    assert!((density(2) / (100.0 * PI * (4e-4 - 2.25e-4)) - 1.0).abs() < 1e-9);
    assert!((density(3) / (100.0 * PI * 0.02 * 0.015) - 1.0).abs() < 1e-9);
    assert_eq!(scene.model.segments[segments.start + 6].line_inertia, None);
    assert!((density(7) / 0.5 - 1.0).abs() < 1e-12);
    assert!((joints[8].bend_compliance * 0.1 * 30.0 - 1.0).abs() < 1e-12);
    assert!((joints[8].bend_twist_compliance().y * 0.1 * 20.0 - 1.0).abs() < 1e-12);
    assert!((joints[8].stretch_compliance * 1e6 / 0.1 - 1.0).abs() < 1e-12);
    // Half of each section.
    let half = (joints[7].bend_compliance + joints[5].bend_compliance) / 2.0;
    assert!(
        (joints[6].bend_compliance * 2.0 - joints[5].bend_compliance - joints[7].bend_compliance).abs() < 1e-12 * half
    );
}

#[test]
fn bending_is_measured_from_rest_where_asked() {
    let text = include_str!("../everything.toml").replace("bending = \"paper\"", "bending = \"rest-rotation\"");
    let (paper, rest) = (everything(), scene::parse(&text, "x.toml").unwrap());
    let mut expected = paper.model.clone();
    expected.measure_from_rest();
    expected.strain_measure = StrainMeasure::Angle;
    assert_eq!((rest.model, rest.state), (expected, paper.state));
}

#[test]
fn contacts() {
    let contacts = everything().model.contacts;
    let friction = Friction { at_rest: 0.4, sliding: 0.3 };
    assert_eq!(contacts.between_segments, Some(Surface { friction, restitution: 0.1 }));
    let [plane, ball, post, ..] = &contacts.obstacles[..] else { panic!("{contacts:?}") };
    let point = Vector3::new(0.0, 0.0, -5.0);
    let half_space = ObstacleShape::HalfSpace { point, normal: Vector3::z_axis() };
    assert_eq!(*plane, Obstacle::new(half_space, Surface::default()));
    let sphere = ObstacleShape::Sphere { centre: Vector3::new(0.0, 0.0, 9.0), radius: 1.0 };
    assert_eq!(*ball, Obstacle::new(sphere, Surface { friction: Friction::new(0.5), restitution: 0.2 }));
    let (start, end) = (Vector3::new(0.0, 9.0, 0.0), Vector3::new(0.0, 9.0, 1.0));
    assert_eq!(post.shape, ObstacleShape::Capsule { start, end, radius: 0.5 });

    let rod = "[[rods]]\nshape.straight = { length_m = 4, segments = 30 }\n";
    let parse = |keys: &str| scene::parse(&format!("{rod}{keys}"), "x.toml").unwrap().model.contacts;
    assert_eq!(parse(""), rod::Contacts::default());
    assert_eq!(parse("[contact]").between_segments, Some(Surface::default()));
    let ground = ObstacleShape::HalfSpace { point: Vector3::zeros(), normal: Vector3::z_axis() };
    assert_eq!(parse("[[obstacles]]\nshape.plane = {}").obstacles[0].shape, ground);
}

#[test]
fn strands_point_outwards_from_their_sphere() {
    let scene = everything();
    let centre = Vector3::new(0.0, 0.0, 9.0);
    for strand in &scene.rods[17..21] {
        for i in strand.segments.clone() {
            let (out, axis) = (scene.state.positions[i] - centre, scene.state.axis(i));
            let along = i - strand.segments.start;
            assert!((out - axis * (1.0 + 0.01 + 0.02 + (along as f64 + 0.5) * 0.5 / 3.0)).norm() < 1e-12, "{out}");
            assert!(axis.z > 60f64.to_radians().cos() - 0.15);
        }
    }
    let hair = scene::builtin("hair").unwrap();
    assert_eq!((hair.rods.len(), hair.model.segments.len()), (200, 2000));
    // Evenly: each half of the half sphere has its share, and roots keep their distance.
    let roots: Vec<Vector3<f64>> = hair.rods.iter().map(|rod| hair.state.axis(rod.segments.start)).collect();
    for half in [Vector3::x(), Vector3::y(), Vector3::new(-0.5, 0.5, 0.0)] {
        let share = roots.iter().filter(|root| root.dot(&half) > 0.0).count();
        assert!((92..=108).contains(&share), "{share}");
    }
    assert!((92..=108).contains(&roots.iter().filter(|root| root.z > 0.5).count()));
    let other = |i: usize| roots.iter().enumerate().filter(move |(k, _)| *k != i).map(|(_, root)| root);
    let nearest = (0..200).map(|i| other(i).map(|root| (root - roots[i]).norm()).fold(f64::INFINITY, f64::min));
    // The lattice's own least distance, 0.85 mean ones, less twice the jitter.
    assert!(nearest.fold(f64::INFINITY, f64::min) > (0.85 - 2.0 * 0.3) * (std::f64::consts::TAU / 200.0).sqrt());
}

#[test]
fn rods_of_a_heap_lie_level_one_above_the_other_and_point_anywhere() {
    let heap = scene::builtin("heap-80").unwrap();
    assert_eq!((heap.rods.len(), heap.model.segments.len()), (80, 1600));
    let mut quarters = [0; 4];
    for (k, rod) in heap.rods.iter().enumerate() {
        let first = rod.segments.start;
        let middle = (heap.state.positions[first] + heap.state.positions[rod.segments.end - 1]) * 0.5;
        assert!((middle - Vector3::z() * (0.02 + 0.012 * k as f64)).norm() < 1e-12, "{middle}");
        let along = heap.state.axis(first);
        assert!(along.z.abs() < 1e-12);
        quarters[usize::from(along.x > 0.0) + 2 * usize::from(along.y > 0.0)] += 1;
    }
    // Each quarter has 20 of 80 in the mean, give or take three standard deviations.
    assert!(quarters.iter().all(|count| (8..=32).contains(count)), "{quarters:?}");
    assert_eq!(heap, scene::builtin("heap-80").unwrap());
}

#[test]
fn ropes_of_a_net_meet_where_they_cross() {
    let scene = everything();
    let net = 33..40;
    let (ropes, model) = (&scene.rods[net.clone()], &scene.model);
    let length = |rope: &scene::RodInfo| -> f64 { rope.segments.clone().map(|i| model.segments[i].length).sum() };
    assert!(ropes[..4].iter().all(|rope| rope.segments.len() == 4 && (length(rope) - 2.0).abs() < 1e-12));
    assert!(ropes[4..].iter().all(|rope| rope.segments.len() == 6 && (length(rope) - 3.0).abs() < 1e-12));
    let rod_of = |body| match body {
        rod::Body::Segment(i) => Some(model.segments[i].rod),
        rod::Body::Anchor(_) => None,
    };
    let crossings = model.joints.iter().filter_map(|j| {
        let (a, b) = (rod_of(j.a)?, rod_of(j.b)?);
        (net.contains(&a) && a != b).then(|| (a - net.start, b - net.start))
    });
    let mut crossings: Vec<_> = crossings.collect();
    crossings.sort_unstable();
    assert_eq!(crossings, (0..4).flat_map(|x| (4..7).map(move |y| (x, y))).collect::<Vec<_>>());
    let joint = model.joints.iter().find(|j| rod_of(j.a) == Some(net.start)).unwrap();
    assert_eq!((joint.youngs_modulus, joint.torsion_modulus), (2e6, 1e6));
    assert!(model.segments[ropes[0].segments.start].radius == 0.02);
}

#[test]
fn a_minimal_file_has_the_declared_defaults() {
    let scene = scene::parse("[[rods]]\nshape.straight = { length_m = 4, segments = 30 }", "x.toml").unwrap();
    let mut paper = scene::builtin("bending-rod").unwrap();
    paper.model.segments[0].fixed = false;
    paper.model.strain_measure = StrainMeasure::Angle;
    assert_eq!(paper.run.integrator.take(), Some(rod::Integrator::Euler));
    assert_eq!((scene.model, scene.state, scene.run), (paper.model, paper.state, paper.run));
}

/// Who knows a cable's `E A` need not know its shear stiffness.
#[test]
fn shear_stiffness_is_that_of_an_isotropic_material_unless_it_is_given() {
    let joint = |shear: &str| {
        let text = format!(
            "[[rods]]\nradius_m = 0.01\nstretch = \"physical\"\nshape.straight = {{ length_m = 1, segments = 4 }}\n\
             section.stiffness = {{ bending_n_m2 = [30, 20], torsion_n_m2 = 10, mass_kg_m = 0.5, stretch_n = 1e6{shear} }}\n"
        );
        scene::parse(&text, "cable.toml").unwrap().model.joints[1]
    };
    let (default, given) = (joint(""), joint(", shear_n = 346153.84615384616"));
    assert!((default.shear_compliance / given.shear_compliance - 1.0).abs() < 1e-12);
    assert_eq!(default.stretch_compliance, given.stretch_compliance);
}

//! What the keys mean: a file that uses each of them once.

use nalgebra::Vector3;

fn everything() -> scene::Scene {
    scene::parse(include_str!("everything.toml"), "folder/everything.toml").unwrap()
}

#[test]
fn names_and_ranges() {
    let scene = everything();
    assert_eq!((scene.name.as_str(), scene.description.as_str()), ("everything", "Every key once."));
    assert_eq!(scene.run, scene::RunDefaults { dt: 0.02, steps: 10 });
    let names: Vec<_> = scene.rods.iter().map(|rod| rod.name.as_str()).collect();
    let grown = ["trunk/0", "trunk/1", "trunk/2", "trunk/3", "trunk/4", "trunk/5", "trunk/6"];
    assert_eq!(
        names,
        [
            &["trunk"][..],
            &grown,
            &["rod-1", "twig", "sapling", "sapling/0", "sapling/1", "sapling/2", "helix", "arc", "ring"]
        ]
        .concat()
    );
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
    let fixed: Vec<usize> = (0..model.segments.len()).filter(|&i| model.segments[i].fixed).collect();
    assert_eq!(fixed, [3, 8, 9]);
    assert!((model.segments[0].radius - 0.049).abs() < 1e-12 && (model.segments[9].radius - 0.031).abs() < 1e-12);
    assert_eq!((model.segments[0].density, model.segments[4].added_mass), (200.0, 2.5));
    assert_eq!((model.anchors.len(), model.anchors[0].position), (1, Vector3::new(0.0, 0.0, 1.0)));
    assert_eq!(model.loads.len(), 2);
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
    assert!(rod::measure::worst_gap(model, &scene.state) < 1e-9);
}

#[test]
fn a_minimal_file_has_the_declared_defaults() {
    let scene = scene::parse("[[rods]]\nshape.straight = { length_m = 4, segments = 30 }", "x.toml").unwrap();
    let mut paper = scene::builtin("bending-rod").unwrap();
    paper.model.segments[0].fixed = false;
    assert_eq!((scene.model, scene.state, scene.run), (paper.model, paper.state, paper.run));
}

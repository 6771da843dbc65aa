//! Joints that are not elastic: what comes of their keys, and errors.

use std::f64::consts::PI;

use rod::{JointLaw, MaxwellBranch, MomentTable, Plasticity, StrandFriction, Strength, Unloading};

fn with(keys: &str) -> Result<scene::Scene, String> {
    let text = format!(
        "[[rods]]\nname = \"wire\"\nradius_m = 0.002\nclamp = [\"start-face\"]\nshape.straight = {{ length_m = 1, segments = 10 }}\n{keys}\n"
    );
    scene::parse(&text, "x.toml").map_err(|error| error.to_string())
}

#[test]
fn joints_of_a_rod_share_its_law() {
    let plastic = |moments: [f64; 3], isotropic, kinematic| {
        JointLaw::Plastic(Plasticity { moments: moments.into(), isotropic, kinematic })
    };
    let branch = |share, time| MaxwellBranch { share, time };
    let round = 0.002_f64.powi(3) * 250e6;
    let full = [4.0 / 3.0 * round, 4.0 / 3.0 * round, 2.0 * PI / 3.0 * round / 3.0_f64.sqrt()];
    for (keys, law) in [
        ("yield = { moment_n_m = 0.5, torque_n_m = 0.4 }", plastic([0.5, 0.5, 0.4], 0.0, 0.0)),
        (
            "yield = { stress_pa = 250e6, hardening_isotropic = 0.1, hardening_kinematic = 0.2 }",
            plastic(full, 0.1, 0.2),
        ),
        (
            "strand_friction = { moment_n_m = 0.1, stiffness_n_m2 = 2 }",
            JointLaw::Friction(StrandFriction { moment: 0.1, stiffness: 2.0 }),
        ),
        (
            "relaxation = [{ share = 0.3, time_s = 0.5 }, { share = 0.4, time_s = 10 }]",
            JointLaw::Viscoelastic(vec![branch(0.3, 0.5), branch(0.4, 10.0)]),
        ),
    ] {
        let model = with(keys).unwrap().model;
        // Nine joints and the clamp.
        assert_eq!(model.laws.iter().map(|own| own.joint).collect::<Vec<_>>(), (0..10).collect::<Vec<_>>(), "{keys}");
        assert!(model.laws.iter().all(|own| *own.law == law), "{keys}: {:?}", model.laws[0].law);
    }
    assert!(with("").unwrap().model.laws.is_empty());
}

#[test]
fn a_tapered_wire_yields_where_it_is_thin() {
    let text = "[[rods]]\nradius_m = [0.002, 0.001]\nshape.straight = { length_m = 1, segments = 10 }\nyield.stress_pa = 3e8\n";
    let model = scene::parse(text, "x.toml").unwrap().model;
    for own in &model.laws {
        let JointLaw::Plastic(Plasticity { moments, .. }) = own.law.as_ref() else { panic!() };
        // The thinner of both segments counts.
        let radius = model.segments[own.joint + 1].radius;
        assert!((moments.x / (4e8 * radius.powi(3)) - 1.0).abs() < 1e-12);
    }
}

#[test]
fn what_turns_freely_or_on_springs_is_elastic() {
    for grip in ["joint = \"ball\"", "stiffness_n_m_rad = [1, 1]"] {
        let text = format!(
            "[[rods]]\nshape.straight = {{ length_m = 1, segments = 10 }}\nyield.stress_pa = 3e8\n[[rods.grips]]\nat = \"end-face\"\n{grip}\n"
        );
        let model = scene::parse(&text, "x.toml").unwrap().model;
        assert_eq!((model.laws.len(), model.joints.len()), (9, 10), "{grip}");
    }
}

#[test]
fn errors_name_the_key() {
    for (keys, expected) in [
        ("yield = {}", "6: rods[0].yield: give `moment_n_m` and `torque_n_m`, or `stress_pa`"),
        ("yield = { moment_n_m = 1 }", "6: rods[0].yield: give `moment_n_m` and `torque_n_m`, or `stress_pa`"),
        (
            "yield = { moment_n_m = 0, torque_n_m = 1 }",
            "6: rods[0].yield.moment_n_m = 0, but it must be finite and > 0 [N m]",
        ),
        (
            "yield = { moment_n_m = 1, stress_pa = 1 }",
            "6: rods[0].yield.stress_pa: goes without `moment_n_m` and `torque_n_m`; leave it out, or both of them",
        ),
        (
            "yield = { stress_pa = 1, hardening_kinematic = -1 }",
            "6: rods[0].yield.hardening_kinematic = -1, but it must be finite and >= 0",
        ),
        (
            "section.ellipse = { width_m = 0.1, height_m = 0.1 }\nyield = { stress_pa = 1 }",
            "7: rods[0].yield.stress_pa: is known of circles, tubes and rectangles; give `moment_n_m` and `torque_n_m` instead",
        ),
        ("yield.moment = 1", "6: rods[0].yield.moment is not a known key (did you mean `moment_n_m`?)"),
        (
            "yield.stress_pa = 1\nrelaxation = [{ share = 0.5, time_s = 1 }]",
            "7: rods[0].relaxation: give one of `yield`, `strand_friction`, `relaxation` and `moment_table`",
        ),
        ("strand_friction = { moment_n_m = 1 }", "6: rods[0].strand_friction: missing key `stiffness_n_m2`"),
        (
            "strand_friction = { moment_n_m = 1, stiffness_n_m2 = -2 }",
            "6: rods[0].strand_friction.stiffness_n_m2 = -2, but it must be finite and > 0 [N m^2]",
        ),
        ("relaxation = []", "6: rods[0].relaxation: there must be at least one branch"),
        ("relaxation = [{ share = 1, time_s = 1 }]", "6: rods[0].relaxation[0].share = 1, but it must be > 0 and < 1"),
        (
            "relaxation = [{ share = 0.5, time_s = 1 }, { share = 0.5, time_s = 1 }]",
            "6: rods[0].relaxation[1].share = 0.5, but it must be less than 0.5: with it the shares add up to 1 or more",
        ),
        (
            "relaxation = [{ share = 0.5, time_s = 0 }]",
            "6: rods[0].relaxation[0].time_s = 0, but it must be finite and > 0 [s]",
        ),
        (
            "yield.stress_pa = 1\ntree = { levels = 1, branches = 1, segments = 3 }",
            "6: rods[0].yield: the joints of trees are elastic; leave it out",
        ),
    ] {
        let error = with(keys).unwrap_err();
        assert!(error.contains(expected), "{error}\nexpected {expected}");
    }
}

#[test]
fn joints_bear_what_their_rod_or_its_piece_says() {
    let bears = |tension, moment, curvature| Strength { tension, moment, curvature };
    let none = f64::INFINITY;
    let model = with("strength = { tension_n = 10, curvature_per_m = 3 }").unwrap().model;
    assert_eq!(model.breakable.iter().map(|own| own.joint).collect::<Vec<_>>(), (0..10).collect::<Vec<_>>());
    assert!(model.breakable.iter().all(|own| own.strength == bears(10.0, none, 3.0)), "{:?}", model.breakable[0]);
    assert!(with("").unwrap().model.breakable.is_empty());
    // Five segments of the first piece; a joint between two pieces bears what the weaker one does.
    let section = "section.circle = { radius_m = 0.002 }";
    let pieces = format!("pieces = [{{ until = 0.5, {section}, strength.moment_n_m = 2 }}, {{ {section} }}]");
    let model = with(&pieces).unwrap().model;
    let moments = |model: &rod::Model| model.breakable.iter().map(|own| own.strength.moment).collect::<Vec<_>>();
    // Joints 0 to 8 are between segments, 9 is the clamp of the first one.
    assert_eq!(moments(&model), [[2.0; 5].as_slice(), &[none; 4], &[2.0]].concat());
    let model = with(&format!("strength.moment_n_m = 1\n{pieces}")).unwrap().model;
    assert_eq!(moments(&model), [[2.0; 4].as_slice(), &[1.0; 5], &[2.0]].concat());
}

#[test]
fn two_rods_that_are_joined_stay_so() {
    let rod = |name: &str, y: f64| {
        format!(
            "[[rods]]\nname = \"{name}\"\nshape.straight = {{ start_m = [0, {y}, 0], length_m = 1, segments = 4 }}\nstrength.tension_n = 5\n"
        )
    };
    let join =
        "[[joins]]\na = { rod = \"a\", segment = -1, fraction = 1 }\nb = { rod = \"b\", segment = -1, fraction = 1 }\n";
    let text = [rod("a", 0.0), rod("b", 0.0), join.to_owned()].concat();
    let model = scene::parse(&text, "x.toml").unwrap().model;
    assert_eq!((model.joints.len(), model.breakable.len()), (7, 6));
}

#[test]
fn errors_of_strengths_name_the_key() {
    for (keys, expected) in [
        ("strength = {}", "6: rods[0].strength: give `tension_n`, `moment_n_m` or `curvature_per_m`"),
        ("strength.tension_n = 0", "6: rods[0].strength.tension_n = 0, but it must be finite and > 0 [N]"),
        ("strength.moment_n_m = -1", "6: rods[0].strength.moment_n_m = -1, but it must be finite and > 0 [N m]"),
        (
            "strength.curvature_per_m = inf",
            "6: rods[0].strength.curvature_per_m = inf, but it must be finite and > 0 [1/m]",
        ),
        ("strength.stress_pa = 1", "6: rods[0].strength.stress_pa is not a known key"),
        (
            "strength.tension_n = 1\ntree = { levels = 1, branches = 1, segments = 3 }",
            "6: rods[0].strength: the joints of trees do not break; leave it out",
        ),
    ] {
        let error = with(keys).unwrap_err();
        assert!(error.contains(expected), "{keys}: {error}");
    }
}

#[test]
fn joints_follow_a_table_of_moments() {
    let scene =
        with("moment_table = { curvatures_per_m = [0.5, 2], moments_n_m = [1, 2.5], unloading = \"masing\" }").unwrap();
    let law = JointLaw::Tabulated(MomentTable { points: vec![[0.5, 1.0], [2.0, 2.5]], unloading: Unloading::Masing });
    assert_eq!(scene.model.laws.len(), 10);
    assert!(scene.model.laws.iter().all(|own| *own.law == law));
    // The first slope is the stiffness of the joints, also where they are clamped.
    for joint in &scene.model.joints {
        let [first, second, twist] = joint.bend_twist_stiffness().into();
        assert!((first - 2.0).abs() < 1e-12 && (second - 2.0).abs() < 1e-12 && twist > 0.0);
    }
    for (keys, expected) in [
        ("curvatures_per_m = [], moments_n_m = []", "curvatures_per_m: there must be at least one point"),
        ("curvatures_per_m = [1], moments_n_m = []", "moments_n_m: 0 moments, but there must be one a curvature (1)"),
        (
            "curvatures_per_m = [1, 1], moments_n_m = [1, 2]",
            "curvatures_per_m[1] = 1, but it must be more than the one before, 1 [1/m]",
        ),
        (
            "curvatures_per_m = [1, 2], moments_n_m = [1, 1]",
            "moments_n_m[1] = 1, but it must be 1.001 [N m] or more: the curve rises by 0.001 of its first slope at least",
        ),
        (
            "curvatures_per_m = [1, 2], moments_n_m = [1, 3], unloading = \"masing\"",
            "moments_n_m[1] = 3, but it must be 2 [N m] or less: by Masing's rule the curve gets no steeper",
        ),
        ("curvatures_per_m = [1], moments_n_m = [-1]", "moments_n_m[0] = -1, but it must be finite and > 0 [N m]"),
        ("curvatures_per_m = [1], moments_n_m = [1], unloading = \"back\"", "unloading"),
    ] {
        let error = with(&format!("moment_table = {{ {keys} }}")).unwrap_err();
        assert!(error.contains(expected), "{keys}: {error}");
    }
}

//! Grips in scene files: pins, hinges and springs, what is held for a time, and what is wrong with them.

use nalgebra::Vector3;
use rod::{Body, Freedom};
use scene::Scene;

/// A metre of cable along x from the origin, with these lines for what holds it.
fn text(lines: &str) -> String {
    format!(
        "[[rods]]\nname = \"cable\"\nradius_m = 0.01\nshape.straight = {{ length_m = 1, segments = 10 }}\n{lines}\n"
    )
}

fn parsed(lines: &str) -> Scene {
    scene::parse(&text(lines), "scenes/x.toml").unwrap()
}

fn error(lines: &str) -> String {
    scene::parse(&text(lines), "scenes/x.toml").unwrap_err().to_string()
}

#[test]
fn an_end_is_pinned_hinged_and_held_by_springs() {
    let rigid = parsed("clamp = [\"start-face\", \"end-face\"]").model;
    let scene = parsed(
        "[[rods.grips]]\nat = \"start-face\"\njoint = \"ball\"\nstiffness_n_m = [100, inf]\n[[rods.grips]]\n\
         at = \"end-face\"\njoint = \"hinge\"\naxis = [0, 2, 0]\nstiffness_n_m_rad = [4, inf]",
    );
    let [start, end] = [scene.model.joints[9], scene.model.joints[10]];
    assert_eq!(start.freedom, Freedom::Ball);
    assert!((start.shear_compliance - rigid.joints[9].shear_compliance - 0.01).abs() < 1e-15);
    assert_eq!(start.stretch_compliance, rigid.joints[9].stretch_compliance);
    assert!(matches!(end.freedom, Freedom::Hinge) && end.a == Body::Anchor(1));
    assert!((scene.model.anchors[1].orientation * Vector3::z() - Vector3::y()).norm() < 1e-12);
    let added = (end.bend_compliance - rigid.joints[10].bend_compliance) * end.length.powi(2);
    assert!((added - 0.25).abs() < 1e-12, "{added} rad/(N m)");
    assert!(scene.model.open.is_empty() && scene.model.motions.is_empty());
    // Three numbers are about d1, d2 and d3.
    let three = parsed("[[rods.grips]]\nat = \"end-face\"\nstiffness_n_m_rad = [4, inf, 8]").model.joints[9];
    let [bend, extra] = [three.bend_compliance, three.bend_extra].map(|added| added * three.length.powi(2));
    assert!((bend + extra - rigid.joints[10].bend_compliance * three.length.powi(2)).abs() < 1e-12);
    assert!((extra + 0.25).abs() < 1e-12, "{extra} rad/(N m)");
    // A spring about the hinge's axis.
    let sprung = "at = \"end-face\"\njoint = \"hinge\"\naxis = [0, 2, 0]\nstiffness_n_m_rad = [inf, 8]";
    let sprung = parsed(&format!("[[rods.grips]]\n{sprung}")).model.joints[9];
    let added = (sprung.twist_compliance - rigid.joints[10].twist_compliance) * sprung.length.powi(2);
    assert!(sprung.freedom == Freedom::None && (added - 0.125).abs() < 1e-12, "{added} rad/(N m)");
    // And three forces are along them.
    let three = parsed("[[rods.grips]]\nat = \"end-face\"\nstiffness_n_m = [4, inf, 8]").model.joints[9];
    let free = rigid.joints[10];
    assert!((three.shear_compliance - free.shear_compliance - 0.25).abs() < 1e-12);
    assert!((three.shear_extra + 0.25).abs() < 1e-12, "{} m/N", three.shear_extra);
    assert!((three.stretch_compliance - free.stretch_compliance - 0.125).abs() < 1e-12);
    // Behind a hinge across the rod springs are across and along the rod, too: the anchor's d1 is the rod's axis.
    let sliding = "at = \"end-face\"\njoint = \"hinge\"\naxis = [0, 2, 0]\nstiffness_n_m = [inf, 8]";
    let model = parsed(&format!("[[rods.grips]]\n{sliding}")).model;
    let (joint, anchor) = (model.joints[9], model.anchors[0]);
    assert!(((anchor.orientation * Vector3::x()).x.abs() - 1.0).abs() < 1e-12);
    assert!((joint.shear_compliance - free.shear_compliance - 0.125).abs() < 1e-12);
    assert!((joint.shear_extra + 0.125).abs() < 1e-12 && joint.stretch_compliance == free.stretch_compliance);
    model.validate(&parsed(&format!("[[rods.grips]]\n{sliding}")).state).unwrap();
    let askew = "at = \"end-face\"\njoint = \"hinge\"\naxis = [1, 2, 0]\nstiffness_n_m = [inf, 8]";
    assert!(error(&format!("[[rods.grips]]\n{askew}")).contains("behind a hinge at an angle to the rod"));
    // The rod's own axis unless it is given.
    let swivel = parsed("[[rods.grips]]\nat = \"start-face\"\njoint = \"hinge\"").model;
    assert!((swivel.anchors[0].orientation * Vector3::z() - Vector3::x()).norm() < 1e-12);
}

#[test]
fn a_grip_holds_a_face_turned() {
    let grip = "[[rods.grips]]\nat = \"end-face\"\nstiffness_n_m_rad = [inf, 5]";
    let [plain, rolled] = ["", "\nturn_deg = [0, 0, -30]"].map(|turn| parsed(&format!("{grip}{turn}")).model);
    let turn = plain.anchors[0].orientation.rotation_to(&rolled.anchors[0].orientation).scaled_axis();
    assert!((turn + Vector3::x() * std::f64::consts::FRAC_PI_6).norm() < 1e-12, "{turn}");
    assert_eq!(plain.joints, rolled.joints);
    // About the axes of the face.
    let yields = grip.replace("inf", "3");
    let bent = parsed(&format!("{yields}\nturn_deg = [20, 0, 0]")).model.anchors[0].orientation;
    let turn = plain.anchors[0].orientation.inverse() * bent;
    assert!((turn.scaled_axis() - Vector3::x() * 20_f64.to_radians()).norm() < 1e-12);
    // What drives the face takes it so.
    let motion = "\n[[rods.motions]]\nat = \"end-face\"\ntimes_s = [0]\nshifts_m = [[0, 0, 0]]";
    let driven = parsed(&format!("{grip}\nturn_deg = [0, 0, -30]{motion}")).model;
    let begin = driven.motions[0].at(0.0).pose.orientation;
    assert!(begin.angle_to(&driven.anchors[0].orientation) < 1e-12 && driven.anchors == rolled.anchors);
}

#[test]
fn rods_are_joined_by_balls_and_hinges() {
    let scene = parsed(
        "[[rods]]\nname = \"twig\"\nbranch_of = { rod = \"cable\" }\nbranch_joint = \"hinge\"\nshape.straight = { \
         angle_deg = 40, length_m = 1, segments = 3 }\n[[rods]]\nname = \"other\"\nshape.straight = { start_m = [1, 0, 0], \
         direction = [0, 1, 0], length_m = 1, segments = 3 }\n[[joins]]\na = { rod = \"cable\" }\nb = { rod = \"other\", \
         segment = 0, fraction = 0 }\njoint = \"ball\"",
    );
    let freedoms: Vec<Freedom> = scene.model.joints.iter().map(|joint| joint.freedom).collect();
    assert_eq!(freedoms.iter().filter(|freedom| **freedom != Freedom::None).count(), 2);
    assert!(freedoms.iter().any(|freedom| matches!(freedom, Freedom::Hinge)));
    assert_eq!(*freedoms.last().unwrap(), Freedom::Ball);
}

#[test]
fn what_is_held_for_a_time_is_free_before_and_after() {
    let scene = parsed(
        "clamp = [\"start-face\"]\n[[rods.grips]]\nat = \"end-face\"\nfrom_s = 1\nuntil_s = 2\n[[rods.grips]]\n\
         segment = 4\nuntil_s = 0.5\n[[rods.motions]]\nat = \"end-face\"\nfrom_s = 2\ntimes_s = [0, 3]\nshifts_m = \
         [[0, 0, 0], [0, 0, 1]]",
    );
    let mut model = scene.model;
    assert_eq!((model.open.clone(), model.segments[4].fixed), (vec![1], true));
    for (time, is_open, is_fixed) in [
        (0.0, true, true),
        (0.5, true, true),
        (0.51, true, false),
        (1.0, true, false),
        (1.01, false, false),
        (9.0, false, false),
    ] {
        model.set_time(time);
        assert_eq!((model.open == [1], model.segments[4].fixed), (is_open, is_fixed), "at {time} s");
    }
    assert!(model.motions[2].moves_along && model.motions[2].from == 2.0 && model.motions[2].until == f64::INFINITY);
}

#[test]
fn compliance_and_motion_of_one_place_go_together() {
    let scene = parsed(
        "[[rods.grips]]\nat = \"end-face\"\njoint = \"ball\"\n[[rods.motions]]\nat = \"end-face\"\nfrom_s = 0.5\n\
         times_s = [0]\npositions_m = [[0, 0, 1]]",
    );
    assert_eq!((scene.model.joints.len(), scene.model.joints[9].freedom), (10, Freedom::Ball));
    assert_eq!((scene.model.open, scene.model.motions[0].moves_along), (vec![0], false));
}

#[test]
fn mistakes_are_named_with_their_key() {
    let grip = |lines: &str| format!("[[rods.grips]]\n{lines}");
    let still = "times_s = [0]\nshifts_m = [[0,0,0]]";
    for (lines, expected) in [
        (grip("joint = \"ball\""), "grips[0]: give either `at` or `segment`"),
        (
            grip("at = \"start-face\"\njoint = \"pin\""),
            "joint = \"pin\", but it must be one of `rigid`, `ball`, `hinge`",
        ),
        (grip("at = \"start-face\"\naxis = [0, 0, 1]"), "grips[0].axis: goes with `joint = \"hinge\"`"),
        (
            grip("at = \"start-face\"\njoint = \"hinge\"\naxis = [0, 0, 0]"),
            "grips[0].axis = [0, 0, 0], but it must be a vector other than zero",
        ),
        (grip("segment = 3\njoint = \"ball\""), "grips[0].joint: goes with end faces"),
        (grip("at = \"end-segment\"\nstiffness_n_m = [1, 1]"), "stiffness_n_m: goes with end faces"),
        (grip("at = \"start-face\"\nstiffness_n_m = [1, 0]"), "stiffness_n_m[1] = 0, but it must be > 1e-9, or inf"),
        (grip("at = \"start-face\"\nstiffness_n_m = 5"), "stiffness_n_m = 5, but it must be"),
        (
            grip("at = \"end-face\"\nstiffness_n_m = [1]"),
            "stiffness_n_m: must be [across, along] or [along d1, along d2",
        ),
        (grip("at = \"end-face\"\nstiffness_n_m = [1, 2, nan]"), "stiffness_n_m[2] = nan, but it must be > 1e-9"),
        (
            grip("at = \"end-face\"\njoint = \"hinge\"\nstiffness_n_m = [1, 2, 3]"),
            "stiffness_n_m: has three values; with a hinge it is [across, along]",
        ),
        (
            grip("at = \"start-face\"\nturn_deg = [0, 0, 10]"),
            "grips[0].turn_deg: goes with `stiffness_n_m_rad` of a rigid joint",
        ),
        (
            grip("at = \"start-face\"\nstiffness_n_m_rad = [1, inf]\nturn_deg = [0, 0, 10]"),
            "turn_deg: goes with a finite `stiffness_n_m_rad` about its axes",
        ),
        (
            grip("at = \"start-face\"\nstiffness_n_m_rad = [1, inf, 1]\nturn_deg = [10, -10, 0]"),
            "turn_deg: goes with a finite `stiffness_n_m_rad` about its axes",
        ),
        (
            grip("at = \"start-face\"\nstiffness_n_m_rad = [1, 1]\nturn_deg = [0, 0, 180]"),
            "turn_deg = [0, 0, 180], but it must be shorter than 180 [degrees]",
        ),
        (
            grip("at = \"start-face\"\nstiffness_n_m_rad = [1, 1]\nturn_deg = [0, 0, 10]\nfrom_s = 1"),
            "turn_deg: goes without `from_s` and `until_s`",
        ),
        (grip("at = \"start-face\"\nfrom_s = -1"), "grips[0].from_s = -1, but it must be finite and >= 0 [s]"),
        (
            grip("at = \"start-face\"\nfrom_s = 2\nuntil_s = 1"),
            "grips[0].until_s = 1, but it must be finite and later than 2 [s]",
        ),
        (
            grip("at = \"start-face\"\nuntil_s = 3\n[[rods.grips]]\nat = \"start-face\"\nfrom_s = 1"),
            "grips[1]: it holds this place from 1 s for ever, but another entry holds it from 0 s until 3 s",
        ),
        (
            format!(
                "[[rods.motions]]\nat = \"end-face\"\n{still}\n[[rods.motions]]\nat = \"end-face\"\nfrom_s = 1\n{still}"
            ),
            "motions[1]: it holds this place from 1 s for ever, but another entry holds it from 0 s for ever",
        ),
        (
            format!("clamp = [\"end-face\"]\n[[rods.motions]]\nat = \"end-face\"\nfrom_s = 1\n{still}"),
            "motions[0]: this place is held for the whole run",
        ),
        (
            grip("at = \"end-face\"\njoint = \"ball\"\n[[rods.grips]]\nat = \"end-face\"\njoint = \"rigid\""),
            "grips[1]: another entry says how this place is held",
        ),
        (
            grip("at = \"end-face\"\nstiffness_n_m_rad = [1]"),
            "stiffness_n_m_rad: must be [bend, twist] or [about d1, about",
        ),
        (grip("at = \"end-face\"\nstiffness_n_m_rad = [1, 2, -3]"), "stiffness_n_m_rad[2] = -3, but it must be > 1e-9"),
        (
            grip("at = \"end-face\"\njoint = \"ball\"\nstiffness_n_m_rad = [1, 2]"),
            "stiffness_n_m_rad: a ball joint turns freely",
        ),
        (
            grip("at = \"end-face\"\n[[rods.grips]]\nat = \"end-face\"\njoint = \"ball\""),
            "another entry, `clamp` or `fixed_segments` holds this place",
        ),
        (
            grip("at = \"end-face\"\njoint = \"hinge\"\nstiffness_n_m_rad = [1, 2, 3]"),
            "stiffness_n_m_rad: has three values; with a hinge it is [bend, twist]",
        ),
        (
            "[[rods.motions]]\nat = \"end-face\"\nfrom_s = 1\ntimes_s = [0]\nshifts_m = [[0,0,0]]\nsnap = true"
                .to_owned(),
            "motions[0].snap: goes with `positions_m` and a `from_s` > 0",
        ),
        (
            "[[rods.motions]]\nat = \"end-face\"\nfrom_s = 1\ntimes_s = [0]\npositions_m = [[0,0,0]]\nsnap = true"
                .to_owned(),
            "motions[0].snap: what is held without springs would jump",
        ),
        (
            "[[rods.motions]]\nat = \"end-face\"\ntimes_s = [0]\nshifts_m = [[0,0,0]]\nsnap = 1".to_owned(),
            "motions[0].snap = 1, but it must be true or false",
        ),
        ("branch_joint = \"ball\"".to_owned(), "branch_joint: goes with `branch_of`"),
    ] {
        let error = error(&lines);
        assert!(error.starts_with("scenes/x.toml:") && error.contains(expected) && !error.contains('\n'), "{error}");
        assert!(error.contains("rods[0]"), "{error}");
    }
}

/// A carriage on a spring moves as a whole: its way is no change of its length.
#[test]
fn a_single_segment_on_a_spring_keeps_its_length() {
    let text = text("grips = [{ at = \"start-face\", stiffness_n_m = [inf, 10] }]");
    let scene = scene::parse(&text.replace("segments = 10", "segments = 1"), "scenes/x.toml").unwrap();
    let mut state = scene.state.clone();
    state.positions[0].x += 0.3;
    assert_eq!(rod::measure::rod_lengths(&scene.model, &state), [1.0]);
}

//! Keys that are given another value before a scene is read.

use scene::{Scene, SceneError, parse, parse_set};

const TEXT: &str = r#"# A comment.
description = "Two rods."
damping = { linear_per_s = 0.1 }
probes = [{ name = "tip", rod = "cable", at = "end-face", quantities = ["position"] }]

[run]
dt_s = 0.02

[[rods]]
name = "cable"
radius_m = 0.01 # thin
shape.straight = { length_m = 1, segments = 10 }

[[rods.motions]]
at = "start-face"
times_s = [0, 1]
shifts_m = [[0, 0, 0], [1, 0, 0]]

[[rods]]
[rods.shape.straight]
start_m = [0, 1, 0]
length_m = 1
segments = 10
"#;

fn set(settings: &[&str]) -> Result<Scene, SceneError> {
    parse_set(TEXT, "two.toml", &settings.iter().map(|&setting| setting.to_owned()).collect::<Vec<_>>()).map(bare)
}

/// All of a scene but its text, which may say the same in other words.
fn bare(scene: Scene) -> Scene {
    Scene { text: None, ..scene }
}

/// The scene of the text with some of it replaced.
fn with(changes: &[(&str, &str)]) -> Scene {
    let text = changes.iter().fold(TEXT.to_owned(), |text, (from, to)| {
        assert_eq!(text.matches(from).count(), 1, "{from}");
        text.replace(from, to)
    });
    bare(parse(&text, "two.toml").unwrap())
}

#[test]
fn a_setting_is_what_the_file_would_be_with_it() {
    let radius = ("radius_m = 0.01", "radius_m = 0.03");
    let second = ("[[rods]]\n[rods", "[[rods]]\nyoungs_modulus_pa = 2e7\n[rods");
    for (settings, changes) in [
        (&[][..], &[][..]),
        (&["rods.cable.radius_m=0.03"], &[radius]),
        (&["rods[0].radius_m = 0.03"], &[radius]),
        (&["rods.0.radius_m=0.03"], &[radius]),
        (&["rods.\"cable\".radius_m=0.03"], &[radius]),
        // Keys that the file does not have, of a nameless rod, too.
        (&["rods.rod-1.youngs_modulus_pa=2e7"], &[second]),
        (&["rods[1].youngs_modulus_pa=1", "rods[1].youngs_modulus_pa=2e7"], &[second]),
        (&["gravity_m_s2=[0, 0, -1.62]"], &[("# A comment.", "gravity_m_s2 = [0, 0, -1.62]")]),
        (&["contact.friction=0.4"], &[("# A comment.", "contact.friction = 0.4")]),
        (&["air.wind.velocity_m_s=[1,0,0]"], &[("# A comment.", "air.wind = { velocity_m_s = [1, 0, 0] }")]),
        // In inline tables, lists of lists, and tables with headers.
        (&["damping.linear_per_s=3"], &[("linear_per_s = 0.1", "linear_per_s = 3")]),
        (&["damping.angular_per_s=3"], &[("linear_per_s = 0.1", "linear_per_s = 0.1, angular_per_s = 3")]),
        (&["probes.tip.at=\"start-face\""], &[("at = \"end-face\"", "at = \"start-face\"")]),
        (&["rods.cable.motions[0].times_s=[0, 9]"], &[("[0, 1]", "[0, 9]")]),
        (&["rods.cable.motions[0].times_s[1]=9"], &[("[0, 1]", "[0, 9]")]),
        (&["rods.cable.shape.straight.length_m=2"], &[("{ length_m = 1", "{ length_m = 2")]),
        (&["rods[1].shape.straight.length_m=2"], &[("\nlength_m = 1", "\nlength_m = 2")]),
        (&["run.dt_s=0.5", "run.steps=7"], &[("dt_s = 0.02", "dt_s = 0.5\nsteps = 7")]),
    ] {
        assert_eq!(set(settings).unwrap(), with(changes), "{settings:?}");
    }
}

#[test]
fn a_mistake_names_the_setting_and_what_is_allowed() {
    let paths = "it must be KEY=VALUE, the key a path such as rods.cable.radius_m or rods[0].radius_m";
    for (settings, expected) in [
        (
            &["rods.cable.radius_m=-1"][..],
            "rods.cable.radius_m=-1: rods[0].radius_m = -1, but it must be finite and > 0 [m]",
        ),
        (&["run.steps=5", "run.dt_s=0"], "run.dt_s=0: run.dt_s = 0, but it must be finite and > 0 [s]"),
        (&["run.dt=1"], "run.dt=1: run.dt is not a known key (did you mean `dt_s`?); expected one of `dt_s`"),
        (&["radius_m=1"], "radius_m=1: radius_m is not a known key"),
        (
            &["rods.cabel.radius_m=1"],
            "rods.cabel.radius_m=1: none of rods is called `cabel`; did you mean `cable`? (there are cable; rods[0] is the first)",
        ),
        (&["rods[2].radius_m=1"], "rods[2].radius_m=1: there is no rods[2]: the file has 2 of them, counted from 0"),
        (&["rods[x].radius_m=1"], "rods[x].radius_m=1: [x] must hold a whole number from 0 on"),
        (&["rods.cable=1"], "rods.cable=1: rods[0] is a whole table: give one of its keys"),
        (&["rods=1"], "rods=1: rods is a whole table: give one of its keys"),
        (&["run[0].dt_s=1"], "run[0].dt_s=1: run is no list"),
        (&["bodies[0].mass_kg=1"], "bodies[0].mass_kg=1: there is no bodies yet, and so no entry of it"),
        (&["run.dt_s.x=1"], "run.dt_s.x=1: run.dt_s is no table and no list"),
        (
            &["probes.tip.at=end-face"],
            "probes.tip.at=end-face: end-face is no TOML value: a number, [a, list], true, false, or a text in double quotes",
        ),
        (&["run.dt_s"], "run.dt_s: it must be KEY=VALUE"),
        (&["=1"], &format!("=1: {paths}")),
        (&["run.=1"], &format!("run.=1: {paths}")),
        (&["\"run=1"], "\"run=1: a quote is not closed"),
        (&["rods[0=1"], "rods[0=1: a bracket is not closed"),
    ] {
        let error = set(settings).unwrap_err();
        assert!(matches!(error, SceneError::Setting { .. }), "{settings:?}: {error}");
        let error = error.to_string();
        assert!(error.starts_with(expected), "{settings:?}: {error}");
    }
}

/// The file's own mistakes have their lines, whatever is set.
#[test]
fn a_mistake_of_the_file_is_the_file_s() {
    let text = TEXT.replace("radius_m = 0.01", "radius_m = -1");
    let settings = ["run.steps=5".to_owned()];
    let error = parse_set(&text, "two.toml", &settings).unwrap_err().to_string();
    assert_eq!(error, "two.toml:11: rods[0].radius_m = -1, but it must be finite and > 0 [m]");
    // Unless that is what is set.
    let settings = ["rods[0].radius_m=0.01".to_owned()];
    assert_eq!(parse_set(&text, "two.toml", &settings).map(bare).unwrap(), with(&[]));
    let error = parse_set("[[rods]\n", "two.toml", &settings).unwrap_err().to_string();
    assert!(error.starts_with("two.toml:1: not valid TOML"), "{error}");
}

#[test]
fn a_text_says_where_its_entries_stand_and_what_they_leave_out() {
    let left_out = |text: &str| parse(text, "two.toml").unwrap().text.unwrap().left_out();
    let lines = ["cable", "rod-1", "cable/3", "nothing", "cabl"].map(|name| scene::line_of(TEXT, name));
    assert_eq!(lines, [Some(9), Some(19), Some(9), None, None]);
    let expected = [
        "cable: youngs_modulus_pa = 100000, density_kg_m3 = 100",
        "rod-1: radius_m = 0.05, youngs_modulus_pa = 100000, density_kg_m3 = 100",
    ];
    assert_eq!(left_out(TEXT), expected);
    let stiffness = "stiffness = { bending_n_m2 = [1, 1], torsion_n_m2 = 1, mass_kg_m = 1 }";
    let given = TEXT.replace("radius_m = 0.01 # thin", &format!("radius_m = 0.01\nsection.{stiffness}"));
    assert_eq!(left_out(&given), expected[1..]);
    // With what is set.
    let set = parse_set(TEXT, "two.toml", &["rods.cable.density_kg_m3=7".to_owned()]).unwrap();
    assert_eq!(set.text.unwrap().left_out()[0], "cable: youngs_modulus_pa = 100000");
}

//! Sheaths: what comes of their keys, and errors.

use rod::Friction;

const RODS: &str = "[[rods]]\nname = \"tube\"\nradius_m = 0.002\n\
                    shape.straight = { start_m = [0, 0, 0], direction = [1, 0, 0], length_m = 1, segments = 10 }\n\
                    [[rods]]\nname = \"wire\"\nradius_m = 0.001\n\
                    shape.straight = { start_m = [-0.2, 0, 0], direction = [1, 0, 0], length_m = 1.4, segments = 21 }\n";

fn with(keys: &str) -> Result<scene::Scene, String> {
    scene::parse(&format!("{RODS}[[sheaths]]\n{keys}\n"), "x.toml").map_err(|error| error.to_string())
}

const KEYS: &str = "rod = \"wire\"\ninside = \"tube\"\nclearance_m = 0.0005\n";

#[test]
fn a_sheath_is_what_its_keys_say() {
    let scene = with(KEYS).unwrap();
    assert_eq!(scene.sheaths, ["sheath-0"]);
    let own = &scene.model.contacts.sheaths[0];
    assert_eq!((own.inner.clone(), own.outer.clone()), (10..31, 0..10));
    assert_eq!((own.clearance, own.friction), (0.0005, Friction::default()));
    assert!(!scene.model.contacts.is_empty() && scene.model.contacts.between_segments.is_none());
    let scene = with(&format!("{KEYS}friction = {{ at_rest = 0.3, sliding = 0.2 }}\nname = \"liner\"")).unwrap();
    assert_eq!(scene.model.contacts.sheaths[0].friction, Friction { at_rest: 0.3, sliding: 0.2 });
    assert_eq!(scene.sheaths, ["liner"]);
}

#[test]
fn errors_name_the_key() {
    for (keys, expected) in [
        (KEYS.replace("0.0005", "0"), "sheaths[0].clearance_m = 0, but it must be finite and > 0 [m]"),
        (
            KEYS.replace("0.0005", "0.001"),
            "sheaths[0].clearance_m = 0.001, but it must be less than 0.001 m, the outer rod's radius less the inner one's",
        ),
        (KEYS.replace("\"tube\"", "\"tub\""), "sheaths[0].inside = \"tub\", but it must be the name of a rod"),
        (KEYS.replace("\"tube\"", "\"wire\""), "sheaths[0].inside: is the rod itself"),
        (
            "rod = \"tube\"\ninside = \"wire\"\nclearance_m = 0.0005".to_owned(),
            "sheaths[0].rod: has the radius 0.002 m, and `wire` around it 0.001 m: it must be thinner",
        ),
        (format!("{KEYS}friction = -1"), "sheaths[0].friction = -1, but it must be finite and >= 0"),
        (KEYS.replace("clearance_m = 0.0005", ""), "sheaths[0]: missing key `clearance_m`"),
        (format!("{KEYS}name = \"a,b\""), "sheaths[0].name = \"a,b\", but it must be a name without commas"),
    ] {
        let error = with(&keys).unwrap_err();
        assert!(error.contains(expected), "{error}");
    }
    let two = with(&format!("{KEYS}name = \"a\"\n[[sheaths]]\n{KEYS}name = \"a\""));
    assert!(two.unwrap_err().contains("but it must be a name that no other sheath has"));
}

#[test]
fn sheaths_are_nested() {
    let scene = scene::parse(include_str!("../sheaths.toml"), "sheaths.toml").unwrap();
    assert_eq!(scene.sheaths, ["sheath-0", "outermost"]);
    let pairs = scene.model.contacts.sheathed();
    assert!(pairs.contains(&[48..78, 0..20]), "the wire is inside of the housing, too: {pairs:?}");
}

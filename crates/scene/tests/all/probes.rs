//! Probes, frames that are kept, and runs that begin with others' frames: what the keys mean, and mistakes in them.

use std::num::NonZeroUsize;
use std::path::Path;

use rod::{Body, Probe, Quantity};
use scene::{Origin, Scene};

/// Two rods, the second a ring that nothing holds, with `more`.
fn text(more: &str) -> String {
    let rods = "[[rods]]\nname = \"a\"\nclamp = [\"start-face\"]\nfixed_segments = [-1]\n\
                shape.straight = { length_m = 1, segments = 10 }\n\
                [[rods]]\nname = \"o\"\nshape.ring = { radius_m = 1, segments = 8 }\n\
                [[rods]]\nname = \"one\"\nshape.straight = { start_m = [0, 5, 0], length_m = 1, segments = 1 }\n";
    format!("{more}\n{rods}")
}

fn probe(keys: &str) -> Result<Probe, String> {
    let text = text(&format!("[[probes]]\n{keys}"));
    let scene = scene::parse(&text, "x.toml").map_err(|error| error.to_string())?;
    Ok(scene.probes[0].clone())
}

#[test]
fn places_and_names() {
    for (keys, segment, offset) in [
        ("at = \"start-face\"", 0, -0.05),
        ("at = \"start-segment\"", 0, 0.0),
        ("at = \"end-segment\"", 9, 0.0),
        ("at = \"end-face\"", 9, 0.05),
        ("segment = 3", 3, 0.0),
        ("segment = -2\nfraction = 0.75", 8, 0.025),
    ] {
        let found = probe(&format!("rod = \"a\"\nquantities = [\"position\"]\n{keys}")).unwrap();
        assert_eq!((found.name.as_str(), found.segment), ("probe-0", segment), "{keys}");
        assert!((found.offset - offset).abs() < 1e-12, "{keys}: {}", found.offset);
    }
    let found = probe("name = \"p\"\nrod = \"o\"\nsegment = 1\nquantities = [\"curvature\", \"position\"]").unwrap();
    assert_eq!((found.segment, found.quantities), (11, vec![Quantity::Curvature, Quantity::Position]));
}

#[test]
fn a_refined_scene_is_read_at_the_same_places() {
    let text = text("[[probes]]\nrod = \"a\"\nsegment = 2\nfraction = 0.5\nquantities = [\"position\"]");
    let place = |Scene { model, state, probes, .. }: &Scene| {
        let Probe { segment, offset, .. } = probes[0];
        assert!(offset.abs() <= 0.5 * model.segments[segment].length);
        state.positions[segment] + state.axis(segment) * offset
    };
    let coarse = place(&scene::parse(&text, "x.toml").unwrap());
    for factor in [2, 3] {
        let fine = scene::parse_refined(&text, "x.toml", NonZeroUsize::new(factor).unwrap()).unwrap();
        assert!((place(&fine) - coarse).norm() < 1e-12, "{factor}");
    }
}

#[test]
fn what_holds_a_place_is_found() {
    let scene = scene::parse(&text(""), "x.toml").unwrap();
    let held =
        |segment, offset| Probe { name: String::new(), segment, offset, quantities: Vec::new() }.held(&scene.model);
    assert_eq!(held(0, -0.05), Some(Body::Anchor(0)));
    assert_eq!(held(9, 0.05), Some(Body::Segment(9)));
    assert_eq!((held(5, 0.0), held(12, 0.0)), (None, None));
}

#[test]
fn mistakes_are_named_with_their_key() {
    let quantities = "quantities = [\"position\"]";
    for (keys, expected) in [
        (format!("rod = \"b\"\nsegment = 0\n{quantities}"), "probes[0].rod = \"b\", but it must be the name of a rod"),
        (
            format!(
                "rod = \"w\"\nsegment = 0\n{quantities}\n[[bodies]]\nname = \"w\"\nmass_kg = 1\nshape.sphere = {{ radius_m = 0.1 }}"
            ),
            "probes[0].rod: `w` is a rigid body, but a probe reads a place of a rod: name a rod that is joined to it",
        ),
        (format!("rod = \"a\"\n{quantities}"), "probes[0]: give either `at` or `segment`"),
        (format!("rod = \"a\"\nat = \"end-face\"\nsegment = 1\n{quantities}"), "give either `at` or `segment`"),
        (
            format!("rod = \"a\"\nat = \"end\"\n{quantities}"),
            "probes[0].at = \"end\", but it must be one of `start-segment`",
        ),
        (format!("rod = \"o\"\nat = \"end-face\"\n{quantities}"), "a closed rod has no ends; give `segment`"),
        (format!("rod = \"a\"\nat = \"end-face\"\nfraction = 1\n{quantities}"), "goes with `segment`, not with `at`"),
        (
            format!("rod = \"a\"\nsegment = 10\n{quantities}"),
            "probes[0].segment = 10, but it must be a segment's index",
        ),
        (format!("rod = \"a\"\nsegment = 1\nfraction = 2\n{quantities}"), "probes[0].fraction = 2, but it must be 0"),
        (format!("name = \"a,b\"\nrod = \"a\"\nsegment = 1\n{quantities}"), "a name without commas, quotes and line"),
        ("rod = \"a\"\nsegment = 1\nquantities = []".to_owned(), "probes[0].quantities = [], but it must be a list of"),
        (
            "rod = \"a\"\nsegment = 1\nquantities = [\"force\", \"colour\"]".to_owned(),
            "probes[0].quantities[1] = \"colour\", but it must be one of position, orientation, velocity",
        ),
        (
            "rod = \"a\"\nsegment = 1\nquantities = [\"force\", \"force\"]".to_owned(),
            "probes[0].quantities[1]: it is read once already",
        ),
        (
            "rod = \"a\"\nsegment = 1\nquantities = [\"reaction\"]".to_owned(),
            "probes[0].quantities[0]: nothing holds the rod there",
        ),
        (
            "rod = \"one\"\nsegment = 0\nquantities = [\"tension\"]".to_owned(),
            "probes[0].quantities[0]: the segment is joined to nothing",
        ),
        (
            format!(
                "rod = \"a\"\nsegment = 1\n{quantities}\n[[probes]]\nname = \"probe-0\"\nrod = \"a\"\nsegment = 2\n{quantities}"
            ),
            "probes[1].name = \"probe-0\", but it must be a name that no other probe has",
        ),
    ] {
        let error = probe(&keys).unwrap_err();
        assert!(error.starts_with("x.toml:") && error.contains(expected), "{keys}\n{error}");
    }
}

#[test]
fn a_run_begins_in_a_folder_beside_the_scene() {
    let parsed = |run: &str| scene::parse(&text(run), "folder/x.toml").map_err(|error| error.to_string());
    let from = |text: &str| parsed(&format!("run.from = \"{text}\"")).map(|scene| scene.from.unwrap());
    let origin = |folder: &str, frame| Ok(Origin { folder: Path::new("folder").join(folder), frame });
    assert_eq!(from("out/rest"), origin("out/rest", None));
    assert_eq!(from("out/rest@12"), origin("out/rest", Some(12)));
    assert_eq!(from("a@b/c"), origin("a@b/c", None));
    assert_eq!(parsed("").unwrap().from, None);
    for wrong in ["out@x", "", "@3"] {
        let error = from(wrong).unwrap_err();
        assert!(error.starts_with(&format!("folder/x.toml:1: run.from = \"{wrong}\", but it must be ")), "{error}");
    }
    assert_eq!(parsed("run.every = 7").unwrap().run.every, 7);
    let error = parsed("run.every = 0").unwrap_err();
    assert_eq!(error, "folder/x.toml:1: run.every = 0, but it must be a whole number from 1 to 1000000000");
}

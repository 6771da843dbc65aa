//! Eyelets: what comes of their keys, and errors.

use nalgebra::Vector3;
use rod::Body;

const ROPE: &str = "[[bodies]]\nname = \"box\"\nshape.box = { sides_m = [0.1, 0.1, 0.1] }\nmass_kg = 1\n[[rods]]\nname = \"rope\"\n\
                    shape.straight = { start_m = [1, 0, 0], direction = [1, 0, 0], length_m = 2, segments = 20 }\n";

fn with(eyelets: &str) -> Result<scene::Scene, String> {
    scene::parse(&format!("{ROPE}{eyelets}"), "x.toml").map_err(|error| error.to_string())
}

#[test]
fn an_eyelet_is_where_its_rod_is() {
    let scene = with(
        "[[eyelets]]\nname = \"ring\"\nat = { rod = \"rope\", segment = 4, fraction = 0.25 }\nfriction = 0.3\n[[eyelets]]\n\
         at = { rod = \"rope\", segment = 10, fraction = 0 }\non = { body = \"box\" }",
    )
    .unwrap();
    assert_eq!(scene.eyelets, ["ring", "eyelet-1"]);
    let [ring, own] = &scene.model.sliding_joints[..] else { panic!() };
    assert_eq!((ring.holder, ring.segments.clone(), ring.friction), (Body::Anchor(0), 1..21, 0.3));
    assert!((ring.start - 0.425).abs() < 1e-12 && (own.start - 1.0).abs() < 1e-12);
    assert!((scene.model.anchors[0].position - Vector3::x() * 1.425).norm() < 1e-12);
    assert_eq!((own.holder, own.friction), (Body::Segment(0), 0.0));
    assert!((own.place - Vector3::x() * 2.0).norm() < 1e-12);
    // Cut into three, segments have the eyelets at the same places.
    let text = format!("{ROPE}[[eyelets]]\nat = {{ rod = \"rope\", segment = 4, fraction = 0.25 }}\n");
    let refined = scene::parse_refined(&text, "x.toml", std::num::NonZeroUsize::new(3).unwrap()).unwrap();
    assert!((refined.model.sliding_joints[0].start - 0.425).abs() < 1e-12);
}

#[test]
fn errors_name_the_key() {
    for (eyelet, expected) in [
        ("at = { body = \"box\" }", "eyelets[0].at: must name a `rod` that runs through the eyelet, not a `body`"),
        ("at = { rod = \"rope\" }\nfriction = -1", "eyelets[0].friction = -1, but it must be finite and >= 0"),
        ("at = { rod = \"rope\" }\non = { rod = \"rope\" }", "eyelets[0].on: is the rod that runs through the eyelet"),
        (
            "at = { rod = \"rope\" }\non = { body = \"box\", at_m = [0, 0, 0] }",
            "eyelets[0].on: the eyelet is where the rod is; leave `at_m` out",
        ),
        (
            "at = { rod = \"rope\" }\non = { body = \"box\" }\nmotion = { times_s = [0], shifts_m = [[0, 0, 0]] }",
            "eyelets[0].motion: does not go with `on`; leave one of them out",
        ),
        (
            "at = { rod = \"rope\" }\nmotion = { at = \"end-face\", times_s = [0], shifts_m = [[0, 0, 0]] }",
            "eyelets[0].motion.at: goes with grips of rods, not with an eyelet",
        ),
        ("name = \"a,b\"\nat = { rod = \"rope\" }", "eyelets[0].name = \"a,b\", but it must be a name without commas"),
        ("at = { rod = \"rop\" }", "eyelets[0].at.rod = \"rop\", but it must be the name of a rod"),
        ("friction = 1", "eyelets[0]: missing key `at`"),
    ] {
        let error = with(&format!("[[eyelets]]\n{eyelet}\n")).unwrap_err();
        assert!(error.contains(expected), "{error}");
    }
    let two = with(
        "[[eyelets]]\nname = \"a\"\nat = { rod = \"rope\" }\n[[eyelets]]\nname = \"a\"\nat = { rod = \"rope\" }\n",
    );
    assert!(two.unwrap_err().contains("eyelets[1].name = \"a\", but it must be a name that no other eyelet has"));
    let ring = "[[rods]]\nname = \"ring\"\nshape.ring = { radius_m = 1, segments = 12 }\n[[eyelets]]\nat = { rod = \"ring\" }\n";
    assert!(scene::parse(ring, "x.toml").unwrap_err().to_string().contains("`ring` is closed"));
}

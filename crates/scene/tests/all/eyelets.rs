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

#[test]
fn a_feed_has_a_store() {
    let eyelet = "[[eyelets]]\nat = { rod = \"rope\", segment = 4, fraction = 0.25 }\n";
    let feed = |feed: &str| with(&format!("{eyelet}feed = {{ {feed} }}\n"));
    let scene = feed("speed_m_s = 0.1, max_force_n = 20, min_length_m = 0.5").unwrap();
    let own = scene.model.sliding_joints[0].feed.as_ref().unwrap();
    assert!(own.is_stored);
    assert_eq!((own.speed(3.0), own.max_force, own.lengths), (0.1, 20.0, [0.5, f64::INFINITY]));
    let [from, to] = scene.model.sliding_joints[0].range(&scene.model);
    assert!(from == 0.0 && (to - 1.5).abs() < 1e-12, "{from} {to}");
    let scene = feed("times_s = [1, 3], speeds_m_s = [0.2, -0.2], store = false").unwrap();
    let own = scene.model.sliding_joints[0].feed.as_ref().unwrap();
    assert_eq!([0.0, 1.5, 4.0].map(|time| own.speed(time)), [0.2, 0.1, -0.2]);
    assert!(!own.is_stored && own.max_force == f64::INFINITY);
    for (keys, expected) in [
        ("max_force_n = 1", "eyelets[0].feed: must have `speed_m_s`, or `times_s` and `speeds_m_s`"),
        ("speed_m_s = 1, speeds_m_s = [1]", "eyelets[0].feed: must have `speed_m_s`, or `times_s` and `speeds_m_s`"),
        ("times_s = [0, 1], speeds_m_s = [1]", "eyelets[0].feed.speeds_m_s: has 1 entries, but `times_s` has 2"),
        ("speed_m_s = inf", "eyelets[0].feed.speed_m_s = inf, but it must be finite [m/s]"),
        ("speed_m_s = 1, max_force_n = -1", "eyelets[0].feed.max_force_n = -1, but it must be finite and >= 0 [N]"),
        (
            "speed_m_s = 1, min_length_m = 2, max_length_m = 1",
            "eyelets[0].feed: has a `min_length_m` above its `max_length_m`",
        ),
        (
            "speed_m_s = 1, max_length_m = 1",
            "eyelets[0].at: leaves 1.575 m of the rod beyond the eyelet, but `feed` allows 0 to 1 m",
        ),
    ] {
        let error = feed(keys).unwrap_err();
        assert!(error.contains(expected), "{error}");
    }
    let error = |text: &str| with(text).unwrap_err();
    let feed = "feed = { speed_m_s = 1 }\n";
    let held = error(&format!("fixed_segments = [0]\n{eyelet}{feed}"));
    assert!(held.contains("eyelets[0].feed: goes with a rod that has no held segments"), "{held}");
    let clamped = error(&format!("clamp = [\"start-face\"]\n{eyelet}{feed}"));
    assert!(clamped.contains("eyelets[0].at: must be at most 0.05 m along the rod"), "{clamped}");
    let yields = error(&format!("yield = {{ stress_pa = 1e6, hardening_isotropic = 0.1 }}\n{eyelet}{feed}"));
    assert!(yields.contains("eyelets[0].feed: goes with an elastic rod, without `yield`"), "{yields}");
    let rough = error(&format!("{eyelet}friction = 0.1\n{feed}"));
    assert!(rough.contains("eyelets[0].friction: does not go with `feed`"), "{rough}");
    let behind = error(&format!("{eyelet}{feed}[[eyelets]]\nat = {{ rod = \"rope\", segment = 2 }}\n"));
    assert!(behind.contains("eyelets[0].at: must be before all other eyelets of a rod that is stored"), "{behind}");
}

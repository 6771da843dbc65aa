//! Hung cables, curves from tables, strained rods and copies in scene files: what they mean, and what is wrong with them.

use nalgebra::Vector3;
use rod::{Body, measure};
use scene::Scene;

fn error_of(text: &str) -> String {
    let error = scene::parse(text, "x.toml").unwrap_err().to_string();
    assert!(error.starts_with("x.toml:") && !error.contains('\n'), "{error}");
    error
}

/// Checks where both end faces of a scene's only clamped rod are held [m].
fn assert_held(scene: &Scene, start: Vector3<f64>, end: Vector3<f64>) {
    let [first, last] = &scene.model.anchors[..] else { panic!("two anchors") };
    assert!(
        (first.position - start).norm() < 1e-12 && (last.position - end).norm() < 1e-12,
        "{:?}",
        scene.model.anchors
    );
}

mod hung {
    use super::*;

    fn text(keys: &str, shape: &str) -> String {
        format!(
            "[[rods]]\nradius_m = 0.01\nclamp = [\"start-face\", \"end-face\"]\n{keys}\n[rods.shape.hung]\n{shape}\n"
        )
    }

    #[test]
    fn a_cable_has_its_length_and_its_ends_and_was_made_straight() {
        let shape = "from_m = [0, 0, 5]\nto_m = [4, 3, 6]\nlength_m = 7\nsegments = 40";
        let scene = scene::parse(&text("", shape), "x.toml").unwrap();
        assert!((measure::rod_lengths(&scene.model, &scene.state)[0] - 7.0).abs() < 1e-11);
        assert_held(&scene, Vector3::z() * 5.0, Vector3::new(4.0, 3.0, 6.0));
        assert!(scene.model.joints.iter().all(|joint| joint.rest_darboux == Vector3::zeros()));
        let initial = scene::parse(&text("rest = \"initial\"", shape), "x.toml").unwrap();
        assert!(initial.model.joints.iter().any(|joint| joint.rest_darboux.norm() > 0.1));
        // It hangs along the scene's gravity, be it over time.
        let sideways = format!("gravity_m_s2 = [0, 9.81, 0]\n{}", text("", shape));
        let over_time = format!(
            "gravity_over_time = {{ times_s = [0, 1], values_m_s2 = [[0, 9.81, 0], [9.81, 0, 0]] }}\n{}",
            text("", shape)
        );
        let middle = |text: &str| scene::parse(text, "x.toml").unwrap().state.positions[20];
        assert!(middle(&sideways).y > 3.0);
        assert_eq!(middle(&sideways), middle(&over_time));
    }

    #[test]
    fn both_kinds_of_clamps_hold_the_directions() {
        let shape =
            "to_m = [1, 0, 0]\nlength_m = 2\nsegments = 40\nstart_direction = [0, 0, 3]\nend_direction = [0, 1, 0]";
        let scene = scene::parse(&text("", shape), "x.toml").unwrap();
        for (anchor, direction) in scene.model.anchors.iter().zip([Vector3::z(), Vector3::y()]) {
            assert!((anchor.orientation * Vector3::z() - direction).norm() < 1e-9);
        }
        assert!(
            (scene.state.axis(0) - Vector3::z()).norm() < 1e-9 && (scene.state.axis(39) - Vector3::y()).norm() < 1e-9
        );
    }

    #[test]
    fn a_branch_hangs_from_where_it_grows() {
        let text = "[[rods]]\nname = \"mast\"\nshape.straight = { direction = [0, 0, 1], length_m = 4, segments = 8 }\n\
                    [[rods]]\nbranch_of = { rod = \"mast\" }\nradius_m = 0.01\n\
                    shape.hung = { to_m = [3, 0, 4], length_m = 3.5, segments = 20 }";
        let scene = scene::parse(text, "x.toml").unwrap();
        assert!(measure::worst_gap(&scene.model, &scene.state) < 1e-9);
        assert!(
            error_of(&text.replace("{ to_m", "{ from_m = [0, 0, 4], to_m"))
                .contains("from_m: a branch starts on its parent; leave it out")
        );
    }

    #[test]
    fn mistakes() {
        let of = |keys: &str, shape: &str| error_of(&text(keys, shape));
        let short = "to_m = [4, 3, 0]\nlength_m = 4\nsegments = 40";
        assert_eq!(
            of("", short),
            "x.toml:7: rods[0].shape.hung.length_m = 4, but it must be at least the distance of its ends, 5 [m]; a cable \
             that is to stretch needs `stretch = \"physical\"` or a compliance"
        );
        let taut = scene::parse(&text("stretch = \"physical\"", short), "x.toml").unwrap();
        assert!((measure::worst_gap(&taut.model, &taut.state) - 0.25).abs() < 1e-9);
        for (keys, shape, expected) in [
            ("", short.replace("= 4\n", "= 0\n"), "length_m = 0, but it must be finite and > 0 [m]"),
            ("", short.replace("= 40", "= 7"), "segments = 7, but it must be a whole number from 8 to 10000000"),
            ("", "length_m = 4\nsegments = 40".to_owned(), "rods[0].shape.hung: missing key `to_m`"),
            (
                "",
                format!("{short}\nend_direction = [0, 0, 1]"),
                "end_direction: a cable of 4 m between ends 5 m apart is straight",
            ),
            (
                "",
                format!("{}\nend_direction = [0, 0, 1]", short.replace("= 4\n", "= 5.01\n")),
                "length_m = 5.01, but it must be longer",
            ),
            ("stretch = \"physical\"\nstrain = 0.1", short.to_owned(), "strain: says a second time how far"),
            (
                "stretch = \"physical\"",
                short.replace("= 4\n", "= 1\n"),
                "such that its strain is -0.5 to 1, and this gives 4",
            ),
        ] {
            let error = of(keys, &shape);
            assert!(error.contains(expected), "{error}");
        }
    }
}

mod curve {
    use super::*;

    /// Writes a table and a scene that names it with these keys, and loads the scene.
    fn with_table(table: &str, keys: &str) -> Result<Scene, String> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("curve.csv"), table).unwrap();
        let path = folder.path().join("x.toml");
        let text = format!("[[rods]]\nradius_m = 0.01\nshape.curve = {{ file = \"curve.csv\"{keys} }}\n");
        std::fs::write(&path, text).unwrap();
        let place = folder.path().display().to_string();
        scene::load(&path).map_err(|error| error.to_string().replace(&format!("{place}/"), ""))
    }

    const CORNER: &str = "x_mm,y_mm,z_mm\n0,0,1000\n2000,0,1000\n2000,1000,1000\n";

    #[test]
    fn a_row_is_a_node_or_a_place_that_the_curve_goes_through() {
        let rows = with_table(CORNER, "").unwrap();
        assert_eq!(rows.state.positions, [Vector3::new(1.0, 0.0, 1.0), Vector3::new(2.0, 0.5, 1.0)]);
        // At rest as it is drawn.
        assert!((rows.model.joints[0].rest_rotation().angle() - std::f64::consts::FRAC_PI_2).abs() < 1e-9);
        let polygon = with_table(CORNER, ", segments = 6, interpolation = \"linear\"").unwrap();
        assert!(polygon.model.segments.iter().all(|segment| (segment.length - 0.5).abs() < 1e-12));
        let smooth = with_table(CORNER, ", segments = 60").unwrap();
        let lengths: Vec<f64> = smooth.model.segments.iter().map(|segment| segment.length).collect();
        assert!(lengths.iter().all(|length| (length / lengths[0] - 1.0).abs() < 1e-2), "{lengths:?}");
        let corner = Vector3::new(2.0, 0.0, 1.0);
        assert!(smooth.state.positions.iter().any(|x| (x - corner).norm() < lengths[0]));
        let columns = "z_m,x_m,y_m\n1,0,0\n1,2,0\n1,2,1\n";
        assert_eq!(with_table(columns, "").unwrap().state, rows.state);
        let closed = with_table(CORNER, ", closed = true").unwrap();
        assert_eq!((closed.model.segments.len(), closed.model.joints.len(), closed.rods[0].closed), (3, 3, true));
        assert_eq!(with_table(CORNER, ", closed = true, segments = 12").unwrap().model.joints.len(), 12);
    }

    #[test]
    fn many_rows() {
        let row = |k: i32| {
            let (sin, cos) = (f64::from(k) * 1e-3).sin_cos();
            format!("{cos},{sin},{}\n", f64::from(k) * 1e-5)
        };
        let table: String = std::iter::once("x_m,y_m,z_m\n".to_owned()).chain((0..100_000).map(row)).collect();
        assert_eq!(with_table(&table, "").unwrap().model.segments.len(), 99_999);
        assert_eq!(with_table(&table, ", segments = 1000").unwrap().model.segments.len(), 1000);
    }

    #[test]
    fn mistakes_are_named_with_their_line() {
        for (table, keys, expected) in [
            ("", "", "curve.csv:1: give the columns x_m, y_m, z_m, or those in cm or mm"),
            ("x_m,y_m,z_m,x_mm,y_mm,z_mm\n", "", "curve.csv:1: give the columns x_m, y_m, z_m, or those"),
            ("x_m,y_m\n0,0\n", "", "curve.csv:1: some of the columns x_m, y_m, z_m are missing"),
            ("x_in,y_in,z_in\n", "", "curve.csv:1: column `x_in` is not known; there are x_m, y_m, z_m, x_cm"),
            ("x_m,y_m,z_m\n0,0,0\n", "", "curve.csv:1: 1 rows, but there must be at least 2"),
            ("x_m,y_m,z_m\n0,0,0\n1,0,0\n", ", closed = true", "curve.csv:1: 2 rows, but there must be at least 3"),
            ("x_m,y_m,z_m\n0,0,0\n1,0,nan\n", "", "curve.csv:3: z_m = nan, but it must be a finite number"),
            ("x_m,y_m,z_m\n0,0,0\n0,0,0\n", "", "curve.csv:3: this row is where the row before it is"),
            (
                "x_m,y_m,z_m\n0,0,0\n1,0,0\n0,1,0\n0,0,0\n",
                ", closed = true",
                "curve.csv:1: the last row is where the first is",
            ),
            ("x_m,y_m,z_m\n0,0,0\n1,0\n", "", "curve.csv:3: this row has not as many values"),
            (
                CORNER,
                ", interpolation = \"linear\"",
                "x.toml:3: rods[0].shape.curve.interpolation: goes with `segments`",
            ),
            (
                CORNER,
                ", segments = 0",
                "x.toml:3: rods[0].shape.curve.segments = 0, but it must be a whole number from 1",
            ),
            (CORNER, ", closed = true, segments = 2", "segments = 2, but it must be a whole number from 3"),
            (CORNER, ", segments = 20_000_000", "but it must be a whole number from 1 to 10000000"),
        ] {
            let error = with_table(table, keys).unwrap_err();
            assert!(error.starts_with(expected) || error.contains(expected) && !error.starts_with("curve"), "{error}");
            assert!(!error.contains('\n'), "{error}");
        }
        let missing = error_of("[[rods]]\nshape.curve = { file = \"none.csv\" }");
        assert!(missing.contains(
            "shape.curve.file = \"none.csv\", but it must be a CSV or USD file, and there is none at none.csv"
        ));
    }
}

mod strained {
    use super::*;

    fn text(keys: &str) -> String {
        format!(
            "[[rods]]\nradius_m = [0.02, 0.01]\nyoungs_modulus_pa = 1e6\nclamp = [\"start-face\", \"end-face\"]\n{keys}\n\
             shape.straight = {{ start_m = [1, 0, 0], length_m = 4, segments = 10 }}\n"
        )
    }

    fn lengths(keys: &str) -> Vec<f64> {
        let scene = scene::parse(&text(keys), "x.toml").unwrap();
        assert_held(&scene, Vector3::x(), Vector3::x() * 5.0);
        scene.model.segments.iter().map(|segment| segment.length).collect()
    }

    #[test]
    fn a_rod_is_drawn_where_the_scene_says_and_is_as_long_as_it_says() {
        const PHYSICAL: &str = "stretch = \"physical\"";
        assert!(lengths(PHYSICAL).iter().all(|length| (length - 0.4).abs() < 1e-15));
        assert!(lengths(&format!("{PHYSICAL}\nstrain = 0.25")).iter().all(|length| (length - 0.32).abs() < 1e-12));
        assert!(lengths(&format!("{PHYSICAL}\nstrain = -0.2")).iter().all(|length| (length - 0.5).abs() < 1e-12));
        assert!((lengths(&format!("{PHYSICAL}\nrest_length_m = 3.2")).iter().sum::<f64>() - 3.2).abs() < 1e-12);
        assert!(
            (lengths("stretch = { compliance_m_per_n = 1e-6 }\nrest_length_m = 5").iter().sum::<f64>() - 5.0).abs()
                < 1e-12
        );
        // The pull is the same all along, so that thin segments are stretched more.
        let scene = scene::parse(&text(&format!("{PHYSICAL}\ntension_n = 10")), "x.toml").unwrap();
        for joint in &scene.model.joints {
            let pull = -measure::stretch_gap(&scene.model, &scene.state, joint).x / joint.stretch_compliance;
            assert!((pull / 10.0 - 1.0).abs() < 1e-12, "{pull} N");
        }
        assert!(scene.model.segments[9].length < scene.model.segments[0].length);
    }

    #[test]
    fn it_is_cut_branched_and_joined_as_it_is_drawn() {
        let text = text("stretch = \"physical\"\nstrain = 0.1\nname = \"a\"")
            + "[[rods]]\nbranch_of = { rod = \"a\", segment = 3 }\nshape.straight = { direction = [0, 0, 1], length_m = 1, segments = 2 }\n";
        let scene = scene::parse(&text, "x.toml").unwrap();
        let start = scene.state.positions[10] - scene.state.axis(10) * 0.25;
        assert!((start - Vector3::new(1.0 + 4.0 * 0.4, 0.0, 0.0)).norm() < 1e-12);
        let fine = scene::parse_refined(&text, "x.toml", std::num::NonZeroUsize::new(3).unwrap()).unwrap();
        let mass = |scene: &Scene| scene.model.segments.iter().map(|segment| segment.mass()).sum::<f64>();
        assert!((mass(&fine) / mass(&scene) - 1.0).abs() < 1e-3);
        assert_held(&fine, Vector3::x(), Vector3::x() * 5.0);
        // A strained ring is as long as its rest length says.
        let ring = "[[rods]]\nstretch = \"physical\"\nrest_length_m = 6\nshape.ring = { radius_m = 1, segments = 20 }";
        let ring = scene::parse(ring, "x.toml").unwrap();
        assert!((ring.model.segments.iter().map(|segment| segment.length).sum::<f64>() - 6.0).abs() < 1e-12);
    }

    #[test]
    fn mistakes() {
        for (keys, expected) in [
            ("strain = 0.1", "strain: the rod does not stretch; give `stretch = \"physical\"` or a compliance"),
            ("stretch = { compliance_m_per_n = 0 }\nstrain = 0.1", "strain: the rod does not stretch"),
            ("stretch = \"physical\"\nstrain = nan", "strain = nan, but it must be finite"),
            (
                "stretch = \"physical\"\nstrain = -0.6",
                "strain = -0.6, but it must be such that its strain is -0.5 to 1",
            ),
            (
                "stretch = \"physical\"\nrest_length_m = 1",
                "rest_length_m = 1, but it must be such that its strain is -0.5 to 1, and this gives 3",
            ),
            ("stretch = \"physical\"\nrest_length_m = -1", "rest_length_m = -1, but it must be finite and > 0 [m]"),
            ("stretch = \"physical\"\ntension_n = 1e9", "tension_n = 1e9, but it must be such that its strain is"),
            ("stretch = \"physical\"\ntension_n = 1\nstrain = 0.1", "tension_n: says a second time how far"),
            ("stretch = { compliance_m_per_n = 1e-6 }\ntension_n = 1", "tension_n: goes with `stretch = \"physical\"`"),
        ] {
            let error = error_of(&text(keys));
            assert!(error.contains(&format!("rods[0].{expected}")), "{error}");
        }
    }
}

mod copies {
    use super::*;

    const BASE: &str = "
        [[rods]]
        name = \"trunk\"
        clamp = [\"start-face\"]
        tree = { branches = 3, levels = 1, segments = 2 }
        shape.straight = { direction = [0, 0, 1], length_m = 2, segments = 4 }

        [[rods]]
        name = \"twig\"
        branch_of = { rod = \"trunk\" }
        shape.straight = { direction = [1, 0, 0], length_m = 1, segments = 2 }
        loads = [{ at = \"end-face\", force_n = [1, 0, 0] }]

        [[rods]]
        name = \"bar\"
        shape.straight = { start_m = [0, 0, 5], length_m = 1, segments = 2 }
        ";

    fn parsed(copies: &str) -> Scene {
        scene::parse(&format!("{BASE}{copies}"), "x.toml").unwrap()
    }

    fn names(scene: &Scene) -> Vec<&str> {
        scene.rods.iter().map(|rod| rod.name.as_str()).collect()
    }

    #[test]
    fn a_rod_takes_what_grows_on_it_along() {
        let scene = parsed(
            "[[copies]]\nrods = [\"trunk\"]\nshifts_m = [[5, 0, 0], [0, 5, 0]]\nturns_deg = [[0, 0, 0], [0, 0, 90]]",
        );
        let own = ["trunk", "trunk/0", "trunk/1", "trunk/2", "twig", "bar"];
        assert_eq!(names(&scene)[..6], own);
        assert_eq!(names(&scene)[6..11], ["trunk-1", "trunk-1/0", "trunk-1/1", "trunk-1/2", "twig-1"]);
        assert_eq!(names(&scene)[11..], ["trunk-2", "trunk-2/0", "trunk-2/1", "trunk-2/2", "twig-2"]);
        assert_eq!((scene.model.anchors.len(), scene.model.loads.len()), (3, 3));
        assert!((scene.model.loads[2].force - Vector3::y()).norm() < 1e-12, "loads turn along");
        let rod = |name: &str| scene.rods.iter().find(|rod| rod.name == name).unwrap().segments.clone();
        for (a, b) in rod("twig").zip(rod("twig-2")) {
            let expected = Vector3::new(0.0, 5.0, 0.0)
                + Vector3::z().cross(&scene.state.positions[a])
                + Vector3::z() * scene.state.positions[a].z;
            assert!((scene.state.positions[b] - expected).norm() < 1e-12);
        }
        assert!(measure::worst_gap(&scene.model, &scene.state) < 1e-9);
        // Copies can be copied, with what grows on them.
        let again = parsed(
            "[[copies]]\nrods = [\"trunk\"]\nshifts_m = [[5, 0, 0]]\n[[copies]]\nrods = [\"trunk-1\"]\nshifts_m = [[0, 9, 0]]",
        );
        assert_eq!(names(&again)[11..], ["trunk-1-1", "trunk-1-1/0", "trunk-1-1/1", "trunk-1-1/2", "twig-1-1"]);
    }

    #[test]
    fn a_grid_and_turns_about_a_place() {
        let grid = parsed("[[copies]]\nrods = [\"bar\"]\ncount = [2, 3, 2]\nspacing_m = [2, 0.5, -1]");
        assert_eq!(grid.rods.len(), 6 + 11);
        let last = grid.state.positions[grid.state.len() - 2] - grid.state.positions[grid.rods[5].segments.start];
        assert!((last - Vector3::new(2.0, 1.0, -1.0)).norm() < 1e-12);
        let turned = parsed("[[copies]]\nrods = [\"bar\"]\nturns_deg = [[0, 0, 180]]\nabout_m = [1, 0, 0]");
        let [a, b] = [5, 6].map(|k: usize| turned.state.positions[turned.rods[k].segments.start]);
        assert!((a - Vector3::new(0.25, 0.0, 5.0)).norm() < 1e-12 && (b - Vector3::new(1.75, 0.0, 5.0)).norm() < 1e-12);
    }

    #[test]
    fn joins_name_copies_too() {
        let scene = parsed(
            "[[copies]]\nrods = [\"bar\"]\nshifts_m = [[1, 0, 0]]\n[[joins]]\na = { rod = \"bar\" }\n\
             b = { rod = \"bar-1\", segment = 0, fraction = 0 }",
        );
        let joint = scene.model.joints.last().unwrap();
        let [bar, copy] = [5, 6].map(|k: usize| scene.rods[k].segments.clone());
        assert_eq!((joint.a, joint.b), (Body::Segment(bar.end - 1), Body::Segment(copy.start)));
    }

    #[test]
    fn mistakes() {
        for (copies, expected) in [
            ("rods = [\"bar\"]", "copies[0]: give `shifts_m`, `turns_deg` or both, or `count` and `spacing_m`"),
            ("rods = []\nshifts_m = [[1, 0, 0]]", "copies[0].rods = [], but it must be at least one name of a rod"),
            (
                "rods = [\"bat\"]\nshifts_m = [[1, 0, 0]]",
                "copies[0].rods[0] = \"bat\", but it must be the name of a rod, a net or a body: `trunk`",
            ),
            (
                "rods = [\"twig\"]\nshifts_m = [[1, 0, 0]]",
                "copies[0].rods: `twig` grows on `trunk`; name that rod, too",
            ),
            (
                "rods = [\"bar\"]\nshifts_m = [[1, 0, nan]]",
                "shifts_m[0] = [1, 0, nan], but it must be three finite numbers [m]",
            ),
            (
                "rods = [\"bar\"]\nshifts_m = [[1, 0, 0]]\nturns_deg = []",
                "turns_deg: has 0 entries, but `shifts_m` has 1",
            ),
            ("rods = [\"bar\"]\nshifts_m = [[1, 0, 0]]\nabout_m = [0, 0, 0]", "about_m: goes with `turns_deg`"),
            ("rods = [\"bar\"]\ncount = [2, 1, 1]", "count: goes with `spacing_m`"),
            ("rods = [\"bar\"]\nspacing_m = [2, 1, 1]", "spacing_m: goes with `count`"),
            (
                "rods = [\"bar\"]\nshifts_m = []\ncount = [2, 1, 1]\nspacing_m = [2, 1, 1]",
                "shifts_m: does not go with `count`",
            ),
            (
                "rods = [\"bar\"]\ncount = [2, 0, 1]\nspacing_m = [2, 1, 1]",
                "count[1] = 0, but it must be a whole number from 1",
            ),
            (
                "rods = [\"bar\"]\ncount = [1000, 1000, 1000]\nspacing_m = [2, 1, 1]",
                "copies[0]: with these copies the scene has 2000000012 segments, but",
            ),
            (
                "rods = [\"bar\"]\nshifts_m = [[1, 0, 0]]\n[[copies]]\nrods = [\"bar\"]\nshifts_m = [[2, 0, 0]]",
                "copies[1].rods: copy 1 of `bar` is called `bar-1`, as another rod is",
            ),
        ] {
            let error = error_of(&format!("{BASE}\n[[copies]]\n{copies}"));
            assert!(error.contains(expected), "{error}");
        }
        let late = "[[copies]]\nrods = [\"bar\"]\nshifts_m = [[1, 0, 0]]\n[[joins]]\na = { rod = \"bar\" }\nb = { rod = \"bar-2\" }";
        assert!(
            error_of(&format!("{BASE}\n{late}"))
                .contains("joins[0].b.rod = \"bar-2\", but it must be the name of a rod")
        );
    }
}

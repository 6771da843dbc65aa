//! What a run keeps of its scene, and what it says of names, probes and extremes.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::common::{json, run, texts};
use cosserat::scene;
use serde_json::{Value, json};

/// A cable between a clamp and a gripper that moves as a table says, over a mesh and a copy, with probes.
const SCENE: &str = r#"
run = { dt_s = 0.01, steps = 12 }
copies = [{ rods = ["rope"], shifts_m = [[0, 0.5, 0]] }]

[[obstacles]]
name = "wedge"
shape.mesh = { file = "../meshes/tent.obj", position_m = [0, 0, -2] }

[[obstacles]]
shape.plane.point_m = [0, 0, -9]

[[bodies]]
name = "hook"
shape.sphere = { radius_m = 0.1 }
mass_kg = 1
position_m = [3, 0, 0]

[[rods]]
name = "cable, steel"
clamp = ["start-segment"]
shape.straight = { length_m = 1, segments = 6 }
motions = [{ at = "end-face", file = 'tables/way.csv' }]

[[rods]]
name = "rope"
clamp = ["start-face"]
shape.straight = { start_m = [0, 0.1, 0], length_m = 1, segments = 4 }

[[probes]]
name = "tip"
rod = "rope"
at = "end-face"
quantities = ["position", "orientation"]

[[probes]]
name = "grip"
rod = "cable, steel"
at = "end-face"
quantities = ["tension", "reaction"]
"#;

const WAY: &str = "time_s,shift_x_m,shift_y_m,shift_z_m\n0,0,0,0\n0.1,0,0.02,0.01\n1,0,0.3,0\n";
const TENT: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

/// Writes the scene with its files below a folder and returns its path.
fn write_scene(place: &Path) -> String {
    for folder in ["scenes/tables", "meshes"] {
        fs::create_dir_all(place.join(folder)).expect("a folder");
    }
    fs::write(place.join("scenes/tables/way.csv"), WAY).expect("a file");
    fs::write(place.join("meshes/tent.obj"), TENT).expect("a file");
    let scene = place.join("scenes/hang.toml");
    fs::write(&scene, SCENE).expect("a file");
    scene.to_str().expect("UTF-8").to_owned()
}

fn quiet(arguments: &[&str]) {
    assert_eq!(texts(&run(&[arguments, &["--quiet"]].concat())), (Some(0), "", ""), "{arguments:?}");
}

fn read_json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).expect("a file")).expect("JSON")
}

/// A table's header and rows.
fn table(path: &Path) -> (Vec<String>, Vec<Vec<String>>) {
    let mut reader = csv::Reader::from_path(path).expect("a table");
    let texts = |record: &csv::StringRecord| record.iter().map(str::to_owned).collect::<Vec<_>>();
    let header = texts(reader.headers().expect("a header"));
    (header, reader.records().map(|record| texts(&record.expect("a row"))).collect())
}

#[test]
fn a_run_keeps_its_scene_and_what_that_names() {
    let place = tempfile::tempdir().expect("a folder");
    let scene = write_scene(place.path());
    let [own, again, on] = ["own", "again", "on"].map(|name| place.path().join("runs").join(name));
    let [at_own, at_again, at_on] = [&own, &again, &on].map(|path| path.to_str().expect("UTF-8"));
    quiet(&[&scene, "--out", at_own, "--export", "csv", "--trajectory"]);
    let kept = fs::read_to_string(own.join("run-scene.toml")).expect("the scene");
    assert_eq!(
        kept,
        SCENE.replace("../meshes/tent.obj", "run-tent.obj").replace("'tables/way.csv'", "\"run-way.csv\"")
    );
    assert_eq!(fs::read_to_string(own.join("run-way.csv")).expect("a copy"), WAY);

    // Nothing else is needed from here on.
    fs::remove_dir_all(place.path().join("scenes")).expect("a folder");
    fs::remove_dir_all(place.path().join("meshes")).expect("a folder");
    let tables = ["segments.csv", "joints.csv", "reactions.csv", "obstacles.csv"];
    let before = tables.map(|name| fs::read(own.join(name)).expect("a table"));
    tables.iter().for_each(|name| fs::remove_file(own.join(name)).expect("a table"));
    quiet(&["export", at_own, "--export", "csv"]);
    assert!(tables.map(|name| fs::read(own.join(name)).expect("a table")) == before);
    quiet(&["--from", at_own, "--out", at_on, "--steps", "2"]);
    assert_eq!(read_json(&on.join("summary.json"))["scene"], "hang");

    // The kept scene is a scene, and a run of it keeps the same, also in its own folder.
    let kept_file = own.join("run-scene.toml");
    quiet(&[kept_file.to_str().expect("UTF-8"), "--out", at_again]);
    let hash = |folder: &Path| read_json(&folder.join("summary.json"))["final_state_hash"].clone();
    assert_eq!(hash(&again), hash(&own));
    let kept_file = again.join("run-scene.toml");
    quiet(&[kept_file.to_str().expect("UTF-8"), "--out", at_again]);
    assert_eq!((hash(&again), fs::read_to_string(kept_file).expect("the scene")), (hash(&own), kept));

    // A run of a version that kept none.
    fs::remove_file(own.join("run-scene.toml")).expect("a file");
    let output = run(&["--from", at_own]);
    let why = format!("error: --from {at_own}: there is no run-scene.toml in it, so name the scene, too\n");
    assert_eq!(texts(&output), (Some(2), "", why.as_str()));
}

/// A run with `--set` keeps what it has run.
#[test]
fn what_is_set_is_kept() {
    let place = tempfile::tempdir().expect("a folder");
    let scene = write_scene(place.path());
    let own = place.path().join("own");
    let at = own.to_str().expect("UTF-8");
    let set = ["--set", "rods.rope.radius_m=0.02", "--set", "gravity_m_s2=[0, 0, -1.62]"];
    quiet(&[&[&scene, "--steps", "2", "--out", at, "--export", "glb", "--trajectory"], &set[..]].concat());
    let whole = fs::read(own.join("run.glb")).expect("a file");
    let thick = |scene: &scene::Scene| scene.model.segments.last().expect("segments").radius;
    let kept = scene::load(own.join("run-scene.toml")).expect("a scene");
    assert_eq!((thick(&kept), kept.model.gravity.z), (0.02, -1.62));
    quiet(&["export", at, "--export", "glb"]);
    assert!(fs::read(own.join("run.glb")).expect("a file") == whole);
    // It is the scene that is changed further.
    let summary = json(&["--from", at, "--steps", "1", "--set", "rods.rope.density_kg_m3=7"]);
    assert_eq!((&summary["scene"], &summary["set"]), (&json!("hang"), &json!(["rods.rope.density_kg_m3=7"])));
    let output = run(&["--from", at, "--set", "rods.robe.radius_m=1"]);
    assert!(texts(&output).2.contains("--set rods.robe.radius_m=1: none of rods is called `robe`"), "{output:?}");
}

#[test]
fn random_scenes_are_kept_too() {
    let place = tempfile::tempdir().expect("a folder");
    let own = place.path().join("own");
    let at = own.to_str().expect("UTF-8");
    quiet(&[
        "random-helix",
        "--seed",
        "4",
        "--index",
        "2",
        "--steps",
        "2",
        "--out",
        at,
        "--export",
        "csv",
        "--trajectory",
    ]);
    let table = |name: &str| fs::read(own.join(name)).expect("a table");
    let before = ["segments.csv", "joints.csv"].map(table);
    quiet(&["export", at, "--export", "csv"]);
    assert!(["segments.csv", "joints.csv"].map(table) == before);
    let output = run(&["--from", at, "--seed", "4"]);
    assert!(texts(&output).2.contains("--seed and --index need the name of a random scene"), "{output:?}");
}

#[test]
fn everything_has_its_name_in_every_file() {
    let place = tempfile::tempdir().expect("a folder");
    let scene = write_scene(place.path());
    let own = place.path().join("own");
    quiet(&[&scene, "--out", own.to_str().expect("UTF-8"), "--export", "csv,obj,glb,vtp"]);
    let names = &read_json(&own.join("summary.json"))["names"];
    let rod = |name: &str, first: usize, segments: usize| json!({ "name": name, "first_segment": first, "segments": segments });
    assert_eq!(names["bodies"], json!({ "0": rod("hook", 0, 1) }));
    let rods = json!({ "1": rod("cable, steel", 1, 6), "2": rod("rope", 7, 4), "3": rod("rope-1", 11, 4) });
    assert_eq!(names["rods"], rods);
    assert_eq!(names["obstacles"], json!({ "0": "wedge", "1": "obstacle-1" }));
    let grips = names["grips"].as_object().expect("an object");
    let grips: Vec<_> = grips.values().map(|name| name.as_str().expect("a name")).collect();
    assert_eq!(grips, ["cable, steel start-segment", "cable, steel end-face", "rope start-face", "rope-1 start-face"]);

    let column = |name: &str, column: &str| {
        let (header, rows) = table(&own.join(name));
        let place = header.iter().position(|own| own == column).unwrap_or_else(|| panic!("{column} in {header:?}"));
        let mut found: Vec<String> = Vec::new();
        rows.into_iter().map(|mut row| row.swap_remove(place)).for_each(|name| {
            if !found.contains(&name) {
                found.push(name);
            }
        });
        found
    };
    let all = ["hook", "cable, steel", "rope", "rope-1"];
    assert_eq!(column("segments.csv", "rod_name"), all);
    let held = ["cable, steel start-segment", "cable, steel end-face", "rope start-face", "rope-1 start-face"];
    assert_eq!(column("reactions.csv", "body_name"), held);
    assert_eq!(column("obstacles.csv", "obstacle_name"), ["wedge", "obstacle-1"]);
    let b_names = column("joints.csv", "b_name");
    assert!(b_names.contains(&"rope-1 segment 3".to_owned()), "{b_names:?}");
    let obj = fs::read_to_string(own.join("obj/frame_0003.obj")).expect("a file");
    let objects: Vec<&str> = obj.lines().filter_map(|line| line.strip_prefix("o ")).collect();
    assert_eq!(objects, ["cable, steel", "rope", "rope-1", "hook", "wedge", "obstacle-1"]);
    let glb = gltf::Gltf::from_slice(&fs::read(own.join("run.glb")).expect("a file")).expect("a valid file");
    let meshes: Vec<_> = glb.meshes().filter_map(|mesh| mesh.name().map(str::to_owned)).collect();
    assert_eq!(meshes, objects);
}

/// What the probes read at the end and at their highest and lowest, over all steps, whichever frames are kept.
#[test]
fn the_summary_has_extremes_of_probes() {
    let place = tempfile::tempdir().expect("a folder");
    let scene = write_scene(place.path());
    let own = place.path().join("own");
    let summary = json(&[&scene, "--out", own.to_str().expect("UTF-8")]);
    let (header, rows) = table(&own.join("probes.csv"));
    let mut expected: BTreeMap<String, BTreeMap<String, Value>> = BTreeMap::new();
    for (place, name) in header.iter().enumerate().skip(2) {
        let values = rows.iter().filter_map(|row| Some([row[place].parse().ok()?, row[1].parse::<f64>().ok()?]));
        let values: Vec<[f64; 2]> = values.collect();
        let first = |is_better: fn(f64, f64) -> bool| {
            values
                .iter()
                .copied()
                .reduce(|best, own| if is_better(own[0], best[0]) { own } else { best })
                .expect("rows")
        };
        let ([min, min_time_s], [max, max_time_s]) = (first(|a, b| a < b), first(|a, b| a > b));
        let end = values[values.len() - 1][0];
        let found = json!({ "end": end, "min": min, "min_time_s": min_time_s, "max": max, "max_time_s": max_time_s });
        let (probe, column) = name.split_once('.').expect("PROBE.COLUMN");
        expected.entry(probe.to_owned()).or_default().insert(column.to_owned(), found);
    }
    assert_eq!(expected["tip"].keys().collect::<Vec<_>>(), ["qw", "qx", "qy", "qz", "x_m", "y_m", "z_m"]);
    assert_eq!(summary["probes"], json!(expected));
    let sparse = own.to_str().expect("UTF-8");
    assert_eq!(json(&[&scene, "--out", sparse, "--every", "5"])["probes"], summary["probes"]);
    assert_eq!(json(&[&scene])["probes"], summary["probes"]);
    assert!(json(&["helix", "--steps", "1"]).get("probes").is_none());
}

/// Of each segment, the extremes at its two ends over all steps: those of the table of joints.
#[test]
fn the_envelope_is_that_of_the_joints() {
    let place = tempfile::tempdir().expect("a folder");
    let scene = write_scene(place.path());
    let own = place.path().join("own");
    let at = own.to_str().expect("UTF-8");
    quiet(&[&scene, "--out", at, "--envelope", "--export", "csv"]);
    let envelope = fs::read(own.join("envelope.csv")).expect("a table");
    let (header, rows) = table(&own.join("envelope.csv"));
    let of = |row: &[String], name: &str| row[header.iter().position(|own| own == name).expect(name)].clone();
    let (columns, joints) = table(&own.join("joints.csv"));
    let number = |row: &[String], name: &str| -> f64 {
        row[columns.iter().position(|own| own == name).expect(name)].parse().expect("a number")
    };
    // The rope's segments 1 and 2 are between joints of its own alone.
    for (within, row) in rows.iter().filter(|row| row[1] == "rope").enumerate().skip(1).take(2) {
        let name = format!("rope segment {within}");
        assert_eq!((&row[3], of(row, "s_m")), (&within.to_string(), format!("{:?}", 0.25 * (within as f64 + 0.5))));
        let at_ends: Vec<_> = joints.iter().filter(|row| row[4] == name || row[6] == name).collect();
        assert_eq!(at_ends.len(), 2 * 13);
        type Quantity<'a> = (&'a str, &'a dyn Fn(&[String]) -> f64, usize);
        let quantities: [Quantity; 4] = [
            ("tension_{}_n", &|row| number(row, "tension_n"), 1),
            ("bending_moment_{}_n_m", &|row| number(row, "moment_x_n_m").hypot(number(row, "moment_y_n_m")), 1),
            ("torsion_{}_n_m", &|row| number(row, "moment_z_n_m"), 1),
            ("curvature_{}_per_m", &|row| number(row, "curvature_per_m"), 0),
        ];
        for (name, value, from) in quantities {
            let values = at_ends.iter().filter(|row| row[0].parse::<usize>().is_ok_and(|frame| frame >= from));
            let values: Vec<f64> = values.map(|row| value(row)).collect();
            for (which, pick) in [("min", f64::min as fn(f64, f64) -> f64), ("max", f64::max)] {
                let expected = values.iter().copied().reduce(pick).expect("rows");
                let found: f64 = of(row, &name.replace("{}", which)).parse().expect("a number");
                assert!((found - expected).abs() <= 1e-12 * expected.abs(), "{name} {which}: {found} {expected}");
            }
        }
    }
    // The body has no joints.
    assert!(rows[0][1] == "hook" && rows[0][5..].iter().all(String::is_empty), "{:?}", rows[0]);
    // Steps between frames count, too.
    quiet(&[&scene, "--out", at, "--envelope", "--every", "6"]);
    assert!(fs::read(own.join("envelope.csv")).expect("a table") == envelope);
}

/// Which mode a frame shows, and its frequency, in every file.
#[test]
fn files_of_modes_say_which() {
    let place = tempfile::tempdir().expect("a folder");
    let own = place.path().join("own");
    let at = own.to_str().expect("UTF-8");
    let report = json(&["modes", "heavy-cantilever", "--count", "3", "--out", at]);
    let frequencies = report["modes"].as_array().expect("modes").iter().map(|mode| mode["frequency_hz"].as_f64());
    let frequencies: Vec<f64> = frequencies.map(|frequency| frequency.expect("a number")).collect();
    let (header, rows) = table(&own.join("modes.csv"));
    assert_eq!([&header[0], &header[1], &header[5], &header[6]], ["mode", "frequency_hz", "first_frame", "last_frame"]);
    assert_eq!(rows.iter().map(|row| row[1].parse().expect("a number")).collect::<Vec<f64>>(), frequencies);
    assert_eq!([&rows[2][0], &rows[2][5], &rows[2][6]], ["2", "49", "72"]);

    quiet(&["export", at, "--export", "vtp,obj,glb"]);
    for (frame, mode) in [(0, None), (1, Some(0)), (24, Some(0)), (25, Some(1)), (72, Some(2))] {
        let obj = fs::read_to_string(own.join(format!("obj/frame_{frame:04}.obj"))).expect("a file");
        let first = obj.lines().next().expect("a line");
        let expected = mode.map(|k: usize| format!(", mode {k}, {:?} Hz", frequencies[k]));
        assert!(first.ends_with(&format!(" s{}", expected.clone().unwrap_or_default())), "{first}");
        let vtp = fs::read_to_string(own.join(format!("vtp/frame_{frame:04}.vtp"))).expect("a file");
        let vtp = roxmltree::Document::parse(&vtp).expect("XML");
        let number = |name: &str| {
            let array = vtp.descendants().find(|node| node.attribute("Name") == Some(name))?;
            array.text().and_then(|text| text.trim().parse::<f64>().ok())
        };
        let expected = [mode.map(|k| k as f64), mode.map(|k| frequencies[k])];
        assert_eq!([number("Mode"), number("FrequencyHz")], expected, "{frame}");
    }

    let gltf::Gltf { document, blob } =
        gltf::Gltf::from_slice(&fs::read(own.join("run.glb")).expect("a file")).expect("a valid file");
    let blob = blob.expect("data");
    let names: Vec<_> = document.animations().filter_map(|animation| animation.name().map(str::to_owned)).collect();
    let expected = frequencies.iter().enumerate().map(|(k, frequency)| format!("mode {k}, {frequency:.6} Hz"));
    assert_eq!(names, expected.collect::<Vec<_>>());
    let states = export::read_trajectory(&own.join("trajectory.safetensors")).expect("a trajectory").states;
    for (k, animation) in document.animations().enumerate() {
        // The last segment's translation, from the frame at rest before the mode on.
        let channels: Vec<_> = animation.channels().collect();
        let reader = channels[channels.len() - 2].reader(|_| Some(blob.as_slice()));
        let times: Vec<f32> = reader.read_inputs().expect("times").collect();
        assert_eq!((times.len(), times[0], times[24]), (25, 0.0, 1.0));
        let Some(gltf::animation::util::ReadOutputs::Translations(places)) = reader.read_outputs() else {
            panic!("no translations")
        };
        for (frame, place) in places.enumerate() {
            let exact = states[24 * k + frame].positions.last().expect("segments");
            assert!(exact.iter().zip(place).all(|(exact, x)| (*exact as f32 - x).abs() < 1e-6), "{k}, {frame}");
        }
    }
}

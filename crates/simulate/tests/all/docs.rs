//! `docs/files.md` names every file that a run writes, and everything that stands in it.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use crate::common::{CABLE_BETWEEN_GRIPS, json, run, texts};
use cosserat::state::Quantity;
use roxmltree::Document;
use safetensors::SafeTensors;
use serde_json::Value;

const DOCS: &str = include_str!("../../../../docs/files.md");

/// The part of the page below a heading.
fn section(heading: &str) -> &'static str {
    let (_, rest) = DOCS.split_once(&format!("\n## {heading}\n")).unwrap_or_else(|| panic!("no section {heading}"));
    rest.split_once("\n## ").map_or(rest, |(section, _)| section)
}

/// Checks that the first column of a section's tables has these names and no others.
fn assert_named<'a>(heading: &str, names: impl IntoIterator<Item = &'a str>) {
    let rows = section(heading).lines().filter_map(|line| line.strip_prefix("| `"));
    let first = rows.filter_map(|row| row.split_once(" |")).map(|(names, _)| names);
    // What networks alone write.
    let is_there = |name: &&str| !name.is_empty() && (cfg!(feature = "gn") || *name != "learned_start_solves");
    let documented: BTreeSet<&str> = first.flat_map(|names| names.split('`').step_by(2)).filter(is_there).collect();
    let found: BTreeSet<&str> = names.into_iter().collect();
    assert_eq!(documented, found, "{heading}");
}

fn keys(summary: &Value) -> Vec<&str> {
    summary.as_object().expect("an object").keys().map(String::as_str).collect()
}

fn read(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(name)).expect(name)
}

#[test]
fn every_file_and_every_column_is_documented() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path();
    let flags =
        ["--view", "--plot", "--export", "csv,vtp,glb,obj", "--contact-forces", "--envelope", "--snapshot", "--quiet"];
    let more = ["--set", "damping.linear_per_s=0.1", "--fps", "24", "--trajectory"];
    let flags = [&flags[..], &more, &["--out", out.to_str().expect("UTF-8")]].concat();
    let output = run(&[&["helix-on-plane", "--steps", "2"][..], &flags].concat());
    assert_eq!(texts(&output), (Some(0), "", ""));

    let entries = fs::read_dir(out).expect("a folder").map(|entry| entry.expect("an entry"));
    for entry in entries {
        let slash = if entry.path().is_dir() { "/" } else { "" };
        let name = format!("`{}{slash}`", entry.file_name().to_string_lossy());
        let (table, _) = DOCS.split_once("\n## ").expect("sections");
        assert!(table.lines().any(|line| line.starts_with("| `") && line.contains(&name)), "{name}");
    }

    let trajectory = fs::read(out.join("trajectory.safetensors")).expect("a trajectory");
    let tensors = SafeTensors::deserialize(&trajectory).expect("a safetensors file");
    let columns = section("`trajectory.safetensors`");
    for name in tensors.names() {
        assert!(columns.lines().any(|line| line.starts_with(&format!("| `{name}`"))), "{name}");
    }

    let header = |name: &str| read(out, name).lines().next().expect("a header").to_owned();
    assert_named("`segments.csv`", header("segments.csv").split(','));
    assert_named("`joints.csv`", header("joints.csv").split(','));
    assert_named("`reactions.csv`", header("reactions.csv").split(','));

    let table = section("`probes.csv`");
    assert_named("`probes.csv`", Quantity::ALL.map(Quantity::name));
    for column in Quantity::ALL.iter().flat_map(|quantity| quantity.columns()) {
        assert!(table.contains(&format!("`{column}`")), "{column}");
    }
    assert_named("`contacts.csv`", header("contacts.csv").split(','));
    let ring = folder.path().join("ring");
    let output = run(&["zip-line", "--steps", "1", "--quiet", "--out", ring.to_str().expect("UTF-8")]);
    assert_eq!(texts(&output), (Some(0), "", ""));
    assert_named("`eyelets.csv`", read(&ring, "eyelets.csv").lines().next().expect("a header").split(','));
    let glass = folder.path().join("glass");
    let output = run(&["spaghetti", "--steps", "1", "--quiet", "--out", glass.to_str().expect("UTF-8")]);
    assert_eq!(texts(&output), (Some(0), "", ""));
    assert_named("`breaks.csv`", read(&glass, "breaks.csv").lines().next().expect("a header").split(','));
    assert_named("`envelope.csv`", header("envelope.csv").split(','));
    let snapshot = fs::read(out.join("snapshot.safetensors")).expect("a snapshot");
    let (_, metadata) = SafeTensors::read_metadata(&snapshot).expect("a safetensors file");
    for name in metadata.metadata().as_ref().expect("texts").keys() {
        assert!(section("`snapshot.safetensors`").contains(&format!("`{name}`")), "{name}");
    }

    let frame = read(out, "vtp/frame_0000.vtp");
    let frame = Document::parse(&frame).expect("XML");
    let lists = frame.descendants().filter(|node| node.has_tag_name("FieldData")).flat_map(|node| node.children());
    for name in lists.filter_map(|array| array.attribute("Name")) {
        assert!(section("`vtp/`").contains(&format!("`{name}`")), "{name}");
    }
    let data = frame.descendants().filter(|node| node.has_tag_name("PointData") || node.has_tag_name("CellData"));
    let arrays = data.flat_map(|node| node.children()).filter_map(|array| array.attribute("Name"));
    assert_named("`vtp/`", arrays.collect::<Vec<_>>());

    let record: Value = serde_json::from_str(&read(out, "run.json")).expect("JSON");
    for key in keys(&record) {
        assert!(DOCS.contains(&format!("`{key}`")), "{key}");
    }
    let summary: Value = serde_json::from_str(&read(out, "summary.json")).expect("JSON");
    // Alone, with obstacles, in wind, and between two grips.
    let cable = folder.path().join("cable.toml");
    fs::write(&cable, CABLE_BETWEEN_GRIPS).expect("a folder");
    let equilibria = ["heavy-cantilever", "suture", "tree-10", cable.to_str().expect("UTF-8")];
    let equilibria = equilibria.map(|scene| json(&["static", scene]));
    let probe = "[[probes]]\nrod = \"cable\"\nat = \"end-face\"\nquantities = [\"tension\"]\n";
    fs::write(&cable, [CABLE_BETWEEN_GRIPS, probe].concat()).expect("a folder");
    let probed = json(&[cable.to_str().expect("UTF-8"), "--steps", "1"]);
    for key in keys(&probed["probes"]["probe-0"]["tension_n"]) {
        assert!(section("`summary.json`").contains(&format!("`{key}`")), "{key}");
    }
    // Of runs that go on, that take hold of something, and that leave something out.
    let told = ["begin_s", "held", "defaults"];
    let sliding = json(&["zip-line", "--steps", "1"]);
    for key in keys(&sliding["eyelets"]["carabiner"]) {
        assert!(section("`eyelets.csv`").contains(&format!("`{key}`")), "{key}");
    }
    let bent = json(&["bent-wire", "--steps", "150"]);
    for key in keys(&bent["inelastic"]).into_iter().chain(keys(&bent["inelastic"]["plastic"])) {
        assert!(section("`summary.json`").contains(&format!("`{key}`")), "{key}");
    }
    let broken = json(&["spaghetti", "--steps", "400"]);
    for key in keys(&broken["breaks"][0]) {
        assert!(DOCS.contains(&format!("`{key}`")), "{key}");
    }
    let others = equilibria.iter().chain([&probed, &sliding, &bent, &broken]).flat_map(keys).chain(told);
    assert_named("`summary.json`", keys(&summary).into_iter().chain(others));
    for key in keys(&summary["names"]) {
        assert!(section("`summary.json`").contains(&format!("`{key}`")), "{key}");
    }
    for key in keys(&summary["worst_residuals"]) {
        assert!(section("`summary.json`").contains(&format!("`{key}`")), "{key}");
    }
}

/// The columns of the way's table, those of what changes among them, and what its report has.
#[test]
fn the_table_of_a_way_is_documented() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = folder.path().join("column.toml");
    let text = r#"
gravity_over_time = { times_s = [0, 1], values_m_s2 = [[0, 0, 0], [0, 0, -4]] }
[run]
dt_s = 0.01
steps = 100
[[rods]]
radius_m = 0.01
youngs_modulus_pa = 1e7
density_kg_m3 = 1000
clamp = ["start-face"]
shape.straight = { direction = [0, 0, 1], length_m = 1, segments = 10 }
"#;
    fs::write(&scene, text).expect("a scene");
    let (scene, out) = (scene.to_str().expect("UTF-8"), folder.path().join("out"));
    let output = run(&["static", scene, "--along", "--json", "--out", out.to_str().expect("UTF-8")]);
    let (code, report, _) = texts(&output);
    assert_eq!(code, Some(0));
    let report: Value = serde_json::from_str(report).expect("JSON");
    for key in keys(&report).into_iter().chain(keys(&report["events"][0])) {
        assert!(section("`summary.json`").contains(&format!("`{key}`")), "{key}");
    }
    let table = read(&out, "path.csv");
    let header: Vec<&str> = table.lines().next().expect("a header").split(',').collect();
    assert_named("`path.csv`", header[..5].iter().copied());
    assert_eq!(header[5..], ["gravity_x_m_s2", "gravity_y_m_s2", "gravity_z_m_s2"]);
    assert_eq!(report["points"], table.lines().count() - 1);
}

//! `docs/scenes.md` names every key that the reader knows; its examples, and the README's, are scenes.

use std::collections::BTreeSet;

const DOCS: &str = include_str!("../../../../docs/scenes.md");
const README: &str = include_str!("../../../../README.md");
const RECIPES: &str = include_str!("../../../../docs/recipes.md");

/// One file a table, with an unknown key in it; the error lists the known ones.
const PROBES: [&str; 74] = [
    "zzz = 1",
    "run.zzz = 1",
    "damping.zzz = 1",
    "gravity_over_time.zzz = 1",
    "air.zzz = 1",
    "air.wind.zzz = 1",
    "air.wind.gusts.zzz = 1",
    "rods = [{ zzz = 1 }]",
    "rods = [{ shape.zzz = 1 }]",
    "rods = [{ shape.straight.zzz = 1 }]",
    "rods = [{ shape.helix.zzz = 1 }]",
    "rods = [{ shape.arc.zzz = 1 }]",
    "rods = [{ shape.ring.zzz = 1 }]",
    "rods = [{ shape.polyline.zzz = 1 }]",
    "rods = [{ stretch.zzz = 1 }]",
    "rods = [{ rest.zzz = 1 }]",
    "rods = [{ branch_of.zzz = 1 }]",
    "rods = [{ velocities = [{ zzz = 1 }] }]",
    "rods = [{ motions = [{ zzz = 1 }] }]",
    "rods = [{ grips = [{ zzz = 1 }] }]",
    "rods = [{ masses = [{ zzz = 1 }] }]",
    "rods = [{ loads = [{ zzz = 1 }] }]",
    "rods = [{ tree.zzz = 1 }]",
    "joins = [{ zzz = 1 }]",
    "contact.zzz = 1",
    "contact.friction.zzz = 1",
    "obstacles = [{ zzz = 1 }]",
    "obstacles = [{ shape.zzz = 1 }]",
    "obstacles = [{ shape.plane.zzz = 1 }]",
    "obstacles = [{ shape.sphere.zzz = 1 }]",
    "obstacles = [{ shape.capsule.zzz = 1 }]",
    "obstacles = [{ shape.box.zzz = 1 }]",
    "obstacles = [{ shape.cylinder.zzz = 1 }]",
    "obstacles = [{ shape.mesh.zzz = 1 }]",
    "obstacles = [{ motion.zzz = 1 }]",
    "rods = [{ shape.knot.zzz = 1 }]",
    "rods = [{ shape.hung.zzz = 1 }]",
    "rods = [{ shape.curve.zzz = 1 }]",
    "rods = [{ strands.zzz = 1 }]",
    "rods = [{ strands.on.zzz = 1 }]",
    "rods = [{ heap.zzz = 1 }]",
    "nets = [{ zzz = 1 }]",
    "probes = [{ zzz = 1 }]",
    "copies = [{ zzz = 1 }]",
    "bodies = [{ zzz = 1 }]",
    "bodies = [{ shape.zzz = 1 }]",
    "bodies = [{ shape.sphere.zzz = 1 }]",
    "bodies = [{ shape.capsule.zzz = 1 }]",
    "bodies = [{ shape.box.zzz = 1 }]",
    "bodies = [{ shape.mesh.zzz = 1 }]",
    "bodies = [{ motions = [{ zzz = 1 }] }]",
    "joins = [{ a.zzz = 1 }]",
    "eyelets = [{ zzz = 1 }]",
    "eyelets = [{ feed.zzz = 1 }]",
    "pulleys = [{ zzz = 1 }]",
    "pulleys = [{ drive.zzz = 1 }]",
    "sheaths = [{ zzz = 1 }]",
    "rods = [{ section.zzz = 1 }]",
    "rods = [{ section.circle.zzz = 1 }]",
    "rods = [{ section.tube.zzz = 1 }]",
    "rods = [{ section.rectangle.zzz = 1 }]",
    "rods = [{ section.ellipse.zzz = 1 }]",
    "rods = [{ section.stiffness.zzz = 1 }]",
    "rods = [{ pieces = [{ zzz = 1 }] }]",
    "rods = [{ frame.zzz = 1 }]",
    "rods = [{ inner_damping.zzz = 1 }]",
    "rods = [{ yield.zzz = 1 }]",
    "rods = [{ strand_friction.zzz = 1 }]",
    "rods = [{ relaxation = [{ zzz = 1 }] }]",
    "rods = [{ moment_table.zzz = 1 }]",
    "rods = [{ strength.zzz = 1 }]",
    "rods = [{ rest_over_time.zzz = 1 }]",
    "rods = [{ foundations = [{ zzz = 1 }] }]",
    "rods = [{ branch_motor.zzz = 1 }]",
];

#[test]
fn every_key_is_documented_and_tried() {
    let mut keys = BTreeSet::new();
    for probe in PROBES {
        let error = scene::parse(probe, "x.toml").unwrap_err().to_string();
        let (_, known) = error.split_once("zzz is not a known key; expected ").expect(&error);
        keys.extend(known.split('`').skip(1).step_by(2).map(str::to_owned));
    }
    assert!(keys.len() > 50, "{keys:?}");
    let everything = concat!(
        include_str!("../everything.toml"),
        include_str!("../bodies.toml"),
        include_str!("../driven.toml"),
        include_str!("../pulleys.toml"),
        include_str!("../sheaths.toml")
    );
    // The file has constant gravity, which does not go with the other.
    for key in
        keys.iter().filter(|key| !["zero", "initial", "gravity_over_time", "values_m_s2"].contains(&key.as_str()))
    {
        let named =
            [format!("`{key}`"), format!("`\"{key}\"`"), format!("`[rods.shape.{key}]`"), format!("{{ {key} =")];
        assert!(named.iter().any(|text| DOCS.contains(text)), "`{key}` is not documented");
        assert!(everything.contains(key.as_str()), "`{key}` is not tried in everything.toml");
    }
}

#[test]
fn the_examples_are_scenes() {
    let mut scenes = 0;
    for text in [DOCS, README] {
        for block in text.split("```toml\n").skip(1).map(|rest| rest.split("```").next().unwrap()) {
            scene::parse(block, "docs.toml").unwrap();
            scenes += 1;
        }
    }
    assert_eq!(scenes, 18);
}

/// Every recipe is a scene; the tables that it names stand below it.
#[test]
fn the_recipes_are_scenes() {
    let folder = tempfile::tempdir().unwrap();
    let mut scenes = 0;
    for recipe in RECIPES.split("\n## ").skip(1) {
        let block = |kind: &str| {
            let (before, rest) = recipe.split_once(&format!("```{kind}\n"))?;
            Some((before, rest.split_once("```").unwrap().0))
        };
        if let Some((before, table)) = block("csv") {
            let name = before.trim_end().rsplit('`').nth(1).unwrap();
            std::fs::write(folder.path().join(name), table).unwrap();
        }
        let (_, text) = block("toml").expect(recipe);
        let path = folder.path().join("recipe.toml");
        std::fs::write(&path, text).unwrap();
        if let Err(error) = scene::load(&path) {
            panic!("{error}\n{recipe}");
        }
        scenes += 1;
    }
    assert_eq!(scenes, 18);
}

#[test]
fn the_readmes_cable_hangs_where_it_says() {
    let (_, rest) = README.split_once("```toml\n").unwrap();
    let scene = scene::parse(rest.split("```").next().unwrap(), "cable.toml").unwrap();
    let length = rod::measure::rod_lengths(&scene.model, &scene.state)[0];
    let [first, last] = [0, 99].map(|i| scene.state.positions[i]);
    assert!((length - 20.4).abs() < 1e-9 && (last - first).z.abs() < 1e-3, "{length} m, from {first} to {last}");
}

#[test]
fn the_defaults_are_those_documented() {
    use scene::defaults::{
        AIR_DENSITY, DENSITY, DT, GUST_LENGTH, GUST_TIME, NORMAL_DRAG, RADIUS, STEPS, TANGENTIAL_DRAG, YOUNGS_MODULUS,
    };
    for row in [
        format!("| `dt_s` | number [s] | {DT} |"),
        format!("| `steps` | whole number | {STEPS} |"),
        format!("| `radius_m` | number or `[start, end]` [m] | {RADIUS} |"),
        format!("| `youngs_modulus_pa` | number [Pa] | {YOUNGS_MODULUS:e} |"),
        format!("| `density_kg_m3` | number [kg/m^3] | {DENSITY} |"),
        format!("| `density_kg_m3` | number [kg/m^3] | {AIR_DENSITY} |"),
        format!("| `normal_drag` | number | {NORMAL_DRAG} |"),
        format!("| `tangential_drag` | number | {TANGENTIAL_DRAG} |"),
        format!("| `length_m` | number [m] | {GUST_LENGTH} |"),
        format!("| `time_s` | number [s] | {GUST_TIME} |"),
    ] {
        assert!(DOCS.contains(&row), "{row}");
    }
}

//! MuJoCo's own examples, from a folder that the user names.

use std::path::PathBuf;

use cosserat::scene;

/// The folder with the examples.
const FOLDER: &str = "MUJOCO_CABLES";

#[test]
#[ignore = "needs MuJoCo's examples: set MUJOCO_CABLES to the folder model/plugin/elasticity of MuJoCo, and run with --ignored"]
fn mujocos_cables_become_scenes() {
    let folder = std::env::var_os(FOLDER).map(PathBuf::from).unwrap_or_else(|| panic!("{FOLDER} is not set"));
    // Cables and what is joined to them: a body on a slide is one segment more.
    for (name, rods, segments) in [("belt", 1, 20), ("cable", 2, 41), ("coil", 3, 71)] {
        let path = folder.join(name).with_extension("xml");
        let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let converted = mjcf::convert(&text, &path).unwrap_or_else(|error| panic!("{error}"));
        let scene = scene::parse(&converted.toml, &path.to_string_lossy());
        let scene = scene.unwrap_or_else(|error| panic!("{error}\n{}", converted.toml));
        assert_eq!((scene.rods.len(), scene.model.segments.len()), (rods, segments), "{name}");
        assert_eq!(scene.obstacles, ["ground"], "{name}");
    }
}

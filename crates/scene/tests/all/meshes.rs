//! Obstacles of boxes, cylinders and files of triangles: what they become, and what is wrong with files.

use std::path::Path;

use nalgebra::Vector3;
use proptest::prelude::*;
use rod::{Body, BodyShape, ObstacleShape};

const SCENE: &str = "[[rods]]\nshape.straight = { start_m = [0, 0, 9], length_m = 1, segments = 2 }\n\n[[obstacles]]\n";

/// A tetrahedron.
const OBJ: &str = "# four faces\nv 0 0 0\nv 1 0 0 0.5\nv 0 1 0\nv 0 0 1\nvn 0 0 1\no rock\nf 1 3 2\nf 1//1 2//1 4//1\n\
                   f 2/1 3/2 4/1\nf -4 -1 -2\n";
const STL: &str = "solid rock\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n\
                   facet normal 0 0 1\nouter loop\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n";

/// The same two triangles as [`STL`] in bytes.
fn binary() -> Vec<u8> {
    let mut bytes = vec![b's'; 80];
    bytes.extend(2_u32.to_le_bytes());
    for corners in [[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0], [0, 1, 0]]] {
        bytes.extend([0; 12]);
        bytes.extend(corners.as_flattened().iter().flat_map(|&x| (x as f32).to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

/// The scene with an obstacle of a file, or its error, which begins with the folder of the scene.
fn load(folder: &Path, name: &str, bytes: &[u8], keys: &str) -> Result<scene::Scene, String> {
    std::fs::write(folder.join(name), bytes).unwrap();
    let path = folder.join("scene.toml");
    std::fs::write(&path, format!("{SCENE}shape.mesh = {{ file = \"{name}\"{keys} }}\n")).unwrap();
    scene::load(&path).map_err(|error| error.to_string())
}

#[test]
fn files_become_meshes() {
    let folder = tempfile::tempdir().unwrap();
    let keys = ", scale = 0.01, position_m = [1, 2, 3], turn_deg = [0, 0, 90]";
    for (name, bytes, count) in [
        ("a.obj", OBJ.as_bytes().to_vec(), 4),
        ("b.STL", STL.as_bytes().to_vec(), 2),
        ("c.stl", binary(), 2),
        // Lines may end as on Windows.
        ("d.obj", OBJ.replace('\n', "\r\n").into_bytes(), 4),
        // A face of more corners is a fan.
        ("e.obj", b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0.5 2 0\nv 0 1 0\nf 1 2 3 4 5\n".to_vec(), 3),
    ] {
        let scene = load(folder.path(), name, &bytes, keys).unwrap();
        let ObstacleShape::Mesh { pose, mesh } = &scene.model.contacts.obstacles[0].shape else { panic!() };
        assert_eq!(mesh.triangles.len(), count, "{name}");
        assert_eq!(pose.position, Vector3::new(1.0, 2.0, 3.0));
        assert!((pose.orientation * Vector3::x() - Vector3::y()).norm() < 1e-12);
        let [a, b] = [0, 1].map(|k| mesh.positions[k]);
        assert!(a == Vector3::zeros() && (b - Vector3::x() * 0.01).norm() < 1e-15, "{name}");
    }
}

#[test]
fn mistakes_in_files_are_named_with_their_lines() {
    let folder = tempfile::tempdir().unwrap();
    let [without_end, without_facet] = ["endsolid\n", "endloop\nendfacet\nendsolid\n"].map(|end| STL.replace(end, ""));
    let cases: [(&str, &[u8], &str); 12] = [
        ("a.obj", b"v 0 0 0\nv 1 zero 0\n", "a.obj:2: v zero, but there must be three finite numbers"),
        ("a.obj", b"v 0 0\n", "a.obj:1: v , but there must be three finite numbers"),
        ("a.obj", b"v 0 nan 0\n", "a.obj:1: v nan, but there must be three finite numbers"),
        ("a.obj", b"v 0 0 0\nf 1 1\n", "a.obj:2: a face of 2 corners, but there must be at least 3"),
        (
            "a.obj",
            b"v 0 0 0\n\nf 1 0 1\n",
            "a.obj:3: f 0, but it must be a corner's number from 1, or from -1 backwards",
        ),
        ("a.obj", b"v 0 0 0\nf 1 1 9\n", "a.obj:2: a triangle has corner 9, but there are 1"),
        ("a.obj", b"v 0 0 0\nf 1 1 1\n", "a.obj:1: there must be at least one triangle with an area"),
        ("a.obj", b"", "a.obj:1: there must be at least one triangle with an area"),
        ("a.stl", b"solid\nvertex 0 0 0\nendfacet\n", "a.stl:3: a facet of 1 corners, but there must be 3"),
        ("a.stl", b"nothing", "a.stl:1: this is no STL file"),
        ("a.stl", without_end.as_bytes(), "a.stl:15: the file ends before its last facet"),
        ("a.stl", without_facet.as_bytes(), "a.stl:13: the file ends before"),
    ];
    for (name, bytes, expected) in cases {
        let error = load(folder.path(), name, bytes, "").unwrap_err();
        assert!(error.contains(expected), "{error}");
    }
    let error = load(folder.path(), "a.ply", b"", "").unwrap_err();
    assert!(error.contains("scene.toml:5: obstacles[0].shape.mesh.file = \"a.ply\", but it must be a file"), "{error}");
    let error = load(folder.path(), "a.obj", OBJ.as_bytes(), ", scale = 0").unwrap_err();
    assert!(error.contains("shape.mesh.scale = 0, but it must be finite and > 0"), "{error}");
    let error = load(folder.path(), "a.obj", b"v 9 0 0\nf 1 1 1\n", ", scale = 1e308").unwrap_err();
    assert!(error.contains("scale = 1e308, but it must be 1e30 in size at most"), "{error}");
    for (bytes, scale, far) in [
        ("v 9 0 0\nv 0 1 0\nv 0 -1e300 0\nf 1 2 3\n", "", "1e300"),
        ("v 1 0 0\n\nv 9 0 0\nf 1 2 2\n", ", scale = 2e11", "1.8e12"),
    ] {
        let error = load(folder.path(), "a.obj", bytes.as_bytes(), scale).unwrap_err();
        let expected = format!("a.obj:3: a corner with {far} m, times `scale`, but it must be 1e12 m at most");
        assert!(error.contains(&expected), "{error}");
    }
}

/// A block of sides 0.2, 0.4, 0.6 with one corner at the origin.
const BLOCK: &str = "v 0 0 0\nv 0.2 0 0\nv 0.2 0.4 0\nv 0 0.4 0\nv 0 0 0.6\nv 0.2 0 0.6\nv 0.2 0.4 0.6\nv 0 0.4 0.6\n\
                     f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

/// A body of a file on a rod, or the error.
fn load_body(bytes: &str, mesh: &str, keys: &str) -> Result<scene::Scene, String> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.obj"), bytes).unwrap();
    let path = folder.path().join("scene.toml");
    let text = format!(
        "[[bodies]]\nname = \"part\"\nshape.mesh = {{ file = \"a.obj\"{mesh} }}\n{keys}\n[[rods]]\nbranch_of = {{ body = \"part\", \
         at_m = [0.1, 0.2, 0.6] }}\nshape.straight = {{ length_m = 1, segments = 2 }}\n"
    );
    std::fs::write(&path, text).unwrap();
    scene::load(&path).map_err(|error| error.to_string())
}

#[test]
fn a_block_in_a_file_is_the_body_that_a_box_is() {
    let keys = "density_kg_m3 = 500\nposition_m = [1, 2, 3]\nturn_deg = [0, 0, 90]";
    let scene = load_body(BLOCK, "", keys).unwrap();
    let body = scene.model.segments[0].body.as_ref().unwrap();
    let sides = Vector3::new(0.2, 0.4, 0.6);
    assert!((body.mass - 24.0).abs() < 1e-12);
    assert!((body.inertia - BodyShape::Box { sides }.inertia_per_mass() * body.mass).norm() < 1e-12);
    // The file's axes are where the scene says: x of the file along y, y of the file against x.
    let state = &scene.state;
    assert!((state.positions[0] - Vector3::new(1.0 - 0.2, 2.0 + 0.1, 3.0 + 0.3)).norm() < 1e-12);
    assert!((state.orientations[0] * Vector3::x() - Vector3::y()).norm() < 1e-12);
    let joint =
        scene.model.joints.iter().find(|joint| joint.b == Body::Segment(0) || joint.a == Body::Segment(0)).unwrap();
    let start = state.positions[1] - state.axis(1) * 0.25;
    assert!((start - Vector3::new(1.0 - 0.2, 2.0 + 0.1, 3.6)).norm() < 1e-12, "the rod starts at `at_m`");
    assert!(joint.mount.is_some());
    // Given, the moments are about the file's axes through the centre that is given, or that of the mesh.
    for (mesh, centre) in [("", sides * 0.5), (", centre_of_mass_m = [0.1, 0.1, 0.1]", Vector3::repeat(0.1))] {
        let scene = load_body(BLOCK, mesh, "mass_kg = 2\ninertia_kg_m2 = [0.2, 0.3, 0.4]").unwrap();
        assert_eq!(scene.model.segments[0].body.as_ref().unwrap().inertia, Vector3::new(0.2, 0.3, 0.4));
        assert!((scene.state.positions[0] - centre).norm() < 1e-12);
        assert_eq!(scene.state.orientations[0], nalgebra::UnitQuaternion::identity());
    }
    // So one can have an open mesh.
    let open = BLOCK.replace("f 4 1 5 8\n", "");
    load_body(&open, ", centre_of_mass_m = [0, 0, 0]", "mass_kg = 2\ninertia_kg_m2 = [0.2, 0.3, 0.4]").unwrap();
}

#[test]
fn meshes_that_are_no_bodies_are_named() {
    let open = BLOCK.replace("f 4 1 5 8\n", "");
    let inwards: String = BLOCK
        .lines()
        .map(|line| match line.strip_prefix("f ") {
            Some(corners) => format!("f {}\n", corners.split(' ').rev().collect::<Vec<_>>().join(" ")),
            None => format!("{line}\n"),
        })
        .collect();
    let needs = "; a mesh that is not full of mass needs `mass_kg`, `inertia_kg_m2` and `shape.mesh.centre_of_mass_m`";
    let moments = "inertia_kg_m2 = [0.2, 0.3, 0.4]";
    let cases = [
        (
            open.as_str(),
            "",
            "mass_kg = 1".to_owned(),
            format!(
                "scene.toml:3: bodies[0].shape.mesh.file: a.obj: the surface is open: 4 of its edges have no triangle on their other side{needs}"
            ),
        ),
        (open.as_str(), "", format!("mass_kg = 1\n{moments}"), "a.obj: the surface is open: 4 of its edges".to_owned()),
        (
            open.as_str(),
            ", centre_of_mass_m = [0, 0, 0]",
            format!("density_kg_m3 = 1\n{moments}"),
            "scene.toml:4: bodies[0].density_kg_m3: a mesh that is open or inside out has no volume; give `mass_kg`"
                .to_owned(),
        ),
        (
            inwards.as_str(),
            "",
            "mass_kg = 1".to_owned(),
            "bodies[0].shape.mesh.file: a.obj: the surface is inside out: it encloses -0.04".to_owned(),
        ),
        (
            BLOCK,
            ", centre_of_mass_m = [0, 0, 0]",
            "mass_kg = 1".to_owned(),
            "bodies[0].shape.mesh.centre_of_mass_m: goes with `inertia_kg_m2`".to_owned(),
        ),
        (
            BLOCK,
            ", scale = -1",
            "mass_kg = 1".to_owned(),
            "shape.mesh.scale = -1, but it must be finite and > 0".to_owned(),
        ),
        (BLOCK, ", scale = 1e-20", "mass_kg = 1".to_owned(), "bodies[0].shape.mesh.file".to_owned()),
        (BLOCK, ", scale = 1e20", "mass_kg = 1".to_owned(), "a.obj:2: a corner with 2e19 m".to_owned()),
        ("v nan 0 0\n", "", "mass_kg = 1".to_owned(), "a.obj:1: v nan".to_owned()),
    ];
    for (file, mesh, keys, expected) in cases {
        let error = load_body(file, mesh, &keys).unwrap_err();
        assert!(error.contains(&expected), "{error}");
        assert!(!error.contains('\n'), "{error}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever is done to a file, it gives a valid model or one error that names it.
    #[test]
    fn mangled_files(
        which in 0..3_usize,
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..4),
        cut in any::<prop::sample::Index>(),
        is_cut in any::<bool>(),
    ) {
        let (name, mut bytes) =
            [("a.obj", OBJ.as_bytes().to_vec()), ("a.stl", STL.as_bytes().to_vec()), ("a.stl", binary())][which].clone();
        for (at, value) in flips {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        if is_cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        let folder = tempfile::tempdir().unwrap();
        match load(folder.path(), name, &bytes, "") {
            Ok(scene) => scene.model.validate(&scene.state).unwrap(),
            Err(error) => {
                let (_, rest) = error.split_once(&format!("{name}:")).expect(&error);
                prop_assert!(rest.split(':').next().unwrap().parse::<usize>().unwrap() > 0, "{}", error);
                prop_assert!(!error.contains('\n'), "{}", error);
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever is done to the file of a body, it gives a valid model or one error.
    #[test]
    fn mangled_files_of_bodies(flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4)) {
        let mut bytes = BLOCK.as_bytes().to_vec();
        for (at, value) in flips {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        match load_body(&String::from_utf8_lossy(&bytes), "", "density_kg_m3 = 1000") {
            Ok(scene) => scene.model.validate(&scene.state).unwrap(),
            Err(error) => prop_assert!(!error.contains('\n') && error.contains(':'), "{}", error),
        }
    }
}

#[test]
fn boxes_and_cylinders_stand_where_the_scene_says() {
    let text = format!(
        "{SCENE}shape.box = {{ centre_m = [1, 2, 3], sides_m = [2, 4, 6], turn_deg = [90, 0, 0] }}\n\
         [[obstacles]]\nshape.cylinder = {{ start_m = [0, 0, 0], end_m = [0, 2, 0], radius_m = 0.5 }}\n"
    );
    let scene = scene::parse(&text, "x.toml").unwrap();
    let corners = |k: usize| {
        let shape = &scene.model.contacts.obstacles[k].shape;
        let (mesh, turn) = shape.surface().unwrap();
        let places = mesh.positions.iter().map(|place| shape.pivot() + turn * place);
        let infinite = Vector3::repeat(f64::INFINITY);
        places.fold([infinite, -infinite], |[low, high], place| [low.inf(&place), high.sup(&place)])
    };
    for (found, expected) in corners(0).into_iter().zip([[0.0, -1.0, 1.0], [2.0, 5.0, 5.0]]) {
        assert!((found - Vector3::from(expected)).norm() < 1e-12, "{found}");
    }
    for (found, expected) in corners(1).into_iter().zip([[-0.5, 0.0, -0.5], [0.5, 2.0, 0.5]]) {
        assert!((found - Vector3::from(expected)).norm() < 1e-12, "{found}");
    }
}

//! Curves in OpenUSD files.

use nalgebra::Vector3;
use scene::Scene;

/// Writes a file and a scene that names it with these keys, and loads the scene.
fn with_file(usd: impl AsRef<[u8]>, keys: &str) -> Result<Scene, String> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("curve.usda"), usd).unwrap();
    let path = folder.path().join("x.toml");
    let text = format!("[[rods]]\nradius_m = 0.01\nshape.usd = {{ file = \"curve.usda\"{keys} }}\n");
    std::fs::write(&path, text).unwrap();
    let place = folder.path().display().to_string();
    scene::load(&path).map_err(|error| error.to_string().replace(&format!("{place}/"), ""))
}

/// The ends of the segments [m].
fn nodes(scene: &Scene) -> Vec<Vector3<f64>> {
    let state = &scene.state;
    let half = |i: usize| state.axis(i) * (0.5 * scene.model.segments[i].length);
    let mut nodes: Vec<_> = (0..state.positions.len()).map(|i| state.positions[i] - half(i)).collect();
    let last = nodes.len() - 1;
    nodes.push(state.positions[last] + half(last));
    nodes
}

fn agree(found: &[Vector3<f64>], expected: &[[f64; 3]]) {
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - Vector3::from(*expected)).norm() < 1e-12, "{found} {expected:?}");
    }
}

/// Much that other programs write, in centimetres with y up.
const FILE: &str = r#"#usda 1.0
(
    "Written by hand"
    customLayerData = { string of = "a } in a text" }
    defaultPrim = "World"
    metersPerUnit = 0.01
    subLayers = [ @./other.usda@ ]
    upAxis = "Y"
)

# def BasisCurves "nothing" {}
def Xform "World" (
    kind = "group" # a comment }
    doc = """Several "lines"
    of text }"""
    prepend references = </Other>
)
{
    def Camera "camera"
    {
        float focalLength = 50
        token projection
        custom rel target = [</World/a>, </World/b>]
    }
    variantSet "look" = {
        "red" { def BasisCurves "hidden" { point3f[] points = [(0, 0, 0)] } }
    }

    def Xform "turned"
    {
        def BasisCurves "cable" (
            prepend apiSchemas = ["MaterialBindingAPI"]
        )
        {
            int[] curveVertexCounts = [2, 3]
            point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 0, 0), (100, 0, 0), (100, 200, 0)] (
                interpolation = "vertex"
            )
            uniform token type = "linear"
            float[] widths = [1, 1] ( interpolation = "constant" )
        }
        double3 xformOp:translate = (10, 0, 0)
        double xformOp:rotateZ = 90
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateZ"]
    }

    def BasisCurves "moving"
    {
        uniform token type = "linear"
        uniform token wrap = "periodic"
        int[] curveVertexCounts = [3]
        point3f[] points.timeSamples = {
            24: [(5, 5, 5), (6, 6, 6), (7, 7, 8)],
            0: [(0, 0, 0), (1e2, 0, 0), (0, 100.0, 0)],
        }
    }
}
"#;

#[test]
fn a_curve_is_where_its_file_draws_it() {
    let scene = with_file(FILE, ", prim = \"/World/turned/cable\", curve = 1").unwrap();
    // Turned about z, moved along x by 0.1 m; then y up becomes z up.
    agree(&nodes(&scene), &[[0.1, 0.0, 0.0], [0.1, 0.0, 1.0], [-1.9, 0.0, 1.0]]);
    let scene = with_file(FILE, ", prim = \"/World/turned/cable\", curve = 1, segments = 30").unwrap();
    assert_eq!(scene.model.segments.len(), 30);
}

#[test]
fn a_curve_that_moves_is_read_at_its_first_time() {
    let scene = with_file(FILE, ", prim = \"/World/moving\", closed = true").unwrap();
    let found = nodes(&scene);
    agree(&found, &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]]);
    assert_eq!(scene.model.joints.len(), 3);
}

/// One linear curve of two points, in metres with z up, with more in the prim.
fn simple(more: &str) -> String {
    format!(
        "#usda 1.0\n(\n    metersPerUnit = 1\n    upAxis = \"Z\"\n)\ndef BasisCurves \"c\"\n{{\n    uniform token type = \
         \"linear\"\n    int[] curveVertexCounts = [2]\n    point3f[] points = [(1, 2, 3), (2, 2, 3)]\n{more}\n}}\n"
    )
}

#[test]
fn transforms_act_in_their_order() {
    let order = |names: &str| format!("uniform token[] xformOpOrder = [{names}]\n");
    let cases = [
        (String::new(), [1.0, 2.0, 3.0]),
        (format!("float3 xformOp:scale = (2, 3, 4)\n{}", order("\"xformOp:scale\"")), [2.0, 6.0, 12.0]),
        // Half a turn about x.
        (format!("quatf xformOp:orient = (0, 1, 0, 0)\n{}", order("\"xformOp:orient\"")), [1.0, -2.0, -3.0]),
        // x by 90 degrees first: (1, -3, 2); then z: (3, 1, 2).
        (format!("float3 xformOp:rotateXYZ = (90, 0, 90)\n{}", order("\"xformOp:rotateXYZ\"")), [3.0, 1.0, 2.0]),
        (
            format!(
                "double xformOp:rotateY:spin = 90\nfloat xformOp:rotateX = 90\n{}",
                order("\"xformOp:rotateX\", \"xformOp:rotateY:spin\"")
            ),
            // y first: (3, 2, -1); then x: (3, 1, 2).
            [3.0, 1.0, 2.0],
        ),
        (
            format!(
                "matrix4d xformOp:transform = ( (0, 1, 0, 0), (-1, 0, 0, 0), (0, 0, 1, 0), (5, 6, 7, 1) )\n{}",
                order("\"xformOp:transform\"")
            ),
            // A quarter turn about z, then a shift.
            [3.0, 7.0, 10.0],
        ),
    ];
    for (more, first) in cases {
        let found = nodes(&with_file(simple(&more), "").unwrap());
        assert!((found[0] - Vector3::from(first)).norm() < 1e-12, "{more}: {}", found[0]);
    }
}

#[test]
fn mistakes_are_named_with_their_line() {
    let cut = &FILE[..FILE.len() - 3];
    let cases: [(&[u8], &str, &str); 22] = [
        (FILE.as_bytes(), "", "curve.usda:1: there are several curves, name one with `prim`: /World/turned/cable, /World/moving"),
        (FILE.as_bytes(), ", prim = \"/World\"", "curve.usda:1: there are no curves at /World; there are /World/turned/cable,"),
        (FILE.as_bytes(), ", prim = \"/World/turned/cable\"", "has 2 curves, give the number of one as `curve`"),
        (FILE.as_bytes(), ", prim = \"/World/turned/cable\", curve = 2", "there is no curve 2: /World/turned/cable has 2"),
        (FILE.as_bytes(), ", prim = \"/World/moving\"", "/World/moving is periodic: say `closed = true`"),
        (FILE.as_bytes(), ", prim = 1", "prim = 1, but it must be"),
        (FILE.as_bytes(), ", curve = -1", "curve = -1, but it must be a whole number from 0"),
        (cut.as_bytes(), "", "a `}` is missing at the end of the file"),
        (b"PXR-USDC\0\0", "", "curve.usda:1: this is a binary USD file; save it as text"),
        (b"#usda 1.0\n", "", "curve.usda:1: there is no prim of type BasisCurves"),
        (b"#usda 1.0\ndef Xform \"a\" {\n double x = [1, 2\n}\n", "", "curve.usda:4: `,` must stand here, not `}`"),
        (b"#usda 1.0\ndef Xform \"a\" {\n string x = \"1\n}\n", "", "curve.usda:3: this text is not closed"),
        (b"#usda 1.0\n( upAxis = \"X\" )\n", "", "curve.usda:2: upAxis must be \"Y\" or \"Z\""),
        (b"#usda 1.0\n( metersPerUnit = 0 )\n", "", "curve.usda:2: metersPerUnit must be > 0"),
        (b"#usda 1.0\ndef 5\n", "", "a prim must have a name"),
        (b"x_m,y_m,z_m\n0,0,0\n1,0,0\n", ", prim = \"/a\"", "shape.usd.prim: goes with a USD file as text"),
        (b"\xff\xfe", "", "curve.usda:1: this is no"),
        (b"#usda 1.0\ndef BasisCurves \"c\" {\n int[] curveVertexCounts = [2]\n}\n", "", "curves of type cubic are not read (/c)"),
        (
            b"#usda 1.0\ndef BasisCurves \"c\" {\n uniform token type = \"linear\"\n int[] curveVertexCounts = [3]\n point3f[] points = [(0,0,0)]\n}\n",
            "",
            "curve.usda:5: /c has 1 points, but curveVertexCounts has others",
        ),
        (
            b"#usda 1.0\ndef BasisCurves \"c\" {\n uniform token type = \"linear\"\n int[] curveVertexCounts = [2]\n point3f[] points = [(0,0,0), (0, nan, 1)]\n}\n",
            "",
            "curve.usda:5: points must be three finite numbers each",
        ),
        (
            b"#usda 1.0\ndef Xform \"a\" {\n uniform token[] xformOpOrder = [\"!resetXformStack!\"]\n}\n",
            "",
            "curve.usda:3: !resetXformStack! in xformOpOrder is not read",
        ),
        (
            b"#usda 1.0\ndef Xform \"a\" {\n float xformOp:shear = 2\n uniform token[] xformOpOrder = [\"xformOp:shear\"]\n}\n",
            "",
            "curve.usda:3: the transform xformOp:shear is not read",
        ),
    ];
    for (file, keys, expected) in cases {
        let error = with_file(file, keys).map(|_| ()).unwrap_err();
        assert!(error.contains(expected), "{expected}: {error}");
        assert!(!error.contains('\n'), "{error}");
    }
}

/// Cut off or changed anywhere, a file is refused or read, without a panic.
#[test]
fn a_mangled_file_never_panics() {
    let load = |file: &[u8]| drop(with_file(file, ", prim = \"/World/moving\", closed = true"));
    for end in (0..FILE.len()).step_by(2) {
        load(&FILE.as_bytes()[..end]);
        for sign in *b"({\"@" {
            let mut changed = FILE.as_bytes().to_vec();
            changed[end] = sign;
            load(&changed);
        }
    }
    for nested in ["[", "(", "def Xform \"a\" {\n", "{"] {
        load(format!("#usda 1.0\ndef Xform \"a\" {{\n double x = {}", nested.repeat(100_000)).as_bytes());
        load(format!("#usda 1.0\n{}", nested.repeat(100_000)).as_bytes());
    }
}

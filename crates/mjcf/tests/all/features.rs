//! What is read, one thing at a time: the scene that a file becomes, read by the reader of scenes.

use std::f64::consts::PI;
use std::path::Path;

use cosserat::scene::{self, Scene};
use mjcf::Converted;

/// A file of ours: a cable that is clamped at its start, over a floor.
const CABLE: &str = include_str!("../../examples/boom.xml");

/// The entries of the plugin.
const PLUGIN: &str = r#"<plugin plugin="mujoco.elasticity.cable"><config key="twist" value="1e7"/><config key="bend" value="4e6"/></plugin>"#;

fn converted(text: &str) -> Converted {
    mjcf::convert(text, Path::new("x.xml")).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// The scene that a text becomes.
fn scene_of(text: &str) -> Scene {
    let toml = converted(text).toml;
    scene::parse(&toml, "x.xml").unwrap_or_else(|error| panic!("{error}\n{toml}"))
}

/// A file with this in its world, and this after it.
fn model(world: &str, after: &str) -> String {
    format!("<mujoco><worldbody>{world}</worldbody>{after}</mujoco>")
}

/// A cable of 10 segments along x from the origin, 1 m long, with these attributes and this geom.
fn cable(attributes: &str, geom: &str) -> String {
    format!("<composite type=\"cable\" curve=\"s\" count=\"11 1 1\" size=\"1\" {attributes}>{PLUGIN}{geom}</composite>")
}

const CAPSULE: &str = "<geom type=\"capsule\" size=\"0.005\" contype=\"0\" conaffinity=\"0\"/>";

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * b.abs().max(1e-9)
}

#[test]
fn a_file_becomes_this_text() {
    let Converted { toml, warnings, .. } = mjcf::convert(CABLE, Path::new("files/cable.xml")).expect("right");
    assert_eq!(toml, include_str!("cable.toml"));
    assert_eq!(
        warnings,
        [
            "files/cable.xml:18: <joint>: armature, an inertia of the joints, is left out: motions are faster, rest is the same",
            "files/cable.xml:4: of no use here, and left out: option integrator, light, vmax (colours)",
        ]
    );
    scene::parse(&toml, "cable.toml").expect("a scene");
}

/// A line of the scene tells the element that it is from.
#[test]
fn lines_know_their_elements() {
    let converted = converted(CABLE);
    let line = converted.toml.lines().position(|line| line.starts_with("youngs_modulus_pa")).expect("a modulus") + 1;
    assert_eq!(converted.origin(line), Some("x.xml:12: <composite prefix=\"boom_\">"));
    assert_eq!((converted.origin(1), converted.origin(0), converted.origin(10_000)), (None, None, None));
}

/// Segments weigh what MuJoCo's geoms weigh, round ends included, and what they give as their mass.
#[test]
fn masses_are_those_of_the_geoms() {
    let (r, l) = (0.005, 0.1);
    let round = PI * r * r * l + 4.0 / 3.0 * PI * r * r * r;
    for (geom, mass) in [
        ("<geom type=\"capsule\" size=\"0.005\"/>", 1000.0 * round),
        ("<geom type=\"capsule\" size=\"0.005\" density=\"500\"/>", 500.0 * round),
        ("<geom type=\"cylinder\" size=\"0.005\"/>", 1000.0 * PI * r * r * l),
        ("<geom type=\"capsule\" size=\"0.005\" mass=\"0.03\"/>", 0.03),
        ("<geom type=\"box\" size=\"1 0.02 0.001\"/>", 1000.0 * 0.04 * 0.002 * l),
    ] {
        let scene = scene_of(&model(&cable("initial=\"none\"", geom), ""));
        for segment in &scene.model.segments {
            assert!(near(segment.mass(), mass), "{geom}: {} {mass}", segment.mass());
        }
    }
}

/// The moment that a joint's damping exerts is stiffness times relaxation time.
#[test]
fn damping_becomes_a_relaxation_time() {
    let geom = "<joint kind=\"main\" damping=\"0.02\"/><geom type=\"capsule\" size=\"0.005\"/>";
    let toml = converted(&model(&cable("initial=\"none\"", geom), "")).toml;
    let second_moment = PI * 0.005_f64.powi(4) / 4.0;
    let [bending, twist] = [0.02 * 0.1 / (4e6 * second_moment), 0.02 * 0.1 / (1e7 * 2.0 * second_moment)];
    let line = toml.lines().find(|line| line.starts_with("inner_damping")).expect("damping");
    let numbers: Vec<f64> = line.split([' ', ',']).filter_map(|word| word.parse().ok()).collect();
    assert!(near(numbers[0], bending) && near(numbers[1], twist), "{line}: {bending} {twist}");
}

/// Functions of s, vertices, and where a body puts them.
#[test]
fn curves_are_where_mujoco_has_them() {
    let helix = r#"<composite type="cable" prefix="h" curve="cos(s) sin(s) s" count="41" size="0.25 0.1 4" offset="1 0 0" initial="free">"#;
    let scene = scene_of(&model(&format!("{helix}{PLUGIN}{CAPSULE}</composite>"), ""));
    assert_eq!((scene.rods[0].name.as_str(), scene.model.segments.len()), ("h", 40));
    let node = |k: f64| {
        let angle = 4.0 * PI * k / 40.0;
        [1.0 + 0.1 * angle.cos(), 0.1 * angle.sin(), 0.25 * k / 40.0]
    };
    for (k, centre) in scene.state.positions.iter().enumerate() {
        for axis in 0..3 {
            let middle = 0.5 * (node(k as f64)[axis] + node(k as f64 + 1.0)[axis]);
            assert!((centre[axis] - middle).abs() < 1e-9, "{k} {axis}: {centre}");
        }
    }
    // Turns about axes that turn along: x of the body is z of the world.
    let body = "<body pos=\"1 2 3\" euler=\"90 0 90\">";
    let scene = scene_of(&model(&format!("{body}{}</body>", cable("initial=\"none\"", CAPSULE)), ""));
    let (first, last) = (scene.state.positions[0], scene.state.positions[9]);
    assert!((last - first).normalize().z > 1.0 - 1e-9, "{first} {last}");
    assert!((first.x - 1.0).abs() < 1e-9 && (first.y - 2.0).abs() < 1e-9 && (first.z - 3.05).abs() < 1e-9);
}

/// The broad side of a belt lies along the second of its half sizes.
#[test]
fn boxes_lie_as_they_do_in_mujoco() {
    let belt = r#"<composite type="cable" vertex="0 0 0 0.1 0 0.1 0.2 0 0.2 0.3 0 0.1" initial="none">"#;
    let geom = r#"<geom type="box" size="0.07 0.02 0.001"/>"#;
    let toml = converted(&model(&format!("{belt}{PLUGIN}{geom}</composite>"), "")).toml;
    assert!(
        toml.contains("section.rectangle = { width_m = 0.04, height_m = 0.002 }\nframe.d1 = [0.0, 1.0, 0.0]\n"),
        "{toml}"
    );
    assert!(toml.contains("bending = \"rest-rotation\"\n") && !toml.contains("rest = \"straight\""), "{toml}");
    // Where it bends at its first joint, that side lies towards the bend.
    let bent = belt.replace("0.2 0 0.2", "0.2 0.1 0.1");
    let toml = converted(&model(&format!("{bent}{PLUGIN}{geom}</composite>"), "")).toml;
    let normal = toml.lines().find_map(|line| line.strip_prefix("frame.d1 = ")).expect("a frame");
    // Tangents (1, 0, 1) and (1, 1, 0): the second across the first is (1, 2, -1) / 2.
    let numbers: Vec<f64> = normal.split(['[', ',', ']', ' ']).filter_map(|word| word.parse().ok()).collect();
    for (own, right) in numbers.iter().zip([1.0, 2.0, -1.0]) {
        assert!((own - right / 6.0_f64.sqrt()).abs() < 1e-9, "{normal}");
    }
    let flat = PLUGIN.replace("</plugin>", "<config key=\"flat\" value=\"true\"/></plugin>");
    let toml = converted(&model(&format!("{belt}{flat}{geom}</composite>"), "")).toml;
    assert!(toml.contains("rest = \"straight\"\n") && !toml.contains("rest-rotation"), "{toml}");
}

/// Classes, the class of a body, what an element says itself; degrees and radians; instances of the plugin; includes.
#[test]
fn sections_are_put_together() {
    let folder = tempfile::tempdir().expect("a folder");
    let floor = r#"<mujoco><worldbody><geom name="floor" type="plane" size="0 0 1" condim="1"/></worldbody></mujoco>"#;
    std::fs::write(folder.path().join("floor.xml"), floor).expect("a file");
    let text = r#"<mujoco>
  <include file="floor.xml"/>
  <compiler angle="radian"/>
  <default>
    <geom rgba="1 0 0 1"/>
    <default class="thin"><geom size="0.002" type="capsule" friction="0.3"/></default>
    <default class="thick"><geom size="0.1"/></default>
  </default>
  <extension><plugin plugin="mujoco.elasticity.cable"><instance name="steel">
    <config key="twist" value="8e10"/><config key="bend" value="2e11"/>
  </instance></plugin></extension>
  <worldbody>
    <body childclass="thin" pos="0 0 1" euler="0 0 1.5707963267948966">
      <composite type="cable" curve="s" count="5" size="1" initial="ball"><plugin instance="steel"/><geom size="0.003"/></composite>
      <geom class="thick" pos="1 0 -0.5"/>
    </body>
  </worldbody>
</mujoco>"#;
    let converted = mjcf::convert(text, &folder.path().join("x.xml")).expect("right");
    let toml = &converted.toml;
    for part in [
        "name = \"floor\"\nshape.plane = { point_m = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }\nfriction = 1.0\n",
        "shape.sphere = { centre_m = [0.0, 1.0, 0.5], radius_m = 0.1 }\nfriction = 1.0\n",
        "direction = [0.0, 1.0, 0.0]",
        "radius_m = 0.003\nyoungs_modulus_pa = 200000000000.0\ntorsion_modulus_pa = 80000000000.0\n",
        "[[rods.grips]]\nat = \"start-face\"\njoint = \"ball\"\n",
    ] {
        assert!(toml.contains(part), "{part}\n{toml}");
    }
    scene::parse(toml, "x.xml").expect("a scene");
}

/// Every shape of an obstacle, moved and turned by its body.
#[test]
fn obstacles() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::create_dir(folder.path().join("parts")).expect("a folder");
    let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
    std::fs::write(folder.path().join("parts/hook.obj"), mesh).expect("a mesh");
    let text = format!(
        r#"<mujoco><compiler meshdir="parts"/><asset><mesh file="hook.obj" scale="0.1 0.1 0.1"/></asset><worldbody>
        {}
        <body pos="0 5 0" quat="0.7071067811865476 0 0.7071067811865476 0">
          <geom name="a" size="0.1"/>
          <geom name="b" type="capsule" size="0.1 0.5"/>
          <geom name="c" type="cylinder" size="0.1" fromto="0 0 0 0 0 2"/>
          <geom name="d" type="box" size="0.1 0.2 0.3" friction="0.25"/>
          <geom name="e" type="mesh" mesh="hook"/>
          <geom name="f" size="0.1" contype="0" conaffinity="0"/>
        </body></worldbody></mujoco>"#,
        cable("initial=\"none\"", "<geom type=\"capsule\" size=\"0.005\" friction=\"0.5\"/>")
    );
    let path = folder.path().join("x.xml");
    let converted = mjcf::convert(&text, &path).expect("right");
    let scene = scene::parse(&converted.toml, path.to_str().expect("UTF-8")).expect(&converted.toml);
    assert_eq!(scene.obstacles, ["a", "b", "c", "d", "e"]);
    for part in [
        "shape.sphere = { centre_m = [0.0, 5.0, 0.0], radius_m = 0.1 }\nfriction = 1.0",
        "shape.capsule = { start_m = [-0.5, 5.0, 0.0], end_m = [0.5, 5.0, 0.0], radius_m = 0.1 }",
        "shape.box = { sides_m = [0.2, 0.4, 0.6], centre_m = [0.0, 5.0, 0.0], orientation = [0.707106781187, 0.0, 0.707106781187, 0.0] }\nfriction = 0.5",
        "shape.mesh = { file = \"parts/hook.obj\", scale = 0.1, position_m = [0.0, 5.0, 0.0]",
        "[contact]\nfriction = 0.5\n",
    ] {
        assert!(converted.toml.contains(part), "{part}\n{}", converted.toml);
    }
    assert!(converted.warnings.iter().any(|warning| warning.contains("<geom name=\"f\">: touches nothing that moves")));
}

/// Constraints, and what holds a cable.
#[test]
fn grips() {
    let ends = |body: &str, constraint: &str| {
        let world = format!("{}{body}", cable("initial=\"ball\"", CAPSULE));
        converted(&model(&world, &format!("<equality>{constraint}</equality>"))).toml
    };
    let has = |toml: &str, part: &str| {
        assert!(toml.contains(part), "{part}\n{toml}");
        scene::parse(toml, "x.xml").unwrap_or_else(|error| panic!("{error}\n{toml}"));
    };
    let pinned = "[[rods.grips]]\nat = \"end-face\"\njoint = \"ball\"\n";
    has(&ends("", "<connect body1=\"B_last\" anchor=\"0.1 0 0\"/>"), pinned);
    let hand = "<body name=\"hand\" mocap=\"true\" pos=\"1 0 0\"/>";
    has(&ends(hand, "<connect body1=\"B_last\" body2=\"hand\" anchor=\"0.1 0 0\"/>"), pinned);
    has(&ends(hand, "<connect body1=\"hand\" body2=\"B_last\" anchor=\"0 0 0\"/>"), pinned);
    has(&ends(hand, "<weld body1=\"hand\" body2=\"B_last\"/>"), "clamp = [\"end-segment\"]\n");
    has(&ends(hand, "<weld body1=\"B_4\" body2=\"hand\"/>"), "fixed_segments = [4]\n");
    let post = ends("", "<connect name=\"post\" body1=\"B_4\" anchor=\"0.05 0 0\"/>");
    has(
        &post,
        "[[joins]]\na = { rod = \"cable\", segment = 4, fraction = 0.5 }\nb = { rod = \"post\", segment = 0, fraction = 0.5 }\njoint = \"ball\"\n",
    );
    assert!(!ends("", "<connect body1=\"B_last\" anchor=\"0.1 0 0\" active=\"false\"/>").contains("end-face"));

    // A body on a slide with a spring, and one that hangs on the cable.
    let slider = "<body name=\"car\" pos=\"1 0 0\"><joint name=\"rail\" type=\"slide\" axis=\"0 2 0\"/><geom size=\"0.01\" mass=\"2\"/></body>";
    let world = format!("{}{slider}", cable("initial=\"ball\"", CAPSULE));
    let after = "<equality><connect body1=\"B_last\" body2=\"car\" anchor=\"0.1 0 0\"/></equality>";
    let free = converted(&model(&world, after)).toml;
    has(
        &free,
        "name = \"car\"\nshape.straight = { start_m = [1.0, -0.005, 0.0], direction = [0.0, 1.0, 0.0], length_m = 0.01, segments = 1 }\n",
    );
    has(&free, "stiffness_n_m = [inf, 1e-6]");
    let servo = format!("{after}<actuator><position joint=\"rail\" kp=\"100\" gear=\"2 0 0 0 0 0\"/></actuator>");
    has(&converted(&model(&world, &servo)).toml, "stiffness_n_m = [inf, 400.0]");
    let scene = scene_of(&model(&world, after));
    assert!(near(scene.model.segments[10].mass(), 2.0), "{}", scene.model.segments[10].mass());

    let weight =
        "<body name=\"weight\" pos=\"1.1 0 0\"><freejoint/><geom type=\"box\" size=\"0.1 0.1 0.1\" mass=\"3\"/></body>";
    let hung = ends(weight, "<weld body1=\"B_last\" body2=\"weight\"/>");
    has(&hung, "[[joins]]\na = { rod = \"cable\", segment = 9, fraction = 1.0 }\nb = { body = \"weight\" }\n");
    // A cable in a body.
    let inside = format!(
        "<body name=\"drone\" pos=\"0 0 4\"><freejoint/><geom size=\"0.1\"/>{}</body>",
        cable("initial=\"none\" offset=\"0.1 0 0\"", CAPSULE)
    );
    let toml = converted(&model(&inside, "")).toml;
    has(&toml, "branch_of = { body = \"drone\", at_m = [0.1, 0.0, 0.0] }\n");
}

/// Friction is the larger of both, none where both are frictionless, and that of whoever has priority; pairs that do not touch.
#[test]
fn contacts() {
    let friction = |floor: &str, own: &str, option: &str| {
        let geom = format!("<geom type=\"capsule\" size=\"0.005\" {own}/>");
        let world = format!("<geom name=\"floor\" type=\"plane\" {floor}/>{}", cable("offset=\"0 0 1\"", &geom));
        let scene = scene_of(&model(&world, option));
        let own = scene.model.contacts.between_segments.map(|surface| surface.friction.at_rest);
        (scene.model.contacts.obstacles.first().map(|obstacle| obstacle.surface.friction.at_rest), own)
    };
    assert_eq!(friction("", "", ""), (Some(1.0), Some(1.0)));
    assert_eq!(friction("friction=\"0.2\"", "friction=\"0.5 0.1 0.1\"", ""), (Some(0.5), Some(0.5)));
    assert_eq!(friction("friction=\"0.2\" priority=\"1\"", "friction=\"0.5\"", ""), (Some(0.2), Some(0.5)));
    assert_eq!(friction("condim=\"1\"", "condim=\"1\"", ""), (Some(0.0), Some(0.0)));
    assert_eq!(friction("condim=\"3\"", "condim=\"1\"", ""), (Some(1.0), Some(0.0)));
    assert_eq!(friction("contype=\"2\" conaffinity=\"2\"", "contype=\"2\" conaffinity=\"4\"", ""), (Some(1.0), None));
    assert_eq!(friction("contype=\"2\" conaffinity=\"2\"", "", ""), (None, Some(1.0)));
    assert_eq!(friction("", "", "<option><flag contact=\"disable\"/></option>"), (None, None));
}

#[test]
fn options() {
    let options = r#"<option timestep="0.004" gravity="0 -1 0" density="1.2" wind="3 0 0"/>"#;
    let scene = scene_of(&model(&cable("", CAPSULE), options));
    assert_eq!((scene.run.dt, scene.run.steps, scene.run.every), (0.004, 1250, 5));
    assert_eq!(scene.model.gravity.y, -1.0);
    assert!(scene.model.air.is_some());
    let none = scene_of(&model(&cable("", CAPSULE), "<option><flag gravity=\"disable\"/></option>"));
    assert_eq!(none.model.gravity.norm(), 0.0);
}

/// The first section of defaults is that of all elements that name no class, whatever it is called.
#[test]
fn the_class_of_all_may_have_any_name() {
    let world = cable("initial=\"none\"", "<geom type=\"capsule\" size=\"0.005\"/>");
    let text = format!(
        "<mujoco><default class=\"robot\"><geom density=\"500\"/><default class=\"other\"><geom density=\"7\"/></default>\
         </default><worldbody>{world}</worldbody></mujoco>"
    );
    let [with, without] = [scene_of(&text), scene_of(&model(&world, ""))].map(|scene| scene.model.segments[3].mass());
    assert!(near(with, 0.5 * without), "{with} {without}");
}

/// A mesh that moves freely has its centre of mass where the file says.
#[test]
fn a_mesh_has_the_centre_of_mass_that_is_given() {
    let folder = tempfile::tempdir().expect("a folder");
    let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
    std::fs::write(folder.path().join("hook.obj"), mesh).expect("a mesh");
    let text = format!(
        r#"<mujoco><asset><mesh file="hook.obj" scale="0.1 0.1 0.1"/></asset><worldbody>{}
        <body pos="0 5 0"><freejoint/><inertial pos="0.01 0.02 0.03" mass="0.2" diaginertia="1e-4 1e-4 1e-4"/>
          <geom name="e" type="mesh" mesh="hook"/></body></worldbody></mujoco>"#,
        cable("initial=\"none\"", CAPSULE)
    );
    let path = folder.path().join("x.xml");
    let converted = mjcf::convert(&text, &path).expect("right");
    let scene = scene::parse(&converted.toml, path.to_str().expect("UTF-8")).expect(&converted.toml);
    let body = scene.model.segments.iter().position(|segment| segment.body.is_some()).expect("a body");
    let centre = scene.state.positions[body];
    assert!((centre - nalgebra::Vector3::new(0.01, 5.02, 0.03)).norm() < 1e-9, "{centre}");
}

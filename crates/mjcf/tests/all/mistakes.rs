//! Mistakes, and what a scene cannot express: one error that names file, line, element, attribute, value and what is allowed.

use std::path::Path;

/// A cable that is clamped at its start.
const BASE: &str = r#"<mujoco model="base">
  <option timestep="0.002"/>
  <worldbody>
    <geom type="plane" size="0 0 1"/>
    <composite type="cable" curve="s" count="11 1 1" size="1" offset="0 0 1" initial="none">
      <plugin plugin="mujoco.elasticity.cable">
        <config key="twist" value="1e7"/>
        <config key="bend" value="4e6"/>
      </plugin>
      <joint kind="main" damping="0.01"/>
      <geom type="capsule" size="0.005"/>
    </composite>
  </worldbody>
</mujoco>
"#;

/// The error of the base with `from` replaced by `to`.
fn error(from: &str, to: &str) -> String {
    assert!(BASE.contains(from), "{from}");
    let text = BASE.replacen(from, to, 1);
    mjcf::convert(&text, Path::new("x.xml")).expect_err(to).to_string()
}

#[test]
fn the_base_is_right() {
    mjcf::convert(BASE, Path::new("x.xml")).expect("right");
}

#[test]
fn values() {
    let end = "  </worldbody>\n";
    for (from, to, expected) in [
        ("0.002", "-1", "x.xml:2: <option> timestep = \"-1\", but it must be > 0 [s]"),
        ("0.002", "fast", "x.xml:2: <option> timestep = \"fast\", but it must be finite numbers, 1e30 in size at most"),
        ("\"0.005\"", "\"0\"", "x.xml:11: <geom> size = \"0\", but it must be > 0 [m]"),
        ("\"4e6\"", "\"0\"", "x.xml:8: <config key=\"bend\"> value = \"0\", but it must be > 0 [Pa]"),
        (
            "key=\"bend\"",
            "key=\"bent\"",
            "x.xml:8: <config key=\"bent\"> key = \"bent\", but it must be twist, bend, flat or vmax",
        ),
        (
            "\"11 1 1\"",
            "\"1 1 1\"",
            "x.xml:5: <composite> count = \"1 1 1\", but it must be a whole number from 2 to 1000001, followed by ones",
        ),
        (
            "curve=\"s\"",
            "curve=\"tan(s)\"",
            "x.xml:5: <composite> curve = \"tan(s)\", but it must be one to three of s, cos(s), sin(s), 0",
        ),
        ("curve=\"s\"", "curve=\"0\"", "x.xml:5: <composite>: vertices 0 and 1 are at one place"),
        ("type=\"cable\"", "type=\"grid\"", "x.xml:5: <composite> type = \"grid\", but it must be cable"),
        (
            "initial=\"none\"",
            "initial=\"nine\"",
            "x.xml:5: <composite> initial = \"nine\", but it must be free, ball or none",
        ),
        (
            "initial=\"none\"",
            "intial=\"none\"",
            "x.xml:5: <composite> intial = \"none\", but this attribute is not read; read are type, prefix, count, offset, size, vertex, curve, initial",
        ),
        (
            "type=\"capsule\"",
            "type=\"sphere\"",
            "x.xml:11: <geom> type = \"sphere\", but it must be capsule, cylinder, box",
        ),
        (
            "mujoco.elasticity.cable",
            "mujoco.elasticity.shell",
            "x.xml:6: <plugin> plugin = \"mujoco.elasticity.shell\", but it must be mujoco.elasticity.cable",
        ),
        (
            "damping=\"0.01\"",
            "stiffness=\"3\"",
            "x.xml:10: <joint> stiffness = \"3\", but it must be 0: say it by bend and twist of the plugin",
        ),
        (
            "damping=\"0.01\"",
            "frictionloss=\"3\"",
            "x.xml:10: <joint> frictionloss = \"3\", but it must be 0: joints without dry friction are read",
        ),
        (
            end,
            "    <body name=\"b\"><joint/><geom size=\"1\"/></body>\n  </worldbody>\n",
            "x.xml:13: <joint>: a hinge: free and slide joints of bodies are read",
        ),
        (end, "    <freejoint/>\n  </worldbody>\n", "x.xml:13: <freejoint>: is of bodies, and the world is none"),
        (end, "    <flexcomp/>\n  </worldbody>\n", "x.xml:13: <flexcomp>: is not read"),
        (end, "  </worldbody><tendon><spatial/></tendon>\n", "x.xml:13: <spatial>: tendons are not read"),
        (
            end,
            "  </worldbody><equality><connect body1=\"B_lost\" anchor=\"0 0 0\"/></equality>\n",
            "x.xml:13: <connect> body1 = \"B_lost\", but there is no body of that name",
        ),
        (
            end,
            "  </worldbody><equality><connect body1=\"B_last\" anchor=\"0 0 0.05\"/></equality>\n",
            "x.xml:13: <connect>: lies 5.000e-2 m off the cable's segment, but must be on its axis",
        ),
        (
            end,
            "  </worldbody><equality><joint joint1=\"J_1\"/></equality>\n",
            "x.xml:13: <joint>: connect and weld are read of <equality>",
        ),
        (
            end,
            "  </worldbody><actuator><muscle joint=\"J_1\"/></actuator>\n",
            "x.xml:13: <muscle>: motor, position and velocity are read of <actuator>",
        ),
        (
            end,
            "  </worldbody><actuator><motor site=\"S_last\" ctrlrange=\"1 2\"/></actuator>\n",
            "x.xml:13: <motor> ctrlrange = \"1 2\", but it must be a range with 0: control is 0 here",
        ),
        (
            end,
            "  </worldbody><contact><pair geom1=\"a\" geom2=\"b\"/></contact>\n",
            "x.xml:13: <pair>: is not read: scenes have one friction for each obstacle",
        ),
        (
            end,
            "  </worldbody><include file=\"none.xml\"/>\n",
            "cannot read none.xml (that x.xml:13: <include> names): No such file or directory (os error 2)",
        ),
        (
            "type=\"plane\"",
            "type=\"ellipsoid\"",
            "x.xml:4: <geom> type = \"ellipsoid\", but it must be plane, sphere, capsule, cylinder, box or mesh",
        ),
        (
            "<geom type=\"plane\" size=\"0 0 1\"/>",
            "<geom class=\"soft\" type=\"plane\"/>",
            "x.xml:4: <geom>: there is no class \"soft\"",
        ),
        (
            "<geom type=\"plane\" size=\"0 0 1\"/>",
            "<geom type=\"mesh\" mesh=\"hook\"/>",
            "x.xml:4: <geom> mesh = \"hook\", but it must be the name of a <mesh> in <asset>",
        ),
        (
            "0.002\"",
            "0.002\" viscosity=\"1\"",
            "x.xml:2: <option> viscosity = \"1\", but it must be 0: scenes have drag that grows with the square of the speed alone",
        ),
        ("<mujoco model=\"base\">", "<robot>", "x.xml:14: not valid XML: expected 'robot' tag, not 'mujoco' at 14:1"),
    ] {
        assert_eq!(error(from, to), expected);
    }
}

#[test]
fn texts_that_are_no_models() {
    for (text, expected) in [
        ("", "x.xml:1: not valid XML: "),
        ("<robot name=\"arm\"/>", "x.xml:1: <robot name=\"arm\">: is URDF; save it from MuJoCo as MJCF"),
        ("<mujoco/>", "x.xml:1: <mujoco>: has neither a cable nor a body that moves"),
        (
            "<mujoco><worldbody><geom type=\"plane\"/></worldbody></mujoco>",
            "x.xml:1: <mujoco>: has neither a cable nor a body that moves",
        ),
    ] {
        let error = mjcf::convert(text, Path::new("x.xml")).expect_err(text).to_string();
        assert!(error.starts_with(expected), "{error}");
    }
    // However deep elements lie in one another, the stack holds.
    let deep = format!("<mujoco>{}{}</mujoco>", "<body>".repeat(100_000), "</body>".repeat(100_000));
    let error = mjcf::convert(&deep, Path::new("x.xml")).expect_err("deep").to_string();
    assert_eq!(error, "x.xml:1: <body>: lies deeper than 200 elements");
}
